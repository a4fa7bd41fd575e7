"""The checks by name. A family decorates its functions with `@check`; `__init__` imports the families.

An instructor's own file uses the same decorator: within `collecting()` checks go to a registry of its own.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from types import UnionType
from typing import Annotated, Literal, NamedTuple, Union, get_args, get_origin

from grader.evidence.run import Run
from grader.model.message_rate import RateBounds
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict

HEADINGS = ("What it checks", "Why it matters on a robot", "How it is measured", "How to fix")
FACTS = ("package", "build", "run", "evidence", "params")
RESERVED = frozenset({"manual", "pytest"})
NAME = re.compile(r"[a-z][a-z0-9-]*")


class NoParams(Record):
    """For a check that has nothing to set."""


@dataclass(frozen=True)
class Refers:
    """What a parameter stands for, in the rubric or on the machine: the rubric is refused where it is not there.

    `process`: a start of the student's in the scenario. `launch`: a launch file that the scenario starts. `program`:
    `package/program` of another package. `message`, `service`: a type. `field`: a field's type. `sent`: a topic on
    which the scenario's probes send. `published`: a topic on which the student publishes. `set`: a parameter that the
    scenario sets. `action`: an action to which its steps send goals. `kept`: a file that it keeps. `served`: a service
    that the grader offers in it. `rostest`: a start of a `.test` file in it. `watched_s`: so long the scenario has to
    last. `dependency`: a ROS package, or another key of rosdep's. `package`: one that students hand in. `node`: a
    node's name, in the namespace in which the scenario starts it. `heard`: a topic that something has to send on.
    `cause`: a condition on one.
    """

    to: Literal[
        "process", "launch", "program", "message", "service", "field", "sent", "published", "set", "action", "kept",
        "served", "rostest", "watched_s", "dependency", "package", "node", "cause", "heard",
    ]  # fmt: skip


class Reference(NamedTuple):
    """A parameter's value, where it stands below `with`, and what it refers to."""

    path: tuple[str | int, ...]
    to: str
    value: object


ProcessName = Annotated[str, Refers("process")]
DependencyName = Annotated[str, Refers("dependency")]
PackageName = Annotated[str, Refers("package")]
NodeName = Annotated[str, Refers("node")]
LaunchName = Annotated[str, Refers("launch")]
ProgramName = Annotated[str, Refers("program")]


@dataclass(frozen=True, kw_only=True)
class Check:
    """One check: its function, the record of its parameters, the facts that it asks for, its docstring in parts."""

    name: str
    function: Callable[..., Verdict]
    params: type[Record]
    facts: tuple[str, ...]
    title: str
    sections: dict[str, str]
    messages_only: bool = False
    """It asks a run for its messages alone, so it judges another tool's recording too. For such a run, `package` is
    empty where there is none."""
    heeds_losses: bool = False
    """It considers for itself what the recorder lost."""
    run_anyway: bool = False
    """What it finds wrong with files is repaired before anything is run, so it explains no empty run, unless the file
    is not there at all."""
    of_callbacks: bool = False
    """It judges what a node does upon what it hears: an exception in a callback explains what it misses."""
    of_lives: bool = False
    """It judges how a node is called, lives and ends: where the node was there, its name or its end on Ctrl-C explains
    nothing that did not come."""
    source: str = ""
    """The file of an instructor's own check."""

    @property
    def needs_run(self) -> bool:
        """Whether it judges a scenario's run, and not only the package and its build."""
        return "run" in self.facts

    def rate_bounds(self, parameters: Mapping[str, object]) -> RateBounds | None:
        """Return the rate that a criterion with these parameters judges in the whole run, None where it judges none."""
        if not hasattr(self.params, "rate_bounds"):
            return None
        bounds: RateBounds | None = self.params.model_validate(parameters).rate_bounds
        return bounds

    def references(self, parameters: Mapping[str, object]) -> Iterator[Reference]:
        """Yield what these parameters refer to, defaults among them."""
        yield from _references(self.params, parameters)


def _references(record: type[Record], parameters: Mapping[str, object]) -> Iterator[Reference]:
    for name, info in record.model_fields.items():
        value = parameters.get(name, None if info.is_required() else info.default)
        kinds = [known for known in info.metadata if isinstance(known, Refers)] or _refers(info.annotation)
        yield from (Reference((name,), known.to, value) for known in kinds)
        if get_origin(info.annotation) is tuple and isinstance(value, list | tuple):
            kinds = _refers(get_args(info.annotation)[0])
            yield from (Reference((name, n), k.to, item) for n, item in enumerate(value) for k in kinds)
        if get_origin(info.annotation) is dict and isinstance(value, dict):
            inner = get_args(info.annotation)[1]
            kinds = _refers(inner)
            yield from (Reference((name, key), k.to, item) for key, item in value.items() for k in kinds)
            if isinstance(inner, type) and issubclass(inner, Record):
                for key, item in value.items():
                    found = _references(inner, item) if isinstance(item, dict) else ()
                    yield from (one._replace(path=(name, key, *one.path)) for one in found)


def _refers(annotation: object) -> list[Refers]:
    """Return what a type refers to, also where it may be absent (`ProcessName | None`)."""
    if get_origin(annotation) is Annotated:
        return [known for known in get_args(annotation)[1:] if isinstance(known, Refers)]
    if get_origin(annotation) in {Union, UnionType}:
        return [known for member in get_args(annotation) for known in _refers(member)]
    return []


CHECKS: dict[str, Check] = {}


@dataclass(kw_only=True)
class Collection:
    """An instructor's own checks by name, and what is wrong with them, each with its line in the file."""

    source: str
    checks: dict[str, Check] = field(default_factory=dict)
    faults: list[tuple[int, str]] = field(default_factory=list)


_COLLECTION: ContextVar[Collection | None] = ContextVar("collection", default=None)


@contextmanager
def collecting(source: str) -> Iterator[Collection]:
    """Checks that are registered in here are not the grader's; their faults are kept and not raised."""
    collection = Collection(source=source)
    token = _COLLECTION.set(collection)
    try:
        yield collection
    finally:
        _COLLECTION.reset(token)


def check(
    name: str, *, params: type[Record] = NoParams, **marks: bool
) -> Callable[[Callable[..., Verdict]], Callable[..., Verdict]]:
    """Register a function under a name, with `marks` of `Check` that are true of it (`messages_only=True`).

    Raises ValueError for a name that is taken or a fact that no one has, TypeError for a mark that there is not.
    """

    def register(function: Callable[..., Verdict]) -> Callable[..., Verdict]:
        own = _COLLECTION.get()
        problems = [*_problems(name, function), *(_own_problems(name, function, params, own) if own else ())]
        if problems and own is None:
            raise ValueError(f"check {name}: {problems[0]}")
        if problems and own is not None:
            line = getattr(getattr(function, "__code__", None), "co_firstlineno", 1)
            own.faults += [(line, f'check "{name}": {problem}') for problem in problems]
            return function
        title, sections = parts(inspect.getdoc(function) or "")
        (own.checks if own else CHECKS)[name] = Check(
            name=name,
            function=function,
            params=params,
            facts=tuple(inspect.signature(function).parameters),
            title=title,
            sections=sections,
            source=own.source if own else "",
            **marks,
        )
        return function

    return register


def _problems(name: str, function: Callable[..., Verdict]) -> Iterator[str]:
    unknown = [fact for fact in inspect.signature(function).parameters if fact not in FACTS]
    if unknown:
        yield f"there is no fact {', '.join(unknown)}; a check can ask for {', '.join(FACTS)}"
    if name in CHECKS or name in RESERVED:
        yield "the grader itself has a check of that name"


def _own_problems(
    name: str, function: Callable[..., Verdict], params: object, own: Collection
) -> Iterator[str]:
    """Yield what the grader's own tests hold for its own checks, and nothing but this holds for an instructor's."""
    if not NAME.fullmatch(name):
        yield "a name is lower-case letters, digits and hyphens, beginning with a letter"
    if name in own.checks:
        yield "is registered twice"
    if not (inspect.getdoc(function) or "").strip():
        yield "has no docstring: its first line is the title that a student reads"
    if not (isinstance(params, type) and issubclass(params, Record)):
        yield "params must be a class derived from Record"


def parts(docstring: str) -> tuple[str, dict[str, str]]:
    """Return the title line, and the text under each heading with its lines joined into paragraphs."""
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


class NotRecorded(Exception):
    """A run or the package was asked for that is not there; `verdict` says why, and what follows from it."""

    def __init__(self, verdict: Verdict) -> None:
        super().__init__(verdict.message)
        self.verdict = verdict


class NoSuchScenario(KeyError):
    """A scenario was asked for that the rubric does not have: a slip in the check itself."""

    def __str__(self) -> str:
        return str(self.args[0])


class Evidence(Mapping[str, Run]):
    """The runs by scenario, and `package`, the run of the build. Iterating yields those that were recorded.

    A scenario that was not recorded raises NotRecorded; one that the rubric does not have raises NoSuchScenario.
    """

    def __init__(
        self, found: Mapping[str, Run | Verdict], *, scenario: str | None, package: PackageFacts | Verdict
    ) -> None:
        self._found = dict(found)
        self._scenario = scenario
        self._package = package

    def __getitem__(self, scenario: str) -> Run:
        if scenario not in self._found:
            raise NoSuchScenario(f"there is no scenario {scenario!r}, only {', '.join(self._found)}")
        found = self._found[scenario]
        if isinstance(found, Verdict):
            raise NotRecorded(found)
        return found

    def __contains__(self, scenario: object) -> bool:
        # Mapping's own asks `__getitem__`, whose NotRecorded is no KeyError.
        return isinstance(self._found.get(str(scenario)), Run)

    def __iter__(self) -> Iterator[str]:
        return (name for name, run in self._found.items() if isinstance(run, Run))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def run(self) -> Run:
        """The run of the criterion's own scenario. Raises NoSuchScenario if it names none."""
        if self._scenario is None:
            raise NoSuchScenario("the criterion names no scenario, so there is no run: add scenario: to it")
        return self[self._scenario]

    @property
    def package(self) -> PackageFacts:
        """What the package's files say. Raises NotRecorded if no package was handed in."""
        if isinstance(self._package, Verdict):
            raise NotRecorded(self._package)
        return self._package
