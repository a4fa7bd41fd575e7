"""Whether a script is a node that lives and ends well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from grader.checks.registry import NodeName, ProcessName, Refers, check
from grader.checks.support.exit_causes import (
    explain_end,
    explain_traceback,
    is_rospys_own,
    process_tracebacks,
)
from grader.checks.support.processes import (
    NO_SCRIPT_HINT,
    Anonymous,
    Life,
    are_noted,
    base_name,
    fell_silent,
    is_flood,
    is_named,
    is_other_name,
    life,
    lives,
    name_hint,
    nodes_of,
    not_started,
    slips_that_name,
    wanted_names,
    was_talking,
    wrong_name,
)
from grader.checks.support.scripts import slips_of_program
from grader.checks.support.text import ANONYMOUS, INIT, LOOP, python_or_cpp
from grader.checks.support.topics import cite, run_slip
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import join_words, on_lines, plural, seconds

IN_A_LOOP = f"loop with `{LOOP}`" + python_or_cpp(" and catch rospy.ROSInterruptException around it", "")


class NodeLivesParams(Record):
    """The process, and how long it has to live."""

    process: ProcessName
    """The scenario's name for the process."""
    min_s: Annotated[float, Refers("watched_s")] = 5.0
    """How long it has to live after its first message."""
    names: tuple[NodeName, ...] = ()
    """The names that the node may have, as `node-name` judges them; empty: any name will do."""
    anonymous: Anonymous = "allowed"
    """Whether the node may, must or must not be anonymous."""


class NodeNameParams(Record):
    """The names that the node may have."""

    names: Annotated[tuple[NodeName, ...], Field(min_length=1)]
    """Names without the slash; an anonymous node ends in `_<digits>_<digits>`, as rospy makes it."""
    anonymous: Anonymous = "allowed"
    """Whether the node may, must or must not be anonymous."""
    process: ProcessName = ""
    """Only this process's nodes count; empty: each of the student's."""


@check("node-lives", params=NodeLivesParams, of_lives=True)
def node_lives(package: PackageFacts, run: Run, params: NodeLivesParams) -> Verdict:
    """The script is one node, stays alive and ends on Ctrl-C.

    What it checks
        That the running script registers with the master as one node, lives as long as it is watched, and
        ends without a traceback when Ctrl-C is pressed. If the lab asks for a name, that the node has it.

    Why it matters on a robot
        When a node dies, its part of the robot stops working, and a node that does not end on Ctrl-C keeps
        driving the motors while you try to stop it.

    How it is measured
        By what the master lists, by the process's life until 5 s and more after its first message, and by
        its exit after SIGINT. Any exit code is fine. Three things at the end cost nothing: the traceback
        `publish() to a closed topic` or `topic was closed during publish()`, which is a race in rospy
        itself; rospy hanging in a flood of messages; and, in a run with a fast clock, a
        `ROSInterruptException`.

    How to fix
        Call `rospy.init_node(…)` once. Loop with `while not rospy.is_shutdown():`, sleep with `rospy.Rate`,
        and catch `rospy.ROSInterruptException` around the call of your main function.
    """
    named = f", named {wanted_names(params.names, params.anonymous)}" if params.names else ""
    expected = f"one node{named}, alive until Ctrl-C, and ending on it"
    one = life(run, params.process)
    if one is None:
        return not_started(params.process).about(expected=expected)
    nodes = nodes_of(run, one.name)
    up_ns = _up_ns(one, run, nodes)
    message = f"{_script(one)} is the node {join_words(nodes)}, stayed alive and ended on Ctrl-C"
    # An early end explains what follows: a node that is not registered, or was watched too briefly.
    verdict = (
        _early_end(one, run, package)
        or _registration(one, run, nodes)
        or _judge_misnamed(package, run, nodes, params)
        or _short_watch(one, up_ns, params)
        or _bad_end(one, run, package)
        or passed(message)
    )
    measured = f"{plural(len(nodes), 'node')} ({join_words(nodes) or 'none'}), alive for {seconds(up_ns)}"
    citations = verdict.citations or (cite(run, "/grader/process", one.start_ns, one.end_ns),)
    return verdict.about(expected=expected, measured=measured, citations=citations)


@check("node-name", params=NodeNameParams, of_lives=True)
def node_name(package: PackageFacts, run: Run, params: NodeNameParams) -> Verdict:
    """The node has the name of the handout.

    What it checks
        That the node registers under the expected name, plain or anonymous as the lab asks.

    Why it matters on a robot
        Other people's launch files, remappings and `rosnode info` all use the node's name, and a second
        node with the same name shuts down the first.

    How it is measured
        By the names that the master lists. Anonymous means the base name with `_<digits>_<digits>` after
        it, as rospy's `anonymous=True` makes it.

    How to fix
        Give `rospy.init_node('<name>')` the name, with or without `anonymous=True` as the lab asks.
        `rosnode list` shows it.
    """
    nodes = nodes_of(run, params.process)
    expected = wanted_names(params.names, params.anonymous)
    if not nodes:
        return _nameless(package, run, params).about(expected=expected)
    cited = (cite(run, "/grader/graph"),)
    measured = join_words(nodes)
    wrong = _judge_misnamed(package, run, nodes, params)
    verdict = wrong or passed(f"the node is {_fitting(nodes, params)[0]}")
    return verdict.about(expected=expected, measured=measured, citations=cited)


def _nameless(package: PackageFacts, run: Run, params: NodeNameParams) -> Verdict:
    """No node was registered: why, where its process ended by itself."""
    message, hint = "no node was registered, so there is no name", f"call {INIT}"
    one = life(run, params.process)
    if one is None and not run.foreign and not lives(run):
        why = "no node was registered: there is no script to run"
        return failed_or_blocked(why, measured="no node", hint=NO_SCRIPT_HINT)
    if one is None or not one.ended_early:
        slip = run_slip(package, run, "never-reached")
        if slip is not None and "init_node" in slip.message:
            message, hint = f"no node was registered: {slip.message}", slip.fix
        return failed_or_blocked(message, measured="no node", hint=hint)
    end = explain_end(one, run, package)
    message = f"{_script(one)} ended by itself after {one.lasted}, before it was a node: {end.cause}"
    return end.verdict(failed_or_blocked, message, measured="no node")


def _fitting(nodes: tuple[str, ...], params: NodeNameParams | NodeLivesParams) -> list[str]:
    return [n for n in nodes if is_named(n, params.names, params.anonymous)]


def _judge_misnamed(
    package: PackageFacts, run: Run, nodes: tuple[str, ...], params: NodeNameParams | NodeLivesParams
) -> Verdict | None:
    """Return None where a name fits, or none is asked for."""
    if not params.names or _fitting(nodes, params):
        return None
    given = params.names, nodes, params.anonymous
    slips = slips_that_name(package, run, "node-name", base_name(nodes[0])) if nodes else []
    cited = tuple(dict.fromkeys(one.place for one in slips))
    # With calls in several scripts, it is not known which one named the node.
    if len({one.file for one in cited}) > 1:
        cited = ()
    hint = name_hint(*given)
    if any(one.fix for one in slips):  # the name stands in a variable, or is passed on
        elsewhere = is_other_name(*given[:2])
        hint, cited = (_rename_hint(slips[0], nodes, params), cited) if elsewhere else (hint, ())
    if len(cited) > 1:
        lines = on_lines(one.line or 0 for one in cited)
        hint = f"{hint}, on {lines} alike: a second call with other arguments ends the node"
    return failed(wrong_name(*given), hint=hint, citations=cited)


def _rename_hint(slip: PythonSlip, nodes: tuple[str, ...], params: NodeNameParams | NodeLivesParams) -> str:
    """Return how to give the node another name where `init_node` gets it from elsewhere."""
    name = params.names[0].lstrip("/")
    hint = f"on line {slip.line} of {slip.file}, write `{slip.fix.format(repr(name))}`"
    numbered = any(base_name(node) != node for node in nodes)
    if params.anonymous == "required" and not numbered:
        return f"{hint}; then add {ANONYMOUS} to `init_node(…)`"
    spare = params.anonymous == "forbidden" and numbered
    return f"{hint}; then remove {ANONYMOUS} from `init_node(…)`" if spare else hint


def _up_ns(one: Life, run: Run, nodes: tuple[str, ...]) -> int:
    """Return how long it lived freely after its first message, or after its start where it published none."""
    # Every node publishes on `/rosout`, before it does anything of its own.
    channels = (c for c in run.student_channels() if c.topic != "/rosout" and c.callerid in nodes)
    first = min((c.times_ns[0] for c in channels if c.messages), default=one.start_ns)
    return max(0, one.until_ns(run) - first)


def _early_end(one: Life, run: Run, package: PackageFacts) -> Verdict | None:
    if not one.ended_early:
        return None
    end = explain_end(one, run, package)
    return end.verdict(failed, f"{_script(one)} ended by itself after {one.lasted}: {end.cause}")


def _registration(one: Life, run: Run, nodes: tuple[str, ...]) -> Verdict | None:
    if not nodes:
        hint = f"call {INIT} before anything that waits"
        return failed_or_blocked(
            f"{_script(one)} runs, but never registers as a node", hint=hint
        ).if_repeated()
    # Another tool's recording does not say whose a node is: there, as many nodes as processes are right.
    if len(nodes) > (1 if are_noted(run) else max(1, len(lives(run)))):
        hint = f"one script is one node: call {INIT} once, and start no other process"
        return failed(f"{_script(one)} registers as {len(nodes)} nodes: {join_words(nodes)}", hint=hint)
    return None


def _short_watch(one: Life, up_ns: int, params: NodeLivesParams) -> Verdict | None:
    if one.end is not None and up_ns >= params.min_s * 1e9:
        return None
    return grade_again(f"{_script(one)} was watched for {seconds(up_ns)} only, or its end was not recorded")


def _bad_end(one: Life, run: Run, package: PackageFacts) -> Verdict | None:
    stopped_by = one.end.stopped_by if one.end else None
    if stopped_by in {"TERM", "KILL"}:
        on_a_goal = _on_a_goal(one, run)
        message = f"{_script(one)} did not end on Ctrl-C and had to be stopped with SIG{stopped_by}"
        # A line that is known to keep the node alive goes before any excuse.
        in_cpp = slips_of_program(one.start.argv, package, "deaf")
        kinds = {"deaf", "deaf-loop", "stuck"}
        own = [s for s in package.slips if s.kind in kinds and s.file == one.start.script] + in_cpp
        if (deaf := [s for s in own if s.fix]) and on_a_goal is None:
            why, told = _deaf_loops(deaf)
            hint = "; ".join(dict.fromkeys(s.fix for s in told))
            return failed(f"{message}: {why}", hint=hint, citations=tuple(s.place for s in told))
        if on_a_goal is None and (slow := max(in_cpp, key=lambda s: float(s.name), default=None)):
            slept = f"{slow.message}, also after Ctrl-C, so its end is not counted"
            return passed(f"{_script(one)} is one node and stayed alive; {slept}")
        if excuse := on_a_goal or _locked_up(one, run) or _asleep(one, package) or _asking(one, run, package):
            return excuse
        hint = IN_A_LOOP + python_or_cpp("; a bare `except:` in the loop swallows the Ctrl-C", "")
        return failed(message, hint=hint).if_repeated()  # no line of the script is known to be why
    found = process_tracebacks(run, one.name, after_ns=one.interrupt_ns)
    # By the computer's clock, which students have, no sleep of rospy's raises on Ctrl-C.
    sleeps = [f for f in found if run.warp != 1 and f.kind == "ROSInterruptException"]
    of_script = [f for f in found if f not in sleeps and not is_rospys_own(f)]
    if not of_script:
        return None
    end = explain_traceback(of_script[-1], package)
    message = f"{_script(one)} ends on Ctrl-C with a traceback: {end.cause}"
    late = [s for s in package.slips if s.kind == "read-late" for c in end.citations if _is_within(c, s)]
    message, hint = (
        (f"{message}; {late[0].message}", late[0].fix) if late else (message, end.hint or IN_A_LOOP)
    )
    return failed(message, hint=hint, citations=end.citations)


def _deaf_loops(slips: Sequence[PythonSlip]) -> tuple[str, Sequence[PythonSlip]]:
    """Return why a script goes on after Ctrl-C, and what of it is told: any of its loops that never ask may be why."""
    loops = [s for s in slips[:LOOPS_TOLD] if s.kind == "deaf-loop" and s.file == slips[0].file]
    if slips[0] not in loops or len(loops) == 1:
        return slips[0].message, slips[:1]
    return f"the loops on {on_lines(s.line for s in loops)} never check whether the node should end", loops


def _is_within(place: FileCitation, slip: PythonSlip) -> bool:
    return place.file == slip.file and slip.line <= (place.line or 0) <= int(slip.name)


LOOPS_TOLD = 3
LONG_TURN_S = 4.0
LONG_SLEEP_HZ = 0.5
"""A loop of a lower rate can sleep for as long as Ctrl-C is waited for."""


def _asleep(one: Life, package: PackageFacts) -> Verdict | None:
    """Return that the node slept on after Ctrl-C, where its loop sleeps for long: its rate is judged elsewhere."""
    rates = [s for s in package.slips if s.kind == "rate-number" and s.file == one.start.script]
    slow = min(rates, key=lambda s: float(s.message), default=None)
    pauses = [s for s in rates if s.name.endswith("sleep")]
    turn_s = sum(1 / float(s.message) for s in pauses)
    if slow is not None and float(slow.message) < LONG_SLEEP_HZ:
        who, pause = f"line {slow.line} lets", seconds(round(1e9 / float(slow.message)))
    elif turn_s >= LONG_TURN_S:  # by the computer's clock, none of them ends sooner
        who, pause = f"{on_lines(sorted(s.line for s in pauses))} let", seconds(round(turn_s * 1e9))
    elif swapped := [s for s in package.slips if s.kind == "rate-as-time" and s.file == one.start.script]:
        who, pause = f"line {swapped[0].line} lets", "too long"
    else:
        return None
    slept = f"{who} it sleep for {pause} at a time, also after Ctrl-C, so its end is not counted"
    return passed(f"{_script(one)} is one node and stayed alive; {slept}")


def _asking(one: Life, run: Run, package: PackageFacts) -> Verdict | None:
    """Return that the node waited for a line, where the rubric types what it asks for: rospy takes the Ctrl-C, and
    `input()` waits on until a line comes."""
    asking = [s for s in package.slips if s.kind == "input" and s.file == one.start.script]
    asks = next((s for s in asking if s.name != "once"), asking[-1] if asking else None)
    typed = sum(e.action == "type" and e.detail == one.name for _, e in run.actors)
    if asks is None or not typed or (asks.name == "once" and typed >= len(asking)):
        return None  # it asks for nothing, or has been told all
    waits = f"line {asks.line} waits for a line that is typed, also after Ctrl-C, so its end is not counted"
    return passed(f"{_script(one)} is one node and stayed alive; {waits}")


def _on_a_goal(one: Life, run: Run) -> Verdict | None:
    """Return that the node was at work on a goal that got no result, which is another criterion's: the callback of an
    action's server looks whether its goal was cancelled, and not whether the node is to end."""
    ends = {event.topic: event.value for _, event in run.actors if event.action == "result"}
    channels = [c for c in run.student_channels() if c.callerid in nodes_of(run, one.name)]
    served = {c.topic.rpartition("/")[0] for c in channels if c.topic.endswith(("/status", "/feedback"))}
    unended = sorted(
        action for action, value in ends.items() if action and action in served and value is None
    )
    if not unended:
        return None
    goes_on = f"it was still at work on a goal of {unended[0]}, so its end is not counted"
    return passed(f"{_script(one)} is one node and stayed alive; {goes_on}")


def _locked_up(one: Life, run: Run) -> Verdict | None:
    if not fell_silent(one, run):
        return None
    if is_flood(run):
        flood = "it floods its topics, which can lock up rospy itself on Ctrl-C"
        return passed(f"{_script(one)} is one node and stayed alive; {flood}, so its end is not counted")
    if was_talking(one, run):
        message = f"{_script(one)} stopped on Ctrl-C but did not end: rospy may have locked up by itself"
        return grade_again(message)
    return None


def _script(one: Life) -> str:
    return one.start.script or one.name
