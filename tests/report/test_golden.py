"""The reports of one hostile result. `GRADER_REGENERATE=1 pytest tests/report/test_golden.py` writes them again."""

from __future__ import annotations

import io
import os
import re
import unicodedata
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from rich.console import Console

from grader.classes.gradebook import Book, GradebookRow, write_gradebook
from grader.classes.gradebook.table import GradebookFormat
from grader.model.batch import Entry
from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.report.files import result_bytes
from grader.report.forms import FORMS, ReportInput
from grader.report.terminal import Terminal, open_console
from grader.report.view import without_hidden
from tests.report import hostile
from tests.report.hostile import ESCAPES
from tests.report.worst import COMMANDS, DOCS, FORMULA, LINKS, WIDE, figures, rubric, worst

GOLDEN = Path(__file__).parent / "golden"
PREFIX = "catkin_ws/src/lab 1"


def student() -> GradingResult:
    return without_hidden(worst(), rubric())


def terminal(encoding: str, width: int = 80, *, full: bool = False) -> bytes:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    console = open_console(stream)
    console.width = width
    Terminal(console).report(student(), rubric(), hidden=3, full=full)
    stream.flush()
    return raw.getvalue()


def gradebook(kind: GradebookFormat) -> bytes:
    shown = worst()
    criteria = tuple((c.id, c.title, c.max_points) for c in shown.criteria)
    book = Book(
        title=FORMULA, rubric_id="hostile-lab", max_points=131, criteria=criteria, columns=("note", FORMULA)
    )
    extra = {"note": COMMANDS, FORMULA: LINKS}
    entry = Entry(id="ada", source="/home/ada", name=f"{FORMULA} {WIDE}", group=ESCAPES, extra=extra)
    with TemporaryDirectory() as folder:
        place = Path(folder, "book")
        write_gradebook(book, [GradebookRow(entry=entry, result=shown)], place, kind)
        return place.read_bytes()


def form(name: str) -> bytes:
    """A form of the registry: as students see it where hidden criteria are left out of it."""
    own = name in {"markdown", "classroom"}
    about = ReportInput(
        result=student() if own else worst(),
        rubric=rubric(),
        hidden=3 if own else 0,
        prefix="" if name == "junit" else PREFIX,
        docs=DOCS,
        load_figures=figures,
    )
    return FORMS[name].render(about)


OWN_TEST = {"terminal": "terminal.txt", "html": "html/golden/report.html"}
"""Forms that are rendered below, or in a test of their own."""
MADE = {
    "gradebook.csv": lambda: gradebook("csv"),
    "results.jsonl": lambda: gradebook("jsonl"),
    "result.json": lambda: result_bytes(worst()),
    "terminal.txt": lambda: terminal("utf-8"),
    "terminal-60.txt": lambda: terminal("utf-8", 60),
    "terminal-ascii.txt": lambda: terminal("ascii"),
    **{each.file: partial(form, name) for name, each in FORMS.items() if name not in OWN_TEST},
}


@pytest.mark.parametrize("name", MADE)
def test_report_is_as_kept(name):
    made, kept = MADE[name](), GOLDEN / name
    if os.environ.get("GRADER_REGENERATE"):
        kept.write_bytes(made)
    assert readable(made) == readable(kept.read_bytes())


def readable(data: bytes) -> str:
    """As text, and a binary form as bytes that a failure can show: its golden file is compared all the same."""
    return data.decode(errors="backslashreplace")


def test_every_form_is_in_the_documentation() -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "reports.md"
    rows = re.findall(r"^\| `([a-z-]+)` \| (.*) \|$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows[1:] == [(each.name, each.purpose) for each in FORMS.values()]


def test_no_golden_file_is_left_over():
    assert {path.name for path in GOLDEN.iterdir()} == set(MADE)


@pytest.mark.parametrize("name", ["report.md", "terminal.txt"])
def test_a_students_view_counts_hidden_criteria_and_names_none(name):
    text = (GOLDEN / name).read_text()
    assert "1 of 22 visible checks passed; 3 more run at grading." in text
    assert "secret" not in text


def cells(text: str) -> int:
    """Columns of a terminal, by Unicode's own tables."""
    wide = sum(unicodedata.east_asian_width(character) in "WF" for character in text)
    return len(text) + wide - sum(unicodedata.category(character) == "Mn" for character in text)


LONG = "a-criterion-with-an-id-that-is-longer-than-any-column-of-a-terminal"


@pytest.mark.parametrize("width", [80, 60])
def test_terminal_keeps_to_its_columns_and_sends_no_escapes(width):
    text = terminal("utf-8", width, full=True).decode()
    wide = [line for line in text.splitlines() if cells(line) > width and LONG not in line]
    assert [line for line in wide if " " in line.strip()] == [], (
        "only one word may be wider, which is not split"
    )
    assert "\x1b" not in text
    assert "[bold red]not bold[/]" in text


def test_a_real_terminal_gets_colour_but_none_of_the_students():
    out = io.StringIO()
    console = Console(
        file=out,
        force_terminal=True,
        width=100,
        markup=False,
        emoji=False,
        highlight=False,
        color_system="standard",
    )
    Terminal(console).report(worst(), rubric())
    assert "\x1b[31m✗" in out.getvalue()
    assert "\x1b]0;" not in out.getvalue()


def test_every_status_has_its_word_in_the_table():
    text = terminal("ascii", full=True).decode("ascii")
    for word in (
        "+ .*  passed",
        "x .*  to fix",
        "~ .*  to fix",
        "- .*  not tested",
        "? .*  not decided yet",
        "! .*  not decided yet",
        "o .*  not decided yet",
    ):
        assert re.search(rf"^{re.escape(word[0])}{word[1:]}  ", text, re.MULTILINE), word


def test_in_an_encoding_without_them_dots_and_arrows_are_spelt_out() -> None:
    update = {
        "status": Status.FAIL,
        "points": 0.0,
        "hint": 'add name="…", 5 → 6',
        "message": "9 ± 1",
        "citations": (),
    }
    shown = hostile.result().model_copy(
        update={"criteria": (hostile.result().criteria[0].model_copy(update=update),)}
    )
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii", write_through=True)
    Terminal(open_console(out)).report(shown, hostile.rubric())
    text = out.buffer.getvalue().decode("ascii")
    assert 'name="...", 5 -> 6' in text
    assert "9 +/- 1" in text
