"""Opens SOURCE: in place for a folder, below the work folder for an archive or a repository; recordings too."""

from __future__ import annotations

import errno
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple, TypeVar

from grader.errors import GraderError, OutputError, SubmissionError
from grader.intake.archive import unpack
from grader.intake.candidates import Candidate, enclosing_package, find_candidates, linked_candidate
from grader.intake.choose import (
    POINTER,
    Choice,
    WantedPackage,
    choose_loose,
    choose_package,
    empty_beside,
    not_found,
)
from grader.intake.git import Git, Repository
from grader.intake.gitdir import Repositories, repository_around
from grader.intake.limits import IntakeLimits
from grader.intake.names import brief, encodable, printable, safe_name
from grader.intake.package_files import (
    Content,
    Modes,
    archive_modes,
    folder_modes,
    package_content,
    remarks,
    right_in_git,
    uploaded_modes,
)
from grader.intake.repository import clone
from grader.intake.source import Source, parse_source
from grader.intake.tree import Entry, file_digest, is_there, list_entries, tree_digest, walk
from grader.model.submission import RecordedSubmission, SourcePackage, Submission

_OTHERS_AT_MOST = 200
_LINKS_SHOWN = 5
GIT_S = 120.0
_SUFFIX = re.compile(r"\.(bag|bag\.active|bag\.orig|mcap|db3)$", re.IGNORECASE)
_MAGIC = (b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\0")


_AnySubmission = TypeVar("_AnySubmission", Submission, RecordedSubmission)


@dataclass(frozen=True, kw_only=True)
class Opened:
    """`archive_modes` is set for an archive, `commit` for a clone; a folder used in place has neither yet.

    `leave_out` is the grader's own work folder, which may lie inside of `root`.
    """

    source: Source
    name: str
    root: Path
    leave_out: Path
    in_place: bool = False
    commit: str | None = None
    archive_sha256: str | None = None
    archive_modes: Mapping[str, bool | None] | None = None
    repository: Repository | None = None
    git_links: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Located:
    """The lab's package, what was chosen besides by the lab's names for it, and all the candidates."""

    opened: Opened
    candidates: list[Candidate]
    choice: Choice
    also: Mapping[str, Choice]


def open_submission(
    source: str | Source,
    *,
    package: str | WantedPackage,
    workdir: Path,
    submission_id: str | None = None,
    git_timeout_s: float = GIT_S,
    limits: IntakeLimits | None = None,
) -> Submission:
    """Return the submission that `source` names, with the lab's `package` found in it; it may be read already.

    A folder is used in place and never written to. An archive or a repository comes to lie in a new folder
    below `workdir`, which is made where it is missing and belongs to the caller. All of git's work together
    takes at most `git_timeout_s` seconds.

    Raises UsageError for a source that does not exist, OutputError for a `workdir` that cannot be written,
    PackageNotFound where the package is not there, SubmissionError for all else that is wrong with it.
    """
    parsed = _parse(source)
    with _base(workdir) as base:
        try:
            git = Git(base / "git-home", timeout_s=git_timeout_s)
            limits = limits or IntakeLimits()
            opened = open_source(parsed, git, base, limits)
            wanted = WantedPackage(name=package) if isinstance(package, str) else package
            located = locate(opened, wanted)
            submission = describe(located, git, limits)
        except OSError as error:
            raise unreadable(parsed.given, error) from error
    return _with_id(submission, submission_id)


def open_recording_file(
    source: str | Source, *, submission_id: str | None = None
) -> RecordedSubmission | None:
    """Return the submission where `source` is itself a recording (a bag or an MCAP file), None where it is anything
    else.

    Raises what `open_submission` raises.
    """
    parsed = _parse(source)
    try:
        # any file is taken for an archive until it is read
        if parsed.kind != "archive" or parsed.path is None or not is_recording(parsed.path):
            return None
        submission = _one_recording(parsed, parsed.path)
    except OSError as error:
        raise unreadable(parsed.given, error) from error
    return _with_id(submission, submission_id)


def open_recordings_only(
    source: str | Source, *, workdir: Path, submission_id: str | None = None
) -> RecordedSubmission:
    """Return the submission of a lab that asks for recordings alone: as `open_submission`, and no package is looked
    for."""
    parsed = _parse(source)
    with _base(workdir) as base:
        try:
            git = Git(base / "git-home", timeout_s=GIT_S)
            submission = _all_recordings(open_source(parsed, git, base, IntakeLimits()), git)
        except OSError as error:
            raise unreadable(parsed.given, error) from error
    return _with_id(submission, submission_id)


def _with_id(submission: _AnySubmission, submission_id: str | None) -> _AnySubmission:
    if submission_id is None:
        return submission
    return submission.model_copy(update={"id": safe_name(submission_id)})


def _parse(source: str | Source) -> Source:
    if isinstance(source, Source):
        return source
    try:
        return parse_source(source)
    except OSError as error:
        raise unreadable(printable(source), error) from error


def unreadable(given: str, error: OSError) -> GraderError:
    """Return the error for a source that this machine could not read, or had no room for."""
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)):
        return OutputError(f"{given}: the disk is full", hint="Free some room (`df -h`) and try again.")
    where = f" at {brief(str(error.filename))}" if error.filename else ""
    return SubmissionError(
        f"{given} cannot be read: {error.strerror or brief(str(error))}{where}",
        hint="Check its permissions (`ls -l`).",
    )


@contextmanager
def new_folder(workdir: Path) -> Iterator[Path]:
    """Make a new folder in `workdir` for the block; nothing of it stays after an error. Raises OutputError."""
    try:
        workdir.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix="source-", dir=workdir)).resolve()
    except OSError as error:
        raise OutputError(
            f"the work folder {workdir} cannot be written: {error.strerror}", hint="Choose another folder."
        ) from error
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


@contextmanager
def _base(workdir: Path) -> Iterator[Path]:
    """Make a new folder in `workdir` for the block. It stays if something was unpacked in it."""
    with new_folder(workdir) as base:
        yield base
    if not (base / "tree").exists():
        shutil.rmtree(base, ignore_errors=True)


def open_source(source: Source, git: Git, base: Path, limits: IntakeLimits) -> Opened:
    """Return what `source` stands for, on disk. New folders are made below `base`, under the source's own name."""
    into = base / "tree" / safe_name(source.name)
    opened = Opened(source=source, name=source.name, root=into, leave_out=base)
    if source.kind == "repository":
        cloned = clone(source, git, into, limits)
        return replace(
            opened,
            root=cloned.root,
            commit=cloned.commit,
            repository=cloned.repository,
            git_links=cloned.git_links,
            hints=cloned.hints,
        )
    path = source.path
    assert path is not None  # noqa: S101 - folders and archives have one
    if source.kind == "folder":
        return replace(opened, root=path.resolve(), in_place=True)
    unpacked = unpack(path, into, limits)
    return replace(
        opened, archive_sha256=unpacked.sha256, archive_modes=unpacked.executable, hints=unpacked.hints
    )


def locate(opened: Opened, wanted: WantedPackage) -> Located:
    """Return the lab's package in what was opened. A folder inside the package (`lab1/src`) stands for the package.

    Raises PackageNotFound, or SubmissionError for an empty folder.
    """
    if not any(path.name != ".git" for path in opened.root.iterdir()):
        raise SubmissionError(
            f"{opened.source.given} is empty, it holds no file",
            hint="Give the folder that holds the package.",
        )
    located = _locate(opened, wanted)
    around = enclosing_package(opened.root) if opened.in_place else None
    if located is None and around is not None:
        located = _locate(replace(opened, name=around.name, root=around), wanted)
    if located:
        return located
    candidates = find_candidates(opened.root, leave_out=opened.leave_out)
    loose = choose_loose(opened.root, candidates, wanted, opened.git_links)
    if loose and around is None:
        return Located(opened=opened, candidates=candidates, choice=loose, also={})
    of_archive = opened.archive_modes
    modes_known = of_archive is None or any(bit is not None for bit in of_archive.values())
    raise not_found(opened.root, candidates, wanted, opened.git_links, modes_known=modes_known)


def _locate(opened: Opened, wanted: WantedPackage) -> Located | None:
    candidates = find_candidates(opened.root, leave_out=opened.leave_out)
    chosen: dict[str, Choice] = {}
    for one in wanted.each:
        name, taken = one.asked or one.name, {choice.package.folder for choice in chosen.values()}
        # a package that the manifest calls by another of the lab's names is that one, whatever its folder
        # is called
        names = {other.asked or other.name for other in wanted.each if other is not one}
        free = [c for c in candidates if c.manifest not in names and c.folder not in taken]
        choice = choose_package(free, one)
        if choice is None and (linked := linked_candidate(opened.root, name)):
            choice = Choice(
                package=linked, hints=(f"{printable(name)} is a link, followed to {printable(linked.path)}",)
            )
        # only without the main package there is nothing to grade; criteria say which of the others is
        # missing
        if choice is None and one is wanted:
            return None
        if choice is not None:
            chosen[one.name] = choice
    main = chosen.pop(wanted.name)
    return Located(opened=opened, candidates=candidates, choice=main, also=chosen)


def describe(located: Located, git: Git, limits: IntakeLimits) -> Submission:
    """Return the record that the next room reads. Raises OSError for a file that cannot be read."""
    opened, choice = located.opened, located.choice
    repositories = Repositories(git, opened.leave_out, root=opened.root, known=opened.repository)
    main = _read(opened, choice, repositories, limits)
    taken = {choice.package.name, *(one.package.name for one in located.also.values())}
    others = [c for c in located.candidates if c.has_manifest and not c.ignored_by and c.name not in taken]
    also = {name: _read(opened, one, repositories, limits) for name, one in located.also.items()}
    return Submission(
        id=safe_name(opened.name),
        source=opened.source.given,
        root=opened.root,
        commit=_commit(opened, choice.package, main.modes, repositories),
        archive_sha256=opened.archive_sha256,
        digest=_digest_of_all(main.digest, also),
        package=main.package,
        packages=tuple(_others(opened, others[:_OTHERS_AT_MOST], repositories, limits)),
        also=tuple(one.package.model_copy(update={"asked": name}) for name, one in also.items()),
        hints=(
            *(*opened.hints, *main.hints),
            *(f"{name}: {hint}" for name, one in also.items() for hint in one.hints),
        ),
    )


class _Read(NamedTuple):
    """A package that the lab asks for, and what its files are."""

    package: SourcePackage
    modes: Modes
    digest: str
    hints: tuple[str, ...]


def _read(opened: Opened, choice: Choice, repositories: Repositories, limits: IntakeLimits) -> _Read:
    """Return the chosen package. Raises OSError for a file that cannot be read."""
    chosen = choice.package
    content = package_content(chosen.folder, limits=limits, leave_out=opened.leave_out)
    modes = _modes(opened, chosen, content.entries, repositories)
    right: frozenset[str] = frozenset()
    if opened.in_place:
        right = right_in_git(chosen.folder, content.entries, repositories.git, opened.leave_out)
    top = repository_around(chosen.folder) if opened.in_place and modes.source == "git" else None
    in_git = "" if top is None else printable(chosen.folder.relative_to(top).as_posix())
    return _Read(
        package=_package(chosen, modes, content, right).model_copy(update={"path_in_git": in_git}),
        modes=modes,
        digest=tree_digest(chosen.folder, content.entries, modes.executable, content.left_out),
        hints=(
            *(*choice.hints, *modes.hints, *content.hints),
            *remarks(chosen.folder, content.entries, content.left_out),
            *(
                f"{printable(path)} {POINTER.format(printable(path))}"
                for path in _links_below(opened, chosen)
            ),
            *empty_beside(chosen, opened.git_links),
        ),
    )


def _links_below(opened: Opened, chosen: Candidate) -> list[str]:
    """Return the folders of the package of which the repository has only a commit's name."""
    prefix = "" if chosen.path == "." else f"{chosen.path}/"
    return [path.removeprefix(prefix) for path in opened.git_links if path.startswith(prefix)][:_LINKS_SHOWN]


def _digest_of_all(digest: str, also: Mapping[str, _Read]) -> str:
    """Return the main package's digest, with those of the others where there are any."""
    if not also:
        return digest
    parts = [digest, *(f"{name} {one.digest}" for name, one in also.items())]
    return sha256("\n".join(parts).encode()).hexdigest()


def _commit(opened: Opened, chosen: Candidate, modes: Modes, repositories: Repositories) -> str | None:
    """Return the commit of the chosen package; None for a folder that merely lies in a repository, untracked."""
    if not opened.in_place:
        return opened.commit
    is_top = is_there(opened.root / ".git") or is_there(chosen.folder / ".git")
    return repositories.head(chosen.folder) if is_top or modes.source == "git" else None


def _modes(opened: Opened, candidate: Candidate, entries: list[Entry], repositories: Repositories) -> Modes:
    if opened.archive_modes is not None:
        modes = archive_modes(entries, opened.archive_modes, path=candidate.path)
    else:
        modes = folder_modes(entries, candidate.folder, repositories)
    return uploaded_modes(modes, opened.source.modes)


def _others(
    opened: Opened, candidates: list[Candidate], repositories: Repositories, limits: IntakeLimits
) -> Iterator[SourcePackage]:
    """Yield the neighbours but for those that are too much: nothing of theirs costs the lab's package anything."""
    for candidate in candidates:
        try:
            content = package_content(
                candidate.folder, limits=limits, leave_out=opened.leave_out, tolerant=True
            )
        except (SubmissionError, OSError):
            continue
        yield _package(candidate, _modes(opened, candidate, content.entries, repositories), content)


def _package(
    candidate: Candidate, modes: Modes, content: Content, right: frozenset[str] = frozenset()
) -> SourcePackage:
    """Return the record of a package. A name that is not UTF-8 fits none; the digest counts its file all the same."""
    return SourcePackage(
        name=candidate.name,
        folder=candidate.folder,
        path=printable(candidate.path),
        mode_source=modes.source,
        executable={path: bit for path, bit in modes.executable.items() if encodable(path)},
        right_in_git=frozenset(path for path in right if encodable(path)),
        left_out=frozenset(path.encode("utf-8", "backslashreplace").decode() for path in content.left_out),
    )


def is_recording(path: Path) -> bool:
    """Return whether a file is a recording by its name or its first bytes; a damaged one is one too.

    Raises OSError where it cannot be read.
    """
    if not path.is_file():
        return False
    if _SUFFIX.search(path.name):
        return True
    with path.open("rb") as file:
        return file.read(16).startswith(_MAGIC)


def _one_recording(source: Source, path: Path) -> RecordedSubmission:
    """Return the submission that is one recording. Raises OSError where it cannot be read, SubmissionError for its
    size."""
    limit_bytes = IntakeLimits().recording_bytes
    if path.stat().st_size > limit_bytes:
        raise SubmissionError(
            f"{source.given} is larger than {limit_bytes >> 20} MiB",
            hint="Record the lab's topics only: `rosbag record /topic …`, or cut it with `rosbag filter`.",
        )
    return RecordedSubmission(
        id=safe_name(_SUFFIX.sub("", path.name)),
        source=source.given,
        root=path.parent,
        file=path,
        commit=None,
        digest=file_digest(path).hexdigest(),
    )


def _all_recordings(opened: Opened, git: Git) -> RecordedSubmission:
    """Return the submission whose recordings lie somewhere in what was opened, with or without a package."""
    entries = list_entries(opened.root, leave_out=opened.leave_out, tolerant=True)
    left_out = {
        e.path for e in entries if e.size_bytes > IntakeLimits().recording_bytes or not _is_open(opened, e)
    }
    commit = opened.commit
    if opened.in_place and is_there(opened.root / ".git"):
        commit = Repositories(git, opened.leave_out, root=opened.root).head(opened.root)
    return RecordedSubmission(
        id=safe_name(opened.name),
        source=opened.source.given,
        root=opened.root,
        file=None,
        commit=commit,
        digest=tree_digest(opened.root, entries, {}, left_out),
    )


def _is_open(opened: Opened, entry: Entry) -> bool:
    return entry.kind != "file" or os.access(opened.root / entry.path, os.R_OK, effective_ids=True)


def find_recordings(root: Path, pattern: str) -> list[Path]:
    """Return the files below `root` that fit a pattern, nearest first; each content once, links left out.

    A pattern without a slash is for a file's name in any folder; capitals make no difference.
    """
    wanted = pattern.casefold().removeprefix("./")
    found: list[Path] = []
    for folder in walk(root, tolerant=True):
        folder.folders[:] = [name for name in folder.folders if not name.startswith(".")]
        names = [entry.name for entry in folder.others if entry.is_file(follow_symlinks=False)]
        found += [root / path for path in map(folder.inside, names) if _fits(path, wanted)]
    # files that are too large are refused later, and their digests would take long
    if len(found) < 2 or any(path.stat().st_size > IntakeLimits().recording_bytes for path in found):
        return found
    # of equal contents, a dict keeps the last one: reversed, it is the nearest; then in order again
    return list({file_digest(path).hexdigest(): path for path in reversed(found)}.values())[::-1]


def _fits(path: str, wanted: str) -> bool:
    name = path.rpartition("/")[2]
    if name.startswith("."):
        return False
    return fnmatchcase(path.casefold() if "/" in wanted else name.casefold(), wanted)
