"""Mistakes in launch files, in the shell scripts that they start, and with the parameters that they load."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import yaml
from pydantic import Field

from grader.authoring.mutation.registry import Finder, operator
from grader.authoring.mutation.rospy_code import argument, calls, script_place, text_literal
from grader.authoring.mutation.solution import CodePlace, Solution
from grader.authoring.mutation.source_edits import (
    Document,
    Element,
    Script,
    TextEdit,
    misspelt_name,
    whole_lines,
)
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


@operator(each=_elements("node", "type"), fits="every node whose type ends in .py")
def launch_type_without_py(document: Document, node: Element) -> list[TextEdit]:
    """Leaves .py away in a node's type."""
    kind = node.attributes["type"]
    return [document.set_attribute(node, "type", kind.removesuffix(".py"))] if kind.endswith(".py") else []


@operator(each=_documents, fits="every launch file with a node")
def launch_malformed(document: Document) -> list[TextEdit]:
    """Forgets to close a node's tag."""
    for node in document.elements("node"):
        # an empty element has no closing tag that could be removed
        if document.data[node.inner - 2 : node.inner] == b"/>":
            return [TextEdit(node.inner - 2, node.inner, ">")]
        return [TextEdit(document.data.rfind(b"</", 0, node.end), node.end, "")]
    return []


@operator(
    each=_elements("node"), params=RemapParams, fits="every node of a launch file that starts two or more"
)
def launch_remapped_apart(document: Document, node: Element, params: RemapParams) -> list[TextEdit]:
    """Remaps a topic for one node only, so that the nodes miss each other."""
    remap = f'<remap from="{params.topic}" to="my_{params.topic}"/>'
    if len(document.elements("node")) < 2:
        return []
    if document.data[node.inner - 2 : node.inner] == b"/>":
        return [TextEdit(node.inner - 2, node.inner, f">{remap}</node>")]
    return [TextEdit(node.inner, node.inner, remap)]


@operator(each=_elements("node"), fits="every node of a launch file")
def launch_node_dropped(document: Document, node: Element) -> list[TextEdit]:
    """Does not start one of the nodes."""
    return [document.remove(node)]


@operator(each=_elements("node", "name"), fits="every node of a launch file with a name")
def launch_name_missing(document: Document, node: Element) -> list[TextEdit]:
    """Gives a node no name."""
    return [document.remove_attribute(node, "name")]


@operator(each=_elements("node", "name"), fits="every node of a launch file with a name")
def launch_name_changed(document: Document, node: Element) -> list[TextEdit]:
    """Gives a node another name in the launch file."""
    return [document.set_attribute(node, "name", f"my_{node.attributes['name']}")]


@operator(each=_elements("node", "pkg"), fits="every node of a launch file with a package")
def launch_pkg_misspelt(document: Document, node: Element) -> list[TextEdit]:
    """Misspells the package of a node."""
    return [document.set_attribute(node, "pkg", misspelt_name(node.attributes["pkg"]))]


@operator(each=_documents, fits="every launch file")
def launch_root_misspelt(document: Document) -> list[TextEdit]:
    """Begins the launch file with another tag than <launch>."""
    root = document.root
    close = document.data.rfind(b"</launch") if root is not None and root.tag == "launch" else -1
    if root is None or close < 0:
        return []
    # seven and eight letters on: `<` and `</`, then `launch`
    return [TextEdit(root.start + 1, root.start + 7, "lauch"), TextEdit(close + 2, close + 8, "lauch")]


@operator(each=_elements("param"), fits="every parameter of a launch file with a number as its value")
def launch_param_altered(document: Document, param: Element) -> list[TextEdit]:
    """Sets a parameter to another value."""
    value = param.attributes.get("value", "").strip()
    return [document.set_attribute(param, "value", str(int(value) + 1))] if value.isdigit() else []


@operator(each=_elements("param"), fits="every parameter of a launch file")
def launch_param_dropped(document: Document, param: Element) -> list[TextEdit]:
    """Does not set a parameter."""
    return [document.remove(param)]


@operator(
    each=_elements("rosparam", "file", named=False), fits="every <rosparam> of a launch file with a file"
)
def launch_load_dropped(document: Document, load: Element) -> list[TextEdit]:
    """Does not load the parameters' file."""
    return [document.remove(load)]


@operator(each=_matches(URL, ".sh", ".launch"), fits="every address in a launch file or a shell script")
def url_changed(_text: str, match: re.Match[str]) -> list[TextEdit]:
    """Opens another page."""
    return [TextEdit(*match.span(), "https://www.example.org/")]


@operator(each=_matches(FIREFOX, ".sh"), fits="every shell script with a line that runs firefox")
def command_dropped(text: str, match: re.Match[str]) -> list[TextEdit]:
    """Leaves the shell script without the command that opens the page."""
    return [TextEdit(*whole_lines(text, *match.span()), "")]


Leaf = tuple[str, yaml.ScalarNode, yaml.ScalarNode]
YAML = (".yaml", ".yml")

# ---- YAML files


def leaves(text: str) -> list[Leaf]:
    """Return every value that is neither map nor list: its key's path (`details/name/first`), the key, the value."""
    try:
        # composed, not loaded: nodes know where they stand in the text
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        return []
    return list(_leaves(node, "")) if node is not None else []


def _leaves(node: yaml.Node, path: str) -> Iterator[Leaf]:
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        name = f"{path}/{key.value}" if path else str(key.value)
        if isinstance(key, yaml.ScalarNode) and isinstance(value, yaml.ScalarNode):
            yield name, key, value
        else:
            yield from _leaves(value, name)


def own_lines(text: str) -> list[Leaf]:
    """Return the leaves that have a line for themselves, in block style."""
    return [leaf for leaf in leaves(text) if _has_line(text, *leaf[1:])]


def _has_line(text: str, key: yaml.ScalarNode, value: yaml.ScalarNode) -> bool:
    start = key.start_mark.index - key.start_mark.column
    after = text[value.end_mark.index : _line_end(text, value)].strip()
    return not text[start : key.start_mark.index].strip() and (not after or after.startswith("#"))


def _line_end(text: str, value: yaml.ScalarNode) -> int:
    return (text + "\n").index("\n", value.end_mark.index)


def _yaml_files(solution: Solution) -> Iterator[tuple[CodePlace, list[Leaf]]]:
    for path in solution.files:
        if path.endswith(YAML):
            yield CodePlace(path=path, at={"file": path}), own_lines(solution.text(path))


def _yaml_keys(solution: Solution) -> Iterator[tuple[CodePlace, str, yaml.ScalarNode, yaml.ScalarNode]]:
    for path in solution.files:
        text = solution.text(path)
        for name, key, value in own_lines(text) if path.endswith(YAML) else ():
            place = CodePlace(path=path, at={"file": path, "key": name}, line=key.start_mark.line + 1)
            yield place, text, key, value


@operator(each=_yaml_files, fits="every YAML file with an indented key in a line of its own")
def yaml_tabs(values: list[Leaf]) -> list[TextEdit]:
    """Indents the YAML file with a tab."""
    marks = [key.start_mark for name, key, _ in values if "/" in name and key.start_mark.column]
    # one tab makes the whole file unreadable
    return [TextEdit(mark.index - mark.column, mark.index, "\t") for mark in marks[:1]]


@operator(each=_yaml_files, fits="every YAML file with a value in a line of its own")
def yaml_malformed(values: list[Leaf]) -> list[TextEdit]:
    """Leaves a quotation mark open in the YAML file."""
    return [TextEdit(v.start_mark.index, v.end_mark.index, f'"{v.value}') for _, _, v in values[:1]]


@operator(each=_yaml_keys, fits="every value of a YAML file that has a line of its own")
def yaml_key_missing(text: str, key: yaml.ScalarNode, value: yaml.ScalarNode) -> list[TextEdit]:
    """Forgets a key of the YAML file."""
    return [TextEdit(*whole_lines(text, key.start_mark.index, _line_end(text, value)), "")]


@operator(each=_yaml_keys, fits="every value of a YAML file that has a line of its own")
def yaml_key_misspelt(_text: str, key: yaml.ScalarNode, _value: yaml.ScalarNode) -> list[TextEdit]:
    """Misspells a key of the YAML file."""
    return [TextEdit(key.start_mark.index, key.end_mark.index, misspelt_name(str(key.value)))]


# ---- scripts


def _accesses(function: str) -> Finder:
    """Return a finder of calls of `get_param` or `set_param` whose parameter is written out."""

    def find(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.Call, ast.Constant]]:
        for script in solution.scripts:
            for call in calls(script, function):
                name = text_literal(script, argument(call, 0, "param_name"))
                if name is not None:
                    yield script_place(script, call, param=str(name.value).strip("/")), script, call, name

    return find


def _reads(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.expr, yaml.Node]]:
    """Find the expressions that read a value of the package's YAML files."""
    values = {n: v for f in solution.files if f.endswith(YAML) for n, _, v in leaves(solution.text(f))}
    for script in solution.scripts:
        for node in script.of(ast.expr):
            reads = _is_deeper(node) and not isinstance(getattr(node, "ctx", None), ast.Store | ast.Del)
            name = param_path(script, node) if reads else ""
            if name in values:
                yield script_place(script, node, param=name), script, node, values[name]


def param_path(script: Script, node: ast.AST) -> str:
    """Return the parameter that an expression reads, by calls, subscripts and variables; "" where it is none."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        base = param_path(script, node.value)
        return f"{base}/{node.slice.value!s}" if base else ""
    if isinstance(node, ast.Call):
        read = [call for call in calls(script, "get_param") if call is node]
        name = text_literal(script, argument(read[0], 0, "param_name")) if read else None
        return str(name.value).strip("/") if name is not None else ""
    if isinstance(node, ast.Name | ast.Attribute):
        variable = ast.unparse(node)
        values = [a.value for a in script.of(ast.Assign) if variable in {ast.unparse(t) for t in a.targets}]
        # assigned once, and not in terms of itself: else its value depends on the way there
        is_itself = len(values) == 1 and node not in set(ast.walk(values[0]))
        return param_path(script, values[0]) if is_itself and _is_deeper(values[0]) else ""
    return ""


def _is_deeper(value: ast.AST) -> bool:
    return isinstance(value, ast.Call | ast.Subscript)


@operator(each=_reads, fits="every expression that reads a value of the package's YAML files")
def parameter_not_read(script: Script, node: ast.expr, value: yaml.Node) -> list[TextEdit]:
    """Writes the value of the YAML file into the script, and does not read the parameter."""
    return [script.replace(node, repr(yaml.safe_load(yaml.serialize(value))))]


@operator(each=_accesses("get_param"), fits="every rospy.get_param() whose parameter is written out")
def parameter_misspelt(script: Script, _call: ast.Call, name: ast.Constant) -> list[TextEdit]:
    """Misspells the parameter that it reads."""
    return [script.replace(name, repr(misspelt_name(str(name.value))))]


@operator(
    each=_accesses("set_param"), fits="every statement rospy.set_param() whose parameter is written out"
)
def parameter_not_set(script: Script, call: ast.Call, _name: ast.Constant) -> list[TextEdit]:
    """Does not set the parameter."""
    statement = script.statement(call)
    return [script.replace(statement, "pass")] if isinstance(statement, ast.Expr) else []


@operator(each=_accesses("set_param"), fits="every rospy.set_param() whose parameter is written out")
def parameter_other_value(script: Script, call: ast.Call, _name: ast.Constant) -> list[TextEdit]:
    """Sets the parameter to another value."""
    value = argument(call, 1, "param_value")
    return [script.replace(value, "12345")] if value is not None else []


@operator(
    each=_accesses("set_param"), fits="every rospy.set_param() of a parameter below another, written out"
)
def parameter_clobbered(script: Script, call: ast.Call, name: ast.Constant) -> list[TextEdit]:
    """Sets a whole branch of parameters where one was meant, so that its neighbours are gone."""
    head, _, tail = str(name.value).rpartition("/")
    value = argument(call, 1, "param_value")
    # a private name has no branch above it, and a keyword cannot be replaced with what follows it
    if not head.strip("/~") or value is None or name not in call.args:
        return []
    start, end = script.span(call.args[0])[0], script.span(value)[1]
    return [TextEdit(start, end, f"{head!r}, {{{tail!r}: {script.source(value)}}}")]


@operator(each=_accesses("set_param"), fits="every rospy.set_param() whose parameter is written out")
def parameter_set_elsewhere(script: Script, _call: ast.Call, name: ast.Constant) -> list[TextEdit]:
    """Sets a parameter of another name."""
    return [script.replace(name, repr(misspelt_name(str(name.value))))]
