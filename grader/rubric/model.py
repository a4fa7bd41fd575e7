"""A rubric's records. Units are in the names; `grader rubric schema` exports them as a JSON Schema."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from grader.model.record import Record

Seconds = Annotated[float, Field(ge=0)]
NAME_PATTERN = r"^[a-z][a-z0-9-]*$"
Name = Annotated[str, Field(pattern=NAME_PATTERN)]


class Start(Record):
    """A process of the student's. Give one of `script` and `launch`.

    `script` is the file and the place where the handout wants it (`src/numeric_talker.py`); it is found under
    `scripts/`, `src/` and anywhere else in the package too. `launch` is the launch file's name.
    """

    name: Name
    script: str | None = None
    launch: str | None = None
    args: tuple[str, ...] = ()


class Probe(Record):
    """Messages that the grader makes up for this run and publishes once the student's node has subscribed.

    `text` random strings, `integers` random values of the type's range, and the values of `among`, shuffled
    together.
    """

    topic: str
    type: Literal["std_msgs/String", "std_msgs/Int8"]
    text: Annotated[int, Field(ge=0)] = 0
    integers: Annotated[int, Field(ge=0)] = 0
    among: tuple[int, ...] = ()
    rate_hz: Annotated[float, Field(gt=0, le=100)] = 10.0


class Until(Record):
    """When a run has seen enough. All conditions that are given must hold.

    `window_s`: that long after the first message on every topic of `topics` (a topic that stays silent stops
    being waited for when `silent_s` have passed since the first message on another). `messages`: so many
    messages on each topic. `connected`: a student's publisher and a student's subscriber are connected over
    the topic. `heard`: every probe's value was printed.
    A run gives up when no message came within `first_message_s`, when all topics that are waited for have
    been silent for `silent_s`, or after `limit_s`.
    """

    window_s: Seconds | None = None
    topics: tuple[str, ...] = ()
    messages: Annotated[dict[str, int], Field(default_factory=dict)]
    connected: tuple[str, ...] = ()
    heard: bool = False
    first_message_s: Seconds = 20.0
    silent_s: Seconds = 6.0
    limit_s: Seconds = 60.0


class Scenario(Record):
    """One run in an arena. `clock` `warped` sets `/use_sim_time` and runs `/clock` `warp` times faster."""

    title: str
    clock: Literal["real", "warped"] = "real"
    warp: Annotated[float, Field(ge=1, le=40)] = 20.0
    start: Annotated[tuple[Start, ...], Field(min_length=1)]
    probes: tuple[Probe, ...] = ()
    until: Until


class Criterion(Record):
    """One line of the report. `with` holds the check's own parameters.

    `requires` names criteria that explain why there may be nothing to judge here: this one is then `blocked`.
    """

    id: Name
    title: str
    points: Annotated[float, Field(ge=0)]
    check: str
    parameters: Annotated[dict[str, Any], Field(alias="with", default_factory=dict)]
    scenario: Name | None = None
    requires: tuple[Name, ...] = ()
    visibility: Literal["visible", "hidden"] = "visible"
    hint: str = ""
    reproduce: str = ""


class Rubric(Record):
    """A lab. `pass_mark` in points; without one, every visible criterion must be reached.

    `digits` is how many decimals points keep.
    """

    schema_: Annotated[Literal["grader.rubric/1"], Field(alias="schema")]
    id: Name
    title: str
    version: str
    package: str
    handout: str = ""
    pass_mark: Annotated[float, Field(ge=0)] | None = None
    digits: Annotated[int, Field(ge=0, le=3)] = 1
    scenarios: dict[Name, Scenario]
    criteria: Annotated[tuple[Criterion, ...], Field(min_length=1)]

    @property
    def max_points(self) -> float:
        return sum(c.points for c in self.criteria)
