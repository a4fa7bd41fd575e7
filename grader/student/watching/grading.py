"""The real grading of `grader check --watch`: what `grader check` does, of a part of the scenarios."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader import pipeline
from grader.arena.asynchronous import Stop
from grader.errors import ExitCode, GraderError, UsageError
from grader.faults import Attempt, error_result
from grader.intake.identity import identify
from grader.model.progress import Progress
from grader.model.result import GradingResult, SubmissionInfo, TimingInfo
from grader.report.view import without_hidden
from grader.results import EVIDENCE
from grader.rubric.load import LoadedRubric
from grader.student.watching.loop import Outcome

NO_TIME = TimingInfo(wall_s=0.0, cpu_s=0.0, student_cpu_s=0.0)


@dataclass(kw_only=True)
class Grading:
    """Grades `source` into `out`, again and again. `code` gives the exit code of a result that was graded, `progress`
    a display, and is told whether it is the first one."""

    source: str
    rubric: LoadedRubric
    out: Path
    options: pipeline.GradeOptions
    progress: Callable[[bool], AbstractContextManager[Progress]]
    code: Callable[[GradingResult], ExitCode]
    _begun: bool = field(default=False, init=False)

    def __call__(self, recorded: Mapping[str, Path], stop: Stop) -> Outcome:
        """See `loop.Watched`. Raises GraderError where no save can mend it: UsageError, the machine at the start."""
        options = replace(self.options, recorded=recorded, stop=stop)
        try:
            with self.progress(not self._begun) as progress:
                result = pipeline.grade(self.source, self.rubric, self.out, options, progress)
        except GraderError as error:
            if isinstance(error, UsageError) or (error.blame != "submission" and not self._begun):
                raise
            self._begun = True
            return Outcome(result=self._shown(self._error(error)), code=ExitCode.NOT_GRADED, evidence=None)
        self._begun = True
        shown = self._shown(result)
        code = ExitCode.NOT_GRADED if shown.status == "error" else self.code(shown)
        return Outcome(
            result=shown, code=code, whole=result, evidence=self.out / result.submission.id / EVIDENCE
        )

    def _shown(self, result: GradingResult) -> GradingResult:
        return without_hidden(result, self.rubric.rubric)

    def _error(self, error: GraderError) -> GradingResult:
        known = identify(self.source) or (Path(self.source).name, self.source)
        about = SubmissionInfo(id=known[0], source=known[1], commit=None, digest="", package="")
        attempt = Attempt(
            source=self.source,
            submission_id=None,
            rubric=self.rubric,
            out=self.out,
            keep_hidden=False,
            timing=lambda: NO_TIME,
        )
        return error_result(error, about, attempt)
