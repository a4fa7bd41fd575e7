"""Status, points and pass mark of the whole, and the bytes that two commands must agree on."""

from __future__ import annotations

import json

import pytest

from grader.evidence.events import ActorEvent
from grader.evidence.run import Run
from grader.judging import criteria_bytes, judge, overall_status, reached_pass_mark, total_points
from grader.judging.summary import notes_of, round_half_up
from grader.model.result import CriterionResult, Note
from grader.model.verdict import FileCitation, Status
from tests.support.a_class import criterion
from tests.support.rubrics import ALL, GOOD_RUN, PACKAGE, rubric
from tests.support.timeline import build_runs


def result(
    name: str = "a", status: str = "pass", points: float = 10.0, max_points: float = 10.0
) -> CriterionResult:
    about = {"title": "größer", "check": "rate", "message": "m"}
    cited = (FileCitation(file="a.py", line=1),)
    return criterion(name, Status(status), points, max_points, citations=cited, **about)


@pytest.mark.parametrize(
    ("statuses", "expected"),
    [
        (["pass", "fail", "blocked", "partial"], "graded"),
        (["pass", "inconclusive"], "inconclusive"),
        (["pass", "manual"], "inconclusive"),
        (["error", "inconclusive"], "error"),
        ([], "error"),
    ],
)
def test_overall_status(statuses: list[str], expected: str) -> None:
    assert overall_status([result(str(i), s) for i, s in enumerate(statuses)]) == expected


def test_advice_holds_up_nothing() -> None:
    advice = result("b", "inconclusive", 0, 0)
    assert overall_status([result(), advice]) == "graded"
    assert overall_status([advice]) == "error"


def test_total_is_exact() -> None:
    results = [result(str(i), points=0.1, max_points=0.1) for i in range(3)]
    assert total_points(rubric({"id": "a", "check": "rate"}), results) == 0.3


@pytest.mark.parametrize(
    ("value", "digits", "expected"),
    [(2.25, 1, 2.3), (2.35, 1, 2.4), (0.5, 0, 1), (2.675, 2, 2.68), (7, 1, 7)],
)
def test_round_half_up(value: float, digits: int, expected: float) -> None:
    assert round_half_up(value, digits) == expected


def test_without_a_pass_mark_every_visible_criterion_has_to_pass() -> None:
    criteria = rubric(
        {"id": "a", "check": "rate"},
        {"id": "hidden", "check": "rate", "visibility": "hidden"},
        {"id": "advice", "check": "rate", "points": 0},
    )
    others = [result("hidden", "fail", 0), result("advice", "fail", 0, 0)]
    assert reached_pass_mark(criteria, [result("a"), *others])
    assert not reached_pass_mark(criteria, [result("a", "partial", 9), *others])
    assert not reached_pass_mark(criteria, others)
    assert not reached_pass_mark(criteria, [])


def test_bytes_are_canonical() -> None:
    timeline = {"runs": {"talker": GOOD_RUN}, "package": PACKAGE}
    first, second = (criteria_bytes(judge(rubric(*ALL), build_runs(timeline))) for _ in range(2))
    assert first == second
    assert first.endswith(b"]\n")
    assert [c["id"] for c in json.loads(first)] == ["rate", "chatter", "node", "executable"]
    assert "größer".encode() in criteria_bytes([result()])
    assert json.loads(criteria_bytes([result()]))[0]["citations"] == [{"file": "a.py", "line": 1}]


def run(*events: tuple[str, str, str], own: bool = True) -> Run:
    actors = tuple(
        (number, ActorEvent(action=action, actor=actor, detail=detail))
        for number, (action, actor, detail) in enumerate(events)
    )
    metadata = {"format": "1"} if own else {}
    return Run(
        evidence="x.mcap",
        scenario="x",
        clock="real",
        warp=1.0,
        metadata=metadata,
        start_ns=0,
        end_ns=9,
        actors=actors,
    )


SHUTDOWN = ("refused", "talker.py", "asked the master to shut down")


def test_what_was_refused_and_what_was_too_much_in_the_order_of_the_runs():
    flood = ("limit", "/talker", "sent more than 10000 messages on /chatter")
    probe = ("publish", "grader", "")
    found = notes_of(
        {"package": run(("limit", "cmake", "too many processes")), "real": run(probe, flood, SHUTDOWN)}
    )
    assert found == (
        Note(scenario="package", actor="cmake", kind="limit", text="too many processes"),
        Note(scenario="real", actor="talker.py", kind="refused", text="asked the master to shut down"),
        Note(
            scenario="real", actor="/talker", kind="limit", text="sent more than 10000 messages on /chatter"
        ),
    )


def test_equal_ones_are_told_once():
    assert len(notes_of({"real": run(SHUTDOWN, SHUTDOWN, SHUTDOWN)})) == 1
    assert len(notes_of({"real": run(SHUTDOWN), "fast": run(SHUTDOWN)})) == 2


def test_of_many_the_first_are_told_and_the_others_counted():
    many = [("refused", "x", f"called {n}") for n in range(45)] + [
        ("limit", "x", f"sent {n}") for n in range(3)
    ]
    found = notes_of({"real": run(*many)})
    assert [n.kind for n in found] == ["refused"] * 21 + ["limit"] * 3
    assert found[20] == Note(scenario="real", actor="", kind="refused", text="and 25 more of this kind")


def test_long_texts_are_cut():
    (note,) = notes_of({"real": run(("limit", "a" * 10**6, "b" * 10**6))})
    assert len(note.actor) < 200
    assert len(note.text) < 400


def test_a_recording_of_another_tool_has_none():
    assert notes_of({"real": run(SHUTDOWN, own=False)}) == ()
    assert notes_of({}) == ()
