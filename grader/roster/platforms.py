"""Whose submission a file is, by the names that Moodle and Canvas give in their bulk downloads.

Moodle: `Full Name_1234567_assignsubmission_file` (a folder), or that with `_lab1.zip` behind it (a file); with
`onlinetext` where text was handed in; `Participant 1234567` or `Participant_1234567` where names are hidden.
Canvas: `lastnamefirstname_LATE_12345_67890_lab1.zip`, `LATE_` where it was.
"""

from __future__ import annotations

import re
from typing import NamedTuple

MOODLE = re.compile(
    r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_(?P<kind>file|onlinetext)(?:_(?P<file>.*))?", re.DOTALL
)
MOODLE_BLIND = re.compile(
    r"(?P<name>\w+) (?P<id>\d+)_assignsubmission_(?P<kind>file|onlinetext)(?:_(?P<file>.*))?", re.DOTALL
)
CANVAS = re.compile(
    r"(?P<name>[^_\W]+(?:-[^_\W]+)*)_(?P<late>LATE_)?(?P<id>\d+)_(?P<attempt>\d+)_(?P<file>.+)", re.DOTALL
)
BLIND = {"Participant", "Teilnehmer/in", "Teilnehmer", "Participante", "Partecipante"}


class Named(NamedTuple):
    """`id` is the platform's number for the student (Canvas) or the submission (Moodle); `file` as handed in."""

    platform: str
    id: str
    name: str
    file: str
    late: bool = False
    is_text: bool = False

    @property
    def is_blind(self) -> bool:
        """Whether the platform hides who it is."""
        return self.platform == "Moodle" and self.name in BLIND


def platform_name(name: str) -> Named | None:
    """What a file's or folder's name says; None where no platform made it."""
    if found := MOODLE.fullmatch(name) or MOODLE_BLIND.fullmatch(name):
        is_text = found["kind"] == "onlinetext"
        return Named("Moodle", found["id"], found["name"], found["file"] or "", is_text=is_text)
    if found := CANVAS.fullmatch(name):
        return Named("Canvas", found["id"], found["name"], found["file"], bool(found["late"]))
    return None
