"""What roslaunch said of its nodes, and why one of them is not there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.executable import find_script
from grader.checks.support.exit_cause import CAUSES, explain_traceback, process_tracebacks
from grader.checks.support.process import lives, observed_until_ns
from grader.checks.support.text import bare, shown
from grader.evidence.run import Run
from grader.model.package import LaunchNode, PackageFacts
from grader.model.verdict import FileCitation
from grader.wording import join_words

_ERRORS = (
    "ERROR: cannot launch",
    "RLException",
    "Invalid ",
    "ERROR:",
    "process has died",
    "roslaunch:",
    "Resource not found",
)
_SUBSTITUTION = re.compile(r"\\\$\\\(([^)]*)\\\)")
# Students print such lines too: between brackets is no other bracket, so that a line is looked through once.
_STARTED = re.compile(r"process\[([^\s\[\]]+)-\d+\]: started with pid")
_DIED = re.compile(r"\[([^\s\[\]]+)-\d+\] process has died \[pid \d+, exit code (-?\d+)")
_FINISHED = re.compile(r"\[([^\s\[\]]+)-\d+\] process has finished cleanly")
_REQUIRED = re.compile(r"REQUIRED process (\[[^\s\[\]]+-\d+\]) has died")

# what roslaunch says when it starts nothing, what it means, and what to do ({0}: the pattern's group)
_REFUSALS = (
    (r"multiple nodes named \[([^\[\]\n]+)\]", "two nodes are named {0}", "give each <node> a name of its own"),
    (r"cannot contain a namespace", "a node's name has a slash in it",
     'write name="…" without a slash; a namespace goes into ns="…"'),
    (r"missing required attribute: '?(\w+)", "a tag has no {0}", "add the attribute"),
    (r"file does not exist \[([^\[\]\n]+)\]", "the file {0} that <rosparam> loads does not exist",
     "write $(find <package>)/config/<file>, and push the file"),
    (r"Resource not found: (\S+)", "there is no package {0}",
     "$(find …) and pkg take the package's name, letter by letter"),
    (r"requires the '(\w+)' arg to be set", 'its <arg name="{0}"> has no default',
     'write <arg name="{0}" default="…"/>'),
    (r"output must be one of", 'output is "screen" or "log", in small letters', 'write output="screen"'),
    (r"multiple files named", "the package has two launch files of that name",
     "delete one of them, also one in a folder of old files: find . -name '*.launch' lists them"),
    (r"Unable to launch \[([^\s\[\]]+)-\d+\]", "the system cannot start the script of {0}",
     "its first line has to be #!/usr/bin/env python3, or #!/bin/bash for a shell script"),
    (r"Unknown substitution command \[([^\[\]\n]+)\]", "$({0}) is nothing that roslaunch knows",
     "write $(find <package>)/…"),
    (r"error loading <rosparam> tag", "<rosparam> cannot load its file",
     "rosparam load <file> shows what is wrong with the file"),
    (r"Invalid roslaunch XML syntax", "it is not well-formed", "close every element"),
)  # fmt: skip


class Absence(NamedTuple):
    """Why a node is not there. `of_script`: the reason lies in the script, not in the launch file."""

    why: str
    hint: str
    of_script: bool = False
    citations: tuple[FileCitation, ...] = ()


def name_pattern(node: LaunchNode) -> re.Pattern[str]:
    """The names that a node can come up under: `$(anon x)` becomes `x_<host>_<pid>_<digits>`.

    However many substitutions there are, a name is looked through once: each takes the least that it can, and what it
    took stands (a group in a lookahead is not tried again).
    """
    before, *others = _SUBSTITUTION.split(re.escape(node.full_name).replace(r"\ ", " "))
    literals, gaps = [before], list[str]()
    for inside, literal in zip(others[::2], others[1::2], strict=True):
        name, gap = _substituted(inside)
        literals[-1] += name
        gaps.append(gap)
        literals.append(literal)
    steps = [
        f"(?=(?P<g{number}>{gap}?{literals[number]}))(?P=g{number})"
        for number, gap in enumerate(gaps[:-1], 1)
    ]
    return re.compile("".join([literals[0], *steps, *gaps[-1:], *literals[1:][-1:]]))


def is_exact(node: LaunchNode) -> bool:
    """Whether the file alone says the node's name."""
    return "$(" not in node.full_name


def nodes_up(run: Run, node: LaunchNode) -> tuple[str, ...]:
    """The names in the graph under which it came up."""
    pattern = name_pattern(node)
    return tuple(name for name in run.student_nodes() if pattern.fullmatch(name))


def refusal(run: Run) -> Absence | None:
    """Why roslaunch started nothing, or broke off."""
    text = "\n".join(line for line in _lines(run))
    for pattern, why, hint in _REFUSALS:
        if match := re.search(pattern, text):
            words = [shown(PurePosixPath(g).name if "/" in g.strip("/") else g) for g in match.groups()]
            return Absence(f"roslaunch starts nothing: {why.format(*words)}", hint.format(*words))
    return None


def died(run: Run, node: LaunchNode) -> int | None:
    """The exit code with which roslaunch saw it die before Ctrl-C; None where it did not."""
    until_ns = observed_until_ns(run) or run.end_ns
    lines = _joined(bare(c.line) for t, c in run.console if t <= until_ns)
    codes = [int(m[2]) for line in lines if (m := _DIED.search(line)) and _is(node, m[1])]
    return codes[-1] if codes else None


def finished(run: Run, node: LaunchNode) -> bool:
    """Whether it ran to its own end without an error."""
    return any((m := _FINISHED.search(line)) and _is(node, m[1]) for line in _joined(_lines(run)))


def why_not_up(package: PackageFacts, run: Run, node: LaunchNode) -> Absence:
    """Why a node of the launch file did not come up."""
    return (
        _not_found(package, run, node)
        or why_died(package, run, node)
        or refusal(run)
        or _silent(run, node)
        or Absence(
            f"roslaunch did not start it{quoted(run)}", "run roslaunch by hand and read what it prints"
        )
    )


def why_died(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    """Its traceback where it was printed, or what roslaunch says of its end."""
    code = died(run, node)
    if code is None:
        return None
    script = find_script(package, str(node.type)) if node.pkg == package.name else None
    found = [
        t
        for one in lives(run)
        for t in process_tracebacks(run, one.name, before_ns=one.interrupt_ns)
        if script is None
        or any(PurePosixPath(f.file).name == PurePosixPath(script.path).name for f in t.frames)
    ]
    if found:
        end = explain_traceback(found[-1], package)
        return Absence(f"it died: {end.cause}", end.hint, of_script=True, citations=end.citations)
    if script is not None and script.python_fault is not None:
        fault = script.python_fault
        place = (FileCitation(file=script.path, line=fault.line),)
        hint = CAUSES.get(fault.kind, ("", "mend that line"))[1]
        return Absence(f"it died: {fault.kind}: {fault.message}", hint, of_script=True, citations=place)
    hint = 'write output="screen" into the <node>, and read what it prints last'
    return Absence(f"it died with exit code {code}", hint, of_script=True)


def quoted(run: Run) -> str:
    """The first line in which roslaunch says what is wrong, as the end of a sentence."""
    said = roslaunch_error(run)
    return f"; roslaunch says: {said}" if said else ""


def roslaunch_error(run: Run) -> str:
    """The first line in which roslaunch, or a node that it started, says what is wrong."""
    lines = [c.line for _, c in run.console if c.line.strip()]
    found = (line for mark in _ERRORS for line in lines if mark in line)
    return shown(next(found, ""))


def _not_found(package: PackageFacts, run: Run, node: LaunchNode) -> Absence | None:
    """roslaunch did not find the program, or none that may be executed."""
    mark = f"cannot launch node of type [{node.pkg}/{node.type}]"
    line = next((text for text in _lines(run) if mark in text), None)
    if line is None:
        return None
    script = find_script(package, str(node.type)) if node.pkg == package.name else None
    if script is not None and script.executable is False:
        hint = f"chmod +x {script.path}, then git update-index --chmod=+x {script.path}, commit and push"
        why = f"{script.path} has no executable bit, so that roslaunch does not find it"
        return Absence(why, hint, of_script=True, citations=(FileCitation(file=script.path),))
    if "Cannot locate" not in line:
        return Absence(
            f"there is no package {node.pkg}", "check the spelling of pkg, and that it is installed"
        )
    why = f"roslaunch finds no program {node.type} in the package {node.pkg}"
    return Absence(why, "type is the file's name, with .py for a script, and the file needs chmod +x")


def _silent(run: Run, node: LaunchNode) -> Absence | None:
    """Started, and never registered."""
    hint = "call rospy.init_node(…) before anything that waits"
    others = [n for n in run.student_nodes() if re.fullmatch(r"/.+_\d+_\d{9,}", n)]
    if finished(run, node):
        return Absence("its script came to its end without ever being a node", hint, of_script=True)
    started = any((m := _STARTED.search(line)) and _is(node, m[1]) for line in _lines(run))
    if not started:
        return None
    if others:
        why = (
            f"{join_words(others)} came up instead: the script does not take the name that roslaunch gives it"
        )
        return Absence(why, "start the script itself, and leave sys.argv as it is", of_script=True)
    return Absence("its script runs, but never registers as a node", hint, of_script=True)


def _is(node: LaunchNode, process: str) -> bool:
    return name_pattern(node).fullmatch(f"/{process}") is not None


def _substituted(inside: str) -> tuple[str, str]:
    """What stands for `$(inside)` in a pattern: the name that is known, and what follows it."""
    words = re.sub(r"\\(.)", r"\1", inside).split()
    return (f"{re.escape(words[1])}_", ".+") if len(words) == 2 and words[0] == "anon" else ("", ".*")


def _joined(lines: Iterable[str]) -> Iterator[str]:
    """Of a node with required="true", roslaunch says in one line that it "died", and in the next one how it ended."""
    name = ""
    for line in lines:
        if match := _REQUIRED.search(line):
            name = match[1]
        elif name and line.startswith("process has "):
            yield f"{name} {line}"
            name = ""
        else:
            yield line


def _lines(run: Run) -> list[str]:
    return [bare(c.line) for _, c in run.console]
