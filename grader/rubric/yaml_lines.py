"""A rubric's YAML as plain data with the line of every key: read as `yaml.safe_load` would, within limits.

What looks for slips in a rubric reads criteria, packages and scenarios here as they are written, faults and all.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias, cast

import yaml
from yaml.composer import Composer

from grader.errors import RubricError
from grader.wording import plural

# No rubric is nested so deeply: what is would come to the end of Python's stack.
MAX_DEPTH = 50
# What JSON readers of other languages, and ROS's int64, can hold.
MAX_NUMBER = (1 << 63) - 1
MAX_NUMBER_LETTERS = 100
OF_ANY_KIND = frozenset({
    "value", "values", "expect", "result", "request", "goal", "answer", "answers", "feedback", "params",
})  # fmt: skip
"""Keys of values that may be text as well as true or false."""
TEXT_TAG = "tag:yaml.org,2002:str"
INT_TAG = "tag:yaml.org,2002:int"
BOOL_TAG = "tag:yaml.org,2002:bool"
MERGE_TAG = "tag:yaml.org,2002:merge"
PLAIN_TAGS = frozenset({"tag:yaml.org,2002:map", "tag:yaml.org,2002:seq"})

AT_BEGINNING = "^"
"""Before a problem that is told where the part begins in which PyYAML finds it, not where that is seen."""
# In this order: the first that fits is told.
YAML_PROBLEMS = {
    "mapping values are not allowed": (
        "a colon where no key can stand: text with a colon needs quotes; else look for a colon, a dash or a blank that "
        "is missing here or in the line above, or for another indentation"
    ),
    "could not find expected ':'": "^a key needs a colon and a blank after it",
    "but found '<block sequence start>'": "this dash is not under those of its list",
    "expected <block end>": (
        "this does not belong to the part that begins on line {line}: look at its indentation, its dash and its quotes"
    ),
    "expected ',' or '}'": "the {{ of line {line} is not closed, or a comma is missing between its keys",
    "expected ',' or ']'": "the [ of line {line} is not closed, or a comma is missing between its items",
    "unexpected end of stream": "^a quotation mark that is not closed",
    "expected alphabetic or numeric character": (
        "between & or * and the name behind it is no blank: text that begins with one of them needs quotes"
    ),
    "undefined alias": "nothing above has this name, with &: text that begins with * needs quotes",
    "the node content": "a comma, or a bracket, too many",
}
"""What PyYAML says, and what is told."""

_TOPIC = re.compile(r"(?:^|:=)(/[\w/]*\w)")

KeyPath = tuple[str | int, ...]
Value: TypeAlias = "dict[str, Any] | list[Any] | str | int | float | None"
Fault = tuple[KeyPath, str]


@dataclass(frozen=True, kw_only=True)
class Form:
    """What a file may hold, and how messages call it.

    Times are text of ISO 8601 under the keys of `times`, and faults elsewhere. `.inf`, `-.inf` and `.nan` are text
    below all keys of one of `not_finite`, and faults elsewhere. With `written_keys`, a key is what is
    written there, also where YAML reads a number or `no`. A file that `may_be_empty` is an empty map then.
    """

    what: str = "a rubric file"
    usual: str = "a rubric is a few kilobytes"
    bytes_max: int = 1_000_000
    nodes_max: int = 100_000
    times: frozenset[str] = frozenset()
    not_finite: tuple[frozenset[str], ...] = ()
    written_keys: bool = False
    may_be_empty: bool = False


SENT, WANTED = ("steps", "serves", "calls", "probes"), ("value", "values", "expect", "result")
"""Keys of what the grader sends in a scenario, and of what a criterion wants to see."""
RUBRIC = Form(
    times=frozenset({"deadline"}),
    not_finite=(*(frozenset({key}) for key in SENT), *(frozenset({"criteria", key}) for key in WANTED)),
)


@dataclass(frozen=True, kw_only=True)
class Source:
    """`data` as JSON could hold it; `lines` maps each key's path to its line, counted from 1."""

    name: str
    raw: bytes
    data: Value
    lines: dict[KeyPath, int]
    faults: list[Fault] = field(default_factory=list)

    def line(self, path: KeyPath) -> int:
        """Return the line of the key, or of the nearest one above it."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)

    def fault(self, path: KeyPath, message: str) -> str:
        """Return a fault as `file:line: key.path: what is wrong`."""
        where = f"{self.name}:{self.line(path)}: "
        return where + (f"{dotted(path)}: {message}" if path else message)

    def in_order(self, faults: Iterable[Fault]) -> list[str]:
        """Return these faults, each once, in the order of the file's lines."""
        found = sorted(dict.fromkeys(faults), key=lambda one: self.line(one[0]))
        return [self.fault(*one) for one in found]


def dotted(path: KeyPath) -> str:
    """Return a path as `criteria[2].with.rate_hz`."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def read_source(path: Path, name: str, form: Form = RUBRIC) -> Source:
    """Return the file's data. Raises RubricError where it is no YAML of that form."""
    return source_of(read_bytes(path, name, form), name, form)


def source_of(raw: bytes, name: str, form: Form) -> Source:
    """Return the data of a file that holds these bytes. Raises RubricError as `read_source` does."""
    try:
        # Windows' editors write a byte order mark, which is no part of the text.
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise RubricError([f"{name}:{line}: the file is not UTF-8: save it as UTF-8"]) from error
    loader: yaml.SafeLoader | None = None
    try:
        loader, node = _load_nodes(text)
        if node is None and form.may_be_empty:
            return Source(name=name, raw=raw, data={}, lines={})
        if node is None:
            raise RubricError([f"{name}:1: the file is empty"])
        reader = _Reader(loader, form)
        data = reader.read(node, ())
    except yaml.YAMLError as error:
        raise RubricError([_yaml_fault(error, text, name)]) from error
    except RecursionError as error:
        raise RubricError([f"{name}:1: is nested too deeply"]) from error
    finally:
        if loader is not None:
            # A loader refers to itself: without this it would wait for the garbage collector.
            loader.dispose()
    return Source(name=name, raw=raw, data=data, lines=reader.lines, faults=reader.faults)


@dataclass(frozen=True, kw_only=True)
class WrittenCriterion:
    """A criterion as it is written, with all faults that it may have.

    `place` is where it is, `at` where its parameters are, which are `given`. `run` is the name of its scenario, and
    `scenario` what is written there: empty where the criterion names none, or one that is not there.
    """

    data: dict[str, Any]
    place: KeyPath
    id: str
    check: str
    given: dict[str, Any]
    run: str
    scenario: dict[str, Any]

    @property
    def at(self) -> KeyPath:
        return (*self.place, "with")

    @cached_property
    def topics(self) -> set[str]:
        """The topics that its parameters name."""
        return set(topics_in(self.given))

    @property
    def has_run(self) -> bool:
        return self.data.get("scenario") is not None

    @property
    def requires(self) -> list[str]:
        return [name for _, name in as_texts(self.data.get("requires"))]

    @property
    def conditions(self) -> tuple[tuple[KeyPath, dict[str, Any]], ...]:
        """Where a value of a field may be asked for, and what is written there: the parameters, a cause, an effect."""
        parts = (((*self.at, key), as_map(self.given.get(key))) for key in ("cause", "effect"))
        return ((self.at, self.given), *parts)


class WrittenRubric:
    """A rubric as it is written, with all faults that it may have."""

    def __init__(self, data: object) -> None:
        self.data = as_map(_comparable(data))
        self.scenarios = {name: as_map(one) for name, one in as_map(self.data.get("scenarios")).items()}
        self.criteria = [
            WrittenCriterion(
                data=one,
                place=("criteria", index),
                id=str(one.get("id")),
                check=str(one.get("check")),
                given=as_map(one.get("with")),
                run=str(one.get("scenario")),
                scenario=self.scenarios.get(str(one.get("scenario")), {}),
            )
            for index, one in as_maps(self.data.get("criteria"))
        ]
        self.handout = str(self.data.get("handout") or "")
        self.packages = packages_in(self.data)
        self.own_packages = {*self.packages, *(name for _, name in as_texts(self.data.get("packages")))}

    @cached_property
    def texts(self) -> list[tuple[KeyPath, str]]:
        """All texts, keys too, each with its place."""
        return list(texts_in((), self.data))

    def package_of(self, one: dict[str, Any]) -> str:
        """Return the package that a criterion or a start is about: the first one where it names none."""
        return str(one.get("package") or next(iter(self.packages), ""))

    def starts(self) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
        """Yield what the scenarios start, each with its place."""
        return self._listed("start")

    def steps(self) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
        """Yield the steps of the scenarios, each with its place."""
        return self._listed("steps")

    def _listed(self, key: str) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
        for name, scenario in self.scenarios.items():
            yield from ((("scenarios", name, key, n), one) for n, one in as_maps(scenario.get(key)))

    def parts(self) -> Iterator[tuple[KeyPath, str, dict[str, Any]]]:
        """Yield what the scenarios send, call, offer and do, each with its place and its kind."""
        for name, scenario in self.scenarios.items():
            yield from ((("scenarios", name, *at), kind, one) for at, kind, one in parts_of(scenario))

    def params(self) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
        """Yield the parameters that the scenarios set, each with its place."""
        for name, scenario in self.scenarios.items():
            yield from ((("scenarios", name, *at), one) for at, one in set_in(scenario))


class _MadeUp(dict[str, Any]):
    """`{made_up: rate}` in place of a value: it may be looked up among texts and numbers, as these may."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(str(self))


def _comparable(value: object) -> object:
    """Return the same data, in which values that are made up can be in a set."""
    if isinstance(value, list):
        return [_comparable(one) for one in value]
    if not isinstance(value, dict):
        return value
    inside = {key: _comparable(one) for key, one in value.items()}
    return _MadeUp(inside) if inside.keys() == {"made_up"} else inside


def packages_in(rubric: dict[str, Any]) -> list[str]:
    """Return the packages that students hand in, as a rubric names them: one, or a list."""
    given = rubric.get("package")
    return [given] if isinstance(given, str) else [name for _, name in as_texts(given)]


def read_bytes(path: Path, name: str, form: Form) -> bytes:
    """Return what the file holds. Raises RubricError where it cannot be read, or is larger than the form allows."""
    try:
        with path.open("rb") as file:
            raw = file.read(form.bytes_max + 1)
    except IsADirectoryError as error:
        raise RubricError([f"{name}: is a folder, not {form.what}"]) from error
    except FileNotFoundError as error:
        hint = "grader labs lists the rubrics" if form is RUBRIC else ""
        raise RubricError([f"{name}: there is no such file"], hint=hint) from error
    except OSError as error:
        raise RubricError([f"{name}: cannot be read: {error.strerror}"]) from error
    if len(raw) > form.bytes_max:
        raise RubricError([f"{name}: is larger than {form.bytes_max // 1_000_000} MB; {form.usual}"])
    return raw


def compose(text: str) -> yaml.Node | None:
    """Return the nodes of a YAML text, with their places in it; None of an empty one. Raises YAMLError."""
    loader, node = _load_nodes(text)
    loader.dispose()
    return node


def _load_nodes(text: str) -> tuple[yaml.SafeLoader, yaml.Node | None]:
    """Return the nodes and their loader: by libyaml, which is faster, where it has nothing to say against the text.

    PyYAML's own scanner finds the faults, so that they read alike on every machine. It allows fewer tabs.
    """
    if LIBYAML is not None and "\t" not in text:
        with suppress(yaml.YAMLError):
            loader = LIBYAML(text)
            return loader, loader.get_single_node()
    loader = yaml.SafeLoader(text)
    return loader, loader.get_single_node()


def _libyaml_loader() -> type[yaml.SafeLoader] | None:
    """Return a loader that scans with libyaml and composes in Python, whose stack has a limit; None without it."""
    if not yaml.__with_libyaml__:
        return None

    class Loader(Composer, yaml.CSafeLoader):
        def __init__(self, text: str) -> None:
            yaml.CSafeLoader.__init__(self, text)
            Composer.__init__(self)

    return cast("type[yaml.SafeLoader]", Loader)


LIBYAML = _libyaml_loader()


def _yaml_fault(error: yaml.YAMLError, text: str, name: str) -> str:
    """Return PyYAML's error as one line, in plain words where its own are hard to understand."""
    if isinstance(error, yaml.reader.ReaderError):
        line = text.count("\n", 0, error.position) + 1
        code = error.character if isinstance(error.character, int) else ord(error.character)
        return f"{name}:{line}: a character that YAML does not allow (U+{code:04X})"
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    problem = getattr(error, "problem", None) or "is not YAML"
    begun = getattr(error, "context_mark", None) or mark
    if "'\\t'" in problem:
        problem = "a tab: YAML is indented with spaces only"
    elif words := next((words for sign, words in YAML_PROBLEMS.items() if sign in problem), ""):
        if words.startswith(AT_BEGINNING):
            mark = begun
        problem = words.removeprefix(AT_BEGINNING).format(line=begun.line + 1 if begun else 1)
        if "does not belong" in problem and mark:
            problem += _other_indent(text.splitlines()[: mark.line + 1], mark.column)
        if "but got ':'" in str(error) and begun and mark and begun.line == mark.line:
            problem = "text with a colon needs quotes; else a comma is missing"
        lines = text.splitlines()[begun.line : mark.line + 1] if begun and mark else []
        before = (one.replace("\t#", " #").rpartition(" #")[0] for one in lines)
        if "is not closed" in problem and any(text.strip(" \t#") for text in before):
            problem += "; what comes after a blank and # is a comment: text with # needs quotes"
    return f"{name}:{mark.line + 1 if mark else 1}: {problem}"


def _other_indent(lines: list[str], column: int) -> str:
    """Return how the last of these lines is indented, where what is wrong is its beginning, and the one before it."""
    blanks = [len(line) - len(line.lstrip(" ")) for line in lines if line.strip()]
    if blanks[-1:] != [column] or blanks[-2:-1] in ([], [column]):
        return ""
    return f" (the line above has {plural(blanks[-2], 'blank')} before it, this one {column})"


class _Reader:
    """Walks the composed nodes once, aliases expanded, and counts what it visits."""

    def __init__(self, loader: yaml.SafeLoader, form: Form) -> None:
        self.loader = loader
        self.form = form
        self.lines: dict[KeyPath, int] = {}
        self.faults: list[Fault] = []
        self.visited = 0

    def _count(self, node: yaml.Node) -> None:
        self.visited += 1
        if self.visited > self.form.nodes_max:
            raise yaml.MarkedYAMLError(
                problem=f"too much: aliases multiply to more than {self.form.what} can hold",
                problem_mark=node.start_mark,
            )

    def read(self, node: yaml.Node, path: KeyPath) -> Value:
        self._count(node)
        if len(path) > MAX_DEPTH:
            raise yaml.MarkedYAMLError(problem="is nested too deeply", problem_mark=node.start_mark)
        # `!!python/object` and the like, and sets and ordered maps, which JSON does not have.
        if not isinstance(node, yaml.ScalarNode) and node.tag not in PLAIN_TAGS:
            raise yaml.MarkedYAMLError(
                problem=f"the tag {node.tag} is not for {self.form.what}", problem_mark=node.start_mark
            )
        # `_mapping` has the line of the key, which is where people look.
        self.lines.setdefault(path, node.start_mark.line + 1)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, path)
        if isinstance(node, yaml.SequenceNode):
            return [self.read(item, (*path, index)) for index, item in enumerate(node.value)]
        return self._scalar(node, path)

    def _mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        own: set[str] = set()
        # What is merged comes first: a map's own keys take its place, wherever `<<` is written.
        for merge_node in [value for key, value in node.value if key.tag == MERGE_TAG]:
            data = {**self._merge(merge_node, path), **data}
        for key_node, value_node in node.value:
            key = self._key(key_node, value_node, path)
            if key is None:
                continue
            line = key_node.start_mark.line + 1
            # PyYAML would take the last one, without a word.
            if key in own:
                self.faults.append(((*path, key), f"is given twice, again on line {line}"))
                continue
            own.add(key)
            data[key] = self.read(value_node, (*path, key))
            self.lines[(*path, key)] = line
        return data

    def _merge(self, node: yaml.Node, path: KeyPath) -> dict[str, Any]:
        """Merge `<<: *anchor`, or a list of them, of which the first wins."""
        self._count(node)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, path)
        if isinstance(node, yaml.SequenceNode) and all(isinstance(n, yaml.MappingNode) for n in node.value):
            # Reversed, since of equal keys the last one in a dict stays.
            parts = [self._mapping(item, path) for item in reversed(node.value)]
            return {key: value for part in parts for key, value in part.items()}
        raise yaml.MarkedYAMLError(problem="<< takes a map or a list of maps", problem_mark=node.start_mark)

    def _key(self, node: yaml.Node, value: yaml.Node, path: KeyPath) -> str | None:
        if node.tag == MERGE_TAG:
            return None
        if isinstance(node, yaml.ScalarNode) and (node.tag == TEXT_TAG or self.form.written_keys):
            return str(node.value)
        shown = node.value if isinstance(node, yaml.ScalarNode) else "this"
        line = node.start_mark.line + 1
        # `rate: 1,5` in braces: YAML ends the value at the comma, and 5 becomes a key without a value.
        is_cut = node.tag == INT_TAG and value.start_mark.index == value.end_mark.index
        remedy = "a decimal number has a point, no comma" if is_cut else "put the key in quotes"
        truth = str(self.loader.construct_object(node)).lower() if node.tag == BOOL_TAG else ""
        fault = f"{shown} on line {line} is not a string: {remedy}"
        if truth not in {"", shown.lower()}:
            fault = f"the key {shown} of line {line} is {truth} in YAML: put it in quotes"
        self.faults.append((path, fault))
        return None

    def _scalar(self, node: yaml.Node, path: KeyPath) -> Value:
        problem = f"{node.value[:40]} cannot be read"
        if node.tag != TEXT_TAG and len(node.value) > MAX_NUMBER_LETTERS:  # `1:1:…` takes time by the square
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
        try:
            value = self.loader.construct_object(node)
        except (ValueError, OverflowError) as error:
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark) from error
        if self.form is RUBRIC and (odd := _read_otherwise(node.value, value, path)):
            return self._refuse(path, odd, value)
        if isinstance(value, int) and abs(value) > MAX_NUMBER:
            return self._refuse(path, f"is too large a number: {node.value[:40]}", 0)
        if value is None or isinstance(value, bool | int | str):
            return value
        if isinstance(value, float):
            return value if math.isfinite(value) else self._not_finite(path, value, node.value)
        if isinstance(value, date) and path and path[-1] in self.form.times:
            return value.isoformat()
        return self._refuse(path, f"must be text or a number: put {node.value[:40]} in quotes", node.value)

    def _not_finite(self, path: KeyPath, value: float, written: str) -> Value:
        if not any(keys.issubset(path) for keys in self.form.not_finite):
            return self._refuse(path, f"must be finite, not {written}")
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"

    def _refuse(self, path: KeyPath, message: str, stand_in: Value = 0.0) -> Value:
        self.faults.append((path, message))
        return stand_in


def _read_otherwise(written: str, value: object, path: KeyPath) -> str:
    """Return that YAML does not read a value as people do, and how to write it; empty where it does."""
    # YAML 1.1, which PyYAML reads, takes yes, no, on and off for truth values.
    if isinstance(value, bool) and written.lower() not in {"true", "false"} and OF_ANY_KIND & {*path}:
        truth = str(value).lower()
        return f'{written} is {truth} in YAML: write {truth}, or "{written}" in quotes where it is text'
    odd = "" if isinstance(value, bool) or not isinstance(value, int | float) else _other_base(written)
    return f"{written} is {value:g} in YAML, {odd}" if odd else ""


def _other_base(written: str) -> str:
    """Return how to write a number that YAML does not read as people do; empty where it does."""
    # YAML 1.1: 010 is octal, and 1:30 counts to the base of 60.
    if re.fullmatch(r"[-+]?0[0-7_]+", written):
        return f"as its first digit is 0: write {written.lstrip('-+0') or 0}"
    return "in minutes and seconds: write it without a colon, or in quotes" if ":" in written else ""


def give_one(keys: Sequence[str], given: Sequence[str]) -> str:
    """Return that one of the keys has to be given, and which are."""
    found = f"{' and '.join(given)} are there" if given else "none is there"
    return f"give one of {', '.join(keys[:-1])} and {keys[-1]}: {found}"


def as_list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def as_map(value: object) -> dict[str, Any]:
    """Return the value where it is a map, else an empty one."""
    return value if isinstance(value, dict) else {}


def as_maps(value: object) -> list[tuple[int, dict[str, Any]]]:
    """Return the maps in a list, each with its place in the list."""
    return [(index, item) for index, item in enumerate(as_list(value)) if isinstance(item, dict)]


def as_texts(value: object) -> list[tuple[int, str]]:
    """Return the texts in a list, each with its place in the list."""
    return [(index, item) for index, item in enumerate(as_list(value)) if isinstance(item, str)]


def items_in(value: object) -> Iterable[tuple[str | int, Any]]:
    """Return what a map or a list holds, each with its key or its place; nothing of any other value."""
    return value.items() if isinstance(value, dict) else enumerate(as_list(value))


def texts_in(path: KeyPath, value: object) -> Iterator[tuple[KeyPath, str]]:
    """Yield all texts in a part of a rubric, keys too, each with its place."""
    if isinstance(value, str):
        yield path, value
    for key, inner in items_in(value):
        if isinstance(value, dict):
            yield (*path, key), str(key)
        yield from texts_in((*path, key), inner)


def numbers_in(path: KeyPath, value: object) -> Iterator[tuple[KeyPath, float]]:
    """Yield all numbers in a part of a rubric, each with its place."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        yield path, float(value)
    for key, inner in items_in(value):
        yield from numbers_in((*path, key), inner)


def topics_in(value: object) -> Iterator[str]:
    """Yield the topics that a part of a rubric names, its keys too."""
    yield from (topic for _, text in texts_in((), value) for topic in _TOPIC.findall(text))


def starts_of(scenario: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what a scenario starts."""
    return [start for _, start in as_maps(scenario.get("start"))]


def started_files(scenario: Mapping[str, Any]) -> set[str]:
    """Return the student's scripts and launch files that a scenario starts."""
    return {
        str(start[key]) for start in starts_of(scenario) for key in ("script", "launch") if start.get(key)
    }


def given_steps(scenario: Mapping[str, Any], kind: str) -> list[dict[str, Any]]:
    """Return what the scenario's steps of one kind (`publish`) say."""
    return [as_map(step[kind]) for _, step in as_maps(scenario.get("steps")) if kind in step]


def set_in(scenario: dict[str, Any]) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Yield the parameters that a scenario sets, and where."""
    yield from ((("params", n), one) for n, one in as_maps(scenario.get("params")))
    for index, step in as_maps(scenario.get("steps")):
        if "set_param" in step:
            yield ("steps", index, "set_param"), as_map(step["set_param"])


def parts_of(scenario: Mapping[str, Any]) -> Iterator[tuple[KeyPath, str, dict[str, Any]]]:
    """Yield what a scenario sends, calls, offers and does: where, its kind as a step has it (`publish` of a probe, and
    `serve`), and what is written there."""
    for key, kind in (("probes", "publish"), ("calls", "call"), ("serves", "serve")):
        yield from (((key, n), kind, one) for n, one in as_maps(scenario.get(key)))
    for n, step in as_maps(scenario.get("steps")):
        yield from ((("steps", n, kind), kind, as_map(given)) for kind, given in step.items())


def published_in(scenario: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what a scenario sends in messages: its probes, and its steps that publish."""
    return [one for _, kind, one in parts_of(scenario) if kind == "publish"]


def services_in(scenario: dict[str, Any]) -> Iterator[tuple[KeyPath, str, dict[str, Any]]]:
    """Yield the services that a scenario calls or offers, where it says so, and the key of what it fills in."""
    for at, kind, one in parts_of(scenario):
        part = {"call": "request", "serve": "response"}.get(kind)
        if part is not None and one.get("action") is None:
            yield at, part, one
