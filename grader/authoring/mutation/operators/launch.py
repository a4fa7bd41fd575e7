"""Mistakes in launch files, and in the shell scripts that they start."""

from __future__ import annotations

import re
from collections.abc import Iterator

from pydantic import Field

from grader.authoring.mutation.registry import Finder, operator
from grader.authoring.mutation.solution import CodePlace, Solution
from grader.authoring.mutation.source_edits import Document, Edit, Element, misspelt_name, whole_lines
from grader.model.record import Record

URL = re.compile(r"""https?://[^\s"'<>]+""")
FIREFOX = re.compile(r"^[ \t]*firefox\b.*$", re.MULTILINE)


class RemapParams(Record):
    """`topic`: what is remapped for one node only."""

    topic: str = Field(default="chatter", min_length=1)


def _elements(tag: str, *needed: str, named: bool = True) -> Finder:
    """Return a finder of the elements with this tag and these attributes."""

    def find(solution: Solution) -> Iterator[tuple[CodePlace, Document, Element]]:
        for document in solution.launch_files:
            for element in document.elements(tag):
                if set(needed) <= element.attributes.keys():
                    name = element.attributes.get("name") or element.attributes.get("type") or tag
                    at = {"file": document.path, **({tag: name} if named else {})}
                    line = document.line(element)
                    yield CodePlace(path=document.path, at=at, line=line, xml=document), document, element

    return find


def _documents(solution: Solution) -> Iterator[tuple[CodePlace, Document]]:
    for document in solution.launch_files:
        yield CodePlace(path=document.path, at={"file": document.path}, xml=document), document


def _matches(pattern: re.Pattern[str], *endings: str) -> Finder:
    """Return a finder of what fits the pattern in files with these endings."""

    def find(solution: Solution) -> Iterator[tuple[CodePlace, str, re.Match[str]]]:
        for path in (path for path in solution.files if path.endswith(endings)):
            text = solution.text(path)
            for match in pattern.finditer(text):
                yield CodePlace(path=path, at={"file": path}), text, match

    return find


@operator("launch-type-without-py", each=_elements("node", "type"))
def launch_type_without_py(document: Document, node: Element) -> list[Edit]:
    """Leaves .py away in a node's type.

    Fits every node whose type ends in .py.
    """
    kind = node.attributes["type"]
    return [document.set_attribute(node, "type", kind.removesuffix(".py"))] if kind.endswith(".py") else []


@operator("launch-malformed", each=_documents)
def launch_malformed(document: Document) -> list[Edit]:
    """Forgets to close a node's tag.

    Fits every launch file with a node.
    """
    for node in document.elements("node"):
        if document.data[node.inner - 2 : node.inner] == b"/>":
            return [Edit(node.inner - 2, node.inner, ">")]
        return [Edit(document.data.rfind(b"</", 0, node.end), node.end, "")]
    return []


@operator("launch-remapped-apart", each=_elements("node"), params=RemapParams)
def launch_remapped_apart(document: Document, node: Element, params: RemapParams) -> list[Edit]:
    """Remaps a topic for one node only, so that the nodes miss each other.

    Fits every node of a launch file that starts two or more.
    """
    remap = f'<remap from="{params.topic}" to="my_{params.topic}"/>'
    if len(document.elements("node")) < 2:
        return []
    if document.data[node.inner - 2 : node.inner] == b"/>":
        return [Edit(node.inner - 2, node.inner, f">{remap}</node>")]
    return [Edit(node.inner, node.inner, remap)]


@operator("launch-node-dropped", each=_elements("node"))
def launch_node_dropped(document: Document, node: Element) -> list[Edit]:
    """Does not start one of the nodes.

    Fits every node of a launch file.
    """
    return [document.remove(node)]


@operator("launch-name-missing", each=_elements("node", "name"))
def launch_name_missing(document: Document, node: Element) -> list[Edit]:
    """Gives a node no name.

    Fits every node of a launch file with a name.
    """
    return [document.remove_attribute(node, "name")]


@operator("launch-name-changed", each=_elements("node", "name"))
def launch_name_changed(document: Document, node: Element) -> list[Edit]:
    """Gives a node another name in the launch file.

    Fits every node of a launch file with a name.
    """
    return [document.set_attribute(node, "name", f"my_{node.attributes['name']}")]


@operator("launch-pkg-misspelt", each=_elements("node", "pkg"))
def launch_pkg_misspelt(document: Document, node: Element) -> list[Edit]:
    """Misspells the package of a node.

    Fits every node of a launch file with a package.
    """
    return [document.set_attribute(node, "pkg", misspelt_name(node.attributes["pkg"]))]


@operator("launch-root-misspelt", each=_documents)
def launch_root_misspelt(document: Document) -> list[Edit]:
    """Begins the launch file with another tag than <launch>.

    Fits every launch file.
    """
    root = document.root
    close = document.data.rfind(b"</launch") if root is not None and root.tag == "launch" else -1
    if root is None or close < 0:
        return []
    return [Edit(root.start + 1, root.start + 7, "lauch"), Edit(close + 2, close + 8, "lauch")]


@operator("launch-param-altered", each=_elements("param"))
def launch_param_altered(document: Document, param: Element) -> list[Edit]:
    """Sets a parameter to another value.

    Fits every parameter of a launch file with a number as its value.
    """
    value = param.attributes.get("value", "").strip()
    return [document.set_attribute(param, "value", str(int(value) + 1))] if value.isdigit() else []


@operator("launch-param-dropped", each=_elements("param"))
def launch_param_dropped(document: Document, param: Element) -> list[Edit]:
    """Does not set a parameter.

    Fits every parameter of a launch file.
    """
    return [document.remove(param)]


@operator("launch-load-dropped", each=_elements("rosparam", "file", named=False))
def launch_load_dropped(document: Document, load: Element) -> list[Edit]:
    """Does not load the parameters' file.

    Fits every <rosparam> of a launch file with a file.
    """
    return [document.remove(load)]


@operator("url-changed", each=_matches(URL, ".sh", ".launch"))
def url_changed(_text: str, match: re.Match[str]) -> list[Edit]:
    """Opens another page.

    Fits every address in a launch file or a shell script.
    """
    return [Edit(*match.span(), "https://www.example.org/")]


@operator("command-dropped", each=_matches(FIREFOX, ".sh"))
def command_dropped(text: str, match: re.Match[str]) -> list[Edit]:
    """Leaves the shell script without the command that opens the page.

    Fits every shell script with a line that runs firefox.
    """
    return [Edit(*whole_lines(text, *match.span()), "")]
