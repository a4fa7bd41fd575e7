"""Grades the reference solution and every fixture, many times each: `make stress`.

A verdict that differs even once between runs is a fault of the grader's.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from concurrent.futures import as_completed
from pathlib import Path

from grader.errors import GraderError
from grader.rubric.load import load_rubric
from tests.fixture_runs import (
    REFERENCE,
    SIDE_BY_SIDE,
    fixture_names,
    grade_fixture,
    read_fixture,
    surprises,
    workers,
)

LAB = "leeds-comp3631-lab1"


def main() -> int:
    options = _parse()
    names = options.only or [REFERENCE, *fixture_names(LAB)]
    began_s, wrong = time.monotonic(), 0
    with tempfile.TemporaryDirectory() as temporary:
        for turn in range(1, options.times + 1):
            found = _one_round(names, (options.out or Path(temporary)) / str(turn), options.jobs)
            wrong += len(found)
            print(f"round {turn} of {options.times}: {len(names) - len(found)} of {len(names)} as declared")
            for name, lines in sorted(found.items()):
                print("\n  ".join([f"  {name}:", *lines]), flush=True)
    runs = len(names) * options.times
    print(f"{runs - wrong} of {runs} runs as declared, {time.monotonic() - began_s:.0f} s")
    return 1 if wrong else 0


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Grades the fixtures many times.")
    parser.add_argument("--times", type=int, default=10, help="rounds")
    parser.add_argument("--jobs", type=int, default=SIDE_BY_SIDE, help="how many side by side")
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", help=f"these fixtures ({REFERENCE}: the reference)"
    )
    parser.add_argument("--out", type=Path, help="keep the results here, by round and fixture")
    return parser.parse_args()


def _one_round(names: list[str], folder: Path, jobs: int) -> dict[str, list[str]]:
    """Surprises by fixture; those without any are left out."""
    rubric = load_rubric(LAB).rubric
    found: dict[str, list[str]] = {}
    with workers(jobs) as pool:
        futures = {pool.submit(grade_fixture, LAB, name, folder): name for name in names}
        for future in as_completed(futures):
            name = futures[future]
            try:
                lines = surprises(future.result(), read_fixture(LAB, name), rubric)
            except GraderError as error:
                lines = [f"not graded: {error.message}"]
            if lines:
                found[name] = lines
    return found


if __name__ == "__main__":
    sys.exit(main())
