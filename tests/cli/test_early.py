"""The first verdicts of `grader check`: what the files alone decide, shown before anything is built."""

from __future__ import annotations

import io
import sys
from functools import partial

import pytest
from hypothesis import example, given
from rich.console import Console
from rich.live import Live

from grader.cli.display import LiveSteps, print_early
from grader.cli.main import run
from grader.model.result import EarlyVerdict, Silence
from grader.pipeline import GradeOptions, grade
from grader.rubric.load import load_rubric
from tests.fixture_runs import ROOT
from tests.report.nasty import STEERING, TEXTS, TO_A_CI
from tests.rubric.samples import spoiled
from tests.support.a_class import criterion

PASSED = EarlyVerdict(criterion=criterion("manifest", "pass", 5, 5, message="names lab1"), final=True)
FAILED = EarlyVerdict(
    criterion=criterion("talker", "fail", 0, 5, message="is not executable", hint="chmod +x talker.py"),
    final=False,
)
SHOWN = """\
Your files, before anything is built or run:
  ✓ 1 pass: manifest
  ✗ fail  talker  is not executable
    hint: chmod +x talker.py
  Provisional: the build can still change these results.

"""


class Terminal(io.StringIO):
    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


class Early(Silence):
    """Keeps what is told."""

    ids: tuple[str, ...] = ()

    def early(self, verdicts) -> None:
        self.ids = tuple(verdict.criterion.id for verdict in verdicts())


@pytest.fixture
def decided(pipeline, monkeypatch):
    """The fake pipeline, which has two verdicts before it grades."""
    whole = pipeline.grade

    def early_first(source, rubric, out, options, progress):
        progress.early(lambda: (PASSED, FAILED))
        return whole(source, rubric, out, options, progress)

    monkeypatch.setattr(pipeline, "grade", early_first)
    return pipeline


@pytest.mark.usefixtures("decided")
def test_check_prints_them_before_the_whole_report(lab, tmp_path, capsys) -> None:
    assert run(["check", str(tmp_path / "x.zip"), "--rubric", lab]) == 0
    out = capsys.readouterr().out
    assert out.startswith(SHOWN + "ada\n")
    assert "criteria passed; --all shows them" in out
    assert "\n100 of 100 points\n" in out


@pytest.mark.usefixtures("decided")
@pytest.mark.parametrize("option", ["--json", "--static"])
def test_nothing_comes_before_json_nor_before_a_report_that_needs_no_build(
    option, lab, tmp_path, capsys
) -> None:
    assert run(["check", str(tmp_path / "x.zip"), "--rubric", lab, option]) == 0
    assert "before anything is built" not in capsys.readouterr().out


@pytest.mark.usefixtures("decided")
def test_grade_prints_them_on_a_terminal_only(lab, tmp_path, capsys, monkeypatch) -> None:
    argv = ["grade", "somewhere", "--rubric", lab, "--out", str(tmp_path / "out")]
    assert run(argv) == 0
    assert "before anything is built" not in capsys.readouterr().out
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    assert run(argv) == 0
    assert terminal.getvalue().startswith(SHOWN)


def test_above_a_display_they_look_the_same(capsys) -> None:
    out = Terminal()
    console = Console(file=out, width=80, markup=False, emoji=False, highlight=False, color_system=None)
    print_early((PASSED, FAILED), above=console.print)
    assert [row.rstrip() for row in out.getvalue().splitlines()][:3] == SHOWN.splitlines()[:3]
    assert capsys.readouterr().out == ""


def test_a_live_display_goes_on_below_them() -> None:
    out = Terminal()
    console = Console(file=out, width=80, force_terminal=True, color_system=None)
    steps = LiveSteps(tell=partial(print_early, above=console.print))
    with Live(steps, console=console, auto_refresh=False):
        steps.step("package", "done")
        steps.early(lambda: (PASSED, FAILED))
    assert "1 pass: manifest" in out.getvalue()
    assert "package" in out.getvalue()[out.getvalue().rindex("Provisional:") :]


def test_without_a_verdict_there_is_no_title(capsys) -> None:
    print_early(())
    assert capsys.readouterr().out == ""


@given(TEXTS, TEXTS)
@example("0" * 60 + " ::error::x", "")
@example("0" * 49 + "::" * 40, "::" * 120)
def test_a_students_words_steer_nothing(message, hint) -> None:
    hostile = criterion("talker", "fail", 0, 5, message=message, hint=hint)
    above, out = io.StringIO(), io.StringIO()
    before, sys.stdout = sys.stdout, out
    try:
        print_early((EarlyVerdict(criterion=hostile, final=True),))
    finally:
        sys.stdout = before
    console = Console(file=above, width=80, markup=False, emoji=False, highlight=False)
    print_early((EarlyVerdict(criterion=hostile, final=True),), above=console.print)
    for shown in (out.getvalue(), above.getvalue()):
        assert not STEERING.search(shown)
        assert not TO_A_CI.search(shown)
        assert len(shown) < 2_000


def test_hidden_criteria_are_told_to_an_instructor_only(tmp_path) -> None:
    hidden = (
        "check: rate\n    with: {topic: /chatter, rate_hz: 10}\n    scenario: real\n",
        "check: manifest\n    with: {name: lab1}\n",
    )
    path = spoiled(tmp_path, hidden, ("points: 40", "points: 40\n    visibility: hidden"))
    rubric, source = load_rubric(str(path)), ROOT / "reference_solutions" / "leeds-comp3631-lab1"
    told = []
    for keep_hidden in (True, False):
        early = Early()
        options = GradeOptions(static_only=True, keep_hidden=keep_hidden)
        grade(str(source), rubric, tmp_path / f"{keep_hidden}", options, early)
        told.append(early.ids)
    assert told == [("talker-node",), ()]
