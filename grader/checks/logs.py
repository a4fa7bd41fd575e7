"""What a node logs on /rosout."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher
from typing import Annotated

from pydantic import Field

from grader.checks.registry import ProcessName, check
from grader.checks.support.console_output import (
    Level,
    Logged,
    in_summary,
    logged_by,
    split_log_line,
)
from grader.checks.support.exit_causes import (
    explain_end,
)
from grader.checks.support.processes import (
    early_end,
    first_interrupt_ns,
    life,
    lives,
    nodes_of,
    not_started,
    run_slips,
)
from grader.checks.support.text import (
    INIT,
    OTHER_WORDS_SHARE,
    log,
    python_or_cpp,
    shown,
    unfilled,
)
from grader.checks.support.topics import cite, refused_type
from grader.evidence.events import ConsoleLine
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import join_words, plural

CAUSES = frozenset({"publish", "call", "goal", "set_param", "play"})
"""What the grader does in a run that a node may log something upon."""
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
        A log message is kept with its time, its level and the node's name, and `rqt_console` shows it on
        any machine. Text that is only printed is lost with its terminal.

    How it is measured
        By the messages on /rosout, where every `rospy.loginfo(…)`, `logwarn(…)` and `logerr(…)` goes. The
        text has to be in one of them letter by letter, including capitals and punctuation; there may be
        more text around it. A line after `rospy.spin()` runs only when the node is stopped: it counts if a
        step stops the node during the run, and comes too late at its end. Other words of the same kind
        (`Hello ROS!` for `Hello World!`) at the right level earn half of the points.

    How to fix
        `rospy.loginfo("…")` after `rospy.init_node(…)` for the level INFO. `print(…)` does not log.
        `rostopic echo /rosout` shows what is logged.
    """
    nodes = nodes_of(run, params.process)
    lines = logged_by(run, nodes)
    right = next((one for one in lines if _has(one.text, params) and one.level == params.level), None)
    level = params.level.upper()
    # Behind `spin()` first: what is logged there would otherwise count as right.
    verdict = (
        _behind_spin(package, run, lines, params)
        or (passed(f"{right.node} logs {shown(right.text)!r} at level {level}") if right else None)
        or _other_level(lines, params)
        or _only_printed(run, params)
        or _near(run, lines, params)
        or _nothing(package, run, nodes, lines, params)
    )
    seen = join_words(f"{shown(t)!r}" for t in dict.fromkeys(one.text for one in lines[:3]))
    more = ", …" if len(lines) > 3 else ""
    at_ns = right.at_ns if right else None
    expected = f"{params.text!r} logged at level {level}"
    measured = f"{plural(len(lines), 'log message')}{': ' if seen else ''}{seen}{more}"
    cited = verdict.citations or (cite(run, "/rosout", at_ns, at_ns),)
    return verdict.about(expected=expected, measured=measured, citations=cited)


def _has(text: str, params: LogsParams) -> bool:
    return " ".join(params.text.split()) in " ".join(text.split())


def _hindered(package: PackageFacts, run: Run, params: LogsParams) -> PythonSlip | None:
    """Return the line that logs the text, where it stands in an `if` or behind a `spin()` and no other does."""
    said = [s for s in run_slips(package, run, "prints") if _has(s.message, params)]
    return said[0] if said and all(s.fix for s in said) else None


def _behind_spin(
    package: PackageFacts, run: Run, lines: Iterable[Logged], params: LogsParams
) -> Verdict | None:
    """Return the loss where the text came only once the node was being stopped, as its line stands behind `spin()`."""
    slip, pressed = _hindered(package, run, params), first_interrupt_ns(run)
    times = [t for t, line in _asked_lines(run, params) if _has(line.line, params)]
    times += [line.at_ns for line in lines if _has(line.text, params)]
    # Only the fix of a line behind `spin()` says to move it above.
    if slip is None or " above " not in slip.fix or pressed is None or min(times, default=0) < pressed:
        return None
    where = f"line {slip.line} of {slip.file} comes after spin()"
    message = f"{params.text!r} is logged only when the node is stopped: {where}"
    return failed(message, hint=f"in {slip.file}, {slip.fix}", citations=(slip.place,))


def _other_level(lines: Iterable[Logged], params: LogsParams) -> Verdict | None:
    one = next((one for one in lines if _has(one.text, params)), None)
    if one is None:
        return None
    level = (one.level or "unknown").upper()
    message = f"{one.node} logs {shown(one.text)!r} at level {level}, not {params.level.upper()}"
    return failed(message, hint=_call(params)).about(said=one.text)


def _only_printed(run: Run, params: LogsParams) -> Verdict | None:
    """On the console and not on /rosout: printed, or logged in a way that the recorder missed."""
    said = [line for _, line in _asked_lines(run, params) if _has(line.line, params)]
    if not said:
        return None
    of_logger = next((log for log in map(split_log_line, (line.line for line in said)) if log), None)
    if of_logger is None:
        message = f"{shown(said[0].line)!r} is only printed, not logged"
        hint = f"{_call(params)} instead of {python_or_cpp('print(…)', 'std::cout')}"
        return failed(message, hint=hint).about(said=said[0].line)
    if of_logger[0] != params.level:
        message = f"{params.text!r} is logged at level {of_logger[0].upper()}, not {params.level.upper()}"
        return failed(message, hint=_call(params))
    if _is_late(run, params):
        return passed(f"{shown(said[0].line)!r} is logged too late: the node was already being stopped")
    # The console proves that the node logged it.
    return grade_again(f"{shown(said[0].line)!r} was logged on the console, and did not arrive on /rosout")


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
    lines = [(t, line) for t, line in run.console if line.process in asked]
    listed = in_summary(line.line for _, line in lines)
    return [one for one, is_listed in zip(lines, listed, strict=True) if not is_listed]


def _near(run: Run, lines: Iterable[Logged], params: LogsParams) -> Verdict | None:
    """Other capitals, a missing sign, a typing error: in what was logged, or else in what was printed."""
    logged = [one.text for one in lines if one.level == params.level]
    otherwise = [one.text for one in lines if one.level != params.level]
    printed = [line.line for _, line in _asked_lines(run, params)]
    # In this order, as near words at the right level earn a part of the points.
    for texts, how in (
        (logged, "is logged"),
        (otherwise, "is logged at another level"),
        (printed, "is printed"),
    ):
        alike = max(texts, key=lambda text: _likeness(text, params.text), default="")
        if _likeness(alike, params.text) >= ALIKE:
            # A log line of the console has its level and time before the text.
            text = (split_log_line(alike) or ("", alike))[1]
            message, hint = f"{shown(text)!r} {how}, not {params.text!r}", unfilled(text) or _call(params)
            share = OTHER_WORDS_SHARE if texts is logged else 0.0
            verdict = failed(message, hint=hint).in_part(share, "the level, and nearly the text")
            return verdict.about(said=text)
    return None


def _likeness(text: str, wanted: str) -> float:
    plain = " ".join((split_log_line(text) or ("", text))[1].casefold().split())
    # With `autojunk`, frequent letters of a text over 200 characters would not count.
    return SequenceMatcher(None, plain, " ".join(wanted.casefold().split()), autojunk=False).ratio()


def _nothing(
    package: PackageFacts, run: Run, nodes: tuple[str, ...], lines: tuple[Logged, ...], params: LogsParams
) -> Verdict:
    """Nothing like it came: no process, a dead one, no node, or a node that logs other things or nothing."""
    if run.foreign:
        hint = "record /rosout too, from before the node starts: rosbag record -a"
        return failed_or_blocked(f"nothing in {run.evidence} logs {params.text!r}", hint=hint)
    asked = life(run, params.process) if params.process else next(iter(lives(run)), None)
    if asked is None:
        return not_started("the node")
    # Without a process named, any of the student's that ended may be the one that should log.
    ended = asked if asked.ended_early else (None if params.process else early_end(run))
    if ended is not None:
        end = explain_end(ended, run, package)
        return end.verdict(failed_or_blocked, f"the node ended before it logged {params.text!r}: {end.cause}")
    if not nodes:
        hint = f"call {INIT} before logging"
        return failed_or_blocked("no node was registered that could log", hint=hint)
    if lines:
        log_it = f"{join_words(nodes)} {'log' if len(nodes) > 1 else 'logs'}"
        message = f"{log_it} {shown(lines[0].text)!r}, not {params.text!r}"
        return failed(message, hint=unfilled(lines[0].text) or _call(params)).about(said=lines[0].text)
    return _silent(package, run, nodes, params)


def _silent(package: PackageFacts, run: Run, nodes: tuple[str, ...], params: LogsParams) -> Verdict:
    message = f"{join_words(nodes)} logs nothing"
    # rospy sends nothing below the level of `init_node`, which is INFO unless the script asks for another.
    debug = (s for s in run_slips(package, run, "prints") if s.name.startswith("logdebug"))
    if slip := next(debug, None):
        message = f"{message}: `rospy.{slip.name}` on line {slip.line} of {slip.file} is not sent"
        return failed(message, hint=f"on line {slip.line}, {_call(params)}", citations=(slip.place,))
    if slip := _hindered(package, run, params):
        noted = sorted({event.topic for _, event in run.actors if event.action == "note" and event.topic})
        # What would be logged upon a message waits for one that cannot come.
        if deaf := next(filter(None, (refused_type(run, topic, package) for topic in noted)), None):
            verdict = failed(f"{message}: {deaf.message}", hint=deaf.hint, citations=deaf.citations)
            return verdict.caused_by(deaf)
        message = f"{message}: line {slip.line} of {slip.file} would, and it is not reached"
        hint = f"in {slip.file}, {slip.fix}"
        # To log whether or not the condition holds would be wrong where the text answers what the grader sends.
        if " out of " in slip.fix and any(e.action in CAUSES for _, e in run.actors):
            hint = f"in {slip.file}, see why the condition above line {slip.line} never holds"
        return failed(message, hint=hint, citations=(slip.place,))
    return failed(message, hint=f"{_call(params)} below {INIT}: above it, nothing is sent")


def _call(params: LogsParams) -> str:
    return f"write {log(params.level, params.text)}"
