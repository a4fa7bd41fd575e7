"""Whether a node sets a parameter and leaves the others alone."""

from __future__ import annotations

from typing import Any

from grader.checks.registry import check
from grader.checks.support.names import GlobalName
from grader.checks.support.param_given import broken, given, is_printed
from grader.checks.support.param_tree import absolute, tree
from grader.checks.support.printed import printed_lines
from grader.checks.support.process import lives
from grader.checks.support.text import shown
from grader.checks.support.unheard import HAND_IN
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, passed, unjudged
from grader.wording import join_words


class ParamsSetParams(Record):
    """`name` has `value` afterwards, as a number or as text; `unchanged` keep theirs; `logged`: it is printed."""

    name: GlobalName
    value: int | float | str
    unchanged: tuple[GlobalName, ...] = ()
    logged: bool = True


@check("params-set", params=ParamsSetParams)
def params_set(package: PackageFacts, run: Run, params: ParamsSetParams) -> Verdict:
    """The node sets a parameter and leaves the others alone.

    What it checks
        That the parameter has its new value on the parameter server afterwards, that the others are as they
        were, and that the new value is printed or logged.

    Why it matters on a robot
        Parameters are shared by all nodes. One that writes a whole map back with names missing takes them away
        from everybody else.

    How it is measured
        By every change of the parameter server up to Ctrl-C or the node's own end. The value may be a number or
        text.

    How to fix
        `rospy.set_param('/details/contact/phone', 55555)`: the whole name of the one value, never a map. Read it
        back with `rospy.get_param` and log it.
    """
    until_ns = min(
        (one.interrupt_ns for one in lives(run) if one.interrupt_ns is not None), default=run.end_ns
    )
    after = tree(run, until_ns=until_ns)
    got = after.get(params.name)
    others = f", {join_words(params.unchanged)} as before" if params.unchanged else ""
    expected = f"{params.name} is {params.value}{others}" + (", and it is logged" if params.logged else "")
    verdict = (
        (None if _is_value(got, params.value) else _not_set(package, run, after, params, until_ns))
        or _clobbered(run, after, params)
        or _not_logged(run, params)
        or passed(f"sets {params.name} to {params.value}{' and logs it' if params.logged else ''}")
    )
    cite = EvidenceCitation(evidence=run.evidence, topic="/grader/param")
    measured = f"{params.name}: {'not there' if got is None else shown(str(got))}"
    update = {"expected": expected, "measured": measured, "citations": (*verdict.citations, cite)}
    return verdict.model_copy(update=update)


def _is_value(got: object, wanted: object) -> bool:
    return not isinstance(got, bool) and (
        got == wanted or (got is not None and str(got).strip() == str(wanted))
    )


def _not_set(
    package: PackageFacts, run: Run, after: dict[str, Any], params: ParamsSetParams, until_ns: int
) -> Verdict:
    if not lives(run):
        return unjudged("the node was not started: there is no script to run", hint=HAND_IN)
    mine = [
        e for t, e in run.params if e.action == "set" and t <= until_ns and run.is_student_node(e.caller_id)
    ]
    last = next((e for e in reversed(mine) if absolute(e.name) == params.name), None)
    hint = f"write rospy.set_param('{params.name}', {params.value!r})"
    if last is not None and params.name in after:
        return failed(
            f"{params.name} is set to {shown(str(after[params.name]))}, not to {params.value}", hint=hint
        )
    if params.name not in after and params.name in given(run):
        cause = _taken_away(run, params.name)
        return failed(f"{params.name} is no longer on the server{cause}", hint=hint)
    if end := broken(package, run):
        message = f"{params.name} was never set: the node ended with {end.cause}"
        return unjudged(message, hint=end.hint, citations=end.citations)
    if _is_value(tree(run).get(params.name), params.value):
        message = (
            f"{params.name} is set to {params.value} only after Ctrl-C: the node does nothing for too long"
        )
        return failed(message, hint="set it as soon as the values are read, without a long sleep before it")
    others = dict.fromkeys(absolute(e.name) for e in mine)
    instead = f"; the node sets {join_words(others)}" if others else ""
    return failed(f"{params.name} is never set to {params.value}{instead}", hint=hint)


def _clobbered(run: Run, after: dict[str, Any], params: ParamsSetParams) -> Verdict | None:
    known = given(run)
    before = tree(run, by=lambda caller: not run.is_student_node(caller))
    for name in params.unchanged:
        was = known[name].value if name in known else before.get(name)
        if was is None or after.get(name) == was:
            continue
        hint = f"set the one value alone: rospy.set_param('{params.name}', {params.value!r})"
        if name in after:
            return failed(
                f"{name} was {shown(str(was))} and is {shown(str(after[name]))} afterwards", hint=hint
            )
        return failed(f"{name} is no longer on the server{_taken_away(run, name)}", hint=hint)
    return None


def _taken_away(run: Run, name: str) -> str:
    """The change that took a name away: a map that lacks it, a value in the map's place, or a delete."""
    for _, event in reversed(run.params):
        above = absolute(event.name)
        if run.is_student_node(event.caller_id) and f"{name}/".startswith(f"{above.rstrip('/')}/"):
            if event.action == "delete":
                return f": the node deletes {above}"
            return f": set_param('{above}', …) replaces all that was below {above}"
    return ""


def _not_logged(run: Run, params: ParamsSetParams) -> Verdict | None:
    if not params.logged or is_printed(params.value, printed_lines(run)):
        return None
    message = f"{params.name} is set to {params.value}, but the new value is never printed"
    return failed(message, hint=f"rospy.loginfo(rospy.get_param('{params.name}'))")
