"""Classes for the tests of the review, as a batch leaves them: the lab with two criteria that a person decides."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path

import yaml

from grader import __version__
from grader.classes.batch.folder import BatchFolder, write_run
from grader.classes.batch.run import describe_rubric, write_books
from grader.evidence.reader import load_evidence
from grader.intake.names import safe_name
from grader.judging import judge
from grader.model.batch import BatchRun, Entry, RosterFault
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.figures import figures_of
from grader.report.files import write_reports
from grader.rubric.load import LoadedRubric, load_rubric
from tests.support.a_class import judged_result

ROOT = Path(__file__).parent.parent.parent.parent
LAB = ROOT / "rubrics" / "leeds-comp3631-lab1.yaml"
RECORDINGS = ROOT / "tests" / "data" / "recordings"
ADVICE_HERE = ("manifest", "cmake", "build", "launch", "talker-executable")
"""Of 25 points together, which the criteria that a person decides have here."""
MANUAL = """
  - id: style
    title: The code reads well
    points: 10
    check: manual
    hint: names, short functions, no copies

  - id: answers
    title: The questions of the sheet are answered
    points: 15
    check: manual
    visibility: hidden
"""


@dataclass(frozen=True, kw_only=True)
class Who:
    """A submission of a made-up class. `recorded` is one of the kept recordings, `changes` change its criteria."""

    id: str
    name: str = ""
    group: str = ""
    recorded: str = "correct"
    changes: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    error: str = ""
    missing: bool = False
    evidence: bool = True


DANA = Who(id="dana", name="Dana Scully", recorded="dies-at-128")
INCONCLUSIVE = {"status": Status.INCONCLUSIVE, "points": 0.0, "message": "the machine was late"}
CLASS = (
    Who(id="ada", name="Ada Lovelace", group="A"),
    DANA,
    Who(id="eve", name="Eve", changes={"chatter-rate": INCONCLUSIVE}),
    Who(id="fay", name="Fay", error="there is no package of the lab in it"),
    Who(id="gus", name="Gus", missing=True),
)


def a_class(out: Path, whos: Sequence[Who] = CLASS, faults: tuple[RosterFault, ...] = ()) -> Path:
    """The folder `out` as a batch left it, with the rubric beside it."""
    rubric = a_rubric(out.parent / "lab.yaml")
    judged = {kind: _judged(rubric, kind) for kind in {who.recorded for who in whos}}
    for who in whos:
        if not who.missing:
            _write(out / safe_name(who.id), who, rubric, judged[who.recorded])
    run = BatchRun(
        state="complete",
        grader=__version__,
        **describe_rubric(rubric, str(rubric.path)),
        roster="roster.csv",
        started_at=datetime(2026, 11, 1, 10, tzinfo=timezone.utc),
        ended_at=datetime(2026, 11, 1, 11, tzinfo=timezone.utc),
        entries=tuple(Entry(id=w.id, source=f"/gone/{w.id}", name=w.name, group=w.group) for w in whos),
        faults=faults,
    )
    out.mkdir(exist_ok=True)
    folder = BatchFolder(out, run)
    write_run(
        out,
        write_books(folder, rubric.rubric, "complete", 0).run.model_copy(update={"ended_at": run.ended_at}),
    )
    return out


def a_rubric(path: Path, more: str = MANUAL) -> LoadedRubric:
    """The lab's rubric with two criteria that a person decides."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = LAB.read_text(encoding="utf-8")
    for criterion in ADVICE_HERE:
        head, tail = text.split(f"  - id: {criterion}\n")
        text = f"{head}  - id: {criterion}\n" + re.sub(r"points: \d+", "points: 0", tail, count=1)
    path.write_text(text + more, encoding="utf-8")
    return load_rubric(str(path))


def overrides_of(out: Path) -> dict[str, dict[str, dict[str, object]]]:
    """What `overrides.yaml` holds, as YAML alone reads it."""
    data = yaml.safe_load((out / "overrides.yaml").read_text(encoding="utf-8"))
    return {key: value for key, value in (data or {}).items() if key != "schema"}


def result_of(out: Path, key: str) -> GradingResult:
    """A submission's `result.json`."""
    return GradingResult.model_validate_json((out / key / "result.json").read_bytes())


def points_of(out: Path, key: str, criterion: str) -> float:
    """What a criterion came to."""
    return next(c.points for c in result_of(out, key).criteria if c.id == criterion)


def _judged(rubric: LoadedRubric, kind: str) -> tuple[CriterionResult, ...]:
    return judge(rubric.rubric, load_evidence([RECORDINGS / kind]), rubric.checks)


def _write(folder: Path, who: Who, rubric: LoadedRubric, judged: tuple[CriterionResult, ...]) -> None:
    if who.evidence:
        shutil.copytree(RECORDINGS / who.recorded, folder / "evidence")
    found = tuple(c.model_copy(update=dict(who.changes.get(c.id, {}))) for c in judged)
    if who.error:
        lost = {"status": Status.ERROR, "points": 0.0, "message": "not judged", "measured": ""}
        found = tuple(c.model_copy(update=lost) for c in found)
    result = judged_result(safe_name(who.id), rubric, found, source="/gone", wall_s=12.5, error=who.error)
    runs = load_evidence([folder / "evidence"]) if who.evidence else {}
    figures = figures_of(rubric.rubric, runs, found)
    write_reports(result, folder, console="", rubric=rubric.rubric, figures=figures, docs=rubric.docs)
