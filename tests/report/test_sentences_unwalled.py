"""A grading without a sandbox says so at the top of every report that people read, and one with a sandbox does not."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest

from grader.arena.control_groups import Cgroups
from grader.arena.sandbox import Sandbox
from grader.integrations.platform_exports import GRADESCOPE
from grader.judging.summary import NOTHING_RUN
from grader.model.figure import Figures
from grader.model.result import GradingResult
from grader.report.class_page.page import write_class_page
from grader.report.html.page import render_html
from grader.report.markdown import render_markdown
from grader.report.sentences import without_sandbox
from grader.report.terminal import Terminal, open_console
from grader.rubric.load import LoadedRubric
from tests.report.class_page.made_up import made_up_rows, made_up_run
from tests.report.hostile import ESCAPES, result, rubric

RAN = "students' code runs with all the rights of"
MISSING = f"The grading machine has no sandbox (bwrap is not installed): {RAN} the user who grades."
OFF = f"The sandbox is switched off (--sandbox none): {RAN} an unprivileged user there."


def label(reason: str, uid: int | None = None) -> str:
    return Sandbox(bubblewrap=not reason, uid=uid, reason=reason, cgroups=Cgroups()).label


def graded(sandbox: str) -> GradingResult:
    made = result()
    return made.model_copy(update={"environment": made.environment.model_copy(update={"sandbox": sandbox})})


def terminal(of: GradingResult) -> str:
    stream = io.StringIO()
    Terminal(open_console(stream)).report(of, rubric())
    return " ".join(stream.getvalue().split())


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (label("bwrap is not installed"), MISSING),
        (label("--sandbox none", uid=30_000), OFF),
        ("none (--sandbox none), but for an unprivileged user", OFF),
        (
            label("bwrap: Creating new namespace failed: max_*_namespaces exceeded (ENOSPC)"),
            (
                "The grading machine has no sandbox (bwrap: Creating new namespace failed: max_*_namespaces exceeded "
                f"(ENOSPC)): {RAN} the user who grades."
            ),
        ),
        (label(""), ""),
        (label("", uid=30_000), ""),
        (NOTHING_RUN, ""),
        ("", ""),
    ],
)
def test_the_sentence_is_made_of_what_the_result_says(said: str, sentence: str) -> None:
    assert without_sandbox(said) == sentence


@pytest.mark.parametrize("shown", [render_markdown, render_html, None], ids=["markdown", "html", "terminal"])
def test_reports_say_it_before_anything_that_was_lost(shown) -> None:
    def text(of: GradingResult) -> str:
        if shown is None:
            return terminal(of)
        more = () if shown is render_markdown else (Figures(),)
        return shown(of, rubric(), *more).replace("&#39;", "'").replace("\\", "")

    lost = re.compile(r'## To fix|<h2 id="lost"|To fix\s+[◐✗]')
    without = text(graded(label("bwrap is not installed")))
    assert "has no sandbox (bwrap is not installed)" in without
    assert without.index("has no sandbox") < lost.search(without).start()
    assert RAN not in text(graded(label("", uid=30_000)))


def test_what_a_result_says_of_its_sandbox_is_shown_and_not_obeyed() -> None:
    hostile = graded(label(f"<b>{ESCAPES}</b>"))
    page = render_html(hostile, rubric(), Figures())
    assert 'id="unwalled"' in page
    assert "<b>" not in page
    assert "\x1b" not in page + render_markdown(hostile, rubric()) + terminal(hostile)


def test_the_page_of_a_class_says_how_many(tmp_path: Path) -> None:
    run, rows = made_up_run(5), list(made_up_rows(5))
    told = tmp_path / "index.html"
    write_class_page(run, rows, told)
    assert "unwalled" not in told.read_text().partition("<main>")[2]
    first = rows[0][1]
    environment = first.environment.model_copy(update={"sandbox": label("bwrap is not installed")})
    rows[0] = (rows[0][0], first.model_copy(update={"environment": environment}))
    write_class_page(run, rows, told)
    page = told.read_text().replace("&#39;", "'")
    assert re.search(rf"<strong>{re.escape(MISSING)}</strong> 1 of 5 submissions was graded so\.", page)


def test_gradescope_tells_the_staff() -> None:
    loaded = LoadedRubric(rubric=rubric(), path=Path(), digest="")
    document = GRADESCOPE.graded(graded(label("bwrap is not installed")), loaded)
    assert document["extra_data"]["without_sandbox"] == MISSING
    assert "without_sandbox" not in GRADESCOPE.graded(graded("bubblewrap"), loaded)["extra_data"]
