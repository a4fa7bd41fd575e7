"""Names that can be shown, stored and used as a file's name, whatever the submission calls itself."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from functools import lru_cache

from grader.wording import first_few

MAX_NAME = 100
LONGEST_PACKAGE_NAME = 255
# letters that Unicode does not take apart into a plain one and an accent
_LETTERS = str.maketrans(
    {"ß": "ss", "æ": "ae", "Æ": "AE", "ø": "o", "Ø": "O", "œ": "oe", "Œ": "OE", "ł": "l", "Ł": "L"}
    | {"đ": "d", "Đ": "D", "ð": "d", "þ": "th", "\N{LATIN SMALL LETTER DOTLESS I}": "i"}
)
_ARCHIVE_SUFFIX = re.compile(r"\.(zip|tar|tar\.(gz|xz|bz2)|tgz|txz|tbz2?)$", re.IGNORECASE)
DEVICE = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
"""Names that Windows keeps for its devices, whatever ending they have."""
_SHOWN_AT_MOST = 5
_SHOWN_LETTERS = 120


def safe_name(text: str) -> str:
    """Return `text` as a file's name: `[A-Za-z0-9._-]`, 1 to 100 characters, not hidden, never `.` or `..`.

    Nor is it a device of Windows (`CON`, `nul.txt`), where someone may look at the results. Accents are dropped.
    Where letters had to be given up, or the name was too long, a short hash of the whole keeps two such names apart.
    """
    plain = unicodedata.normalize("NFKD", text.translate(_LETTERS))
    plain = "".join(char for char in plain if not unicodedata.combining(char))
    lost = any(ord(char) > 127 and not char.isspace() for char in plain)
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", plain).lstrip(".-").rstrip(".-")
    name = f"submission-{name}" if DEVICE.match(name) else name
    if not lost and len(name) <= MAX_NAME:
        return name or "submission"
    digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    # nine less, for a hyphen and eight digits of the hash
    return f"{name[: MAX_NAME - 9].rstrip('.-') or 'submission'}-{digest}"


@lru_cache(maxsize=20_000)
def folder_key(name: str) -> str:
    """Return what two names of the same folder have in common: some file systems take `A` for `a`."""
    return safe_name(name).casefold()


def printable(text: str) -> str:
    """Return `text` on one line, with a readable escape (`\\xe9`) for what no terminal or JSON file can hold."""
    shown = text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in shown)


def brief(text: str) -> str:
    """Return `text` as `printable` shows it, cut in the middle where it is too long for a message."""
    # cut before it is escaped, so that a name of megabytes costs nothing
    shown = printable(
        text[: _SHOWN_LETTERS * 2] + text[-_SHOWN_LETTERS:] if len(text) > 3 * _SHOWN_LETTERS else text
    )
    half = _SHOWN_LETTERS // 2
    return shown if len(shown) <= _SHOWN_LETTERS else f"{shown[:half]}...{shown[-half:]}"


def encodable(text: str) -> bool:
    """Return whether `text` is UTF-8; a file's name on Linux need not be."""
    return not any("\ud800" <= char <= "\udfff" for char in text)


def archive_stem(name: str) -> str:
    """Return a file's name without the ending that makes it an archive: `lab1.tar.gz` is `lab1`."""
    return _ARCHIVE_SUFFIX.sub("", name)


def is_package_name(text: str) -> bool:
    """Return whether `text` could stand between `<name>` and `</name>`, however wrong the name is."""
    return 0 < len(text) <= LONGEST_PACKAGE_NAME and encodable(text) and text.isprintable()


def is_archive_name(name: str) -> bool:
    return _ARCHIVE_SUFFIX.search(name) is not None


def listing(names: list[str]) -> str:
    """Return the first few of `names` for a message, and how many more there are."""
    return first_few([brief(name) for name in names], _SHOWN_AT_MOST)
