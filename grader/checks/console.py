"""What a process logs and writes on its console, how it ends, and whether its callbacks fail."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from pathlib import PurePosixPath
from typing import Annotated

from pydantic import Field, model_validator

from grader.checks.registry import ProcessName, check
from grader.checks.support.console_output import (
    Level,
    Line,
    Logged,
    filled,
    in_summary,
    line_that_prints,
    lines_and_errors,
    logged_by,
    not_reached,
    split_log_line,
    stream_lines,
    unprinted_result,
    unreached_except,
)
from grader.checks.support.exit_causes import (
    explain_end,
    explain_error,
    explain_traceback,
    is_rospys_own,
    process_tracebacks,
)
from grader.checks.support.fields import unit_slip
from grader.checks.support.launch_slips import own_script
from grader.checks.support.processes import (
    Life,
    asked_services,
    early_end,
    first_interrupt_ns,
    life,
    lives,
    nodes_of,
    not_started,
    offered_services,
    run_slips,
)
from grader.checks.support.text import (
    INIT,
    NUMBER,
    OTHER_WORDS_SHARE,
    PLACE,
    both,
    log,
    near_names,
    refuse_others,
    shown,
    unfilled,
    words_pattern,
)
from grader.checks.support.topics import cite, reads_keys, unheard
from grader.evidence.events import ConsoleLine
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import join_words, plural, significant

LINE_CHARS_MAX = 1_000
"""A text is looked for in so much of a line."""
# Decimal numbers are not exact as floats: 0.4 differs from 0.3 by more than 0.1.
ROUNDING = 1e-9
CAUSES = frozenset({"publish", "call", "goal", "set_param", "play"})
"""What the grader does in a run that a node may log something upon."""


class PrintsParams(Record):
    """A line of output, and how the program ends."""

    process: ProcessName
    """The scenario's name for the process."""
    text: Annotated[str, Field(min_length=1), refuse_others(PLACE)]
    """Part of a line; `{number}` in it stands for any number."""
    numbers: tuple[float, ...] = ()
    """The numbers that have to be in place of `{number}`, in this order."""
    tolerance: Annotated[float, Field(ge=0)] = 0.0
    """How much each number may differ, in the text's own unit."""
    at_most: Annotated[int, Field(ge=1)] | None = None
    """How many lines of one stream may have the text with these numbers, the log being one; null: any number."""
    exit_code: int | None = None
    """The process has to end by itself with this code; null: it may run on."""

    @model_validator(mode="after")
    def _has_places(self) -> PrintsParams:
        places = self.text.count(PLACE)
        if self.numbers and len(self.numbers) != places:
            message = f"numbers: {len(self.numbers)}, and {PLACE} {plural(places, 'time')} in the text"
            raise ValueError(message)
        return self

    @property
    def words(self) -> str:
        """The text with its numbers in their places."""
        text = self.text
        for number in self.numbers:
            text = text.replace(PLACE, significant(number), 1)
        return repr(text.replace(PLACE, "<number>"))

    @property
    def is_number_alone(self) -> bool:
        """Whether no word stands beside the number."""
        return not re.search(r"\w", self.text.replace(PLACE, ""))

    def found_in(self, line: Line) -> Iterator[re.Match[str]]:
        """Yield where the line has the words, without regard to capitals and blanks, with a group for each number."""
        pattern = f"({NUMBER})".join(words_pattern(words) for words in self.text.split(PLACE))
        return re.finditer(pattern, line.text[:LINE_CHARS_MAX])


@check("prints", params=PrintsParams)
def prints(package: PackageFacts, run: Run, params: PrintsParams) -> Verdict:
    """The program prints the line.

    What it checks
        That the process writes this text, with the right numbers if the lab gives them, and that it ends
        with the right exit code if the lab asks for one.

    Why it matters on a robot
        People who start a program read what it prints, and scripts use its exit code.

    How it is measured
        Every line on stdout and stderr, and every log message of the process's nodes, is compared. Capitals
        and the number of spaces between words do not matter; there may be more text around it. Numbers may
        differ by the tolerance.

    How to fix
        `print("…")` or `rospy.loginfo("…")` with the handout's words, at the place where it happens.
        In Python, `sys.exit(code)` sets the exit code.
    """
    one = life(run, params.process)
    code = "" if params.exit_code is None else f", exit code {params.exit_code}"
    expected = f"{params.words} printed{code}"
    if one is None:
        return not_started(params.process).about(expected=expected)
    lines, errors = lines_and_errors(run, one.name)
    # any error may have a number somewhere: `python3`
    said = lines if params.is_number_alone else (*lines, *errors)
    right = next((line for line in said if _fits(line, params)), None)
    if right is None:
        verdict = _not_printed(one, lines, package, run, params)
    else:
        verdict = (
            _too_often(run, one.name, params)
            or _other_end(one, params)
            or passed(f"it prints {shown(right.text)!r}")
        )
    span = (right.at_ns, right.at_ns) if right else (one.start_ns, one.end_ns)
    measured = verdict.measured or plural(len(lines), "line")
    cited = verdict.citations or (cite(run, "/grader/console", *span),)
    return verdict.about(expected=expected, measured=measured, citations=cited)


def _too_often(run: Run, process: str, params: PrintsParams) -> Verdict | None:
    # What is logged is also printed: each stream counts by itself.
    counts = (sum(_fits(line, params) for line in stream) for stream in stream_lines(run, process))
    count = max(counts, default=0)
    if params.at_most is None or count <= params.at_most:
        return None
    message = f"it prints {params.words} again and again, {count} times"
    return failed(message, hint="remember in a variable that it was printed, and do not print it again")


def _fits(line: Line, params: PrintsParams) -> bool:
    """Return whether the text stands anywhere on the line with the right numbers in it."""
    most = params.tolerance + ROUNDING
    # Without `numbers` any number will do, so there may be more groups than numbers.
    return any(
        all(abs(float(text) - n) <= most for text, n in zip(found.groups(), params.numbers, strict=False))
        for found in params.found_in(line)
    )


def _not_printed(
    one: Life, lines: Sequence[Line], package: PackageFacts, run: Run, params: PrintsParams
) -> Verdict:
    refused = any(OTHER_DEFINITION in line.text for line in lines)  # no number in that line is an answer
    other = [line for line in lines if any(params.found_in(line)) and not refused]
    hint = f"print {params.words} where it happens"
    failing = one.ended_early and (one.end is None or one.end.exit_code != 0)
    asked = asked_services(one, run)
    absent = [name for name, is_there in asked.items() if not is_there and name not in offered_services(run)]
    lacking = absent[0] if absent and not one.ended_early else ""
    # Where the call failed or the program crashed, a number on a line need not be an answer.
    if other and not (lacking or (failing and params.is_number_alone)):
        near = f", within {significant(params.tolerance)}" if params.tolerance else ""
        message = f"it prints {shown(other[0].text)!r}, not {params.words}{near}{_slip(other[0], params)}"
        return _of_client(asked, run)(message, hint=hint).about(said=other[0].text)
    if failing:
        end, ended = explain_end(one, run, package), f"it ended before it printed {params.words}"
        early = _called_early(one, asked, run)
        return _early_call(ended, early) if early else end.verdict(failed_or_blocked, f"{ended}: {end.cause}")
    if error := explain_error(package, run):
        return error.verdict(failed_or_blocked, f"it never prints {params.words}: {error.cause}")
    # What comes after Ctrl-C says how the program stops, not what it does.
    own = [line for line in lines if one.interrupt_ns is None or line.at_ns < one.interrupt_ns]
    deaf = unheard(run, package)
    never = f"it never prints {params.words}"
    unheard_of = failed_or_blocked(f"{never}: {deaf.message}", hint=deaf.hint) if deaf else None
    unheard_of = unheard_of and unheard_of.model_copy(update={"cause": deaf.message if deaf else ""})
    if (
        why := _unserved(asked, lacking, own, run, never)
        or unheard_of
        or _unseen(one, package, run, params, never)
        or unprinted_result(package, one, never, params.words, params.found_in)
        or unreached_except(package, one, never, params.found_in, _of_client(asked, run))
    ):
        return why
    if not own:
        return _nothing_printed(package, run, params, hint).if_repeated().model_copy(update={"silent": True})
    meant = max(own, key=lambda line: SequenceMatcher(None, params.words, line.text[:LINE_CHARS_MAX]).ratio())
    hint = _of_whole_answer(meant, params) or unfilled(meant.text) or hint
    lost = _of_client(asked, run)(f"{never}; it prints {shown(meant.text)!r}", hint=hint)
    return lost.about(said=meant.text).if_repeated()


def _nothing_printed(package: PackageFacts, run: Run, params: PrintsParams, hint: str) -> Verdict:
    nothing = f"it prints nothing, not {params.words}"
    if keys := reads_keys(package, run):
        return failed_or_blocked(f"{nothing}: {keys.message}", hint=keys.fix)
    verdict = failed_or_blocked(nothing, hint=both(f"{hint}, with flush=True", hint))
    could = line_that_prints(package, run, lambda text: any(params.found_in(Line(0, text))))
    return not_reached(verdict, could) if could else verdict


def _unseen(one: Life, package: PackageFacts, run: Run, params: PrintsParams, never: str) -> Verdict | None:
    """Return the loss where a launch file brings nothing up, or sends what a node prints to a file."""
    started = {PurePosixPath(word).name for word in one.start.argv}
    refused = any("cannot launch node of type" in line.line for _, line in run.lines(one.name))
    if refused and run.graph and not nodes_of(run, one.name):
        return failed_or_blocked(
            f"{never}: no node of the launch file came up", hint="read what roslaunch prints"
        )
    files = [file for file in package.launch_files if PurePosixPath(file.path).name in started]
    # Unless a <node> asks for the screen, roslaunch writes what it prints to a log file.
    for node in (node for file in files for node in file.brings if node.output != "screen"):
        script = own_script(package, node)
        said = [s for s in package.slips if script and s.file == script.path and s.kind == "prints"]
        printed = (filled(s) for s in said if s.name == "print")
        if any(any(params.found_in(Line(0, text))) for text in printed):
            why = f'the <node> {node.name} lacks output="screen", so what it prints goes to a log file'
            hint = f'on line {node.line} of {node.file}, write output="screen" in the <node>'
            return failed(f"{never}: {why}", hint=hint)
    return None


def _of_client(asked: Iterable[str], run: Run) -> Callable[..., Verdict]:
    """Return how a loss is told: what a client prints wrong may be what another node of the student's answers."""
    of_students = {
        name
        for _, e in run.graph
        for name, nodes in e.services.items()
        if any(map(run.is_student_node, nodes))
    }
    return failed if of_students.isdisjoint(asked) else failed_or_blocked


def _of_whole_answer(line: Line, params: PrintsParams) -> str:
    """Return how to print one field, where the line has the whole answer, `sum: 3`, in the place of its number."""
    for field in dict.fromkeys(re.findall(r"\b([a-z_]\w*): ", line.text[:LINE_CHARS_MAX])):
        if _fits(line._replace(text=line.text.replace(f"{field}: ", "", 1)), params):
            return f"print the field {field} alone, not the whole answer: write .{field} behind it"
    return ""


def _unserved(
    asked: Mapping[str, bool], lacking: str, own: Sequence[Line], run: Run, never: str
) -> Verdict | None:
    """Of a client: what its service does wrong, or that it asks for another one, or before a node offers it."""
    if any(OTHER_DEFINITION in line.text for line in own):
        hint = "give the .srv file the handout's fields, in their order and with their types, and build again"
        why = "its call failed, as the service has another definition of that type"
        return failed_or_blocked(f"{never}: {why}", hint=hint)
    for said, wrong in WRONG_ANSWERS.items():
        if any(said in line.text for line in own):
            hint = "end the service's callback with `return …Response(…)`"
            return failed_or_blocked(f"{never}: the service's callback returns {wrong}", hint=hint)
    offered = offered_services(run)
    absent = lacking or next((n for n, is_there in asked.items() if not is_there and n not in offered), "")
    # The only service that there is will be the one that is meant, whatever its name.
    near = near_names(absent, offered) or (tuple(offered) if len(offered) == 1 else ())
    if absent and near:
        hint = f"use the name {near[0]} both where you wait for it and where you call it"
        return failed_or_blocked(f"{never}: it asks for {absent}, and {near[0]} is offered", hint=hint)
    if lacking:
        hint = f"offer {lacking} in a node that runs beside it, or ask for the service that is offered"
        return failed_or_blocked(f"{never}: it asks for {lacking}, which no node offers", hint=hint)
    asked_early = [name for name, is_there in asked.items() if not is_there]
    early = next((n for n in asked_early if any(f"service [{n}] unavailable" in one.text for one in own)), "")
    return _early_call(never, early) if early in offered else None


def _called_early(one: Life, asked: Mapping[str, bool], run: Run) -> str:
    """Return the service that a program calls before a node offers it, where it ends by itself without a traceback."""
    by_itself = one.end is None or one.end.signal is None
    early = next((n for n, is_there in asked.items() if not is_there and n in offered_services(run)), "")
    return early if by_itself and not process_tracebacks(run, one.name) else ""


def _early_call(lost: str, service: str) -> Verdict:
    wait = both(f"rospy.wait_for_service('{service}')", f'ros::service::waitForService("{service}");')
    verdict = failed(
        f"{lost}: it calls {service} before a node offers it", hint=f"wait for it before the call: `{wait}`"
    )
    return verdict.if_repeated()  # which of the two comes first may differ from run to run


def _slip(line: Line, params: PrintsParams) -> str:
    """Return in brackets what is odd about a line's numbers if one is in another unit."""
    found = next(params.found_in(line), None)
    each = zip(found.groups() if found else (), params.numbers, strict=False)
    return next(filter(None, (unit_slip(float(text), number) for text, number in each)), "")


def _other_end(one: Life, params: PrintsParams) -> Verdict | None:
    if params.exit_code is None:
        return None
    hint = f"end with sys.exit({params.exit_code})"
    if not one.ended_early or one.end is None:
        return failed("it does not end by itself", hint=hint, measured="no exit code").if_repeated()
    code = one.end.exit_code
    if code == params.exit_code:
        return None
    how = f"exit code {code}" if code is not None else f"signal {one.end.signal}"
    return failed(f"it ends with {how}, not {params.exit_code}", hint=hint, measured=how)


class CallbacksCleanParams(Record):
    """Whose callbacks are watched."""

    process: ProcessName = ""
    """The scenario's name for the process; empty: each of the student's."""


@check("callbacks-clean", params=CallbacksCleanParams)
def callbacks_clean(package: PackageFacts, run: Run, params: CallbacksCleanParams) -> Verdict:
    """No callback ends with an exception.

    What it checks
        That no traceback is printed while the node runs. rospy catches an exception of a callback, prints it,
        and the node keeps running.

    Why it matters on a robot
        A callback that fails does nothing with its message. The node looks healthy, and the robot drives on
        with the previous command.

    How it is measured
        By the tracebacks on stderr up to Ctrl-C that contain a line of the package's own. A traceback that
        ends the whole process is not a callback's.

    How to fix
        Read the last line of the traceback, and the line of your file above it. Look at what the message
        holds before you use it: a list may be empty, a number may be NaN or infinite.
    """
    asked = [one for one in lives(run) if params.process in {"", one.name}]
    expected = "no exception in a callback"
    if not asked:
        return not_started(params.process or "the node").about(expected=expected)
    until = {one.name: one.interrupt_ns or one.end_ns for one in asked}
    found = [
        (one, traceback)
        for one in asked
        for traceback in process_tracebacks(run, one.name, before_ns=until[one.name])
        if not is_rospys_own(traceback)
    ]
    ended = next((one for one in asked if one.ended_early and one.end and one.end.exit_code != 0), None)
    # Only the last traceback ended the process: one before it is a callback's.
    if ended is not None and (len(found) <= 1 or found[0][0] != ended):
        end = explain_end(ended, run, package)
        verdict = end.verdict(
            failed_or_blocked, f"{ended.name} ended by itself after {ended.lasted}: {end.cause}"
        )
    elif found:
        end = explain_traceback(found[0][1], package)
        verdict = end.verdict(failed, f"a callback of {found[0][0].name} fails: {end.cause}")
    else:
        verdict = passed("no callback failed")
    measured = plural(len(found), "traceback")
    place = cite(run, "/grader/console", asked[0].start_ns, asked[-1].end_ns)
    return verdict.about(expected=expected, measured=measured, citations=(place,))


ALIKE = 0.7
OTHER_DEFINITION = "md5sums do not match"
WRONG_ANSWERS = {
    "service handler returned None": "nothing",
    "handler returned wrong number of values": "something that is not a response",
    "handler returned invalid value": "something that is not a response",
}
"""What rospy tells a client whose server's callback returns nothing that it can send."""


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
        more text around it. What a line behind `rospy.spin()` logs counts only where a step stops the node:
        at the end of the run it is too late. Other words of the same kind (`Hello ROS!` for `Hello World!`)
        at the right level earn half of the points.

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
        hint = f"{_call(params)} instead of {both('print(…)', 'std::cout')}"
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
        message = f"{message}: line {slip.line} of {slip.file} would, and it is not reached"
        hint = f"in {slip.file}, {slip.fix}"
        # To log whether or not the condition holds would be wrong where the text answers what the grader sends.
        if " out of " in slip.fix and any(e.action in CAUSES for _, e in run.actors):
            hint = f"in {slip.file}, see why the condition above line {slip.line} never holds"
        return failed(message, hint=hint, citations=(slip.place,))
    return failed(message, hint=f"{_call(params)} below {INIT}: above it, nothing is sent")


def _call(params: LogsParams) -> str:
    return f"write {log(params.level, params.text)}"
