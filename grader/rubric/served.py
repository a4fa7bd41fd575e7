"""Faults of the services that the grader offers in a scenario."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from grader.ros_packages import ros_packages
from grader.rubric.source import Fault, KeyPath, as_map, as_maps
from grader.rubric.steps import slash

ANSWERS = ("answer", "answers", "fails")


def served_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with one scenario's `serves`."""
    first: dict[str, int] = {}
    for index, served in as_maps(scenario.get("serves")):
        at, name = (*path, "serves", index), served.get("service")
        yield from slash((*at, "service"), name, "a service")
        if isinstance(name, str) and first.setdefault(name, index) != index:
            yield (*at, "service"), f"{name} is offered by serves[{first[name]}] already"
        given = [key for key in ANSWERS if served.get(key) or served.get(key) == {}]
        if len(given) != 1:
            found = f"{' and '.join(given)} are there" if given else "none is there"
            yield at, f"give one of answer, answers and fails: {found}"
        yield from _misfits(at, served)


def _misfits(at: KeyPath, served: dict[str, Any]) -> Iterator[Fault]:
    """Yield answers that do not fit the type, where its text is known before a run."""
    kind, text = served.get("type"), served.get("definition")
    if not isinstance(kind, str) or "/" not in kind:
        return
    text = text if isinstance(text, str) else ros_packages().service_text(kind)
    if text is None:
        return
    from grader.evidence.message_values import FIRST, ServiceTypes  # noqa: PLC0415 - slow to load, and few rubrics need it

    answers = served.get("answers")
    values: list[tuple[KeyPath, Any]] = (
        [((*at, "answer"), served["answer"])] if as_map(served.get("answer")) else []
    )
    values += [((*at, "answers", n), one) for n, one in as_maps(answers)]
    try:
        response = ServiceTypes(kind, text).response
    except ValueError:  # a type of the student's or the course's in it, known in a run
        return
    for place, value in values:
        if wrong := response.misfit(value, FIRST):
            yield place, wrong
