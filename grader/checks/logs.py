"""Whether a node logs a line."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher
from typing import Annotated

from pydantic import Field

from grader.checks.registry import ProcessName, check
from grader.checks.support.console_output import Level, Logged, console_log, logged_by
from grader.checks.support.exit_causes import explain_end
from grader.checks.support.idioms import INIT, both, log
from grader.checks.support.nodes import nodes_of
from grader.checks.support.processes import early_end, life, lives, not_started
from grader.checks.support.text import OTHER_WORDS_SHARE, shown
from grader.checks.support.topics import cite
from grader.evidence.events import ConsoleLine
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, inconclusive, partial, passed, unjudged
from grader.wording import join_words, plural

ALIKE = 0.7


class LogsParams(Record):
    """A log message."""

    text: Annotated[str, Field(min_length=1)]
    """Part of the log message, letter by letter."""
    level: Level = "info"
    """The level at which it is logged."""
    process: ProcessName = ""
    """Only this process's nodes count; empty: each of the student's."""


@check("logs", params=LogsParams, messages_only=True)
def logs(package: PackageFacts, run: Run, params: LogsParams) -> Verdict:
    """The node logs the line.

    What it checks
        That the node logs this text at this level.

    Why it matters on a robot
        What is logged is kept with its time, its level and the node's name, and `rqt_console` shows it on
        any machine. What is only printed is gone with its terminal.

    How it is measured
        By the messages on /rosout, where every `rospy.loginfo(…)`, `logwarn(…)` and `logerr(…)` goes. The
        text has to stand in one of them letter by letter, capitals and punctuation included; more may stand
        around it. Other words of the same kind (`Hello ROS!` for `Hello World!`) earn half of the points.

    How to fix
        `rospy.loginfo("…")` after `rospy.init_node(…)` for the level INFO. `print(…)` does not log.
        `rostopic echo /rosout` shows what is logged.
    """
    nodes = nodes_of(run, params.process)
    lines = logged_by(run, nodes)
    right = next((one for one in lines if _has(one.text, params) and one.level == params.level), None)
    level = params.level.upper()
    verdict = (
        (passed(f"{right.node} logs {shown(right.text)!r} at level {level}") if right else None)
        or _other_level(lines, params)
        or _only_printed(run, params)
        or _near(run, lines, params)
        or _nothing(package, run, nodes, lines, params)
    )
    seen = join_words(f"{shown(t)!r}" for t in dict.fromkeys(one.text for one in lines[:3]))
    more = ", …" if len(lines) > 3 else ""
    at_ns = right.at_ns if right else None
    return verdict.about(
        expected=f"{params.text!r} logged at level {level}",
        measured=f"{plural(len(lines), 'log message')}{': ' if seen else ''}{seen}{more}",
        citations=verdict.citations or (cite(run, "/rosout", at_ns, at_ns),),
    )


def _has(text: str, params: LogsParams) -> bool:
    return " ".join(params.text.split()) in " ".join(text.split())


def _other_level(lines: Iterable[Logged], params: LogsParams) -> Verdict | None:
    one = next((one for one in lines if _has(one.text, params)), None)
    if one is None:
        return None
    level = (one.level or "unknown").upper()
    message = f"{one.node} logs {shown(one.text)!r} at level {level}, not {params.level.upper()}"
    return failed(message, hint=_call(params))


def _only_printed(run: Run, params: LogsParams) -> Verdict | None:
    """On the console and not on /rosout: printed, or logged in a way that the recorder missed."""
    said = [line for _, line in _asked_lines(run, params) if _has(line.line, params)]
    if not said:
        return None
    of_logger = next((log for log in map(console_log, (line.line for line in said)) if log), None)
    if of_logger is None:
        message = f"{shown(said[0].line)!r} is only printed, not logged"
        return failed(message, hint=f"{_call(params)} instead of {both('print(…)', 'std::cout')}")
    if of_logger[0] != params.level:
        message = f"{params.text!r} is logged at level {of_logger[0].upper()}, not {params.level.upper()}"
        return failed(message, hint=_call(params))
    if _is_late(run, params):
        return passed(f"{shown(said[0].line)!r} is logged too late: the node was already being stopped")
    message = f"{shown(said[0].line)!r} was logged on the console, and did not arrive on /rosout"
    return inconclusive(message, hint="grade again")


def _is_late(run: Run, params: LogsParams) -> bool:
    """Logged behind Ctrl-C, when nothing is sent to /rosout any more: the node slept first."""
    stops = {one.name: one.interrupt_ns for one in lives(run) if one.interrupt_ns is not None}
    return any(
        line.process in stops and t >= stops[line.process] and _has(line.line, params)
        for t, line in _asked_lines(run, params)
    )


def _asked_lines(run: Run, params: LogsParams) -> list[tuple[int, ConsoleLine]]:
    """Return the console's lines of the process that is judged, or of all the student's."""
    asked = {params.process} if params.process else {one.name for one in lives(run)}
    return [(t, line) for t, line in run.console if line.process in asked]


def _near(run: Run, lines: Iterable[Logged], params: LogsParams) -> Verdict | None:
    """Other capitals, a missing sign, a typing error: in what was logged, or else in what was printed."""
    logged = [one.text for one in lines]
    printed = [line.line for _, line in _asked_lines(run, params)]
    for texts, how in ((logged, "is logged"), (printed, "is printed")):
        alike = max(texts, key=lambda text: _likeness(text, params.text), default="")
        if _likeness(alike, params.text) >= ALIKE:
            text = (console_log(alike) or ("", alike))[1]
            message, hint = f"{shown(text)!r} {how}, not {params.text!r}", _call(params)
            return (
                partial(OTHER_WORDS_SHARE, message, hint=hint)
                if texts is logged
                else failed(message, hint=hint)
            )
    return None


def _likeness(text: str, wanted: str) -> float:
    plain = " ".join((console_log(text) or ("", text))[1].casefold().split())
    matcher = SequenceMatcher(None, plain, " ".join(wanted.casefold().split()), autojunk=False)
    return matcher.ratio()


def _nothing(
    package: PackageFacts, run: Run, nodes: tuple[str, ...], lines: tuple[Logged, ...], params: LogsParams
) -> Verdict:
    """Nothing like it came: no process, a dead one, no node, or a node that logs other things or nothing."""
    if run.foreign:
        hint = "record /rosout too, from before the node starts: rosbag record -a"
        return unjudged(f"nothing in {run.evidence} logs {params.text!r}", hint=hint)
    asked = life(run, params.process) if params.process else next(iter(lives(run)), None)
    if asked is None:
        return not_started("the node")
    ended = asked if asked.ended_early else (None if params.process else early_end(run))
    if ended is not None:
        end = explain_end(ended, run, package)
        return end.verdict(unjudged, f"the node ended before it logged {params.text!r}: {end.cause}")
    if not nodes:
        hint = f"call {INIT} before logging"
        return unjudged("no node was registered that could log", hint=hint)
    if lines:
        message = f"{join_words(nodes)} logs {shown(lines[0].text)!r}, not {params.text!r}"
        return failed(message, hint=_call(params))
    hint = f"{_call(params)} below {INIT}: above it, nothing is sent"
    return failed(f"{join_words(nodes)} logs nothing", hint=hint)


def _call(params: LogsParams) -> str:
    return f"write {log(params.level, params.text)}"
