"""A branch of its own in each student's repository, with the report as Markdown and as a page.

A commit is made in a repository of ours and pushed, one behind the other. A branch of that name that someone else made
(GitHub Classroom has one called `feedback`) stays as it is, and so does every other branch.
"""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path

from grader.classes.feedback.forms import PAGE, TEXT, Feedback, Sender, SendSettings
from grader.errors import GraderError, NotSent, UsageError
from grader.files import temporary_folder
from grader.host_programs import find_user_program
from grader.intake.git import Git, GitFailed, Repository
from grader.intake.names import printable
from grader.intake.repository import ask, explained, parse_refs
from grader.intake.source import Source, parse_source

NAME = "feedback"
TIMEOUT_S = 120.0
TRAILER = "Grader-Feedback"
_TRAILER = re.compile(rf"^{TRAILER}: [0-9a-f]{{64}}$", re.MULTILINE)
# what every git and every server takes for a branch's name, and no option
_BRANCH = re.compile(r"(?!.*(?:\.\.|//|@\{|\.lock(?:/|$)|/\.))[A-Za-z0-9_][A-Za-z0-9._/-]{0,100}(?<![./])")
_IDENTITY = ("-c", "user.name=ros-lab-grader", "-c", "user.email=ros-lab-grader@localhost")
# The settings of a repository on this machine may be a student's: those given to the command win over them.
_RECEIVE = {
    "core.hooksPath": os.devnull,
    "core.alternateRefsCommand": "true",
    "core.fsmonitor": "false",
    "receive.autogc": "false",
    "receive.denyCurrentBranch": "refuse",
    "receive.denyNonFastForwards": "true",
    "gc.auto": "0",
    "maintenance.auto": "false",
}


_PLAIN = re.compile(
    r"core\.(?:repositoryformatversion|filemode|bare|sharedrepository|logallrefupdates|ignorecase|precomposeunicode"
    r"|symlinks)|receive\.deny\w+|http\.receivepack|extensions\.objectformat|remote\..+\.(?:url|fetch|mirror)",
    re.IGNORECASE,
)
"""Settings of a repository that let git run nothing."""


class Branch(Sender):
    """Pushes to the branch of `--branch`, by default `feedback`."""

    def __init__(self, settings: SendSettings) -> None:
        super().__init__(settings)
        self.branch = settings.branch or NAME
        if not _BRANCH.fullmatch(self.branch):
            raise UsageError(
                f"--branch {self.branch[:80]}: not a valid name for a branch", hint="for example: feedback"
            )

    def place(self, feedback: Feedback) -> str:
        """Return the repository and the branch."""
        return f"{_repository(feedback).given}, branch {self.branch}"

    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Push a commit with the reports; none if the branch has them already."""
        del look
        source = _repository(feedback)
        with temporary_folder("source") as room:
            try:
                commit = _Push(source, self.branch, room).push(feedback)
            except GitFailed as failure:
                raise _refusal(failure, source, self.branch) from failure
        return f"{source.given}, branch {self.branch}, commit {commit[:12]}"


def _repository(feedback: Feedback) -> Source:
    try:
        source = parse_source(feedback.entry.source)
    except GraderError as error:
        raise NotSent(error.message, hint=error.hint) from error
    if source.kind != "repository":
        raise NotSent("no repository was submitted", hint="return it by another form: --form folder")
    if not source.remote and (
        source.top is None or (source.top / ".git").exists() or source.top.name == ".git"
    ):
        raise NotSent(
            "a working copy on this machine was submitted, and students do not fetch from it",
            hint="give the roster the repository's address, or a bare repository",
        )
    return source


class _Push:
    """One push, from a new repository in `room`."""

    def __init__(self, source: Source, branch: str, room: Path) -> None:
        self._source, self._ref, self._branch = source, f"refs/heads/{branch}", branch
        self._git = Git(room / "home", timeout_s=TIMEOUT_S)
        self._top = room / "work"
        self._top.mkdir()
        self._own = Repository(git_dir=self._top / ".git", top=self._top)

    def push(self, feedback: Feedback) -> str:
        """Return the commit that the branch has then."""
        self._git.run("init", "--quiet", "--template=", ".", cwd=self._top)
        self._refuse_settings()
        listed = self._ask("ls-remote", "--quiet", refspecs=(self._ref,))
        tip = parse_refs(os.fsdecode(listed)).get(self._ref, "")
        if tip:
            # one commit is enough: to see whose the branch is, and as the parent of the next
            self._ask("fetch", "--quiet", "--no-tags", "--depth=1", refspecs=(self._ref,))
            if not _TRAILER.search(self._run("show", "--no-patch", "--format=%B", tip)):
                raise NotSent(
                    f"its branch {self._branch} is not the grader's, and stays as it is",
                    hint="give another name with --branch",
                )
        (self._top / TEXT).write_bytes(feedback.text.encode())
        (self._top / PAGE).write_bytes(feedback.page)
        self._run("add", "--force", "--", TEXT, PAGE)
        tree = self._run("write-tree")
        if tip and self._run("rev-parse", f"{tip}^{{tree}}") == tree:
            return tip
        parents = ("-p", tip) if tip else ()
        message = f"{feedback.subject}\n\n{TRAILER}: {feedback.publication.digest}"
        commit = self._run(*_IDENTITY, "commit-tree", tree, *parents, "-m", message)
        self._ask(
            "push", "--quiet", f"--receive-pack={self._receiver()}", refspecs=(f"{commit}:{self._ref}",)
        )
        return commit

    def _refuse_settings(self) -> None:
        """Of a repository on this machine: what it says may be a student's, and make git run programs."""
        if self._source.top is None:
            return
        listed = self._run("config", "--file", str(self._source.top / "config"), "--name-only", "--list")
        unknown = [name for name in listed.splitlines() if not _PLAIN.fullmatch(name)]
        if unknown or (self._source.top / "objects" / "info" / "alternates").exists():
            raise NotSent(
                f"this repository has settings of its own: {printable(unknown[0]) if unknown else 'alternates'}",
                hint="push to it through a server, or by another user",
            )

    def _receiver(self) -> str:
        """Return what receives the push: the server's own program, and on this machine one that runs nothing else."""
        if self._source.remote:
            return "git-receive-pack"
        options = [part for key, value in _RECEIVE.items() for part in ("-c", f"{key}={value}")]
        return shlex.join([find_user_program("git") or "git", *options, "receive-pack"])

    def _ask(self, *command: str, refspecs: tuple[str, ...]) -> bytes:
        return ask(self._source, self._git, self._own, command, *refspecs)

    def _run(self, *args: str) -> str:
        return self._git.run(*args, cwd=self._top, repository=self._own).decode("utf-8", "replace").strip()


def _refusal(failure: GitFailed, source: Source, branch: str) -> NotSent:
    # GitHub refuses pushes with codes from GH001 on
    if re.search(r"\[(?:remote )?rejected\]|protected branch|denied|GH00[0-9]", failure.stderr):
        said = next((row for row in failure.stderr.splitlines() if "rejected" in row or "remote:" in row), "")
        return NotSent(
            f"{source.given} does not take a push to {branch}: {' '.join(said.split())[:200]}",
            hint="the account that sends feedback needs write access to that repository",
        )
    error = explained(failure, source)
    return NotSent(error.message, hint=error.hint)
