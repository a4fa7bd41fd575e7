"""What a process writes on its console, how it ends, and whether its callbacks fail."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from pathlib import PurePosixPath
from typing import Annotated

from pydantic import Field, model_validator

from grader.checks.registry import ProcessName, check
from grader.checks.support.console_output import (
    Line,
    lines_and_errors,
    stream_lines,
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
    life,
    lives,
    nodes_of,
    not_started,
    offered_services,
)
from grader.checks.support.text import (
    NUMBER,
    PLACE,
    near_names,
    python_or_cpp,
    refuse_others,
    shown,
    unfilled,
    words_pattern,
)
from grader.checks.support.topics import cite, reads_keys, unheard
from grader.checks.support.wrong_lines import (
    filled,
    line_that_prints,
    not_reached,
    unprinted_result,
    unreached_except,
)
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, passed
from grader.wording import plural, significant

NUMERAL = re.compile(NUMBER)
LINE_CHARS_MAX = 1_000
"""A text is looked for in so much of a line."""
# Decimal numbers are not exact as floats: 0.4 differs from 0.3 by more than 0.1.
ROUNDING = 1e-9


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
            plain = significant(number)
            is_exact = abs(float(plain) - number) <= self.tolerance
            text = text.replace(PLACE, plain if is_exact else f"{number:.10g}", 1)
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
    other = [line for line in lines if not refused and _says_other(line, one, params)]
    hint = f"print {params.words} where it happens"
    failing = one.ended_early and (one.end is None or one.end.exit_code != 0)
    asked = asked_services(one, run)
    absent = [name for name, is_there in asked.items() if not is_there and name not in offered_services(run)]
    lacking = absent[0] if absent and not one.ended_early else ""
    never = f"it never prints {params.words}"
    # After a failed call or a crash, a number on a line need not be an answer.
    if other and not (lacking or (failing and params.is_number_alone)):
        near = f", within {significant(params.tolerance)}" if params.tolerance else ""
        message = f"it prints {shown(other[0].text)!r}, not {params.words}{near}{_slip(other[0], params)}"
        lost = _of_client(asked, run)(message, hint=hint).about(said=other[0].text)
        return lost.based_on(lost_to=(f"{params.text}: cut off",)) if _is_cut(other[0], params) else lost
    if failing:
        end, ended = explain_end(one, run, package), f"it ended before it printed {params.words}"
        early = _called_early(one, asked, run)
        return _early_call(ended, early) if early else end.verdict(failed_or_blocked, f"{ended}: {end.cause}")
    # What comes after Ctrl-C says how the program stops, not what it does.
    own = [line for line in lines if one.interrupt_ns is None or line.at_ns < one.interrupt_ns]
    error = explain_error(package, run)
    if error and not any(_has_words(line, params) for line in own):
        return error.verdict(failed_or_blocked, f"{never}: {error.cause}")
    deaf = unheard(run, package)
    unheard_of = (
        failed_or_blocked(f"{never}: {deaf.message}", hint=deaf.hint).caused_by(deaf) if deaf else None
    )
    if (
        why := _unserved(asked, lacking, own, run, never)
        or unheard_of
        or _unseen(one, package, run, params, never)
        or unprinted_result(package, one, never, params.words, params.found_in)
        or unreached_except(package, one, never, params.found_in, _of_client(asked, run))
    ):
        return why
    # One that goes on until Ctrl-C may still wait for its answer.
    waits = not one.ended_early and not _of_students(run).isdisjoint(asked)
    if not own:
        silent = _nothing_printed(package, run, params, hint).if_repeated().based_on(silent=True)
        return silent.late() if waits else silent
    meant = max(own, key=lambda line: SequenceMatcher(None, params.words, line.text[:LINE_CHARS_MAX]).ratio())
    hint = _of_whole_answer(meant, params) or unfilled(meant.text) or hint
    # what comes with an answer cannot be printed where nothing was called
    kind = failed_or_blocked if params.numbers and _uncalled(asked, run) else _of_client(asked, run)
    lost = kind(f"{never}; it prints {shown(meant.text)!r}", hint=hint)
    lost = lost.about(said=meant.text).based_on(lost_to=_other_words(meant, params)).if_repeated()
    return lost.late() if waits else lost


def _other_words(line: Line, params: PrintsParams) -> tuple[str, ...]:
    """Return what is wrong where the right numbers are on a line, with other words, for all criteria on that text."""
    there = [float(text) for text in re.findall(NUMBER, line.text[:LINE_CHARS_MAX])]
    near = (any(abs(one - n) <= params.tolerance + ROUNDING for one in there) for n in params.numbers)
    return (f"{params.text}: in other words",) if params.numbers and all(near) else ()


def _is_cut(line: Line, params: PrintsParams) -> bool:
    """Return whether the numbers on a line are the right ones without their decimals."""
    cut = tuple(float(int(n)) for n in params.numbers)
    return cut != params.numbers and _fits(line, params.model_copy(update={"numbers": cut, "tolerance": 0.0}))


def _uncalled(asked: Collection[str], run: Run) -> bool:
    """Return whether none of the services that are asked for was called."""
    return bool(asked) and not any(e.action == "serve" and e.topic in asked for _, e in run.actors)


def _has_words(line: Line, params: PrintsParams) -> bool:
    """Return whether all words of the text stand on the line, whatever is between them."""
    asked, said = (
        re.findall(r"[^\W\d_]+", text.lower())
        for text in (params.text.replace(PLACE, ""), line.text[:LINE_CHARS_MAX])
    )
    return bool(asked) and set(asked) <= set(said)


def _says_other(line: Line, one: Life, params: PrintsParams) -> bool:
    """Return whether the text stands on the line; a number alone, with another one than the program was given."""
    given = {float(word) for word in one.start.argv if params.is_number_alone and NUMERAL.fullmatch(word)}
    found = [set(map(float, each.groups())) for each in params.found_in(line)]
    return any(not numbers or not numbers <= given for numbers in found)


def _nothing_printed(package: PackageFacts, run: Run, params: PrintsParams, hint: str) -> Verdict:
    nothing = f"it prints nothing, not {params.words}"
    if keys := reads_keys(package, run):
        return failed_or_blocked(f"{nothing}: {keys.message}", hint=keys.fix)
    verdict = failed_or_blocked(nothing, hint=python_or_cpp(f"{hint}, with flush=True", hint))
    could = line_that_prints(package, run, lambda text: any(params.found_in(Line(0, text))))
    return not_reached(verdict, could, package) if could else verdict


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
    return failed if _of_students(run).isdisjoint(asked) else failed_or_blocked


def _of_students(run: Run) -> set[str]:
    """Return the services that the student's nodes offer."""
    offered = (one for _, event in run.graph for one in event.services.items())
    return {name for name, nodes in offered if any(map(run.is_student_node, nodes))}


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
    wait = python_or_cpp(
        f"rospy.wait_for_service('{service}')", f'ros::service::waitForService("{service}");'
    )
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


OTHER_DEFINITION = "md5sums do not match"
WRONG_ANSWERS = {
    "service handler returned None": "nothing",
    "handler returned wrong number of values": "something that is not a response",
    "handler returned invalid value": "something that is not a response",
}
"""What rospy tells a client whose server's callback returns nothing that it can send."""
