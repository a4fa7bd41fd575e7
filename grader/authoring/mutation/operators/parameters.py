"""Parameters that are not read, not set, or set with others."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import yaml

from grader.authoring.mutation.python_script import Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.rospy_code import argument, calls, text_literal
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.text_edits import Edit, misspelt_name, whole_lines


def _site(solution: Solution, script: Script, node: ast.AST, edit: Edit, name: str) -> Site:
    line = script.text.count("\n", 0, edit.start) + 1
    return Site(
        at={"script": script.path, "param": name.strip("/")},
        tree=solution.edited(script.path, [edit]),
        line=getattr(node, "lineno", line),
    )


def _accesses(solution: Solution, function: str) -> Iterator[tuple[Script, ast.Call, ast.Constant]]:
    """Calls of `get_param` or `set_param` whose name is written out."""
    for script in solution.scripts:
        for call in calls(script, function):
            name = text_literal(script, argument(call, 0, "param_name"))
            if name is not None:
                yield script, call, name


def param_path(script: Script, node: ast.AST) -> str:
    """The parameter that an expression reads, by calls, subscripts and variables; empty where it is none."""
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
        is_itself = len(values) == 1 and node not in set(ast.walk(values[0]))
        return param_path(script, values[0]) if is_itself and _is_deeper(values[0]) else ""
    return ""


def _is_deeper(value: ast.AST) -> bool:
    return isinstance(value, ast.Call | ast.Subscript)


@operator("parameter-not-read")
def parameter_not_read(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Writes the value of the YAML file into the script, and does not read the parameter.

    Fits every expression that reads a value of the package's YAML files.
    """
    values = {
        n: v for f in solution.files if f.endswith((".yaml", ".yml")) for n, _, v in leaves(solution.text(f))
    }
    for script in solution.scripts:
        for node in script.of(ast.expr):
            reads = _is_deeper(node) and not isinstance(getattr(node, "ctx", None), ast.Store | ast.Del)
            name = param_path(script, node) if reads else ""
            if name in values:
                value = yaml.safe_load(yaml.serialize(values[name]))
                yield _site(solution, script, node, script.replace(node, repr(value)), name)


@operator("parameter-misspelt")
def parameter_misspelt(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the parameter that it reads.

    Fits every rospy.get_param() whose parameter is written out.
    """
    for script, call, name in _accesses(solution, "get_param"):
        edit = script.replace(name, repr(misspelt_name(str(name.value))))
        yield _site(solution, script, call, edit, str(name.value))


@operator("parameter-not-set")
def parameter_not_set(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not set the parameter.

    Fits every statement rospy.set_param() whose parameter is written out.
    """
    for script, call, name in _accesses(solution, "set_param"):
        statement = script.statement(call)
        if isinstance(statement, ast.Expr):
            yield _site(solution, script, call, script.replace(statement, "pass"), str(name.value))


@operator("parameter-other-value")
def parameter_other_value(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sets the parameter to another value.

    Fits every rospy.set_param() whose parameter is written out.
    """
    for script, call, name in _accesses(solution, "set_param"):
        value = argument(call, 1, "param_value")
        if value is not None:
            yield _site(solution, script, call, script.replace(value, "12345"), str(name.value))


@operator("parameter-clobbered")
def parameter_clobbered(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sets a whole branch of parameters where one was meant, so that its neighbours are gone.

    Fits every rospy.set_param() of a parameter below another, written out.
    """
    for script, call, name in _accesses(solution, "set_param"):
        head, _, tail = str(name.value).rpartition("/")
        value = argument(call, 1, "param_value")
        if head.strip("/~") and value is not None and name in call.args:
            start, end = script.span(call.args[0])[0], script.span(value)[1]
            edit = Edit(start, end, f"{head!r}, {{{tail!r}: {script.source(value)}}}")
            yield _site(solution, script, call, edit, str(name.value))


@operator("parameter-set-elsewhere")
def parameter_set_elsewhere(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sets a parameter of another name.

    Fits every rospy.set_param() whose parameter is written out.
    """
    for script, call, name in _accesses(solution, "set_param"):
        edit = script.replace(name, repr(misspelt_name(str(name.value))))
        yield _site(solution, script, call, edit, str(name.value))


# [authoring.mutation.operators.yaml] Mistakes in YAML files of parameters.

Leaf = tuple[str, yaml.ScalarNode, yaml.ScalarNode]


def leaves(text: str) -> list[Leaf]:
    """Every value that is no map and no list: its key's path (`details/name/first`), the key, the value."""
    try:
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
    """Those that have a line for themselves, in block style."""
    return [leaf for leaf in leaves(text) if _has_line(text, *leaf[1:])]


def _has_line(text: str, key: yaml.ScalarNode, value: yaml.ScalarNode) -> bool:
    start = key.start_mark.index - key.start_mark.column
    end = text.find("\n", value.end_mark.index)
    after = text[value.end_mark.index : end if end >= 0 else len(text)].strip()
    return not text[start : key.start_mark.index].strip() and (not after or after.startswith("#"))


def _files(solution: Solution) -> Iterator[tuple[str, str]]:
    """The YAML files in plain ASCII or UTF-8 without a byte order mark, whose marks are places of the text."""
    for path in solution.files:
        if path.endswith((".yaml", ".yml")) and own_lines(solution.text(path)):
            yield path, solution.text(path)


@operator("yaml-tabs")
def yaml_tabs(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Indents the YAML file with a tab.

    Fits every YAML file with an indented key in a line of its own.
    """
    for path, text in _files(solution):
        for name, key, _ in own_lines(text):
            start = key.start_mark.index - key.start_mark.column
            if "/" in name and key.start_mark.column:
                edit = Edit(start, key.start_mark.index, "\t")
                yield Site(
                    at={"file": path}, tree=solution.edited(path, [edit]), line=key.start_mark.line + 1
                )
                break


@operator("yaml-malformed")
def yaml_malformed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves a quotation mark open in the YAML file.

    Fits every YAML file with a value in a line of its own.
    """
    for path, text in _files(solution):
        for _, _, value in own_lines(text)[:1]:
            start, end = value.start_mark.index, value.end_mark.index
            edit = Edit(start, end, f'"{value.value}')
            line = value.start_mark.line + 1
            yield Site(at={"file": path}, tree=solution.edited(path, [edit]), line=line)


@operator("yaml-key-missing")
def yaml_key_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets a key of the YAML file.

    Fits every value of a YAML file that has a line of its own.
    """
    for path, text in _files(solution):
        for name, key, value in own_lines(text):
            line_end = text.find("\n", value.end_mark.index)
            end = len(text) if line_end < 0 else line_end
            edit = Edit(*whole_lines(text, key.start_mark.index, end), "")
            yield Site(
                at={"file": path, "key": name},
                tree=solution.edited(path, [edit]),
                line=key.start_mark.line + 1,
            )


@operator("yaml-key-misspelt")
def yaml_key_misspelt(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells a key of the YAML file.

    Fits every value of a YAML file that has a line of its own.
    """
    for path, text in _files(solution):
        for name, key, _ in own_lines(text):
            edit = Edit(key.start_mark.index, key.end_mark.index, misspelt_name(str(key.value)))
            yield Site(
                at={"file": path, "key": name},
                tree=solution.edited(path, [edit]),
                line=key.start_mark.line + 1,
            )
