"""When a run has seen enough: pure."""

from __future__ import annotations

import math
from itertools import accumulate

import pytest

from grader.arena.outcome import (
    all_compute,
    describe_wait,
    find_outcome,
    is_settled,
    is_silent,
    next_look_s,
    starting,
)
from grader.arena.run_state import RunState
from grader.model.message_rate import RateBounds
from grader.rubric.scenario import Until


def _live(**topics: tuple[int, float, float]) -> RunState:
    """Topics as count, first, last; the run started at 0, its process runs and is a node."""
    live = RunState(running={"node"}, registered={"node"})
    for name, (count, first_s, last_s) in topics.items():
        seen = live.topics["/" + name]
        seen.count, seen.first_s, seen.last_s = count, first_s, last_s
    return live


WINDOW = Until(window_s=6, topics=("/a", "/b"), first_message_s=20, silent_s=5)
COUNT = Until(messages={"/a": 10}, silent_s=5, limit_s=60)


@pytest.mark.parametrize(
    ("until", "live", "now_s", "outcome"),
    [
        (WINDOW, _live(), 19.0, None),
        (WINDOW, _live(), 20.1, "silent"),
        (WINDOW, _live(a=(5, 1.0, 2.0), b=(5, 3.0, 3.5)), 8.9, None),
        (WINDOW, _live(a=(5, 1.0, 2.0), b=(5, 3.0, 3.5)), 9.0, "complete"),
        (WINDOW, _live(a=(5, 1.0, 2.0)), 6.9, None),
        (WINDOW, _live(a=(5, 1.0, 2.0)), 7.0, "complete"),
        (WINDOW, _live(rosout=(5, 1.0, 2.0)), 19.9, None),
        (WINDOW, _live(rosout=(5, 1.0, 2.0)), 20.1, "silent"),
        (WINDOW, _live(c=(5, 1.0, 2.0)), 7.0, None),
        (WINDOW, _live(c=(5, 1.0, 2.0)), 7.1, "complete"),
        (COUNT, _live(a=(9, 1.0, 2.0)), 6.9, None),
        (COUNT, _live(a=(10, 1.0, 2.0)), 2.0, "complete"),
        (COUNT, _live(a=(9, 1.0, 2.0)), 7.1, "silent"),
        (COUNT, _live(b=(9, 1.0, 9.0)), 6.1, "silent"),
        (COUNT, _live(a=(9, 1.0, 60.0)), 60.1, "timeout"),
        (Until(limit_s=3), _live(), 2.9, None),
        (Until(limit_s=3), _live(), 3.1, "complete"),
        (Until(connected=("/a",)), _live(), 1.0, None),
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
    live = _live()
    for now_s in range(1, 25):
        live.note_machine(busy, own, float(now_s))
    done = find_outcome(live, WINDOW, 24.0)
    assert (done and done[0]) == outcome
    assert find_outcome(live, WINDOW, 4 * WINDOW.first_message_s) is not None


def test_what_others_took_before_the_steps_were_over_lengthens_nothing_behind_them() -> None:
    until = Until(messages={"/a": 1}, first_message_s=20, limit_s=20)
    live = _live()
    live.lost_s = 60.0
    live.begin_wait(80.0)
    assert find_outcome(live, until, 99.0) is None
    assert find_outcome(live, until, 101.0) == ("silent", "no message within 20 s")
    live.lost_s = 65.0
    assert find_outcome(live, until, 101.0) is None


def test_what_no_node_subscribed_to_is_waited_for_once() -> None:
    until, live = Until(messages={"/a": 1}, first_message_s=20, limit_s=60), _live()
    live.started_s = 5.0
    live.begin_wait(15.0, heeded=False)
    assert find_outcome(live, until, 24.0) is None
    assert find_outcome(live, until, 26.0) == ("silent", "no message within 20 s")


def test_what_others_took_before_a_process_started_lengthens_nothing_behind_it() -> None:
    live, until = _live(), Until(nodes=2)
    live.lost_s, live.nodes, live.news_s = 30.0, {"/node"}, 30.0
    live.note_start("late", 40.0, helper=False)
    assert find_outcome(live, until, 45.9) is None
    assert find_outcome(live, until, 46.1) == ("silent", "nothing happened for 6 s")


@pytest.mark.parametrize(
    ("until", "live", "now_s", "outcome"),
    [
        (Until(quiet_s=3), _live(), 6.0, "complete"),
        (WINDOW, _live(a=(5, 1.0, 2.0)), 9.0, "complete"),
        (COUNT, _live(b=(9, 1.0, 9.0)), 9.0, "silent"),
        (Until(nodes=2), _live(), 9.0, "silent"),
        (Until(alive_s=8), _live(), 9.0, "complete"),
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
    live, until = _live(), Until(quiet_s=3, first_message_s=10)
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
    live, until = _live(), Until(heard=True)
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
    live = _live(a=(10, 1.0, 2.0))
    live.running, live.ended = set(), {"node"}
    assert find_outcome(live, COUNT, 2.0) == ("ended", "")


TEN_HZ = RateBounds(
    topic="/a", low_hz=9.5, high_hz=10.5, low_gap_ns=50e6, high_gap_ns=150e6, min_window_s=5.0
)


def _rated(gaps_s: list[float], *topics: str, chosen: tuple[str, ...] = ("/a",)) -> bool:
    """Whether a window of 60 s ends early for these topics, all with the same gaps."""
    live = _live(**{topic: (len(gaps_s), 1.0, 9.0) for topic in topics})
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
    live, until = _live(a=(40, 1.0, 6.0)), Until(window_s=5, topics=("/a",))
    assert find_outcome(live, until, 6.05) == ("complete", "")
    live.watch_rates([TEN_HZ])
    assert find_outcome(live, until, 6.05) is None
    assert find_outcome(live, until, 6.15) == ("complete", "")


def test_of_a_flood_few_arrivals_are_kept() -> None:
    live = _live(a=(1, 1.0, 9.0))
    live.watch_rates([TEN_HZ])
    for number in range(100):
        live.note_arrivals("/a", 1000, number)
    assert len(live.arrivals_ns["/a"]) < 5000
    assert live.arrivals_ns["/a"][-1] == 99


def test_heard_takes_numbers_as_words_of_their_own() -> None:
    live = _live()
    live.note_probe("12", 1.0)
    live.note_probe("-5", 1.0)
    live.note_line("[INFO] [1712.512]: I heard 128, 5 and 3.12", 1.1)
    assert set(live.unheard) == {"12", "-5"}
    live.note_line("I heard -5: 12", 1.2)
    assert not live.unheard


def test_heard_waits_only_so_long_after_the_last_line() -> None:
    live, until = _live(), Until(heard=True)
    live.note_probe("12", 1.0)
    live.note_line("nothing of it", 1.5)
    assert find_outcome(live, until, 3.4) is None
    assert find_outcome(live, until, 3.6) == ("complete", "")


def test_a_connection_has_to_last() -> None:
    live, until = _live(), Until(connected=("/a",))
    live.note_connections({"/a"}, 1.0)
    live.note_connections({"/a"}, 1.9)
    assert find_outcome(live, until, 1.9) is None
    live.note_connections((), 1.95)
    live.note_connections({"/a"}, 2.0)
    assert find_outcome(live, until, 2.5) is None
    assert find_outcome(live, until, 3.0) == ("complete", "")


def test_looking_at_the_graph_is_no_change_of_it() -> None:
    live, until = _live(), Until(connected=("/a",), silent_s=6, first_message_s=20)
    for now_s in (1.0, 2.0, 20.9):
        live.note_graph(["/talker"], {}, now_s, picture={"publishers": {"/a": ["/talker"]}})
    assert find_outcome(live, until, 20.9) is None
    assert find_outcome(live, until, 21.1) == ("silent", "the graph has not changed for 20 s")
    live.note_graph(["/talker"], {}, 21.1, picture={"publishers": {"/b": ["/talker"]}})
    assert find_outcome(live, until, 21.2) is None


def test_messages_are_no_news_of_a_node_that_is_missing() -> None:
    live, until = _live(), Until(nodes=2, alive_s=1, silent_s=6)
    live.note_graph(["/turtlesim"], {}, 1.0, picture={})
    live.note_messages("/turtle1/pose", 1, 6.9)
    assert find_outcome(live, until, 6.9) is None
    assert find_outcome(live, until, 7.1) == ("silent", "nothing happened for 6 s")
    live.note_graph(["/turtlesim", "/teleop"], {}, 7.1, picture={})
    assert find_outcome(live, until, 7.2) == ("complete", "")


def test_waiting_is_said_in_words() -> None:
    assert describe_wait(_live(), WINDOW) == "waiting for the first message on /a"
    assert describe_wait(_live(a=(3, 1.0, 2.0)), COUNT) == "3 of 10 messages on /a"
    assert describe_wait(_live(), Until(connected=("/a",))) == "waiting for a connection over /a"


def test_next_look_is_never_in_the_past_and_never_far() -> None:
    for now_s in (0.0, 3.0, 19.9, 100.0):
        assert 0 < next_look_s(_live(a=(1, 1.0, 2.0)), WINDOW, now_s) <= 1.001


def _resting(**processes: tuple[str, int]) -> RunState:
    """Each process is a node since 1 s, and at rest since 2 s, as `spins` or `loops` with so many programs."""
    live = RunState()
    for name in processes:
        live.note_start(name, 0.0, helper=False)
    live.note_graph([f"/{name}" for name in processes], {f"/{name}": name for name in processes}, 1.0)
    for name, (rest, programs) in processes.items():
        live.note_rest(name, rest, programs, 2.0)
    return live


@pytest.mark.parametrize(
    ("processes", "settled_s"),
    [
        ({"node": ("spins", 1)}, 3.6),
        ({"node": ("loops", 1)}, 6.1),
        ({"node": ("spins", 1), "other": ("loops", 1)}, 6.1),
        ({"node": ("spins", 2)}, None),  # one of its programs is no node yet
        ({"node": (None, 1)}, None),
    ],
)
def test_a_graph_settles_once_all_nodes_rest(
    processes: dict[str, tuple[str, int]], settled_s: float | None
) -> None:
    live = _resting(**processes)
    assert not is_settled(live, (settled_s or 60.0) - 0.2)
    assert is_settled(live, settled_s or 60.0) is (settled_s is not None)


def test_what_changes_or_works_or_starts_is_not_settled() -> None:
    live = _resting(node=("spins", 1))
    live.note_graph(["/node", "/new"], {"/node": "node", "/new": "node"}, 3.0)
    assert not is_settled(live, 4.4)
    assert is_settled(live, 4.6)
    live.lost_s = 5.0  # others filled the machine, but who is at rest gets the processor
    assert not is_settled(live, 4.8)
    assert is_settled(live, 4.9)
    live.note_rest("node", None, 1, 5.0)
    assert not is_settled(live, 60.0)
    live.note_rest("node", "spins", 1, 60.0)
    assert is_settled(live, 61.6)
    live.note_start("late", 61.0, helper=False)
    assert not is_settled(live, 90.0)


def test_nodes_are_watched_for_the_least_time_though_nothing_more_is_to_come() -> None:
    live = _resting(node=("spins", 1))
    live.least_s = 5.0
    assert not is_settled(live, 5.9)
    assert is_settled(live, 6.0)
    live.talking["/node"] = 4.0
    assert not is_settled(live, 8.9)
    assert is_settled(live, 9.0)


def test_nodes_that_talk_already_settle_sooner_than_those_that_only_loop() -> None:
    live = _resting(node=("loops", 1))
    live.talking["/node"] = 1.5
    assert not is_settled(live, 4.4)
    assert is_settled(live, 4.6)


@pytest.mark.parametrize(
    ("until", "published", "outcome"),
    [
        (Until(messages={"/a": 10}), set(), "the graph has settled, without /a"),
        (Until(messages={"/a": 10}, first_message_s=30), {"/a"}, None),  # it may yet send
        (Until(messages={"/a": 10}), {"/a"}, "the graph has settled, without /a"),  # spin() sends nothing
        (Until(connected=("/a",)), {"/a"}, "the graph has settled, without /a"),
        (Until(nodes=2), set(), "the graph has settled"),
        (Until(window_s=6, topics=("/a",)), set(), "the graph has settled, without /a"),
        (Until(messages={"/a": 10}, alive_s=20), set(), None),
        (Until(messages={"/a": 10}, ended=("node",)), set(), "the graph has settled, without /a"),
        (Until(messages={"/a": 10}, ended=("other",)), set(), None),
    ],
)
def test_what_never_comes_ends_the_wait_once_the_graph_has_settled(
    until: Until, published: set[str], outcome: str | None
) -> None:
    live = _resting(node=("spins", 1))
    live.published = {topic: {"/node"} for topic in published}
    live.note_connections((), 2.9)
    assert find_outcome(live, until, 3.0) is None
    assert find_outcome(live, until, 5.0) == (outcome and ("silent", outcome))


@pytest.mark.parametrize(
    ("connected", "programs", "ends"),
    [
        ({"/robot/a"}, 1, True),
        ({"/robot/a", "/other/a"}, 1, True),
        ({"/robot/a"}, 2, False),  # one of its programs is no node yet
        ({"/robot/b"}, 1, False),
        ({"/a", "/robot/a"}, 1, False),
    ],
)
def test_nodes_that_are_connected_in_a_namespace_are_not_waited_for_longer(
    connected: set[str], programs: int, ends: bool
) -> None:
    live, until = _resting(node=("loops", programs)), Until(connected=("/a",))
    live.lost_s = 60.0  # others fill the machine
    live.note_connections(connected, 2.0)
    assert find_outcome(live, until, 2.9) is None
    found = find_outcome(live, until, 3.1)
    silent = ("silent", "the nodes are connected over /a of a namespace")
    assert found == (silent if ends else ("complete", "") if "/a" in connected else None)


def test_who_has_not_said_yet_what_it_is_connected_to_may_be_connected() -> None:
    live, until = _resting(node=("spins", 1)), Until(connected=("/a",))
    live.note_connections((), 1.5)  # asked before a connection could be there
    live.note_connections((), 4.0, answered=False)
    assert find_outcome(live, until, 5.0) is None
    live.note_connections((), 5.0)
    assert find_outcome(live, until, 5.0) == ("silent", "the graph has settled, without /a")


def test_a_window_that_another_topic_needs_is_watched_to_its_end() -> None:
    live = _resting(node=("loops", 1))
    seen = live.topics["/a"]
    seen.count, seen.first_s, seen.last_s = 5, 2.0, 2.5
    until = Until(window_s=20, topics=("/a", "/b"), silent_s=30)
    assert find_outcome(live, until, 21.9) is None
    assert find_outcome(live, until, 22.0) == ("silent", "the graph has settled, without /b")


def test_who_naps_or_counts_aloud_is_waited_for_longer() -> None:
    live = _resting(node=("spins", 1))
    live.naps = True
    assert not is_settled(live, 5.9)
    assert is_settled(live, 6.1)
    live.note_line("3 … 2 … 1", 6.0)
    assert not is_settled(live, 9.9)
    live.talking["/node"] = 6.0  # who publishes may go on printing
    assert is_settled(live, 9.9)


def test_who_says_the_same_again_and_again_has_nothing_more_to_register() -> None:
    live, until = _resting(node=("loops", 1)), Until(messages={"/a": 10})
    live.published = {"/a": {"/node"}}
    for second in range(2, 9):
        live.note_line(f"[WARN] [17.{second}]: no transform yet", float(second), "node")
    assert live.new_line_s == 2.0
    assert not is_settled(live, 5.9)
    assert is_settled(live, 8.1)
    assert not is_silent(live, ("/a",), until, 13.9)  # what it publishes may yet come
    assert is_silent(live, ("/a",), until, 14.1)
    live.note_line("[WARN] [17.9]: 1 of 2 transforms", 9.0, "node")
    assert not is_settled(live, 12.9)


def test_who_works_on_and_on_is_at_rest_once_it_can_do_nothing_else() -> None:
    live = _resting(node=("stuck", 1))
    assert not is_settled(live, 2.4)
    assert is_settled(live, 2.6)
    live.note_rest("node", "computes", 1, 3.0)  # it may yet come to an end
    assert not is_settled(live, 60.0)
    live.endless = frozenset({"node"})
    live.note_rest("node", "computes", 1, 3.0)
    assert is_settled(live, 3.6)


def test_who_computes_before_it_is_a_node_is_no_longer_starting() -> None:
    live, until = RunState(endless=frozenset({"node"})), Until(messages={"/a": 10})
    live.note_start("node", 0.0, helper=False)
    assert find_outcome(live, until, 3.0) is None
    live.note_rest("node", "computes", 1, 2.0)
    assert find_outcome(live, until, 3.0) == ("silent", "the graph has settled, without /a")


@pytest.mark.parametrize(
    ("rest", "messages", "until", "silent_s"),
    [
        ("spins", 0, Until(messages={"/a": 10}), 3.5),
        ("loops", 0, Until(messages={"/a": 10}), 8.0),  # as long as a topic may be silent
        (
            "loops",
            0,
            Until(messages={"/a": 10}, first_message_s=30),
            None,
        ),  # the rubric knows that it takes long
        ("loops", 1, Until(messages={"/a": 10}), 8.0),  # the next may be seconds away
        ("loops", 5, Until(messages={"/a": 10}), 4.5),  # five in 0.4 s
        ("stuck", 0, Until(messages={"/a": 10}), 2.5),
    ],
)
def test_a_topic_stays_silent_when_its_programs_do_nothing_for_it(
    rest: str, messages: int, until: Until, silent_s: float | None
) -> None:
    live = _resting(node=(rest, 1))
    live.published = {"/a": {"/node"}}
    if messages:
        seen = live.topics["/a"]
        seen.count, seen.first_s, seen.last_s = messages, 1.6, 1.6 + 0.1 * (messages - 1)
        live.talking["/node"] = 1.6
    assert not is_silent(live, ("/a",), until, (silent_s or 19.0) - 0.1)
    assert is_silent(live, ("/a",), until, silent_s or 19.0) is False
    assert is_silent(live, ("/a",), until, (silent_s or 19.0) + 0.1) is (silent_s is not None)


def test_who_hears_messages_may_yet_answer() -> None:
    live, until = _resting(node=("spins", 1)), Until(messages={"/a": 10})
    live.published, live.listened = {"/a": {"/node"}}, {"/pose": {"/node"}}
    live.note_messages("/pose", 1, 20.0, active=False)
    assert not is_silent(live, ("/a",), until, 21.4)
    ends = Until(ended=("node",), silent_s=60)
    assert find_outcome(live, ends, 21.4) is None
    assert find_outcome(live, ends, 21.6) == ("silent", "the graph has settled")
    live.sent_s = 21.0  # the grader's own
    assert not is_silent(live, ("/a",), until, 21.9)
    assert is_silent(live, ("/a",), until, 22.1)


def test_who_is_sent_messages_may_collect_many_before_it_publishes() -> None:
    live, until = _live(raw=(80, 1.0, 9.0)), Until(messages={"/a": 1})
    assert find_outcome(live, until, 7.1) == ("silent", "no message on /a for 6 s")
    live.listened, live.owners = {"/raw": {"/node"}}, {"/node": "node"}
    assert find_outcome(live, until, 9.1) is None
    live.note_line("[ERROR] [17.5]: bad callback: <function callback at 0x7f>", 9.0, "node")
    assert find_outcome(live, until, 9.1) == ("silent", "no message on /a for 6 s")
    live.raised_s.clear()
    live.note_messages("/raw", 40, 13.0, active=True)
    assert find_outcome(live, until, 13.1) == ("silent", "no message on /a for 12 s")
    live.note_messages("/a", 1, 13.1, active=True)
    assert find_outcome(live, until, 13.1) == ("complete", "")


def test_a_loop_in_which_nothing_publishes_is_not_waited_for() -> None:
    live, until = _resting(node=("loops", 1)), Until(messages={"/a": 10})
    live.published = {"/rosout": {"/node"}}
    live.mute = frozenset({"node"})
    assert not is_settled(live, 5.9)  # it may yet register something
    live.published["/a"] = {"/node"}
    assert find_outcome(live, until, 4.4) is None
    assert find_outcome(live, until, 4.6) == ("silent", "the graph has settled, without /a")
    live.note_line("publishing 1", 4.5)  # it only says so
    assert find_outcome(live, until, 4.6) == ("silent", "the graph has settled, without /a")
    live.mute = frozenset()
    assert find_outcome(live, until, 7.9) is None


def test_a_simulator_that_has_not_begun_is_waited_for() -> None:
    live, until = _resting(node=("spins", 1)), Until(messages={"/a": 10})
    live.published = {"/a": {"/node"}}
    live.note_start("world", 0.0, helper=True)
    live.note_graph(["/node", "/world"], {"/node": "node", "/world": "world"}, 2.0)
    assert not is_silent(live, ("/a",), until, 19.0)
    live.talking["/world"] = 19.0
    assert is_silent(live, ("/a",), until, 19.1)


@pytest.mark.parametrize(
    ("sought", "goal", "in_vain"),
    [
        ({"/addd"}, "", True),
        ({"/add"}, "", False),
        ({"/addd", "/add"}, "", False),
        (set(), "/counter", True),
        (set(), "/count", False),
        (set(), "", False),
    ],
)
def test_who_looks_for_what_nobody_offers_is_not_waited_for(
    sought: set[str], goal: str, in_vain: bool
) -> None:
    live, until = _resting(node=("loops", 1)), Until(ended=("node",))
    live.serves = frozenset({"/add", "/count"})
    live.sought["/node"] = sought
    topics = (f"{goal}/goal", f"{goal}/cancel") if goal else ("/goal",)
    live.published = {topic: {"/node"} for topic in topics}
    assert find_outcome(live, until, 2.2) is None
    assert find_outcome(live, until, 2.3) == (("silent", "the graph has settled") if in_vain else None)


def test_a_client_of_another_name_than_the_students_server_is_not_waited_for() -> None:
    live, until = _resting(client=("loops", 1), server=("spins", 1)), Until(ended=("client",))
    live.services, live.sought["/client"] = {"/clamps"}, {"/clamp"}
    assert find_outcome(live, until, 3.4) is None
    assert find_outcome(live, until, 3.6) == ("silent", "the graph has settled")
    live.gives_up = True
    assert find_outcome(live, until, 3.6) is None
    live.gives_up, live.services = False, {"/clamp"}
    assert find_outcome(live, until, 3.6) is None
    live.services, live.published = set(), {"/count/goal": {"/client"}, "/count/cancel": {"/client"}}
    assert find_outcome(live, until, 3.6) == ("silent", "the graph has settled")
    live.sought.clear()
    live.listened = {"/count/goal": {"/server"}}
    assert find_outcome(live, until, 3.6) is None
    live.sought["/client"], live.listened = {"/clamp"}, {}
    live.note_rest("server", "loops", 1, 2.0)  # it may offer it in the end
    assert find_outcome(live, until, 3.6) is None
    live.note_rest("server", "spins", 1, 2.0)
    assert find_outcome(live, until, 3.6) == ("silent", "the graph has settled")
    live.note_rest("client", "loops", 2, 2.0)  # of two programs, one may offer what the other asks for
    assert find_outcome(live, until, 3.6) is None


def test_a_client_that_is_no_node_is_not_waited_for_where_nobody_offers_its_service() -> None:
    live, until = _resting(server=("spins", 1)), Until(ended=("client",))
    live.note_start("client", 0.0, helper=False)
    live.note_rest("client", "loops", 1, 2.0)
    live.services = {"/clamps"}
    assert find_outcome(live, until, 5.0) is None  # who knows what it does
    live.sought["/unnamed"] = {"/clamp"}
    assert find_outcome(live, until, 3.4) is None
    assert find_outcome(live, until, 3.6) == ("silent", "the graph has settled")
    live.services = {"/clamp"}
    assert find_outcome(live, until, 3.6) is None
    live.services = {"/clamps"}
    live.note_start("other", 0.0, helper=False)  # which of the two asks is not known
    live.note_rest("other", "loops", 1, 2.0)
    assert find_outcome(live, until, 5.0) is None


def test_who_asked_for_a_service_before_init_node_may_become_a_node() -> None:
    live, until = _resting(server=("spins", 1)), Until(nodes=2)
    live.note_start("client", 4.0, helper=False)
    live.note_rest("client", "naps", 1, 5.0)
    live.services, live.sought["/unnamed"] = {"/clamp"}, {"/clamp"}
    assert starting(live, until, 9.0) == {"client"}
    live.services = set()
    assert starting(live, until, 9.0) == set()
    live.note_graph(["/client"], {"/client": "client"}, 9.0)
    assert "/unnamed" not in live.sought


def test_a_service_is_sought_by_who_asks_for_it_again() -> None:
    live = RunState()
    live.note_lookup("/node", "/there", is_there=True)
    live.note_lookup("/node", "/log", is_there=False)
    live.note_lookup("/other", "/log", is_there=False)
    assert live.sought == {"/node": {"/there"}}
    live.note_lookup("/node", "/log", is_there=False)
    assert live.sought == {"/node": {"/there", "/log"}}


def test_a_callback_that_ended_in_an_exception_does_nothing_more() -> None:
    live = _resting(node=("spins", 1))
    live.sent_s = 2.0
    live.raised_s["node"] = 2.0
    assert not is_settled(live, 2.9)
    assert is_settled(live, 3.1)
    live.sent_s = 2.1  # what came since may be heard
    assert not is_settled(live, 3.4)
    assert is_settled(live, 3.6)


def test_nothing_is_settled_while_the_grader_works_on_an_answer() -> None:
    live = _resting(node=("spins", 1))
    live.answers_s = math.inf
    assert not is_settled(live, 60.0)
    live.answers_s = 60.0
    assert not is_settled(live, 60.9)
    assert is_settled(live, 61.1)


def test_a_call_is_given_up_where_all_programs_compute() -> None:
    assert all_compute(_resting(node=("stuck", 1)))
    assert not all_compute(_resting(node=("stuck", 1), other=("spins", 1)))
    assert not all_compute(RunState())


def test_a_rate_on_another_topic_has_its_window_too() -> None:
    live, until = _live(a=(50, 1.0, 6.0), b=(45, 1.5, 6.0)), Until(window_s=5, topics=("/a",))
    assert find_outcome(live, until, 6.1) == ("complete", "")
    live.watch_rates([TEN_HZ.model_copy(update={"topic": "/b"})])
    assert find_outcome(live, until, 6.4) is None
    assert find_outcome(live, until, 6.6) == ("complete", "")
