"""That a finding is found: by its kind, and without an end to the run."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator

import pytest

from tests.fuzz import parent
from tests.fuzz.minimise import minimised
from tests.fuzz.mutate import BYTES_MAX, mutated
from tests.fuzz.parent import Runner

FAULTY = """
import ctypes, os, re
from tests.fuzz.loop import serve

def refuse(data):
    raise ValueError("no\\nsuch thing")

def loop(data):
    while True:
        try:
            pass
        except Exception:
            pass

def in_c(data):
    re.match("(a+)+b", "a" * 60)

serve({
    "fine": (lambda data: None, ()),
    "refused": (refuse, (ValueError,)),
    "raised": (refuse, (KeyError,)),
    "hang": (loop, ()),
    "slow-in-c": (in_c, ()),
    "memory": (lambda data: bytearray(b"x") * (12 << 20), ()),
    "died": (lambda data: os._exit(7), ()),
}, 0.6, 8 << 20)
"""


@pytest.fixture
def runner(monkeypatch: pytest.MonkeyPatch) -> Iterator[Runner]:
    monkeypatch.setitem(parent.COMMANDS, "grader", (sys.executable, "-c", FAULTY))
    monkeypatch.setattr(parent, "CPU_S", 1.0)
    monkeypatch.setattr(parent, "LOOK_S", 0.1)
    runner = Runner()
    yield runner
    runner.close()


def test_what_happens_is_told_and_the_next_case_runs_all_the_same(runner):
    for kind in ("raised", "hang", "memory", "died", "fine", "refused"):
        outcome = runner.run("grader", kind, b"")
        assert outcome.kind == kind
        assert outcome.finding == (kind not in {"fine", "refused"})
        assert runner.run("grader", "fine", b"x").kind == "fine"


def test_a_loop_that_no_signal_ends_is_a_hang(runner):
    assert runner.run("grader", "slow-in-c", b"").kind == "hang"
    assert runner.run("grader", "fine", b"").kind == "fine"


def test_a_finding_has_a_name_that_fits_a_file(runner):
    assert runner.run("grader", "raised", b"").signature == "raised-ValueError-string-refuse"


def test_a_finding_is_made_small():
    assert minimised(b"a" * 500 + b"xyz" + b"b" * 300, lambda data: b"xyz" in data) == b"xyz"


def test_mutations_follow_from_the_generator():
    seeds = [b"<launch/>", b"0123456789" * 20, b""]

    def some() -> list[bytes]:
        rng = random.Random(3)  # noqa: S311 - no secret
        return [mutated(rng.choice(seeds), seeds, rng) for _ in range(300)]

    found = some()
    assert found == some()
    assert len(set(found)) > 200
    assert max(map(len, found)) <= BYTES_MAX
