"""The class's page in a browser: it sorts, filters, shows what it has to, asks for nothing, and obeys nobody."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml

from grader.model.batch import Entry
from grader.report.class_page.page import write_class_page
from tests.browser.conftest import DESKTOP, PHONE
from tests.report.class_page.made_up import CRITERIA, FAULTS, made_up_rows, made_up_run
from tests.report.nasty import PIECES

COUNT = 60
ON_PHONES = pytest.param(PHONE, marks=pytest.mark.full)
SIZES = pytest.mark.parametrize("size", [DESKTOP, ON_PHONES], ids=["desktop", "phone"])
LOOKS = [
    pytest.param(PHONE, True, id="dark-phone"),
    pytest.param(DESKTOP, False, id="light-desktop", marks=pytest.mark.full),
    pytest.param(DESKTOP, True, id="dark-desktop", marks=pytest.mark.full),
    pytest.param(PHONE, False, id="light-phone", marks=pytest.mark.full),
]


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("class") / "index.html"
    write_class_page(made_up_run(COUNT, faults=FAULTS), made_up_rows(COUNT), path)
    return path


@pytest.fixture(scope="module")
def shown(visit_once, written):
    """The page, for tests that change nothing in it."""
    return visit_once(written)


def ids(page) -> list[str]:
    """The submissions of the table as it is shown."""
    return page.locator("#submissions tbody tr").evaluate_all("rows => rows.map((row) => row.dataset.id)")


def column(page, name: str) -> list[str]:
    place = page.locator("#submissions thead th").evaluate_all(
        "(heads, name) => heads.findIndex((head) => head.dataset.column === name)", name
    )
    return page.locator(f"#submissions tbody tr > :nth-child({place + 1})").all_inner_texts()


def by_id() -> dict:
    return {entry.id: result for entry, result in made_up_rows(COUNT)}


@pytest.mark.parametrize(("size", "dark"), LOOKS)
def test_it_is_accessible_and_fits(visit, axe, written, size, dark) -> None:
    page = visit(written, size=size, dark=dark)
    page.locator("details").evaluate_all("all => all.forEach((one) => { one.open = true; })")
    page.locator("#heat-scroll").press("ArrowRight")
    assert axe(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.full
def test_it_is_valid_html(validate, tmp_path) -> None:
    run, rows = made_up_run(20, "interrupted", faults=FAULTS), made_up_rows(20, missing=3)
    for anonymous in (False, True):
        write_class_page(run, rows, tmp_path / f"{anonymous}.html", anonymous=anonymous)
    assert validate(tmp_path / "False.html", tmp_path / "True.html") == []


def test_all_submissions_are_there_in_the_rosters_order_with_links(shown) -> None:
    assert ids(shown) == list(by_id())
    href = shown.locator("#submissions tbody a").first.get_attribute("href")
    assert href == f"{ids(shown)[0]}/report.html"
    assert shown.locator("#shown").inner_text() == f"{COUNT} submissions"


@pytest.mark.full
@SIZES
def test_it_sorts_by_click_and_by_key(visit, written, size) -> None:
    page = visit(written, size=size)
    head = page.locator("th[data-column=points]")
    button = page.get_by_role("button", name="Points")
    button.click()
    assert head.get_attribute("aria-sort") == "descending"
    points = [float(text) for text in column(page, "points") if text[0].isdigit()]
    assert points == sorted(points, reverse=True)
    assert len(points) > COUNT // 2
    button.focus()
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "ascending"
    points = [float(text) for text in column(page, "points") if text[0].isdigit()]
    assert points == sorted(points)
    page.get_by_role("button", name="Submission", exact=True).press(" ")
    assert head.get_attribute("aria-sort") is None
    assert ids(page) == sorted(by_id())


@pytest.mark.full
def test_every_column_sorts_both_ways(visit, written) -> None:
    page = visit(written)
    for head in page.locator("#submissions thead th").all():
        head.get_by_role("button").click()
        one = head.get_attribute("aria-sort")
        head.get_by_role("button").click()
        assert {one, head.get_attribute("aria-sort")} == {"ascending", "descending"}
        assert sorted(ids(page)) == sorted(by_id())


@pytest.mark.full
def test_it_filters_by_text_status_and_lost_criterion(visit, written) -> None:
    page, all_of_them = visit(written), by_id()
    one = next(iter(all_of_them))
    page.get_by_role("searchbox").fill(one.upper())
    assert ids(page) == [one]
    assert page.locator("#shown").inner_text() == f"1 of {COUNT} submissions"
    page.get_by_role("button", name="Show all", exact=True).first.click()
    assert len(ids(page)) == COUNT
    page.locator("#filter-state").select_option("inconclusive")
    assert ids(page) == [i for i, r in all_of_them.items() if r.status == "inconclusive"]
    page.locator("#filter-state").select_option("")
    page.locator("#filter-lost").select_option(label="The counter wraps from 127 to 0")
    lost = [i for i, r in all_of_them.items() if r.error is None and r.criteria[12].status.value != "pass"]
    assert ids(page) == lost != []
    page.locator("#filter-lost").select_option("")
    page.locator("#filter-mark").select_option("late")
    assert ids(page) == [i for i, r in all_of_them.items() if r.late] != []
    page.get_by_role("searchbox").fill("nobody is called that")
    assert ids(page) == []


def test_the_heat_map_has_a_cell_for_each_criterion_and_submission(shown) -> None:
    judged = sum(result.error is None for result in by_id().values())
    assert shown.locator("#heat-scroll rect.cell").count() == len(CRITERIA) * judged
    assert shown.locator(".heat-names li").count() == len(CRITERIA)


@pytest.mark.full
@SIZES
def test_the_heat_map_tells_each_cell_by_pointer_and_key(visit, written, size) -> None:
    page, all_of_them = visit(written, size=size), by_id()
    best = max((r for r in all_of_them.values() if r.error is None), key=lambda r: r.points)
    said = page.locator("#heat-said")
    page.locator("#heat-scroll rect.cell").first.hover()
    assert said.inner_text().startswith(best.submission.id)
    rows = page.locator(".heat-names li").all_inner_texts()
    assert sorted(rows) == sorted(title for _, title, _, _ in CRITERIA)
    assert rows[0] in said.inner_text()
    scroll = page.locator("#heat-scroll")
    scroll.press("ArrowDown")
    assert rows[1] in said.inner_text()
    scroll.press("ArrowRight")
    assert not said.inner_text().startswith(best.submission.id)
    who = said.inner_text().split(" ")[0]
    scroll.press("Enter")
    assert ids(page) == [who]


def test_the_histogram_counts_everybody_who_was_judged(shown) -> None:
    titles = shown.locator("#points ~ * rect.pile title").evaluate_all(
        "all => all.map((one) => one.textContent)"
    )
    counts = [int(title.rpartition(": ")[2]) for title in titles]
    assert sum(counts) == sum(result.error is None for result in by_id().values())


@pytest.mark.full
def test_diagnoses_are_largest_first_and_their_names_fold_out(visit, written) -> None:
    page = visit(written)
    boxes = page.locator("#diagnoses ~ ol > .diagnosis")
    many = [int(text) for text in page.locator(".diagnosis .many").all_text_contents()]
    assert many == sorted(many, reverse=True)
    first = boxes.first
    assert first.locator(".members a").count() == 0
    first.locator("summary").click()
    first.locator(".members a").first.wait_for()
    names = first.locator(".members a").all_inner_texts()
    assert len(names) == many[0]
    first.locator("textarea").fill('see "lecture 3": it is there')
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    first.get_by_role("button", name="Copy it for overrides.yaml").click()
    first.get_by_role("button", name="Copied").wait_for()
    given = yaml.safe_load(page.evaluate("navigator.clipboard.readText()"))
    assert sorted(given) == sorted(names)
    comment = {"comment": 'see "lecture 3": it is there'}
    each = [one for own in given.values() for one in own.values()]
    assert comment in each  # the points stay the check's
    assert all(one | comment == one and one.keys() <= {"comment", "points"} for one in each)
    first.get_by_role("button", name="Show them in the table").click()
    assert sorted(ids(page)) == sorted(names)
    page.locator("#picked button").click()
    assert len(ids(page)) == COUNT


@pytest.mark.full
def test_who_lost_a_criterion_is_shown_from_the_list_of_costs(visit, written) -> None:
    page = visit(written)
    button = page.locator("[data-cost-show]").first
    many = int(button.inner_text())
    button.click()
    assert len(ids(page)) == many


@pytest.mark.full
def test_what_is_left_to_do_comes_with_its_command(visit, written) -> None:
    page = visit(written)
    page.locator("#todo-inconclusive summary").click()
    command = page.locator("#todo-inconclusive code").inner_text()
    assert command.startswith("grader batch 'roster of 2026.csv' --rubric leeds-comp3631-lab1 --out ")
    assert command.endswith(" --only inconclusive")
    items = page.locator("#todo-inconclusive li a").all_inner_texts()
    assert items == [i for i, r in by_id().items() if r.status == "inconclusive"]
    assert page.locator("#todo-error code").text_content().endswith(" --only failed")


@pytest.mark.full
def test_a_large_class_comes_in_pages(visit, tmp_path) -> None:
    path = tmp_path / "index.html"
    write_class_page(made_up_run(1234), made_up_rows(1234), path)
    page = visit(path)
    assert len(ids(page)) == 100
    first = ids(page)
    page.get_by_role("button", name="Next page").click()
    assert page.locator("#page-said").inner_text() == "Page 2 of 13"
    assert not set(first) & set(ids(page))
    assert page.locator("#heat-scroll rect.cell").count() == len(CRITERIA) * 120
    page.locator("#heat-scroll").press("ArrowRight")
    assert re.match(r"\d+ submissions with 100 points", page.locator("#heat-said").inner_text())
    page.get_by_role("button", name="Points").click()
    assert page.locator("#page-said").inner_text() == "Page 1 of 13"


NASTY = (
    "</script><script>document.title='owned'</script>",
    "<img src=x onerror=\"document.title='owned'\">",
    "'><svg/onload=alert(1)>",
    "{{7*7}} ${7*7} <!--<script>",
    "javascript:alert(1)",
    "\u202egnp.exe\u2066 \x00\x1b[31m",
    *PIECES,
)


def test_texts_of_others_stay_texts(visit, validate, tmp_path) -> None:
    path = tmp_path / "index.html"
    rows = []
    for i, (_, result) in enumerate(made_up_rows(len(NASTY))):
        nasty = NASTY[i]
        criteria = tuple(c.model_copy(update={"message": nasty, "title": nasty}) for c in result.criteria)
        named = Entry(id=f"{i}{nasty}", source=nasty, name=nasty, group=nasty)
        submission = result.submission.model_copy(update={"id": f"{i}{nasty}"})
        rows.append((named, result.model_copy(update={"criteria": criteria, "submission": submission})))
    run = made_up_run(len(NASTY), title=NASTY[0], roster=NASTY[1] + "'; touch x", cluster=NASTY[2])
    titled = tuple(
        c.model_copy(update={"title": nasty}) for c, nasty in zip(run.criteria, NASTY, strict=False)
    )
    write_class_page(run.model_copy(update={"criteria": titled}), rows, path)
    page = visit(path)
    page.locator("details").evaluate_all("all => all.forEach((one) => { one.open = true; })")
    page.locator("#heat-scroll").press("ArrowRight")
    assert page.title() == f"{NASTY[0]}: the class"
    assert page.locator("h1").inner_text() == NASTY[0]
    assert page.locator("img, main script, svg:not(.plot)").count() == 0
    assert len(ids(page)) == min(100, len(NASTY))
    assert column(page, "name")[0] == NASTY[0]
    links = page.locator("a[href]").evaluate_all("all => all.map((one) => one.getAttribute('href'))")
    assert all(re.fullmatch(r"#[a-z-]+|[\w.~%-]+/report\.html|gradebook\.csv", link) for link in links)
    assert not re.search("[\x00-\x08\x1b\u202e\u2066]", path.read_text(encoding="utf-8"))
    assert validate(path) == []


def test_the_data_of_the_page_reads_back(shown) -> None:
    data = json.loads(shown.locator("#data").text_content())
    assert [row[0] for row in data["rows"]] == list(by_id())


@pytest.mark.full
def test_an_anonymous_page_works_the_same(visit, axe, tmp_path) -> None:
    path = tmp_path / "index.html"
    write_class_page(made_up_run(COUNT), made_up_rows(COUNT), path, anonymous=True)
    page = visit(path)
    assert ids(page) == [f"S{number:03}" for number in range(1, COUNT + 1)]
    assert page.locator("a[href*='report.html']").count() == 0
    page.get_by_role("button", name="Points").click()
    page.locator(".diagnosis summary").first.click()
    assert axe(page) == []


@pytest.mark.full
def test_an_interrupted_batch_says_so_on_its_page(visit, tmp_path) -> None:
    path = tmp_path / "index.html"
    write_class_page(made_up_run(20, "interrupted"), made_up_rows(20, missing=7), path)
    page = visit(path)
    assert "interrupted" in page.locator("#state").inner_text()
    assert "7 of 20 submissions are not graded yet" in page.locator("#state").inner_text()
    assert "--only" not in page.locator("#todo-missing code").text_content()


@pytest.mark.full
@pytest.mark.parametrize("count", [0, 1])
def test_a_class_of_nobody_and_of_one(visit, axe, tmp_path, count) -> None:
    path = tmp_path / "index.html"
    write_class_page(made_up_run(count), made_up_rows(count), path)
    page = visit(path)
    assert len(ids(page)) == count
    assert axe(page) == []
