"""From declared packages, or from all operators, to packages that can be graded."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from grader.authoring.mutation.declared import LoadedMutants, parse_parameters
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.package_tree import Entry, Tree
from grader.authoring.mutation.solution import Site, Solution
from grader.errors import RubricError, UsageError
from grader.model.mutants import (
    AppendText,
    ChosenFile,
    Cost,
    MoveFiles,
    Mutant,
    PackageEdit,
    ReplaceText,
    SetMode,
    SymbolicLink,
    WriteFile,
)
from grader.wording import did_you_mean

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
        mistakes = (OPERATORS[name].mistake for name in self.mutant.operators)
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
            name = unique = re.sub(r"[^a-z0-9.]+", "-", label.lower()).strip("-.")[:80]
            number = 1
            while unique in planned:
                number += 1
                unique = f"{name}-{number}"
            edit = {"operator": operator.name, "at": site.at}
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
            solution = solution.then(_find_site(solution, edit.operator, edit).tree)
            continue
        (kind,) = edit.kinds
        tree = dict(solution.tree)
        try:
            EDITS[kind](tree, getattr(edit, kind))
        except KeyError as error:
            raise DoesNotFitError(f"{kind}: there is no file {error}") from error
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
    text = tree[edit.file].data.decode(errors="surrogateescape")
    if text.count(edit.old) != edit.times:
        raise DoesNotFitError(
            f"{edit.file} has {edit.old!r} {text.count(edit.old)} times, not {edit.times} times"
        )
    data = text.replace(edit.old, edit.new).encode(errors="surrogateescape")
    tree[edit.file] = replace(tree[edit.file], data=data)


def _write(tree: Tree, edit: WriteFile) -> None:
    executable = edit.executable or (edit.file in tree and tree[edit.file].executable)
    tree[edit.file] = Entry(data=edit.text.encode(), executable=executable)


def _append(tree: Tree, edit: AppendText) -> None:
    tree[edit.file] = replace(tree[edit.file], data=tree[edit.file].data + edit.text.encode())


def _mode(tree: Tree, edit: SetMode) -> None:
    tree[edit.file] = replace(tree[edit.file], executable=edit.executable)


def _crlf(tree: Tree, edit: ChosenFile) -> None:
    tree[edit.file] = replace(tree[edit.file], data=tree[edit.file].data.replace(b"\n", b"\r\n"))


def _bom(tree: Tree, edit: ChosenFile) -> None:
    tree[edit.file] = replace(tree[edit.file], data=b"\xef\xbb\xbf" + tree[edit.file].data)


def _delete(tree: Tree, edit: ChosenFile) -> None:
    del tree[edit.file]


def _link(tree: Tree, edit: SymbolicLink) -> None:
    tree[edit.file] = Entry(data=b"", link=edit.to)


def _move(tree: Tree, edit: MoveFiles) -> None:
    moved = [name for name in tree if name.startswith(edit.old)]
    if not moved:
        raise KeyError(edit.old)
    for name in moved:
        tree[edit.new + name.removeprefix(edit.old)] = tree.pop(name)


EDITS: dict[str, Callable[..., None]] = {
    "replace": _replace,
    "write": _write,
    "append": _append,
    "mode": _mode,
    "crlf": _crlf,
    "bom": _bom,
    "delete": _delete,
    "link": _link,
    "move": _move,
}
