"""Everything that a command prints: no escape reaches the terminal, no line is a command to a CI system."""

from __future__ import annotations

import ast
import io
import json
import re
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

import grader
from grader.cli.commands.grading import inspect
from grader.cli.display import LiveSteps, PlainSteps
from grader.cli.labs import print_test
from grader.cli.output import guarded, report, say, say_json
from grader.errors import RubricError, SubmissionError
from grader.evidence.events import ActorEvent
from grader.evidence.inspect import inspect_run
from grader.evidence.run import Channel, Message, Run
from grader.model.mutants import LostCriterion, MutantResult, ReferenceResult, RubricTest
from grader.model.result import RubricInfo
from tests.report.nasty import STEERING, TEXTS, TO_A_CI

GRADER = Path(grader.__file__).parent
MAY_PRINT = {
    "cli/output.py",
    "cli/display.py",
    "cli/class_display.py",
    "cli/main.py",  # the list of commands, which is its own
    "limited_child.py",  # JSON for the process that started it
    "integrations/ci_systems.py",  # annotations; tests/integrations
    "integrations/autograde.py",  # a report as in a terminal; tests/integrations
}
NASTY = "\x1b[2J\u202e\n::error::owned\n##[error]x\x9b31m\ud800" + "y" * 10**6
SOME = settings(max_examples=40)


def harmless(shown: str, *, limit: int = 20_000) -> bool:
    return not STEERING.search(shown) and not TO_A_CI.search(shown) and len(shown) < limit


@SOME
@given(TEXTS, TEXTS)
def test_progress_in_a_log(name, detail):
    out = io.StringIO()
    PlainSteps(out).step(name, "running", detail, 3)
    assert harmless(out.getvalue())
    assert out.getvalue().count("\n") == 1


@SOME
@given(TEXTS, TEXTS)
def test_progress_on_a_terminal(name, detail):
    steps = LiveSteps()
    steps.step(name, "running", detail, 3)
    out = io.StringIO()
    Console(file=out, width=80, markup=False, emoji=False, highlight=False).print(steps)
    assert harmless(out.getvalue())
    assert out.getvalue().count("\n") == 2


@SOME
@given(TEXTS, TEXTS)
def test_errors_are_lines(message, hint):
    out, before = io.StringIO(), sys.stderr
    sys.stderr = out
    try:
        report(SubmissionError(message, hint=hint or "x"))
        report(RubricError([message, hint]))
    finally:
        sys.stderr = before
    assert harmless(out.getvalue())
    assert out.getvalue().count("\n") == 4


def test_a_traceback_shows_what_a_student_wrote_and_sends_nothing(capsys):
    def broken() -> int:
        raise SubmissionError(NASTY)

    assert guarded(broken, debug=True) == 3
    shown = capsys.readouterr().err
    assert "Traceback" in shown
    assert "\\x1b[2J" in shown
    assert harmless(shown, limit=1_100_000)


def inspected(text: str) -> Run:
    channel = Channel(
        topic=text,
        callerid=text,
        type=text,
        md5sum="",
        definition="",
        latching=False,
        messages=(Message(1, 0, b""),),
    )
    return Run(
        evidence=text, scenario=text, clock=text, warp=float("inf"), metadata={text: text}, start_ns=0, end_ns=1,
        channels=(channel,), attachments={text: b""},
        actors=((0, ActorEvent(action="refused", actor=text, detail=text)),),
    )  # fmt: skip


@pytest.mark.parametrize("as_json", [False, True])
def test_inspect_shows_names_that_somebody_else_chose(as_json, monkeypatch, capsys):
    text = NASTY[:100].replace("\ud800", "")
    monkeypatch.setattr("grader.evidence.inspect.inspect_file", lambda _: inspect_run(inspected(text)))
    assert inspect(file=None, as_json=as_json) == 0
    shown = capsys.readouterr().out
    assert harmless(shown)
    assert as_json or "\nnoticed:" in shown
    if as_json:
        data = json.loads(shown)
        assert data["noticed"] == [f"{text}: {text}"]
        assert data["channels"][0]["topic"] == text
        assert data["metadata"] == {text: text}
        assert data["warp"] is None


def test_inspect_of_a_thousand_channels_ends(monkeypatch, capsys):
    channels = tuple(
        Channel(
            topic=f"/t{i}", callerid="", type="t/T", md5sum="", definition="", latching=False, messages=()
        )
        for i in range(1000)
    )
    run = Run(
        evidence="x",
        scenario="",
        clock="real",
        warp=1.0,
        metadata={},
        start_ns=0,
        end_ns=1,
        channels=channels,
    )
    monkeypatch.setattr("grader.evidence.inspect.inspect_file", lambda _: inspect_run(run))
    assert inspect(file=None) == 0
    assert "and 500 more channels" in capsys.readouterr().out


def test_a_rubrics_test_shows_what_its_solution_wrote():
    lost = (LostCriterion(id="rate", status="fail", message=NASTY),)
    mutant = MutantResult(
        name="m", label=NASTY[:80], operator="o", mistake="Does", state="survived", expected=None, lost=lost,
        missing=(NASTY[:80],), diff=f"+{NASTY}", evidence=NASTY[:80], error=NASTY, wall_s=1,
    )  # fmt: skip
    test = RubricTest(
        rubric=RubricInfo(id="x", version="1", digest=""), solution=NASTY[:80],
        reference=ReferenceResult(points=0, max_points=1, lost=lost, evidence=None), mutants=(mutant,), uncosted=None,
        unfit=(NASTY[:80],), wall_s=1, passed=False,
    )  # fmt: skip
    out = io.StringIO()
    print_test(test, out)
    assert "\\x1b[2J" in out.getvalue()
    assert harmless(out.getvalue())


@SOME
@given(TEXTS, st.sampled_from(["utf-8", "ascii", "latin-1"]))
def test_what_is_printed_is_one_line_in_any_encoding(text, encoding):
    raw, before = io.BytesIO(), sys.stdout
    sys.stdout = io.TextIOWrapper(raw, encoding=encoding, errors="backslashreplace")
    try:
        say(text)
        sys.stdout.flush()
        printed = raw.getvalue().decode(encoding)
        say_json([text])
        sys.stdout.flush()
        data = raw.getvalue().decode(encoding)[len(printed) :]
    finally:
        sys.stdout = before
    assert harmless(printed)
    assert printed.count("\n") == 1
    assert json.loads(data) == [text.encode("utf-8", "backslashreplace").decode()]
    assert harmless(data)


def test_nothing_else_prints():
    """What prints must know whose text it prints; ROS's side has no terminal."""
    found = {
        path.relative_to(GRADER).as_posix()
        for path in GRADER.rglob("*.py")
        if not {"ros", "lint", "standins", "_data"} & set(path.relative_to(GRADER).parts)
        for text in [path.read_text(encoding="utf-8")]
        if re.search(r"\bprint\(|\bstd(out|err)\.write\(", text)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call)
        and ast.unparse(node.func) in {"print", "sys.stdout.write", "sys.stderr.write"}
    }
    assert found <= MAY_PRINT
