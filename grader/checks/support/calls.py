"""Services that the student's nodes offer, and the grader's calls of them."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any, NamedTuple

from grader.checks.support.absence import life_of, no_node
from grader.checks.support.exit_cause import explain_end, explain_traceback
from grader.checks.support.names import plain_type
from grader.checks.support.text import near_names, shown
from grader.checks.support.traceback import HEADING, Traceback, tracebacks
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict, failed, unjudged
from grader.wording import join_words

LOGGERS = ("/get_loggers", "/set_logger_level")


class Offer(NamedTuple):
    """Who offers a service, and what it says of its type: empty where nobody could ask it."""

    node: str
    type: str


class Exchange(NamedTuple):
    """One call of the grader's. `answered_ns` is None where the recording has no answer, not even a failed one."""

    at_ns: int
    answered_ns: int | None
    type: str
    request: Mapping[str, Any]
    response: Mapping[str, Any] | None
    detail: str


def offers(run: Run) -> dict[str, Offer]:
    """The services of the student's nodes by name, as they were last; every node's loggers left out."""
    found: dict[str, Offer] = {}
    for _, event in run.graph:
        for name, nodes in event.services.items():
            node = next((n for n in nodes if run.is_student_node(n)), None)
            if node is None or name.endswith(LOGGERS):
                continue
            known = found[name].type if name in found and found[name].node == node else ""
            found[name] = Offer(node, plain_type(event.service_types.get(name, known)))
    return found


def described(found: Mapping[str, Offer]) -> str:
    """All services in one line."""
    return (
        join_words(f"{name} ({offer.type or 'type unknown'})" for name, offer in found.items())
        or "no service"
    )


def exchanges(run: Run, service: str) -> tuple[Exchange, ...]:
    """The grader's calls of one service with their answers, in order."""
    calls = [(t, e) for t, e in run.actors if e.action == "call" and e.topic == service]
    answers = [(t, e) for t, e in run.actors if e.action == "answer" and e.topic == service]
    found = []
    for number, (at_ns, call) in enumerate(calls):
        time_ns, answer = answers[number] if number < len(answers) else (None, None)
        found.append(
            Exchange(
                at_ns,
                time_ns,
                plain_type(call.type or ""),
                call.value or {},
                answer.value if answer else None,
                answer.detail if answer else "",
            )
        )
    return tuple(found)


def not_offered(package: PackageFacts, run: Run, service: str) -> Verdict:
    """Why no node of the student's offers it."""
    found = offers(run)
    owner = _other_owner(run, service)
    near = near_names(service, found)
    if owner:
        message = f"{service} is offered by {owner}, which is not a node of the package"
        return failed(message, hint=f"offer it with rospy.Service('{service}', …) in a node of your own")
    if near:
        message = f"there is no service {service}; {found[near[0]].node} offers {join_words(near)}"
        return failed(message, hint=_rename_hint(service, near[0], found[near[0]].node))
    if absent := no_node(package, run, f"there is no service {service}"):
        return absent
    others = f"; it offers {join_words(found)}" if found else ""
    message = f"no node offers {service}{others}"
    return failed(
        message, hint=f"add rospy.Service('{service}', …, callback) before the loop or rospy.spin()"
    )


def _other_owner(run: Run, service: str) -> str:
    nodes = (n for _, e in run.graph for n in e.services.get(service, ()) if not run.is_student_node(n))
    return next(nodes, "")


def _rename_hint(wanted: str, found: str, node: str) -> str:
    if found == f"{node}{wanted}":
        return f"a name with ~ is put below the node's own: write rospy.Service('{wanted}', …)"
    if wanted == f"{node}{found}":
        return f"a name with ~ is put below the node's own: write rospy.Service('~{found[1:]}', …)"
    return f"name it {wanted} in rospy.Service(…)"


def handler_traceback(run: Run, service: str, since_ns: int) -> Traceback | None:
    """The first traceback of the service's node since a call; rospy logs a handler's as a list on one line."""
    offer = offers(run).get(service)
    one = life_of(run, offer.node) if offer else None
    if one is None:
        return None
    lines = [
        part
        for t, c in run.lines(one.name)
        if c.stream == "stderr" and t >= since_ns
        for part in _unpacked(c.line)
    ]
    return next(iter(tracebacks(lines)), None)


def _unpacked(line: str) -> list[str]:
    start = line.find("['" + HEADING)
    if start < 0:
        return [line]
    try:
        parts = ast.literal_eval(line[start:].strip())
    except (SyntaxError, ValueError):
        return [line]
    return "".join(map(str, parts)).splitlines()


def no_answer(package: PackageFacts, run: Run, service: str, one: Exchange) -> Verdict:
    """Why a call brought nothing back."""
    asked = f"{service}, called with {fields(one.request)},"
    found = handler_traceback(run, service, one.at_ns)
    if found is not None:
        end = explain_traceback(found, package)
        return failed(f"{asked} fails: {end.cause}", hint=end.hint, citations=end.citations)
    kind = one.type.partition("/")[2]
    if "returned None" in one.detail:
        hint = f"end the callback with return {kind}Response(…)"
        return failed(f"{asked} fails: its callback returns nothing", hint=hint)
    if "returned invalid value" in one.detail or "wrong number of values" in one.detail:
        message = f"{asked} fails: its callback returns what is no {kind}Response ({shown(one.detail)})"
        return failed(message, hint=f"end the callback with return {kind}Response(…), its fields by name")
    owner = life_of(run, offers(run)[service].node)
    if owner is not None and owner.ended_early:
        end = explain_end(owner, run, package)
        return failed(f"{asked} gives no answer: {owner.name} ended ({end.cause})", hint=end.hint)
    why = shown(one.detail) or "the call was not answered"
    return failed(f"{asked} gives no answer: {why}", hint=f"try it by hand: rosservice call {service} …")


def other_type(run: Run, service: str, one: Exchange) -> Verdict | None:
    """The call could not fit, because the service is of another type."""
    kind = offers(run)[service].type if service in offers(run) else ""
    if not kind or not one.type or kind == one.type:
        return None
    message = f"{service} cannot be called as {one.type}: it is of type {kind}"
    return unjudged(message, hint=f"give rospy.Service('{service}', …) the type {one.type}")


def fields(value: Mapping[str, Any]) -> str:
    """A request's or an answer's fields in one line."""
    return shown(", ".join(f"{name}: {text(one)}" for name, one in value.items())) or "nothing"


def text(value: object) -> str:
    """A value as `rosservice` and YAML show it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"'{value}'"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {text(one)}" for name, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(text, value)) + "]"
    return f"{value:.7g}" if isinstance(value, float) else str(value)
