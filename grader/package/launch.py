"""Launch files: what they say, with lines, nothing executed (roslaunch's own loader runs commands)."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from lxml import etree

from grader.model.file_fault import Fault
from grader.model.launch_file import LAUNCH_TAGS, LaunchFile, LaunchNode
from grader.model.submission import SourcePackage
from grader.package.launch_loader import KEPT_AS_WRITTEN, Scope, load, unknown_attributes, wanted
from grader.package.reading import read_markup
from grader.package.xml import line_of, parse_what_is_left, parse_xml
from grader.wording import is_one_edit

_FILES_MAX = 100
_TAGS_MAX = 20_000
_VALUE_CHARS_MAX = 4_000
_COMMENTED_MAX = 50
_TYPE = re.compile(r"""\btype\s*=\s*["']([^"'\s]{1,200})["']""")
_SUFFIXES = (".launch", ".launch.xml", ".test")


class Beside(NamedTuple):
    """Another package of the submission: the path to its folder from that of the package that is read, the folder, and
    its regular files."""

    way: str
    folder: Path
    paths: Collection[str]


def packages_beside(
    package: SourcePackage, names: Collection[str], others: Iterable[SourcePackage]
) -> dict[str, Beside]:
    """Return the other packages of a submission by their names; `names` are those of the package itself."""
    return {
        one.name: Beside(posixpath.relpath(one.path, package.path), one.folder, one.executable)
        for one in others
        if one.name not in names
    }


Remaps = tuple[tuple[str, str], ...]


class _Parsed(NamedTuple):
    """`element` is the root where there is no fault, `root` its tag. `left` is what can be read of a faulty file."""

    element: etree._Element | None
    fault: Fault | None
    root: str | None = None
    left: etree._Element | None = None


def is_launch_file(path: str) -> bool:
    """Return whether `roslaunch PACKAGE NAME` finds it: by name, in any folder of the package."""
    return path.lower().endswith(_SUFFIXES)


def read_launch_files(
    folder: Path,
    paths: Iterable[tuple[str, str]],
    names: Iterable[str] = (),
    commands: Collection[tuple[str, tuple[str, ...]]] = (),
    others: Collection[str] = (),
    *,
    beside: Mapping[str, Beside] | None = None,
) -> tuple[LaunchFile, ...]:
    """Return each launch file; `paths` are pairs of the name to show and the path on disk relative to `folder`.

    `names` are the package's own, as `$(find …)` calls it, `others` those of packages that are there besides ROS's;
    `beside` are the submission's other packages by name, whose launch files may be included.
    After them come the files of `commands`, by their names, as roslaunch reads them with these arguments.
    """
    places, own = dict(paths), tuple(dict.fromkeys(names))
    beside = beside or {}
    inside = {
        f"{one.way}/{path}": (one.folder, path)
        for one in beside.values()
        for path in one.paths
        if path.endswith((*_SUFFIXES, ".xml"))
    }
    inside |= {shown: (folder, path) for shown, path in paths}
    ways = {name: one.way for name, one in beside.items()}
    library = _Library(places, lambda path: read_markup(*inside[path]), others, ways, inside)
    launched = (
        _record(path, library.parsed(path), library, own, given)
        for name, given in commands
        for path in library.paths
        if PurePosixPath(path).name == name
    )
    return (*_records(library, own), *launched)


def parse_launch_files(texts: Mapping[str, bytes], names: Iterable[str] = ()) -> tuple[LaunchFile, ...]:
    """Return the same from the files' bytes by path."""
    return _records(_Library(texts, lambda path: texts[path]), names)


def parse_launch(data: bytes, path: str) -> LaunchFile:
    """Return one launch file from its bytes. Never raises: what is wrong with it is the record's `fault`."""
    return _record(path, _parse(data, path), _Library({}, lambda _: data), ())


def _records(library: _Library, names: Iterable[str]) -> tuple[LaunchFile, ...]:
    own = tuple(dict.fromkeys(names))
    paths = list(filter(is_launch_file, library.paths))[:_FILES_MAX]
    return tuple(_record(path, library.parsed(path), library, own) for path in paths)


class _Library:
    """The package's files as launch files, each parsed once."""

    def __init__(
        self,
        paths: Collection[str],
        read: Callable[[str], bytes | Fault],
        others: Collection[str] = (),
        ways: Mapping[str, str] | None = None,
        included: Collection[str] | None = None,
    ) -> None:
        self.paths = paths
        self.others = frozenset(others)
        self.ways = ways or {}
        self._included = paths if included is None else included
        self._read = read
        self._parsed: dict[str, _Parsed] = {}
        self._tags = 0

    def parsed(self, path: str) -> _Parsed:
        if path not in self._parsed:
            self._parsed[path] = self._new(path)
        return self._parsed[path]

    def _new(self, path: str) -> _Parsed:
        data = self._read(path)
        if isinstance(data, Fault):
            return _Parsed(None, data.model_copy(update={"file": path}))
        self._tags += data.count(b"<")
        if self._tags > _TAGS_MAX:
            cause = "the launch files together hold too many tags, so this one was not read"
            return _Parsed(None, Fault(file=path, line=None, kind="TooLarge", message=cause, cause=cause))
        return _parse(data, path)

    def find(self, path: str) -> tuple[etree._Element | None, Fault | None]:
        if path not in self._included:
            return None, None
        found = self.parsed(path)
        return found.element, found.fault


def _parse(data: bytes, path: str) -> _Parsed:
    element, fault = parse_xml(data, path, root="launch")
    if element is None:
        broken = fault is not None and fault.kind == "XMLSyntaxError"
        return _Parsed(None, fault, left=parse_what_is_left(data) if broken else None)
    for tag in element.iter(etree.Element):
        for name, value in tag.attrib.items():
            if len(value) > _VALUE_CHARS_MAX:
                tag.set(name, value[:_VALUE_CHARS_MAX])
    root = str(element.tag)[:_VALUE_CHARS_MAX]
    if root != "launch":
        return _Parsed(None, _wrong_root(path, root, line_of(element)), root)
    nested = next((e for e in element.iter("launch") if e is not element), None)
    if nested is not None:
        return _Parsed(None, _nested_root(path, line_of(nested)), root)
    return _Parsed(element, None, root)


def _record(
    path: str, parsed: _Parsed, library: _Library, own: tuple[str, ...], given: tuple[str, ...] = ()
) -> LaunchFile:
    nodes: list[LaunchNode] = []
    includes: list[str] = []
    if parsed.element is None:
        left = [_node(e, ()) for e in parsed.left.iter("node")] if parsed.left is not None else ()
        return LaunchFile(
            path=path, root=parsed.root, nodes=(), includes=(), fault=parsed.fault, readable=tuple(left),
            given=given,
        )  # fmt: skip
    if wanted(parsed.element):
        _walk(parsed.element, (), nodes, includes)
    args = dict(one.split(":=", 1) for one in given)
    loaded = load(
        parsed.element, Scope(file=path, own=own, args=args), library.find, library.others, library.ways
    )
    return LaunchFile(
        path=path,
        root=parsed.root,
        nodes=tuple(nodes),
        includes=tuple(includes),
        brings=tuple(loaded.nodes),
        tests=tuple(loaded.tests),
        params=tuple(loaded.params),
        loads=tuple(loaded.loads),
        include_faults=tuple(loaded.faults),
        unknown_tags=tuple(_unknown(parsed.element)),
        switched_off=tuple(loaded.switched_off),
        unset_args=tuple(loaded.unset_args.values()),
        late_remaps=tuple(loaded.late_remaps),
        commented=tuple(islice(_commented(parsed.element), _COMMENTED_MAX)),
        given=given,
    )


def _commented(root: etree._Element) -> Iterator[tuple[str, int]]:
    """Yield the `type` of each node that stands in a comment, with its line."""
    for comment in root.iter(etree.Comment):
        text, ends = comment.text or "", line_of(comment) or 1  # libxml2 gives a comment's last line
        for found in _TYPE.finditer(text) if "node" in text else ():
            yield found[1], ends - text.count("\n", found.start())


def _unknown(parent: etree._Element) -> Iterator[tuple[str, int]]:
    """Yield the tags that roslaunch skips with a warning, `<Node>` for one, and those with another meaning that are
    written like a node: `<arg name="a" pkg="b" type="c.py"/>`."""
    for child in parent:
        if isinstance(child.tag, str):
            is_node = bool(child.get("pkg") and child.get("type"))
            if child.tag not in LAUNCH_TAGS or (is_node and child.tag not in {"node", "test"}):
                yield child.tag, line_of(child) or 0
            elif child.tag == "group":
                yield from _unknown(child)
            elif child.tag == "node":
                yield from (("node", line_of(inner) or 0) for inner in child.iterchildren("node"))


def _wrong_root(path: str, root: str, line: int | None) -> Fault:
    letters = " in lower case" if root.lower() == "launch" else ""
    cause = f"the file begins with `<{root}>`; roslaunch wants `<launch>`{letters}"
    fix = f"write `<launch>` instead of `<{root}>`, and `</launch>` instead of `</{root}>`"
    fix = fix if is_one_edit(root.lower(), "launch") or letters else ""
    return Fault(file=path, line=line, kind="WrongRoot", message=f"root tag is {root}", cause=cause, fix=fix)


def _nested_root(path: str, line: int | None) -> Fault:
    words = {"message": "more than one <launch>", "cause": "there is a second `<launch>` inside the first"}
    return Fault(file=path, line=line, kind="WrongRoot", fix="keep only one of the two", **words)


def _walk(parent: etree._Element, remaps: Remaps, nodes: list[LaunchNode], includes: list[str]) -> None:
    for child in parent:
        if not isinstance(child.tag, str) or not wanted(child):
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
        if wanted(child):
            remaps += _remap(child)
    written = {name: element.get(name.replace("_", "-")) for name in KEPT_AS_WRITTEN}
    return LaunchNode.model_validate(
        {**written, "remaps": remaps, "line": line_of(element) or 0, "unknown": unknown_attributes(element)}
    )
