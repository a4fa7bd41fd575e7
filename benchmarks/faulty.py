"""Faulty packages beside the correct one of their lab: what repaired copies and repeated runs cost."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import Found, Options, Row, spread
from benchmarks.gradings import ROOT, folder_for
from benchmarks.machine import timed
from fixtures.make import declared, faulty_package, labs
from grader.judging.repeats_and_repairs import REPAIRED, REPEATED

COUNT = 20
BESIDE_ONE = 3
"""So many faulty packages are held against one grading of the correct one, which comes right before them."""
RUBRICS = ROOT / "rubrics"
GRADER = (sys.executable, "-m", "grader")


class Turn(NamedTuple):
    """A faulty package beside the correct one: `ratio` of their wall times, and whether more was run."""

    ratio: float
    copied: bool
    repeated: bool


def measure(options: Options) -> Found:
    names = [(lab, name) for lab in labs() if (RUBRICS / f"{lab}.yaml").is_file() for name in declared(lab)]
    chosen = names[:: max(1, len(names) // (options.count or COUNT))]
    with folder_for("faulty", options) as folder:
        turns = [
            turn
            for lab in dict.fromkeys(lab for lab, _ in chosen)
            for turn in _lab(lab, chosen, folder / lab)
        ]
    again = [turn.ratio for turn in turns if turn.copied or turn.repeated]
    rows = [Row("faulty package / correct one, wall", "", [turn.ratio for turn in turns], "at most 1.6")]
    if again:
        rows.append(Row("of these, with a repaired copy or a repeated run", "", again))
    runs = f"{len(turns)} of {len(names)} faulty packages, each beside its lab's correct one"
    more = f"{sum(t.copied for t in turns)} had a repaired copy, {sum(t.repeated for t in turns)} a repeated run."
    return Found(runs=runs, tables=(spread(rows),), remarks=(more,))


def _lab(lab: str, chosen: list[tuple[str, str]], folder: Path) -> Iterator[Turn]:
    correct, correct_s = ROOT / "reference_solutions" / lab, 0.0
    _wall_s(correct, lab, folder / "first")  # what is shared is made now
    for number, name in enumerate(name for one, name in chosen if one == lab):
        if number % BESIDE_ONE == 0:
            correct_s = _wall_s(correct, lab, folder / f"{number}-correct")
        faulty_s = _wall_s(faulty_package(lab, name), lab, folder / f"{number}-faulty")
        seen = {path.name for path in (folder / f"{number}-faulty").glob("*/evidence/*")}
        yield Turn(faulty_s / correct_s, REPAIRED in seen, REPEATED in seen)


def _wall_s(package: Path, lab: str, out: Path) -> float:
    argv = [*GRADER, "grade", str(package), "--rubric", lab, "--out", str(out)]
    return timed(argv, codes=(0, 1, 4)).wall_s
