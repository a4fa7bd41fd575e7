"""What the page keeps of one submission."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from urllib.parse import quote

from grader.model.batch import MISSING, ROSTER, CriterionInfo, Entry
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.sentences import without_sandbox
from grader.report.view import arrange
from grader.untrusted_text import line

REPORT = "report.html"
CHARS = 160
MESSAGE_CHARS = 300
LETTERS: Mapping[Status, str] = {
    Status.PASS: "p",
    Status.PARTIAL: "a",
    Status.FAIL: "f",
    Status.BLOCKED: "b",
    Status.INCONCLUSIVE: "i",
    Status.ERROR: "e",
    Status.MANUAL: "m",
}
"""A status in one sign: what the page's data and its style sheet call it."""
ABSENT = "n"
LOST, OPEN = "afb", "iem"
State = Literal["graded", "inconclusive", "manual", "error", "missing"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Problem:
    """Why a submission could not be graded; `roster` where the roster keeps it from that."""

    message: str
    hint: str
    roster: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class Line:
    """One submission; texts are visible ones of bounded length.

    `state` is `manual` where only a person's points are missing, `missing` where it is not graded yet. `letters` has
    one of `LETTERS` for each criterion of the rubric, in its order. `earned` are the points of criteria, by place,
    where they are not those of the status. `caused` are the points that each mistake cost in all, by the place of the
    criterion that asks for it. `folder` holds its reports, if there are any. `unwalled` says that it ran
    without a sandbox. Seconds.
    """

    id: str
    name: str
    group: str
    folder: str
    state: State
    points: float
    letters: str
    earned: Mapping[int, float]
    caused: Mapping[int, float]
    late_s: float
    late_lost: float
    decided: int
    look_again: int
    wall_s: float
    unwalled: str
    why: str
    problem: Problem | None

    @property
    def judged(self) -> bool:
        """Whether its points say anything."""
        return self.state in {"graded", "inconclusive", "manual"}

    def points_of(self, place: int, most: float) -> float:
        """What it has for the criterion at that place, which is worth `most`."""
        full = most if self.letters[place] == "p" else 0.0
        return self.earned.get(place, full)


def line_of(entry: Entry, result: GradingResult, criteria: Sequence[CriterionInfo]) -> Line:
    """One submission and its result, as the page shows it."""
    by_id = {criterion.id: criterion for criterion in result.criteria}
    judged = [by_id.get(criterion.id) for criterion in criteria]
    late = result.late
    return Line(
        id=line(entry.id, CHARS),
        name=line(entry.name, CHARS),
        group=line(entry.group, CHARS),
        folder=result.submission.id if _has_reports(result) else "",
        state=_state(result),
        points=result.points,
        letters="".join(
            LETTERS[found.status] if found and not found.left_out else ABSENT for found in judged
        ),
        earned={place: found.points for place, found in enumerate(judged) if found and _unusual(found)},
        caused=_caused(result, criteria),
        late_s=late.late_s if late else 0.0,
        late_lost=max(0.0, late.points_before - late.points) if late else 0.0,
        decided=len(result.overrides),
        look_again=sum(override.changed for override in result.overrides),
        wall_s=result.timing.wall_s,
        unwalled=line(without_sandbox(result.environment.sandbox), MESSAGE_CHARS),
        why=_why(result.criteria),
        problem=_problem(result),
    )


def _caused(result: GradingResult, criteria: Sequence[CriterionInfo]) -> dict[int, float]:
    if result.error is not None:
        return {}
    places = {criterion.id: place for place, criterion in enumerate(criteria)}
    lost = arrange(result).lost
    return {places[loss.criterion.id]: loss.points for loss in lost if loss.criterion.id in places}


def link_to(one: Line) -> str:
    """Return the submission's report; empty where it has none."""
    return f"{quote(one.folder, safe='', errors='replace')}/{REPORT}" if one.folder else ""


def _has_reports(result: GradingResult) -> bool:
    return result.error is None or result.error.kind not in {MISSING, ROSTER}


def _state(result: GradingResult) -> State:
    if result.error is not None and result.error.kind == MISSING:
        return "missing"
    if result.status == "inconclusive" and not _still_open(result.criteria):
        return "manual"
    return result.status


def _still_open(criteria: Iterable[CriterionResult]) -> list[CriterionResult]:
    """What another run could decide."""
    return [c for c in criteria if c.status.is_retryable and c.counts]


def _why(criteria: Iterable[CriterionResult]) -> str:
    """What is open, in a line."""
    found = _still_open(criteria)
    if not found:
        return ""
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return line(f"{found[0].id}: {found[0].message or found[0].title}", MESSAGE_CHARS) + more


def _unusual(criterion: CriterionResult) -> bool:
    full = criterion.max_points if criterion.status is Status.PASS else 0.0
    return criterion.points != full


def _problem(result: GradingResult) -> Problem | None:
    error = result.error
    if result.status != "error" or (error is not None and error.kind == MISSING):
        return None
    if error is None:
        return Problem(message=_why(result.criteria), hint="", roster=False)
    return Problem(
        message=line(error.message, MESSAGE_CHARS),
        hint=line(error.hint, MESSAGE_CHARS),
        roster=error.kind == ROSTER,
    )
