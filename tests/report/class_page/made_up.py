"""Classes that never were: results of a lab with seventeen criteria, by chance but always the same."""

from __future__ import annotations

import random
from collections.abc import Iterator
from datetime import datetime, timedelta, timezone

from grader.model.batch import BatchRun, Counts, CriterionInfo, Entry, RosterFault, State
from grader.model.result import (
    AppliedOverride,
    Automatic,
    CriterionResult,
    ErrorInfo,
    GradingResult,
    Lateness,
    RubricInfo,
)
from grader.model.verdict import Status
from tests.support.a_class import criterion, made_result

RUBRIC = RubricInfo(id="leeds-comp3631-lab1", version="1.2", digest="0" * 64)
STARTED = datetime(2026, 11, 21, 18, 0, tzinfo=timezone.utc)
CRITERIA = (
    ("manifest", "package.xml names lab1", 5.0, ("package.xml names {x}, not lab1",)),
    ("cmake", "CMakeLists.txt calls what catkin needs", 5.0, ("there is no catkin_package() in CMakeLists.txt",)),
    ("build", "catkin_make succeeds", 5.0, ("src/{x}.cpp:{n}: expected ';' before '}}'", "catkin_make failed")),
    ("talker-executable", "The talker can be run", 5.0, ("src/{x}.py is not executable",)),
    ("listener-executable", "The listener can be run", 5.0, ("src/{x}.py has no shebang line",)),
    ("talker-node", "The talker is a node and stays alive", 5.0, ("ended after {n}.2 s: NameError: name 'rospyy'",)),
    ("chatter", "Strings on /chatter", 5.0, ("no message came on /chatter",)),
    ("chatter-rate", "/chatter has 10 Hz", 10.0, ("{n}.3 Hz, not 10 Hz",)),
    ("numeric-type", "Int8 on /numeric_chatter", 10.0, ("std_msgs/String, not std_msgs/Int8",)),
    ("numeric-rate", "/numeric_chatter has 10 Hz", 5.0, ("{n}.1 Hz, not 10 Hz", "no messages for {n} s")),
    ("counter-start", "The counter begins with 0", 5.0, ("begins with 1, not 0",)),
    ("counter-step", "The counter goes up by one", 5.0, ("after {n} comes {n}",)),
    ("counter-wrap", "The counter wraps from 127 to 0", 15.0, ("after 127 comes -128", "after 127 comes 1, not 0")),
    ("listener-chatter", "The listener prints /chatter", 5.0, ("prints {n} of 8 messages",)),
    (
        "listener-numeric",
        "The listener prints /numeric_chatter",
        5.0,
        ("none of the messages that were sent was printed",),
    ),
    ("launch", "roslaunch connects both", 5.0, ("lab1.launch has no <node> for numeric_{x}.py",)),
    ("dependencies", "package.xml declares what is used", 0.0, ("std_msgs is not declared",)),
)  # fmt: skip
FIRST = (
    "Ada",
    "Björn",
    "Chen",
    "Dilara",
    "Emeka",
    "Fatima",
    "Grace",
    "Hiro",
    "Inés",
    "Jakub",
    "Łucja",
    "Mehmet",
)
LAST = (
    "Achebe",
    "Bauer",
    "Costa",
    "Dubois",
    "Eriksen",
    "Fischer",
    "García",
    "Haddad",
    "Ivanov",
    "Jensen",
    "Kim",
)


def made_up_run(count: int, state: State = "complete", **fields: object) -> BatchRun:
    """The run of such a class."""
    given = {
        "state": state,
        "grader": "0.1.0",
        "rubric": RUBRIC,
        "rubric_source": RUBRIC.id,
        "title": "COMP3631 Lab 1: publishers and subscribers",
        "max_points": sum(most for _, _, most, _ in CRITERIA),
        "criteria": tuple(CriterionInfo(id=i, title=t, max_points=m) for i, t, m, _ in CRITERIA),
        "roster": "roster of 2026.csv",
        "started_at": STARTED,
        "ended_at": STARTED + timedelta(seconds=4.1 * count),
        "jobs": 8,
        "counts": Counts(submissions=count, graded=count, passed=count // 2),
    }
    return BatchRun(**{**given, **fields})


def made_up_rows(count: int, seed: int = 1, missing: int = 0) -> Iterator[tuple[Entry, GradingResult]]:
    """So many submissions, one by one, the last `missing` of them without a result."""
    chance = random.Random(seed)  # noqa: S311 - a class by chance, no secret
    for place in range(count):
        yield made_up(place, chance, missing=place >= count - missing)


def made_up(place: int, chance: random.Random, *, missing: bool = False) -> tuple[Entry, GradingResult]:
    """One submission."""
    name = f"{chance.choice(FIRST)} {chance.choice(LAST)}"
    entry = Entry(
        id=f"sc{chance.randrange(100):02}{place:05}",
        source=f"https://git.example.org/lab1/{place:05}.git",
        name=name,
        group=f"Group {place % 12 + 1}",
    )
    kind = chance.random()
    if missing:
        return entry, _error(entry, "not-graded-yet", "not graded yet")
    if kind < 0.03:
        return entry, _error(entry, "package-not-found", f"no package.xml in {entry.id}")
    weak = chance.betavariate(0.7, 3.5)
    criteria = [_criterion(spec, weak, chance) for spec in CRITERIA]
    if criteria[5].status is Status.FAIL:  # no talker, nothing of it
        criteria[6:13] = [_blocked(criterion) for criterion in criteria[6:13]]
    if 0.03 <= kind < 0.06:
        criteria[7] = criteria[7].model_copy(
            update={
                "status": Status.INCONCLUSIVE,
                "points": 0.0,
                "message": "the machine was late",
                "blocked_by": None,
            }
        )
    return entry, _settled(entry, tuple(criteria), chance)


def _criterion(
    spec: tuple[str, str, float, tuple[str, ...]], weak: float, chance: random.Random
) -> CriterionResult:
    name, title, most, messages = spec
    lost = chance.random() < weak
    partly = lost and name in {"chatter-rate", "numeric-rate", "listener-chatter"} and chance.random() < 0.6
    message = chance.choice(messages).format(
        x=chance.choice(("talker", "numeric_talker", "lab1", "pub")), n=chance.randrange(2, 9)
    )
    status = Status.PARTIAL if partly else Status.FAIL if lost else Status.PASS
    points = most / 2 if partly else 0.0 if lost else most
    return criterion(
        name, status, points, most, title=title, check=name, message=message if lost else "as it should be"
    )


def _blocked(criterion: CriterionResult) -> CriterionResult:
    update = {
        "status": Status.BLOCKED,
        "points": 0.0,
        "message": "blocked by talker-node",
        "blocked_by": "talker-node",
    }
    return criterion.model_copy(update=update)


def _settled(entry: Entry, criteria: tuple[CriterionResult, ...], chance: random.Random) -> GradingResult:
    overrides: tuple[AppliedOverride, ...] = ()
    if chance.random() < 0.04:
        said = Automatic(status=criteria[0].status, points=criteria[0].points, message=criteria[0].message)
        was = said.model_copy(update={"points": 2.0}) if chance.random() < 0.4 else said
        overrides = (
            AppliedOverride(
                points=5.0,
                author="A. Miller",
                comment="by mail",
                criterion="manifest",
                automatic=said,
                was=was,
                changed=was != said,
            ),
        )
        criteria = (criteria[0].model_copy(update={"status": Status.PASS, "points": 5.0}), *criteria[1:])
    points = sum(c.points for c in criteria)
    late = None
    if chance.random() < 0.08:
        left = max(0.0, points - 10)
        late = Lateness(late_s=chance.randrange(600, 200_000), points_before=points, points=left, text="late")
        points = left
    open_ = any(c.status is Status.INCONCLUSIVE for c in criteria)
    return _result(entry, criteria, chance).model_copy(
        update={
            "points": points,
            "overrides": overrides,
            "late": late,
            "status": "inconclusive" if open_ else "graded",
        }
    )


def _result(
    entry: Entry, criteria: tuple[CriterionResult, ...], chance: random.Random | None
) -> GradingResult:
    wall_s = round(chance.lognormvariate(2.2, 0.4), 3) if chance else 0.0
    commit = f"{hash_of(entry):040x}"
    return made_result(
        entry.id, criteria, source=entry.source, commit=commit, wall_s=wall_s, rubric=RUBRIC, points=0.0
    )


def hash_of(entry: Entry) -> int:
    """What stands for its commit."""
    return int.from_bytes(entry.id.encode()[-12:], "big") ** 2


def _error(entry: Entry, kind: str, message: str) -> GradingResult:
    chance = random.Random(0)  # noqa: S311 - as above
    update = {"status": Status.ERROR, "points": 0.0}
    criteria = tuple(_criterion(spec, 0.0, chance).model_copy(update=update) for spec in CRITERIA)
    error = ErrorInfo(kind=kind, message=message, hint="")
    return _result(entry, criteria, None).model_copy(update={"status": "error", "error": error})


FAULTS = (
    RosterFault(where="roster of 2026.csv:17", id="sc99", text="source: there is no folder /class/sc99"),
    RosterFault(where="roster of 2026.csv:21", text="id: empty"),
)
