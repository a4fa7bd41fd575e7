"""What the server does not have, or has on another branch than the one that is marked."""

from __future__ import annotations

from collections.abc import Iterator

from grader.intake.names import listing, printable
from grader.model.result import Point
from grader.student.git_status.commands import Commands
from grader.student.git_status.state import State


def pushed_points(state: State, commands: Commands) -> Iterator[Point]:
    """From a commit here to what is marked: a branch, a push, the server's default branch."""
    head, remote = state.head, state.remote
    if not remote.names:
        yield _no_server(state, commands)
    elif head.commit is not None:
        if head.branch is None:
            yield from _detached(state, commands)
        elif remote.name is None or remote.ref is None:
            yield from _never_pushed(state, commands)
        else:
            yield from _ahead_and_behind(state, commands)
            yield from _other_branch(state, commands)


def _no_server(state: State, commands: Commands) -> Point:
    text = "The repository has no server to push to (no remote)."
    if state.around is not None:
        text += f" The repository around it, {printable(state.around.name)}, does not hand in its files."
    branch = state.head.branch or "main"
    mend = (
        f"{commands.git('remote', 'add', 'origin', 'URL')} && {commands.git('push', '-u', 'origin', branch)}"
    )
    return Point(kind="no-remote", text=text, mend=mend)


def _detached(state: State, commands: Commands) -> Iterator[Point]:
    remote = state.remote
    short = (state.head.commit or "")[:7]
    if not remote.elsewhere:
        text = f"No branch is checked out: the commits that end with {short} are on none, and not pushed."
        yield Point(kind="detached", text=text, mend=commands.git("switch", "-c", "BRANCH"))
    elif remote.differing:
        text = f"No branch is checked out, but the commit {short}{_other_than(state)}"
        mend = commands.git("switch", (remote.default or "/main").partition("/")[2])
        yield Point(kind="detached", text=text, mend=mend)


def _never_pushed(state: State, commands: Commands) -> Iterator[Point]:
    head, remote = state.head, state.remote
    branch = head.branch or ""
    if remote.elsewhere and (remote.name is None or not remote.differing):
        return
    text = f"The branch {printable(branch)} was never pushed{_of_package(state)}"
    mend = commands.git("push", "-u", remote.name or "REMOTE", branch)
    yield Point(kind="unpushed", text=text, mend=mend)
    yield from _other_branch(state, commands)


def _ahead_and_behind(state: State, commands: Commands) -> Iterator[Point]:
    remote = state.remote
    ref = printable(remote.ref or "")
    judged_elsewhere = remote.default not in (None, remote.ref)
    if remote.ahead:
        commits = "1 commit is" if remote.ahead == 1 else f"{remote.ahead} commits are"
        touched = bool(remote.differing) or judged_elsewhere
        text = f"{commits} not pushed to {ref}{'' if judged_elsewhere else _of_package(state)}"
        yield Point(kind="unpushed", text=text, mend=commands.git("push"), remark=not touched)
    if remote.behind and (remote.differing or judged_elsewhere):
        commits = "1 commit that is" if remote.behind == 1 else f"{remote.behind} commits that are"
        text = f"{ref} has {commits} not here"
        yield Point(kind="behind", text=text, mend=commands.git("pull"), remark=judged_elsewhere)


def _other_branch(state: State, commands: Commands) -> Iterator[Point]:
    """The default branch is what a fresh clone has, so usually what is marked."""
    head, remote = state.head, state.remote
    if remote.default in (None, remote.ref) or not remote.differing:
        return
    default = (remote.default or "").partition("/")[2]
    branch = head.branch or ""
    if default == branch:  # it is the one that was never pushed
        return
    usual = f"what is marked is usually {printable(default)}{_of_package(state)}"
    text = f"You are on the branch {printable(branch)}; {usual}"
    mend = " && ".join((commands.git("switch", default), commands.git("merge", branch), commands.git("push")))
    yield Point(kind="other-branch", text=text, mend=mend)


def _other_than(state: State) -> str:
    """In which files what is marked differs."""
    remote = state.remote
    marked = printable(remote.default or remote.ref or "the server")
    return f"; {marked} differs in {listing(list(remote.differing))}"


def _of_package(state: State) -> str:
    remote = state.remote
    if remote.differing:
        return _other_than(state)
    known = remote.default or remote.ref
    return "; none of it changes this package" if known else ""
