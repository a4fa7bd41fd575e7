"""What `roslaunch` makes of a launch file with all that it includes of the same submission; nothing is executed.

`Scope` is what a tag sees where it stands: arguments, namespace, remaps, and `$(…)` as far as it is literal.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import PurePosixPath
from typing import Any, Protocol

from lxml import etree
from pydantic import Field

from grader.installable import TUTORIALS, known_packages
from grader.line_slips.xml import ATTRIBUTES
from grader.model.file_fault import Fault
from grader.model.launch_file import (
    SUBSTITUTION,
    LateRemap,
    LaunchArg,
    LaunchLine,
    LaunchLoad,
    LaunchNode,
    LaunchParam,
)
from grader.model.record import Record
from grader.package.xml import line_of
from grader.wording import PAIR, is_another_number, is_one_edit

INCLUDES_MAX = 50
DEPTH_MAX = 10
WORK_MAX = 10_000
OF_GROUP = ("ns", "clear_params", "if", "unless")
"""The attributes of a `<group>`."""
STARTING = ("node", "group", "include")
KEPT_AS_WRITTEN = ("pkg", "type", "name", "ns", "output", "launch_prefix", "args")
"""Attributes of a `<node>`, also of one that no scope resolves."""
_TOO_MUCH = "launch files that hold more than a robot can start"
_FOUND = re.compile(r"\$\(find\s+([^()\s]+)\s*\)/+(.+)")
_SUBSTITUTION = re.compile(r"\$\(([^()]*)\)")
_ARGUMENT = re.compile(r"\$\(arg\s+([^()\s]+)\s*\)")
_WORDS = re.compile(r"\$\((\w+)\s*([\w-]*)[^()]*\)")
SUBSTITUTIONS = ("find", "arg", "env", "optenv", "anon", "eval", "dirname")
_NESTED = re.compile(r"\$\((?!eval\b)[^()$]*\$\(\w+ [^()]*\)")
_UNSET_MAX = 20
_OFF_MAX = 20
_SLASHES = re.compile(r"//+")
# Of one value: arguments that name each other can double at every step.
_VALUE_CHARS_MAX = 4_000
_TRUE, _FALSE = frozenset({"true", "1"}), frozenset({"false", "0"})

Remaps = tuple[tuple[str, str], ...]


class Find(Protocol):
    """Gives the root of a launch file by its path from the package, or its fault; neither where there is no such."""

    def __call__(self, path: str, /) -> tuple[etree._Element | None, Fault | None]: ...


@dataclass(kw_only=True)
class Loaded:
    """All that was found, in the file's order."""

    nodes: list[LaunchNode] = field(default_factory=list)
    tests: list[LaunchNode] = field(default_factory=list)
    params: list[LaunchParam] = field(default_factory=list)
    loads: list[LaunchLoad] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    unset_args: dict[tuple[str, str], LaunchArg] = field(default_factory=dict)
    switched_off: list[tuple[str, int, str]] = field(default_factory=list)
    late_remaps: list[LateRemap] = field(default_factory=list)
    included: int = 0
    work: int = 0

    def full(self, more: int) -> bool:
        """Return whether there is too much of it already; `more` is what the next tag takes."""
        self.work += 1 + more
        return self.work > WORK_MAX


def load(
    root: etree._Element,
    scope: Scope,
    find: Find,
    others: frozenset[str] = frozenset(),
    ways: Mapping[str, str] | None = None,
) -> Loaded:
    """Walk the file. `find` gives the root of another launch file by its path, or its fault; `others`
    are packages that are there besides ROS's; `ways` are the paths to the submission's other packages, by name."""
    loader = _Loader(find, others, {**(ways or {}), **dict.fromkeys(scope.own, "")})
    if wanted(root, scope):
        loader.walk(root, scope, 0)
    return loader.loaded


def node_of(element: etree._Element, scope: Scope) -> LaunchNode:
    """Return one `<node>` as it stands in this scope, with its own `<remap>`s."""
    inside = [one for one in element if isinstance(one.tag, str)]
    remapping = [one for one in inside if one.tag == "remap" and wanted(one, scope)]
    off = [one for one in inside if one.tag in {"param", "remap"} and not wanted(one, scope)]
    below = scope.below(scope.get(element, "ns"), element)
    words = (word.partition(":=") for word in (scope.get(element, "args") or "").split())
    # `_name:=value` sets a parameter of the node's own, and renames nothing.
    renamed = [(old, new) for old, _, new in words if old and new and not old.startswith("_")]
    by_args = [_line(element, scope, old).model_copy(update={"tag": "args"}) for old, _ in renamed]
    remaps = (*scope.remaps, *(_remap(one, scope) for one in remapping), *renamed)
    by_tags = (_line(one, scope, scope.get(one, "from")) for one in remapping)
    renaming = (*below.renaming, *by_tags, *by_args)
    names = (*KEPT_AS_WRITTEN, "machine", "respawn", "required")
    given: dict[str, Any] = {name: scope.get(element, name.replace("_", "-")) for name in names}
    return LaunchNode(
        **given,
        remaps=remaps,
        line=line_of(element) or 0,
        file=scope.file,
        namespace=below.namespace,
        renaming=renaming,
        by_args=tuple(_by_args(element, scope, remapping)),
        uncertain=scope.uncertain,
        condition=scope.condition,
        left_out=tuple(
            _line(one, scope, _condition(one)).model_copy(
                update={"tag": one.get("name") or one.get("from") or ""}
            )
            for one in off
        ),
        unknown=(*unknown_attributes(element), *scope.unknown),
    )


def _by_args(
    element: etree._Element, scope: Scope, remapping: Sequence[etree._Element]
) -> Iterator[LaunchLine]:
    """Yield the `<arg>`s that give the node's names, and the new ones of its topics, where they are nothing else."""
    written = [(name, element.get(name)) for name in ("pkg", "type", "name")]
    written += [("to", one.get("to")) for one in remapping]
    for name, text in written:
        if place := scope.place_of(text):
            yield place.model_copy(update={"tag": name})


def _condition(element: etree._Element) -> str:
    """Return the `if` or `unless` of a tag as it is written."""
    return " ".join(f'{key}="{element.get(key)}"' for key in ("if", "unless") if element.get(key))


class _Loader:
    def __init__(self, find: Find, others: frozenset[str], ways: Mapping[str, str]) -> None:
        self.loaded = Loaded()
        self._find = find
        self._ways = ways
        self._others = others

    def walk(self, parent: etree._Element, scope: Scope, depth: int) -> None:
        """Read tag by tag: each changes the scope for those that follow it."""
        for child in parent:
            if not isinstance(child.tag, str):
                continue
            if not wanted(child, scope):
                self._note_off(child)
                continue
            if self.loaded.full(len(scope.args) // 10 + len(scope.renaming) // 10 + len(scope.private)):
                self._stop(child, scope)
                return
            self._note_unset(child, scope)
            if child.tag == "group":
                inner = scope.of(child).below(scope.get(child, "ns"), child)
                others = tuple(str(name)[:100] for name in child.attrib if name not in OF_GROUP)
                self.walk(child, inner.model_copy(update={"unknown": (*scope.unknown, *others)[:10]}), depth)
            elif child.tag == "include":
                self._include(child, scope.of(child), depth)
            elif child.tag in {"arg", "remap", "param"}:
                scope = self._change_scope(child, scope)
            else:
                self._add(child, scope.of(child))
        self._note_late(parent, scope)

    def _note_late(self, parent: etree._Element, scope: Scope) -> None:
        """Note the `<remap>`s behind all that starts nodes: they are in force only for what follows."""
        tags = [one for one in parent if isinstance(one.tag, str) and wanted(one, scope)]
        starting = [place for place, one in enumerate(tags) if one.tag in STARTING]
        for one in (one for one in tags[starting[-1] :] if one.tag == "remap") if starting else ():
            said = _line(one, scope, scope.get(one, "from")).model_dump()
            said |= {"namespace": scope.namespace, "to": _remap(one, scope)[1]}
            self.loaded.late_remaps.append(LateRemap(**said, above=line_of(tags[starting[0]]) or 0))

    def _note_off(self, element: etree._Element) -> None:
        """Note the nodes that are left out, by the `if` or `unless` of the tag that leaves them out."""
        said = _condition(element)
        off = ((node.get("type") or "", line_of(element) or 0, said) for node in element.iter("node"))
        self.loaded.switched_off += islice(off, max(0, _OFF_MAX - len(self.loaded.switched_off)))

    def _stop(self, child: etree._Element, scope: Scope) -> None:
        if not any(fault.message == _TOO_MUCH for fault in self.loaded.faults):
            self.loaded.faults.append(_fault(child, scope, _TOO_MUCH))

    def _change_scope(self, child: etree._Element, scope: Scope) -> Scope:
        if child.tag == "arg":
            return _with_arg(child, scope)
        if child.tag == "remap":
            line = _line(child, scope, scope.get(child, "from"))
            remaps = (*scope.remaps, _remap(child, scope))
            return scope.model_copy(update={"remaps": remaps, "renaming": (*scope.renaming, line)})
        return self._param(child, scope)

    def _add(self, child: etree._Element, scope: Scope) -> None:
        if child.tag == "node":
            self._node(child, scope)
        elif child.tag == "rosparam":
            self._load(child, scope)
        elif child.tag == "test":
            self.loaded.tests.append(node_of(child, scope))

    def _node(self, element: etree._Element, scope: Scope) -> None:
        own = [c for c in element if isinstance(c.tag, str) and wanted(c, scope)]
        node = node_of(element, scope)
        self.loaded.nodes.append(node)
        # A `<param>` or `<rosparam>` in a `<node>` is private: it goes below the node's name.
        inside = scope.model_copy(update={"namespace": f"{node.full_name}/"})
        for child in own:
            self._note_unset(child, scope)
            if child.tag == "rosparam":
                self._load(child, inside)
            elif child.tag == "param":
                self.loaded.params.append(_private(_param(child, inside), inside))
        self.loaded.params += [_private(param, inside) for param in scope.private]

    def _note_unset(self, element: etree._Element, scope: Scope) -> None:
        """Note what the tag asks for by `$(arg …)` and nothing gives: roslaunch starts nothing then."""
        found, file, line = self.loaded.unset_args, scope.file, line_of(element) or 0
        name = element.get("name") or ""
        if element.tag == "arg" and _with_arg(element, scope) is scope and name not in scope.args:
            found[file, name] = LaunchArg(name=name, declared=True, file=file, line=line)
        self._note_unresolved(element, scope)
        for asked in (name for value in element.attrib.values() for name in _ARGUMENT.findall(str(value))):
            if asked not in scope.args and len(found) < _UNSET_MAX:
                meant = next((one for one in islice(scope.args, _UNSET_MAX) if _is_slip(asked, one)), "")
                arg = LaunchArg(name=asked, declared=False, file=file, line=line, meant=meant)
                found.setdefault((file, f"{asked}:{line}" if meant else asked), arg)

    def _note_unresolved(self, element: etree._Element, scope: Scope) -> None:
        """Note a `$(…)` that is none of roslaunch's, or that finds a package of nearly this one's name."""
        own, fault = next(iter(scope.own), ""), ("", "")
        for value in () if scope.of(element).uncertain else element.attrib.values():
            if nested := _NESTED.search(str(value)):
                fault = (
                    f"{nested[0]}…) has a $(…) in another one",
                    "write the name itself in place of the inner $(…)",
                )
            for word, name in _WORDS.findall(str(value)):
                if word not in SUBSTITUTIONS:
                    near = (one for one in SUBSTITUTIONS if is_one_edit(word.lower(), one))
                    right = "find" if name in scope.own else next(near, "arg" if name else "find")
                    fault = f"roslaunch does not know $({word} …)", f"write $({right} {name or '…'})"
                elif word == "find" and is_one_edit(name, own) and not self._is_known(name, scope):
                    # `_include` notes its own, and what another lab is called is no slip.
                    if element.tag == "include" or is_another_number(name, own):
                        continue
                    fault = f"there is no package {name}: this one is called {own}", f"write $(find {own})"
        if fault[0]:
            noted = _fault(element, scope, *fault)
            self.loaded.faults.append(noted.model_copy(update={"kind": SUBSTITUTION}))

    def _is_known(self, name: str, scope: Scope) -> bool:
        return name in scope.own or name in self._others or name in known_packages()

    def _param(self, element: etree._Element, scope: Scope) -> Scope:
        param = _param(element, scope)
        if param.name.startswith("~"):
            return scope.model_copy(update={"private": (*scope.private, param)})
        self.loaded.params.append(param.model_copy(update={"name": scope.resolved(param.name)}))
        return scope

    def _load(self, element: etree._Element, scope: Scope) -> None:
        below = scope.below(scope.get(element, "ns")).below(scope.get(element, "param"))
        load = LaunchLoad(
            source=scope.get(element, "file"),
            command=scope.get(element, "command") or "load",
            namespace=below.namespace,
            file=scope.file,
            line=line_of(element) or 0,
        )
        self.loaded.loads.append(load)
        name, value = scope.get(element, "param"), scope.text(element.text or "").strip()
        if name and load.source is None and load.command == "load" and len(value.splitlines()) == 1:
            whole = below.namespace.rstrip("/")
            given = {"name": whole, "value": value, "type": None, "file": scope.file, "line": load.line}
            self.loaded.params.append(LaunchParam(**given, attribute="param"))

    def _include(self, element: etree._Element, scope: Scope, depth: int) -> None:
        written = scope.get(element, "file") or ""
        path = scope.own_path(written)
        of_package = {"own": scope.own, "way": scope.way}
        if path is None and (beside := self._find_beside(written)) is not None:
            path, of_package = beside
        if path is None:
            if slip := self._misnamed_package(scope, written):
                message = f"it includes a file of the package {slip}, which is called {scope.own[0]}"
                fix = f'write file="{written.replace(slip, scope.own[0], 1)}"'
                self.loaded.faults.append(_fault(element, scope, message, fix))
            return
        if "$(" in path:  # which file it is, only roslaunch can tell
            return
        self.loaded.included += 1
        if depth >= DEPTH_MAX or self.loaded.included > INCLUDES_MAX:
            message = "launch files that include each other endlessly"
            self.loaded.faults.append(_fault(element, scope, message))
            return
        root, fault = self._find(path)
        if root is None and scope.uncertain:
            return
        if root is None:
            reason = f"it is not well-formed: {fault.explanation}" if fault else "it is not in the package"
            advice = f": {fault.advice}" if fault and fault.advice else ""
            fix = f"first fix {path}{advice}" if fault else f"write {path}, or push it"
            self.loaded.faults.append(_fault(element, scope, f"it includes {path}, and {reason}", fix))
        elif wanted(root, scope):
            self.walk(root, _included(element, scope, path).model_copy(update=of_package), depth + 1)

    def _find_beside(self, path: str) -> tuple[str, dict[str, Any]] | None:
        """Return the path to a launch file of another package of the submission, if it is there, with the
        part of its scope that is of that package."""
        found = _FOUND.fullmatch(path.strip())
        inside = _plain(found[2]) if found is not None and found[1] in self._ways else None
        if found is None or inside is None:
            return None
        way = self._ways[found[1]]
        whole = f"{way}/{inside}" if way else inside
        there = self._find(whole) != (None, None)
        return (whole, {"own": (found[1],), "way": way}) if there else None

    def _misnamed_package(self, scope: Scope, path: str) -> str:
        """Return the package that `$(find …)/…` names for this one: a slip of its name; or, where this package has the
        file, a handout's name, or one that nobody knows and that has a word of this one's."""
        found = _FOUND.fullmatch(path.strip())
        if found is not None and found[1] in self._others:
            return ""
        unknown = found is not None and found[1] not in known_packages()
        inside = _plain(found[2]) if found is not None and unknown else None
        # A file that stands in for one of the same name includes that one.
        is_here = inside not in (None, scope.file) and self._find(str(inside))[0] is not None
        meant = found is not None and is_here and (found[1] in TUTORIALS or _shares_word(found[1], scope.own))
        return found[1] if found is not None and meant else scope.misspelt_package(path)


USUAL = frozenset(
    {"bringup", "config", "control", "description", "gazebo", "launch", "msgs", "navigation", "robot"}
)
"""Words in the names of many packages."""


def _shares_word(name: str, own: Sequence[str]) -> bool:
    words, others = (
        {word for one in names for word in re.split(r"[\W\d_]+", one.lower()) if len(word) > PAIR} - USUAL
        for names in ((name,), own)
    )
    return bool(words & others) or any(is_one_edit(name, one) for one in own)


def _included(element: etree._Element, scope: Scope, path: str) -> Scope:
    """An included file sees only the arguments that it is given."""
    passed = (scope.get(element, "pass_all_args") or "").lower() == "true"
    given = Scope(file=path, own=scope.own)
    for child in element.iterchildren("arg"):
        if wanted(child, scope):
            value = scope.get(child, "value") or scope.get(child, "default") or ""
            given = given.model_copy(update=_given(child, scope, given, child.get("name") or "", value))
    args = {**scope.args, **given.args} if passed else given.args
    places = {**scope.places, **given.places} if passed else given.places
    inside = scope.below(scope.get(element, "ns"), element)
    return inside.model_copy(update={"file": path, "args": args, "places": places})


_TOLD_APART = re.compile(r"\d|[xyz]\b|[xyz](?=_)|(?<=_)[xyz]|(?<![^\W_])[a-z](?![^\W_])")
"""What tells names apart on purpose: a digit, an axis, a letter alone."""


def _is_slip(asked: str, name: str) -> bool:
    """Return whether one letter, capitals or a shorter form tell the names of two arguments apart: not a digit or an
    axis, nor all they have."""
    one, other = asked.lower(), name.lower()
    on_purpose = one != other and _TOLD_APART.sub("", one) == _TOLD_APART.sub("", other)
    short, longer = sorted((one, other), key=len)
    is_form = len(short) > PAIR and longer.startswith(short) and longer[len(short) :].isalpha()
    return len(one) > PAIR and not on_purpose and (one == other or is_form or is_one_edit(one, other))


def _with_arg(element: etree._Element, scope: Scope) -> Scope:
    name = scope.get(element, "name") or ""
    value, default = scope.get(element, "value"), scope.get(element, "default")
    # What is given from outside goes before the file's own default.
    if value is None and (default is None or name in scope.args):
        return scope
    return scope.model_copy(
        update=_given(element, scope, scope, name, value if value is not None else default)
    )


def _given(element: etree._Element, scope: Scope, to: Scope, name: str, value: str | None) -> dict[str, Any]:
    """Return the arguments of `to` with one more, that the `<arg>` gives, and where each stands."""
    attribute = "default" if element.get("value") is None else "value"
    place = scope.place_of(element.get(attribute)) or _line(element, scope, attribute)
    return {"args": {**to.args, name: value}, "places": {**to.places, name: place}}


def _line(element: etree._Element, scope: Scope, value: str | None) -> LaunchLine:
    return LaunchLine(tag=str(element.tag), value=value or "", file=scope.file, line=line_of(element) or 0)


def _remap(element: etree._Element, scope: Scope) -> tuple[str, str]:
    return scope.get(element, "from") or "", scope.get(element, "to") or ""


def _param(element: etree._Element, scope: Scope) -> LaunchParam:
    return LaunchParam(
        name=(scope.get(element, "name") or "").strip(),
        value=scope.get(element, "value"),
        type=scope.get(element, "type"),
        file=scope.file,
        line=line_of(element) or 0,
        by_arg=scope.place_of(element.get("value")),
    )


def _private(param: LaunchParam, inside: Scope) -> LaunchParam:
    """Return a parameter of a node's own: a slash in front of its name does not lead out of it."""
    return param.model_copy(update={"name": inside.resolved(param.name.lstrip("~/"))})


def _fault(element: etree._Element, scope: Scope, message: str, fix: str = "remove this <include>") -> Fault:
    words = {"message": message, "cause": "this <include> brings nothing", "fix": fix}
    return Fault(file=scope.file, line=line_of(element), kind="Include", **words)


class Scope(Record):
    """`own` are the package's names, the first its usual one; `private` are `<param name="~…">` for later nodes.

    `uncertain`: an `if` or `unless` that only roslaunch can work out decides whether the tag counts.
    """

    file: str
    own: tuple[str, ...]
    way: str = ""
    """From the folder of the package that is read to that of the package which has the file, if it is another."""
    namespace: str = "/"
    args: Mapping[str, str] = Field(default_factory=dict)
    places: Mapping[str, LaunchLine] = Field(default_factory=dict)
    remaps: Remaps = ()
    renaming: tuple[LaunchLine, ...] = ()
    private: tuple[LaunchParam, ...] = ()
    uncertain: bool = False
    condition: LaunchLine | None = None
    unknown: tuple[str, ...] = ()

    def text(self, written: str) -> str:
        """Resolve `$(arg …)`, `$(dirname)` and `$(optenv NAME DEFAULT)`; what only roslaunch knows stays as it is."""
        short = written[:_VALUE_CHARS_MAX]
        text = _SUBSTITUTION.sub(lambda found: self._value(found[0], found[1].split()), short)
        return text[:_VALUE_CHARS_MAX]

    def get(self, element: etree._Element, name: str) -> str | None:
        """Return an attribute resolved, None where it is not there."""
        written = element.get(name)
        return None if written is None else self.text(written)

    def place_of(self, written: str | None) -> LaunchLine | None:
        """Return the `<arg>` that gives a text that is nothing but a `$(arg …)`."""
        found = _SUBSTITUTION.fullmatch((written or "").strip()[:_VALUE_CHARS_MAX])
        words = found[1].split() if found else []
        return self.places.get(words[1]) if len(words) == 2 and words[0] == "arg" else None

    def of(self, element: etree._Element) -> Scope:
        """Return the scope in the element, as far as its own conditions go."""
        conditions = f"{self.get(element, 'if') or ''}{self.get(element, 'unless') or ''}"
        found = {"uncertain": True, "condition": _line(element, self, _condition(element))}
        return self.model_copy(update=found) if "$(" in conditions else self

    def below(self, namespace: str | None, element: etree._Element | None = None) -> Scope:
        """Return the scope in a group, node or include with this `ns`, which is noted where the element is given."""
        if not namespace:
            return self
        whole = namespace if namespace.startswith("/") else f"{self.namespace}{namespace}"
        given = self.place_of(element.get("ns")) if element is not None else None
        line = _line(element, self, namespace) if element is not None else None
        noted = (line.model_copy(update={"by_arg": given}),) if line is not None else ()
        inner = _SLASHES.sub("/", f"/{whole[:_VALUE_CHARS_MAX]}/")
        return self.model_copy(update={"namespace": inner, "renaming": (*self.renaming, *noted)})

    def resolved(self, name: str) -> str:
        """Return a parameter's whole name."""
        whole = name if name.startswith("/") else f"{self.namespace}{name}"
        return _SLASHES.sub("/", whole.rstrip("/") or "/")

    def own_path(self, path: str) -> str | None:
        """Return the package's own path behind `$(find <package>)/…`, None for any other."""
        found = _FOUND.fullmatch(path.strip())
        inside = _plain(found[2]) if found and found[1] in self.own else None
        return f"{self.way}/{inside}" if self.way and inside else inside

    def misspelt_package(self, path: str) -> str:
        """Return the package's name in `$(find …)/…` where it differs in capitals or dashes alone, else ""."""
        found = _FOUND.fullmatch(path.strip())
        name = found[1] if found else ""
        plain = {one.casefold().replace("-", "_") for one in self.own}
        return name if name not in self.own and name.casefold().replace("-", "_") in plain else ""

    def _value(self, whole: str, words: list[str]) -> str:
        match words:
            case ["arg", name] if name in self.args:
                return self.args[name]
            case ["dirname"] if self.own:
                folder = PurePosixPath(self.file.removeprefix(f"{self.way}/")).parent.as_posix()
                return f"$(find {self.own[0]})" + ("" if folder == "." else f"/{folder}")
            case ["optenv", _, *default] if default:
                return " ".join(default)
        return whole


def wanted(element: etree._Element, scope: Scope | None = None) -> bool:
    """Return False where `if` or `unless` switches the element off; what only the run tells does not."""
    on, off = (element.get(name) or "" for name in ("if", "unless"))
    if scope is not None:
        on, off = scope.text(on), scope.text(off)
    return on.strip().lower() not in _FALSE and off.strip().lower() not in _TRUE


def _plain(path: str) -> str | None:
    """Return `launch/../config/a.yaml` as `config/a.yaml`; None where it leads out of the package."""
    parts: list[str] = []
    for part in PurePosixPath(path).parts:
        if part == ".." and not parts:
            return None
        if part == "..":
            parts.pop()
        elif part != ".":
            parts.append(part)
    return "/".join(parts)


def unknown_attributes(element: etree._Element) -> tuple[str, ...]:
    """Return attributes of a `<node>` that roslaunch does not know, the first ten."""
    return tuple(str(name)[:100] for name in element.attrib if name not in ATTRIBUTES["launch"]["node"])[:10]
