"""`grader rubric test LAB|FILE`: a correct package gets everything, and each mutant of it loses what it must."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from grader.authoring.mutation.declared import load_mutants, mutants_file, mutants_text
from grader.authoring.mutation.plan import (
    Planned,
    plan_all,
    plan_declared,
    refuse_unfit,
    select_mutants,
)
from grader.authoring.mutation.rubric_test import Plan, run_test
from grader.authoring.mutation.solution import (
    Solution,
    find_reference,
    load_solution,
    reference_at,
)
from grader.cli.display import open_progress
from grader.cli.inherited_limits import make_room
from grader.cli.mutants import print_test
from grader.cli.output import say_json
from grader.cli.sandbox_report import say_unwalled
from grader.errors import ExitCode
from grader.files import atomic_write, check_writable
from grader.model.mutants import RubricTest
from grader.model.submission import SandboxMode
from grader.rubric.load import LoadedRubric, load_rubric

SIDE_BY_SIDE = 4  # they wait most of the time; fits two cores


def run(
    *,
    rubric: str,
    solution: Path | None = None,
    only: Sequence[str] = (),
    jobs: int = SIDE_BY_SIDE,
    out: Path | None = None,
    write: Path | None = None,
    sandbox: SandboxMode = "auto",
    as_json: bool = False,
) -> ExitCode:
    """Test, show, and write what was lost to the file `write`, where one is given."""
    make_room(gradings=jobs)
    loaded = load_rubric(rubric)
    reference = reference_at(solution) if solution else find_reference(loaded)
    correct = load_solution(reference, loaded.rubric.package)
    mutants, unfit = _planned(loaded, correct, own=solution is not None, everything=write is not None)
    picked = select_mutants(mutants, only)
    for place in filter(None, (out, write and write.absolute().parent)):
        check_writable(place)
    folder = out or Path(tempfile.mkdtemp(prefix="grader-mutants-"))
    plan = Plan(
        rubric=loaded,
        solution=correct,
        given=str(reference.folder),
        mutants=picked,
        unfit=unfit,
        partial=bool(only),
        jobs=jobs,
        out=folder.absolute(),
        keep_all=out is not None,
        sandbox=sandbox,
    )
    say_unwalled(sandbox, loaded)
    test = _tested(plan, temporary=out is None)
    if write is not None and not test.reference.lost:
        text = mutants_text(loaded.rubric.id, {m.name: m.mutant for m in plan.mutants}, test.mutants)
        atomic_write(write, text.encode(), public=True)
    if as_json:
        say_json(test.model_dump(mode="json", by_alias=True))
    else:
        print_test(test, sys.stdout)
    return ExitCode.PASSED if test.passed else ExitCode.BELOW_PASS_MARK


def _planned(
    loaded: LoadedRubric, solution: Solution, *, own: bool, everything: bool
) -> tuple[list[Planned], list[str]]:
    """The mutants, and those declared that a solution of the user's `own` has no place for."""
    file = None if everything else mutants_file(loaded)
    if file is None:
        return plan_all(solution), []
    mutants, unfit = plan_declared(load_mutants(file, loaded.rubric), solution)
    if not own:
        refuse_unfit(unfit)
    return mutants, unfit


def _tested(plan: Plan, *, temporary: bool) -> RubricTest:
    """Run it; a temporary folder stays only where it holds evidence that somebody has to look at."""
    kept = False
    try:
        with open_progress() as progress:
            test = run_test(plan, progress)
        kept = any(mutant.evidence for mutant in test.mutants) or test.reference.evidence is not None
        return test
    finally:
        if temporary and not kept:
            shutil.rmtree(plan.out, ignore_errors=True)
