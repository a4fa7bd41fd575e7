"""What a package's `.gitignore` files keep out of git, and so out of what is handed in."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

from grader.model.record import Record


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

    def hides(self, path: str) -> bool:
        """Return whether the pattern is one of this path, from the package's folder, or of a folder above it."""
        if self.file.startswith("../"):
            path = f"{self.below}/{path}"
        elif self.below and not path.startswith(f"{self.below}/"):
            return False
        else:
            path = path.removeprefix(f"{self.below}/")
        pattern = self.pattern.removeprefix("!").removeprefix("**/")
        anchored = "/" in pattern.rstrip("/")
        whole = PurePosixPath(path)
        places = [whole, *whole.parents][:-1]
        if pattern.endswith("/"):
            places = places[1:]
        given = pattern.strip("/")
        return any(fnmatchcase(str(place) if anchored else place.name, given) for place in places)


def hiding_line(lines: Iterable[IgnoreLine], path: str) -> IgnoreLine | None:
    """Return the line by which git ignores the path; None where it does not. The last one that fits it counts."""
    last = next((one for one in reversed(list(lines)) if one.hides(path)), None)
    return last if last is not None and not last.pattern.startswith("!") else None
