"""The test of a rubric: the reference solution and the mutants are graded, and what they lost is compared."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Callable, Collection, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from grader.authoring.mutation.faulty_packages import Planned
from grader.authoring.mutation.solution import Solution, Tree, unified_diff, write_tree
from grader.classes.batch.job import FolderJob, GradedSubmission, grade_all
from grader.errors import HostError
from grader.files import temporary_folder
from grader.model import SandboxMode
from grader.model.mutants import Cost, LostCriterion, Mutant, MutantResult, ReferenceResult, RubricTest, State
from grader.model.result import CriterionResult, GradingResult, Progress, RubricInfo
from grader.model.verdict import Status
from grader.rubric.load import LoadedRubric
from grader.wording import number

REFERENCE = "reference"
SOURCE = "source"
DIFF = "mutant.diff"
COSTING = {Status.FAIL.value, Status.PARTIAL.value}


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is to be tried. `given` is the solution's folder as the user knows it.

    `partial` is set where the user chose some of the mutants. With `keep_all`, folders of killed mutants stay, too.
    """

    rubric: LoadedRubric
    solution: Solution
    given: str
    mutants: Sequence[Planned]
    unfit: Sequence[str] = ()
    partial: bool = False
    jobs: int
    out: Path
    keep_all: bool
    sandbox: SandboxMode = "auto"


def run_test(plan: Plan, progress: Progress) -> RubricTest:
    """Grade everything and return what came of it. Raises HostError if this machine cannot judge the reference."""
    begun_s = time.monotonic()
    result = _grade_reference(plan, progress)
    reference = _judge_reference(plan, result, progress)
    mutants: list[MutantResult] = []
    if not reference.lost:
        mutants = _grade_mutants(plan, _find_ignored(result), progress, time.monotonic() - begun_s)
    uncosted = None if plan.partial or reference.lost else _find_uncosted(plan, mutants)
    killed = bool(mutants) and all(mutant.state == "killed" for mutant in mutants)
    rubric = plan.rubric
    return RubricTest(
        rubric=RubricInfo(id=rubric.rubric.id, version=rubric.rubric.version, digest=rubric.digest),
        solution=plan.given,
        reference=reference,
        mutants=tuple(mutants),
        uncosted=uncosted,
        unfit=tuple(plan.unfit),
        wall_s=round(time.monotonic() - begun_s, 3),
        passed=killed and not reference.lost and not uncosted,
    )


# ---- the reference solution


def _grade_reference(plan: Plan, progress: Progress) -> GradingResult:
    trees = {REFERENCE: plan.solution.tree}
    (graded,) = _grade_trees(plan, trees, 1, lambda _: progress.step(REFERENCE, "running"))
    if graded.result is None:
        raise HostError(f"the reference solution could not be graded: {graded.error}")
    doubtful = [c for c in graded.result.criteria if c.status.is_retryable]
    if doubtful:
        raise HostError(
            f"the reference solution could not be judged: {doubtful[0].id}: {doubtful[0].message}",
            hint=doubtful[0].hint or "`grader doctor` shows what this machine lacks",
        )
    return graded.result


def _judge_reference(plan: Plan, result: GradingResult, progress: Progress) -> ReferenceResult:
    """Return how the reference solution fared: every criterion that is worth points has to be reached."""
    lost = find_lost([c for c in result.criteria if c.counts and not c.left_out])
    said = "lost: " + ", ".join(c.id for c in lost) if lost else "everything reached"
    progress.step(REFERENCE, "failed" if lost else "done", said)
    return ReferenceResult(
        points=result.points,
        max_points=result.max_points,
        lost=lost,
        evidence=_keep_folder(plan, REFERENCE, plan.solution.tree, wanted=bool(lost)),
    )


def _find_ignored(result: GradingResult) -> frozenset[str]:
    """Return criteria that say nothing about mutants: advice that the correct package gets too, and manual ones."""
    return frozenset(c.id for c in result.criteria if c.status is not Status.PASS)


# ---- the mutants


def _grade_mutants(
    plan: Plan, ignored: frozenset[str], progress: Progress, expected_s: float
) -> list[MutantResult]:
    """Grade the mutants side by side, then once more, alone, those that are inconclusive."""
    results: dict[str, MutantResult] = {}

    def run(mutants: Iterable[Planned], jobs: int) -> None:
        named = {mutant.name: mutant for mutant in mutants}
        begun_s: dict[str, float] = {}

        def begun(name: str) -> None:
            begun_s[name] = time.monotonic()
            progress.step(named[name].label, "running", expected_s=expected_s)

        with closing(_grade_trees(plan, {n: m.tree for n, m in named.items()}, jobs, begun)) as gradings:
            for graded in gradings:
                took_s = time.monotonic() - begun_s[graded.name]
                result = _judge_mutant(plan, named[graded.name], graded, ignored, took_s)
                results[graded.name] = result
                progress.step(
                    result.label, "done" if result.state == "killed" else "failed", _describe(result)
                )

    run(sorted(plan.mutants, key=_ends_early), plan.jobs)
    for mutant in plan.mutants:
        if results[mutant.name].state == "inconclusive":
            run([mutant], 1)
    return [results[mutant.name] for mutant in plan.mutants]


def _ends_early(mutant: Planned) -> bool:
    """Return False for a faulty launch file, which then comes first: its run waits to its limit for the nodes."""
    return not any("launch" in name for name in (mutant.name, *mutant.mutant.operators))


def _describe(result: MutantResult) -> str:
    lost = ", ".join(criterion.id for criterion in result.lost) or "nothing"
    return f"{result.state}, lost: {result.error or lost}"


def _judge_mutant(
    plan: Plan, mutant: Planned, graded: GradedSubmission, ignored: frozenset[str], took_s: float
) -> MutantResult:
    criteria = graded.result.criteria if graded.result else ()
    compared = compare(mutant.costs, criteria, ignored) if graded.result else Comparison(state="error")
    if graded.result is not None and compared.state in {"killed", "differs"}:
        compared = compared.with_words(mutant.mutant, graded.result)
    return MutantResult(
        name=mutant.name,
        label=mutant.label,
        operator=" + ".join(mutant.mutant.operators),
        mistake=mutant.mistake,
        state=compared.state,
        expected=mutant.costs,
        lost=find_lost(criteria, ignored),
        missing=compared.missing,
        surplus=compared.surplus,
        differing=compared.differing,
        diff=unified_diff(plan.solution.tree, mutant.tree),
        evidence=_keep_folder(plan, mutant.name, mutant.tree, wanted=compared.state != "killed"),
        error=graded.error,
        wall_s=round(took_s, 3),
    )


def _find_uncosted(plan: Plan, results: Sequence[MutantResult]) -> tuple[str, ...]:
    """Return the criteria that are worth points and that no mutant fails."""
    failed = {c.id for result in results for c in result.lost if c.status in COSTING}
    criteria = plan.rubric.rubric.criteria
    return tuple(
        c.id for c in criteria if (c.points or c.extra) and c.check != "manual" and c.id not in failed
    )


# ---- gradings


def _grade_trees(
    plan: Plan, trees: Mapping[str, Tree], jobs: int, begun: Callable[[str], None]
) -> Generator[GradedSubmission, None, None]:
    """Grade each tree into `out/<name>/`.

    The trees are written outside of any repository: the modes that git knows would count for more than the disk's.
    """
    with temporary_folder("mutants") as folder:
        for name, tree in trees.items():
            write_tree(tree, folder / name)
        about = {"rubric": plan.rubric.path, "out": plan.out}
        work = [FolderJob(name=n, source=folder / n, sandbox=plan.sandbox, **about) for n in trees]
        yield from grade_all(work, jobs, begun)


def _keep_folder(plan: Plan, name: str, tree: Tree, *, wanted: bool) -> str | None:
    """Return the grading's folder, with the graded files in `source/`, or remove it where it need not be kept."""
    folder = plan.out / name
    if not (plan.keep_all or wanted):
        shutil.rmtree(folder, ignore_errors=True)
        return None
    write_tree(tree, folder / SOURCE)
    (folder / DIFF).write_text(unified_diff(plan.solution.tree, tree), encoding="utf-8")
    return str(folder)


# ---- what a mutant lost, against what it must cost


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """How what a mutant lost differs from what it must; see `MutantResult`."""

    state: State
    missing: tuple[str, ...] = ()
    surplus: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()

    def with_words(self, mutant: Mutant, result: GradingResult) -> Comparison:
        """Return the same with the words that the report should have used, or should not, and with other points."""
        words = [line for criterion in result.criteria for line in mutant.wrong_words(criterion)]
        if mutant.points is not None and not math.isclose(mutant.points, result.points):
            words.append(f"it gets {number(result.points)} points, not {number(mutant.points)}")
        return replace(self, state="differs", differing=(*self.differing, *words)) if words else self


def find_lost(
    criteria: Sequence[CriterionResult], ignored: Collection[str] = ()
) -> tuple[LostCriterion, ...]:
    """Return the criteria that were not reached, without those that a person judges."""
    return tuple(
        LostCriterion(id=c.id, status=c.status.value, message=c.message, hint=c.hint)
        for c in criteria
        if c.status not in {Status.PASS, Status.MANUAL} and c.id not in ignored
    )


def compare(
    expected: dict[str, Cost] | None, criteria: Sequence[CriterionResult], ignored: Collection[str] = ()
) -> Comparison:
    """Compare a mutant's verdicts with what it must lose; without a declaration, any points that are lost kill it.

    `ignored` are criteria that the reference solution does not reach either.
    """
    found = {c.id: c.status for c in criteria if c.id not in ignored}
    if any(status.is_retryable for status in found.values()):
        return Comparison(state="inconclusive")
    lost = {name: status.value for name, status in found.items() if status.is_lost}
    if expected is None:
        return Comparison(state="killed" if any(c.id in lost and c.counts for c in criteria) else "survived")
    known = {c.id for c in criteria}
    missing = tuple(
        name if name in known else f"{name} (the rubric has no such criterion)"
        for name in expected
        if name not in lost
    )
    surplus = tuple(name for name in lost if name not in expected)
    differing = tuple(
        f"{name} is {lost[name]}, not {wanted}"
        for name, wanted in expected.items()
        if name in lost and lost[name] != wanted
    )
    if not (missing or surplus or differing):
        return Comparison(state="killed")
    state: State = "differs" if lost else "survived"
    return Comparison(state=state, missing=missing, surplus=surplus, differing=differing)
