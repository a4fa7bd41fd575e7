"""Rosters made in a test."""

from __future__ import annotations

from pathlib import Path

from grader.classes.roster import Local, read_roster
from grader.classes.roster.entries import OWN_FOLDER
from grader.model.batch import Roster


def roster_file(folder: Path, text: str | bytes, encoding: str = "utf-8") -> Path:
    path = folder / "roster.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return path


def read(folder: Path, text: str | bytes, local: Local = OWN_FOLDER) -> Roster:
    return read_roster(roster_file(folder, text), local)


def said(roster: Roster) -> list[str]:
    return [str(fault) for fault in roster.faults]


def ids(roster: Roster) -> list[str]:
    return [entry.id for entry in roster.entries]
