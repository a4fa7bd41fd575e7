"""Whose submission a file is, by the names that Moodle and Canvas give in their bulk downloads.

Moodle: `Full Name_1234567_assignsubmission_file` (a folder), or that with `_lab1.zip` behind it (a file); with
`onlinetext` where text was handed in; `Participant 1234567` or `Participant_1234567` where names are hidden.
Of a team it is the team's name and number. Canvas: `lastnamefirstname_LATE_12345_67890_lab1.zip`, `LATE_` where it was;
`LATE_anon_x7Yz2_67890_lab1.zip` where names are hidden; `…_12345_text.html` and `…_12345_link.html` for no files.
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
    r"(?P<name>[\w-]+?)_(?P<late>LATE_)?(?P<id>\d+)_(?:\d+_(?P<file>.+)|(?P<text>text|link)\.html)", re.DOTALL
)
CANVAS_BLIND = re.compile(
    r"(?P<late>LATE_)?(?P<name>anon)_(?P<id>[A-Za-z0-9]{5})_(?:\d+_(?P<file>.+)|(?P<text>text|link)\.html)",
    re.DOTALL,
)
BLIND = {"Participant", "Teilnehmer", "Teilnehmerin", "Participante", "Partecipante"}


class Named(NamedTuple):
    """`id` is the platform's number for the student (Canvas) or the submission (Moodle); `file` as handed in.

    `is_blind`: the platform hides who it is; Canvas has other ids then.
    """

    platform: str
    id: str
    name: str
    file: str
    late: bool = False
    is_text: bool = False
    is_blind: bool = False


def platform_name(name: str) -> Named | None:
    """What a file's or folder's name says; None where no platform made it."""
    if found := MOODLE.fullmatch(name) or MOODLE_BLIND.fullmatch(name):
        is_text = found["kind"] == "onlinetext"
        blind = found["name"] in BLIND
        return Named(
            "Moodle", found["id"], found["name"], found["file"] or "", is_text=is_text, is_blind=blind
        )
    blind_canvas = CANVAS_BLIND.fullmatch(name)
    if found := blind_canvas or CANVAS.fullmatch(name):
        return Named(
            "Canvas",
            found["id"],
            found["name"],
            found["file"] or "",
            late=bool(found["late"]),
            is_text=bool(found["text"]),
            is_blind=blind_canvas is not None,
        )
    return None
