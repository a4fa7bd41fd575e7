"""Whether the student's node calls a service that the grader offers, with the right request."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import excused, run_seconds, why_late
from grader.checks.support.exit_causes import explain_early_end, explain_error
from grader.checks.support.fields import Difference, differences, fields_text
from grader.checks.support.processes import LOGGERS, GlobalName, early_end, lives
from grader.checks.support.text import action_client, near_names, python_or_cpp, service_client, shown
from grader.checks.support.topics import cite, no_node, nodes_on, topics_with
from grader.evidence.events import MISFIT, OTHER_TYPE, ActorEvent
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, passed
from grader.wording import join_words, plural, significant

CALLS_SHOWN = 8


class CallsParams(Record):
    """The service, and what has to be asked of it."""

    service: Annotated[GlobalName, Refers("served")]
    """A service or an action that the scenario `serves`, with its slash: `/add`."""
    expect: dict[str, Any] | tuple[dict[str, Any], ...] = ()
    """The fields of the request, or of the goal, that matter, and their values; or a list of requests in their order.
    Calls between them, and fields that are left out, do not matter."""
    at_least: Annotated[int, Field(ge=1)] = 1
    """The least number of calls; if `expect` is one request, each of them has to match it."""
    at_most: Annotated[int, Field(ge=1)] | None = None
    """The greatest number of calls, whatever their fields; null: any number."""
    apart_s: Annotated[float, Field(gt=0)] | None = None
    """The least time between two calls, by the run's clock; null: any time."""
    tolerance: Annotated[float, Field(ge=0)] = 1e-6
    """How much numbers may differ."""

    @model_validator(mode="after")
    def _some_number(self) -> CallsParams:
        if self.at_most is not None and self.at_most < len(self.wanted):
            raise ValueError(f"at_most is {self.at_most}, and {plural(len(self.wanted), 'call')} are wanted")
        return self

    @property
    def wanted(self) -> tuple[dict[str, Any], ...]:
        """The requests that have to come."""
        if isinstance(self.expect, dict):
            return (self.expect,) * self.at_least
        return (*self.expect, *({},) * (self.at_least - len(self.expect)))

    @property
    def words(self) -> str:
        asked = (self.expect,) if isinstance(self.expect, dict) else self.expect
        requests = f" with {join_words(map(fields_text, asked), 'then')}" if any(asked) else ""
        most = "" if self.at_most is None else f", {self.at_most} at most"
        apart = "" if self.apart_s is None else f", {significant(self.apart_s)} s apart"
        return f"{plural(len(self.wanted), 'call')} of {self.service}{requests}{most}{apart}"


class Request(NamedTuple):
    """A call of the student's; `fields` is None where the bytes were none of the service's type."""

    at_ns: int
    node: str
    fields: dict[str, Any] | None


@check("calls", params=CallsParams)
def calls(package: PackageFacts, run: Run, params: CallsParams) -> Verdict:
    """The node calls the service with the right request.

    What it checks
        That a node of the package calls the grader's service as often as it should, no more often and no
        faster than the lab allows, and that the fields of its requests have the right values.

    Why it matters on a robot
        A server does what it is asked. A client that swaps two fields, or never calls, drives the robot to
        another place, or leaves it standing.

    How it is measured
        The grader offers the service before any node starts and records each request with its fields. Numbers
        are compared within a tolerance, text exactly.

    How to fix
        `rospy.wait_for_service('<service>')`, then `add = rospy.ServiceProxy('<service>', <Type>)`, then
        `answer = add(a=…, b=…)`: with the fields by name, none can be swapped.
    """
    made = requests(run, params.service)
    missing = _first_missing(made, params)
    verdict = (
        _too_many(made, params)
        or _too_soon(made, run, params)
        or passed(f"{params.service} is called with {join_words(dict.fromkeys(_text(r) for r in made))}")
        if missing is None
        else _excuse(
            _never(package, run, params) if not made else _fault(package, run, params, *missing), run
        )
    )
    measured = join_words(_text(r) for r in made) or verdict.measured or "no call"
    cited = (cite(run, "/grader/actor", *_span(made)),)
    return verdict.about(expected=params.words, measured=measured, citations=cited)


def requests(run: Run, service: str) -> tuple[Request, ...]:
    """Return the calls of one of the grader's services by nodes of the student's, in their order."""
    return tuple(
        Request(time_ns, event.actor, event.value["request"])
        for time_ns, event in run.actors
        if event.action == "serve" and event.topic == service and run.is_student_node(event.actor)
    )


def _text(request: Request) -> str:
    return "something that is not a valid request" if request.fields is None else fields_text(request.fields)


def _span(made: tuple[Request, ...]) -> tuple[int | None, int | None]:
    return (made[0].at_ns, made[-1].at_ns) if made else (None, None)


def _first_missing(
    made: tuple[Request, ...], params: CallsParams
) -> tuple[dict[str, Any], tuple[Request, ...]] | None:
    """Return the first request that did not come, and the calls after the one before it; None where all came."""
    left = made
    for wanted in params.wanted:
        # Other calls in between are judged by `at_most`.
        fits = (n for n, one in enumerate(left) if not any(_differences(one, wanted, params)))
        number = next(fits, None)
        if number is None:
            return wanted, left
        left = left[number + 1 :]
    return None


def _differences(one: Request, wanted: dict[str, Any], params: CallsParams) -> Iterator[Difference]:
    return differences(one.fields, wanted, params.tolerance)


def _too_many(made: Sequence[Request], params: CallsParams) -> Verdict | None:
    if params.at_most is None or len(made) <= params.at_most:
        return None
    message = f"{params.service} is called {plural(len(made), 'time')}; the handout allows {params.at_most}"
    return failed(message, hint="count the calls, and stop after the last one that is asked for")


def _too_soon(made: Sequence[Request], run: Run, params: CallsParams) -> Verdict | None:
    """A late machine excuses nothing: a call is noted before it is answered, and the pause begins after that."""
    to_s = run_seconds(run)
    if params.apart_s is None or to_s is None:
        return None
    apart = [to_s(later.at_ns) - to_s(one.at_ns) for one, later in pairwise(made)]
    soon = [one for one in apart if one < params.apart_s]
    if not soon:
        return None
    message = f"{params.service} is called again after {min(soon):.2f} s, not {significant(params.apart_s)} s"
    return failed(message, hint=f"wait before the next call: rospy.sleep({significant(params.apart_s)})")


def _fault(
    package: PackageFacts, run: Run, params: CallsParams, wanted: dict[str, Any], left: tuple[Request, ...]
) -> Verdict:
    """Some call came: either it is another one, or there are too few."""
    made = requests(run, params.service)
    came, error, end = len(made), explain_error(package, run), explain_early_end(package, run)
    is_over = not error and end is not None and end.by_itself
    if (came >= len(params.wanted) or is_over) and (other := _in_another_order(params, wanted, made)):
        return other
    if left and (came >= len(params.wanted) or not error):
        return _other_request(params, wanted, left, run)
    with_fields = f" with {fields_text(wanted)}" if wanted else ""
    what = f"{params.service} is called {plural(came, 'time')}, but there was no other call{with_fields}"
    ended = early_end(run)
    by_itself = ended is not None and (ended.end is None or ended.end.signal is None)
    if by_itself and end is not None and not (error or end.citations or end.of_machine):
        needed = plural(max(len(params.wanted), params.at_least), "call")
        hint = f"{needed} are needed, and the program ends after {came}: let it go on, and call it again"
        return failed(f"{what}: {end.cause}", hint=hint).based_on(lost_to=(f"{run.scenario}: {what}",))
    if end := end or error:
        return end.verdict(failed, f"{what}: {end.cause}")
    return failed(what, hint=f"{plural(len(params.wanted), 'call')} are needed: call it again").if_repeated()


def _in_another_order(params: CallsParams, wanted: dict[str, Any], made: Sequence[Request]) -> Verdict | None:
    """The request that is missing is right where it comes: it comes at another place, or less often."""
    if len(params.wanted) == 1 or all(any(_differences(one, wanted, params)) for one in made):
        return None
    asked = [f"({fields_text(one)})" for one in params.wanted]
    came = [f"({_text(one)})" for one in made]
    message = f"{params.service} is called with {_in_turn(came)}, not with {_in_turn(asked)}"
    return failed(message, hint=f"make {plural(len(asked), 'call')} in this order: {_in_turn(asked)}")


def _in_turn(calls: Sequence[str]) -> str:
    return ", ".join([*calls[:CALLS_SHOWN], *(["…"] if len(calls) > CALLS_SHOWN else [])])


def _other_request(
    params: CallsParams, wanted: dict[str, Any], left: tuple[Request, ...], run: Run
) -> Verdict:
    """It is called with other values, judged by the call that comes nearest."""
    nearest = min(left, key=lambda one: len(list(_differences(one, wanted, params))))
    found = list(_differences(nearest, wanted, params))
    text = join_words(map(str, found))
    if swapped := _swapped(nearest, wanted, params):
        by_name = ", ".join(f"{field}=…" for field in nearest.fields or {})
        message = f"{params.service} is called with {join_words(swapped)} swapped: {text}"
        hint = f"give {join_words(swapped)} each other's values where they are set, or pass them by name: ({by_name})"
        return failed(message, hint=hint)
    hint = f"set {join_words(one.path for one in found)} of the request to what the handout asks for"
    # Remappings are ROS's, and no arguments of the program.
    given = [one for life in lives(run) for one in life.start.argv[1:] if ":=" not in one]
    values = [str(asked) for one in found if isinstance(asked := wanted.get(one.path), str | int | float)]
    is_told = len(values) == len(found) and all(given.count(one) == values.count(one) == 1 for one in values)
    # With several programs, it is not known whose arguments they are.
    if is_told and len(lives(run)) == 1:
        places = [given.index(one) + 1 for one in values]
        read = (f"{d.path} from {_argument(n, wanted[d.path])}" for d, n in zip(found, places, strict=True))
        text += f"; the run starts it with {plural(len(given), 'argument')}: {shown(' '.join(given))}"
        hint = f"take {join_words(read)}, where the program gets its arguments"
    return failed(f"{params.service} is called with {text}", hint=hint)


def _argument(number: int, value: object) -> str:
    """Return what reads an argument of the command line as a value of this kind."""
    if isinstance(value, bool):  # every text is true to Python and C++, also False
        return python_or_cpp(f"sys.argv[{number}] == 'True'", f'std::string(argv[{number}]) == "True"')
    python = f"{type(value).__name__}(sys.argv[{number}])"
    cpp = {int: "atoll({})", float: "atof({})"}.get(type(value), "{}").format(f"argv[{number}]")
    return python_or_cpp(f"sys.argv[{number}]" if isinstance(value, str) else python, cpp)


def _swapped(one: Request, wanted: dict[str, Any], params: CallsParams) -> list[str]:
    """Return the fields of which each has the value of another one; none where it is not so."""
    fields = one.fields or {}
    wrong = [
        key
        for key in wanted
        if key in fields and any(differences(fields[key], wanted[key], params.tolerance))
    ]
    asked = [wanted[key] for key in wrong]
    for key in wrong:
        fits = (n for n, one in enumerate(asked) if not any(differences(fields[key], one, params.tolerance)))
        number = next(fits, None)
        if number is None:
            return []
        # Each value can be that of one field only.
        del asked[number]
    return wrong


def _never(package: PackageFacts, run: Run, params: CallsParams) -> Verdict:
    """Why no call came at all: the surest reason first. What is then wrong with the request, no one knows."""
    what, service = f"no node calls {params.service}", params.service
    asked = [e for _, e in run.actors if e.action == "lookup" and run.is_student_node(e.actor)]
    looked = {e.topic or "": e.actor for e in asked} | _clients(run)
    near = near_names(service, looked)
    if refused := _judge_refusal(run, service):
        return refused
    if near and service not in looked:
        hint = f"use the name {service} both where you wait for it and where you call it"
        return failed_or_blocked(f"{what}: {looked[near[0]]} asks for {near[0]}", hint=hint)
    if end := explain_error(package, run):
        return end.verdict(failed_or_blocked, f"{what}: {end.cause}")
    if service in looked:
        hint = f"waiting for it is not enough: {_call(run, service)} calls it"
        verdict = failed_or_blocked(f"{looked[service]} looks {service} up, but never calls it", hint=hint)
        return _waits_for_another(run, asked, what) or _unless_over(verdict, run)
    if absent := no_node(package, run, what):
        return absent
    others = f"; it asks for {join_words(looked)}" if looked else ""
    verdict = failed_or_blocked(f"{what}{others}", hint=f"{_call(run, service)} calls it")
    return verdict if any(e.detail for e in asked) else _unless_over(verdict, run)


def _waits_for_another(run: Run, asked: Sequence[ActorEvent], what: str) -> Verdict | None:
    """Return the loss where the node waits for another service, again and again, and nothing offers that."""
    offered = {name for _, event in run.graph for name in event.services if not name.endswith(LOGGERS)}
    name = (asked[-1].topic or "") if asked else ""
    again = [e for e in asked if e.detail and e.topic == name]
    if len(again) < 2 or asked[-1] != again[-1] or name in offered:
        return None
    hint = f"delete the line that waits for {name}, or offer it yourself"
    if right := near_names(name, sorted(offered)):
        hint = f"write {right[0]} instead of {name}"
    return failed_or_blocked(f"{what}: {asked[-1].actor} waits for {name}, which nothing offers", hint=hint)


def _clients(run: Run) -> dict[str, str]:
    """Return the actions that nodes of the student's could send goals to, each with its node."""
    topics = [topic for topic in topics_with(run, "publishers") if topic.endswith("/goal")]
    return {topic.removesuffix("/goal"): nodes_on(run, topic, "publishers")[0] for topic in topics}


def _call(run: Run, service: str) -> str:
    if any(f"{service}/status" in event.publishers for _, event in run.graph):
        return action_client(service)
    return service_client(service)


def _unless_over(verdict: Verdict, run: Run) -> Verdict:
    """A program that came to its end has done all that it does; one that ran on may have been late with a call."""
    return verdict if all(one.ended_early for one in lives(run)) else verdict.if_repeated()


def _judge_refusal(run: Run, service: str) -> Verdict | None:
    """Return the verdict where the grader could not offer it, or a client asked for another type."""
    for _, note in run.actors:
        if note.action != "note" or note.topic not in {service, f"{service}/feedback", f"{service}/result"}:
            continue
        if note.detail.startswith(MISFIT):
            kind = (note.type or "").partition("/")[2]
            hint = f"give srv/{kind}.srv the names and types of the handout, and build again"
            return failed_or_blocked(
                f"{service} cannot be offered as the lab asks: {shown(note.detail)}", hint=hint
            )
        if note.detail.startswith(OTHER_TYPE) and run.is_student_node(note.actor):
            theirs, why = note.type or "another type", note.detail.partition(": ")[2]
            hint = "call it with the handout's type"
            if note.type == note.value:
                theirs = f"another definition of {note.type}" + (f" ({shown(why)})" if why else "")
                hint = "give its definition the handout's fields, in their order and with their types, and build again"
            message = f"{note.actor} calls {service} with {theirs}; the server has {note.value}"
            return failed_or_blocked(message, hint=hint)
    return None


def _excuse(verdict: Verdict, run: Run) -> Verdict:
    """Calls that did not come may be the machine's fault; those that came are not."""
    return excused(verdict, run, run.start_ns, run.end_ns, why_late) if verdict.basis.timing else verdict
