"""From evidence and rubric to criteria: runs the checks, settles what blocks what, gives the points."""

from __future__ import annotations

from collections.abc import Mapping
from graphlib import TopologicalSorter

from grader.checks import CHECKS
from grader.evidence.run import Run
from grader.judge.facts import Facts, try_facts
from grader.judge.points import round_half_up
from grader.model.result import CriterionResult
from grader.model.verdict import Status, Verdict, inconclusive
from grader.rubric.model import Criterion, Rubric

MANUAL = "manual"
EXPLAINS = {Status.FAIL, Status.PARTIAL, Status.BLOCKED}
OPEN = {Status.INCONCLUSIVE, Status.ERROR, Status.MANUAL}
WITH_HINT = {Status.FAIL, Status.PARTIAL, Status.BLOCKED, Status.INCONCLUSIVE}


def judge(rubric: Rubric, runs: Mapping[str, Run]) -> tuple[CriterionResult, ...]:
    """Every criterion in the rubric's order. `runs` maps scenarios, and `package`, to their recorded runs.

    The same evidence and rubric always give equal results; nothing that is wrong with the evidence raises.
    """
    facts = try_facts(rubric, runs)
    criteria = {c.id: c for c in rubric.criteria}
    verdicts: dict[str, Verdict] = {}
    roots: dict[str, str] = {}
    for name in TopologicalSorter({c.id: c.requires for c in rubric.criteria}).static_order():
        verdict = verdict_of(criteria[name], facts)
        verdicts[name] = _settled(criteria[name], verdict, verdicts, roots)
    return tuple(_result(c, verdicts[c.id], rubric.digits) for c in rubric.criteria)


def verdict_of(criterion: Criterion, facts: Facts) -> Verdict:
    """What the criterion's check says; an exception inside it is the grader's own fault and says so."""
    if criterion.check == MANUAL:
        return Verdict(status=Status.MANUAL, score=0.0, message="a person gives these points")
    check = CHECKS.get(criterion.check)
    if check is None:
        message = f"this grader has no check {criterion.check!r}"
        return Verdict(
            status=Status.ERROR, score=0.0, message=message, hint="`grader rubric validate` finds this"
        )
    try:
        asked = facts.of(check, criterion, check.params.model_validate(criterion.parameters))
        return asked if isinstance(asked, Verdict) else check.function(**asked)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong in a check must not cost a student a mark
        kind = type(error).__name__
        message = f"the check {check.name!r} itself failed ({kind}); no mark is lost by this"
        return Verdict(
            status=Status.ERROR, score=0.0, message=message, hint="please report this with the evidence file"
        )


def _settled(
    criterion: Criterion, verdict: Verdict, verdicts: Mapping[str, Verdict], roots: dict[str, str]
) -> Verdict:
    """`blocked` where there was nothing to judge and a required criterion explains it, named by its root."""
    if not verdict.unjudged:
        return verdict
    blocking = next((r for r in criterion.requires if verdicts[r].status in EXPLAINS), None)
    if blocking is not None:
        root = roots[criterion.id] = roots.get(blocking, blocking)
        message = f"blocked by {root}: {verdicts[root].message}"
        update = {"status": Status.BLOCKED, "message": message, "hint": f"mend {root} first"}
        return verdict.model_copy(update=update)
    unsettled = next((r for r in criterion.requires if verdicts[r].status in OPEN), None)
    if unsettled is not None:
        message = f"{verdict.message}; and {unsettled} could not be judged"
        return inconclusive(message, expected=verdict.expected, measured=verdict.measured, hint=verdict.hint)
    return verdict


def _result(criterion: Criterion, verdict: Verdict, digits: int) -> CriterionResult:
    lost = verdict.status in WITH_HINT
    return CriterionResult(
        id=criterion.id,
        title=criterion.title,
        check=criterion.check,
        scenario=criterion.scenario,
        status=verdict.status,
        points=round_half_up(verdict.score * criterion.points, digits),
        max_points=criterion.points,
        message=verdict.message,
        expected=verdict.expected,
        measured=verdict.measured,
        hint=verdict.hint or (criterion.hint if lost else ""),
        reproduce=criterion.reproduce,
        citations=verdict.citations,
    )
