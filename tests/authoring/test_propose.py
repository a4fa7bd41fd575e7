"""What rubric is proposed from a recorded run, without ROS: what its program wrote is data, and nothing else."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.authoring.mutation.faulty_packages import mutants_text
from grader.authoring.propose import Proposal, assign_points
from grader.authoring.rubric_draft import (
    SAMPLES,
    Parts,
    answers_to,
    find_parts,
    heard_template,
    nice_rate,
    observe,
    rubric_text,
    second_look,
    step_for,
    title_of,
    wraps_of,
)
from grader.evidence.reader import package_facts
from grader.evidence.run import Run
from grader.model.mutants import LostCriterion, Mutant, MutantResult
from grader.model.package import Interface, InterfaceField
from grader.rubric.load import load_rubric
from grader.rubric.step_faults import step_faults
from tests.report.nasty import STEERING, TEXTS, TO_A_CI
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


@pytest.mark.parametrize(
    ("package", "title"),
    [
        ("battery_monitor", "Lab: battery monitor"),
        ("pick-and-place", "Lab: pick and place"),
        ("lab3", "Lab: lab3"),
        ("__", "Lab: __"),
    ],
)
def test_a_drafts_title_is_the_packages_name_in_words(package: str, title: str) -> None:
    assert title_of(package) == title


def test_a_script_with_its_packages_name_is_noted() -> None:
    """Python finds the script in place of the package with the messages."""
    line = "ModuleNotFoundError: No module named 'node.msg'; 'node' is not a package"
    runs = build_runs({"runs": {"node": {"processes": [{**LIVES, "exit_s": 1, "exit_code": 1, "stopped_by": None}],
                                         "console": [{"process": "node", "stream": "stderr", "line": line}],
                                         "graph": []}}, "package": {}})  # fmt: skip
    parts = Parts(nodes={"node": "src/node.py"}, launches={})
    proposal = Proposal(package_facts(runs["package"]), parts, {"node": observe(runs["node"])}, runs)
    assert "the script has the package's name, and Python finds it first" in proposal.notes[0]


@pytest.mark.parametrize("kind", SAMPLES)
def test_what_is_sent_to_a_node_fits_its_type(kind: str) -> None:
    assert list(step_faults((), {"steps": [step_for("/heard", kind)]})) == []


def test_a_build_that_failed_is_noted_first() -> None:
    made = {"name": "catkin_make", "role": "build", "exit_code": 2}
    runs = build_runs({"runs": {"package": {"processes": [made]}}, "package": {}})
    proposal = Proposal(package_facts(runs["package"]), Parts(nodes={}, launches={}), {}, runs)
    (note,) = proposal.notes
    assert note.startswith("little of the package was seen: catkin_make failed")
    assert note.endswith("--from FOLDER --package NAME")


def test_a_script_that_is_installed_needs_no_executable_bit() -> None:
    install = {"name": "catkin_install_python", "args": ["PROGRAMS", "src/node.py", "DESTINATION", "bin"]}
    runs = build_runs({"runs": {}, "package": {"cmake": {"calls": [install]}}})
    parts = Parts(nodes={"node": "src/node.py", "other": "src/other.py"}, launches={})
    proposal = Proposal(
        package_facts(runs["package"]), parts, dict.fromkeys(parts.nodes, observe(run_of())), runs
    )
    named = [one["with"] for one in proposal.criteria if one["check"] in {"executable", "cmake-install"}]
    assert {"path": "src/node.py"} not in named
    assert {"scripts": ["src/node.py"]} in named


def test_stamps_and_a_script_that_is_two_nodes_are_asked_for() -> None:
    stamp = {"header": {"stamp": {"secs": 1700000001, "nsecs": 0}}, "name": ["elbow"]}
    later = {"header": {"stamp": {"secs": 1700000001, "nsecs": 500000000}}, "name": ["elbow"]}
    joints = {"topic": "/joints", "type": "sensor_msgs/JointState", "callerid": "/node"}
    run = run_of(topics=[{**joints, "times_s": [1.01, 1.51], "values": [stamp, later]}])
    arms = [{"name": "node", "pkg": "lab1", "type": "node.py", "ns": ns} for ns in ("left", "right")]
    launch = {"path": "launch/arms.launch", "nodes": arms}
    runs = build_runs({
        "runs": {"arms": {"processes": [{"name": "arms", "stopped_by": "INT"}],
                          "graph": [{"at_s": 1, "nodes": ["/left/node", "/right/node"],
                                     "processes": {"/left/node": "arms", "/right/node": "arms"}}]}},
        "package": {"launch_files": [launch]},
    })  # fmt: skip
    parts = Parts(nodes={"node": "src/node.py"}, launches={"arms": "arms.launch"})
    facts = package_facts(runs["package"]).model_copy(update={"name": "lab1"})
    seen = {"node": observe(run), "arms": observe(runs["arms"])}
    proposal = Proposal(facts, parts, seen, {**runs, "node": run})
    by_check = {one["check"]: one.get("with", {}) for one in proposal.criteria}
    assert by_check["stamps"] == {"topic": "/joints"}
    assert by_check["launch-runs"]["nodes"] == {"/left/node": "lab1", "/right/node": "lab1"}


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


def service_and_client() -> tuple[Interface, Parts, dict[str, Run]]:
    """A service of the package's own, the scripts of its server and its client, and what each does alone."""
    fields = [
        ("request", "string", "unit"),
        ("request", "float64", "value"),
        ("response", "float64", "result"),
    ]
    own = Interface(
        path="srv/Convert.srv",
        fields=tuple(InterfaceField(part=p, type=t, name=n, line=1) for p, t, n in fields),
    )
    offers = [{"at_s": 0.5, "nodes": ["/node"], "services": {"/convert": ["/node"]},
               "processes": {"/node": "node"}, "service_types": {"/convert": "lab1/Convert"}}]  # fmt: skip
    up = [{"at_s": 0.5, "nodes": ["/client"], "processes": {"/client": "node"}}]
    looks = [{"action": "lookup", "actor": "/client", "topic": "/convert", "detail": "no such service"}]
    parts = Parts(nodes={"node": "src/node.py", "client": "src/client.py"}, launches={})
    return own, parts, {"node": run_of(graph=offers), "client": run_of(graph=up, actors=looks)}


def test_a_service_of_the_packages_own_is_called_and_its_client_answered() -> None:
    own, parts, first = service_and_client()
    text = "string unit\nfloat64 value\n---\nfloat64 result\n"
    seen = {name: observe(run) for name, run in first.items()}
    assert seen["client"].sought == ("/convert",)
    again = second_look("lab1", parts, seen, [own])
    assert again is not None
    calls = again.rubric.scenarios["node-asked"].calls
    assert [call.request for call in calls] == [
        {"unit": "first", "value": 3.5},
        {"unit": "second", "value": 6.5},
    ]
    assert {call.definition for call in calls} == {text}
    (served,) = again.rubric.scenarios["client-served"].serves
    assert (served.service, served.answer, served.definition) == ("/convert", {"result": 1.5}, text)

    asked = {"unit": "inch", "value": 2}
    answers = [
        {"at_s": at_s, "action": action, "topic": "/convert", "value": {"result": value}}
        for at_s, action, value in (
            (1, "call", 0),
            (1.1, "answer", 8.89),
            (2, "call", 0),
            (2.1, "answer", 16.51),
        )
    ]
    served_it = [{"action": "serve", "actor": "/client", "topic": "/convert",
                  "value": {"request": asked, "response": {"result": 1.5}}}]  # fmt: skip
    said = [{"process": "node", "stream": "stdout", "line": "2 inch is 1.50 cm"}]
    runs = build_runs({"runs": {}, "package": {}}) | first
    runs |= {"node-asked": run_of(actors=answers), "client-served": run_of(actors=served_it, console=said)}
    facts = package_facts(runs["package"]).model_copy(update={"interfaces": (own,)})
    proposal = Proposal(facts, parts, seen, runs)
    judged = {one["check"]: one.get("with", {}) for one in proposal.criteria}
    assert judged["service-answers"]["expect"] == [{"result": 8.89}, {"result": 16.51}]
    assert [call["limit_s"] for call in proposal.scenarios["node-asked"]["calls"]] == [2, 2]
    later = [{**one, "at_s": 9} if one["at_s"] == 2.1 else one for one in answers]
    slow = Proposal(facts, parts, seen, runs | {"node-asked": run_of(actors=later)})
    assert not any("limit_s" in call for call in slow.scenarios["node-asked"]["calls"])
    assert judged["calls"]["expect"] == [asked]
    assert judged["prints"]["text"] == "{number} inch is {number} cm"
    assert judged["prints"]["numbers"] == [2, 1.5]
    assert proposal.notes == []
    silent = Proposal(facts, parts, seen, runs | {"node-asked": run_of()})
    assert silent.notes[0].startswith("what /convert answers is not covered")


def test_nodes_are_found_by_reading_alone(tmp_path):
    from grader.model.submission import SourcePackage  # noqa: PLC0415
    from grader.package.facts import read_package  # noqa: PLC0415

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


SOME = settings(max_examples=60)


@SOME
@given(TEXTS, TEXTS, st.lists(TEXTS, max_size=3))
def test_a_proposed_rubric_reads_back(name, text, notes):
    scenarios = {
        "node": {"title": text, "start": [{"name": "node", "script": name}], "until": {"messages": {text: 3}}}
    }
    criteria = [
        {
            "id": "a",
            "title": text,
            "points": 100,
            "check": "logs",
            "with": {"text": text, "names": [name, text]},
        }
    ]
    made = rubric_text(name, "sample", scenarios, criteria, notes)
    read = yaml.safe_load(made)
    assert read["package"] == name
    assert read["title"]
    assert read["scenarios"] == scenarios
    assert read["criteria"] == criteria
    assert set(read) == {"schema", "id", "title", "version", "package", "scenarios", "criteria"}
    assert made.count("# NOTE:") >= len(notes)
    assert STEERING.search(made) is None
    assert TO_A_CI.search(made) is None


@SOME
@given(TEXTS, TEXTS)
def test_a_written_mutants_file_reads_back(place, value):
    edit = {"operator": "o", "at": {"script": place}, "with": {"to": value}}
    mutant = Mutant.model_validate({"edits": (edit,), "expect": {}})
    lost = (LostCriterion(id="rate", status="fail", message=""),)
    results = [
        MutantResult(
            name=state, label="", operator="o", mistake="", state=state, expected=None, diff="", wall_s=1,
            lost=lost if state == "killed" else (),
        )
        for state in ("killed", "survived")
    ]  # fmt: skip
    made = mutants_text("sample", {"killed": mutant, "survived": mutant}, results)
    assert yaml.safe_load(made)["mutants"] == {"killed": {"expect": {"rate": "fail"}, "edits": [edit]}}
    assert STEERING.search(made) is None
