"""The page that a student reads: all that it has to say, in order, and nothing of it obeyed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from lxml import html as parser

from grader.checks import CHECKS
from grader.errors import GraderError, blame
from grader.model.figure import Figures
from grader.model.result import ErrorInfo, GradingResult, Lateness, Note
from grader.model.verdict import FileCitation, Mistake, Status
from grader.report.html.page import BYTES_MAX, render_html
from grader.report.html.shell import policy, script
from grader.report.sentences import FAULTS, MINUS
from grader.report.text import code_parts, line, visible
from grader.report.view import commands_in
from tests.report.anything import FIELDS, HUGE, SOME, decided, of, results, spoiled
from tests.report.hostile import CRITERIA, result, rubric
from tests.report.html.made import SCRIPT, code, console, figures, graph, hostile_figures
from tests.report.nasty import STEERING
from tests.support.a_class import criterion

DOCS = {"some-check": {**CHECKS["rate"].sections}}
GOLDEN = Path(__file__).parent / "golden" / "report.html"
SCENARIOS = {"real": {"title": "The talker in real time"}}
VOID_ADDRESS = re.compile(r"^(#|data:,$)")


def page(shown: GradingResult | None = None, drawn: Figures | None = None, **how) -> str:
    beside = {"hidden": 0, "docs": DOCS, **how}
    of_rubric = beside.pop("rubric", None) or rubric(scenarios=SCENARIOS)
    return render_html(shown or result(), of_rubric, figures() if drawn is None else drawn, **beside)


def parsed(text: str) -> parser.HtmlElement:
    return parser.document_fromstring(text)


def words(element: parser.HtmlElement) -> str:
    return " ".join(element.text_content().split())


def card(document: parser.HtmlElement, name: str) -> parser.HtmlElement:
    (found,) = document.xpath(f"//*[@data-criterion='{name}']")
    return found


def test_the_report_is_as_kept():
    made = page(
        result(criteria=CRITERIA[:3], notes=(Note(scenario="real", actor="/a", kind="limit", text="x"),))
    )
    made = re.sub(r"<style>.*?</style>|<script>.*?</script>", "", made, flags=re.DOTALL) + "\n"
    if os.environ.get("GRADER_REGENERATE"):
        GOLDEN.parent.mkdir(exist_ok=True)
        GOLDEN.write_text(made)
    assert made == GOLDEN.read_text()


def test_points_come_first_then_what_was_lost_the_most_expensive_first():
    document = parsed(page())
    assert words(document.find(".//title")).startswith("12.5 of 100 points: ada")
    assert document.get_element_by_id("points").text == "12.5"
    order = [c.get("data-criterion") for c in document.xpath("//section[h2/@id='lost']/article")]
    assert order == ["talker-node", "chatter-rate", "listener-chatter"]
    text = words(document.find(".//main"))
    assert text.index("To fix") < text.index("Not decided yet") < text.index("All criteria")
    assert "3 mistakes cost 47.5 points, the first one alone 30." in words(document)


def test_a_card_says_what_why_how_to_mend_it_and_where():
    found = card(parsed(page()), "chatter-rate")
    text = words(found)
    lost = CRITERIA[1]
    for said in (
        lost.title,
        lost.message,
        lost.expected,
        lost.measured,
        lost.hint,
        "0 of 10",
    ):
        assert said in text
    assert DOCS["some-check"]["Why it matters on a robot"] in text
    assert "rate = rospy.Rate(10) once before the loop" in text
    assert found.xpath(".//code[.='rostopic hz <topic>']"), "backticks become code"
    assert found.xpath(".//div[@class='command'][.//code[.='rostopic hz /chatter']]/button[@data-copy]")
    assert found.xpath(".//*[@data-figure='rate'][@data-points='30']//*[local-name()='svg']")
    assert [words(mark) for mark in found.xpath(".//*[@data-figure='code']//mark")] == ["rate.sleep"]
    assert "real.mcap /chatter, 6.0 s" in text
    assert found.get("data-status") == "fail"


def test_a_line_that_is_shown_with_its_code_is_not_named_again():
    assert "numeric_talker.py:17" not in words(card(parsed(page()), "chatter-rate"))
    assert "numeric_talker.py:17" in words(card(parsed(page(drawn=Figures())), "chatter-rate"))


def test_what_a_loss_holds_back_is_named_and_linked():
    document = parsed(page())
    found = card(document, "talker-node")
    targets = [link.get("href")[1:] for link in found.xpath(".//div[@class='holds']//a")]
    assert [document.get_element_by_id(t).get("data-criterion") for t in targets] == [
        "counter-start",
        "counter-step",
        "counter-wrap",
    ]
    assert f"{MINUS}5 here, {MINUS}30 in all: also counter-start {MINUS}5" in words(found)


def test_every_criterion_has_its_details_once_and_its_row():
    document = parsed(page())
    assert sorted(c.get("data-criterion") for c in document.xpath("//*[@data-criterion]")) == sorted(
        c.id for c in CRITERIA
    )
    criteria = document.get_element_by_id("criteria")
    rows = [row.get("data-row") for row in criteria.xpath(".//*[@data-row]")]
    assert sorted(rows) == sorted(c.id for c in CRITERIA)
    assert criteria.get("data-rows") == str(len(CRITERIA))
    passed = criteria.xpath("./details[@class='passed']//*[@data-row]/@data-status")
    assert passed
    assert set(passed) == {"pass"}


def test_each_status_has_a_word_beside_its_colour():
    badges = {words(badge) for badge in parsed(page()).xpath("//*[starts-with(@class, 'badge status-')]")}
    still = {f"{sign} not decided yet" for sign in "?!•"}
    assert badges == {"✓ passed", "✗ to fix", "◐ to fix", "⊘ not tested"} | still


def test_files_that_have_to_be_written_are_one_card_which_says_what_they_hold():
    asked = {"launch/a.launch": "a.launch starts /talker", "config/b.yaml": "it sets /rate"}
    lost = tuple(
        criterion(
            f"file-{i}",
            Status.FAIL,
            0,
            10,
            message=f"{path} is not in the package",
            expected=holds,
            hint=f"write {path}",
            mistake=Mistake(kind="file-missing", name=path),
        )
        for i, (path, holds) in enumerate(asked.items())
    )
    document = parsed(page(result(criteria=lost)))
    (only,) = document.xpath("//section[h2/@id='lost']/article")
    assert "2 files are not in the package 0 of 20" in words(only)
    assert [words(item) for item in only.xpath(".//div[@class='files']//li")] == [
        f"launch/a.launch {MINUS}10Starts /talker",
        f"config/b.yaml {MINUS}10It sets /rate",
    ]
    assert not only.xpath(".//div[@class='see']"), "a command would only say that there is none"


def test_code_that_a_fix_says_to_write_can_be_copied():
    def copied(hint: str) -> list[str]:
        found = card(parsed(page(result(criteria=(criterion("a", Status.FAIL, 0, 5, hint=hint),)))), "a")
        return found.xpath(".//*[contains(@class, 'hint')]//button/@data-copy")

    assert copied("write `rate.sleep()` as the last line") == ["rate.sleep()"]
    assert copied("add <depend>rospy</depend> below line 4; then on line 7, write f(a)") == [
        "<depend>rospy</depend>",
        "f(a)",
    ]
    assert copied("write talker.py") == copied("remove `rate.sleep()`") == []


def test_the_same_picture_is_drawn_once():
    document = parsed(page())
    assert len(document.xpath("//*[@data-figure='rate']")) == 1
    link = card(document, "manifest").xpath(".//p[@class='where']/a")[0]
    assert document.get_element_by_id(link.get("href")[1:]).get("data-figure") == "rate"


def test_a_loss_without_a_plot_shows_the_graph_of_its_run():
    lost = criterion("launch", Status.FAIL, 0, 5, scenario="real")
    drawn = Figures(graphs={"real": graph()}, by_criterion={"launch": (code(),)})
    document = parsed(page(result(criteria=(lost,)), drawn))
    assert card(document, "launch").xpath(".//*[@data-figure='graph']")
    assert "The same picture" in words(document.xpath("//*[@data-scenario='real']")[0])


def test_everything_reached_is_a_short_congratulation():
    good = result(criteria=(CRITERIA[0],), points=5, max_points=5, status="graded")
    document = parsed(page(good))
    assert "every criterion that counts is met. Well done!" in words(document.find(".//header"))
    assert words(document.find_class("verdict")[0]) == "Passed"
    assert not document.xpath("//*[@id='lost' or @id='open' or @id='advice']")


def test_visible_and_hidden_criteria_are_honestly_worded():
    good = result(criteria=(CRITERIA[0],), points=5, max_points=5, status="graded")
    document = parsed(page(good, hidden=5))
    assert words(document.get_element_by_id("left-out")) == "1 visible check passed; 5 more run at grading."
    assert words(document.find_class("verdict")[0]) == "So far, so good"
    both = parsed(page(result(criteria=CRITERIA[:3]), hidden=1))
    assert (
        words(both.get_element_by_id("left-out")) == "1 of 3 visible checks passed; 1 more runs at grading."
    )
    assert not parsed(page()).xpath("//*[@id='left-out']")


def test_the_whole_view_marks_hidden_criteria():
    data = rubric(scenarios=SCENARIOS).model_dump(by_alias=True)
    for each in data["criteria"]:
        each["visibility"] = "hidden" if each["id"] == "chatter-rate" else "visible"
    document = parsed(page(rubric=type(rubric()).model_validate(data)))
    marked = document.xpath("//*[@data-criterion][.//*[contains(@class, 'hidden-criterion')]]")
    assert [c.get("data-criterion") for c in marked] == ["chatter-rate"]


def test_pictures_of_criteria_and_runs_that_are_left_out_are_not_there():
    shown = result(criteria=(criterion("manifest", Status.PASS, 5, 5),))
    secret = Figures(
        by_criterion={"chatter-rate": (code(lines=("secret",), marked=()),)},
        consoles={"real": console("secret"), "package": console("building")},
    )
    text = page(shown, secret, hidden=10)
    assert "building" in text
    assert "secret" not in text


@pytest.mark.parametrize(
    ("kind", "whose"),
    [("submission", "submission"), ("package-not-found", "submission"), ("ros-missing", "machine"),
     ("host", "machine"), ("arena", "machine"), ("internal", "grader"), ("never-heard-of", "grader")],
)  # fmt: skip
def test_an_error_says_what_happened_and_whose_fault_it_is(kind, whose):
    error = ErrorInfo(kind=kind, message="it broke", hint="do this")
    document = parsed(page(result(status="error", error=error, criteria=()), Figures()))
    notice = document.xpath("//*[@data-error]")[0]
    assert "It could not be graded it broke What to do: do this" in words(notice)
    assert FAULTS[whose] in words(notice)
    assert words(document.find_class("verdict")[0]) == "Not graded"
    assert not document.xpath("//*[@id='points']")


def test_every_error_of_the_grader_has_somebody_at_fault():
    def below(kind: type[GraderError]) -> Iterator[type[GraderError]]:
        yield kind
        for each in kind.__subclasses__():
            yield from below(each)

    assert {blame(error.kind) for error in below(GraderError)} <= FAULTS.keys()


def test_what_a_person_decided_what_being_late_cost_and_what_was_noticed():
    shown = result(
        overrides=(decided(CRITERIA[1], of("because")),),
        late=Lateness(points_before=15, points=12.5, text="a day late"),
        notes=(Note(scenario="real", actor="/talker", kind="refused", text="asked to shut down"),),
    )
    document = parsed(page(shown))
    assert "title of chatter-rate: 0 of 10 by because: because The check says:" in words(document)
    assert "look again" in words(document)
    assert "15 of 100 points before, 12.5 after: a day late" in words(document.find(".//footer"))
    assert "real, /talker: asked to shut down (refused)" in words(document)
    assert "Being late costs you 2.5 points." in words(document.find(".//header"))


def test_all_reached_but_late_is_no_congratulation():
    shown = result(
        criteria=(CRITERIA[0],),
        points=4,
        max_points=5,
        status="graded",
        late=Lateness(points_before=5, points=4, text="late"),
    )
    text = words(parsed(page(shown)).find(".//header"))
    assert "Being late costs you 1 point." in text
    assert "You lost nothing" not in text


def test_only_what_can_be_mended_says_how_to_mend_it():
    document = parsed(page())
    assert "How to fix it" in words(card(document, "chatter-rate"))
    for name in ("manifest", "build", "counter-start", "style"):
        assert "How to fix it" not in words(card(document, name))


def test_it_says_how_to_judge_it_again():
    assert "grader judge evidence --rubric hostile-lab" in words(parsed(page()).find(".//footer"))


def test_the_pass_mark_is_said_and_drawn():
    document = parsed(page(rubric=rubric(pass_mark=50)))
    assert "To pass, you need 50 points of 100: 37.5 points are missing." in words(document.find(".//header"))
    assert document.find_class("mark")[0].get("style") == "left:50%"


def test_landmarks_headings_and_names_are_in_order():
    document = parsed(page(drawn=hostile_figures()))
    levels = [int(h.tag[1]) for h in document.iter("h1", "h2", "h3", "h4")]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    names = document.xpath("//@id")
    assert len(names) == len(set(names))
    assert [e.tag for e in document.iter("header", "nav", "main", "footer")] == [
        "header",
        "nav",
        "main",
        "footer",
    ]
    targets = {link[1:] for link in document.xpath("//a/@href")}
    assert targets <= set(names)
    labels = {name for value in document.xpath("//@aria-labelledby") for name in value.split()}
    assert labels <= set(names)
    assert document.get("lang") == "en"
    for table in document.iter("table"):
        assert words(table.find("caption"))
        assert {"col", "row"} >= set(table.xpath(".//th/@scope"))
        assert not table.xpath(".//th[not(@scope)]")
    assert document.xpath("//a[@class='skip']/@href") == ["#main"]


def is_harmless(text: str) -> None:
    """Nothing in the page but what the templates put there loads, runs or steers."""
    document = parsed(text)
    assert [e.text for e in document.iter("script")] == [str(script("report.js"))]
    assert {
        e.tag for e in document.iter("img", "iframe", "object", "embed", "form", "audio", "video", "base")
    } == set()
    attributes = {name for e in document.iter() if isinstance(e.tag, str) for name in e.attrib}
    assert not [name for name in attributes if name.startswith("on")]
    for address in document.xpath("//@href | //@src | //@action | //@data | //@poster"):
        assert VOID_ADDRESS.match(address)
    style = "".join(e.text for e in document.iter("style"))
    assert "url(" not in style
    assert "@import" not in style
    for value in document.xpath("//@style"):
        assert re.fullmatch(r"(width|left):[\d.]+%|min-width:[\d.]+px", value)
    assert STEERING.search(text) is None


def test_a_hostile_submissions_text_stays_text():
    text = page(drawn=hostile_figures())
    is_harmless(text)
    document = parsed(text)
    assert visible(SCRIPT) in words(document)
    assert "\\u202e" in words(document)


def test_only_our_own_script_may_run_and_nothing_may_be_loaded():
    document = parsed(page())
    (said,) = document.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")
    assert said == policy(script("report.js"))
    assert said.startswith("default-src 'none'; ")
    assert "unsafe-inline" not in said.partition("script-src")[2].partition(";")[0]
    head = [e.tag for e in document.find("head")]
    assert head.index("meta") < head.index("style")
    assert document.find("head")[1].get("http-equiv") == "Content-Security-Policy"


@SOME
@given(results())
def test_any_text_in_any_field_is_shown_and_not_obeyed(shown):
    text = page(shown, Figures(), rubric=rubric())
    is_harmless(text)
    document = parsed(text)
    assert len(document.xpath("//*[@data-row]")) == len(shown.criteria)
    content = " ".join(document.text_content().split())
    for field in ("message", "hint", "kind"):
        said = getattr(shown.error, field)
        if field != "kind":
            assert " ".join(line(said, 1000).split()) in content


@SOME
@given(results())
def test_any_text_of_a_criterion_stands_in_its_card(shown):
    graded = shown.model_copy(update={"error": None, "status": "graded"})
    content = words(parsed(page(graded, Figures(), rubric=rubric(), docs={})))
    for field in FIELDS:
        if field not in {"check", "scenario", "hint"}:
            text = line(getattr(shown.criteria[0], field), 1000)
            # an identifier stands as it is, with its backticks, and commands apart from the words between them
            said = [text] if field == "id" else ["".join(part for part, _ in code_parts(text))]
            said = [part for part, _ in commands_in(text)] if field == "reproduce" else said
            assert all(" ".join(part.split()) in content for part in said), (
                "without the backticks around code"
            )


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(HUGE[0], id="letters", marks=pytest.mark.full),
        pytest.param(HUGE[1], id="hidden", marks=pytest.mark.full),
        pytest.param(HUGE[2], id="entities"),
        pytest.param(HUGE[3], id="stars", marks=pytest.mark.full),
        pytest.param(HUGE[4], id="names", marks=pytest.mark.full),
    ],
)
def test_a_page_stays_below_400_kilobytes_whatever_is_in_it(text):
    graded = spoiled(of(text)).model_copy(update={"error": None, "status": "graded"})
    drawn = Figures(
        consoles={"real": console(*[text[:10_000]] * 1000)}, by_criterion={text: (code(lines=(text,) * 20),)}
    )
    for shown in (page(graded, drawn), page(spoiled(of(text)), drawn)):
        assert len(shown.encode()) < BYTES_MAX
        is_harmless(shown)


@pytest.mark.full
def test_two_hundred_criteria_of_the_longest_texts_are_cut_and_it_says_so():
    fields = dict.fromkeys(("title", "message", "expected", "measured", "hint", "reproduce"), "&" * 100_000)
    criteria = tuple(
        criterion(f"c{i}", Status.FAIL, 0, 0.5, citations=(FileCitation(file="&" * 1000),) * 30, **fields)
        for i in range(200)
    )
    text = page(result(criteria=criteria), hostile_figures(), rubric=rubric())
    assert len(text.encode()) < BYTES_MAX
    document = parsed(text)
    assert len(document.xpath("//*[@data-row]")) == 200
    cut = 200 - len(document.xpath("//*[@data-criterion]"))
    assert cut > 0
    assert f"{cut} of them have no details here" in words(document)


@pytest.mark.full
def test_a_thousand_criteria_have_a_row_or_are_counted():
    criteria = tuple(criterion(f"c{i}", Status.FAIL, 0, 0.5, title="&" * 200) for i in range(1000))
    text = page(result(criteria=criteria), rubric=rubric())
    assert len(text.encode()) < BYTES_MAX
    rows = len(parsed(text).xpath("//*[@data-row]"))
    assert f"{1000 - rows} criteria more" in words(parsed(text))


def test_a_long_console_shows_its_beginning_and_its_end():
    lines = [f"line {i}" for i in range(1000)]
    drawn = Figures(consoles={"real": console(*lines, left_out=50)})
    (found,) = parsed(page(drawn=drawn)).xpath("//*[@data-figure='console']")
    text = words(found)
    assert "1050 lines" in text
    assert "line 0" in text
    assert "line 999" in text
    assert "line 500" not in text
    assert f"{1050 - int(found.get('data-points'))} lines are left out here" in text


def test_a_line_on_stderr_has_the_word_beside_its_colour():
    (found,) = parsed(page()).xpath("//*[@data-figure='console']//em")
    assert words(found) == "0.100 talker stderr Traceback"


def test_a_picture_that_cannot_be_drawn_costs_no_report():
    broken = figures().by_criterion["chatter-rate"][0].model_copy(update={"times_s": ("x",)})
    text = words(parsed(page(drawn=Figures(by_criterion={"chatter-rate": (broken,)}))))
    assert "This picture could not be drawn" in text


@pytest.mark.full
def test_the_templates_are_loaded_only_when_a_report_is_written():
    code = "import sys, grader.pipeline, grader.cli.main; print('jinja2' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
