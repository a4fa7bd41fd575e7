"""How a scenario's processes start and stop, and what is on the parameter server before."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from typing import Any, TypeAlias

from grader.arena.admission import Leave
from grader.arena.parameters import OVER, settings
from grader.arena.process_environment import Place
from grader.arena.session import ArenaSession
from grader.errors import ArenaError
from grader.evidence.events import ActorEvent
from grader.rubric.model import Param, Start

CTRL_C_S = 5.0
LAUNCH_CTRL_C_S = 20.0  # roslaunch gives its own nodes 15 s and more
TERM_S = 2.0
HELD_S = 0.1
UP_S, SETTLE_S = 5.0, 0.2
"""A process is up when its nodes have registered and nothing changes for a moment; some never are."""
BUILT_PROGRAMS_MAX = 20

Spec: TypeAlias = dict[str, Any]
"""What the arena needs to start a process (`Place.spec`)."""


def process_specs(start: Start, place: Place) -> Iterator[Spec]:
    """How `rosrun`, `roslaunch` or `rosparam` would start it; nothing for a file that is not in the package."""
    if start.launch is not None:
        yield place.spec(start.name, ["roslaunch", place.package, start.launch, *start.args])
    elif start.load is not None:
        yield from _loading(start.name, start.load, place)
    elif start.program is not None:
        package, _, program = start.program.partition("/")
        argv = ["rosrun", package, program, *start.args]
        yield replace(place, env={}).spec(start.name, argv, role="grader", copy=False)
    elif start.built:
        for program in built_programs(place):
            yield place.spec(f"{start.name}/{program}", [f"{place.devel_programs}/{program}", *start.args])
    else:
        yield from _script(start, place)


def _script(start: Start, place: Place) -> Iterator[Spec]:
    found = place.find_program(start.script or "")
    if found is not None:
        program, path = found
        repairs = list(place.workspace.repairs.get(path, ()))
        yield place.spec(start.name, [program, *start.args], script=path, repairs=repairs)


def _loading(name: str, file: str, place: Place) -> Iterator[Spec]:
    found = place.script_path(file)
    if found is not None:
        yield place.spec(name, ["rosparam", "load", f"{place.package_folder}/{found}"], script=found)


def built_programs(place: Place) -> list[str]:
    """The names of what the compiler made for `rosrun` to find, in order."""
    return sorted(place.built.compiled)[:BUILT_PROGRAMS_MAX]


def set_params(params: tuple[Param, ...], arena: ArenaSession) -> None:
    """Set them, each with its event in the evidence; a file that cannot be read, or is too much, is noted there."""
    found, remarks = settings(params, arena.place.package_file)
    for remark in remarks:
        over = remark.endswith(OVER)
        actor = "the package" if over else "grader"
        arena.note(ActorEvent(action="limit" if over else "note", actor=actor, detail=remark))
    for one in found:
        record = {
            "action": "param",
            "actor": "grader",
            "topic": one.name,
            "value": one.value,
            "detail": one.detail,
        }
        arena.send(do="set_param", name=one.name, value=one.value, record=record)


@asynccontextmanager
async def given_back(leave: Leave, names: set[str], arena: ArenaSession) -> AsyncIterator[None]:
    """Inside, the leave to start is given back as soon as these processes are up."""

    async def give_back() -> None:
        live = arena.live
        await arena.wait(lambda: names <= live.registered | live.ended, UP_S)
        await arena.wait(lambda: time.monotonic() > live.graph_changed_s + SETTLE_S, SETTLE_S)
        leave.release()

    task = asyncio.ensure_future(give_back())
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError, ArenaError):  # the block meets the same error itself
            await task
        leave.release()


async def stop(starts: tuple[Start, ...], arena: ArenaSession, *, warped: bool) -> None:
    """Take a last look at the graph, then Ctrl-C for everything that runs, the grader's own programs last.

    A clock that runs fast stands still first: Ctrl-C in the middle of a message locks rospy up, and nodes that sleep
    send none.
    """
    if warped:
        arena.send(do="hold_clock")
        await arena.wait(lambda: not arena.live.running, HELD_S)
    if arena.live.running:
        looks = arena.live.graphs
        arena.send(do="graph")
        await arena.wait(lambda: arena.live.graphs > looks, 2.0)
    launched = {start.name for start in starts if start.launch is not None}
    for names in (arena.live.running, arena.live.helpers):
        stops = [
            arena.interrupt(name, int_s=LAUNCH_CTRL_C_S if name in launched else CTRL_C_S, term_s=TERM_S)
            for name in sorted(names)
        ]
        await asyncio.gather(*stops)
