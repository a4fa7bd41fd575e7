"""The goals that steps send to a student's action server (wiki.ros.org/actionlib/DetailedDescription), one after the
other, and how long each one's result is waited for."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from grader.arena.run_end import LATE_MOST, is_silent
from grader.arena.session import ArenaSession
from grader.evidence.events import GOAL_STATUS, ActorEvent
from grader.evidence.message_values import MessageType
from grader.rubric.scenario import Action, JudgedGoal, Scenario

if TYPE_CHECKING:
    from grader.arena.steps import StepRunner

BEHIND = "the server has not begun with it, since it still works on an earlier goal that got no result"
GOAL_ID, GOALS = "actionlib_msgs/GoalID", "actionlib_msgs/GoalStatusArray"
NOT_BEGUN, BEGUN = {"PENDING", "RECALLING"}, {"ACTIVE", "PREEMPTING"}
ENDING_S, STUCK_S = 10.0, 2.0
"""So long after it was sent, a goal without a result may yet end, above all because of a newer one; and so long a newer
one is not begun with behind one that should have ended."""
ENDING_TIMES, ENDING_LEAST_S = 2.0, 5.0
"""A goal that criteria wait for only so long is taken to end within so many times that, or not at all."""
MARGIN_S, GOES_ON = 0.1, 2
"""A result that should have come so long ago is late on any machine, and with so much feedback behind that the server
goes on with its goal."""
STOPPED, STOPPED_S, STOPPED_GAPS, STOPPED_BEHIND_S, STILL_BEHIND_S = 3, 0.5, 5.0, 1.0, 0.25
"""A server that sent so much feedback has stopped when it is silent for so long, and for so many of its gaps, and does
nothing else. So long a newer goal is not begun with behind that one, and so long each after it."""


class GoalSender:
    """Sends the goals of one run, and notes their results. `judged` is what criteria ask of them, by action and
    number."""

    def __init__(
        self,
        scenario: Scenario,
        arena: ArenaSession,
        runner: StepRunner,
        judged: Mapping[tuple[str, int], JudgedGoal],
        tell: Callable[[str], None],
    ) -> None:
        self._scenario, self._arena, self._runner, self._tell = scenario, arena, runner, tell
        self._judged, self._live = judged, arena.live
        self._results: dict[str, MessageType] = {}
        self._sent: Counter[str] = Counter()
        self._asked: dict[str, tuple[float, float]] = {}
        self._unended: dict[str, tuple[float, float]] = {}
        """The goals that got no result: when one may still end, and how long a newer one waits behind it (s)."""
        self._stopped: dict[str, tuple[int, float]] = {}
        """Those on which the server does no more: how much feedback had come, and how long a newer one waits (s)."""

    def advertise(self, action: Action) -> None:
        place = self._arena.place
        try:
            find_text = place.action_texts(action.type)
            self._results[action.type] = MessageType(f"{action.type}ActionResult", find_text)
            self._statuses = MessageType(GOALS, lambda type_: place.type_text(type_, "msg"))
        except ValueError as error:
            self._note("note", action, detail=f"the grader cannot use {action.type}: {error}")
            return
        self._runner.advertise_topic(
            f"{action.name}/goal", f"{action.type}ActionGoal", latched=False, find_text=find_text
        )
        self._runner.advertise_topic(f"{action.name}/cancel", GOAL_ID, latched=False)
        self._arena.watch(f"{action.name}/result")
        self._arena.watch(f"{action.name}/status")

    async def pursue(self, action: Action) -> None:
        """Send a goal, cancel it where the step says so, and wait for its result."""
        goal, cancel = f"{action.name}/goal", f"{action.name}/cancel"
        is_heard = self._runner.can_send(goal) and await self._runner.has_subscriber(goal)
        if not is_heard or not await self._runner.has_subscriber(cancel):
            return
        self._sent[action.name] += 1
        name = f"grader-{sum(self._sent.values())}"
        value = {"header": {"stamp": "now"}, "goal_id": {"stamp": "now", "id": name}, "goal": action.goal}
        about = {"topic": action.name, "type": action.type}
        try:
            self._runner.send_message(goal, value, 0, 1, {"action": "goal", **about, "value": action.goal})
        except ValueError as error:
            self._note("note", action, detail=f"the grader cannot send the goal: {error}")
            return
        self._tell(f"waiting for the result of {action.name}")
        self._asked[name] = time.monotonic(), self._live.lost_s
        if action.cancel_after_s is None:
            (found, left_s), since = await self._end(action, name), ""
        else:
            left_s, since = action.cancel_after_s, ""
            found = await self._result(action, name, left_s)
            if found is None and not self._is_behind(action, name):
                self._runner.send_message(cancel, {"id": name}, 0, 1, {"action": "cancel", **about})
                self._asked[name] = time.monotonic(), self._live.lost_s
                left_s, since = self._patience_s(action), " after it was cancelled"
                found = await self._in_time(action, name, left_s)
                if found is None and self._is_lost(action, name):
                    left_s = round(time.monotonic() - self._asked[name][0], 1)
        is_behind = found is None and self._is_behind(action, name)
        if found is None:
            self._note_unended(action, name)
            if is_behind:
                self._stopped = {goal: (count, STILL_BEHIND_S) for goal, (count, _) in self._stopped.items()}
        late = BEHIND if is_behind else f"no result within {left_s:.3g} s{since}"
        value_, detail = found or (None, late)
        self._note("result", action, type=action.type, value=value_, detail=detail)

    async def _end(self, action: Action, name: str) -> tuple[tuple[Any, str] | None, float]:
        """Return the end of a goal that is not cancelled, and how long it was waited for (s)."""
        begun_s, lost_before_s, left_s = time.monotonic(), self._live.lost_s, self._patience_s(action)
        feedback = self._live.topics[f"{action.name}/feedback"]
        wanted = feedback.count + self._judged_goal(action).feedback
        found = await self._in_time(action, name, left_s)
        if found is None and left_s < action.limit_s:
            # Feedback that comes late is another criterion's

            def has_reported() -> bool:
                silent = time.monotonic() > max(begun_s, feedback.last_s) + left_s
                return feedback.count >= wanted or silent or self._has_stopped(action, name)

            found = await self._result(action, name, action.limit_s - left_s, has_reported)
            waited_s = time.monotonic() - begun_s - (self._live.lost_s - lost_before_s)
            least_s = 0.0 if self._is_lost(action, name) else left_s
            left_s = min(action.limit_s, max(least_s, round(waited_s, 1)))
        return found, left_s

    def _judged_goal(self, action: Action) -> JudgedGoal:
        return self._judged.get((action.name, self._sent[action.name]), JudgedGoal(math.inf))

    def _note_unended(self, action: Action, name: str) -> None:
        """Keep in mind that this goal has no end, and may keep the server from newer ones."""
        # A short wait for a goal whose end nothing asks for is the rubric's own: the server may rightly go on with it.
        matters_s = self._judged.get((action.name, self._sent[action.name]), JudgedGoal(0.0)).matters_s
        self._live.unended.add(action.name)
        if self._has_stopped(action, name):
            self._stopped[name] = self._live.topics[f"{action.name}/feedback"].count, STOPPED_BEHIND_S
        if action.cancel_after_s is not None:
            self._unended[name] = ENDING_S, STUCK_S
        elif matters_s > 0:
            ending_s = min(ENDING_S, max(ENDING_LEAST_S, ENDING_TIMES * matters_s))
            self._unended[name] = ending_s, STUCK_S
        elif action.limit_s >= ENDING_S:
            self._unended[name] = ENDING_S, ENDING_S

    def _patience_s(self, action: Action) -> float:
        """Return how long the result of a goal is waited for, from when it was sent or cancelled. Before another goal,
        the server must end it, unless it ends it for that."""
        last = [s.action for s in self._scenario.steps if s.action and s.action.name == action.name][-1]
        matters_s, is_cancelled = self._judged_goal(action).matters_s, action.cancel_after_s is not None
        if action is not last and (is_cancelled or not self._live.ends_for_newer):
            return action.limit_s
        return min(action.limit_s, matters_s if is_cancelled or matters_s else math.inf)

    async def _in_time(self, action: Action, name: str, left_s: float) -> tuple[Any, str] | None:
        """Return the end of a goal, if it comes within what criteria ask for. On a full machine, too, a server at rest
        gets the processor when it wants it."""
        is_short = left_s < action.limit_s

        def is_enough() -> bool:
            return is_short and (self._is_older(name, left_s) or self._is_lost(action, name))

        return await self._result(action, name, left_s, is_enough)

    def _is_lost(self, action: Action, name: str) -> bool:
        """Return whether a result is too late by now, and what the server sent says that it will not be there soon: it
        goes on behind the goal's end, or has stopped."""
        judged, seen = self._judged_goal(action), self._live.topics[f"{action.name}/feedback"]
        if not 0 < judged.within_s < math.inf or not self._is_older(name, judged.within_s + MARGIN_S):
            return False
        sent_s = self._asked[name][0]
        if action.cancel_after_s is not None:
            goes_on = sum(at_s > sent_s + judged.within_s for at_s in seen.latest_s) >= GOES_ON
        else:
            goes_on = 0 < judged.feedback < sum(at_s > sent_s for at_s in seen.latest_s)
        return goes_on or self._has_stopped(action, name)

    def _has_stopped(self, action: Action, name: str) -> bool:
        """Return whether the server sent feedback on this goal, has been silent for long, and does nothing else. One
        that sleeps for a time of its own may yet go on."""
        topic, live = f"{action.name}/feedback", self._live
        seen, since_s = live.topics[topic], self._asked[name][0]
        own_s = [at_s for at_s in seen.latest_s if at_s > since_s] if action.cancel_after_s is None else []
        owners = {live.owners.get(node, "") for node in live.published.get(topic, ())}
        if live.naps or len(own_s) < STOPPED or not owners <= live.at_rest.keys():
            return False
        gap_s = max(later - earlier for earlier, later in pairwise(own_s))
        return time.monotonic() > own_s[-1] + max(STOPPED_S, STOPPED_GAPS * gap_s)

    async def _result(
        self, action: Action, name: str, limit_s: float, is_enough: Callable[[], bool] = lambda: False
    ) -> tuple[Any, str] | None:
        """Return the result of that goal and the word for its status."""
        type_, came = self._results[action.type], self._arena.watch(f"{action.name}/result")

        def own() -> dict[str, Any] | None:
            values = (type_.decode(data) for data in came)
            return next((v for v in values if v and v["status"]["goal_id"]["id"] == name), None)

        topics = tuple(f"{action.name}/{part}" for part in ("result", "feedback"))

        def is_never() -> bool:
            if self._runner.is_over() or self._is_behind(action, name):
                return True
            # A server may work on its goal in silence, for as long as the rubric gives it
            served = bool(self._live.listened.get(f"{action.name}/goal"))
            return not served and is_silent(self._live, topics, self._scenario.until, time.monotonic())

        await self._arena.wait(lambda: own() is not None or is_enough() or is_never(), limit_s)
        found = own()
        if found is None:
            return None
        status = found["status"]["status"]
        return found["result"], GOAL_STATUS[status] if status < len(GOAL_STATUS) else f"status {status}"

    def _is_older(self, goal: str, patience_s: float) -> bool:
        """Return whether a goal was sent, or cancelled, so long ago; longer, where others fill the machine."""
        sent_s, lost_before_s = self._asked[goal]
        lost_s = self._live.lost_s - lost_before_s
        if self._live.running <= self._live.at_rest.keys():
            lost_s = min(lost_s, LATE_MOST * patience_s)
        return time.monotonic() > sent_s + patience_s + lost_s

    def _is_behind(self, action: Action, name: str) -> bool:
        """Return whether the server has not begun with this goal for a while, since it still works on an earlier one
        that got no result in its time. One that was not cancelled may end only because of this goal: it gets longer."""
        reports = self._live.topics[f"{action.name}/feedback"].count
        stuck = {
            goal: left_s for goal, (end_s, left_s) in self._unended.items() if self._is_older(goal, end_s)
        } | {goal: left_s for goal, (count, left_s) in self._stopped.items() if count == reports}
        stuck.pop(name, None)
        came = self._arena.watch(f"{action.name}/status")
        if not stuck or not came or not self._is_older(name, min(stuck.values())):
            return False
        seen = self._statuses.decode(came[-1]) or {"status_list": []}
        status = {one["goal_id"]["id"]: one["status"] for one in seen["status_list"]}
        known = {goal: GOAL_STATUS[at] for goal, at in status.items() if at < len(GOAL_STATUS)}
        return known.get(name) in NOT_BEGUN and any(known.get(goal) in BEGUN for goal in stuck)

    def _note(self, did: Any, action: Action, **about: Any) -> None:  # noqa: ANN401 - one of ActorEvent's words
        self._arena.note(ActorEvent(action=did, actor="grader", topic=action.name, **about))
