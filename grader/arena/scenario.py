"""Runs one scenario of a rubric in an arena of its own, into one evidence file."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from grader.arena.live import next_look_s, settled, waiting_for
from grader.arena.place import Place
from grader.arena.probes import advertisement, make_shots, publication
from grader.arena.session import ArenaSession
from grader.errors import ArenaError
from grader.evidence.events import ScenarioEvent
from grader.evidence.writer import EvidenceWriter
from grader.model.record import Record
from grader.rubric.model import Scenario, Start

CLOCK_STEP_S = 0.05
UNFOLLOWED_S = 2.0
UNFOLLOWED_HZ = 15.0
SUBSCRIBE_S = 6.0
HEARD_SETTLE_S = 0.3
GRAPH_EVERY_S = 0.25
CTRL_C_S = 5.0
LAUNCH_CTRL_C_S = 20.0
TERM_S = 2.0
STARTING_S = 1.5
EXPECTED_HZ = 10.0

Tell = Callable[[str], None]


class ScenarioCost(Record):
    """CPU seconds: the grader's own share of the run, and that of the student's processes."""

    cpu_s: float
    student_cpu_s: float


def expected_s(scenario: Scenario) -> float:
    """About how long a run takes when all is as it should be."""
    until = scenario.until
    messages = (
        max(until.messages.values(), default=0)
        / EXPECTED_HZ
        / (scenario.warp if scenario.clock == "warped" else 1)
    )
    probing = sum(shot.pause_s for shot in make_shots(scenario.probes))
    return STARTING_S + (until.window_s or 0) + messages + probing


async def run_scenario(
    name: str, scenario: Scenario, place: Place, *, path: Path, metadata: Mapping[str, str], tell: Tell
) -> ScenarioCost:
    """Record the scenario at `path`. An arena that fails still leaves evidence, with the outcome `host`."""
    warp = scenario.warp if scenario.clock == "warped" else 1.0
    specs = [spec for start in scenario.start if (spec := process_spec(start, place)) is not None]
    with EvidenceWriter(path, scenario=name, clock=scenario.clock, warp=warp, metadata=metadata) as writer:
        session = ArenaSession(place, writer)
        if not specs:
            session.course(ScenarioEvent(event="end", outcome="ended", detail="there was nothing to start"))
            return ScenarioCost(cpu_s=0, student_cpu_s=0)
        try:
            async with session as arena:
                arena.course(ScenarioEvent(event="begin"))
                outcome, detail = await _run(scenario, specs, arena, tell)
                await _stop(scenario, arena)
                await arena.finish()
                arena.course(ScenarioEvent(event="end", outcome=outcome, detail=detail))
        except ArenaError as error:
            session.course(ScenarioEvent(event="end", outcome="host", detail=error.message))
    return ScenarioCost(cpu_s=session.cpu_s, student_cpu_s=session.student_cpu_s)


async def _run(
    scenario: Scenario, specs: list[dict[str, Any]], arena: ArenaSession, tell: Tell
) -> tuple[str, str]:
    tell("starting the managed roscore")
    await arena.wait(lambda: arena.rosout_up, 3.0)
    if scenario.clock == "warped":
        arena.send(do="warp", warp=scenario.warp, step_s=CLOCK_STEP_S)
    for probe in scenario.probes:
        arena.send(do="advertise", fields=advertisement(probe))
    arena.live.started_s = time.monotonic()
    for spec in specs:
        arena.start(spec)
    if scenario.probes:
        await _send_probes(scenario, arena, tell)
    return await _observe(scenario, arena, tell)


def process_spec(start: Start, place: Place) -> dict[str, Any] | None:
    """How `rosrun` or `roslaunch` would start it; None for a script that is not in the package."""
    if start.launch is not None:
        return place.spec(start.name, ["roslaunch", place.package, start.launch, *start.args])
    found = place.find_program(start.script or "")
    if found is None:
        return None
    program, path = found
    repairs = list(place.workspace.repairs.get(path, ()))
    return place.spec(start.name, [program, *start.args], script=path, repairs=repairs)


async def _send_probes(scenario: Scenario, arena: ArenaSession, tell: Tell) -> None:
    """Once the student's node has subscribed to every topic, or has had its time to."""
    topics = {probe.topic for probe in scenario.probes}
    live = arena.live
    tell(f"waiting for a subscriber on {', '.join(sorted(topics))}")
    await arena.wait(lambda: bool(live.subscribed) or not live.running, scenario.until.first_message_s)
    await arena.wait(
        lambda: topics <= live.subscribed or not live.running, SUBSCRIBE_S if live.subscribed else 0.0
    )
    tell("sending it messages")
    for shot in make_shots(scenario.probes):
        if not live.running:
            return
        if shot.topic in live.subscribed:
            live.sent(str(shot.value), time.monotonic())
            arena.send(do="publish", **publication(shot))
            await asyncio.sleep(shot.pause_s)


async def _observe(scenario: Scenario, arena: ArenaSession, tell: Tell) -> tuple[str, str]:
    until, live = scenario.until, arena.live
    warped = scenario.clock == "warped"
    while True:
        now_s = time.monotonic()
        done = settled(live, until, now_s)
        if done is not None:
            if until.heard and live.running:
                await arena.wait(lambda: not live.running, HEARD_SETTLE_S)
            return done
        tell(waiting_for(live, until))
        if warped and _does_not_follow(scenario, arena, now_s):
            warped = False
            detail = "the node does not follow the simulated clock; the run goes on in real time"
            arena.send(do="rewarp", warp=1, detail=detail)
        if until.connected:
            await _look_at_connections(arena)
        else:
            await arena.wait(
                lambda: settled(live, until, time.monotonic()) is not None, next_look_s(live, until, now_s)
            )


def _does_not_follow(scenario: Scenario, arena: ArenaSession, now_s: float) -> bool:
    """A node that sleeps by the wall's clock stays at its own rate, however fast `/clock` runs."""
    for topic in scenario.until.messages:
        seen = arena.live.topics[topic]
        seen_s = now_s - seen.first_s
        if seen.count and seen_s > UNFOLLOWED_S:
            return seen.count / seen_s < UNFOLLOWED_HZ
    return False


async def _look_at_connections(arena: ArenaSession) -> None:
    looks = arena.live.graphs
    arena.send(do="graph")
    await arena.wait(lambda: arena.live.graphs > looks or not arena.live.running, 5.0)
    if not arena.live.connected:
        await arena.wait(lambda: not arena.live.running, GRAPH_EVERY_S)


async def _stop(scenario: Scenario, arena: ArenaSession) -> None:
    """Take a last look at the graph, then Ctrl-C for everything that runs."""
    if arena.live.running:
        looks = arena.live.graphs
        arena.send(do="graph")
        await arena.wait(lambda: arena.live.graphs > looks, 2.0)
    launched = {start.name for start in scenario.start if start.launch is not None}
    stops = [
        arena.interrupt(name, int_s=LAUNCH_CTRL_C_S if name in launched else CTRL_C_S, term_s=TERM_S)
        for name in sorted(arena.live.running)
    ]
    await asyncio.gather(*stops)
