"""What the recorder lost of a run's topics, and what a check may say then."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from grader.checks.registry import Check
from grader.checks.support.text import texts_in
from grader.evidence.events import RecorderEvent
from grader.evidence.run import Run
from grader.model.record import Record
from grader.model.verdict import Status, Verdict, grade_again
from grader.wording import plural

READ_TOO = {"logs": ("/rosout",), "hears": ("/rosout",), "transform": ("/tf", "/tf_static")}
"""Topics that a check reads, and that its parameters do not name."""
TAKEN = {Status.FAIL, Status.PARTIAL}


class Losses(Record):
    """From `at_ns` on messages of the topic are missing: `dropped` of them, or no one knows how many (0)."""

    topic: str
    at_ns: int
    kept: int
    dropped: int

    @property
    def words(self) -> str:
        if self.dropped:
            return f"the recorder kept {plural(self.kept, 'message')} of {self.topic}, dropped {self.dropped}"
        return f"the recorder may have missed messages of {self.topic}, because it could not keep up"


def losses(run: Run, topic: str) -> Losses | None:
    """Return what is missing of a topic, None where the recorder took all that came."""
    events = [(at_ns, e) for at_ns, e in run.recorder if e.topic == topic]
    lost = [at_ns for at_ns, e in events if _is_loss(e)]
    if not lost:
        return None
    kept = sum(len(c.messages) for c in run.channels if c.topic == topic)
    return Losses(topic=topic, at_ns=min(lost), kept=kept, dropped=sum(e.dropped for _, e in events))


def _is_loss(event: RecorderEvent) -> bool:
    return event.event in {"limit", "behind"} or event.dropped != 0


def whole_until_ns(run: Run, topic: str, until_ns: int | None = None) -> int | None:
    """Return until when every message of the topic was recorded, `until_ns` at the most."""
    lost = losses(run, topic)
    if lost is None:
        return until_ns
    return lost.at_ns - 1 if until_ns is None else min(until_ns, lost.at_ns - 1)


def all_lost(run: Run, topic: str) -> Verdict | None:
    """Return the verdict where nothing was recorded of a topic because the recorder dropped it."""
    lost = losses(run, topic)
    gone = lost is not None and not lost.kept
    return grade_again(f"nothing was recorded on {topic}", measured="no message") if gone else None


def account_for_losses(check: Check, facts: Mapping[str, object], verdict: Verdict) -> Verdict:
    """Return the verdict with what the recorder lost of its topics. A lost mark becomes `inconclusive`, unless the
    check rests on what came whole (`heeds_losses`): then what was lost only stands with what was measured."""
    run = facts.get("run")
    if not isinstance(run, Run) or not any(_is_loss(event) for _, event in run.recorder):
        return verdict
    found = [one for topic in _topics(check, facts.get("params")) if (one := losses(run, topic))]
    if not found:
        return verdict
    taken = verdict.status in TAKEN and not check.heeds_losses
    verdict = verdict.based_on(dropped=any(one.dropped for one in found))
    if not taken and verdict.status is not Status.INCONCLUSIVE:
        measured = "; ".join(filter(None, (verdict.measured, *(one.words for one in found))))
        return verdict.model_copy(update={"measured": measured})
    update: dict[str, object] = {"message": "; ".join([verdict.message, *(one.words for one in found)])}
    if taken:
        update |= {"status": Status.INCONCLUSIVE, "score": 0.0, "hint": "grade again"}
        verdict = verdict.based_on(unjudged=False)
    return verdict.model_copy(update=update)


def _topics(check: Check, params: object) -> Iterable[str]:
    """Whatever of its parameters may be the name of a topic."""
    named = texts_in(params.model_dump() if isinstance(params, Record) else None)
    return tuple(dict.fromkeys((*named, *READ_TOO.get(check.name, ()))))
