"""What a person has to look at after a batch, one line each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from grader.classes.batch.folder import BatchFolder
from grader.classes.gradebook import Row
from grader.classes.overrides import FILE as OVERRIDES
from grader.model.batch import MISSING, ROSTER
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.wording import first_few

WHY_OPEN = {
    Status.INCONCLUSIVE: "could not be judged",
    Status.MANUAL: "waits for a person",
    Status.ERROR: "failed",
}
NAMES_SHOWN = 4
GO_ON = {
    "error": "{count} could not be graded; when that is mended: --only failed",
    "inconclusive": "{count} inconclusive; to grade them again: --only inconclusive",
    "manual": "{count} with criteria that a person decides: their points go into {overrides}",
    "missing": "{count} not graded yet: the same command goes on with them",
}


def notable(folder: BatchFolder) -> Iterator[str]:
    """Of each submission that is not graded, why; then how to go on with them."""
    found: Counter[str] = Counter()
    for row in folder.rows():
        state = _state(row)
        found[state] += 1
        if state == "error":
            error = row.result.error
            yield f"{_name(row)}: error: {error.message if error else _open(row)}"
        elif state == "inconclusive":
            yield f"{_name(row)}: inconclusive: {_open(row)}"
        for override in row.result.overrides:
            if override.changed:
                yield f"{row.entry.id}: {override.criterion}: a person decided, and the check says something else now"
    for state, words in GO_ON.items():
        if found[state]:
            yield words.format(count=found[state], overrides=folder.path / OVERRIDES)


def _name(row: Row) -> str:
    """The id, and the line of the roster where the error does not name it already."""
    error = row.result.error
    told = error is not None and error.kind == ROSTER
    return row.entry.id if told or not row.entry.where else f"{row.entry.id} ({row.entry.where})"


def _state(row: Row) -> str:
    """The result's status, told apart further: nothing there yet, and only people's criteria open."""
    result = row.result
    if result.error is not None and result.error.kind == MISSING:
        return "missing"
    if result.status == "inconclusive" and {c.status for c in _waiting(row)} == {Status.MANUAL}:
        return "manual"
    return result.status


def _waiting(row: Row) -> tuple[CriterionResult, ...]:
    return tuple(c for c in row.result.criteria if c.status.is_open and c.max_points > 0)


def _open(row: Row) -> str:
    names = [f"{c.id} ({WHY_OPEN[c.status]})" for c in _waiting(row)]
    return first_few(names, NAMES_SHOWN)
