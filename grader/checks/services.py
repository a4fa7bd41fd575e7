"""Whether a node offers a service, and whether it answers well."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from grader.checks.registry import check
from grader.checks.support.absence import life_of
from grader.checks.support.calls import (
    Exchange,
    Offer,
    described,
    exchanges,
    fields,
    no_answer,
    not_offered,
    offers,
    other_type,
)
from grader.checks.support.comparing import differences
from grader.checks.support.exit_cause import explain_end
from grader.checks.support.names import GlobalName, TypeName
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, inconclusive, passed, unjudged
from grader.wording import join_words, plural


class ServiceParams(Record):
    """`service` with its slash, `type` as `rosservice type` gives it (`std_srvs/Trigger`)."""

    service: GlobalName
    type: TypeName


class ServiceAnswersParams(Record):
    """`expect` has an entry for each call of the scenario, in order: the fields that matter, and their values.

    Numbers may differ by `tolerance`.
    """

    service: GlobalName
    expect: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]
    tolerance: Annotated[float, Field(ge=0)] = 1e-6


@check("service", params=ServiceParams)
def service(package: PackageFacts, run: Run, params: ServiceParams) -> Verdict:
    """A node offers the service.

    What it checks
        That a node of the package offers the service under exactly this name, and that it is of this type.

    Why it matters on a robot
        Whoever calls a service waits for its name and asks by its type. One letter off, and the caller
        waits for ever; another type, and every call is refused.

    How it is measured
        By what the master lists, and by the type that the service itself gives when the grader connects to
        it. A node that ends takes its services with it.

    How to fix
        `rospy.Service('<service>', <Type>, callback)` with the name and type of the handout, then
        `rospy.spin()` or a loop. `rosservice list` and `rosservice type <service>` show what is there.
    """
    found = offers(run)
    offer = found.get(params.service)
    verdict = (
        not_offered(package, run, params.service) if offer is None else _judged(offer, package, run, params)
    )
    cite = EvidenceCitation(evidence=run.evidence, topic="/grader/graph")
    return verdict.model_copy(
        update={
            "expected": f"{params.service} of type {params.type}",
            "measured": verdict.measured or described(found),
            "citations": (*verdict.citations, cite),
        }
    )


@check("service-answers", params=ServiceAnswersParams)
def service_answers(package: PackageFacts, run: Run, params: ServiceAnswersParams) -> Verdict:
    """The service answers as it should.

    What it checks
        That every call of the grader's gets an answer, and that the answer's fields have the values that
        belong to the request.

    Why it matters on a robot
        Another node stops and waits for the answer. One that never comes, or says success where nothing was
        done, holds up or misleads everything that depends on it.

    How it is measured
        The grader calls the service once it is offered and compares each field that the rubric names:
        numbers within a tolerance, text exactly. Other fields do not matter.

    How to fix
        The callback takes the request and ends with `return <Type>Response(…)` on every way through it;
        `rosservice call <service> …` shows the answer, or the error.
    """
    made = exchanges(run, params.service)
    pairs = list(zip(made, params.expect, strict=False))
    wrong = next(((one, v) for one, w in pairs if (v := _fault(one, w, package, run, params))), None)
    verdict = (
        (wrong[1] if wrong else None)
        or _uncalled(made, package, run, params)
        or passed(f"{params.service} answers {plural(len(pairs), 'call')} as it should")
    )
    shown = wrong[0] if wrong else next(reversed(made), None)
    return verdict.model_copy(
        update={
            "expected": join_words(f"call {n}: {fields(w)}" for n, w in enumerate(params.expect, 1)),
            "measured": verdict.measured or _measured(shown),
            "citations": (*verdict.citations, _citation(shown, run)),
        }
    )


def _judged(offer: Offer, package: PackageFacts, run: Run, params: ServiceParams) -> Verdict:
    """A service of that name is there, or was."""
    name, _, kind = params.type.partition("/")
    hint = f"from {name}.srv import {kind}, then rospy.Service('{params.service}', {kind}, callback)"
    if offer.type and offer.type != params.type:
        message = f"{params.service} of {offer.node} is of type {offer.type}, not {params.type}"
        return failed(message, hint=hint)
    one = life_of(run, offer.node)
    if one is not None and one.ended_early:
        end = explain_end(one, run, package)
        message = f"{offer.node} offered {params.service}, but {one.name} ended: {end.cause}"
        return unjudged(message, hint=end.hint, citations=end.citations)
    if not offer.type:
        message = f"{params.service} is offered, but did not say of what type it is"
        return inconclusive(message, hint=f"rosservice type {params.service} shows it; grade again")
    return passed(f"{offer.node} offers {params.service} of type {params.type}")


def _fault(
    one: Exchange, wanted: dict[str, Any], package: PackageFacts, run: Run, params: ServiceAnswersParams
) -> Verdict | None:
    """What is wrong with one answer, None if nothing is."""
    if one.response is None:
        if params.service not in offers(run):
            return _not_there(package, run, params)
        return other_type(run, params.service, one) or no_answer(package, run, params.service, one)
    found = list(differences(one.response, wanted, params.tolerance))
    if not found:
        return None
    message = f"{params.service}, called with {fields(one.request)}, answers {join_words(map(str, found))}"
    return failed(message, hint=f"try it by hand: rosservice call {params.service} …")


def _uncalled(
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
        message = f"{one.name} ended before {params.service} could be called: {end.cause}"
        return unjudged(message, hint=end.hint, citations=end.citations)
    message = f"{params.service} was called {plural(len(made), 'time')} of {len(params.expect)}"
    return inconclusive(message, hint="grade again")


def _not_there(package: PackageFacts, run: Run, params: ServiceAnswersParams) -> Verdict:
    """What a service that is not there would answer, nobody knows: its own criterion says why it is not."""
    return not_offered(package, run, params.service).model_copy(update={"unjudged": True})


def _measured(one: Exchange | None) -> str:
    if one is None:
        return "not called"
    return "no answer" if one.response is None else fields(one.response)


def _citation(one: Exchange | None, run: Run) -> EvidenceCitation:
    span = {"from_ns": one.at_ns, "to_ns": one.answered_ns} if one else {}
    return EvidenceCitation(evidence=run.evidence, topic="/grader/actor", **span)
