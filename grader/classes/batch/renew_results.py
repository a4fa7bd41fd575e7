"""What earlier gradings left: evidence is judged again, results are settled again, reports are written again.

To settle is to apply what people decided (overrides) and what being late costs (deadlines) to an automatic result. Many
submissions are done at a time, in worker processes. None of it needs ROS.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from grader.errors import EvidenceError, GraderError, OutputError, UsageError
from grader.evidence.reader import SUFFIXES, load_evidence
from grader.evidence.run import Run
from grader.files import new_file, writing
from grader.judging import judge
from grader.judging.settle import settle, unsettled
from grader.model.figure import Figures
from grader.model.result import CriterionResult, GradingResult, HandedIn, Override
from grader.report.figures import figures_of
from grader.report.files import render_files, write_reports
from grader.report.forms import ReportInput
from grader.report.sentences import missing_hidden
from grader.results import EVIDENCE, RESULT, Results, load_result
from grader.rubric.load import LoadedRubric
from grader.rubric.made_up import with_recorded_values
from grader.rubric.model import Rubric
from grader.workers import WorkerEnded, run_each

PACKAGE, SCENARIO = "package.mcap", "scenario.digest"


@dataclass(frozen=True, kw_only=True)
class JudgedFolder:
    """One submission's criteria, or on one line why there are none and what to do about it.

    `missing` are the rubric's scenarios without a recording that fits.
    """

    folder: Path
    criteria: tuple[CriterionResult, ...] | None
    missing: tuple[str, ...] = ()
    error: str = ""
    hint: str = ""


def judge_all(folders: Sequence[Path], rubric: LoadedRubric, jobs: int) -> Iterator[JudgedFolder]:
    """Judge every submission's evidence again, `jobs` at a time; yield each as it comes.

    What is wrong with one submission is in its `error` and stops no other, even if it ends the process.
    """
    return run_each(partial(judge_one, rubric), folders, min(jobs, len(folders)), ended=_judging_ended)


def _judging_ended(folder: Path, _: WorkerEnded) -> JudgedFolder:
    hint = "check whether this machine has too little memory, then judge it by itself"
    return JudgedFolder(
        folder=folder, criteria=None, error=f"{folder}: judging it ended the process", hint=hint
    )


def judge_one(rubric: LoadedRubric, folder: Path, *, fitting: bool = False) -> JudgedFolder:
    """Judge one submission's evidence again, in a worker.

    With `fitting`, a recording counts only if it was made with the rubric's present scenario.
    """
    lab = rubric.rubric
    try:
        runs = load_evidence([folder])
        runs = fitting_runs(lab, runs) if fitting else runs
        criteria = judge(lab, runs, rubric.checks, rubric.handed_out)
    except GraderError as error:
        return JudgedFolder(folder=folder, criteria=None, error=error.message, hint=error.hint)
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are judged
        message = f"{folder}: internal error: {type(error).__name__}: {error}"
        return JudgedFolder(
            folder=folder, criteria=None, error=message, hint="judge it by itself with --debug"
        )
    scenarios = dict.fromkeys(c.scenario for c in lab.criteria if c.scenario is not None)
    missing = tuple(name for name in scenarios if name not in runs)
    return JudgedFolder(folder=folder, criteria=criteria, missing=missing)


def fitting_runs(rubric: Rubric, runs: Mapping[str, Run]) -> dict[str, Run]:
    """Return the runs that were recorded with the rubric's present scenarios; evidence that does not say counts."""
    scenarios = with_recorded_values(rubric, runs).scenarios
    digests = {name: scenario.digest for name, scenario in scenarios.items()}
    return {
        name: run
        for name, run in runs.items()
        # a repaired or repeated run is named `repaired-1/<scenario>`; what does not say how it was recorded
        # fits
        if run.metadata.get(SCENARIO, wanted := digests.get(name.rpartition("/")[2])) == wanted
    }


def submissions_in(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the folders of the submissions that these paths stand for; none if they stand for one submission.

    A folder of results stands for every submission in it. Raises EvidenceError if something else is among them.
    """
    whole = [path for path in paths if _is_result(path)]
    below = {path: _submissions_below(path) for path in paths if path not in whole}
    found = [*whole, *(folder for folders in below.values() for folder in folders)]
    if len(whole) < 2 and len(found) == len(whole):
        return ()
    for path, folders in below.items():
        if not folders:
            message = f"{path}: not the folder of a submission's results, as the others are"
            raise EvidenceError(message, hint="judge it by itself")
    return tuple(dict.fromkeys(found))


def _submissions_below(folder: Path) -> list[Path]:
    """Return the submissions in a folder of results; a folder of recordings has none."""
    try:
        if not folder.is_dir() or _has_recordings(folder):
            return []
        inside = [path for path in sorted(folder.iterdir()) if not path.name.startswith(".")]
        return [path for path in inside if _is_result(path) or _has_recordings(path)]
    except OSError as error:
        raise EvidenceError(f"{folder}: {error.strerror or type(error).__name__}") from error


def _is_result(folder: Path) -> bool:
    """Return whether `grade` left this of one submission, or it is its evidence alone."""
    return (folder / RESULT).is_file() or (folder / PACKAGE).is_file() or _has_recordings(folder / EVIDENCE)


def _has_recordings(folder: Path) -> bool:
    return folder.is_dir() and any(path.suffix in SUFFIXES for path in folder.iterdir())


CONSOLE = "console.log"


@dataclass(frozen=True, kw_only=True)
class WrittenReports:
    """One submission's reports are written, or `error` says on one line why not."""

    folder: Path
    rubric_digest: str = ""
    error: str = ""
    hint: str = ""


def write_all(folders: Sequence[Path], rubric: LoadedRubric, jobs: int) -> Iterator[WrittenReports]:
    """Write each submission's reports, `jobs` at a time; yield each as it comes. A faulty one stops no other."""
    return run_each(partial(_try_write, rubric), folders, min(jobs, len(folders)), ended=_writing_ended)


def _writing_ended(folder: Path, error: WorkerEnded) -> WrittenReports:
    message = f"{folder}: the process that wrote it {error.reason}"
    return WrittenReports(folder=folder, error=message, hint="write it by itself")


def write_one(folder: Path, rubric: LoadedRubric) -> GradingResult:
    """Write `report.html`, `report.md` and `junit.xml` again into a submission's folder; return its result.

    Each appears whole; they are not flushed to the disk, since they can always be made again. Raises EvidenceError if
    there is no result that can be read, and as `Results` does.
    """
    result_in(folder, rubric)  # before anything is made there
    with Results(folder) as results:
        # read again under the lock: it may have been replaced since
        result = result_in(folder, rubric)
        shown = ReportInput(
            result=result,
            rubric=rubric.rubric,
            hidden=missing_hidden(result, rubric.rubric),
            docs=rubric.docs,
            load_figures=lambda: figures_in(folder, result, rubric.rubric),
        )
        made = render_files(shown)
        with writing(folder):
            for name, data in made.items():
                with new_file(results.new / name) as file:
                    file.write(data)
            for name in made:
                (results.new / name).replace(folder / name)
    return result


def has_result(folder: Path) -> bool:
    """Return whether `folder` holds a submission's results."""
    return (folder / RESULT).is_file()


def result_in(folder: Path, rubric: LoadedRubric | None = None) -> GradingResult:
    """Return a submission's result. Raises EvidenceError, and UsageError if it is of another lab than `rubric`."""
    result = load_result(folder / RESULT)
    if rubric is not None and result.rubric.id != rubric.rubric.id:
        message = f"{folder}: a result of {result.rubric.id}, not of {rubric.rubric.id}"
        raise UsageError(message, hint="give the rubric that it was graded by with --rubric")
    return result


def _try_write(rubric: LoadedRubric, folder: Path) -> WrittenReports:
    """In a worker."""
    try:
        result = write_one(folder, rubric)
    except GraderError as error:
        return WrittenReports(folder=folder, error=error.message, hint=error.hint)
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are written
        message = f"{folder}: internal error: {type(error).__name__}: {error}"
        return WrittenReports(folder=folder, error=message, hint="write it by itself with --debug")
    return WrittenReports(folder=folder, rubric_digest=result.rubric.digest)


@dataclass(frozen=True)
class Settler:
    """Settles results by the rubric's late policy and by `overrides`: by submission, then by criterion."""

    rubric: Rubric
    overrides: Mapping[str, Mapping[str, Override]]

    def of(self, submission_id: str) -> Mapping[str, Override]:
        """Return a submission's overrides, by criterion."""
        return self.overrides.get(submission_id, {})

    def settle(
        self, automatic: GradingResult, submission_id: str, handed_in: HandedIn | None, earlier: GradingResult
    ) -> GradingResult:
        """Return the result that counts, made from an automatic one; `earlier` is the result that it replaces."""
        return settle(
            automatic,
            self.rubric,
            overrides=self.of(submission_id),
            handed_in=handed_in or earlier.handed_in,
            before=earlier.overrides,
        )

    def settle_again(
        self, result: GradingResult, submission_id: str, handed_in: HandedIn | None
    ) -> GradingResult:
        """Return the same result as it counts now: overrides or extensions may have come since."""
        automatic = unsettled(result, self.rubric)
        return self.settle(automatic, submission_id, handed_in, result)


def rewrite(
    folder: Path,
    result: GradingResult,
    rubric: Rubric,
    docs: Mapping[str, Mapping[str, str]],
    *,
    of: Path | None = None,
) -> None:
    """Write the result's reports; its evidence and its log stay, or are those of the folder `of`. Raises as `Results`
    does.

    `docs` has the sections of the checks' docstrings.
    """
    with Results(folder) as results:
        figures = figures_in(of or folder, result, rubric)
        write_reports(result, results.new, console="", rubric=rubric, figures=figures, docs=docs)
        (results.new / CONSOLE).unlink()
        if of is not None:
            _copy(of, results)
        results.commit(keep=(EVIDENCE, CONSOLE) if of is None else ())


def _copy(folder: Path, results: Results) -> None:
    results.evidence.rmdir()
    try:
        if (folder / EVIDENCE).is_dir():
            shutil.copytree(folder / EVIDENCE, results.evidence, symlinks=True)
        if (folder / CONSOLE).is_file():
            shutil.copy(folder / CONSOLE, results.new / CONSOLE)
    except (OSError, shutil.Error) as error:
        raise OutputError(f"cannot copy {folder}: {error}") from error


def rewrite_all(results: Mapping[Path, GradingResult], rubric: LoadedRubric, count: int) -> Iterator[str]:
    """Do as `rewrite` for each folder's result, `count` at a time. Yield for each an empty string, or why it could not
    be written; a faulty one stops no other."""
    return run_each(
        partial(_try_rewrite, rubric),
        list(results.items()),
        min(count, len(results)),
        ended=lambda job, error: _writing_ended(job[0], error).error,
    )


def _try_rewrite(rubric: LoadedRubric, job: tuple[Path, GradingResult]) -> str:
    """In a worker."""
    try:
        rewrite(*job, rubric.rubric, rubric.docs)
    except GraderError as error:
        return error.message
    return ""


def figures_in(folder: Path, result: GradingResult, rubric: Rubric) -> Figures | None:
    """Return the figures of a submission's evidence; None if there is none, or it cannot be read."""
    with suppress(Exception):  # no mark depends on a picture
        runs = fitting_runs(rubric, load_evidence([folder / EVIDENCE]))
        return figures_of(rubric, runs, result.criteria)
    return None
