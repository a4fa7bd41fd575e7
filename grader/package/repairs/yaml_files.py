"""What keeps a parameter file from being read as YAML: lines that are not `name: value`, or in a wrong column."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import NamedTuple

import yaml

from grader.line_slips.yaml import YAML_LINES_MAX, levels_of, slip_of_yaml
from grader.model.package import PackageFacts
from grader.model.repair import indent_of
from grader.package.repairs.editing import Files, keep_first_version
from grader.package.repairs.names import Wanted
from grader.wording import on_lines, plural

SUFFIXES = (".yaml", ".yml")
LINES_MAX = 4
"""So many lines of a file are repaired."""
COLUMNS_MAX = 6
FURTHER_MAX, FILE_MAX = 6, 60
"""So far above the line where YAML's parser stops a line is moved, in files of so many lines."""


class _Repaired(NamedTuple):
    text: str
    why: str
    fix: str = ""


def repair_yaml_files(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Find such lines in the files that the lab names, and in those that a launch file names."""
    named = {PurePosixPath(file).name for file in wanted.files}
    launches = [files.text(launch.path) or "" for launch in package.launch_files]
    for path in (file.path for file in package.files if file.path.endswith(SUFFIXES)):
        name = PurePosixPath(path).name
        if name in named or any(name in text for text in launches):
            _repair_file(files, path, wanted)
        loads = [one for launch in package.launch_files for one in launch.loads if one.loads(path)]
        below = any(one.namespace.strip("/") for one in loads) and namespace_wanted(
            files.text(path) or "", wanted
        )
        if (
            name in named and not below
        ):  # its names are those of a namespace, into which a launch file loads them
            _nest_keys(files, path, wanted)


def _repair_file(files: Files, path: str, wanted: Wanted) -> None:
    keep_first_version(files, path, "yaml-syntax")
    text = files.text(path)
    if text is None or text.count("\n") > YAML_LINES_MAX:
        return
    steps: list[_Repaired] = []
    while (at := _fault_in(text)) is not None:
        steps += [one] if (one := _without_fault(text, at, wanted)) else []
        if one is None or len(steps) > LINES_MAX:
            return
        text = one.text
    for one in steps:
        files.change("yaml-syntax", path, one.text, one.why.format(path=path), one.fix)


def _nest_keys(files: Files, path: str, wanted: Wanted) -> None:
    """Write the lab's parameters in levels, where the file has just these and has them in lists, or flat."""
    text = files.text(path)
    if text is None or text.count("\n") > YAML_LINES_MAX or _fault_in(text) is not None:
        return
    names = [tuple(name.strip("/").split("/")) for name in wanted.params]
    if not _without_lists(files, path, text, names):
        _in_levels(files, path, text, names)


def _without_lists(files: Files, path: str, text: str, names: list[tuple[str, ...]]) -> bool:
    lines = text.split("\n")
    changed = [_LISTED.sub(r"\1  ", line) for line in lines]
    after = "\n".join(changed)
    missing = [name for name in names if name not in _paths(text)]
    if after == text or _fault_in(after) is not None or _paths(after).isdisjoint(missing):
        return False
    numbers = [n for n, (one, other) in enumerate(zip(lines, changed, strict=True), 1) if one != other]
    new = next(name for name in missing if name in _paths(after))
    why = f"line {numbers[0]} of {path}: the `-` makes a list, in which there is no {'/'.join(new)}"
    fix = f"start {on_lines(numbers)} with a space in place of the `-`"
    files.change("parameter-name", path, after, why, fix)
    return True


_LISTED = re.compile(r"""^( *)- (?=["']?[A-Za-z_][\w-]*["']?:(?:\s|$))""")
"""What begins a `name: value` that is an entry of a list."""


def _in_levels(files: Files, path: str, text: str, names: list[tuple[str, ...]]) -> None:
    """Rewrite a file that holds all the names below one root, and nothing else, without their upper levels."""
    values = _values(text)
    found = {name: [one for one in values if one[-1] in _flat(name)] for name in names if len(name) > 1}
    root = next((name[0] for name, own in found.items() if own), "")
    meant = {name: own for name, own in found.items() if name[0] == root}
    used = [one for own in meant.values() for one in own]
    fix = levels_of("/".join(name) for name in meant)
    if not fix or sorted(used) != sorted(values) or any(len(own) != 1 for own in meant.values()):
        return
    if any(name in values for name in meant):
        return  # only the names at the wrong level have to move: another repair does that
    lines = text.split("\n")
    nested = [*(line for line in lines if line.startswith("#")), f"{root}:"]
    for block in dict.fromkeys(name[1] for name in meant):
        nested.append(f"  {block}:")
        for name in (one for one in meant if one[1] == block):
            line, column = values[meant[name][0]]
            nested.append(f"    {name[-1]}: {lines[line][column:]}")
    first = next(iter(meant))
    old = meant[first][0]
    why = f"line {values[old][0] + 1} of {path}: {'/'.join(old)} should be {'/'.join(first)}"
    files.change("parameter-name", path, "\n".join([*nested, ""]), why, fix)


def _flat(name: tuple[str, ...]) -> set[str]:
    return {sign.join(name[first:]) for sign in "_.-" for first in range(len(name))}


def _values(text: str) -> dict[tuple[str, ...], tuple[int, int]]:
    """Return the line and column, from 0, at which each value begins; nothing where one goes on in the next line."""
    found: dict[tuple[str, ...], tuple[int, int]] = {}

    def collect(node: yaml.Node | None, above: tuple[str, ...]) -> bool:
        if isinstance(node, yaml.MappingNode) and len(above) < YAML_DEPTH and not node.flow_style:
            return all(collect(value, (*above, str(key.value))) for key, value in node.value)
        is_plain = isinstance(node, yaml.ScalarNode) or (
            isinstance(node, yaml.SequenceNode) and node.flow_style
        )
        mark = node.start_mark if is_plain and node is not None else None
        if mark is None or node is None or node.end_mark.line != mark.line or above in found:
            return False
        found[above] = (mark.line, mark.column)
        return True

    return found if collect(yaml.compose(text, Loader=yaml.SafeLoader), ()) else {}


def _without_fault(text: str, at: int, wanted: Wanted) -> _Repaired | None:
    """Return the text without its first fault, that was noticed at line `at`; None where no line is plainly wrong."""
    lines = text.split("\n")
    tabbed = next((n for n, line in enumerate(lines, 1) if "\t" in indent_of(line)), None)
    if tabbed is not None and tabbed <= at:
        why = f"line {tabbed} of {{path}} is indented with a tab, which YAML does not accept"
        plain = [_Repaired(one, why, _begin(one, lines, tabbed)) for one in _untabbed(lines, tabbed)]
        # with another fault further down, no text can be read yet
        left = [one for one in plain if not any("\t" in indent_of(line) for line in one.text.split("\n"))]
        return _best(plain, wanted) or next(iter(left), None)
    if slip := slip_of_yaml(text, at):
        comment = re.search(r"\s+#.*", lines[slip.number - 1])
        changed = f"{indent_of(lines[slip.number - 1])}{slip.right}{comment[0] if comment else ''}"
        repaired = "\n".join([*lines[: slip.number - 1], changed, *lines[slip.number :]])
        return _Repaired(repaired, f"line {slip.number} of {{path}} {slip.why}", f"write `{slip.right}`")
    why = "line {} of {{path}} does not line up with the lines beside it"
    # Where the lab's names tell which line is meant, it may be one further up.
    further = range(at - 2, max(0, at - FURTHER_MAX), -1) if wanted.params and len(lines) <= FILE_MAX else ()
    moved = [(number, one) for number in (at, at - 1, *further) for one in _moved(lines, number)]
    return _best([_Repaired(one, why.format(n), _begin(one, lines, n)) for n, one in moved], wanted)


def _untabbed(lines: list[str], number: int) -> Iterator[str]:
    """Yield the text with the line in the column of a line beside it, and with as many spaces for each tab."""
    yield from _moved(lines, number)
    for spaces in (2, 4):
        yield "\n".join(indent_of(line).replace("\t", " " * spaces) + line.lstrip() for line in lines)


def _begin(text: str, lines: list[str], number: int) -> str:
    """Return how to change the lines' beginnings: that of one, or of all."""
    changed = text.split("\n")
    if sum(one != other for one, other in zip(changed, lines, strict=True)) > 1:
        return "indent with spaces only, two per level"
    return f"begin the line with {plural(len(indent_of(changed[number - 1])), 'space')}"


def _moved(lines: list[str], number: int) -> Iterator[str]:
    """Yield the text with the line in the columns of the other lines, that of the nearest line above it first."""
    if not 0 < number <= len(lines):
        return
    others = [line for line in (*reversed(lines[: number - 1]), *lines[number:]) if line.strip()]
    for blanks in [*dict.fromkeys(map(indent_of, others))][:COLUMNS_MAX]:
        changed = blanks + lines[number - 1].lstrip()
        if "\t" not in blanks and changed != lines[number - 1]:
            yield "\n".join([*lines[: number - 1], changed, *lines[number:]])


def _best(candidates: list[_Repaired], wanted: Wanted) -> _Repaired | None:
    """Return the one that can be read with the most of the lab's parameters in it, and then in the fewest columns."""
    readable = [one for one in candidates if _fault_in(one.text) is None]
    names = {tuple(name.strip("/").split("/")) for name in wanted.params}

    def quality(one: _Repaired) -> tuple[int, int]:
        return len(names & _paths(one.text)), -len({len(indent_of(line)) for line in one.text.split("\n")})

    return max(readable, key=quality, default=None)


def _fault_in(text: str) -> int | None:
    """Return the line, from 1, where YAML's parser stops; None where it reads all."""
    try:
        if isinstance(yaml.compose(text, Loader=yaml.SafeLoader), yaml.ScalarNode):
            return text.count("\n") + 1  # a file without a single `name: value`
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        return mark.line + 1 if mark else 1
    except (yaml.YAMLError, RecursionError):
        return 0
    return None


def namespace_wanted(text: str, wanted: Wanted) -> str | None:
    """Return below what a file's names have to be loaded to be those of the lab, "" for nothing; None where no
    namespace makes them so."""
    if text.count("\n") > YAML_LINES_MAX or _fault_in(text) is not None:
        return None
    names = {f"/{'/'.join(path)}" for path in _paths(text)}
    asked = [f"/{name.strip('/')}" for name in wanted.params]
    before = [{one.removesuffix(name) for name in names if one.endswith(name)} for one in asked]
    known = [one for one in before if one]
    right = set.intersection(*known) if known else set[str]()
    return right.pop() if len(right) == 1 else None


def _paths(text: str) -> set[tuple[str, ...]]:
    """Return the names in the file, each with those that it lies below."""
    found: set[tuple[str, ...]] = set()

    def collect(node: yaml.Node | None, above: tuple[str, ...]) -> None:
        if isinstance(node, yaml.MappingNode) and len(above) < YAML_DEPTH:
            for key, value in node.value:
                found.add((*above, str(key.value)))
                collect(value, (*above, str(key.value)))

    collect(yaml.compose(text, Loader=yaml.SafeLoader), ())
    return found


YAML_DEPTH = 10
"""Names lie no deeper in a student's file."""
