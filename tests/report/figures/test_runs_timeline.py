"""The timeline of a run: who was there when, what was sent, and what the grader did."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from grader.model.figure import Lane, TimelineFigure
from grader.report.figures.runs import LANES_MAX, STRETCHES_MAX, timeline_of
from grader.report.html.figures import EVENTS_MAX, timeline
from tests.checks.examples import runs_of

OWN = ["/grader_recorder_0a1b2c3d", "/rosout"]
RUN: dict[str, Any] = {
    "processes": [{"name": "talker", "start_s": 0.5, "exit_s": 3.0, "exit_code": 1}],
    "graph": [
        {"nodes": [*OWN, "/talker"], "processes": {"/talker": "talker"}, "at_s": 1},
        {"nodes": OWN, "at_s": 3.2},
    ],
    "topics": [
        {"topic": "/chatter", "callerid": "/talker", "type": "std_msgs/String", "count": 15, "start_s": 1.5},
        {"topic": "/grader/calibration", "callerid": "/grader_calibration_0a1b2c3d", "type": "std_msgs/Int8"},
    ],
    "console": [{"process": "talker", "stream": "stderr", "line": "NameError: x", "at_s": 2.9}],
    "actors": [
        {"action": "publish", "actor": "/grader_actor_0a1b2c3d", "topic": "/go", "value": 3, "at_s": 2.0}
    ],
}


def drawn(**changes: Any) -> TimelineFigure:
    found = timeline_of(runs_of({"run": {**RUN, **changes}})["run"])
    assert found is not None
    return found


def lane(figure: TimelineFigure, kind: str) -> Lane:
    (found,) = [one for one in figure.lanes if one.kind == kind]
    return found


def test_all_that_was_there_but_for_the_graders_own() -> None:
    assert [(one.kind, one.name) for one in drawn().lanes] == [
        ("process", "talker"),
        ("node", "/talker"),
        ("topic", "/chatter"),
        ("log", "stderr"),
        ("grader", "the grader"),
    ]


def test_a_process_ends_where_it_ended_and_how() -> None:
    (life,) = lane(drawn(), "process").stretches
    assert (life.from_s, life.to_s, life.wrong) == (0.5, 3.0, True)
    assert life.says == "ended by itself: exit code 1"


def test_a_node_is_there_while_the_master_lists_it() -> None:
    (there,) = lane(drawn(), "node").stretches
    assert (there.from_s, there.to_s) == (1.0, 3.2)


def test_messages_apart_are_strokes_and_close_ones_a_stretch() -> None:
    assert len(lane(drawn(), "topic").stretches) == 15
    flood = {
        "topic": "/chatter",
        "callerid": "/talker",
        "type": "std_msgs/String",
        "rate_hz": 1000,
        "count": 2000,
    }
    assert len(lane(drawn(topics=[flood]), "topic").stretches) == 1
    uneven = [{**flood, "rate_hz": 30, "count": 300}]
    assert len(lane(drawn(topics=uneven), "topic").stretches) <= STRETCHES_MAX


def test_what_was_printed_on_stderr_and_what_the_grader_did() -> None:
    (error,) = lane(drawn(), "log").stretches
    assert (error.from_s, error.says, error.wrong) == (2.9, "talker: NameError: x", True)
    (did,) = lane(drawn(), "grader").stretches
    assert (did.from_s, did.says) == (2.0, "publish /go 3")


def test_the_same_as_a_list_in_order() -> None:
    said = [f"{one.at_s:g} {one.who} {one.says}" for one in timeline(drawn()).happened]
    assert said == [
        "0.5 process talker started",
        "1 node /talker registered with the master",
        "1.5 topic /chatter first message",
        "2 the grader publish /go 3",
        "2.9 topic /chatter last message",
        "2.9 log stderr talker: NameError: x",
        "3 process talker ended by itself: exit code 1",
    ]


def test_it_is_of_bounded_size() -> None:
    many = [{"name": f"p{i}", "start_s": i / 100, "exit_s": 3.0} for i in range(100)]
    figure = drawn(processes=many, console=[{"process": "p1", "stream": "stderr", "lines": ["x"] * 500}])
    assert len(figure.lanes) == LANES_MAX
    assert figure.left_out > 0
    made = timeline(figure)
    assert len(made.happened) <= EVENTS_MAX
    assert made.lanes[0] == ("process", "p0")


def test_another_tools_recording_has_none() -> None:
    run = runs_of({"run": {"topics": [{"topic": "/chatter"}]}})["run"]
    assert timeline_of(replace(run, metadata={}, graph=(), processes=())) is None
