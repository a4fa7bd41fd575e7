"""`package.xml`: catkin_pkg says what it means and whether `catkin_make` takes it, lxml on which line.

What catkin_pkg refuses is put in plain words.
"""

from __future__ import annotations

import difflib
import re
import threading
import warnings
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path

from catkin_pkg.condition import evaluate_condition
from catkin_pkg.package import InvalidPackage, Package, parse_package_string
from lxml import etree

from grader.line_slips.python_habits import Reason
from grader.line_slips.xml import TAGS
from grader.model.file_fault import Fault
from grader.model.package import MANIFEST, Dependency, Manifest, Person
from grader.package.reading import read_markup
from grader.package.xml import find_strange, line_of, parse_xml

_TEXT_CHARS_MAX = 4_000
_TAGS = 600
_CONDITIONS = 200
_CONDITION_CHARS_MAX = 300
_CONDITION_BRACKETS = 20
_MESSAGE_CHARS_MAX = 500
_FILTERS = threading.Lock()
"""Filters of warnings are the whole process's: two threads would leave each other's behind."""

# What `condition="$ROS_VERSION == 1"` (REP 149) is measured by: the labs are ROS 1 on its last distribution.
_CONTEXT = {"ROS_VERSION": "1", "ROS_DISTRO": "noetic", "ROS_PYTHON_VERSION": "3"}
# catkin_pkg's message, the tag whose line is named, and the words ({0}, {1}: the pattern's groups)
_CAUSES: tuple[tuple[str, ...], ...] = (
    (r'contain a single "package" root', "", "the file must hold one `<package> ... </package>`",
     "write it as catkin_create_pkg makes it"),
    (r'exactly one "(\w+)" tag', "{0}", "there must be exactly one `<{0}>` tag", "delete one of them"),
    (r'not contain more than one "(\w+)"', "{0}", "there may be only one `<{0}>` tag", "delete one of them"),
    (r'"(\w+)" tag must have the attribute "(\w+)"', "{0}", '`<{0}>` needs {1}="..."', 'write {1}="..." in the tag'),
    (r'Invalid email ""', "maintainer", '`<maintainer>` needs email="name@place.org"'),
    (r'Invalid email "(.*?)"', "maintainer", "`{0}` is not an e-mail address", "write name@place.org"),
    (r"must have an email", "maintainer", '`<maintainer>` needs email="name@place.org"'),
    (r"name must not be empty", "name", "`<name>` is empty"),
    (r'Package name "(.*?)" does not follow naming', "name",
     "`{0}` is not a package name", "use letters, digits, `_` and `-`, no spaces, and start with a letter"),
    (r"version must not be empty", "version", "`<version>` is empty", "write 0.0.0"),
    (r'version "(.*?)" does not follow version', "version", "`{0}` is not a version", "write 0.0.0"),
    (r"description must not be empty", "description", "`<description>` is empty", "write a sentence"),
    (r"at least one maintainer", "", '`<maintainer email="...">` is missing', "{maintainer}"),
    (r'at least one "license"', "", "`<license>` is missing", "{license}"),
    (r"license tag must neither", "license", "`<license>` is empty"),
    (r"must not contain the following tags: (depend)$", "{0}", "format 1 has no `<{0}>`",
     'begin the file with `<package format="2">`'),
    (r"must not contain the following tags: (.*)", "{0}", "format {format} has no `<{0}>`"),
    (r"must not contain the following children: (.*)", "",
     "there is a tag inside another where only text belongs (`<{0}>`)", "a closing tag is missing before it"),
    (r'"(\w+)" tag must not have the following attributes: (.*)', "{0}", "`<{0}>` takes no attribute `{1}`",
     "delete `{1}` with its value"),
    (r"replace <run_depend> tags with <exec_depend>", "run_depend",
     "in format 2 and 3 `<run_depend>` is written `<exec_depend>`",
     "write exec_depend instead of run_depend, in the opening and in the closing tag of each of them"),
    (r"replace <exec_depend> tags with <run_depend>", "exec_depend",
     "format 1 has no `<exec_depend>`, which is `<run_depend>` there", 'begin the file with `<package format="2">`'),
    (r"generic dependency on '(.*?)' is redundant with: (.*)", "depend",
     "`<depend>{0}</depend>` says it all", "delete `<{1}>{0}</{1}>`"),
    (r'test dependency on "(.*?)" is redundant', "test_depend", "delete `<test_depend>{0}</test_depend>`"),
    (r'must not "\w+" on a package with the same name', "", "the package depends on itself", "delete the line"),
    (r"invalid literal for int|format version", "", "the format must be 1, 2 or 3", '`<package format="2">`'),
    (r"condition '(.*)' failed to parse", "", "the condition `{0}` cannot be read"),
    (r"Only one <build_type>", "export", "there may be only one `<build_type>`"),
)  # fmt: skip


_ALIKE = 0.8


def required_tags(name: str) -> dict[str, str]:
    """Return the tags that every manifest has (REP 127, 140, 149), each as it is written for a package of this name."""
    return {
        "name": f"<name>{name}</name>",
        "version": "<version>0.0.0</version>",
        "description": f"<description>The {name} package</description>",
        "maintainer": '<maintainer email="you@example.org">You</maintainer>',
        "license": "<license>BSD</license>",
    }


def read_manifest(folder: Path) -> tuple[Manifest | None, Fault | None]:
    """Return the manifest of the package in `folder`, or None and why `catkin_make` would not take it."""
    data = read_markup(folder, MANIFEST)
    if isinstance(data, Fault):
        return None, _missing(folder, data)
    return parse_manifest(data)


def _missing(folder: Path, fault: Fault) -> Fault:
    if fault.kind != "Missing":
        return fault
    names = [p.name for p in sorted(folder.glob("*")) if p.name.lower() in (MANIFEST, f"{MANIFEST}.txt")]
    if not names or MANIFEST in names:
        return fault
    cause = f"the file is called `{names[0]}`; catkin wants `{MANIFEST}`"
    return fault.model_copy(update={"cause": cause})


@lru_cache(maxsize=8)
def parse_manifest(data: bytes) -> tuple[Manifest | None, Fault | None]:
    """Return the manifest from its bytes. Never raises. Each repair asks for that of the same file."""
    if not data.strip():
        return None, _fault(1, "XMLSyntaxError", "no element found", "`package.xml` is empty")
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        cause = "it is saved as UTF-16" if wide else "it is not saved as UTF-8"
        return None, _fault(line, "UnicodeDecodeError", error.reason, cause, "save it as UTF-8")
    # catkin reads the file as UTF-8, whatever its first line says
    root, fault = parse_xml(data, MANIFEST, root="package", encoding="utf-8")
    if root is None:
        return None, fault
    manifest, message = _read(root)
    if manifest is not None:
        return manifest, None
    slip = find_strange(data.decode("utf-8"), "package")
    whole, _ = parse_xml(slip.text.encode(), MANIFEST, root="package") if slip is not None else (None, None)
    if slip is not None and whole is not None and _read(whole)[0] is not None:
        return None, _fault(slip.number, "InvalidPackage", "; ".join(message.split("\n")), slip.why, slip.fix)
    place, reason = explain(message, root)
    strange = re.search(r"must not contain the following tags: (\w+)", message)
    near = difflib.get_close_matches(strange[1], TAGS["package"], 1, _ALIKE) if strange else []
    if strange and near and near[0] != strange[1]:
        fix = f"write `<{near[0]}>` instead of `<{strange[1]}>`, and the same in its closing tag"
        reason = reason._replace(fix=fix)
    return None, _fault(place, "InvalidPackage", "; ".join(message.split("\n")), *reason)


def _read(root: etree._Element) -> tuple[Manifest | None, str]:
    """Return the manifest of a well-formed file, or None and what catkin_pkg says of it."""
    said: list[str] = []
    try:
        with _FILTERS, warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # catkin_pkg's own use of pyparsing
            return _manifest(_meaning(root, said), root, said), ""
    except (InvalidPackage, AssertionError, ValueError, RecursionError) as error:
        return None, str(getattr(error, "msg", error))[:_MESSAGE_CHARS_MAX]


def _fault(line: int | None, kind: str, message: str, cause: str, fix: str = "") -> Fault:
    return Fault(file=MANIFEST, line=line, kind=kind, message=message, cause=cause, fix=fix)


def _meaning(root: etree._Element, said: list[str]) -> Package:
    """Return what catkin_pkg makes of it. It gets the tree as newly written XML, so that no DTD reaches its parser."""
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
        if element.text and len(element.text) > _TEXT_CHARS_MAX:
            element.text = element.text[:_TEXT_CHARS_MAX]
        if element.tail and len(element.tail) > _TEXT_CHARS_MAX:
            element.tail = element.tail[:_TEXT_CHARS_MAX]
        for name, value in element.attrib.items():
            element.set(name, value[:_TEXT_CHARS_MAX])
        condition = element.get("condition") or ""  # a comment has no attributes, not even the default
        if len(condition) > _CONDITION_CHARS_MAX or condition.count("(") > _CONDITION_BRACKETS:
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
    """Yield every `…depend` whose condition holds."""
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


def explain(message: str, root: etree._Element) -> tuple[int | None, Reason]:
    """Return the line and the reasons, `; ` between them, of catkin_pkg's `message`, as far as they are known."""
    known: dict[Reason, int | None] = {}
    for text in filter(None, (part.strip("- ") for part in message.split("\n"))):
        for pattern, tag, *words in _CAUSES:
            if found := re.search(pattern, text):
                groups = found.groups()
                tags = {tag: f"add `{line}`" for tag, line in required_tags(_name_in(root)).items()}
                texts = (one.format(*groups, format=root.get("format", "1"), **tags) for one in words)
                reason = Reason(*texts)
                if "exactly one" in text:
                    reason = _of_one(groups[0], root, tags) or reason
                known.setdefault(reason, _line_of(root, tag.format(*groups)))
                break
    line = next((number for number in known.values() if number is not None), line_of(root))
    return line, _together(list(known))


def _name_in(root: etree._Element) -> str:
    return next((_text(element) for tag, element in _elements(root) if tag == "name"), "your_package")


def _of_one(wanted: str, root: etree._Element, tags: dict[str, str]) -> Reason | None:
    """Return what is to be said where a tag of which there has to be one is missing; None where it is there."""
    there = any(tag == wanted for tag, _ in _elements(root))
    return None if there or wanted not in tags else Reason(f"`<{wanted}>` is missing", tags[wanted])


def _together(reasons: Sequence[Reason]) -> Reason:
    """Return several as one: its `fix` begins with the first that there is."""
    first = next((at for at, one in enumerate(reasons) if one.fix), len(reasons) - 1)
    why = "; ".join(one.why for one in reasons[: first + 1])
    fixes = [*(one.fix for one in reasons[first : first + 1]), *(one.text for one in reasons[first + 1 :])]
    return Reason(why, "; ".join(fixes))


def _line_of(root: etree._Element, tags: str) -> int | None:
    """Return the line of the last element with one of the tags: where a tag stands twice, the second is too much."""
    wanted = tags.split(", ")
    lines = [line_of(element) for tag, element in _elements(root) if tag in wanted]
    return lines[-1] if lines else None
