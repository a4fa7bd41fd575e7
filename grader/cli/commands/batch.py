"""`grader batch ROSTER|FOLDER --rubric ID|FILE [--out DIR]`."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from grader.classes.batch.executor import Hands, Processes
from grader.classes.batch.flow import GRADEBOOK, INDEX, RESULTS, BatchOptions, run_batch
from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.needs_attention import notable
from grader.classes.roster import Local, read_roster
from grader.classes.roster.times import parse_time
from grader.cli.class_display import open_class_display
from grader.cli.inherited_limits import make_room
from grader.cli.output import say, say_beside, say_json
from grader.cli.host_support import say_unwalled
from grader.errors import ExitCode, UsageError
from grader.model.batch import BatchRun
from grader.portable import cores
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.needs import needs_ros
from grader.shown import line

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode

DEFAULT_OUT = Path("grader-results")
JOBS_PER_CORE = 4
"""Most of a grading's time is spent in waiting for what the student's nodes send."""


def run(
    *,
    roster: Path,
    rubric: str,
    out: Path | None = None,
    jobs: int | None = None,
    only: list[str] | None = None,
    before: str | None = None,
    static: bool = False,
    sandbox: Mode = "auto",
    cluster: str | None = None,
    cluster_insecure: bool = False,
    exchange: str | None = None,
    allow_local: list[Path] | None = None,
    remote_only: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Grade a class into `out/<id>/`, with a gradebook, and go on where an earlier batch stopped."""
    loaded = load_rubric(rubric)
    local = _local(allow_local or [], remote_only=remote_only)
    named = read_roster(roster, local)
    options = BatchOptions(
        out=out or DEFAULT_OUT,
        jobs=jobs or _jobs(loaded, static=static),
        sandbox=sandbox,
        static_only=static,
        before=_time(before),
        only=only or (),
        cluster=cluster or "",
        cluster_insecure=cluster_insecure,
        allow_local=tuple(str(folder) for folder in local.folders),
        remote_only=remote_only,
    )
    if needs_ros(loaded) and not (static or cluster):
        make_room(gradings=options.jobs)
        say_unwalled(sandbox, loaded)
    for fault in named.faults:
        say_beside(f"roster: {fault}")
    with open_class_display() as watcher:
        hands = _hands(options, exchange)
        folder = run_batch(named, rubric_source(rubric), loaded, options, hands=hands, watcher=watcher)
    _show(folder, as_json=as_json)
    return exit_code(folder.run)


def rubric_source(rubric: str) -> str:
    """What `--rubric` said, so that it is found again from any folder."""
    path = Path(rubric)
    return str(path.absolute()) if path.is_file() else rubric


def exit_code(run: BatchRun) -> ExitCode:
    """Of the worst that is there."""
    counts = run.counts
    if counts.error or counts.missing:
        return ExitCode.NOT_GRADED
    if counts.inconclusive:
        return ExitCode.INCONCLUSIVE
    return ExitCode.PASSED if counts.passed == counts.submissions else ExitCode.BELOW_PASS_MARK


def _jobs(rubric: LoadedRubric, *, static: bool) -> int:
    return cores() if static or not rubric.rubric.scenarios else cores() * JOBS_PER_CORE


def _time(text: str | None) -> datetime | None:
    if text is None:
        return None
    found = parse_time(text)
    if found is None:
        raise UsageError(f"--before {line(text, 80)} is no time", hint="such as 2026-11-20T23:59:00+01:00")
    return found


def _local(folders: list[Path], *, remote_only: bool) -> Local:
    if folders and remote_only:
        raise UsageError("--remote-only refuses what --allow-local allows", hint="leave one of them out")
    for folder in folders:
        if not folder.is_dir():
            raise UsageError(f"--allow-local {folder}: there is no such folder", hint="give a folder")
    return Local(folders=tuple(folder.absolute() for folder in folders), remote_only=remote_only)


def _hands(options: BatchOptions, exchange: str | None) -> Hands:
    if not options.cluster:
        given = {"--exchange": exchange is not None, "--cluster-insecure": options.cluster_insecure}
        for flag in (name for name, there in given.items() if there):
            raise UsageError(f"{flag} is for --cluster", hint="leave it out")
        return Processes(options.jobs)
    from grader.classes.cluster import ClusterHands  # noqa: PLC0415 - an extra

    return ClusterHands(
        options.cluster,
        options.out,
        exchange,
        insecure=options.cluster_insecure,
        say=lambda text: say_beside(f"cluster: {text}"),
    )


def _show(folder: BatchFolder, *, as_json: bool) -> None:
    if as_json:
        say_json(folder.run.model_dump(mode="json", by_alias=True, exclude={"entries"}))
        return
    for text in notable(folder):
        say(text)
    counts = folder.run.counts
    parts = [f"{counts.submissions} submissions", f"{counts.graded} graded ({counts.passed} passed)"]
    parts += [f"{counts.inconclusive} inconclusive"] if counts.inconclusive else []
    parts += [f"{counts.error} could not be graded"] if counts.error else []
    parts += [f"{counts.missing} not graded yet"] if counts.missing else []
    parts += [f"{counts.kept} complete before"] if counts.kept else []
    say(", ".join(parts))
    say(f"{folder.path / INDEX}  {folder.path / GRADEBOOK}  {folder.path / RESULTS}")
