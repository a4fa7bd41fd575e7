"""A folder, an archive or a git URL becomes a folder on disk with the lab's package in it; nothing is run.

SOURCE as it stands on the command line comes in, `model.submission.Submission` goes out. Everything hostile about a
source is dealt with here: its size, its names, its links, its git settings. Reading the files is the job of
`package/`.

Names are loaded when they are first asked for: the child that unpacks an archive needs little of this.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grader.intake.credentials import without_password
    from grader.intake.find import enclosing_package, find_packages
    from grader.intake.limits import IntakeLimits
    from grader.intake.names import safe_name
    from grader.intake.open import find_recordings, open_recorded, open_recording, open_submission, unreadable
    from grader.intake.source import Source, parse_source

__all__ = [
    "IntakeLimits",
    "Source",
    "enclosing_package",
    "find_packages",
    "find_recordings",
    "open_recorded",
    "open_recording",
    "open_submission",
    "parse_source",
    "safe_name",
    "unreadable",
    "without_password",
]

_PLACES = {
    "credentials": ("without_password",),
    "find": ("enclosing_package", "find_packages"),
    "limits": ("IntakeLimits",),
    "names": ("safe_name",),
    "open": ("find_recordings", "open_recorded", "open_recording", "open_submission", "unreadable"),
    "source": ("Source", "parse_source"),
}
_MODULE_OF = {name: f"grader.intake.{module}" for module, names in _PLACES.items() for name in names}


if not TYPE_CHECKING:  # to a type checker it would mean that there is every name

    def __getattr__(name: str) -> object:
        if name not in _MODULE_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_MODULE_OF[name]), name)
        return value
