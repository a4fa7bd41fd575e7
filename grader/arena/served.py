"""The services and actions that the grader offers in a run: their types, their answers as bytes, and what they were
asked.

The arena answers services by itself (`ros/services.py`) and says what came: each request becomes an event of
`/grader/actor`. The server of an action is played from here (wiki.ros.org/actionlib/DetailedDescription). The recorder
takes goals and cancelling as it takes all that students publish; feedback, status and result go out over the arena's
own node, one goal after the other.
"""

from __future__ import annotations

import base64
import math
import time
from typing import Any

from grader.arena.session import ArenaSession
from grader.errors import ArenaError
from grader.evidence.events import GOAL_STATUS, MISFIT, OTHER_TYPE, ActorEvent
from grader.evidence.message_values import MessageType, Moment, ServiceTypes
from grader.model.message_definitions import other_fields
from grader.rubric.scenario import Served

FAILS = "the service cannot do it"
"""What a client of one that `fails` is told."""


class ServedServices:
    """Offers them, and notes what they are asked."""

    def __init__(self, served: tuple[Served, ...], arena: ArenaSession) -> None:
        self._served = {one.name: one for one in served if one.service}
        self._arena = arena
        self._types: dict[str, ServiceTypes] = {}
        arena.on_request = self._note_request
        arena.on_other_type = self._note_other_type

    def offer(self) -> None:
        """Register them with the master, before anything is started."""
        for one in self._served.values():
            self._offer(one)

    def _offer(self, one: Served) -> None:
        try:
            types = self._types[one.name] = self._find(one.type, one.definition)
            now_ns, total = self._arena.ros_now_ns(), len(one.in_turn)
            answers = [types.response.encode(a, Moment(n, total, now_ns)) for n, a in enumerate(one.in_turn)]
        except ValueError as error:
            _refuse(one, self._arena, error)
            return
        fields = {"service": one.name, "type": one.type, "md5sum": types.md5sum, "delay_s": one.delay_s}
        encoded = [base64.b64encode(answer).decode() for answer in answers]
        self._arena.send(
            do="serve", fields={**fields, "answers": encoded, "error": FAILS if one.fails else ""}
        )

    def _find(self, type_: str, text: str | None = None) -> ServiceTypes:
        """Return a type by the text of its `.srv` file. Raises ValueError where there is none, or it is none."""
        place = self._arena.place
        text = place.type_text(type_, "srv") if text is None else text
        if text is None:
            raise ValueError(f"there is no srv/{type_.partition('/')[2]}.srv")
        return ServiceTypes(type_, text, lambda name: place.type_text(name, "msg"))

    def _note_request(self, time_ns: int, fields: dict[str, Any]) -> None:
        one, live = self._served[fields["service"]], self._arena.live
        # Until the answer has gone out, a client that waits for it is no sign that the graph has settled.
        live.answers_s = max(live.answers_s, time.monotonic() + one.delay_s)
        request = self._types[one.name].request.decode(base64.b64decode(fields["data"]))
        response = None if one.fails else one.in_turn[fields["answer"]]
        detail = f"the request is not a {one.type}" if request is None else FAILS if one.fails else ""
        about = {"topic": one.name, "type": one.type, "value": {"request": request, "response": response}}
        event = ActorEvent(action="serve", actor=fields["caller"], **about, detail=detail)
        self._arena.note(event, time_ns)

    def _note_other_type(self, time_ns: int, fields: dict[str, Any]) -> None:
        """A client says no more than its type's MD5 sum: which type that is, files of the package and of ROS say."""
        one, place = self._served[fields["service"]], self._arena.place
        found = next((t for t in place.service_types() if self._has_sum(t, fields["md5sum"])), None)
        own = place.type_text(one.type, "srv") if found == one.type else None
        differs = other_fields(one.type, own, one.definition) if own and one.definition else ""
        about = {"topic": one.name, "type": found, "value": one.type}
        detail = f"{OTHER_TYPE}: {differs}" if differs else OTHER_TYPE
        self._arena.note(ActorEvent(action="note", actor=fields["caller"], **about, detail=detail), time_ns)

    def _has_sum(self, type_: str, md5sum: str) -> bool:
        try:
            return self._find(type_).md5sum == md5sum
        except ValueError:
            return False


def _refuse(one: Served, arena: ArenaSession, error: ValueError) -> None:
    """Note that the student's own type does not fit. Any other type is this machine's fault: raise ArenaError."""
    if one.definition is not None or not arena.place.is_own(one.type):
        raise ArenaError(f"the grader cannot offer {one.name}: {error}", hint="grader doctor") from error
    about = {"topic": one.name, "type": one.type}
    arena.note(ActorEvent(action="note", actor="grader", **about, detail=f"{MISFIT}{error}"))


ACTIVE, PREEMPTED = 1, 2
ENDS = {"succeeded": 3, "aborted": 4}
"""By number (actionlib_msgs/GoalStatus)."""
STATUS, CANCEL = "actionlib_msgs/GoalStatusArray", "actionlib_msgs/GoalID"
GOALS_MAX, RUN_S_MAX = 1000, 3600.0
SENT = ("status", "feedback", "result")


class ServedAction:
    """Plays one action's server."""

    def __init__(self, served: Served, arena: ArenaSession) -> None:
        self._served = served
        self._arena = arena
        self._types: dict[str, MessageType] = {}
        self._goals = arena.watch(f"{served.name}/goal")
        self._cancels = arena.watch(f"{served.name}/cancel")
        self._ended = 0

    def offer(self) -> None:
        """Advertise its topics, before anything is started."""
        one = self._served
        try:
            self._types = self._find()
            for feedback in one.feedback:
                self._encode("feedback", {"feedback": feedback})
            self._encode("result", {"result": one.result})
        except ValueError as error:
            _refuse(one, self._arena, error)
            self._types = {}
            return
        for name in SENT:
            kind = self._types[name]
            fields = {"type": kind.type, "md5sum": kind.md5sum, "definition": kind.definition}
            topic = {"topic": f"{one.name}/{name}", "latching": name == "status"}
            self._arena.send(do="advertise", fields={**fields, **topic}, of_server=True)
        self._send("status", {"status_list": []})

    def _find(self) -> dict[str, MessageType]:
        type_ = self._served.type
        find_text = self._arena.place.action_texts(type_)
        own = {part: f"{type_}Action{part.title()}" for part in ("goal", "feedback", "result")}
        return {n: MessageType(t, find_text) for n, t in {**own, "status": STATUS, "cancel": CANCEL}.items()}

    async def serve(self) -> None:
        """Take goals, one after the other, until the run ends."""
        for _ in range(GOALS_MAX if self._types else 0):
            if not await self._arena.wait(lambda: bool(self._goals), RUN_S_MAX):
                return
            goal = self._types["goal"].decode(self._goals.popleft())
            if goal is not None:
                # While the goal is worked on, nothing counts as settled.
                self._arena.live.answers_s = math.inf
                await self._pursue(goal["goal_id"], goal["goal"])
                self._arena.live.answers_s = time.monotonic()

    async def _pursue(self, goal_id: dict[str, Any], goal: dict[str, Any]) -> None:
        """Report on the goal, end it, and note it."""
        one, began_ns = self._served, self._arena.now_ns()
        status = {"goal_id": goal_id, "status": ACTIVE}
        self._send("status", {"status_list": [status]})
        cancelled = False
        # None stands for the pause after the last feedback, before the result.
        for feedback in (*one.feedback, None):
            await self._arena.wait(lambda: self._is_cancelled(goal_id["id"]), one.delay_s)
            cancelled = self._is_cancelled(goal_id["id"])
            if cancelled or feedback is None:
                break
            self._send("feedback", {"status": status, "feedback": feedback})
        ends = (one.ends,) if isinstance(one.ends, str) else one.ends
        number = PREEMPTED if cancelled else ENDS[ends[min(self._ended, len(ends) - 1)]]
        self._ended += 1
        end = {"goal_id": goal_id, "status": number}
        value = {"request": goal, "response": one.result}
        about = {"topic": one.name, "type": one.type, "value": value, "detail": GOAL_STATUS[number]}
        node = self._arena.last_from[f"{one.name}/goal"]
        self._arena.note(ActorEvent(action="serve", actor=node, **about), began_ns)
        self._send("status", {"status_list": [end]})
        self._send("result", {"status": end, "result": one.result})
        # A cancel without an id is for the goals that there were, not for the next one.
        self._cancels.clear()

    def _is_cancelled(self, goal: str) -> bool:
        """Return whether the goal was cancelled; a cancel message without an id is for all goals."""
        asked = (self._types["cancel"].decode(data) for data in self._cancels)
        return any(one and one["id"] in {"", goal} for one in asked)

    def _encode(self, name: str, value: dict[str, Any]) -> bytes:
        moment = Moment(0, 1, self._arena.ros_now_ns())
        return self._types[name].encode({"header": {"stamp": "now"}, **value}, moment)

    def _send(self, name: str, value: dict[str, Any]) -> None:
        data = base64.b64encode(self._encode(name, value)).decode()
        self._arena.send(do="publish", topic=f"{self._served.name}/{name}", data=data, record=None)
