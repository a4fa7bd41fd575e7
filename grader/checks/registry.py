"""The checks by name. A family decorates its functions with `@check`; `__init__` imports the families."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass

from grader.model.record import Record
from grader.model.verdict import Verdict

HEADINGS = ("What it checks", "Why it matters on a robot", "How it is measured", "How to fix")
FACTS = ("package", "build", "run", "params")


class NoParams(Record):
    """For a check that has nothing to set."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One check: function, record of its parameters, the facts it asks for, its docstring in parts.

    `messages_only` checks ask a run for its messages alone, so they judge another tool's recording too. For such a
    run `package` is empty where there is none.
    """

    name: str
    function: Callable[..., Verdict]
    params: type[Record]
    facts: tuple[str, ...]
    title: str
    sections: dict[str, str]
    messages_only: bool = False

    @property
    def needs_run(self) -> bool:
        """Whether it judges a scenario's run, and not only the package and its build."""
        return "run" in self.facts

    @property
    def family(self) -> str:
        return self.function.__module__.rpartition(".")[2]


CHECKS: dict[str, Check] = {}


def check(
    name: str, *, params: type[Record] = NoParams, messages_only: bool = False
) -> Callable[[Callable[..., Verdict]], Callable[..., Verdict]]:
    """Put a function into `CHECKS`. Raises ValueError for a name that is taken or a fact that nobody has."""

    def register(function: Callable[..., Verdict]) -> Callable[..., Verdict]:
        facts = tuple(inspect.signature(function).parameters)
        unknown = set(facts) - set(FACTS)
        if unknown or name in CHECKS:
            raise ValueError(
                f"check {name}: unknown facts {sorted(unknown)}" if unknown else f"check {name} twice"
            )
        title, sections = _parts(inspect.getdoc(function) or "")
        CHECKS[name] = Check(
            name=name,
            function=function,
            params=params,
            facts=facts,
            title=title,
            sections=sections,
            messages_only=messages_only,
        )
        return function

    return register


def _parts(docstring: str) -> tuple[str, dict[str, str]]:
    """The title line, and the text under each heading with its lines joined into paragraphs."""
    title, *rest = docstring.splitlines() or [""]
    sections: dict[str, list[str]] = {}
    heading = ""
    for line in rest:
        if line.strip() in HEADINGS:
            heading = line.strip()
            sections[heading] = []
        elif heading:
            sections[heading].append(line.strip())
    texts = {name: "\n".join(lines).strip() for name, lines in sections.items()}
    return title, {name: _paragraphs(text) for name, text in texts.items()}


def _paragraphs(text: str) -> str:
    return "\n\n".join(" ".join(p.split("\n")) for p in text.split("\n\n"))
