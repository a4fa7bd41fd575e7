"""Evidence as bags: the same messages come back, and ROS's own tools read them."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from grader.cli.main import run as grader
from grader.errors import EvidenceError, OutputError
from grader.evidence import bag
from grader.evidence.bag import export_bag
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from tests.evidence.bags import CHATTER, COUNT, Topic, mcap_bytes, write_bag
from tests.evidence.samples import sample

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
