"""Steps and served services of a scenario: what they may say, and every fault with its place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.integrations.platform_exports import Bundle, add_lab
from grader.rubric.consistency import scenario_faults
from grader.rubric.fault_words import model_faults
from grader.rubric.load import load_rubric
from grader.rubric.scenario import Publish, Scenario, Step
from grader.rubric.yaml_lines import RUBRIC, source_of
from tests.evidence.bags import Topic, write_bag
from tests.rubric.samples import faults, spoiled

SCAN = '{topic: /scan, type: sensor_msgs/LaserScan, value: {ranges: {repeat: .inf, count: 8, except: {"2-3": .nan}}}}'
AT = "lab.yaml:11: scenarios.real.steps[0]"


def _with_steps(folder: Path, *steps: str) -> Path:
    return spoiled(folder, ("    until:", f"    steps: [{', '.join(steps)}]\n    until:"))


@pytest.mark.parametrize(
    "step",
    [
        f"{{publish: {SCAN}}}",
        "{publish: {topic: /speed, type: std_msgs/Float64, value: {from: 0, to: .5}, rate_hz: 20, duration_s: 3}}",
        "{publish: {topic: /go, type: std_msgs/Bool, values: [true, false], background: true}}",
        "{publish: {topic: /own, type: lab1/Reading, value: {anything: now}}}",
        "{wait: {seconds: 2}}",
        "{wait: {topic: /cmd_vel, messages: 3, new: true, limit_s: 5}}",
        "{wait: {node: /talker}}",
        "{call: {service: /reset, type: std_srvs/Empty}}",
        "{stop: talker}, {start: talker}, {kill: talker}",
        "{start: talker}, {restart: talker}",
        "{type: {process: talker, line: '3.5'}}",
        "{set_param: {name: /gain, value: [1, 2.5]}}",
        "{action: {name: /count, type: lab1/Count, goal: {target: 5}, cancel_after_s: 2}}",
        "{transform: {parent: map, child: base, translation: [1, {from: 0, to: 2}, 0], duration_s: 2}}",
        "{transform: {parent: base, child: laser, rotation_deg: [0, 0, 180], static: true}}",
    ],
)
def test_sound_steps(step: str, tmp_path: Path) -> None:
    assert load_rubric(_with_steps(tmp_path, step)).rubric.scenarios["real"].steps


def test_what_is_not_finite_stays_as_it_is_written(tmp_path: Path) -> None:
    rubric = load_rubric(_with_steps(tmp_path, f"{{publish: {SCAN}}}")).rubric
    publish = rubric.scenarios["real"].steps[0].publish
    assert publish is not None
    assert publish.value["ranges"] == {"repeat": ".inf", "count": 8, "except": {"2-3": ".nan"}}


@pytest.mark.parametrize(
    ("step", "fault"),
    [
        ("{}", ": give one of publish, wait"),
        ("{wait: {seconds: 1}, call: {service: /a, type: a/B}}", "wait and call are there"),
        ("{publsh: {}}", '.publsh: is not known here (did you mean "publish"?)'),
        (
            "{publish: {topic: go, type: std_msgs/Bool, value: true}}",
            '.publish.topic: a topic begins with a slash: "/go"',
        ),
        ("{publish: {topic: /go, type: std_msgs/Bool}}", ".publish: give one of value and values"),
        ("{publish: {topic: /go, type: std_msgs/Bool, value: 3}}", ".publish.value: 3 is no bool"),
        (
            "{publish: {topic: /go, type: std_msgs/Bol, value: true}}",
            ".publish.type: ROS Noetic has no message type std_msgs/Bol",
        ),
        (
            "{publish: {topic: /x, type: geometry_msgs/Twist, values: [{}, {linar: {}}]}}",
            ".publish.values[1]: geometry_msgs/Twist has no field linar",
        ),
        (
            "{publish: {topic: /x, type: std_msgs/Int8, value: 1, count: 2, duration_s: 3}}",
            ".publish: give count or duration_s, not both",
        ),
        (
            "{publish: {topic: /x, type: std_msgs/Int8, value: 1, rate_hz: .inf}}",
            ".publish.rate_hz: must be a number",
        ),
        (
            "{publish: {topic: /x, type: std_msgs/Int8, value: {from: 0, to: 1}, background: true}}",
            ".publish.value: from and to need a last message",
        ),
        (
            "{publish: {topic: /x, type: std_msgs/Int8, value: 1, duration_s: 601}}",
            ".publish.duration_s: must be at most 600, not 601",
        ),
        ("{wait: {}}", ".wait: give one of seconds, topic and node: none is there"),
        ("{wait: {seconds: 1, new: true}}", ".wait.new: is for a topic"),
        ("{wait: {node: talker}}", '.wait.node: a node\'s name begins with a slash: "/talker"'),
        (
            "{action: {name: count, type: lab1/Count}}",
            '.action.name: an action begins with a slash: "/count"',
        ),
        ("{set_param: {name: gain, value: 1}}", '.set_param.name: a parameter begins with a slash: "/gain"'),
        (
            "{set_param: {name: /gain, value: .inf}}",
            ".set_param.value: is not a value that the parameter server takes",
        ),
        (
            "{transform: {parent: a, child: b, translation: [1, 2]}}",
            ".transform.translation: needs at least 3, has 2",
        ),
        (
            "{transform: {parent: a, child: b, static: true, count: 2}}",
            ".transform.count: is not for a static",
        ),
        (
            "{transform: {parent: a, child: b, translation: [far, 0, 0]}}",
            ".transform: 'far' is no float64",
        ),
        ("{stop: taker}", '.stop: there is no start "taker" (did you mean "talker"?)'),
        ("{type: {process: taker, line: a}}", '.type.process: there is no start "taker" (did you mean'),
        ("{type: {process: talker, line: 5}}", ".type.line: must be text, not 5: put it in quotes"),
        (
            "{call: {service: reset, type: std_srvs/Empty}}",
            '.call.service: a service begins with a slash: "/reset"',
        ),
    ],
)
def test_steps_that_make_no_sense(step: str, fault: str, tmp_path: Path) -> None:
    found = faults(_with_steps(tmp_path, step))
    assert any(line.startswith(AT) and fault in line for line in found), found


def test_steps_that_last_too_long_or_mix_types(tmp_path: Path) -> None:
    go = "{{publish: {{topic: /go, type: std_msgs/{}, value: 1}}}}"
    found = faults(
        _with_steps(tmp_path, *["{wait: {seconds: 600}}"] * 3, go.format("Int8"), go.format("Int16"))
    )
    assert any("scenarios.real.steps: last 1800 s in total, at most 1200 s" in line for line in found), found
    assert any(
        "steps[4].publish.type: an earlier step publishes std_msgs/Int8 on /go" in line for line in found
    ), found


@pytest.mark.parametrize(
    ("steps", "fault"),
    [
        ("{start: talker}, {start: talker}", '[1].start: "talker" runs already'),
        ("{stop: talker}, {kill: talker}", '[1].kill: "talker" does not run'),
    ],
)
def test_processes_that_cannot_be_started_or_stopped(steps: str, fault: str, tmp_path: Path) -> None:
    assert any(f"scenarios.real.steps{fault}" in line for line in faults(_with_steps(tmp_path, steps)))


WORDS = Topic("/words", "std_msgs/String", ["one", "two"])


def test_a_recording_belongs_to_the_rubric(tmp_path: Path) -> None:
    path = _with_steps(tmp_path, "{play: {bag: words.bag, topics: [/words]}}")
    write_bag(tmp_path / "words.bag", WORDS)
    before = load_rubric(str(path)).digest
    (tmp_path / "words.bag").unlink()
    write_bag(tmp_path / "words.bag", WORDS._replace(values=["one", "three"]))
    assert load_rubric(str(path)).digest != before


def test_a_recording_goes_with_the_rubric_to_a_platform(tmp_path: Path) -> None:
    write_bag(tmp_path / "words.bag", WORDS)
    rubric = load_rubric(str(_with_steps(tmp_path, "{play: {bag: words.bag}}")))
    bundle = Bundle()
    add_lab(bundle, rubric, "lab")
    assert "lab/words.bag" in [path for path, _, _ in bundle.entries()]


@pytest.mark.parametrize(
    ("play", "fault"),
    [
        ("bag: none.bag", ".bag: none.bag cannot be read beside the rubric: No such file"),
        ("bag: ../words.bag", ".bag: must name a recording beside the rubric, like bags/corridor.bag"),
        ("bag: lab.yaml", ".bag: must name a recording beside the rubric"),
        ("bag: odd.bag", ".bag: cannot be played: "),
        ("bag: words.bag, topics: [/word]", '.topics[0]: words.bag has no /word (did you mean "/words"?)'),
        ("bag: words.bag, topics: [words]", '.topics[0]: a topic begins with a slash: "/words"'),
    ],
)
def test_recordings_that_cannot_be_played(play: str, fault: str, tmp_path: Path) -> None:
    write_bag(tmp_path / "words.bag", WORDS)
    (tmp_path / "odd.bag").write_bytes(b"#ROSBAG V2.0\nodd")
    found = faults(_with_steps(tmp_path, f"{{play: {{{play}}}}}"))
    assert any(line.startswith(f"{AT}.play{fault}") for line in found), found


@pytest.mark.parametrize(
    ("steps", "later"),
    [
        ([{"start": "a"}, {"stop": "b"}], {"a"}),
        ([{"stop": "a"}, {"start": "a"}], set()),
        ([{"restart": "a"}], set()),
    ],
)
def test_what_a_step_starts_is_not_started_before(steps: list[dict[str, str]], later: set[str]) -> None:
    assert Scenario.model_validate({"title": "a", "steps": steps}).started_later == later


@pytest.mark.parametrize(
    ("steps", "again"),
    [
        ([{"start": "a"}, {"stop": "b"}], set()),
        ([{"stop": "a"}, {"start": "a"}], {"a"}),
        ([{"start": "a"}, {"kill": "a"}, {"start": "a"}], {"a"}),
        ([{"start": "a"}, {"restart": "b"}], {"b"}),
    ],
)
def test_what_may_be_started_again(steps: list[dict[str, str]], again: set[str]) -> None:
    assert Scenario.model_validate({"title": "a", "steps": steps}).started_again == again


@pytest.mark.parametrize(
    ("given", "total"),
    [
        ({"value": 1}, 1),
        ({"values": (1, 2, 3)}, 3),
        ({"value": 1, "count": 7}, 7),
        ({"value": 1, "duration_s": 2.5, "rate_hz": 20.0}, 50),
        ({"value": 1, "background": True}, None),
        ({"value": 1, "background": True, "count": 5}, 5),
    ],
)
def test_how_many_messages_it_is(given: dict[str, object], total: int | None) -> None:
    assert Publish.model_validate({"topic": "/x", "type": "std_msgs/Int8", **given}).total == total


def test_a_scenario_without_steps_is_the_one_that_it_was() -> None:
    one = Scenario(title="one")
    assert one.digest == "d0701fab35a86961129464233349b74a406aa6d6e92b02c1461b9c93ea88a9c6"
    assert one.model_copy(update={"steps": (Step(),)}).digest != one.digest


def _examples() -> list[str]:
    text = (Path(__file__).parents[2] / "docs/how-to/steps.md").read_text(encoding="utf-8")
    return re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)


@pytest.mark.parametrize("example", _examples())
def test_the_examples_of_the_docs_are_sound(example: str) -> None:
    data = source_of(example.encode(), "steps.md", RUBRIC).data
    assert isinstance(data, dict)
    start = [{"name": name, "script": f"{name}.py"} for name in ("talker", "avoider")]
    found = data.get("scenarios", {"one": {"title": "One", "start": start, "until": {"nodes": 1}, **data}})
    for name, scenario in found.items():
        assert [*model_faults(Scenario, scenario), *scenario_faults((name,), scenario)] == []


SERVES_AT = "lab.yaml:11: scenarios.real.serves[0]"
OWN = "service: /add, type: lab1/Add"
TEXT = r'definition: "int64 a\n---\nint64 sum"'


def _serving(folder: Path, served: str) -> Path:
    return spoiled(folder, ("    until:", f"    serves: [{served}]\n    until:"))


@pytest.mark.parametrize(
    "served",
    [
        "{action: /count, type: lab1/Count, feedback: [{count: 1}], result: {total: 3}, ends: aborted, delay_s: 1}",
        f"{{{OWN}, answer: {{sum: 7}}}}",
        f"{{{OWN}, answers: [{{sum: 7}}, {{sum: 8}}], delay_s: 2, {TEXT}}}",
        f"{{{OWN}, fails: true}}",
        "{service: /reset, type: std_srvs/Empty, answer: {}}",
        r'{service: /lap, type: lab1/Lap, answer: {lap: {a: 1}}, definition: "---\nlab1/Time lap"}',
    ],
)
def test_sound_services(served: str, tmp_path: Path) -> None:
    assert load_rubric(str(_serving(tmp_path, served))).rubric.scenarios["real"].serves


@pytest.mark.parametrize(
    ("served", "fault"),
    [
        (f"{{{OWN}}}", ": give one of answer, answers and fails: none is there"),
        (
            f"{{{OWN}, answer: {{}}, fails: true}}",
            ": give one of answer, answers and fails: answer and fails are",
        ),
        ("{type: lab1/Add, fails: true}", ": give one of service and action, not neither"),
        ("{action: /a, type: lab1/B, fails: true}", ".fails: is not for an action"),
        (f"{{{OWN}, fails: true, result: {{}}}}", ".result: is not for a service"),
        pytest.param(
            "{action: /a, type: actionlib/Test, result: {reslt: 1}}",
            ".result: actionlib/TestResult has no field reslt",
            marks=pytest.mark.ros,  # what its fields are, only ROS's own files say
        ),
        ("{service: add, type: lab1/Add, fails: true}", '.service: a service begins with a slash: "/add"'),
        (
            f"{{{OWN}, answer: {{total: 7}}, {TEXT}}}",
            ".answer: lab1/AddResponse has no field total; its fields are",
        ),
        (f"{{{OWN}, answer: {{sum: 7.5}}, {TEXT}}}", ".answer: 7.5 is no int64"),
        (f"{{{OWN}, answers: [{{sum: 7}}, {{sum: x}}], {TEXT}}}", ".answers[1]: 'x' is no int64"),
        ("{service: /a, type: std_srvs/Trigger, answer: {succes: true}}", '(did you mean "success"?)'),
        ("{service: /a, type: std_srvs/Triger, fails: true}", '.type: std_srvs has no service type "Triger"'),
        (
            f'{{{OWN}, fails: true, definition: "int64 a"}}',
            ".definition: a service has a request and a response",
        ),
    ],
)
def test_faults(served: str, fault: str, tmp_path: Path) -> None:
    (found,) = faults(_serving(tmp_path, served))
    assert found.startswith(SERVES_AT)
    assert fault in found


def test_a_service_is_offered_once(tmp_path: Path) -> None:
    served = f"{{{OWN}, fails: true}}"
    (found,) = faults(_serving(tmp_path, f"{served}, {served}"))
    assert found == "lab.yaml:11: scenarios.real.serves[1].service: /add is offered by serves[0] already"


def test_calls_are_judged_of_a_service_that_is_offered(tmp_path: Path) -> None:
    path = _serving(tmp_path, f"{{{OWN}, fails: true}}")
    text = path.read_text(encoding="utf-8")
    judged = "check: calls\n    with: {service: /ad, expect: {a: 3}}"
    path.write_text(text.replace("check: rate\n    with: {topic: /chatter, rate_hz: 10}", judged, 1))
    (found,) = faults(path)
    assert found == (
        'lab.yaml:18: criteria[0].with.service: the grader does not offer /ad in real (did you mean "/add"?): '
        "add it to serves"
    )
