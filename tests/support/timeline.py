"""Builds evidence from its text form (docs/reference/evidence-timelines.md), for fixtures and for trying a rubric."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pydantic import TypeAdapter
from rosbags.rosbag1 import Writer

from grader.evidence import decode
from grader.evidence.events import (
    ActorEvent,
    Connection,
    ConsoleLine,
    GraphEvent,
    HostEvent,
    ParamEvent,
    ProcessEvent,
    RecorderEvent,
    ScenarioEvent,
)
from grader.evidence.reader import load_run
from grader.evidence.run import Run, left_name
from grader.evidence.writer import EvidenceStream, EvidenceWriter
from grader.model.record import Record
from tests.support.timeline_facts import complete_facts
from tests.support.timeline_model import Acted, Host, LeftLine, Printed, TimelineRun, TopicLine
from tests.support.timeline_topics import Sent, messages

EPOCH_NS = 1_700_000_000_000_000_000
"""Where second 0 of every timeline lies: 2023-11-14 22:13:20 UTC."""

PACKAGE_RUN = "package"
RUNS = TypeAdapter(dict[str, dict[str, Any] | None])
Event = tuple[int, str, Record]


def build_runs(timeline: Mapping[str, Any]) -> dict[str, Run]:
    """The timeline's runs by scenario, each written as an evidence file in memory and read back.

    Raises ValueError (pydantic's ValidationError among them) for unknown keys and values that do not fit.
    """
    runs: dict[str, Run] = {}
    for name, data in _written(timeline):
        stream = BytesIO(data)
        stream.name = f"{name}.mcap"  # citations name the file
        run = load_run(stream)
        runs[run.scenario] = run
    return runs


WRITTEN: dict[str, tuple[tuple[str, bytes], ...]] = {}
"""The files of each timeline, by its text: one of five is asked for again."""


def _written(timeline: Mapping[str, Any]) -> tuple[tuple[str, bytes], ...]:
    """Return the file of each run."""
    key = repr(timeline)
    if key not in WRITTEN:
        found = []
        for name, line in parse_timeline(timeline).items():
            stream = BytesIO()
            writer = EvidenceStream(stream, **_about(name, line))
            _record(line, writer)
            writer.finish()
            found.append((name, stream.getvalue()))
        WRITTEN[key] = tuple(found)
    return WRITTEN[key]


def write_runs(timeline: Mapping[str, Any], folder: Path) -> list[Path]:
    """The same as files `<scenario>.mcap` in `folder`. Raises ValueError as `build_runs`, and OutputError."""
    paths = []
    for name, line in parse_timeline(timeline).items():
        paths.append(folder / f"{name}.mcap")
        with EvidenceWriter(paths[-1], **_about(name, line)) as writer:
            _record(line, writer)
    return paths


def parse_timeline(timeline: Mapping[str, Any]) -> dict[str, TimelineRun]:
    """The runs by name. One may stand at the top without `runs`; `package` there is a run of its own."""
    top = dict(timeline)
    package = top.pop("package", None)
    if "runs" in top:
        if unknown := top.keys() - {"runs"}:
            raise ValueError(f"unknown beside `runs`: {', '.join(sorted(map(str, unknown)))}")
        runs = RUNS.validate_python(top["runs"])
        given = {name: dict(keys or {}) for name, keys in runs.items()}
    else:
        given = {str(top.get("scenario", "run")): top} if top else {}
    if package is not None:
        own = given.setdefault(PACKAGE_RUN, {})
        if "package" in own:
            raise ValueError("`package` is given twice")
        own["package"] = package
    return {name: TimelineRun.model_validate(keys) for name, keys in given.items()}


def at_ns(seconds: float) -> int:
    """The `log_time` (ns) of a second of the timeline."""
    return EPOCH_NS + round(seconds * 1e9)


def _about(name: str, line: TimelineRun) -> dict[str, Any]:
    scenario = line.scenario or name
    return {"scenario": scenario, "clock": line.clock, "warp": line.warp, "metadata": line.metadata}


def _record(line: TimelineRun, writer: EvidenceStream) -> None:
    sent = [(topic, messages(topic)) for topic in line.topics]
    events = [*_events(line)]
    end_ns = _end_ns(line, sent, events)
    events += [*_processes(line, end_ns), *_course(line, end_ns)]
    queue: list[tuple[int, Callable[[], None]]] = []
    for topic, ones in sent:
        channel = writer.register_channel(**_identity(topic))
        times = ((at_ns(one.at_s), one) for one in ones)
        queue += [(time_ns, partial(channel.message, time_ns, one.data)) for time_ns, one in times]
    queue += [(time_ns, _noter(writer, event)) for event in events for time_ns in [event[0]]]
    for _, write in sorted(queue, key=lambda item: item[0]):
        write()
    if line.package is not None:
        writer.package(complete_facts(line.package), EPOCH_NS)
    for name, text in line.attachments.items():
        writer.attach(name, text.encode(), EPOCH_NS, "text/plain")
    for left in line.left:
        _left(left, writer)


def _left(left: LeftLine, writer: EvidenceStream) -> None:
    data = None if left.text is None else left.text.encode()
    if left.topics is not None:
        data = _bag(left.topics)
    size_bytes = left.size_bytes if data is None else len(data)
    event = ActorEvent(action="left", actor=left.process, value=size_bytes, detail=left.path)
    writer.event("/grader/actor", at_ns(left.at_s), event)
    if data is not None:
        name = left_name(left.process, left.path)
        writer.attach(name, data, at_ns(left.at_s), "application/octet-stream")


def _bag(topics: Sequence[TopicLine]) -> bytes:
    with TemporaryDirectory() as folder:
        with Writer(path := Path(folder, "left.bag")) as bag:
            for topic in topics:
                about = _identity(topic)
                number = bag.add_connection(
                    topic.topic,
                    topic.type.replace("/", "/msg/"),
                    msgdef=about["definition"],
                    md5sum=about["md5sum"],
                    callerid=topic.callerid,
                )
                for one in messages(topic):
                    bag.write(number, at_ns(one.at_s), one.data)
        return path.read_bytes()


def _noter(writer: EvidenceStream, event: Event) -> Callable[[], None]:
    time_ns, topic, record = event
    return lambda: writer.event(topic, time_ns, record)


def _identity(topic: TopicLine) -> dict[str, Any]:
    own = topic.definition is not None
    return {
        "topic": topic.topic,
        "callerid": topic.callerid,
        "type": topic.type,
        "md5sum": topic.md5sum
        if topic.md5sum is not None
        else "0" * 32
        if own
        else decode.md5sum(topic.type),
        "definition": topic.definition if own else decode.definition(topic.type),
        "latching": topic.latching,
    }


def _end_ns(line: TimelineRun, sent: list[tuple[TopicLine, list[Sent]]], events: list[Event]) -> int:
    if line.end_s is not None:
        return at_ns(line.end_s)
    times = [one.at_s for _, ones in sent for one in ones]
    times += [value for p in line.processes for value in (p.start_s, p.exit_s or 0.0)]
    return (
        max([at_ns(t) for t in times] + [time_ns for time_ns, _, _ in events], default=EPOCH_NS) + 100_000_000
    )


def _events(line: TimelineRun) -> Iterator[Event]:
    for printed in line.console:
        yield from _printed(printed)
    for acted in line.actors:
        yield from _acted(acted)
    for param in line.params:
        yield at_ns(param.at_s), "/grader/param", _as(ParamEvent, param)
    for host in [Host()] if line.host is None else line.host:
        yield at_ns(host.at_s), "/grader/host", _as(HostEvent, host)
    if line.graph is None:
        yield at_ns(0.4), "/grader/graph", _graph(line)
    for graph in line.graph or ():
        yield at_ns(graph.at_s), "/grader/graph", _as(GraphEvent, graph)
    if line.recorder is None:
        for topic in line.topics:
            connected = RecorderEvent(event="connected", topic=topic.topic, callerid=topic.callerid)
            yield at_ns(0.4), "/grader/recorder", connected
    for recorder in line.recorder or ():
        yield at_ns(recorder.at_s), "/grader/recorder", _as(RecorderEvent, recorder)


def _as(kind: type[Record], line: Record) -> Record:
    """The event without what only the timeline has."""
    return kind(**{name: getattr(line, name) for name in kind.model_fields})


def _printed(printed: Printed) -> Iterator[Event]:
    for number, text in enumerate(printed.lines or (printed.line,)):
        time_ns = at_ns(printed.at_s + number * printed.every_s)
        yield time_ns, "/grader/console", _as(ConsoleLine, printed.model_copy(update={"line": text}))


def _acted(acted: Acted) -> Iterator[Event]:
    for number, value in enumerate(acted.values or (acted.value,)):
        time_ns = at_ns(acted.at_s + number * acted.every_s)
        yield time_ns, "/grader/actor", _as(ActorEvent, acted.model_copy(update={"value": value}))


def _graph(line: TimelineRun) -> GraphEvent:
    publishers: dict[str, tuple[str, ...]] = {}
    for topic in line.topics:
        publishers[topic.topic] = tuple(dict.fromkeys((*publishers.get(topic.topic, ()), topic.callerid)))
    pairs = [
        (topic, publisher, subscriber)
        for topic, subscribers in line.subscribers.items()
        for publisher in publishers.get(topic, ())
        for subscriber in subscribers
    ]
    processes = {node: process.name for process in line.processes for node in process.nodes}
    nodes = {n for names in (*publishers.values(), *line.subscribers.values()) for n in names}
    nodes |= processes.keys() | {service.node for service in line.services.values()}
    return GraphEvent(
        nodes=("/rosout", *sorted(nodes - {"/rosout"})),
        topic_types={topic.topic: topic.type for topic in line.topics},
        publishers=publishers,
        subscribers=line.subscribers,
        services={name: (service.node,) for name, service in line.services.items()},
        connections=tuple(Connection(topic=t, publisher=p, subscriber=s) for t, p, s in pairs),
        processes=processes,
        service_types={name: service.type for name, service in line.services.items() if service.type},
    )


def _processes(line: TimelineRun, end_ns: int) -> Iterator[Event]:
    for process in line.processes:
        known = {"name": process.name, "role": process.role, "argv": process.argv, "script": process.script}
        start = ProcessEvent(event="start", repairs=process.repairs, **known)
        yield at_ns(process.start_s), "/grader/process", start
        if process.ends:
            how = {
                k: getattr(process, k)
                for k in ("exit_code", "signal", "stopped_by", "cpu_s", "max_rss_bytes")
            }
            time_ns = end_ns if process.exit_s is None else at_ns(process.exit_s)
            yield (
                time_ns,
                "/grader/process",
                ProcessEvent(event="exit", repairs=process.repairs, **known, **how),
            )


def _course(line: TimelineRun, end_ns: int) -> Iterator[Event]:
    yield EPOCH_NS, "/grader/scenario", ScenarioEvent(event="begin")
    yield at_ns(0.4), "/grader/scenario", ScenarioEvent(event="ready")
    if line.outcome is not None:
        end = ScenarioEvent(event="end", outcome=line.outcome, detail=line.outcome_detail)
        yield end_ns, "/grader/scenario", end
