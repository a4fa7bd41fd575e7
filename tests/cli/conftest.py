"""A pipeline and a judge that do what a test says: the command line is tested without ROS."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest

import grader
from grader.model.result import GradingResult
from grader.report.files import write_reports
from tests.report.hostile import result
from tests.rubric.samples import spoiled
from tests.support.a_class import criterion

LOADED = "grader.cli.checking"
"""Has the pipeline as it was when it was loaded."""


@dataclass(frozen=True, kw_only=True)
class GradeOptions:
    sandbox: str
    submission_id: str | None = None
    package: str = ""
    static_only: bool = False
    keep_hidden: bool = True
    files: bool = True
    repository: Path | None = None


class FakePipeline(ModuleType):
    """`outcome` is what `grade` returns, or raises where it is an exception."""

    GradeOptions = GradeOptions

    def __init__(self) -> None:
        super().__init__("grader.pipeline")
        self.outcome: GradingResult | BaseException = passing()
        self.calls: list[tuple] = []

    def grade(self, source, rubric, out: Path, options, progress):
        """Tell two steps, write the reports, return the result."""
        self.calls.append((source, rubric.rubric.id, out, options))
        progress.step("intake", "running", "reading \x1b[31m", 1.0)
        progress.step("intake", "done")
        if isinstance(self.outcome, BaseException):
            raise self.outcome
        folder = out / self.outcome.submission.id
        write_reports(self.outcome, folder, console="", rubric=rubric.rubric, keep_hidden=options.keep_hidden)
        return self.outcome

    def record(self, source, rubric, out: Path, options, progress):
        """Say where a scenario's evidence would be."""
        self.calls.append((source, rubric.rubric, out, options))
        progress.step("record", "done")
        return [out / f"{name}.mcap" for name in rubric.rubric.scenarios]


def passing(status: str = "pass", *, graded: str = "graded") -> GradingResult:
    """The sample rubric's result: the rate has `status`, the other criterion is reached."""
    points = 60 if status == "pass" else 0
    return result(
        status=graded,
        points=40 + points,
        criteria=(
            criterion("talker-node", "pass", 40, 40, scenario="real"),
            criterion("chatter-rate", status, points, 60, scenario="real", message="5 Hz \x1b[31m"),
        ),
    )


@pytest.fixture
def pipeline(monkeypatch):
    """The fake in place of `grader.pipeline`, in freshly imported commands that no other test sees."""
    fake = FakePipeline()
    monkeypatch.setitem(sys.modules, "grader.pipeline", fake)
    monkeypatch.setattr(grader, "pipeline", fake, raising=False)
    monkeypatch.setattr(
        "grader.cli.host_support.why_nodes_cannot_run", lambda: ""
    )  # whatever this machine has
    monkeypatch.delitem(sys.modules, LOADED, raising=False)
    yield fake
    sys.modules.pop(LOADED, None)


@pytest.fixture
def lab(tmp_path) -> str:
    """A sound rubric's file."""
    return str(spoiled(tmp_path))
