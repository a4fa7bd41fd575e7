"""Runs an instructor's file of checks, and says what is wrong with it."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, wraps
from importlib.abc import ExecutionLoader
from importlib.machinery import ModuleSpec
from pathlib import Path
from traceback import extract_tb

from grader.checks.registry import Check, collecting
from grader.model.verdict import Verdict
from grader.rubric.own_checks.printing import printing_to_stderr

LineFault = tuple[int, str]


@dataclass(frozen=True, kw_only=True)
class OwnChecks:
    """`complete` is false where the file has a fault: then it may mean more checks than are here."""

    checks: Mapping[str, Check] = field(default_factory=dict)
    faults: tuple[LineFault, ...] = ()
    complete: bool = True


@lru_cache(maxsize=64)
def run_checks_file(path: Path, raw: bytes) -> OwnChecks:
    """The checks that the file registers. It is run once for each content; whatever goes wrong is a fault."""
    with collecting(str(path)) as collection:
        fault = _run(path, raw)
    faults = [*collection.faults, *([fault] if fault else [])]
    if not faults and not collection.checks:
        faults.append((1, "registers no check: decorate functions with @check(…), from grader.checks"))
    checks = {name: replace(c, function=_contained(c.function)) for name, c in collection.checks.items()}
    return OwnChecks(checks=checks, faults=tuple(sorted(faults)), complete=not faults)


def _contained(function: Callable[..., Verdict]) -> Callable[..., Verdict]:
    """What it prints goes to stderr, as stdout may be JSON, and it does not end the grader."""

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
    name = f"grader_own_{hashlib.sha256(str(path).encode() + raw).hexdigest()[:16]}"
    module = importlib.util.module_from_spec(ModuleSpec(name, _Loader(path, raw), origin=str(path)))
    sys.modules[name] = module
    try:
        assert module.__spec__ is not None  # noqa: S101 - made two lines above
        assert module.__spec__.loader is not None  # noqa: S101 - as above
        with printing_to_stderr():
            module.__spec__.loader.exec_module(module)
    except SyntaxError as error:
        own = error.filename in {str(path), None}
        return (error.lineno or 1) if own else _line(path, error), f"{error.msg}"
    except (Exception, SystemExit) as error:  # noqa: BLE001 - an instructor's own code may raise anything
        text = str(error).partition("\n")[0]
        return _line(path, error), f"{type(error).__name__}{': ' if text else ''}{text}"
    return None


def _line(path: Path, error: BaseException) -> int:
    """The last line of the file that took part."""
    lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == str(path)]
    return lines[-1] if lines and lines[-1] else 1


class _Loader(ExecutionLoader):
    """Compiles the bytes that were read, under the file's name; leaves no `__pycache__` beside the rubric."""

    def __init__(self, path: Path, raw: bytes) -> None:
        self._path = path
        self._raw = raw

    def get_filename(self, fullname: str) -> str:  # noqa: ARG002 - importlib's interface
        """For tracebacks."""
        return str(self._path)

    def get_source(self, fullname: str) -> str:  # noqa: ARG002 - as above
        """As Python reads it: by the coding that the file declares."""
        return importlib.util.decode_source(self._raw)
