"""One override written into `overrides.yaml`; all else of the file stays as it was written."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

from grader.classes.overrides.edit import Fields, edited
from grader.classes.overrides.read import FORM, SCHEMA_KEY, folder_key
from grader.errors import Busy, RubricError, UsageError
from grader.files import atomic_write, lock, open_lock, unwritable
from grader.model.result import Override
from grader.rubric.source import as_map, source_of

WAIT_S, LOOK_S = 30.0, 0.02


def write_override(path: Path, submission: str, criterion: str, override: Override | None) -> None:
    """Put one override into the file, which need not exist, or take it out (None). Several writers wait for each other.

    Raises RubricError where the file has faults already, UsageError where it is written in a way that cannot be
    changed here, OutputError where it cannot be written, Busy where another writer does not come to its end.
    """
    path = path.resolve()
    with _alone(path):
        raw = _read(path)
        mode = path.stat().st_mode & 0o777 if path.exists() else None
        new = _changed(path, raw, submission, criterion, _fields(override)).encode()
        if new != raw:
            atomic_write(path, new)
            if mode is not None:
                path.chmod(mode)


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold the file beside it that all writers lock; it stays, because another one may be waiting for it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = open_lock(path.with_name(f".{path.name}.lock"), public=True)
    except OSError as error:
        raise unwritable(path, error) from error
    try:
        with suppress(OSError):  # a file system without locks: whoever shares it has to know what they do
            _wait(descriptor, path)
        yield
    finally:
        os.close(descriptor)


def _wait(descriptor: int, path: Path) -> None:
    until = time.monotonic() + WAIT_S
    while not lock(descriptor):
        if time.monotonic() > until:
            raise Busy(f"another program is writing {path}", hint="wait until it has ended, then try again")
        time.sleep(LOOK_S)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return b""
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from error


def _fields(override: Override | None) -> Fields | None:
    """As the file's data have them; what is empty is left out."""
    if override is None:
        return None
    date = override.date.isoformat() if override.date else None
    given = {"points": override.points, "comment": override.comment, "author": override.author, "date": date}
    return {name: value for name, value in given.items() if value is not None and value != ""}


def _changed(path: Path, raw: bytes, submission: str, criterion: str, fields: Fields | None) -> str:
    """The file's new text, which is read back and compared before it counts."""
    before = _data(path, raw)
    if submission == SCHEMA_KEY:
        raise UsageError(
            f"a submission cannot be called {SCHEMA_KEY} in {path}", hint="rename it in the roster"
        )
    key = next((k for k in before if k != SCHEMA_KEY and folder_key(k) == folder_key(submission)), submission)
    text = raw.decode("utf-8-sig")
    new = edited(text, before, key, criterion, fields)
    try:
        sound = _plain(_data(path, new.encode())) == _plain(_expected(before, key, criterion, fields))
    except RubricError:
        sound = False
    if not sound:
        message = f"{path}: {criterion} of {submission} is written in a way that cannot be changed here"
        raise UsageError(message, hint="change it by hand")
    return new


def _data(path: Path, raw: bytes) -> dict[str, Any]:
    """Raises RubricError where the file is no sound map."""
    source = source_of(raw, str(path), FORM)
    faults = [source.fault(*fault) for fault in source.faults]
    if not isinstance(source.data, dict):
        faults.append(source.fault((), "must be a map from submissions to criteria"))
    if faults:
        raise RubricError(faults, hint="mend it by hand")
    return as_map(source.data)


def _expected(before: dict[str, Any], key: str, criterion: str, fields: Fields | None) -> dict[str, Any]:
    after = deepcopy(before)
    if fields is not None:
        there = as_map(as_map(after.get(key)).get(criterion))
        others = {name: value for name, value in there.items() if name not in Override.model_fields}
        after[key] = {**as_map(after.get(key)), criterion: {**others, **fields}}
    elif criterion in as_map(after.get(key)):
        del after[key][criterion]
    return after


def _plain(data: dict[str, Any]) -> dict[str, Any]:
    """Without what is empty, which means nothing; the schema's line may be there or not."""
    plain = {key: _plain(value) if isinstance(value, dict) else value for key, value in data.items()}
    return {key: value for key, value in plain.items() if value not in (None, {}) and key != SCHEMA_KEY}
