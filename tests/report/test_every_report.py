"""Any text in every field of a result: every report parses back, and none of it is obeyed."""

from __future__ import annotations

import io
import json
import re
from xml.parsers import expat

import pytest
from cmarkgfm import github_flavored_markdown_to_html
from cmarkgfm.cmark import Options
from hypothesis import given
from lxml import etree
from lxml import html as parser
from rich.console import Console

from grader.judging import criteria_bytes
from grader.model.result import (
    GradingResult,
)
from grader.model.verdict import FileCitation, Status
from grader.report.files import result_bytes, result_text, write_reports
from grader.report.junit import render_junit
from grader.report.markdown import render_markdown
from grader.report.terminal import Terminal, open_console
from grader.report.text import line
from tests.report.anything import FIELDS, HUGE, SOME, of, results, spoiled
from tests.report.hostile import result, rubric
from tests.report.markdown_readers import FOUND_BY_FORGES, HARMLESS, MARKDOWN, QUICK_ACTION, prose
from tests.report.nasty import STEERING, TO_A_CI
from tests.support.a_class import criterion


def terminal(shown: GradingResult, **how) -> str:
    out = io.StringIO()
    console = (
        Console(file=out, width=80, markup=False, emoji=False, highlight=False, **how)
        if how
        else open_console(out)
    )
    Terminal(console).report(shown, rubric())
    return out.getvalue()


def blocks(source: str) -> list[str]:
    return [token.type for token in MARKDOWN.parse(source)]


@SOME
@given(results())
def test_markdown_holds_nothing_but_the_template(shown):
    source = render_markdown(shown, rubric())
    plain = spoiled(of("word"), shown.criteria[0].status.value)
    assert blocks(source) == blocks(render_markdown(plain, rubric()))
    inlines = [token.children for token in MARKDOWN.parse(source) if token.type == "inline"]
    kinds = [token.type for children in inlines for token in children]
    assert kinds.count("strong_open") == 1  # the template's own: look again
    assert set(kinds) - {"strong_open", "strong_close"} <= HARMLESS
    assert [found for children in inlines if (found := FOUND_BY_FORGES.search(prose(children)))] == []
    assert QUICK_ACTION.search(source) is None
    assert STEERING.search(source) is None
    assert TO_A_CI.search(source) is None


def elements(source: str) -> list[str]:
    """The elements that GitHub's own renderer makes of it, code spans left out."""
    page = parser.document_fromstring(github_flavored_markdown_to_html(source, Options.CMARK_OPT_FOOTNOTES))
    return [element.tag for element in page.iter() if element.tag != "code"]


@SOME
@given(results())
def test_githubs_renderer_makes_nothing_else_of_it(shown):
    source = render_markdown(shown, rubric())
    plain = spoiled(of("word"), shown.criteria[0].status.value)
    assert elements(source) == elements(render_markdown(plain, rubric()))


@SOME
@given(results())
def test_junit_parses_and_gives_the_visible_text_back(shown):
    data = render_junit(shown)
    expat.ParserCreate().Parse(data, True)
    suite = etree.fromstring(data)[0]
    tags = {element.tag for element in suite.iter()}
    own = {"testsuite", "properties", "property", "testcase", "failure", "error", "skipped", "system-out"}
    assert tags <= own
    case, hostile = suite.find("testcase"), shown.criteria[0]
    assert case.get("name") == line(hostile.id, 2000)
    assert case.get("file") == line(hostile.citations[0].file, 2000)
    assert f"title: {line(hostile.title, 2000)}\n" in case.findtext("system-out")
    outcome = [child for child in case if child.tag != "system-out"]
    assert [child.get("message") for child in outcome] in ([], [line(hostile.message, 2000)])
    assert line(shown.notes[0].text, 2000) in suite.findtext("system-out")
    assert "\ncheck: " in case.findtext("system-out")
    assert suite.find("properties/property[@name='late']").get("value") == line(shown.late.text, 2000)
    assert STEERING.search(data.decode()) is None
    assert TO_A_CI.search(data.decode()) is None


@pytest.mark.full
@SOME
@given(results())
def test_json_is_the_result_itself(shown):
    def encodable(text: str) -> str:
        return text.encode("utf-8", "backslashreplace").decode()

    data = json.loads(result_bytes(shown))
    assert list(data)[-4:] == ["notes", "overrides", "late", "error"]
    assert data["overrides"][0]["comment"] == encodable(shown.overrides[0].comment)
    assert data["late"]["note"] == encodable(shown.late.note)
    for name in FIELDS:
        assert data["criteria"][0][name] == encodable(getattr(shown.criteria[0], name))
    assert data["notes"][0]["text"] == encodable(shown.notes[0].text)
    assert data["error"]["hint"] == encodable(shown.error.hint)
    assert json.loads(criteria_bytes(shown.criteria)) == data["criteria"]
    assert json.loads(result_text(shown, ascii_only=True).encode("ascii")) == data
    assert STEERING.search(result_bytes(shown).decode()) is None
    assert TO_A_CI.search(result_bytes(shown).decode()) is None


@pytest.mark.full
@SOME
@given(results())
def test_a_terminal_gets_no_escape_and_a_log_no_command(shown):
    plain, coloured = terminal(shown), terminal(shown, force_terminal=True, color_system="standard")
    assert STEERING.search(plain) is None
    assert STEERING.search(re.sub(r"\x1b\[[0-9;]*m", "", coloured)) is None
    assert TO_A_CI.search(plain) is None
    assert TO_A_CI.search(re.sub(r"\x1b\[[0-9;]*m", "", coloured)) is None


@pytest.mark.parametrize("before", range(60, 84))
def test_a_command_that_wraps_to_a_lines_start_is_none(before):
    text = "x" * (before - 30) + " ::error file=a::owned ::stop-commands::t"
    shown = terminal(result(criteria=(criterion("c", Status.FAIL, 0, 5, message=text, hint=text),)))
    assert "owned" in shown
    assert TO_A_CI.search(shown) is None


@pytest.mark.parametrize("text", HUGE, ids=["letters", "hidden", "entities", "stars", "names"])
def test_a_message_of_a_megabyte_is_clipped_everywhere(text, tmp_path):
    write_reports(spoiled(of(text)), tmp_path, console="", rubric=rubric())
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert max(sizes.values()) < 800_000, sizes
    assert "more characters)" in (tmp_path / "result.json").read_text()
    assert len(terminal(spoiled(of(text)))) < 60_000


@pytest.mark.full
@pytest.mark.parametrize("text", HUGE[1:3], ids=["hidden", "entities"])
def test_two_hundred_criteria_of_the_longest_texts_make_a_few_megabytes(text, tmp_path):
    citations = (FileCitation(file=text),) * 100
    fields = dict.fromkeys(("title", "message", "expected", "measured", "hint", "reproduce"), text)
    criteria = tuple(
        criterion(f"c{i}", Status.FAIL, 0, 0.5, citations=citations, **fields) for i in range(200)
    )
    console = f"{text[:1000]}\n" * 3000
    write_reports(result(criteria=criteria), tmp_path, console=console, rubric=rubric())
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert max(sizes.values()) < 4_200_000, sizes


@pytest.mark.full
def test_a_longer_console_says_that_it_goes_on(tmp_path):
    write_reports(result(), tmp_path, console="line\n" * 2_000_000, rubric=rubric())
    text = (tmp_path / "console.log").read_text()
    assert 3_900_000 < len(text) < 4_100_000
    assert text.endswith("\nline\n… the rest is in the evidence\n")
