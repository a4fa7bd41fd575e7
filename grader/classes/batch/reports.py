"""The reports of results that are there already, written again from `result.json` and evidence: nothing is judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from grader.checks import CHECKS
from grader.classes.batch.pool import side_by_side, workers, working
from grader.classes.batch.regrade import fitting_runs
from grader.errors import EvidenceError, GraderError, UsageError
from grader.evidence.reader import load_evidence
from grader.files import new_file, unwritable
from grader.judging.settle import settle, unsettled
from grader.model.figure import Figures
from grader.model.result import GradingResult
from grader.model.submission_time import HandedIn, Override
from grader.report.figures import figures_of
from grader.report.files import write_reports
from grader.report.html import html_report
from grader.report.junit import junit
from grader.report.markdown import markdown_report
from grader.report.summary import missing_hidden
from grader.results import EVIDENCE, RESULT, Results, read_result
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric


@dataclass(frozen=True, kw_only=True)
class Written:
    """What became of one submission: its reports are written, or `error` says in one line why not."""

    folder: Path
    rubric_digest: str = ""
    error: str = ""
    hint: str = ""


def write_all(folders: Sequence[Path], rubric: LoadedRubric, jobs: int) -> Iterator[Written]:
    """Each submission's reports, `jobs` at a time, each as it comes. What is wrong with one stops no other."""
    left = dict.fromkeys(folders)
    work = partial(_written, rubric)
    with suppress(BrokenProcessPool), workers(min(jobs, len(left))) as pool:
        for written in side_by_side(pool, work, tuple(left), most=2 * jobs):
            del left[written.folder]
            yield written
    for folder in left:  # a process has ended: nobody knows on which of them
        yield Written(
            folder=folder, error=f"{folder}: the process that wrote it has ended", hint="write it by itself"
        )


def write_one(folder: Path, rubric: LoadedRubric) -> GradingResult:
    """Write `report.html`, `report.md` and `junit.xml` anew into a submission's folder; gives its result.

    Each appears whole; they are not flushed to the disk, for they can always be made again. Raises EvidenceError where
    there is no result that can be read, and as `Results` does.
    """
    result_in(folder, rubric)  # before anything is made there
    with Results(folder) as results:
        result = result_in(folder, rubric)
        made = _files(result, rubric, figures_in(folder, result, rubric.rubric))
        try:
            for name, data in made.items():
                with new_file(results.new / name) as file:
                    file.write(data)
            for name in made:
                (results.new / name).replace(folder / name)
        except OSError as error:
            raise unwritable(folder, error) from error
    return result


def has_result(folder: Path) -> bool:
    """Whether it is a submission's folder of results."""
    return (folder / RESULT).is_file()


def result_in(folder: Path, rubric: LoadedRubric | None = None) -> GradingResult:
    """A submission's result. Raises EvidenceError, and UsageError where it is of another lab than `rubric`."""
    result = read_result(folder)
    if result is None:
        message = f"{folder / RESULT}: there is none, or it is not what this grader writes"
        raise EvidenceError(message, hint="grade it again")
    if rubric is not None and result.rubric.id != rubric.rubric.id:
        message = f"{folder}: a result of {result.rubric.id}, not of {rubric.rubric.id}"
        raise UsageError(message, hint="give the rubric that it was graded by with --rubric")
    return result


def _files(result: GradingResult, rubric: LoadedRubric, figures: Figures | None) -> dict[str, bytes]:
    hidden = missing_hidden(result, rubric.rubric)
    page = html_report(result, rubric.rubric, figures or Figures(), hidden=hidden, docs=rubric.docs)
    text = markdown_report(result, rubric.rubric, hidden=hidden, figures=figures)
    return {
        "report.html": page.encode("utf-8", "backslashreplace"),
        "report.md": text.encode(),
        "junit.xml": junit(result),
    }


def _written(rubric: LoadedRubric, folder: Path) -> Written:
    """In a worker."""
    with working():
        try:
            result = write_one(folder, rubric)
        except GraderError as error:
            return Written(folder=folder, error=error.message, hint=error.hint)
        except Exception as error:  # noqa: BLE001 - whatever it is, the others are written
            message = f"{folder}: internal error: {type(error).__name__}: {error}"
            return Written(folder=folder, error=message, hint="write it by itself with --debug")
        return Written(folder=folder, rubric_digest=result.rubric.digest)


# [classes.batch.settled] What a person decided and when it was handed in, applied to a result that is there already.

CONSOLE = "console.log"


@dataclass(frozen=True)
class Settler:
    """Settles results by the rubric's late policy and by `overrides`: by submission, then by criterion."""

    rubric: Rubric
    overrides: Mapping[str, Mapping[str, Override]]

    def of(self, submission_id: str) -> Mapping[str, Override]:
        """A submission's overrides."""
        return self.overrides.get(submission_id, {})

    def settled(
        self, automatic: GradingResult, submission_id: str, handed_in: HandedIn | None, earlier: GradingResult
    ) -> GradingResult:
        """An automatic result made the one that counts; `earlier` is the one that it takes the place of."""
        return settle(
            automatic,
            self.rubric,
            overrides=self.of(submission_id),
            handed_in=handed_in or earlier.handed_in,
            before=earlier.overrides,
        )

    def again(self, result: GradingResult, submission_id: str, handed_in: HandedIn | None) -> GradingResult:
        """The same result as it counts now: an override or an extension may have come since."""
        automatic = unsettled(result, self.rubric)
        return self.settled(automatic, submission_id, handed_in, result)


def rewrite(
    folder: Path, result: GradingResult, rubric: Rubric, docs: Mapping[str, Mapping[str, str]] | None = None
) -> None:
    """Write the result's reports; the evidence that it was judged from stays. Raises as `Results` does.

    `docs` has the sections of the checks' docstrings; without them, those of the grader's own checks are taken.
    """
    with Results(folder) as results:
        figures = figures_in(folder, result, rubric)
        docs = docs or {name: check.sections for name, check in CHECKS.items()}
        write_reports(result, results.new, console="", rubric=rubric, figures=figures, docs=docs)
        (results.new / CONSOLE).unlink()
        results.commit(keep=(EVIDENCE, CONSOLE))


def figures_in(folder: Path, result: GradingResult, rubric: Rubric) -> Figures | None:
    """Of a submission's folder of results, drawn from its evidence; None where there is none, or it cannot be read."""
    with suppress(Exception):  # no mark hangs on a picture
        runs = fitting_runs(rubric, load_evidence([folder / EVIDENCE]))
        return figures_of(rubric, runs, result.criteria)
    return None
