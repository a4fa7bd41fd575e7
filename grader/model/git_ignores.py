"""What a package's `.gitignore` files keep out of git, and so out of what is handed in: by git's own rules."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase

from grader.model.record import Record

ANY_FOLDERS = "**"


class IgnoreLine(Record):
    """A line of a `.gitignore` file."""

    file: str
    """The file, from the package's folder: `../.gitignore`."""
    line: int
    """Its line."""
    pattern: str
    """What the line says."""
    below: str = ""
    """The package's folder from that of a file above it, or that of the file from the package's."""

    def hides(self, path: str, up: int = 0) -> bool:
        """Return whether the pattern is that of a path, from the package's folder, or of the folder so many levels
        `up` from there, in which all is hidden then."""
        own = self.below.split("/") if self.below else []
        parts = path.split("/")
        if self.file.startswith("../"):
            parts = own + parts
        elif parts[: len(own)] == own:
            parts = parts[len(own) :]
        else:
            return False
        given = self.pattern.removeprefix("!")
        asked = [_as_python_has_it(part) for part in given.strip("/").split("/")]
        asked = asked if "/" in given.rstrip("/") else [ANY_FOLDERS, *asked]
        return (up > 0 or not given.endswith("/")) and _fits(asked, parts[: len(parts) - up])


def _as_python_has_it(part: str) -> str:
    """Return a part of a pattern as `fnmatch` reads it: of git's, `\\*` is a star, and `[^a]` is all but `a`."""
    return re.sub(r"\\([*?[])", r"[\1]", part).replace("\\", "").replace("[^", "[!")


def _fits(asked: Sequence[str], parts: Sequence[str]) -> bool:
    """Return whether the parts of a path are those that are asked for, of which `**` is any folders, none of them too;
    at the end, it is what is in them. Each part is compared with each that is asked for once, whatever they are."""
    last, places = len(asked) - 1, {0}
    for part in parts:
        begun = set(places)
        for at in range(last):  # in order, as one `**` may follow another
            if at in begun and asked[at] == ANY_FOLDERS:
                begun.add(at + 1)
        any_of = {at for at in begun if at <= last and asked[at] == ANY_FOLDERS}
        places = {at + 1 for at in begun - any_of if at <= last and fnmatchcase(part, asked[at])}
        places |= any_of | ({last + 1} if last in any_of else set())
    return last + 1 in places


def hiding_line(lines: Sequence[IgnoreLine], path: str) -> IgnoreLine | None:
    """Return the line by which git ignores the path; None where it does not. The last one that fits it counts, but
    what is in a folder that is ignored is not seen: no other line brings it back."""
    depth = path.count("/") + max((one.below.count("/") + 1 for one in lines), default=0)
    for up in range(depth, -1, -1):
        last = next((one for one in reversed(lines) if one.hides(path, up)), None)
        if last is not None and not last.pattern.startswith("!"):
            return last
    return None
