"""What blocks what, whose fault nothing is, and how points are given."""

from __future__ import annotations

from typing import Any

import pytest

from grader.checks import CHECKS
from grader.checks.support.exit_causes import Ending
from grader.judging import judge
from grader.judging.requirements import charge_once
from grader.model.result import CriterionResult
from grader.model.verdict import Status, Verdict, failed, partial, passed
from grader.package.launch import parse_launch_files
from grader.rubric.message_fields import said_types
from tests.support.rubrics import (
    ALL,
    CHATTER,
    EXECUTABLE,
    GOOD_RUN,
    NODE,
    PACKAGE,
    RATE,
    SCENARIO,
    SCRIPT,
    rubric,
)
from tests.support.timeline import build_runs

DIED = {"processes": [{"name": "talker", "exit_s": 0.3, "exit_code": 1}], "outcome": "ended"}


def results(timeline: dict[str, Any], *criteria: dict[str, Any], **keys: Any) -> dict[str, CriterionResult]:
    found = judge(rubric(*(criteria or ALL), **keys), build_runs(timeline))
    return {r.id: r for r in found}


def statuses(found: dict[str, CriterionResult]) -> dict[str, str]:
    return {name: r.status.value for name, r in found.items()}


def test_all_pass_in_the_rubrics_order() -> None:
    found = results({"runs": {"talker": GOOD_RUN}, "package": PACKAGE})
    assert statuses(found) == dict.fromkeys(["rate", "chatter", "node", "executable"], "pass")
    assert list(found) == ["rate", "chatter", "node", "executable"]
    assert all(r.points == r.max_points == 10 for r in found.values())


def test_blocked_names_the_root() -> None:
    found = results({"runs": {"talker": DIED}, "package": PACKAGE})
    assert statuses(found) == {"rate": "blocked", "chatter": "blocked", "node": "fail", "executable": "pass"}
    for name in ("rate", "chatter"):
        assert found[name].message.startswith("blocked by node: talker ended by itself")
        assert found[name].hint == "fix node first"
        assert found[name].points == 0


@pytest.mark.parametrize("recorded", [True, False])
def test_a_missing_script_blocks_everything_that_needs_it(recorded: bool) -> None:
    """Also where the arena had nothing to run, and where there is no arena."""
    runs = {"talker": {"outcome": "ended", "graph": []}} if recorded else {}
    found = results({"runs": runs, "package": {"files": []}})
    assert statuses(found) == {
        "rate": "blocked",
        "chatter": "blocked",
        "node": "blocked",
        "executable": "fail",
    }
    assert found["rate"].message.startswith(
        "blocked by executable: src/numeric_talker.py is not in the package"
    )


def test_an_empty_script_is_told_once() -> None:
    file = {
        "path": EXECUTABLE["with"]["path"],
        "shebang_problem": "the file is empty",
        "shebang_fault": "empty-file",
    }
    named = {**NODE, "check": "node-name", "with": {"names": ["talker"], "process": "talker"}}
    run = {
        "processes": [{"name": "talker", "script": file["path"], "exit_s": 0.2, "exit_code": 0}],
        "outcome": "ended",
    }
    found = judge(
        rubric(EXECUTABLE, named), build_runs({"runs": {"talker": run}, "package": {"files": [file]}})
    )
    assert [c.status.value for c in found] == ["fail", "blocked"]


def test_what_can_be_judged_is_judged_though_a_requirement_failed() -> None:
    package = {
        "files": [{"path": "src/numeric_talker.py", "executable": False, "shebang": "#!/usr/bin/python3"}]
    }
    found = results({"runs": {"talker": GOOD_RUN}, "package": package})
    assert statuses(found) == {"rate": "pass", "chatter": "pass", "node": "pass", "executable": "fail"}


def test_nothing_to_judge_and_nothing_that_explains_it_is_a_fail() -> None:
    free = {**RATE, "requires": []}
    found = results({"runs": {"talker": DIED}, "package": PACKAGE}, free)
    assert found["rate"].status is Status.FAIL
    assert found["rate"].hint


def test_nothing_to_judge_because_of_something_open_is_open() -> None:
    package = {
        "files": [{"path": "src/numeric_talker.py", "executable": None, "shebang": "#!/usr/bin/python3"}]
    }
    found = results({"runs": {"talker": {"outcome": "ended"}}, "package": package})
    assert statuses(found) == dict.fromkeys(["rate", "chatter", "node", "executable"], "inconclusive")
    assert "executable could not be judged" in found["node"].message


def test_no_ros_leaves_the_static_criteria_judged() -> None:
    reason = "no ROS 1 on this machine"
    timeline = {"runs": {"package": {"package": PACKAGE, "metadata": {"not_run": reason}}}}
    found = results(timeline)
    assert statuses(found) == {
        "rate": "inconclusive",
        "chatter": "inconclusive",
        "node": "inconclusive",
        "executable": "pass",
    }
    assert reason in found["rate"].message
    assert "apt-get install" in found["rate"].hint


@pytest.mark.parametrize("outcome", ["host", None])
def test_a_run_that_the_machine_lost_is_held_against_nobody(outcome: str | None) -> None:
    run = {**GOOD_RUN, "topics": [], "outcome": outcome, "outcome_detail": "the roscore ended"}
    found = results({"runs": {"talker": run}, "package": PACKAGE})
    assert found["chatter"].status is Status.INCONCLUSIVE
    if outcome:
        assert "the roscore ended" in found["chatter"].message


def test_no_evidence_at_all_is_inconclusive() -> None:
    found = {r.id: r for r in judge(rubric(*ALL), {})}
    assert statuses(found) == dict.fromkeys(["rate", "chatter", "node", "executable"], "inconclusive")


def test_a_check_that_breaks_is_an_error_and_no_lost_mark(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(**_: object) -> Verdict:
        raise ZeroDivisionError("secret detail")

    monkeypatch.setitem(CHECKS, "rate", _with_function("rate", broken))
    found = results({"runs": {"talker": GOOD_RUN}, "package": PACKAGE})
    assert found["rate"].status is Status.ERROR
    assert "ZeroDivisionError" in found["rate"].message
    assert "secret" not in found["rate"].message
    assert found["chatter"].status is Status.PASS


def test_unknown_check_and_bad_parameters_are_errors() -> None:
    unknown = {"id": "a", "check": "no-such-check"}
    bad = {"id": "b", "check": "rate", "with": {"rate": 10}, "scenario": "talker"}
    found = results({"runs": {"talker": GOOD_RUN}, "package": PACKAGE}, unknown, bad)
    assert statuses(found) == {"a": "error", "b": "error"}


def test_manual_is_left_to_a_person() -> None:
    found = results({"package": PACKAGE}, {"id": "a", "check": "manual"})
    assert (found["a"].status, found["a"].points) == (Status.MANUAL, 0)


@pytest.mark.parametrize(
    ("score", "points", "digits", "expected"),
    [
        (1 / 3, 15, 1, 5.0),
        (1 / 3, 10, 1, 3.3),
        (0.45, 5, 1, 2.3),
        (0.5, 2.5, 1, 1.3),
        (0.5, 5, 0, 3.0),
        (0.125, 1, 2, 0.13),
    ],
)
def test_points_are_rounded_half_up(
    score: float, points: float, digits: int, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(CHECKS, "rate", _with_function("rate", lambda **_: partial(score, "some")))
    found = results(
        {"runs": {"talker": GOOD_RUN}, "package": PACKAGE},
        {**RATE, "requires": [], "points": points},
        digits=digits,
    )
    assert found["rate"].points == expected


def test_the_rubrics_hint_stands_in_where_the_check_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CHECKS, "rate", _with_function("rate", lambda **_: partial(0.5, "some")))
    timeline = {"runs": {"talker": GOOD_RUN}, "package": PACKAGE}
    found = results(
        timeline, {**RATE, "requires": [], "hint": "look here", "reproduce": "rostopic hz /chatter"}
    )
    assert found["rate"].hint == "look here"
    assert found["rate"].reproduce == "rostopic hz /chatter"
    passed = results(timeline, EXECUTABLE, NODE, {**CHATTER, "hint": "look here"})
    assert passed["chatter"].hint == ""


def _with_function(name: str, function: Any) -> Any:
    from dataclasses import replace  # noqa: PLC0415 - beside its only use

    return replace(CHECKS[name], function=function)


SIMULATOR = {"name": "turtlesim", "role": "grader", "exit_s": 0.4}
SAID = [{"process": "turtlesim", "at_s": 0.3, "line": "ERROR: cannot open the display"}]


@pytest.mark.parametrize(
    ("end", "lines", "status", "how"),
    [
        ({"exit_code": 3}, SAID, "inconclusive", "exit code 3: ERROR: cannot open the display"),
        ({"signal": 11}, [], "inconclusive", "turtlesim ended with signal 11"),
        ({"exit_code": 0}, SAID, "pass", ""),
        ({"exit_code": 1, "exit_s": 6.9, "stopped_by": "INT", "nodes": ["/turtlesim"]}, SAID, "pass", ""),
        (
            {"exit_code": 1, "exit_s": 6.9, "stopped_by": "INT"},
            SAID,
            "inconclusive",
            "and never became a node: ERROR: cannot open the display",
        ),
        (
            {"exit_code": 1},
            [{**SAID[0], "line": "shutdown request: new node registered with same name"}],
            "pass",
            "",
        ),
    ],
    ids=["exit-code", "signal", "done", "stopped", "no-node", "shut-down-by-another-node"],
)
def test_a_program_of_the_graders_that_fails_is_the_machines_fault(
    end: dict[str, Any], lines: list[dict[str, Any]], status: str, how: str
) -> None:
    start = [{"name": "turtlesim", "program": "turtlesim/turtlesim_node"}, *SCENARIO["start"]]
    talker = {**GOOD_RUN["processes"][0], "nodes": ["/talker"]}
    run = {**GOOD_RUN, "processes": [talker, SIMULATOR | end], "console": lines}
    found = results(
        {"runs": {"talker": run}, "package": PACKAGE}, scenarios={"talker": {**SCENARIO, "start": start}}
    )
    assert statuses(found) == dict.fromkeys(["rate", "chatter", "node"], status) | {"executable": "pass"}
    assert how in found["rate"].message
    assert (status == "pass") or "one of the grader's programs failed in the run 'talker'" in found[
        "rate"
    ].message


HANDOUT = "The node alarm hears /level, a std_msgs/Float32, and answers on /alarm."
CONVERTS = "The node percent publishes what it hears on /level as a std_msgs/Float64 on /percent."
ANSWERS = {
    "id": "answers",
    "check": "reacts",
    "with": {
        "cause": {"topic": "/level", "field": "data", "min": 6},
        "effect": {"topic": "/alarm", "field": "data", "value": True},
        "within_s": 0.5,
    },
    "scenario": "talker",
}
FED = {"topic": "/level", "type": "std_msgs/Float32", "callerid": "/tank", "values": [1.0, 3.0, 5.0]}
ALARM = {"topic": "/alarm", "type": "std_msgs/Bool", "callerid": "/alarm", "values": [False]}
ENDS, RUNS_ON = {"exit_s": 0.9, "exit_code": 0}, {"exit_s": 2.0, "stopped_by": "INT"}


@pytest.mark.parametrize(
    ("fed", "end", "heard", "otherwise"),
    [
        ({"topic": "/levels"}, RUNS_ON, {}, "tank publishes on /levels, and the rubric names /level"),
        (
            {"type": "std_msgs/Int32", "values": [1]},
            RUNS_ON,
            {},
            "tank publishes std_msgs/Int32 on /level, and the handout says std_msgs/Float32",
        ),
        ({}, ENDS, {}, "tank ended, and data of /level at least 6 never came"),
        # here the student may have kept it from coming, or came too early to its end
        ({}, RUNS_ON, {}, ""),
        ({}, ENDS, {"/alarm": ["/tank"]}, ""),
        # the cause came, or it is the student who hears a topic that the rubric does not have
        ({"values": [1.0, 7.0]}, ENDS, {}, ""),
        ({}, RUNS_ON, {"/level": [], "/levels": ["/alarm"]}, ""),
        # a node that hears what another run sends, and one by whose hand the program ended
        ({"topic": "/status"}, RUNS_ON, {}, ""),
        ({}, {**ENDS, "shut_down": True}, {}, ""),
    ],
    ids=[
        "topic",
        "type",
        "ends",
        "runs-on",
        "closed-loop",
        "came",
        "students-topic",
        "other-run",
        "shut-down",
    ],
)
def test_a_program_that_contradicts_the_rubric_costs_no_student_a_mark(
    fed: dict[str, Any], end: dict[str, Any], heard: dict[str, list[str]], otherwise: str
) -> None:
    start = [{"name": "tank", "program": "course_sim/tank.py"}, *SCENARIO["start"]]
    shut_down = {
        "process": "tank",
        "at_s": 0.8,
        "line": "shutdown request: new node registered with same name",
    }
    console = [shut_down] if "shut_down" in end else []
    end = {key: value for key, value in end.items() if key != "shut_down"}
    topics = [FED | fed, ALARM]
    subscribers = {"/level": ["/alarm"], **heard}
    types = dict.fromkeys(subscribers, FED["type"]) | {one["topic"]: one["type"] for one in topics}
    graph = {
        "nodes": ["/tank", "/alarm"],
        "processes": {"/tank": "tank", "/alarm": "talker"},
        "topic_types": types,
        "publishers": {one["topic"]: [one["callerid"]] for one in topics},
        "subscribers": subscribers,
        "connections": [
            {"topic": one["topic"], "publisher": one["callerid"], "subscriber": hearer}
            for one in topics
            for hearer in subscribers.get(one["topic"], ())
        ],
    }
    run = {
        "topics": topics,
        "graph": [graph],
        "console": console,
        "processes": [
            {"name": "tank", "role": "grader", **end},
            {"name": "talker", "stopped_by": "INT", "exit_code": 0},
        ],
    }
    found = results(
        {"runs": {"talker": run}, "package": PACKAGE},
        ANSWERS,
        scenarios={"talker": {**SCENARIO, "start": start}},
        handout=HANDOUT,
    )["answers"]
    assert otherwise in found.message
    assert ("contradict each other" in found.message) == bool(otherwise)
    assert not otherwise or found.status is Status.INCONCLUSIVE


def test_what_else_is_wrong_with_a_node_is_no_reason_for_its_end() -> None:
    named = {
        "id": "node",
        "check": "node-name",
        "with": {"process": "talker", "names": ["talker"], "anonymous": "forbidden"},
        "scenario": "talker",
    }
    lines = [
        "Traceback (most recent call last):",
        '  File "/ws/src/lab1/src/numeric_talker.py", line 3, in <module>',
        "EOFError: EOF when reading a line",
    ]
    run = {
        "processes": [{"name": "talker", "nodes": ["/other"], "exit_s": 0.5, "exit_code": 1}],
        "console": [{"process": "talker", "stream": "stderr", "at_s": 0.4, "every_s": 0.001, "lines": lines}],
        "outcome": "ended",
    }
    runs = build_runs({"runs": {"talker": run}, "package": PACKAGE})
    found = {c.id: c for c in judge(rubric(named, CHATTER, RATE), runs)}
    assert (found["node"].status.value, found["chatter"].status.value) == ("fail", "fail")
    assert "EOFError" in found["chatter"].message
    assert found["rate"].blocked_by == "chatter"
    assert found["rate"].message.count("EOFError") == 1


@pytest.mark.parametrize(
    ("raised", "judged", "blocked_by"), [(True, "", "rate"), (True, "chatter", ""), (False, "", "")]
)
def test_an_exception_is_charged_once(raised: bool, judged: str, blocked_by: str) -> None:
    """Also where its node goes on. What a repaired copy has judged keeps its share."""
    end = Ending("NameError: name 'a' is not defined (src/a.py, line 3)", "x", raised=raised)
    lost = {name: end.verdict(failed, "it never moves") for name in "ab"}
    verdicts = {"rate": lost["a"], "chatter": lost["b"]}
    told = charge_once(rubric({**RATE, "requires": []}, {**CHATTER, "requires": []}), verdicts, {judged})
    assert told["rate"] == lost["a"]
    assert told["chatter"].blocked_by == blocked_by
    asking = {**CHATTER, "requires": [], "check": "callbacks-clean", "with": {"process": "talker"}}
    told = charge_once(rubric({**RATE, "requires": []}, asking), verdicts, {judged})
    assert told["rate"].blocked_by == ("chatter" if blocked_by else "")


@pytest.mark.parametrize(
    ("basis", "root"), [({"unbuilt": True}, "build"), ({"judged_by": "definition"}, "fields")]
)
def test_what_the_files_are_lost_to_is_charged_there(basis: dict[str, object], root: str) -> None:
    """What is blocked by a criterion that is blocked itself names the root of both."""
    of_file = {"file": "msg/Num.msg", "fields": {"num": "int64"}}
    asked = [{"id": "build", "check": "build"}, {"id": "fields", "check": "definition", "with": of_file}]
    rated, said = ({**one, "requires": []} for one in (RATE, CHATTER))
    lost = failed("it is lost", hint="x")
    blocked = lost.model_copy(
        update={"status": Status.BLOCKED, "message": "blocked by rate: it is lost", "blocked_by": "rate"}
    )
    verdicts = {"build": lost, "fields": lost, "rate": lost.based_on(**basis), "chatter": blocked}
    told = charge_once(rubric(*asked, rated, said), verdicts)
    assert {told[name].blocked_by for name in ("rate", "chatter")} == {root}
    assert told["chatter"].message.startswith(f"blocked by {root}: ")
    passed_files = {**verdicts, "build": passed("x"), "fields": passed("x")}
    assert charge_once(rubric(*asked, rated, said), passed_files) == passed_files


def test_what_two_criteria_ask_of_one_thing_is_charged_once() -> None:
    """A word that both share; one that may be true by chance explains only beside a criterion that is lost to it."""
    asked = {**RATE, "requires": []}, {**CHATTER, "requires": []}
    lost = failed("it is lost", hint="x")
    missing, bound = ("no table.csv",), ("power: above 100",)
    cases = [
        ({"lost_to": missing}, {"lost_to": missing}, "", "rate"),
        ({"lost_to": missing}, {"lost_to": bound}, "", ""),
        ({"beyond": bound}, {"lost_to": bound}, "chatter", ""),
        ({"beyond": bound}, {"beyond": bound}, "", ""),
    ]
    for one, other, rate, chatter in cases:
        verdicts = {"rate": lost.based_on(**one), "chatter": lost.based_on(**other)}
        told = charge_once(rubric(*asked), verdicts)
        assert (told["rate"].blocked_by, told["chatter"].blocked_by) == (rate, chatter)


def test_another_name_is_no_reason_for_silence() -> None:
    named = {
        "id": "node",
        "check": "node-name",
        "with": {"process": "talker", "names": ["talker"]},
        "scenario": "talker",
    }
    says = {
        "id": "says",
        "check": "prints",
        "with": {"process": "talker", "text": "done"},
        "scenario": "talker",
    }
    asked = [{**RATE, "requires": ["node"]}, {**says, "requires": ["node"]}]
    silent = {"processes": [{"name": "talker", "nodes": ["/other"], "stopped_by": "INT", "exit_s": 9}]}
    runs = build_runs({"runs": {"talker": silent | {"actors": GOOD_RUN["actors"]}}, "package": PACKAGE})
    found = {c.id: c for c in judge(rubric(named, *asked), runs)}
    assert {c.status.value for c in found.values()} == {"fail"}
    assert found["says"].message == "it prints nothing, not 'done'"
    gone = build_runs({"runs": {"talker": {"outcome": "ended"}}, "package": PACKAGE})
    found = {c.id: c for c in judge(rubric(named, *asked), gone)}
    assert found["rate"].blocked_by == found["says"].blocked_by == "node"


def test_what_another_run_lost_is_a_reason_for_a_program_that_prints_nothing() -> None:
    """A client prints nothing where the server, judged in a run of its own, offers no service."""
    offers = {
        "id": "offers",
        "check": "service",
        "with": {"service": "/add", "type": "a/Add"},
        "scenario": "server",
    }
    says = {
        "id": "says",
        "check": "prints",
        "with": {"process": "client", "text": "sum"},
        "scenario": "client",
    }
    runs = {
        name: {"processes": [{"name": name, "nodes": [f"/{name}"], "stopped_by": "INT", "exit_s": 9}]}
        for name in ("server", "client")
    }
    found = results({"runs": runs, "package": PACKAGE}, offers, {**says, "requires": ["offers"]})
    assert statuses(found) == {"offers": "fail", "says": "blocked"}


def test_what_was_seen_of_a_call_is_no_reason_for_a_program_that_prints_nothing() -> None:
    other = {
        "id": "other",
        "check": "rate",
        "with": {"topic": "/chatter", "rate_hz": 50},
        "scenario": "talker",
    }
    says = {
        "id": "says",
        "check": "prints",
        "with": {"process": "talker", "text": "done"},
        "scenario": "talker",
    }
    found = results(
        {"runs": {"talker": GOOD_RUN}, "package": PACKAGE}, other, {**says, "requires": ["other"]}
    )
    assert statuses(found) == {"other": "fail", "says": "fail"}


def test_a_loop_that_does_not_sleep_is_named_on_another_topic_too() -> None:
    flood = {**GOOD_RUN, "topics": [{"topic": "/blabla", "count": 6000, "rate_hz": 1000}]}
    asked = {"file": SCRIPT["path"], "line": 5, "kind": "rate-number"}
    for number, status in (("10", "fail"), ("2", "blocked")):
        package = {**PACKAGE, "slips": [{**asked, "message": number}]}
        found = results({"runs": {"talker": flood}, "package": package})
        assert found["rate"].status.value == status
        assert ("the loop does not sleep" in found["rate"].message) == (status == "fail")


@pytest.mark.parametrize(
    ("topics", "status", "message"),
    [
        ([{"topic": "/blabla", "count": 13, "rate_hz": 2}], "fail",
         "on /blabla, which comes in place of /chatter: /blabla is too slow"),
        ([{"topic": "/blabla", "count": 61}], "blocked", "blocked by chatter"),
        ([{"topic": "/blabla", "count": 13, "rate_hz": 2}, {"topic": "/other", "count": 13}], "blocked", "blocked by"),
        ([{"topic": "/blabla", "count": 13, "rate_hz": 2},
          {"topic": "/number", "type": "std_msgs/Int8", "count": 9, "values": {"count_from": 0}}], "fail", "on "),
        ([{"topic": "/chater", "count": 13, "rate_hz": 2}], "blocked", "blocked by chatter"),
    ],
)  # fmt: skip
def test_what_is_wrong_on_another_topic_is_named_behind_the_topic(
    topics: list[dict[str, Any]], status: str, message: str
) -> None:
    found = results({"runs": {"talker": {**GOOD_RUN, "topics": topics}}, "package": PACKAGE})
    assert found["chatter"].status is Status.FAIL
    assert found["rate"].status.value == status
    assert found["rate"].message.startswith(message)
    assert found["rate"].points == 0


def test_a_node_that_ended_tells_what_its_script_would_lose_next() -> None:
    """As far as it is plain in the source: rates, topics, types and names behind the error that came first."""
    script = "src/numeric_talker.py"
    slips = [
        {"file": script, "line": 5, "kind": "publisher", "message": "position"},
        {"file": script, "line": 5, "kind": "publisher-type", "message": "Twist"},
        {"file": script, "line": 6, "kind": "node-name", "message": "talker"},
        {"file": script, "line": 7, "kind": "rate-number", "message": "0.5"},
    ]
    lines = [
        "Traceback (most recent call last):",
        f'  File "/ws/src/lab1/{script}", line 3, in <module>',
        "EOFError: EOF when reading a line",
    ]
    run = {
        "processes": [{"name": "talker", "script": script, "exit_s": 0.5, "exit_code": 1}],
        "console": [{"process": "talker", "stream": "stderr", "at_s": 0.4, "every_s": 0.001, "lines": lines}],
        "outcome": "ended",
    }
    right = [
        {"file": script, "line": 5, "kind": "publisher", "message": "/chatter"},
        {"file": script, "line": 5, "kind": "publisher-type", "message": "String"},
        {"file": script, "line": 7, "kind": "rate-number", "message": "10"},
    ]
    hints = []
    for found in (slips, right):
        package = {**PACKAGE, "slips": found}
        runs = build_runs({"runs": {"talker": run}, "package": package})
        judged = {c.id: c for c in judge(rubric(NODE | {"requires": []}, CHATTER, RATE), runs)}
        assert {c.status.value for c in judged.values()} == {"fail", "blocked"}
        hints.append(judged["node"].hint)
    assert hints[0] == (
        f"{hints[1]}; then publish on /chatter on line 5 of {script}, not on position, "
        f"publish std_msgs/String on line 5 of {script}, not Twist and "
        f"make it 10 Hz on line 7 of {script}, which asks for 0.5 Hz"
    )
    assert "then" not in hints[1]


def test_what_is_named_as_absent_explains_more_than_another_loss() -> None:
    asked = rubric(
        EXECUTABLE,
        {"id": "cmake", "check": "cmake", "with": {"name": "lab1"}},
        {
            "id": "install",
            "check": "cmake-install",
            "with": {"scripts": ["src/numeric_talker.py", "src/numeric_listener.py"]},
            "requires": ["executable", "cmake"],
        },
    )
    package = {"files": [{"path": "src/numeric_listener.py"}], "manifest": {}}
    found = {c.id: c for c in judge(asked, build_runs({"runs": {}, "package": package}))}
    assert found["executable"].status.is_lost
    assert found["install"].blocked_by == "cmake"


def test_a_type_of_another_topic_in_the_same_sentence_is_not_the_first_ones() -> None:
    assert list(said_types("/level", HANDOUT)) == ["std_msgs/Float32"]
    assert list(said_types("/level", CONVERTS)) == []
    assert list(said_types("/percent", CONVERTS)) == ["std_msgs/Float64"]


def test_a_build_that_also_runs_is_blocked_by_the_manifest_too() -> None:
    named = {"id": "manifest", "check": "manifest", "with": {"name": "lab1"}}
    built = {"id": "build", "check": "build-and-run", "scenario": "talker", "requires": ["manifest"]}
    made = {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0, "exit_s": 2}]}
    runs = {"talker": {}, "package": made}
    found = judge(
        rubric(named, built), build_runs({"runs": runs, "package": {"files": [{"path": "CMakeLists.txt"}]}})
    )
    assert [c.status.value for c in found] == ["fail", "blocked"]


@pytest.mark.parametrize(("named", "status"), [("lab1", "fail"), ("lab_1", "blocked")])
def test_what_a_manifest_lacks_is_no_reason_for_a_launch_file_with_another_name(
    named: str, status: str
) -> None:
    """With the right name in it, the launch file's is wrong; with another one, both are put right there."""
    manifest = {"id": "manifest", "check": "manifest", "with": {"name": "lab1", "dependencies": ["rospy"]}}
    launch = {
        "id": "launch-xml",
        "check": "launch-xml",
        "with": {"launch": "a.launch", "scripts": ["src/a.py"]},
        "requires": ["manifest"],
    }
    text = b'<launch>\n  <node pkg="week1" type="a.py" name="a"/>\n</launch>\n'
    package = {
        "name": named,
        "path": "week1",
        "files": [{"path": "src/a.py"}],
        "manifest": {"name": named},
        "launch_files": [one.model_dump() for one in parse_launch_files({"launch/a.launch": text}, (named,))],
    }
    found = judge(rubric(manifest, launch), build_runs({"runs": {}, "package": package}))
    assert [c.status.value for c in found] == ["fail", status]
