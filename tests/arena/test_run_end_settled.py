"""Whether anything may yet come of a run, its graph and its topics: pure."""

from __future__ import annotations

import math

import pytest

from grader.arena.run_end import (
    all_compute,
    find_outcome,
    is_settled,
    is_silent,
    starting,
)
from grader.arena.run_state import RunState
from grader.rubric.scenario import Until
from tests.arena.support import state_of


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


@pytest.mark.parametrize(("first_message_s", "ends"), [(20, True), (30, False)])
def test_a_full_machine_makes_no_silent_node_one_that_the_rubric_waits_long_for(
    first_message_s: float, ends: bool
) -> None:
    live, until = _resting(node=("spins", 1)), Until(quiet_s=1, first_message_s=first_message_s)
    live.published = {"/a": {"/node"}}
    live.lost_s = 5.0
    assert find_outcome(live, until, 3.0) is None
    assert find_outcome(live, until, 8.0) == (("complete", "") if ends else None)


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


def test_who_sleeps_in_a_loop_before_it_is_a_node_is_not_waited_for() -> None:
    """Where its script has no loop that only sleeps, it may yet become a node."""
    live, until = RunState(), Until(messages={"/a": 10})
    live.note_start("node", 0.0, helper=False)
    live.note_rest("node", "naps", 1, 2.0)
    assert find_outcome(live, until, 19.0) is None
    live.sleeping = frozenset({"node"})
    live.note_rest("node", "naps", 1, 2.0)
    assert find_outcome(live, until, 2.4) is None
    assert find_outcome(live, until, 2.6) == ("silent", "the graph has settled, without /a")


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
    live, until = state_of(raw=(80, 1.0, 9.0)), Until(messages={"/a": 1})
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


@pytest.mark.parametrize(
    ("polled", "offered", "in_vain"), [("/addd", "", True), ("/add", "", False), ("/b", "/b", False)]
)
def test_who_looks_in_the_list_for_a_service_that_nobody_offers_is_not_waited_for(
    polled: str, offered: str, *, in_vain: bool
) -> None:
    live, until = _resting(node=("loops", 1)), Until(ended=("node",))
    live.serves, live.services, live.polled = frozenset({"/add"}), {offered}, {"node": frozenset({polled})}
    assert find_outcome(live, until, 3.4) is None
    assert find_outcome(live, until, 3.6) == (("silent", "the graph has settled") if in_vain else None)


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
    live.note_rest("client", "loops", 1, 5.0)
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


def test_who_was_typed_to_may_yet_end() -> None:
    live, until = _resting(node=("spins", 1)), Until(ended=("node",), silent_s=60)
    live.sent_s = 21.0  # a line was typed
    assert find_outcome(live, until, 23.4) is None
    assert find_outcome(live, until, 23.6) == ("silent", "the graph has settled")
