"""Mistakes in YAML files of parameters."""

from __future__ import annotations

from collections.abc import Iterator

import yaml

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit, whole_lines
from grader.authoring.mutation.words import misspelt_name

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
