"""What git has, in words: in which way it differs from what was checked, and the command that mends each."""

from __future__ import annotations

from collections.abc import Iterator

from grader.intake.names import listing, printable
from grader.model.result import Point, Standing
from grader.student.git_status.ask import Asked
from grader.student.git_status.commands import Commands
from grader.student.git_status.environment import Surroundings
from grader.student.git_status.pushed import pushed_points
from grader.student.git_status.state import Change, State
from grader.wording import plural

LAST_FETCH = "as of the last fetch or push"


def standing(asked: Asked, around: Surroundings) -> Standing:
    """What is not committed or not pushed, as far as it can be told from here."""
    if asked.state is not None:
        return _standing(asked.state, around)
    if asked.reason:
        text = f"What git has of this package is not known: {asked.reason}."
        return Standing(points=(Point(kind="unknown", text=text, remark=True),))
    text = "This package is in no git repository: hand in these very files."
    return Standing(points=() if around.ci else (Point(kind="no-repository", text=text, remark=True),))


def _standing(state: State, around: Surroundings) -> Standing:
    commands = Commands(state, around.here)
    points = [*_in_git(state, commands, around), *_hidden(state, commands)]
    if not around.ci and not around.committing:
        points += pushed_points(state, commands)
        points += _around(state, mends=bool(points))
    if points or around.ci or around.committing:
        return Standing(points=tuple(points))
    return Standing(summary=_summary(state))


def _summary(state: State) -> str:
    remote = state.remote
    if remote.ref is None:
        return f"All of it is committed, and {remote.default or 'the server'} has it ({LAST_FETCH})."
    return f"All of it is committed and pushed: {printable(remote.ref)} has it ({LAST_FETCH})."


def _in_git(state: State, commands: Commands, around: Surroundings) -> Iterator[Point]:
    """What is on the disk and not in a commit. Just before a commit, what is staged is on its way into one."""
    head, files = state.head, state.files
    if head.operation and not around.committing:
        text = f"git is in the middle of a {head.operation}: nothing is settled before it ends."
        yield Point(kind="unfinished", text=text, mend=commands.git("status"))
    if head.commit is None and not around.committing:
        named = [*(c.path for c in files.changes if c.what != "deleted"), *files.untracked]
        text = f"Nothing is committed yet, none of {plural(len(named), 'file')}."
        yield Point(kind="no-commit", text=text, mend=commands.add_and_commit(named))
    else:
        changes = () if around.committing else files.changes
        yield from _changed(changes, commands)
        yield from _new(state, commands, "in the package" if around.committing else "checked")
    yield from _bits(files.bits, commands)


def _changed(changes: tuple[Change, ...], commands: Commands) -> Iterator[Point]:
    conflicts = [c.path for c in changes if c.what == "conflict"]
    if conflicts:
        text = f"Both sides of a merge are still in {listing(conflicts)}."
        yield Point(kind="conflict", text=text, mend=commands.git("status"))
    present = [c for c in changes if c.what in ("new", "modified")]
    if present:
        paths = [c.path for c in present]
        staged = all(c.staged for c in present)
        text = f"{plural(len(paths), 'file')} that {_were(paths)} checked {_are(paths)} not committed: {listing(paths)}"
        mend = commands.commit() if staged else commands.add_and_commit(paths)
        yield Point(kind="uncommitted", text=text, mend=mend)
    gone = [c.path for c in changes if c.what == "deleted"]
    if gone:
        text = f"Deleted here, and still in git: {listing(gone)}"
        yield Point(kind="deleted", text=text, mend=commands.add_and_commit(gone))
    bits = [c.path for c in changes if c.what == "bit"]
    if bits:
        text = f"The executable bit is changed, and not committed: {listing(bits)}"
        yield Point(kind="mode", text=text, mend=commands.commit())


def _new(state: State, commands: Commands, where: str) -> Iterator[Point]:
    paths = list(state.files.untracked)
    if paths:
        number = plural(len(paths), "file")
        text = f"{number} that {_were(paths)} {where} {_are(paths)} not in git: {listing(paths)}"
        yield Point(kind="untracked", text=text, mend=commands.add_and_commit(paths))


def _bits(paths: tuple[str, ...], commands: Commands) -> Iterator[Point]:
    if paths:
        text = f"git does not have the executable bit of {listing(list(paths))}"
        yield Point(kind="mode", text=text, mend=commands.chmod(paths))


def _hidden(state: State, commands: Commands) -> Iterator[Point]:
    """What git does not see, or sees otherwise."""
    files = state.files
    if files.ignored:
        paths = list(files.ignored)
        text = f"A .gitignore hides what the package uses, so git will not have it: {listing(paths)}"
        yield Point(kind="ignored", text=text, mend=commands.add_and_commit(paths, force=True))
    for in_git, on_disk in files.cases[:5]:
        text = f"git calls it {printable(in_git)}, this disk {printable(on_disk)}: on Linux these are two."
        yield Point(kind="case", text=text, mend=commands.rename(in_git, on_disk))
    if files.unlooked:
        paths = list(files.unlooked)
        text = f"git was told not to look at changes of {listing(paths)}"
        yield Point(kind="unlooked", text=text, mend=commands.look(paths))
    if files.links:
        paths = list(files.links)
        text = f"Of {listing(paths)} git has only a pointer to another repository, not the files."
        yield Point(kind="pointer", text=text, mend=commands.git("submodule", "status"))


def _around(state: State, *, mends: bool) -> Iterator[Point]:
    """What else there is to know; of the repository's owner only where commands are named that git would refuse."""
    if not state.owned and mends:
        text = "The repository belongs to another user: git refuses to work in it."
        yield Point(kind="owner", text=text, mend=Commands.trust(state.top), remark=True)
    if state.submodule and state.around is not None:
        text = (
            f"The package is in a submodule: {printable(state.around.name)} hands in the commit "
            "that it points to, which may be an older one."
        )
        yield Point(
            kind="submodule", text=text, mend=Commands.status_of(state.around, state.top), remark=True
        )


def _were(paths: list[str]) -> str:
    return "was" if len(paths) == 1 else "were"


def _are(paths: list[str]) -> str:
    return "is" if len(paths) == 1 else "are"
