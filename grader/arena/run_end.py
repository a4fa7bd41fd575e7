"""Whether a run has seen enough, and whether anything may yet come of it: pure, from what has been seen of it so far.

The times follow rospy's own delays: `spin()` wakes twice a second, and a node registers its topics one after the
other.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from itertools import pairwise

from grader.arena.run_state import ROSOUT, RunState, TopicSeen
from grader.evidence.events import UNNAMED
from grader.rubric.scenario import Until
from grader.wording import hertz

Outcome = tuple[str, str]
HEARD_S, HEARD_LOST_S_MAX = 2.0, 6.0
"""A value that is not printed so long after the last probe and the last line will not be; the second is the most that
may be added because other programs kept the machine busy."""
CONNECTED_S = 1.0
"""Nodes that are not connected so long after both are there will not be."""
FED = 2.0
"""A topic whose nodes are sent messages has so many times as long for its first."""
HEARD_AT_MOST_S = 8.0
"""So long after the last probe and the last value that was heard, whatever else is printed."""


def find_outcome(live: RunState, until: Until, now_s: float) -> Outcome | None:
    """Return (outcome, detail) once the run has seen enough or has to give up, else None.

    `silent`: what was waited for stopped coming, or never came though the nodes were up.
    """
    given, until = until, _patient(live, until)
    still_starting = bool(starting(live, until, now_s))
    enough = (not still_starting, *_enough(live, until, now_s, given))
    if live.ended and not live.running:
        return "complete" if until.ended and all(enough) else "ended", ""
    # Where nothing ends the run before its limit, the limit is its end and no failure.
    if waits(until):
        if all(enough):
            return "complete", ""
    elif now_s - live.started_s > until.limit_s:
        return "complete", f"watched for {until.limit_s:g} s"
    # A process that may yet become a node, or a goal that is worked on, makes silence no news.
    wanting = still_starting or (bool(until.ended) and has_goal(live))
    silent = "" if wanting else _silent(live, until, now_s) or _never(live, until, given, now_s)
    silent = silent or _in_namespaces(live, until, now_s)
    if silent:
        return "silent", silent
    late = "" if wanting else _too_slow(live, until, given, now_s)
    if not late and now_s - live.started_s > until.limit_s:
        late = f"not complete after {until.limit_s:g} s"
    return ("timeout", late) if late else None


def _enough(live: RunState, until: Until, now_s: float, given: Until | None = None) -> tuple[bool, ...]:
    """`given` is `until` as the rubric has it."""
    return (
        _window(live, until, now_s),
        _messages(live, until),
        _are_connected(live, until, now_s),
        _has_heard(live, until, now_s),
        _nodes(live, until, now_s),
        _quiet(live, until, given or until, now_s),
    )


def _patient(live: RunState, until: Until) -> Until:
    """Return `until` with more patience for processes to which others left little of the machine."""
    more_s = round(live.lost_s - live.lost_before_s)
    if not more_s:
        return until
    limit_s = until.limit_s + more_s if waits(until) else until.limit_s
    return until.model_copy(update={"first_message_s": until.first_message_s + more_s, "limit_s": limit_s})


def waits(until: Until) -> bool:
    """Return whether anything ends the run before its limit."""
    lasting = (until.window_s, until.alive_s, until.quiet_s)
    seen = (until.messages, until.connected, until.heard, until.nodes, until.opened, until.ended)
    return any(seconds is not None for seconds in lasting) or any(seen)


def describe_wait(live: RunState, until: Until) -> str:
    """Return in a few words what the run still waits for."""
    missing = [t for t in (*until.topics, *until.messages) if not live.topics[t].count]
    if missing:
        return f"waiting for the first message on {missing[0]}"
    for topic, wanted in until.messages.items():
        if live.topics[topic].count < wanted:
            return f"{live.topics[topic].count} of {wanted} messages on {topic}"
    if not set(until.connected) <= set(live.connected_s):
        return f"waiting for a connection over {', '.join(until.connected)}"
    if len(live.nodes) < until.nodes:
        return f"{len(live.nodes)} of {until.nodes} nodes are up"
    return "observing"


def next_look_s(live: RunState, until: Until, now_s: float) -> float:
    """Return how long nothing can change by time alone."""
    until = _patient(live, until)
    looks = [live.started_s + until.limit_s, live.started_s + until.first_message_s]
    looks += [starts_until_s(live, until)]
    for seen in live.topics.values():
        looks += [
            seen.first_s + (until.window_s or 0),
            seen.last_s + until.silent_s,
            seen.first_s + until.silent_s,
        ]
    looks += [live.graph_changed_s + max(until.silent_s, until.first_message_s)]
    looks += [max(live.last_line_s, live.last_sent_s) + HEARD_S]
    looks += [max(live.last_sent_s, live.last_heard_s) + HEARD_AT_MOST_S]
    looks += [live.activity_s + (until.quiet_s or 0), live.news_s + until.silent_s]
    looks += [_lived_s(live, until.alive_s or 0)]
    # What no time above tells, as whether a process has come to rest, is looked at once a second. The last part makes
    # `>` true at the next look.
    ahead = [look - now_s for look in looks if look > now_s]
    return min([*ahead, 1.0]) + 0.001


def _talking(live: RunState) -> list[TopicSeen]:
    """Return the topics with messages; log messages do not count, as they say nothing of what else may come."""
    return [seen for topic, seen in live.topics.items() if seen.count and topic != ROSOUT]


def _window(live: RunState, until: Until, now_s: float) -> bool:
    if until.window_s is None:
        return True
    topics = until.topics or tuple(live.topics)
    if until.topics:  # others whose rates are judged have their window too, once they are there
        topics += tuple(t for t in live.rates.keys() & live.topics.keys() - {*topics} if live.topics[t].count)
    seen = [live.topics[t] for t in topics if live.topics[t].count]
    if not seen:
        return _talks_elsewhere(live, until, now_s)
    if until.topics and _rates_are_clear(live, topics):
        return True
    # the least time of a rate lies between two of its messages, and the last comes up to a period before the end
    rates = [rate for topic in topics for rate in live.rates.get(topic, ())]
    window_s = max([until.window_s, *(one.min_window_s + 2 / (one.low_hz + one.high_hz) for one in rates)])
    if len(seen) == len(topics):
        return now_s >= max(s.first_s for s in seen) + window_s
    return now_s >= max(s.first_s for s in seen) + max(window_s, _late_s(live, until, now_s))


def _talks_elsewhere(live: RunState, until: Until, now_s: float) -> bool:
    """Return whether the nodes have talked for so long on topics that are not waited for that no more will come of
    them."""
    first_s = min((seen.first_s for seen in _talking(live)), default=now_s)
    return now_s > first_s + max(until.window_s or 0, _late_s(live, until, now_s))


def _late_s(live: RunState, until: Until, now_s: float) -> float:
    """Return how long after the first message on another topic a topic may yet have its first: a node that is sent
    messages may collect many before it publishes."""
    return FED * until.silent_s if is_fed(live, now_s) else until.silent_s


def _rates_are_clear(live: RunState, topics: tuple[str, ...]) -> bool:
    """Return whether each topic is there to show a rate, and its rate is known well enough."""
    return bool(topics) and all(
        topic in live.rates
        and all(bounds.decided_by(live.arrivals_ns[topic]) for bounds in live.rates[topic])
        for topic in topics
    )


def _messages(live: RunState, until: Until) -> bool:
    return all(live.topics[topic].count >= count for topic, count in until.messages.items())


def _are_connected(live: RunState, until: Until, now_s: float) -> bool:
    """Return whether the nodes have been connected for so long that one which dies as soon as it is up would
    have died."""
    since = [live.connected_s.get(topic, now_s) for topic in until.connected]
    return all(now_s >= one_s + CONNECTED_S for one_s in since)


def _nodes(live: RunState, until: Until, now_s: float) -> bool:
    """Return whether what is waited for is there or gone: nodes, opened programs, processes that ended."""
    alive = until.alive_s is None or now_s >= _lived_s(live, until.alive_s)
    up = len(live.nodes) >= until.nodes and set(until.opened) <= live.opened
    return alive and up and set(until.ended) <= live.ended


def _lived_s(live: RunState, alive_s: float) -> float:
    """Return when the nodes have been up for so long, the last process's for half of it."""
    return max(live.first_node_s + alive_s, live.registered_s + alive_s / 2) if live.nodes else math.inf


def _quiet(live: RunState, until: Until, given: Until, now_s: float) -> bool:
    if until.quiet_s is None:
        return True
    if any(publisher not in live.helper_nodes for _, publisher in live.unrecorded):
        return False
    quiet_at_s = live.activity_s + until.quiet_s
    own = {topic: nodes - live.helper_nodes for topic, nodes in live.published.items() if topic != ROSOUT}
    silent = tuple(topic for topic, nodes in own.items() if nodes)
    talks = any(nodes & live.talking.keys() for nodes in own.values())
    if silent and not talks and not is_silent(live, silent, given, now_s):
        quiet_at_s = max(quiet_at_s, _began_s(live) + until.first_message_s)  # it has yet to begin
    return live.activity_s > 0 and now_s >= quiet_at_s


def _has_heard(live: RunState, until: Until, now_s: float) -> bool:
    if not until.heard or not live.unheard or is_settled(live, now_s):
        return True
    lost_s = min(live.lost_s, HEARD_LOST_S_MAX)
    news_s = max(live.last_sent_s, live.last_heard_s)
    return now_s > min(max(live.last_line_s, news_s) + HEARD_S, news_s + HEARD_AT_MOST_S) + lost_s


def starting(live: RunState, until: Until, now_s: float) -> set[str]:
    """Return the processes that may yet become nodes: on a busy machine, imports alone can take many seconds."""
    if now_s > starts_until_s(live, until):
        return set()
    return {p for p in live.running - live.registered if not computes(live, p) and not is_unnamed(live, p)}


def starts_until_s(live: RunState, until: Until) -> float:
    return live.last_start_s + until.silent_s + live.lost_s - live.lost_before_last_s


def _silent(live: RunState, until: Until, now_s: float) -> str:
    waited = (*until.topics, *until.messages)
    seen = _talking(live)
    if waited and not seen:
        is_late = now_s > _began_s(live) + until.first_message_s
        return f"no message within {until.first_message_s:g} s" if is_late else ""
    for topic, count in until.messages.items():
        topic_s = live.topics[topic].last_s
        last_s = max(topic_s or min(s.first_s for s in seen), live.started_s)
        silent_s = until.silent_s if topic_s else _late_s(live, until, now_s)
        if live.topics[topic].count < count and now_s > last_s + silent_s:
            return f"no message on {topic} for {silent_s:g} s"
    patience_s = max(until.silent_s, until.first_message_s)
    changed_s = live.graph_changed_s and max(live.graph_changed_s, live.started_s)
    if until.connected and changed_s and now_s > changed_s + patience_s:
        return f"the graph has not changed for {patience_s:g} s"
    return _standstill(live, until, now_s)


def _never(live: RunState, until: Until, given: Until, now_s: float) -> str:
    """Return what is waited for and cannot come, and all the rest has been seen; else "". `given` is `until` as the
    rubric has it."""
    unanswered = until.connected and live.all_answered_s < live.graph_changed_s + CONNECTED_S
    if unanswered or not is_settled(live, now_s):
        return ""
    waited = [t for t in until.topics if not live.topics[t].count]
    waited += [t for t, wanted in until.messages.items() if live.topics[t].count < wanted]
    absent = {topic for topic in waited if is_silent(live, (topic,), given, now_s)}
    absent |= {topic for topic in until.connected if topic not in live.connected_s}
    topics = tuple(topic for topic in until.topics if topic not in absent)
    possible = {
        "window_s": until.window_s if topics else None,
        "topics": topics,
        "messages": {topic: count for topic, count in until.messages.items() if topic not in absent},
        "connected": tuple(topic for topic in until.connected if topic not in absent),
        "nodes": min(until.nodes, len(live.nodes)),
        "ended": tuple(process for process in until.ended if not goes_on(live, process, now_s)),
    }
    if all(_enough(live, until.model_copy(update=possible), now_s, given)):
        missing = min(absent, default="")
        return f"the graph has settled, without {missing}" if missing else "the graph has settled"
    return ""


def _too_slow(live: RunState, until: Until, given: Until, now_s: float) -> str:
    """Return that a topic is too slow for the messages that are waited for to come within the limit, and all the rest
    has been seen; else "". `given` is `until` as the rubric has it."""
    left_s = live.started_s + until.limit_s - now_s
    rates_hz = {
        topic: hz
        for topic, wanted in until.messages.items()
        if (hz := _steady_hz(live.topics[topic])) and wanted - live.topics[topic].count > FASTER * hz * left_s
    }
    if not rates_hz or is_fed(live, now_s) or now_s < live.all_began_s + live.least_s:
        return ""
    others = {topic: count for topic, count in until.messages.items() if topic not in rates_hz}
    if not all(_enough(live, until.model_copy(update={"messages": others}), now_s, given)):
        return ""
    topic, hz = min(rates_hz.items())
    return f"{until.messages[topic]} messages on {topic} take over {until.limit_s:g} s at {hertz(hz)}"


def _steady_hz(seen: TopicSeen) -> float:
    """Return the rate of a topic that has been steady for long; 0 where it is not, or may become faster."""
    if len(seen.latest_s) < STEADY_COUNT or seen.last_s - seen.latest_s[0] < STEADY_S:
        return 0.0
    times_s = [*seen.latest_s]
    first = bisect_right(times_s, seen.last_s - STEADY_S) - 1
    times_s = times_s[min(first, len(times_s) - STEADY_COUNT) :]
    gaps_s = [later - earlier for earlier, later in pairwise(times_s)]
    mean_s, half = sum(gaps_s) / len(gaps_s), len(gaps_s) // 2
    is_even = all(abs(gap_s - mean_s) <= UNSTEADY * mean_s for gap_s in gaps_s)
    quickens = sum(gaps_s[-half:]) < (1 - QUICKER) * sum(gaps_s[:half])
    return 0.0 if quickens or not is_even else 1 / mean_s


def has_goal(live: RunState) -> bool:
    """Return whether an action's server, which tells its status again and again, has a goal that has no result yet:
    a node that waits for it neither works nor sends until then."""
    counts = {topic: seen.count for topic, seen in live.topics.items() if seen.count}
    servers = [topic.removesuffix("/status") for topic in counts if topic.endswith("/status")]
    return any(counts.get(f"{name}/goal", 0) > counts.get(f"{name}/result", 0) for name in servers)


def _in_namespaces(live: RunState, until: Until, now_s: float) -> str:
    """Return that all nodes are up and connected over topics of these names in namespaces, as long as it would take
    outside of them; else ""."""
    rests = [(process, live.at_rest.get(process)) for process in live.running]
    owners = [live.owners.get(node) for node in live.here]
    if not rests or any(rest is None or owners.count(process) < rest.programs for process, rest in rests):
        return ""
    for topic in until.connected:
        since = [at_s for name, at_s in live.connected_s.items() if name != topic and name.endswith(topic)]
        if topic in live.connected_s or not since or now_s < max(since) + CONNECTED_S:
            return ""
    others = until.model_copy(update={"connected": ()})
    if until.connected and all(_enough(live, others, now_s)):
        return f"the nodes are connected over {until.connected[0]} of a namespace"
    return ""


def _began_s(live: RunState) -> float:
    """Return since when a first message may have come: what starts after a simulator waits until that is up."""
    return max(live.started_s - live.waited_s, live.last_start_s)


def _standstill(live: RunState, until: Until, now_s: float) -> str:
    """Return that nothing happens any more, though more nodes, programs or ends were waited for; "" where something
    may."""
    growing_up = live.nodes and now_s < _lived_s(live, until.alive_s or 0)
    if growing_up or _nodes(live, until, now_s):
        return ""
    patience_s = until.silent_s if live.nodes else max(until.silent_s, until.first_message_s)
    if now_s > max(live.news_s, live.started_s) + patience_s:
        return f"nothing happened for {patience_s:g} s"
    return ""


FIRST_MESSAGE_S = Until.model_fields["first_message_s"].default
SPINNING_S, TALKING_S, LOOPING_S = 1.5, 2.5, 4.0
"""So long after the last change, nothing more is registered by programs that only wait for callbacks, by those that
publish already, and by others that loop."""
ANSWERING_S, RAISED_S = 1.0, 0.5
"""So long after the last message, programs that only wait for callbacks have done what they do for it (`spin()` wakes
twice a second, and one that sleeps for longer is not at rest), and where it ended in an exception."""
COMPUTING_S, IN_VAIN_S = 0.5, 0.25
ENDING_S = 2.5
"""So long after what was typed or sent last, a program that waits may yet end: rospy waits for its threads then."""
LATE_MOST = 0.25
"""A program at rest gets the processor when it wants it: that others fill the machine makes the wait longer by this
share of it at most."""
STREAM, GAPS = 3, 5.0
"""A topic with so many messages is one that goes on, and has stopped when it is silent for so many of its gaps."""
STEADY_COUNT, STEADY_S, UNSTEADY, QUICKER = 20, 15.0, 0.2, 0.05
"""A topic's rate is known from so many messages over so long a time on, if no gap differs by more than this share from
the mean one, and the gaps of the second half are not shorter by more than that share: a full machine makes gaps that
differ, and a node that speeds up makes shorter ones."""
FASTER = 2.0
"""What comes too late for the limit would come too late at so many times the rate, too."""
SLOW_START = 1.2
"""A program that loops and has not published yet is given so many times as long as a right one is watched."""


def is_settled(live: RunState, now_s: float) -> bool:
    """Return whether no node, topic or service is to come any more.

    Every process is there with as many nodes as it has programs, all of these have come to rest, and nothing in the
    graph has changed for a while.
    """
    since_s, asked_s = _at_rest_since(live, now_s), max(live.last_sent_s, live.answers_s)
    if not live.talking and not live.running <= _unused(live):
        asked_s = max(asked_s, live.new_line_s)  # who counts down aloud has something to come
    return (
        since_s is not None
        and now_s > since_s + _longer(live, _patience_s(live))
        and now_s > asked_s + _longer(live, _answers_in_s(live))
    )


def all_compute(live: RunState) -> bool:
    """Return whether each of the student's processes works on and on, and changes nothing."""
    return bool(live.running) and all(computes(live, process) for process in live.running)


def is_silent(live: RunState, topics: tuple[str, ...], until: Until, now_s: float) -> bool:
    """Return whether no message is to come on these topics any more: no node has them, or those that have them do
    nothing but wait for callbacks, loop without publishing on them, or have stopped."""
    if not is_settled(live, now_s):
        return False
    seen = [live.topics[topic] for topic in topics if topic in live.topics]
    count = sum(one.count for one in seen)
    # No node has a publisher of it, and none is to register one any more.
    if not count and live.published.keys().isdisjoint(topics):
        return True
    line_s = 0.0 if live.running <= _unused(live) else live.last_line_s
    last_s = max([live.sent_s, line_s, *(one.last_s for one in seen)])
    if until.first_message_s > FIRST_MESSAGE_S or is_fed(live, now_s):
        return False  # the rubric knows that it takes long, or a node may work on what it hears
    patience_s, answer_s = _patience_s(live), _answers_in_s(live)
    loops = {process for process in live.running if live.at_rest[process].kind == "loops"}
    if live.naps or loops - _unused(live):
        patience_s = max(until.silent_s, 0.0 if count else SLOW_START * live.least_s)
        if count >= STREAM:
            gap_s = (last_s - min(one.first_s for one in seen if one.count)) / (count - 1)
            patience_s = min(patience_s, max(TALKING_S, GAPS * gap_s))
        answer_s = patience_s
    rested_s = _at_rest_since(live, now_s) or 0.0
    return now_s > max(rested_s + _longer(live, patience_s), last_s + _longer(live, answer_s))


def is_fed(live: RunState, now_s: float) -> bool:
    """Return whether messages come to the student's nodes, and end in no exception, or are to come of a simulator that
    has not begun yet."""
    if _is_awaited(live):
        return True
    fresh = {topic for topic, seen in live.topics.items() if seen.last_s and now_s < seen.last_s + SPINNING_S}
    fed = {live.owners.get(node, "") for topic in fresh for node in live.listened.get(topic, ())}
    return any(now_s >= live.raised_s.get(process, -math.inf) + SPINNING_S for process in fed)


def _is_awaited(live: RunState) -> bool:
    """Return whether a program that runs beside the student's has yet to send its first message."""
    return bool(live.helper_nodes) and not live.helper_nodes & live.talking.keys()


def _at_rest_since(live: RunState, now_s: float) -> float | None:
    """Return since when all programs have been nodes at rest and nothing has changed; None where that is not so."""
    rests = [live.at_rest.get(process) for process in live.running]
    if not rests or not live.helpers <= live.registered:
        return None
    owners = [live.owners.get(node) for node in live.here]
    for process, rest in zip(live.running, rests, strict=True):
        lacks_node = rest is None or owners.count(process) < rest.programs
        if rest is None or (lacks_node and not computes(live, process) and not is_unnamed(live, process)):
            return None
    if _is_awaited(live) and any(computes(live, process) for process in live.running):
        return None
    if now_s < live.all_began_s + live.least_s:
        return None
    found = [rest for rest in rests if rest is not None]
    since_s = max(live.graph_changed_s, live.last_start_s, live.slowed_until_s)
    return max(since_s, *(rest.since_s for rest in found))


def computes(live: RunState, process: str) -> bool:
    """Return whether a process works on and on, and changes nothing, or sleeps in a loop before it is a node."""
    rest = live.at_rest.get(process)
    return rest is not None and rest.kind in {"computes", "stuck", "naps"}


def is_unnamed(live: RunState, process: str) -> bool:
    """Return whether a process is a client that looks for a service which is not there, and is no node (it has no
    `init_node`)."""
    lone = live.running - {live.owners.get(node, "") for node in live.here}
    rest, absent = live.at_rest.get(process), live.sought.get(UNNAMED, set()) - live.serves - live.services
    return lone == {process} and rest is not None and rest.programs == 1 and absent != set()


def _waits_for_nothing(live: RunState, process: str) -> bool:
    """Return whether a process looks for a service or an action without end, and for none of those that are there."""
    nodes = {node for node in live.here if live.owners.get(node) == process}
    nodes |= {UNNAMED} if is_unnamed(live, process) else set[str]()
    asked = {service for node in nodes & live.sought.keys() for service in live.sought[node]}
    asked |= live.polled.get(process, frozenset())
    goals = {t.removesuffix("/goal") for t in live.published if t.endswith("/goal")}
    goals = {action for action in goals if f"{action}/cancel" in live.published}
    served = {topic.removesuffix("/goal") for topic in live.listened if topic.endswith("/goal")}
    known, rest = live.serves | live.services | served, live.at_rest.get(process)
    if rest is None or live.gives_up or not asked | goals or known & (asked | goals):
        return False
    others = [live.at_rest.get(other) for other in live.running - {process}]
    # One of the student's own programs may yet offer it, where it does more than wait for callbacks.
    return bool(live.serves) or (
        rest.programs == 1
        and not live.naps
        and all(other is not None and other.kind == "spins" for other in others)
    )


def _unused(live: RunState) -> set[str]:
    """Return the processes that have a publisher, and nothing that uses it."""
    nodes = set().union(*(by for topic, by in live.published.items() if topic != ROSOUT))
    return {live.owners.get(node, "") for node in nodes} & live.mute


def _patience_s(live: RunState) -> float:
    """Return how long after the last change the programs, which are at rest, may yet register something."""
    talking = {live.owners.get(node) for node in live.talking} | _unused(live)
    patience = {
        "spins": LOOPING_S if live.naps else SPINNING_S,
        **dict.fromkeys(("computes", "stuck", "naps"), COMPUTING_S),
    }
    found = []
    for process in live.running:
        own_s = patience.get(live.at_rest[process].kind, LOOPING_S)
        if own_s == SPINNING_S and _raised(live, [process]):
            own_s = ANSWERING_S
        if _waits_for_nothing(live, process):
            is_seen = live.serves and not live.naps and not live.polled.get(process)
            own_s = IN_VAIN_S if is_seen else SPINNING_S
        found.append(min(TALKING_S if process in talking else LOOPING_S, own_s))
    return max(found)


def _answers_in_s(live: RunState) -> float:
    """Return how long after a message the programs, which are at rest, may yet do something for it."""
    waits = not live.naps and all(live.at_rest[process].kind == "spins" for process in live.running)
    answering_s = RAISED_S if _raised(live, live.raised_s) else ANSWERING_S
    return min(_patience_s(live), answering_s) if waits else _patience_s(live)


def _raised(live: RunState, processes: Iterable[str]) -> bool:
    """Return whether a callback of one of these processes ended in an exception since the grader last sent a
    message."""
    sent_s = max(live.sent_s, live.last_sent_s)
    return any(live.raised_s.get(process, -math.inf) >= sent_s for process in processes)


def _longer(live: RunState, patience_s: float) -> float:
    """Return a patience that heeds what others have taken of the machine since all programs came to rest."""
    lost_s = live.lost_s - min(live.at_rest[process].lost_before_s for process in live.running)
    return patience_s + min(lost_s, LATE_MOST * patience_s)


def goes_on(live: RunState, process: str, now_s: float) -> bool:
    """Return whether a process that is at rest will not end by itself: it only waits for callbacks, or works or waits
    without end, and has had its time for what was typed or sent last."""
    rest, may_end = live.at_rest.get(process), bool(live.sent_s) and now_s <= live.sent_s + ENDING_S
    spins = rest is not None and rest.kind == "spins" and not live.naps and not may_end
    endless = (spins or computes(live, process)) and not is_fed(live, now_s)
    return endless or _waits_for_nothing(live, process)
