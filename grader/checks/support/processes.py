"""The life of the student's processes in a run: how they took Ctrl-C, and which nodes of the ROS graph are theirs.

Ctrl-C in the middle of `publish(…)` or `loginfo(…)` can lock up rospy's own shutdown, by no fault of the student's: its
signal handler then waits for a lock that the interrupted call holds.
"""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field

from grader.checks.registry import Refers
from grader.checks.support.text import ANONYMOUS, init
from grader.evidence.events import UNNAMED, ProcessEvent
from grader.evidence.run import Run, once_for_each_run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed_or_blocked
from grader.wording import join_words, on_lines, seconds, shorten

NO_SCRIPT_HINT = "add the script to the package, and push it"
LOGGERS = ("/get_loggers", "/set_logger_level")
"""How the names of the services end that every node has."""
STEPS = ("stop", "kill")
FLOOD_HZ = 100
SILENT_AFTER_NS = 500_000_000
TALKING_NS = 1_000_000_000
TALKING_LINES = 5
UP_NS = 5_000_000_000
"""So long after its start, a program of the grader's is a node."""
SHUT_DOWN = "shutdown request"
LINE_CHARS = 200


class Life(NamedTuple):
    """One process from start to end. `end` is None while it ran on to the end of the recording. `by_step`: it was not
    the run's end that stopped it, but a step of the scenario."""

    name: str
    start_ns: int
    start: ProcessEvent
    end_ns: int | None
    end: ProcessEvent | None
    interrupt_ns: int | None
    by_step: bool = False

    @property
    def ended_early(self) -> bool:
        """It ended before the grader pressed Ctrl-C: by itself, or because it broke a limit."""
        # Killed without a Ctrl-C before it, it broke a limit.
        return self.end is not None and self.interrupt_ns is None and self.end.stopped_by in {None, "KILL"}

    @property
    def lasted(self) -> str:
        """`2.0 s`: how long it ran before it ended."""
        return seconds((self.end_ns or self.start_ns) - self.start_ns)

    def until_ns(self, run: Run) -> int:
        """Return up to when it could act freely: Ctrl-C, its own end, or the recording's."""
        times = (t for t in (self.interrupt_ns, self.end_ns) if t is not None)
        return min(times, default=run.end_ns)


def signal_name(number: int) -> str:
    """Return `signal 11 (SIGSEGV)`."""
    try:
        return f"signal {number} ({signal.Signals(number).name})"
    except ValueError:
        return f"signal {number}"


def not_started(who: str) -> Verdict:
    """Return the verdict where there was no script to start."""
    return failed_or_blocked(f"{who} was not started: there is no script to run", hint=NO_SCRIPT_HINT)


@once_for_each_run
def lives(run: Run) -> tuple[Life, ...]:
    """Return the student's processes in order of their start."""
    starts = [(t, e) for t, e in run.processes if e.role == "student" and e.event == "start"]
    return tuple(_life(run, start_ns, start) for start_ns, start in starts)


def failed_program(run: Run, names: Collection[str]) -> str:
    """Return how one of the grader's own programs failed in the run, "" where none did.

    One that another node shut down, by taking its name or by `rosnode kill`, did not fail by itself.
    """
    owners = {process for _, event in run.graph for process in event.processes.values()}
    for start_ns, start in run.processes:
        if start.role != "grader" or start.event != "start" or start.name not in names:
            continue
        one = _life(run, start_ns, start)
        lines = [line.line.strip() for _, line in run.lines(one.name) if line.line.strip()]
        if not one.ended_early and owners and one.name not in owners and one.until_ns(run) - start_ns > UP_NS:
            last = f": {shorten(lines[-1], LINE_CHARS)}" if lines else ""
            return f"{one.name} ran for {seconds(one.until_ns(run) - start_ns)} and never became a node{last}"
        if one.end is None or not one.ended_early or one.end.exit_code == 0:
            continue
        if not any(SHUT_DOWN in line for line in lines):
            last = f": {shorten(lines[-1], LINE_CHARS)}" if lines else ""
            return f"{one.name} ended with {how_it_ended(one.end)}{last}"
    return ""


def ended_programs(run: Run) -> set[str]:
    """Return the grader's own programs that ended by themselves while the run went on, with exit code 0."""
    starts = [(t, e) for t, e in run.processes if e.role == "grader" and e.event == "start"]
    found = (_life(run, start_ns, start) for start_ns, start in starts)
    ended = {one.name for one in found if one.ended_early and one.end is not None and one.end.exit_code == 0}
    return {name for name in ended if not any(SHUT_DOWN in line.line for _, line in run.lines(name))}


def how_it_ended(end: ProcessEvent) -> str:
    """Return `exit code 1`, or `signal 9`."""
    return f"signal {end.signal}" if end.exit_code is None else f"exit code {end.exit_code}"


def _life(run: Run, start_ns: int, start: ProcessEvent) -> Life:
    ends = ((t, e) for t, e in run.processes if e.event == "exit" and e.name == start.name and t >= start_ns)
    end_ns, end = next(ends, (None, None))
    interrupt_ns, action = min(_interrupts(run, start.name, start_ns), default=(None, ""))
    # Ctrl-C for the whole run came when this one had ended by itself.
    if interrupt_ns is not None and end_ns is not None and end_ns < interrupt_ns:
        interrupt_ns, action = None, ""
    return Life(start.name, start_ns, start, end_ns, end, interrupt_ns, action in STEPS)


def _interrupts(run: Run, process: str, after_ns: int) -> Iterator[tuple[int, str]]:
    """Yield when the grader stopped this process, and how. An interrupt that names no known process is for all."""
    known = {e.name for _, e in run.processes}
    for time_ns, event in run.actors:
        if event.action in {"interrupt", *STEPS} and time_ns >= after_ns:
            named = {event.actor, event.detail} & known
            if not named or process in named:
                yield time_ns, event.action


def life(run: Run, process: str) -> Life | None:
    """Return the first life of that process; of the only one of the run where `process` is empty."""
    found = lives(run)
    if not process:
        return found[0] if len({one.name for one in found}) == 1 else None
    return next((one for one in found if one.name == process), None)


def life_of(run: Run, node: str) -> Life | None:
    """Return the process that a node belongs to; None where it cannot be told, or is not the student's."""
    # From the end, as another process may have taken the name.
    return life(run, next((e.processes[node] for _, e in reversed(run.graph) if node in e.processes), ""))


def slips_of(package: PackageFacts, run: Run, callerid: str, *kinds: SlipKind) -> list[PythonSlip]:
    """Return what is remarkable, of these kinds, in the script that the node runs."""
    life = life_of(run, callerid)
    return [s for s in package.slips if life is not None and s.kind in kinds and s.file == life.start.script]


def named_at(package: PackageFacts, run: Run, kind: SlipKind, name: str) -> tuple[FileCitation, ...]:
    """Return the one line of the run's scripts whose call names this node, topic or parameter."""
    found = {slip.place for slip in slips_that_name(package, run, kind, name) if not slip.fix}
    return tuple(found) if len(found) == 1 else ()


def where_named(named: tuple[FileCitation, ...], call: str) -> str:
    """Return where a name is written: `on line 5 of scripts/talker.py`, or in a call where no one line is known."""
    return f"on line {named[0].line} of {named[0].file}" if len(named) == 1 else f"in {call}"


def is_written_as(written: str, topic: str) -> bool:
    """Return whether a name in the source can be that of a topic, in whatever namespace the node is."""
    return written.rpartition("/")[2].lstrip("~") == topic.rpartition("/")[2]


def slips_that_name(package: PackageFacts, run: Run, kind: SlipKind, name: str) -> list[PythonSlip]:
    """Return where the run's scripts name this node, topic or parameter; those of a node may be in a variable."""
    return [s for s in run_slips(package, run, kind) if is_written_as(s.message, name)]


def run_slips(package: PackageFacts, run: Run, *kinds: SlipKind) -> list[PythonSlip]:
    """Return what is remarkable, of these kinds, in the scripts that run."""
    scripts = run_scripts(run)
    return [s for s in package.slips if s.kind in kinds and s.file in scripts]


TYPES_HINT = "give the topic the handout's type where it is advertised, and where it is subscribed to"
_WANTS_TYPE = re.compile(
    r"\[(\S+)\] wants topic (\S+) to have datatype/md5sum \[([\w/]+)/\w+\], but our version has \[([\w/]+)/\w+\]"
)


def disputed_types(run: Run, topic: str = "") -> str:
    """Return how the types of a topic, or of any, do not fit, as a node of roscpp says that publishes on it."""
    for _, console in run.console:
        if (found := _WANTS_TYPE.search(console.line)) and topic in {"", found[2]}:
            return f"{found[2]} is advertised as {found[4]}, and {found[1]} hears it as {found[3]}"
    return ""


def ends_twice(run: Run) -> bool:
    """Return whether actionlib says that a server tried to end a goal that was over."""
    return any("To transition to a" in line.line for _, line in run.console)


def copied_topic(
    package: PackageFacts, run: Run, kind: Literal["publisher", "subscriber"], topic: str = ""
) -> str:
    """Return the lines of one running script that name the same topic, as where one is copied; "" for none."""
    places: dict[tuple[str, str], list[int]] = {}
    for slip in run_slips(package, run, kind):
        name = slip.message.strip("/")
        if name == (topic.strip("/") or name):
            places.setdefault((slip.file, name), []).append(slip.line)
    found = ((file, sorted(set(lines))) for (file, _), lines in places.items())
    return next((f"{on_lines(n)} of {file}" for file, n in found if len(n) > 1), "")


def by_copies(package: PackageFacts, run: Run, topic: str, of_node: Callable[..., Verdict]) -> Verdict | None:
    """Return that a script publishes on a topic with several types, of which one is for it; None where none does."""
    copied = copied_topic(package, run, "publisher", topic)
    named = {
        s.place for s in run_slips(package, run, "publisher") if s.message.strip("/") == topic.strip("/")
    }
    if (
        not copied
        or len({s.message for s in run_slips(package, run, "publisher-type") if s.place in named}) < 2
    ):
        return None
    hint = f"give the one of {copied} that is for another topic that topic's name"
    why = f"{copied} publish on {topic} with several types: rospy sends all by the type of the first"
    return of_node(why, hint=hint)


def run_scripts(run: Run) -> set[str | None]:
    """Return the package's scripts that run; None among them is a program of another kind."""
    return {one.start.script for one in lives(run)}


def early_end(run: Run) -> Life | None:
    """Return the first process of the student's that ended before the grader stopped it."""
    return min([one for one in lives(run) if one.ended_early], key=lambda one: one.end_ns or 0, default=None)


def first_interrupt_ns(run: Run) -> int | None:
    """Return when the grader first pressed Ctrl-C to end the run; None where it never did."""
    stops = (one.interrupt_ns for one in lives(run) if one.interrupt_ns is not None and not one.by_step)
    return min(stops, default=None)


def observed_until_ns(run: Run) -> int | None:
    """Return up to when silence is a living node's own: the first Ctrl-C, or before it the last tick of a fast clock,
    which stands still then. None where neither was recorded."""
    own = [one for one in lives(run) if not one.ended_early and not one.by_step]
    ends = [one.until_ns(run) for one in own if one.end_ns is not None]
    ends += [pressed] if (pressed := first_interrupt_ns(run)) is not None else []
    if run.clock == "warped" and ends:
        ends += [c.times_ns[-1] for c in run.channels if c.topic == "/clock" and c.by_grader and c.times_ns]
    return min(ends, default=None)


def taken_off(run: Run, topic: str) -> set[str]:
    """Return the nodes that are there up to Ctrl-C, and last without the topic."""
    until_ns = observed_until_ns(run) or run.end_ns
    before = (event for time_ns, event in reversed(run.graph) if time_ns <= until_ns)
    if (last := next(before, None)) is None:
        return set()
    return {*last.nodes} - {*last.publishers.get(topic, ()), *last.subscribers.get(topic, ())}


def fell_silent(one: Life, run: Run) -> bool:
    """Return whether it had to be killed, and neither printed nor published after Ctrl-C."""
    if one.interrupt_ns is None or one.end is None or one.end.stopped_by != "KILL":
        return False
    quiet_ns = one.interrupt_ns + SILENT_AFTER_NS
    printed = any(t > quiet_ns for t, _ in run.lines(one.name))
    return not printed and not any(t > quiet_ns for c in run.student_channels() for t in c.times_ns[-1:])


def was_talking(one: Life, run: Run) -> bool:
    """Whether it printed line after line until Ctrl-C, so that its silence afterwards is not a loop that goes on."""
    end_ns = one.interrupt_ns or 0
    return sum(end_ns - TALKING_NS <= t <= end_ns for t, _ in run.lines(one.name)) >= TALKING_LINES


def is_flood(run: Run) -> bool:
    """Return whether so many messages came that Ctrl-C most likely comes in the middle of one."""
    return any(
        len(c.times_ns) > FLOOD_HZ
        # Multiplied, not divided: all may have come at one moment.
        and (len(c.times_ns) - 1) * 1e9 >= FLOOD_HZ * (c.times_ns[-1] - c.times_ns[0])
        for c in run.student_channels()
    )


Anonymous = Literal["allowed", "required", "forbidden"]
_KINDS = {"allowed": "plain or anonymous", "required": "anonymous", "forbidden": "plain"}
_SUFFIX = re.compile(r"_\d+_\d+$")
_ANONYMOUS = r"(_\d+_\d+)?"
_ODD = re.compile(r"[\s*?{}\[\]()#:,;=\"'\\]|[^\x00-\x7f]")
"""What is in no name of the graph, and may have come into one from YAML or a shell."""
TypeName = Annotated[str, Field(pattern=r"^[A-Za-z]\w*/[A-Za-z]\w*$")]


def nodes_of(run: Run, process: str) -> tuple[str, ...]:
    """Return the nodes of one process; all of the student's where it is empty, or the graph names no processes."""
    return run.student_nodes(process) if process and are_noted(run) else run.student_nodes()


def are_noted(run: Run) -> bool:
    """Return whether the graph says which process each of the student's nodes belongs to."""
    return any(run.is_student_node(node) for _, event in run.graph for node in event.processes)


def offered_services(run: Run) -> set[str]:
    """Return the names of the services of all nodes, without those that every node has."""
    return {name for _, e in run.graph for name in e.services if not name.endswith(LOGGERS)}


def asked_services(one: Life, run: Run) -> dict[str, bool]:
    """Return the services for which a process asked, each with whether it was there at once. A program that is no node
    asks by the name that rospy gives to all of these: it counts where there is one such program alone."""
    unnamed = [other.name for other in lives(run) if not run.student_nodes(other.name)]
    is_no_node = unnamed == [one.name] and (are_noted(run) or not run.student_nodes())
    names = {UNNAMED} if is_no_node else {*nodes_of(run, one.name)}
    looked = [e for _, e in run.actors if e.action == "lookup" and e.actor in names and e.topic]
    return {e.topic or "": not e.detail for e in looked}


def is_named(node: str, names: Iterable[str], anonymous: Anonymous) -> bool:
    """Return whether a node has this name. An anonymous one has `_<digits>_<digits>` after it, as rospy makes it."""
    bases = _bases(names)
    plain = node in bases and anonymous != "required"
    return plain or (base_name(node) != node and base_name(node) in bases and anonymous != "forbidden")


def base_name(node: str) -> str:
    """Return `/talker` for `/talker_4711_1700000000000`, and any other name as it is."""
    return _SUFFIX.sub("", node)


def wanted_names(names: Iterable[str], anonymous: Anonymous) -> str:
    """Return `/talker or /numeric_talker, plain or anonymous`."""
    return f"{join_words(_bases(names), 'or')}, {_KINDS[anonymous]}"


def wrong_name(names: tuple[str, ...], nodes: Iterable[str], anonymous: Anonymous) -> str:
    """Return how the names of the nodes differ from those that are wanted: in themselves, or in their ending alone."""
    there = tuple(nodes)
    if is_other_name(names, there):
        return f"the node is named {join_words(there)}, not {join_words(_bases(names), 'or')}"
    how = "without" if anonymous == "required" else "with"
    return f"the node is named {join_words(there)}, {how} the numbers that anonymous=True adds to the name"


def is_other_name(names: Iterable[str], nodes: Iterable[str]) -> bool:
    """Return whether no node has one of the names, not even with numbers behind it."""
    return {base_name(n) for n in nodes}.isdisjoint(_bases(names))


def name_hint(names: tuple[str, ...], nodes: Iterable[str], anonymous: Anonymous) -> str:
    """Return what to write into `init_node`, or which namespace to leave: no name in `init_node` has a slash."""
    there = tuple(nodes)
    spaces = {n.removesuffix(b) for n in map(base_name, there) for b in _bases(names) if n.endswith(b)} - {""}
    if spaces:
        where = "`ROS_NAMESPACE` in the script or `ns` in the launch file"
        return f"take the node out of the namespace {join_words(sorted(spaces))}: delete {where}"
    counted = [n for n in there if any(re.fullmatch(rf"{re.escape(b)}_*\d+", n) for b in _bases(names))]
    if counted and anonymous == "allowed":
        name = names[0].lstrip("/")
        return f"write {init(name, anonymous=True)}: that adds numbers by itself"
    numbered = any(base_name(n) != n for n in there)
    spare = anonymous == "forbidden" and numbered
    keeps = anonymous == "required" or (anonymous == "allowed" and numbered)
    call = init(names[0].lstrip("/"), anonymous=keeps)
    return f"write {call} without {ANONYMOUS}" if spare else f"write {call}"


def _bases(names: Iterable[str]) -> list[str]:
    return ["/" + name.lstrip("/") for name in names]


def _global(name: str) -> str:
    if not name.startswith("/"):
        raise ValueError(f'a name of the graph begins with a slash: "/{name}"')
    if fault := odd_name(name):
        raise ValueError(fault)
    return name


def _global_pattern(name: str) -> str:
    _global(name.removesuffix("*").rstrip("/") or "/")
    return name


def odd_name(name: str) -> str:
    """Return why no topic, service, node or parameter has this name; empty where one may have it."""
    if odd := _ODD.search(name):
        return f"no name of ROS's has {json.dumps(odd[0])} in it: {json.dumps(name)}"
    if "//" in name or (len(name) > 1 and name.endswith("/")):
        return f'has a slash too many: "/{"/".join(part for part in name.split("/") if part)}"'
    return ""


def plain_type(name: str) -> str:
    """Return `std_srvs/Empty`, also where another tool wrote `std_srvs/srv/Empty`."""
    return name.replace("/msg/", "/").replace("/srv/", "/")


def is_called(node: str, name: str) -> bool:
    """Return whether a node has this name, given with its slash or without; an anonymous one counts."""
    return re.fullmatch(re.escape("/" + name.lstrip("/")) + _ANONYMOUS, node) is not None


GlobalName = Annotated[str, AfterValidator(_global)]
"""A topic's, a service's or a parameter's full name."""
GlobalPattern = Annotated[str, AfterValidator(_global_pattern)]
"""Such a name, or a pattern for several: `/square/*`."""
PublishedTopic = Annotated[GlobalName, Refers("published")]
"""A topic on which the student publishes."""


class OnTopic(Record):
    """What is judged on a topic of the student's."""

    topic: PublishedTopic
    """The topic, with its slash: `/chatter`."""
