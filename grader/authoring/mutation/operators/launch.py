"""Mistakes in launch files, and in the shell scripts that they start."""

from __future__ import annotations

import re
from collections.abc import Iterator

from pydantic import Field

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.text_edits import Edit, misspelt_name, whole_lines
from grader.authoring.mutation.xml_document import Document, Element
from grader.model.record import Record

URL = re.compile(r"""https?://[^\s"'<>]+""")


class RemapParams(Record):
    """`topic`: what is remapped for one node only."""

    topic: str = Field(default="chatter", min_length=1)


def _nodes(solution: Solution, *needed: str) -> Iterator[tuple[Document, Element]]:
    """Every `<node>` that has these attributes."""
    for document in solution.launch_files:
        for node in document.elements("node"):
            if set(needed) <= node.attributes.keys():
                yield document, node


def _site(solution: Solution, document: Document, element: Element, *edits: Edit, **at: str) -> Site:
    shown = element.attributes.get("name") or element.attributes.get("type") or element.tag
    key = at or {element.tag: shown}
    return Site(
        at={"file": document.path, **key},
        tree=solution.edited_xml(document, edits),
        line=document.line(element),
    )


@operator("launch-type-without-py")
def launch_type_without_py(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves .py away in a node's type.

    Fits every node whose type ends in .py.
    """
    for document, node in _nodes(solution, "type"):
        kind = node.attributes["type"]
        if kind.endswith(".py"):
            edit = document.set_attribute(node, "type", kind.removesuffix(".py"))
            yield _site(solution, document, node, edit)


@operator("launch-malformed")
def launch_malformed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to close a node's tag.

    Fits every launch file with a node.
    """
    for document in solution.launch_files:
        for node in document.elements("node")[:1]:
            closed_itself = document.data[node.inner - 2 : node.inner] == b"/>"
            end = node.inner if closed_itself else node.end
            start = end - 2 if closed_itself else document.data.rfind(b"</", 0, end)
            edit = Edit(start, end, ">" if closed_itself else "")
            yield Site(
                at={"file": document.path},
                tree=solution.edited_xml(document, [edit]),
                line=document.line(node),
            )


@operator("launch-remapped-apart", params=RemapParams)
def launch_remapped_apart(solution: Solution, params: RemapParams) -> Iterator[Site]:
    """Remaps a topic for one node only, so that the nodes miss each other.

    Fits every node of a launch file that starts two or more.
    """
    remap = f'<remap from="{params.topic}" to="my_{params.topic}"/>'
    for document, node in _nodes(solution):
        if len(document.elements("node")) < 2:
            continue
        if document.data[node.inner - 2 : node.inner] == b"/>":
            edit = Edit(node.inner - 2, node.inner, f">{remap}</node>")
        else:
            edit = Edit(node.inner, node.inner, remap)
        yield _site(solution, document, node, edit)


@operator("launch-node-dropped")
def launch_node_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not start one of the nodes.

    Fits every node of a launch file.
    """
    for document, node in _nodes(solution):
        yield _site(solution, document, node, document.remove(node))


@operator("launch-name-missing")
def launch_name_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives a node no name.

    Fits every node of a launch file with a name.
    """
    for document, node in _nodes(solution, "name"):
        yield _site(solution, document, node, document.remove_attribute(node, "name"))


@operator("launch-name-changed")
def launch_name_changed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives a node another name in the launch file.

    Fits every node of a launch file with a name.
    """
    for document, node in _nodes(solution, "name"):
        edit = document.set_attribute(node, "name", f"my_{node.attributes['name']}")
        yield _site(solution, document, node, edit)


@operator("launch-pkg-misspelt")
def launch_pkg_misspelt(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the package of a node.

    Fits every node of a launch file with a package.
    """
    for document, node in _nodes(solution, "pkg"):
        edit = document.set_attribute(node, "pkg", misspelt_name(node.attributes["pkg"]))
        yield _site(solution, document, node, edit)


@operator("launch-root-misspelt")
def launch_root_misspelt(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Begins the launch file with another tag than <launch>.

    Fits every launch file.
    """
    for document in solution.launch_files:
        root = document.root
        close = document.data.rfind(b"</launch") if root is not None and root.tag == "launch" else -1
        if root is not None and close >= 0:
            edits = [Edit(root.start + 1, root.start + 7, "lauch"), Edit(close + 2, close + 8, "lauch")]
            yield Site(at={"file": document.path}, tree=solution.edited_xml(document, edits), line=1)


@operator("launch-param-altered")
def launch_param_altered(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sets a parameter to another value.

    Fits every parameter of a launch file with a number as its value.
    """
    for document in solution.launch_files:
        for element in document.elements("param"):
            value = element.attributes.get("value", "")
            if value.strip().isdigit():
                edit = document.set_attribute(element, "value", str(int(value) + 1))
                yield _site(solution, document, element, edit)


@operator("launch-param-dropped")
def launch_param_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not set a parameter.

    Fits every parameter of a launch file.
    """
    for document in solution.launch_files:
        for element in document.elements("param"):
            yield _site(solution, document, element, document.remove(element))


@operator("launch-load-dropped")
def launch_load_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not load the parameters' file.

    Fits every <rosparam> of a launch file with a file.
    """
    for document in solution.launch_files:
        for element in document.elements("rosparam"):
            if "file" in element.attributes:
                edit = document.remove(element)
                yield Site(
                    at={"file": document.path},
                    tree=solution.edited_xml(document, [edit]),
                    line=document.line(element),
                )


@operator("url-changed")
def url_changed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Opens another page.

    Fits every address in a launch file or a shell script.
    """
    for path in solution.files:
        if path.endswith((".sh", ".launch")):
            for match in URL.finditer(solution.text(path)):
                edit = Edit(*match.span(), "https://www.example.org/")
                line = solution.text(path).count("\n", 0, match.start()) + 1
                yield Site(at={"file": path}, tree=solution.edited(path, [edit]), line=line)


@operator("command-dropped")
def command_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves the shell script without the command that opens the page.

    Fits every shell script with a line that runs firefox.
    """
    for path in solution.files:
        text = solution.text(path) if path.endswith(".sh") else ""
        for match in re.finditer(r"^[ \t]*firefox\b.*$", text, re.MULTILINE):
            edit = Edit(*whole_lines(text, *match.span()), "")
            line = text.count("\n", 0, match.start()) + 1
            yield Site(at={"file": path}, tree=solution.edited(path, [edit]), line=line)
