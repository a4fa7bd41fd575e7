"""The longest files begin first, and the others run beside them (`--dist loadfile --no-loadscope-reorder`).

Examples of properties have no deadline: on a machine that is shared, how long one takes says nothing. All gradings take
turns with each other, and their locks lie where no test looks for what is left. Files of which `-m` leaves out every
test are not imported. What is collected stays to the end, and Python looks for garbage neither while it is collected
nor in it.
"""

from __future__ import annotations

import gc
import json
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from threading import Lock

import pytest
from hypothesis import settings

from grader import workers
from grader.limited_child import Answer, ChildLimits
from grader.workers import Worker

settings.register_profile("all", deadline=None)
settings.register_profile("quick", deadline=None, max_examples=20)
LONGEST = (
    "test_fixtures.py",
    "test_attacks.py",
    "test_platforms.py",
    "test_hostile_ros.py",
    "test_faults.py",
)
OF_A_FILE = re.compile(r"^pytestmark = (\[[^]]*\]|.*)", re.MULTILINE)
ONE_AT_A_TIME = Lock()
LOCKS = Path(tempfile.gettempdir(), f"ros-lab-grader-tests-{os.geteuid()}")
LOCKS.mkdir(mode=0o700, exist_ok=True)
os.environ["XDG_RUNTIME_DIR"] = str(LOCKS)


def pytest_configure(config: pytest.Config) -> None:
    """Properties get fewer examples where the marker `full` is left out, as in `make test`."""
    settings.load_profile("quick" if "not full" in config.option.markexpr else "all")
    gc.disable()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """None where others decide."""
    asked = config.option.markexpr
    if collection_path.suffix != ".py" or not asked:
        return None
    text = collection_path.read_text(encoding="utf-8")
    if asked.startswith("ros"):
        return True if "mark.ros" not in text else None
    marks = OF_A_FILE.search(text)
    left_out = (f"mark.{mark}" for mark in ("ros", "full") if f"not {mark}" in asked)
    return True if marks and any(mark in marks[0] for mark in left_out) else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: LONGEST.index(item.path.name) if item.path.name in LONGEST else len(LONGEST))


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


@pytest.fixture
def without_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers and limited children do their jobs here, for tests of what is made of the answers: to start one
    takes longer than most jobs. One at a time: Python cannot parse in two threads of one process."""
    monkeypatch.setattr(Worker, "run", lambda _worker, function, job: function(job))
    monkeypatch.setattr(workers, "_template", lambda *_: None)
    monkeypatch.setattr(sys, "path", [*sys.path])  # a child adds to its own
    for module in ("intake.archive", "package.python", "package.repairs.python"):
        monkeypatch.setattr(f"grader.{module}.run_limited", run_in_this_process)


def run_in_this_process(function: str, *arguments: object, limits: ChildLimits) -> Answer:
    """Do what `run_limited` does, without a child and its limits."""
    module, _, name = function.partition(":")
    with ONE_AT_A_TIME:
        values = getattr(import_module(module), name)(*json.loads(json.dumps(arguments)))
        return Answer(lines=b"".join(json.dumps(value).encode() + b"\n" for value in values), done=True)


@pytest.fixture
def open_path() -> Iterator[Path]:
    """A folder that other users can pass: pytest keeps `tmp_path` to whoever runs it."""
    with tempfile.TemporaryDirectory(prefix="grader-test-") as name:
        path = Path(name)
        path.chmod(0o755)
        yield path
