"""Chooses the lab's package among those that are found, and says what is there instead where it is not: another
package, or the lab's files in none, with what keeps them from being run there."""

from __future__ import annotations

import os
import re
import shlex
import stat
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path, PurePosixPath

from grader.errors import PackageNotFound, SubmissionError
from grader.files import read_untrusted
from grader.intake.candidates import LARGEST_BYTES, WORKSPACE_MARKS, Candidate, manifest_name, named_at
from grader.intake.names import brief, encodable, is_archive_name, listing, printable
from grader.intake.tree import is_there, walk
from grader.model.package import BUILD_SPACES, MANIFEST, meant_manifest
from grader.wording import is_one_edit, join_words, name_package

COPIES_LOOKED_AT, FOLDERS_OF_A_COPY = 50, 300
USUAL_FOLDERS = frozenset({"src", "scripts", "nodes", "launch"})


@dataclass(frozen=True, kw_only=True)
class WantedPackage:
    """The package that the lab asks for, and the `paths` of the files that it asks for in it.

    `asked` is the name of the package to grade in its place, from `--package`, or "". `others` are those that the lab
    asks for besides.
    """

    name: str
    paths: frozenset[str] = frozenset()
    asked: str = ""
    others: tuple[WantedPackage, ...] = ()

    @property
    def files(self) -> frozenset[str]:
        """The names of these files, without folders."""
        return frozenset(PurePosixPath(path).name for path in self.paths)

    @property
    def each(self) -> tuple[WantedPackage, ...]:
        """All that the lab asks for, this one first."""
        return (self, *self.others)


@dataclass(frozen=True, kw_only=True)
class Choice:
    package: Candidate
    hints: tuple[str, ...]


def choose_package(candidates: list[Candidate], wanted: WantedPackage) -> Choice | None:
    """Return the lab's package, with remarks on files that it lacks and other packages have."""
    choice = _choose(candidates, wanted)
    if choice is None:
        return None
    chosen, known = choice.package, {choice.package.name, *(one.name for one in wanted.each)}
    others = [c for c in candidates if c.has_manifest and c.name not in known][:COPIES_LOOKED_AT]
    hints = (*_name_taken(chosen, candidates, wanted), *_in_another_package(chosen, others, wanted))
    return replace(choice, hints=(*choice.hints, *hints, *_outside_of_it(chosen, wanted)))


def _name_taken(chosen: Candidate, candidates: list[Candidate], wanted: WantedPackage) -> Iterator[str]:
    """Yield which package beside one that was asked for by another name has the lab's, beginning with it."""
    if wanted.asked and chosen.name != wanted.name:
        above = PurePosixPath(chosen.path).parent
        for other in candidates:
            if other.manifest == wanted.name and PurePosixPath(other.path).parent == above:
                where = printable(other.path)
                yield f"{wanted.name} is the name of {where} too: first move {where} out of this workspace"


def _choose(candidates: list[Candidate], wanted: WantedPackage) -> Choice | None:
    """Return the lab's package: by its manifest's name, by that in other case, by its folder's name, in this order.

    What catkin does not see (a marker file, no manifest) comes after all that it does see. Last comes the only name
    that is nearly right, or before a folder that has no more than scripts. With `wanted.asked`, only that name counts.
    """
    packages = [c for c in candidates if c.has_manifest]
    seen = [c for c in packages if c.ignored_by is None]
    ignored = [c for c in packages if c.ignored_by is not None]
    bare = [c for c in candidates if not c.has_manifest]
    if wanted.asked:
        groups = ([c for c in group if c.name == wanted.asked] for group in (seen, ignored, bare))
        return next((_best(group, wanted) for group in groups if group), None)
    for group in (seen, ignored):
        for fits in (_is_named, _named_alike, _in_folder):
            matches = [c for c in group if fits(c, wanted.name)]
            if matches:
                return _best(matches, wanted)
    bare = [c for c in bare if _in_folder(c, wanted.name) and not any(_below(p, c) for p in packages)]
    near = [c for c in seen if c.manifest is not None and is_slip(c.manifest, wanted.name)]
    near = near if len({c.manifest for c in near}) == 1 else []
    made = [c for c in bare if c.has_cmake]
    # A folder of scripts is no package where one with the lab's files is beside it.
    if bare and (made or not any(_files_of(c.folder, wanted.files) for c in near)):
        return _best(
            made or bare, wanted
        )  # A workspace has `src/` too; the package in it has the CMakeLists.txt.
    return _best(near, wanted) if near else None


def choose_loose(
    root: Path, candidates: list[Candidate], wanted: WantedPackage, git_links: tuple[str, ...]
) -> Choice | None:
    """Return the only folder that has files of the lab and lacks no more than its manifest to be the package, where the
    submission has no package at all, and nothing else says where that went."""
    if wanted.asked or wanted.others or any(c.has_manifest for c in candidates):
        return None
    own = [c for c in candidates if c.folder.name != "src"]  # with a CMakeLists.txt it is a workspace's
    found = [c for c in own if _files_of(c.folder, wanted.files, near=not c.has_cmake)]
    above = {str(folder) for c in found for folder in PurePosixPath(c.path).parents}
    found = [c for c in found if c.path not in above]
    if len(found) != 1 or _where_it_went(root, wanted.name, git_links, own=found[0].path):
        return None
    return _best([replace(found[0], manifest=wanted.name)], wanted)


def _is_named(candidate: Candidate, wanted: str) -> bool:
    return candidate.manifest == wanted


def _named_alike(candidate: Candidate, wanted: str) -> bool:
    return candidate.manifest is not None and candidate.manifest.casefold() == wanted.casefold()


def _in_folder(candidate: Candidate, wanted: str) -> bool:
    """Return whether its folder has the name; a repository that was downloaded as a zip adds its branch."""
    folder = candidate.folder.name.casefold()
    return wanted.casefold() in (folder, re.sub(r"-(main|master)$", "", folder))


def _below(inner: Candidate, outer: Candidate) -> bool:
    return inner is not outer and (outer.path == "." or inner.path.startswith(f"{outer.path}/"))


def is_slip(name: str, wanted: str) -> bool:
    """Return whether `name` is `wanted` but for capitals, `-` and `_`, and one letter.

    Digits are not letters: `lab2` is another lab's package than `lab1`.
    """
    one, other = (re.sub(r"[\s_-]", "", text.casefold()) for text in (name, wanted))
    digits = [re.sub(r"\D", "", text) for text in (one, other)]
    return bool(one) and digits[0] == digits[1] and (one == other or is_one_edit(one, other))


def _best(matches: list[Candidate], wanted: WantedPackage) -> Choice:
    """Of several copies, return the one that catkin sees, then the one with most of the lab's files, then the nearest
    to the root; at one depth, a folder that is named like the package goes first."""

    def key(c: Candidate) -> tuple[bool, int, bool, int, bool, bytes]:
        # only copies need to be told apart, and it takes a walk through each
        files = -len(_files_of(c.folder, wanted.files)) if len(looked_at) > 1 else 0
        is_named = c.folder.name == (wanted.asked or wanted.name)
        return not _in_workspace(c), files, "src" not in _above(c), c.depth, not is_named, os.fsencode(c.path)

    # an archive may hold thousands of copies
    looked_at = sorted(matches, key=lambda c: (not _in_workspace(c), c.depth))[:COPIES_LOOKED_AT]
    chosen, *others = sorted(looked_at, key=key)
    hints = [hint for hint in (_name_hint(chosen, wanted), _ignored_hint(chosen)) if hint]
    if others:
        rest = listing([c.path for c in others])
        name = printable(wanted.asked or wanted.name)
        hints.append(f"{name} is there more than once: {printable(chosen.path)} is graded, {rest} is not")
        hints += _left_behind(chosen, others, wanted)
    return Choice(package=chosen, hints=tuple(hints))


def empty_beside(chosen: Candidate, git_links: Collection[str]) -> Iterator[str]:
    """Yield the empty folders beside a package that have the name of one that it depends on: a repository in a
    repository is empty in a clone and in an archive, or only one of the `git_links`."""
    if chosen.path == "." or not chosen.has_manifest:
        return
    text = read_untrusted(chosen.folder / MANIFEST, LARGEST_BYTES) or b""
    beside = PurePosixPath(chosen.path)
    there = [beside.with_name(name).as_posix() for name in _empty_folders(chosen.folder.parent)]
    for path in dict.fromkeys((*there, *git_links)):
        name = PurePosixPath(path).name
        if re.search(rb"<\w*depend\b[^<>]*>\s*%s\s*<" % re.escape(os.fsencode(name)), text):
            why = f"{printable(path)}/ is empty here, and {MANIFEST} names {printable(name)}"
            yield f"{why}: if it is a repository of its own, {TAKE_IN.format(printable(path))}"


def _empty_folders(around: Path) -> list[str]:
    found: list[str] = []
    with suppress(OSError, SubmissionError):
        for below in islice(walk(around, tolerant=True), FOLDERS_OF_A_COPY):
            if "/" in below.path:
                break  # the nearest come first
            if not below.folders and not below.others:
                found.append(below.path)
    return found


def _above(candidate: Candidate) -> list[str]:
    return candidate.path.split("/")[:-1]


def _in_workspace(candidate: Candidate) -> bool:
    """Return whether it lies below the `src/` of a workspace: one with catkin's marks, or the submission itself."""
    parts = _above(candidate)
    root = candidate.folder.parents[len(parts)] if parts else candidate.folder
    for number, part in enumerate(parts):
        workspace = root.joinpath(*parts[:number])
        if part == "src" and (number == 0 or any(is_there(workspace / mark) for mark in WORKSPACE_MARKS)):
            return True
    return False


def _left_behind(chosen: Candidate, others: list[Candidate], wanted: WantedPackage) -> Iterator[str]:
    """Yield the lab's files that another copy has, and the one that is graded has not; each begins with its name."""
    missing = wanted.files - _files_of(chosen.folder, wanted.files)
    for other in others if missing else ():
        for name in sorted(missing & _files_of(other.folder, missing)):
            missing -= {name}
            where = f"{printable(other.path)}, which is not graded"
            yield f"{printable(name)} is in {where}: move it to {printable(chosen.path)}, into the same folder there"


def _in_another_package(chosen: Candidate, others: list[Candidate], wanted: WantedPackage) -> Iterator[str]:
    """Yield where other packages have the lab's files that the one which is graded lacks; each begins with its name.
    They are copied: those packages name them too, and would not build without them."""
    own = _files_of(chosen.folder, wanted.files)
    missing = wanted.files - own
    for other in others if missing else ():
        places = _places_of(other.folder, missing)
        for name, path in sorted(places.items()):
            there = f"{printable(other.path)}/{printable(path)}, in another package"
            fix = f"copy it to {printable(chosen.path)}/{printable(path)}"
            if name.endswith(".launch"):
                fix += _launch_changes(other, path, chosen, wanted)
            fix += (
                "" if own else f", or grade {printable(other.path)} with --package {shlex.quote(other.name)}"
            )
            yield f"{printable(name)} is at {there}: {fix}"
        missing -= places.keys()


def _outside_of_it(chosen: Candidate, wanted: WantedPackage) -> Iterator[str]:
    """Yield the lab's files that the package lacks and that lie beside its folder, or beside the `src/` of its
    workspace; each begins with its name."""
    missing = wanted.files - _files_of(chosen.folder, wanted.files)
    path = PurePosixPath(chosen.path)
    around = [path.parent] if path.parts else []
    around += [path.parent.parent] if path.parent.name == "src" else []
    for above in around:
        folder = chosen.folder.parents[path.parents.index(above)]
        taken = path.relative_to(above).parts[0]
        for name, there in sorted(_places_of(folder, missing, near=True, without=taken).items()):
            if "/" in there:
                missing -= {name}
                where, into = (printable(str(one / there)) for one in (above, path))
                yield f"{printable(name)} is at {where}, outside of the package: move it to {into}"


def _launch_changes(other: Candidate, path: str, chosen: Candidate, wanted: WantedPackage) -> str:
    """Return what to change in a launch file of another package: whose nodes it starts, and which are not there."""
    text = read_untrusted(other.folder / path, LARGEST_BYTES) or b""
    if f'"{other.name}"'.encode() not in text:
        return ""
    scripts = frozenset(name.decode("utf-8", "replace") for name in _SCRIPT_STARTED.findall(text))
    lacking = sorted(scripts - wanted.files - _files_of(chosen.folder, scripts))
    without = f" and without its <node> of {join_words(map(printable, lacking))}" if lacking else ""
    return f', with pkg="{printable(chosen.name)}" in it{without}'


_SCRIPT_STARTED = re.compile(rb"""\btype\s*=\s*["']([\w.-]+\.py)["']""")


def _files_of(folder: Path, names: frozenset[str], *, near: bool = False) -> frozenset[str]:
    """Return which of the lab's files are there by name, in whatever folder of the package; with `near`, only in those
    that a package has: what is deeper may be in another one, and the folder a workspace."""
    return frozenset(_places_of(folder, names, near=near))


def _places_of(
    folder: Path, names: frozenset[str], *, near: bool = False, without: str = ""
) -> dict[str, str]:
    """Return the paths of those files, the first of each name; if `near`, only those in usual folders, `without` one of
    these."""
    found: dict[str, str] = {}
    if names:
        for below in islice(walk(folder, tolerant=True), FOLDERS_OF_A_COPY):
            below.folders[:] = [name for name in below.folders if name not in BUILD_SPACES]
            if near:
                usual = USUAL_FOLDERS.intersection(below.folders) - {without}
                below.folders[:] = sorted(usual) if below.path == "." else []
            for entry in below.others:
                if entry.name in names:
                    found.setdefault(entry.name, below.inside(entry.name))
    return found


def _name_hint(chosen: Candidate, lab: WantedPackage) -> str:
    folder, wanted = printable(chosen.folder.name), lab.name
    if not chosen.has_manifest:
        why = "by its name" if _in_folder(chosen, wanted) else "because of the lab's files in it"
        return f"the folder {folder} has no {MANIFEST}: it was taken for the package {wanted} {why}"
    if chosen.manifest is None:
        return f"no name can be read from the {MANIFEST} in {folder}: the folder's name was taken instead"
    if chosen.manifest in (wanted, lab.asked):
        return ""
    name = printable(chosen.manifest)
    if _named_alike(chosen, wanted) or not _in_folder(chosen, wanted):
        return f"the package is named {name} in its {MANIFEST}, the lab asks for exactly {wanted}"
    return f"the folder {folder} was taken for {wanted}, but its {MANIFEST} names the package {name}"


def _ignored_hint(chosen: Candidate) -> str:
    if chosen.ignored_by is None:
        return ""
    marker = printable(chosen.ignored_by)
    return f"catkin does not see the package, because of the file {marker}: delete that file"


def not_found(
    root: Path,
    candidates: list[Candidate],
    wanted: WantedPackage,
    git_links: tuple[str, ...],
    *,
    modes_known: bool = True,
) -> PackageNotFound:
    """Return the error for a submission without the package; it says what is there instead, and what to do.
    `modes_known`: the disk tells which files are executable."""
    packages = sorted(
        (c for c in candidates if c.has_manifest),
        key=lambda c: (-len(_files_of(c.folder, wanted.files)), c.name),
    )
    names = list(dict.fromkeys(c.name for c in packages))
    here = f"packages here: {listing(names)}" if names else f"no {MANIFEST} was found"
    name = printable(wanted.asked or wanted.name)
    return PackageNotFound(
        f"there is no package {name} in this submission; {here}",
        hint=_where_it_went(root, wanted.asked or wanted.name, git_links)
        or _rename(root, packages, wanted, modes_known=modes_known),
    )


def _rename(root: Path, packages: list[Candidate], wanted: WantedPackage, *, modes_known: bool) -> str:
    # reversed, so that of several with one name the nearest stays
    seen = {c.name: c for c in reversed(packages) if c.ignored_by is None and encodable(c.path)}
    if wanted.asked and packages:
        return "Give one of these names with --package, or leave it out."
    name = printable(wanted.asked or wanted.name)
    if not seen:
        told = f"It is the folder whose {MANIFEST} says <name>{name}</name>"
        loose = loose_files(root, wanted.paths, modes_known=modes_known)
        made = f"`catkin_create_pkg {name} std_msgs rospy` makes it, to hold {loose}"
        return f"{told}: {made}." if loose else f"{told}: was it handed in (and pushed)?"
    counts = {c: len(_files_of(c.folder, wanted.files)) for c in seen.values()}
    only = max(counts, key=lambda c: counts[c])
    # it is sure if no other package has half as many of the lab's files
    is_only = len(counts) == 1 or sum(count * 2 >= max(1, counts[only]) for count in counts.values()) == 1
    name, named = only.name, named_at(only.folder, root=root)
    if not is_only or named is None:
        return (
            f"Was it handed in (and pushed)? If it is one of these, rename that to {wanted.name} "
            f"(<name> in its {MANIFEST}), or grade it with --package NAME."
        )
    manifest = MANIFEST if only.path == "." else f"{only.path}/{MANIFEST}"
    places = [
        f"<name>{wanted.name}</name> in {brief(manifest)}, line {named[1]}, in place of {brief(name)}",
        f"project({wanted.name}) in CMakeLists.txt",
        f'pkg="{wanted.name}" in each <node>',
    ]
    right = name_package(wanted.name, places)
    return f"{right[:1].upper()}{right[1:]}, or grade it with --package {shlex.quote(brief(name))}."


TAKE_IN = "delete {0}/.git, `git rm --cached {0}`, `git add {0}`, commit and push"
POINTER = "is only a pointer to another repository, and its files are not in this one: " + TAKE_IN


def _where_it_went(root: Path, wanted: str, git_links: tuple[str, ...], *, own: str = "") -> str:
    """Return what students do to a package so that it is there and cannot be seen; a file in place of a manifest hides
    none in its `own` folder, where the check of the manifest tells of it."""
    links = [path for path in git_links if path.rpartition("/")[2].casefold() == wanted.casefold()]
    # nothing else was handed in, so the package is behind one of the links, whatever its name
    if not links and not any(folder.others for folder in walk(root, tolerant=True)):
        links = list(git_links)
    if links:
        path = printable(links[0])
        return f"{path} {POINTER.format(path)}."
    for folder in walk(root, tolerant=True):
        files = {entry.name for entry in folder.others}
        if MANIFEST in files and manifest_name(root / folder.path, root=root) == wanted:
            return _hidden_place(folder.path)
        for entry in folder.others:
            if entry.name == wanted and entry.is_symlink():
                return f"{printable(folder.inside(wanted))} is a link: hand in the folder itself."
        meant = next(filter(None, map(meant_manifest, sorted(files - {MANIFEST}))), "")
        if (
            meant
            and folder.path != own
            and MANIFEST not in files
            and BUILD_SPACES.isdisjoint(folder.path.split("/"))
        ):
            where = "" if folder.path == "." else f"In {printable(folder.path)}/, "
            return f"{where}{printable(meant)}."
        packed = [entry.name for entry in folder.others if is_archive_name(entry.name)]
        if packed and folder.path == ".":
            return f"{printable(packed[0])} is here: unpack it, or give that file."
    return _empty_place(root, wanted)


def _empty_place(root: Path, wanted: str) -> str:
    """Return what an empty folder of the package's name shows: a submodule is one in a clone and in an archive."""
    for folder in walk(root, tolerant=True):
        if folder.path.rpartition("/")[2] == wanted and not folder.folders and not folder.others:
            path = printable(folder.path)
            return f"{path}/ is empty here; if it is a repository of its own: {TAKE_IN.format(path)}."
    return ""


def _hidden_place(path: str) -> str:
    parts = path.split("/")
    made = next((part for part in parts if part in BUILD_SPACES or part.startswith(".")), None)
    if made:
        return (
            f"{printable(path)} is only a copy in {printable(made)}/: hand in the package itself, from src/."
        )
    return f"{printable(path)} is below another {MANIFEST}, where catkin never looks: move it out."


FOLDERS_LOOKED_AT = 300
BYTES_READ = 64_000
SCRIPTS = (".py", ".sh")
PRINTS = re.compile(rb"""[ \t]*print[ \t]+(?:["']|[A-Za-z_][\w.]*[ \t]*(?:[,%]|$))""")
"""A line that begins with the `print` of Python 2."""


def loose_files(root: Path, paths: frozenset[str], *, modes_known: bool) -> str:
    """Return where most of the lab's files lie, with the folders of `paths` that they belong in, and what to do with
    them before they can be run: `publisher.py in week1/`; "" for nowhere. `modes_known`: the disk tells which of them
    are executable."""
    wanted = {
        PurePosixPath(path).name: str(PurePosixPath(path).parent) for path in sorted(paths, reverse=True)
    }
    wanted |= {name: "launch" for name, into in wanted.items() if name.endswith(".launch") and into == "."}
    names = wanted.keys()
    found = {
        folder.path: sorted(names & {entry.name for entry in folder.others})
        for folder in islice(walk(root, tolerant=True), FOLDERS_LOOKED_AT)
    }
    path = max(found, key=lambda path: len(found[path]), default="")
    if not path or not found[path]:
        return ""
    folder = root if path == "." else root / path
    where = "" if path == "." else f" in {printable(path)}/"
    belong = [_belong(found[path], wanted, into) for into in sorted({wanted[n] for n in found[path]} - {"."})]
    return "; ".join(
        [listing(found[path]) + where, *belong, *_repairs(folder, found[path], modes_known=modes_known)]
    )


def _belong(names: list[str], wanted: Mapping[str, str], folder: str) -> str:
    inside = [name for name in names if wanted[name] == folder]
    return f"{listing(inside)} {'belongs' if len(inside) == 1 else 'belong'} in the package's {printable(folder)}/"


def _repairs(folder: Path, names: list[str], *, modes_known: bool) -> Iterator[str]:
    texts = {name: read_untrusted(folder / name, BYTES_READ) or b"" for name in names}
    crlf = [name for name, text in texts.items() if re.match(rb"#![^\n]*\r\n", text)]
    if crlf:
        why = "cannot be started, because of Windows' line ends (CRLF)"
        yield f"{listing(crlf)} {why}: dos2unix {_them(crlf)} first"
    plain = [name for name in names if name.endswith(SCRIPTS) and _is_plain(folder / name)]
    if modes_known and plain:
        verb = "is" if len(plain) == 1 else "are"
        yield f"{listing(plain)} {verb} not executable: chmod +x {_them(plain)}"
    for name, line in ((name, _old_print(text)) for name, text in texts.items() if name.endswith(".py")):
        if line:
            yield f"line {line} of {printable(name)} prints as in Python 2: write print(…), with brackets"


def _them(names: list[str]) -> str:
    return "it" if len(names) == 1 else "them"


def _is_plain(path: Path) -> bool:
    """Return whether it is a file that may not be executed."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return False
    return stat.S_ISREG(mode) and not mode & stat.S_IXUSR


def _old_print(text: bytes) -> int:
    """Return the first line that prints as in Python 2, outside of texts between three quotes; 0 for none."""
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        if not inside and PRINTS.match(line):
            return number
        inside ^= (line.count(b'"""') + line.count(b"'''")) % 2 == 1
    return 0
