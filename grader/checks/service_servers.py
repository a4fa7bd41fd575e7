"""Whether a node offers a service, and whether it answers the grader's calls correctly."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, product
from typing import Annotated, Any

from pydantic import Field, model_validator

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import clock_slack_s, run_seconds
from grader.checks.support.exit_causes import explain_end
from grader.checks.support.fields import differences, fields_text
from grader.checks.support.processes import (
    GlobalName,
    TypeName,
    first_interrupt_ns,
    life_of,
    plain_type,
)
from grader.checks.support.services import (
    Exchange,
    Offer,
    by_hand,
    described,
    exchanges,
    no_answer,
    not_offered,
    offers,
    other_type,
)
from grader.checks.support.text import imports, python_or_cpp, service_call
from grader.checks.support.topics import cite
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.record import Record
from grader.model.verdict import (
    EvidenceCitation,
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
    within_s: Annotated[float, Field(gt=0)] | None = None
    """How long an answer may take, by the run's clock; null: as long as the call waits."""
    least_s: Annotated[float, Field(ge=0)] = 0.0
    """How long an answer has to take at least, where the callback sleeps or moves the robot, by the run's clock."""

    @model_validator(mode="after")
    def _in_order(self) -> ServiceAnswersParams:
        if self.within_s is not None and self.least_s > self.within_s:
            raise ValueError(f"least_s, {self.least_s:g}, is more than within_s, {self.within_s:g}")
        return self


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
        numbers within a tolerance, text exactly. Other fields do not matter. If the lab says how long an
        answer takes, it is timed from the call to the answer. Of several calls, each that is answered as it
        should be earns its share.

    How to fix
        The callback takes the request and ends with `return <Type>Response(…)` on every way through it;
        `rosservice call <service> …` shows the answer, or the error.
    """
    made = exchanges(run, params.service)
    pairs = list(zip(made, params.expect, strict=False))
    faults = [(one, v) for one, w in pairs if (v := _fault(one, w, package, run, params))]
    if faults and (hint := _exchanged(pairs, params) or _letters(pairs)):
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
    expected = join_words(
        f"call {n}: {fields_text(w)}" for n, w in enumerate(params.expect, 1)
    ) + _times_text(params)
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
        return _at_wrong_time(one, run, params)
    message = (
        f"{params.service}, called with {fields_text(one.request)}, answers {join_words(map(str, found))}"
    )
    unset = _unset_field([one.path for one in found], plain_type(one.type), package)
    if unset is not None:
        hint = f"set {unset.fix} of the {unset.name} that the callback returns"
        return failed(f"{message}: the script never sets {unset.fix}", hint=hint, citations=(unset.place,))
    verdict = failed(message, hint=f"see what the callback computes: {by_hand(params.service, one)}")
    return verdict.of_value(nan=any(one.nan for one in found))


def _times_text(params: ServiceAnswersParams) -> str:
    """Return how long an answer may take, as the end of a sentence; "" where nothing is said of it."""
    least = f", after {params.least_s:g} s or more" * (params.least_s > 0)
    return least + ("" if params.within_s is None else f", within {params.within_s:g} s")


def _at_wrong_time(one: Exchange, run: Run, params: ServiceAnswersParams) -> Verdict | None:
    """Return what is wrong with how long a right answer took, None if nothing is."""
    if one.answered_ns is None:
        return None
    to_s = run_seconds(run) or (lambda time_ns: time_ns / 1e9)
    took_s = to_s(one.answered_ns) - to_s(one.at_ns)
    asked = f"{params.service}, called with {fields_text(one.request)}, answers after {took_s:.2f} s"
    # A fast clock goes in steps, and a call may come just before one.
    slack_s, late_s = clock_slack_s(run), params.within_s
    if took_s + slack_s < params.least_s:
        hint = f"let the callback return only when it has done its work, after {params.least_s:g} s or more"
        return failed(f"{asked}, not after {params.least_s:g} s or more", hint=hint)
    if late_s is not None and took_s > late_s + slack_s:
        verdict = failed(
            f"{asked}, not within {late_s:g} s", hint="look for a sleep or a wait in the callback"
        )
        return verdict.if_repeated()
    return None


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
            by_name = python_or_cpp(
                f"{kind}Response({first}=…, {second}=…)", f"response.{first} = …; response.{second} = …;"
            )
            return f"{first} and {second} have each other's values: write each by its name, {by_name}"
    return ""


def _letters(pairs: Sequence[tuple[Exchange, dict[str, Any]]]) -> str:
    """Return what to do where each answer is how many letters a text of the request has, in place of words; else ""."""
    texts = {name for one, _ in pairs for name, value in one.request.items() if isinstance(value, str)}
    for name, field in product(sorted(texts), sorted({field for _, wanted in pairs for field in wanted})):
        asked = [(str(one.request.get(name, "")), one, wanted) for one, wanted in pairs]
        if all(
            one.response is not None
            and wanted.get(field) == len(text.split()) != len(text) == one.response.get(field)
            for text, one, wanted in asked
        ):
            return f"`len(…)` of a text counts its letters; `len(request.{name}.split())` counts its words"
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
