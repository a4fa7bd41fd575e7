"""What the options of `grader batch` come to: folders, times, jobs and an executor; and the exit code of a batch."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from grader.classes.batch.folder import open_batch
from grader.classes.batch.job import Executor, LocalExecutor
from grader.classes.batch.run import BatchOptions, run_batch
from grader.classes.course.labs import with_late_days
from grader.classes.roster import Local, Roster
from grader.classes.roster.entries import parse_time
from grader.cli.class_display import open_class_display, print_batch
from grader.cli.host_support import require_room, warn_without_sandbox
from grader.cli.output import say_beside
from grader.errors import ExitCode, GraderError, UsageError
from grader.model.batch import BatchRun
from grader.portable import cores
from grader.rubric.course import load_course, split_name
from grader.rubric.load import PIN, LoadedRubric, needs_ros, split_pin
from grader.untrusted_text import line

JOBS_PER_CORE = 4
"""Most of a grading's time is spent waiting for what the student's nodes send."""


def grade_class(
    roster: Roster,
    rubric: str,
    loaded: LoadedRubric,
    options: BatchOptions,
    exchange: str | None,
    *,
    as_json: bool,
) -> ExitCode:
    """Grade a class by the value of `--rubric`, print what came of it, and return the exit code."""
    if of_course := split_name(split_pin(rubric)[0]):
        roster = with_late_days(roster, load_course(of_course[0]), of_course[1])
    if needs_ros(loaded) and not (options.static_only or options.cluster):
        require_room(gradings=options.jobs)
        warn_without_sandbox(options.sandbox, loaded)
    for fault in roster.faults:
        say_beside(f"roster: {fault}")
    with open_class_display() as watcher:
        chosen = executor(options, exchange)
        try:
            folder = run_batch(
                roster, rubric_source(rubric), loaded, options, executor=chosen, watcher=watcher
            )
        except KeyboardInterrupt:
            _say_interrupted(options.out)
            raise
    print_batch(folder, as_json=as_json)
    return exit_code(folder.run)


def _say_interrupted(out: Path) -> None:
    with suppress(GraderError):
        counts = open_batch(out).run.counts
        done = counts.submissions - counts.missing
        say_beside(f"{done} of {counts.submissions} done; the same command continues")


def rubric_source(rubric: str) -> str:
    """Return the value of `--rubric` so that it is found again from any folder."""
    name, pin = split_pin(rubric)
    of_course = split_name(name)
    path = of_course[0] if of_course else Path(name)
    if not path.is_file():
        return rubric
    return f"{path.absolute()}{f'#{of_course[1]}' if of_course else ''}{PIN if pin else ''}{pin}"


def exit_code(run: BatchRun) -> ExitCode:
    """Return the exit code of the worst submission."""
    counts = run.counts
    if counts.error or counts.missing:
        return ExitCode.NOT_GRADED
    if counts.inconclusive:
        return ExitCode.INCONCLUSIVE
    return ExitCode.PASSED if counts.passed == counts.submissions else ExitCode.BELOW_PASS_MARK


def default_jobs(rubric: LoadedRubric, *, static: bool) -> int:
    """Return how many submissions are graded at a time."""
    return cores() if static or not rubric.rubric.scenarios else cores() * JOBS_PER_CORE


def parse_before(text: str | None) -> datetime | None:
    """Parse the value of `--before`. Raises UsageError."""
    if text is None:
        return None
    found = parse_time(text)
    if found is None:
        raise UsageError(
            f"--before {line(text, 80)} is not a time", hint="write it like 2026-11-20T23:59:00+01:00"
        )
    return found


def allowed_folders(folders: Sequence[Path], *, remote_only: bool) -> Local:
    """Return which paths of this machine a roster may name. Raises UsageError."""
    if folders and remote_only:
        raise UsageError("--remote-only forbids what --allow-local allows", hint="leave out one of them")
    for folder in folders:
        if not folder.is_dir():
            raise UsageError(f"--allow-local {folder}: there is no such folder", hint="give a folder")
    return Local(folders=tuple(folder.absolute() for folder in folders), remote_only=remote_only)


def with_package(roster: Roster, package: str) -> Roster:
    """Return the roster with `package` in every row that names none."""
    entries = (e if e.package else e.model_copy(update={"package": package}) for e in roster.entries)
    return roster.model_copy(update={"entries": tuple(entries)})


def executor(options: BatchOptions, exchange: str | None) -> Executor:
    """Return the processes of this machine, or the cluster. Raises UsageError."""
    if not options.cluster:
        given = {"--exchange": exchange is not None, "--cluster-insecure": options.cluster_insecure}
        for flag in (name for name, there in given.items() if there):
            raise UsageError(f"{flag} goes with --cluster", hint="leave it out")
        return LocalExecutor(options.jobs)
    from grader.classes.cluster import ClusterExecutor  # noqa: PLC0415 - an extra

    return ClusterExecutor(
        options.cluster,
        options.out,
        exchange,
        insecure=options.cluster_insecure,
        say=lambda text: say_beside(f"cluster: {text}"),
    )
