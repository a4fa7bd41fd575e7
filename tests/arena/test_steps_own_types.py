"""A call that the student's own `.srv` does not let the grader make is noted as a call without an answer."""

from __future__ import annotations

import asyncio
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from grader.arena.process_environment import ProcessEnvironment
from grader.arena.steps import StepRunner
from grader.evidence.events import MISFIT, ActorEvent
from grader.rubric.scenario import Call


@pytest.mark.parametrize(
    ("text", "type_", "noted"),
    [
        ("int32 b\n---\nint32 sum\n", "lab1/Add", ["", f"{MISFIT}lab1/Add"]),
        (None, "lab1/Add", ["", f"{MISFIT}srv/Add.srv is not there"]),
        ("course_msgs/Lap a\n---\n", "lab1/Add", ["the grader could not call it: "]),
        (None, "course_srvs/Add", ["the grader could not call it: "]),
        (
            "int32 a\nint32 b\n---\nint64 sum",
            "lab1/Add",
            ["", f"{MISFIT}its request has int32 a, int32 b; the"],
        ),
        (
            "int64 b\nint64 a\n---\nint64 sum",
            "lab1/Add",
            ["", f"{MISFIT}its request has int64 b, int64 a; the"],
        ),
        ("int64 a\nint64 b\n---\nint32 sum", "lab1/Add", ["", f"{MISFIT}its response has int32 sum; the"]),
        ("# for the sum of int64 a\n", "lab1/Add", ["", f"{MISFIT}it has no line `---`"]),
    ],
    ids=[
        "other-fields",
        "no-file",
        "a-type-that-this-machine-lacks",
        "another-package",
        "other-types",
        "other-order",
        "other-response",
        "no-field",
    ],
)
def test_whose_definition_it_is_that_does_not_fit(
    text: str | None, type_: str, noted: list[str], tmp_path: Path
) -> None:
    (tmp_path / "lab1" / "srv").mkdir(parents=True)
    if text is not None:
        (tmp_path / "lab1" / "srv" / "Add.srv").write_text(text)
    events: list[ActorEvent] = []
    place: Any = SimpleNamespace(workspace=SimpleNamespace(repaired=tmp_path), share_folders=())
    place.type_text = partial(ProcessEnvironment.type_text, place)
    place.is_own = partial(ProcessEnvironment.is_own, place)
    arena = SimpleNamespace(place=place, note=events.append, ros_now_ns=lambda: 0)
    runner: Any = object.__new__(StepRunner)
    runner._arena = arena
    asked = " a" in (text or "").partition("---")[0].replace("Lap a", "")
    wanted = "int64 a\nint64 b  # the second one\n---\nint64 sum\n" if asked else None
    call = Call(service="/add", type=type_, request={"a": 2}, definition=wanted)
    asyncio.run(runner._ask(call))
    assert [event.action for event in events] == ["call", "answer"][-len(noted) :]
    assert all(event.detail.startswith(begin) for event, begin in zip(events, noted, strict=True))
