"""`facts.md`, made from what checks are given: runs, channels, events and the package's files."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from functools import cached_property

from grader.checks.registry import Evidence
from grader.evidence import events
from grader.evidence.run import Channel, Message, Run
from grader.model import file_fault, launch_file, package
from grader.model.record import field_docstrings
from grader.model.verdict import Placed
from scripts.reference.table import MADE, cell, table

INTRODUCTION = f"""# What a check is given

The records that [a check of your own](../how-to/own-checks.md) and an instructor's tests see: what was recorded, and
what the package's files say. All of them are read-only. Times are whole nanoseconds of the recorder's clock, in real
time: `run.start_ns` is where the run begins, and in a run with a warped clock `run.warp` seconds of ROS's time pass in
one second. {MADE}
"""
RUNS = (Evidence, Run, Channel, Message)
EVENTS = (
    events.ProcessEvent, events.ConsoleLine, events.GraphEvent, events.Connection, events.ParamEvent,
    events.ActorEvent, events.HostEvent, events.RecorderEvent, events.ScenarioEvent,
)  # fmt: skip
FILES = (
    package.PackageFacts, package.SourceFile, package.Manifest, package.Dependency, package.Person, package.CMakeFacts,
    package.CMakeCall, package.Shebang, launch_file.LaunchFile, launch_file.LaunchNode, launch_file.LaunchParam,
    launch_file.LaunchLoad, package.PythonSlip, file_fault.Fault,
)  # fmt: skip
INNER = {"budget", "decoder", "read_json", "foreign"}


def facts_page() -> str:
    """Every record, by where it is found."""
    lines = [INTRODUCTION]
    for heading, kinds in (("Runs", RUNS), ("Events of a run", EVENTS), ("Files of the package", FILES)):
        lines += [f"## {heading}", ""]
        for kind in kinds:
            lines += _section(kind)
    return "\n".join(lines).rstrip() + "\n"


def _section(kind: type) -> Iterator[str]:
    yield from (f"### {kind.__name__}", "", inspect.getdoc(kind) or "", "")
    meanings = field_docstrings(kind)
    fields = [(name, text) for name, text in _fields(kind) if name not in INNER]
    if meanings:
        rows = [(f"`{name}`", f"`{text}`", meanings.get(name, "")) for name, text in fields]
        yield from table(("field", "type", "meaning"), rows)
    else:
        yield from table(("field", "type"), [(f"`{name}`", f"`{text}`") for name, text in fields])
    for name, doc in _members(kind):
        yield f"- `{name}`: {cell(doc)}"
    yield ""


def _fields(kind: type) -> Iterator[tuple[str, str]]:
    """Yield each field with its type as it is written."""
    for name, written in inspect.get_annotations(kind).items():
        text = getattr(written, "__forward_arg__", written)
        yield name, re.sub(r"Literal\[([^\]]*)\]", _alternatives, text)


def _alternatives(found: re.Match[str]) -> str:
    return found[1].replace(", ", " or ")


def _members(kind: type) -> Iterator[tuple[str, str]]:
    """Yield properties and methods with the docstrings that they have, those of the mixin `Placed` among them."""
    mixed_in = vars(Placed) if issubclass(kind, Placed) else {}
    for name, member in {**mixed_in, **vars(kind)}.items():
        if name.startswith("_") or name in INNER:
            continue
        function = member.func if isinstance(member, cached_property) else getattr(member, "fget", member)
        doc = inspect.getdoc(function) if inspect.isfunction(function) else ""
        if doc:
            called = inspect.isfunction(member)
            yield f"{name}{_arguments(function) if called else ''}", " ".join(doc.split())


def _arguments(function: Callable[..., object]) -> str:
    """Return the arguments as they are given: `(topic=None)`."""
    given = [
        p.name if p.default is p.empty else f"{p.name}={p.default!r}"
        for p in inspect.signature(function).parameters.values()
        if p.name != "self"
    ]
    return f"({', '.join(given)})"
