"""What the recorder did not keep of a topic, and what that means for a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from grader.checks.registry import Check
from grader.evidence.run import Run
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, inconclusive
from grader.wording import plural

LOGGED = frozenset({"logs", "hears"})
"""Families that also read what is logged."""
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
    return (*named, "/rosout") if check.family in LOGGED and "/rosout" not in named else named


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
