"""Why a listener did not print what was sent to it."""

from __future__ import annotations

from collections.abc import Sequence

from grader.checks.support.exit_cause import explain_end, explain_traceback, process_tracebacks
from grader.checks.support.printed import Line, Probe, numbers_in
from grader.checks.support.process import early_end, lives
from grader.checks.support.text import near_names, shown
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, unjudged
from grader.wording import join_words, plural, significant

HAND_IN = "add the script to the package, and push it"
CALLBACK_HINT = (
    "print data.data in the callback, without a condition and nothing slow beside it; end with rospy.spin()"
)


def never_sent(package: PackageFacts, run: Run, topic: str) -> Verdict:
    """The grader sends when the node has subscribed; it never did, or it was not there."""
    if not lives(run):
        return unjudged(
            "the listener was not started: there is no script to run", measured="not started", hint=HAND_IN
        )
    ended = early_end(run)
    if ended is not None:
        end = explain_end(ended, run, package)
        message = f"the node ended before it subscribed to {topic}: {end.cause}"
        return unjudged(message, hint=end.hint, citations=end.citations, measured="ended")
    subscribed = student_subscriptions(run)
    cite = (EvidenceCitation(evidence=run.evidence, topic="/grader/graph"),)
    measured = f"subscribed to {join_words(subscribed)}" if subscribed else "no subscription"
    if differs := _types_differ(run, topic):
        return differs.model_copy(update={"measured": measured, "citations": cite})
    if topic in subscribed:
        message = f"the node subscribed to {topic}, but the grader sent nothing"
        return inconclusive(message, hint="grade again", measured=measured, citations=cite)
    near = near_names(topic, subscribed)
    other = f"; it subscribes to {join_words(near or subscribed)}" if subscribed else ""
    hint = f"add rospy.Subscriber('{topic}', …, callback)"
    return failed(
        f"the node never subscribes to {topic}{other}", hint=hint, measured=measured, citations=cite
    )


def student_subscriptions(run: Run) -> tuple[str, ...]:
    """Topics that a node of the student's ever subscribed to."""
    found = (
        topic
        for _, event in run.graph
        for topic, nodes in event.subscribers.items()
        if any(run.is_student_node(n) for n in nodes)
    )
    return tuple(dict.fromkeys(found))


def not_printed(
    package: PackageFacts, run: Run, probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line]
) -> Verdict:
    """Some or all of what was sent was not printed: the likeliest reason that shows."""
    return (
        _broken(package, run)
        or _some_numbers(probes, missing, lines)
        or _only_again(probes, missing)
        or _by_number(probes, missing, lines)
    )


def _broken(package: PackageFacts, run: Run) -> Verdict | None:
    """An error in the callback, which rospy reports and outlives, or the node's end."""
    found = [t for one in lives(run) for t in process_tracebacks(run, one.name, before_ns=one.interrupt_ns)]
    ended = early_end(run)
    if ended is not None:
        end = explain_end(ended, run, package)
        message = f"the node ended before it had printed everything: {end.cause}"
    elif found:
        end = explain_traceback(found[-1], package)
        message = f"an error stops the node from printing: {end.cause}"
    else:
        return None
    return failed(message, hint=end.hint, citations=end.citations)


def _types_differ(run: Run, topic: str) -> Verdict | None:
    """The grader's publisher had to refuse the node, which asked for another type."""
    asked = next((e for _, e in run.actors if e.action == "note" and e.topic == topic and e.type), None)
    if asked is None:
        return None
    message = f"{asked.actor} subscribes to {topic} with {asked.type}, so that nothing arrives"
    return failed(message, hint=f"give rospy.Subscriber('{topic}', …) the type that the publisher uses")


def _some_numbers(probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line]) -> Verdict | None:
    """Typical ways to lose zero, or all negative numbers, and print the others."""
    values = [p.value for p in missing if isinstance(p.value, int)]
    if not values or len(values) == len(probes):
        return None
    if set(values) == {0}:
        return failed("0 is not printed", hint="0 counts as false: print without `if data.data:`")
    if any(v >= 0 for v in values):
        return None
    printed = {n for line in lines for n in numbers_in(line.text)}
    as_unsigned = all(v + 256 in printed for v in values)
    shape = f"as {values[0] + 256} and the like" if as_unsigned else "not at all"
    message = f"negative numbers are printed {shape}, {values[0]} for instance"
    return failed(message, hint="print data.data as it is: an Int8 goes from -128 to 127")


def _only_again(probes: Sequence[Probe], missing: Sequence[Probe]) -> Verdict | None:
    """All that is missing is what came a second time."""
    printed = {str(p.value) for p in probes if p not in missing}
    if not all(str(p.value) in printed for p in missing):
        return None
    message = f"{missing[0].value!r} came twice, and is printed once only"
    return failed(
        message, hint="print in the callback each time, also where the message is one that came before"
    )


def _by_number(probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line]) -> Verdict:
    """Nothing, only the first, or some."""
    after = [line.text for line in lines if line.at_ns >= probes[0].at_ns and line.text.strip()]
    if len(missing) == len(probes):
        seen = f"it prints {shown(after[0]).strip(' :')!r}" if after else "it prints nothing at all"
        sent = f"; {probes[0].value!r} was sent first" if isinstance(probes[0].value, str) else ""
        return failed(f"nothing of what was sent is printed{sent}; {seen}", hint=CALLBACK_HINT)
    if len(missing) == len(probes) - 1 and missing[0] is not probes[0]:
        hint = "subscribe with a callback and rospy.spin(); wait_for_message(…) waits for one message only"
        return failed("only the first message is printed", hint=hint)
    value = missing[0].value
    first = significant(value) if isinstance(value, int) else repr(value)
    message = f"{len(missing)} of {plural(len(probes), 'message')} not printed, the first of them {first}"
    return failed(message, hint=CALLBACK_HINT)
