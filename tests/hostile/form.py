"""The form of an attack (README.md), and where attacks are found."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import yaml
from pydantic import AfterValidator, Field, model_validator
from typing_extensions import Self

from grader.model.record import Record
from grader.model.verdict import Status

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
HERE = Path(__file__).resolve().parent
ATTACKS = HERE / "attacks"
VICTIM = HERE / "victim"

User = Literal["root", "ordinary"]
Groups = Literal["found", "with", "without"]
Promise = Literal[
    "outside", "sees", "paths", "calls", "disk", "reaches", "rights", "limits", "ros", "connections", "base",
    "outlives", "auto", "started", "inherited", "excused", "unpacking", "reading", "built", "shown", "fair", "private",
    "others", "exported",
]  # fmt: skip
PROMISES: dict[Promise, str] = {
    "outside": "Nothing of a submission reaches a program that runs outside the sandbox",
    "sees": "sees the system's programs, ROS, its own workspace, and nothing else",
    "paths": "It sees no paths of the machine except those of the system and of ROS",
    "calls": "It makes only the system calls that ROS's programs need",
    "disk": "It writes to no disk, only to memory of a fixed size",
    "reaches": "It reaches no network but the loopback interface of its own run",
    "rights": "It gains no rights and makes no namespaces of its own",
    "limits": "tasks, CPU seconds, output, messages, files and descriptors of a run are limited",
    "ros": "Over ROS it cannot end the master, speak for other processes' nodes",
    "connections": "What a node says about its connections counts only if the other end says the same",
    "base": "What a build begins with (`~/.cache/grader`) is made without anything of a student's",
    "outlives": "None of its processes outlives the run",
    "auto": "`--sandbox auto` goes without one only if",
    "started": "It does not matter what starts the grader",
    "inherited": "A limit that the grader inherits",
    "excused": "A run is not excused by a machine that its own processes made late",
    "unpacking": "Unpacking and checking out writes below one folder only",
    "reading": "Reading a submission's files executes nothing",
    "built": "What the build says about itself is not believed if the files say otherwise",
    "shown": "Students' text is only shown, and never acts as a command or markup",
    "fair": "No evidence is never a pass, and a fault of the machine or of the grader is never a lost mark",
    "private": "Files with marks are for their owner alone, whatever the umask",
    "others": "One submission of a class cannot stop, slow or change another one's grading",
    "exported": "student code can neither write `results.json` nor read the rubric",
}
"""Words of SECURITY.md, each in one of its promises."""
Mode = Annotated[str, Field(pattern=r"^[0-7]{3,4}$")]


def _compiles(pattern: str) -> str:
    re.compile(pattern)
    return pattern


Pattern = Annotated[str, AfterValidator(_compiles)]
Statuses = dict[str, Status | tuple[Status, ...]]


class Bytes(Record):
    """A file's content that is not text."""

    base64: str


class Entry(Record):
    """One entry of an archive; `zeros` bytes of nothing where there is no other content."""

    path: str = ""
    raw_name: str | None = None
    type: Literal["file", "folder", "link", "hardlink", "fifo", "device"] = "file"
    text: str | None = None
    base64: str | None = None
    zeros: int = 0
    target: str = ""
    mode: Mode = "644"
    encrypted: bool = False


class Archive(Record):
    format: Literal["zip", "tar", "tar.gz"]
    victim: bool = True
    entries: tuple[Entry, ...] = ()


class Written(Record):
    path: str
    text: str
    mode: Mode = "644"


class Linked(Record):
    path: str
    target: str


class Step(Record):
    """One step of making a repository; exactly one of the keys."""

    git: tuple[str, ...] = ()
    write: Written | None = None
    link: Linked | None = None
    remove: str | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(map(bool, (self.git, self.write, self.link, self.remove))) != 1:
            raise ValueError("a step is one of git, write, link, remove")
        return self


class Generator(Record):
    """A function of makers.py, and its arguments."""

    make: str
    arguments: dict[str, Any] = Field(default_factory=dict)


class ExpectedError(Record):
    kind: str | tuple[str, ...]
    message: Pattern


class Run(NamedTuple):
    """Who grades, and whether with control groups."""

    user: User
    groups: Groups

    @property
    def label(self) -> str:
        return self.user if self.groups == "found" else f"{self.user}-{self.groups}-groups"

    @property
    def held_by(self) -> str:
        """What the report says that memory is held by; nothing where it depends on the machine."""
        return {"found": "", "with": "cgroup v", "without": "a watchdog"}[self.groups]


class Attack(Record):
    """One attack or broken submission; README.md says what each key means."""

    title: Annotated[str, Field(min_length=5, max_length=80)]
    tries: Annotated[str, Field(min_length=10, pattern=r"\.$")]
    promise: Promise
    attacker: str | None = None
    builder: str | None = None
    files: dict[str, str | Bytes] = Field(default_factory=dict)
    remove: tuple[str, ...] = ()
    modes: dict[str, Mode] = Field(default_factory=dict)
    links: dict[str, str] = Field(default_factory=dict)
    archive: Archive | None = None
    repository: tuple[Step, ...] | None = None
    generator: Generator | None = None
    source: str = "{path}"
    arguments: tuple[str, ...] = ()
    env: dict[str, str] = Field(default_factory=dict)
    rubric: str = "rubric.yaml"
    expect: Statuses = Field(default_factory=dict)
    error: ExpectedError | None = None
    refused: Pattern | None = None
    noticed: tuple[Pattern, ...] = ()
    says: tuple[Pattern, ...] | None = None
    never: tuple[Pattern, ...] = ()
    shows: tuple[Pattern, ...] = ()
    user: Literal["root", "ordinary", "both"] = "root"
    groups: Literal["found", "with", "without", "both"] = "found"
    through: tuple[str, ...] = ()
    container: bool = False
    often: bool = False
    after: Literal["none", "static", "full"] = "none"
    machine_mb: int | None = None
    installed: bool = False
    wall_s: Annotated[float, Field(gt=0, le=200)] = 150
    finding: str | None = None

    @property
    def must_say(self) -> tuple[str, ...]:
        """An attack that never ran proves nothing."""
        return self.says if self.says is not None else (r"tried",) if self.attacker or self.builder else ()

    @property
    def users(self) -> tuple[User, ...]:
        return ("root", "ordinary") if self.user == "both" else (self.user,)

    @property
    def runs(self) -> tuple[Run, ...]:
        """Each is a grading of its own."""
        groups: tuple[Groups, ...] = ("with", "without") if self.groups == "both" else (self.groups,)
        return tuple(Run(user, found) for user in self.users for found in groups)

    def is_for_all_only(self, run: Run) -> bool:
        """Return whether only `make test-all` makes this run.

        Of an attack that `make test` makes, too, it makes the last run: an ordinary user without control groups has the
        least to hold the attack.
        """
        return not self.often or run != self.runs[-1]


def attack_names() -> list[str]:
    found = [path.stem for path in ATTACKS.glob("*.yaml")]
    return sorted(found + [path.parent.name for path in ATTACKS.glob("*/attack.yaml")])


@cache
def load_attack(name: str) -> Attack:
    return Attack.model_validate(yaml.load(_declaration(name).read_bytes(), LOADER))  # noqa: S506 - a safe one


def rubric_path(name: str) -> Path:
    """Beside the attack in a folder of its own, or beside this file."""
    attack = load_attack(name)
    own = _declaration(name).parent / attack.rubric
    return own if own.is_file() and own.parent != ATTACKS else HERE / attack.rubric


def submission_job(name: str) -> Mapping[str, Any]:
    """What the room needs in order to make the submission, as JSON."""
    attack = load_attack(name)
    beside = ATTACKS / name / "package"
    fields = {
        "attacker",
        "builder",
        "files",
        "remove",
        "modes",
        "links",
        "archive",
        "repository",
        "generator",
    }
    made = attack.model_dump(mode="json", include=fields)
    return made | {"name": name, "beside": str(beside) if beside.is_dir() else None}


def _declaration(name: str) -> Path:
    single = ATTACKS / f"{name}.yaml"
    return single if single.is_file() else ATTACKS / name / "attack.yaml"
