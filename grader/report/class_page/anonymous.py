"""The page without anybody's name: pseudonyms, and texts without the words that could tell who it is."""

from __future__ import annotations

import hashlib
import re
import secrets
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from grader.files import atomic_write
from grader.model.batch import Entry
from grader.report.class_page.diagnoses import reduced

SALT = ".anonymous-salt"
SALT_BYTES = 32
LEFT_OUT = "…"
WORD_CHARS = 3
PREFIXES = ("S", "P", "X", "No. ", "Anon. ")

_WORDS = re.compile(r"[^\W_]+")


def salt_in(folder: Path) -> bytes:
    """The folder's own secret: pages made with it call everybody the same each time. Made where there is none.

    Raises OutputError where it cannot be written.
    """
    path = folder / SALT
    try:
        salt = path.read_bytes()
    except OSError:
        salt = b""
    if len(salt) >= SALT_BYTES:
        return salt
    salt = secrets.token_bytes(SALT_BYTES)
    atomic_write(path, salt)
    return salt


def order(ids: Sequence[str], salt: bytes) -> list[int]:
    """The places of `ids`, shuffled: the same for the same salt."""
    keyed = [hashlib.blake2b(name.encode("utf-8", "surrogatepass"), key=salt).digest() for name in ids]
    return sorted(range(len(ids)), key=lambda place: keyed[place])


def pseudonyms(ids: Sequence[str]) -> list[str]:
    """`S001`, `S002`, …, in a form that no id has."""
    taken = [name.casefold() for name in ids]
    free = (p for p in PREFIXES if not any(re.match(rf"{re.escape(p.casefold())}\d", name) for name in taken))
    prefix = next(free, PREFIXES[-1])
    digits = max(3, len(str(len(ids))))
    return [f"{prefix}{number:0{digits}}" for number in range(1, len(ids) + 1)]


class Names:
    """Knows the words of everybody's id, name, group and source, and takes them out of texts."""

    def __init__(self) -> None:
        self._own: set[str] = set()
        self._sources: Counter[str] = Counter()
        self._count = 0

    def add(self, entry: Entry, commit: str | None) -> None:
        """One submission's."""
        self._count += 1
        self._own.update(_words(entry.id, entry.name, entry.group, commit or ""))
        self._sources.update(set(_words(entry.source, entry.ref or "")))

    def told(self) -> frozenset[str]:
        """The words that could tell somebody: of sources not those that most have (`home`, `submissions`)."""
        most = max(1, self._count // 2)
        return frozenset(self._own).union(word for word, times in self._sources.items() if times <= most)


def without_words(text: str, words: frozenset[str]) -> str:
    """`text` with `…` for each of the words, and for names of files, what is quoted, and numbers."""
    return _WORDS.sub(lambda found: LEFT_OUT if found[0].casefold() in words else found[0], reduced(text))


def _words(*texts: str) -> Iterable[str]:
    return (
        word
        for text in texts
        for found in _WORDS.findall(text)
        if len(word := found.casefold()) >= WORD_CHARS
    )
