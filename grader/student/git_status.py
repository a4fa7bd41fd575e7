"""What git lacks of the package that was checked, as advice to a student. It changes no verdict and no point.

A package's folder comes in, `model.result.GitStatus` goes out, with commands that can be typed as they are printed.
The network is not asked: what the server has is known from the last fetch or push. What a hostile repository must not
do through git is the business of `intake.gitdir`.
"""

from __future__ import annotations

import os
import shlex
import stat
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.errors import GraderError, SubmissionError
from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, GitTooMuch
from grader.intake.gitdir import Unfit, View, open_view, repository_around
from grader.intake.names import brief, encodable, listing, printable
from grader.intake.package_files import is_script
from grader.intake.tree import list_entries
from grader.model.package import BUILD_SPACES
from grader.model.result import GitStatus, Point
from grader.portable import MODES_ON_DISK
from grader.wording import plural

SECONDS = 5.0
NAMED_AT_MOST = 4
LAST_FETCH = "as of the last fetch or push"
CI = ("CI", "GITHUB_ACTIONS", "GITLAB_CI", "JENKINS_URL", "TF_BUILD", "BUILDKITE", "TEAMCITY_VERSION")
NO = ("", "0", "false", "no")
# the format for programs, which later versions of git keep; `-z` leaves names unquoted
STATUS = (
    *("status", "--porcelain=v2", "-z", "--branch", "--no-renames", "--ignore-submodules=all"),
    *("--untracked-files=all", "--ignored=traditional", "--", "."),
)
# of ordinary and of unmerged records: the fields before the path, which may have blanks
FIELDS = {"1": 8, "u": 10}
GITLINK = "160000"
TRACKING = "refs/remotes/"
USED = frozenset(
    {".py", ".cpp", ".cc", ".cxx", ".c", ".h", ".hpp", ".launch", ".xml", ".msg", ".srv", ".action", ".yaml", ".yml"}
    | {".sh", ".bash", ".cfg", ".urdf", ".xacro", ".world", ".sdf"}
)  # fmt: skip
LEFTOVERS = (".pyc", ".pyo", ".o", ".so", ".swp", ".swo", ".orig", ".rej", "~", ".bak", ".tmp", ".log")


@dataclass(frozen=True, kw_only=True)
class Environment:
    """Where `grader check` runs. In `ci` a commit was pushed already, and is checked out by itself. While git is
    `committing`, what is staged is on its way, and pushing comes later. Commands are typed in the folder `here`."""

    here: Path
    ci: bool = False
    committing: bool = False


@dataclass(frozen=True, kw_only=True)
class UncommittedFiles:
    """The package's files that git lacks, by path relative to its folder. `staged` of the changed ones need no
    `git add`; `renamed` are those of which only the case differs, as git and the disk call them; `pointers` are
    folders of which git only has the commit of another repository."""

    changed: tuple[str, ...]
    staged: frozenset[str]
    conflicts: bool
    renamed: dict[str, str]
    untracked: tuple[str, ...]
    pointers: tuple[str, ...]
    ignored: tuple[str, ...]
    modes: tuple[str, ...]
    hidden: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class RemoteBranch:
    """The remote that is pushed to, and how HEAD differs from the branch there that is `marked`: usually the default
    one, as `origin/main`; None where that is not known. `upstream` is where the current branch is pushed to."""

    remotes: tuple[str, ...]
    name: str | None = None
    upstream: str | None = None
    marked: str | None = None
    differing: tuple[str, ...] = ()
    ahead: int = 0
    behind: int = 0
    has_head: bool = True


def read_environment(variables: Mapping[str, str], here: Path) -> Environment:
    """Return what the variables that CI systems, git and pre-commit set say."""
    ci = any(variables.get(name, "").lower() not in NO for name in CI)
    # pre-commit sets the former for what it runs, git the latter for a commit's hooks
    committing = not ci and bool(variables.get("PRE_COMMIT") or variables.get("GIT_INDEX_FILE"))
    return Environment(here=here, ci=ci, committing=committing)


def advise(package: Path, base: Path, environment: Environment, *, seconds: float = SECONDS) -> GitStatus:
    """Return what is not committed or not pushed of the package in the folder `package`. Raises nothing.

    `base` is a new folder of ours. All of git's work together takes at most `seconds`.
    """
    try:
        package = package.resolve()
        top = repository_around(package)
        if top is None:
            text = "This package isn't in a git repository: make sure that you submit exactly these files."
            remark = Point(kind="no-repository", text=text, remark=True)
            return GitStatus(points=() if environment.ci else (remark,))
        view = open_view(top, base / "view", Git(base / "home", timeout_s=seconds))
        return _Advice(view, package, top, environment).standing()
    except GitFailed as failure:
        return _unknown(_reason(failure, seconds))
    except (Unfit, OSError, ValueError, GraderError) as error:
        return _unknown(brief(str(error)) or type(error).__name__)


def _reason(failure: GitFailed, seconds: float) -> str:
    if isinstance(failure, GitMissing):
        return "git is not installed here"
    if isinstance(failure, GitTimeout):
        return f"git took longer than {seconds:g} seconds"
    if isinstance(failure, GitTooMuch):
        return "there is too much in this repository"
    return brief((failure.stderr.strip().splitlines() or ["git failed"])[-1])


def _unknown(reason: str) -> GitStatus:
    text = f"Can't tell what git has of this package: {reason}."
    return GitStatus(points=(Point(kind="unknown", text=text, remark=True),))


class _Advice:
    """The messages about one package, each with the commands that fix it."""

    def __init__(self, view: View, package: Path, top: Path, environment: Environment) -> None:
        self._environment = environment
        self._branch, self._commit, self._files = read_files(view, package)
        self._view, self._package = view, package
        self._commands = Commands(package, top, environment.here)

    def standing(self) -> GitStatus:
        if self._files.hidden:
            names = listing(list(self._files.hidden))
            return _unknown(f"git was told not to look at {names} (assume-unchanged, skip-worktree)")
        points = [*self._in_git()]
        # in CI the commit was pushed; before a commit there is none to push
        if self._environment.ci or self._environment.committing:
            return GitStatus(points=tuple(points))
        server = read_server(self._view, self._package, self._branch, self._commit)
        points += self._push_advice(server)
        if points:
            return GitStatus(points=tuple(points))
        where = printable(server.marked or "the server")
        return GitStatus(summary=f"Everything is committed and pushed: {where} has it ({LAST_FETCH}).")

    def _in_git(self) -> Iterator[Point]:
        """What is on the disk and not in a commit. What is staged just before a commit is on its way into one."""
        files, commands = self._files, self._commands
        if files.changed and not self._environment.committing:
            changes = plural(len(files.changed), "change is", "changes are")
            text = f"{changes} not committed: {listing(list(files.changed))}"
            fix = commands.add_and_commit([p for p in files.changed if p not in files.staged])
            yield Point(kind="uncommitted", text=text, fix=commands.git("status") if files.conflicts else fix)
        for in_git, on_disk in list(files.renamed.items())[:NAMED_AT_MOST]:
            text = f"git calls it {printable(in_git)}, this disk {printable(on_disk)}: on Linux they differ."
            yield Point(kind="uncommitted", text=text, fix=commands.rename(in_git, on_disk))
        if files.untracked:
            number = plural(len(files.untracked), "file of the package is", "files of the package are")
            text = f"{number} not in git: {listing(list(files.untracked))}"
            yield Point(kind="untracked", text=text, fix=commands.add_and_commit(files.untracked))
        if files.pointers:
            text = f"git has only a pointer to another repository for {listing(list(files.pointers))}, not the files."
            yield Point(kind="untracked", text=text, fix=commands.git("submodule", "status"))
        if files.ignored:
            text = f"A .gitignore file keeps out of git what the package uses: {listing(list(files.ignored))}"
            yield Point(kind="ignored", text=text, fix=commands.add_and_commit(files.ignored, force=True))
        if files.modes:
            text = f"git does not know that this is executable: {listing(list(files.modes))}"
            yield Point(kind="mode", text=text, fix=commands.make_executable(files.modes))

    def _push_advice(self, server: RemoteBranch) -> Iterator[Point]:
        """What the server lacks, or has on another branch than the marked one. Commits that do not touch the package
        do not matter."""
        branch, name, git = self._branch, server.name or "REMOTE", self._commands.git
        push = git("push") if server.upstream else git("push", "-u", name, branch or "BRANCH")
        if not server.remotes:
            text = "The repository has no server to push to (no remote)."
            fix = (
                f"{git('remote', 'add', 'origin', 'URL')} && {git('push', '-u', 'origin', branch or 'main')}"
            )
            yield Point(kind="unpushed", text=text, fix=fix)
        elif self._commit is None or (server.has_head and not server.differing):
            return
        elif server.marked is None:
            what = f"The branch {printable(branch)}" if branch else "What is checked out"
            yield Point(kind="unpushed", text=f"{what} was never pushed.", fix=push)
        elif server.differing:
            yield self._differs(server, server.marked, push)

    def _differs(self, server: RemoteBranch, marked: str, push: str) -> Point:
        branch, git = self._branch, self._commands.git
        default = marked.partition("/")[2]
        where = f"{printable(marked)} differs in {listing(list(server.differing))}"
        if branch is None:
            text = f"No branch is checked out, and what is marked is usually {printable(default)}; {where}"
            fix = git("switch", default) if server.has_head else git("switch", "-c", "BRANCH")
            return Point(kind="other-branch", text=text, fix=fix)
        if marked not in (server.upstream, f"{server.name}/{branch}"):
            text = f"You are on the branch {printable(branch)}; what is marked is usually {printable(default)}; {where}"
            fix = " && ".join((git("switch", default), git("merge", branch), git("push")))
            return Point(kind="other-branch", text=text, fix=fix)
        if server.ahead:
            commits = plural(server.ahead, "commit is", "commits are")
            text = f"{commits} not pushed to {printable(marked)}; {where}"
            fix = f"{git('pull')} && {push}" if server.behind else push
            return Point(kind="unpushed", text=text, fix=fix)
        commits = plural(server.behind, "commit that is", "commits that are")
        return Point(kind="unpushed", text=f"{printable(marked)} has {commits} not here", fix=git("pull"))


class Commands:
    """Commands of git for a shell in the folder `here`. From outside of the repository, `git -C` leads into it."""

    def __init__(self, package: Path, top: Path, here: Path) -> None:
        here = here.resolve()
        inside = here.is_relative_to(top.resolve())
        self._package = package
        self._base = here if inside else package
        self._git = ("git",) if inside else ("git", "-C", _relative(package, here))

    def git(self, *words: str) -> str:
        """Return `git` with these words; a name that cannot be typed is shown as it is elsewhere."""
        return " ".join(shlex.quote(printable(word)) for word in (*self._git, *words))

    def add_and_commit(self, paths: Sequence[str], *, force: bool = False) -> str:
        """Return the commands. The package's folder stands for many files, or for one that cannot be typed."""
        commit = self.git("commit", "-m", "Lab")
        if not paths:
            return commit
        # what is ignored must be named: with -f, the folder would bring in what builds leave, too
        typed = all(path.isprintable() and encodable(path) for path in paths[:NAMED_AT_MOST])
        few = typed and (force or len(paths) <= NAMED_AT_MOST)
        named = self._paths(paths) if few else [_relative(self._package, self._base)]
        return f"{self.git('add', *(('-f',) if force else ()), *named)} && {commit}"

    def make_executable(self, paths: Sequence[str]) -> str:
        """Return commands that set the executable bit in the index, which works with `core.fileMode=false` too."""
        change = self.git("update-index", "--chmod=+x", *self._paths(paths))
        return f"{change} && {self.git('commit', '-m', 'Lab')}"

    def rename(self, in_git: str, on_disk: str) -> str:
        """Return commands that have git call a file as the disk does."""
        # without -f git refuses: on this disk the new name exists
        return f"{self.git('mv', '-f', *self._paths((in_git, on_disk)))} && {self.git('commit', '-m', 'Lab')}"

    def _paths(self, paths: Sequence[str]) -> list[str]:
        return [_relative(self._package / path, self._base) for path in paths[:NAMED_AT_MOST]]


def _relative(path: Path, base: Path) -> str:
    try:
        return os.path.relpath(path, base)
    except ValueError:  # another drive of Windows
        return str(path)


def read_files(view: View, package: Path) -> tuple[str | None, str | None, UncommittedFiles]:
    """Return the branch (None where none is checked out), the commit (None before the first one), and the files.

    Raises GitFailed, OSError.
    """
    records = [os.fsdecode(record) for record in view.run(*STATUS, cwd=package).split(b"\0") if record]
    heads = dict(record[2:].split(" ", 1) for record in records if record.startswith("# branch."))
    path = package.relative_to(view.repository.top).as_posix()
    prefix = "" if path == "." else f"{path}/"
    index = dict(_index(view, package))
    on_disk = _files_on_disk(package)
    renamed = dict(_case_advice(index, on_disk))
    taken = {*renamed, *renamed.values()}
    changes = [record.split(" ", FIELDS[record[0]]) for record in records if record[0] in FIELDS]
    changed = {c[-1].removeprefix(prefix): c for c in changes if c[-1].removeprefix(prefix) not in taken}
    others = {
        sign: [
            r[2:].removeprefix(prefix)
            for r in records
            if r[0] == sign and _is_own(r[2:].removeprefix(prefix))
        ]
        for sign in "?!"
    }
    branch, commit = heads.get("branch.head"), heads.get("branch.oid")
    files = UncommittedFiles(
        changed=tuple(changed),
        # the second sign is for the disk against the index: a dot if they are the same
        staged=frozenset(p for p, fields in changed.items() if fields[0] == "1" and fields[1][1] == "."),
        conflicts=any(fields[0] == "u" for fields in changes),
        renamed=renamed,
        untracked=tuple(p for p in others["?"] if p not in taken),
        pointers=tuple(path for path, (_, mode) in index.items() if mode == GITLINK),
        ignored=tuple(sorted(p for p in others["!"] if _is_used(package, p))),
        modes=tuple(_missing_modes(package, index)),
        # git leaves these as they are in the index, whatever is on the disk: a small letter says
        # assume-unchanged, and S skip-worktree
        hidden=tuple(
            path
            for path, (tag, mode) in index.items()
            if (tag.islower() or tag == "S") and path in on_disk and mode != GITLINK
        ),
    )
    return None if branch == "(detached)" else branch, None if commit == "(initial)" else commit, files


def _index(view: View, package: Path) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield each tracked file below the package's folder: the tag that says how git looks at it, and its mode."""
    for record in view.run("ls-files", "-v", "--stage", "-z", cwd=package).split(b"\0"):
        meta, _, path = record.partition(b"\t")
        if path:
            tag, mode, *_ = meta.decode("ascii", "replace").split(" ")
            yield os.fsdecode(path), (tag, mode)


def _files_on_disk(package: Path) -> set[str]:
    try:
        return {entry.path for entry in list_entries(package, tolerant=True)}
    except SubmissionError:
        return set()


def _case_advice(index: Iterable[str], on_disk: set[str]) -> Iterator[tuple[str, str]]:
    """Yield names of files in git and on the disk that only differ in case: such a disk keeps the one it has."""

    def composed(path: str) -> str:
        return unicodedata.normalize("NFC", path)  # macOS takes the accents of names apart

    by_folded = {composed(path).casefold(): path for path in on_disk}
    for path in index:
        found = by_folded.get(composed(path).casefold())
        if found is not None and path not in on_disk and composed(found) != composed(path):
            yield path, found


def _missing_modes(package: Path, index: Mapping[str, tuple[str, str]]) -> Iterator[str]:
    """Yield scripts that are executable here and not in git."""
    # where package.xml is executable, so is everything (a Windows share), and the bit says nothing
    if MODES_ON_DISK and not _is_executable(package / "package.xml"):
        for path, (_, mode) in index.items():
            if mode == "100644" and _is_executable(package / path) and is_script(package, path):
                yield path


def _is_executable(path: Path) -> bool:
    try:
        mode = path.lstat().st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISREG(mode) and bool(mode & stat.S_IXUSR)


def _is_own(path: str) -> bool:
    """Return whether a person wrote the file, rather than a build, an editor or another program."""
    *folders, name = path.split("/")
    made = any(f in BUILD_SPACES or f.startswith((".", "__")) or f == "venv" for f in folders)
    return not (made or name.startswith(".") or name.endswith(LEFTOVERS))


def _is_used(package: Path, path: str) -> bool:
    name = path.rpartition("/")[2]
    return name == "CMakeLists.txt" or Path(name).suffix in USED or is_script(package, path)


def read_server(view: View, package: Path, branch: str | None, commit: str | None) -> RemoteBranch:
    """Return what is known of the server. Raises GitFailed."""
    names, settings = view.remote_names, view.settings
    refs = _remote_branches(view)
    # in the order in which `git push` itself looks for the remote
    candidates = (
        settings.get(f"branch.{branch}.pushremote"),
        settings.get("remote.pushdefault"),
        settings.get(f"branch.{branch}.remote"),
        names[0] if len(names) == 1 else None,
        "origin",
    )
    name = next((name for name in candidates if name in names), None)
    if commit is None or name is None:
        return RemoteBranch(remotes=names, name=name, has_head=commit is not None and _has_head(view))
    merged = settings.get(f"branch.{branch}.merge", "").removeprefix("refs/heads/")
    own = merged if merged and settings.get(f"branch.{branch}.remote") == name else branch
    upstream = f"{name}/{own}" if f"{name}/{own}" in refs else None
    marked = _default_branch(name, refs) or upstream
    if marked is None or refs[marked] == commit:
        has_head = marked is not None or _has_head(view)
        return RemoteBranch(remotes=names, name=name, upstream=upstream, marked=marked, has_head=has_head)
    ref = f"{TRACKING}{marked}"
    arguments = ("diff-tree", "-r", "-z", "--name-only", "--no-renames", "--relative", ref, "HEAD", "--", ".")
    differing = [os.fsdecode(path) for path in view.run(*arguments, cwd=package).split(b"\0") if path]
    ahead, behind = view.run("rev-list", "--left-right", "--count", f"HEAD...{ref}", "--").split()
    return RemoteBranch(
        remotes=names,
        name=name,
        upstream=upstream,
        marked=marked,
        differing=tuple(differing),
        ahead=int(ahead),
        behind=int(behind),
        has_head=_has_head(view),
    )


def _remote_branches(view: View) -> dict[str, str]:
    """Return the server's branches, as `origin/main`, each with its commit; `origin/HEAD` with the branch it names."""
    said = view.run("for-each-ref", "--format=%(refname) %(objectname) %(symref)", TRACKING)
    refs = {}
    for line in os.fsdecode(said).splitlines():
        name, commit, link = line.removeprefix(TRACKING).split(" ")
        refs[name] = link.removeprefix(TRACKING) or commit
    return refs


def _default_branch(name: str, refs: Mapping[str, str]) -> str | None:
    """Return the branch that a fresh clone has, as far as it can be told."""
    link = refs.get(f"{name}/HEAD")
    if link in refs:
        return link
    # only a clone has the remote's HEAD, not `git remote add`: the usual names are a guess
    own = [ref for ref in refs if ref.startswith(f"{name}/") and ref != f"{name}/HEAD"]
    usual = [ref for ref in own if ref in (f"{name}/main", f"{name}/master")]
    found = usual if len(usual) == 1 else own
    return found[0] if len(found) == 1 else None


def _has_head(view: View) -> bool:
    """Return whether the commit here is on some branch of the server."""
    try:
        return bool(view.run("for-each-ref", "--count=1", "--contains=HEAD", TRACKING).strip())
    except GitTimeout:
        raise  # the time is over for what follows, too
    # HEAD names no commit yet
    except GitFailed:
        return False
