"""Why a process ended, in a student's words."""

from __future__ import annotations

import re
import signal
from typing import NamedTuple

from grader.checks.support.process import Life
from grader.checks.support.text import shown
from grader.checks.support.traceback import Traceback, tracebacks
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import FileCitation
from grader.wording import seconds

SYNTAX = ("SyntaxError", "IndentationError", "TabError")
RUN_IT = "run it by itself with rosrun, and read what it prints last"
RACE = "publish() to a closed topic"
LIMITS = ("limit", "note")  # evidence of earlier versions has it as a note
CAUSES = {
    "EOFError": (
        "it asks for input (`input()`), and a node is given none",
        "remove `input()`: a node runs by itself",
    ),
    "ROSInterruptException": (
        "ROS was told to shut down while the node slept, and nothing caught it",
        "call your main function in `try: … except rospy.ROSInterruptException: pass`, as talker.py does",
    ),
    "ROSInitException": (
        "it uses ROS before `rospy.init_node(…)`",
        "call `rospy.init_node(…)` before the first publish, Rate or sleep",
    ),
    "KeyboardInterrupt": (
        "Ctrl-C reached it in a place where nothing expects it",
        "loop with `while not rospy.is_shutdown():` and sleep with `rospy.Rate`",
    ),
    "ModuleNotFoundError": (
        "",
        "check the spelling of the import; a message package is imported as `std_msgs.msg`",
    ),
    "ImportError": (
        "",
        "check the spelling of the import: the message types are at http://wiki.ros.org/std_msgs",
    ),
    "NameError": ("", "check the spelling, and that it is imported or assigned before it is used"),
    "ROSSerializationException": ("", "publish a value that fits the message's type"),
    "SerializationError": ("", "publish a value that fits the message's type"),
    "SyntaxError": ("", "mend that line, or the one above it"),
    "IndentationError": ("", "indent every line with four spaces"),
    "TabError": ("tabs and spaces are mixed in its indentation", "indent every line with four spaces"),
}
# what rospy says of a slip that its exception's class does not tell of
SLIPS = {
    "namespaces are not allowed in node names": (
        "the name in `rospy.init_node(…)` has a slash in it",
        "write the node's name without a slash",
    ),
    "init_node() has already been called with different arguments": (
        "`rospy.init_node(…)` is called a second time",
        "one script is one node: call `rospy.init_node(…)` once",
    ),
    "Invalid number of arguments, args should be": (
        "the message is given another number of values than it has fields",
        'one value for each field; numbers get into a text by `%`: `publish("… %s" % value)`, not by a comma',
    ),
}
_ILLEGAL_NAME = re.compile(
    r"register (publication|subscription|service)(?: topic)? \[([^\[\]]*)\] with master: "
)


class Ending(NamedTuple):
    """What was the matter: a clause that follows `it ended because …`, what to do, and where it shows."""

    cause: str
    hint: str
    citations: tuple[FileCitation, ...]


def explain_end(life: Life, run: Run, package: PackageFacts) -> Ending:
    """Why a process ended: a name that ROS refuses, its last traceback, a limit, a signal, or its last words."""
    if refused := _refused_name(life, run):
        return refused
    if limit := _limit(life, run):
        return Ending(limit, "a node of this lab needs little memory, few processes and little time", ())
    found = process_tracebacks(run, life.name)
    code = life.end.exit_code if life.end else None
    if found and code != 0:
        return explain_traceback(found[-1], package)
    if life.end is not None and life.end.signal is not None and life.end.stopped_by is None:
        return Ending(f"{_signal_name(life.end.signal)} ended it", RUN_IT, ())
    if code == 0:
        hint = "a node has to stay alive: `rospy.spin()`, or a loop `while not rospy.is_shutdown():`"
        return Ending("its script came to its end", hint, ())
    last = next((line.line for _, line in reversed(list(run.lines(life.name))) if line.line.strip()), "")
    words = f"; its last words: {shown(last)}" if last else ""
    return Ending(f"it exited with code {code}{words}", RUN_IT, ())


def _limit(life: Life, run: Run) -> str:
    """What it had too much of, so that it was stopped."""
    met = (e.detail for _, e in run.actors if e.action in LIMITS and e.actor == life.name)
    return next((detail for detail in met if detail.startswith("stopped by the grader")), "")


def _refused_name(life: Life, run: Run) -> Ending | None:
    """rospy shuts a node down whose topic has a name that the master does not take."""
    found = (_ILLEGAL_NAME.search(c.line) for _, c in run.lines(life.name) if "illegal chars" in c.line)
    match = next(filter(None, found), None)
    if match is None:
        return None
    kind, name = "service" if match[1] == "service" else "topic", match[2]
    what = "has a blank in it" if re.search(r"\s", name) else "is no name that ROS takes"
    hint = (
        f"a {kind}'s name is made of letters, digits, _ and /: no blanks, also none before the closing quote"
    )
    return Ending(f"ROS shuts it down, for the name of its {kind} {name!r} {what}", hint, ())


def explain_traceback(found: Traceback, package: PackageFacts) -> Ending:
    """One traceback, with the line of the student's own file where it names one."""
    place = _place(found, package)
    slip = next((known for said, known in SLIPS.items() if said in found.message), None)
    cause, hint = slip or CAUSES.get(found.kind, ("", "mend the line that is named"))
    fault = (package.file(place.file) or _NO_FILE).python_fault if place else None
    if found.kind in SYNTAX and fault is not None:
        cause = fault.cause or cause
    where = f" ({place.file}, line {place.line})" if place else ""
    text = f"{shown(found.text)}{where}" + (f": {cause}" if cause else "")
    return Ending(text, hint, (place,) if place else ())


def process_tracebacks(
    run: Run, process: str, *, after_ns: int | None = None, before_ns: int | None = None
) -> tuple[Traceback, ...]:
    """The tracebacks on a process's stderr that began at `after_ns` or later, and before `before_ns`."""
    lines = [(t, c.line) for t, c in run.lines(process) if c.stream == "stderr"]
    found = tracebacks([line for _, line in lines])
    first_ns = after_ns if after_ns is not None else run.start_ns
    end_ns = before_ns if before_ns is not None else run.end_ns + 1
    return tuple(f for f in found if first_ns <= lines[f.first][0] < end_ns)


def is_rospys_own(found: Traceback) -> bool:
    """A race of rospy's own shutdown, or a thread in which no line of the student's takes part."""
    race = found.kind == "ROSException" and RACE in found.message
    return race or (bool(found.frames) and not found.own_frames)


def ended_after(life: Life) -> str:
    return seconds((life.end_ns or life.start_ns) - life.start_ns)


class _NoFile(NamedTuple):
    python_fault: None = None


_NO_FILE = _NoFile()


def _place(found: Traceback, package: PackageFacts) -> FileCitation | None:
    """The innermost line that lies in a file of the package; the longest path that fits decides."""
    for frame in reversed(found.frames):
        fits = [f.path for f in package.files if ("/" + frame.file).endswith("/" + f.path)]
        if fits and not frame.in_library:
            return FileCitation(file=max(fits, key=len), line=frame.line)
    return None


def _signal_name(number: int) -> str:
    try:
        return f"signal {number} ({signal.Signals(number).name})"
    except ValueError:
        return f"signal {number}"
