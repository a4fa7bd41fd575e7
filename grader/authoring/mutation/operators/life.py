"""Nodes that end when they should not, or do not end when they should."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from pydantic import Field

from grader.authoring.mutation.python import Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import calls, loops
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit
from grader.model.record import Record


class EndsParams(Record):
    """`turns`: how many rounds a loop makes before it ends."""

    turns: int = Field(default=30, ge=1)


def _spins(script: Script) -> list[ast.Expr]:
    return [s for call in calls(script, "spin") if isinstance(s := script.statement(call), ast.Expr)]


def _sites(solution: Solution, script: Script, edits: Sequence[Edit], line: int) -> Site:
    return Site(at={"script": script.path}, tree=solution.edited(script.path, edits), line=line)


@operator("node-ends-by-itself", params=EndsParams)
def node_ends_by_itself(solution: Solution, params: EndsParams) -> Iterator[Site]:
    """Lets the node come to its end: a loop that is counted, or no rospy.spin().

    Fits every script with a loop until shutdown or a spin.
    """
    for script in solution.scripts:
        spins = _spins(script)
        for loop in loops(script):
            start, _ = script.span(loop)
            edit = Edit(start, script.span(loop.test)[1], f"for _ in range({params.turns})")
            yield _sites(solution, script, [edit], loop.lineno)
        for spin in spins if not loops(script) else []:
            yield _sites(solution, script, [script.remove(spin)], spin.lineno)


@operator("ctrl-c-swallowed")
def ctrl_c_swallowed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Catches every exception and goes on, so that Ctrl-C does not end the node.

    Fits every script with a loop until shutdown or a spin.
    """
    for script in solution.scripts:
        unit = script.unit
        except_pass = (f"{unit}except:", f"{unit * 2}pass")
        for loop in loops(script):
            if script.can_wrap(loop.body):
                edits = [
                    script.replace(loop.test, "True"),
                    script.wrap(loop.body, "try:", footer=("except:", f"{unit}pass")),
                ]
                yield _sites(solution, script, edits, loop.lineno)
        for spin in _spins(script) if not loops(script) else []:
            if script.has_lines(spin):
                sleep = f"{unit * 2}rospy.rostime.wallsleep(0.1)"
                edits = [
                    script.before(spin, "while True:", f"{unit}try:", sleep, *except_pass),
                    script.remove(spin) if len(script.block(spin)) > 1 else script.replace(spin, "pass"),
                ]
                yield _sites(solution, script, edits, spin.lineno)


@operator("traceback-on-exit")
def traceback_on_exit(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Uses a variable that is not there, once the node has been told to end.

    Fits every script with a loop until shutdown or a spin.
    """
    for script in solution.scripts:
        for node in loops(script) or _spins(script):
            if script.has_lines(node):
                edit = script.after(node, "print('stopped after', turns_so_far)")
                yield _sites(solution, script, [edit], node.lineno)
