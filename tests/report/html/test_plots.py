"""The plots: what is drawn, and the same in words."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree
from markupsafe import Markup

from grader.model.figure import Edge, GraphFigure, RateFigure
from grader.report.html.figures import Drawer
from grader.report.html.graph import graph_plot, graph_rows, is_bend, layered
from grader.report.html.plots import (
    counter_plots,
    counter_words,
    path_plot,
    path_words,
    rate_plots,
    rate_words,
    wrong_steps,
)
from grader.report.html.svg import ticks
from tests.report.html.made import EVERY, SCRIPT, counter, graph, rate, way

SVG = "{http://www.w3.org/2000/svg}"


def svg(plot: Markup) -> etree._Element:
    """The plot as XML; HTML gives `<svg>` its namespace itself."""
    return etree.fromstring(str(plot).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1))


def classed(plot: Markup, name: str) -> list[etree._Element]:
    return [e for e in svg(plot).iter() if name in e.get("class", "").split()]


def texts(plot: Markup) -> list[str]:
    return [e.text for e in svg(plot).iter(f"{SVG}text")]


@pytest.mark.parametrize("kind", EVERY)
def test_every_plot_is_an_image_with_a_title_and_words(kind):
    drawn = Drawer(console_chars=10_000).draw(EVERY[kind]())
    assert drawn.kind == kind
    assert drawn.points > 0
    for plot in drawn.plots:
        root = svg(plot)
        assert root.get("role") == "img"
        title, desc = (root.find(f"{SVG}{name}") for name in ("title", "desc"))
        assert root.get("aria-labelledby").split() == [title.get("id"), desc.get("id")]
        assert title.text
        assert desc.text
        assert drawn.words


def test_a_rate_has_its_dots_band_mean_and_late_stretches():
    over_time, gaps = rate_plots(rate(), "f1")
    (dots,) = classed(over_time, "dots")
    assert dots.get("d").count("M") == 30
    (band,) = classed(over_time, "band")
    (mean,) = classed(over_time, "mean")
    top = float(band.get("y"))
    assert float(mean.get("y1")) > top + float(band.get("height")), "5 Hz lies below the band"
    (late,) = classed(over_time, "late")
    assert late.get("fill") == "url(#f1-rate-late)"
    assert svg(over_time).xpath("//*[@id='f1-rate-late']")
    assert "mean 5.00 Hz" in texts(over_time)
    assert "9.5 to 10.5 Hz passes" in texts(over_time)
    assert len(classed(gaps, "column")) == 1
    assert len(classed(gaps, "bound")) == 2
    words = rate_words(rate())
    assert "5.00 Hz on average; 9.5 to 10.5 Hz (the green band) passes" in words
    assert "30 of 30 lie outside 50 to 150 ms" in words
    assert "late 1 time" in words


def test_bursts_do_not_flatten_the_plot():
    gaps = (1e-6, 0.0, 1.0) * 10
    over_time, histogram = rate_plots(rate(gaps_s=gaps, mean_hz=3.0), "f")
    assert "Hz (logarithmic)" in texts(over_time)
    assert "milliseconds from message to message (logarithmic)" in texts(histogram)
    (band,) = classed(over_time, "band")
    assert 100 < float(band.get("y")) < 200, "the band has its place in the middle"
    assert not re.search(r"\b(inf|nan|e\+)", over_time + histogram)


def test_one_large_value_leaves_room_to_the_others():
    figure = counter(values=(*range(30), 32767), numbers=(), times_s=tuple(range(31)), wraps=(), wrong=(30,))
    (plot,) = counter_plots(figure, "f")
    assert "value (logarithmic)" in texts(plot)
    heights = [float(y) for y in re.findall(r"M[\d.]+ ([\d.]+)h0", classed(plot, "dots")[0].get("d"))]
    assert heights[0] - heights[29] > 40, "0 to 29 take a good part of the height"


def test_the_end_of_a_node_is_named_where_it_was():
    over_time, _ = rate_plots(rate(died=((7.0, "talker ended: NameError"),)), "f")
    (line,) = classed(over_time, "died")
    dots = [float(x) for x in re.findall(r"M([\d.]+) ", classed(over_time, "dots")[0].get("d"))]
    assert float(line.get("x1")) > max(dots)
    assert "talker ended: NameError" in texts(over_time)
    assert not classed(rate_plots(rate(), "f")[0], "died")


def test_nothing_is_drawn_before_the_first_message():
    over_time, _ = rate_plots(rate(times_s=tuple(20.2 + 0.2 * i for i in range(30)), late=((2.0, 2.4),)), "f")
    dots = [float(x) for x in re.findall(r"M([\d.]+) ", classed(over_time, "dots")[0].get("d"))]
    assert min(dots) < 80, "20 s of silence before it take no room"
    assert not classed(over_time, "late")


def test_silence_at_the_end_is_named():
    assert "the last one is the silence at the end" in rate_words(rate(ends_silent=True))


def test_no_gap_is_no_plot():
    nothing = rate(times_s=(), gaps_s=(), mean_hz=None)
    assert rate_plots(nothing, "f") == []
    assert "Too few messages" in rate_words(nothing)


def test_a_counter_is_a_sawtooth_with_wraps_marked_and_wrong_steps_circled_and_zoomed():
    close, whole = counter_plots(counter(), "f2")
    assert classed(whole, "dots")[0].get("d").count("M") == 265
    assert len(classed(whole, "wrap-mark")) == 1
    assert "wrap 127 → 0" in texts(whole)
    for plot in (whole, close):
        assert len(classed(plot, "wrong")) == 1
        assert "#1: 127 → 1" in texts(plot)
    assert classed(close, "dots")[0].get("d").count("M") == 13
    assert {"126", "127", "2"} <= set(texts(close))
    assert list(wrong_steps(counter())) == ["#1, at 25.6 s: after 127 comes 1"]
    assert "wraps once correctly (127 → 0); 1 step is wrong" in counter_words(counter())


def test_points_that_are_left_out_break_the_line():
    figure = counter(
        values=(0, 1, 50, 51), numbers=(0, 1, 50, 51), times_s=(0, 1, 50, 51), wraps=(), wrong=()
    )
    (plot,) = counter_plots(figure, "f")
    assert classed(plot, "line")[0].get("d").count("M") == 2


def test_more_wrong_steps_than_can_be_named_are_counted():
    wrong = tuple(range(1, 30))
    figure = counter(wrong=wrong, texts=("no",) * 29, more_wrong=5)
    notes = list(wrong_steps(figure))
    assert len(notes) == 13
    assert notes[-1] == "… and 22 more"
    assert "34 steps are wrong" in counter_words(figure)


@pytest.mark.parametrize("values", [(0, 2**63 - 1), (-(10**18), 10**18), (1.5, 2.25), (7, 7)])
def test_any_numbers_can_be_drawn(values):
    figure = counter(values=values, numbers=(0, 1), times_s=(1.0, 1.0), wraps=(), wrong=(1,), texts=("x",))
    (plot,) = counter_plots(figure, "f")
    heights = [float(one.get(end)) for one in svg(plot).iter(f"{SVG}line") for end in ("y1", "y2")]
    assert 0 <= min(heights) < max(heights) <= 240


def places(plot: Markup, name: str) -> dict[str, float]:
    """The middle of each node or topic, by the name that is written in it."""
    root = svg(plot)
    found = {}
    for text in root.iter(f"{SVG}text"):
        if "name" in text.get("class", ""):
            found[text.text] = float(text.get("x"))
    return {key: x for key, x in found.items() if name in key}


def test_a_graph_has_ellipses_for_nodes_and_boxes_for_topics_from_left_to_right():
    plot = graph_plot(graph(), "f3")
    assert len(classed(plot, "node")) == 2
    assert {e.tag for e in classed(plot, "node")} == {f"{SVG}ellipse"}
    assert {e.tag for e in classed(plot, "topic")} == {f"{SVG}rect"}
    assert len(classed(plot, "arrow")) == 3
    x = places(plot, "/")
    assert x["/talker"] < x["/chatter"] < x["/listener"]
    assert "std_msgs/String" in texts(plot)
    assert list(graph_rows(graph())) == [
        ("/chatter", "std_msgs/String", "/talker", "/listener"),
        ("/numeric_chatter", "", "/talker", "none"),
    ]


def test_what_is_wrong_in_a_graph_is_drawn_and_named():
    figure = graph(
        topics=(*graph().topics, "/numbers"),
        missing=("/numbers",),
        wrong={"/numbers": "nobody publishes", "/talker": "not /sender"},
    )
    plot = graph_plot(figure, "f")
    assert len(classed(plot, "missing")) == 1
    assert len(classed(plot, "wrong")) == 2
    assert {"nobody publishes", "not /sender"} <= set(texts(plot))


def test_the_number_of_an_anonymous_node_takes_no_room_in_a_graph():
    edge = Edge(node="/talker_4711_1700000000000", topic="/chatter", publishes=True)
    plot = graph_plot(graph(nodes=(edge.node,), topics=("/chatter",), edges=(edge,)), "f")
    assert "/talker_…" in texts(plot)


def test_a_flood_has_a_column_for_each_tenth_of_a_second_and_a_line_that_passes():
    (plot,) = rate_plots(rate(counts=(560, 540, 0, 555), mean_hz=5500.0), "f")
    assert len(classed(plot, "column")) == 3
    assert len(classed(plot, "passes")) == 1
    assert {"mean 5,500 Hz", "green: 9.5 to 10.5 Hz passes"} <= set(texts(plot))


def test_a_counter_with_a_fast_clock_is_drawn_by_that_clock():
    (whole, *_) = counter_plots(counter(faster=20.0), "f")
    assert "seconds of ROS's clock, 20 times as fast as real time" in texts(whole)


def test_a_graph_that_nobody_could_read_is_a_list():
    many = tuple(f"/n{i}" for i in range(50))
    figure = graph(nodes=many, edges=tuple(Edge(node=n, topic="/chatter", publishes=True) for n in many))
    assert graph_plot(figure, "f") is None
    drawn = Drawer(console_chars=0).draw(figure)
    assert drawn.rows
    assert not drawn.plots


def test_a_node_that_hears_itself_is_drawn():
    edges = tuple(Edge(node="/a", topic="/t", publishes=p) for p in (True, False))
    plot = graph_plot(GraphFigure(scenario="s", nodes=("/a",), topics=("/t",), edges=edges), "f")
    assert len(classed(plot, "arrow")) == 2


def test_edges_to_what_is_not_shown_are_left_out():
    edges = (*graph().edges, Edge(node="/gone", topic="/chatter", publishes=True))
    assert len(classed(graph_plot(graph(edges=edges), "f"), "arrow")) == 3


VERTICES = st.integers(1, 12).map(lambda count: [f"n{i}" for i in range(count)])


@given(st.data())
def test_layers_lead_to_the_right_and_hold_every_vertex_once(data):
    vertices = data.draw(VERTICES)
    arrows = data.draw(st.lists(st.tuples(st.sampled_from(vertices), st.sampled_from(vertices)), max_size=20))
    arrows = [(a, b) for a, b in arrows if a != b]
    found = layered(vertices, arrows)
    column = {v: i for i, held in enumerate(found.columns) for v in held}
    assert sorted(v for v in column if not is_bend(v)) == sorted(vertices)
    assert found.routes.keys() == set(arrows)
    for route in found.routes.values():
        assert [column[v] for v in route] == list(range(column[route[0]], column[route[0]] + len(route)))


def test_what_leads_nowhere_back_has_no_arrow_back():
    found = layered(["a", "b", "c"], [("a", "b"), ("b", "c"), ("a", "c")])
    assert found.back == frozenset()
    assert found.columns[0] == ("a",)


def test_a_way_shows_the_room_the_corners_and_where_it_strays():
    plot = path_plot(way(), "f4")
    assert len(classed(plot, "corner")) == 5
    assert len(classed(plot, "passed")) == 2
    assert len(classed(plot, "wrong")) == 1
    assert "leaves it here" in texts(plot)
    assert "passed 2 of 5 points" in path_words(way())
    assert "x 2.9, y 1" in path_words(way())
    assert "stayed within that" in path_words(way(strayed=None))


def test_a_robot_that_stood_still_can_be_drawn():
    svg(path_plot(way(points=((0, 0),), reached=1, strayed=None), "f"))
    assert path_plot(way(points=(), corners=(), reached=0, strayed=None), "f") is None


@pytest.mark.parametrize(("low", "high"), [(0, 10), (0, 1), (-128, 127), (2.34, 2.42), (0, 1e9), (0, 1e-6)])
def test_ticks_are_few_round_and_inside(low, high):
    found = ticks(low, high)
    assert 2 <= len(found) <= 11
    assert all(low - 1e-9 <= value <= high * (1 + 1e-9) for value in found)


def test_no_span_has_no_ticks():
    assert ticks(1, 1) == []
    assert ticks(0, math.inf) == []


def test_hostile_names_stay_text():
    for figure in (
        rate(topic=SCRIPT),
        rate(publisher=SCRIPT),
        counter(topic=SCRIPT, texts=(SCRIPT,)),
        way(topic=SCRIPT),
    ):
        for plot in Drawer(console_chars=0).draw(figure).plots:
            assert not svg(plot).xpath("//*[local-name()='script' or local-name()='img']")
    plot = graph_plot(
        graph(nodes=(SCRIPT, "/b"), edges=(Edge(node=SCRIPT, topic="/chatter", publishes=True),)), "f"
    )
    assert not svg(plot).xpath("//*[local-name()='script']")


FINITE = st.floats(0, 1e6, allow_nan=False)


@given(st.lists(st.tuples(FINITE, FINITE), min_size=1, max_size=30), st.one_of(st.none(), FINITE))
def test_any_rate_can_be_drawn(points, mean_hz):
    figure = RateFigure(
        topic="/t",
        publisher="/p",
        scenario="s",
        times_s=tuple(sorted(t for t, _ in points)),
        gaps_s=tuple(g for _, g in points),
        mean_hz=mean_hz,
        low_hz=9.5,
        high_hz=10.5,
        late=((0.0, 1e6),),
    )
    for plot in rate_plots(figure, "f"):
        assert not re.search(r'"[^"]*\b(inf|nan)\b', plot)
        svg(plot)
