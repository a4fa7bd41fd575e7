"""Whether a package's files lie where the handout wants them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.registry import check
from grader.checks.support.scripts import find_script
from grader.checks.support.text import near_names
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, passed, unjudged
from grader.wording import join_words, plural

OTHERS = {
    "launch": ("launcher", "launchers", "launchfile", "launchfiles", "launch_files"),
    "src": ("scripts", "source", "sources", "nodes", "bin"),
    "scripts": ("src", "script", "nodes", "bin"),
    "config": ("configs", "cfg", "conf", "params", "param", "yaml"),
}


class LayoutParams(Record):
    """Everything relative to the package's folder."""

    folders: tuple[str, ...] = ()
    """Folders that the package holds."""
    files: tuple[str, ...] = ()
    """Files that the package holds."""
    scripts: tuple[str, ...] = ()
    """Scripts that have to lie in their right folder: `scripts/talker.py`."""


class Slip(NamedTuple):
    """What is not in its place, how to fix it, where it lies. `explained`: another criterion names the cause."""

    what: str
    fix: str
    place: str = ""
    explained: bool = False


@check("layout", params=LayoutParams, run_anyway=True)
def layout(package: PackageFacts, params: LayoutParams) -> Verdict:
    """The package is laid out as the handout says.

    What it checks
        That the folders and files of the handout are there under one package folder, under exactly these
        names, and that each script lies in the folder where the handout puts it, or below that.

    Why it matters on a robot
        People and programs find things in a package by the customs of its folders; anyone who repairs the
        robot at night does not want to search.

    How it is measured
        By the files that were handed in. Git keeps no empty folders: one without a file in it is not there.
        Further files and folders do not matter. A script that is nowhere at all counts elsewhere.

    How to fix
        `mkdir <folder>` and `git mv <file> <folder>/`, then commit and push. Capital letters matter:
        `Launch` is not `launch`.
    """
    wanted = [*(f"{name}/" for name in params.folders), *params.files, *params.scripts]
    expected = f"{join_words(wanted)} under one package folder"
    top = sorted({PurePosixPath(f.path).parts[0] + "/" * ("/" in f.path) for f in package.files})
    measured = f"in the package: {join_words(top) or 'nothing'}"
    slips = list(_slips(package, params))
    if not slips:
        message = (
            f"{plural(len(wanted), 'folder or file') if len(wanted) == 1 else 'everything'} is in its place"
        )
        return passed(message, expected=expected, measured=measured)
    places = tuple(FileCitation(file=slip.place) for slip in slips if slip.place)
    verdict = unjudged if all(slip.explained for slip in slips) else failed
    return verdict(
        "; ".join(slip.what for slip in slips),
        expected=expected,
        measured=measured,
        hint="; ".join(dict.fromkeys(slip.fix for slip in slips)),
        citations=tuple(dict.fromkeys(places)),
    )


def _slips(package: PackageFacts, params: LayoutParams) -> Iterator[Slip]:
    """Folders, files, scripts; a script that moves with its folder is not named once more."""
    folders = {parent.as_posix() for f in package.files for parent in PurePosixPath(f.path).parents}
    lost = [_lost_folder(package, f, params) for f in map(_plain, params.folders) if f not in folders]
    yield from lost
    for name in params.files:
        if package.file(name) is None:
            yield _lost_file(package, name)
    moved = tuple(slip.place for slip in lost if slip.place)
    for script in params.scripts:
        found = find_script(package, script)
        if found is None or _is_below(found.path, script) or found.path.startswith(moved):
            continue
        what = f"{PurePosixPath(script).name} is at {found.path}, not at {script}"
        yield Slip(what, f"git mv {found.path} {script}", found.path)


def _is_below(path: str, script: str) -> bool:
    """`src/nodes/a.py` for `src/a.py`: `rosrun` finds both, and both are in `src/`."""
    folder = PurePosixPath(script).parent
    return path == script or (folder.name != "" and folder in PurePosixPath(path).parents)


def _plain(folder: str) -> str:
    return folder.strip("/")


def _lost_folder(package: PackageFacts, folder: str, params: LayoutParams) -> Slip:
    """Another folder in its place, or none. Where all its scripts are nowhere, they are the cause."""
    instead = _instead(package, folder)
    if instead:
        what = f"there is no folder {folder}/, but {instead}/"
        return Slip(what, f"git mv {instead} {folder}", f"{instead}/")
    own = [s for s in params.scripts if PurePosixPath(s).parts[0] == folder]
    nowhere = bool(own) and all(find_script(package, s) is None for s in own)
    fix = f"mkdir {folder} in the package folder, put the files that belong there into it, and git add them"
    return Slip(f"there is no folder {folder}/", fix, explained=nowhere)


def _instead(package: PackageFacts, folder: str) -> str:
    """A folder that stands in for this one: its name in other letters, or another customary name."""
    there = dict.fromkeys(PurePosixPath(f.path).parts[0] for f in package.files if "/" in f.path)
    slips = [n for n in there if n.casefold() == folder.casefold()] or list(near_names(folder, there))
    customary = [n for n in there if n.casefold() in OTHERS.get(folder, ())]
    return next(iter([*slips, *customary]), "")


def _lost_file(package: PackageFacts, name: str) -> Slip:
    """A slip of its name, another folder, or nothing. What needs the file has said so at its own criterion."""
    paths = {f.path: PurePosixPath(f.path) for f in package.files}
    wanted = PurePosixPath(name)
    same = [p for p, path in paths.items() if path.name == wanted.name]
    near = [
        p
        for p, path in paths.items()
        if path.parent == wanted.parent and near_names(wanted.name, [path.name])
    ]
    other = next(iter([*near, *same]), "")
    seen, fix = (f", but {other}", f"git mv {other} {name}") if other else ("", f"add {name}, and push it")
    return Slip(f"there is no {name}{seen}", fix, other, explained=True)
