"""The services that a run's nodes offer, the grader's calls of them, and why one is not offered or gives no answer."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from grader.checks.support.console_output import Traceback
from grader.checks.support.exit_causes import Ending, explain_end, explain_traceback, process_tracebacks
from grader.checks.support.fields import fields_text, value_text
from grader.checks.support.processes import (
    LOGGERS,
    life_of,
    plain_type,
)
from grader.checks.support.text import SERVICE, SPIN, near_names, rename_if_meant, service_call, shown
from grader.checks.support.topics import no_node, why_unreached
from grader.evidence.events import MISFIT, NO_ANSWER
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import (
    FileCitation,
    Verdict,
    failed,
    failed_or_blocked,
)
from grader.wording import join_words


class Offer(NamedTuple):
    """Who offers a service, and what it says of its type: empty where no one could ask it."""

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


def answers_between(run: Run, from_ns: int, to_ns: int) -> bool:
    """Return whether a node answered a call of the grader's between two times: it was there, and the machine too."""
    return any(e.action == "answer" and e.value is not None and from_ns < t < to_ns for t, e in run.actors)


def offers(run: Run) -> dict[str, Offer]:
    """Return the services of the student's nodes by name, as they were last; every node's loggers left out."""
    found: dict[str, Offer] = {}
    for _, event in run.graph:
        for name, nodes in event.services.items():
            node = next((n for n in nodes if run.is_student_node(n)), None)
            if node is None or name.endswith(LOGGERS):
                continue
            # An event without the type does not undo what is known of it.
            known = found[name].type if name in found and found[name].node == node else ""
            found[name] = Offer(node, plain_type(event.service_types.get(name, known)))
    return found


def described(found: Mapping[str, Offer]) -> str:
    """Return all services on one line."""
    return (
        join_words(f"{name} ({offer.type or 'type unknown'})" for name, offer in found.items())
        or "no service"
    )


def exchanges(run: Run, service: str) -> tuple[Exchange, ...]:
    """Return the grader's calls of one service with their answers, in order."""
    calls = [(t, e) for t, e in run.actors if e.action == "call" and e.topic == service]
    answers = [(t, e) for t, e in run.actors if e.action == "answer" and e.topic == service]
    found = []
    for number, (at_ns, call) in enumerate(calls):
        # One call is made after the other, so that the answers are in their order.
        time_ns, answer = answers[number] if number < len(answers) else (None, None)
        response, detail = (answer.value, answer.detail) if answer else (None, "")
        kind = plain_type(call.type or "")
        found.append(Exchange(at_ns, time_ns, kind, call.value or {}, response, detail))
    return tuple(found)


def by_hand(service: str, one: Exchange) -> str:
    """Return the command that makes the same call."""
    return f"rosservice call {service}" + (f' "{value_text(one.request)}"' if one.request else "")


def not_offered(package: PackageFacts, run: Run, service: str) -> Verdict:
    """Return why no node of the student's offers it."""
    found = offers(run)
    owner = _other_owner(run, service)
    near = near_names(service, found)
    if owner:
        message = f"{service} is offered by {owner}, which is not a node of the package"
        return failed(message, hint=f"offer it with {service_call(service)} in a node of your own")
    if near:
        message = f"there is no service {service}; {found[near[0]].node} offers {join_words(near)}"
        return failed(message, hint=_rename_hint(service, near[0], found[near[0]].node))
    if absent := no_node(package, run, f"there is no service {service}"):
        return absent
    if (slip := why_unreached(package, run)) and not found:
        hint = f"write {service_call(service, '…, callback')} where the script gets to: before the loop or {SPIN}"
        return failed(f"no node offers {service}: {slip.message}", hint=hint, citations=(slip.place,))
    others = f"; it offers {join_words(found)}" if found else ""
    hint = f"add {service_call(service, '…, callback')} before the loop or {SPIN}"
    hint += rename_if_meant(found)
    return failed(f"no node offers {service}{others}", hint=hint)


def _other_owner(run: Run, service: str) -> str:
    nodes = (n for _, e in run.graph for n in e.services.get(service, ()) if not run.is_student_node(n))
    return next(nodes, "")


def _rename_hint(wanted: str, found: str, node: str) -> str:
    if found == f"{node}{wanted}":
        return f"a name with ~ gets the node's name in front: write {service_call(wanted)}"
    if wanted == f"{node}{found}":
        return f"a name with ~ gets the node's name in front: write {service_call(f'~{found[1:]}')}"
    return f"name it {wanted} in {SERVICE}"


def handler_traceback(run: Run, service: str, call: Exchange) -> Traceback | None:
    """Return the first traceback of the service's node since a call; of one that was given up, before the next call."""
    offer = offers(run).get(service)
    one = life_of(run, offer.node) if offer else None
    if one is None:
        return None
    later = [other.at_ns for other in exchanges(run, service) if other.at_ns > call.at_ns]
    before_ns = min(later, default=None) if call.detail.startswith(NO_ANSWER) else None
    ended_ns = before_ns or one.interrupt_ns
    found = process_tracebacks(run, one.name, after_ns=call.at_ns, before_ns=ended_ns)
    # what is raised while another exception is handled says more: rospy's names the field
    return next((one for one in found if not one.is_handled), found[0] if found else None)


_IN_ORDER = re.compile(r" has ([^;]+); the handout asks for ([^;]+)")


def _sorted(fields: str) -> tuple[str, ...]:
    return tuple(sorted(fields.split(", ")))


def no_answer(package: PackageFacts, run: Run, service: str, one: Exchange) -> Verdict:
    """Return why a call brought nothing back."""
    asked = f"{service}, called with {fields_text(one.request)},"
    found = handler_traceback(run, service, one)
    if found is not None:
        end = _in_other_order(found, one, package) or explain_traceback(found, package)
        return end.verdict(failed, f"{asked} fails: {end.cause}")
    kind = one.type.partition("/")[2]
    if one.detail.startswith(MISFIT):
        message = f"{service} cannot be called with {fields_text(one.request)}: {shown(one.detail)}"
        hint = f"give srv/{kind}.srv the handout's names and types, the request above ---, and build again"
        if (found_order := _IN_ORDER.search(one.detail)) and len({*map(_sorted, found_order.groups())}) == 1:
            order = shown(found_order[2])
            hint = f"write the fields in srv/{kind}.srv in the handout's order, {order}, and build again"
        verdict = _undivided(package, kind, one) or failed(message, hint=hint)
        return verdict.based_on(judged_by="definition", unjudged=True)
    if "returned None" in one.detail:
        hint = f"end the callback with return {kind}Response(…)"
        verdict = failed(f"{asked} fails: its callback returns nothing", hint=hint)
        return verdict.based_on(wrong="nothing")
    if "returned invalid value" in one.detail or "wrong number of values" in one.detail:
        message = f"{asked} fails: its callback returns something that is not a {kind}Response ({shown(one.detail)})"
        return failed(message, hint=f"end the callback with return {kind}Response(…), its fields by name")
    owner = life_of(run, offers(run)[service].node)
    if owner is not None and owner.ended_early:
        end = explain_end(owner, run, package)
        return failed(f"{asked} gives no answer: {owner.name} ended ({end.cause})", hint=end.hint)
    why = shown(one.detail) or "the call was not answered"
    verdict = failed(f"{asked} gives no answer: {why}", hint=f"try it by hand: {by_hand(service, one)}")
    return verdict.late() if one.detail.startswith(NO_ANSWER) else verdict


def _in_other_order(found: Traceback, one: Exchange, package: PackageFacts) -> Ending | None:
    """Return the cause, the hint and the line where a callback returns a list whose values do not fit the fields."""
    name = f"/{one.type.partition('/')[2]}.srv"
    own = next((i for i in package.interfaces if f"/{i.path}".endswith(name)), None)
    fields = [f.name for f in own.fields if f.part == "response"] if own is not None else []
    lists = [s for s in package.slips if s.kind == "returns-list" and s.message.count(",") + 1 == len(fields)]
    if found.kind != "SerializationError" or len(lists) != 1:
        return None
    slip, values = lists[0], lists[0].message.split(", ")
    cause = (
        f"{shown(found.message)}, and a {slip.name} gives its values to {join_words(fields)}, in this order"
    )
    rest = [value for value in values if value not in fields]
    by_name = {value: value for value in values if value in fields}
    if not by_name or len(rest) > 1 or "..." in rest or values == fields:
        return Ending(cause, "put the values in that order, each of its field's type", (slip.place,))
    right = ", ".join(by_name.get(field, rest[0] if rest else field) for field in fields)
    right = f"[{right}]" if slip.name == "list" else right
    return Ending(cause, f"on line {slip.line}, write `return {shown(right)}`", (slip.place,))


def _undivided(package: PackageFacts, kind: str, one: Exchange) -> Verdict | None:
    """Return the verdict on a .srv file without its `---`, which belongs below the last field of the request."""
    alike = [i for i in package.interfaces if f"/{i.path}".endswith(f"/{kind}.srv")]
    own = min(alike, key=lambda one: one.path != f"srv/{kind}.srv", default=None)
    if own is None or own.fault is None or own.fault.kind != "OtherParts":
        return None
    if not own.fields:
        fix = "write the handout's fields into it, with a line `---` between the request's and the response's"
        cited = (FileCitation(file=own.path, line=None),)
        return failed(f"{own.path} has no field", hint=fix, citations=cited)
    lines = [field.line for field in own.fields if field.name in one.request]
    below = f"below line {max(lines)}" if lines else "between the request's fields and the response's"
    place = FileCitation(file=own.path, line=max(lines, default=None))
    return failed(f"{own.path}: {own.fault.message}", hint=f"write a line `---` {below}", citations=(place,))


def other_type(run: Run, service: str, one: Exchange) -> Verdict | None:
    """Return the verdict where the call could not fit, because the service is of another type."""
    kind = offers(run)[service].type if service in offers(run) else ""
    if not kind or not one.type or kind == one.type:
        return None
    message = f"{service} cannot be called as {one.type}: it is of type {kind}"
    return failed_or_blocked(message, hint=f"give {service_call(service)} the type {one.type}")
