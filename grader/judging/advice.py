"""What hints say besides, and costs nothing: scripts that do not parse, nodes that do not start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grader.checks.support.exit_causes import SYNTAX, syntax_hint
from grader.checks.support.launch import node_slip, not_executable, own_script
from grader.checks.support.scripts import PYTHON, chmod_hint, installed, is_product, names_script
from grader.model.package import LaunchFile, PackageFacts
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation, Status
from grader.rubric.model import Rubric

POINTS_MAX = 3
OF_FILES = ("build", "cmake", "manifest")
"""Checks whose criterion takes the advice: it is of the package as a whole."""


def add_advice(
    results: Sequence[CriterionResult], package: PackageFacts, rubric: Rubric
) -> tuple[CriterionResult, ...]:
    """Return the criteria, with what none of them tells as the hint of one that passed."""
    visible = {c.id for c in rubric.criteria if c.visibility == "visible"}
    good = [c for c in results if c.status is Status.PASS and c.id in visible]
    host = next((c for check in OF_FILES for c in good if c.check == check), None)
    points = [text for place, text in _points(package) if not _is_told(place, results)][:POINTS_MAX]
    if host is None or not points:
        return tuple(results)
    told = host.model_copy(update={"hint": "; ".join(filter(None, (host.hint, *points)))})
    return tuple(told if c is host else c for c in results)


def _points(package: PackageFacts) -> Iterator[tuple[FileCitation, str]]:
    for file in package.files:
        fault = file.python_fault
        if fault is not None and fault.kind in SYNTAX and not is_product(file.path):
            why = fault.cause or fault.message
            text = f"{file.path} does not parse: {why}; {syntax_hint(fault)}"
            yield FileCitation(file=file.path), text
    for launch in package.launch_files:
        if launch.fault is not None:
            why = launch.fault.cause or launch.fault.message
            yield launch.fault.place, f"{launch.path}, line {launch.fault.line}, is not well-formed: {why}"
        yield from _nodes(package, launch)


def _nodes(package: PackageFacts, launch: LaunchFile) -> Iterator[tuple[FileCitation, str]]:
    """Nodes whose program is not there, or not executable: roslaunch prints an error, and starts the others."""
    for node in launch.brings:
        if node.pkg != package.name or node.uncertain:
            continue
        script, slip = own_script(package, node), node_slip(package, node)
        if slip is not None:
            text = f"roslaunch leaves a <node> out: {slip.file}, line {slip.line}: {slip.why}; {slip.fix}"
            yield FileCitation(file=slip.file, line=slip.line), text
        elif script and script.executable is False and not _is_installed(package, script.path):
            text = f"{not_executable(script.path).why} ({node.file}, line {node.line}); {chmod_hint(script.path)}"
            yield FileCitation(file=script.path), text


def _is_installed(package: PackageFacts, path: str) -> bool:
    return any(one.call.name == PYTHON and names_script(one, path) for one in installed(package))


def _is_told(place: FileCitation, results: Sequence[CriterionResult]) -> bool:
    """Return whether a lost criterion cites the place, or a hint names it. Without a line it is the whole file."""
    words = place.file if place.line is None else f"{place.file}, line {place.line}"
    return any(words in c.hint or (c.status.is_lost and _cites(c, place)) for c in results)


def _cites(criterion: CriterionResult, place: FileCitation) -> bool:
    cited = (one for one in criterion.citations if isinstance(one, FileCitation))
    return any(one.file == place.file and place.line in {None, one.line} for one in cited)
