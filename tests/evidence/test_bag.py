"""Bags: those of other tools are read whole or refused on one line, and evidence is written as one."""

from __future__ import annotations

import json
import random
import struct
import subprocess
from pathlib import Path

import pytest

from grader.cli.main import run as grader
from grader.errors import EvidenceError, OutputError
from grader.evidence import bag
from grader.evidence.bag import export_bag
from grader.evidence.reader import load_evidence, load_run
from grader.evidence.run import Run
from tests.evidence.bags import BZ2, CHATTER, COUNT, LZ4, Topic, mcap_bytes, write_bag
from tests.evidence.samples import sample


def refused(path: Path) -> str:
    with pytest.raises(EvidenceError) as caught:
        load_evidence([path])
    assert "\n" not in caught.value.message
    return caught.value.message


@pytest.mark.parametrize("compression", [None, BZ2, LZ4])
def test_a_bag_loads_whatever_its_compression(tmp_path, compression):
    run = load_run(write_bag(tmp_path / "lab.bag", CHATTER, COUNT, compression=compression))
    assert (run.foreign, run.scenario, run.clock) == (True, "lab", "real")
    assert {c.topic: c.data for c in run.channels} == {
        "/chatter": tuple(CHATTER.values), "/numeric_chatter": tuple(COUNT.values)
    }  # fmt: skip
    assert [m.sequence for m in run.channels[1].messages] == list(range(300))


def test_a_publisher_that_connected_twice_is_one_channel(tmp_path):
    again = COUNT._replace(start_s=30.0)
    first, second = (load_run(p).channels for p in (
        write_bag(tmp_path / "a.bag", COUNT, again._replace(latching=True)),
        write_bag(tmp_path / "b.bag", COUNT, again._replace(callerid="/other")),
    ))  # fmt: skip
    assert [(len(c.messages), c.latching) for c in first] == [(600, True)]
    assert [m.sequence for m in first[0].messages] == list(range(600))
    assert [c.callerid for c in second] == ["/talker", "/other"]


def test_a_bag_that_does_not_know_its_publishers(tmp_path):
    (channel,) = load_run(write_bag(tmp_path / "lab.bag", COUNT._replace(callerid=None))).student_channels()
    assert (channel.callerid, channel.publisher) == ("", "an unnamed node")


def test_mcap_messages_are_counted_by_channel(tmp_path):
    (tmp_path / "lab.mcap").write_bytes(mcap_bytes(CHATTER, COUNT, metadata=False))
    run = load_run(tmp_path / "lab.mcap")
    assert [[m.sequence for m in c.messages[:3]] for c in run.channels] == [[0, 1, 2], [0, 1, 2]]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"profile": "", "encoding": "protobuf"}, "no message of ROS in it, only protobuf"),
        ({"profile": "ros2", "encoding": "cdr", "schema": "ros2idl"}, "no message definition (ros2msg)"),
        ({"schema": "jsonschema"}, "/numeric_chatter has no message definition"),
    ],
)
def test_what_is_not_of_ros_is_refused(tmp_path, options, reason):
    (tmp_path / "lab.mcap").write_bytes(mcap_bytes(COUNT, **options))
    assert reason in refused(tmp_path / "lab.mcap")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "empty"),
        (b"#ROSBAG V1.2\n" + b"\0" * 100, "another format than 2.0"),
        (b"#ROSBAG V2.0\n", "damaged or cut short"),
        (b"SQLite format 3\0" + b"\0" * 100, "ROS 2"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS"),
        (b"hello", "not an MCAP file and not a bag"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path, content, reason):
    (tmp_path / "lab.bag").write_bytes(content)
    assert reason in refused(tmp_path / "lab.bag")


def test_a_recording_without_messages_is_refused(tmp_path):
    assert "holds no messages" in refused(write_bag(tmp_path / "a.bag", Topic("/n", "std_msgs/Int8", [])))
    (tmp_path / "b.mcap").write_bytes(mcap_bytes())
    assert "holds no messages" in refused(tmp_path / "b.mcap")


def test_a_recording_that_was_not_ended_has_no_index(tmp_path):
    path = write_bag(tmp_path / "lab.bag", COUNT)
    data = path.read_bytes()
    at = data.index(b"index_pos=") + len(b"index_pos=")
    path.write_bytes(data[:at] + struct.pack("<Q", 0) + data[at + 8 :])
    assert "cut short: it has no index" in refused(path)


@pytest.mark.full
@pytest.mark.parametrize("compression", [None, BZ2, LZ4])
def test_cut_or_damaged_anywhere_it_is_refused_or_harmless(tmp_path, compression):
    whole = write_bag(tmp_path / "whole.bag", CHATTER, COUNT, compression=compression).read_bytes()
    path = tmp_path / "lab.bag"
    for cut in (*range(0, 200, 13), *range(200, len(whole), len(whole) // 60)):
        path.write_bytes(whole[:cut])
        assert refused(path)
    rng = random.Random(1)  # noqa: S311 - a fixed choice of places
    for _ in range(200):
        damaged = bytearray(whole)
        damaged[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        path.write_bytes(damaged)
        try:
            run = load_run(path)
        except EvidenceError as error:
            assert "\n" not in error.message  # noqa: PT017 - either outcome is fine
        else:
            assert sum(len(c.messages) for c in run.channels) <= 600


@pytest.mark.parametrize("compression", [BZ2, LZ4])
def test_a_chunk_that_blows_up_is_refused(tmp_path, monkeypatch, compression):
    big = Topic("/big", "std_msgs/String", ["x" * (3 << 20)])
    path = write_bag(tmp_path / "lab.bag", big, big._replace(topic="/again"), compression=compression)
    assert path.stat().st_size < 1 << 20
    monkeypatch.setattr(bag, "MAX_CHUNK_BYTES", 1 << 20)
    assert "a chunk of more than 1 MiB" in refused(path)
    monkeypatch.undo()
    monkeypatch.setattr(bag, "MAX_UNPACKED_BYTES", 4 << 20)
    assert "more than 4 MiB unpacked" in refused(path)


def test_too_many_messages_or_connections_are_refused(tmp_path, monkeypatch):
    path = write_bag(tmp_path / "lab.bag", CHATTER, COUNT)
    monkeypatch.setattr(bag, "MAX_RECORDS", 10)
    assert "more than 10 records" in refused(path)
    monkeypatch.undo()
    monkeypatch.setattr(bag, "MAX_CONNECTIONS", 1)
    assert "more than 1 connections" in refused(path)


def test_a_folder_stands_for_its_bags_too(tmp_path):
    (tmp_path / "evidence").mkdir()
    write_bag(tmp_path / "evidence" / "lab.bag", COUNT)
    assert list(load_evidence([tmp_path])) == ["lab"]


WRITE = """
import sys, rosbag, rospy
from std_msgs.msg import Int8
with rosbag.Bag(sys.argv[1], "w", compression=sys.argv[2], chunk_threshold=2000) as bag:
    for n in range(300):
        bag.write("/n", Int8(n % 128), rospy.Time(1000, n * 1000000))
"""


@pytest.mark.ros
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_what_rosbag_itself_writes_is_read(tmp_path, compression):
    path = tmp_path / "lab.bag"
    subprocess.run(["/usr/bin/python3", "-c", WRITE, str(path), compression], check=True)
    (channel,) = load_run(path).channels
    assert (channel.topic, channel.type, channel.callerid) == ("/n", "std_msgs/Int8", "")
    assert channel.data == tuple(n % 128 for n in range(300))
    assert channel.times_ns == tuple(1_000_000_000_000 + n * 1_000_000 for n in range(300))


RECORDINGS = Path(__file__).parent.parent / "data" / "recordings"
POSE = {"pose": {"position": {"x": 1.5}}, "header": {"frame_id": "map", "stamp": {"secs": 3, "nsecs": 4}}}
LATCHED = Topic("/goal", "geometry_msgs/PoseStamped", [POSE], latching=True)
READ = """
import json, sys, rosbag
with rosbag.Bag(sys.argv[1]) as bag:
    info = bag.get_type_and_topic_info()
    print(json.dumps({
        "topics": {t: [i.msg_type, i.message_count] for t, i in info.topics.items()},
        "md5": info.msg_types,
        "headers": sorted(
            [c.topic, c.header["callerid"].decode(), c.header["latching"].decode()] for c in bag._get_connections()
        ),
        "values": [[t, str(getattr(m, "data", "")), s.to_nsec()] for t, m, s in bag.read_messages()],
    }))
"""


def messages(run: Run) -> dict[tuple[str, ...], list[tuple[int, bytes]]]:
    return {
        (c.topic, c.callerid, c.type, c.md5sum, c.definition, str(c.latching)): [
            (m.log_time_ns, m.data) for m in c.messages
        ]
        for c in run.channels
        if c.messages
    }


@pytest.mark.parametrize("name", ["talker", "wraps", "listener", "launch"])
def test_recorded_evidence_comes_back(tmp_path, name):
    run = load_run(RECORDINGS / "correct" / f"{name}.mcap")
    assert export_bag(run, tmp_path / "out.bag") == sum(len(c.messages) for c in run.channels)
    assert messages(load_run(tmp_path / "out.bag")) == messages(run)
    assert [p.name for p in tmp_path.iterdir()] == ["out.bag"]


def test_another_tools_recording_comes_back(tmp_path):
    bag = load_run(write_bag(tmp_path / "a.bag", CHATTER, COUNT, LATCHED))
    export_bag(bag, tmp_path / "b.bag")
    assert messages(load_run(tmp_path / "b.bag")) == messages(bag)


def test_a_sum_that_is_not_recorded_is_worked_out(tmp_path):
    (tmp_path / "a.mcap").write_bytes(mcap_bytes(COUNT, LATCHED, metadata=False))
    export_bag(load_run(tmp_path / "a.mcap"), tmp_path / "b.bag")
    sums = {c.type: c.md5sum for c in load_run(tmp_path / "b.bag").channels}
    assert sums == {
        "std_msgs/Int8": "27ffa0c9c4b8fb8492252bcad9e5c57b",
        "geometry_msgs/PoseStamped": "d3812c3cbc69362b77dc0b19b345f8f5",
    }


def test_the_graders_own_records_come_along_when_asked(tmp_path):
    (tmp_path / "talker.mcap").write_bytes(sample())
    run = load_run(tmp_path / "talker.mcap")
    export_bag(run, tmp_path / "plain.bag")
    assert not any(c.topic.startswith("/grader") for c in load_run(tmp_path / "plain.bag").channels)
    export_bag(run, tmp_path / "all.bag", everything=True)
    again = {c.topic: c for c in load_run(tmp_path / "all.bag").channels}
    lines = [json.loads(text)["line"] for text in again["/grader/console"].data]
    assert lines == [line.line for _, line in run.console]
    assert json.loads(again["/grader/package"].data[0])["name"] == "lab1"
    assert again["/grader/console"].by_grader


def test_a_failure_leaves_what_was_there(tmp_path, monkeypatch):
    run = load_run(write_bag(tmp_path / "a.bag", COUNT))
    (tmp_path / "b.bag").write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(bag, "_write", full)
    with pytest.raises(OutputError, match="No space left"):
        export_bag(run, tmp_path / "b.bag")
    assert (tmp_path / "b.bag").read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.bag", "b.bag"]


def test_times_that_no_bag_can_hold(tmp_path):
    data = mcap_bytes(COUNT._replace(start_s=4e9))
    (tmp_path / "a.mcap").write_bytes(data)
    with pytest.raises(EvidenceError, match="1970 to 2106"):
        export_bag(load_run(tmp_path / "a.mcap"), tmp_path / "b.bag")


def test_the_command_writes_one_bag_a_scenario(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert grader(["export", "bag", str(RECORDINGS / "correct"), "--out", "bags"]) == 0
    assert sorted(p.name for p in Path("bags").iterdir()) == [
        "launch.bag", "listener.bag", "talker.bag", "wraps.bag"
    ]  # fmt: skip
    assert "bags/talker.bag: 242 messages" in capsys.readouterr().out


def test_the_command_overwrites_only_what_was_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    source = str(RECORDINGS / "correct" / "talker.mcap")
    assert grader(["export", "bag", source]) == 0
    assert grader(["export", "bag", source]) == 2
    assert "talker.bag already exists" in capsys.readouterr().err
    assert grader(["export", "bag", source, "--out", "talker.bag"]) == 0
    assert grader(["export", "bag", "talker.bag", "--out", "talker.bag"]) == 2
    assert grader(["export", "bag", str(RECORDINGS / "correct" / "package.mcap")]) == 3
    assert "holds no messages to export" in capsys.readouterr().err


def read_by_ros(path: Path) -> dict:
    done = subprocess.run(
        ["/usr/bin/python3", "-c", READ, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return json.loads(done.stdout)


@pytest.mark.ros
@pytest.mark.parametrize("name", ["talker", "wraps"])
def test_rosbag_reads_exported_evidence(tmp_path, name):
    run = load_run(RECORDINGS / "correct" / f"{name}.mcap")
    export_bag(run, tmp_path / "out.bag")
    seen = read_by_ros(tmp_path / "out.bag")
    topics: dict[str, list] = {}
    for c in run.channels:
        if c.messages:
            topics.setdefault(c.topic, [c.type, 0])[1] += len(c.messages)
    assert seen["topics"] == topics
    assert seen["md5"] == {c.type: c.md5sum for c in run.channels if c.messages}
    assert seen["headers"] == sorted(
        [c.topic, c.callerid, str(int(c.latching))] for c in run.channels if c.messages
    )
    chatter = [(v, t) for topic, v, t in seen["values"] if topic == "/chatter"]
    (channel,) = run.student_channels("/chatter")
    assert chatter == list(zip(channel.data, channel.times_ns, strict=True))


@pytest.mark.ros
def test_rosbag_info_describes_an_exported_bag(tmp_path):
    (tmp_path / "a.mcap").write_bytes(mcap_bytes(CHATTER, LATCHED, metadata=False))
    export_bag(load_run(tmp_path / "a.mcap"), tmp_path / "out.bag")
    info = subprocess.run(
        ["/usr/bin/rosbag", "info", str(tmp_path / "out.bag")],
        capture_output=True,
        text=True,
        check=True,
    )
    assert info.stderr == ""
    assert "messages:    301" in info.stdout
    assert "d3812c3cbc69362b77dc0b19b345f8f5" in info.stdout
