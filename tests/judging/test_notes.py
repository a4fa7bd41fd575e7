"""What was noticed while it ran: bounded, once, from the grader's own recordings only."""

from __future__ import annotations

from grader.evidence.events import ActorEvent
from grader.evidence.run import Run
from grader.judging.summary import notes_of
from grader.model.result import Note


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
