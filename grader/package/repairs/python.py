"""Repairs of Python sources: what does not parse, names and calls that are missing, and names that ROS is told.

The sources are read in a child process with limits (`python_repairs/examine.py`); here its answer is put in words.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Collection, Iterator, Sequence
from difflib import get_close_matches
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path
from typing import Literal

from grader.installable import exists_somewhere, known_packages, noetic_messages
from grader.limited_child import ChildLimits, run_limited
from grader.line_slips.python import COMMENTED_OUT, OUT_OF_BLOCK
from grader.line_slips.python_habits import DELETE_LINE, MERGED, Reason
from grader.model.package import INTERFACE_FOLDERS, PackageFacts
from grader.model.record import Record
from grader.model.repair import ASKED, Repair, RepairKind, as_code
from grader.package.python import TOO_FAR_IN, reason_of
from grader.package.repairs.editing import KEEP_ONE, Files, emptied_lines
from grader.wording import is_one_edit, join_words, lines_text, numbers_text, on_lines, plural

EXAMINE = "grader.package.python_repairs.examine:examine"
TURN = "grader.package.python_repairs.examine:with_sign_turned"
LIMITS = {"memory_bytes": 1 << 30, "cpu_s": 20, "file_bytes": 32 << 20, "answer_bytes": 16 << 20}
WALL_S = 10.0
INDENTED_SHOWN = 12
LINES_SHOWN = 4
ATTEMPTS = 3
"""A source that crashes Python costs its own repairs, not those of the others."""

Cause = Literal[
    "merged", "tabs", "level", "indent", "braces", "commented", "python2", "characters", "token", "global", "outside",
    "old-name", "module", "other-module", "import", "name", "quotes", "attribute", "value", "time", "call", "quoted",
    "comment", "callback", "argument", "unbound", "kept", "defined", "guard", "inside", "start", "late", "main", "init",
    "server", "spin", "line", "twice", "turned", "empty", "emptied",
]  # fmt: skip
CALLS = (
    "name", "quotes", "attribute", "value", "time", "call", "quoted", "comment", "callback", "argument", "unbound",
    "kept", "defined", "guard", "inside", "start", "late", "main", "init", "server", "spin",
)  # fmt: skip
KINDS: dict[str, RepairKind] = {
    **dict.fromkeys(("module", "other-module", "import"), "missing-import"),
    **dict.fromkeys(CALLS, "missing-call"),
}


class _Error(Record):
    kind: str
    line: int
    column: int | None
    message: str
    text: str


class _Step(Record):
    cause: Cause
    line: int
    word: str = ""
    error: _Error | None = None
    text: str


class Name(Record):
    """A text in a script that names something; `start` and `end` are columns of its line, from 0. `keys` are those that
    the script reads of a parameter."""

    role: Literal["publisher", "subscriber", "server", "client", "node", "param", "set-param", "key"]
    value: str
    line: int
    start: int
    end: int
    keys: tuple[str, ...] = ()


class _Entry(Record):
    file: str
    steps: tuple[_Step, ...]
    names: tuple[Name, ...]


def repair_python(
    files: Files,
    scripts: Sequence[str],
    package: PackageFacts,
    types: Sequence[str],
    modules: Collection[str] = (),
) -> dict[str, tuple[Name, ...]]:
    """Find what keeps the sources from running, and return the names that they use once they do. `modules` are only
    imported: nothing has to start in them."""
    _delete_imports(files, scripts, package)
    _delete_manifests(files, scripts, package)
    _spell_package(files, scripts, package, types)
    texts = {script: text for script in scripts if (text := files.text(script))}
    names: dict[str, tuple[Name, ...]] = {}
    fields = {
        each.name: {name: names for one in each.interfaces for name, names in one.members.items()}
        for each in (package, *package.also)
    }
    for entry in _examine(texts, types, fields):
        left_out = OF_START if entry.file in modules else ()
        for cause, steps in _join_steps([*_until(entry.steps, left_out)]):
            _change(files, entry.file, cause, steps)
        names[entry.file] = entry.names
    return names


def _until(steps: Sequence[_Step], causes: Collection[Cause]) -> Iterator[_Step]:
    """Return the steps before the first one of these causes: each has the changes of those before it."""
    return takewhile(lambda step: step.cause not in causes, steps)


OF_START: tuple[Cause, ...] = ("inside", "start", "late", "main", "init", "server", "spin")
"""Causes that keep a script from starting, which come last."""


def _delete_imports(files: Files, scripts: Sequence[str], package: PackageFacts) -> None:
    """Delete imports that nothing in their script uses, of modules and messages that there are none of."""
    own = package.own_modules
    misnamed = {s.file for s in package.slips if s.kind in {"undefined", "misspelt"}}
    lacking = {(s.file, s.line) for s in package.slips if s.kind == "lacking-import"}
    unused = [s for s in package.slips if s.kind == "unused-import" and s.file not in misnamed]
    for slip in sorted(unused, key=lambda s: s.line, reverse=True):
        lines = (files.text(slip.file) or "").split("\n")
        text = lines[slip.line - 1] if slip.line <= len(lines) else ""
        is_import = slip.file in scripts and slip.message not in own and IMPORT.fullmatch(text)
        if not is_import or _is_misspelt(text):
            continue
        what = _unknown_message(text)
        if (slip.file, slip.line) in lacking and not exists_somewhere(slip.message, own):
            what = f"module {slip.message}"
        if not what:
            continue
        message = f"line {slip.line} of {slip.file}: there is no {what}"
        files.change("missing-import", slip.file, _emptied(lines, slip.line), message, slip.fix)


def _emptied(lines: Sequence[str], line: int) -> str:
    """Return the text with an empty line in place of this one: the others are told by the lines that they have."""
    return "\n".join([*lines[: line - 1], "", *lines[line:]])


def _delete_manifests(files: Files, scripts: Sequence[str], package: PackageFacts) -> None:
    """Delete `roslib.load_manifest(…)`, which only rosbuild needed, of packages that there are none of."""
    declared = {one.name for one in package.manifest.dependencies} if package.manifest else set[str]()
    there = {package.name, *(one.name for one in package.also), *declared, *known_packages()}
    for file in scripts:
        lines = (files.text(file) or "").split("\n")
        for number, line in enumerate(lines, start=1):
            loaded = LOADED.fullmatch(line)
            if loaded is None or loaded[1] in there:
                continue
            if sum("roslib." in one.partition("#")[0] for one in lines) > 1:
                continue
            why = f"there is no package {loaded[1]}, and catkin needs no such line"
            message = f"line {number} of {file}: {why}"
            files.change("missing-import", file, _emptied(lines, number), message, f"delete line {number}")


def _spell_package(files: Files, scripts: Sequence[str], package: PackageFacts, types: Sequence[str]) -> None:
    """Write the package's own name in place of a slip of it, or of a package that has no such classes, where its
    messages and services are imported; that of the package which makes one of `types`, in place of one which has a copy
    of its definition, and does not build it."""
    own = [one for one in (package, *package.also) if one.interfaces]
    names = [one.name for one in own]
    for file in scripts:
        lines = (files.text(file) or "").split("\n")
        for number, line in enumerate(lines, start=1):
            found = re.match(r"\s*(?:from|import)\s+((\w+)\.(?:msg|srv|action))\b", line)
            if found is None:
                continue
            module, name = found.groups()
            meant = [one for one in names if is_one_edit(name, one) or name.lower() == one.lower()]
            what, end = f"there is no package {name}", found.end(2)
            if len(meant) != 1 or name in {*names, *known_packages()}:
                meant, end = _makers(line, (package, *package.also), types), found.end(1)
                what = f"{module} has no {join_words(_names_from(line))}"
            if len(meant) == 1:
                lines[number - 1] = line[: found.start(1)] + meant[0] + line[end:]
                message = f"line {number} of {file}: {what}"
                files.change("missing-import", file, "\n".join(lines), message)


def _names_from(line: str) -> list[str]:
    """Return the names that a line imports from the messages or services of a package; none of any other line."""
    found = re.fullmatch(r"from \w+\.(?:msg|srv|action) import \(?([\w, ]+)\)?\s*(?:#.*)?", line.strip())
    return re.split(r"\s*,\s*", found[1].strip(" ,")) if found else []


def _makers(line: str, own: Sequence[PackageFacts], types: Sequence[str]) -> list[str]:
    """Return the modules that the build makes with all that a line imports from another one, which has none of it."""
    module, names = [*line.split(), "", ""][1], set(_names_from(line))
    package, _, inner = module.partition(".")
    made: dict[str, set[str]] = {}
    for each in own:
        is_built = any(call.name in INTERFACE_FOLDERS for call in (each.cmake.calls if each.cmake else ()))
        others = {f"{one.name}/{name}" for one in own if one is not each for name in names}
        for one in each.interfaces if is_built or not others & {*types} else ():
            made.setdefault(f"{each.name}.{one.module}", set()).update(one.classes)
    there = made.get(module, set()) | {*noetic_messages().get(package, ())} | {*SERVICES_OF_ROS}
    is_known = package in {*noetic_messages(), "std_srvs", *(one.name for one in own)}
    is_part = any(f"{one.name}_".startswith(f"{package}_") for one in own)  # `lab` for `lab_a1`
    has_others = not (is_known or is_part) and exists_somewhere(package, [one.name for one in own])
    if not names or names & there or has_others or (package, inner) == ("turtlesim", "srv"):
        return []
    return [module for module, classes in made.items() if names <= classes]


SERVICES_OF_ROS = ("Empty", "SetBool", "Trigger", "GetMap", "GetPlan", "LoadMap", "SetMap", "SetCameraInfo")
"""Services of ROS's own packages of messages."""


LOADED = re.compile(r"""(?:import roslib\s*;\s*)?roslib\.load_manifest\(["']([\w-]+)["']\)\s*(?:#.*)?""")
"""A line that asks for a package by its name, and does nothing else."""


IMPORT = re.compile(r"(?:import|from)\s[^(\\;]*")
"""A line that is one import, and nothing else."""


def _is_misspelt(line: str) -> bool:
    """Return whether a message is imported of which both the package and the class have a slip, so that it is meant."""
    found = re.fullmatch(r"from (\w+)\.msg import (\w+)", line.strip())
    known = noetic_messages()
    near = get_close_matches(found[1], known, 1, 0.85) if found and found[1] not in known else []
    classes = [one.lower() for name in near for one in known[name]]
    name = found[2].lower() if found else ""
    return any(name == one or is_one_edit(name, one) for one in classes)


def _unknown_message(line: str) -> str:
    """Return what is imported from a known package of messages, or from its messages, is not there, and is no slip of
    what is; "" where there is no such name."""
    bare = re.fullmatch(r"from (\w+_(?:msgs|srvs)) import ([A-Z]\w*)", line.strip())
    if bare is not None and bare[1] in known_packages():  # its classes are in its modules `msg` and `srv`
        return f"{bare[2]} in {bare[1]}"
    found = re.fullmatch(r"from (\w+)\.msg import ([\w, ]+)", line.strip())
    known = noetic_messages().get(found[1], ()) if found else ()
    if found is None or not known:
        return ""
    wrong = [name for name in re.split(r"[ ,]+", found[2]) if name not in known]
    slips = [name for name in wrong if any(is_one_edit(name.lower(), one.lower()) for one in known)]
    meant = slips or {name.lower() for name in wrong} & {one.lower() for one in known}
    return f"{wrong[0]} in {found[1]}.msg" if wrong and not meant else ""


def _examine(
    texts: dict[str, str], types: Sequence[str], fields: dict[str, dict[str, list[str]]]
) -> Iterator[_Entry]:
    deadline, left = time.monotonic() + WALL_S, list(texts)
    for _ in range(ATTEMPTS):
        wall_s = deadline - time.monotonic()
        if not left or wall_s <= 0:
            return
        request = [[file, texts[file]] for file in left]
        limits = ChildLimits(wall_s=wall_s, **LIMITS)
        answer = run_limited(EXAMINE, request, list(types), fields, _site(), limits=limits)
        for entry in filter(None, map(_entry, answer.lines.splitlines())):
            if entry.file in left:
                left.remove(entry.file)
                yield entry
        left = left[1:]  # of those that are left, the first one ended the child


def turn_sign(folder: Path, file: str, side: str = "") -> Repair | None:
    """Return the repair that turns the sign of the only line of a script that can make a robot turn to that side, or
    without a side, of the only turn that is worked out; None where it is not plain which one that is. The robot's way
    shows whether it is one."""
    files = Files(folder=folder.resolve())
    text = files.text(file)
    answer = run_limited(TURN, text or "", side, limits=ChildLimits(wall_s=WALL_S, **LIMITS))
    for step in map(json.loads, answer.lines.splitlines()[:1]):
        # where no side is known to be wrong, another line may be what is meant
        why = "with the other sign for this turn, a copy of the package passes"
        if side:
            why = "this turn has the wrong sign: a copy of the package with the other sign passes"
        files.change("turn-sign", file, step["text"], f"line {step['line']} of {file}: {why}")
    return next(iter(files.repairs), None)


def ros_clock(folder: Path, file: str) -> Repair | None:
    """Return the repair that measures time and waits by ROS's clock in a script that does so by the computer's; None
    where it does not."""
    files = Files(folder=folder.resolve())
    text = files.text(file) or ""
    lines = text.split("\n") if "import rospy" in text else []
    codes = [line.partition("#")[0] for line in lines]
    after = [
        OWN_CLOCK.sub(lambda found: CLOCKS[found[0]], code) + line[len(code) :]
        for code, line in zip(codes, lines, strict=True)
    ]
    changed = [number for number, (a, b) in enumerate(zip(lines, after, strict=True), 1) if a != b]
    if not changed:
        return None
    found = {one for code in codes for one in OWN_CLOCK.findall(code)}
    words = sorted({one.rstrip("(").replace("from time import ", "time.") for one in found})
    message = f"line {changed[0]} of {file}: {join_words(words)} {'keep' if len(words) > 1 else 'keeps'} "
    message += "to the computer's clock, and not to that of ROS"
    imports = [number for number in changed if lines[number - 1].startswith("from")]
    fixes = [f"on line {number}, write `{after[number - 1].partition('#')[0].strip()}`" for number in imports]
    if calls := [number for number in changed if number not in imports]:
        where = f"{'lines' if len(calls) > 1 else 'line'} {numbers_text(calls)}"
        fixes.append(f"on {where}, measure time with `rospy.get_time()` and wait with `rospy.sleep(…)`")
    fix = "; ".join(fixes)
    files.change("ros-clock", file, "\n".join(after), message, fix)
    return next(iter(files.repairs), None)


CLOCKS = {
    "time.time()": "rospy.get_time()",
    "time.sleep(": "rospy.sleep(",
    "from time import sleep": "from rospy import sleep",
    "from time import time": "from rospy import get_time as time",
}
OWN_CLOCK = re.compile(
    r"(?<![\w.])time\.time\(\)|(?<![\w.])time\.sleep\(|^from time import (?:sleep|time)(?=\s*$)"
)


def _site() -> str:
    """Return the folder that has fissix, which the child finds nowhere else."""
    spec = find_spec("fissix")
    return str(Path(spec.origin).parents[1]) if spec is not None and spec.origin else ""


def _entry(line: bytes) -> _Entry | None:
    try:
        return _Entry.model_validate(json.loads(line))
    except (ValueError, RecursionError):
        return None


def _join_steps(steps: Sequence[_Step]) -> Iterator[tuple[Cause, list[_Step]]]:
    """Steps of one cause that follow each other are one mistake, but each missing token and import is its own."""
    groups: list[tuple[Cause, list[_Step]]] = []
    for step in steps:
        if groups and groups[-1][0] == step.cause and step.cause not in EACH_ITS_OWN:
            groups[-1][1].append(step)
        else:
            groups.append((step.cause, [step]))
    yield from groups


EACH_ITS_OWN = ("token", "indent", "module", "import", "name", "attribute", "argument", "unbound", "kept")


def _change(files: Files, file: str, cause: Cause, steps: list[_Step]) -> None:
    kind = KINDS.get(cause, "python-syntax")
    message, fix = _words(file, cause, steps, files.text(file) or "")
    asks = any("raw_input" in step.word.split(", ") for step in steps if step.cause == "old-name")
    files.change(kind, file, steps[-1].text, message, fix, asks_input=asks)


def _blanks_of(text: str, number: int) -> str:
    line = text.split("\n")[number - 1]
    return line[: len(line) - len(line.lstrip())]


def _required_indentation(before: str, after: str, first: str) -> str:
    """How lines that are indented otherwise have to begin, so that the file parses; `first` goes before it."""
    pairs = enumerate(zip(before.split("\n"), after.split("\n"), strict=False), start=1)
    changed = [(number, new) for number, (old, new) in pairs if old != new and new.strip()]
    empty = {number for number, new in enumerate(after.split("\n"), start=1) if not new.strip()}
    lines: dict[str, list[int]] = {}
    for number, new in changed:
        count = len(new) - len(new.lstrip())
        kind = "tab" if set(new[:count]) == {"\t"} else "space"
        begin = plural(count, kind) if count else "no spaces"
        if len(set(new[:count])) > 1:
            tabs = new[:count].count("\t")
            like = [n for n in range(number - 1, 0, -1) if _blanks_of(after, n) == new[:count]]
            mixed = f"{plural(count - tabs, 'space')} and {plural(tabs, 'tab')}"
            begin = f"the spaces and tabs of line {like[0]}" if like else mixed
        some = lines.setdefault(begin, [])
        between = range(some[-1] + 1, number) if some else range(0)
        some += [*(between if empty.issuperset(between) else ()), number]
    named = [f"{on_lines(some)} with {begin}" for begin, some in lines.items()]
    if sum(len(re.findall(r"\d+ to \d+|\d+", one)) - 1 for one in named) > INDENTED_SHOWN:
        where = f"from line {changed[0][0]} to {changed[-1][0]}"
        if "\t" not in before:
            return f"{first}start the lines of each block exactly below each other, {where}"
        return f"indent with spaces only, the same at each level, {where}; `grader check --fix` does it"
    return f"{first}start {join_words(named)}"


def _rewritten(before: str, after: str) -> str:
    """Return how each of several lines is written instead; "" for one line, which the change itself shows."""
    pairs = list(zip(before.split("\n"), after.split("\n"), strict=False))
    found = [(number, as_code(new.strip())) for number, (old, new) in enumerate(pairs, start=1) if old != new]
    if len(found) < 2 or before.count("\n") != after.count("\n"):
        return ""
    written = [f"on line {number}, write {new}" for number, new in found[1:LINES_SHOWN]]
    left = len(found) - LINES_SHOWN
    more = f"; {plural(left, 'more line')} in the same way" if left > 0 else ""
    return "; ".join([f"write {found[0][1]}", *written]) + more


def _further_in(before: str, after: str, line: int) -> str:
    """Return by how many characters more the line begins."""
    one, other = ("".join(text.split("\n")[line - 1 : line]) for text in (before, after))
    more = len(other) - len(other.lstrip()) - (len(one) - len(one.lstrip()))
    return "four" if more == INDENTATION else str(more)


INDENTATION = 4
DEEPER = ("-2", "-4", "-8")
"""How much less lines are indented in the end that may have lost the line which they belong to."""


def _words(file: str, cause: Cause, steps: list[_Step], before: str) -> tuple[str, str]:
    """Return what is wrong, and how it is repaired; "" where the changed line says it."""
    first, after = steps[0], steps[-1].text
    error, word, place = first.error, first.word, f"line {first.line} of {file}"
    if cause in {"unbound", "kept"}:
        return _shared_variables(place, cause, word.split(", "))
    if cause == "defined":
        return _defined_below(place, word)
    if cause not in WORDS:
        reason = reason_of(error.message, error.text, column=error.column) if error else Reason()
        fix = _rewritten(before, after) if cause == "python2" else ""
        fix = f"delete line {first.line}" if reason.fix == DELETE_LINE else fix
        return f"{place}: {reason.text or (error.message if error else 'not Python 3')}", fix
    names = ", ".join(dict.fromkeys(step.word for step in steps))
    calls = ", ".join(f"{one}()" for one in word.split(", "))
    further = _further_in(before, after, first.line)
    told = COMMENTED_OUT if cause == "commented" else error.message if error else ""
    if cause == "level" and error and (first.line < error.line or "indent" not in told):
        told = TOO_FAR_IN if further.startswith("-") else OUT_OF_BLOCK
    told = reason_of(told).text
    known = {
        "file": file, "place": place, "line": first.line, "below": first.line + 1, "word": word, "names": names,
        "calls": calls, "told": told, "emptied": emptied_lines(before, after),
        "further": further,
    }  # fmt: skip
    said, fix = (words.format(**known) for words in WORDS[cause])
    if cause in {"quotes", "time"}:
        fix = _rewritten(before, after)
    if cause in {"tabs", "level", "inside"}:
        fix = _required_indentation(before, after, fix)
    if cause == "level" and further in DEEPER:
        fix += f" (or, if the line that begins its block, `if …:`, is missing: write that above line {first.line})"
    return said, fix if cause != "old-name" or word == "raw_input" else ""


def _defined_below(place: str, word: str) -> tuple[str, str]:
    """Return the same of what a line needs above it; `word` says which lines to move where, and names the functions."""
    first, last, where, other, *names = word.split()
    they = f"{join_words(f'`{name}`' for name in names)} {'are' if names[1:] else 'is'} defined only below it"
    return f"{place}: {they}", f"move {lines_text(int(first) - 1, int(last) - 1)} {where} line {other}"


def _shared_variables(place: str, cause: Cause, words: list[str]) -> tuple[str, str]:
    """Return the same of a function that lacks a `global`; `words` are its name and those of its variables."""
    function, *names = words
    fix = f"write `global {', '.join(names)}` as the first line of the function"
    if cause == "unbound":
        they = (
            "they are variables of its own and have" if names[1:] else "it is a variable of its own and has"
        )
        return f"{place}: `{function}(…)` assigns to {join_words(names)}: {they} no value yet", fix
    what = f"values to variables {join_words(names)}" if names[1:] else f"a value to a variable {names[0]}"
    those = "those" if names[1:] else "that"
    return f"{place}: `{function}(…)` gives {what} of its own, not to {those} of the file", fix


BELOW = "{place}: `global {word}` comes after a line that uses {word}"
WORDS: dict[Cause, tuple[str, str]] = {
    "merged": (f"{{place}}: {MERGED}", KEEP_ONE),
    "tabs": ("{place}: tabs and spaces are mixed in the indentation", "replace the tabs: "),
    "level": ("{place}: {told}", "change the indentation: "),
    "indent": ("{place}: the line after a `:` must be indented", "indent line {line} by {further} more spaces"),
    "commented": ("{place}: {told}", ""),
    "braces": ("{place}: Python has no `{{` and `}}` around a block",
     "end the first line of each block with `:` in place of `{{`, and delete each `}}` that ends a block"),
    "global": (BELOW, "move `global {names}` up, as the first line of the function, and nowhere else in it"),
    "outside": (BELOW, "delete line {line}: outside a function, `global` does nothing"),
    "old-name": ("{place}: {word} is Python 2", ASKED),
    "import": ("{place} uses {word}, which is not imported", ""),
    "module": ("{place}: {word}", ""),
    "other-module": ("{place}: {word} has no `init_node`: rospy is meant",
     "write `rospy` in place of `{word}`, wherever it stands"),
    "name": ("{place}: {word} is not defined", ""),
    "quotes": ("{place}: quotes are missing around {word}", ""),
    "attribute": ("{place}: there is no {word}", ""),
    "value": ("{place}: {word} is given a value with `=`, and has to be called", ""),
    "time": ("{place}: {word} must be a ROS time, not a number", ""),
    "call": ("{place}: {word} is named but not called", "write {calls}"),
    "quoted": ("{place}: {word} is in quotes, so it never runs", ""),
    "comment": ("{place}: `{word}` is commented out", "remove the `#` from line {line}"),
    "callback": ("{place}: {calls} is called where the function itself is meant", ""),
    "argument": ("{place}: {word}", ""),
    "guard": ("{place}: {word}", ""),
    "line": ("{place}: the line `{word}` is missing", ""),
    "empty": ("{place}: this block needs a line of its own", "write what it should do, or `pass` if nothing"),
    "emptied": ("{place}: there are only comments in the block that begins above it",
     "delete the `#` before the code of that block"),
    "twice": ("{place}: this line repeats the one above", "delete line {line}"),
    "turned": ("lines {line} and {below} of {file} are the wrong way round", "write line {below} above line {line}"),
    "start": ("{place}: the lines from here on belong to {calls}, so nothing runs them", ""),
    "inside": ("{place}: from here on the lines are outside of {calls}, to which they belong",
     "change the indentation: "),
    "late": ("{place} uses ROS before `rospy.init_node(…)`",
     "move `rospy.init_node(…)` from line {word} up, above line {line}"),
    "main": ("{place}: nothing calls {calls}", "add `if __name__ == '__main__':`, and {calls} below it"),
    "init": ("{file} never calls `rospy.init_node(…)`, so it makes no node", ""),
    "server": ("{place}: the action server of line {line} is never started", "below line {line}, write `{word}`"),
    "spin": ("{file} ends as soon as it is set up, because nothing keeps it running",
     "write {word} as the last line of the code that makes the node"),
}  # fmt: skip
"""What is wrong, and how it is repaired, where that is known without Python's own message."""
