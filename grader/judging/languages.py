"""A hint speaks of the node that it is for: of rospy to one in Python, of roscpp to one in C++."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

from grader.checks.support.idioms import Language, in_language
from grader.checks.support.scripts import find_script, programs
from grader.checks.support.text import texts_in
from grader.evidence.run import Run
from grader.judging.facts import Facts
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict
from grader.rubric.model import Criterion, Scenario

SOURCES = {".c", ".cc", ".cpp", ".cxx"}


def said_for_node(verdict: Verdict, criterion: Criterion, facts: Facts) -> Verdict:
    """Return the verdict with its hint in the language of the node that it judges."""
    if in_language(verdict.hint, "python") == verdict.hint:
        return verdict
    hint = in_language(verdict.hint, _language_of(verdict, criterion, facts))
    return verdict.model_copy(update={"hint": hint})


def _language_of(verdict: Verdict, criterion: Criterion, facts: Facts) -> Language | None:
    """The one of the nodes that the message names, that the criterion names, that publish on its topic, or of all.

    None where the scenario runs nodes of both and nothing tells which is meant.
    """
    name = criterion.scenario or ""
    scenario, run = facts.rubric.scenarios.get(name), facts.runs.get(name)
    if scenario is None or facts.package is None:
        return "python"
    asked = set(texts_in(criterion.parameters))
    known = _languages(facts, scenario, run)
    graph = run.graph if run else ()
    publishing = {node for _, event in graph for topic in asked for node in event.publishers.get(topic, ())}
    for nodes in (set(re.findall(r"[\w/-]+", verdict.message)), asked, publishing, known):
        found = {known[one] for one in nodes if one in known}
        if len(found) == 1:
            return found.pop()
    return None if known else "python"


def _languages(facts: Facts, scenario: Scenario, run: Run | None) -> dict[str, Language]:
    """What each process and each node of the scenario is written in, by its name."""
    found: dict[str, Language] = {}
    for start in scenario.start:
        package = facts.package_of(start)
        if package is None:
            continue
        if start.built:
            found[start.name] = "cpp"
        elif start.script:
            found[start.name] = _written_in(package, start.script)
        for launch in package.launch_files:
            own = [n for n in launch.brings if PurePosixPath(launch.path).name == start.launch and n.type]
            packages = {one.name: one for one in (*package.also, package)}
            found |= {
                n.full_name: _written_in(packages[n.pkg], str(n.type)) for n in own if n.pkg in packages
            }
    for _, event in run.graph if run else ():
        for node, process in event.processes.items():
            name = process.partition("/")[0]
            found |= {node: found[name]} if name in found else {}
    return found


def _written_in(package: PackageFacts, path: str) -> Language:
    file, name = find_script(package, path), PurePosixPath(path)
    if file is not None and file.python:
        return "python"
    built = any(name.stem == one.target or one.is_called(name.name) for one in programs(package))
    return "cpp" if built or name.suffix in SOURCES else "python"
