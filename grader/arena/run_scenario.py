"""Runs one scenario of a rubric in an arena of its own, into one evidence file."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from grader.arena.admission import Admission, StartPermit
from grader.arena.process_environment import ProcessEnvironment
from grader.arena.recording_files import RunCost
from grader.arena.run_end import describe_wait, find_outcome, next_look_s, waits
from grader.arena.sandbox_files import FUNCTIONS, ROSTESTS
from grader.arena.scenario_inputs import OVER, make_shots, settings
from grader.arena.session import GRAPH_EVERY_S, ArenaSession
from grader.arena.source_waits import (
    ENDS_FOR_NEWER,
    IDLE,
    PROGRAM,
    PUBLISHER,
    PUBLISHES,
    SLEEPING,
    gives_up,
    naps,
    polled,
    sleeps_elsewhere,
)
from grader.arena.steps import CTRL_C_S, LAUNCH_CTRL_C_S, TERM_S, ProcessSpec, StepRunner, Tell
from grader.errors import ArenaError
from grader.evidence.events import ActorEvent, ScenarioEvent
from grader.evidence.writer import EvidenceWriter
from grader.model.message_rate import RateBounds
from grader.rubric.course_packages import LAUNCH_ENDINGS
from grader.rubric.scenario import JudgedGoal, Param, Scenario, Start

# Of the run's time. A node's timer or sleep is late by one step at most.
CLOCK_STEP_S = 0.05
UNFOLLOWED_S = 2.0
# By the wall's clock: a node of 10 Hz that follows the simulated clock is many times as fast.
UNFOLLOWED_HZ = 15.0
TRIAL_S, TRIAL_MESSAGES = 1.0, 8
SLOWED = 0.25
"""A node that sends less than this share of what it sent with a fast clock follows that clock."""
REGISTERED_S = 1.0
HEARD_SETTLE_S = 0.3
TALKED_S = 1.0
"""So long after its first message a node's connections are asked for: it may end before the run does, and they with
it."""
STARTING_S = 1.5
EXPECTED_HZ = 10.0
WATCHED_MORE_S = 0.5
WATCHED_LONGER_S = 0.05

HELD_S = 0.1
UP_S, SETTLE_S = 5.0, 0.2
"""A process is up when its nodes have registered and nothing changes for a moment; some never are."""
BUILT_PROGRAMS_MAX = 20
ALONE_S, ROSTEST_LOOK_S = 5.0, 0.5
"""So long an instructor's tests go on after the last of the student's processes, and how often that is looked at."""


def expected_s(scenario: Scenario) -> float:
    """Return about how long a run takes when all is as it should be."""
    until = scenario.until
    warp = scenario.warp if scenario.clock == "warped" else 1
    messages = max(until.messages.values(), default=0) / EXPECTED_HZ / warp
    probing = sum(shot.pause_s for shot in make_shots(scenario.probes))
    watched = max(until.window_s or 0, until.alive_s or 0, until.quiet_s or 0)
    return STARTING_S + watched + messages + probing + _steps_s(scenario)


def _steps_s(scenario: Scenario) -> float:
    """Return about how long the steps of a scenario take."""
    warp = scenario.warp if scenario.clock == "warped" else 1
    return sum(step.lasts_s for step in scenario.steps) / warp


async def run_scenario(
    name: str,
    scenario: Scenario,
    place: ProcessEnvironment,
    *,
    path: Path,
    metadata: Mapping[str, str],
    tell: Tell,
    rates: tuple[RateBounds, ...] = (),
    watched_s: float = 0.0,
    goals: Mapping[tuple[str, int], JudgedGoal] | None = None,
    admission: Admission | None = None,
    last_run: bool = False,
    beside: Path | None = None,
) -> RunCost:
    """Record the scenario at `path`. An arena that fails still leaves evidence, with the outcome `host`.

    Processes are started when `admission` lets them: others wait until they are up. A window in which nothing but
    `rates` is to be seen ends when they are clear. For `watched_s`, nodes are watched even where nothing more can come.
    `goals` are those that criteria judge (`goals_of` in `rubric/load.py`). `beside` is the rubric's folder.
    """
    admission = admission or Admission(None)
    warp = scenario.warp if scenario.clock == "warped" else 1.0
    starts = _starts(scenario, place)
    with EvidenceWriter(path, scenario=name, clock=scenario.clock, warp=warp, metadata=metadata) as writer:
        session = ArenaSession(
            place, writer, calibrated=bool(rates), last_run=last_run, on_lateness=admission.note_lateness
        )
        if not any(spec["role"] == "student" for _, spec in starts):
            session.course(ScenarioEvent(event="end", outcome="ended", detail="there was nothing to start"))
            return RunCost(cpu_s=0, student_cpu_s=0)
        try:
            session.live.watch_rates(rates)
            _tell_what_is_known(session, scenario, place, starts, watched_s)
            async with admission.start() as permit, session as arena:
                arena.course(ScenarioEvent(event="begin"))
                at_once = {spec["name"] for start, spec in starts if start.name not in scenario.started_later}
                async with release_when_up(permit, at_once, arena):
                    steps = StepRunner(scenario, starts, arena, tell, beside=beside, goals=goals)
                    outcome, detail = await _run(scenario, starts, arena, tell, steps)
                    if outcome == "complete":
                        await _watch_on(arena, watched_s)
                await stop(scenario.start, arena, warped=scenario.clock == "warped")
                await arena.finish()
                arena.course(ScenarioEvent(event="end", outcome=outcome, detail=detail))
        except ArenaError as error:
            session.course(ScenarioEvent(event="end", outcome="host", detail=error.message))
    return RunCost(cpu_s=session.cpu_s, student_cpu_s=session.student_cpu_s)


def _starts(scenario: Scenario, place: ProcessEnvironment) -> list[tuple[Start, dict[str, Any]]]:
    """Return each process of the scenario with what the arena needs to start it."""
    numbers = count()
    starts = [(start, spec) for start in scenario.start for spec in process_specs(start, place, numbers)]
    typed_to = scenario.typed_to | {start.name for start in scenario.start if start.tests is not None}
    for start, spec in starts:
        spec["stdin"] = start.name in typed_to
        spec["keeps"] = scenario.keeps if spec["role"] == "student" else ()
        spec["again"] = spec["name"] in scenario.started_again
    return starts


def _tell_what_is_known(
    session: ArenaSession,
    scenario: Scenario,
    place: ProcessEnvironment,
    starts: list[tuple[Start, ProcessSpec]],
    watched_s: float,
) -> None:
    """Set what the scenario and the package's sources say of how long anything may yet come."""
    session.live.gives_up = place.has_line(gives_up)
    session.live.serves = frozenset(one.name for one in scenario.serves)
    session.live.naps = place.has_line(naps)
    session.live.ends_for_newer = place.has_line(ENDS_FOR_NEWER)
    scripts = {spec["name"]: spec["script"] for _, spec in starts if spec["script"] is not None}
    session.live.polled = {name: polled(place.text_of(path)) for name, path in scripts.items()}
    session.live.endless = frozenset(s["name"] for _, s in starts if place.has_line(IDLE, s["script"]))
    session.live.sleeping = frozenset(s["name"] for _, s in starts if place.has_line(SLEEPING, s["script"]))
    # A file that the script may import counts, too
    if session.live.sleeping and place.has_line(sleeps_elsewhere):
        session.live.sleeping = frozenset()
    session.live.mute = frozenset(
        name
        for name, path in scripts.items()
        if place.has_line(PUBLISHER, path) and not place.has_line(PUBLISHES, path, programs=PROGRAM)
    )
    # Half of what the steps take: where one of them waits for something that never comes, its wait is added to this.
    least_s = expected_s(scenario) - STARTING_S - _steps_s(scenario) / 2
    session.live.least_s = max(watched_s + WATCHED_MORE_S, least_s)


async def _run(
    scenario: Scenario,
    starts: list[tuple[Start, ProcessSpec]],
    arena: ArenaSession,
    tell: Tell,
    steps: StepRunner,
) -> tuple[str, str]:
    tell("starting the managed roscore")
    if scenario.clock == "warped":
        arena.send(do="warp", warp=scenario.warp, step_s=CLOCK_STEP_S)
    set_params(scenario.params, arena)
    async with steps as runner:
        runner.advertise()
        arena.live.started_s = time.monotonic()
        for start, spec in starts:
            if start.name in scenario.started_later:
                continue
            if start.after is not None:
                await _await_node(start.after, scenario, arena, tell)
                # A simulator begins to send at once: a node that is not connected yet would miss it.
                if start.program is not None:
                    await arena.await_connections()
            arena.start(spec)
        await runner.run()
        await _await_rostests(scenario, arena, tell)
        if scenario.steps or any(start.tests or start.is_rostest for start in scenario.start):
            if runner.unheeded:  # steps that were left out leave less to see than the criteria ask for
                left_s = arena.live.first_node_s + arena.live.least_s - time.monotonic()
                await arena.wait(lambda: not arena.live.running, max(0.0, left_s))
            arena.live.begin_wait(time.monotonic(), heeded=not runner.unheeded)
            if runner.stopped_all or (arena.live.running and not waits(scenario.until)):
                return "complete", ""
        return await _observe(scenario, arena, tell)


async def _watch_on(arena: ArenaSession, watched_s: float) -> None:
    """Let the nodes go on until they have been watched for so long after their first messages: steps may be over sooner
    than a criterion asks a node to live, above all where `/clock` runs ahead."""
    live = arena.live
    left_s = live.all_began_s + watched_s + WATCHED_LONGER_S - time.monotonic()
    if watched_s and left_s > 0:
        await arena.wait(lambda: not live.running, left_s)


async def _await_node(process: str, scenario: Scenario, arena: ArenaSession, tell: Tell) -> None:
    """Wait until a node of that process is registered with all that it has, has ended, or cannot come any more.

    A node whose name is taken over while it is still registering takes it back: then both are shut down.
    """
    live, until_s = arena.live, time.monotonic() + scenario.until.first_message_s
    tell(f"waiting for {process}")
    await arena.wait(
        lambda: process in live.registered or process in live.ended, scenario.until.first_message_s
    )
    while process not in live.ended:
        left_s = min(live.graph_changed_s + REGISTERED_S, until_s) - time.monotonic()
        if left_s <= 0:
            return
        await arena.wait(lambda: process in live.ended, left_s)


async def _await_rostests(scenario: Scenario, arena: ArenaSession, tell: Tell) -> None:
    """Wait until the tests of `.test` files are over. Once all of the student's processes have ended, they have little
    left to wait for."""
    live, names = arena.live, {start.name for start in scenario.start if start.is_rostest}
    until_s = live.started_s + scenario.until.limit_s
    while names & live.helpers and time.monotonic() < until_s + live.lost_s:
        tell("the instructor's tests are running")
        if live.ended and not live.running:
            until_s = min(until_s, time.monotonic() + ALONE_S)
        await arena.wait(lambda: not names & live.helpers, ROSTEST_LOOK_S)


async def _observe(scenario: Scenario, arena: ArenaSession, tell: Tell) -> tuple[str, str]:
    until, live = scenario.until, arena.live
    trial = _ClockTrial(scenario, arena)
    looked = bool(until.connected)
    while True:
        now_s = time.monotonic()
        talked_s = (at_s for node, at_s in live.talking.items() if node not in live.helper_nodes)
        if not looked and any(now_s >= at_s + TALKED_S for at_s in talked_s):
            looked = True
            arena.send(do="graph")
        done = find_outcome(live, until, now_s)
        if done is not None:
            # What was printed last may not be in yet, and the verdict rests on it.
            if until.heard and live.running:
                await arena.wait(lambda: not live.running, HEARD_SETTLE_S)
            return done
        tell(describe_wait(live, until))
        trial.look(now_s)
        if until.connected:
            await arena.look_at_connections()
            await arena.wait(lambda: not live.running, GRAPH_EVERY_S)
        else:
            await arena.wait(
                lambda: find_outcome(live, until, time.monotonic()) is not None,
                next_look_s(live, until, now_s),
            )


class _ClockTrial:
    """Whether a node whose messages come slowly follows the fast clock: for a while, that runs as the wall's does. A
    node that follows it is then slower by far, and it runs fast again. For a node that sleeps by the wall's clock, it
    stays as it is then."""

    def __init__(self, scenario: Scenario, arena: ArenaSession) -> None:
        self._scenario, self._arena = scenario, arena
        self._is_over = scenario.clock != "warped"
        self._topic, self._hz, self._began_s, self._count = "", 0.0, 0.0, 0

    def look(self, now_s: float) -> None:
        """Begin the trial where there is reason for it, and end it once it has shown something."""
        if self._is_over:
            return
        if not self._topic:
            self._begin(now_s)
        elif now_s > self._began_s + self._length_s():
            self._is_over = True
            came_hz = (self._arena.live.topics[self._topic].count - self._count) / (now_s - self._began_s)
            if came_hz < SLOWED * self._hz:
                self._set(self._scenario.warp, "the node follows the simulated clock, which runs fast again")
            else:
                self._set(1, "the node does not follow the simulated clock; the run goes on in real time")
        if self._topic:
            # The run's end is looked for at other moments, too.
            self._arena.live.slowed_until_s = now_s if self._is_over else self._began_s + self._length_s()

    def _begin(self, now_s: float) -> None:
        live = self._arena.live
        for topic in self._scenario.until.messages:
            seen = live.topics[topic]
            # A machine that others fill also makes a node slow, by no clock of its own.
            seen_s = now_s - seen.first_s
            lost_s = live.lost_s - seen.lost_before_s
            if seen.count and seen_s - lost_s > UNFOLLOWED_S:
                self._hz = seen.count / seen_s
                if self._hz < UNFOLLOWED_HZ:
                    self._topic, self._began_s, self._count = topic, now_s, seen.count
                    self._set(1, "the node is slow; the clock shows whether the node follows it")
                return

    def _length_s(self) -> float:
        # a run is over once a topic has been silent for so long
        return min(max(TRIAL_S, TRIAL_MESSAGES / self._hz), self._scenario.until.silent_s / 2)

    def _set(self, warp: float, detail: str) -> None:
        self._arena.send(do="rewarp", warp=warp, detail=detail)


def process_specs(start: Start, place: ProcessEnvironment, numbers: Iterator[int]) -> Iterator[ProcessSpec]:
    """Return how `rosrun`, `roslaunch` or `rosparam` would start it; nothing for a file that is not in its package.

    `numbers` are those of the run's processes.
    """
    found = place.of(start.package)
    if found is None:
        return
    place = found
    if start.launch is not None:
        yield place.spec(start.name, ["roslaunch", place.package, start.launch, *start.args])
    elif start.load is not None:
        file = place.script_path(start.load)
        if file is not None:
            yield place.spec(start.name, ["rosparam", "load", f"{place.package_folder}/{file}"], script=file)
    elif start.program is not None:
        package, _, program = start.program.partition("/")
        how = ["roslaunch" if program.endswith(LAUNCH_ENDINGS) else "rosrun"]
        if start.is_rostest:
            how = ["python3", f"{place.shims}/{ROSTESTS}"]
        argv = [*how, package, program, *start.args]
        # Without what the built workspace's `setup.bash` adds: it is no program of the student's.
        yield replace(place, env={}).spec(start.name, argv, role="grader", copy=False)
    elif start.tests is not None:
        argv = ["python3", f"{place.shims}/{FUNCTIONS}", place.package_folder]
        yield place.spec(start.name, argv, as_handed_in=True, number=next(numbers))
    elif start.built:
        for program in sorted(place.built.compiled)[:BUILT_PROGRAMS_MAX]:
            argv = [f"{place.devel_programs}/{program}", *start.args]
            yield place.spec(f"{start.name}/{program}", argv, number=next(numbers))
    else:
        yield from _script(start, place, numbers)


def _script(start: Start, place: ProcessEnvironment, numbers: Iterator[int]) -> Iterator[ProcessSpec]:
    found = place.find_program(start.script or "")
    if found is not None:
        program, path = found
        repairs = list(place.workspace.repairs.get(path, ()))
        argv = [program, *start.args]
        yield place.spec(start.name, argv, script=path, repairs=repairs, number=next(numbers))


def set_params(params: tuple[Param, ...], arena: ArenaSession) -> None:
    """Set them, each with its event in the evidence; a file that cannot be read, or is too much, is noted there."""
    found, remarks = settings(params, arena.place.package_file)
    for remark in remarks:
        over = remark.endswith(OVER)
        actor = "the package" if over else "grader"
        arena.note(ActorEvent(action="limit" if over else "note", actor=actor, detail=remark))
    for one in found:
        about = {"topic": one.name, "value": one.value, "detail": one.detail}
        record = {"action": "param", "actor": "grader", **about}
        arena.send(do="set_param", name=one.name, value=one.value, record=record)


@asynccontextmanager
async def release_when_up(permit: StartPermit, names: set[str], arena: ArenaSession) -> AsyncIterator[None]:
    """Give the start lock back as soon as these processes are up, or the block has ended."""

    async def give_back() -> None:
        live = arena.live
        await arena.wait(lambda: names <= live.registered | live.ended, UP_S)
        await arena.wait(lambda: time.monotonic() > live.graph_changed_s + SETTLE_S, SETTLE_S)
        permit.release()

    task = asyncio.ensure_future(give_back())
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError, ArenaError):  # the block meets the same error itself
            await task
        permit.release()


GOAL_CTRL_C_S = 1.0, 0.2
"""An action's server that goes on with a goal may do so behind Ctrl-C, too: its end says nothing of it."""


async def stop(starts: tuple[Start, ...], arena: ArenaSession, *, warped: bool) -> None:
    """Take a last look at the graph, then Ctrl-C for everything that runs, the grader's own programs last.

    A clock that runs fast stands still first: Ctrl-C in the middle of a message locks rospy up, and nodes that sleep
    send none.
    """
    if warped:
        arena.send(do="hold_clock")
        await arena.wait(lambda: not arena.live.running, HELD_S)
    if arena.live.running:
        await arena.look_at_connections()
    live = arena.live
    launched = {start.name for start in starts if start.launch is not None}
    patience_s = dict.fromkeys(launched, (LAUNCH_CTRL_C_S, TERM_S))
    servers = {node for action in live.unended for node in live.published.get(f"{action}/status", ())}
    patience_s = {live.owners.get(node, ""): GOAL_CTRL_C_S for node in servers} | patience_s
    for names in (live.running, live.helpers):
        waits_s = [(name, *patience_s.get(name, (CTRL_C_S, TERM_S))) for name in sorted(names)]
        await asyncio.gather(
            *(arena.interrupt(n, int_s=int_s, term_s=term_s) for n, int_s, term_s in waits_s)
        )
