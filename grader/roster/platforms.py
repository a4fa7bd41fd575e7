"""Whose submission a file is, by the names that Moodle and Canvas give in their bulk downloads.

Moodle: `Full Name_1234567_assignsubmission_file` (a folder), or that with `_lab1.zip` behind it (a file); with
`onlinetext` where text was handed in. Canvas: `lastnamefirstname_LATE_12345_67890_lab1.zip`, `LATE_` where it was.
"""

from __future__ import annotations

import re
from typing import NamedTuple

MOODLE = re.compile(
    r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_(?P<kind>file|onlinetext)(?:_(?P<file>.*))?", re.DOTALL
)
CANVAS = re.compile(
    r"(?P<name>[^_\W]+(?:-[^_\W]+)*)_(?P<late>LATE_)?(?P<id>\d+)_(?P<attempt>\d+)_(?P<file>.+)", re.DOTALL
)


class Named(NamedTuple):
    """`id` is the platform's number for the student (Canvas) or the submission (Moodle); `file` as handed in."""

    platform: str
    id: str
    name: str
    file: str
    late: bool = False


def platform_name(name: str) -> Named | None:
    """What a file's or folder's name says; None where no platform made it."""
    if found := MOODLE.fullmatch(name):
        return Named("Moodle", found["id"], found["name"], found["file"] or "")
    if found := CANVAS.fullmatch(name):
        return Named("Canvas", found["id"], found["name"], found["file"], bool(found["late"]))
    return None
