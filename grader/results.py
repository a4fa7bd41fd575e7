"""The results folder of one submission: evidence and reports replace older ones together, or not at all.

Everything is written into `.grader-new` (the reports by `report/files.py`), flushed to the disk, and renamed to
`.grader-ready`: this commits it. Then the old result is removed, the new evidence and reports are moved into place, and
the new result last. A grader that is killed in between leaves no result, or one that fits the evidence beside it; the
next one finishes what it had begun.

Folders and files are private to their owner: they hold a student's marks.
"""

from __future__ import annotations

import json
import os
import shutil
from contextlib import suppress
from pathlib import Path

from pydantic import ValidationError
from typing_extensions import Self

from grader.errors import Busy, EvidenceError
from grader.files import lock, make_folder, sync, sync_tree, try_lock, writing
from grader.model.result import GradingResult
from grader.model.version import RESULT as FORMAT
from grader.model.version import UPDATE
from grader.portable import close, open_folder

NEW, READY = ".grader-new", ".grader-ready"
NAMES, REPLACED = "names.json", "replaced"
EVIDENCE, RESULT = "evidence", "result.json"
SUMS, SIGNATURE = "SHA256SUMS", "SHA256SUMS.sig"
RESULT_FILES = (RESULT, EVIDENCE, "report.md", "report.html", "junit.xml", "console.log", SUMS, SIGNATURE)
COMPLETE = ("graded", "inconclusive")
ATTEMPTS = 10


class Results:
    """`with Results(folder) as results:` write into `results.new`, then call `results.commit()`. Without that, nothing
    changes, and folders that were made are removed again.

    Raises Busy if another grader works on the same submission, OutputError or HostError if the folder cannot be
    written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.new = folder / NEW

    def __enter__(self) -> Self:
        # before anything is made, to remove no more than that in the end
        self._made = [path for path in (self.folder, *self.folder.parents) if not path.exists()]
        with writing(self.folder):
            self._lock = _locked(self.folder)
        try:
            with writing(self.folder):
                _recover(self.folder)
                make_folder(self.evidence)
        except BaseException:  # without `__enter__`, `__exit__` is not called
            self._leave()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    @property
    def evidence(self) -> Path:
        """Where the new evidence goes."""
        return self.new / EVIDENCE

    @property
    def complete(self) -> bool:
        """Whether an earlier run left a complete result, one with points."""
        try:
            return json.loads((self.folder / RESULT).read_bytes()).get("status") in COMPLETE
        except (OSError, ValueError, AttributeError):
            return False

    def commit(self, *, keep: tuple[str, ...] = ()) -> None:
        """Replace what was there by what is in `new`, except for the parts to `keep`."""
        with writing(self.folder):
            if EVIDENCE in keep:
                shutil.rmtree(self.evidence)
            names = sorted({*keep, *(path.name for path in self.new.iterdir())})
            # the list tells a grader that has to finish this which parts belong to the new result
            (self.new / NAMES).write_text(json.dumps(names))
            sync_tree(self.new)
            self.new.rename(self.folder / READY)
            sync(self.folder)
            _roll_forward(self.folder)

    def _leave(self) -> None:
        shutil.rmtree(self.new, ignore_errors=True)
        # innermost first; a folder that holds anything stays
        for path in self._made:
            with suppress(OSError):  # not empty: it is in use
                path.rmdir()
        close(self._lock)


def read_result(folder: Path) -> GradingResult | None:
    """Read the result in a submission's folder, of any version up to this grader's; None if there is none, or it is
    damaged. Raises EvidenceError if a newer grader wrote it: it must not look as if there were none.
    """
    try:
        return _read(folder / RESULT)
    except OSError:
        return None


def load_result(path: str | os.PathLike[str]) -> GradingResult:
    """Read a `result.json`, of any version up to this grader's, or the one in that folder of results.

    Raises EvidenceError where there is none, where it is damaged, and where a newer grader wrote it.
    """
    file = Path(path) / RESULT if Path(path).is_dir() else Path(path)
    try:
        result = _read(file)
    except OSError as error:
        raise EvidenceError(f"{file}: {error.strerror}", hint="give a folder of results") from error
    if result is None:
        raise EvidenceError(f"{file}: not what a grader writes", hint="grade the submission again")
    return result


def _read(file: Path) -> GradingResult | None:
    data = file.read_bytes()
    try:
        return GradingResult.read_json(data)
    except ValidationError:
        if newer := FORMAT.newer_in(data):
            raise EvidenceError(f"{file}: {newer}", hint=UPDATE) from None
        return None


def finish_killed(out: Path) -> None:
    """Finish or discard what killed graders left in the folders of `out`. What running ones are at stays."""
    with suppress(OSError):  # there is no such folder yet
        for folder in list(out.iterdir()):
            with suppress(OSError):  # what cannot be done here is done when that submission is graded
                if (folder / NEW).is_dir() or (folder / READY).is_dir():
                    _finish(folder)


def _finish(folder: Path) -> None:
    descriptor = open_folder(folder)
    try:
        if lock(descriptor):
            _recover(folder)
            folder.rmdir()  # where it holds nothing else
    finally:
        close(descriptor)


def _locked(folder: Path) -> int:
    """Lock the folder and return its descriptor. The folder is made again if its last grader has just removed it."""
    for _ in range(ATTEMPTS):
        try:
            make_folder(folder)
            descriptor = open_folder(folder)
        except FileNotFoundError:
            continue
        held = try_lock(descriptor)
        if held and _is_at(descriptor, folder):
            return descriptor
        close(descriptor)
        if not held:
            break
    raise Busy(
        f"another grader works on {folder} just now",
        hint="wait until it has ended, or choose another folder with --out",
    )


def _is_at(descriptor: int, folder: Path) -> bool:
    if descriptor < 0:  # a system where folders cannot be opened
        return True
    try:
        return os.path.samestat(os.fstat(descriptor), folder.stat())
    except FileNotFoundError:
        return False


def _recover(folder: Path) -> None:
    if (folder / READY).is_dir():
        _roll_forward(folder)
    shutil.rmtree(folder / NEW, ignore_errors=True)


def _roll_forward(folder: Path) -> None:
    """Move what is ready into place. Can be interrupted anywhere, and started again."""
    ready = folder / READY
    names = ready / NAMES
    if names.exists():
        coming = json.loads(names.read_text())
        _clear(folder, coming)
        # the old result is gone from the disk before anything newer than it appears
        sync(folder)
        for name in (*(n for n in coming if n != RESULT), RESULT):
            if (ready / name).exists():
                (ready / name).rename(folder / name)
        sync(folder)
        names.unlink()
    shutil.rmtree(ready, ignore_errors=True)


def _clear(folder: Path, coming: list[str]) -> None:
    """Remove what is replaced, the old result first. What is in place already is no longer in `ready`, and stays."""
    ready = folder / READY
    for name in dict.fromkeys((*RESULT_FILES, *coming)):
        old = folder / name
        if os.path.lexists(old) and ((ready / name).exists() or name not in coming):
            # a rename is whole or not at all, unlike removing a tree; what it held goes with `ready`
            if name == EVIDENCE:
                shutil.rmtree(ready / REPLACED, ignore_errors=True)
                old.rename(ready / REPLACED)
            else:
                old.unlink()
