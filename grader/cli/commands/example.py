"""`grader example LAB [DIR]`: a lab's correct package to try things with, as it is or with a mistake of students'."""

from __future__ import annotations

from pathlib import Path

from grader.authoring.mutation.declared import load_mutants, mutants_file
from grader.authoring.mutation.package_tree import Tree, write_tree
from grader.authoring.mutation.plan import Planned, plan_all, plan_declared
from grader.authoring.mutation.solution import Solution, find_reference, load_solution
from grader.cli.output import say
from grader.errors import ExitCode, UsageError
from grader.files import check_writable
from grader.rubric.faults import did_you_mean
from grader.rubric.load import LoadedRubric, load_rubric


def run(*, lab: str, folder: Path | None = None, mistake: str | None = None) -> ExitCode:
    """Write the package into `folder`, or list the lab's mistakes. Raises UsageError for a folder that is in use."""
    loaded = load_rubric(lab)
    correct = load_solution(find_reference(loaded), loaded.rubric.package)
    if folder is None:
        if mistake is not None:
            raise UsageError(
                "--mistake needs a folder to write to", hint=f"grader example {lab} DIR --mistake {mistake}"
            )
        return _list(loaded, correct)
    wanted = None if mistake is None else _chosen(_mistakes(loaded, correct), mistake)
    _write(correct.tree if wanted is None else wanted.tree, folder)
    package = folder / correct.folder
    if wanted is None:
        say(f"{package}: a correct package for {loaded.rubric.id}")
    else:
        say(f"{package}: a package for {loaded.rubric.id} with a mistake: {wanted.mistake}")
    return ExitCode.PASSED


def _list(loaded: LoadedRubric, correct: Solution) -> ExitCode:
    """Each mistake with the criteria that it costs."""
    planned = _mistakes(loaded, correct)
    width = max((len(mutant.name) for mutant in planned), default=0)
    for mutant in planned:
        costs = ", ".join(mutant.costs or {})
        say(f"{mutant.name:{width}}  {costs}".rstrip())
    return ExitCode.PASSED


def _mistakes(loaded: LoadedRubric, correct: Solution) -> list[Planned]:
    file = mutants_file(loaded)
    if file is None:
        return plan_all(correct)
    return plan_declared(load_mutants(file, loaded.rubric), correct)[0]


def _chosen(planned: list[Planned], name: str) -> Planned:
    """The mistake of that name; an operator's name will do where it makes one mistake only. Raises UsageError."""
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
    """Raises UsageError where something is in the folder already."""
    if folder.is_symlink() or (folder.exists() and (not folder.is_dir() or any(folder.iterdir()))):
        raise UsageError(f"{folder} is in use", hint="give a folder that is empty or not there")
    check_writable(folder.absolute())
    write_tree(tree, folder)
