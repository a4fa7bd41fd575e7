"""Launch files: what they say, with lines, nothing executed (roslaunch's own loader runs commands)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lxml import etree

from grader.model.package import Fault, LaunchFile, LaunchNode
from grader.package.reading import read_markup
from grader.package.xml import line_of, parse_xml

_SUFFIXES = (".launch", ".launch.xml", ".test")
_TRUE, _FALSE = frozenset({"true", "1"}), frozenset({"false", "0"})

Remaps = tuple[tuple[str, str], ...]


def is_launch_file(path: str) -> bool:
    """As `roslaunch PACKAGE NAME` finds it: by name, in any folder of the package."""
    return path.lower().endswith(_SUFFIXES)


def read_launch_files(folder: Path, paths: Iterable[tuple[str, str]]) -> tuple[LaunchFile, ...]:
    """Each launch file; `paths` are pairs of the name to show and the path on disk relative to `folder`."""
    return tuple(_read(folder, shown, path) for shown, path in paths if is_launch_file(shown))


def _read(folder: Path, shown: str, path: str) -> LaunchFile:
    data = read_markup(folder, path)
    if isinstance(data, Fault):
        return _broken(shown, data.model_copy(update={"file": shown}))
    return parse_launch(data, shown)


def parse_launch(data: bytes, path: str) -> LaunchFile:
    """One launch file from its bytes. Never raises: what is wrong with it is the record's `fault`."""
    element, fault = parse_xml(data, path, root="launch")
    if element is None:
        return _broken(path, fault)
    root = str(element.tag)
    if root != "launch":
        return _broken(path, _wrong_root(path, root, line_of(element)), root)
    nested = next((e for e in element.iter("launch") if e is not element), None)
    if nested is not None:
        return _broken(path, _nested_root(path, line_of(nested)), root)
    nodes: list[LaunchNode] = []
    includes: list[str] = []
    if _wanted(element):
        _walk(element, (), nodes, includes)
    return LaunchFile(path=path, root=root, nodes=tuple(nodes), includes=tuple(includes))


def _broken(path: str, fault: Fault | None, root: str | None = None) -> LaunchFile:
    return LaunchFile(path=path, root=root, nodes=(), includes=(), fault=fault)


def _wrong_root(path: str, root: str, line: int | None) -> Fault:
    letters = " in small letters" if root.lower() == "launch" else ""
    cause = f"the file begins with `<{root}>`; roslaunch wants `<launch>`{letters}"
    return Fault(file=path, line=line, kind="WrongRoot", message=f"root tag is {root}", cause=cause)


def _nested_root(path: str, line: int | None) -> Fault:
    cause = "a second `<launch>` stands inside the first: roslaunch wants exactly one"
    return Fault(file=path, line=line, kind="WrongRoot", message="more than one <launch>", cause=cause)


def _wanted(element: etree._Element) -> bool:
    """False where a literal `if` or `unless` switches the element off; anything else is left to run time."""
    on = (element.get("if") or "").strip().lower()
    off = (element.get("unless") or "").strip().lower()
    return on not in _FALSE and off not in _TRUE


def _walk(parent: etree._Element, remaps: Remaps, nodes: list[LaunchNode], includes: list[str]) -> None:
    for child in parent:
        if not isinstance(child.tag, str) or not _wanted(child):
            continue
        if child.tag == "remap":
            remaps += _remap(child)
        elif child.tag == "node":
            nodes.append(_node(child, remaps))
        elif child.tag == "include":
            includes.append(child.get("file") or "")
        elif child.tag == "group":
            _walk(child, remaps, nodes, includes)


def _remap(element: etree._Element) -> Remaps:
    return ((element.get("from") or "", element.get("to") or ""),)


def _node(element: etree._Element, remaps: Remaps) -> LaunchNode:
    for child in element.iterchildren("remap"):
        if _wanted(child):
            remaps += _remap(child)
    return LaunchNode(
        pkg=element.get("pkg"),
        type=element.get("type"),
        name=element.get("name"),
        ns=element.get("ns"),
        output=element.get("output"),
        launch_prefix=element.get("launch-prefix"),
        args=element.get("args"),
        remaps=remaps,
        line=line_of(element) or 0,
    )
