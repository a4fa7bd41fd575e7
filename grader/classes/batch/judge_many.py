"""Recorded submissions judged again, many at a time, in worker processes. Needs no ROS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from grader.errors import EvidenceError, GraderError
from grader.evidence.reader import SUFFIXES, load_evidence
from grader.evidence.run import Run
from grader.judging import judge
from grader.model.result import CriterionResult
from grader.results import EVIDENCE, RESULT
from grader.rubric.load import LoadedRubric
from grader.rubric.made_up import as_recorded
from grader.rubric.model import Rubric
from grader.workers import WorkerEnded, run_each

PACKAGE, SCENARIO = "package.mcap", "scenario.digest"


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One submission's criteria, or in one line why there are none and what to do about it.

    `missing` are the rubric's scenarios without a recording that fits.
    """

    folder: Path
    criteria: tuple[CriterionResult, ...] | None
    missing: tuple[str, ...] = ()
    error: str = ""
    hint: str = ""


def judge_all(
    folders: Sequence[Path], rubric: LoadedRubric, jobs: int, *, fitting: bool = False
) -> Iterator[Judged]:
    """Judge every submission's evidence again, `jobs` at a time; yield each as it comes.

    With `fitting`, a recording counts only if it was made with the rubric's present scenario. What is wrong with one
    submission is in its `error` and stops no other, even if it ends the process.
    """
    judge_one = partial(_judge_one, rubric, fitting)
    return run_each(judge_one, folders, min(jobs, len(folders)), ended=_judging_ended)


def _judging_ended(folder: Path, _: WorkerEnded) -> Judged:
    hint = "check whether this machine has too little memory, then judge it by itself"
    return Judged(folder=folder, criteria=None, error=f"{folder}: judging it ended the process", hint=hint)


def _judge_one(rubric: LoadedRubric, fitting: bool, folder: Path) -> Judged:
    """In a worker."""
    lab = rubric.rubric
    try:
        runs = load_evidence([folder])
        runs = fitting_runs(lab, runs) if fitting else runs
        criteria = judge(lab, runs, rubric.checks, rubric.handed_out)
    except GraderError as error:
        return Judged(folder=folder, criteria=None, error=error.message, hint=error.hint)
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are judged
        message = f"{folder}: internal error: {type(error).__name__}: {error}"
        return Judged(folder=folder, criteria=None, error=message, hint="judge it by itself with --debug")
    scenarios = dict.fromkeys(c.scenario for c in lab.criteria if c.scenario is not None)
    missing = tuple(name for name in scenarios if name not in runs)
    return Judged(folder=folder, criteria=criteria, missing=missing)


def fitting_runs(rubric: Rubric, runs: Mapping[str, Run]) -> dict[str, Run]:
    """Return the runs that were recorded with the rubric's present scenarios; evidence that does not say counts."""
    scenarios = as_recorded(rubric, runs).scenarios
    digests = {name: scenario.digest for name, scenario in scenarios.items()}
    return {
        name: run
        for name, run in runs.items()
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
