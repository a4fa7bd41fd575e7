"""Python files as a Python reads them, in a process of its own with limits; nothing is imported."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field

from grader.limited import ChildLimits, run_limited
from grader.model.package import Fault, PythonSlip
from grader.model.record import Record
from grader.package.python_causes import cause_of
from grader.package.reading import printable

CHECK = "grader.arena.ros.syntax:check_all"
MEMORY_BYTES, CPU_S = 1 << 30, 20
REPORT_BYTES_MAX = 8 << 20
"""More than `syntax.py` has to say of as many files as a package may have."""
CRASHES_MAX = 3
MESSAGE_CHARS_MAX = 500


class SyntaxReport(Record):
    """What `syntax.py` said: `checked` are all files that it came to, `faults` by path."""

    checked: tuple[str, ...] = ()
    faults: dict[str, Fault] = Field(default={})
    slips: tuple[PythonSlip, ...] = ()


class _RawFault(Record):
    kind: str
    line: int | None
    column: int | None
    message: str
    text: str = ""
    opened: int | None = None
    mixed: bool = False


class _RawSlip(Record):
    line: int
    kind: Literal["not-called", "input"]
    message: str


class _RawEntry(Record):
    file: str
    faults: tuple[_RawFault, ...]
    slips: tuple[_RawSlip, ...]


def read_syntax_report(output: bytes | str) -> SyntaxReport:
    """The report of `grader/arena/ros/syntax.py` from what it printed; foreign lines are passed over, and what is past
    `REPORT_BYTES_MAX` is not read."""
    checked: list[str] = []
    faults: dict[str, Fault] = {}
    slips: list[PythonSlip] = []
    for entry in filter(None, map(_entry, output[:REPORT_BYTES_MAX].splitlines())):
        file = printable(entry.file)
        checked.append(file)
        if entry.faults:
            faults[file] = _fault(file, entry.faults[0])
        slips += [
            PythonSlip(file=file, line=slip.line, kind=slip.kind, message=printable(slip.message))
            for slip in entry.slips
        ]
    return SyntaxReport(checked=tuple(checked), faults=faults, slips=tuple(slips))


def _entry(line: bytes | str) -> _RawEntry | None:
    try:
        return _RawEntry.model_validate(json.loads(line))
    except (ValueError, RecursionError):
        return None


def _fault(file: str, raw: _RawFault) -> Fault:
    cause = cause_of(raw.message, raw.text, column=raw.column, opened=raw.opened, mixed=raw.mixed)
    kind = printable(raw.kind[:MESSAGE_CHARS_MAX])
    return Fault(
        file=file,
        line=raw.line,
        column=raw.column if raw.column and raw.column > 0 else None,
        kind=kind,
        message=printable(raw.message[:MESSAGE_CHARS_MAX]) or kind,
        cause=printable(cause),
    )


def check_syntax(folder: Path, paths: Sequence[str], *, timeout_s: float = 10.0) -> SyntaxReport:
    """The report on files of `folder`, made by this Python in processes of their own with limits.

    A file that crashes Python gets a fault of kind `PythonCrash`, those that the time does not reach
    `NotChecked`.
    """
    deadline = time.monotonic() + timeout_s
    report, left = SyntaxReport(), list(paths)
    for _ in range(CRASHES_MAX + 1):
        remaining_s = deadline - time.monotonic()
        if not left or remaining_s <= 0:
            break
        found, timed_out = _run(folder, left, remaining_s)
        done = set(found.checked)
        left = [path for path in left if printable(path) not in done]
        report = _joined(report, found)
        if left:
            kind, message = (
                ("NotChecked", "takes too long") if timed_out else ("PythonCrash", "crashes Python")
            )
            report = _joined(report, _without_result([left.pop(0)], kind, message))
    return _joined(report, _without_result(left, "NotChecked", "was not reached in time"))


def _run(folder: Path, paths: list[str], timeout_s: float) -> tuple[SyntaxReport, bool]:
    limits = ChildLimits(
        memory_bytes=MEMORY_BYTES,
        cpu_s=CPU_S,
        wall_s=timeout_s,
        file_bytes=4 * REPORT_BYTES_MAX,
        answer_bytes=REPORT_BYTES_MAX,
    )
    answer = run_limited(CHECK, str(folder.absolute()), paths, limits=limits)
    return read_syntax_report(answer.lines), answer.timed_out


def _without_result(paths: Iterable[str], kind: str, message: str) -> SyntaxReport:
    faults = {}
    for file in map(printable, paths):
        crashed = kind == "PythonCrash"
        cause = f"the syntax of `{file}` could not be checked: reading it {message}" if crashed else ""
        faults[file] = Fault(file=file, line=None, kind=kind, message=message, cause=cause)
    return SyntaxReport(checked=tuple(faults), faults=faults)


def _joined(one: SyntaxReport, two: SyntaxReport) -> SyntaxReport:
    return SyntaxReport(
        checked=one.checked + two.checked,
        faults={**one.faults, **two.faults},
        slips=one.slips + two.slips,
    )
