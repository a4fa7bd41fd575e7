"""The correct package of a lab: where it is, and its files in memory as operators see and change them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePosixPath

import cmake_parser
from cmake_parser.ast import Command
from cmake_parser.error import CMakeParseError

from grader.authoring.mutation.package_tree import Tree, TreeFile, read_tree
from grader.authoring.mutation.source_edits import Document, Script, TextEdit, apply_edits, line_at
from grader.errors import UsageError
from grader.model.package import CMAKE, MANIFEST
from grader.rubric.find import rubrics_folder
from grader.rubric.load import LoadedRubric

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
        return tuple(name for name in self.files if self.entry(name).data.startswith(b"#!"))

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
    manifests = sorted(
        (p for p in tree if PurePosixPath(p).name == MANIFEST), key=lambda p: (p.count("/"), p)
    )
    for path in manifests:
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
