"""The graph, the console and the cited lines of a run: the student's, and of bounded size."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from grader.checks import CHECKS
from grader.model.figure import CodeFigure, ConsoleFigure, GraphFigure
from grader.model.verdict import EvidenceCitation, FileCitation
from grader.report.figures.runs import (
    EDGES_MAX,
    FIGURES_MAX,
    LETTERS_MAX,
    LINES_MAX,
    NODES_MAX,
    TOPICS_MAX,
    code_figures,
    console_of,
    graph_of,
    with_faults,
)
from tests.checks.examples import runs_of
from tests.report.figures.made import criterion, drawn, only

OWN = ("/grader_recorder_0a1b2c3d", "/grader_actor_0a1b2c3d", "/grader_calibration_0a1b2c3d", "/rosout")


def graph(**keys: Any) -> GraphFigure | None:
    return graph_of(runs_of({"run": keys})["run"])


def console(*lines: str, **keys: Any) -> ConsoleFigure | None:
    printed = [{"process": "talker", "lines": list(lines), "every_s": 0.001}]
    return console_of(runs_of({"run": {"console": printed if lines else [], **keys}})["run"])


def test_the_graders_nodes_and_system_topics_are_left_out() -> None:
    found = graph(
        graph=[
            {
                "nodes": [*OWN, "/talker_4711_1700000000000", "/turtlesim"],
                "publishers": {
                    "/chatter": ["/talker_4711_1700000000000", OWN[1]],
                    "/rosout": ["/talker_4711_1700000000000"],
                    "/clock": [OWN[1]],
                    "/grader/calibration": [OWN[2]],
                },
                "subscribers": {"/chatter": [OWN[0]], "/clock": ["/turtlesim"], "/cmd": ["/turtlesim"]},
                "topic_types": {"/chatter": "std_msgs/String", "/cmd": "*", "/rosout": "rosgraph_msgs/Log"},
            }
        ]
    )
    assert found is not None
    assert found.nodes == ("/talker_4711_1700000000000", "/turtlesim")
    assert found.topics == ("/chatter", "/cmd")
    assert found.types == {"/chatter": "std_msgs/String"}
    assert [(e.node, e.topic, e.publishes) for e in found.edges] == [
        ("/talker_4711_1700000000000", "/chatter", True),
        ("/turtlesim", "/cmd", False),
    ]


def test_all_that_was_there_at_any_time() -> None:
    states = [
        {"nodes": ["/a"], "publishers": {"/x": ["/a"]}, "topic_types": {"/x": "*"}, "at_s": 1},
        {"nodes": ["/b"], "subscribers": {"/x": ["/b"]}, "topic_types": {"/x": "std_msgs/Int8"}, "at_s": 2},
        {"nodes": [], "at_s": 3},
    ]
    found = graph(graph=states)
    assert found is not None
    assert (found.nodes, found.types) == (("/a", "/b"), {"/x": "std_msgs/Int8"})


def test_no_node_no_graph() -> None:
    assert graph() is None
    assert graph(graph=[{"nodes": list(OWN)}]) is None


def test_another_tools_recording_tells_who_published() -> None:
    run = runs_of({"run": {"topics": [{"topic": "/chatter"}]}})["run"]
    found = graph_of(replace(run, metadata={}, graph=()))
    assert found is not None
    assert found.nodes == ("/talker",)
    assert [e.publishes for e in found.edges] == [True]


@pytest.mark.full
def test_a_thousand_nodes() -> None:
    names = [f"/n{i}" for i in range(1000)]
    long = "/" + "x" * 10_000
    found = graph(
        graph=[{"nodes": [long, *names], "publishers": {f"/t{i}": names for i in range(300)}}],
    )
    assert found is not None
    assert len(found.nodes) == NODES_MAX
    assert len(found.nodes[0]) == 200
    assert len(found.topics) == TOPICS_MAX
    assert len(found.edges) == EDGES_MAX
    assert found.left_out == 1001 - NODES_MAX + 300 - TOPICS_MAX
    assert {e.node for e in found.edges} <= set(found.nodes)
    assert {e.topic for e in found.edges} <= set(found.topics)


def test_lines_have_times_and_no_colours() -> None:
    found = console("\x1b[33m[WARN] late\x1b[0m", "second")
    assert found is not None
    assert [(line.text, line.at_s) for line in found.lines] == [("[WARN] late", 0.6), ("second", 0.601)]
    assert found.left_out == 0


def test_the_first_and_the_last_hundred_lines() -> None:
    found = console(*(f"line {i}" for i in range(1000)))
    assert found is not None
    texts = [line.text for line in found.lines]
    assert texts == [f"line {i}" for i in (*range(100), *range(900, 1000))]
    assert found.left_out == 800


def test_what_the_graders_own_processes_print_is_left_out() -> None:
    processes = [{"name": "talker"}, {"name": "world", "role": "grader"}]
    lines = [{"process": "world", "line": "own"}, {"process": "talker", "line": "the student's"}]
    found = console(processes=processes, console=lines)
    assert found is not None
    assert [line.text for line in found.lines] == ["the student's"]
    assert console(processes=processes, console=lines[:1]) is None


def test_long_lines_are_cut() -> None:
    found = console("x" * 10_000)
    assert found is not None
    assert len(found.lines[0].text) == 300
    many = console(*["y" * 10_000] * 500)
    assert many is not None
    assert sum(len(line.text) for line in many.lines) <= LETTERS_MAX


NODES = {
    "nodes": ["/talker", "/listener"],
    "publishers": {"/chater": ["/talker"], "/count": ["/talker"]},
    "subscribers": {"/chatter": ["/listener"]},
    "topic_types": {"/chater": "std_msgs/String", "/count": "std_msgs/Int32"},
}


@pytest.mark.parametrize(
    ("check", "params", "wrong", "missing"),
    [
        (
            "topic-type",
            {"topic": "/chatter", "type": "std_msgs/String"},
            {"/chatter": "nobody publishes"},
            (),
        ),
        ("topic-type", {"topic": "/count", "type": "std_msgs/Int8"}, {"/count": "not std_msgs/Int8"}, ()),
        (
            "topic-type",
            {"topic": "/counts", "type": "std_msgs/Int8"},
            {"/count": "not /counts", "/counts": "nobody publishes"},
            ("/counts",),
        ),
        ("hears", {"topic": "/numbers"}, {"/numbers": "nobody subscribes"}, ("/numbers",)),
        ("hears", {"topic": "/count"}, {"/count": "nobody subscribes"}, ()),
        ("node-name", {"names": ["sender"]}, {"/talker": "not /sender", "/listener": "not /sender"}, ()),
        ("node-name", {"names": ["talker"]}, {}, ()),
    ],
)
def test_what_is_wrong_in_a_graph_is_named(check, params, wrong, missing) -> None:
    found = graph(graph=[NODES])
    assert found is not None
    marked = with_faults(found, check, CHECKS[check].params.model_validate(params))
    assert (marked.wrong, marked.missing) == (wrong, missing)
    assert set(wrong) <= {*marked.nodes, *marked.topics}


def test_a_loss_without_a_plot_has_the_graph_with_its_fault() -> None:
    figures, results = drawn(
        {"graph": [NODES]}, criterion("topic-type", topic="/chatter", type="std_msgs/String")
    )
    assert results["topic-type"].status.is_lost
    assert only(figures, "topic-type", GraphFigure).wrong == {"/chatter": "nobody publishes"}


TEXT = "".join(f"line {number}\n" for number in range(1, 201))


def code(text: str | bytes, *marks: int | None, file: str = "src/talker.py") -> list[CodeFigure]:
    runs = runs_of({})
    data = text if isinstance(text, bytes) else text.encode()
    build = runs["package"]
    object.__setattr__(build, "attachments", {"src/talker.py": data})
    return list(code_figures(build, [FileCitation(file=file, line=mark) for mark in marks]))


def test_three_lines_before_and_behind() -> None:
    (figure,) = code(TEXT, 100)
    assert figure.first_line == 97
    assert figure.lines == tuple(f"line {number}" for number in range(97, 104))
    assert figure.marked == (100,)


@pytest.mark.parametrize(("mark", "first", "count"), [(1, 1, 4), (2, 1, 5), (200, 197, 4)])
def test_at_the_ends_of_a_file(mark: int, first: int, count: int) -> None:
    (figure,) = code(TEXT, mark)
    assert (figure.first_line, len(figure.lines), figure.marked) == (first, count, (mark,))


def test_marks_near_each_other_are_one_figure() -> None:
    (figure,) = code(TEXT, 20, 12, 12, 10)
    assert figure.marked == (10, 12, 20)
    assert (figure.first_line, len(figure.lines)) == (7, 17)


def test_marks_far_apart_are_two() -> None:
    assert [f.marked for f in code(TEXT, 10, 150)] == [(10,), (150,)]


@pytest.mark.parametrize("mark", [None, 0, -3, 201])
def test_no_such_line(mark: int | None) -> None:
    assert code(TEXT, mark) == []


def test_files_that_were_not_kept_and_citations_of_messages() -> None:
    assert code(TEXT, 3, file="src/other.py") == []
    span = EvidenceCitation(evidence="talker.mcap", topic="/chatter")
    assert list(code_figures(runs_of({})["package"], [span])) == []


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_end_as_they_do_for_python(end: str) -> None:
    (figure,) = code(f"a{end}b\x0cb\u2028b{end}c{end}", 3)
    assert figure.lines == ("a", "b\x0cb\u2028b", "c")


@pytest.mark.parametrize(
    ("end", "shown"), [("\n", "#!/usr/bin/env python3"), ("\r\n", "#!/usr/bin/env python3\r")]
)
def test_a_shebang_has_its_carriage_return(end: str, shown: str) -> None:
    (figure,) = code(f"#!/usr/bin/env python3{end}import rospy{end}", 1)
    assert figure.lines == (shown, "import rospy")


def test_what_is_no_text_is_shown_all_the_same() -> None:
    (figure,) = code(b"\xef\xbb\xbf\xff\x00\nprint\n", 2)
    assert figure.lines == ("\ufffd\x00", "print")


def test_everything_is_bounded() -> None:
    figures = code(("x" * 10_000 + "\n") * 150, *range(1, 151))
    assert 1 < len(figures) <= FIGURES_MAX
    assert all(len(f.lines) <= LINES_MAX + 6 for f in figures)
    assert all(len(line) <= 300 for f in figures for line in f.lines)


def test_a_column_is_kept_where_its_line_is_shown() -> None:
    cited = [
        FileCitation(file="src/talker.py", line=2, column=3, source="line 2"),
        FileCitation(file="src/talker.py", line=3, column=10**6),
        FileCitation(file="src/talker.py", line=999, column=3),
    ]
    build = runs_of({})["package"]
    object.__setattr__(build, "attachments", {"src/talker.py": TEXT.encode()})
    (figure,) = code_figures(build, cited)
    assert figure.columns == {2: 3}
