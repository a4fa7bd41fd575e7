"""A class as a batch leaves it, with what the roster says of each student, and the commands that end its marking."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from grader.classes.batch.folder import open_batch, write_run
from grader.classes.batch.regrade import regrade
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides.write import write_override
from grader.cli.main import run
from grader.intake.names import safe_name
from grader.model.batch import Sent
from grader.model.result import GradingResult, Override
from grader.report.files import result_bytes
from grader.rubric.load import load_rubric
from tests.classes.review.a_class import Who, a_class, result_of

COMMIT = "c0ffee" + 34 * "0"


@dataclass(frozen=True, kw_only=True)
class Student:
    """One submission. All criteria that a person decides are decided, but for one who is `open`."""

    id: str
    name: str = ""
    source: str = ""
    where: str = "roster.csv:2"
    extra: Mapping[str, str] = field(default_factory=dict)
    commit: str = COMMIT
    open: bool = False
    error: str = ""
    missing: bool = False


def made(out: Path, *students: Student) -> Path:
    """Write the class into `out`, judged and settled."""
    whos = [
        Who(id=s.id, name=s.name, error=s.error, missing=s.missing, evidence=s is students[0])
        for s in students
    ]
    a_class(out, whos)
    for student in students:
        if not (student.open or student.error or student.missing):
            for criterion in ("style", "answers"):
                award(out, student.id, criterion, 5, settled=False)
        if not student.missing:
            _change(out, student)
    run_ = open_batch(out).run
    entries = tuple(
        entry.model_copy(
            update={
                "source": s.source or f"https://github.com/course/{s.id}",
                "where": s.where,
                "extra": dict(s.extra),
            }
        )
        for entry, s in zip(run_.entries, students, strict=True)
    )
    write_run(out, run_.model_copy(update={"entries": entries}))
    settle(out)
    return out


def _change(out: Path, student: Student) -> None:
    result = result_of(out, safe_name(student.id))
    about = result.submission.model_copy(update={"commit": student.commit or None})
    write_result(out, student.id, result.model_copy(update={"submission": about}))


def write_result(out: Path, name: str, result: GradingResult) -> None:
    """Put a result in place of the student's."""
    (out / safe_name(name) / "result.json").write_bytes(result_bytes(result))


def award(
    out: Path,
    name: str,
    criterion: str,
    points: float,
    comment: str = "",
    *,
    answer: str = "",
    settled: bool = True,
) -> None:
    """Override a criterion, and let the results follow."""
    override = Override(points=points, comment=comment, answer=answer, author="ann")
    write_override(out / OVERRIDES, name, criterion, override)
    if settled:
        settle(out)


def settle(out: Path) -> None:
    """Apply the overrides, as a batch does."""
    from grader.classes.batch.renew_results import Settler  # noqa: PLC0415 - of this alone
    from grader.classes.batch.run import ids_of  # noqa: PLC0415
    from grader.classes.overrides import read_overrides  # noqa: PLC0415

    batch = open_batch(out)
    rubric = load_rubric(batch.run.rubric_source).rubric
    overrides = read_overrides(out / OVERRIDES, rubric, ids_of(batch.run))
    settler = Settler(rubric, overrides)
    for entry in batch.run.entries:
        result = batch.earlier(entry)
        if result is not None and settler.of(entry.id):
            write_result(out, entry.id, settler.settle_again(result, entry.id, None))


def publish(out: Path, *options: str) -> int:
    """Run `grader publish`."""
    return run(["publish", str(out), "--author", "kim", *options])


def feedback(out: Path, form: str, *options: str) -> int:
    """Run `grader feedback`."""
    return run(["feedback", str(out), "--form", form, *options])


def sent(out: Path) -> list[tuple[str, str, str]]:
    """Return the id, form and state of every line of `sent.jsonl`."""
    lines = (out / "sent.jsonl").read_text(encoding="utf-8").splitlines()
    found = [Sent.read_json(line) for line in lines]
    return [(one.id, one.form, one.state) for one in found]


__all__ = ["COMMIT", "Student", "award", "feedback", "made", "publish", "regrade", "sent", "settle"]


def use(out: Path, sources: dict[str, str]) -> None:
    """Let the roster name these sources."""
    run_ = out / "run.json"
    data = json.loads(run_.read_text())
    for entry in data["entries"]:
        entry["source"] = sources.get(entry["id"], entry["source"])
    run_.write_text(json.dumps(data))
