"""Whether two copies of a node can live at once."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import ProcessName, check
from grader.checks.support.console_output import LOOKED_AT, both_from_ns, heard_of, printed_times, sent_by
from grader.checks.support.exit_causes import explain_end
from grader.checks.support.processes import (
    NO_SCRIPT_HINT,
    GlobalName,
    Life,
    are_noted,
    life,
    lives,
    named_at,
    nodes_of,
)
from grader.checks.support.text import (
    GET_TIME,
    IN_OWN_WORDS,
    INIT,
    LOOP,
    SPIN,
    VALUE,
    in_words,
    init,
    refuse_others,
)
from grader.checks.support.topics import cite
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    machine_lacks,
    partial,
    passed,
)
from grader.wording import join_words, plural, seconds

SAME_NAME = "new node registered with same name"
FEW, ENOUGH_NS = 2, 4_000_000_000
"""Messages of a copy, and how long both are watched at least before too few of them are the copy's own."""


class CopiesParams(Record):
    """Two processes of one script, and the one that hears both."""

    first: ProcessName
    """The process that is started first."""
    second: ProcessName
    """The process of the same script that is started after it."""
    listener: ProcessName
    """The process that has to print the messages of both."""
    topic: GlobalName
    """The topic, with its slash: `/chatter`."""
    template: Annotated[str, refuse_others(VALUE)] = VALUE
    """What the listener has to print for each message; `{value}` stands for the message's text."""
    taken_over_score: Annotated[float, Field(ge=0, le=1)] = 0.3333
    """The share that is earned if the second copy takes the name over and the first is shut down."""

    @model_validator(mode="after")
    def _are_two(self) -> CopiesParams:
        if self.first == self.second:
            raise ValueError("second: is the first, too: name the other process of the script")
        if self.listener in {self.first, self.second}:
            raise ValueError("listener: is one of the two, too: name the process that prints what both send")
        return self


class Trio(NamedTuple):
    """The three processes, and the nodes of the two copies."""

    first: Life
    second: Life
    listener: Life
    first_nodes: tuple[str, ...]
    second_nodes: tuple[str, ...]

    def watched_ns(self, run: Run) -> int:
        """How long both copies ran before Ctrl-C."""
        return min(one.until_ns(run) for one in self[:2]) - self.second.start_ns


@check("copies", params=CopiesParams)
def copies(package: PackageFacts, run: Run, params: CopiesParams) -> Verdict:
    """Two copies of the node run at the same time, and the listener hears both.

    What it checks
        That a second copy of the script can be started beside the first: both keep running, under two names, and
        the listener prints messages of both.

    Why it matters on a robot
        A robot often has two of a kind, wheels or cameras, run by the same program. ROS allows each name
        once: if a second node has the same name, the first one is shut down.

    How it is measured
        The grader starts the script twice, beside the listener. The names come from the master, and the
        messages are told apart by their texts. If the second copy takes the name over and the first is shut
        down, part of the points is earned.

    How to fix
        `rospy.init_node('<name>', anonymous=True)` adds a number of its own to each copy's name. `rosnode
        list` shows both.
    """
    expected = f"two copies running under two names, and {params.listener} printing messages of both"
    trio = _trio(package, run, params)
    if isinstance(trio, Verdict):
        return trio.about(expected=expected)
    verdict = (
        _taken_over(package, run, trio, params)
        or _not_both_alive(package, run, trio)
        or _judge_unknown_nodes(run, trio)
        or _judge_heard(package, run, trio, params)
    )
    names = dict.fromkeys((*trio.first_nodes, *trio.second_nodes))
    graph = cite(run, "/grader/graph")
    measured = verdict.measured or f"names of the copies: {join_words(names) or 'none'}"
    return verdict.about(expected=expected, measured=measured, citations=verdict.citations or (graph,))


def _trio(package: PackageFacts, run: Run, params: CopiesParams) -> Trio | Verdict:
    first, second, listener = (life(run, name) for name in (params.first, params.second, params.listener))
    if first is None or second is None:
        started = join_words(one.name for one in lives(run)) or "nothing"
        return _not_started(package, run, params).about(measured=f"started: {started}")
    if listener is None:
        message = f"{params.listener} was not started, so it cannot be told whose messages arrive"
        return failed_or_blocked(
            message, measured="no listener", hint="add the listener's script, and push it"
        )
    return Trio(first, second, listener, run.student_nodes(first.name), run.student_nodes(second.name))


def _not_started(package: PackageFacts, run: Run, params: CopiesParams) -> Verdict:
    """A process may have to wait for another one's node: then that one is the cause."""
    waited_for = [one for one in lives(run) if one.name in {params.first, params.second, params.listener}]
    for one in waited_for:
        if one.ended_early:
            end = explain_end(one, run, package)
            return end.verdict(
                failed_or_blocked, f"{one.name} ended before the copies were started: {end.cause}"
            )
        if not nodes_of(run, one.name):
            message = f"{one.name} never registers as a node, so what waits for it was not started"
            return failed_or_blocked(message, hint=f"call {INIT} before anything that waits").if_repeated()
    if any(one.name in {params.first, params.second} for one in waited_for):
        return grade_again("only one copy was started")
    return failed_or_blocked("no copy was started: there is no script to run", hint=NO_SCRIPT_HINT)


def _taken_over(package: PackageFacts, run: Run, trio: Trio, params: CopiesParams) -> Verdict | None:
    """One name for both: the master has the copy that had it first shut down."""
    shared = [n for n in trio.first_nodes if n in trio.second_nodes]
    told = [one for one in trio[:2] if any(SAME_NAME in c.line for _, c in run.lines(one.name))]
    if not (shared or told) or (trio.second.ended_early and len(told) < len(trio[:2])):
        return None
    name = shared[0] if shared else next(iter((*trio.second_nodes, *trio.first_nodes)), "its name")
    down = "the first copy is shut down" if trio.first.ended_early else "the first copy is told to shut down"
    if trio.second.ended_early:
        down = "the first takes it back, and both are shut down"
    message = f"both copies are called {name}, and ROS allows each name once: {down}"
    base = name.strip("/")
    hint = f"write {init(base, anonymous=True)}, so that each copy has its own name"
    measured = f"one name for two copies: {name}"
    lines, graph = named_at(package, run, "node-name", base), cite(run, "/grader/graph")
    return partial(params.taken_over_score, message, hint=hint, measured=measured, citations=(*lines, graph))


def _not_both_alive(package: PackageFacts, run: Run, trio: Trio) -> Verdict | None:
    """Ended for another reason: both, as the script does alone too, or one of them only."""
    gone = [(word, one) for word, one in zip(("first", "second"), trio[:2], strict=True) if one.ended_early]
    if not gone:
        return None
    word, one = gone[-1]
    end = explain_end(one, run, package)
    cited = end.citations or (cite(run, "/grader/process", one.start_ns, one.end_ns),)
    if len(gone) > 1:
        message = f"both copies ended by themselves: {end.cause}"
        return (machine_lacks if end.of_machine else failed_or_blocked)(
            message, hint=end.hint, citations=cited
        )
    message = f"the {word} copy ended by itself after {one.lasted}, while the other kept running: {end.cause}"
    if word == "second":
        hint = (
            end.hint
            if end.citations
            else "it runs when alone: remove whatever ends it when another copy is running"
        )
        return failed(message, hint=hint, citations=cited)
    return failed_or_blocked(message, hint=end.hint, citations=cited)  # the first would have ended alone too


def _judge_unknown_nodes(run: Run, trio: Trio) -> Verdict | None:
    if trio.first_nodes and trio.second_nodes:
        return None
    if run.student_nodes() and not are_noted(run):
        return grade_again("the recording does not say which node belongs to which copy")
    which = "second" if trio.first_nodes else "first" if trio.second_nodes else ""
    if not which:
        message = "neither copy registers as a node"
        return failed_or_blocked(message, hint=f"call {INIT} before anything that waits").if_repeated()
    message = f"the {which} copy never registers as a node beside the other"
    return failed(message, hint=f"call {init('…', anonymous=True)} before anything that waits")


def _listener_gone(package: PackageFacts, run: Run, trio: Trio) -> Verdict | None:
    if not trio.listener.ended_early:
        return None
    end = explain_end(trio.listener, run, package)
    message = f"both copies run, but {trio.listener.name} ended before it could hear both: {end.cause}"
    return end.verdict(failed_or_blocked, message)


def _judge_heard(package: PackageFacts, run: Run, trio: Trio, params: CopiesParams) -> Verdict:
    """Messages of both that came while both were sending, by what the listener printed."""
    copies = (trio.first_nodes, trio.second_nodes)
    from_ns = both_from_ns(run, params.topic, *copies)
    if from_ns is None:
        silent = next(nodes for nodes in copies if not sent_by(run, params.topic, nodes))
        message = f"both copies run, but {join_words(silent)} sends no text on {params.topic}"
        return failed_or_blocked(
            message, hint=f"publish on {params.topic} in the loop, as a single copy does"
        )
    first, second = (sent_by(run, params.topic, nodes, from_ns) for nodes in copies)
    if first.total() + second.total() > LOOKED_AT:  # the listener lags behind a flood
        first, second = (sent_by(run, params.topic, nodes) for nodes in copies)
    texts = {**first, **second}
    said, known = (printed_times(run, trio.listener.name, texts, form) for form in (params.template, VALUE))
    return (
        _judge_both(first, second, said, trio, params)
        or _listener_gone(package, run, trio)
        or (_judge_both(first, second, known, trio, params) and _other_words(params))
        or _unheard(run, (first, second), known, trio, params)
    )


def _other_words(params: CopiesParams) -> Verdict:
    wanted = in_words(params.template)
    message = f"{params.listener} prints what both copies send, but not as '{wanted}'"
    return failed_or_blocked(message, hint=f"print '{wanted}', {IN_OWN_WORDS}")


def _judge_both(
    first: Counter[str], second: Counter[str], printed: Counter[str], trio: Trio, params: CopiesParams
) -> Verdict | None:
    counts = heard_of(first, second, printed), heard_of(second, first, printed)
    if not all(counts):
        return None
    names = f"{trio.first_nodes[0]} and {trio.second_nodes[0]}"
    heard = f"{counts[0]} of {plural(first.total(), 'message')} and {counts[1]} of {second.total()}"
    if first.total() + second.total() > LOOKED_AT:
        heard = f"at least {heard}"
    message = f"{names} run at the same time, and {params.listener} prints messages of both"
    return passed(message, measured=f"{names}; printed: {heard}")


def _unheard(
    run: Run,
    sent: tuple[Counter[str], Counter[str]],
    printed: Counter[str],
    trio: Trio,
    params: CopiesParams,
) -> Verdict:
    """The listener hears one copy, or none at all: then the listener's own criterion says why."""
    (first, second), names = sent, (trio.first_nodes[0], trio.second_nodes[0])
    fewest = min(first.total(), second.total())
    if fewest < FEW and trio.watched_ns(run) >= ENOUGH_NS:
        message = (
            f"both copies run, but one sends {plural(fewest, 'message')} in {seconds(trio.watched_ns(run))}"
        )
        return failed_or_blocked(
            message, hint=f"publish on {params.topic} in the loop `{LOOP}`, again and again"
        )
    if fewest < FEW:
        return grade_again("the two copies were watched too briefly to see their messages printed")
    if not printed:
        message = f"both copies run, but {params.listener} prints nothing of what they send"
        return failed_or_blocked(message, hint="first make the listener print what it hears")
    counts = heard_of(first, second, printed), heard_of(second, first, printed)
    if not any(counts):
        message = f"{names[0]} and {names[1]} send the same texts, and not all of them are printed twice"
        return failed_or_blocked(message, hint=f"put the time into each message: {GET_TIME}")
    lost = names[0] if counts[1] else names[1]
    message = f"{names[0]} and {names[1]} run together, but {params.listener} prints nothing of {lost}"
    hint = f"subscribe with a callback and {SPIN}; a subscriber hears every publisher of its topic"
    return failed_or_blocked(message, hint=hint)
