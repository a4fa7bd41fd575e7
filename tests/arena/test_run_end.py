"""When a run has seen enough: pure."""

from __future__ import annotations

from itertools import accumulate

import pytest

from grader.arena.run_end import (
    describe_wait,
    find_outcome,
    next_look_s,
)
from grader.arena.run_state import RunState
from grader.model.message_rate import RateBounds
from grader.rubric.scenario import Until
from tests.arena.support import state_of

WINDOW = Until(window_s=6, topics=("/a", "/b"), first_message_s=20, silent_s=5)


COUNT = Until(messages={"/a": 10}, silent_s=5, limit_s=60)


@pytest.mark.parametrize(
    ("until", "live", "now_s", "outcome"),
    [
        (WINDOW, state_of(), 19.0, None),
        (WINDOW, state_of(), 20.1, "silent"),
        (WINDOW, state_of(a=(5, 1.0, 2.0), b=(5, 3.0, 3.5)), 8.9, None),
        (WINDOW, state_of(a=(5, 1.0, 2.0), b=(5, 3.0, 3.5)), 9.0, "complete"),
        (WINDOW, state_of(a=(5, 1.0, 2.0)), 6.9, None),
        (WINDOW, state_of(a=(5, 1.0, 2.0)), 7.0, "complete"),
        (WINDOW, state_of(rosout=(5, 1.0, 2.0)), 19.9, None),
        (WINDOW, state_of(rosout=(5, 1.0, 2.0)), 20.1, "silent"),
        (WINDOW, state_of(c=(5, 1.0, 2.0)), 7.0, None),
        (WINDOW, state_of(c=(5, 1.0, 2.0)), 7.1, "complete"),
        (COUNT, state_of(a=(9, 1.0, 2.0)), 6.9, None),
        (COUNT, state_of(a=(10, 1.0, 2.0)), 2.0, "complete"),
        (COUNT, state_of(a=(9, 1.0, 2.0)), 7.1, "silent"),
        (COUNT, state_of(b=(9, 1.0, 9.0)), 6.1, "silent"),
        (COUNT, state_of(a=(9, 1.0, 60.0)), 60.1, "timeout"),
        (Until(limit_s=3), state_of(), 2.9, None),
        (Until(limit_s=3), state_of(), 3.1, "complete"),
        (Until(connected=("/a",)), state_of(), 1.0, None),
    ],
)
def test_settled(until: Until, live: RunState, now_s: float, outcome: str | None) -> None:
    done = find_outcome(live, until, now_s)
    assert (done and done[0]) == outcome


@pytest.mark.parametrize(
    ("busy", "own", "outcome"),
    [(1.0, 0.0, None), (1.0, 0.5, None), (1.0, 0.95, "silent"), (0.8, 0.0, "silent")],
)
def test_a_node_is_waited_for_longer_where_others_fill_the_machine(
    busy: float, own: float, outcome: str | None
) -> None:
    live = state_of()
    for now_s in range(1, 25):
        live.note_machine(busy, own, float(now_s))
    done = find_outcome(live, WINDOW, 24.0)
    assert (done and done[0]) == outcome
    assert find_outcome(live, WINDOW, 4 * WINDOW.first_message_s) is not None


def test_what_others_took_before_the_steps_were_over_lengthens_nothing_behind_them() -> None:
    until = Until(messages={"/a": 1}, first_message_s=20, limit_s=20)
    live = state_of()
    live.lost_s = 60.0
    live.begin_wait(80.0)
    assert find_outcome(live, until, 99.0) is None
    assert find_outcome(live, until, 101.0) == ("silent", "no message within 20 s")
    live.lost_s = 65.0
    assert find_outcome(live, until, 101.0) is None


def test_what_no_node_subscribed_to_is_waited_for_once() -> None:
    until, live = Until(messages={"/a": 1}, first_message_s=20, limit_s=60), state_of()
    live.started_s = 5.0
    live.begin_wait(15.0, heeded=False)
    assert find_outcome(live, until, 24.0) is None
    assert find_outcome(live, until, 26.0) == ("silent", "no message within 20 s")


def test_what_others_took_before_a_process_started_lengthens_nothing_behind_it() -> None:
    live, until = state_of(), Until(nodes=2)
    live.lost_s, live.nodes, live.news_s = 30.0, {"/node"}, 30.0
    live.note_start("late", 40.0, helper=False)
    assert find_outcome(live, until, 45.9) is None
    assert find_outcome(live, until, 46.1) == ("silent", "nothing happened for 6 s")


@pytest.mark.parametrize(
    ("until", "live", "now_s", "outcome"),
    [
        (Until(quiet_s=3), state_of(), 6.0, "complete"),
        (WINDOW, state_of(a=(5, 1.0, 2.0)), 9.0, "complete"),
        (COUNT, state_of(b=(9, 1.0, 9.0)), 9.0, "silent"),
        (Until(nodes=2), state_of(), 9.0, "silent"),
        (Until(alive_s=8), state_of(), 9.0, "complete"),
    ],
)
def test_a_process_that_is_no_node_yet_is_waited_for(
    until: Until, live: RunState, now_s: float, outcome: str
) -> None:
    live.nodes, live.first_node_s, live.activity_s, live.news_s = {"/node"}, 1.0, 1.0, 1.0
    done = find_outcome(live, until, now_s)
    assert done is not None
    assert done[0] == outcome
    live.running, live.last_start_s = {"node", "late"}, 6.0
    assert find_outcome(live, until, now_s) is None
    assert find_outcome(live, until, 6.1 + until.silent_s) is not None


def test_a_node_that_has_a_publisher_and_has_not_used_it_is_not_quiet_yet() -> None:
    live, until = state_of(), Until(quiet_s=3, first_message_s=10)
    live.nodes, live.activity_s, live.published = {"/node"}, 1.0, {"/a": {"/node"}, "/pose": {"/simulator"}}
    live.helper_nodes, live.talking = {"/simulator"}, {"/simulator": 0.5}
    live.note_messages("/pose", 9, 0.5, active=False)
    assert find_outcome(live, until, 9.9) is None
    assert find_outcome(live, until, 10.1) == ("complete", "")
    live.last_start_s = 4.0  # a simulator was waited for
    assert find_outcome(live, until, 13.9) is None
    assert find_outcome(live, until, 14.1) == ("complete", "")
    live.note_messages("/a", 1, 5.0)
    live.talking["/node"] = 5.0
    live.unrecorded.add(("/a", "/node"))  # a flood, of which no more is seen
    assert find_outcome(live, until, 8.1) is None
    live.unrecorded.clear()
    assert find_outcome(live, until, 8.1) == ("complete", "")


def test_what_is_sent_has_longer_to_be_printed_where_others_fill_the_machine() -> None:
    live, until = state_of(), Until(heard=True)
    live.note_probe("word", 1.0)
    assert find_outcome(live, until, 3.1) == ("complete", "")
    live.lost_s = 4.0
    assert find_outcome(live, until, 6.9) is None
    assert find_outcome(live, until, 7.1) == ("complete", "")


def test_the_last_process_is_watched_for_half_as_long_as_the_first() -> None:
    live, until = RunState(running={"first", "second"}, last_start_s=1.0), Until(alive_s=8)
    live.note_graph(["/first"], {"/first": "first"}, 2.0)
    live.note_graph(["/first", "/second"], {"/first": "first", "/second": "second"}, 9.0)
    assert find_outcome(live, until, 12.9) is None
    assert find_outcome(live, until, 13.0) == ("complete", "")


def test_ended_comes_before_all_else() -> None:
    live = state_of(a=(10, 1.0, 2.0))
    live.running, live.ended = set(), {"node"}
    assert find_outcome(live, COUNT, 2.0) == ("ended", "")


TEN_HZ = RateBounds(
    topic="/a", low_hz=9.5, high_hz=10.5, low_gap_ns=50e6, high_gap_ns=150e6, min_window_s=5.0
)


def _rated(gaps_s: list[float], *topics: str, chosen: tuple[str, ...] = ("/a",)) -> bool:
    """Whether a window of 60 s ends early for these topics, all with the same gaps."""
    live = state_of(**{topic: (len(gaps_s), 1.0, 9.0) for topic in topics})
    live.watch_rates([TEN_HZ])
    times_ns = [1_000_000_000 + round(t * 1e9) for t in accumulate([0.0, *gaps_s])]
    for topic in topics:
        for time_ns in times_ns:
            live.note_arrivals("/" + topic, 1, time_ns)
    return find_outcome(live, Until(window_s=60, topics=chosen, limit_s=90), 10.0) is not None


@pytest.mark.parametrize(
    ("gaps_s", "early"),
    [
        ([0.1] * 51, True),
        ([0.1] * 49, False),  # not yet 5 s
        ([0.108, 0.11] * 25, True),  # 9.2 Hz, and it will stay so
        ([0.09] * 60, True),  # 11 Hz
        ([0.095, 0.115] * 25, False),  # 9.52 Hz: too near to the bound
        ([0.1] * 50 + [0.2], False),  # a gap that another one may show to be a rule
        ([0.0] * 9 + [1.0], False),
        (([0.0] * 9 + [1.0]) * 6, False),  # bursts: the mean is right
        ([0.0, 0.001, 0.01] * 500, True),  # a flood, and an uneven one
        ([0.3] * 18, False),  # too few to say anything
        ([0.3] * 21, True),
    ],
)
def test_a_window_ends_when_its_rates_are_clear(gaps_s: list[float], early: bool) -> None:
    assert _rated(gaps_s, "a") is early


def test_a_window_that_shows_more_than_rates_does_not_end_early() -> None:
    assert not _rated([0.1] * 60, "a", chosen=())
    assert not _rated([0.1] * 60, "a", "b", chosen=("/a", "/b"))


def test_a_window_holds_the_least_time_of_a_rate_and_a_period() -> None:
    live, until = state_of(a=(40, 1.0, 6.0)), Until(window_s=5, topics=("/a",))
    assert find_outcome(live, until, 6.05) == ("complete", "")
    live.watch_rates([TEN_HZ])
    assert find_outcome(live, until, 6.05) is None
    assert find_outcome(live, until, 6.15) == ("complete", "")


def test_of_a_flood_few_arrivals_are_kept() -> None:
    live = state_of(a=(1, 1.0, 9.0))
    live.watch_rates([TEN_HZ])
    for number in range(100):
        live.note_arrivals("/a", 1000, number)
    assert len(live.arrivals_ns["/a"]) < 5000
    assert live.arrivals_ns["/a"][-1] == 99


def test_heard_takes_numbers_as_words_of_their_own() -> None:
    live = state_of()
    live.note_probe("12", 1.0)
    live.note_probe("-5", 1.0)
    live.note_line("[INFO] [1712.512]: I heard 128, 5 and 3.12", 1.1)
    assert set(live.unheard) == {"12", "-5"}
    live.note_line("I heard -5: 12", 1.2)
    assert not live.unheard


def test_heard_waits_only_so_long_after_the_last_line() -> None:
    live, until = state_of(), Until(heard=True)
    live.note_probe("12", 1.0)
    live.note_line("nothing of it", 1.5)
    assert find_outcome(live, until, 3.4) is None
    assert find_outcome(live, until, 3.6) == ("complete", "")


def test_a_connection_has_to_last() -> None:
    live, until = state_of(), Until(connected=("/a",))
    live.note_connections({"/a"}, 1.0)
    live.note_connections({"/a"}, 1.9)
    assert find_outcome(live, until, 1.9) is None
    live.note_connections((), 1.95)
    live.note_connections({"/a"}, 2.0)
    assert find_outcome(live, until, 2.5) is None
    assert find_outcome(live, until, 3.0) == ("complete", "")


def test_looking_at_the_graph_is_no_change_of_it() -> None:
    live, until = state_of(), Until(connected=("/a",), silent_s=6, first_message_s=20)
    for now_s in (1.0, 2.0, 20.9):
        live.note_graph(["/talker"], {}, now_s, picture={"publishers": {"/a": ["/talker"]}})
    assert find_outcome(live, until, 20.9) is None
    assert find_outcome(live, until, 21.1) == ("silent", "the graph has not changed for 20 s")
    live.note_graph(["/talker"], {}, 21.1, picture={"publishers": {"/b": ["/talker"]}})
    assert find_outcome(live, until, 21.2) is None


def test_messages_are_no_news_of_a_node_that_is_missing() -> None:
    live, until = state_of(), Until(nodes=2, alive_s=1, silent_s=6)
    live.note_graph(["/turtlesim"], {}, 1.0, picture={})
    live.note_messages("/turtle1/pose", 1, 6.9)
    assert find_outcome(live, until, 6.9) is None
    assert find_outcome(live, until, 7.1) == ("silent", "nothing happened for 6 s")
    live.note_graph(["/turtlesim", "/teleop"], {}, 7.1, picture={})
    assert find_outcome(live, until, 7.2) == ("complete", "")


def test_waiting_is_said_in_words() -> None:
    assert describe_wait(state_of(), WINDOW) == "waiting for the first message on /a"
    assert describe_wait(state_of(a=(3, 1.0, 2.0)), COUNT) == "3 of 10 messages on /a"
    assert describe_wait(state_of(), Until(connected=("/a",))) == "waiting for a connection over /a"


def test_next_look_is_never_in_the_past_and_never_far() -> None:
    for now_s in (0.0, 3.0, 19.9, 100.0):
        assert 0 < next_look_s(state_of(a=(1, 1.0, 2.0)), WINDOW, now_s) <= 1.001


def test_a_rate_on_another_topic_has_its_window_too() -> None:
    live, until = state_of(a=(50, 1.0, 6.0), b=(45, 1.5, 6.0)), Until(window_s=5, topics=("/a",))
    assert find_outcome(live, until, 6.1) == ("complete", "")
    live.watch_rates([TEN_HZ.model_copy(update={"topic": "/b"})])
    assert find_outcome(live, until, 6.4) is None
    assert find_outcome(live, until, 6.6) == ("complete", "")


def test_a_goal_without_its_result_is_waited_for_up_to_the_limit() -> None:
    live, until = state_of(), Until(ended=("client",), silent_s=6, limit_s=40)
    live.note_graph(["/count", "/client"], {}, 1.0, picture={})
    live.note_messages("/count/goal", 1, 1.0)
    assert find_outcome(live, until, 7.1) == (
        "silent",
        "nothing happened for 6 s",
    )  # a topic that is called so
    live.note_messages("/count/status", 5, 2.0)
    assert find_outcome(live, until, 39.9) is None
    assert find_outcome(live, until, 40.1) == ("timeout", "not complete after 40 s")
    live.note_messages("/count/result", 1, 30.0)
    assert find_outcome(live, until, 36.1) == ("silent", "nothing happened for 6 s")


SLOW = Until(messages={"/a": 258}, silent_s=6, limit_s=60)
EVEN = [1.0] * 40


@pytest.mark.parametrize(
    ("gaps_s", "ends_s"),
    [
        (EVEN, 20.0),
        ([0.5] * 80, 16.0),
        ([2.0] * 30, 39.0),
        ([0.1] * 30 + EVEN, 23.0),  # a fast clock that the node does not follow
        ([0.25] * 240, 55.0),  # 60 s are too short for it, but by little
        ([0.2] * 300, None),
        ([1.2 * 0.97**i for i in range(60)], None),  # quickens
        ([1.0] * 15 + [0.1] * 300, None),
        ([1.0, 1.6] * 20, None),  # as on a machine that stalls
        ([1.0] * 10 + [3.0] + [1.0] * 8, None),
    ],
)
def test_a_topic_that_is_steadily_too_slow_is_not_waited_for(
    gaps_s: list[float], ends_s: float | None
) -> None:
    live, ended_s = state_of(), None
    live.note_graph(["/talker"], {"/talker": "talker"}, 0.5)
    for now_s in accumulate(gaps_s, initial=1.0):
        live.note_messages("/a", 1, now_s)
        if now_s < 59 and (done := find_outcome(live, SLOW, now_s)) and done[0] == "timeout":
            ended_s = now_s
            break
    assert ended_s == (pytest.approx(ends_s) if ends_s else None)


def test_what_else_a_slow_topics_run_is_to_show_is_waited_for() -> None:
    live, until = state_of(), SLOW.model_copy(update={"messages": {"/a": 258, "/b": 9}, "silent_s": 30})
    for second in range(1, 25):
        live.note_messages("/a", 1, float(second))
    live.note_messages("/b", 8, 20.0)
    assert find_outcome(live, until, 24.5) is None
    live.note_messages("/b", 1, 24.5)
    assert find_outcome(live, until, 24.5) == ("timeout", "258 messages on /a take over 60 s at 1.00 Hz")
    live.least_s = 30.0
    assert find_outcome(live, until, 24.5) is None
    live.least_s, live.listened, live.owners = 0.0, {"/a": {"/n"}}, {"/n": "n"}
    assert find_outcome(live, until, 24.5) is None  # who is sent messages may yet answer
