"""`grader regrade DIR [--rubric ID|FILE]`: a class judged again from its evidence; nothing is run, no ROS needed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from grader.classes.batch.executor import Processes
from grader.classes.batch.flow import GRADEBOOK
from grader.classes.batch.folder import BatchFolder, open_batch
from grader.classes.batch.regrade import CHANGES, Change, Regraded, regrade, run_missing
from grader.cli.class_display import open_class_display
from grader.cli.commands.batch import JOBS_PER_CORE, exit_code, rubric_source
from grader.cli.output import say, say_json
from grader.cli.host_support import say_unwalled
from grader.errors import ExitCode
from grader.portable import cores
from grader.report.text import number
from grader.rubric.load import load_rubric

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode

NAMES_SHOWN = 10
CHANGES_SHOWN = 200


def run(
    *,
    folder: Path,
    rubric: str | None = None,
    run_missing_too: bool = False,
    jobs: int | None = None,
    sandbox: Mode = "auto",
    as_json: bool = False,
) -> ExitCode:
    """Judge every submission again and show what changed; with `run_missing_too`, run what was not recorded."""
    batch = open_batch(folder)
    source = rubric or batch.run.rubric_source
    loaded = load_rubric(source)
    own = cores()
    batch, regraded = regrade(batch, loaded, rubric_source(source), jobs or own)
    missing = [one for one in regraded if one.missing]
    if missing and run_missing_too:
        say_unwalled(sandbox, loaded)
        with open_class_display() as watcher:
            hands = Processes(jobs or own * JOBS_PER_CORE)
            batch, regraded = run_missing(
                batch, loaded, regraded, hands=hands, watcher=watcher, sandbox=sandbox
            )
    if as_json:
        say_json([_data(one) for one in regraded])
    else:
        for text in _told(batch, regraded):
            say(text)
    return exit_code(batch.run)


def _data(one: Regraded) -> dict[str, object]:
    return {
        "id": one.entry.id,
        "points_before": one.before.points if one.before else None,
        "points": one.after.points if one.after else None,
        "missing": list(one.missing),
        "error": one.error,
        "changes": [
            {
                "criterion": change.criterion,
                "before": _state(change, "before"),
                "after": _state(change, "after"),
                "why": change.why,
            }
            for change in one.changes
        ],
    }


def _state(change: Change, which: str) -> dict[str, object] | None:
    criterion = change.before if which == "before" else change.after
    return {"status": criterion.status.value, "points": criterion.points} if criterion else None


def _told(batch: BatchFolder, regraded: Sequence[Regraded]) -> Iterator[str]:
    shown = 0
    for one in regraded:
        if not one.changes or one.before is None or one.after is None:
            continue
        yield f"{one.entry.id}: {number(one.before.points)} -> {number(one.after.points)}"
        for change in one.changes:
            shown += 1
            if shown <= CHANGES_SHOWN:
                yield f"    {change.criterion}: {_words(change, 'before')} -> {_words(change, 'after')}: {change.why}"
    if shown > CHANGES_SHOWN:
        yield f"{shown - CHANGES_SHOWN} more changes: {batch.path / CHANGES}"
    for one in regraded:
        if one.error:
            yield f"{one.entry.id}: stays as it was: {one.error}"
    missing = [one for one in regraded if one.missing]
    if missing:
        names = ", ".join(one.entry.id for one in missing[:NAMES_SHOWN])
        more = f" and {len(missing) - NAMES_SHOWN} more" if len(missing) > NAMES_SHOWN else ""
        scenarios = ", ".join(dict.fromkeys(name for one in missing for name in one.missing))
        yield f"{len(missing)} must run again, there is no recording of {scenarios}: {names}{more}"
        yield "  hint: --run-missing runs them"
    changed = sum(bool(one.changes) for one in regraded)
    judged = sum(one.after is not None for one in regraded)
    yield f"{judged} of {len(regraded)} judged again, {changed} changed"
    yield f"{batch.path / GRADEBOOK}  {batch.path / CHANGES}"


def _words(change: Change, which: str) -> str:
    criterion = change.before if which == "before" else change.after
    return f"{criterion.status.value} {number(criterion.points)}" if criterion else "-"
