"""The reports of results that are there already, written again from `result.json` and evidence: nothing is judged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from grader.classes.batch.pool import side_by_side, workers, working
from grader.classes.batch.settled import figures_in
from grader.errors import EvidenceError, GraderError, UsageError
from grader.files import new_file, unwritable
from grader.model.result import GradingResult
from grader.report.files import render_files
from grader.report.forms import Shown
from grader.report.sentences import missing_hidden
from grader.results import RESULT, Results, read_result
from grader.rubric.load import LoadedRubric


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
        shown = Shown(
            result=result,
            rubric=rubric.rubric,
            hidden=missing_hidden(result, rubric.rubric),
            docs=rubric.docs,
            load_figures=lambda: figures_in(folder, result, rubric.rubric),
        )
        made = render_files(shown)
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
