"""What `grader labs`, `grader example` and `grader rubric test` show and write.

`rubric test` grades a correct package, and mutants of it that must lose marks. `plan_test` says what is graded,
`run_plan` grades it, and `print_test` shows it: a table comes first, then everything that did not go as declared, with
its diff and its evidence. `write_mutants` writes what each mutant cost as a file.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import IO

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from grader.authoring.mutation.faulty_packages import (
    Planned,
    load_mutants,
    mutants_file,
    mutants_text,
    plan_all,
    plan_declared,
    refuse_unfit,
    select_mutants,
    why_not_killed,
)
from grader.authoring.mutation.rubric_test import Plan, run_test
from grader.authoring.mutation.solution import (
    Solution,
    find_reference,
    load_solution,
    reference_at,
    write_tree,
)
from grader.cli.display import open_progress
from grader.cli.output import say
from grader.errors import UsageError
from grader.files import atomic_write, check_writable
from grader.model import SandboxMode
from grader.model.mutants import LostCriterion, MutantResult, RubricTest
from grader.report.terminal import emit, open_console
from grader.report.text import line, visible
from grader.rubric.find import BUILT_IN, EXAMPLE
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.model import Rubric
from grader.rubric.scenario import NAME_PATTERN
from grader.wording import did_you_mean, number

MARKS = {
    "killed": ("✓", "green"),
    "survived": ("✗", "red"),
    "differs": ("✗", "red"),
    "inconclusive": ("?", "yellow"),
    "error": ("!", "red"),
}
TEXT_CHARS = 500
DIFF_STYLES = {"+": "green", "-": "red", "@": "cyan"}


def plan_test(
    rubric: str,
    solution: Path | None,
    *,
    only: Sequence[str],
    jobs: int,
    out: Path | None,
    everything: Path | None,
    sandbox: SandboxMode,
) -> Plan:
    """Return what is to be graded, and where. `everything` is the file that what every operator costs is written to,
    None to try the declared mutants. Raises UsageError."""
    loaded = load_rubric(rubric)
    reference = reference_at(solution) if solution else find_reference(loaded)
    correct = load_solution(reference, loaded.rubric.package)
    correct, mutants, unfit = _plan_mutants(
        loaded, correct, own=solution is not None, everything=everything is not None
    )
    picked = select_mutants(mutants, only)
    for place in filter(None, (out, everything and everything.absolute().parent)):
        check_writable(place)
    # without an end of its own: what survived stays for a person to look at
    folder = out or Path(tempfile.mkdtemp(prefix="grader-mutants-"))
    return Plan(
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


def _plan_mutants(
    loaded: LoadedRubric, solution: Solution, *, own: bool, everything: bool
) -> tuple[Solution, list[Planned], list[str]]:
    """Return the solution with its mutants, and the declared ones that do not fit one of the user's `own`. Raises
    RubricError where none of them fits."""
    file = None if everything else mutants_file(loaded)
    if file is None:
        return solution, plan_all(solution), []
    declared = load_mutants(file, loaded.rubric)
    mutants, unfit = plan_declared(declared, solution)
    if own and unfit and not solution.folder:
        # the package's own folder was given, and the file may have its paths from the folder around that
        around = solution.in_folder()
        there, more = plan_declared(declared, around)
        if len(more) < len(unfit):
            solution, mutants, unfit = around, there, more
    if not own or not mutants:
        refuse_unfit(unfit)
    return solution, mutants, unfit


def run_plan(plan: Plan, *, temporary: bool) -> RubricTest:
    """Grade everything. A temporary folder is kept only if it holds evidence for a person to look at."""
    kept = False
    try:
        with open_progress() as progress:
            test = run_test(plan, progress)
        kept = any(mutant.evidence for mutant in test.mutants) or test.reference.evidence is not None
        return test
    finally:
        if temporary and not kept:
            shutil.rmtree(plan.out, ignore_errors=True)


def write_mutants(plan: Plan, test: RubricTest, file: Path) -> None:
    """Write a mutants file with what each mutant cost."""
    text = mutants_text(plan.rubric.rubric.id, {m.name: m.mutant for m in plan.mutants}, test.mutants)
    atomic_write(file, text.encode(), public=True)


def print_test(test: RubricTest, stream: IO[str]) -> None:
    """Print the whole test on a terminal or to a file."""
    parts: list[RenderableType] = [_table(test)] if test.mutants else []
    parts += list(_reference(test))
    for mutant in test.mutants:
        if mutant.state != "killed":
            parts += [Text(), *_open(mutant)]
    parts += [Text(), *_summary(test)]
    emit(open_console(stream), parts)


def _table(test: RubricTest) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    for heading in ("", "mutant", "lost"):
        table.add_column(heading, no_wrap=heading == "")
    for mutant in test.mutants:
        mark, style = MARKS[mutant.state]
        state = Text(f"{mark} {mutant.state}", style)
        lost = ", ".join(f"{c.id} {c.status}" for c in mutant.lost)
        lost = lost or line(mutant.error, TEXT_CHARS) or "nothing"
        table.add_row(state, Text(visible(mutant.label)), Text(lost))
    return table


def _reference(test: RubricTest) -> Iterator[Text]:
    if test.reference.lost:
        reached = f"{number(test.reference.points)} of {number(test.reference.max_points)} points"
        yield Text(f"The reference solution does not get everything: {reached}", "bold red")
        yield Text(f"  {visible(test.solution)}")
        yield from _criteria(test.reference.lost)
        yield from _evidence(test.reference.evidence)


def _open(mutant: MutantResult) -> Iterator[Text]:
    """Yield the lines of a mutant that was not killed."""
    yield Text(f"{mutant.state}: {visible(mutant.label)}", "bold red")
    if mutant.mistake:
        yield Text(f"  {visible(mutant.mistake)}")
    if mutant.expected is None and not mutant.error:
        yield Text(f"  {why_not_killed(mutant)}", "yellow")
    if mutant.error:
        yield Text(f"  not graded: {line(mutant.error, TEXT_CHARS)}")
    for words, names in (
        ("should cost, and does not", mutant.missing),
        ("should not cost, and does", mutant.surplus),
        ("has another status", mutant.differing),
    ):
        if names:
            yield Text(f"  {words}: {visible(', '.join(names))}", "yellow")
    yield from _criteria(mutant.lost)
    for row in mutant.diff.rstrip("\n").split("\n"):
        yield Text(f"    {line(row, TEXT_CHARS)}", DIFF_STYLES.get(row[:1], ""))
    yield from _evidence(mutant.evidence)


def _criteria(lost: tuple[LostCriterion, ...]) -> Iterator[Text]:
    for criterion in lost:
        yield Text(f"  {criterion.id} {criterion.status}: {line(criterion.message, TEXT_CHARS)}")


def _evidence(folder: str | None) -> Iterator[Text]:
    if folder is not None:
        yield Text(f"  evidence: {visible(folder)}")


def _summary(test: RubricTest) -> Iterator[Text]:
    for fault in test.unfit:
        yield Text(f"not tried: {visible(fault)}", "yellow")
    if test.uncosted:
        names = ", ".join(test.uncosted)
        which = "No mutant that was tried" if test.unfit else "No mutant"
        yield Text(f"{which} costs {names}: add mutants that do, to show that these criteria work", "red")
    killed = sum(mutant.state == "killed" for mutant in test.mutants)
    text = f"{test.rubric.id}: {killed} of {len(test.mutants)} mutants killed, {test.wall_s:.0f} s"
    yield Text(text, "bold green" if test.passed else "bold red")


def print_labs(rubrics: Sequence[tuple[Rubric, str]], stream: IO[str]) -> None:
    """Print a table of labs with the package that each is for, below the folder of the user's that it comes from."""
    shown: list[RenderableType] = []
    for source, group in groupby(rubrics, key=lambda known: known[1]):
        if source not in {BUILT_IN, EXAMPLE}:
            shown.append(Text(f"\n{visible(source)}", "bold"))
        shown.append(_labs_table([rubric for rubric, _ in group]))
    emit(open_console(stream), shown)


def labs_data(rubrics: Sequence[tuple[Rubric, str]]) -> list[dict[str, object]]:
    """Return the same for programs."""
    return [
        {
            "id": rubric.id,
            "title": rubric.title,
            "version": rubric.version,
            "package": rubric.package,
            "criteria": len(rubric.criteria),
            "max_points": rubric.max_points,
            "source": source,
        }
        for rubric, source in rubrics
    ]


def _labs_table(rubrics: Sequence[Rubric]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    for heading in ("lab", "package", "criteria", "points", "title"):
        table.add_column(heading, no_wrap=heading != "title", overflow="fold")
    for rubric in rubrics:
        packages, points = ", ".join(rubric.package_names), number(rubric.max_points)
        cells = (rubric.id, packages, str(len(rubric.criteria)), points, rubric.title)
        table.add_row(*(Text(visible(cell)) for cell in cells))
    return table


def write_example(lab: str, folder: Path, mistake: str | None) -> None:
    """Write a lab's correct package into `folder`, or one with a mistake. Raises UsageError if the folder is in use."""
    loaded, correct = _correct(lab)
    wanted = None if mistake is None else _find_mistake(_mistakes(loaded, correct), mistake)
    if folder.is_symlink() or (folder.exists() and (not folder.is_dir() or any(folder.iterdir()))):
        raise UsageError(f"{folder} is in use", hint="give a new or an empty folder")
    check_writable(folder.absolute())
    write_tree(correct.tree if wanted is None else wanted.tree, folder)
    package = folder / correct.folder
    if wanted is None:
        say(f"{package}: a correct package for {loaded.rubric.id}")
    else:
        say(f"{package}: a package for {loaded.rubric.id} with a mistake: {wanted.mistake or wanted.label}")


def list_mistakes(lab: str) -> None:
    """Print each mistake with the criteria that it costs."""
    planned = _mistakes(*_correct(lab))
    width = max((len(mutant.name) for mutant in planned), default=0)
    for mutant in planned:
        costs = ", ".join(mutant.costs or {})
        say(f"{mutant.name:{width}}  {costs}".rstrip())


def rubric_id_from(text: str) -> str:
    """Return `text` as an id of a rubric. Raises UsageError if it contains nothing that an id may have."""
    found = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
    if not re.fullmatch(NAME_PATTERN, found):
        raise UsageError(
            f"{text!r} cannot be made into an id", hint="give --id: lower-case letters, digits and hyphens"
        )
    return found


def _correct(lab: str) -> tuple[LoadedRubric, Solution]:
    loaded = load_rubric(lab)
    return loaded, load_solution(find_reference(loaded), loaded.rubric.package)


def _mistakes(loaded: LoadedRubric, correct: Solution) -> list[Planned]:
    return _plan_mutants(loaded, correct, own=True, everything=False)[1]


def _find_mistake(planned: list[Planned], name: str) -> Planned:
    """Return the mistake of that name, or that of an operator which makes only one. Raises UsageError."""
    found = [m for m in planned if m.name == name] or [m for m in planned if m.mutant.operators == (name,)]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(mutant.name for mutant in found)
        raise UsageError(f"{name} can be made in {len(found)} ways", hint=f"choose one of: {names}")
    raise UsageError(
        f'there is no mistake "{name}"{did_you_mean(name, [mutant.name for mutant in planned])}',
        hint="without DIR, grader example lists the lab's mistakes",
    )
