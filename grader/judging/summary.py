"""The result: what all criteria come to, notes on what was noticed while student code ran, and which files
of a loss are still as the course handed them out.

Points are rounded as people round them: half up, in decimals. Notes cost no points.
"""

from __future__ import annotations

import posixpath
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from decimal import ROUND_HALF_UP, Decimal
from pathlib import PurePosixPath
from platform import python_version
from typing import Literal

from grader import __version__
from grader.evidence.run import Run
from grader.judging.facts import starts_of
from grader.model.package import PackageFacts
from grader.model.result import (
    CriterionResult,
    EnvironmentInfo,
    Gate,
    GradingResult,
    LeftOut,
    Note,
    RubricInfo,
    RubricOrigin,
    SubmissionInfo,
    TimingInfo,
)
from grader.model.verdict import FileCitation, Status
from grader.rubric.load import LoadedRubric, names_in
from grader.rubric.model import Criterion, Rubric
from grader.untrusted_text import clip, clipped, json_text, text_limit
from grader.wording import join_words

LIMIT = 2000
KINDS = ("refused", "limit")
NOTES_MAX = 20
TEXT_CHARS = 300
ACTOR_CHARS = 100
EXACT_DIGITS = 6
"""More digits than points have, and fewer than rounding errors show in."""
NOTHING_RUN = "nothing was run"
"""In place of a sandbox's name."""


def assemble_result(
    submission: SubmissionInfo,
    rubric: LoadedRubric,
    criteria: tuple[CriterionResult, ...],
    *,
    runs: Mapping[str, Run],
    environment: EnvironmentInfo,
    timing: TimingInfo,
    rubric_origin: RubricOrigin | None = None,
) -> GradingResult:
    """Return the automatic result that these criteria make."""
    return GradingResult(
        submission=submission,
        rubric=RubricInfo(id=rubric.rubric.id, version=rubric.rubric.version, digest=rubric.digest),
        rubric_origin=rubric_origin,
        status=overall_status(criteria),
        points=total_points(rubric.rubric, criteria),
        gate=closed_gate(rubric.rubric, criteria),
        max_points=rubric.rubric.max_points,
        criteria=criteria,
        environment=environment,
        timing=timing,
        notes=notes_of(runs),
    )


def environment_info(ros: str = "", sandbox: str = "") -> EnvironmentInfo:
    """Return this grader and Python, with the names of the ROS and the sandbox that ran the submission."""
    return EnvironmentInfo(
        grader=__version__, ros=ros, python=python_version(), sandbox=sandbox or NOTHING_RUN
    )


def total_points(rubric: Rubric, results: Sequence[CriterionResult]) -> float:
    """Return the sum of the criteria's points, rounded half up to the rubric's digits: at least 0, at most what the
    gates leave."""
    gate = closed_gate(rubric, results)
    return gate.at_most if gate else max(0.0, _sum(rubric, results))


def closed_gate(rubric: Rubric, results: Sequence[CriterionResult]) -> Gate | None:
    """Return the gate that keeps the total lowest; None where none does."""
    lost = {r.id for r in results if r.status in {Status.FAIL, Status.BLOCKED}}
    points = _sum(rubric, results)
    closed = [gate for gate in rubric.gates if gate.criterion in lost and gate.at_most < points]
    lowest = min(closed, key=lambda gate: gate.at_most, default=None)
    return (
        None
        if lowest is None
        else Gate(criterion=lowest.criterion, at_most=lowest.at_most, points_before=points)
    )


def total_fields(rubric: Rubric, results: Sequence[CriterionResult]) -> dict[str, object]:
    """Return the fields of a result that these criteria come to."""
    return {"points": total_points(rubric, results), "gate": closed_gate(rubric, results)}


def _sum(rubric: Rubric, results: Sequence[CriterionResult]) -> float:
    total = sum((Decimal(repr(r.points)) for r in results), Decimal(0))
    return round_half_up(float(total), rubric.digits)


def leave_out(rubric: Rubric, results: Sequence[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Return the results without the points of those that do not count, because others of their group are better.

    Where two have as many points, the one that is still open counts, then the earlier one. What was left out before
    is taken in again first.
    """
    found = {r.id: r for r in take_in(results)}
    for name, group in rubric.groups.items():
        if group.best is None:
            continue
        members = [found[i] for i in group.criteria if i in found]
        # Of equal points, what is still open counts first: it may earn more.
        members.sort(key=lambda r: (-r.points, not r.status.is_open))
        for r in members[group.best :]:
            left_out = LeftOut(points=r.points, max_points=r.max_points, group=name)
            found[r.id] = r.model_copy(update={"points": 0.0, "max_points": 0.0, "left_out": left_out})
    return tuple(found.values())


def take_in(results: Sequence[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Return the results with the points of what was left out."""
    return tuple(
        r.model_copy(update={**r.left_out.model_dump(exclude={"group"}), "left_out": None})
        if r.left_out
        else r
        for r in results
    )


def overall_status(results: Sequence[CriterionResult]) -> Literal["graded", "inconclusive", "error"]:
    """Return `error` where a check of ours failed, `inconclusive` where points are still open, `graded` otherwise.

    Advice (0 points) does not hold up a result. No criteria at all are an error: nothing was judged.
    """
    counting = [r for r in results if r.counts]
    if not counting or any(r.status is Status.ERROR for r in counting):
        return "error"
    return "inconclusive" if any(r.status.is_open for r in counting) else "graded"


def scaled_pass_mark(rubric: Rubric, points: float) -> float | None:
    """Return the rubric's pass mark in proportion to the `points` that are counted; None where it has none."""
    if rubric.pass_mark is None:
        return None
    return round(rubric.pass_mark * points / (rubric.max_points or 1.0), EXACT_DIGITS)


def reached_pass_mark(rubric: Rubric, results: Sequence[CriterionResult]) -> bool:
    """Return whether the points reach the rubric's mark; without one, every visible criterion has to pass."""
    if rubric.pass_mark is not None:
        return total_points(rubric, results) >= rubric.pass_mark
    visible = {c.id for c in rubric.criteria if c.visibility == "visible"}
    judged = [r for r in results if r.id in visible and r.is_required]
    return bool(judged) and all(r.status is Status.PASS for r in judged)


def passed(rubric: Rubric, result: GradingResult) -> bool:
    """The same of a whole result: a mark in points is compared with those that count, lateness included. What came
    after the cut-off has passed nothing."""
    if rubric.pass_mark is not None:
        return result.points >= rubric.pass_mark
    if result.late is not None and result.points == 0 < result.late.points_before:
        return False
    return reached_pass_mark(rubric, result.criteria)


def criteria_text(results: Sequence[CriterionResult], *, ascii_only: bool = False) -> str:
    """Return the criteria as canonical JSON in the rubric's order: the same from `grader grade` and `grader judge`."""
    return json_text(_criteria(results), ascii_only=ascii_only)


def judged_text(
    rubric: Rubric, judged: Iterable[tuple[str, Sequence[CriterionResult] | str]], *, ascii_only: bool = False
) -> str:
    """Return several submissions as JSON, each with its points and criteria, or with the error in their place."""
    return json_text([_about(rubric, name, found) for name, found in judged], ascii_only=ascii_only)


def _about(rubric: Rubric, name: str, found: Sequence[CriterionResult] | str) -> dict[str, object]:
    if isinstance(found, str):
        return {"submission": name, "status": "error", "error": found[:LIMIT]}
    return {
        "submission": name,
        "status": overall_status(found),
        "points": total_points(rubric, found),
        "max_points": rubric.max_points,
        "criteria": _criteria(found),
    }


def _criteria(results: Sequence[CriterionResult]) -> object:
    data = [result.model_dump(mode="json") for result in results]
    return clipped(data, text_limit(len(results), LIMIT))


def criteria_bytes(results: Sequence[CriterionResult]) -> bytes:
    """Return the same as UTF-8."""
    return criteria_text(results).encode()


def round_half_up(points: float, digits: int) -> float:
    """Return the rounded points: `round_half_up(2.25, 1)` is 2.3, where Python's own `round` says 2.2."""
    step = Decimal(1).scaleb(-digits)
    # By its shortest text: 2.675 is a little less as a float, and would be rounded down.
    return float(Decimal(repr(points)).quantize(step, rounding=ROUND_HALF_UP))


def notes_of(runs: Mapping[str, Run]) -> tuple[Note, ...]:
    """Return the notes of all runs, in the order of the runs and of time; equal ones once, at most 20 of each kind a
    run.

    What was left out is counted in a last note. Recordings of other tools have none: no one watched.
    """
    return tuple(
        note
        for scenario, run in runs.items()
        if not run.foreign and "/" not in scenario  # what a repaired copy does is not the student's
        for kind in KINDS
        for note in _bound_notes(scenario, kind, tuple(dict.fromkeys(_notes(scenario, kind, run))))
    )


def _notes(scenario: str, kind: str, run: Run) -> Iterator[Note]:
    for _, event in run.actors:
        if event.action == kind:
            actor, text = clip(event.actor, ACTOR_CHARS), clip(event.detail, TEXT_CHARS)
            yield Note.model_validate({"scenario": scenario, "actor": actor, "kind": kind, "text": text})


def _bound_notes(scenario: str, kind: str, notes: tuple[Note, ...]) -> Iterator[Note]:
    yield from notes[:NOTES_MAX]
    left = len(notes) - NOTES_MAX
    if left > 0:
        text = f"and {left} more of this kind"
        yield Note.model_validate({"scenario": scenario, "actor": "", "kind": kind, "text": text})


CPP = frozenset({".cpp", ".cc", ".cxx"})


def name_unchanged_files(
    result: CriterionResult, rubric: Rubric, package: PackageFacts, handed_out: Collection[str]
) -> CriterionResult:
    """Return the criterion; where it is lost, with those of its files whose sha256 is among `handed_out`.

    Its files are those that it cites or its parameters name, and the programs of its run.
    """
    if result.status not in {Status.FAIL, Status.PARTIAL} or not handed_out:
        return result
    criterion = next(c for c in rubric.criteria if c.id == result.id)
    cited = {one.file for one in result.citations if isinstance(one, FileCitation)}
    names = names_in(criterion).union(_programs(criterion, rubric, package))
    own = rubric.package_of(criterion) if rubric.package_of(criterion) != rubric.package else ""
    unchanged = [
        path
        for one in (package, *package.also)
        for file in one.files
        if file.sha256 in handed_out
        and (
            (path := posixpath.normpath(f"{package.way_to(one)}/{file.path}")) in cited
            or (_is_named(path, names) and one.asked == own)
        )
    ]
    if not unchanged:
        return result
    verb, them = ("is", "it") if len(unchanged) == 1 else ("are", "them")
    told = f"{join_words(unchanged)} {verb} still as the course handed {them} out"
    return result.model_copy(update={"message": f"{result.message}; {told}"})


def _is_named(path: str, names: Collection[str]) -> bool:
    """Return whether the file is among the names; a program in C++ is named without its suffix."""
    file = PurePosixPath(path)
    return file.name in names or (file.suffix in CPP and file.stem in names)


def _programs(criterion: Criterion, rubric: Rubric, package: PackageFacts) -> Iterator[str]:
    """Yield the names of the student's programs in the criterion's run: of its process, where it judges one."""
    starts = starts_of(criterion, rubric)
    process = criterion.parameters.get("process")
    for start in [one for one in starts if one.name == process] or starts:
        if start.script is not None:
            yield PurePosixPath(start.script).name
        for launch in (file for one in (package, *package.also) for file in one.launch_files):
            if (
                start.launch is not None
                and PurePosixPath(launch.path).name == PurePosixPath(start.launch).name
            ):
                names = {one.name for one in (package, *package.also)}
                yield from (node.type for node in launch.brings if node.pkg in names and node.type)
