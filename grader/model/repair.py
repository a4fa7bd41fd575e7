"""A mechanical repair of a package: one mistake, the lines that it changes, and what is left of the points after it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from itertools import groupby
from typing import Literal, get_args

from pydantic import Field

from grader.model.record import Record
from grader.model.submission import chmod_hint
from grader.wording import join_words, plural

RepairKind = Literal[
    "executable-bit", "encoding", "byte-order-mark", "line-ends", "shebang", "file-name", "python-syntax",
    "manifest-line", "build-line", "launch-syntax", "yaml-syntax", "package-name", "launch-type", "missing-import",
    "missing-call", "node-name", "topic-name", "service-name", "parameter-name", "ros-clock", "turn-sign",
    "exchanged-files", "message-type", "loop-rate", "other-field",
]  # fmt: skip
"""In the order in which a student would meet them."""

KINDS: tuple[RepairKind, ...] = get_args(RepairKind)
HALVING = frozenset({
    "python-syntax", "manifest-line", "build-line", "launch-syntax", "yaml-syntax", "missing-import", "missing-call",
    "turn-sign", "other-field",
})  # fmt: skip
DEFAULT_SHARES: dict[RepairKind, float] = {kind: 0.5 if kind in HALVING else 1.0 for kind in KINDS}
"""Which share of its points a criterion keeps that passes on a copy with a repair of this kind. The criterion that asks
for what was repaired loses its own points. A rubric's `repairs` can say otherwise."""
BY_HAND: dict[RepairKind, str] = {
    "executable-bit": f"not executable: {chmod_hint(None, 'FILE')}",
    "encoding": "not saved as UTF-8: in the editor, save it with the encoding UTF-8",
    "byte-order-mark": "an invisible mark before the first line: save it as UTF-8 without BOM",
    "line-ends": "Windows' line ends: dos2unix FILE, or switch CRLF to LF in the editor",
    "shebang": "no usable first line: write #!/usr/bin/env python3 as the very first line",
    "file-name": "a file by another name: rename it (git mv), and write the new name wherever the old one stands",
    "python-syntax": "a syntax error: python3 -m py_compile FILE names the line",
    "manifest-line": "a line is missing in package.xml: compare it with one that catkin_create_pkg makes",
    "build-line": "a line is missing in CMakeLists.txt: compare it with one that catkin_create_pkg makes",
    "launch-syntax": "a tag or attribute of a launch file that is misspelt or missing, or XML that is not well-formed: "
    "xmllint --noout FILE names the line",
    "yaml-syntax": "a line of a parameter file that is not YAML: rosparam load FILE names it",
    "package-name": "a misspelt package name: it is the same in package.xml, in project(…) and in each pkg=",
    "launch-type": "type= without .py: it is the file's whole name, as ls shows it",
    "missing-import": "a name that is not imported: from std_msgs.msg import NAME; or an import of what is not there",
    "missing-call": "a name or call that is misspelt, missing, lacks its brackets or has an argument in the wrong form",
    "node-name": "a misspelt node name: rosnode list shows how it is called",
    "topic-name": "a misspelt topic: rostopic list shows how it is called",
    "service-name": "a misspelt service or action: rosservice list and rostopic list show how it is called",
    "parameter-name": "a misspelt parameter: rosparam list shows how it is called",
    "ros-clock": "time by the computer's clock: a simulator sets ROS's, which rospy.get_time() and rospy.sleep(…) use",
    "turn-sign": "a turn to the wrong side: a positive angular.z turns to the left",
    "exchanged-files": "two scripts that hold each other's code: exchange the two files",
    "message-type": "a subscriber with another type than its topic: rostopic info shows the type",
    "loop-rate": "a loop or a timer with another rate: rostopic hz shows it",
    "other-field": "a value in another field of the message, linear.y for linear.x: rostopic echo shows the fields",
}
"""How a mistake of this kind looks, and how it is repaired."""

OF_LOGIC: frozenset[RepairKind] = frozenset({"ros-clock", "turn-sign", "other-field"})
"""Kinds that no file shows to be mistakes: they count only where the copy passes, and nothing is made by itself."""


MOVING: frozenset[RepairKind] = frozenset({"file-name", "exchanged-files"})
"""Kinds whose `before` and `after` are paths."""


RENAMED = "my_"
"""What a file's name begins with once it no longer hides a module."""


ASKED = "put a value in the code in place of `raw_input(…)`: a node cannot ask for input"
TYPED = "write `input` in place of `raw_input`"
"""The fix of a `raw_input(…)` to which the grader types the answer."""


class Repair(Record):
    """One mistake, and how it is repaired. Logic is not repaired, but for a clock, a rate, a sign and a field."""

    kind: RepairKind
    """What kind of repair it is, as in the rubric's `repairs`."""
    file: str
    """A file of the submission, from the package's root."""
    line: int | None = None
    """The first line that changes, counted from 1; null for permission bits and renames."""
    before: str = ""
    """The changed lines, after earlier repairs and before this one; for a rename, the path."""
    after: str = ""
    """The same lines, repaired, or the new path, or that of the other of two files. If a line is only added, both
    include the line next to it."""
    message: str
    """What is wrong."""
    fix: str
    """How it is repaired by hand: a command, or the line as it should be."""
    asks_input: bool = Field(default=False, exclude_if=lambda value: not value)
    """Whether the repaired line waits for typed input. Only there if it does."""

    def of_typing(self) -> Repair:
        """Return the repair for a lab in which the grader types what scripts ask for."""
        return self.model_copy(update={"fix": self.fix.replace(ASKED, TYPED)})

    def with_paths(self, path: Callable[[str], str]) -> Repair:
        """Return the repair with other paths of the file, and of what it is renamed to."""
        renamed = {"before": path(self.before), "after": path(self.after)} if self.kind in MOVING else {}
        return self.model_copy(update={"file": path(self.file), **renamed})


def place_of(repair: Repair) -> str:
    """Return `src/talker.py line 12`, or the file alone."""
    return repair.file if repair.line is None else f"{repair.file} line {repair.line}"


def messages_of(repairs: Iterable[Repair]) -> list[str]:
    """Return what is wrong by each of the repairs; of several on one line, the place once."""
    found: list[str] = []
    before = ""
    for message in (one.message for one in repairs):
        named = _PLACE.match(message)
        here = named[0] if named is not None else ""
        found.append(message.removeprefix(here) if here == before else message)
        before = here
    return found


_PLACE = re.compile(r"line \d+ of [^:]+: ")


def added_lines(before: str, after: str) -> str:
    """Return the lines that are new, on one line."""
    return "; ".join(_added(before, after))


def _added(before: str, after: str) -> list[str]:
    old = before.split("\n")
    return [line.strip() for line in after.split("\n") if line not in old and line.strip()]


def lines_to_write(line: int, before: str, after: str) -> str:
    """Return the lines that are new, as code; of those from a line on that each take another's place, which they are:
    `<launch>`, and `</launch>` on line 4."""
    old, new = before.split("\n"), after.split("\n")
    if len(old) != len(new):
        return join_words(map(as_code, _added(before, after)))
    numbered = [(n, one.strip()) for n, one in enumerate(new, start=line) if one not in old and one.strip()]
    return ", and ".join(as_code(one) + f" on line {n}" * (n > line) for n, one in numbered)


# Texts in quotes fit first, and stay as they are.
TABS_INSIDE = re.compile(r"""("[^"]*"|'[^']*')|[ ]*\t[ \t]*""")


def as_code(line: str) -> str:
    """Return a line of code in backticks, unless it has some itself; with a space for the tabs between its words, which
    a report would write out."""
    line = TABS_INSIDE.sub(lambda found: found[1] or " ", line)
    return line if "`" in line else f"`{line}`"


def _where_and_how(repair: Repair) -> tuple[str, str]:
    """Return where and how it is done by hand: `package.xml`, ``below line 9 add `<depend>rospy</depend>` ``."""
    new, added = repair.after.split("\n"), _added(repair.before, repair.after)
    if repair.kind == "exchanged-files":
        return "", repair.fix  # it names both
    if repair.fix != "; ".join(added):
        # A fix that is a sentence: it mostly names the line itself.
        below = len(new) > 1 and new[0] == repair.before and repair.line is not None
        named = re.match(
            r"(delete|move|replace the tabs: start|start|indent|write|make|remove the `#` (?:of|from)|in place of|"
            r"below(?: the \S+ on)?) lines? \d|write the keys in levels|write into it|at the end of",
            repair.fix,
        )
        if below and not named:
            return repair.file, f"below line {repair.line}, {repair.fix}"
        # the place has the line already
        return (
            (repair.file, repair.fix)
            if named
            else (place_of(repair), repair.fix.removeprefix(f"on line {repair.line}, "))
        )
    code = lines_to_write(repair.line or 1, repair.before, repair.after)
    # Where a line is added, the line beside it is the first or the last of the new ones, unchanged.
    replaced, script = repair.before not in (new[0], new[-1]), repair.file.endswith(".py")
    if replaced:
        # In Python the indentation is a part of what to write.
        moved = script and indent_of(new[0]) != indent_of(repair.before)
        return place_of(repair), f"write {code}{_indentation(new[0]) if moved else ''}"
    where = "below" if repair.before == new[0] else "above"
    depth = _indentation(new[1] if where == "below" else new[0]) if script else ""
    return repair.file, f"{where} line {repair.line} add {code}{depth}"


def indent_of(line: str) -> str:
    """Return the blanks with which the line begins."""
    return line[: len(line) - len(line.lstrip())]


def advice_on(repairs: Iterable[Repair]) -> list[str]:
    """Return the advice for each of the repairs, as one for those that follow each other on one line. Those that write
    the same line are told as one, by what it was and will be, and a line that is added as it will be in the end."""
    joined: list[Repair] = []
    for repair in repairs:
        added = next((at for at, one in enumerate(joined) if _is_of_added(one, repair)), None)
        if added is not None:
            after = joined[added].after.removesuffix(repair.before) + repair.after
            joined[added] = joined[added].model_copy(update={"after": after, "fix": repair.after})
            continue
        earlier = next((at for at, one in enumerate(joined) if _is_rewritten(one, repair)), None)
        if earlier is not None:
            before = joined[earlier].before
            fix = added_lines(before, repair.after)
            joined[earlier] = repair.model_copy(update={"before": before, "fix": fix})
        else:
            joined.append(repair)
    each = map(_where_and_how, joined)
    return [
        f"{place}: {', and '.join(how for _, how in found)}".removeprefix(": ")
        for place, found in groupby(each, key=lambda one: one[0])
    ]


def _is_rewritten(one: Repair, later: Repair) -> bool:
    return (one.file, one.line, one.after) == (later.file, later.line, later.before)


def _is_of_added(one: Repair, later: Repair) -> bool:
    """Return whether the later repair writes one line otherwise that the other one adds."""
    adds = one.fix == later.before and one.after.endswith(f"\n{later.before}")
    return one.file == later.file and adds and "\n" not in later.before + later.after


def _indentation(line: str) -> str:
    """Return how an indented line begins, as it has to be typed: with the tabs or the spaces of the lines beside it."""
    blanks = indent_of(line)
    counts = ((blanks.count("\t"), "tab"), (blanks.count(" "), "space"))
    words = join_words(plural(count, kind) for count, kind in counts if count)
    return f", with {words} before it" if words else ""
