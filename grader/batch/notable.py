"""What a person has to look at after a batch, one line each."""

from __future__ import annotations

from collections.abc import Iterator

from grader.batch.folder import MISSING, BatchFolder
from grader.gradebook import Row
from grader.model.verdict import Status

OPEN = {Status.INCONCLUSIVE: "could not be judged", Status.MANUAL: "waits for a person", Status.ERROR: "failed"}
NAMES_SHOWN = 4


def notable(folder: BatchFolder) -> Iterator[str]:
    """Of each submission that is not graded, why; then how to go on with them."""
    failed = inconclusive = missing = manual = 0
    for row in folder.rows():
        error = row.result.error
        if error is not None and error.kind == MISSING:
            missing += 1
        elif row.result.status == "error":
            failed += 1
            yield f"{row.entry.id}: error: {error.message if error else _open(row)}"
        elif row.result.status == "inconclusive":
            only_manual = {c.status for c in row.result.criteria if c.status in OPEN and c.max_points} == {Status.MANUAL}
            manual += only_manual
            inconclusive += not only_manual
            if not only_manual:
                yield f"{row.entry.id}: inconclusive: {_open(row)}"
        for override in row.result.overrides:
            if override.changed:
                yield f"{row.entry.id}: {override.criterion} was decided by a person, and the check says something else now"
    if failed:
        yield f"{failed} to be graded again when that is mended: --only failed"
    if inconclusive:
        yield f"{inconclusive} to be graded again: --only inconclusive"
    if manual:
        yield f"{manual} with criteria that a person decides: write their points into {folder.path / 'overrides.yaml'}"
    if missing:
        yield f"{missing} not graded yet: the same command goes on with them"


def _open(row: Row) -> str:
    names = [f"{c.id} ({OPEN[c.status]})" for c in row.result.criteria if c.status in OPEN and c.max_points]
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    return ", ".join(names[:NAMES_SHOWN]) + more
