"""Grading inside of a platform's container. Whatever goes wrong, there is something to say to the student."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from grader import pipeline
from grader.errors import GraderError, InternalError
from grader.faults import fault_of
from grader.files import atomic_write, make_folder
from grader.integrations.bundle import Settings, read_settings
from grader.model.progress import Silence
from grader.model.result import GradingResult
from grader.report.terminal import open_console, print_report
from grader.report.text import json_text, line
from grader.results import read_result
from grader.rubric.load import LoadedRubric, load_rubric
from dataclasses import replace
from grader.errors import SubmissionError
from grader.intake.source import Source, parse_source
from grader.integrations.bundle import Modes


LIMIT = 1000
ID = "submission"
REPORTS = "grader"
"""The folder beside results.json with all reports and the evidence."""
TOO_LONG = "grading was stopped, for it took longer than the {minutes} minutes that there are for it"
AGAIN = "your teachers can see why; hand it in again, or ask them to grade it again"


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where things are in a container: `lab` with the settings, what was `handed_in`, and the folder of `results`."""

    lab: Path
    handed_in: Path
    results: Path


@dataclass(frozen=True, kw_only=True)
class Form:
    """How a platform wants to be told: of a result, and that there is none and why. Each gives a JSON document."""

    graded: Callable[[GradingResult, LoadedRubric], dict[str, object]]
    not_graded: Callable[[GraderError], dict[str, object]]


def deliver(place: Place, form: Form) -> bool:
    """Grade what was handed in and write `results.json`; False where that says that nothing was graded."""
    try:
        make_folder(place.results, public=True)  # as its `results.json`, but for the reports in it
        settings = read_settings(place.lab)
        try:
            result, rubric = _grade(place, settings)
        except KeyboardInterrupt:
            raise InternalError(TOO_LONG.format(minutes=settings.minutes), hint=AGAIN) from None
        document = form.graded(result, rubric)
    except Exception as error:  # noqa: BLE001 - a student who gets no answer is worse off than with any
        fault = fault_of(error)
        _write(place, form.not_graded(fault))
        print(f"NOT GRADED: {line(fault.message, LIMIT)}\n{line(fault.hint, LIMIT)}")
        return False
    _write(place, document)
    print_report(result, rubric.rubric, open_console(sys.stdout))
    return True


def _write(place: Place, document: dict[str, object]) -> None:
    """As the umask has it: the platform may read it as another user than it grades as."""
    atomic_write(place.results / "results.json", json_text(document).encode(), public=True)


def _grade(place: Place, settings: Settings) -> tuple[GradingResult, LoadedRubric]:
    """The result, also where it says that what was handed in cannot be graded."""
    rubric = load_rubric(str(place.lab / settings.rubric))
    out = place.results / REPORTS
    options = pipeline.GradeOptions(sandbox=settings.sandbox, submission_id=ID)
    try:
        source = upload(place.handed_in, settings.modes)
        return pipeline.grade(source, rubric, out, options, Silence()), rubric
    except GraderError as error:
        if error.blame != "submission":
            raise
        result = read_result(out / ID)
        if result is None:
            raise
        return result, rubric


# [integrations.deliver.upload] What a student handed in on a platform that takes uploads: a folder of files, or one archive in it.

ARCHIVES = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2", ".tar.xz", ".txz", ".bag", ".mcap")
LEFT_BEHIND = ("__MACOSX", ".DS_Store", "Thumbs.db")
"""What systems put beside files that they pack."""


def upload(folder: Path, modes: Modes) -> Source:
    """The folder, or the archive or recording in it where there is one and no folder beside it.

    A folder has lost its file modes on the way, as far as anybody can tell; an archive in it kept them, if it carries
    any. Raises SubmissionError where nothing was handed in.
    """
    entries = _entries(folder)
    if not entries:
        raise SubmissionError(
            "nothing was handed in", hint="hand in the folder of your package, as a .zip or .tar.gz"
        )
    files = [path for path in entries if path.is_file() and not path.is_symlink()]
    archives = [path for path in files if path.name.lower().endswith(ARCHIVES)]
    folders = [path for path in entries if path.is_dir()]
    single = len(archives) == 1 and not folders and not (folder / "package.xml").exists()
    chosen = archives[0] if single else folder
    source = parse_source(str(chosen))
    return replace(source, given=chosen.name if single else "what was handed in", modes=modes)


def _entries(folder: Path) -> list[Path]:
    try:
        found = sorted(folder.iterdir())
    except OSError as error:
        raise SubmissionError(
            f"{folder} cannot be read: {error.strerror}", hint="hand it in again"
        ) from error
    return [path for path in found if path.name not in LEFT_BEHIND]
