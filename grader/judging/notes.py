"""What was noticed while student code ran, and costs no points: what it was refused, what it had too much of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from grader.evidence.run import Run
from grader.model.result import Note
from grader.untrusted_text import clip

KINDS = ("refused", "limit")
NOTES_MAX = 20
TEXT_CHARS = 300
ACTOR_CHARS = 100


def notes_of(runs: Mapping[str, Run]) -> tuple[Note, ...]:
    """The notes of all runs, in the order of the runs and of time; equal ones once, at most 20 of each kind a run.

    What was left out is counted in a last note. Recordings of other tools have none: nobody watched.
    """
    return tuple(
        note
        for scenario, run in runs.items()
        if not run.foreign
        for kind in KINDS
        for note in _bounded(scenario, kind, tuple(dict.fromkeys(_notes(scenario, kind, run))))
    )


def _notes(scenario: str, kind: str, run: Run) -> Iterator[Note]:
    for _, event in run.actors:
        if event.action == kind:
            actor, text = clip(event.actor, ACTOR_CHARS), clip(event.detail, TEXT_CHARS)
            yield Note.model_validate({"scenario": scenario, "actor": actor, "kind": kind, "text": text})


def _bounded(scenario: str, kind: str, notes: tuple[Note, ...]) -> Iterator[Note]:
    yield from notes[:NOTES_MAX]
    left = len(notes) - NOTES_MAX
    if left > 0:
        text = f"and {left} more of this kind"
        yield Note.model_validate({"scenario": scenario, "actor": "", "kind": kind, "text": text})
