"""Recordings of ROS 2 are read as those of ROS 1."""

from __future__ import annotations

import sqlite3
import sys
from contextlib import closing
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from mcap.writer import Writer
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from grader.errors import EvidenceError
from grader.evidence.decode import Decoder
from grader.evidence.reader import load_run
from grader.evidence.ros2 import is_latched, ros1_definition, ros1_messages

OWN = """\
# what the lab measures
uint8 MOST=5
string<=20 NAME="a = b"
std_msgs/Header header
float64[<=3] readings
int16 count 7
bool[2] flags
byte level
builtin_interfaces/Duration took
string unit "m"
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
"""
PLAIN = "std_msgs/Header header\nfloat64[] readings\nint16 count\nbool[2] flags\nuint8 level\n"
PLAIN += "builtin_interfaces/Duration took\nstring unit\n"
VALUE = {
    "header": {"stamp": {"secs": 12, "nsecs": 5}, "frame_id": "laser"},
    "readings": [0.5, float("inf")],
    "count": -3,
    "flags": [True, False],
    "level": 200,
    "took": {"secs": 1, "nsecs": 2},
    "unit": "cm",
}


def own_message() -> bytes:
    """As a node of ROS 2 sends it."""
    import numpy as np  # noqa: PLC0415 - only here

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(PLAIN, "lab/msg/Reading"))
    types: Any = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=12, nanosec=5)
    message = types["lab/msg/Reading"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="laser"),
        readings=np.array([0.5, np.inf]),
        count=-3,
        flags=np.array([True, False]),
        level=200,
        took=types["builtin_interfaces/msg/Duration"](sec=1, nanosec=2),
        unit="cm",
    )
    return bytes(store.serialize_cdr(message, "lab/msg/Reading"))


def recording(*channels: tuple[str, str, str, list[bytes]], profile: str = "ros2") -> bytes:
    """As rosbag2 writes it: topic, type, definition and messages, ten a second."""
    stream = BytesIO()
    writer = Writer(stream)
    writer.start(profile=profile)
    for topic, type_, definition, messages in channels:
        schema = writer.register_schema(type_, "ros2msg", definition.encode())
        about = {"offered_qos_profiles": "- history: 3\n  durability: 1\n" if topic == "/map" else ""}
        number = writer.register_channel(topic, "cdr", schema, about)
        for sequence, data in enumerate(messages):
            at_ns = 1_700_000_000_000_000_000 + sequence * 100_000_000
            writer.add_message(number, at_ns, data, at_ns, sequence)
    writer.finish()
    return stream.getvalue()


def text_message(text: str) -> bytes:
    store = get_typestore(Stores.ROS2_HUMBLE)
    types: Any = store.types
    return bytes(store.serialize_cdr(types["std_msgs/msg/String"](data=text), "std_msgs/msg/String"))


def test_a_recording_of_ros_2(tmp_path: Path) -> None:
    told = [
        ("/chatter", "std_msgs/msg/String", "string data", [text_message(f"hello {i}") for i in range(3)])
    ]
    own = [("/map", "lab/msg/Reading", OWN, [own_message()])]
    (tmp_path / "lab.mcap").write_bytes(recording(*told, *own))
    run = load_run(tmp_path / "lab.mcap")
    chatter, reading = run.student_channels()
    assert run.foreign
    assert (chatter.type, chatter.data, chatter.latching) == (
        "std_msgs/String",
        ("hello 0", "hello 1", "hello 2"),
        False,
    )
    assert (reading.type, reading.values, reading.latching) == ("lab/Reading", (VALUE,), True)


def test_a_definition_in_ros_1s_words() -> None:
    assert ros1_definition("lab/Reading", OWN).splitlines() == [
        "std_msgs/Header header", "float64[] readings", "int16 count", "bool[2] flags", "uint8 level", "duration took",
        "string unit", "=" * 80, "MSG: std_msgs/Header", "time stamp", "string frame_id",
    ]  # fmt: skip


SHORT, BIG_ENDIAN = own_message()[:-4], b"\0\0" + own_message()[2:]


@pytest.mark.parametrize(
    "data", [b"", b"\0\1\0\0", b"\0\1\0\0" + b"\xff" * 9, SHORT, BIG_ENDIAN, own_message() + b"1234"]
)
def test_what_does_not_fit_cannot_be_read(data: bytes) -> None:
    definition = ros1_definition("lab/Reading", OWN)
    (message,) = ros1_messages("lab/Reading", definition, [data])
    assert Decoder("lab/Reading", definition).decode(message) is None


def test_a_message_without_fields() -> None:
    assert ros1_messages("std_msgs/Empty", ros1_definition("std_msgs/Empty", ""), [b"\0\1\0\0\0"]) == [b""]


def test_only_names_of_our_own_reach_the_code_generator(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.usertypes", ModuleType("rosbags.usertypes"))
    data = b"\0\1\0\0" + b"\1\0\0\0" + b"\3\0\0\0ab\0\0"
    (message,) = ros1_messages("demo/A", "int8 os\nstring exec", [data])
    assert Decoder("demo/A", "int8 os\nstring exec").decode(message) == {"os": 1, "exec": "ab"}
    names = [name for name in vars(sys.modules["rosbags.usertypes"]) if "__msg__" in name]
    assert names
    assert all(name.startswith("recorded__msg__T") for name in names)


def test_definitions_that_cannot_be_followed_leave_the_messages_unread(tmp_path: Path) -> None:
    odd = ("wstring data", "MSG", "string data\n====\nno name", "lab/Missing one", "=====")
    channels = [(f"/n{i}", "lab/msg/Odd", text, [own_message()]) for i, text in enumerate(odd)]
    (tmp_path / "lab.mcap").write_bytes(recording(*channels))
    assert [c.values for c in load_run(tmp_path / "lab.mcap").channels] == [(None,)] * len(odd)


def test_what_keeps_its_last_message() -> None:
    assert is_latched("- history: 1\n  durability: transient_local\n")
    assert not is_latched("- history: 1\n  durability: 2\n")


KEPT = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    QosTime(0, 0),
    QosTime(0, 0),
    QosLiveliness.AUTOMATIC,
    QosTime(0, 0),
    avoid_ros_namespace_conventions=False,
)


def rosbag2(folder: Path, version: int, *, own: bool = True) -> Path:
    """Write a bag as `ros2 bag record` does by default (SQLite), and return the `.db3` file of it."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(PLAIN, "lab/msg/Reading"))
    with Rosbag2Writer(folder, version=version, storage_plugin=StoragePlugin.SQLITE3) as bag:  # type: ignore[arg-type]
        chatter = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for i in (2, 0, 1):  # the file's order is not that of time
            bag.write(chatter, 1_700_000_000_000_000_000 + i * 100_000_000, text_message(f"hello {i}"))
        if own:
            reading = bag.add_connection(
                "/map", "lab/msg/Reading", typestore=store, offered_qos_profiles=[KEPT]
            )
            bag.write(reading, 1_700_000_000_000_000_000, own_message())
    (file,) = folder.glob("*.db3")
    return file


def test_a_bag_of_ros_2_in_sqlite(tmp_path: Path) -> None:
    file = rosbag2(tmp_path / "lab", 9)
    run = load_run(file)
    chatter, reading = run.student_channels()
    assert (run.foreign, run.scenario, run.end_ns - run.start_ns) == (True, file.stem, 200_000_000)
    assert (chatter.type, chatter.data) == ("std_msgs/String", ("hello 0", "hello 1", "hello 2"))
    assert (reading.type, reading.values, reading.latching) == ("lab/Reading", (VALUE,), True)


def test_a_bag_without_definitions_holds_ros_2s_own_types(tmp_path: Path) -> None:
    file = rosbag2(tmp_path / "own", 9, own=False)
    change(file, "DROP TABLE message_definitions")
    assert [c.data for c in load_run(file).channels] == [("hello 0", "hello 1", "hello 2")]


def test_a_type_without_any_definition_is_refused(tmp_path: Path) -> None:
    file = rosbag2(tmp_path / "lab", 9)
    change(file, "DROP TABLE message_definitions")
    with pytest.raises(EvidenceError, match="no definition of 'lab/msg/Reading' in it"):
        load_run(file)


def change(file: Path, *statements: str) -> None:
    with closing(sqlite3.connect(file)) as bag:
        for statement in statements:
            bag.execute(statement)
        bag.commit()


ENDLESS = "CREATE VIEW messages(topic_id, timestamp, data) AS "
ENDLESS += "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i, i, x'' FROM n"


@pytest.mark.parametrize(
    "statements",
    [
        ["DROP TABLE messages"],
        ["DROP TABLE topics"],
        ["UPDATE messages SET data = 'text'"],
        ["UPDATE messages SET timestamp = 'soon'"],
        ["ALTER TABLE topics RENAME COLUMN type TO kind"],
        ["DROP TABLE messages", ENDLESS],
        [
            "DROP TABLE messages",
            "CREATE TABLE messages(topic_id, timestamp, data GENERATED ALWAYS AS (zeroblob(900000000)))",
            "INSERT INTO messages VALUES(1, 1)",
        ],
        ["DROP TABLE messages", "CREATE VIRTUAL TABLE messages USING fts4(topic_id, timestamp, data)"],
    ],
)  # fmt: skip
def test_a_hostile_or_damaged_bag_is_refused(tmp_path: Path, statements: list[str]) -> None:
    file = rosbag2(tmp_path / "lab", 9, own=False)
    change(file, *statements)
    with pytest.raises(EvidenceError, match="a bag of ROS 2 in SQLite, damaged"):
        load_run(file)


def test_a_bag_that_is_cut_short_is_refused(tmp_path: Path) -> None:
    file = rosbag2(tmp_path / "lab", 9)
    file.write_bytes(file.read_bytes()[:5_000])
    with pytest.raises(EvidenceError, match="a bag of ROS 2 in SQLite, damaged or cut short"):
        load_run(file)
