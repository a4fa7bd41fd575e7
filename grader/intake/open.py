"""SOURCE on disk: in place for a folder, below the work folder for an archive or a repository."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from grader.errors import SubmissionError
from grader.intake.archive import unpack
from grader.intake.choose import Choice, choose, not_found
from grader.intake.content import Content, package_content
from grader.intake.digest import tree_digest
from grader.intake.find import Candidate, enclosing_package, find_candidates, linked_candidate
from grader.intake.git import Git, Repository
from grader.intake.gitdir import Repositories
from grader.intake.limits import Limits
from grader.intake.line_ends import right_in_git
from grader.intake.modes import Modes, archive_modes, folder_modes, uploaded_modes
from grader.intake.names import encodable, printable, safe_name
from grader.intake.remarks import remarks
from grader.intake.repository import clone
from grader.intake.source import Source
from grader.intake.tree import Entry, is_there
from grader.model.submission import SourcePackage, Submission

_OTHERS_AT_MOST = 200


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
    """The lab's package, and all the candidates it was chosen from."""

    opened: Opened
    candidates: list[Candidate]
    choice: Choice


def open_source(source: Source, git: Git, base: Path, limits: Limits) -> Opened:
    """What `source` stands for, on disk. New folders are made below `base`, under the source's own name."""
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


def locate(opened: Opened, wanted: str) -> Located:
    """The lab's package in what was opened. A folder inside the package (`lab1/src`) stands for the package.

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
    raise not_found(opened.root, candidates, wanted, opened.git_links)


def _locate(opened: Opened, wanted: str) -> Located | None:
    candidates = find_candidates(opened.root, leave_out=opened.leave_out)
    choice = choose(candidates, wanted)
    if choice is None and (linked := linked_candidate(opened.root, wanted)):
        choice = Choice(package=linked, hints=(f"{wanted} is a link, followed to {printable(linked.path)}",))
    return Located(opened=opened, candidates=candidates, choice=choice) if choice else None


def describe(located: Located, git: Git, limits: Limits) -> Submission:
    """The record that the next station reads. Raises OSError for a file that cannot be read."""
    opened, choice = located.opened, located.choice
    chosen = choice.package
    repositories = Repositories(git, opened.leave_out, root=opened.root, known=opened.repository)
    content = package_content(chosen.folder, limits=limits, leave_out=opened.leave_out)
    modes = _modes(opened, chosen, content.entries, repositories)
    others = [c for c in located.candidates if c.has_manifest and not c.ignored_by and c.name != chosen.name]
    notes = remarks(chosen.folder, content.entries, content.left_out)
    return Submission(
        id=safe_name(opened.name),
        source=opened.source.given,
        root=opened.root,
        commit=_commit(opened, chosen, modes, repositories),
        archive_sha256=opened.archive_sha256,
        digest=tree_digest(chosen.folder, content.entries, modes.executable, content.left_out),
        package=_package(chosen, modes, content, _right_in_git(opened, chosen, content, git)),
        packages=tuple(_others(opened, others[:_OTHERS_AT_MOST], repositories, limits)),
        hints=(*opened.hints, *choice.hints, *modes.hints, *content.hints, *notes),
    )


def _commit(opened: Opened, chosen: Candidate, modes: Modes, repositories: Repositories) -> str | None:
    """A folder that merely lies somewhere in a repository, untracked, is not of that repository's commit."""
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
    opened: Opened, candidates: list[Candidate], repositories: Repositories, limits: Limits
) -> Iterator[SourcePackage]:
    """The neighbours, but for those that are too much: nothing of theirs costs the lab's package anything."""
    for candidate in candidates:
        try:
            content = package_content(
                candidate.folder, limits=limits, leave_out=opened.leave_out, tolerant=True
            )
        except (SubmissionError, OSError):
            continue
        yield _package(candidate, _modes(opened, candidate, content.entries, repositories), content)


def _right_in_git(opened: Opened, chosen: Candidate, content: Content, git: Git) -> frozenset[str]:
    if not opened.in_place:
        return frozenset()
    return right_in_git(chosen.folder, content.entries, git, opened.leave_out)


def _package(
    candidate: Candidate, modes: Modes, content: Content, right: frozenset[str] = frozenset()
) -> SourcePackage:
    """A name that is not UTF-8 fits no record; the digest counts its file all the same."""
    return SourcePackage(
        name=candidate.name,
        folder=candidate.folder,
        path=printable(candidate.path),
        mode_source=modes.source,
        executable={path: bit for path, bit in modes.executable.items() if encodable(path)},
        right_in_git=frozenset(path for path in right if encodable(path)),
        left_out=frozenset(path.encode("utf-8", "backslashreplace").decode() for path in content.left_out),
    )
