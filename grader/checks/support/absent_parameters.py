"""Where a parameter is that a node asks for under another name, and dies of."""

from __future__ import annotations

import re

from grader.checks.registry import Check
from grader.checks.support.parameters import absolute_name, params_on_server
from grader.checks.support.text import get_param
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict

_NOT_SET = re.compile(r"the parameter '([~\w/]+)' is not set")


def explain_by_absent_parameter(_check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a loss by a parameter that is not set with the namespace in which it is: a default would hide it."""
    found = _NOT_SET.search(verdict.message)
    name = found[1].lstrip("~/") if found else ""
    there = [f"{one}/" for one in params_on_server(run)]
    reads = [event for _, event in run.actors if name and event.action == "read" and event.detail]
    for event in sorted(reads, key=lambda one: one.actor not in verdict.message):
        node, asked = event.actor, absolute_name(event.topic or "")
        if not asked.endswith(f"/{name}"):
            continue
        space = node.rpartition("/")[0]
        places = {f"{space}/{name}": name, f"{node}/{name}": f"~{name}", f"/{name}": f"/{name}"}
        for place, right in places.items():
            if place == asked or not any(one.startswith(f"{place}/") for one in there):
                continue
            hint = f"write {get_param(right)}"
            if right.startswith("/") and asked == f"{space}/{name}":
                hint = f"set it in the node's namespace, {space}: in the launch file, inside its <group>"
            if asked == f"{node}/{name}":
                hint = _move_into_node(package, node, place.rpartition("/")[0]) or hint
            return verdict.explained(
                f"{node} asks for {asked}, and {place} is set", hint, cause=asked
            ).based_on(charged_once=True)
    return verdict


def _move_into_node(package: PackageFacts, node: str, space: str) -> str:
    """Return what to do where a launch file loads a node's own parameters beside its <node>; "" where it does not."""
    for file in package.launch_files:
        loads = [one for one in file.loads if one.namespace.rstrip("/") == space]
        nodes = [one for one in file.brings if one.full_name == node]
        if len(loads) == 1 and len(nodes) == 1:
            where = f"the <node> on line {nodes[0].line} of {nodes[0].file}, between <node …> and </node>"
            return f"move the <rosparam> from line {loads[0].line} of {loads[0].file} into {where}"
    return ""
