"""`python -m grader.integrations.autograde PLATFORM FOLDER`: grade an upload in a platform's container.

The scripts of an exported grader run it (`integrations/files`). Whatever goes wrong, the student gets an answer.
"""

from __future__ import annotations

import signal
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from types import FrameType

from grader import pipeline
from grader.errors import GraderError, InternalError, SubmissionError
from grader.faults import fault_of
from grader.files import atomic_write, make_folder
from grader.intake.source import Source, parse_source
from grader.integrations.platform_exports import (
    GRADESCOPE,
    PRAIRIELEARN,
    BundleSettings,
    ContainerLayout,
    LostModes,
    read_settings,
)
from grader.model.result import GradingResult, Silence
from grader.report.terminal import Terminal, open_console
from grader.report.text import json_text, line
from grader.results import read_result
from grader.rubric.load import LoadedRubric, load_rubric

PLATFORMS = {"gradescope": GRADESCOPE, "prairielearn": PRAIRIELEARN}
LIMIT = 1000
ID = "submission"
REPORTS = "grader"
"""The folder beside results.json with all reports and the evidence."""
ARCHIVES = (
    ".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2", ".tar.xz", ".txz", ".bag", ".mcap", ".db3",
)  # fmt: skip
LEFT_BEHIND = ("__MACOSX", ".DS_Store", "Thumbs.db")
"""What operating systems add to the files that they pack."""
TOO_LONG = "grading was stopped: it took longer than the {minutes} minutes allowed"
AGAIN = "your teachers can see why; submit again, or ask them to grade it again"


def main() -> int:
    """Return 0 if something was graded, 3 if results.json says that nothing was."""
    # so that the student gets an answer when the container is stopped
    signal.signal(signal.SIGTERM, _interrupt)
    warnings.simplefilter("ignore")  # Python's warnings about a student's code are of no use here
    platform, folder = sys.argv[1:]
    return 0 if grade_upload(PLATFORMS[platform], Path(folder)) else 3


def grade_upload(platform: ContainerLayout, root: Path) -> bool:
    """Grade the upload in the container's folder `root` and write results/results.json. Return False if that says
    that nothing was graded."""
    lab, results = root / platform.lab, root / "results"
    try:
        make_folder(results, public=True)  # like results.json in it, but unlike the reports
        settings = read_settings(lab)
        try:
            result, rubric = _grade(lab, root / platform.upload, results, settings)
        except KeyboardInterrupt:
            raise InternalError(TOO_LONG.format(minutes=settings.minutes), hint=AGAIN) from None
        document = platform.graded(result, rubric)
    except Exception as error:  # noqa: BLE001 - a student who gets no answer is worse off than with any
        fault = fault_of(error)
        _write(results, platform.not_graded(fault))
        print(f"NOT GRADED: {line(fault.message, LIMIT)}\n{line(fault.hint, LIMIT)}")
        return False
    _write(results, document)
    Terminal(open_console(sys.stdout)).report(result, rubric.rubric)
    return True


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _write(results: Path, document: dict[str, object]) -> None:
    """Write results.json as readable as the umask says: the platform may read it as another user than the grader's."""
    atomic_write(results / "results.json", json_text(document).encode(), public=True)


def _grade(
    lab: Path, folder: Path, results: Path, settings: BundleSettings
) -> tuple[GradingResult, LoadedRubric]:
    """Return the result, even if it says that the submission cannot be graded."""
    rubric = load_rubric(str(lab / settings.rubric))
    out = results / REPORTS
    options = pipeline.GradeOptions(sandbox=settings.sandbox, submission_id=ID, package=settings.package)
    try:
        source = find_upload(folder, settings.modes)
        return pipeline.grade(source, rubric, out, options, Silence()), rubric
    except GraderError as error:
        if error.blame != "submission":
            raise
        result = read_result(out / ID)
        if result is None:
            raise
        return result, rubric


def find_upload(folder: Path, modes: LostModes) -> Source:
    """Return the folder that was uploaded, or the only archive or recording in it if there is no folder beside it.

    A folder may have lost its file modes on the way; an archive keeps them if it carries any. Raises SubmissionError
    if nothing was uploaded.
    """
    entries = _entries(folder)
    if not entries:
        raise SubmissionError(
            "nothing was submitted", hint="submit the folder of your package, as a .zip or .tar.gz"
        )
    files = [path for path in entries if path.is_file() and not path.is_symlink()]
    archives = [path for path in files if path.name.lower().endswith(ARCHIVES)]
    folders = [path for path in entries if path.is_dir()]
    # with anything beside it, the archive belongs to the package and is not the package
    single = len(archives) == 1 and not folders and not (folder / "package.xml").exists()
    chosen = archives[0] if single else folder
    source = parse_source(str(chosen))
    return replace(source, given=chosen.name if single else "what was submitted", modes=modes)


def _entries(folder: Path) -> list[Path]:
    try:
        found = sorted(folder.iterdir())
    except OSError as error:
        raise SubmissionError(f"{folder} cannot be read: {error.strerror}", hint="submit again") from error
    return [path for path in found if path.name not in LEFT_BEHIND]


if __name__ == "__main__":
    sys.exit(main())
