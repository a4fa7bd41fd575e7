"""The correct package of a lab: where it is, and its files in memory as operators see and change them.

A `Tree` is a folder of files in memory, with the differences between two of them and the way back to the disk.
"""

from __future__ import annotations

import difflib
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePosixPath

import cmake_parser
from cmake_parser.ast import Command
from cmake_parser.error import CMakeParseError

from grader.authoring.mutation.source_edits import Document, Script, TextEdit, apply_edits, line_at
from grader.errors import UsageError
from grader.model.package import CMAKE, MANIFEST
from grader.rubric.find import rubrics_folder
from grader.rubric.load import LoadedRubric

IGNORED = frozenset({"__pycache__", ".git", ".DS_Store", ".vscode", ".idea"})
MAX_FILES = 5_000
MAX_BYTES = 50_000_000
SHEBANG = b"#!"


@dataclass(frozen=True, kw_only=True)
class TreeFile:
    """One file; `link` is the target of a symbolic link, whose `data` is empty."""

    data: bytes
    executable: bool = False
    link: str | None = None


Tree = dict[str, TreeFile]


def read_tree(folder: Path, *, modes: bool = True) -> Tree:
    """Return every file below `folder`, by its posix path.

    Without `modes`, the folder cannot be trusted to have kept executable bits (an installed wheel's data): then
    what begins with a shebang is executable. Raises UsageError for a folder that no reference solution would be.
    """
    tree: Tree = {}
    size = 0
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if IGNORED & set(name.parts) or (path.is_dir() and not path.is_symlink()):
            continue
        entry = _entry(path, modes=modes)
        if entry is None:
            continue
        size += len(entry.data)
        tree[name.as_posix()] = entry
        if len(tree) > MAX_FILES or size > MAX_BYTES:
            raise UsageError(
                f"{folder} holds more than a package: over {MAX_FILES} files or {MAX_BYTES // 1_000_000} MB",
                hint="give the folder of the correct package with --solution",
            )
    return tree


def _entry(path: Path, *, modes: bool) -> TreeFile | None:
    try:
        if path.is_symlink():
            return TreeFile(data=b"", link=path.readlink().as_posix())
        if not path.is_file():
            return None
        data = path.read_bytes()
        executable = bool(path.stat().st_mode & 0o100) if modes else data.startswith(SHEBANG)
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    return TreeFile(data=data, executable=executable)


def write_tree(tree: Tree, folder: Path) -> None:
    """Replace `folder` by the tree."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, entry in tree.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if entry.link is not None:
            path.symlink_to(entry.link)
        else:
            path.write_bytes(entry.data)
            path.chmod(0o755 if entry.executable else 0o644)


def unified_diff(before: Tree, after: Tree) -> str:
    """Return the changes as a unified diff; modes, line ends and moves are said in git's words."""
    changed = (name for name in sorted(before.keys() | after.keys()) if before.get(name) != after.get(name))
    return "".join(line for name in changed for line in _file_diff(name, before, after))


def _file_diff(name: str, before: Tree, after: Tree) -> Iterator[str]:
    old, new = before.get(name), after.get(name)
    yield f"diff a/{name} b/{name}\n"
    if old is None or new is None:
        yield "new file\n" if old is None else "deleted file\n"
    elif old.executable != new.executable:
        yield f"old mode {_mode(old)}\nnew mode {_mode(new)}\n"
    yield from difflib.unified_diff(
        _lines(old),
        _lines(new),
        fromfile=f"a/{name}" if old else "/dev/null",
        tofile=f"b/{name}" if new else "/dev/null",
    )


def _mode(entry: TreeFile) -> str:
    return "100755" if entry.executable else "100644"


def _lines(entry: TreeFile | None) -> list[str]:
    """Return the lines, each with one `\\n`; what a reader cannot see is written out."""
    if entry is None:
        return []
    text = entry.data.decode(errors="replace").replace("\r", "^M").replace("\ufeff", "<BOM>")
    return [f"{line}\n" for line in text.removesuffix("\n").split("\n")] if text else []


BUILT = frozenset({"build", "devel", "install"})
PYTHON_SHEBANG = re.compile(rb"#!\s*\S*(?:python|env +python)")


@dataclass(frozen=True, kw_only=True)
class Site:
    """One place where an operator fits. `at` tells it from the others; `tree` is the mutant made there."""

    at: Mapping[str, str | int]
    tree: Tree
    line: int | None = None


Change = Sequence[TextEdit] | bytes | Tree | None
"""What an operator makes of a place: edits of the file, its new content, or a whole new tree; None for nothing."""


@dataclass(frozen=True, kw_only=True)
class CodePlace:
    """A place that an operator may change. `at` tells it from the others; without `line`, the first edit does.

    Positions in an XML file count bytes, those in any other file characters: `xml` is the file's document.
    """

    path: str
    at: Mapping[str, str | int]
    line: int | None = None
    xml: Document | None = None

    def site(self, solution: Solution, change: Sequence[TextEdit] | bytes | Tree) -> Site:
        """Return the mutant that is made here."""
        line = self.line
        if isinstance(change, bytes):
            tree = solution.with_data(self.path, change)
        elif isinstance(change, dict):
            tree = change
        elif self.xml is not None:
            tree = solution.edited_xml(self.xml, change)
        else:
            tree = solution.edited(self.path, change)
            line = line or line_at(solution.text(self.path), min(change).start)
        return Site(at=self.at, tree=tree, line=line)


@dataclass(frozen=True, kw_only=True)
class Solution:
    """`folder` is the package's folder within the tree, empty or ending in a slash. All paths of files that are
    given and taken are relative to it."""

    tree: Tree
    folder: str
    name: str

    # ---- what is there

    @cached_property
    def files(self) -> tuple[str, ...]:
        """The package's own files; what a build left is none."""
        inside = [name.removeprefix(self.folder) for name in self.tree if name.startswith(self.folder)]
        return tuple(sorted(name for name in inside if PurePosixPath(name).parts[0] not in BUILT))

    def entry(self, path: str) -> TreeFile:
        return self.tree[self.folder + path]

    def text(self, path: str) -> str:
        return self.entry(path).data.decode(errors="surrogateescape")

    @cached_property
    def programs(self) -> tuple[str, ...]:
        """The files that begin with a shebang."""
        return tuple(name for name in self.files if self.entry(name).data.startswith(SHEBANG))

    @cached_property
    def scripts(self) -> tuple[Script, ...]:
        """The Python files that compile."""
        return tuple(script for name in self.files if self._is_python(name) if (script := self._script(name)))

    def _is_python(self, name: str) -> bool:
        return name.endswith(".py") or bool(PYTHON_SHEBANG.match(self.entry(name).data))

    def _script(self, name: str) -> Script | None:
        try:
            script = Script(name, self.text(name))
        except (SyntaxError, ValueError, RecursionError):
            return None
        return script if script.module.body else None

    @cached_property
    def manifest(self) -> Document | None:
        return self._document(MANIFEST) if MANIFEST in self.files else None

    @cached_property
    def launch_files(self) -> tuple[Document, ...]:
        names = [name for name in self.files if name.endswith(".launch")]
        return tuple(document for name in names if (document := self._document(name)) is not None)

    def _document(self, name: str) -> Document | None:
        try:
            return Document(name, self.entry(name).data)
        except ValueError:
            return None

    @cached_property
    def cmake(self) -> tuple[Command, ...]:
        """The commands of the package's CMakeLists.txt."""
        if CMAKE not in self.files:
            return ()
        try:
            found = list(cmake_parser.parse_raw(self.text(CMAKE), skip_comments=True))
        except CMakeParseError:
            return ()
        return tuple(command for command in found if isinstance(command, Command))

    def cmake_calls(self, *names: str) -> Iterator[Command]:
        return (command for command in self.cmake if command.identifier.lower() in names)

    # ---- what is made of it

    def with_entry(self, path: str, entry: TreeFile) -> Tree:
        return {**self.tree, self.folder + path: entry}

    def with_data(self, path: str, data: bytes) -> Tree:
        return self.with_entry(path, replace(self.entry(path), data=data))

    def moved(self, old: str, new: str) -> Tree:
        rest = {name: entry for name, entry in self.tree.items() if name != self.folder + old}
        return {**rest, self.folder + new: self.entry(old)}

    def without(self, path: str) -> Tree:
        return {name: entry for name, entry in self.tree.items() if name != self.folder + path}

    def edited(self, path: str, edits: Sequence[TextEdit]) -> Tree:
        """Return the tree with edits in one text file."""
        text = apply_edits(self.text(path), edits)
        return self.with_data(path, text.encode(errors="surrogateescape"))

    def edited_xml(self, document: Document, edits: Sequence[TextEdit]) -> Tree:
        """Return the same for XML, whose places count bytes; what the edits insert is written as UTF-8."""
        wide = [TextEdit(e.start, e.end, e.text.encode().decode("latin-1")) for e in edits]
        return self.with_data(document.path, apply_edits(document.text, wide).encode("latin-1"))

    def then(self, tree: Tree) -> Solution:
        return replace(self, tree=tree)

    def in_folder(self) -> Solution:
        """Return the same, with all files in a folder of the package's name."""
        folder = f"{self.name}/"
        return replace(
            self, tree={folder + name: file for name, file in self.tree.items()}, folder=folder + self.folder
        )


# ---- where a lab's correct package is

REFERENCES = "reference_solutions"


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A correct package's folder. `modes` is False where its executable bits cannot be trusted."""

    folder: Path
    modes: bool = True


def references_folder() -> Path:
    """Return the folder of the reference solutions that come with the grader."""
    return rubrics_folder().parent / REFERENCES


def find_reference(rubric: LoadedRubric) -> Reference:
    """Return the rubric's reference solution. Raises UsageError where there is none.

    A checkout has its executable bits from git. A wheel is unpacked by installers that need not keep them: there,
    what begins with a shebang is executable.
    """
    name = rubric.rubric.id
    own = rubric.path.absolute().parent.parent / REFERENCES / name
    if own.is_dir() and own.parent != references_folder():
        return Reference(folder=own)
    shipped = references_folder() / name
    if shipped.is_dir():
        return Reference(folder=shipped, modes=shipped.parent.parent.name != "_data")
    raise UsageError(
        f"there is no reference solution for {name}",
        hint="give the folder of a correct package with --solution",
    )


def reference_at(folder: Path) -> Reference:
    """Return the user's own correct package. Raises UsageError where it is not a folder."""
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder", hint="--solution takes the folder of a correct package")
    return Reference(folder=folder)


def load_solution(reference: Reference, package: str) -> Solution:
    """Return the package of that name within the folder. Raises UsageError where it is not there."""
    tree = read_tree(reference.folder, modes=reference.modes)
    manifests = (path for path in tree if PurePosixPath(path).name == MANIFEST)
    for path in sorted(manifests, key=lambda path: (path.count("/"), path)):
        if _name(tree, path).lower() == package.lower():
            return Solution(tree=tree, folder=path.removesuffix(MANIFEST), name=package)
    raise UsageError(
        f"there is no package {package} in {reference.folder}",
        hint="a solution's package.xml has to name the package of the rubric",
    )


def _name(tree: Tree, path: str) -> str:
    try:
        document = Document(path, tree[path].data)
    except ValueError:
        return ""
    return next((document.content(e) for e in document.elements("name") if e.parent is document.root), "")
