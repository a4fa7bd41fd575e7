"""Mistakes in package.xml."""

from __future__ import annotations

import re
from collections.abc import Iterator

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import CMAKE, MANIFEST, Site, Solution
from grader.authoring.mutation.spans import Edit
from grader.authoring.mutation.xml import Document, Element

DEPENDENCIES = ("depend", "build_depend", "build_export_depend", "exec_depend", "run_depend")


def _elements(solution: Solution, *tags: str) -> Iterator[tuple[Document, Element]]:
    manifest = solution.manifest
    if manifest is not None:
        yield from ((manifest, element) for element in manifest.elements(*tags))


def _site(solution: Solution, manifest: Document, element: Element, edit: Edit, **at: str) -> Site:
    return Site(at=at, tree=solution.edited_xml(manifest, [edit]), line=manifest.line(element))


@operator("dependency-dropped")
def dependency_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not declare a package that the nodes need.

    Fits every dependency of package.xml but catkin.
    """
    found = list(_elements(solution, *DEPENDENCIES))
    for name in sorted({manifest.content(element) for manifest, element in found} - {"catkin", ""}):
        edits = [manifest.remove(element) for manifest, element in found if manifest.content(element) == name]
        yield Site(at={"dependency": name}, tree=solution.edited_xml(found[0][0], edits))


@operator("manifest-renamed")
def manifest_renamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives package.xml another name than the rest of the package.

    Fits every package.xml with a name.
    """
    for manifest, element in _elements(solution, "name"):
        edit = manifest.set_content(element, f"{manifest.content(element)}_pkg")
        yield _site(solution, manifest, element, edit)


@operator("package-renamed")
def package_renamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives the package another name, in all of its files alike.

    Fits every package.
    """
    if MANIFEST not in solution.files:
        return
    word = re.compile(rf"(?<![\w/.-]){re.escape(solution.name)}(?![\w.-])".encode())
    tree = dict(solution.tree)
    for path in (MANIFEST, CMAKE, *(d.path for d in solution.launch_files)):
        if path in solution.files:
            data = word.sub(f"my_{solution.name}".encode(), solution.entry(path).data)
            tree |= {solution.folder + path: solution.with_data(path, data)[solution.folder + path]}
    yield Site(at={}, tree=tree)


@operator("manifest-malformed")
def manifest_malformed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to close a tag in package.xml.

    Fits every package.xml with a description.
    """
    for manifest, element in list(_elements(solution, "description"))[:1]:
        close = manifest.data.rfind(b"</", element.inner, element.end)
        if close >= 0:
            yield _site(solution, manifest, element, Edit(close, element.end, ""))


@operator("buildtool-dropped")
def buildtool_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not name catkin as the build tool.

    Fits every package.xml with a buildtool_depend.
    """
    for manifest, element in list(_elements(solution, "buildtool_depend"))[:1]:
        yield _site(solution, manifest, element, manifest.remove(element))


@operator("email-left")
def email_left(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves the maintainer's e-mail address as catkin_create_pkg wrote it.

    Fits every maintainer with an address.
    """
    for manifest, element in list(_elements(solution, "maintainer"))[:1]:
        if "email" in element.attributes:
            edit = manifest.set_attribute(element, "email", "user@todo.todo")
            yield _site(solution, manifest, element, edit)
