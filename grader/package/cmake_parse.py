"""`CMakeLists.txt` without CMake: the library `cmake_parser` for the grammar; variables and loops where literal.

Where the grammar fails, a fault with its line and a plain cause goes out beside the calls that come before it.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import islice, takewhile
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from cmake_parser import CMakeError, Token, parse_raw, parse_tree, resolve_args, tokenize
from cmake_parser import ast as nodes
from cmake_parser.interpreter import Context

from grader.line_slips.cmake import find_slip, is_open
from grader.line_slips.python_habits import MERGE_MARKER, MERGED
from grader.model.file_fault import Fault
from grader.model.package import CMAKE, INTERFACE_FOLDERS, CMakeCall, CMakeFacts
from grader.package.reading import printable, read_markup
from grader.wording import lines_text

_CALLS_MAX = 5_000
_DEPTH_MAX = 20
STEPS_MAX = 20_000
_CHARS_MAX = 2_000_000
_VALUE_CHARS_MAX = 20_000
FILE_BYTES_MAX = 200_000
_FALSE = frozenset({"0", "OFF", "NO", "FALSE", "N", "IGNORE", "NOTFOUND"})
_LONE_SIGN = re.compile(r"(\\.|\$[A-Za-z]*\{)|[${]", re.DOTALL)

# What find_package(catkin) sets (catkin's catkin_destinations.cmake), `{0}` the project's name
_CATKIN = {
    **{f"CATKIN_GLOBAL_{name.upper()}_DESTINATION": name for name in ("bin", "include", "lib", "share")},
    "CATKIN_PACKAGE_BIN_DESTINATION": "lib/{0}",
    "CATKIN_PACKAGE_ETC_DESTINATION": "etc/{0}",
    "CATKIN_PACKAGE_INCLUDE_DESTINATION": "include/{0}",
    "CATKIN_PACKAGE_LIB_DESTINATION": "lib",
    "CATKIN_PACKAGE_SHARE_DESTINATION": "share/{0}",
}
_MODULE_FOLDERS_MAX = 10
_FOLDERS_HERE = ("${CMAKE_CURRENT_SOURCE_DIR}", "${CMAKE_CURRENT_LIST_DIR}")
_NESTING_MAX = 50
_WORK_MAX = 20_000_000
_BLOCKS = ("if", "foreach", "while", "function", "macro", "block")
_MIDDLE = ("else", "elseif")
_COMMENTED = re.compile(r"[ \t]*#[# \t]*add_dependencies[ \t]*\(([^()#]*)\)\s*(?:#|$)", re.IGNORECASE)
_COMMENTED_MAX = 50
_COMMENTED_CHARS_MAX = 400
_HALVES_MAX = 20
_HALF_LINES_MAX = 40
_LINK_CHARS_MAX = 4_095
_LINK_TEXT = re.compile(r"\s*(\.{0,2}/)?[\w./-]+/[\w./-]+\s*")

# A `#[` that opens no bracket comment is a plain comment to CMake, but not to the library.
_COMMENTS = re.compile(
    r"""(?P<keep>"(?:\\.|[^\\"])*"|\#?\[(=*)\[.*?\]\2\]|\#(?!\[)[^\n]*|\\.)|\#\[""", re.DOTALL
)
_OPENERS = re.compile(r"\[=*\[")


class _Variables(dict[str, str]):
    """CMake's variables; one that is not known stays in the text as it is written."""

    def __init__(self, prefix: str = "$") -> None:
        super().__init__()
        self.prefix = prefix

    def get(self, key: str, _default: object = None) -> str:
        # CMake may know it from a module that is not read here
        return super().get(key, f"{self.prefix}{{{key}}}")


def parse_cmake(folder: Path, name: str) -> CMakeFacts | None:
    """Return the calls of the package in `folder`, every command kept; None where it has no `CMakeLists.txt`.

    Never raises; `fault` says why CMake would not read the file, and the calls are then those before it.
    """
    data = read_markup(folder, CMAKE, FILE_BYTES_MAX)
    if isinstance(data, Fault):
        is_link = (folder / CMAKE).is_symlink()
        # A link to nothing is a fault of the file, a package without the file has none
        if data.kind == "Missing" and not is_link:
            return None
        return CMakeFacts(file=CMAKE, source="parser", calls=(), fault=data)
    return read_calls(data, folder, name)


def read_calls(data: bytes, folder: Path, name: str) -> CMakeFacts:
    """Return the calls of a package whose `CMakeLists.txt` holds this. Never raises."""
    reader = _Reader(folder, name)
    tree, fault = parse_tree_of(data, CMAKE)
    reader.run(tree, CMAKE, 0)
    return CMakeFacts(
        file=CMAKE,
        source="parser",
        calls=tuple(reader.calls),
        fault=fault or reader.fault,
        last_line=tree[-1].line if tree and fault is None else None,
        commented=tuple(islice(_commented(data.decode(errors="replace"), name), _COMMENTED_MAX)),
    )


def _commented(text: str, name: str) -> Iterator[CMakeCall]:
    for line, written in enumerate(text.split("\n"), 1):
        if found := _COMMENTED.match(written[:_COMMENTED_CHARS_MAX]):
            words = found[1].replace("${PROJECT_NAME}", name).split()
            yield CMakeCall(name="add_dependencies", args=tuple(words), file=CMAKE, line=line)


class _Reader:
    """Walks the tree as CMake would, as far as that can be told without running it."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder = folder
        self.calls: list[CMakeCall] = []
        self.fault: Fault | None = None
        self.read = {CMAKE}
        self.defined: dict[str, nodes.Function | nodes.Macro] = {}
        self.steps = self.letters = 0
        self.left_bytes = FILE_BYTES_MAX
        self.variables = _Variables()
        self.variables["CMAKE_PROJECT_NAME"] = self.variables["PROJECT_NAME"] = name
        unknown = (_Variables("$ENV"), _Variables("$CACHE"))
        self.context = Context(var=self.variables, env=unknown[0], cache=unknown[1])

    def run(self, tree: Iterable[nodes.AstNode], file: str, depth: int) -> None:
        for node in tree:
            self.steps += 1
            if self._is_enough() or depth > _DEPTH_MAX:
                return
            if isinstance(node, nodes.If):
                self._branch(node, file, depth)
            elif isinstance(node, nodes.ForEach):
                self._loop(node, file, depth)
            elif isinstance(node, nodes.While | nodes.Block):
                self.run(node.body, file, depth + 1)
            elif isinstance(node, nodes.Function | nodes.Macro):  # a definition calls nothing
                self.defined |= {node.args[0].value.lower(): node} if node.args else {}
            else:
                self._call(node, file, depth)

    def _is_enough(self) -> bool:
        """Return whether to stop: loops in each other, and values made of each other, multiply without an end."""
        return len(self.calls) >= _CALLS_MAX or self.steps > STEPS_MAX or self.letters > _CHARS_MAX

    def _branch(self, node: nodes.If, file: str, depth: int) -> None:
        """Follow both branches, but for a literal `if(FALSE)`: conditions are CMake's to judge."""
        condition = self._arguments(node.args, file)
        if [text.upper() for text in condition] not in [[word] for word in _FALSE]:
            self.run(node.if_true, file, depth + 1)
        self.run(node.if_false or (), file, depth + 1)

    def _loop(self, node: nodes.ForEach, file: str, depth: int) -> None:
        args = self._arguments(node.args, file)
        self.calls.append(CMakeCall(name="foreach", args=tuple(args), file=file, line=node.line))
        variable, *items = args or [""]
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
        """Yield the items of `foreach(x a b)`, `foreach(x IN LISTS l ITEMS a)`; a RANGE is left out."""
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
        if name in self.defined:
            self._call_defined(self.defined[name], args, file, depth)
        elif name == "set" and args:
            self._set(args)
        elif name == "list" and args[:1] == ["APPEND"] and len(args) > 1:
            before = filter(None, [dict.get(self.variables, args[1])])
            self.variables[args[1]] = ";".join([*before, *args[2:]])[:_VALUE_CHARS_MAX]
        elif name == "unset" and args:
            self.variables.pop(args[0], None)
        elif name == "project" and args:
            self.variables["PROJECT_NAME"] = args[0]
        elif name == "find_package" and args[:1] == ["catkin"]:
            project = self.variables.get("PROJECT_NAME")
            self.variables.update({key: text.format(project) for key, text in _CATKIN.items()})
        elif name in {"include", "add_subdirectory"} and args:
            self._include(name, args[0], file, depth)

    def _call_defined(
        self, node: nodes.Function | nodes.Macro, args: list[str], file: str, depth: int
    ) -> None:
        """Follow a call of what the package defines, with the parameters as variables."""
        names = [str(token.value) for token in node.args[1:] if token.kind != "COMMENT"]
        given = dict(zip(names, args, strict=False))
        given |= {"ARGV": ";".join(args), "ARGN": ";".join(args[len(names) :])}
        before = {name: dict.get(self.variables, name) for name in given}
        self.variables.update({name: value[:_VALUE_CHARS_MAX] for name, value in given.items()})
        self.run(node.body, file, depth + 1)
        for name, value in before.items():
            if value is None:
                self.variables.pop(name, None)
            else:
                self.variables[name] = value

    def _set(self, args: list[str]) -> None:
        values = args[1:]
        for end in ("CACHE", "PARENT_SCOPE"):
            values = values[: values.index(end)] if end in values else values
        self.variables[args[0]] = ";".join(values)[:_VALUE_CHARS_MAX]

    def _include(self, name: str, place: str, file: str, depth: int) -> None:
        """Read a file of the same package; modules of CMake and of other packages are none of its facts."""
        if name == "include" and re.fullmatch(r"\w+", place):  # a module
            folders = dict.get(self.variables, "CMAKE_MODULE_PATH", "").split(";")
            for folder in islice(filter(None, folders), _MODULE_FOLDERS_MAX):
                self._include(name, f"{folder}/{place}.cmake", file, depth)
            return
        place = place if name == "include" else posixpath.join(place, CMAKE)
        root, _, below = place.partition("/")
        at_root = root == "${PROJECT_SOURCE_DIR}"
        place = below if at_root or root in _FOLDERS_HERE else place
        path = posixpath.normpath(posixpath.join("" if at_root else posixpath.dirname(file), place))
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
        # Each reference may become the longest value there is: too much is noticed before anything is expanded
        if references * max(map(len, self.variables.values())) > _CHARS_MAX:
            return [printable(token.value[:_VALUE_CHARS_MAX]) for token in tokens]
        try:
            resolved = resolve_args(self.context, [_escape(t) for t in tokens if t.kind != "COMMENT"])
        except (CMakeError, RecursionError) as error:
            line = next((token.line for token in tokens if is_open(token.value)), tokens[0].line)
            cause = "a variable `${...}` is never closed by `}`"
            words = {"kind": type(error).__name__, "message": str(error), "cause": cause}
            self.fault = self.fault or Fault(file=file, line=line, **words)
            return [printable(token.value) for token in tokens]
        args = [printable(token.value[:_VALUE_CHARS_MAX]) for token in resolved]
        self.letters += sum(map(len, args)) + 10 * len(args)
        return args


def _escape(token: Token) -> Token:
    """With each `$` and `{` escaped that begins no variable (`$<TARGET_FILE:x>`, `{NAME}`): the library stops there."""
    value = _LONE_SIGN.sub(lambda found: found[1] or f"\\{found[0]}", token.value)
    if token.kind == "BRACKETED" or value == token.value:
        return token
    return Token(kind=token.kind, value=value, span=token.span, line=token.line, column=token.column)


def parse_tree_of(data: bytes, file: str) -> tuple[list[nodes.AstFileNode], Fault | None]:
    """Return the top-level commands and blocks of a CMake file, up to the fault where there is one. Never raises."""
    # Windows PowerShell writes such files when output is sent to one by `>`
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return [], _fault(file, 1, "is UTF-16", f"`{file}` is saved as UTF-16", fix="save it as UTF-8")
    text = _readable(data)
    if text is None:
        return [], _fault(file, None, "too many brackets", f"`{file}` holds too many `[[` to be read")
    commands, fault = _commands(text, file)
    whole, unbalanced = _balance(commands, file, is_cut=fault is not None)
    fault = unbalanced or fault
    if fault is not None and whole:
        text = text[: whole[-1].span.stop]
    tree: list[nodes.AstFileNode] = []
    try:
        tree.extend(parse_tree(text, skip_comments=True) if whole else ())
    except CMakeError as error:  # break(1)
        line = tree[-1].line if tree else 1
        fault = fault or _fault(file, line, str(error), "")
    return tree, fault


@lru_cache(maxsize=8)
def commands_of(data: bytes) -> tuple[nodes.Command, ...] | None:
    """Return every command of a CMake file, also those in blocks and definitions; None where it cannot be read.

    Each repair asks for those of the same file.
    """
    text = _readable(data)
    commands, fault = ([], None) if text is None else _commands(text, "")
    return None if text is None or fault else tuple(commands)


def _readable(data: bytes) -> str | None:
    """Return the text as the library takes it; None where that would take it too long."""
    text = data.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\0", " ")
    # The library looks for the end of each `[[` through the rest of the file
    if len(_OPENERS.findall(text)) * len(text) > _WORK_MAX:
        return None
    return _COMMENTS.sub(lambda found: found["keep"] or "# ", text)


def _commands(text: str, file: str) -> tuple[list[nodes.Command], Fault | None]:
    commands: list[nodes.Command] = []
    try:
        commands.extend(parse_raw(text, skip_comments=True))
    except RecursionError:
        return commands, _fault(file, None, "nested too deep", "brackets are nested too deep")
    except CMakeError as error:
        return commands, _explain_fault(text, commands[-1].span.stop if commands else 0, file, str(error))
    return commands, None


def _explain_fault(text: str, end: int, file: str, message: str) -> Fault:
    """Return the fault of the command that begins behind `end`, the place where the last good one stopped."""
    tokens = [t for t in tokenize(text) if t.kind != "COMMENT" and t.span.start >= end]
    first = tokens[0] if tokens else Token("RAW", "", slice(end, end), text.count("\n") + 1, 1)
    unparsed = next((t for t in tokens if t.kind == "UNPARSEABLE"), None)
    line, cause, fix = first.line, f"`{_word(first)}` is not a command", "CMake expects name(...)"
    unclosed = ""
    if MERGE_MARKER.match(text.split("\n")[line - 1]):
        return _fault(file, line, message, MERGED, fix="keep one version and delete the markers")
    half = join_half_comment(text)
    if half is not None:
        return _fault(file, half.line, message, half.cause, fix=half.fix)
    if (slip := find_slip(text, line)) is not None:
        return _fault(file, slip.number, message, slip.why, fix=slip.fix)
    if unparsed is not None and text[unparsed.span].startswith('"'):
        line, cause, fix = unparsed.line, 'a quote `"` is opened here and never closed', ""
    elif head := missing_head(tokens, text):
        cause = f"the line that begins the command is missing above `{_word(first)}`"
        fix = f"above line {line}, write `{head}`"
    elif first.kind == "RPAREN":
        cause, fix = "there is one `)` too many", ""
    elif "unexpected end of file" in message and len(tokens) > 1 and tokens[1].kind == "LPAREN":
        last = _last_line(text, line)
        cause, unclosed = f"the `(` of `{_word(first)}(` is never closed by `)`", "("
        fix = f"write `)` at the end of line {last}"
    elif end == 0 and len(text) <= _LINK_CHARS_MAX and _LINK_TEXT.fullmatch(text):
        cause, fix = "the file holds only the path that a link should lead to, no CMake commands", ""
    return _fault(file, line, message, cause, fix=fix, unclosed=unclosed)


_HEADS = {
    **dict.fromkeys(("CATKIN_DEPENDS", "INCLUDE_DIRS", "LIBRARIES", "DEPENDS"), "catkin_package"),
    "DEPENDENCIES": "generate_messages",
    "PROGRAMS": "catkin_install_python",
    "TARGETS": "install",
}
"""The calls of which these words are the first ones."""
_OF_FILES = {f".{folder}": f"{command}(FILES" for command, folder in INTERFACE_FOLDERS.items()}
_OF_FILES[".py"] = "catkin_install_python(PROGRAMS"
_OF_WORDS = {
    "DESTINATION": "catkin_install_python(PROGRAMS",
    "${catkin_INCLUDE_DIRS}": "include_directories(",
}
"""How the calls begin in which such files or words are."""


def missing_head(tokens: list[Token], text: str) -> str:
    """Return how the call begins whose words and `)` are there alone, from the first of the tokens on; "" where that
    is not known."""
    inside = [str(t.value) for t in takewhile(lambda t: t.kind not in {"LPAREN", "RPAREN"}, tokens)]
    behind = tokens[len(inside) : len(inside) + 1]
    if not behind or behind[0].kind != "RPAREN":
        return ""
    below_comment = text[: behind[0].span.start].rstrip().rpartition("\n")[2].lstrip().startswith("#")
    called = set(re.findall(r"^\s*(\w+)\s*\(", text, re.MULTILINE))
    catkin = re.search(r"^\s*find_package\s*\(\s*catkin\b", text, re.MULTILINE)
    if inside and inside[0] in _HEADS:
        return f"{_HEADS[inside[0]]}("
    words = ((PurePosixPath(word).suffix, word) for word in inside)
    heads = (_OF_WORDS.get(word) or _OF_FILES.get(suffix) for suffix, word in words)
    if head := next(filter(None, heads), None):
        return head.removesuffix("FILES") if inside[0] == "FILES" else head
    if inside and not catkin and all(re.fullmatch(r"[a-z]\w+", word) for word in inside):
        return "find_package(catkin REQUIRED COMPONENTS"
    return "catkin_package(" if not inside and "catkin_package" not in called and below_comment else ""


class HalfComment(NamedTuple):
    """A call that is partly in comments, from `line` to `last`, and the text without these."""

    line: int
    last: int
    name: str
    text: str

    @property
    def cause(self) -> str:
        """What is wrong."""
        return f"only a part of `{self.name}(…)` is commented out"

    @property
    def fix(self) -> str:
        """Which comments to take away."""
        return f"remove the `#` on {lines_text(self.line - 1, self.last - 1)}"


def join_half_comment(text: str) -> HalfComment | None:
    """Return the call of which a part is in comments, where the text is right without the `#` of these."""
    for half in half_comments(text):
        try:
            parse_raw(half.text, skip_comments=True)
        except (CMakeError, RecursionError):
            continue
        return half
    return None


def half_comments(text: str) -> Iterator[HalfComment]:
    """Yield the calls of which a part is in comments, each with the text without the `#` of its own."""
    lines = text.split("\n")
    found = (half for at in range(len(lines)) if (half := _half_comment(lines, at)) is not None)
    # Each try reads the whole file
    for name, first, end in islice(found, _HALVES_MAX):
        plain = [re.sub(r"#+ ?", "", line, count=1) for line in lines[first:end]]
        changed = "\n".join([*lines[:first], *plain, *lines[end:]])
        yield HalfComment(line=first + 1, last=end, name=name, text=changed)


def _half_comment(lines: list[str], at: int) -> tuple[str, int, int] | None:
    """Return the name of the call that begins in the line `at`, and the first and the end of its lines that are
    comments, where either its first line is one, or its last."""
    begun = _BEGUN.match(lines[at])
    below = lines[at + 1 : at + 1 + _HALF_LINES_MAX] if begun else []
    closing = next((i for i, line in enumerate(below) if not _ARGUMENTS.match(line)), None)
    if begun is None or closing is None or not _CLOSING.match(below[closing]):
        return None
    numbers = range(at, at + closing + 2)
    commented = [number for number in numbers if lines[number].lstrip().startswith("#")]
    # Comments in the middle of a call are no fault: both of its ends are there, or neither is
    is_half = (numbers[0] in commented) != (numbers[-1] in commented)
    return (begun[1], commented[0], commented[-1] + 1) if is_half else None


_BEGUN = re.compile(r"\s*#*\s?(\w+)\s*\([^()]*$")
_ARGUMENTS = re.compile(r"\s*#*\s*[^\s()#][^()#]*$")
_CLOSING = re.compile(r"\s*#*[^()#]*\)")


def _last_line(text: str, line: int) -> int:
    """Return the last line of an open call that begins in `line`: then comes a blank line, or another call."""
    own = takewhile(lambda other: other.strip() and not _BEGINS.match(other), text.split("\n")[line:])
    numbers = (n for n, other in enumerate(own, line + 1) if not other.lstrip().startswith("#"))
    return max(numbers, default=line)


_BEGINS = re.compile(r"\s*\w+\s*\(")


def _word(token: Token) -> str:
    return str(token.value or "")[:40]


def _balance(
    commands: list[nodes.Command], file: str, *, is_cut: bool
) -> tuple[list[nodes.Command], Fault | None]:
    """Return the commands up to the last one outside every open block, and the fault where blocks do not match. Where
    the file `is_cut` at what cannot be read, the end of a block may come behind that."""
    open_blocks: list[nodes.Command] = []
    whole = 0
    for count, command in enumerate(commands, 1):
        name = command.identifier.lower()
        block = name.removeprefix("end")
        if name in _BLOCKS:
            open_blocks.append(command)
        elif name in _MIDDLE or (name.startswith("end") and block in _BLOCKS):
            wanted = "if" if name in _MIDDLE else block
            if not open_blocks or open_blocks[-1].identifier.lower() != wanted:
                cause = f"`{name}()` has no `{wanted}()` before it that is still open"
                return commands[:whole], _fault(file, command.line, f"flow control: {name}", cause)
            if name not in _MIDDLE:
                open_blocks.pop()
        if len(open_blocks) > _NESTING_MAX:
            fault = _fault(file, command.line, "nested too deep", "blocks are nested too deep")
            return commands[:whole], fault
        # Only here is no block open, so that the text up to here can be read on its own
        whole = whole if open_blocks else count
    if open_blocks and is_cut:
        return commands[:whole], None
    if open_blocks:
        name = open_blocks[0].identifier.lower()
        cause = f"`{name}()` is never closed by `end{name}()`"
        return commands[:whole], _fault(file, open_blocks[0].line, f"flow control: {name}", cause)
    return commands, None


def _fault(
    file: str, line: int | None, message: str, cause: str, *, fix: str = "", unclosed: str = ""
) -> Fault:
    words = {"message": message, "cause": cause, "fix": fix, "unclosed": unclosed}
    return Fault(file=file, line=line, kind="ParseError", **words)
