"""What a launch file says, as roslaunch reads it: nodes, parameters, remaps and what cannot be resolved.

Paths are posix and relative to the package's root; lines count from 1.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet

from pydantic import Field

from grader.model.file_fault import Fault
from grader.model.record import Record
from grader.model.verdict import Placed

LAUNCH_TAGS = frozenset(
    {"arg", "env", "group", "include", "machine", "master", "node", "param", "remap", "rosparam", "test"}
)
"""Below `<launch>`."""
SUBSTITUTION = "Substitution"
"""The kind of a fault of a `$(…)`."""


class LaunchLine(Placed, Record):
    """A tag that gives the topics of nodes other names: a `<remap>`, `value` its `from`; `args`, the `args` of a
    `<node>` with `old:=new` in them, `value` the old name; any other by its `ns`."""

    tag: str
    value: str
    file: str
    line: int
    by_arg: LaunchLine | None = Field(default=None, exclude_if=lambda value: value is None)
    """Where its `ns` is only a `$(arg …)`: the `<arg>` that gives it, by its `default` or `value`."""


class LateRemap(LaunchLine):
    """A `<remap>` to the name `to` with no `<node>` behind it, and so without effect: its place is above the tag on
    the line `above`. `namespace` is that of its group."""

    namespace: str
    to: str
    above: int


class LaunchArg(Placed, Record):
    """An `<arg>` that has no value where `$(arg …)` asks for it. `declared`: there is an `<arg>`, without a default,
    and `line` is its own; else the line that asks, where `meant` is the one with nearly that name."""

    name: str
    declared: bool
    file: str
    line: int
    meant: str = Field(default="", exclude_if=lambda value: not value)


class LaunchNode(Placed, Record):
    """One `<node>`, with its attributes as written; a missing attribute is None.

    `remaps` are those in force: those that come before it in `<launch>` and its `<group>`s, then its own.
    `file` is the file that has it, `namespace` that of its groups, includes and its own `ns`, with both
    slashes. `uncertain`: only roslaunch can tell whether it counts (`if="$(eval …)"`).
    """

    pkg: str | None
    type: str | None
    name: str | None
    ns: str | None
    output: str | None
    launch_prefix: str | None
    args: str | None
    remaps: tuple[tuple[str, str], ...]
    line: int
    file: str = ""
    namespace: str = "/"
    machine: str | None = None
    respawn: str | None = None
    required: str | None = None
    uncertain: bool = False
    unknown: tuple[str, ...] = ()
    """Attributes that roslaunch does not know."""
    renaming: tuple[LaunchLine, ...] = ()
    """The `<remap>`s and `ns` in force, in the file's order."""
    by_args: tuple[LaunchLine, ...] = Field(default=(), exclude_if=lambda value: not value)
    """Where `pkg`, `type` or `name`, which is the `tag`, is only a `$(arg …)`: the `<arg>` that gives it, by its
    `default` or `value`, which is the `value`. Of a `<remap>` in the node, the tag is `to`."""
    condition: LaunchLine | None = Field(default=None, exclude_if=lambda value: value is None)
    """Why it is `uncertain`: the tag's line, with its `if` or `unless` as `value`."""
    left_out: tuple[LaunchLine, ...] = Field(default=(), exclude_if=lambda value: not value)
    """Each `<param>` and `<remap>` in it that its `if` or `unless`, the `value`, leaves out; the `tag` is its name."""

    @property
    def full_name(self) -> str:
        """The name in the graph, `/robot/talker`. What only roslaunch can resolve is still `$(…)` in it."""
        return f"{self.namespace}{self.name or ''}"


class LaunchParam(Placed, Record):
    """One `<param>`, or `<rosparam param="…">` with its value in the tag; `name` is the full name on the server, which
    `attribute` gives; `value` is None if a file or command gives it."""

    name: str
    value: str | None
    type: str | None
    file: str
    line: int
    attribute: str = "name"
    by_arg: LaunchLine | None = Field(default=None, exclude_if=lambda value: value is None)
    """Where its value is only a `$(arg …)`: the `<arg>` that gives it, by its `default` or `value`."""


class LaunchLoad(Placed, Record):
    """One `<rosparam>`; `source` is its `file` (None for text in the tag), `namespace` where its names go."""

    source: str | None
    command: str
    namespace: str
    file: str
    line: int

    def loads(self, path: str) -> bool:
        """Return whether it loads this file of the package."""
        return self.command == "load" and (self.source or "").endswith(f")/{path}")


class LaunchFile(Record):
    """`fault` is set if the file is not well-formed or does not begin with `<launch>`.

    Nodes and includes that a literal `if="false"` or `unless="true"` switches off are left out. `nodes` are
    the file's own. These fields say what `roslaunch` would do, with the package's own included files and
    with `$(arg …)`, `$(dirname)` and namespaces resolved: `brings` (nodes), `tests` (`<test>`, which only
    rostest runs), `params`, `loads`, `include_faults` (own files that cannot be included, and each `$(…)` that
    roslaunch refuses), `unset_args`. A
    path inside the package is written as `$(find <package>)/…`. `unknown_tags` are tags that roslaunch
    skips, with their lines, and others that are written like a node; `commented` has the `type`s of nodes in
    comments; `switched_off` those of nodes that an `if` or `unless` leaves out, with its line and text.
    `readable` are the nodes that can be read from a file that is not well-formed.
    """

    path: str
    root: str | None
    nodes: tuple[LaunchNode, ...]
    includes: tuple[str, ...]
    fault: Fault | None = None
    brings: tuple[LaunchNode, ...] = ()
    tests: tuple[LaunchNode, ...] = ()
    params: tuple[LaunchParam, ...] = ()
    loads: tuple[LaunchLoad, ...] = ()
    include_faults: tuple[Fault, ...] = ()
    unknown_tags: tuple[tuple[str, int], ...] = ()
    commented: tuple[tuple[str, int], ...] = ()
    switched_off: tuple[tuple[str, int, str], ...] = ()
    unset_args: tuple[LaunchArg, ...] = ()
    late_remaps: tuple[LateRemap, ...] = ()
    readable: tuple[LaunchNode, ...] = ()
    given: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)
    """The arguments with which it is read: `robot:=tb3`."""

    def starts(self, programs: AbstractSet[str]) -> set[str]:
        """Return which of these programs the file starts, by their names; the `.py` may be missing."""
        types = {node.type for node in self.nodes}
        return {name for name in programs if {name, name.removesuffix(".py")} & types}
