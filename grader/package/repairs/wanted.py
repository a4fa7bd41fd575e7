"""What a rubric names: files, topics, nodes and parameters, to which a near name in the package can be set right."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import PurePosixPath
from typing import Any

from grader.model.record import Record
from grader.rubric.model import Criterion, Rubric
from grader.wording import is_one_edit


class Wanted(Record):
    """Names as the rubric writes them, each once: topics and parameters from `/` on, paths from the package's folder
    on. `installed` are the scripts that `CMakeLists.txt` has to install, `dependencies` what the manifest has to
    declare, `types` the message types (`std_msgs/Int8`) of topics."""

    package: str
    scripts: tuple[str, ...] = ()
    launch_files: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()
    params: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    installed: tuple[str, ...] = ()
    dependencies: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    started: tuple[tuple[str, str], ...] = ()
    """Launch files, and the names of the scripts that each has to start."""


NAMES_ARE = {
    "node-name": "nodes",
    "node-lives": "nodes",
    "dependencies": "dependencies",
    "params-loaded": "params",
    "params-read": "params",
    "launch-loads": "params",
}
"""What the parameter `names` of a check holds."""
STARTED_BY = ("launch-xml", "launch-runs", "launch-loads")
PARAMETER_CHECKS = ("params-set", "param-value")
TOPIC_KEYS = ("topic", "asked_on")
TOPICS_OF = {
    "robot_world/robot_world": ("/scan", "/odom", "/cmd_vel"),
    "turtlesim/turtlesim_node": ("/turtle1/pose", "/turtle1/cmd_vel"),
}
"""What a program that a scenario starts has for the student's nodes: a rubric need not name it."""


def wanted_of(rubric: Rubric, package: str = "") -> Wanted:
    """Return what the rubric's scenarios and criteria name in one of its packages, the main one if none is given."""
    package = package or rubric.package
    criteria = [one for one in rubric.criteria if rubric.package_of(one) == package]
    found: dict[str, dict[str, None]] = {}
    for field, name in (*_of_scenarios(rubric, package), *_of_criteria(criteria)):
        if isinstance(name, str) and name and "*" not in name:
            found.setdefault(field, {})[name] = None
    started = dict.fromkeys(
        (c.parameters["launch"], PurePosixPath(script).name)
        for c in criteria
        if "launch" in c.parameters and c.check in STARTED_BY
        for script in (*c.parameters.get("scripts", ()), *filter(None, [c.parameters.get("script")]))
    )
    return Wanted(
        package=package, started=tuple(started), **{field: tuple(names) for field, names in found.items()}
    )


def _of_scenarios(rubric: Rubric, package: str) -> Iterator[tuple[str, Any]]:
    for scenario in rubric.scenarios.values():
        for start in scenario.start:
            yield from _each("topics", TOPICS_OF.get(start.program or ""))
            if rubric.package_of(start) == package:
                yield from (("scripts", start.script), ("launch_files", start.launch), ("files", start.load))
        for param in scenario.params:
            yield from (("params", param.name), ("files", param.file))
            yield from _each("params", param.also)
        for probe in scenario.probes:
            yield from (("topics", probe.topic), ("types", probe.type))
        for step in scenario.steps:
            sent, waited = step.published, step.wait
            yield from (("topics", sent.topic), ("types", sent.type)) if sent is not None else ()
            yield ("topics", waited.topic if waited is not None else None)
            yield ("params", step.set_param.name if step.set_param is not None else None)
        until = scenario.until
        yield from _each("topics", (*until.topics, *until.messages, *until.connected))


def _of_criteria(criteria: Iterable[Criterion]) -> Iterator[tuple[str, Any]]:
    for criterion in criteria:
        check, given = criterion.check, criterion.parameters
        yield from (("launch_files", given.get("launch")), ("files", given.get("file")))
        yield from (("topics", topic) for topic in _topics_in(given))
        yield ("types", given.get("type") if "topic" in given else None)
        yield from _each("topics", given.get("topics"))
        yield from _each("files", given.get("files"))
        yield from _each("dependencies", given.get("dependencies"))
        yield from _each("installed" if check == "cmake-install" else "scripts", given.get("scripts"))
        yield from (("scripts", given.get("script")), ("scripts", given.get("path")))
        yield from _each(NAMES_ARE.get(check, ""), given.get("names"))
        if check in PARAMETER_CHECKS:
            yield "params", given.get("name")
            yield from _each("params", given.get("unchanged"))


def _topics_in(given: Any) -> Iterator[Any]:  # noqa: ANN401 - as an instructor wrote it
    """Yield the topics that a check's parameters name, at any depth."""
    if isinstance(given, dict):
        yield from (given[key] for key in TOPIC_KEYS if key in given)
        for value in given.values():
            yield from _topics_in(value)


def _each(field: str, names: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - as an instructor wrote it
    if field and isinstance(names, list | tuple | dict):
        yield from ((field, name) for name in names)


# ---- names that are nearly right


def is_near(name: str, wanted: str) -> bool:
    """Return whether `name` is a slip of `wanted`: one letter, capitals, or a leading slash."""
    if name == wanted or min(len(name), len(wanted)) < SHORTEST:
        return False
    one, other = (text.casefold().lstrip("/~") for text in (name, wanted))
    return one == other or is_one_edit(one, other)


SHORTEST = 3
"""Shorter names differ by one letter because they are different names."""
