"""The grading of a watched package: what ends it, what is shown and tried again, and how it is stopped."""

from __future__ import annotations

import asyncio
import threading
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from grader import pipeline
from grader.arena.interruption import Stop, Stopped, run_until_signal
from grader.cli.main import build_parser
from grader.errors import Busy, ExitCode, HostError, OutputError, SandboxMissing, SubmissionError
from grader.model.result import Silence
from grader.model.verdict import Status
from grader.student.watching import Grading
from tests.report.hostile import criterion, result
from tests.student.watching.labs import rubric


@pytest.fixture
def grading(tmp_path: Path) -> Grading:
    return Grading(
        source=str(tmp_path / "lab1"),
        rubric=rubric("leeds-comp3631-lab1"),
        out=tmp_path / "out",
        options=pipeline.GradeOptions(keep_hidden=False),
        progress=lambda _first: nullcontext(Silence()),
        code=lambda _: ExitCode.BELOW_PASS_MARK,
    )


def outcomes(monkeypatch, *outcomes_: object) -> list[pipeline.GradeOptions]:
    """The pipeline gives or raises these, one after the other; the options that it was asked with."""
    left, asked = list(outcomes_), []

    def grade(_source, _rubric, _out, options, _progress):
        asked.append(options)
        outcome = left.pop(0)
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    monkeypatch.setattr(pipeline, "grade", grade)
    return asked


def test_the_stop_reaches_the_pipeline(grading, monkeypatch) -> None:
    asked = outcomes(monkeypatch, result(status="graded"))
    stop = Stop()
    outcome = grading(stop)
    assert (asked[0].stop, asked[0].keep_hidden) == (stop, False)
    assert outcome.code is ExitCode.BELOW_PASS_MARK


@pytest.mark.parametrize("static", [True, False])
def test_what_was_not_judged_is_undecided_unless_nothing_was_to_run(static, grading, monkeypatch) -> None:
    grading.options = replace(grading.options, static_only=static)
    criteria = (criterion("rate", Status.INCONCLUSIVE, 0.0, 10.0),)
    outcomes(monkeypatch, result(status="graded", criteria=criteria))
    assert grading(Stop()).undecided is not static


def test_a_submission_that_cannot_be_graded_is_a_result(grading, monkeypatch) -> None:
    outcomes(monkeypatch, SubmissionError("too much", hint="less"))
    outcome = grading(Stop())
    assert (outcome.code, outcome.undecided) == (ExitCode.NOT_GRADED, True)
    assert outcome.result.error is not None
    assert (outcome.result.submission.id, outcome.result.error.hint) == ("lab1", "less")


@pytest.mark.parametrize(
    "error", [SandboxMissing("no bwrap"), HostError("no memory"), OutputError("read-only")]
)
def test_what_no_save_can_fix_ends_it_at_the_start(error, grading, monkeypatch) -> None:
    outcomes(monkeypatch, error)
    with pytest.raises(type(error)):
        grading(Stop())


def test_a_fault_of_the_machine_later_on_is_shown_and_tried_again(grading, monkeypatch) -> None:
    outcomes(monkeypatch, result(status="graded"), Busy("another grader"), result(status="graded"))
    codes = [grading(Stop()).code for _ in range(3)]
    assert codes[1] is ExitCode.NOT_GRADED
    assert codes[0] == codes[2]


def test_work_is_stopped_from_another_thread_and_ends_in_order() -> None:
    stop, course = Stop(), []

    async def work() -> None:
        threading.Thread(target=stop.ask).start()
        try:
            await asyncio.sleep(60)
        finally:
            course.append("cleaned up")

    with pytest.raises(Stopped):
        run_until_signal(work(), stop)
    assert course == ["cleaned up"]


def test_work_that_begins_after_it_was_stopped_ends_at_once() -> None:
    stop = Stop()
    stop.ask()
    with pytest.raises(Stopped):
        run_until_signal(asyncio.sleep(60), stop)


def test_a_stop_after_the_end_changes_nothing() -> None:
    stop = Stop()
    run_until_signal(asyncio.sleep(0), stop)
    stop.ask()
    assert stop.asked


def test_the_command_line_knows_it() -> None:
    assert build_parser().parse_args(["check", "--watch", "--static"]).watch is True
    assert build_parser().parse_args(["check"]).watch is False
