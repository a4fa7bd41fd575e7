"""What the grader does in a run once the processes are started: probes, calls, and the scenario's steps, one by one.

What all belongs to a new kind of step is at the beginning of `rubric/scenario.py`.

Messages are made here, from the text of their types, and go to the arena as bytes. Each deed is an event of
`/grader/actor`.
"""

from __future__ import annotations

import asyncio
import base64
import time
from collections.abc import Callable, Coroutine, Mapping
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from typing_extensions import Self

from grader.arena.goals import GoalSender
from grader.arena.run_end import is_settled, is_silent, starting, starts_until_s
from grader.arena.scenario_inputs import make_shots
from grader.arena.served import ServedAction, ServedServices
from grader.arena.session import NS, ArenaSession
from grader.arena.unit_tests import call_functions
from grader.errors import ArenaError, EvidenceError
from grader.evidence.decode import FindText
from grader.evidence.events import MISFIT, NOT_OFFERED, UNHEARD, UNSENDABLE, ActorEvent
from grader.evidence.message_values import MessageType, Moment, ServiceTypes, md5_of
from grader.model.message_definitions import other_fields
from grader.rubric.scenario import (
    Call,
    JudgedGoal,
    Play,
    Publish,
    Scenario,
    Start,
    Step,
    Transform,
    Typed,
    Wait,
)
from grader.wording import plural

if TYPE_CHECKING:
    from grader.evidence.run import Channel

Tell = Callable[[str], None]
ANSWER_S, AGAIN_S = 10.0, 2.0
"""So long an answer is waited for, and by calls of a service that has left one unanswered."""
SUBSCRIBE_S = 6.0
REFUSED_S, UNANSWERED_S = 1.0, 0.5
"""So long a node that asks for a topic of the grader's by another type may yet do something else."""
CTRL_C_S = 5.0
LAUNCH_CTRL_C_S = 20.0  # roslaunch gives its own nodes 15 s and more
TERM_S = 2.0
NOT_PLAYED = frozenset({"/clock", "/rosout", "/rosout_agg"})
"""Where none is named: they are the run's own."""

ProcessSpec: TypeAlias = dict[str, Any]
"""What the arena needs to start a process (`ProcessEnvironment.spec`)."""


class StepRunner:
    """Does the probes, calls and steps of one run. Inside the context, what has gone to the background goes on."""

    def __init__(
        self,
        scenario: Scenario,
        starts: list[tuple[Start, ProcessSpec]],
        arena: ArenaSession,
        tell: Tell,
        *,
        beside: Path | None = None,
        goals: Mapping[tuple[str, int], JudgedGoal] | None = None,
    ) -> None:
        self._scenario = scenario
        self._starts = starts
        self._goals = GoalSender(scenario, arena, self, goals or {}, tell)
        self._beside = beside or Path()
        self._bags: dict[str, tuple[Channel, ...]] = {}
        self._stopped: set[str] = set()
        self._arena, self._may_start = arena, False
        self._services = ServedServices(scenario.serves, arena)
        self._actions = [ServedAction(one, arena) for one in scenario.serves if one.action]
        self._live = arena.live
        self._tell = tell
        self._types: dict[str, MessageType] = {}
        self._md5sums: dict[str, str] = {}
        self._announced: set[str] = set()
        self._fixed: dict[str, Any] = {}
        self._deaf: set[str] = set()
        self._in_vain: set[str] = set()
        self._background: list[asyncio.Task[None]] = []
        self._endless: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        for task in (*self._background, *self._endless):
            task.cancel()
            with suppress(asyncio.CancelledError, ArenaError):  # the run itself meets the same error
                await task

    def advertise(self) -> None:
        """Say on which topics there will be messages, and offer the services, before anything is started."""
        self._services.offer()
        for action in self._actions:
            action.offer()
            self._endless.append(asyncio.ensure_future(action.serve()))
        for probe in self._scenario.probes:
            self.advertise_topic(probe.topic, probe.type, latched=False)
        for step in self._scenario.steps:
            if (sent := step.published) is not None:
                self.advertise_topic(sent.topic, sent.type, latched=sent.latched)
            if step.action is not None:
                self._goals.advertise(step.action)
            if step.play is not None:
                self._advertise_bag(step.play)

    async def run(self) -> None:
        """Return when all is done, but for what lasts as long as the run."""
        if self._scenario.probes:
            await self._probe()
        steps = (*(Step(call=call) for call in self._scenario.calls), *self._scenario.steps)
        for index, step in enumerate(steps):
            self._may_start = any(left.start or left.restart for left in steps[index:])
            if self.is_over():
                break
            await self._do(step)
        for start, spec in self._starts:
            if start.tests is not None:
                await call_functions(spec["name"], self._beside / start.tests, self._arena, self._tell)
        await asyncio.gather(*self._background)

    async def _do(self, step: Step) -> None:
        if step.transform is not None and step.transform.static:
            self._static(step.transform)
        elif (sent := step.published) is not None:
            await self._publish(sent)
        if step.set_param is not None:
            about = step.set_param
            record = {"action": "set_param", "actor": "grader", "topic": about.name, "value": about.value}
            self._arena.send(do="set_param", name=about.name, value=about.value, record=record)
            self._note_deed()
        if step.wait is not None:
            await self._wait(step.wait)
        if step.call is not None:
            await self._call(step.call)
        if step.play is not None:
            await self._begin(self._play(step.play), background=step.play.background)
        if step.action is not None:
            await self._goals.pursue(step.action)
        await self._do_to_process(step)

    async def _do_to_process(self, step: Step) -> None:
        if step.type is not None:
            self._type(step.type)
        if name := step.stop or step.kill or step.restart:
            await self._stop(name, "kill" if step.kill else "stop")
        if name := step.start or step.restart:
            self._start(name)

    def _note_deed(self) -> None:
        """Note that a node that has come to rest, or was switched off, may begin again."""
        self._live.sent_s = time.monotonic()

    def is_over(self) -> bool:
        """Return whether nothing of the student's runs any more, nor will."""
        return not self._live.running and not self._may_start

    @property
    def stopped_all(self) -> bool:
        """Whether steps have stopped all that ran."""
        return not self._live.running and self._live.ended <= self._stopped

    @property
    def unheeded(self) -> bool:
        """Whether no node subscribed to a topic on which steps were to send."""
        return bool(self._deaf)

    # --- Messages ----------------------------------------------------------------------------------------------------

    def advertise_topic(
        self, topic: str, type_: str, *, latched: bool, find_text: FindText | None = None
    ) -> None:
        if topic in self._types:
            return
        try:
            found = MessageType(type_, find_text or self._message_text)
        except ValueError as error:
            self._note_misfit(topic, type_, error)
            return
        if self._md5sums.setdefault(topic, found.md5sum) != found.md5sum:
            self._note("note", topic, f"{UNSENDABLE}{type_}: a recording has another type there")
            return
        self._types[topic] = found
        about = {"type": type_, "md5sum": found.md5sum, "definition": found.definition}
        self._announce(topic, {**about, "latching": latched})

    def can_send(self, topic: str) -> bool:
        """Return whether the type of a topic's messages is known."""
        return topic in self._types

    def _announce(self, topic: str, fields: dict[str, Any]) -> None:
        """Advertise it to the master, once."""
        if topic not in self._announced:
            self._announced.add(topic)
            self._arena.send(do="advertise", fields={"topic": topic, **fields})

    def _message_text(self, type_: str) -> str | None:
        return self._arena.place.type_text(type_, "msg")

    def send_message(
        self, topic: str, value: object, index: int, total: int | None, deed: dict[str, Any] | None = None
    ) -> None:
        """Send one message, and note it as `deed`. Raises ValueError where the value does not fit."""
        self._note_deed()
        type_, moment = self._types[topic], Moment(index, total, self._arena.ros_now_ns())
        data, shown = type_.encode(value, moment), type_.shown(value, moment)
        # Only such a value can be found again in what a node prints.
        if isinstance(shown, str | int) and not isinstance(shown, bool):
            self._live.note_probe(str(shown), time.monotonic())
        about = deed or {"action": "publish", "topic": topic, "type": type_.type, "value": shown}
        record = {"actor": "grader", **about}
        self._arena.send(do="publish", topic=topic, data=base64.b64encode(data).decode(), record=record)

    async def _probe(self) -> None:
        """Send the probes once the student's node has subscribed to every topic, or has had its time to."""
        live, topics = self._live, {probe.topic for probe in self._scenario.probes}
        self._tell(f"waiting for a subscriber on {', '.join(sorted(topics))}")
        patience_s = self._scenario.until.first_message_s
        await self._come(lambda: bool(live.subscribed & topics), patience_s, topics=topics)
        patience_s = SUBSCRIBE_S if live.subscribed & topics else 0.0
        await self._arena.wait(lambda: topics <= live.subscribed or not live.running, patience_s)
        await self._arena.await_connections()
        self._tell("sending it messages")
        for shot in make_shots(self._scenario.probes):
            if not live.running:
                return
            if shot.topic in live.subscribed and shot.topic in self._types:
                self._try_send(Publish(topic=shot.topic, type=shot.type), shot.value, 0, 1)
                await asyncio.sleep(shot.pause_s)

    async def _publish(self, publish: Publish) -> None:
        if publish.topic not in self._types:
            return  # said when it was to be advertised
        await self._begin(self._stream(publish), background=publish.background, endless=publish.total is None)

    def _static(self, transform: Transform) -> None:
        """Send the transform with all that were sent before: a latched topic keeps its last message only."""
        sent = transform.published
        self._fixed[transform.child] = sent.value["transforms"][0]
        self._try_send(sent, {"transforms": list(self._fixed.values())}, 0, 1)

    def _try_send(self, publish: Publish, value: object, index: int, total: int | None) -> bool:
        try:
            self.send_message(publish.topic, value, index, total)
        except ValueError as error:
            self._note_misfit(publish.topic, publish.type, error)
            return False
        return True

    def _note_misfit(self, topic: str, type_: str, error: ValueError) -> None:
        """Note why nothing of that type can be published: by the student's own definition, or by the rubric's."""
        begin = MISFIT if self._arena.place.is_own(type_) else f"{UNSENDABLE}{type_}: "
        self._note("note", topic, f"{begin}{error}")

    async def _stream(self, publish: Publish) -> None:
        topic, total, values = publish.topic, publish.total, publish.in_turn
        if not publish.latched and not await self.has_subscriber(topic):
            return
        self._tell(f"publishing on {topic}")
        due_ns = self._arena.ros_now_ns()
        for index in count() if total is None else range(total):
            if not self._live.running or not self._try_send(
                publish, values[index % len(values)], index, total
            ):
                return
            # What came late is not caught up with: a burst would be another rate than the rubric's.
            due_ns = max(due_ns + round(NS / publish.rate_hz), self._arena.ros_now_ns())
            await self._until(due_ns, exact=True)

    async def has_subscriber(self, topic: str) -> bool:
        """Wait for one, once for each topic."""
        live = self._live
        if topic not in live.subscribed and topic not in self._deaf:
            self._tell(f"waiting for a subscriber on {topic}")
            # Where all processes are up and hear another topic of these, this one's subscriber would be there as well.
            settled = live.subscribed & self._types.keys() and live.running <= live.registered
            patience_s = SUBSCRIBE_S if settled else self._scenario.until.first_message_s
            await self._come(lambda: topic in live.subscribed, patience_s, topics={topic})
            await self._arena.await_connections()
        if topic in live.subscribed:
            self._deaf.discard(topic)
            return True
        self._deaf.add(topic)
        self._note("note", topic, UNHEARD)
        return False

    async def _come(
        self,
        has_come: Callable[[], bool],
        patience_s: float,
        is_over: Callable[[], bool] | None = None,
        topics: AbstractSet[str] = frozenset(),
    ) -> None:
        """Wait for what a node registers, for as long as one may still do so. A node that wants one of these topics by
        another type tries again and again."""
        live, is_over = self._live, is_over or (lambda: not self._live.running)

        def is_refused() -> bool:
            return live.refused >= topics > set() and time.monotonic() > live.graph_changed_s + REFUSED_S

        await self._arena.wait(
            lambda: has_come() or is_over() or is_refused() or is_settled(live, time.monotonic()), patience_s
        )

    async def _begin(
        self, work: Coroutine[Any, Any, None], *, background: bool, endless: bool = False
    ) -> None:
        if not background:
            await work
            return
        (self._endless if endless else self._background).append(asyncio.ensure_future(work))

    # --- Recordings --------------------------------------------------------------------------------------------------

    def _advertise_bag(self, play: Play) -> None:
        """Advertise the recording's topics, each by its first channel; a type that a topic has already stays."""
        from grader.evidence.reader import load_run  # noqa: PLC0415 - few runs play anything

        if play.bag not in self._bags:
            try:
                found = load_run(self._beside / play.bag).channels
                self._bags[play.bag] = tuple(
                    replace(c, md5sum=c.md5sum or md5_of(c.type, c.definition)) for c in found
                )
            except (EvidenceError, ValueError) as error:
                raise ArenaError(f"{play.bag} cannot be played: {error}") from error
        for channel in self._channels_to_play(play):
            if self._md5sums.setdefault(channel.topic, channel.md5sum) == channel.md5sum:
                about = {"type": channel.type, "md5sum": channel.md5sum, "definition": channel.definition}
                self._announce(channel.topic, {**about, "latching": channel.latching})

    def _channels_to_play(self, play: Play) -> list[Channel]:
        channels, wanted = self._bags[play.bag], set(play.topics)
        return [c for c in channels if (c.topic in wanted if wanted else c.topic not in NOT_PLAYED)]

    async def _play(self, play: Play) -> None:
        channels = [c for c in self._channels_to_play(play) if self._md5sums[c.topic] == c.md5sum]
        # All channels by time, as they were recorded: topics may depend on each other.
        messages = sorted((m.log_time_ns, c.topic, m.data) for c in channels for m in c.messages)
        topics = {channel.topic for channel in channels}
        self._tell(f"waiting for a subscriber on {', '.join(sorted(topics))}")
        patience_s = self._scenario.until.first_message_s
        await self._come(lambda: bool(topics & self._live.subscribed), patience_s, self.is_over)
        if not topics & self._live.subscribed:
            self._note("note", play.bag, f"{UNHEARD} to {', '.join(sorted(topics))}")
            return
        self._note("play", play.bag, f"{plural(len(messages), 'message')} on {', '.join(sorted(topics))}")
        self._tell(f"playing {play.bag}")
        begun_ns = self._arena.ros_now_ns()
        for time_ns, topic, data in messages:
            await self._until(begun_ns + round((time_ns - messages[0][0]) / play.speed), exact=True)
            if not self._live.running:
                return
            self._live.sent_s = time.monotonic()
            self._arena.send(do="publish", topic=topic, data=base64.b64encode(data).decode(), record=None)

    # --- Waiting -----------------------------------------------------------------------------------------------------

    async def _until(self, time_ns: int, *, exact: bool = False) -> None:
        """Wait until that time of the run's clock; of the wall's, where that stands still. What is sent at a rate has
        to come at an `exact` time, however busy the machine is: a velocity that holds for longer leads elsewhere."""
        left_s = max(0.0, (time_ns - self._arena.ros_now_ns()) / NS)
        await self._arena.wait(
            lambda: self._arena.ros_now_ns() >= time_ns or self.is_over(), left_s, exact=exact
        )

    async def _come_up(self) -> None:
        """Wait for processes that may yet become nodes: on a busy machine, a pause would be over before they are up."""
        live, until, typed_to = self._live, self._scenario.until, self._scenario.typed_to

        def is_up() -> bool:
            now_s = time.monotonic()
            waited_for = live.helpers - live.registered if now_s <= starts_until_s(live, until) else set()
            waited_for |= starting(live, until, now_s) - typed_to
            return not waited_for or is_settled(live, now_s) or self.is_over()

        await self._arena.wait(is_up, starts_until_s(live, until) - time.monotonic())

    async def _wait(self, wait: Wait) -> None:
        live, patience_s = self._live, self._scenario.until.first_message_s
        if wait.seconds is not None:
            await self._come_up()
            self._tell(f"waiting for {wait.seconds:g} s")
            await self._until(self._arena.ros_now_ns() + round(wait.seconds * NS))
            if not self.is_over():
                self._note("wait", None, f"{wait.seconds:g} s have passed")
            return
        name = wait.topic or wait.node or ""
        self._tell(f"waiting for {name}")
        # What did not come the last time gets little time now, until another process is started.
        limit_s = wait.limit_s or (min(SUBSCRIBE_S, patience_s) if name in self._in_vain else patience_s)
        if self._deaf and self._deaf <= live.refused and not live.topics[name].count:
            limit_s = min(limit_s, UNANSWERED_S)  # the node's type is another: it hears nothing to answer
        wanted = wait.messages + (live.topics[name].count if wait.new else 0)

        def is_there() -> bool:
            return live.topics[name].count >= wanted if wait.topic else name in live.here

        def is_never() -> bool:
            now_s, until = time.monotonic(), self._scenario.until
            return is_silent(live, (name,), until, now_s) if wait.topic else is_settled(live, now_s)

        begun_s = time.monotonic()
        await self._arena.wait(lambda: is_there() or is_never() or self.is_over(), limit_s)
        what = plural(wait.messages, "message") if wait.topic else "the node"
        there = is_there()
        (self._in_vain.discard if there else self._in_vain.add)(name)
        within_s = min(limit_s, time.monotonic() - begun_s)
        self._note("wait", name, f"{what} came" if there else f"{what} did not come within {within_s:.3g} s")

    # --- Processes ---------------------------------------------------------------------------------------------------

    def _start(self, name: str) -> None:
        self._in_vain.clear()
        for spec in self._specs(name):
            self._note("start", None, spec["name"])
            self._stopped.discard(spec["name"])
            self._arena.start(spec)

    async def _stop(self, name: str, action: str) -> None:
        self._tell(f"stopping {name}")
        int_s = LAUNCH_CTRL_C_S if any(s.launch for s, _ in self._starts if s.name == name) else CTRL_C_S
        for spec in self._specs(name):
            process = spec["name"]
            if process in self._live.running | self._live.helpers:
                self._stopped.add(process)
                await self._arena.interrupt(process, int_s=int_s, term_s=TERM_S, action=action)

    def _type(self, typed: Typed) -> None:
        data = base64.b64encode(f"{typed.line}\n".encode()).decode()
        for spec in self._specs(typed.process):
            process = spec["name"]
            record = {"action": "type", "actor": "grader", "detail": process, "value": typed.line}
            self._arena.send(do="type", name=process, data=data, record=record)
            self._note_deed()

    def _specs(self, name: str) -> list[ProcessSpec]:
        return [spec for start, spec in self._starts if start.name == name]

    # --- Services ----------------------------------------------------------------------------------------------------

    async def _call(self, call: Call) -> None:
        """Call the service once it is offered; request and answer are events."""
        arena, live, service = self._arena, self._live, call.service
        self._tell(f"waiting for the service {service}")
        patience_s = self._scenario.until.first_message_s
        await self._come(lambda: service in live.services, patience_s)
        if service in live.services:
            await arena.wait(lambda: not live.running, call.delay_s)
            self._tell(f"calling {service}")
            await self._ask(call)
        else:
            self._note("note", service, NOT_OFFERED)

    async def _ask(self, call: Call) -> None:
        text, fits = None, True
        try:
            text = self._arena.place.type_text(call.type, "srv")
            wanted = call.definition if text is not None else None
            differs = other_fields(call.type, text or "", wanted) if wanted else ""
            if differs:
                self._refuse(call, text, differs, fits=False)
                return
            types = ServiceTypes(call.type, text or "", self._message_text)
            moment, fits = Moment(0, 1, self._arena.ros_now_ns()), False
            data = types.request.encode(call.request, moment)
            shown = types.request.shown(call.request, moment)
        except ValueError as error:
            self._refuse(call, text, str(error), fits=fits)
            return
        about = {"topic": call.service, "type": call.type, "value": shown}
        record = {"action": "call", "actor": "grader", **about}
        self._note_deed()
        encoded = base64.b64encode(data).decode()
        limit_s = ANSWER_S if call.limit_s is None else call.limit_s
        # A second call of a service that is silent: it is given less, and never all of the rubric's own time.
        again_s = min(AGAIN_S, limit_s / 2)
        begun_s, limit_s = time.monotonic(), again_s if call.service in self._in_vain else limit_s
        answer = await self._arena.call(
            limit_s, service=call.service, type=call.type, data=encoded, record=record
        )
        if "data" not in answer:
            if time.monotonic() > begun_s + again_s:
                self._in_vain.add(call.service)
            self._answer(call, None, answer["error"])
            return
        self._note_deed()
        value = types.response.decode(base64.b64decode(answer["data"]))
        self._answer(call, value, "" if value is not None else f"the answer is not a {call.type}")

    def _refuse(self, call: Call, text: str | None, error: str, *, fits: bool) -> None:
        """Note a call that cannot be made: by the fault of the student's own definition, or of this machine."""
        name = call.type.partition("/")[2]
        if not self._arena.place.is_own(call.type) or (fits and text is not None):
            self._answer(call, None, f"the grader could not call it: {error}")
            return
        about = {"topic": call.service, "type": call.type, "value": call.request}
        self._arena.note(ActorEvent(action="call", actor="grader", **about))
        self._answer(call, None, MISFIT + (error if text is not None else f"srv/{name}.srv is not there"))

    def _answer(self, call: Call, value: object, detail: str) -> None:
        about = {"topic": call.service, "type": call.type, "value": value, "detail": detail}
        self._arena.note(ActorEvent(action="answer", actor="grader", **about))

    def _note(self, action: Any, topic: str | None, detail: str) -> None:  # noqa: ANN401 - one of ActorEvent's words
        self._arena.note(ActorEvent(action=action, actor="grader", topic=topic, detail=detail))
