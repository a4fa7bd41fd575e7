"""Message and service definitions, each with bytes that fit it, or nearly."""

from __future__ import annotations

import struct

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from tests.fuzz.grammars.common import SIZES, joined, words

TYPES = (
    "int8", "uint8", "bool", "float64", "string", "time", "duration", "Header", "std_msgs/Header", "byte", "char",
    "Inner", "demo/Inner", "Outer", "std_msgs/Empty", "uint64",
)  # fmt: skip
BRACKETS = ("", "", "", "[]", "[]", "[3]", "[0]", "[16777217]", "[-1]", "[9999999999]", "[ ]")
ENDS = ("", "", "", " # c", "=3", "=a # b", " = x", ";", " y")
RULE = "=" * 80
CHUNKS = st.one_of(
    st.binary(max_size=12),
    st.sampled_from(SIZES).map(lambda size: struct.pack("<I", size)),
    st.text(max_size=5).map(lambda text: struct.pack("<I", len(text.encode())) + text.encode()),
)


def _fields() -> SearchStrategy[str]:
    names = st.sampled_from([f"f{n}" for n in range(12)] + ["class", "data", "1a", "é", "secs", ""])
    return joined(
        st.builds("{}{} {}{}".format, words(*TYPES), st.sampled_from(BRACKETS), names, st.sampled_from(ENDS)),
        "\n",
        most=8,
    )


def _text() -> SearchStrategy[str]:
    part = st.builds(
        "{}\nMSG: {}\n{}".format,
        st.sampled_from((RULE, "=" * 5, "===x")),
        words("demo/Inner", "Inner"),
        _fields(),
    )
    return st.builds("{}\n{}".format, _fields(), joined(part, "\n", most=3))


def _message() -> SearchStrategy[bytes]:
    return st.lists(CHUNKS, max_size=10).map(b"".join)


def definition() -> SearchStrategy[bytes]:
    return st.builds(
        _case, words("demo/Outer", "demo/Outer", "std_msgs/String", "Outer"), _text(), _message()
    )


def service() -> SearchStrategy[bytes]:
    text = st.builds(
        "{}\n{}\n{}".format, _text(), st.sampled_from(("---", "---", "---", "", "--- ")), _text()
    )
    return st.builds(_case, words("demo/Call", "std_srvs/Empty"), text, _message())


def _case(name: str, text: str, message: bytes) -> bytes:
    return f"{name}\n{text}".replace("\0", "").encode(errors="replace") + b"\0" + message
