"""Grades the reference solution and every fixture of every lab, many times each: `make stress`.

A verdict that differs even once between runs is a fault of the grader's.
`python -m tests.stress --only LAB/reference --times 60 --loops 8` does so with one correct package on a busy machine.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from concurrent.futures import as_completed
from pathlib import Path

from benchmarks.busy import busy_loops
from fixtures.make import labs
from grader.errors import GraderError
from tests.fixture_runs import (
    REFERENCE,
    SIDE_BY_SIDE,
    fixture_names,
    grade_fixture,
    in_turn,
    read_fixture,
    rubric_of,
    surprises,
    workers,
)

Named = tuple[str, str]


def main() -> int:
    options = _parse()
    names = _chosen(options.only)
    began_s, wrong = time.monotonic(), 0
    with tempfile.TemporaryDirectory() as temporary, busy_loops(options.loops):
        for turn in range(1, options.times + 1):
            found = _one_round(names, (options.out or Path(temporary)) / str(turn), options.jobs)
            wrong += len(found)
            print(f"round {turn} of {options.times}: {len(names) - len(found)} of {len(names)} as declared")
            for (lab, name), lines in sorted(found.items()):
                print("\n  ".join([f"  {lab}/{name}:", *lines]), flush=True)
    runs = len(names) * options.times
    print(f"{runs - wrong} of {runs} runs as declared, {time.monotonic() - began_s:.0f} s")
    return 1 if wrong else 0


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Grades the fixtures many times.")
    parser.add_argument("--times", type=int, default=10, help="rounds")
    parser.add_argument("--jobs", type=int, default=SIDE_BY_SIDE, help="how many side by side")
    parser.add_argument("--loops", type=int, default=0, help="busy loops beside them")
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="NAME",
        help=f"these labs, fixtures, or fixtures of a lab (LAB/NAME); {REFERENCE} is the reference solution",
    )
    parser.add_argument("--out", type=Path, help="keep the results here, by round, lab and fixture")
    return parser.parse_args()


def _chosen(only: list[str] | None) -> list[Named]:
    every = [(lab, name) for lab in labs() for name in [REFERENCE, *fixture_names(lab)]]
    if only is None:
        return every
    titles = {pair: {pair[0], pair[1], "/".join(pair)} for pair in every}
    unknown = set(only).difference(*titles.values())
    if unknown:
        sys.exit(f"no such lab or fixture: {', '.join(sorted(unknown))}")
    return [pair for pair in every if titles[pair] & set(only)]


def _one_round(names: list[Named], folder: Path, jobs: int) -> dict[Named, list[str]]:
    """Surprises by fixture; those without any are left out."""
    found: dict[Named, list[str]] = {}
    with workers(jobs) as pool:
        futures = {pool.submit(grade_fixture, *pair, folder): pair for pair in in_turn(names)}
        for future in as_completed(futures):
            lab, name = futures[future]
            try:
                lines = surprises(future.result(), read_fixture(lab, name), rubric_of(lab))
            except GraderError as error:
                lines = [f"not graded: {error.message}"]
            if lines:
                found[lab, name] = lines
    return found


if __name__ == "__main__":
    sys.exit(main())
