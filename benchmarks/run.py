"""Measures everything, or some of it, and writes it down: `make bench`, `python -m benchmarks.run --only one`.

Each benchmark is a module of this folder with `measure(options)`. Ends with 1 where what was measured is not right
(a wrong verdict, a message lost without a word), never because something was slow.
"""

from __future__ import annotations

import argparse
import compileall
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import grader
from benchmarks import readme
from benchmarks.figures import Found, NotMeasured, Options
from benchmarks.machine import load, machine
from grader.errors import GraderError

NAMES = (
    "one",
    "peers",
    "faulty",
    "scenarios",
    "against",
    "hundred",
    "judging",
    "recorder",
    "accuracy",
    "load",
    "fair",
    "thousands",
    "growth",
    "reviewing",
)


def main(argv: Sequence[str] | None = None) -> int:
    given = _parser().parse_args(argv)
    options = Options(
        times=given.times,
        count=given.count,
        jobs=given.jobs,
        loops=tuple(given.loops) if given.loops is not None else None,
        seconds=given.seconds,
        keep=given.keep,
        against=given.against,
    )
    _compile()
    wrong = [name for name in given.only or NAMES if not _right(name, options, write=given.write)]
    if wrong:
        print(f"not right: {', '.join(wrong)}", file=sys.stderr)
    return 1 if wrong else 0


def _compile() -> None:
    """Write the bytecode that an installed grader has: without it, every process would compile every module."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    compileall.compile_dir(Path(grader.__file__).parent, quiet=1)


def _right(name: str, options: Options, *, write: bool) -> bool:
    print(f"## {name}\n", flush=True)
    before = load()
    try:
        found: Found = import_module(f"benchmarks.{name}").measure(options)
        text = readme.section(found, machine(), (before, load()))
        print(text, flush=True)
        if write:
            readme.write(name, text, found.pictures)
    except (NotMeasured, GraderError) as error:
        print(f"{name}: {error}", file=sys.stderr, flush=True)
        return False
    return not found.faults


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Measures what the grader promises.")
    parser.add_argument("--only", nargs="+", choices=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--write", action="store_true", help="put the figures into benchmarks/README.md")
    parser.add_argument("--times", type=int, help="how often each measurement is made")
    parser.add_argument("--count", type=int, help="how many: submissions, gradings, or runs under each load")
    parser.add_argument("--jobs", type=int, help="how many gradings side by side")
    parser.add_argument("--loops", type=int, nargs="+", help="busy loops beside (load: several numbers)")
    parser.add_argument("--seconds", type=float, help="how long a publisher publishes (recorder, accuracy)")
    parser.add_argument("--against", metavar="COMMIT", help="the grader to compare with (against)")
    parser.add_argument("--keep", metavar="FOLDER", help="keep results and evidence there")
    return parser


def _interrupted(_number: int, _frame: object) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    # what runs beside is ended either way; what a shell starts in the background, and its nodes, would ignore Ctrl-C
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupted)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
