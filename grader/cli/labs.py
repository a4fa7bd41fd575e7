"""What `grader labs` and `grader example` show and write: labs, correct packages, packages with a mistake."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from rich.table import Table
from rich.text import Text

from grader.authoring.mutation.faulty_packages import (
    Planned,
    load_mutants,
    mutants_file,
    plan_all,
    plan_declared,
)
from grader.authoring.mutation.package_tree import Tree, write_tree
from grader.authoring.mutation.solution import Solution, find_reference, load_solution
from grader.cli.output import say
from grader.errors import UsageError
from grader.files import check_writable
from grader.report.terminal import emit, open_console
from grader.report.text import visible
from grader.rubric.find import BUILT_IN, EXAMPLE
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.model import Rubric
from grader.rubric.scenario import NAME_PATTERN
from grader.wording import did_you_mean, number


def print_labs(rubrics: Sequence[tuple[Rubric, str]], stream: IO[str]) -> None:
    """Print a table of labs with the package that each is for, and where each comes from."""
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    own = any(source not in {BUILT_IN, EXAMPLE} for _, source in rubrics)
    for heading in ("lab", "package", "criteria", "points", "title", *(["from"] if own else [])):
        table.add_column(heading, no_wrap=heading not in {"title", "from"}, overflow="fold")
    for rubric, source in rubrics:
        points = number(rubric.max_points)
        cells = [rubric.id, ", ".join(rubric.package_names), str(len(rubric.criteria)), points, rubric.title]
        cells += [source] if own else []
        table.add_row(*(Text(visible(cell)) for cell in cells))
    emit(open_console(stream), [table])


def write_example(lab: str, folder: Path, mistake: str | None) -> None:
    """Write a lab's correct package into `folder`, or one with a mistake. Raises UsageError if the folder is in use."""
    loaded, correct = _correct(lab)
    wanted = None if mistake is None else _find_mistake(_mistakes(loaded, correct), mistake)
    _write(correct.tree if wanted is None else wanted.tree, folder)
    package = folder / correct.folder
    if wanted is None:
        say(f"{package}: a correct package for {loaded.rubric.id}")
    else:
        say(f"{package}: a package for {loaded.rubric.id} with a mistake: {wanted.mistake}")


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
    file = mutants_file(loaded)
    if file is None:
        return plan_all(correct)
    return plan_declared(load_mutants(file, loaded.rubric), correct)[0]


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


def _write(tree: Tree, folder: Path) -> None:
    """Raises UsageError if the folder is not empty."""
    if folder.is_symlink() or (folder.exists() and (not folder.is_dir() or any(folder.iterdir()))):
        raise UsageError(f"{folder} is in use", hint="give a new or an empty folder")
    check_writable(folder.absolute())
    write_tree(tree, folder)
