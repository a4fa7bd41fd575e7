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


def explain_by_absent_parameter(_check: Check, _package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
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
            return verdict.explained(f"{node} asks for {asked}, and {place} is set", hint, cause=asked)
    return verdict
