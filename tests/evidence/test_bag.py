"""Recordings of other tools: read whole, or refused on one line that says why."""

from __future__ import annotations

import random
import struct
import subprocess
from pathlib import Path

import pytest

from grader.errors import EvidenceError
from grader.evidence import bag
from grader.evidence.reader import load_evidence, load_run
from tests.evidence.bags import BZ2, CHATTER, COUNT, LZ4, Topic, mcap_bytes, write_bag


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
