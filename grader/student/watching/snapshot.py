"""A package as it is at one moment: what tells later whether a file has changed, and which files name each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from grader.arena.workspace import needed_packages
from grader.files import temporary_folder
from grader.intake import open_submission
from grader.model.package import SourceFile
from grader.model.submission import SourcePackage, Submission
from grader.package.files import read_files
from grader.package.reading import LEFT_OUT, Unreadable, regular_file
from grader.student.watching.ignored import ignored

TEXT_BYTES_MAX = 1 << 20
FOLDERS_MAX = 2000


@dataclass(frozen=True, kw_only=True)
class Picture:
    """`files` are the package's by path, `texts` the contents of those that are text; `others` are the files of other
    packages of the submission that are built with it. `hints` is what intake remarked (git's view of the modes).
    """

    folder: Path
    files: Mapping[str, SourceFile]
    texts: Mapping[str, str]
    others: Mapping[str, SourceFile] = field(default_factory=dict)
    hints: tuple[str, ...] = ()
    places: tuple[Path, ...] = ()

    def same_as(self, other: Picture | None) -> bool:
        """Whether a grading of the one would say what a grading of the other says."""
        return other is not None and (self.files, self.others, self.hints, self.folder) == (
            other.files,
            other.others,
            other.hints,
            other.folder,
        )


def differing(before: Picture, after: Picture) -> tuple[str, ...]:
    """The paths of files that came, went or changed (contents, executable bit, link), in order."""
    paths = sorted(before.files.keys() | after.files.keys())
    own = tuple(path for path in paths if before.files.get(path) != after.files.get(path))
    others = sorted(before.others.keys() | after.others.keys())
    return (*own, *(path for path in others if before.others.get(path) != after.others.get(path)))


def take_picture(source: str, package: str, *, without: Path | None = None) -> Picture:
    """The package as `grader check SOURCE` sees it now; `without` is a folder that is no part of it.

    Raises SubmissionError where there is no such package, or a file cannot be read, OSError where one vanishes.
    """
    with temporary_folder("source") as workdir:
        submission = open_submission(source, package=package, workdir=workdir)
    folder = submission.package.folder
    files = dict(_files(submission.package, without))
    needed = needed_packages(submission)
    return Picture(
        folder=folder,
        files=files,
        texts=dict(_texts(folder, files)),
        others={f"{p.name}/{path}": file for p in needed[1:] for path, file in _files(p, without)},
        hints=_hints(submission),
        places=tuple(islice((place for p in needed for place in folders_in(p.folder, without)), FOLDERS_MAX)),
    )


def folders_in(folder: Path, without: Path | None = None) -> Iterator[Path]:
    """`folder` and the folders below it that are looked at. No link is followed. One that cannot be read has none."""
    yield folder
    try:
        below = sorted(entry for entry in folder.iterdir() if entry.is_dir() and not entry.is_symlink())
    except OSError:
        return
    for entry in below:
        if entry.name not in LEFT_OUT and not ignored(entry.name) and entry != without:
            yield from folders_in(entry, without)


def _files(package: SourcePackage, without: Path | None) -> Iterator[tuple[str, SourceFile]]:
    """Who says which mode a file has changes with the first commit, and no file does."""
    for file, path in read_files(package):
        if not ignored(path) and not (without and (package.folder / path).is_relative_to(without)):
            yield file.path, file.model_copy(update={"mode_source": "disk"})


def _texts(folder: Path, files: Mapping[str, SourceFile]) -> Iterator[tuple[str, str]]:
    """Of text files of a size that a person writes. What is missing here is not known."""
    for path, file in files.items():
        if file.binary or file.link_problem or not file.sha256 or file.size_bytes > TEXT_BYTES_MAX:
            continue
        try:
            data = regular_file(folder, path).read_bytes()
            yield path, data.decode("utf-8" if file.encoding == "unknown-8bit" else file.encoding, "replace")
        except (Unreadable, OSError, LookupError):
            continue


def _hints(submission: Submission) -> tuple[str, ...]:
    return tuple(
        hint for hint in submission.hints if not any(ignored(word.rstrip(",")) for word in hint.split())
    )
