"""The text form of evidence: short to write, strict, and on the way that recordings go."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from grader.evidence.inspect import rate_stats
from grader.evidence.reader import load_evidence, package_facts
from grader.evidence.run import Channel
from tests.support.timeline import EPOCH_NS, build_runs, write_runs

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "evidence-timelines.md"
S = 1_000_000_000


def only(**topic) -> Channel:
    [channel] = build_runs({"topics": [{"topic": "/c", **topic}]})["run"].channels
    return channel


def seconds(channel: Channel) -> list[float]:
    return [round((t - EPOCH_NS) / S, 6) for t in channel.times_ns]


def test_the_example_of_the_page_is_true(tmp_path):
    timeline = yaml.safe_load(re.findall(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL)[0])
    runs = build_runs(timeline)
    assert list(runs) == ["talker", "package"]
    [channel] = runs["talker"].channels
    assert channel.data == (*range(128), *range(128), 0, 1, 2, 3)
    assert rate_stats(channel.times_ns).mean_hz == pytest.approx(10)
    assert runs["talker"].outcome.outcome == "complete"
    assert [e.event for _, e in runs["talker"].processes] == ["start", "exit"]
    assert runs["talker"].student_nodes() == ("/numeric_talker",)
    assert package_facts(runs["package"]).file("src/numeric_talker.py").shebang.interpreter == "python3"
    write_runs(timeline, tmp_path)
    assert load_evidence([tmp_path]) == {name: runs[name] for name in sorted(runs)}


def test_one_run_stands_without_runs():
    runs = build_runs({"scenario": "talker", "clock": "warped", "warp": 20, "package": {"name": "x"}})
    assert list(runs) == ["talker", "package"]
    assert (runs["talker"].clock, runs["talker"].warp, runs["talker"].evidence) == (
        "warped",
        20,
        "talker.mcap",
    )


@pytest.mark.parametrize(
    "timeline",
    [
        {"topic": []},
        {"runs": {"a": {"topics": [{"topic": "/c", "rate": 10}]}}},
        {"runs": {"a": {}}, "topics": []},
        {"runs": {"package": {"package": {}}}, "package": {}},
        {"topics": [{"type": "std_msgs/String"}]},
        {"topics": [{"topic": "/c", "type": "std_msgs/Int8", "values": [128]}]},
        {"topics": [{"topic": "/c", "type": "std_msgs/Nothing"}]},
        {"topics": [{"topic": "/c", "count": 3, "values": []}]},
        {"topics": [{"topic": "/c", "values": ["a"], "raw": ["00"]}]},
        {"topics": [{"topic": "/c", "times_s": [1], "gaps": [{"before": 1, "pause_s": 1}]}]},
        {"topics": [{"topic": "/c", "times_s": [1], "count": 2}]},
        {"topics": [{"topic": "/c", "replace": {5: "x"}}]},
        {"package": {"licence": "BSD"}},
        {"package": {"files": [{"path": "a", "mode": 7}]}},
        {"outcome": "perfect"},
        {"console": [{"line": "of nobody"}]},
        {"services": {"/reset": {"type": "std_srvs/Empty"}}},
        {"graph": [], "services": {"/reset": {"node": "/a"}}},
        {"graph": [], "processes": [{"name": "a", "nodes": ["/a"]}]},
    ],
)
def test_what_nobody_knows_is_an_error(timeline):
    with pytest.raises(ValueError, match=r"."):
        build_runs(timeline)


def test_values():
    assert only(values=["a", "b"]).data == ("a", "b")
    assert only(values=["a", "b"], count=5).data == ("a", "b", "a", "b", "a")
    assert (
        only(values={"text": "hello world {time_s:.1f} {i}"}, count=2).data[1] == "hello world 1700000000.6 1"
    )
    assert only(
        type="std_msgs/Int8", values={"count_from": 126, "wrap_after": 126, "wrap_to": -128}, count=3
    ).data == (
        126,
        -128,
        -127,
    )
    assert only(type="std_msgs/Int8", count=4, values={"step": 2}, replace={2: 9}, drop=[1]).data == (0, 9, 6)
    assert only().data == ("hello world",)
    assert only(count=0).messages == ()
    assert only(type="std_msgs/Empty", count=2).values == ({}, {})
    header = only(type="std_msgs/Header", values=[{"frame_id": "map"}])
    assert header.values[0] == {"seq": 0, "stamp": {"secs": 0, "nsecs": 0}, "frame_id": "map"}
    own = only(type="lab1/Num", definition="int64 num\n", raw=["0500000000000000"])
    assert own.values == ({"num": 5},)
    assert only(raw=["ff"]).values == (None,)


def test_times():
    assert seconds(only(count=3)) == [0.5, 0.6, 0.7]
    assert seconds(only(count=3, start_s=1, rate_hz=1)) == [1, 2, 3]
    assert seconds(only(times_s=[0.1, 0.4])) == [0.1, 0.4]
    assert seconds(only(count=4, jitter_ms=[0, 10])) == [0.5, 0.61, 0.7, 0.81]
    assert seconds(only(count=4, gaps=[{"before": 2, "pause_s": 1}])) == [0.5, 0.6, 1.7, 1.8]
    assert seconds(only(count=4, stalls=[{"at": 1, "late_s": 0.25}])) == [0.5, 0.85, 0.85, 0.85]
    assert seconds(only(count=6, burst=3)) == [0.5, 0.5, 0.5, 0.8, 0.8, 0.8]
    assert seconds(only(count=3, drop=[1])) == [0.5, 0.7]


def test_what_is_left_out_is_calm_and_can_be_left_out_for_good():
    run = build_runs({"topics": [{"topic": "/c"}], "subscribers": {"/c": ["/listener"]}})["run"]
    [(_, graph)] = run.graph
    assert graph.nodes == ("/rosout", "/listener", "/talker")
    assert [c.subscriber for c in graph.connections] == ["/listener"]
    assert len(run.host) == len(run.recorder) == 1
    bare = build_runs({"scenario": "run", "graph": [], "host": [], "recorder": [], "outcome": None})["run"]
    assert (bare.graph, bare.host, bare.recorder, bare.outcome) == ((), (), (), None)


def test_processes_have_nodes_and_nodes_have_services():
    run = build_runs(
        {
            "topics": [{"topic": "/c", "callerid": "/sender_1_2"}],
            "processes": [
                {"name": "first", "nodes": ["/sender_1_2"]},
                {"name": "turtlesim", "role": "grader", "nodes": ["/turtlesim"]},
            ],
            "services": {"/reset": {"node": "/turtlesim", "type": "std_srvs/Empty"}, "/mute": {"node": "/b"}},
        }
    )["run"]
    [(_, graph)] = run.graph
    assert graph.nodes == ("/rosout", "/b", "/sender_1_2", "/turtlesim")
    assert graph.processes == {"/sender_1_2": "first", "/turtlesim": "turtlesim"}
    assert graph.services == {"/reset": ("/turtlesim",), "/mute": ("/b",)}
    assert graph.service_types == {"/reset": "std_srvs/Empty"}
    assert run.student_nodes("first") == ("/sender_1_2",)
    assert run.student_nodes() == ("/b", "/sender_1_2")


def test_events_of_every_kind():
    run = build_runs(
        {
            "processes": [{"name": "a", "exit_s": 3, "exit_code": 1}, {"name": "b"}],
            "console": [{"process": "a", "lines": ["1", "2"], "every_s": 0.5, "at_s": 1}],
            "actors": [{"action": "publish", "topic": "/c", "values": [1, 2]}],
            "params": [{"name": "/p", "value": {"x": [1]}}],
            "attachments": {"src/a.py": "print()"},
            "metadata": {"ros": "noetic"},
            "outcome": "host",
            "outcome_detail": "the master died",
            "end_s": 9,
        }
    )["run"]
    assert [(e.name, e.event) for _, e in run.processes] == [("a", "start"), ("b", "start"), ("a", "exit")]
    assert [(t - EPOCH_NS) / S for t, _ in run.console] == [1.0, 1.5]
    assert [e.value for _, e in run.actors] == [1, 2]
    assert run.params[0][1].value == {"x": [1]}
    assert run.attachments == {"src/a.py": b"print()"}
    assert run.metadata["ros"] == "noetic"
    assert run.outcome.detail == "the master died"
    assert run.end_ns == EPOCH_NS + 9 * S


def test_package_facts_are_filled_in():
    facts = package_facts(
        build_runs(
            {
                "package": {
                    "name": "demo",
                    "manifest": {"dependencies": [["depend", "rospy"]]},
                    "cmake": {"calls": [["project", "demo"], {"name": "find_package", "args": ["catkin"]}]},
                    "files": [{"path": "a.py", "shebang": "#!/usr/bin/python3", "crlf": True}],
                    "launch_files": [
                        {"path": "launch/a.launch", "nodes": [{"pkg": "demo"}], "fault": {"message": "x"}}
                    ],
                }
            }
        )["package"]
    )
    assert (facts.manifest.name, facts.manifest.dependencies[0].name) == ("demo", "rospy")
    assert [(c.name, c.args) for c in facts.cmake.calls] == [
        ("project", ("demo",)),
        ("find_package", ("catkin",)),
    ]
    assert (facts.files[0].shebang.interpreter, facts.files[0].shebang.crlf) == ("python3", True)
    assert facts.launch_files[0].fault.file == "launch/a.launch"
    assert facts.launch_files[0].nodes[0].pkg == "demo"


def test_a_timeline_gives_the_same_bytes_every_time(tmp_path):
    timeline = {"topics": [{"topic": "/c", "count": 50}, {"topic": "/d", "count": 50}]}
    for name in ("a", "b"):
        write_runs(timeline, tmp_path / name)
    assert (tmp_path / "a" / "run.mcap").read_bytes() == (tmp_path / "b" / "run.mcap").read_bytes()
