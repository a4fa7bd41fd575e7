"""`CMakeLists.txt` without CMake: `cmake_parser` for the grammar; variables and loops where literal."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from cmake_parser import CMakeError, Token, resolve_args
from cmake_parser import ast as nodes
from cmake_parser.interpreter import Context

from grader.model.package import CMakeCall, CMakeFacts, Fault
from grader.package.cmake_syntax import parse_tree_of
from grader.package.reading import printable, read_markup

_CMAKE_FILE = "CMakeLists.txt"
_CALLS_LIMIT = 5_000
_DEPTH_LIMIT = 20
_STEPS_LIMIT = 20_000
_LETTERS_LIMIT = 2_000_000
_VALUE_LETTERS = 20_000
_FILE_LIMIT_BYTES = 200_000
_FALSE = frozenset({"0", "OFF", "NO", "FALSE", "N", "IGNORE", "NOTFOUND"})
_LONE_DOLLAR = re.compile(r"(\\.)|\$(?![A-Za-z]*\{)", re.DOTALL)

# What find_package(catkin) sets (catkin's catkin_destinations.cmake), `{0}` the project's name
_CATKIN = {
    "CATKIN_GLOBAL_BIN_DESTINATION": "bin",
    "CATKIN_GLOBAL_INCLUDE_DESTINATION": "include",
    "CATKIN_GLOBAL_LIB_DESTINATION": "lib",
    "CATKIN_GLOBAL_SHARE_DESTINATION": "share",
    "CATKIN_PACKAGE_BIN_DESTINATION": "lib/{0}",
    "CATKIN_PACKAGE_ETC_DESTINATION": "etc/{0}",
    "CATKIN_PACKAGE_INCLUDE_DESTINATION": "include/{0}",
    "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
    "CATKIN_PACKAGE_SHARE_DESTINATION": "share/{0}",
}


class _Variables(dict[str, str]):
    """CMake's variables; one that is not known stays in the text as it is written."""

    def __init__(self, prefix: str = "$") -> None:
        super().__init__()
        self.prefix = prefix

    def get(self, key: str, _default: object = None) -> str:
        return super().get(key, f"{self.prefix}{{{key}}}")


def parse_cmake(folder: Path, name: str) -> CMakeFacts | None:
    """The calls of the package in `folder`, every command kept; None where it has no `CMakeLists.txt`.

    Never raises; `fault` says why CMake would not read the file, and the calls are then those before it.
    """
    data = read_markup(folder, _CMAKE_FILE, _FILE_LIMIT_BYTES)
    if isinstance(data, Fault):
        is_link = (folder / _CMAKE_FILE).is_symlink()
        if data.kind == "Missing" and not is_link:
            return None
        return CMakeFacts(file=_CMAKE_FILE, source="parser", calls=(), fault=data)
    reader = _Reader(folder, name)
    tree, fault = parse_tree_of(data, _CMAKE_FILE)
    reader.run(tree, _CMAKE_FILE, 0)
    return CMakeFacts(
        file=_CMAKE_FILE,
        source="parser",
        calls=tuple(reader.calls),
        fault=fault or reader.fault,
        last_line=tree[-1].line if tree and fault is None else None,
    )


class _Reader:
    """Walks the tree as CMake would, as far as that can be told without running it."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder = folder
        self.calls: list[CMakeCall] = []
        self.fault: Fault | None = None
        self.read = {_CMAKE_FILE}
        self.steps = self.letters = 0
        self.left_bytes = _FILE_LIMIT_BYTES
        self.variables = _Variables()
        self.variables["CMAKE_PROJECT_NAME"] = self.variables["PROJECT_NAME"] = name
        unknown = (_Variables("$ENV"), _Variables("$CACHE"))
        self.context = Context(var=self.variables, env=unknown[0], cache=unknown[1])

    def run(self, tree: Iterable[nodes.AstNode], file: str, depth: int) -> None:
        for node in tree:
            self.steps += 1
            if self._is_enough() or depth > _DEPTH_LIMIT:
                return
            if isinstance(node, nodes.If):
                self._branch(node, file, depth)
            elif isinstance(node, nodes.ForEach):
                self._loop(node, file, depth)
            elif isinstance(node, nodes.While | nodes.Block):
                self.run(node.body, file, depth + 1)
            elif not isinstance(node, nodes.Function | nodes.Macro):  # a definition calls nothing
                self._call(node, file, depth)

    def _is_enough(self) -> bool:
        """Loops in each other, and values made of each other, multiply without an end."""
        return len(self.calls) >= _CALLS_LIMIT or self.steps > _STEPS_LIMIT or self.letters > _LETTERS_LIMIT

    def _branch(self, node: nodes.If, file: str, depth: int) -> None:
        """Both branches, but for a literal `if(FALSE)`: conditions are CMake's to judge."""
        condition = self._arguments(node.args, file)
        if [text.upper() for text in condition] not in [[word] for word in _FALSE]:
            self.run(node.if_true, file, depth + 1)
        self.run(node.if_false or (), file, depth + 1)

    def _loop(self, node: nodes.ForEach, file: str, depth: int) -> None:
        variable, *items = self._arguments(node.args, file) or [""]
        before = self.variables.pop(variable, None)
        for item in self._items(items):
            self.steps += 1
            if self._is_enough():
                break
            self.variables[variable] = item
            self.run(node.body, file, depth + 1)
        self.variables.pop(variable, None)
        if before is not None:
            self.variables[variable] = before

    def _items(self, words: list[str]) -> Iterator[str]:
        """`foreach(x a b)`, `foreach(x IN LISTS l ITEMS a)`; a RANGE is left out."""
        if words[:1] == ["RANGE"]:
            return
        lists = False
        for word in words[1:] if words[:1] == ["IN"] else words:
            if words[:1] == ["IN"] and word in {"LISTS", "ITEMS"}:
                lists = word == "LISTS"
            elif lists:
                yield from filter(None, self.variables.get(word).split(";"))
            else:
                yield word

    def _call(self, node: nodes.AstNode, file: str, depth: int) -> None:
        name = node.identifier.lower() if isinstance(node, nodes.Command) else type(node).__name__.lower()
        line = getattr(node, "line", 1)
        args = self._arguments(getattr(node, "args", []), file)
        self.calls.append(CMakeCall(name=name, args=tuple(args), file=file, line=line))
        if name == "set" and args:
            self._set(args)
        elif name == "list" and args[:1] == ["APPEND"] and len(args) > 1:
            before = filter(None, [dict.get(self.variables, args[1])])
            self.variables[args[1]] = ";".join([*before, *args[2:]])[:_VALUE_LETTERS]
        elif name == "unset" and args:
            self.variables.pop(args[0], None)
        elif name == "project" and args:
            self.variables["PROJECT_NAME"] = args[0]
        elif name == "find_package" and args[:1] == ["catkin"]:
            project = self.variables.get("PROJECT_NAME")
            self.variables.update({key: text.format(project) for key, text in _CATKIN.items()})
        elif name in {"include", "add_subdirectory"} and args:
            self._include(name, args[0], file, depth)

    def _set(self, args: list[str]) -> None:
        values = args[1:]
        for end in ("CACHE", "PARENT_SCOPE"):
            values = values[: values.index(end)] if end in values else values
        self.variables[args[0]] = ";".join(values)[:_VALUE_LETTERS]

    def _include(self, name: str, place: str, file: str, depth: int) -> None:
        """A file of the same package; modules of CMake and of other packages are none of its facts."""
        place = place if name == "include" else posixpath.join(place, _CMAKE_FILE)
        path = posixpath.normpath(posixpath.join(posixpath.dirname(file), place))
        if path in self.read or path.startswith(("/", "../")) or "\0" in path:
            return
        self.read.add(path)
        data = read_markup(self.folder, path, self.left_bytes)
        if isinstance(data, bytes):
            self.left_bytes -= len(data)
            tree, fault = parse_tree_of(data, path)
            self.fault = self.fault or fault
            self.run(tree, path, depth + 1)

    def _arguments(self, tokens: list[Token], file: str) -> list[str]:
        references = sum(token.value.count("${") for token in tokens)
        if references * max(map(len, self.variables.values())) > _LETTERS_LIMIT:
            return [printable(token.value[:_VALUE_LETTERS]) for token in tokens]
        try:
            resolved = resolve_args(self.context, [_escaped(t) for t in tokens if t.kind != "COMMENT"])
        except (CMakeError, RecursionError) as error:
            line = tokens[0].line
            cause = "a variable `${...}` is never closed by `}`"
            self.fault = self.fault or Fault(
                file=file, line=line, kind=type(error).__name__, message=str(error), cause=cause
            )
            return [printable(token.value) for token in tokens]
        args = [printable(token.value[:_VALUE_LETTERS]) for token in resolved]
        self.letters += sum(map(len, args)) + 10 * len(args)
        return args


def _escaped(token: Token) -> Token:
    """With each `$` escaped that begins no variable (`$<TARGET_FILE:x>`): the library stops there."""
    value = _LONE_DOLLAR.sub(lambda found: found[1] or r"\$", token.value)
    if token.kind == "BRACKETED" or value == token.value:
        return token
    return Token(kind=token.kind, value=value, span=token.span, line=token.line, column=token.column)
