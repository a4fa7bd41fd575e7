"""Faults of the services and actions that the grader offers in a scenario."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from grader.ros_packages import ros_packages
from grader.rubric.source import Fault, KeyPath, as_map, as_maps
from grader.rubric.steps import slash

ANSWERS = ("answer", "answers", "fails")
PARTS = ("Result", "Feedback")
OF_SERVICES, OF_ACTIONS = (*ANSWERS, "definition"), ("feedback", "result", "ends")


def served_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with one scenario's `serves`."""
    first: dict[str, int] = {}
    for index, served in as_maps(scenario.get("serves")):
        at, kinds = (*path, "serves", index), [key for key in ("service", "action") if served.get(key)]
        if len(kinds) != 1:
            yield at, f"give one of service and action, not {'both' if kinds else 'neither'}"
            continue
        (kind,) = kinds
        name = served[kind]
        yield from slash((*at, kind), name, "a service" if kind == "service" else "an action")
        if isinstance(name, str) and first.setdefault(name, index) != index:
            yield (*at, kind), f"{name} is offered by serves[{first[name]}] already"
        for key in OF_ACTIONS if kind == "service" else OF_SERVICES:
            if key in served:
                yield (*at, key), f"is not for {'a service' if kind == 'service' else 'an action'}"
        if kind == "service":
            yield from _answers(at, served)
        yield from _misfits(at, served)


def _answers(at: KeyPath, served: dict[str, Any]) -> Iterator[Fault]:
    given = [key for key in ANSWERS if served.get(key) or served.get(key) == {}]
    if len(given) != 1:
        found = f"{' and '.join(given)} are there" if given else "none is there"
        yield at, f"give one of answer, answers and fails: {found}"


def _misfits(at: KeyPath, served: dict[str, Any]) -> Iterator[Fault]:
    """Yield what does not fit the type, where its text is known before a run."""
    from grader.evidence.message_values import MessageType, ServiceTypes, action_texts  # noqa: PLC0415 - slow to load, and few rubrics need it

    kind, text = served.get("type"), served.get("definition")
    if not isinstance(kind, str) or "/" not in kind:
        return
    if not isinstance(text, str):
        text = ros_packages().text(kind, "srv" if "service" in served else "action")
    if text is None:
        return
    values: list[tuple[MessageType, KeyPath, Any]] = []
    try:
        if "service" in served:
            response = ServiceTypes(kind, text).response
            values += [(response, (*at, "answer"), served["answer"])] if as_map(served.get("answer")) else []
            values += [(response, (*at, "answers", n), one) for n, one in as_maps(served.get("answers"))]
        else:
            result, feedback = (MessageType(f"{kind}{p}", action_texts(kind, text).get) for p in PARTS)
            values += [(result, (*at, "result"), as_map(served.get("result")))]
            values += [(feedback, (*at, "feedback", n), one) for n, one in as_maps(served.get("feedback"))]
    except ValueError:  # a type of the student's or the course's in it, known in a run
        return
    for type_, place, value in values:
        if wrong := type_.misfit(value):
            yield place, wrong
