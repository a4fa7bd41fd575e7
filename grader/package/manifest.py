"""`package.xml`: catkin_pkg says what it means and whether `catkin_make` takes it, lxml where it stands."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from pathlib import Path

from catkin_pkg.condition import evaluate_condition
from catkin_pkg.package import InvalidPackage, Package, parse_package_string
from lxml import etree

from grader.model.package import Dependency, Fault, Manifest, Person
from grader.package.manifest_causes import explain
from grader.package.reading import read_markup
from grader.package.xml import line_of, parse_xml

MANIFEST = "package.xml"
_TEXT_LETTERS = 4_000
_TAGS = 600
_CONDITIONS = 200
_CONDITION_LETTERS = 300
_CONDITION_BRACKETS = 20
_MESSAGE_LETTERS = 500
_FILTERS = threading.Lock()
"""Filters of warnings are the whole process's: two threads would leave each other's behind."""

# What `condition="$ROS_VERSION == 1"` (REP 149) is measured by: the labs are ROS 1 on its last distribution.
_CONTEXT = {"ROS_VERSION": "1", "ROS_DISTRO": "noetic", "ROS_PYTHON_VERSION": "3"}


def read_manifest(folder: Path) -> tuple[Manifest | None, Fault | None]:
    """The manifest of the package in `folder`, or None and why `catkin_make` would not take it."""
    data = read_markup(folder, MANIFEST)
    if isinstance(data, Fault):
        return None, _missing(folder, data)
    return parse_manifest(data)


def _missing(folder: Path, fault: Fault) -> Fault:
    if fault.kind != "Missing":
        return fault
    similar = next((p.name for p in sorted(folder.glob("*")) if p.name.lower() == MANIFEST), None)
    if similar is None or similar == MANIFEST:
        return fault
    cause = f"the file is called `{similar}`; catkin wants `{MANIFEST}` in small letters"
    return fault.model_copy(update={"cause": cause})


def parse_manifest(data: bytes) -> tuple[Manifest | None, Fault | None]:
    """The manifest from its bytes. Never raises."""
    if not data.strip():
        return None, _fault(1, "XMLSyntaxError", "no element found", "`package.xml` is empty")
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        cause = f"`package.xml` is not saved as UTF-8 (line {line}): save it as UTF-8"
        return None, _fault(line, "UnicodeDecodeError", error.reason, cause)
    # catkin reads the file as UTF-8, whatever its first line says
    root, fault = parse_xml(data, MANIFEST, root="package", encoding="utf-8")
    if root is None:
        return None, fault
    said: list[str] = []
    try:
        with _FILTERS, warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # catkin_pkg's own use of pyparsing
            return _manifest(_meaning(root, said), root, said), None
    except (InvalidPackage, AssertionError, ValueError, RecursionError) as error:
        message = str(getattr(error, "msg", error))[:_MESSAGE_LETTERS]
    place, cause = explain(message, root)
    return None, _fault(place, "InvalidPackage", "; ".join(message.split("\n")), cause)


def _fault(line: int | None, kind: str, message: str, cause: str) -> Fault:
    return Fault(file=MANIFEST, line=line, kind=kind, message=message, cause=cause)


def _meaning(root: etree._Element, said: list[str]) -> Package:
    """What catkin_pkg makes of it. Written anew from the tree, so that no DTD reaches its XML parser."""
    _shorten(root)
    text = etree.tostring(root, encoding="unicode", with_tail=False)
    package = parse_package_string(text, warnings=said)
    package.evaluate_conditions(_CONTEXT)
    return package


def _shorten(root: etree._Element) -> None:
    """Cut what is too long for catkin_pkg: its patterns take time by the square of a text's length.

    Raises ValueError for conditions that its parser could work on for years, and for more dependencies than it can
    compare with each other.
    """
    if len(root) > _TAGS:
        raise ValueError(f"more than {_TAGS} tags")
    if sum("condition" in element.attrib for element in root.iter(etree.Element)) > _CONDITIONS:
        raise ValueError(f"more than {_CONDITIONS} conditions")
    for element in root.iter():
        if element.text and len(element.text) > _TEXT_LETTERS:
            element.text = element.text[:_TEXT_LETTERS]
        if element.tail and len(element.tail) > _TEXT_LETTERS:
            element.tail = element.tail[:_TEXT_LETTERS]
        for name, value in element.attrib.items():
            element.set(name, value[:_TEXT_LETTERS])
        condition = element.get("condition") or ""  # a comment has no attributes, not even the default
        if len(condition) > _CONDITION_LETTERS or condition.count("(") > _CONDITION_BRACKETS:
            raise ValueError(f"condition '{condition[:40]}...' failed to parse")


def _manifest(package: Package, root: etree._Element, said: list[str]) -> Manifest:
    people = tuple(_people(root))
    return Manifest(
        file=MANIFEST,
        format=package.package_format,
        name=package.name,
        name_line=next(line_of(e) or 1 for tag, e in _elements(root) if tag == "name"),
        version=package.version,
        maintainers=people,
        licenses=tuple(str(text) for text in package.licenses),
        dependencies=tuple(_dependencies(root)),
        build_type=package.get_build_type(),
        advice=(*said, *_advice(package, people)),
    )


def _elements(root: etree._Element) -> Iterator[tuple[str, etree._Element]]:
    for element in root:
        if isinstance(element.tag, str):
            yield etree.QName(element).localname, element


def _text(element: etree._Element) -> str:
    return "".join([element.text or "", *(child.tail or "" for child in element)]).strip()


def _dependencies(root: etree._Element) -> Iterator[Dependency]:
    """Every `…depend` whose condition holds."""
    for tag, element in _elements(root):
        if _is_dependency(tag) and evaluate_condition(element.get("condition"), _CONTEXT):
            yield Dependency(kind=tag, name=_text(element), line=line_of(element) or 1)


def _is_dependency(tag: str) -> bool:
    return tag == "depend" or (tag.endswith("_depend") and tag != "group_depend")


def _people(root: etree._Element) -> Iterator[Person]:
    for tag, element in _elements(root):
        if tag == "maintainer":
            yield Person(name=_text(element), email=element.get("email") or "", line=line_of(element) or 1)


def _advice(package: Package, maintainers: tuple[Person, ...]) -> Iterator[str]:
    if any(text.strip().upper() == "TODO" for text in package.licenses):
        yield "the licence still says TODO"
    for person in maintainers:
        if person.email.lower().endswith("@todo.todo"):
            yield f"the maintainer's address is still {person.email}"
    if not any(d.name == "catkin" for d in package.buildtool_depends):
        yield "there is no <buildtool_depend>catkin</buildtool_depend>"
