"""Whether an action server takes goals, reports on them, ends them as it should, and lets them be cancelled."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import NEVER_LATE_S, excused, run_seconds, why_late
from grader.checks.support.exit_causes import Ending, explain_early_end, explain_error
from grader.checks.support.fields import differences, fields_text
from grader.checks.support.processes import GlobalName, ends_twice, plain_type, run_slips
from grader.checks.support.text import near_names, python_or_cpp, shown
from grader.checks.support.topics import cite, no_node, nodes_on, published_topics, run_slip, topics_with
from grader.evidence.events import ActorEvent
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import join_words, plural, significant, there_is

LISTED = 10
"""So many values of the feedback are listed."""
GOES_ON_NS = 1_000_000_000
"""Feedback so long after a goal was cancelled says that the server goes on with it, if the lab does not say."""
SURELY = 10
"""With so many of these messages, that is no matter of a busy machine."""
LONGER, LONGER_S = 1.5, 1.0
"""So many times `within_s`, and so much longer at least, a result is waited for: its loss says how late it comes."""
ENDS = {
    "SUCCEEDED": python_or_cpp("set_succeeded(result)", "setSucceeded(result)"),
    "ABORTED": python_or_cpp("set_aborted(result)", "setAborted(result)"),
    "PREEMPTED": python_or_cpp("set_preempted(result)", "setPreempted(result)"),
}
"""The methods of an action server that end a goal."""
ASKED_TO_STOP = python_or_cpp("is_preempt_requested()", "isPreemptRequested()")
HINTS = {
    "SUCCEEDED": f"at the end of the callback, call the action server's {ENDS['SUCCEEDED']}",
    "ABORTED": f"for such a goal, call the action server's {ENDS['ABORTED']}, and then return",
    "PREEMPTED": f"in the loop, where the action server's {ASKED_TO_STOP} is true: {ENDS['PREEMPTED']}, then return",
}


class ActionResultParams(Record):
    """Which of the scenario's goals, and how it has to end."""

    action: Annotated[GlobalName, Refers("action")]
    """The action's name, with its slash: `/count`."""
    goal: Annotated[int, Field(ge=1)] = 1
    """Which of the scenario's goals for it, counted from 1."""
    status: Literal["SUCCEEDED", "ABORTED", "PREEMPTED"] = "SUCCEEDED"
    """The state at its end; a goal that the scenario cancels ends `PREEMPTED`."""
    result: dict[str, Any] = Field(default_factory=dict)
    """The fields of the result that matter, and their values."""
    tolerance: Annotated[float, Field(ge=0)] = 1e-6
    """How far numbers of the result, and of `reports`, may be off."""
    feedback: Annotated[int, Field(ge=0)] = 0
    """The least number of feedback messages."""
    reports: dict[str, list[Any]] = Field(default_factory=dict)
    """Fields of the feedback, and the values that have to come in this order; others may come between them."""
    as_reported: dict[str, str] = Field(default_factory=dict)
    """Fields of the result that must have the value that a field of the last feedback has: `{total: count}`."""
    within_s: Annotated[float, Field(gt=0)] | None = None
    """How long after the goal, or after it was cancelled, the result may come; null: as long as the step waits."""

    @property
    def of_feedback_alone(self) -> bool:
        """Whether nothing is asked of the goal's end."""
        of_end = {"status", "result", "within_s", "as_reported"}
        return bool(self.feedback or self.reports) and not self.model_fields_set & of_end

    @property
    def matters_s(self) -> float | None:
        """How long after the goal, or its cancelling, the result still matters; None: as long as the step waits."""
        if self.of_feedback_alone:
            return 0.0
        return None if self.within_s is None else max(LONGER * self.within_s, self.within_s + LONGER_S)

    @property
    def least_feedback(self) -> int:
        """How many feedback messages it takes."""
        return max([self.feedback, *map(len, self.reports.values())])

    @property
    def words(self) -> str:
        reports = [f"{name} {join_words(map(str, values))}" for name, values in self.reports.items()]
        told = join_words(reports) and f"feedback with {join_words(reports)}"
        if self.of_feedback_alone:
            wanted = told or plural(self.feedback, "feedback message")
            return f"{wanted} on goal {self.goal} of {self.action}"
        with_result = f" with {fields_text(self.result)}" if self.result else ""
        for name, field in self.as_reported.items():
            with_result += f" with the {name} that the last feedback has as {field}"
        limit = f" within {significant(self.within_s)} s" if self.within_s else ""
        feedback = f", {plural(self.feedback, 'feedback message')} before" if self.feedback else ""
        return f"goal {self.goal} of {self.action} {self.status}{with_result}{limit}{feedback}"


class Goal(NamedTuple):
    """A goal of the grader's: when it was sent, cancelled and answered; `end` is None where the run ended before."""

    at_ns: int
    value: dict[str, Any]
    cancelled_ns: int | None
    ended_ns: int | None
    end: ActorEvent | None

    @property
    def name(self) -> str:
        return f"the goal {fields_text(self.value)}"


@check("action-result", params=ActionResultParams)
def action_result(package: PackageFacts, run: Run, params: ActionResultParams) -> Verdict:
    """The action server brings its goals to the right end.

    What it checks
        That a goal from the grader ends in the right state, with the right result, in time, with feedback
        on the way; and that a cancelled goal is given up.

    Why it matters on a robot
        A program that sends the robot somewhere has to know whether it arrived, and be able to stop it. A
        server that ignores a cancel request drives on.

    How it is measured
        The grader sends the goals one after the other once the server listens, and reads result and
        feedback like actionlib's own client. Only the result fields that the rubric names matter.

    How to fix
        `actionlib.SimpleActionServer(name, CountAction, execute_cb=…, auto_start=False)`, then `start()`. The callback
        publishes feedback, looks at `is_preempt_requested()` in its loop, and ends with `set_succeeded(…)`,
        `set_aborted(…)` or `set_preempted(…)`.
    """
    goals = _goals(run, params.action)
    goal = goals[params.goal - 1] if len(goals) >= params.goal else None
    verdict = (
        _not_sent(package, run, goals, params)
        if goal is None
        else _fault(package, run, goal, params) or _passed(run, goal, params)
    )
    span = (goal.at_ns, goal.ended_ns) if goal else (None, None)
    return verdict.about(
        expected=params.words,
        measured=verdict.measured
        or (_measured_text(run, goal, params) if goal else "no such goal could be sent"),
        citations=(cite(run, "/grader/actor", *span),),
    )


def _goals(run: Run, action: str) -> list[Goal]:
    """Return the grader's goals for one action; each is over before the next one is sent."""
    own = [(t, e) for t, e in run.actors if e.topic == action and e.action in {"goal", "cancel", "result"}]
    starts = [n for n, (_, event) in enumerate(own) if event.action == "goal"]
    found = []
    for start, end in zip(starts, [*starts[1:], len(own)], strict=False):
        at = {event.action: (time_ns, event) for time_ns, event in own[start:end]}
        cancelled_ns, (ended_ns, result) = at.get("cancel", (None,))[0], at.get("result", (None, None))
        found.append(Goal(own[start][0], own[start][1].value or {}, cancelled_ns, ended_ns, result))
    return found


def _fault(package: PackageFacts, run: Run, goal: Goal, params: ActionResultParams) -> Verdict | None:
    if goal.end is None:
        return grade_again(f"the run ended before {goal.name} of {params.action} did")
    if goal.end.value is None:
        return _no_result(package, run, goal, params)
    status, hint = goal.end.detail, HINTS[params.status]
    if params.of_feedback_alone and len(_feedback(run, goal, params)) >= params.feedback:
        return _other_reports(run, goal, params)  # how it ends is another criterion's
    if status != params.status:
        return _other_end(package, run, goal, params)
    found = list(differences(goal.end.value, params.result, params.tolerance))
    if found:
        message = f"{goal.name} of {params.action} ends {status} with {join_words(map(str, found))}"
        verdict = failed(message, hint=_how_to_fill(goal.end.value, params.result, hint))
        return _without_result(package, run, goal, params, verdict)
    return (
        _unlike_last_report(package, run, goal, params)
        or _too_late(package, run, goal, params)
        or _no_feedback(run, goal, params)
        or _other_reports(run, goal, params)
    )


def _without_result(
    package: PackageFacts, run: Run, goal: Goal, params: ActionResultParams, verdict: Verdict
) -> Verdict:
    """Return the loss with the line that ends the goal without a result, where it is an empty one."""
    call = f"set_{params.status.lower()}"
    slip = next((s for s in run_slips(package, run, "no-result") if s.name == call), None)
    if slip is None or goal.end is None or not _is_empty(goal.end.value):
        return verdict
    why = f"line {slip.line} of {slip.file} gives it no result"
    fix = slip.fix or f"write `{slip.message}(…)` with the result"
    return verdict.explained(why, f"on line {slip.line}, {fix}", (slip.place,))


def _unlike_last_report(
    package: PackageFacts, run: Run, goal: Goal, params: ActionResultParams
) -> Verdict | None:
    last, end = next(iter(_feedback(run, goal, params)[-1:]), {}), goal.end.value if goal.end else None
    for name, field in params.as_reported.items():
        wanted = {name: last[field]} if field in last else {}
        if end is not None and any(differences(end, wanted, params.tolerance)):
            ends = f"{goal.name} of {params.action} ends {params.status} with {name}: {end.get(name)}"
            hint = f"set {name} of the result before you call {ENDS[params.status]}"
            verdict = failed(f"{ends}, but the last feedback has {field}: {last[field]}", hint=hint)
            return _without_result(package, run, goal, params, verdict)
    return None


def _other_reports(run: Run, goal: Goal, params: ActionResultParams) -> Verdict | None:
    for name, wanted in params.reports.items():
        came = [one.get(name) for one in _feedback(run, goal, params)]
        left = iter(came)
        if all(any(not any(differences(value, one, params.tolerance)) for value in left) for one in wanted):
            continue
        shown_values = f"{join_words(map(str, came[:LISTED]))}{' …' * (len(came) > LISTED)}"
        message = f"the feedback on {goal.name} of {params.action} has {name} {shown_values or 'nowhere'}"
        message += f", not {join_words(map(str, wanted))}"
        verdict = failed(message, hint=f"look at where {name} of the feedback gets its value")
        return verdict if len(came) >= len(wanted) else _excused(verdict.if_repeated(), run, goal)
    return None


def _how_to_fill(got: Mapping[str, Any], wanted: Mapping[str, Any], hint: str) -> str:
    """Return the advice on a result with other values; one in which all are 0 was never filled in."""
    if _is_empty(got):
        return f"fill in the result before you send it: {hint}"
    # `isinstance` would take true and false for numbers.
    numbers = [(name, got.get(name), value) for name, value in wanted.items() if type(value) is int]
    for name, came, value in numbers:
        if type(came) is int and abs(came - value) == 1:
            side = "high" if came > value else "low"
            look = f"look at the condition of the loop, and at where {name} is counted"
            return f"{name} is one too {side}: if it counts something, {look}"
    return f"look at where {join_words(list(wanted))} is worked out"


def _is_empty(value: object) -> bool:
    return all(map(_is_empty, value.values())) if isinstance(value, Mapping) else not value


def _passed(run: Run, goal: Goal, params: ActionResultParams) -> Verdict:
    if params.of_feedback_alone:
        count = plural(len(_feedback(run, goal, params)), "feedback message")
        return passed(f"{count} came on {goal.name} of {params.action}")
    return passed(f"{goal.name} of {params.action} ends {params.status}")


def _no_result(package: PackageFacts, run: Run, goal: Goal, params: ActionResultParams) -> Verdict:
    said = f"{goal.name} of {params.action} got no result"
    kind = published_topics(run).get(f"{params.action}/result", "").removesuffix("ActionResult")
    asked = plain_type(goal.end.type or "") if goal.end else ""
    if kind and asked and kind != asked:
        told = f"{params.action} is of type {kind}, not {asked}"
        return failed_or_blocked(told, hint=f"make it a server of {asked}Action")
    if end := explain_early_end(package, run):
        return end.verdict(failed, f"{said}: the node ended before ({end.cause})")
    if end := explain_error(package, run):
        return end.verdict(failed, f"{said}: {end.cause}")
    to_s = run_seconds(run)
    waited_s = (
        to_s(goal.ended_ns) - to_s(goal.cancelled_ns or goal.at_ns) if to_s and goal.ended_ns else math.inf
    )
    if waits := _long_wait(package, run, waited_s):
        return _excused(waits.verdict(failed, f"{said}: {waits.cause}"), run, goal)
    message = f"{said}: {shown(goal.end.detail) if goal.end else ''}"
    hint = "every path through the callback must end with set_succeeded, set_aborted or set_preempted"
    verdict = failed(message, hint=hint).if_repeated()
    late = _late_feedback(run, goal, params)
    if late:
        verdict = failed(f"{said}: it goes on, though it was cancelled", hint=HINTS["PREEMPTED"])
    return verdict if late >= SURELY else _excused(verdict, run, goal)


def _late_feedback(run: Run, goal: Goal, params: ActionResultParams) -> int:
    """Return how many feedback messages come long after the goal was cancelled."""
    reports = run.student_channels(f"{params.action}/feedback")
    stopped_ns, until_ns = goal.cancelled_ns, goal.ended_ns or run.end_ns
    if stopped_ns is None:
        return 0
    goes_on_ns = round(1e9 * params.within_s) if params.within_s else GOES_ON_NS
    return sum(stopped_ns + goes_on_ns < t <= until_ns for channel in reports for t in channel.times_ns)


def _other_end(package: PackageFacts, run: Run, goal: Goal, params: ActionResultParams) -> Verdict:
    status = goal.end.detail if goal.end else ""
    how = ", though it was cancelled" if goal.cancelled_ns else ""
    message = f"{goal.name} of {params.action} ends {shown(status)}, not {params.status}{how}"
    if status == "ABORTED" and (end := explain_error(package, run)):
        return end.verdict(failed, f"{message}: {end.cause}")
    if params.status == "PREEMPTED" and goal.cancelled_ns is None:
        told = f"{message}: it was over before it could be cancelled"
        verdict = failed(told, hint="let it take as long as the handout says")
        # A server that ends a goal twice ends it early by itself, however late the machine is
        return verdict if ends_twice(run) else _excused(verdict.if_repeated(), run, goal)
    unset = any("did not set the goal to a terminal status" in line.line for _, line in run.console)
    if status == "ABORTED" and unset:
        message += ": the callback returns without saying how the goal ends"
    verdict = failed(message, hint=HINTS[params.status])
    # As soon after the cancelling, it may have been over before the server had to look
    limit_ns = round(1e9 * (params.within_s or SOON_S))
    soon = goal.cancelled_ns and goal.ended_ns and goal.ended_ns - goal.cancelled_ns <= limit_ns
    return _excused(verdict.if_repeated(), run, goal) if soon and status == "SUCCEEDED" else verdict


SOON_S = 1.0
"""A server may take so long to see that its goal is cancelled, if the lab does not say."""


def _long_wait(package: PackageFacts, run: Run, limit_s: float) -> Ending | None:
    """Return the line of a script that runs which makes a turn of its loop last longer than the goal may (s)."""
    for slip in run_slips(package, run, "rate-number"):
        pause_s = 1 / (float(slip.message) or math.inf)
        if pause_s > limit_s:
            lasts = (
                f"line {slip.line} of {slip.file} lets each turn of its loop last {significant(pause_s)} s"
            )
            hint = f"on line {slip.line}, wait for less time: a rate is in hertz, and a time to sleep is in seconds"
            return Ending(lasts, hint, (slip.place,))
    return None


def _too_late(package: PackageFacts, run: Run, goal: Goal, params: ActionResultParams) -> Verdict | None:
    to_s, from_ns = run_seconds(run), goal.cancelled_ns or goal.at_ns
    if params.within_s is None or goal.ended_ns is None or to_s is None:
        return None
    took_s = to_s(goal.ended_ns) - to_s(from_ns)
    if took_s <= params.within_s:
        return None
    since = "it was cancelled" if goal.cancelled_ns else "it was sent"
    message = f"the result of {goal.name} of {params.action} comes {took_s:.2f} s after {since}"
    hint = (
        f"check {ASKED_TO_STOP} each time around the loop"
        if goal.cancelled_ns
        else "do not sleep longer than the handout asks"
    )
    verdict = failed(message, hint=hint)
    # A goal of several turns takes as many pauses of its loop.
    pause_s = params.within_s if goal.cancelled_ns else min(params.within_s, took_s / 10)
    if waits := _long_wait(package, run, pause_s):
        return waits.verdict(failed, f"{message}: {waits.cause}")
    # So much later than asked is no lateness of a machine.
    if took_s > params.within_s + NEVER_LATE_S * run.warp:
        return verdict
    return excused(verdict.if_repeated(), run, from_ns, goal.ended_ns, why_late)


def _no_feedback(run: Run, goal: Goal, params: ActionResultParams) -> Verdict | None:
    came = len(_feedback(run, goal, params))
    if came >= params.feedback:
        return None
    count = plural(came, "feedback message")
    message = f"{count} came on {goal.name} of {params.action}, but {params.feedback} are expected"
    publish = python_or_cpp("publish_feedback(feedback)", "publishFeedback(feedback)")
    verdict = failed(message, hint=f"call the action server's {publish} each time around the loop")
    # That none came at all is no matter of time.
    nothing = verdict.based_on(wrong="nothing")
    return nothing if came == 0 else _excused(verdict.if_repeated(), run, goal)


def _excused(verdict: Verdict, run: Run, goal: Goal) -> Verdict:
    """Return the verdict, open where the machine was late itself while the goal was pursued."""
    return excused(verdict, run, goal.at_ns, goal.ended_ns or run.end_ns, why_late)


def _feedback(run: Run, goal: Goal, params: ActionResultParams) -> list[dict[str, Any]]:
    """Return the feedback on the goal: by its id, and where that was not recorded, by its time."""
    sent = [v for c in run.channels if c.topic == f"{params.action}/goal" and c.by_grader for v in c.values]
    ids = [(value or {}).get("goal_id", {}).get("id") for value in sent]
    channels, until_ns = run.student_channels(f"{params.action}/feedback"), goal.ended_ns or run.end_ns
    came = [(t, v or {}) for c in channels for t, v in zip(c.times_ns, c.values, strict=True)]
    if len(ids) >= params.goal:
        own = ids[params.goal - 1]
        came = [(t, v) for t, v in came if v.get("status", {}).get("goal_id", {}).get("id") == own]
    else:
        came = [(t, v) for t, v in came if goal.at_ns <= t <= until_ns]
    return [value.get("feedback", {}) for _, value in came]


def _not_sent(package: PackageFacts, run: Run, goals: Sequence[Goal], params: ActionResultParams) -> Verdict:
    notes = [e.detail for _, e in run.actors if e.action == "note" and e.topic == params.action]
    # With an .action file of its own, it is the package that defines what the grader could not use.
    if notes and any(one.path.endswith(".action") for one in package.interfaces):
        why = shown(notes[0].partition(": ")[2] or notes[0])
        hint = "use the handout's names and types in the .action file, and build again"
        return failed_or_blocked(f"{params.action} cannot be used as the handout asks: {why}", hint=hint)
    if notes:
        return grade_again(shown(notes[0]))
    if not nodes_on(run, f"{params.action}/goal", "subscribers"):
        return _no_server(package, run, params)
    if goals and (end := explain_early_end(package, run)):
        message = f"the node ended before goal {params.goal} of {params.action} was sent: {end.cause}"
        return end.verdict(failed_or_blocked, message)
    return grade_again(f"only {plural(len(goals), 'goal')} could be sent to {params.action}")


def _no_server(package: PackageFacts, run: Run, params: ActionResultParams) -> Verdict:
    what, bare = f"there is no action server {params.action}", params.action.lstrip("/")
    # An action server subscribes to `<name>/goal`.
    servers = [t.removesuffix("/goal") or "/" for t in topics_with(run, "subscribers") if t.endswith("/goal")]
    if near := near_names(params.action, servers):
        hint = f"give SimpleActionServer(…) the name '{bare}'"
        return failed_or_blocked(f"{what}; {there_is(near)}", hint=hint, measured=join_words(servers))
    if absent := no_node(package, run, what):
        return absent
    if end := explain_error(package, run):
        return end.verdict(failed, f"{what}: {end.cause}")
    if slip := run_slip(package, run, "not-started", "not-called"):
        why = f"{what}: {slip.message} ({slip.file}, line {slip.line})"
        return failed_or_blocked(why, hint=slip.fix, measured="no action server", citations=(slip.place,))
    others = f"; {there_is(servers)}" if servers else ""
    hint = f"actionlib.SimpleActionServer('{bare}', …, auto_start=False), and then start()"
    return failed_or_blocked(f"{what}{others}", hint=hint, measured=join_words(servers) or "no action server")


def _measured_text(run: Run, goal: Goal, params: ActionResultParams) -> str:
    came = plural(len(_feedback(run, goal, params)), "feedback message")
    if goal.end is None or goal.end.value is None:
        return f"{came}, no result"
    return f"{came}, {shown(goal.end.detail)} with {fields_text(goal.end.value)}"
