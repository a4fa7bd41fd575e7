"""Names of nodes."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.authoring.mutation.python import Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import argument, calls, text_literal
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit


def _site(solution: Solution, script: Script, call: ast.Call, edit: Edit) -> Site:
    return Site(at={"script": script.path}, tree=solution.edited(script.path, [edit]), line=call.lineno)


def _anonymous(call: ast.Call) -> ast.keyword | None:
    return next((k for k in call.keywords if k.arg == "anonymous"), None)


def _is_anonymous(call: ast.Call) -> bool:
    keyword = _anonymous(call)
    return keyword is not None and isinstance(keyword.value, ast.Constant) and bool(keyword.value.value)


@operator("name-changed")
def name_changed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives the node another name.

    Fits every script with a node whose name is written out.
    """
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            name = text_literal(script, argument(call, 0, "name"))
            if name is not None:
                yield _site(solution, script, call, script.replace(name, repr(f"my_{name.value!s}")))


@operator("not-anonymous")
def not_anonymous(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves `anonymous=True` away.

    Fits every script with an anonymous node.
    """
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            keyword = _anonymous(call)
            if keyword is not None and _is_anonymous(call):
                yield _site(solution, script, call, script.replace(keyword.value, "False"))


@operator("made-anonymous")
def made_anonymous(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Makes the node anonymous where its plain name is asked for.

    Fits every script with a node that is not anonymous.
    """
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            keyword = _anonymous(call)
            if _is_anonymous(call) or argument(call, 0, "name") is None:
                continue
            if keyword is not None:
                yield _site(solution, script, call, script.replace(keyword.value, "True"))
            else:
                last = script.span(max((*call.args, *call.keywords), key=lambda node: script.span(node)[1]))[
                    1
                ]
                yield _site(solution, script, call, Edit(last, last, ", anonymous=True"))
