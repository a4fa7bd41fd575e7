"""Names of the ROS graph, which nodes a process registered, and whether a name is the one that was asked for."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from grader.checks.registry import Refers
from grader.checks.support.idioms import ANONYMOUS, init
from grader.evidence.run import Run
from grader.wording import join_words

Anonymous = Literal["allowed", "required", "forbidden"]
_KINDS = {"allowed": "plain or anonymous", "required": "anonymous", "forbidden": "plain"}
_SUFFIX = re.compile(r"_\d+_\d+$")
_ANONYMOUS = r"(_\d+_\d+)?"
TypeName = Annotated[str, Field(pattern=r"^[A-Za-z]\w*/[A-Za-z]\w*$")]


def nodes_of(run: Run, process: str) -> tuple[str, ...]:
    """The nodes of one process, or the student's all where `process` is empty or no one noted whose they are."""
    return run.student_nodes(process) if process and are_noted(run) else run.student_nodes()


def are_noted(run: Run) -> bool:
    """Return whether the graph says which process each of the student's nodes belongs to."""
    return any(run.is_student_node(node) for _, event in run.graph for node in event.processes)


def is_named(node: str, names: Iterable[str], anonymous: Anonymous) -> bool:
    """Anonymous is the base name with `_<digits>_<digits>` after it, as rospy makes it."""
    bases = _bases(names)
    plain = node in bases and anonymous != "required"
    return plain or (base_name(node) != node and base_name(node) in bases and anonymous != "forbidden")


def base_name(node: str) -> str:
    """`/talker` for `/talker_4711_1700000000000`, and any other name as it is."""
    return _SUFFIX.sub("", node)


def wanted_names(names: Iterable[str], anonymous: Anonymous) -> str:
    """`/talker or /numeric_talker, plain or anonymous`."""
    return f"{join_words(_bases(names), 'or')}, {_KINDS[anonymous]}"


def wrong_name(names: tuple[str, ...], nodes: Iterable[str], anonymous: Anonymous) -> str:
    """Return how the names of the nodes differ from those that are wanted: in themselves, or in their ending alone."""
    there = tuple(nodes)
    if {base_name(n) for n in there}.isdisjoint(_bases(names)):
        return f"the node is named {join_words(there)}, not {join_words(_bases(names), 'or')}"
    how = "without" if anonymous == "required" else "with"
    return f"the node is named {join_words(there)}, {how} the numbers that anonymous=True adds to the name"


def name_hint(names: tuple[str, ...], nodes: Iterable[str], anonymous: Anonymous) -> str:
    """Return what to write into `init_node`."""
    there = tuple(nodes)
    counted = [n for n in there if any(re.fullmatch(rf"{re.escape(b)}_*\d+", n) for b in _bases(names))]
    if counted and anonymous == "allowed":
        name = names[0].lstrip("/")
        return f"write {init(name, anonymous=True)}: that adds numbers by itself"
    spare = anonymous == "forbidden" and not {base_name(n) for n in there}.isdisjoint(_bases(names))
    call = init(names[0].lstrip("/"), anonymous=anonymous == "required")
    return f"write {call} without {ANONYMOUS}" if spare else f"write {call}"


def _bases(names: Iterable[str]) -> list[str]:
    return ["/" + name.lstrip("/") for name in names]


def _global(name: str) -> str:
    if not name.startswith("/"):
        raise ValueError(f'a name of the graph begins with a slash: "/{name}"')
    return name


def plain_type(name: str) -> str:
    """`std_srvs/Empty`, also where another tool wrote `std_srvs/srv/Empty`."""
    return name.replace("/msg/", "/").replace("/srv/", "/")


def is_called(node: str, name: str) -> bool:
    """Return whether a node has this name, given with its slash or without; an anonymous one counts."""
    return re.fullmatch(re.escape("/" + name.lstrip("/")) + _ANONYMOUS, node) is not None


GlobalName = Annotated[str, AfterValidator(_global)]
"""A topic's, a service's or a parameter's full name."""
PublishedTopic = Annotated[GlobalName, Refers("published")]
"""A topic on which the student publishes."""
