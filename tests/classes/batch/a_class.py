"""Classes for the tests of batches: made from the fixtures, with a rubric that files alone decide."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from fixtures.make import faulty_package
from grader import __version__
from grader.classes.batch.folder import write_run
from grader.classes.batch.run import describe_rubric
from grader.cli.main import run
from grader.evidence.reader import load_evidence
from grader.judging import judge
from grader.model.batch import BatchRun, Entry
from grader.report.files import write_reports
from grader.rubric.load import LoadedRubric, load_rubric
from tests.support.a_class import judged_result

ROOT = Path(__file__).parent.parent.parent.parent
RUBRIC = ROOT / "benchmarks" / "data" / "static.yaml"
CORRECT = ROOT / "reference_solutions" / "leeds-comp3631-lab1"
WRONG_NAME = faulty_package("leeds-comp3631-lab1", "cmake-project-name")


def handed_in(folder: Path, names: Iterable[str], source: Path = CORRECT) -> Path:
    """A folder with the same submission under each of the names."""
    for name in names:
        shutil.copytree(source, folder / name)
    return folder


def roster_of(folder: Path, rows: Iterable[str], columns: str = "id,source") -> Path:
    """A roster in that folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "roster.csv"
    path.write_text("\n".join([columns, *rows]) + "\n", encoding="utf-8")
    return path


def batch(roster: Path, out: Path, *more: str, rubric: Path = RUBRIC) -> int:
    """`grader batch` as a user runs it, with one process for all submissions: to start more takes longer here."""
    return run(["batch", str(roster), "--rubric", str(rubric), "--out", str(out), "--jobs", "1", *more])


def lines_of(out: Path) -> list[dict[str, Any]]:
    """`results.jsonl`."""
    return [json.loads(text) for text in (out / "results.jsonl").read_text(encoding="utf-8").splitlines()]


def run_of(out: Path) -> dict[str, Any]:
    """`run.json`."""
    return json.loads((out / "run.json").read_bytes())


RECORDINGS = Path(__file__).parent.parent.parent / "data" / "recordings"
LAB = Path(__file__).parent.parent.parent.parent / "rubrics" / "leeds-comp3631-lab1.yaml"


def recorded(out: Path, kinds: dict[str, str]) -> Path:
    """A batch's folder as the lab's rubric left it, from recordings that are kept."""
    rubric = load_rubric(str(LAB))
    entries = tuple(Entry(id=name, source=f"/gone/{name}", name=name.title()) for name in kinds)
    for name, kind in kinds.items():
        shutil.copytree(RECORDINGS / kind, out / name / "evidence")
        write_result(out / name, name, rubric)
    about = BatchRun(
        state="complete",
        grader=__version__,
        **describe_rubric(rubric, str(LAB)),
        roster="roster.csv",
        started_at=datetime(2026, 11, 1, tzinfo=timezone.utc),
        entries=entries,
    )
    write_run(out, about)
    return out


def write_result(folder: Path, name: str, rubric: LoadedRubric) -> None:
    criteria = judge(rubric.rubric, load_evidence([folder / "evidence"]), rubric.checks)
    result = judged_result(name, rubric, criteria)
    write_reports(result, folder, console="kept", rubric=rubric.rubric)


def kinds() -> dict[str, str]:
    return {"ada": "correct", "bob": "correct"}
