"""Markdown, HTML and CSV, read back by the programs that read them."""

from __future__ import annotations

import csv
import io
import re
from itertools import chain, pairwise

import pytest
from cmarkgfm import github_flavored_markdown_to_html
from cmarkgfm.cmark import Options
from hypothesis import example, given
from hypothesis import strategies as st
from lxml import html as parser

from grader.report.text import csv_text, html, markdown, markdown_code, visible
from grader.wording import did_you_mean, number, on_lines, significant
from tests.report.markdown_readers import FOUND_BY_FORGES, HARMLESS, MARKDOWN, QUICK_ACTION, prose
from tests.report.nasty import STEERING, TEXTS


def inline(source: str, kind: str = "inline"):
    """The inline tokens of the only block of that kind."""
    (block,) = [token for token in MARKDOWN.parse(source) if token.type == kind]
    return block.children


def read(tokens) -> str:
    return "".join(token.content for token in tokens)


def words(text: str) -> list[str]:
    """What is read of it: the signs around code are not."""
    return re.sub(r"(?<!`)`(?! )([^`]*[^` ])`(?!`)", r"\1", " ".join(visible(text).split())).split()


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("`rate.sleep` is named", "<code>rate.sleep</code> is named"),
        ("(`try: … except rospy.X: pass`).", "(<code>try: … except rospy.X: pass</code>)."),
        ("`a.py`, `b c.py`", "<code>a.py</code>, <code>b c.py</code>"),
        ("one ` alone, and a.py", "one ` alone, and <code>a.py</code>"),
        ("`` `a.py` ``", "`` <code>a.py</code> ``"),
        ("call ros::init(argc, argv) once", "call <code>ros::init(argc, argv)</code> once"),
        ("`<b>|&`", "<code>&lt;b&gt;|&amp;</code>"),
    ],
)
def test_code_in_a_text_is_code(text, shown):
    assert _github(markdown(text)) == f"<p>{shown}</p>\n"


@pytest.mark.parametrize("code", ["a ` b", "``", "`a", "a`", " a ", "a `` b ` c"])
def test_backticks_within_code_stay(code):
    page = parser.fragment_fromstring(_github(markdown_code(code)))
    assert page.xpath("string(code)").strip() == code.strip()


@given(TEXTS)
@example("`:0()")
def test_markdown_reads_as_the_text_itself_also_where_a_line_begins(text):
    shown = markdown(text)
    if not words(text):
        assert shown == ""
        return
    blocks = [token.type for token in MARKDOWN.parse(shown)]
    assert blocks == ["paragraph_open", "inline", "paragraph_close"]
    tokens = inline(shown)
    assert {token.type for token in tokens} <= HARMLESS
    assert read(tokens).split() == words(text)
    assert STEERING.search(shown) is None


@given(TEXTS)
def test_forges_find_nothing_in_it(text):
    shown = markdown(text)
    assert QUICK_ACTION.search(shown) is None
    if shown:
        assert FOUND_BY_FORGES.search(prose(inline(shown))) is None


@given(TEXTS, TEXTS)
def test_a_cell_of_a_table_stays_one_cell(text, other):
    rows = f"| a | b |\n|---|---|\n| {markdown(text, cell=True)} | {markdown_code(other, cell=True)} |"
    tokens = MARKDOWN.parse(rows)
    cells = [after for before, after in pairwise(tokens) if before.type == "td_open"]
    assert [token.type for token in cells] == ["inline", "inline"]
    assert [read(cell.children).split() for cell in cells] == [words(text), visible(other).split()]
    assert {token.type for cell in cells for token in cell.children} <= HARMLESS


@given(TEXTS, TEXTS)
def test_githubs_renderer_reads_the_same(text, other):
    rows = f"| a | b |\n|---|---|\n| {markdown(text, cell=True)} | {markdown_code(other, cell=True)} |"
    page = parser.fragment_fromstring(f"<div>{_github(rows)}{_github(markdown(text))}</div>")
    cells = page.xpath(".//td")
    assert [cell.text_content().split() for cell in cells] == [words(text), visible(other).split()]
    assert {element.tag for cell in cells for element in cell} <= {"code"}
    assert [p.text_content().split() for p in page.xpath("p")] == ([words(text)] if words(text) else [])
    assert {element.tag for element in page} <= {"table", "p"}


def _github(source: str) -> str:
    return github_flavored_markdown_to_html(source, Options.CMARK_OPT_FOOTNOTES)


@given(TEXTS)
def test_code_shows_the_text_as_it_is(text):
    shown = markdown_code(text)
    if visible(text).strip():
        assert [token.type for token in inline(shown)] == ["code_inline"]
        assert read(inline(shown)).strip() == visible(text).strip()
    else:
        assert shown == ""


@pytest.mark.parametrize(
    "text",
    [
        *(
            "@everyone",
            "a@b.example",
            "https://evil.example/x",
            "www.evil.example",
            "#1",
            "a/b!7",
            "GH-12",
            "~bug",
        ),
        *(
            "%12",
            "$x$",
            ":smile:",
            ":+1:",
            "0123456789abcdef",
            "{+",
            "[[_TOC_]]",
            "[TOC]",
            "evil.com",
            "/close",
            "//h",
        ),
    ],
)
def test_what_a_forge_would_act_on_is_code(text):
    assert markdown(f"{text} now").startswith("`")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("# no heading", "\\# no heading"),
        ("- no list", "\\- no list"),
        ("12. no list", "12\\. no list"),
        ("12.", "12\\."),
        ("12.5 Hz", "12.5 Hz"),
        ("-1.5 m", "-1.5 m"),
        ("--- - -", "\\--- - -"),
        ("+", "\\+"),
        (":::x", "\\\\x3a::x"),
        (
            "rospy.Publisher('/low', …, queue_size=1), twice (see below)",
            "`rospy.Publisher('/low', …, queue_size=1)`, twice (see below)",
        ),
        (
            "write rospy.Service('~count', Trigger, self.f).",
            "write `rospy.Service('~count', Trigger, self.f)`.",
        ),
        ("f(g(h('x/y.py'), 2)).z(a, b) is read", "`f(g(h('x/y.py'), 2)).z(a, b)` is read"),
        ("2 line(s) and (a b) c(d e) f", "2 line(s) and (a b) `c(d e)` f"),
        ("call rate.sleep(), or (rospy.Rate(1)).", "call `rate.sleep()`, or (`rospy.Rate(1)`)."),
        ("1) no list", "1\\) no list"),
        ("> no quotation", "&gt; no quotation"),
        ("    no code", "no code"),
        ("/chatter came at 5.02 Hz, not 10 Hz", "`/chatter` came at 5.02 Hz, not 10 Hz"),
        ("see (https://ros.org).", "see (`https://ros.org`)."),
        ("package.xml: 10 %, R & D, 5 # 3", "`package.xml`: 10 %, R &amp; D, 5 # 3"),
        ("12:30:45", "12:30:45"),
        ("@0@0 and #1#2", "`@0@0` and `#1#2`"),
    ],
)
def test_markdown_of(text, shown):
    assert markdown(text) == shown


@given(TEXTS)
def test_html_is_text_and_nothing_else(text):
    page = f"<div><p title=\"{html(text)}\">{html(text)}</p><q title='{html(text)}'></q></div>"
    found = parser.fragment_fromstring(page)
    assert [element.tag for element in found.iter()] == ["div", "p", "q"]
    assert [sorted(element.attrib) for element in found.iter()] == [[], ["title"], ["title"]]
    assert found[0].text_content() == found[0].get("title") == found[1].get("title") == visible(text)
    assert STEERING.search(page) is None


FORMULA = re.compile("(?:^|;)[\\s\"'`]*[=+\\-@\uff1d\uff0b\uff0d\uff20\u2212]")


@given(st.lists(st.lists(TEXTS, min_size=1, max_size=3), max_size=3))
def test_no_cell_is_a_formula_and_all_are_read_back(rows):
    text = csv_text(rows)
    found = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    assert [len(row) for row in found] == [len(row) for row in rows]
    for cell, given_ in zip(chain(*found), chain(*rows), strict=True):
        assert cell.replace("'", "") == visible(given_).replace("'", "")
        assert not re.match('[\\s"`]*[=+\\-@\uff1d\uff0b\uff0d\uff20\u2212]', cell)
        assert not any(FORMULA.match(f";{part}") and "'" not in part for part in cell.split(";"))
    assert STEERING.search(text.replace("\r\n", "\n")) is None


@pytest.mark.parametrize(
    ("cell", "shown"),
    [
        ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
        (' "=1+1', "' \"=1+1"),
        ("\uff1d1+1", "'\uff1d1+1"),
        ("\t=1", "\\t=1"),
        ("-1.5", "'-1.5"),
        ("a;=1", "a;'=1"),
        ("a-b = c", "a-b = c"),
        (-1.5, "-1.5"),
        (87.5, "87.5"),
        (0, "0"),
        (None, ""),
        (float("nan"), ""),
    ],
)
def test_a_number_of_ours_stays_a_number_and_text_stays_text(cell, shown):
    assert next(csv.reader(io.StringIO(csv_text([[cell]])))) == [shown]


def test_numbers_carry_no_idle_zeros():
    assert [number(x) for x in (10, 100.0, 87.5, 0, 0.1 + 0.2)] == ["10", "100", "87.5", "0", "0.3"]
    assert [significant(x) for x in (2.0, -0.0, 9.98765, -0.001234)] == ["2", "0", "9.988", "-0.001234"]


@pytest.mark.parametrize(
    ("word", "near"),
    [
        ("leeds", "leeds-lab1"),
        ("LAB7", "york-lab7"),
        ("yrok-lab7", "york-lab7"),
        ("--exchang", "--exchange"),
        ("--worker", ""),
        ("lab", ""),
        ("la", ""),
    ],
)
def test_a_part_of_one_name_or_a_likeness_is_suggested(word, near):
    said = f' (did you mean "{near}"?)' if near else ""
    assert did_you_mean(word, ["leeds-lab1", "york-lab7", "--exchange", "--before"]) == said


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ([3], "line 3"),
        ([3, 4], "lines 3 and 4"),
        ([3, 4, 5, 9], "lines 3 to 5 and 9"),
        (range(1, 20, 2), "lines 1, 3, 5, 7, 9, 11, 13, 15, 17 and 19"),
        (range(1, 99, 2), "lines 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31 and 33 more"),
    ],
)
def test_each_line_of_a_hint_is_named_unless_they_are_too_many(numbers, text) -> None:
    assert on_lines(numbers) == text
