"""Recorded submissions judged again, many at a time, in worker processes. Needs no ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from grader.classes.batch.pool import side_by_side, workers, working
from grader.errors import EvidenceError, GraderError
from grader.evidence.reader import SUFFIXES, load_evidence
from grader.evidence.run import Run
from grader.judging import judge
from grader.model.result import CriterionResult
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric

EVIDENCE, RESULT, PACKAGE = "evidence", "result.json", "package.mcap"
SCENARIO = "scenario.digest"


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One submission's criteria, or in one line why there are none, and what to do about it.

    `missing` are the rubric's scenarios of which there is no recording that fits.
    """

    folder: Path
    criteria: tuple[CriterionResult, ...] | None
    missing: tuple[str, ...] = ()
    error: str = ""
    hint: str = ""


def judge_all(
    folders: Sequence[Path], rubric: LoadedRubric, jobs: int, *, fitting: bool = False
) -> Iterator[Judged]:
    """Every submission's evidence judged again, each as it comes, `jobs` at a time.

    With `fitting`, a recording counts only where the rubric's scenario is still the one that was run.
    What is wrong with one of them is in its `error` and stops no other, not even where it ends the worker.
    """
    left = dict.fromkeys(folders)
    while left:
        begun: list[Path] = []
        work = partial(_judged, rubric, fitting)
        for judged in _until_broken(tuple(left), work, jobs, begun.append):
            del left[judged.folder]
            yield judged
        for suspect in [folder for folder in begun if folder in left]:
            del left[suspect]
            yield from tuple(_until_broken([suspect], work, 1)) or [_ended(suspect)]


def _until_broken(
    folders: Sequence[Path],
    work: Callable[[Path], Judged],
    jobs: int,
    begun: Callable[[Path], None] = lambda _: None,
) -> Iterator[Judged]:
    """Ends early where a worker ends: on one of those that were begun, nobody knows which."""
    count = max(1, min(jobs, len(folders)))
    try:
        with workers(count) as pool:
            yield from side_by_side(pool, work, folders, most=2 * count, begun=begun)
    except BrokenProcessPool:
        return


def _ended(folder: Path) -> Judged:
    hint = "look whether the machine has too little memory, and judge it by itself"
    return Judged(folder=folder, criteria=None, error=f"{folder}: judging it ended the process", hint=hint)


def _judged(rubric: LoadedRubric, fitting: bool, folder: Path) -> Judged:
    """In a worker."""
    with working():
        try:
            runs = load_evidence([folder])
            runs = fitting_runs(rubric.rubric, runs) if fitting else runs
            criteria = judge(rubric.rubric, runs, rubric.checks)
        except GraderError as error:
            return Judged(folder=folder, criteria=None, error=error.message, hint=error.hint)
        except Exception as error:  # noqa: BLE001 - whatever it is, the others are judged
            message = f"{folder}: internal error: {type(error).__name__}: {error}"
            return Judged(folder=folder, criteria=None, error=message, hint="judge it by itself with --debug")
        missing = tuple(name for name in asked_for(rubric.rubric) if name not in runs)
        return Judged(folder=folder, criteria=criteria, missing=missing)


def fitting_runs(rubric: Rubric, runs: Mapping[str, Run]) -> dict[str, Run]:
    """Those that were recorded as the rubric's scenarios say; evidence that does not tell counts as such."""
    digests = {name: scenario.digest for name, scenario in rubric.scenarios.items()}
    return {
        name: run
        for name, run in runs.items()
        if run.metadata.get(SCENARIO, digests.get(name)) == digests.get(name)
    }


def asked_for(rubric: Rubric) -> tuple[str, ...]:
    """The scenarios that criteria judge."""
    return tuple(dict.fromkeys(c.scenario for c in rubric.criteria if c.scenario is not None))


def submissions_in(paths: Sequence[Path]) -> tuple[Path, ...]:
    """The submissions' folders that these paths stand for, where they stand for several submissions; else none.

    A folder of results stands for every submission in it. Raises EvidenceError where something else is among them.
    """
    whole = [path for path in paths if _is_result(path)]
    held = {path: _held(path) for path in paths if path not in whole}
    found = [*whole, *(folder for folders in held.values() for folder in folders)]
    if len(whole) < 2 and len(found) == len(whole):
        return ()
    for path, folders in held.items():
        if not folders:
            message = f"{path}: not the folder of a submission's results, as the others are"
            raise EvidenceError(message, hint="judge it by itself")
    return tuple(dict.fromkeys(found))


def _held(folder: Path) -> list[Path]:
    """The submissions in a folder of results; a folder of recordings is none."""
    try:
        if not folder.is_dir() or _has_recordings(folder):
            return []
        inside = [path for path in sorted(folder.iterdir()) if not path.name.startswith(".")]
        return [path for path in inside if _is_result(path) or _has_recordings(path)]
    except OSError as error:
        raise EvidenceError(f"{folder}: {error.strerror or type(error).__name__}") from error


def _is_result(folder: Path) -> bool:
    """What `grade` leaves of one submission, or its evidence alone."""
    return (folder / RESULT).is_file() or (folder / PACKAGE).is_file() or _has_recordings(folder / EVIDENCE)


def _has_recordings(folder: Path) -> bool:
    return folder.is_dir() and any(path.suffix in SUFFIXES for path in folder.iterdir())
