"""A scenario's records: what is started, sent, called and served in a run, and when it has seen enough.

A new kind of step takes
1. its record and its key in `Step`, here; `Step.lasts_s` where it takes time, `Step.published` where it publishes;
2. `arena/steps.py`: what it advertises before anything starts, and how it is done;
3. `evidence/events.py`: the `action` of the `ActorEvent` that says so, where none of those that are there fits;
4. `rubric/step_faults.py`: what its record's types cannot say, and its entry in `NAMED` if it names something of ROS's;
5. `rubric/made_up.py`: its entry in `GIVEN`, if a program meets its values;
6. `rubric/references.py`: `_sent_topics` and the like, if criteria refer to what it sends or calls;
7. `package/repairs/names.py`: `wanted_of`, if it has a name that a student's package may misspell;
8. a section in `docs/how-to/steps.md`, and the pages that `make reference` writes.
"""

from __future__ import annotations

import math
from hashlib import sha256
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field

from grader.model.message_definitions import parse_definition, sound_message
from grader.model.record import Record

Seconds = Annotated[float, Field(ge=0)]
NAME_PATTERN = r"^[a-z][a-z0-9-]*$"
PROGRAM_PATTERN = r"^[A-Za-z][\w-]*/[\w.-]+$"
TYPE_PATTERN = r"^[A-Za-z]\w*/[A-Za-z]\w*$"
PACKAGE_PATTERN = r"^[A-Za-z]\w*$"
ROSTEST_ENDING = ".test"
FOLDER_PATTERN = r"^[A-Za-z][\w-]*$"
MESSAGES_MAX = 10_000
LINE_CHARS_MAX = 1_000
TF_TYPE = "tf2_msgs/TFMessage"
STEP_S_MAX = 600
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
StepSeconds = Annotated[float, Field(gt=0, le=STEP_S_MAX)]


def _service_text(text: str | None) -> str | None:
    if text is not None and sum(line.strip() == "---" for line in text.splitlines()) != 1:
        raise ValueError("a service has a request and a response with one line --- between them")
    for _ in parse_definition(text or "---", ".srv"):
        pass
    return text


class Start(Record):
    """A process of a run. Give one of `script`, `launch`, `load`, `program`, `built` and `tests`."""

    name: Name
    """The name of the process in the rubric's criteria and steps."""
    script: str | None = None
    """The student's file, at the place where the handout wants it: `src/talker.py`. It is found under `scripts/`,
    `src/` and anywhere else in the package too. A C++ program by its name."""
    launch: str | None = None
    """The launch file's name, in whatever folder of the package it lies."""
    load: str | None = None
    """A YAML file that `rosparam load` puts on the parameter server."""
    program: Annotated[str, Field(pattern=PROGRAM_PATTERN)] | None = None
    """A node of another package, as `rosrun` takes it (`turtlesim/turtlesim_node`), or a launch file of one
    (`course_sim/world.launch`), or its tests for rostest (`course_sim/world.test`), which the run waits
    for. It is the grader's, and what it does never counts as the student's."""
    built: bool = False
    """Start every program that the build made (`add_executable`), as processes `<name>/<program>`."""
    tests: str | None = None
    """A Python file beside the rubric with tests for pytest that call functions of the student's files.
    They are called in this process, after the steps; `check: pytest` judges the same file."""
    args: tuple[str, ...] = ()
    """Arguments, as for `rosrun` or `roslaunch`: `["_rate:=5", "robot:=burger"]`."""
    after: Name | None = None
    """The name of an earlier start: this one waits until a node of that one is registered."""
    package: str | None = None
    """Which of the lab's packages has the file or the programs, if students hand in several; null: the
    first."""

    @property
    def is_rostest(self) -> bool:
        """Whether it is an instructor's tests, which the check `rostest` judges."""
        return self.program is not None and self.program.endswith(ROSTEST_ENDING)


class Param(Record):
    """A parameter that is set before anything starts. Give `file`, or `name` with `value` or `made_up`."""

    name: str | None = None
    """The parameter, with its slash."""
    value: Any = None
    """Its value, as in YAML."""
    made_up: Literal["text", "integer", "number"] | None = None
    """The type of a value for `name` that no one can guess."""
    file: str | None = None
    """A YAML file of the student's, read as `rosparam load` would; each of its values is replaced by one of the same
    type that the grader makes up for this run."""
    also: tuple[str, ...] = ()
    """Names that also get made-up values if the file lacks them."""


class Probe(Record):
    """Messages that the grader publishes once the student's node has subscribed.

    Made-up values and those of `among` are shuffled together; `values` come after them.
    """

    topic: str
    """The topic, with its slash: `/chatter`."""
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    """Any message type of ROS's own packages: `std_msgs/String`."""
    text: Annotated[int, Field(ge=0)] = 0
    """How many random strings; if there are four or more, one comes twice in a row."""
    integers: Annotated[int, Field(ge=0)] = 0
    """How many random values in the type's range, within ±10 000; of four or more, one comes twice in a row."""
    among: tuple[int, ...] = ()
    """Values that have to be among the random ones."""
    values: tuple[Any, ...] = ()
    """Sent as written and in their order: the field `data`, or a map of the message's fields."""
    times: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How often `values` are sent, one round after the other."""
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 10.0
    """Messages each second."""


class Call(Record):
    """A service that the grader calls once it is offered, after the probes and the calls before it."""

    service: str
    """The service, with its slash: `/add`."""
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    """As `rosservice type` gives it: `std_srvs/Trigger`."""
    request: Annotated[dict[str, Any], Field(default_factory=dict)]
    """The request's fields; those that it lacks are zero."""
    definition: Annotated[str | None, AfterValidator(_service_text)] = None
    """The handout's text of a `.srv` that students write themselves: if theirs has other fields, types or
    another order, the service is not called, and the report says why."""
    delay_s: Seconds = 0.0
    """How long after the service is offered."""
    limit_s: StepSeconds | None = None
    """How long the run waits for its answer, on a machine that does nothing else; null: 10 s. Once one was not answered
    in time, the calls of that service after it have half as long, 2 s at most."""


GoalEnd = Literal["succeeded", "aborted"]


class Served(Record):
    """A service or an action that the grader offers, from before anything starts.

    Give `service`, and one of `answer`, `answers` and `fails`; or `action`, and what becomes of its goals.
    """

    service: str | None = None
    """The service, with its slash: `/add`."""
    action: str | None = None
    """The action, with its slash: `/fibonacci`."""
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    """Of ROS's, of the student's package (`lab5/Add`), or of one of the course's."""
    feedback: tuple[dict[str, Any], ...] = ()
    """The feedback that is sent for each goal, one after the other."""
    result: dict[str, Any] = Field(default_factory=dict)
    """The fields of each goal's result; those that it lacks are zero."""
    ends: GoalEnd | Annotated[tuple[GoalEnd, ...], Field(min_length=1)] = "succeeded"
    """The state in which goals end, or a list of states in turn, of which the last one is repeated: `[aborted,
    succeeded]`. A goal that the client cancels before is preempted, and counts as one of them."""
    answer: dict[str, Any] | None = None
    """The fields of each answer; those that it lacks are zero."""
    answers: tuple[dict[str, Any], ...] = ()
    """The answers in turn; the last one is repeated."""
    fails: bool = False
    """Whether each call ends with an error, as if a server's callback raised an exception."""
    definition: Annotated[str | None, AfterValidator(_service_text)] = None
    """The handout's text of a `.srv` that students write themselves: if theirs differs, their calls are
    refused, as the handout's server would do."""
    delay_s: Annotated[float, Field(ge=0, le=STEP_S_MAX)] = 0.0
    """How long each answer takes; for an action, each feedback and the result."""

    @property
    def name(self) -> str:
        """The service's or the action's."""
        return self.service or self.action or ""

    @property
    def in_turn(self) -> tuple[dict[str, Any], ...]:
        """The answers, one after the other; none where it fails."""
        return self.answers or (() if self.answer is None else (self.answer,))


class Publish(Record):
    """Messages on one topic. Give `value`, the same each time, or `values`, which take turns.

    A value is the field `data`, or a map of the message's fields; fields left out are zero. In it, `now`,
    `now-2` and `now+0.5` (seconds) are stamps, `.inf` and `.nan` are floats, `{from: 0, to: 1}` is a number
    that changes evenly from the first message to the last, `{each: […]}` takes its items in turn, one for
    each message, and `{repeat: .inf, count: 360, except: {"150-210": 0.3}}` is an array. Without `count`
    and `duration_s` each value is sent once. Sending begins once a node has subscribed, and with `latched`
    at once.
    """

    topic: str
    """The topic, with its slash: `/chatter`."""
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    """A message type of ROS, of the student's package or of an installed one."""
    definition: Annotated[str | None, AfterValidator(sound_message)] = None
    """The handout's text of a `.msg` that students write themselves: the values have to fit it, and a package that
    lacks one of its fields is judged with it repaired. Messages are sent by the student's own file."""
    value: Any = None
    """What each message holds."""
    values: tuple[Any, ...] = ()
    """What the messages hold, in turn."""
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 10.0
    """Messages each second."""
    count: Annotated[int, Field(ge=1, le=MESSAGES_MAX)] | None = None
    """How many messages."""
    duration_s: StepSeconds | None = None
    """How long to send."""
    latched: bool = False
    """Whether the last message is kept for nodes that subscribe later."""
    background: bool = False
    """Whether the next steps begin at once, during this one. Without `count` and `duration_s` it lasts until the
    run ends."""

    @property
    def in_turn(self) -> tuple[Any, ...]:
        """The values, one after the other."""
        return self.values or (self.value,)

    @property
    def total(self) -> int | None:
        """How many messages it is; None for one that lasts until the run ends."""
        if self.count is not None:
            return self.count
        if self.duration_s is not None:
            return max(1, round(self.duration_s * self.rate_hz))
        return None if self.background else len(self.in_turn)


class Wait(Record):
    """A pause. Give one of `seconds`, `topic` and `node`."""

    seconds: StepSeconds | None = None
    """How long, by the run's clock, counted from when the running processes are nodes, or cannot become
    any."""
    topic: str | None = None
    """Until this topic has had its messages."""
    messages: Annotated[int, Field(ge=1, le=MESSAGES_MAX)] = 1
    """How many messages the topic has to have had in the run."""
    new: bool = False
    """Whether only messages since this step began count."""
    node: str | None = None
    """Until a node of this name is registered."""
    limit_s: StepSeconds | None = None
    """The run goes on without it after this time; null: the `first_message_s` of `until`."""


class Action(Record):
    """A goal for an action server (actionlib), once it listens, until its result comes."""

    name: str
    """The name of the action, with its slash."""
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    """That of the `.action` file: `lab6/Count`."""
    goal: Annotated[dict[str, Any], Field(default_factory=dict)]
    """The goal's fields; those that it lacks are zero."""
    cancel_after_s: StepSeconds | None = None
    """How long after it was sent the goal is cancelled, if no result has come by then; null: never."""
    limit_s: StepSeconds = 30.0
    """Without a result within this time, the run goes on. It waits less long where the criteria on this goal
    have a `within_s`: half as long again, or 1 s more than that, and until the feedback that they ask for has
    come; and no longer than `within_s` if the server goes on behind the end of the goal, or its feedback has
    stopped. That holds for the last goal of an action, and for others that are not cancelled, where the server
    ends a goal for a newer one (`is_preempt_requested()`). So let the goal that is cancelled be the last."""


class JudgedGoal(NamedTuple):
    """What criteria ask of a goal: for how many seconds after it was sent, or cancelled, its result matters (0 if no
    criterion asks for it, infinite if one says nothing of how soon it has to come), how much feedback it takes, and
    within how many seconds the result has to come (infinite if one does not say)."""

    matters_s: float
    feedback: int = 0
    within_s: float = math.inf


class Play(Record):
    """A recording beside the rubric, with its messages unchanged, including their stamps.

    Playing begins once a node has subscribed.
    """

    bag: Annotated[str, Field(min_length=1)]
    """The file: `.bag` or `.mcap`, 20 MB at most."""
    topics: tuple[str, ...] = ()
    """Those that are played; empty: all but `/clock` and `/rosout`."""
    speed: Annotated[float, Field(gt=0, le=100)] = 1.0
    """2 is twice as fast."""
    background: bool = False
    """Whether the next steps begin at once, during this one."""


class SetParam(Record):
    """A parameter that is set in the middle of a run, on the parameter server."""

    name: Annotated[str, Field(min_length=1)]
    """The parameter, with its slash."""
    value: Any
    """Its value, as in YAML."""


class Transform(Record):
    """Where one frame is in another, on `/tf`, or latched on `/tf_static`. Numbers may change as in
    `publish`."""

    parent: Annotated[str, Field(min_length=1)]
    """The frame in which it is."""
    child: Annotated[str, Field(min_length=1)]
    """The frame that is placed."""
    translation: Annotated[tuple[Any, ...], Field(min_length=3, max_length=3)] = (0, 0, 0)
    """x, y, z in metres; each may be a number that changes, `{from: 0, to: 1}`."""
    rotation_deg: Annotated[tuple[Any, ...], Field(min_length=3, max_length=3)] = (0, 0, 0)
    """Roll, pitch and yaw in degrees, in tf's order; each may be a number that changes."""
    static: bool = False
    """Whether it is sent once, latched, on `/tf_static`."""
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 20.0
    """Messages each second."""
    count: Annotated[int, Field(ge=1, le=MESSAGES_MAX)] | None = None
    """How many messages."""
    duration_s: StepSeconds | None = None
    """How long to send."""
    background: bool = False
    """Whether the next steps begin at once, during this one."""

    @property
    def published(self) -> Publish:
        """The same as messages: in the place of the quaternion, `rpy_deg`."""
        about = {
            "header": {"stamp": "now", "frame_id": self.parent},
            "child_frame_id": self.child,
            "transform": {
                "translation": dict(zip("xyz", self.translation, strict=True)),
                "rotation": {"rpy_deg": list(self.rotation_deg)},
            },
        }
        sending = self.model_dump(include={"rate_hz", "count", "duration_s", "background"})
        return Publish(
            topic="/tf_static" if self.static else "/tf",
            type=TF_TYPE,
            value={"transforms": [about]},
            latched=self.static,
            **sending,
        )


class Typed(Record):
    """A line on the standard input of a process. A process has a standard input only if a step types to it."""

    process: Name
    """The scenario's name for the process."""
    line: Annotated[str, Field(max_length=LINE_CHARS_MAX)]
    """The line, without its end."""


class Step(Record):
    """One thing that the grader does in a run, after the probes, the calls and the steps before it. Give one key.

    `start`, `stop`, `kill` and `restart` name one of the scenario's `start`. If a process first appears in
    a `start` step, it is not started with the others. What a step did is in the evidence (`/grader/actor`).
    When no student's process runs any more, and no later step starts one, the remaining steps are skipped.
    """

    publish: Publish | None = None
    """Send messages."""
    wait: Wait | None = None
    """Wait for a time, a topic or a node."""
    call: Call | None = None
    """Call a service."""
    action: Action | None = None
    """Send a goal to an action server."""
    start: Name | None = None
    """Start this process."""
    stop: Name | None = None
    """End this process as Ctrl-C does."""
    kill: Name | None = None
    """End this process at once (SIGKILL)."""
    restart: Name | None = None
    """Stop and start this process."""
    type: Typed | None = None
    """Type a line to a process."""
    set_param: SetParam | None = None
    """Set a parameter."""
    transform: Transform | None = None
    """Say where a frame is (tf)."""
    play: Play | None = None
    """Play a recording."""

    @property
    def published(self) -> Publish | None:
        """What it publishes, if it does."""
        return self.transform.published if self.transform is not None else self.publish

    @property
    def lasts_s(self) -> float:
        """About how long it takes where all is as it should be."""
        sent = self.published
        if sent is not None and not sent.background:
            return (sent.total or 0) / sent.rate_hz
        return (self.wait.seconds or 0.0) if self.wait is not None else 0.0


class Until(Record):
    """When a run has seen enough. All given conditions must be true; without any, the run lasts `limit_s`.

    The run waits less long for what cannot come: once all processes are nodes that only wait, loop or
    compute, and nothing in the graph has changed for 1.5 to 4 s. Then a topic counts as silent if its node
    only waits for callbacks; if the node loops and its script publishes, only after `silent_s`, unless
    `first_message_s` is more than 20. `alive_s`, silence and `quiet_s` do not count while a process may
    still become a node: until it is one, or `silent_s` after its start. If other programs keep the machine
    busy, this time, `first_message_s` and `limit_s` are longer by the time that those take.
    """

    window_s: Seconds | None = None
    """This long after the first message on every topic of `topics`, or, where no criterion judges what may
    come later (another topic, a last value, a line that is printed), until the rates are clear. The run
    waits for a silent topic until `silent_s` after the first message on another, and twice as long while
    messages come to a node of the student's, which may collect many before it publishes."""
    topics: tuple[str, ...] = ()
    """The topics of `window_s`, with their slash."""
    messages: Annotated[dict[str, int], Field(default_factory=dict)]
    """How many messages on each topic: `{/chatter: 20}`."""
    connected: tuple[str, ...] = ()
    """Topics over which a publisher and a subscriber of the student's have been connected for a second."""
    heard: bool = False
    """Whether every probe's value has to be printed."""
    nodes: Annotated[int, Field(ge=0)] = 0
    """How many nodes of the student's have registered."""
    alive_s: Seconds | None = None
    """This long after the student's first node registered, and half as long after the last process's node
    did."""
    opened: tuple[str, ...] = ()
    """Programs that were asked to open something: `firefox`."""
    ended: tuple[Name, ...] = ()
    """Processes that have ended."""
    quiet_s: Seconds | None = None
    """Nothing has been printed, published, registered or set for this long, after something was. A node that has a
    publisher has up to `first_message_s` to use it."""
    first_message_s: Seconds = 20.0
    """The run gives up if no message has come within this time."""
    silent_s: Seconds = 6.0
    """The run gives up if everything that it waits for has been silent for this long; if it waits for a
    connection, when nothing in the graph has changed for the longer of this and `first_message_s`."""
    limit_s: Seconds = 60.0
    """The run ends after this time at the latest."""


class Scenario(Record):
    """One run in an arena, or a recording that is handed in."""

    title: str
    """What is run, in a few words."""
    recording: Annotated[str, Field(min_length=1)] | None = None
    """In place of `start`: a pattern (`*.bag`, `bags/lab3*.mcap`) for the one file of the submission that is judged as
    this run; nothing is run."""
    clock: Literal["real", "warped"] = "real"
    """`warped` sets `/use_sim_time` and lets `/clock` run faster."""
    warp: Annotated[float, Field(ge=1, le=40)] = 20.0
    """How many times faster a warped clock runs."""
    params: tuple[Param, ...] = ()
    """Parameters that are set before anything starts."""
    start: tuple[Start, ...] = ()
    """The processes, in the order in which they are started."""
    probes: tuple[Probe, ...] = ()
    """Messages that the grader publishes once the student's node has subscribed."""
    calls: tuple[Call, ...] = ()
    """Services that the grader calls."""
    serves: tuple[Served, ...] = ()
    """Services and actions that the grader offers to the student's nodes."""
    steps: tuple[Step, ...] = ()
    """What the grader does, one step after the other; `until` is checked after the last one, and its times
    count from then on."""
    until: Annotated[Until, Field(default_factory=lambda: Until(messages={}))]
    """When the run has seen enough."""
    keeps: tuple[Annotated[str, Field(min_length=1)], ...] = ()
    """Patterns for files that the student's processes leave (`*.bag`, `results/*.csv`): they become evidence."""

    @property
    def started_later(self) -> frozenset[str]:
        """The names of those that a step starts first."""
        first: dict[str, str] = {}
        for step in self.steps:
            named = {"start": step.start, "": step.stop or step.kill or step.restart}
            for kind, name in named.items():
                first.setdefault(name or "", kind)
        return frozenset(name for name, kind in first.items() if name and kind)

    @property
    def typed_to(self) -> frozenset[str]:
        """The processes on whose standard input a step types."""
        return frozenset(step.type.process for step in self.steps if step.type is not None)

    @property
    def started_again(self) -> frozenset[str]:
        """The names of those that a step may start a second time."""
        later = self.started_later
        again = {step.start for step in self.steps if step.start not in later}
        again |= {
            step.start for n, step in enumerate(self.steps) if step.start in {s.start for s in self.steps[:n]}
        }
        return frozenset(name for name in {*again, *(step.restart for step in self.steps)} if name)

    @property
    def digest(self) -> str:
        """The sha256 of what is run and until when: evidence of a scenario with another one says something else."""
        # Words that change nothing of the run.
        left_out: dict[str, Any] = {"title": True}
        # Keys that a scenario does not use are left out: a newer grader that knows more keys gives the same digest, and
        # what was recorded before still fits.
        left_out |= {key: True for key in ("steps", "keeps", "serves") if not getattr(self, key)}
        if not any(call.definition for call in self.calls):
            left_out["calls"] = {"__all__": {"definition"}}
        if self.steps and not any(step.publish and step.publish.definition for step in self.steps):
            left_out["steps"] = {"__all__": {"publish": {"definition"}}}
        unset = {key for key in ("tests", "package") if not any(getattr(start, key) for start in self.start)}
        if unset:
            left_out["start"] = {"__all__": unset}
        return sha256(self.model_dump_json(exclude=left_out).encode()).hexdigest()
