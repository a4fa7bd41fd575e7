"""An instructor's own checks: the files that a rubric names are read, and the file of checks is run.

What they print goes to stderr, with what a student wrote in it made visible.
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from functools import lru_cache, wraps
from importlib.abc import ExecutionLoader
from importlib.machinery import ModuleSpec
from pathlib import Path
from traceback import extract_tb
from typing import TextIO

from grader.checks import CHECKS, Check
from grader.checks.registry import collecting
from grader.model.verdict import Verdict
from grader.rubric.course_packages import read_packages, read_starter
from grader.rubric.pytest_check import BAG, PYTHON, FileFault, faults_of_tests, pytest_check, read_beside
from grader.rubric.step_faults import bag_faults, played_bags
from grader.rubric.yaml_lines import Fault, KeyPath, WrittenRubric
from grader.untrusted_text import visible

PYTEST = "pytest"
LineFault = tuple[int, str]
LINE_CHARS = 65_536
_STREAMS = threading.RLock()
"""Stdout is the whole process's: two threads would leave each other's behind."""


@dataclass(frozen=True, kw_only=True)
class Beside:
    """The files by name, the instructor's own checks, all checks by name, faults of the rubric's own keys, and the
    sha256 of each file of the starter."""

    files: dict[str, bytes]
    own: OwnChecks
    known: dict[str, Check]
    faults: tuple[Fault, ...]
    handed_out: frozenset[str]


def read_instructor(data: object, folder: Path) -> Beside:
    """Read what the rubric names beside it (checks, packages, a starter, tests, bags), and run the file of checks."""
    rubric = WrittenRubric(data)
    named: list[tuple[KeyPath, object]] = [(("checks",), rubric.data.get("checks"))]
    of_tests = [criterion for criterion in rubric.criteria if criterion.check == PYTEST]
    named += [((*criterion.at, "file"), criterion.given.get("file")) for criterion in of_tests]
    named += [((*at, "tests"), start.get("tests")) for at, start in rubric.starts()]
    played = played_bags(rubric)
    named += [(path, play.get("bag")) for path, play in played.items()]
    files, faults = read_packages(rubric, folder)
    starter, more = read_starter(rubric, folder)
    files |= starter
    faults += more
    own = OwnChecks(complete=rubric.data.get("checks") is None)
    for path, name in named:
        if not isinstance(name, str):
            continue
        try:
            file, files[name] = read_beside(folder, name, BAG if path in played else PYTHON)
        except FileFault as fault:
            faults.append((path, str(fault)))
            continue
        if path in played:
            faults += bag_faults(path, file, played[path], rubric)
        if path == ("checks",):
            own = run_checks_file(file, files[name])
    handed_out = frozenset(hashlib.sha256(content).hexdigest() for content in starter.values() if content)
    faults += faults_of_tests(rubric, files)
    known = known_checks(folder, own.checks)
    return Beside(files=files, own=own, known=known, faults=tuple(faults), handed_out=handed_out)


def known_checks(folder: Path, own: Mapping[str, Check]) -> dict[str, Check]:
    """Return the grader's, `pytest` for tests in the rubric's folder, and the rubric's own."""
    tests = pytest_check(folder)
    return {**CHECKS, tests.name: tests, **own}


@dataclass(frozen=True, kw_only=True)
class OwnChecks:
    """`complete` is false where the file has a fault: then it may mean more checks than are here."""

    checks: Mapping[str, Check] = field(default_factory=dict)
    faults: tuple[LineFault, ...] = ()
    complete: bool = True


@lru_cache(maxsize=64)
def run_checks_file(path: Path, raw: bytes) -> OwnChecks:
    """Return the checks that the file registers. It is run once for each content; whatever goes wrong is a fault."""
    with collecting(str(path)) as collection:
        fault = _run(path, raw)
    faults = [*collection.faults, *([fault] if fault else [])]
    if not faults and not collection.checks:
        faults.append((1, "registers no check: decorate functions with @check(…), from grader.checks"))
    checks = {name: replace(c, function=_contain(c.function)) for name, c in collection.checks.items()}
    return OwnChecks(checks=checks, faults=tuple(sorted(faults)), complete=not faults)


def _contain(function: Callable[..., Verdict]) -> Callable[..., Verdict]:
    """Return the check's function, made so that what it prints goes to stderr, as stdout may be JSON, and that its
    `sys.exit` is an error and does not end the grader."""

    @wraps(function)
    def contained(**facts: object) -> Verdict:
        try:
            with printing_to_stderr():
                return function(**facts)
        except SystemExit as error:
            raise RuntimeError("it called sys.exit") from error

    return contained


def _run(path: Path, raw: bytes) -> LineFault | None:
    """Run the file as a module of its own, which stays: records of parameters look their types up in it."""
    # By path and content: another rubric's file of this name, or this one once it has changed, is another module.
    name = f"grader_own_{hashlib.sha256(str(path).encode() + raw).hexdigest()[:16]}"
    loader = _Loader(path, raw)
    module = importlib.util.module_from_spec(ModuleSpec(name, loader, origin=str(path)))
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        with printing_to_stderr():
            loader.exec_module(module)
    except SyntaxError as error:
        # Else the syntax error is in a file that this one imports.
        own = error.filename in {str(path), None}
        return (error.lineno or 1) if own else _line(path, error), f"{error.msg}"
    except (Exception, SystemExit) as error:  # noqa: BLE001 - an instructor's own code may raise anything
        text = str(error).partition("\n")[0]
        return _line(path, error), f"{type(error).__name__}{': ' if text else ''}{text}"
    return None


def _line(path: Path, error: BaseException) -> int:
    """Return the last line of the file that took part."""
    lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == str(path)]
    return lines[-1] if lines and lines[-1] else 1


class _Loader(ExecutionLoader):
    """Compiles the bytes that were read, under the file's name; leaves no `__pycache__` beside the rubric."""

    def __init__(self, path: Path, raw: bytes) -> None:
        self._path = path
        self._raw = raw

    def get_filename(self, fullname: str) -> str:  # noqa: ARG002 - importlib's interface
        """Return the file's name, for tracebacks."""
        return str(self._path)

    def get_source(self, fullname: str) -> str:  # noqa: ARG002 - as above
        """Return the source as Python reads it: by the coding that the file declares."""
        return importlib.util.decode_source(self._raw)


class VisibleText(io.TextIOBase):
    """Writes whole lines to another stream, so that a command to a CI system is known wherever it was cut."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._rest = ""

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        """Write what is complete of it."""
        whole, newline, self._rest = (self._rest + text).rpartition("\n")
        self._stream.write(visible(whole + newline, lines=True))
        if len(self._rest) > LINE_CHARS:
            self.finish()
        return len(text)

    def finish(self) -> None:
        """Write what no line end came for."""
        rest, self._rest = self._rest, ""
        if rest:
            self._stream.write(f"{visible(rest)}\n")


@contextmanager
def printing_to_stderr() -> Iterator[None]:
    """Send what is printed in the block to stderr: stdout may be JSON."""
    with _STREAMS:
        shown = VisibleText(sys.stderr)
        try:
            with redirect_stdout(shown), redirect_stderr(shown):
                yield
        finally:
            shown.finish()
