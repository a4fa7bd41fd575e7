"""Faulty packages beside the correct one of their lab: what repaired copies and repeated runs cost."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, Options, Row, spread
from benchmarks.gradings import ROOT, folder_for
from benchmarks.machine import timed
from fixtures.make import declared, faulty_package, labs
from grader.repaired_copy import REPAIRED, REPEATED

COUNT = 40
RUBRICS = ROOT / "rubrics"
GRADER = (sys.executable, "-m", "grader")


class Turn(NamedTuple):
    """A faulty package and right after it the correct one: `ratio` of their wall times, and whether more was run."""

    ratio: float
    copied: bool
    repeated: bool


def measure(options: Options) -> Found:
    names = [(lab, name) for lab in labs() if (RUBRICS / f"{lab}.yaml").is_file() for name in declared(lab)]
    chosen = names[:: max(1, len(names) // (options.count or COUNT))]
    with folder_for("faulty", options) as folder:
        for lab in dict.fromkeys(lab for lab, _ in chosen):
            _wall_s(ROOT / "reference_solutions" / lab, lab, folder / "first")  # what is shared is made now
        turns = [_turn(lab, name, folder / str(number)) for number, (lab, name) in enumerate(chosen)]
    again = [turn.ratio for turn in turns if turn.copied or turn.repeated]
    rows = [Row("faulty package / correct one, wall", "", [turn.ratio for turn in turns], "at most 1.6")]
    if again:
        rows.append(Row("of these, with a repaired copy or a repeated run", "", again))
    runs = f"{len(turns)} of {len(names)} faulty packages, each beside its lab's correct one"
    more = f"{sum(t.copied for t in turns)} had a repaired copy, {sum(t.repeated for t in turns)} a repeated run."
    return Found(runs=runs, tables=(spread(rows),), remarks=(more,))


def _turn(lab: str, name: str, folder: Path) -> Turn:
    faulty_s = _wall_s(faulty_package(lab, name), lab, folder / "faulty")
    correct_s = _wall_s(ROOT / "reference_solutions" / lab, lab, folder / "correct")
    seen = {path.name for path in (folder / "faulty").glob("*/evidence/*")}
    return Turn(faulty_s / correct_s, REPAIRED in seen, REPEATED in seen)


def _wall_s(package: Path, lab: str, out: Path) -> float:
    argv = [*GRADER, "grade", str(package), "--rubric", lab, "--out", str(out)]
    return timed(argv, codes=(0, 1, 4)).wall_s
