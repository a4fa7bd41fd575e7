"""Whether a node offers a service, and whether it answers the grader's calls correctly."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from grader.checks.registry import Refers, check
from grader.checks.support.console_output import Traceback
from grader.checks.support.exit_causes import Ending, explain_end, explain_traceback, process_tracebacks
from grader.checks.support.fields import differences, fields_text, value_text
from grader.checks.support.processes import (
    LOGGERS,
    GlobalName,
    TypeName,
    first_interrupt_ns,
    life_of,
    plain_type,
)
from grader.checks.support.text import SERVICE, SPIN, both, imports, near_names, service_call, shown
from grader.checks.support.topics import cite, no_node, why_unreached
from grader.evidence.events import MISFIT, NO_ANSWER
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import (
    EvidenceCitation,
    FileCitation,
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    inconclusive,
    passed,
)
from grader.wording import join_words, plural


class ServiceParams(Record):
    """The service."""

    service: GlobalName
    """The service, with its slash: `/add`."""
    type: Annotated[TypeName, Refers("service")]
    """As `rosservice type` gives it: `std_srvs/Trigger`."""


class ServiceAnswersParams(Record):
    """The service, and what it has to answer."""

    service: GlobalName
    """The service, with its slash: `/add`."""
    expect: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]
    """One entry for each call of the scenario, in order: the fields that matter, and their values."""
    tolerance: Annotated[float, Field(ge=0)] = 1e-6
    """How much numbers may differ."""


@check("service", params=ServiceParams)
def service(package: PackageFacts, run: Run, params: ServiceParams) -> Verdict:
    """A node offers the service.

    What it checks
        That a node of the package offers the service under exactly this name, and that it is of this type.

    Why it matters on a robot
        A node that calls a service waits for its name and uses its type. If one letter is wrong, the caller
        waits for ever; if the type is another one, every call is refused.

    How it is measured
        By what the master lists, and by the type that the service itself gives when the grader connects to
        it. A node that ends takes its services with it.

    How to fix
        `rospy.Service('<service>', <Type>, callback)` with the name and type of the handout, then
        `rospy.spin()` or a loop. `rosservice list` and `rosservice type <service>` show what is offered.
    """
    found = offers(run)
    offer = found.get(params.service)
    verdict = (
        not_offered(package, run, params.service)
        if offer is None
        else _judge_service(offer, package, run, params)
    )
    cited = cite(run, "/grader/graph")
    expected = f"{params.service} of type {params.type}"
    return verdict.about(expected=expected, measured=verdict.measured or described(found), citations=(cited,))


@check("service-answers", params=ServiceAnswersParams, of_callbacks=True)
def service_answers(package: PackageFacts, run: Run, params: ServiceAnswersParams) -> Verdict:
    """The service answers as it should.

    What it checks
        That every call of the grader's gets an answer, and that the answer's fields have the values that
        belong to the request.

    Why it matters on a robot
        Another node stops and waits for the answer. An answer that never comes, or reports success when
        nothing was done, blocks or misleads everything that depends on it.

    How it is measured
        The grader calls the service once it is offered and compares each field that the rubric names:
        numbers within a tolerance, text exactly. Other fields do not matter. Of several calls, each that
        is answered as it should be earns its share.

    How to fix
        The callback takes the request and ends with `return <Type>Response(…)` on every way through it;
        `rosservice call <service> …` shows the answer, or the error.
    """
    made = exchanges(run, params.service)
    pairs = list(zip(made, params.expect, strict=False))
    faults = [(one, v) for one, w in pairs if (v := _fault(one, w, package, run, params))]
    if faults and (hint := _exchanged(pairs, params)):
        faults = [(one, verdict.model_copy(update={"hint": hint})) for one, verdict in faults]
    wrong = faults[0] if faults else None
    right = len(pairs) - len(faults)
    share = right / len(params.expect)
    if wrong:
        verdict = wrong[1].in_part(share, f"{right} of {plural(len(params.expect), 'answer')} right")
    else:
        answered = f"{params.service} answers {plural(len(pairs), 'call')} as it should"
        verdict = _judge_uncalled(made, package, run, params) or passed(answered)
    call = wrong[0] if wrong else next(reversed(made), None)
    expected = join_words(f"call {n}: {fields_text(w)}" for n, w in enumerate(params.expect, 1))
    measured = verdict.measured or _measured_text(call)
    return verdict.about(expected=expected, measured=measured, citations=(_citation(call, run),))


def _judge_service(offer: Offer, package: PackageFacts, run: Run, params: ServiceParams) -> Verdict:
    """A service of that name is there, or was."""
    name, _, kind = params.type.partition("/")
    hint = f"{imports(name, kind, 'srv')}, then {service_call(params.service, f'{kind}, callback')}"
    if offer.type and offer.type != params.type:
        message = f"{params.service} of {offer.node} is of type {offer.type}, not {params.type}"
        return failed(message, hint=hint)
    one = life_of(run, offer.node)
    if one is not None and one.ended_early:
        end = explain_end(one, run, package)
        message = f"{offer.node} offered {params.service}, but {one.name} ended: {end.cause}"
        return end.verdict(failed_or_blocked, message)
    if back := _taken_back(run, params.service, offer.node):
        return back
    if not offer.type:
        message = f"{params.service} is offered, but its type could not be determined"
        return inconclusive(message, hint=f"rosservice type {params.service} shows it; grade again")
    return passed(f"{offer.node} offers {params.service} of type {params.type}")


def _taken_back(run: Run, service: str, node: str) -> Verdict | None:
    """Return the loss where the node was there without the service at the end, and never answered."""
    # An answer shows that it was kept.
    if any(one.response is not None for one in exchanges(run, service)):
        return None
    until_ns = first_interrupt_ns(run) or run.end_ns
    last = [event for t, event in run.graph if t < until_ns][-1:]
    if not any(node in event.nodes and node not in event.services.get(service, ()) for event in last):
        return None
    hint = "keep what offers it in a variable that lives as long as the node does: in C++, none within inner braces"
    return failed_or_blocked(
        f"{node} offers {service} for a moment, and takes it back while it runs on", hint=hint
    )


def _fault(
    one: Exchange, wanted: dict[str, Any], package: PackageFacts, run: Run, params: ServiceAnswersParams
) -> Verdict | None:
    """Return what is wrong with one answer, None if nothing is."""
    if one.response is None:
        if params.service not in offers(run):
            return _not_there(package, run, params)
        return other_type(run, params.service, one) or no_answer(package, run, params.service, one)
    found = list(differences(one.response, wanted, params.tolerance))
    if not found:
        return None
    message = (
        f"{params.service}, called with {fields_text(one.request)}, answers {join_words(map(str, found))}"
    )
    unset = _unset_field([one.path for one in found], plain_type(one.type), package)
    if unset is not None:
        hint = f"set {unset.fix} of the {unset.name} that the callback returns"
        return failed(f"{message}: the script never sets {unset.fix}", hint=hint, citations=(unset.place,))
    verdict = failed(message, hint=f"see what the callback computes: {_by_hand(params.service, one)}")
    return verdict.of_value(nan=any(one.nan for one in found))


def _exchanged(pairs: Sequence[tuple[Exchange, dict[str, Any]]], params: ServiceAnswersParams) -> str:
    """Return what to do where two fields of all answers have each other's values, and the rest is right; else ""."""
    for first, second in combinations(dict.fromkeys(name for _, wanted in pairs for name in wanted), 2):
        turned = {first: second, second: first}
        if all(
            one.response is not None
            and {first, second} <= {*wanted}
            # two truth values that are both turned around may each be wrong by itself
            and not isinstance(wanted[first], bool)
            and not any(differences(one.response, _renamed(wanted, turned), params.tolerance))
            for one, wanted in pairs
        ):
            kind = pairs[0][0].type.partition("/")[2]
            by_name = both(
                f"{kind}Response({first}=…, {second}=…)", f"response.{first} = …; response.{second} = …;"
            )
            return f"{first} and {second} have each other's values: write each by its name, {by_name}"
    return ""


def _renamed(fields: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    return {names.get(name, name): value for name, value in fields.items()}


def _unset_field(paths: Iterable[str], kind: str, package: PackageFacts) -> PythonSlip | None:
    """Return where the response is made, its `fix` being the first of these fields that no line sets; else None."""
    name = f"{kind.partition('/')[2]}Response"
    made = [s for s in package.slips if (s.kind, s.name) == ("fills", name)]
    given = {field for s in made for field in s.message.split()}
    unset = [path for path in paths if path and re.split(r"\W", path)[0] not in given]
    return made[0].model_copy(update={"fix": unset[0]}) if made and given and unset else None


def _by_hand(service: str, one: Exchange) -> str:
    """Return the command that makes the same call."""
    return f"rosservice call {service}" + (f' "{value_text(one.request)}"' if one.request else "")


def _judge_uncalled(
    made: tuple[Exchange, ...], package: PackageFacts, run: Run, params: ServiceAnswersParams
) -> Verdict | None:
    if len(made) >= len(params.expect):
        return None
    if params.service not in offers(run):
        return _not_there(package, run, params)
    offer = offers(run)[params.service]
    one = life_of(run, offer.node)
    if one is not None and one.ended_early:
        end = explain_end(one, run, package)
        return end.verdict(
            failed_or_blocked, f"{one.name} ended before {params.service} could be called: {end.cause}"
        )
    if back := _taken_back(run, params.service, offer.node):
        return back
    return grade_again(f"{params.service} was called {plural(len(made), 'time')} of {len(params.expect)}")


def _not_there(package: PackageFacts, run: Run, params: ServiceAnswersParams) -> Verdict:
    """What a service that is not there would answer, no one knows: its own criterion says why it is not."""
    return not_offered(package, run, params.service).based_on(unjudged=True)


def _measured_text(one: Exchange | None) -> str:
    if one is None:
        return "not called"
    return "no answer" if one.response is None else fields_text(one.response)


def _citation(one: Exchange | None, run: Run) -> EvidenceCitation:
    return cite(run, "/grader/actor", one.at_ns, one.answered_ns) if one else cite(run, "/grader/actor")


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
    hint += f", or rename {join_words(found, 'or')} if that is meant to be it" if found else ""
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
        return _undivided(package, kind, one) or failed(message, hint=hint)
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
    verdict = failed(f"{asked} gives no answer: {why}", hint=f"try it by hand: {_by_hand(service, one)}")
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
    name = f"/{kind}.srv"
    own = next((i for i in package.interfaces if f"/{i.path}".endswith(name)), None)
    if own is None or own.fault is None or own.fault.kind != "OtherParts":
        return None
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
