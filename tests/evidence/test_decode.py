"""Message bytes against ROS's own serialisation, and definitions that mean harm."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap_ros1.decoder import DecoderFactory

from grader.evidence import decode
from grader.evidence.decode import Decoder
from grader.evidence.definitions import MAX_DEFINITION_BYTES, DefinitionError, parse

INTEGERS = {f"std_msgs/{sign}Int{bits}": (bits, sign) for sign in ("", "U") for bits in (8, 16, 32, 64)}
SEPARATOR = "=" * 80
EVERY_KIND = """bool flag
byte b
char c
float32[2] pair
uint8[] raw
int8[3] small
string[2] words
duration d
demo/Point[] points
int32 FOO=3  # constants are not sent
{separator}
MSG: demo/Point
float64 x
"""


def decoder_for(type_: str) -> Decoder:
    return Decoder(type_, decode.definition(type_))


@pytest.mark.parametrize(
    ("type_", "md5sum"),
    [
        ("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1"),
        ("std_msgs/Int8", "27ffa0c9c4b8fb8492252bcad9e5c57b"),
        ("std_msgs/Header", "2176decaecbce78abc3b96ef049fabed"),
        ("std_msgs/Byte", "ad736a2e8818154c487bb80fe42ce43b"),
        ("std_msgs/Char", "1bf77f25acecdedba0e224b162199717"),
        ("rosgraph_msgs/Log", "acffd30cd6b6de30f120938c17c593fb"),
        ("rosgraph_msgs/Clock", "a9c97c1d230cfc112e270351a944ee47"),
    ],
)
def test_md5sums_are_those_of_ros(type_, md5sum):
    assert decode.md5sum(type_) == md5sum


@given(st.text())
def test_text_comes_back(text):
    data = decode.encode("std_msgs/String", {"data": text})
    assert decoder_for("std_msgs/String").decode(data) == {"data": text}


@given(st.sampled_from(sorted(INTEGERS)), st.data())
def test_integers_come_back(type_, data):
    bits, sign = INTEGERS[type_]
    low, high = (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    value = data.draw(st.integers(low, high))
    assert decoder_for(type_).decode(decode.encode(type_, {"data": value})) == {"data": value}


@pytest.mark.parametrize("type_", sorted(INTEGERS))
def test_integers_out_of_range_are_refused(type_):
    bits, sign = INTEGERS[type_]
    low, high = (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for value in (low - 1, high + 1, 1.5, "1", True):
        with pytest.raises(ValueError, match=r"out of range|is no"):
            decode.encode(type_, {"data": value})


@given(
    st.builds(
        dict,
        level=st.integers(-128, 127),
        name=st.text(),
        line=st.integers(0, 2**32 - 1),
        topics=st.lists(st.text(), max_size=4),
        header=st.builds(
            dict,
            seq=st.integers(0, 2**32 - 1),
            stamp=st.builds(dict, secs=st.integers(0, 2**31 - 1), nsecs=st.integers(0, 10**9 - 1)),
            frame_id=st.text(),
        ),
    )
)
def test_nested_messages_come_back_as_another_reader_reads_them(log):
    data = decode.encode("rosgraph_msgs/Log", log)
    ours = decoder_for("rosgraph_msgs/Log").decode(data)
    assert {key: ours[key] for key in log} == log
    assert decoder_for("rosgraph_msgs/Log").decode(data + b"\0") is None


@pytest.mark.filterwarnings("ignore:.*TemporaryFileWrapper")  # of genpy's, which Python 3.14 complains of
def test_another_reader_agrees_on_every_kind_of_field():
    definition = EVERY_KIND.format(separator=SEPARATOR)
    data = b"\x01\xff\xff" + b"\0\0\x80?\0\0\0@" + b"\x02\0\0\0\x01\x02" + b"\x01\xff\x03"
    data += b"\x01\0\0\0a\x02\0\0\0bc" + b"\xff\xff\xff\xff\x05\0\0\0" + b"\x01\0\0\0" + b"\0\0\0\0\0\0\xf0?"
    value = Decoder("demo/All", definition).decode(data)
    assert value == {
        "flag": True,
        "b": -1,
        "c": 255,
        "pair": [1.0, 2.0],
        "raw": b"\x01\x02",
        "small": [1, -1, 3],
        "words": ["a", "bc"],
        "d": {"secs": -1, "nsecs": 5},
        "points": [{"x": 1.0}],
    }
    schema = type(
        "Schema", (), {"id": 1, "name": "demo/All", "encoding": "ros1msg", "data": definition.encode()}
    )
    other = DecoderFactory().decoder_for("ros1", schema)(data)
    assert (other.b, other.c, list(other.small), other.points[0].x) == (-1, 255, [1, -1, 3], 1.0)


@given(
    st.binary(max_size=40),
    st.sampled_from(["std_msgs/String", "rosgraph_msgs/Log", "std_msgs/Int8MultiArray"]),
)
def test_any_bytes_give_a_value_or_none(data, type_):
    value = decoder_for(type_).decode(data)
    assert value is None or isinstance(value, dict)


@pytest.mark.parametrize(
    "data", [b"", b"\0\0", b"\x01\0\0\0", b"\xff\xff\xff\xffabc", b"\x01\0\0\0ab", b"\x01\0\0\0\xff"]
)
def test_bytes_that_do_not_fit_a_string_give_none(data):
    assert decoder_for("std_msgs/String").decode(data) is None


@pytest.mark.parametrize(
    ("type_", "definition"),
    [
        ("demo/A", ""),
        ("demo/A", "# only a comment\n\n"),
        ("demo/A", "int8  a \r\n\tint16 b # two\r\n"),
        ("Demo/class_", "string class\nint8 import\nint8 f0"),
        (
            "demo/A",
            "Header header\n" + SEPARATOR + "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id",
        ),
        ("demo/A", "string NOTE=a # b = c\nB b\n" + SEPARATOR + "\nMSG: demo/B\nint8 x"),
        ("demo/A", "std_msgs/Empty nothing\nint8 x\n" + SEPARATOR + "\nMSG: std_msgs/Empty\n"),
    ],
)
def test_sound_definitions_are_followed(type_, definition):
    assert Decoder(type_, definition).usable


@pytest.mark.parametrize(
    ("type_", "definition"),
    [
        ("demo/A", "int8 x; import os"),
        ("demo/A", "int8 x\nint8 x"),
        ("demo/A", "int8 __class__"),
        ("demo/A", "int8 x\nnonsense"),
        ("demo/A", "int8 größe"),
        ("demo/A", "A[] again"),
        ("demo/A", "A again"),
        ("demo/A", "demo/Missing m"),
        ("demo/A", f"B b\n{SEPARATOR}\nMSG: demo/B\nA a"),
        ("demo/A", f"B[] b\n{SEPARATOR}\nMSG: demo/B\n"),
        ("demo/A", f"B[9999] b\n{SEPARATOR}\nMSG: demo/B\nint8 x"),
        ("demo/A", f"int8 x\n{SEPARATOR}\nint8 y"),
        ("demo/A", f"int8 x\n{SEPARATOR}\nMSG: demo/B()\nint8 y"),
        ("demo/A", f"B b\n{SEPARATOR}\nMSG: demo/B\nint8 y\n{SEPARATOR}\nMSG: demo/B\nint16 y"),
        ("demo/A", "string[100000000] x"),
        ("demo/A", "float64[999999999] x"),
        ("demo/A", "float64[9999999999] x"),
        ("demo/A", "int8 x" + "0" * MAX_DEFINITION_BYTES),
        ("demo/A", "\n".join(f"int8 x{n}" for n in range(4000))),
        ("", "int8 x"),
        ("A", "int8 x"),
        ("demo/A\nint8 y", "int8 x"),
        ("demo/A:\n    pass\nimport os\nclass B", "int8 x"),
        ("../A", "int8 x"),
    ],
)
def test_hostile_definitions_are_refused(type_, definition):
    decoder = Decoder(type_, definition)
    assert not decoder.usable
    assert decoder.decode(b"\0") is None


def nest(levels: int, line: str, last: str) -> str:
    parts = [line.replace("Next", "L0")]
    parts += [f"MSG: demo/L{n}\n" + line.replace("Next", f"L{n + 1}") for n in range(levels)]
    return f"\n{SEPARATOR}\n".join([*parts, f"MSG: demo/L{levels}\n{last}"])


@pytest.mark.parametrize(
    "definition",
    [
        nest(200, "Next a", "int8 x"),
        nest(12, "Next a\nNext b\nNext c\nNext d", ""),
        nest(12, "Next[50] a", "int8 x"),
        nest(12, "\n".join(f"Next a{n}" for n in range(50)), "int8 x"),
    ],
    ids=["deep", "empty", "arrays", "fields"],
)
def test_definitions_that_would_explode_are_refused_at_once(definition):
    begin = time.process_time()
    assert not Decoder("demo/Top", definition).usable
    assert time.process_time() - begin < 2


@given(st.text(alphabet="int8 xAB/[]3=\n#MSG:_", max_size=80))
def test_any_text_is_a_definition_or_none(text):
    try:
        parse("demo/A", text)
    except DefinitionError:
        assert not Decoder("demo/A", text).usable
    else:
        assert Decoder("demo/A", text).usable


@pytest.mark.parametrize(
    ("type_", "value"),
    [
        ("std_msgs/Nothing", {}),
        ("nonsense", {}),
        ("std_msgs/String", {"text": "a"}),
        ("std_msgs/String", {"data": 1}),
        ("std_msgs/Bool", {"data": 1}),
        ("std_msgs/Float32", {"data": 1e300}),
        ("std_msgs/Time", {"data": {"sec": 1}}),
        ("std_msgs/Int8MultiArray", {"data": [1, 300]}),
        ("geometry_msgs/PoseWithCovariance", {"covariance": [1.0]}),
    ],
)
def test_what_a_type_cannot_hold_is_refused(type_, value):
    with pytest.raises(ValueError, match=r"."):
        decode.encode(type_, value)
