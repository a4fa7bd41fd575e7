"""Why what a check looks for is not there at all."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any

from pydantic import AfterValidator

from grader.checks.hears import HAND_IN
from grader.checks.registry import Check
from grader.checks.support.exit_causes import explain_end
from grader.checks.support.processes import Life, early_end, life, lives
from grader.checks.support.text import listed, near_names, plural
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, inconclusive, unjudged

SYSTEM_TOPICS = frozenset({"/rosout", "/rosout_agg", "/clock"})


def no_node(package: PackageFacts, run: Run, what: str) -> Verdict | None:
    """`what` is missing (`nothing came on /x`) because no node was there; None where one was."""
    if run.foreign:
        return unjudged(f"{what} in this recording", hint="record it too, with rosbag record -a")
    if not lives(run):
        return unjudged(f"{what}: there was nothing to run", measured="not started", hint=HAND_IN)
    ended = early_end(run)
    if ended is not None:
        end = explain_end(ended, run, package)
        message = f"{what}: {ended.name} ended before ({end.cause})"
        return unjudged(message, measured="ended", hint=end.hint, citations=end.citations)
    if not run.student_nodes():
        hint = "call rospy.init_node(…), and run the node"
        return unjudged(f"{what}: no node was registered", measured="no node", hint=hint)
    return None


def no_message(package: PackageFacts, run: Run, topic: str) -> Verdict:
    """Why nothing that can be judged came on a topic."""
    if lost := all_lost(run, topic):
        return lost
    published = published_topics(run)
    measured = listed(published) or "no topic"
    near = near_names(topic, published)
    if topic not in published and near:
        message = f"nothing came on {topic}; the node publishes on {listed(near)}"
        return unjudged(message, measured=measured, hint=f"name the topic {topic}")
    refused = [e for _, e in run.recorder if e.topic == topic and e.event in {"refused", "invalid"}]
    if refused and not run.student_channels(topic):
        message = f"the recorder could not listen to {topic}: {refused[0].detail or refused[0].event}"
        return inconclusive(message, measured=measured, hint="grade again")
    if absent := no_node(package, run, f"nothing came on {topic}"):
        return absent
    if topic in published:
        message = f"{topic} is advertised, but no message ever came"
        return unjudged(message, measured="no message", hint="call publish(…) on it")
    message = f"nothing came on {topic}: no node publishes on it"
    return unjudged(message, measured=measured, hint=f"look at rostopic info {topic}")


def published_topics(run: Run) -> dict[str, str]:
    """Every topic on which a node of the student's publishes or could, with its type; system topics left out."""
    found = {c.topic: c.type for c in run.student_channels()}
    for _, event in run.graph:
        for topic, nodes in event.publishers.items():
            if any(run.is_student_node(n) for n in nodes):
                found.setdefault(topic, event.topic_types.get(topic, ""))
    return {topic: kind for topic, kind in found.items() if topic not in SYSTEM_TOPICS}


def life_of(run: Run, node: str) -> Life | None:
    """The process that a node belongs to; None where it cannot be told, or is not the student's."""
    return life(run, next((e.processes[node] for _, e in reversed(run.graph) if node in e.processes), ""))


LOGGED = frozenset({"logs", "hears"})
"""Checks that also read what is logged."""
TAKEN = {Status.FAIL, Status.PARTIAL}


class Losses(Record):
    """From `at_ns` on messages of the topic are missing: `dropped` of them, or nobody knows how many (0)."""

    topic: str
    at_ns: int
    kept: int
    dropped: int

    @property
    def words(self) -> str:
        if self.dropped:
            return (
                f"the recorder kept {plural(self.kept, 'message')} of {self.topic} and dropped {self.dropped}"
            )
        return f"the recorder may have missed messages of {self.topic}, because it could not keep up"


def losses(run: Run, topic: str) -> Losses | None:
    """What is missing of a topic, None where the recorder took all that came."""
    events = [(at_ns, e) for at_ns, e in run.recorder if e.topic == topic]
    lost = [at_ns for at_ns, e in events if e.event in {"limit", "behind"} or e.dropped]
    if not lost:
        return None
    kept = sum(len(c.messages) for c in run.channels if c.topic == topic)
    return Losses(topic=topic, at_ns=min(lost), kept=kept, dropped=sum(e.dropped for _, e in events))


def whole_until_ns(run: Run, topic: str, until_ns: int | None = None) -> int | None:
    """Up to when every message of the topic was recorded, `until_ns` at the most."""
    lost = losses(run, topic)
    if lost is None:
        return until_ns
    return lost.at_ns - 1 if until_ns is None else min(until_ns, lost.at_ns - 1)


def all_lost(run: Run, topic: str) -> Verdict | None:
    """Where nothing came on a topic because the recorder dropped it."""
    lost = losses(run, topic)
    if lost is None or lost.kept:
        return None
    return inconclusive(f"nothing is recorded of {topic}", measured="no message", hint="grade again")


def heed_losses(check: Check, facts: Mapping[str, object], verdict: Verdict) -> Verdict:
    """The verdict with what the recorder lost of its topics.

    A lost mark becomes `inconclusive`, unless the check rests on what came whole (`heeds_losses`).
    """
    run = facts.get("run")
    if not isinstance(run, Run):
        return verdict
    found = [one for topic in _topics(check, facts.get("params")) if (one := losses(run, topic))]
    if not found:
        return verdict
    message = "; ".join([verdict.message, *(one.words for one in found)])
    update: dict[str, object] = {"message": message}
    if verdict.status in TAKEN and not check.heeds_losses:
        update |= {"status": Status.INCONCLUSIVE, "score": 0.0, "unjudged": False, "hint": "grade again"}
    return verdict.model_copy(update=update)


def _topics(check: Check, params: object) -> Iterable[str]:
    """Whatever of its parameters may be the name of a topic."""
    named = dict.fromkeys(_texts(params.model_dump() if isinstance(params, Record) else None))
    return (*named, "/rosout") if check.name in LOGGED and "/rosout" not in named else named


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _texts(key)
            yield from _texts(item)
    elif isinstance(value, list | tuple | set | frozenset):
        for item in value:
            yield from _texts(item)


_STEP = r"[A-Za-z]\w*(?:\[(?:\d+|\*)\])*"
_PARTS = re.compile(r"[A-Za-z]\w*|\[(?:\d+|\*)\]")


def _sound(path: str) -> str:
    if not re.fullmatch(rf"{_STEP}(?:\.{_STEP})*", path):
        raise ValueError(f'must be a field like linear.x, ranges[0] or ranges[*], not "{path}"')
    return path


FieldPath = Annotated[str, AfterValidator(_sound)]


class NoField(LookupError):
    """What of the path is not there, and what is there instead."""


def values_at(message: Any, path: str) -> list[Any]:  # noqa: ANN401 - decoded messages hold anything
    """All values that the path names, several where it holds `[*]`. Raises NoField."""
    found, done = [message], ""
    for part in _PARTS.findall(path):
        found = [item for one in found for item in _step(one, part, done)]
        done += part if part.startswith("[") else f".{part}" if done else part
    return found


def _step(value: Any, part: str, done: str) -> list[Any]:  # noqa: ANN401 - as above
    if not part.startswith("["):
        if isinstance(value, Mapping) and part in value:
            return [value[part]]
        there = ", ".join(value) if isinstance(value, Mapping) else ""
        raise NoField(f"{done or 'the message'} has no field {part}" + (f", but {there}" if there else ""))
    if not isinstance(value, list | tuple | bytes):
        raise NoField(f"{done} is no list")
    if part == "[*]":
        return list(value)
    index = int(part[1:-1])
    if index >= len(value):
        raise NoField(f"{done} has {len(value)} items only")
    return [value[index]]
