"""MCAP files, bags and archives whose lengths, sizes and places may lie."""

from __future__ import annotations

import bz2
import io
import json
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Mapping, Sequence

import lz4.frame
import zstandard
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from mcap.opcode import Opcode

from tests.fuzz.grammars.common import lengths, sized, words
from tests.fuzz.grammars.text import JSON_VALUES
from tests.fuzz.grammars.wire import RECORDS, TOPICS

MAGIC = b"\x89MCAP0\r\n"
TIMES = st.sampled_from((0, 1, 1_700_000_000_000_000_000, (1 << 63) - 1, (1 << 64) - 1))
OWN = {"format": "1", "scenario": "talker", "clock": "real", "warp": "1"}
DEFINITIONS = (
    "int8 data\n",
    "string data\n",
    "Inner[] a\n" + "=" * 80 + "\nMSG: demo/Inner\nuint8 x\n",
    "",
    "A[] a",
)
PACKERS = {"": lambda data: data, "zstd": zstandard.compress, "lz4": lz4.frame.compress}


@st.composite
def record(draw: st.DrawFn, opcode: int, body: bytes) -> bytes:
    return bytes([opcode]) + draw(sized(body, "<Q"))


@st.composite
def text(draw: st.DrawFn, value: str) -> bytes:
    return draw(sized(value.encode("utf-8", "surrogatepass")))


@st.composite
def table(draw: st.DrawFn, values: Mapping[str, str]) -> bytes:
    pairs = [draw(text(key)) + draw(text(value)) for key, value in values.items()]
    return draw(sized(b"".join(pairs)))


@st.composite
def _schema(draw: st.DrawFn, *, own: bool) -> bytes:
    number = draw(st.integers(0, 3))
    kind = draw(st.sampled_from(("ros1msg", "ros1msg", "jsonschema", "")))
    name = draw(text(draw(words("std_msgs/Int8", "std_msgs/msg/String", "demo/A", "grader.ScenarioEvent"))))
    definition = draw(st.sampled_from(DEFINITIONS)).encode()
    encoding = draw(text("jsonschema" if own and number == 3 else kind))
    return struct.pack("<H", number) + name + encoding + draw(sized(definition))


@st.composite
def _channel(draw: st.DrawFn, *, own: bool) -> bytes:
    number = draw(st.integers(0, 4))
    topic = draw(words("/c", "/numeric_chatter", *(f"/grader/{topic}" for topic in TOPICS)))
    encoding = "json" if own and number > 2 else draw(words("ros1", "ros1", "json", "cdr"))
    about = draw(
        st.sampled_from(({}, {"callerid": "/talker", "md5sum": "x", "latching": "1", "topic": "/c"}))
    )
    schema = 3 if encoding == "json" else draw(st.integers(0, 3))
    return struct.pack("<HH", number, schema) + draw(text(topic)) + draw(text(encoding)) + draw(table(about))


@st.composite
def _message(draw: st.DrawFn, *, own: bool) -> bytes:
    number = draw(st.integers(0, 4))
    data = draw(st.binary(max_size=12))
    if own and number > 2:
        sound = draw(st.sampled_from(sorted(RECORDS)))
        value = {
            **RECORDS[sound],
            **draw(st.dictionaries(st.sampled_from(sorted(RECORDS[sound])), JSON_VALUES, max_size=1)),
        }
        data = json.dumps(value).encode()
    return struct.pack("<HIQQ", number, draw(st.integers(0, 9)), draw(TIMES), 0) + data


def _content(own: bool) -> SearchStrategy[bytes]:
    return st.one_of(
        _schema(own=own).flatmap(lambda body: record(Opcode.SCHEMA, body)),
        _channel(own=own).flatmap(lambda body: record(Opcode.CHANNEL, body)),
        _message(own=own).flatmap(lambda body: record(Opcode.MESSAGE, body)),
        _message(own=own).flatmap(lambda body: record(Opcode.MESSAGE, body)),
    )


@st.composite
def _chunk(draw: st.DrawFn, *, own: bool) -> bytes:
    plain = b"".join(draw(st.lists(_content(own), max_size=8)))
    packing = draw(st.sampled_from(("", "", "zstd", "lz4", "rle")))
    packed = PACKERS.get(packing, PACKERS[""])(plain)
    crc = draw(st.sampled_from((0, 0, zlib.crc32(plain), 1)))
    size = draw(lengths(len(plain)))
    return struct.pack("<QQQI", 0, 0, size, crc) + draw(text(packing)) + draw(sized(packed, "<Q"))


@st.composite
def _metadata(draw: st.DrawFn, *, own: bool) -> bytes:
    odd = draw(
        st.dictionaries(
            words("format", "warp", "not_run", "recording.problem"), words("1", "nan"), max_size=1
        )
    )
    name = draw(st.sampled_from(("grader.evidence", "other"))) if own else "other"
    return draw(text(name)) + draw(table({**OWN, **odd}))


@st.composite
def _attachment(draw: st.DrawFn) -> bytes:
    name = draw(text(draw(words("src/a.py", "../a"))))
    return struct.pack("<QQ", 0, 0) + name + draw(text("text/plain")) + draw(sized(b"data", "<Q")) + bytes(4)


@st.composite
def _mcap(draw: st.DrawFn, *, own: bool) -> bytes:
    profile = draw(st.sampled_from(("ros1", "ros1", "ros2", "")))
    parts = [MAGIC, draw(record(Opcode.HEADER, draw(text(profile)) + draw(text("x"))))]
    if own:
        parts.append(draw(record(Opcode.METADATA, draw(text("grader.evidence")) + draw(table(OWN)))))
    others = st.one_of(
        _chunk(own=own).flatmap(lambda body: record(Opcode.CHUNK, body)),
        _content(own),
        _metadata(own=own).flatmap(lambda body: record(Opcode.METADATA, body)),
        _attachment().flatmap(lambda body: record(Opcode.ATTACHMENT, body)),
        st.binary(max_size=20).flatmap(lambda body: record(Opcode.MESSAGE_INDEX, body)),
    )
    parts += draw(st.lists(others, max_size=8))
    parts.append(draw(record(Opcode.DATA_END, bytes(4))))
    parts.append(draw(record(Opcode.FOOTER, bytes(20))))
    parts.append(draw(st.sampled_from((MAGIC, MAGIC, MAGIC, b"", MAGIC + b"x"))))
    return b"".join(parts)


def own_mcap() -> SearchStrategy[bytes]:
    return _mcap(own=True)


def foreign_mcap() -> SearchStrategy[bytes]:
    return _mcap(own=False)


@st.composite
def _fields(draw: st.DrawFn, values: Mapping[str, bytes]) -> bytes:
    lines = [draw(sized(name.encode() + b"=" + value)) for name, value in values.items()]
    return draw(sized(b"".join(lines)))


@st.composite
def _bag_record(draw: st.DrawFn, values: Mapping[str, bytes], data: bytes) -> bytes:
    return draw(_fields(values)) + draw(sized(data))


@st.composite
def _connection(draw: st.DrawFn, number: int) -> bytes:
    about = {
        "topic": draw(words("/c", "/n")).encode("utf-8", "replace"),
        "type": draw(words("std_msgs/Int8", "demo/A", "a/b/c/d")).encode("utf-8", "replace"),
        "md5sum": b"x",
        "message_definition": draw(st.sampled_from(DEFINITIONS)).encode(),
    }
    if draw(st.booleans()):
        about |= {"callerid": b"/talker", "latching": draw(words("1", "0")).encode("utf-8", "replace")}
    head = {"op": b"\7", "conn": struct.pack("<I", number), "topic": about["topic"]}
    fields = draw(_fields(about))
    return draw(_fields(head)) + fields


@st.composite
def bag(draw: st.DrawFn) -> bytes:
    """Chunks, then the index; places in it are right as long as no length lies."""
    connections = [draw(_connection(number)) for number in range(draw(st.integers(0, 2)))]
    out = io.BytesIO()
    out.write(
        draw(st.sampled_from((b"#ROSBAG V2.0\n", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n", b"#ROSBAG V2.0")))
    )
    place = out.tell()
    out.write(bytes(4096))
    infos = [draw(_bag_chunk(out, connections)) for _ in range(draw(st.integers(0, 3)))]
    index = draw(st.sampled_from((out.tell(), out.tell(), out.tell(), 0, place)))
    out.write(b"".join(connections) + b"".join(infos))
    counts = [struct.pack("<I", draw(lengths(len(found)))) for found in (connections, infos)]
    head = {
        "op": b"\3",
        "index_pos": struct.pack("<Q", index),
        "conn_count": counts[0],
        "chunk_count": counts[1],
    }
    fields = draw(_fields(head))
    data = out.getvalue()
    padding = bytes(max(0, 4096 - len(fields) - 4))
    return data[:place] + fields + struct.pack("<I", len(padding)) + padding + data[place + 4096 :]


@st.composite
def _bag_chunk(draw: st.DrawFn, out: io.BytesIO, connections: list[bytes]) -> bytes:
    time = struct.pack("<II", draw(st.sampled_from((0, 1_700_000_000, (1 << 32) - 1))), 0)
    messages = [
        draw(
            _bag_record(
                {"op": b"\2", "conn": struct.pack("<I", draw(st.integers(0, 2))), "time": time},
                draw(st.binary(max_size=9)),
            )
        )
        for _ in range(draw(st.integers(0, 4)))
    ]
    plain = b"".join([*connections, *messages])
    packing, packed = draw(
        st.sampled_from(
            (
                (b"none", plain),
                (b"none", plain),
                (b"bz2", bz2.compress(plain)),
                (b"lz4", lz4.frame.compress(plain)),
                (b"x", b""),
            )
        )
    )
    place = out.tell()
    size = struct.pack("<I", draw(lengths(len(plain))))
    out.write(draw(_bag_record({"op": b"\5", "compression": packing, "size": size}, packed)))
    info = {
        "op": b"\6",
        "ver": struct.pack("<I", draw(st.sampled_from((1, 1, 1, 0)))),
        "chunk_pos": struct.pack("<Q", draw(st.sampled_from((place, place, place, 13, 0, 1 << 40)))),
        "start_time": time,
        "end_time": time,
        "count": struct.pack("<I", draw(lengths(1))),
    }
    return draw(_bag_record(info, struct.pack("<II", 0, len(messages))))


NAMES = (
    "lab1/package.xml", "lab1/CMakeLists.txt", "lab1/src/a.py", "lab1/", "../x", "/etc/passwd", "lab1/../../x", "a\\b",
    "C:/x", "lab1/src", "lab1/link", "é", "__MACOSX/x", ".git/config", "lab1/package.xml/x", "LAB1/PACKAGE.XML",
)  # fmt: skip
BUILT = (
    "devel/lib/lab1/talker",
    "devel/lib/lab1",
    "devel/lib/lab1/../x",
    "trace.json",
    "devel/lib/other/x",
    "/x",
)
XML = b"<package><name>lab1</name></package>"


@st.composite
def archive(draw: st.DrawFn) -> bytes:
    return draw(st.one_of(_zip(), _tar(NAMES, ("w", "w:gz", "w:bz2", "w:xz"))))


def built() -> SearchStrategy[bytes]:
    """What a build hands over."""
    return _tar(BUILT, ("w",))


@st.composite
def _zip(draw: st.DrawFn) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as packed:
        for name in draw(st.lists(st.sampled_from(NAMES), max_size=6, unique=True)):
            info = zipfile.ZipInfo(name)
            info.create_system = draw(st.sampled_from((3, 0)))
            info.external_attr = (
                draw(st.sampled_from((0o100755, 0o100644, 0o120777, 0o040755, 0o020666, 0))) << 16
            )
            info.compress_type = draw(st.sampled_from((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))
            packed.writestr(info, draw(st.sampled_from((XML, b"../../x", b"lab1", b"\0" * 9000, b""))))
    return _spoiled(draw, out.getvalue())


@st.composite
def _tar(draw: st.DrawFn, names: Sequence[str], modes: Sequence[str]) -> bytes:
    out = io.BytesIO()
    form = draw(st.sampled_from((tarfile.PAX_FORMAT, tarfile.GNU_FORMAT, tarfile.USTAR_FORMAT)))
    with tarfile.open(fileobj=out, mode=draw(st.sampled_from(modes)), format=form) as packed:
        for name in draw(st.lists(st.sampled_from(names), max_size=6)):
            info = tarfile.TarInfo(name)
            info.type = draw(st.sampled_from((b"0", b"0", b"1", b"2", b"5", b"3", b"6", b"S", b"x")))
            info.mode = draw(st.sampled_from((0o755, 0o644, 0)))
            info.linkname = draw(st.sampled_from(names)) if info.type in b"12" else ""
            data = draw(st.sampled_from((XML, b"", b"x" * 2000))) if info.isreg() else b""
            info.size = len(data)
            packed.addfile(info, io.BytesIO(data))
    return _spoiled(draw, out.getvalue())


def _spoiled(draw: st.DrawFn, data: bytes) -> bytes:
    """Sound, or with one number in it changed."""
    if not data or draw(st.booleans()):
        return data
    place = draw(st.integers(0, len(data) - 1))
    lie = struct.pack("<I", draw(st.sampled_from((0, 1, 0xFFFF, 0xFFFFFFFF))))
    return data[:place] + lie + data[place + len(lie) :]
