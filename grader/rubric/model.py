"""A rubric's records. Units are in the names; `grader rubric schema` exports them as a JSON Schema."""

from __future__ import annotations

from datetime import datetime
from hashlib import sha256
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, AwareDatetime, Field

from grader.model.record import Record
from grader.model.repair import DEFAULT_SHARES, RepairKind

Seconds = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
NAME_PATTERN = r"^[a-z][a-z0-9-]*$"
PROGRAM_PATTERN = r"^[A-Za-z][\w-]*/[\w.-]+$"
TYPE_PATTERN = r"^[A-Za-z]\w*/[A-Za-z]\w*$"
PACKAGE_PATTERN = r"^[A-Za-z]\w*$"
MESSAGES_MAX = 10_000
LINE_CHARS_MAX = 1_000
TF_TYPE = "tf2_msgs/TFMessage"
STEP_S_MAX = 600
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
StepSeconds = Annotated[float, Field(gt=0, le=STEP_S_MAX)]
YEARS = range(2000, 3000)
LATE_DAYS_MAX = 3660


def _of_these_times(time: datetime) -> datetime:
    if time.year not in YEARS:
        raise ValueError(f"must be a time of the years {YEARS[0]} to {YEARS[-1]}")
    return time


Deadline = Annotated[AwareDatetime, AfterValidator(_of_these_times)]


def _service_text(text: str | None) -> str | None:
    if text is not None and sum(line.strip() == "---" for line in text.splitlines()) != 1:
        raise ValueError("a service has a request and a response with one line --- between them")
    return text


class Start(Record):
    """A process of a run. Give one of `script`, `launch`, `load`, `program` and `built`.

    `script` is the student's file and the place where the handout wants it (`src/numeric_talker.py`); it is found
    under `scripts/`, `src/` and anywhere else in the package too. `launch` is the launch file's name. `load` is a
    YAML file that `rosparam load` puts on the parameter server. `program` is a node of another package, as `rosrun`
    takes it (`turtlesim/turtlesim_node`), or a launch file of one (`course_sim/world.launch`): it is the grader's, and
    what it does never counts as the student's.
    `built` starts every program that the build made (`add_executable`), as processes `<name>/<program>`.
    `after` names an earlier start: this one waits until a node of that one is registered.
    """

    name: Name
    script: str | None = None
    launch: str | None = None
    load: str | None = None
    program: Annotated[str, Field(pattern=PROGRAM_PATTERN)] | None = None
    built: bool = False
    args: tuple[str, ...] = ()
    after: Name | None = None


class Param(Record):
    """Parameters that are set before anything starts. Give `file`, or `name` with `value` or `made_up`.

    `file` is a YAML file of the student's, read as `rosparam load` would, each of its values replaced by one of the
    same type that the grader makes up for this run. Names of `also` that the file lacks get made-up values too.
    `made_up` is the type of a value for `name` that no one can guess.
    """

    name: str | None = None
    value: Any = None
    made_up: Literal["text", "integer", "number"] | None = None
    file: str | None = None
    also: tuple[str, ...] = ()


class Probe(Record):
    """Messages that the grader publishes once the student's node has subscribed.

    `type` is any message type of ROS's own packages. Made up for this run: `text` random strings (of four and
    more, one comes twice running), `integers` random values of the type's range; they are shuffled together with the
    values of `among`. `values` are sent as they stand and in their order, `times` times over: the field `data`, or a
    map of the message's fields.
    """

    topic: str
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    text: Annotated[int, Field(ge=0)] = 0
    integers: Annotated[int, Field(ge=0)] = 0
    among: tuple[int, ...] = ()
    values: tuple[Any, ...] = ()
    times: Annotated[int, Field(ge=1, le=10_000)] = 1
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 10.0


class Call(Record):
    """A service that the grader calls `delay_s` after it is offered, after the probes and the calls before it.

    Fields that `request` lacks are zero. `definition` is the handout's text of a `.srv` that students write themselves:
    where theirs has other fields, types or another order, the service is not called, and the reason is said.
    """

    service: str
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    request: Annotated[dict[str, Any], Field(default_factory=dict)]
    definition: Annotated[str | None, AfterValidator(_service_text)] = None
    delay_s: Seconds = 0.0


class Publish(Record):
    """Messages on one topic. Give `value`, the same each time, or `values`, which take turns.

    `type` is a message type of ROS's, of the student's package or of one that is installed. A value is the field
    `data`, or a map of the message's fields; what it leaves out is zero. In it, `now`, `now-2` and `now+0.5` (seconds)
    are stamps, `.inf` and `.nan` are floats, `{from: 0, to: 1}` is a number that goes evenly from the first message to
    the last, `{each: […]}` takes its items in turn, one for each message, and
    `{repeat: .inf, count: 360, except: {"150-210": 0.3}}` is an array. `count` messages are sent at `rate_hz`, or
    those of `duration_s`; without either, each value once. With `background`, the next steps begin at once; without
    count and duration it then lasts until the run ends. Sending begins once a node has subscribed, and with
    `latched` at once.
    """

    topic: str
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    value: Any = None
    values: tuple[Any, ...] = ()
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 10.0
    count: Annotated[int, Field(ge=1, le=MESSAGES_MAX)] | None = None
    duration_s: StepSeconds | None = None
    latched: bool = False
    background: bool = False

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
    """Give one of `seconds`, `topic` and `node`.

    `seconds` are those of the run's clock. `topic`: until it has had so many `messages` in the run, or with `new`
    since this step began. `node`: until a node of that name is registered. After `limit_s` (without it, the
    `first_message_s` of `until`) the run goes on without it.
    """

    seconds: StepSeconds | None = None
    topic: str | None = None
    messages: Annotated[int, Field(ge=1, le=MESSAGES_MAX)] = 1
    new: bool = False
    node: str | None = None
    limit_s: StepSeconds | None = None


class Action(Record):
    """A goal for an action server (actionlib), once it listens, until its result comes.

    `type` is that of the `.action` file: `lab6/Count`. `cancel_after_s` cancels the goal so long after it was sent,
    where no result has come by then. Without a result within `limit_s`, the run goes on.
    """

    name: str
    type: Annotated[str, Field(pattern=TYPE_PATTERN)]
    goal: Annotated[dict[str, Any], Field(default_factory=dict)]
    cancel_after_s: StepSeconds | None = None
    limit_s: StepSeconds = 30.0


class Play(Record):
    """A recording (`.bag` or `.mcap`, 20 MB at most) beside the rubric, with its messages as they are, stamps too.

    `topics` are those that are played, all but `/clock` and `/rosout` where none is given; `speed` 2 is twice as fast.
    With `background`, the next steps begin at once. Playing begins once a node has subscribed to one of the topics.
    """

    bag: Annotated[str, Field(min_length=1)]
    topics: tuple[str, ...] = ()
    speed: Annotated[float, Field(gt=0, le=100)] = 1.0
    background: bool = False


class SetParam(Record):
    """A parameter that is set in the middle of a run, on the parameter server."""

    name: Annotated[str, Field(min_length=1)]
    value: Any


class Transform(Record):
    """Where the frame `child` is in the frame `parent`, on `/tf`; with `static`, latched on `/tf_static`.

    `translation` is x, y, z in metres, `rotation_deg` roll, pitch and yaw in degrees, as tf's are. Each may be a number
    that changes, `{from: 0, to: 90}`. It is sent as `publish` sends: `rate_hz`, `count` or `duration_s`, `background`.
    """

    parent: Annotated[str, Field(min_length=1)]
    child: Annotated[str, Field(min_length=1)]
    translation: Annotated[tuple[Any, ...], Field(min_length=3, max_length=3)] = (0, 0, 0)
    rotation_deg: Annotated[tuple[Any, ...], Field(min_length=3, max_length=3)] = (0, 0, 0)
    static: bool = False
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 20.0
    count: Annotated[int, Field(ge=1, le=MESSAGES_MAX)] | None = None
    duration_s: StepSeconds | None = None
    background: bool = False

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
    """A line on the standard input of a process. Only processes that a step types to have one."""

    process: Name
    line: Annotated[str, Field(max_length=LINE_CHARS_MAX)]


class Step(Record):
    """One thing that the grader does in a run, after the probes, the calls and the steps before it. Give one key.

    `start`, `stop` (Ctrl-C), `kill` (SIGKILL) and `restart` (stop and start) name one of the scenario's `start`. What
    a step starts before anything else names it is not started with the others.

    What it did is in the evidence (`/grader/actor`). When no student's process runs any more, and no later step starts
    one, the steps that are left are left out.
    """

    publish: Publish | None = None
    wait: Wait | None = None
    call: Call | None = None
    action: Action | None = None
    start: Name | None = None
    stop: Name | None = None
    kill: Name | None = None
    restart: Name | None = None
    type: Typed | None = None
    set_param: SetParam | None = None
    transform: Transform | None = None
    play: Play | None = None

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
    """When a run has seen enough. All conditions that are given must hold.

    `window_s`: that long after the first message on every topic of `topics`, or until the rates that are judged there
    are clear (a topic that stays silent stops being waited for when `silent_s` have passed since the first message on
    another). `messages`: so many
    messages on each topic. `connected`: a student's publisher and a student's subscriber are connected over
    the topic, for a second. `heard`: every probe's value was printed. `nodes`: so many nodes of the student's have
    registered. `alive_s`: that long after the student's first node registered, and half as long after the last
    process's did. `opened`: these programs (`firefox`) were asked to open something. `ended`: these processes have
    ended. `quiet_s`: for so long, nothing was printed, published, registered or set, and something was before.
    A run gives up when no message came within `first_message_s`, when all that is waited for has been silent for
    `silent_s`, when nothing in the graph has changed for the longer of the two while a connection is waited for, or
    after `limit_s`. What no node is there for is given up sooner: once all processes are nodes that only wait or loop,
    and nothing in the graph has changed for 1.5 to 4 s. `alive_s`, silence and quiet do not count while a process may
    still become a node: until it is one, or `silent_s` after its start. Where others fill the machine, this,
    `first_message_s` and `limit_s` are longer by what they take. With no condition at all it is watched for `limit_s`.
    """

    window_s: Seconds | None = None
    topics: tuple[str, ...] = ()
    messages: Annotated[dict[str, int], Field(default_factory=dict)]
    connected: tuple[str, ...] = ()
    heard: bool = False
    nodes: Annotated[int, Field(ge=0)] = 0
    alive_s: Seconds | None = None
    opened: tuple[str, ...] = ()
    ended: tuple[Name, ...] = ()
    quiet_s: Seconds | None = None
    first_message_s: Seconds = 20.0
    silent_s: Seconds = 6.0
    limit_s: Seconds = 60.0


class Scenario(Record):
    """One run in an arena. `clock` `warped` sets `/use_sim_time` and runs `/clock` `warp` times faster.

    `steps` are done one after the other; `until` is looked at once they are over, and its times count from then on.
    With `recording` in place of `start` nothing is run: it is a pattern (`*.bag`, `bags/lab3*.mcap`) for the one
    file of the submission that is judged as this run.
    """

    title: str
    recording: Annotated[str, Field(min_length=1)] | None = None
    clock: Literal["real", "warped"] = "real"
    warp: Annotated[float, Field(ge=1, le=40)] = 20.0
    params: tuple[Param, ...] = ()
    start: tuple[Start, ...] = ()
    probes: tuple[Probe, ...] = ()
    calls: tuple[Call, ...] = ()
    steps: tuple[Step, ...] = ()
    until: Annotated[Until, Field(default_factory=lambda: Until(messages={}))]

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
    def digest(self) -> str:
        """The sha256 of what is run and until when: evidence of a scenario with another one says something else."""
        left_out: dict[str, Any] = {"title": True}
        if not self.steps:  # before there were any, none were counted, and so it is with definitions
            left_out["steps"] = True
        if not any(call.definition for call in self.calls):
            left_out["calls"] = {"__all__": {"definition"}}
        return sha256(self.model_dump_json(exclude=left_out).encode()).hexdigest()


class Criterion(Record):
    """One line of the report. `with` holds the check's own parameters.

    Give one of `points`, `bonus` and `penalty`. `points` are of the rubric's 100, and 0 is advice. A `bonus` is added
    to them where the check passes; not to reach it costs nothing. A `penalty` is taken off where the check fails, and
    the total is never less than 0. `requires` names criteria that explain why there may be nothing to judge here: this
    one is then `blocked`.
    """

    id: Name
    title: str
    points: Annotated[float, Field(ge=0)] = 0.0
    bonus: Annotated[float, Field(gt=0)] | None = None
    penalty: Annotated[float, Field(gt=0)] | None = None
    check: str
    parameters: Annotated[dict[str, Any], Field(alias="with", default_factory=dict)]
    scenario: Name | None = None
    requires: tuple[Name, ...] = ()
    visibility: Literal["visible", "hidden"] = "visible"
    hint: str = ""
    reproduce: str = ""

    @property
    def extra(self) -> float:
        """What it can change beside the rubric's 100 points: a bonus, or minus a penalty."""
        return self.bonus or -(self.penalty or 0.0)


class Group(Record):
    """Criteria whose points are given together.

    With `points`, the group is worth so much, and those of its criteria are their weights in it. With `best`, only so
    many of its criteria count, those with the most points; all have to be worth the same then.
    """

    criteria: Annotated[tuple[Name, ...], Field(min_length=1)]
    points: Annotated[float, Field(gt=0)] | None = None
    best: Annotated[int, Field(ge=1)] | None = None


class Gate(Record):
    """Without this criterion (it fails, or is blocked), the whole is worth `at_most` so many points."""

    criterion: Name
    at_most: Annotated[float, Field(ge=0)]


class Late(Record):
    """What being late costs: `lost` percent for each `per` that has begun since the deadline, at most `cap` percent.

    They are percents of the points that were reached, or with `of: possible` of all the rubric's points. What comes
    at most `grace_minutes` after the deadline is in time. Later than `cut_off_days` after it, nothing counts.
    """

    lost: Annotated[float, Field(ge=0, le=100)]
    of: Literal["reached", "possible"] = "reached"
    per: Literal["day", "hour"] = "day"
    grace_minutes: Annotated[float, Field(ge=0, le=LATE_DAYS_MAX * 24 * 60)] = 0.0
    cap: Annotated[float, Field(ge=0, le=100)] = 100.0
    cut_off_days: Annotated[float, Field(ge=0, le=LATE_DAYS_MAX)] | None = None


class Needs(Record):
    """What a lab needs of the machine: ROS packages, Debian packages, and modules of ROS's Python (`pip`)."""

    ros: tuple[str, ...] = ()
    apt: tuple[str, ...] = ()
    pip: tuple[str, ...] = ()


class Rubric(Record):
    """A lab. `pass_mark` in points; without one, every visible criterion must be reached.

    A file without `schema` is read as version 1. `digits` is how many decimals points keep. `checks` is a Python file
    beside the rubric with checks of the instructor's own. `deadline` has a time zone; `late` says what later costs, and
    without it nothing is lost. `repairs` has shares by kind of repair: what is judged on a copy with such a repair
    earns that share of its points; 0 switches the repair off.
    With `fixes: none`, `grader check --fix` repairs nothing: students are to find it themselves. `groups` and `gates`
    say how the criteria's points come to a total. `packages` are folders beside the rubric, each a ROS package of the
    course: nodes, messages, launch files. `needs` is what the machine has to have besides.
    """

    schema_: Annotated[Literal["grader.rubric/1"], Field(alias="schema")] = "grader.rubric/1"
    id: Name
    title: str
    version: str
    package: str
    handout: str = ""
    pass_mark: Annotated[float, Field(ge=0)] | None = None
    digits: Annotated[int, Field(ge=0, le=3)] = 1
    checks: str | None = None
    deadline: Deadline | None = None
    late: Late | None = None
    repairs: Annotated[dict[RepairKind, Share], Field(default_factory=dict)]
    fixes: Literal["offered", "none"] = "offered"
    packages: tuple[Annotated[str, Field(pattern=PACKAGE_PATTERN)], ...] = ()
    needs: Annotated[Needs, Field(default_factory=Needs)]
    groups: Annotated[dict[Name, Group], Field(default_factory=dict)]
    gates: tuple[Gate, ...] = ()
    scenarios: dict[Name, Scenario]
    criteria: Annotated[tuple[Criterion, ...], Field(min_length=1)]

    def share_of(self, kind: RepairKind) -> float:
        """Return the share of its points, 0 to 1, that a criterion earns on a copy with such a repair."""
        return self.repairs.get(kind, DEFAULT_SHARES[kind])

    @property
    def max_points(self) -> float:
        """The most points that can be reached, without bonuses."""
        worth = {c.id: c.points for c in self.criteria}
        uncounted = sum(
            worth.get(name, 0.0) for g in self.groups.values() if g.best for name in g.criteria[g.best :]
        )
        return round(sum(worth.values()) - uncounted, 6)
