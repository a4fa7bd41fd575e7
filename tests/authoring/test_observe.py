"""What is made of a recorded run, without ROS."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.authoring.propose import Proposal, assign_points
from grader.authoring.rubric_draft import (
    Parts,
    answers_to,
    find_parts,
    heard_template,
    nice_rate,
    observe,
    rubric_text,
    second_look,
    wraps_of,
)
from grader.evidence.reader import package_facts
from grader.evidence.run import Run
from grader.rubric.load import load_rubric
from tests.support.timeline import build_runs

NS = 10**9
LIVES = {"name": "node", "script": "src/node.py", "stopped_by": "INT", "exit_code": 0}


def run_of(**timeline: Any) -> Run:
    return build_runs({"runs": {"node": {"processes": [LIVES]} | timeline}})["node"]


def counter(**more: Any) -> dict[str, Any]:
    return {"topic": "/n", "type": "std_msgs/Int8", "callerid": "/node_1_1795242274394", "count": 300, **more}


@pytest.mark.parametrize(
    ("hz", "jitter_ns", "found"),
    [(10, 0, 10), (9.9, 0, 10), (62.5, 10**5, 60), (7, 0, 7), (1, 10**6, 1), (0.5, 0, 0.5)],
)
def test_a_rate_as_an_author_writes_it(hz, jitter_ns, found):
    times = [round(i * NS / hz) + (i % 2) * jitter_ns for i in range(20)]
    if hz == 62.5:
        assert nice_rate(times) == 62.5
    else:
        assert nice_rate(times) == found


@pytest.mark.parametrize(
    "times", [[], [0], [0, 1, 2, 3], [0, 0, 0, 0, 0, 0], [0, 1, 2, 3, 4, 900, 901, 902, 903, 904, 1900, 1901]]
)
def test_what_is_not_periodic_has_no_rate(times):
    assert nice_rate([t * 10**6 for t in times]) is None


def test_a_node_that_counts():
    seen = observe(run_of(topics=[counter(values={"count_from": 0, "wrap_after": 127, "wrap_to": 0})]))
    assert seen.nodes == ("node",)
    assert seen.anonymous
    (topic,) = seen.topics
    assert (topic.name, topic.type, topic.rate_hz, topic.counts_from) == ("/n", "std_msgs/Int8", 10, 0)


def test_the_values_around_a_wrap():
    assert wraps_of(
        run_of(topics=[counter(values={"count_from": 5, "wrap_after": 20, "wrap_to": 3})]), "/n"
    ) == (20, 3)
    assert wraps_of(run_of(topics=[counter(values={"count_from": 0}, count=90)]), "/n") is None
    odd = counter(values=[1, 2, 3, 1, 2, 1, 2, 3, 1], count=9)
    assert wraps_of(run_of(topics=[odd]), "/n") is None


def test_texts_that_tell_the_time():
    told = {"topic": "/c", "callerid": "/node", "count": 50, "values": {"text": "The time is {time_s:.2f}"}}
    assert observe(run_of(topics=[told])).topics[0].template == "The time is {seconds}"
    other = {"topic": "/c", "callerid": "/node", "count": 50, "values": {"text": "turn {i}"}}
    assert observe(run_of(topics=[other])).topics[0].template == ""


def test_what_stands_before_a_message_that_was_heard():
    def heard(*lines: str) -> str | None:
        sent = [
            {"action": "publish", "topic": "/c", "value": v, "at_s": 1.0 + i}
            for i, v in enumerate(("abc", "xyz"))
        ]
        said = [{"process": "node", "at_s": 1.1 + i, "line": line} for i, line in enumerate(lines)]
        processes = [{**LIVES, "nodes": ["/node"]}]
        return heard_template(run_of(processes=processes, actors=sent, console=said), "/c")

    assert heard("[INFO] [1.0]: /node I heard abc", "[INFO] [2.0]: /node I heard xyz") == "I heard {value}"
    assert heard("abc", "xyz") == "{value}"
    assert heard("1: abc", "2: xyz") == "{value}"
    assert heard("I heard abc", "nothing") is None


def test_a_node_that_failed_is_named_in_a_note(tmp_path):
    runs = build_runs(
        {
            "runs": {"node": {"processes": [{**LIVES, "exit_s": 1, "exit_code": 1, "stopped_by": None}],
                              "console": [{"process": "node", "stream": "stderr", "line": "KeyError: 'details'"}],
                              "graph": []}},
            "package": {"files": [{"path": "src/node.py"}]},
        }
    )  # fmt: skip
    facts = package_facts(runs["package"])
    proposal = Proposal(
        facts, Parts(nodes={"node": "src/node.py"}, launches={}), {"node": observe(runs["node"])}, runs
    )
    (note,) = proposal.notes
    assert "KeyError: 'details'" in note
    text = rubric_text("lab1", "sample", proposal.scenarios, proposal.criteria, proposal.notes)
    path = tmp_path / "sample.yaml"
    path.write_text(text)
    assert "# NOTE: src/node.py was not observed" in text
    assert load_rubric(str(path)).rubric.max_points == 100


def test_a_build_that_failed_is_noted_first() -> None:
    made = {"name": "catkin_make", "role": "build", "exit_code": 2}
    runs = build_runs({"runs": {"package": {"processes": [made]}}, "package": {}})
    proposal = Proposal(package_facts(runs["package"]), Parts(nodes={}, launches={}), {}, runs)
    (note,) = proposal.notes
    assert note.startswith("little of the package was seen: catkin_make failed")
    assert note.endswith("--from FOLDER --package NAME")


def test_nothing_to_see_twice():
    seen = {"node": observe(run_of(topics=[{"topic": "/c", "callerid": "/node"}]))}
    assert second_look("lab1", Parts(nodes={"node": "src/node.py"}, launches={}), seen) is None


def test_a_node_that_answers_what_it_hears_gets_a_step_for_it() -> None:
    types = {"/in": "std_msgs/Float32", "/cmd": "geometry_msgs/Twist", "/out": "std_msgs/Float32"}
    listens = [{"at_s": 0.5, "nodes": ["/node"], "subscribers": {"/in": ["/node"], "/cmd": ["/node"]},
                "publishers": {"/out": ["/node"]}, "processes": {"/node": "node"},
                "topic_types": types}]  # fmt: skip
    out = {"topic": "/out", "type": "std_msgs/Float32", "callerid": "/node"}
    first = run_of(graph=listens, topics=[{**out, "count": 0}])
    parts = Parts(nodes={"node": "src/node.py"}, launches={})
    again = second_look("lab1", parts, {"node": observe(first)})
    assert again is not None
    sent = [step.publish for step in again.rubric.scenarios["node-answers"].steps if step.publish]
    assert [(one.topic, one.total) for one in sent] == [("/in", 3), ("/cmd", 3)]

    def noted(topic: str, begin_s: float) -> list[dict[str, Any]]:
        return [{"action": "publish", "topic": topic, "at_s": begin_s + 0.5 * n} for n in range(3)]

    answers = run_of(
        graph=listens,
        actors=[*noted("/in", 1.0), *noted("/cmd", 3.0)],
        topics=[{**out, "count": 3, "rate_hz": 2, "start_s": 1.1}],
    )
    assert answers_to(answers, "/in", 0.5) == ("/out",)
    assert answers_to(answers, "/cmd", 0.5) == ()
    runs = build_runs({"runs": {}, "package": {}}) | {"node": first, "node-answers": answers}
    proposal = Proposal(package_facts(runs["package"]), parts, {"node": observe(first)}, runs)
    judged = {one["check"]: one for one in proposal.criteria if one.get("scenario") == "node-answers"}
    assert judged["topic-type"]["with"]["topic"] == "/out"
    assert judged["reacts"]["with"]["cause"] == {"topic": "/in"}
    (note,) = proposal.notes
    assert note.endswith(
        "publish: {topic: /cmd, type: geometry_msgs/Twist, value: {}, count: 3, rate_hz: 2.0}"
    )


def test_nodes_are_found_by_reading_alone(tmp_path):
    from grader.model.submission import SourcePackage  # noqa: PLC0415
    from grader.package import read_package  # noqa: PLC0415

    files = {
        "package.xml": "<package><name>x</name></package>",
        "scripts/Node One.py": "import rospy\nrospy.init_node('a')\n",
        "scripts/also.py": "from rospy import init_node\ninit_node('b')\n",
        "scripts/none.py": "print('init_node')\n",
        "scripts/broken.py": "rospy.init_node(\n",
        "launch/a.launch": "<launch/>",
        "launch/broken.launch": "<launch>",
        "config/a.yaml": "x: 1\n",
        ".github/workflows/ci.yaml": "x: 1\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    source = SourcePackage(name="x", folder=tmp_path, path=".", mode_source="disk", executable={})
    parts = find_parts(tmp_path, read_package(source))
    assert parts.nodes == {"node-one": "scripts/Node One.py", "also": "scripts/also.py"}
    assert parts.launches == {"a-launch": "a.launch"}
    assert parts.configs == ("config/a.yaml",)


@given(
    st.lists(st.sampled_from(["manifest", "rate", "hears", "counter-wrap", "own"]), min_size=1, max_size=90)
)
def test_points_are_whole_and_add_up(checks):
    criteria = [{"check": name} for name in checks]
    assign_points(criteria)
    assert sum(c["points"] for c in criteria) == 100
    assert all(isinstance(c["points"], int) and c["points"] >= 0 for c in criteria)
