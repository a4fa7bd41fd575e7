"""Classes for the tests of batches: made from the fixtures, with a rubric that files alone decide."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fixtures.make import faulty_package
from grader.cli.main import run

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
