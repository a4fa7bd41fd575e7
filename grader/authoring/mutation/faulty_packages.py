"""A lab's file of faulty packages: read into records with every fault named, and a first one written from a test.

From declared packages, or from all operators, packages are made that can be graded.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from typing import Any

from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.solution import Site, Solution, Tree, TreeFile
from grader.authoring.rubric_draft import dump_flow
from grader.errors import RubricError, UsageError
from grader.model.mutants import (
    Cost,
    MoveFiles,
    Mutant,
    MutantResult,
    MutantsFile,
    PackageEdit,
    ReplaceText,
    WriteFile,
)
from grader.model.record import Record
from grader.model.version import MUTANTS
from grader.rubric.fault_words import model_faults
from grader.rubric.find import rubrics_folder, short_path
from grader.rubric.load import LoadedRubric, refuse_newer
from grader.rubric.model import Rubric
from grader.rubric.yaml_lines import Fault, KeyPath, Source, as_map, as_maps, read_source
from grader.wording import did_you_mean, first_few, join_words

FILES_SHOWN = 8
HEADER = """\
# Faulty packages for {rubric}: the reference solution with edits, and the criteria that each package must not reach.
# Written by a test: keep those that say something, and correct what a package should cost.
schema: grader.mutants/1
rubric: {rubric}

mutants:
"""
NOT_KILLED = {
    "survived": "costs nothing: the rubric does not notice this mistake",
    "inconclusive": "could not be judged",
    "error": "could not be graded",
}


@dataclass(frozen=True, kw_only=True)
class LoadedMutants:
    """The records, and their source for faults that show only when the packages are built."""

    mutants: dict[str, Mutant]
    source: Source


def mutants_file(rubric: LoadedRubric) -> Path | None:
    """Return `mutants/<id>.yaml` beside the rubric, or the file that comes with the grader; None without either."""
    name = f"{rubric.rubric.id}.yaml"
    beside, shipped = (
        rubric.path.absolute().parent / "mutants" / name,
        rubrics_folder().parent / "fixtures" / name,
    )
    return next((path for path in (beside, shipped) if path.is_file()), None)


def load_mutants(path: Path, rubric: Rubric) -> LoadedMutants:
    """Return the packages that the file declares for this rubric. Raises RubricError with every fault.

    A criterion that the rubric does not have is not a fault of the file: such a mutant survives.
    """
    source = read_source(path, short_path(path))
    if not isinstance(source.data, dict):
        raise RubricError(
            [source.fault((), "a mutants file is a map, beginning with schema: grader.mutants/1")]
        )
    refuse_newer(source, MUTANTS)
    found = [*source.faults, *model_faults(MutantsFile, source.data), *_cross_faults(source.data, rubric)]
    if found:
        raise RubricError(source.in_order(found))
    records = MutantsFile.from_data(source.data)
    return LoadedMutants(mutants=records.mutants, source=source)


def parse_parameters(operator: str, given: dict[str, Any]) -> Record:
    """Return an operator's parameters as its own record."""
    return OPERATORS[operator].params.from_data(given)


def _cross_faults(data: dict[str, Any], rubric: Rubric) -> Iterator[Fault]:
    name = data.get("rubric")
    if isinstance(name, str) and name != rubric.id:
        yield ("rubric",), f"these mutants are for {name}, not for {rubric.id}"
    first: dict[str, str] = {}
    for key, mutant in as_map(data.get("mutants")).items():
        edits = as_map(mutant).get("edits")
        for position, edit in as_maps(edits):
            yield from _operator_faults(("mutants", key, "edits", position), edit)
        # two mutants of the same edits test one thing twice
        same = first.setdefault(json.dumps(edits, sort_keys=True), key)
        if same != key and edits:
            yield ("mutants", key), f"has the same edits as mutants.{same}"


def _operator_faults(path: KeyPath, edit: dict[str, Any]) -> Iterator[Fault]:
    name = edit.get("operator")
    if not isinstance(name, str):
        return
    if name not in OPERATORS:
        yield (*path, "operator"), f'there is no operator "{name}"{did_you_mean(name, OPERATORS)}'
        return
    yield from model_faults(OPERATORS[name].params, as_map(edit.get("with")), (*path, "with"))


# ---- a first file


def mutants_text(rubric: str, mutants: dict[str, Mutant], results: Sequence[MutantResult]) -> str:
    """Return the text of a mutants file. Mutants that cost nothing, or were not judged, are in it as comments."""
    parts = [HEADER.format(rubric=rubric)]
    for result in results:
        costs = {criterion.id: criterion.status for criterion in result.lost}
        text = _mutant_text(result.name, mutants[result.name], costs)
        if result.state in NOT_KILLED:
            text = "".join(f"  # {line.strip()}\n" for line in [why_not_killed(result), *text.splitlines()])
        parts.append(text)
    return "\n".join(parts)


def why_not_killed(result: MutantResult) -> str:
    """Return why a mutant of which nothing is declared was not killed."""
    if result.state == "survived" and result.lost:
        ids = join_words([criterion.id for criterion in result.lost])
        return f"costs no points: the rubric notices it in {ids}, which is advice"
    return NOT_KILLED.get(result.state, "")


def _mutant_text(name: str, mutant: Mutant, costs: dict[str, str]) -> str:
    # what was given alone: the file shall read as if written by hand
    edits = [edit.model_dump(by_alias=True, exclude_unset=True) for edit in mutant.edits]
    made = [f"      - {dump_flow(edit)}" for edit in edits]
    lines = [f"    expect: {dump_flow(costs)}", "    edits:", *made]
    return "\n".join([f"  {name}:", *lines, ""])


SHOWN_PLACES = 6
Place = Mapping[str, str | int]


@dataclass(frozen=True, kw_only=True)
class Planned:
    """A mutant that is ready: `name` is fit for a folder, `costs` None where nothing is declared."""

    name: str
    label: str
    mutant: Mutant
    tree: Tree
    costs: dict[str, Cost] | None = None

    @property
    def mistake(self) -> str:
        """What is wrong with the package, in a sentence."""
        if self.mutant.summary:
            return self.mutant.summary
        mistakes = [OPERATORS[name].mistake for name in self.mutant.operators]
        if not mistakes:
            return ""
        return "The student " + " and ".join(words[:1].lower() + words[1:] for words in mistakes) + "."


class DoesNotFitError(Exception):
    """An edit that has no place, or no single one, in a solution; says why."""


def plan_declared(loaded: LoadedMutants, solution: Solution) -> tuple[list[Planned], list[str]]:
    """Return the packages of the file that must lose something, and what is wrong with those that do not fit.

    A fault names the file's line. Declarations of correct packages (`expect: {}`) are left out.
    """
    planned: list[Planned] = []
    faults: list[str] = []
    for name, mutant in loaded.mutants.items():
        if not mutant.expect:
            continue
        try:
            tree = build_tree(solution, mutant)
        except DoesNotFitError as error:
            faults.append(loaded.source.fault(("mutants", name), str(error)))
            continue
        planned.append(Planned(name=name, label=name, mutant=mutant, tree=tree, costs=dict(mutant.expect)))
    return planned, faults


def plan_all(solution: Solution) -> list[Planned]:
    """Return a mutant for every operator at every place where it fits, with its default parameters."""
    planned: dict[str, Planned] = {}
    for operator in OPERATORS.values():
        for site in operator.sites(solution):
            label = _label(operator.name, site.at)
            # of letters that any disk takes, and short enough beside what the path has already
            name = unique = re.sub(r"[^a-z0-9.]+", "-", label.lower()).strip("-.")[:80]
            number = 1
            # two places may differ only in what the name leaves out
            while unique in planned:
                number += 1
                unique = f"{name}-{number}"
            edit = {"operator": operator.name, **({"at": site.at} if site.at else {})}
            mutant = Mutant.model_validate({"edits": (edit,), "expect": {}})
            planned[unique] = Planned(name=unique, label=label, mutant=mutant, tree=site.tree)
    return list(planned.values())


def _label(operator: str, at: Place) -> str:
    place = ", ".join(str(value) for value in at.values())
    return f"{operator}: {place}" if place else operator


def select_mutants(planned: Sequence[Planned], only: Sequence[str]) -> list[Planned]:
    """Return those that `only` names, by mutant or operator, `*` allowed. Raises UsageError for an unknown name."""
    for pattern in only:
        if not any(_matches(mutant, pattern) for mutant in planned):
            known = dict.fromkeys(name for m in planned for name in (m.name, *m.mutant.operators))
            raise UsageError(
                f'there is no mutant "{pattern}"{did_you_mean(pattern, known)}',
                hint="--only takes a mutant's name as the table shows it, or an operator's",
            )
    return [m for m in planned if not only or any(_matches(m, pattern) for pattern in only)]


def _matches(planned: Planned, pattern: str) -> bool:
    names = (planned.name, planned.label, *planned.mutant.operators)
    return any(fnmatchcase(name, pattern) for name in names)


def refuse_unfit(faults: list[str]) -> None:
    """Raise RubricError where a mutants file does not fit the reference solution that it was written for."""
    if faults:
        raise RubricError(faults, hint="the mutants file and the reference solution do not fit each other")


# ---- edits


def build_tree(solution: Solution, mutant: Mutant) -> Tree:
    """Return the package with all of the mutant's edits. Raises DoesNotFitError."""
    for edit in mutant.edits:
        if edit.operator is not None:
            # each edit applies to what the ones before it made
            solution = solution.then(_find_site(solution, edit.operator, edit).tree)
            continue
        (kind,) = edit.kinds
        tree, how = dict(solution.tree), getattr(edit, kind)
        try:
            if kind in CHANGES:
                tree[how.file] = CHANGES[kind](tree[how.file], how)
            else:
                EDITS[kind](tree, how)
        except KeyError as error:
            name = str(error.args[0])
            there = [path for path in solution.tree if PurePosixPath(path).name == PurePosixPath(name).name]
            meant = f' (did you mean "{there[0]}"?)' if len(there) == 1 else did_you_mean(name, solution.tree)
            meant = meant or f"; the solution has {first_few(sorted(solution.tree), FILES_SHOWN)}"
            raise DoesNotFitError(f"{kind}: there is no file {name!r}{meant}") from error
        solution = solution.then(tree)
    return solution.tree


def _find_site(solution: Solution, name: str, edit: PackageEdit) -> Site:
    operator = OPERATORS[name]
    sites = operator.sites(solution, parse_parameters(name, edit.parameters))
    if not sites:
        raise DoesNotFitError(f"{name} fits nowhere in this package; it fits {operator.fits}")
    found = [site for site in sites if edit.at.items() <= site.at.items()]
    if len(found) == 1:
        return found[0]
    where = "; ".join(_place(site.at) for site in (found or sites)[:SHOWN_PLACES])
    if not found:
        raise DoesNotFitError(f"{name} does not fit at {_place(edit.at)}; it fits at {where}")
    raise DoesNotFitError(f"{name} fits in {len(found)} places: say in `at` which: {where}")


def _place(at: Place) -> str:
    return "{" + ", ".join(f"{key}: {value}" for key, value in at.items()) + "}"


def _replace(tree: Tree, edit: ReplaceText) -> None:
    # surrogateescape brings bytes that are no UTF-8 through unchanged
    text = tree[edit.file].data.decode(errors="surrogateescape")
    if text.count(edit.old) != edit.times:
        raise DoesNotFitError(
            f"{edit.file} has {edit.old!r} {text.count(edit.old)} times, not {edit.times} times"
        )
    data = text.replace(edit.old, edit.new).encode(errors="surrogateescape")
    tree[edit.file] = replace(tree[edit.file], data=data)


def _write(tree: Tree, edit: WriteFile) -> None:
    executable = edit.executable or (edit.file in tree and tree[edit.file].executable)
    tree[edit.file] = TreeFile(data=edit.text.encode(), executable=executable)


def _move(tree: Tree, edit: MoveFiles) -> None:
    moved = [name for name in tree if name.startswith(edit.old)]  # a folder moves with all that is below it
    if not moved:
        raise KeyError(edit.old)
    for name in moved:
        tree[edit.new + name.removeprefix(edit.old)] = tree.pop(name)


CHANGES: dict[str, Callable[[TreeFile, Any], TreeFile]] = {
    "append": lambda file, edit: replace(file, data=file.data + edit.text.encode()),
    "mode": lambda file, edit: replace(file, executable=edit.executable),
    "crlf": lambda file, _: replace(file, data=file.data.replace(b"\n", b"\r\n")),
    "bom": lambda file, _: replace(file, data=b"\xef\xbb\xbf" + file.data),
}
"""Edits that change one file, by what they make of it."""
EDITS: dict[str, Callable[[Tree, Any], object]] = {
    "replace": _replace,
    "write": _write,
    "delete": lambda tree, edit: tree.pop(edit.file),
    "link": lambda tree, edit: tree.update({edit.file: TreeFile(data=b"", link=edit.to)}),
    "move": _move,
}
