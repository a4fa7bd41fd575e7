"""What of a package is to be run, and rubrics that only say so: their criterion is never judged."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath

from grader.authoring.observe import INTEGER_TYPES, Observed
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Criterion, Param, Probe, Rubric, Scenario, Start, Until

SOURCE_BYTES_MAX = 1 << 20
WATCH_S = 6.0
QUIET_LAUNCH_S = 2.0
WARPED_MESSAGES = 300
TEXT_PROBES = 8
INTEGER_PROBES = 9
STRING = "std_msgs/String"


class Parts(Record):
    """What can be run. `nodes` maps a start's name to its script or program, `launches` to its launch file; `configs`
    are the YAML files that may hold parameters."""

    nodes: dict[str, str]
    launches: dict[str, str]
    configs: tuple[str, ...] = ()

    @property
    def params(self) -> tuple[Param, ...]:
        """Every parameter of the package's own files, with made-up values."""
        return tuple(Param(file=path) for path in self.configs)


def find_parts(folder: Path, facts: PackageFacts) -> Parts:
    """Python files that call `init_node`, programs of `add_executable`, launch files that can be read."""
    scripts = [f.path for f in facts.files if f.python and not f.python_fault and _is_node(folder / f.path)]
    programs = [one.name for one in facts.cmake.executables] if facts.cmake else []
    launches = [f.path for f in facts.launch_files if f.fault is None and f.path.endswith(".launch")]
    taken: set[str] = set()
    nodes = {_name(path, taken): path for path in [*scripts, *programs]}
    configs = [
        f.path for f in facts.files if f.path.endswith((".yaml", ".yml")) and _holds_parameters(f.path)
    ]
    launch_names = {_name(path, taken): PurePosixPath(path).name for path in launches}
    return Parts(nodes=nodes, launches=launch_names, configs=tuple(configs))


def first_look(package: str, parts: Parts) -> LoadedRubric:
    """Each node alone, in real time, and each launch file."""
    scenarios = {
        name: Scenario(
            title=f"{PurePosixPath(script).name} in real time",
            params=parts.params,
            start=(Start(name=name, script=script),),
            until=Until(alive_s=WATCH_S, messages={}),
        )
        for name, script in parts.nodes.items()
    }
    for name, launch in parts.launches.items():
        until = Until(alive_s=QUIET_LAUNCH_S, quiet_s=0.0, messages={})
        scenarios[name] = Scenario(title=launch, start=(Start(name=name, launch=launch),), until=until)
    return only_runs(package, scenarios)


def second_look(package: str, parts: Parts, seen: Mapping[str, Observed]) -> LoadedRubric | None:
    """Messages for the nodes that listen, and a fast clock for those that count; None where there is nothing to see."""
    scenarios: dict[str, Scenario] = {}
    for name, script in parts.nodes.items():
        probes = tuple(p for topic, kind in seen[name].listens.items() if (p := probe_for(topic, kind)))
        if probes:
            scenarios[f"{name}-hears"] = Scenario(
                title=f"{PurePosixPath(script).name}, with messages made up for this run",
                params=parts.params,
                start=(Start(name=name, script=script),),
                probes=probes,
                until=Until(heard=True, messages={}),
            )
        counting = {
            topic.name: WARPED_MESSAGES for topic in seen[name].topics if topic.counts_from is not None
        }
        if counting:
            scenarios[f"{name}-fast"] = Scenario(
                title=f"{PurePosixPath(script).name} with a fast clock",
                clock="warped",
                params=parts.params,
                start=(Start(name=name, script=script),),
                until=Until(messages=counting),
            )
    return only_runs(package, scenarios) if scenarios else None


def probe_for(topic: str, kind: str) -> Probe | None:
    """Made-up messages of that type, None for a type of which none can be made up."""
    if kind == STRING:
        return Probe(topic=topic, type=kind, text=TEXT_PROBES)
    if kind in INTEGER_TYPES:
        return Probe(topic=topic, type=kind, integers=INTEGER_PROBES, among=(0,))
    return None


def only_runs(package: str, scenarios: Mapping[str, Scenario]) -> LoadedRubric:
    """Return a rubric for recording."""
    first = next(iter(scenarios), None)
    criterion = Criterion.model_validate(
        {"id": "recorded", "title": "Recorded", "points": 0, "check": "none", "scenario": first}
    )
    about = {"schema": "grader.rubric/1", "id": "look", "title": "A look", "version": "0", "package": package}
    rubric = Rubric.model_validate({**about, "scenarios": dict(scenarios), "criteria": (criterion,)})
    return LoadedRubric(rubric=rubric, path=Path(), digest="")


def _is_node(path: Path) -> bool:
    """Return whether the file calls `init_node`; it is read, not run."""
    if path.stat().st_size > SOURCE_BYTES_MAX:
        return False
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError, RecursionError):
        return False
    calls = (node.func for node in ast.walk(tree) if isinstance(node, ast.Call))
    return "init_node" in {_last_name(function) for function in calls}


def _holds_parameters(path: str) -> bool:
    """By its folder: other YAML files are someone else's, a CI's for instance."""
    return {"config", "cfg", "param", "params", "yaml"} & set(PurePosixPath(path).parts[:-1]) != set()


def _last_name(function: ast.expr) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def _name(path: str, taken: set[str]) -> str:
    """A start's name that no other has: `scripts/numeric_talker.py` becomes `numeric-talker`."""
    stem = re.sub(r"[^a-z0-9]+", "-", PurePosixPath(path).stem.lower()).strip("-")
    stem = stem if stem[:1].isalpha() else f"p-{stem}".rstrip("-")
    stem += "-launch" if path.endswith(".launch") else ""
    name = next(n for n in _numbered(stem) if n not in taken)
    taken.add(name)
    return name


def _numbered(stem: str) -> Iterable[str]:
    yield stem
    yield from (f"{stem}-{number}" for number in range(2, 1000))
