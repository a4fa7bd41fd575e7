"""Which nodes are connected over which topics: what both ends say, held against the kernel's table of sockets.

A node can say what it likes of itself (`getBusInfo`). So a connection counts only where its publisher and its
subscriber are asked in one round and both name it, and where a process of each holds an end of a connection. What the
kernel does not say (no /proc of another user, too many sockets) is left to the two.
"""

import collections
import threading
import time

import sockets
from bounded_sockets import ProtocolError, call, port_of, slave_api
from guard import NAME_CHARS_MAX, OWN_NODE, ROSOUT, shown
from quotas import Pool, cut

# With less, a busy machine's late answer would count as no connection.
BUS_INFO_S, ROUND_S = 1.5, 3.0
CONNECTIONS_MAX = 2000
UDP = "UDPROS"
DOUBTED_ROUNDS, DOUBTS_MAX = 3, 100
"""What is said wrongly so many rounds in a row is told: each end learns at its own time that the other is gone."""

Said = collections.namedtuple("Said", "topic subscriber transport")
Answer = collections.namedtuple("Answer", "serves hears")
"""`serves` are all the connections of a publisher, `hears` is what a subscriber hears: (topic, publisher's name or
port)."""


class Links:
    """`own` is the name under which the arena asks."""

    def __init__(self, own, owners, guard):
        self._own = own
        self._owners = owners
        self._guard = guard
        self._pool = Pool()
        self._doubts = {}

    def of(self, apis):
        """Return the connections between these nodes (addresses by names), all asked side by side, and whether each
        that still listens has answered: a node that does not answer in time has no connection."""
        answers = self._ask(apis)
        ties = Ties(self._owners, {port_of(api) for api in apis.values()})
        found, doubts = [], []
        for node, answer in answers.items():
            for said in answer.serves:
                if node == said.subscriber or self._is_so(node, said, apis, answers, ties):
                    found.append({"topic": said.topic, "publisher": node, "subscriber": said.subscriber})
                elif len(doubts) < DOUBTS_MAX and self._is_made_up(node, said, apis, answers, ties):
                    doubts.append((node, said))
        self._doubts = {doubt: self._doubts.get(doubt, 0) + 1 for doubt in doubts}
        for (node, said), rounds in self._doubts.items():
            if rounds >= DOUBTED_ROUNDS:
                self._refuse(node, said, apis)
        late = any(sockets.listening(port_of(api)) for node, api in apis.items() if node not in answers)
        return found[:CONNECTIONS_MAX], not late

    def subscribers(self, api, topic):
        """Return the subscribers that a publisher itself names."""
        answer = self._answer(api)
        return {said.subscriber for said in answer.serves if said.topic == topic} if answer else set()

    def _is_so(self, node, said, apis, answers, ties):
        answer = answers.get(said.subscriber)
        if answer is None or answer.hears.isdisjoint(((said.topic, node), (said.topic, port_of(apis[node])))):
            return False
        return ties.joined(apis[node], apis[said.subscriber], said.transport) is not False

    def _is_made_up(self, node, said, apis, answers, ties):
        """Return whether what a node says is made up, and not merely out of date: a node that does not answer says
        nothing, and a publisher that sends nothing does not notice that its subscriber has gone."""
        silent = said.subscriber in apis and said.subscriber not in answers
        return not silent and not ties.half_closed(apis[node])

    def _refuse(self, node, said, apis):
        detail = "said that {} is connected to {} over {}, which is not so"
        self._guard.refused(
            self._owners.known(apis[node]) or node,
            detail.format(shown(said.subscriber), shown(node), shown(said.topic)),
        )

    def _ask(self, apis):
        """Return what nodes say, by their names in the order of `apis`."""
        deadline = time.monotonic() + ROUND_S
        found, answered, asked = {}, threading.Semaphore(0), 0
        for node, api in apis.items():
            # Bound now: the loop's variables have moved on when a thread runs it.
            def ask(node=node, api=api):
                if time.monotonic() < deadline:
                    answer = self._answer(api)
                    if answer is not None:
                        found[node] = answer
                answered.release()

            asked += self._pool.submit(self._owners.known(api), ask)
        for _ in range(asked):
            answered.acquire(timeout=max(0.0, deadline - time.monotonic()))
        return {node: found[node] for node in apis if node in found}

    def _answer(self, api):
        """Return what a node says of its connections; None where it says nothing. A subscriber names publishers by
        their addresses, in which the host may have any name."""
        try:
            entries = call(slave_api(api, BUS_INFO_S).getBusInfo, self._own)
        except (ProtocolError, ValueError):
            return None
        serves, hears = [], set()
        for entry in entries[:CONNECTIONS_MAX] if isinstance(entries, list) else ():
            if not isinstance(entry, list) or len(entry) < 5:
                continue
            other, direction, transport, topic = (cut(value, NAME_CHARS_MAX) for value in entry[1:5])
            if direction == "o" and other != ROSOUT and not OWN_NODE.fullmatch(other):
                serves.append(Said(topic, other, transport))
            elif direction == "i":
                hears.add((topic, port_of(other) or other))
        return Answer(serves, hears)


class Ties:
    """Which nodes are connected in the kernel's table, read once: whose processes hold the two ends of a connection.

    A node's processes are those that have the socket open on which its slave API listens. A connection to such a port
    (`calls`) is a call, no topic's: whoever was asked a moment ago has one that is about to be closed.
    """

    def __init__(self, owners, calls):
        self._owners = owners
        self._joined = {}
        self._listening = collections.defaultdict(set)
        self._half_closed = set()
        self._rows = rows = sockets.streams() or ()
        pids = owners.pids({row.inode for row in rows})
        self._streams = _Ends(pids, [row for row in rows if row.state == sockets.ESTABLISHED])
        self._datagrams = None
        for row in rows:
            if row.state == sockets.LISTEN:
                self._listening[row.near] |= pids[row.inode]
            elif row.state == sockets.CLOSE_WAIT and calls.isdisjoint((row.near, row.far)):
                self._half_closed |= pids[row.inode]

    def joined(self, publisher, subscriber, transport):
        """Return whether two processes, one of each node (an address), hold the ends of a connection; None where the
        kernel does not say whose sockets they are. A node that has ended since it was asked, or is just ending, has
        none."""
        key = publisher, subscriber, transport == UDP
        if key not in self._joined:
            self._joined[key] = self._join(port_of(publisher), port_of(subscriber), udp=transport == UDP)
        return self._joined[key]

    def half_closed(self, node):
        """Return whether the node (an address) has a connection whose other end is gone and may not have noticed; True
        where that is not known."""
        pids = self._listening.get(port_of(node))
        return not pids or not pids.isdisjoint(self._half_closed)

    def _join(self, publisher, subscriber, *, udp):
        ours, theirs = self._listening.get(publisher), self._listening.get(subscriber)
        if not ours or not theirs:
            # In a sandbox all that the run has is in its trees: who holds no socket there has ended.
            if self._rows and self._owners.whole:
                return False
            unknown = [port for port, pids in ((publisher, ours), (subscriber, theirs)) if not pids]
            return None if all(port is None or sockets.listening(port) for port in unknown) else False
        # UDP is rare: its table is read only where a node says that it uses it.
        if not udp:
            return self._streams.meet(ours, theirs, {publisher, subscriber})
        if self._datagrams is None:
            rows = sockets.datagrams() or ()
            self._datagrams = _Ends(self._owners.pids({row.inode for row in rows}), rows)
        return self._datagrams.meet(ours, theirs, set(), receiver_is_connected=False)


class _Ends:
    """Sockets by their ports and by the processes that hold them, `pids` by inode."""

    def __init__(self, pids, rows):
        self._holders = collections.defaultdict(set)
        self._held = collections.defaultdict(set)
        for row in rows:
            self._holders[row.near, row.far] |= pids[row.inode]
            for pid in pids[row.inode]:
                self._held[pid].add((row.near, row.far))

    def meet(self, ours, theirs, calls, *, receiver_is_connected=True):
        """Return whether a process of `ours` and another one of `theirs` hold two ends that belong together, on no port
        of `calls`. The receiver of datagrams knows no sender."""
        for pid in ours:
            for near, far in self._held.get(pid, ()):
                other = (far, near if receiver_is_connected else 0)
                holders = self._holders.get(other, set()) & theirs
                if holders - {pid} and calls.isdisjoint((near, far)):
                    return True
        return False
