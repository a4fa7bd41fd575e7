"""From evidence and rubric to criteria: run the checks, find what blocks what, award the points."""

from __future__ import annotations

from collections.abc import Mapping
from graphlib import TopologicalSorter
from pathlib import PurePath
from traceback import extract_tb

from grader.checks import CHECKS, Check
from grader.checks.all_runs import NotRecorded
from grader.checks.support.topics import heed_losses
from grader.errors import EvidenceError
from grader.evidence.run import Run
from grader.judging.facts import Facts, try_facts
from grader.judging.summary import round_half_up
from grader.model.result import CriterionResult
from grader.model.verdict import Status, Verdict, inconclusive
from grader.rubric.model import Criterion, Rubric

MANUAL = "manual"


def judge(
    rubric: Rubric, runs: Mapping[str, Run], checks: Mapping[str, Check] = CHECKS
) -> tuple[CriterionResult, ...]:
    """Return every criterion in the rubric's order. `runs` maps scenarios, and `package`, to their recorded runs.

    `checks` are the grader's and the rubric's own (`LoadedRubric.checks`). The same evidence and rubric always give
    equal results; nothing that is wrong with the evidence raises.
    """
    facts = try_facts(rubric, runs)
    criteria = {c.id: c for c in rubric.criteria}
    verdicts: dict[str, Verdict] = {}
    roots: dict[str, str] = {}
    for name in TopologicalSorter({c.id: c.requires for c in rubric.criteria}).static_order():
        verdict = verdict_of(criteria[name], facts, checks)
        verdicts[name] = apply_requirements(criteria[name], verdict, verdicts, roots)
    return tuple(result_of(c, verdicts[c.id], rubric.digits) for c in rubric.criteria)


def verdict_of(criterion: Criterion, facts: Facts, checks: Mapping[str, Check] = CHECKS) -> Verdict:
    """Return what the criterion's check says; an exception inside it is not the student's fault and says so."""
    if criterion.check == MANUAL:
        return Verdict(status=Status.MANUAL, score=0.0, message="a person gives these points")
    check = checks.get(criterion.check)
    if check is None:
        message = f"this grader has no check {criterion.check!r}"
        return Verdict(
            status=Status.ERROR, score=0.0, message=message, hint="`grader rubric validate` finds this"
        )
    try:
        asked = facts.of(check, criterion, check.params.model_validate(criterion.parameters))
        return (
            asked
            if isinstance(asked, Verdict)
            else heed_losses(check, asked, _sound(check.function(**asked)))
        )
    except NotRecorded as missing:
        return missing.verdict
    except EvidenceError as error:
        return inconclusive(error.message, hint=error.hint)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong in a check must not cost a student a mark
        return _broken(check, error)


def _sound(verdict: object) -> Verdict:
    """Raise TypeError or ValueError for what an instructor's own check must not return."""
    if not isinstance(verdict, Verdict):
        raise TypeError(f"it returned {type(verdict).__name__}, no verdict: return passed(…) or failed(…)")
    if not 0 <= verdict.score <= 1:
        raise ValueError(f"its score is {verdict.score:g}: a score is 0 to 1")
    return verdict


def _broken(check: Check, error: Exception) -> Verdict:
    kind = type(error).__name__
    message = f"the check {check.name!r} itself failed ({kind}); no mark is lost by this"
    hint = "please report this with the evidence file"
    if check.source:
        lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == check.source]
        place = f"{PurePath(check.source).name}:{lines[-1]}" if lines else PurePath(check.source).name
        hint = f"for the instructor: {place}: {kind}: {error}"
    return Verdict(status=Status.ERROR, score=0.0, message=message, hint=hint)


def apply_requirements(
    criterion: Criterion, verdict: Verdict, verdicts: Mapping[str, Verdict], roots: dict[str, str]
) -> Verdict:
    """`blocked` where there was nothing to judge and a required criterion explains it, named by its root."""
    if not verdict.unjudged:
        return verdict
    blocking = next((r for r in criterion.requires if verdicts[r].status.is_lost), None)
    if blocking is not None:
        root = roots[criterion.id] = roots.get(blocking, blocking)
        message = f"blocked by {root}: {verdicts[root].message}"
        update = {"status": Status.BLOCKED, "message": message, "hint": f"fix {root} first"}
        return verdict.model_copy(update=update)
    undecided = next((r for r in criterion.requires if verdicts[r].status.is_open), None)
    if undecided is not None:
        message = f"{verdict.message}; and {undecided} could not be judged"
        return inconclusive(message, expected=verdict.expected, measured=verdict.measured, hint=verdict.hint)
    return verdict


def result_of(criterion: Criterion, verdict: Verdict, digits: int) -> CriterionResult:
    """Return the report's line of a criterion, with the points of its verdict."""
    lost = verdict.status.is_lost or verdict.status is Status.INCONCLUSIVE
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
