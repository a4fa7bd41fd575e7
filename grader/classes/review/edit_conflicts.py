"""When two people decide the same: what each of them had seen, and the one after the other."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

from grader.files import open_lock, unwritable, wait_for_lock
from grader.model.result import Override

LOCK = ".review.lock"


class Conflict(Exception):
    """Somebody else decided meanwhile: `now` is what stands there, None for nothing."""

    def __init__(self, now: Override | None) -> None:
        super().__init__("decided meanwhile")
        self.now = now


def mark(override: Override | None) -> str:
    """What a form carries to say which decision it was made from; empty for none."""
    return sha256(override.model_dump_json().encode()).hexdigest()[:24] if override else ""


def plain(override: Override) -> Override:
    """What a person wrote of an override that was applied."""
    return Override(**{name: getattr(override, name) for name in Override.model_fields})


def alike(one: Override | None, other: Override | None) -> bool:
    """Whether both say the same, whenever it was said."""
    if one is None or other is None:
        return one is other
    return one.model_copy(update={"date": None}) == other.model_copy(update={"date": None})


@contextmanager
def reviewing(path: Path) -> Iterator[None]:
    """Hold what all reviews of a class hold while they compare and write: another process may review it, too."""
    try:
        descriptor = open_lock(path / LOCK, public=True)
    except OSError as error:
        raise unwritable(path / LOCK, error) from error
    try:
        with suppress(OSError):  # a file system without locks: whoever shares it has to know what they do
            wait_for_lock(descriptor)
        yield
    finally:
        os.close(descriptor)
