"""Operators: named functions, each making one kind of mistake wherever it fits a correct package.

A new operator is a function with `@operator` in the module of `operators/` for its kind of file; the page of operators
is made of them (`make reference`). Its test is a faulty package of a lab in `fixtures/`.
"""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from grader.authoring.mutation.solution import Change, Site, Solution
from grader.model.record import Record

Finder = Callable[[Solution], Iterable[tuple[Any, ...]]]
Function = TypeVar("Function", bound=Callable[..., Change])


class NoParams(Record):
    """For an operator that has nothing to set."""


@dataclass(frozen=True, kw_only=True)
class Operator:
    """`mistake` is what the student does wrong, `fits` what of the package the operator works on."""

    name: str
    each: Finder
    function: Callable[..., Change]
    params: type[Record]
    mistake: str
    fits: str

    @property
    def family(self) -> str:
        return self.function.__module__.rpartition(".")[2]

    def sites(self, solution: Solution, params: Record | None = None) -> tuple[Site, ...]:
        """Return every place where it fits, each under another `at`; empty where it fits nowhere."""
        found = [s for s in self._sites(solution, params or self.params()) if s.tree != solution.tree]
        alike = Counter(frozenset(site.at.items()) for site in found)
        return tuple(
            replace(site, at={**site.at, "line": site.line})
            if alike[frozenset(site.at.items())] > 1 and site.line is not None
            else site
            for site in found
        )

    def _sites(self, solution: Solution, params: Record) -> Iterator[Site]:
        own = () if self.params is NoParams else (params,)
        for place, *found in self.each(solution):
            change = self.function(*found, *own)
            if change or isinstance(change, bytes):
                yield place.site(solution, change)


OPERATORS: dict[str, Operator] = {}


def operator(*, each: Finder, fits: str, params: type[Record] = NoParams) -> Callable[[Function], Function]:
    """Put a function into `OPERATORS`, as `bit-removed` if it is called `bit_removed`. Its docstring says the student's
    mistake.

    `each` finds where the operator may fit: it yields a `CodePlace` and what is there. The function is called with
    what is there, and with the parameters if it has any. It returns the change, or nothing where it does not fit.
    Raises ValueError for a name that is taken and for a function without a docstring.
    """

    def register(function: Function) -> Function:
        name, mistake = function.__name__.replace("_", "-"), inspect.getdoc(function)
        if name in OPERATORS or not mistake:
            raise ValueError(f"operator {name}: {'twice' if name in OPERATORS else 'it has no docstring'}")
        OPERATORS[name] = Operator(
            name=name, each=each, function=function, params=params, mistake=mistake.rstrip("."), fits=fits
        )
        return function

    return register
