"""Lost marks that lines of a script explain: a value that goes wrong there, a callback that waits, or a line that would
print what is missing."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from pathlib import PurePosixPath

from grader.checks.registry import Check
from grader.checks.support.console_output import Line
from grader.checks.support.processes import Life, ends_twice, run_slips
from grader.checks.support.scans import begins_ahead
from grader.checks.support.topics import files_that_run, reach_hint, why_unreached
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.verdict import Status, Verdict, failed

SEEN_AS = {
    "nan": "nan", "degrees": "value", "return": "nothing", "empty": "value", "bounds": "", "added": "",
    "step": "order", "cut": "place", "half": "value", "secs": "never", "mean": "", "unset": "value",
    "stuck": "stuck", "edge": "place", "times": "order", "early": "value",
    "frames": "frames", "rows": "order",
}  # fmt: skip
"""How a verdict says that a value is `wrong`, by the name of the slip that makes it so; others always show."""

STEERING = (
    "swapped",
    "mixed",
    "rootless",
    "inf",
    "angle",
    "turned",
    "negative",
    "ungiven",
    "first",
    "side",
    "metres",
)
OF_STEERING = ("ends-at", "stays-within", "path", "reacts")
"""What leads a robot astray wherever its script computes so, and the checks of what a robot does."""

PRIVATE, COPIES = "private ", ("copied", "argv", "uncancelled", "swallowed", "shared")
OF_ARGUMENTS = ("prints", "calls")
"""Checks of what a node makes of its command line."""
OF_CONNECTIONS = ("launch-connects", "connected", "topic-type", "rate", "latched")
"""Checks that a topic of the node's own namespace fails."""
OF_TURNS = ("orientation", "rotation", "transform")
"""What a quaternion can be wrong in."""


def is_private_there(slip: PythonSlip, run: Run) -> bool:
    """Return whether a node of the student's has the topic or the service of its own namespace that a line makes."""
    names, nodes = slip.name.removeprefix(PRIVATE).split(), run.student_nodes()
    ends = [
        getattr(event, end) for _, event in run.graph for end in ("publishers", "subscribers", "services")
    ]
    return any(f"{node}/{name}" in end for node in nodes for name in names for end in ends)


SEEN_BY = {
    "argv": OF_ARGUMENTS,
    "swallowed": (*OF_ARGUMENTS, "service-answers", "action-result"),
    "shared": ("field-equals", "rostest"),
    "kept": (*OF_STEERING, "field-equals", "field-bounds", "rostest"),
    "turn": ("prints", "service-answers", "action-result", "field-equals", "reacts", "rostest"),
}
"""The checks that see what some slips make wrong."""


def _may_show(slip: PythonSlip, check: Check, run: Run, verdict: Verdict, *, of_values: bool) -> bool:
    """Return whether a check may see what a line makes wrong."""
    if slip.name.startswith(PRIVATE):
        return is_private_there(slip, run)
    if slip.name in SEEN_BY:
        return check.name in SEEN_BY[slip.name]
    if slip.name == "side" and not begins_ahead(run):
        return False
    if slip.name == "uncancelled":
        return "cancelled" in verdict.message
    # of these an exception tells
    return of_values and slip.name != "closed" and not slip.name.startswith("decorator ")


SLOW_HZ = 2.0
"""A robot that steers so seldom has turned too far before the next velocity comes."""


def _by_slow_loop(package: PackageFacts, files: Collection[str | None], verdict: Verdict) -> Verdict:
    """Return a robot's lost mark with the loop of its script that goes round too seldom to steer."""
    rates = [s for s in package.slips if s.kind == "rate-number" and s.file in files]
    slow = [s for s in rates if float(s.message) <= SLOW_HZ]
    if len(rates) != 1 or not slow:
        return verdict
    one = slow[0]
    why = f"line {one.line} of {one.file} lets it steer at {one.message} Hz, and each velocity lasts until the next one"
    hint = f"on line {one.line} of {one.file}, let it come round more often, as 10 or 20 times a second"
    return verdict.explained(why, hint, (one.place,), cause=why)


def explain_by_wrong_value(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the line of a script that runs on which the value goes wrong, or with its conditions that
    are always or never true."""
    silent = not any("Twist" in c.type and c.messages for c in run.student_channels())
    if (
        silent
        and not verdict.basis.cause
        and check.name in OF_STEERING[:3]
        and (slip := why_unreached(package, run))
    ):
        why = f"line {slip.line} of {slip.file}: {slip.message}"
        return verdict.explained(why, reach_hint(slip), (slip.place,), cause=slip.message)
    files = files_that_run(package, run)
    of_values = (
        check.of_callbacks or check.name in OF_VALUES or (check.name == "prints" and verdict.basis.silent)
    )
    kinds = ["wrong-value", "compared"] if of_values and not verdict.basis.cause else []
    if check.name in (*OF_CONNECTIONS, *OF_ARGUMENTS) and not verdict.basis.cause and not kinds:
        kinds = ["wrong-value"]
    unexplained = verdict.basis.wrong != "nothing" and not verdict.basis.cause
    if check.name == "action-result" and unexplained and ends_twice(run):
        kinds.append("goes-on")
    found = [s for s in package.slips if s.kind in kinds and s.file in files]
    found = [s for s in found if _may_show(s, check, run, verdict, of_values=of_values)]
    # feedback that is not sent explains only what is missing of it
    found = [s for s in found if "publish_feedback" not in s.fix or "feedback" in verdict.message]
    wrong = verdict.basis.wrong
    steers = STEERING if check.name in OF_STEERING else ()
    sure = [
        s
        for s in found
        if s.kind in ("goes-on", "compared")
        or s.name in steers
        or s.name.startswith((*COPIES, PRIVATE))
        or (wrong and SEEN_AS.get(s.name) == wrong)
    ]
    turns = any(word in verdict.message for word in OF_TURNS)
    sure = [s for s in sure if s.name != "half" or turns]
    maybe = [s for s in found if not (SEEN_AS.get(s.name) or (wrong and s.name in SEEN_AS))]
    if not sure and not maybe and check.name in OF_STEERING and not verdict.basis.cause and not silent:
        return _by_slow_loop(package, files, verdict)
    for slip in sure[:1] or maybe[:4]:
        why = f"line {slip.line} of {slip.file}: {slip.message}"
        fix = f"on line {slip.line}, {slip.fix}" if slip.kind == "compared" else slip.fix
        # a line that is told already is wrong as well
        hint = fix if sure and not verdict.hint.startswith("on line ") else f"{verdict.hint}; {fix}"
        cause = slip.message if sure else ""
        verdict = verdict.explained(why, hint, (slip.place,), cause=cause)
    return verdict


def explain_by_misplaced_value(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return the same of values in a wrong place or order, which no exception puts there."""
    if verdict.basis.wrong not in {"place", "order"}:
        return verdict
    explained = explain_by_wrong_value(check, package, run, verdict)
    return explained if explained.basis.cause else verdict


OF_VALUES = ("action-result", "rostest", "stamps")
"""Checks of what a node sends, besides those of what it does upon what it hears."""
OF_RESULTS = ("prints", "rostest")
"""Checks of what comes of callbacks in the end."""


def explain_by_waiting_callback(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the callback that sleeps or never ends: until it returns, its script receives nothing."""
    of_callbacks = check.of_callbacks or check.name in (*OF_RESULTS, "action-result")
    files = files_that_run(package, run) if of_callbacks and not verdict.basis.cause else ()
    waits = (s for s in package.slips if (s.kind == "callback-waits" or s.is_lock) and s.file in files)
    slip = next((s for s in waits if check.name != "action-result" or s.is_lock), None)
    # What should come before any callback does not wait for one.
    if slip is None or verdict.basis.callbacks == "before":
        return verdict
    if slip.is_endless and verdict.basis.dropped and verdict.status is Status.INCONCLUSIVE:
        # the flood is the loop's own, and keeps the machine busy: neither excuses it
        lost = verdict.basis.excused or verdict.message
        verdict = verdict.model_copy(update={"status": Status.FAIL, "message": lost})
    if not verdict.status.is_lost or not (slip.is_endless or verdict.basis.callbacks == "late"):
        return verdict
    ends = "the caller waits" if check.name == "service-answers" else "nothing else is heard"
    hint = f"in {slip.file}, {slip.fix}" + (
        f": {ends} until the callback ends" if slip.name and not slip.is_lock else ""
    )
    return verdict.explained(f"in {slip.file}, {slip.message}", hint, (slip.place,), cause=slip.message)


def filled(slip: PythonSlip) -> str:
    """Return the text that a line prints; a place that the script fills in may hold any number."""
    return re.sub(r"\{\w*\}", "0", slip.message)


def line_that_prints(package: PackageFacts, run: Run, could_be: Callable[[str], bool]) -> PythonSlip | None:
    """Return the line of a script that runs which prints such a text, if it is reached."""
    return next((s for s in run_slips(package, run, "prints") if could_be(filled(s))), None)


def of_no_node(verdict: Verdict, package: PackageFacts, scripts: Collection[str | None]) -> Verdict:
    """Return the verdict; where one of the scripts makes no node, so that what it logs is shown nowhere, with that."""
    found = (s for s in package.slips if s.kind == "no-init" and s.file in scripts)
    if (slip := next(found, None)) is None:
        return verdict
    why = f"{slip.message}, without which nothing that is logged is shown"
    hint = f"in {slip.file}, write `rospy.init_node('{PurePosixPath(slip.file).stem}')` below the imports"
    return verdict.explained(why, hint, (slip.place,))


def not_reached(verdict: Verdict, slip: PythonSlip, package: PackageFacts) -> Verdict:
    """Return a loss with the line that prints what is missing, and was never reached; or that logs it in no node."""
    unlogged = of_no_node(verdict, package, [slip.file]) if slip.name in ("loginfo", "logdebug") else verdict
    if unlogged is not verdict:
        return unlogged.about(citations=(slip.place, *verdict.citations))
    why = f"line {slip.line} of {slip.file} does, and is never reached"
    hint = f"see what keeps line {slip.line} from being reached: print what the condition above it compares"
    return verdict.explained(why, hint, (slip.place,))


def unprinted_result(
    package: PackageFacts, one: Life, never: str, words: str, found_in: Callable[[Line], Iterable[object]]
) -> Verdict | None:
    """Return the loss where a function of the script returns the words, or the number in them, and nothing prints what
    it returns; `never` begins the message."""
    script = one.start.script or ""
    own = [s for s in package.slips if (s.kind, s.file) == ("drops-result", script)]
    texts = [s for s in own if any(found_in(Line(0, filled(s))))]
    numbers = [s for s in own if s.message == "{}" and re.search(r"\d|<number>", words)]
    slip = next(iter(texts or numbers), None)
    if slip is None:
        return None
    call = f"`{slip.name}(…)` on line {slip.line}"
    why = f"line {slip.fix} of {slip.file} returns {'it' if texts else 'the number'}"
    hint = f"print what {call} returns" if texts else f"print {words} above line {slip.fix}"
    message = f"{never}: {why}, and nothing keeps what {call} returns"
    return failed(message, hint=hint, citations=(slip.place,))


def unreached_except(
    package: PackageFacts,
    one: Life,
    never: str,
    found_in: Callable[[Line], Iterable[object]],
    lost: Callable[..., Verdict],
) -> Verdict | None:
    """Return the loss where an `except` prints the words, and what is above it raised nothing; `lost` makes it."""
    # what a script still waits for may yet be caught
    own = [s for s in package.slips if s.file == one.start.script and one.ended_early]
    said = [s for s in own if s.kind == "prints" and any(found_in(Line(0, filled(s))))]
    caught = {s.line + 1: s for s in own if s.kind == "catches"}
    if len(said) != 1 or said[0].line not in caught:
        return None
    slip, lines = said[0], caught[said[0].line].name.replace("-", " to ")
    message = (
        f"{never}: line {slip.line} of {slip.file} would, and lines {lines} raise nothing that it catches"
    )
    hint = "look at what is called there: where the handout asks for a failure, a service's callback has to raise one"
    return lost(message, hint=hint, citations=(slip.place,)).if_repeated()
