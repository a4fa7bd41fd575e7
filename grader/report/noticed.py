"""What was noticed while it ran, in the words of the reports."""

from __future__ import annotations

from grader.model.result import Note

NOTICED_TITLE = "Noticed while it ran"
COSTS_NOTHING = "No points were taken for any of this."


def note_place(note: Note) -> str:
    """`build`, or the scenario's name; with the process or node, where it is known."""
    run = "build" if note.scenario == "package" else note.scenario
    return f"{run}, {note.actor}" if note.actor else run


def note_text(note: Note) -> str:
    """`asked the master to shut down (refused)`."""
    return f"{note.text} ({'refused' if note.kind == 'refused' else 'limited'})"
