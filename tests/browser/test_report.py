"""A student's report in a browser: the plots have their points, it obeys nobody, and it can be used without a mouse."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from fixtures.make import faulty_package
from grader.checks import CHECKS
from grader.report.html.page import render_html
from tests.browser.conftest import DESKTOP, PHONE
from tests.browser.test_class_page import LOOKS
from tests.report.anything import of, spoiled
from tests.report.hostile import ESCAPES, result, rubric
from tests.report.html.made import SCRIPT, code, counter, figures, graph, heard, hostile_figures, rate
from tests.report.nasty import STEERING

ROOT = Path(__file__).resolve().parents[2]
LAB = "leeds-comp3631-lab1"
DOCS = {"some-check": {**CHECKS["rate"].sections}}
ON_PHONES = pytest.param(PHONE, marks=pytest.mark.full)
SIZES = pytest.mark.parametrize("size", [DESKTOP, ON_PHONES], ids=["desktop", "phone"])
DARK = pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
# Of a path of single dots, how many there are, and whether they are somewhere.
DOTS = "all => all.map((one) => [one.getAttribute('d').split('M').length - 1, one.getBBox().width > 1])"


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    text = render_html(
        result(), rubric(scenarios={"real": {"title": "In real time"}}), figures(), hidden=0, docs=DOCS
    )
    path.write_text(text, encoding="utf-8")
    return path


def opened(page):
    page.locator("details").evaluate_all("all => all.forEach((one) => { one.open = true; })")
    return page


@pytest.fixture(scope="module")
def shown(visit_once, written):
    """The page with all of it folded out, for tests that change nothing in it."""
    return opened(visit_once(written))


@pytest.mark.parametrize(("size", "dark"), LOOKS)
def test_it_is_accessible_and_fits(visit, axe, written, size, dark) -> None:
    page = opened(visit(written, size=size, dark=dark))
    assert axe(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.full
def test_it_is_valid_html(validate, written) -> None:
    assert validate(written) == []


@SIZES
def test_points_and_what_was_lost_are_what_one_sees_first(visit, written, size) -> None:
    page = visit(written, size=size)
    assert page.locator("#points").bounding_box()["y"] < size.height / 2
    lost = page.locator("article[data-status=fail], article[data-status=partial]").first
    assert lost.locator("h3").bounding_box()["y"] < 0.6 * size.height, "the heading says what is wrong"


def test_what_is_cut_off_shows_that_it_scrolls_and_is_reached_by_keys(visit, written) -> None:
    page = opened(visit(written, size=PHONE))
    cut = page.locator(".scroll").evaluate_all(
        """all => all.filter((one) => one.scrollWidth > one.clientWidth).map((one) => [
            one.tabIndex, getComputedStyle(one).backgroundAttachment.split(", ").slice(0, 4).join(" "),
            [...one.querySelectorAll("svg.plot, table")].map((in_it) => getComputedStyle(in_it).backgroundColor)])"""
    )
    assert cut, "a phone is too narrow for some of it"
    for tab, attached, above in cut:
        assert tab == 0
        assert attached == "local local scroll scroll", "shadows at the edge behind which there is more"
        assert set(above) <= {"rgba(0, 0, 0, 0)"}, "nothing hides them"


@pytest.mark.full
def test_the_rate_and_a_short_graph_fit_a_phone(visit, written) -> None:
    page = opened(visit(written, size=PHONE))
    for kind in ("rate", "graph"):
        plot = page.locator(f"[data-figure={kind}] .scroll:has(svg)").first
        assert plot.evaluate("one => one.scrollWidth <= one.clientWidth"), kind


@pytest.mark.full
def test_a_wrapped_line_of_code_keeps_its_indentation(visit, tmp_path) -> None:
    line = "        publisher.publish(some_message, " + "and_another, " * 5 + ")"
    shown = figures().model_copy(update={"by_criterion": {"chatter-rate": (code(lines=("x", line, "y")),)}})
    path = tmp_path / "report.html"
    path.write_text(render_html(result(), rubric(), shown), encoding="utf-8")
    shown = visit(path, size=PHONE).locator("[data-figure=code]").first
    marked, number = shown.locator("mark"), shown.locator(".marked .ln").bounding_box()
    lefts = marked.evaluate("one => [...one.getClientRects()].map((line) => Math.round(line.left))")
    assert marked.bounding_box()["height"] > 1.5 * shown.locator(".row").last.bounding_box()["height"], (
        "it is wrapped"
    )
    assert min(lefts) - number["x"] - number["width"] > 40


def test_the_rate_has_a_dot_for_each_gap_its_band_and_the_gaps_histogram(shown) -> None:
    plots = shown.locator("[data-criterion=chatter-rate] [data-figure=rate]")
    assert plots.get_attribute("data-points") == str(len(rate().gaps_s))
    assert plots.locator("path.dots").evaluate_all(DOTS) == [[len(rate().gaps_s), True]]
    assert plots.locator("svg").count() == 2
    over_time, gaps = plots.locator("svg").all()
    assert over_time.locator("rect.band").count() == 1
    assert over_time.locator("rect.late").count() == len(rate().late)
    columns = gaps.locator("rect.column").evaluate_all("all => all.map((one) => one.getBBox().height)")
    assert len(columns) == 1  # all gaps are of one length
    assert columns[0] > 50


def test_the_counter_is_a_sawtooth_with_its_wraps_marked_and_the_wrong_step_circled(shown) -> None:
    plots = shown.locator("[data-criterion=counter-wrap] [data-figure=counter]")
    whole = plots.locator("svg").last
    assert whole.locator("path.dots").evaluate_all(DOTS) == [[len(counter().values), True]]
    assert whole.locator("path.line").evaluate("one => one.getTotalLength()") > 1000
    assert whole.locator("line.wrap").count() == len(counter().wraps)
    (circle,) = whole.locator("circle.wrong").all()
    assert circle.bounding_box()["width"] > 5
    assert "after 127 comes 1" in plots.inner_text()


def test_what_was_sent_stands_beside_what_was_heard(shown) -> None:
    table = shown.locator("[data-figure=heard] table")
    assert table.locator("tbody tr").count() == len(heard().rows)
    assert table.locator("tr.missed").all_inner_texts() == ["1.1 s\t0\t✗ not printed"]


def test_the_graph_has_all_nodes_and_topics_with_arrows(shown) -> None:
    drawn = shown.locator("[data-figure=graph]")
    assert drawn.locator("svg .node").count() == len(graph().nodes)
    assert drawn.locator("svg .topic").count() == len(graph().topics)
    assert drawn.locator("svg .arrow").count() == len(graph().edges)
    assert drawn.locator("details tbody tr").count() == len(graph().topics)


def test_the_console_has_its_lines_with_times(shown) -> None:
    lines = shown.locator("[data-figure=console] pre").inner_text().strip().splitlines()
    assert [line.split() for line in lines] == [
        ["0.000", "talker", "hello"],
        ["0.100", "talker", "stderr", "Traceback"],
    ]


def test_the_cited_line_is_marked_among_those_around_it(shown) -> None:
    code = shown.locator("[data-figure=code]").first
    assert code.locator("pre .row").count() == 3
    assert code.locator("mark").all_inner_texts() == ["rate.sleep"]
    assert code.locator(".row").nth(1).locator("> span").nth(1).text_content() == "    ", (
        "indented as in the file"
    )
    rows = [row.bounding_box() for row in code.locator("pre .row").all()]
    assert [row["y"] for row in rows] == sorted({row["y"] for row in rows}), "each line below the one before"
    assert {round(after["y"] - before["y"] - before["height"]) for before, after in pairwise(rows)} == {0}


@pytest.mark.full
def test_a_timeline_is_zoomed_by_keys_buttons_and_wheel_and_scrolled(visit, written) -> None:
    page = opened(visit(written))
    lanes = page.locator("[data-timeline]")
    scroll, plane = lanes.locator(".scroll"), lanes.locator(".plane")
    whole = plane.bounding_box()["width"]
    assert scroll.evaluate("one => one.scrollWidth - one.clientWidth") == 0, "all of it is seen first"
    scroll.focus()
    page.keyboard.press("+")
    page.keyboard.press("+")
    assert plane.bounding_box()["width"] == pytest.approx(4 * whole, rel=0.01)
    assert lanes.locator(".axis .fine").first.is_visible()
    before = scroll.evaluate("one => one.scrollLeft")
    page.keyboard.press("ArrowRight")
    page.wait_for_function("([one, was]) => one.scrollLeft > was", arg=[scroll.element_handle(), before])
    page.keyboard.press("0")
    assert plane.bounding_box()["width"] == pytest.approx(whole, rel=0.01)
    lanes.get_by_role("button", name="Zoom in").click()
    assert plane.bounding_box()["width"] == pytest.approx(2 * whole, rel=0.01)
    lanes.get_by_role("button", name="Show all").click()
    scroll.hover()
    page.keyboard.down("Control")
    page.mouse.wheel(0, -100)
    page.keyboard.up("Control")
    page.wait_for_function(
        "([one, was]) => one.getBoundingClientRect().width > was", arg=[plane.element_handle(), whole]
    )


def test_a_timeline_says_all_without_scripts(shown) -> None:
    said = shown.locator("[data-figure=timeline] .happened li").all_inner_texts()
    assert said[0].split() == ["0.5", "s", "process", "talker", "started"]
    assert "ended by itself: exit code 1" in said[-1]
    names = shown.locator("[data-figure=timeline] .names li").all_inner_texts()
    assert names == ["process talker", "topic /chatter"]


@pytest.mark.full
@DARK
def test_plots_can_be_told_from_their_ground(visit, written, dark) -> None:
    colours = "one => [getComputedStyle(one).stroke, getComputedStyle(one.ownerSVGElement).backgroundColor]"
    dots, ground = visit(written, dark=dark).locator("path.dots").first.evaluate(colours)
    channels = [[int(part) for part in re.findall(r"\d+", colour)[:3]] for colour in (dots, ground)]
    assert max(abs(one - other) for one, other in zip(*channels, strict=True)) > 90


def test_it_can_be_used_with_keys_alone(visit, written) -> None:
    page = visit(written)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the report"
    assert page.locator(".skip").bounding_box()["x"] >= 0
    summary, part = page.locator("details > summary").first, page.locator("details").first
    is_open = part.evaluate("one => one.open")
    summary.focus()
    page.keyboard.press("Enter")
    assert part.evaluate("one => one.open") != is_open
    outline = summary.evaluate("one => getComputedStyle(one).outlineWidth")
    assert outline not in {"", "0px"}


@pytest.mark.full
def test_a_link_to_a_criterion_opens_it(visit, written) -> None:
    page = visit(written)
    link = page.locator("#criteria > .item a").last
    target = link.get_attribute("href")
    link.click()
    assert page.locator(target).is_visible()
    assert page.locator(target).evaluate("one => one.tagName !== 'DETAILS' || one.open")


@pytest.mark.full
def test_a_command_is_copied(visit, written) -> None:
    page = visit(written)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    button = page.locator("button[data-copy]").first
    command = button.locator("xpath=..").locator("code").inner_text()
    button.click()
    page.get_by_role("button", name="Copied").or_(button.filter(has_text="Copied")).first.wait_for()
    assert page.evaluate("navigator.clipboard.readText()") == command


@pytest.mark.full
def test_print_shows_everything_on_white(visit, written) -> None:
    page = visit(written, dark=True)
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    closed = page.locator("details:not([open])").count()
    assert closed == 0
    assert not page.locator("nav").is_visible()
    assert len(page.pdf()) > 10_000


@SIZES
def test_texts_of_others_stay_texts(visit, validate, tmp_path, size) -> None:
    path = tmp_path / "report.html"
    shown = spoiled(of(f"{SCRIPT} {ESCAPES}")).model_copy(update={"error": None})
    shown = shown.model_copy(update={"criteria": (*shown.criteria, *result().criteria)})
    path.write_text(render_html(shown, rubric(), hostile_figures()), encoding="utf-8")
    page = opened(visit(path, size=size))
    assert any(SCRIPT in title for title in page.locator("h3").all_inner_texts())
    assert page.locator("figure").count() >= 8
    assert page.locator("img, main script, iframe, object").count() == 0
    assert page.evaluate("document.querySelectorAll('[onerror],[onload],[onclick]').length") == 0
    links = page.locator("a[href]").evaluate_all("all => all.map((one) => one.getAttribute('href'))")
    assert all(link.startswith("#") for link in links)
    assert not STEERING.search(page.locator("body").evaluate("one => one.textContent"))
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert validate(path) == []


@pytest.mark.full
@pytest.mark.ros
def test_a_real_grading_shows_what_was_recorded(visit, axe, validate, tmp_path) -> None:
    source = faulty_package(LAB, "counter-resets-to-1")
    command = [sys.executable, "-m", "grader", "grade", str(source), "--rubric", LAB, "--out", str(tmp_path)]
    subprocess.run(command, check=False, capture_output=True)  # the browser's loop runs in this process
    path = tmp_path / source.name / "report.html"
    assert path.stat().st_size < 400_000
    page = opened(visit(path))
    plots = page.locator("[data-figure=counter]")
    assert plots.count() >= 1
    for plot in plots.all():
        points = int(plot.get_attribute("data-points"))
        assert plot.locator("svg").last.locator("path.dots").evaluate_all(DOTS) == [[points, True]]
    assert page.locator("[data-criterion=counter-wrap] circle.wrong").count() >= 1
    assert page.locator("[data-figure=rate] path.dots").count() >= 1
    assert page.locator("[data-figure=graph] svg .node").count() >= 2
    assert axe(page) == []
    assert validate(path) == []
