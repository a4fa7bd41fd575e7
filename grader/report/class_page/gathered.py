"""All submissions of a class, read one by one and kept as the page needs them, with names or without."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from grader.model.batch import BatchRun, Entry
from grader.model.result import GradingResult
from grader.report.class_page.anonymous import Names, order, pseudonyms, without_words
from grader.report.class_page.diagnoses import Diagnoses
from grader.report.class_page.lines import Line, line_of


@dataclass(frozen=True, kw_only=True)
class Shared:
    """A diagnosis: `message` as most have it, `wordings` with how often each was said (`more` where there are others).

    `members` are places of submissions. `criterion` is an id, empty for what could not be graded.
    """

    criterion: str
    message: str
    wordings: Sequence[tuple[str, int]]
    more: bool = False
    members: Sequence[int]


@dataclass(frozen=True, kw_only=True)
class Gathered:
    """Submissions in the order in which the page shows them, and diagnoses, most members first."""

    lines: Sequence[Line]
    diagnoses: Sequence[Shared]


def gather(run: BatchRun, rows: Iterable[tuple[Entry, GradingResult]]) -> Gathered:
    """In the roster's order, by name."""
    lines, diagnoses = [], Diagnoses()
    for place, (entry, result) in enumerate(rows):
        lines.append(line_of(entry, result, run.criteria))
        diagnoses.add(place, result)
    shared = [
        Shared(
            criterion=found.criterion,
            message=found.message,
            wordings=found.wordings.most_common(),
            more=found.more,
            members=found.members,
        )
        for found in diagnoses.largest_first()
    ]
    return Gathered(lines=lines, diagnoses=shared)


def gather_anonymous(run: BatchRun, rows: Iterable[tuple[Entry, GradingResult]], salt: bytes) -> Gathered:
    """By pseudonyms, in an order that depends on `salt`; nothing in it tells who anybody is."""
    names, ids = Names(), []

    def read() -> Iterable[tuple[Entry, GradingResult]]:
        for entry, result in rows:
            names.add(entry, result.submission.commit)
            ids.append(entry.id)
            yield entry, result

    named = gather(run, read())
    words = names.told()
    shuffled = order(ids, salt)
    now = {before: place for place, before in enumerate(shuffled)}
    lines = [
        _unnamed(named.lines[before], pseudonym, words)
        for pseudonym, before in zip(pseudonyms(ids), shuffled, strict=True)
    ]
    diagnoses = [
        Shared(
            criterion=found.criterion,
            message=without_words(found.message, words),
            wordings=(),
            members=sorted(now[member] for member in found.members),
        )
        for found in named.diagnoses
    ]
    return Gathered(lines=lines, diagnoses=diagnoses)


def _unnamed(line: Line, pseudonym: str, words: frozenset[str]) -> Line:
    problem = line.problem
    if problem is not None:
        problem = replace(problem, message=without_words(problem.message, words), hint="")
    why = without_words(line.why, words)
    return replace(line, id=pseudonym, name="", group="", folder="", why=why, problem=problem)
