"""A small recorded run that several tests read."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from grader.evidence import decode
from grader.evidence.events import ConsoleLine, GraphEvent, ProcessEvent, ScenarioEvent
from grader.evidence.writer import EvidenceStream
from tests.support.timeline_facts import complete_facts

T0 = 1_700_000_000_000_000_000
MS = 1_000_000
METADATA = {"submission": '{"id": "ada"}', "grader": "0.1.0"}
ABOUT: dict[str, Any] = {"scenario": "talker", "clock": "real", "warp": 1.0, "metadata": METADATA}


def identity(topic: str, type_: str, callerid: str = "/talker") -> dict[str, Any]:
    return {
        "topic": topic,
        "callerid": callerid,
        "type": type_,
        "md5sum": decode.md5sum(type_),
        "definition": decode.definition(type_),
        "latching": False,
    }


def fill(writer: EvidenceStream, count: int = 30) -> None:
    """Two talkers, a silent publisher, some events, the package and a file of it."""
    writer.register_channel(**identity("/silent", "std_msgs/Header"))
    writer.event("/grader/scenario", T0, ScenarioEvent(event="begin"))
    writer.event("/grader/process", T0, ProcessEvent(event="start", name="talker", role="student"))
    graph = GraphEvent(
        nodes=("/talker", "/rosout"), topic_types={}, publishers={}, subscribers={}, services={}
    )
    writer.event("/grader/graph", T0, graph)
    for n in range(count):
        at = T0 + n * 100 * MS
        data = decode.encode("std_msgs/Int8", {"data": n % 128})
        writer.register_channel(**identity("/numeric", "std_msgs/Int8")).message(at, data)
        text = decode.encode("std_msgs/String", {"data": f"hello {n}"})
        writer.register_channel(**identity("/chatter", "std_msgs/String")).message(at + 1, text)
        writer.event(
            "/grader/console", at + 2, ConsoleLine(process="talker", stream="stdout", line=f"hé {n}")
        )
    writer.package(complete_facts({"name": "lab1"}), T0)
    writer.attach("src/talker.py", b"#!/usr/bin/env python3\n", T0, "text/x-python")
    end = T0 + count * 100 * MS
    writer.event("/grader/scenario", end, ScenarioEvent(event="end", outcome="complete"))


def sample(count: int = 30, **about: Any) -> bytes:
    stream = BytesIO()
    writer = EvidenceStream(stream, **{**ABOUT, **about})
    fill(writer, count)
    writer.finish()
    return stream.getvalue()
