"""Why a process ended, in a student's words: Python tracebacks, limits, signals, what rospy says."""

from __future__ import annotations

import builtins
import re
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

from grader.checks.registry import Check
from grader.checks.support.console_output import Traceback, tracebacks, unpack_traceback
from grader.checks.support.exceptions import (
    OF_ROSCPP,
    SLIPS,
    evaluated,
    explain_exception,
    explain_narrow_handler,
    explain_number_of_values,
    no_number,
    without_base,
)
from grader.checks.support.launch_slips import unfound_program
from grader.checks.support.missing_modules import (
    broken_import,
    imported_line,
    is_module,
    lacking_module,
    lacking_too,
    unused_import,
)
from grader.checks.support.missing_names import IMPORT_ERRORS, hiding_file, name_slip, other_name, unmade
from grader.checks.support.operand_types import explain_by_definition, explain_operand
from grader.checks.support.processes import Life, early_end, lives, nodes_of, signal_name
from grader.checks.support.rospy_calls import (
    explain_formatting,
    of_typed_text,
    other_items,
    part_of_action,
    unfit_value,
    whole_message,
    without_message,
    wrong_class,
)
from grader.checks.support.scripts import (
    BUILD_FIRST_HINT,
    OF_INTERFACES,
    SYNTAX,
    argument_not_given,
    in_comments,
    input_not_given,
    move_hint,
    old_encoding,
    path_in_package,
    real_copy,
    without_git,
)
from grader.checks.support.text import (
    ARGUMENT_HINT,
    CAUSES,
    NEEDS_NETWORK,
    NO_INPUT,
    OFFLINE,
    PAUSE,
    STAY_ALIVE,
    VALUE_SLOT,
    explain_arguments,
    refused_options,
    shown,
)
from grader.evidence.events import STOPPED
from grader.evidence.run import Run
from grader.installable import install_hint
from grader.line_slips.python import COMMENTED_OUT, corrected, without_brace
from grader.model.file_fault import Fault
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.verdict import FileCitation, Span, Verdict, machine_lacks
from grader.wording import NOTHING_TO_DO, ON_THE_MACHINE, join_words, on_lines

OTHER_NAMES_SHOWN = 3
"""Names of the same script that are not defined either."""
MAIN = "`if __name__ == '__main__':`"
LOOK_THERE = "look at that line: the last words say what Python cannot do there"
RAISED = "the script raises this itself: is it what the handout asks for, and its condition right?"
RUN_IT = "run it by itself with rosrun, and read what it prints last"
BY_ROSCPP = -5
"""With which roslaunch sees a program end that roscpp ends: SIGTRAP, which not every system's `signal` has."""
RACES = ("publish() to a closed topic", "topic was closed during publish()")
PRINTED_ERROR = re.compile(
    r"name '\w+' is not defined|has no attribute|unexpected keyword argument|missing \d+ required|takes \d+ positional"
    r"|unsupported operand|must be str|not callable|(?:Error|Exception)\b"
)
"""What an `except Exception as e: print(e)` prints of a mistake in the script."""
LIMITS = ("limit", "note")  # evidence of earlier versions has it as a note
_NUMBER_WANTED = re.compile(r"must be (?:an integer|unsigned integer|float) type")
_ILLEGAL_NAME = re.compile(
    r"register (publication|subscription|service)(?: topic)? \[([^\[\]]*)\] with master: "
)
_NUMBER_ASKED = re.compile(r"\b(?:int|float)\(\s*(?:raw_)?input\(")
_NEEDS_INIT = re.compile(r"^(?!.*already been called).*init_node")
_ARITY = re.compile(r"([\w.<>]+)\(\) (?:takes|missing) ")
_NAME = re.compile(r"(?:name|local variable) '(\w+)' (?:is not defined|where it is not|referenced before)")
_BY_PYTHON = re.compile(r"\. Did you mean: '(\w+)'\?$")


def syntax_hint(fault: Fault) -> str:
    """Return how to repair a file that Python cannot parse: the lines as they have to be where that is known."""
    return "; ".join([_first_line_hint(fault), *fault.further])


def _first_line_hint(fault: Fault) -> str:
    where = f"line {fault.line}: " if fault.line else ""
    right = corrected(fault.source, fault.message, fault.column)
    if fault.unclosed and not right:
        closing = {"(": "`)`", "[": "`]`", "{": "`}`"}.get(fault.unclosed, "the bracket that closes it")
        return f"{where}write {closing} at the end of what is opened there"
    if below := re.search(r"name '(\w+)' is .* global declaration", fault.message):
        moved = f"move `global {below[1]}` up, as the first line of the function"
        return where + (moved if fault.source[:1].isspace() else "delete this line")
    if right:
        braces = ", and delete the `}` that closes the block" if without_brace(fault.source) else ""
        begin = fault.message.partition(f"{COMMENTED_OUT}: ")[2]
        return f"{where}write `{shown(right.strip())}`{braces}" + (f", and {begin}" if begin else "")
    return fault.advice or CAUSES.get(fault.kind, ("", "save the file as plain UTF-8 text"))[1]


class Ending(NamedTuple):
    """What was the matter with a process: a clause after `it ended because …`, what to do, and where it shows."""

    cause: str
    hint: str
    citations: tuple[FileCitation, ...] = ()
    process: str = ""
    by_itself: bool = False
    """Whether it came to its end as a script that has nothing more to do."""
    of_machine: bool = False
    """The grading machine lacks what it needs."""
    unbuilt: bool = False
    """What it needs is made by the build alone."""
    raised: bool = False
    """It is an exception of a line that is known."""

    def verdict(self, kind: Callable[..., Verdict], message: str, measured: str = "") -> Verdict:
        """Return a verdict of this kind (`failed`, `failed_or_blocked`) with the ending's hint and citations, or
        `inconclusive` where the machine is at fault."""
        return self.explain(kind(message, measured=measured), message)

    def explain(self, verdict: Verdict, message: str) -> Verdict:
        """Return a lost mark with this message, the ending's hint and its citations before those that it has;
        `inconclusive` where the machine is at fault."""
        if self.of_machine:
            verdict = machine_lacks(message, expected=verdict.expected, measured=verdict.measured)
        cited = (*self.citations, *verdict.citations)
        told = verdict.model_copy(update={"message": message, "hint": self.hint, "citations": cited})
        told = told.based_on(cause=self.cause, charged_once=self.raised, unbuilt=self.unbuilt)
        return told.seeking("uncalled", *OF_INTERFACES) if self.unbuilt else told


def explain_early_end(package: PackageFacts, run: Run) -> Ending | None:
    """Return why the first of the student's processes that ended early did so; None where none did."""
    ended = early_end(run)
    return None if ended is None else explain_end(ended, run, package)


def explain_end(life: Life, run: Run, package: PackageFacts) -> Ending:
    """Return why a process ended: a name that ROS refuses, its last traceback, a limit, a signal or its last output."""
    return _find_cause(life, run, package)._replace(process=life.name)


def _find_cause(life: Life, run: Run, package: PackageFacts) -> Ending:
    script = package.file(life.start.script or "")
    fault = script.python_fault if script is not None and script.is_no_script else None
    whole = Ending(fault.explanation, syntax_hint(fault)) if fault is not None else None
    if refused := whole or _refused_name(life, run):
        return refused
    if limit := _limit(life, run):
        return Ending(limit, "a node of this lab needs little memory, few processes and little time")
    found = process_tracebacks(run, life.name)
    code = life.end.exit_code if life.end else None
    # A script that catches an exception and prints it may still come to a good end.
    printed = [line.line for _, line in run.lines(life.name) if line.line.strip()]
    # roslaunch itself comes to a good end when its last node has died.
    if found and (code != 0 or any("have died, roslaunch" in line for line in printed)):
        return explain_traceback(found[-1], package)
    # A signal of the grader's is no crash.
    if life.end is not None and life.end.signal is not None and life.end.stopped_by is None:
        ended = f"{signal_name(life.end.signal)} ended it"
        lacking = argument_not_given(ended, life.start.argv, package)
        return Ending(*(lacking or _said_by_roscpp(printed) or (ended, RUN_IT)))
    if (offline := _offline(code, printed)) or code == 0:
        return offline or _not_run(life, run, package) or _ran_to_the_end(printed, package)
    # roslaunch goes on printing after it has said why.
    exceptions = [line for line in printed if re.match(r"(?:\x1b\[\d*m)?RLException: ", line)]
    last = next(iter(exceptions or printed[::-1]), "")
    words = f"; its last output: {shown(last)}" if last else ""
    # Remappings are ROS's, and no arguments of the program.
    explained = explain_arguments(last, [one for one in life.start.argv[1:] if ":=" not in one])
    words, hint = (f"{words}; {explained[0]}", explained[1]) if explained else (words, RUN_IT)
    own = [s for s in package.slips if (s.file, s.kind) == (life.start.script, "ends-node")]
    words, hint, cited = (f": {own[0].message}", own[0].fix, (own[0].place,)) if own else (words, hint, ())
    return Ending(f"it exited with code {code}{words}", hint, cited)


def explain_code(code: int, printed: Sequence[str], *, shown_by_roslaunch: bool) -> tuple[str, str]:
    """Return why a node died that roslaunch started and that printed no traceback, and what to do."""
    if code == BY_ROSCPP and (known := _said_by_roscpp(printed)):
        return f"it died: {known[0]}", known[1]
    hint = RUN_IT if shown_by_roslaunch else f'write output="screen" in the <node>: {RUN_IT}'
    return f"it died with exit code {code}{refused_options(printed)}", hint


def _said_by_roscpp(printed: Sequence[str]) -> tuple[str, str] | None:
    return next((known for line in printed for text, known in OF_ROSCPP.items() if text in line), None)


def _offline(code: int | None, printed: Sequence[str]) -> Ending | None:
    if not printed or not OFFLINE.search(printed[-1]):
        return None
    cause = f"it ended with exit code {code}; its last output: {shown(printed[-1])}: {NEEDS_NETWORK[0]}"
    return Ending(cause, NEEDS_NETWORK[1], of_machine=True)


def _ran_to_the_end(printed: Sequence[str], package: PackageFacts) -> Ending:
    """Explain it by what was printed last, where an `except` may have printed it."""
    last = printed[-1] if printed else ""
    if found := unfound_program(printed, package):
        return Ending(*found, unbuilt=found[1] == BUILD_FIRST_HINT)
    if not PRINTED_ERROR.search(last):
        return Ending("its script ran to the end", STAY_ALIVE, by_itself=True)
    hint = "fix that error; without the `except` that prints it, Python says on which line it is"
    return Ending(f"its script ran to the end, and printed last: {shown(last)}", hint, by_itself=True)


def _not_run(life: Life, run: Run, package: PackageFacts) -> Ending | None:
    """Explain a script that comes to its end because nothing calls what it defines, or because its loop is left."""
    script = package.file(life.start.script or "")
    is_node = bool(nodes_of(run, life.name))  # also by a name that no line of it says
    if script is not None and not is_node and (other := real_copy(script, package)):
        cause = f"its script ran to the end: it makes no node, but {other}, which has the same name, does"
        return Ending(cause, without_git(move_hint(package, other, script.path), package), by_itself=True)
    if script is not None and script.shebang_fault == "empty-file":
        cited = (FileCitation(file=script.path, line=1),)
        return Ending("its file is empty", f"write the node in {script.path}", cited, by_itself=True)
    calls = ("main-guard", "not-called", "never-called")
    kinds = (*calls, "never-begun", "loop-left", "commented-out", "no-init", "ends-node", "swallows")
    own = [s for s in package.slips if s.file == life.start.script and s.kind in kinds]
    slips = [
        s
        for s in own
        if (s.kind not in {"commented-out", "swallows"} or s.name in {"spin", "run"})
        and (s.kind != "not-called" or s.name.rpartition(".")[2] not in ("sleep", "is_shutdown"))
    ]
    if not slips:
        typed = input_not_given(life.start.argv, package)
        return Ending(*typed, by_itself=True) if typed else None
    slip = min(slips, key=lambda one: kinds.index(one.kind))
    of_script = [s for s in package.slips if s.file == life.start.script]
    if slip.kind == "commented-out" and (all_of_them := in_comments(of_script)):
        slip = slip.model_copy(update=all_of_them)
    called = f"call {slip.name}() at the end of the script, below {MAIN}" if slip.name else f"write {MAIN}"
    cause = f"its script ran to the end: {slip.message} ({slip.file}, line {slip.line})"
    return Ending(cause, slip.fix or called, (slip.place,), by_itself=True)


def explain_error(
    package: PackageFacts, run: Run, *, only: Collection[str] | None = None, during: Sequence[Span] = ()
) -> Ending | None:
    """Return the last traceback before Ctrl-C, or in at least half of the stretches `during`, of the student's
    processes, or of those of these names; None where there is none."""
    own = [one for one in lives(run) if only is None or one.name in only]
    spans = [[(one, *span) for one in own] for span in during]
    by_span = [
        [
            t
            for one, from_ns, until_ns in span
            for t in process_tracebacks(run, one.name, after_ns=from_ns, before_ns=until_ns)
            if not is_rospys_own(t)
        ]
        for span in spans or [[(one, one.start_ns, one.interrupt_ns or run.end_ns + 1) for one in own]]
    ]
    found = [here[-1] for here in by_span if here]
    # what fails at one of many times does not explain the others
    return explain_traceback(found[-1], package) if found and 2 * len(found) >= len(by_span) else None


def explain_by_exception(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the exception that a callback raised, which rospy prints and outlives. One when nothing
    was due need not be why."""
    if not check.of_callbacks or verdict.basis.cause or early_end(run):
        return verdict
    if (end := explain_error(package, run, during=verdict.basis.due)) is None:
        if not (verdict.basis.due and (other := explain_error(package, run))):
            return verdict
        why, hint = f"at another time, a callback fails: {other.cause}", f"{verdict.hint}; {other.hint}"
        return verdict.explained(why, hint, other.citations)
    return end.explain(verdict, f"{verdict.message}; a callback fails: {end.cause}")


def _limit(life: Life, run: Run) -> str:
    """Return what it had too much of, so that it was stopped."""
    met = (e.detail for _, e in run.actors if e.action in LIMITS and e.actor == life.name)
    return next((detail for detail in met if detail.startswith(STOPPED)), "")


def _refused_name(life: Life, run: Run) -> Ending | None:
    """Explain a node that rospy shut down because the master does not take the name of its topic."""
    found = (_ILLEGAL_NAME.search(c.line) for _, c in run.lines(life.name) if "illegal chars" in c.line)
    match = next(filter(None, found), None)
    if match is None:
        return None
    kind, name = "service" if match[1] == "service" else "topic", match[2]
    what = "has a space in it" if re.search(r"\s", name) else "is not a name that ROS accepts"
    hint = (
        f"a {kind}'s name is made of letters, digits, _ and /: no spaces, not even before the closing quote"
    )
    return Ending(f"ROS shuts it down because the name of its {kind} {name!r} {what}", hint)


def explain_traceback(found: Traceback, package: PackageFacts) -> Ending:
    """Explain one traceback, with the line of the student's own file where it names one."""
    place = _place(found, package)
    if lacking := lacking_module(found, package):
        return _of_machine(found, lacking, place, package)
    if broken := broken_import(found, package):
        return _of_broken_machine(found, broken, place)
    where = f" ({place.file}, line {place.line})" if place else ""
    if OFFLINE.search(found.text) and not any("/rosgraph/" in frame.file for frame in found.frames):
        cause = f"{shown(found.text.rstrip('.'))}{where}: {NEEDS_NETWORK[0]}"
        return Ending(cause, NEEDS_NETWORK[1], (place,) if place else (), of_machine=True)
    source = package.file(place.file) if place and found.kind in SYNTAX else None
    fault = source.python_fault if source else None
    place = fault.place if fault and fault.line else place
    wrong = _callback(found, place, package) or _of_timer(found, package)
    hiding = hiding_file(found, package)
    unbuilt = None if hiding else unmade(found, package)
    known = hiding or unbuilt or _known_meaning(found, place, package)
    if fault:
        known = fault.explanation if fault.cause else known[0], syntax_hint(fault)
    if wrong:
        known = wrong.message, wrong.fix
    elif place is not None:  # other lines are nearer to the mistake than what the exception says of this one
        known = _by_script(found, place, package) or known
    cause, hint = known
    place = place or (wrong.place if wrong else None)
    if place is not None and found.kind in IMPORT_ERRORS and unbuilt is None and not hiding:
        # what the build makes is imported to be used: its right import is the nearer fix
        of_own = f"write `from {package.name}." in hint
        hint = (not of_own and unused_import(place, package)) or hint
    where = f" ({place.file}, line {place.line})" if place else ""
    text = f"{shown(_said(found, cause).rstrip('.'))}{where}" + (f": {cause}" if cause else "")
    return Ending(text, hint, (place,) if place else (), unbuilt=unbuilt is not None, raised=bool(place))


def _known_meaning(found: Traceback, place: FileCitation | None, package: PackageFacts) -> tuple[str, str]:
    """Return the cause and the hint, by the first that knows it; else what the type of the exception says."""
    return (
        _misplaced(found)
        or without_message(found)
        or _slip(found, package)
        or _asks_for_input(found, place, package)
        or old_encoding(package, found.kind, {one.file for one in found.frames})
        or CAUSES.get(found.kind, ("", RAISED if found.innermost.source.startswith("raise ") else LOOK_THERE))
    )


def _misplaced(found: Traceback) -> tuple[str, str] | None:
    own = found.own_frames
    return (evaluated(found) or wrong_class(own[-1].source)) if own else None


def _by_script(found: Traceback, place: FileCitation, package: PackageFacts) -> tuple[str, str] | None:
    """Return what the sides of a sum are, or what other lines of the script are to blame for."""
    of_sum = explain_operand(found, package) if found.kind == "TypeError" else None
    sum_ = explain_by_definition(found, package) or of_sum
    sum_ = of_typed_text(found, place.file, package) or sum_ or without_base(found.message, package.slips)
    spent = (s for s in package.slips if (s.file, s.kind, s.line) == (place.file, "runs-out", place.line))
    sum_ = sum_ or next(((s.message, s.fix) for s in spent if found.kind == "StopIteration"), None)
    return sum_ or (None if _misplaced(found) else _by_other_lines(found, place, package))


def _said(found: Traceback, cause: str) -> str:
    """Return the exception's own words, without a guess of Python's where the cause names another one."""
    said = re.sub(r" \(/\S+/__init__\.py\)$", "", found.text)
    guess = _BY_PYTHON.search(said)
    has_other = cause.startswith("the build ") or "did you mean" in cause
    is_spare = guess is not None and (hasattr(builtins, guess[1]) or has_other)
    return said.removesuffix(guess[0]) if guess is not None and is_spare else said


def _of_broken_machine(found: Traceback, broken: str, place: FileCitation | None) -> Ending:
    """Explain an import that fails within a file of ROS's or of the machine's."""
    where = f" ({place.file}, line {place.line})" if place else ""
    cause = f"{shown(found.text)}{where}: raised by a file of this grading machine, {broken}"
    line = shown(imported_line(found)) or "what is imported"
    hint = f"{ON_THE_MACHINE}repair {line}, which fails there by itself"
    return Ending(cause, hint, (place,) if place else (), of_machine=True)


OF_OTHER_LINES = {
    "unregistered()": "unregistered",
    "integer' when writing 'header": "secs",
    "'~": "unset",
    "by zero": "new-field",
}


EXPLAINED_ELSEWHERE = {
    "TypeError", "UnboundLocalError", "ValueError", "KeyError", "IndexError", "ROSSerializationException",
}  # fmt: skip


def _by_other_lines(found: Traceback, place: FileCitation, package: PackageFacts) -> tuple[str, str] | None:
    """Return the cause and the hint of an error that other lines of the file explain."""
    own = [s for s in package.slips if s.file == place.file]
    said = f"{found.message} {found.innermost.source}"
    hidden = [s for s in own if s.kind == "hides-class" and re.search(rf"\b{s.name}\b", said)]
    hidden += [s for s in own if s.name == "nanoseconds" and "format requires" in found.message]
    if found.kind == "TypeError":
        hidden += [s for s in own if (s.kind, s.line) == ("defined-twice", place.line)]
    hidden += [s for s in own if (s.name, s.line) == ("letters", place.line)]
    hidden += [s for s in own if (s.name, found.kind) == ("edge", "IndexError")]
    if hidden and found.kind in EXPLAINED_ELSEWHERE:
        return hidden[0].message, hidden[0].fix
    if found.kind in {"NameError", "UnboundLocalError"}:
        return _misspelt(found, place, package)
    if found.kind == "AttributeError" or "missing 1 required positional argument: 'self'" in found.message:
        lines = {place.line} if "is read-only" not in found.message else {s.line for s in own}
        here = (s for s in own if s.kind == "object" and s.line in lines)
        return next(((s.message, s.fix) for s in here if re.search(rf"\b{s.name}\b", found.message)), None)
    if found.kind == "SerializationError" and _NUMBER_WANTED.search(found.message):
        return no_number(found, place, package)
    if slip := next((name for said, name in OF_OTHER_LINES.items() if said in found.message), ""):
        return next(((s.message, s.fix) for s in own if slip in {s.kind, s.name}), None)
    late = found.kind in {"ROSInitException", "ROSException"} and _NEEDS_INIT.search(found.message)
    calls = [f.line for f in found.own_frames if path_in_package(package, f.file) == place.file] or [1]
    return _late_init(place.file, calls, package) if late else explain_narrow_handler(found, place, package)


def _late_init(file: str, lines: Sequence[int], package: PackageFacts) -> tuple[str, str] | None:
    """Return why `init_node` was not called before these lines, the first of which calls what the others are in."""
    slips = [s for s in package.slips if s.file == file]
    if astray := next((s for s in slips if (s.kind, s.name) == ("object", "__init__")), None):
        return astray.message, astray.fix
    gone = next((s for s in slips if (s.kind, s.name) == ("commented-out", "init_node")), None)
    if gone is not None and not any(s.kind == "node-name" for s in slips):
        told = in_comments(slips) or {"message": f"line {gone.line} is commented out", "fix": gone.fix}
        return told["message"], told["fix"]
    if never := next((s for s in slips if s.kind == "no-init"), None):
        return never.message, f"call `rospy.init_node(…)`, with the node's name, above line {lines[0]}"
    calls = [s.line for s in slips if s.kind == "node-name" and not s.fix]
    # of a function that a line outside of it calls too early, that line
    below = [(call, line) for line in lines for call in calls if call > line]
    move = "move `rospy.init_node(…)` from line {} up, above line {}"
    return (CAUSES["ROSInitException"][0], move.format(*below[0])) if below else None


def _asks_for_input(
    found: Traceback, place: FileCitation | None, package: PackageFacts
) -> tuple[str, str] | None:
    """Return the cause and the hint of a script that asks for input once, or has a Rate already."""
    rated = {one.file for one in package.slips if one.kind.startswith("rate-")}
    own = [s for s in package.slips if s.kind == "input" and place and s.file == place.file]
    asks, fixes, instead = {s.line: s.name for s in own}, [s.fix for s in own if s.fix], ""
    if len(asks) > 1:
        instead = f"write values in the code in place of each `input()`: {on_lines(sorted(asks))}"
    elif fixes and fixes[0].startswith(("publish …", "on line")):
        instead = fixes[0].replace("…", VALUE_SLOT, 1)
    elif number := _NUMBER_ASKED.search(found.innermost.source):
        value = "a number in the code" if "once" in asks.values() else VALUE_SLOT
        instead = f"write {value} in place of `{number[0]}…))`"
    elif "once" in asks.values():
        instead = "write a value in the code in place of `input()`"
    has_rate = place is not None and place.file in rated
    if found.kind != "EOFError" or not (instead or has_rate):
        return None
    in_place = instead or (f"{NO_INPUT}; {fixes[0]}" if fixes else NO_INPUT)
    # what is typed is what such a loop waits for
    waits = "" in asks.values() or (not instead and "paused" not in asks.values())
    pause = "make sure that the loop calls `sleep()` of its Rate"
    pause = pause if has_rate else f"pause in the loop: {PAUSE}"
    return CAUSES["EOFError"][0], f"{in_place}, and {pause}" if waits else in_place


def _slip(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return the cause and the hint of a known slip, by what was said, by the module and by the line itself."""
    source = found.innermost.source
    if found.kind == "IndexError" and "argv" in source:
        return "it reads a command-line argument, but is started without any", ARGUMENT_HINT
    name = _NAME.search(found.message)
    if name and re.search(rf"//.*\b{name[1]}\b", source):
        return "a comment begins with `#` in Python", f"write `{shown(source.replace('//', '#', 1))}`"
    known = next((known for said, known in SLIPS.items() if said in found.message), None)
    known = explain_number_of_values(found.message, source) or known
    meant = part_of_action(found) or other_items(found) or unfit_value(found, package)
    meant = meant or known or other_name(found, package)
    frame = found.innermost
    meant = meant or whole_message(found, package) or explain_formatting(found.message, source)
    return meant or explain_exception(found.kind, found.message, frame.source, frame.marked)


def _misspelt(found: Traceback, place: FileCitation, package: PackageFacts) -> tuple[str, str] | None:
    """Return the name that is meant, where the file defines one that is spelt alike, with other slips of its names."""
    name = _NAME.search(found.message)
    slips = [s for s in package.slips if s.file == place.file]
    if outside := next((s for s in slips if (s.line, s.kind) == (place.line, "outside-method")), None):
        return outside.message, outside.fix
    meant = [one for s in slips if (one := name_slip(s, package)) is not None]
    here = next((one for one in meant if name and (one.line, one.name) == (place.line, name[1])), None)
    if here is None:
        return None
    # what gives a name its value is told once, however often it is read
    others = {one.name if one.fix.startswith("above line ") else one.fix: one for one in reversed(meant)}
    others = {
        key: o for key, o in others.items() if o.line != place.line and key not in {here.name, here.fix}
    }
    fixes = [one.fix for one in reversed(others.values())]
    return here.why, "; ".join([here.fix, *fixes[:OTHER_NAMES_SHOWN]])


def _callback(found: Traceback, place: FileCitation | None, package: PackageFacts) -> PythonSlip | None:
    """The callback that the error speaks of: one that is called on this line, or that ROS calls with other values."""
    if found.kind != "TypeError":
        return None
    called = [s for s in package.slips if s.kind == "callback-called" and place is not None]
    here = next((s for s in called if place and (s.file, s.line) == (place.file, place.line)), None)
    match = _ARITY.match(found.message)
    name = match[1].rpartition(".")[2] if match else ""
    taken = (s for s in package.slips if s.kind == "callback-values" and s.name == name)
    return here or (next(taken, None) if name and not found.own_frames else None)


def _of_timer(found: Traceback, package: PackageFacts) -> PythonSlip | None:
    """The timer whose thread divides by its period, 0, before its callback is called once."""
    return next((s for s in package.slips if s.name == "zero" and found.is_of_timer), None)


def process_tracebacks(
    run: Run, process: str, *, after_ns: int | None = None, before_ns: int | None = None
) -> tuple[Traceback, ...]:
    """Return the tracebacks on a process's stderr that began at `after_ns` or later, and before `before_ns`."""
    printed = [(t, c.line) for t, c in run.lines(process) if c.stream == "stderr"]
    lines = [(t, part) for t, line in printed for part in unpack_traceback(line)]
    found = tracebacks([line for _, line in lines])
    first_ns = after_ns if after_ns is not None else run.start_ns
    end_ns = before_ns if before_ns is not None else run.end_ns + 1
    return tuple(f for f in found if first_ns <= lines[f.first][0] < end_ns)


def _is_answer(found: Traceback) -> bool:
    return any(frame.file.endswith("/tcpros_service.py") and frame.in_library for frame in found.frames)


def is_rospys_own(found: Traceback) -> bool:
    """Return whether it is a race of rospy's own shutdown, a thread in which no line of the student's takes part, or
    how a service refuses a call."""
    if found.innermost.source.startswith("raise ") and _is_answer(found):
        return True
    race = found.kind == "ROSException" and any(said in found.message for said in RACES)
    if found.is_of_timer or (found.kind == "TypeError" and _ARITY.match(found.message)):
        return False  # a timer's period, or a callback that takes other values: rospy's line uses it
    return race or (bool(found.frames) and not found.own_frames)


def _lines_added(package: PackageFacts, path: str) -> int:
    """Return how many lines the script that ran has more than the one handed in: a missing first line is added to a
    node's, which names its node, or which publishes or subscribes and is not just imported."""
    file = package.file(path)
    if file is None or file.shebang is not None or file.link_problem:
        return 0
    imported = any(path in other.imports for other in package.files)
    kinds = {"node-name"} if imported else {"node-name", "publisher-type", "subscriber-type"}
    return int(any(slip.file == path and slip.kind in kinds for slip in package.slips))


def _place(found: Traceback, package: PackageFacts) -> FileCitation | None:
    """Return the innermost line that lies in a file of the package; the call of a debugger, which stops below it."""
    for frame in reversed(found.frames):
        path = None if frame.in_library else path_in_package(package, frame.file)
        if path is not None:
            calls = [s.place for s in package.slips if (s.file, s.kind) == (path, "debugger")]
            if calls and found.kind == "BdbQuit":
                return calls[0]
            place = FileCitation(file=path, line=max(1, frame.line - _lines_added(package, path)))
            if not frame.marked:
                return place
            begin, end = (1 + column for column in frame.marked)
            return place.model_copy(update={"column": begin, "end_column": end, "source": frame.source})
    return None


def _of_machine(found: Traceback, lacking: str, place: FileCitation | None, package: PackageFacts) -> Ending:
    """Explain an import of what exists and this machine lacks, with what else the script needs of the kind."""
    where = f" ({place.file}, line {place.line})" if place else ""
    others = [name for name in lacking_too(place, package) if name != lacking]
    cause = f"{shown(found.text)}{where}: this grading machine lacks {join_words([lacking, *others])}"
    hint = install_hint(lacking, module=is_module(lacking, package), also=others)
    if place is not None and (unused := unused_import(place, package)):
        needed = hint.replace(NOTHING_TO_DO, "If you need it, ", 1)
        hint = f"{unused}. {needed}"
    return Ending(cause, hint, (place,) if place else (), of_machine=True)
