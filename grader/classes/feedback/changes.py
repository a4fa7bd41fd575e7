"""What has changed between two results of one submission, in words: `85 → 95: override by ann, clear names (style)`."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from grader.classes.batch.regrade import Change, pairs
from grader.model.result import AppliedOverride, GradingResult
from grader.report.view import not_graded
from grader.wording import number, plural


def changes_between(
    before: GradingResult, after: GradingResult, hidden: Collection[str] = ()
) -> tuple[str, ...]:
    """Return a line for the points if one thing changed, else one for the points and one for each change; none if the
    marks and all that people said of them are the same. Criteria of the ids in `hidden` are counted and not named."""
    points = f"{_total(before)} → {_total(after)}" if _total(before) != _total(after) else ""
    causes = [*_whole(before, after)]
    if not_graded(before) == not_graded(after):
        causes = [*_criteria(before, after, hidden), *causes]
    if len(causes) == 1 and points:
        return (f"{points}: {causes[0]}",)
    return tuple(line for line in (points, *causes) if line)


def _total(result: GradingResult) -> str:
    if not_graded(result):
        return "not graded"
    return number(result.points) + (" (not settled)" if result.status == "inconclusive" else "")


def _criteria(before: GradingResult, after: GradingResult, hidden: Collection[str]) -> Iterator[str]:
    overrides = [{o.criterion: o for o in result.overrides} for result in (before, after)]
    unseen = 0
    for change in pairs(before, after):
        was, now = (found.get(change.criterion) for found in overrides)
        decided = _decision(was) != _decision(now)
        if not decided and _state(change, "before") == _state(change, "after"):
            continue
        if change.criterion in hidden:
            unseen += 1
        elif decided:
            yield f"{_override(now)} ({change.criterion})"
        else:
            yield f"judged again ({change.criterion}): {change.why}"
    if unseen:
        yield f"{plural(unseen, 'criterion', 'criteria')} that your course does not show"


def _state(change: Change, which: str) -> tuple[object, ...]:
    criterion = change.before if which == "before" else change.after
    if criterion is None:
        return ()
    return criterion.status, criterion.points, criterion.max_points, criterion.left_out is None


def _decision(override: AppliedOverride | None) -> tuple[object, ...]:
    return (override.points, override.comment, override.author) if override else ()


def _override(override: AppliedOverride | None) -> str:
    if override is None:
        return "an override was taken back"
    comment = f", {override.comment}" if override.comment else ""
    return f"override by {override.author or 'a person'}{comment}"


def _whole(before: GradingResult, after: GradingResult) -> Iterator[str]:
    late, was = (
        r.late.text if r.late and r.late.points != r.late.points_before else "" for r in (after, before)
    )
    if late != was:
        yield late or "no late penalty"
    if before.gate != after.gate:
        gate = after.gate
        yield (
            f"no more than {number(gate.at_most)} points without a criterion" if gate else "no gate any more"
        )
    if before.error != after.error and after.error is not None:
        yield after.error.message
    if before.submission.commit != after.submission.commit:
        yield f"commit {(after.submission.commit or 'unknown')[:7]} was graded"
    if before.rubric.digest != after.rubric.digest and before.max_points != after.max_points:
        yield f"out of {number(after.max_points)} points, not {number(before.max_points)}"
