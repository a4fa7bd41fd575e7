"""What comes over sockets and pipes: the arena's frames, TCPROS headers and messages, XML-RPC."""

from __future__ import annotations

import json
import struct

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from tests.fuzz.grammars.common import encoded, joined, lengths, sized, words
from tests.fuzz.grammars.text import JSON_VALUES

TOPICS = ("process", "console", "graph", "param", "host", "actor", "recorder", "scenario", "package")
RECORDS = {
    "process": {"event": "exit", "name": "talker", "role": "student", "exit_code": 0, "cpu_s": 0.1},
    "console": {"process": "talker", "stream": "stdout", "line": "x"},
    "graph": {
        "nodes": ["/talker"], "topic_types": {}, "publishers": {}, "subscribers": {}, "services": {}, "connections": [],
        "processes": {},
    },
    "param": {"action": "set", "name": "/a", "caller_id": "/n", "value": 1},
    "host": {"samples": 1, "mean_ms": 0.1, "p95_ms": 0.1, "max_ms": 0.1, "load_1min": 0.5},
    "actor": {"action": "note", "actor": "/n", "detail": "x"},
    "recorder": {"event": "connected", "topic": "/c", "callerid": "/n"},
}  # fmt: skip
CHANNEL = {
    "id": 1, "topic": "/c", "callerid": "/n", "type": "std_msgs/Int8", "md5sum": "x", "definition": "int8 data",
    "latching": False,
}  # fmt: skip
STATUSES = ("ready", "done", "subscribed", "answer", "graph", "spawn-failed", "nonsense")


@st.composite
def _frame(draw: st.DrawFn) -> bytes:
    kind = draw(st.sampled_from("EEECSSMx"))
    payload = draw(_PAYLOADS[kind])
    length = draw(lengths(len(payload)))
    return struct.pack("<BIQ", ord(kind), length, draw(st.integers(0, (1 << 64) - 1))) + payload


def _event() -> SearchStrategy[object]:
    def spoiled(topic: str) -> SearchStrategy[object]:
        sound = RECORDS.get(topic, {})
        changed = st.dictionaries(st.sampled_from(sorted(sound) or ["x"]), JSON_VALUES, max_size=2)
        return st.builds(lambda change: {"topic": f"/grader/{topic}", "record": {**sound, **change}}, changed)

    return st.sampled_from(TOPICS).flatmap(spoiled)


def _messages() -> SearchStrategy[bytes]:
    """Of the first channel, each behind its length."""
    several = st.lists(st.binary(max_size=8).flatmap(sized), max_size=3)
    return several.map(lambda datas: struct.pack("<I", 1) + b"".join(datas))


_STATUS = st.fixed_dictionaries(
    {"status": st.sampled_from(STATUSES)},
    optional=dict.fromkeys(
        ("topic", "subscriber", "id", "connections", "cpu_s", "max_rss_bytes", "name"), JSON_VALUES
    ),
)
_CHANNEL = st.dictionaries(st.sampled_from(sorted(CHANNEL)), JSON_VALUES, max_size=1).map(
    lambda change: {**CHANNEL, **change}
)
_PAYLOADS: dict[str, SearchStrategy[bytes]] = {
    "E": st.one_of(_event(), _event(), JSON_VALUES).map(lambda value: json.dumps(value).encode()),
    "C": st.one_of(st.just(CHANNEL), _CHANNEL).map(lambda value: json.dumps(value).encode()),
    "S": st.one_of(_STATUS, JSON_VALUES).map(lambda value: json.dumps(value).encode()),
    "M": st.one_of(_messages(), _messages(), st.binary(max_size=10)),
    "x": st.binary(max_size=10),
}


def frames() -> SearchStrategy[bytes]:
    return st.lists(_frame(), max_size=8).map(b"".join)


@st.composite
def header(draw: st.DrawFn) -> bytes:
    names = words("type", "md5sum", "callerid", "latching", "message_definition", "error", "topic", "service")
    fields = draw(
        st.lists(st.tuples(names, st.sampled_from(("=", "=", "=", "")), words("std_msgs/String", "*", "1")))
    )
    lines = ["".join(field).encode("utf-8", "surrogatepass") for field in fields]
    return draw(sized(b"".join(draw(sized(line)) for line in lines))) + draw(st.binary(max_size=4))


def service_answer() -> SearchStrategy[bytes]:
    """A header, then whether it worked and the answer behind its length."""
    answer = st.binary(max_size=20).flatmap(sized)
    return st.builds(
        lambda head, ok, data: head + ok + data, header(), st.sampled_from((b"\0", b"\1", b"")), answer
    )


def topic_stream() -> SearchStrategy[bytes]:
    return st.lists(st.binary(max_size=30).flatmap(sized), max_size=8).map(b"".join)


def xmlrpc() -> SearchStrategy[bytes]:
    scalars = st.builds(
        "<{0}>{1}</{0}>".format,
        st.sampled_from(("int", "i4", "i8", "boolean", "string", "double", "base64", "dateTime.iso8601", "nil")),
        words("1", "-2147483648", "99999999999", "1e999", "x", "MQ==", "20200101T00:00:00", "&#0;", "&lt;", "]]>"),
    )  # fmt: skip

    def around(inner: SearchStrategy[str]) -> SearchStrategy[str]:
        value = inner.map("<value>{}</value>".format)
        member = st.builds("<member><name>{}</name>{}</member>".format, words("a", "b"), value)
        return st.one_of(
            joined(value, most=4).map("<array><data>{}</data></array>".format),
            joined(member, most=3).map("<struct>{}</struct>".format),
            joined(value, most=2),
        )

    values = joined(
        st.recursive(scalars, around, max_leaves=10).map("<param><value>{}</value></param>".format), most=3
    )
    frames_ = st.sampled_from(
        (
            "<?xml version='1.0'?><methodResponse><params>{}</params></methodResponse>",
            "<methodCall><methodName>registerPublisher</methodName><params>{}</params></methodCall>",
            "<methodResponse><fault>{}</fault></methodResponse>",
            '<!DOCTYPE a [<!ENTITY x "y">]><methodResponse>{}</methodResponse>',
            "{}",
        )
    )
    return encoded(st.builds(str.format, frames_, values))
