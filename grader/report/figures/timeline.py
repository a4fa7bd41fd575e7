"""A run on one axis of time: its processes, nodes, topics, what went to stderr, and what the grader did."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from grader.checks.support.processes import how_it_ended
from grader.checks.support.text import SHOWN_BEFORE_CHARS, bare
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.evidence.events import ActorEvent, ProcessEvent
from grader.evidence.run import Run
from grader.model.figure import Lane, Stretch, TimelineFigure
from grader.report.figures.bounds import is_drawn, named, second, short

LANES_MAX = 24
STRETCHES_MAX = 120
PARTS = 400
"""Messages that are nearer to each other than such a part of the run are drawn as one stretch."""
SAYS_LETTERS = 120
QUIET = frozenset({"clock", "interrupt", "open", "note", "left", "lookup", "read"})


def timeline_of(run: Run) -> TimelineFigure | None:
    """None where no process and no node was there: another tool's recording knows of messages alone."""
    lanes = [
        *_processes(run),
        *_nodes(run),
        *_topics(run),
        *_lane("log", "stderr", _errors(run)),
        *_lane("grader", "the grader", _actions(run)),
    ]
    if not any(lane.kind in {"process", "node"} for lane in lanes):
        return None
    return TimelineFigure(
        scenario=named(run.scenario),
        length_s=second(run, run.end_ns),
        lanes=tuple(lanes[:LANES_MAX]),
        left_out=len(lanes[LANES_MAX:]),
    )


def _lane(kind: str, name: str, stretches: Iterable[Stretch]) -> Iterator[Lane]:
    found = tuple(stretches)
    if found:
        yield Lane.model_validate({"kind": kind, "name": named(name), "stretches": found[:STRETCHES_MAX]})


def _processes(run: Run) -> Iterator[Lane]:
    names = dict.fromkeys(event.name for _, event in run.processes if event.role != "build")
    for name in names:
        yield from _lane("process", name, _lives(run, name))


def _lives(run: Run, name: str) -> Iterator[Stretch]:
    begin: int | None = None
    for time_ns, event in run.processes:
        if event.name != name:
            continue
        if event.event == "start":
            begin = time_ns
        elif begin is not None:
            yield _stretch(run, begin, time_ns, _ended(event), wrong=_failed(event))
            begin = None
    if begin is not None:
        yield _stretch(run, begin, run.end_ns, "ran to the end")


def _ended(event: ProcessEvent) -> str:
    stopped = {"INT": "Ctrl-C, then "}.get(event.stopped_by or "", f"{event.stopped_by}, then ")
    return (stopped if event.stopped_by else "ended by itself: ") + how_it_ended(event)


def _failed(event: ProcessEvent) -> bool:
    killed = event.stopped_by == "KILL" and event.role == "student"
    return killed or (event.stopped_by is None and event.exit_code != 0)


def _nodes(run: Run) -> Iterator[Lane]:
    """From the first of the master's states that has a node up to the first that has it no longer."""
    for node in filter(is_drawn, (*run.student_nodes(), *sorted(run.grader_nodes - {"/rosout"}))):
        yield from _lane("node", node, _there(run, node))


def _there(run: Run, node: str) -> Iterator[Stretch]:
    begin: int | None = None
    for time_ns, state in run.graph:
        if node in state.nodes and begin is None:
            begin = time_ns
        elif node not in state.nodes and begin is not None:
            yield _stretch(run, begin, time_ns, "registered with the master")
            begin = None
    if begin is not None:
        yield _stretch(run, begin, run.end_ns, "registered with the master")


def _topics(run: Run) -> Iterator[Lane]:
    size_ns = max(1, (run.end_ns - run.start_ns) // PARTS)
    topics = (c.topic for c in run.channels if c.topic not in SYSTEM_TOPICS and is_drawn(c.topic))
    for topic in dict.fromkeys(topics):
        times = sorted(time for c in run.channels if c.topic == topic for time in c.times_ns)
        yield from _lane("topic", topic, _messages(run, times, size_ns))


def _messages(run: Run, times: Sequence[int], size_ns: int) -> Iterator[Stretch]:
    """Of very many, the stretches are longer."""
    while len(found := list(_joined(times, size_ns))) > STRETCHES_MAX:
        size_ns *= 2
    for begin, end, count in found:
        yield _stretch(run, begin, end, f"{count} messages" if count > 1 else "")


def _joined(times: Sequence[int], size_ns: int) -> Iterator[tuple[int, int, int]]:
    """Yield the first time, the last time and the number of those that follow each other so closely."""
    begin, count = 0, 0
    for i, time_ns in enumerate(times):
        count += 1
        if i + 1 == len(times) or times[i + 1] - time_ns > size_ns:
            yield times[begin], time_ns, count
            begin, count = i + 1, 0


def _errors(run: Run) -> Iterator[Stretch]:
    own = {event.name for _, event in run.processes if event.role == "grader"}
    for time_ns, line in run.console:
        text = bare(line.line[:SHOWN_BEFORE_CHARS]).strip()
        if line.stream == "stderr" and line.process not in own and text:
            yield _stretch(run, time_ns, time_ns, f"{line.process}: {text}", wrong=True)


def _actions(run: Run) -> Iterator[Stretch]:
    for time_ns, event in run.actors:
        if event.action not in QUIET or event.action == "interrupt":
            yield _stretch(run, time_ns, time_ns, _done(event))


def _done(event: ActorEvent) -> str:
    """`publish /chatter "abc"`; `Ctrl-C`."""
    if event.action == "interrupt":
        return "Ctrl-C"
    value = "" if event.value is None else f"{event.value!r}"
    parts = (event.action.replace("_", " "), event.topic or "", value, event.detail)
    return " ".join(part for part in parts if part)


def _stretch(run: Run, from_ns: int, to_ns: int, says: str, *, wrong: bool = False) -> Stretch:
    begin = max(0.0, second(run, from_ns))
    return Stretch(
        from_s=round(begin, 3),
        to_s=round(max(begin, second(run, to_ns)), 3),
        says=short(says, SAYS_LETTERS),
        wrong=wrong,
    )
