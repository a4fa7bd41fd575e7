"""Whether anything may yet come of a run: pure conditions on its `RunState`, by which the grader stops waiting.

How long a patience is, is what rospy itself may take: `spin()` wakes twice a second, and a node registers its topics
one after the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from grader.arena.run_state import ROSOUT, RunState
from grader.evidence.events import UNNAMED
from grader.rubric.scenario import Until

FIRST_MESSAGE_S = Until.model_fields["first_message_s"].default
SPINNING_S, TALKING_S, LOOPING_S = 1.5, 2.5, 4.0
"""So long after the last change, nothing more is registered by programs that only wait for callbacks, by those that
publish already, and by others that loop."""
ANSWERING_S, RAISED_S = 1.0, 0.5
"""So long after the last message, programs that only wait for callbacks have done what they do for it (`spin()` wakes
twice a second, and one that sleeps for longer is not at rest), and where it ended in an exception."""
COMPUTING_S, IN_VAIN_S = 0.5, 0.25
LATE_MOST = 0.25
"""A program at rest gets the processor when it wants it: that others fill the machine makes the wait longer by this
share of it at most."""
STREAM, GAPS = 3, 5.0
"""A topic with so many messages is one that goes on, and has stopped when it is silent for so many of its gaps."""
SLOW_START = 1.2
"""A program that loops and has not published yet is given so many times as long as a right one is watched."""


def is_settled(live: RunState, now_s: float) -> bool:
    """Return whether no node, topic or service is to come any more.

    Every process is there with as many nodes as it has programs, all of these have come to rest, and nothing in the
    graph has changed for a while.
    """
    since_s, asked_s = _at_rest_since(live, now_s), max(live.last_sent_s, live.answers_s)
    if not live.talking and not live.running <= _unused(live):
        asked_s = max(asked_s, live.last_line_s)  # who counts down aloud has something to come
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
    since_s = max(live.graph_changed_s, live.last_start_s)
    return max(since_s, *(rest.since_s for rest in found))


def computes(live: RunState, process: str) -> bool:
    """Return whether a process works on and on, and changes nothing."""
    rest = live.at_rest.get(process)
    return rest is not None and rest.kind in {"computes", "stuck"}


def is_unnamed(live: RunState, process: str) -> bool:
    """Return whether a process is a client that looks for a service and is no node (it has no `init_node`)."""
    lone = live.running - {live.owners.get(node, "") for node in live.here}
    rest = live.at_rest.get(process)
    return lone == {process} and rest is not None and rest.programs == 1 and UNNAMED in live.sought


def _waits_in_vain(live: RunState, process: str) -> bool:
    """Return whether a process looks for a service or an action without end, and for none of those that are there."""
    nodes = {node for node in live.here if live.owners.get(node) == process}
    nodes |= {UNNAMED} if is_unnamed(live, process) else set[str]()
    asked = {service for node in nodes & live.sought.keys() for service in live.sought[node]}
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
        "computes": COMPUTING_S,
        "stuck": COMPUTING_S,
    }
    found = []
    for process in live.running:
        own_s = patience.get(live.at_rest[process].kind, LOOPING_S)
        if own_s == SPINNING_S and _raised(live, [process]):
            own_s = ANSWERING_S
        if _waits_in_vain(live, process):
            own_s = IN_VAIN_S if live.serves and not live.naps else SPINNING_S
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
    without end."""
    rest = live.at_rest.get(process)
    spins = rest is not None and rest.kind == "spins" and not live.naps
    endless = (spins or computes(live, process)) and not is_fed(live, now_s)
    return endless or _waits_in_vain(live, process)
