"""Who may grade: workers that come and go, and workers that differ."""

from __future__ import annotations

import pytest

from grader.classes.cluster.connect import Answer, Needs, Recruits, why_not
from tests.support.processes import until

VERSIONS = {"grader": "1.0", "code": "1f2e", "python": "3.11", "pydantic": "2.7.0"}
GOOD = {**VERSIONS, "host": "node1", "ros": "noetic", "kept_out": ""}
NEEDS = Needs(versions=VERSIONS, ros=True)
A, B = "tcp://10.0.0.1:1", "tcp://10.0.0.2:1"


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (GOOD, ""),
        ({**GOOD, "grader": "0.9"}, "it has grader 0.9, here it is 1.0"),
        ({**GOOD, "code": "9a8b"}, "its grader has other files than this one"),
        ({**GOOD, "python": "3.10"}, "it has python 3.10, here it is 3.11"),
        ({**GOOD, "pydantic": "2.6.0"}, "it has pydantic 2.6.0, here it is 2.7.0"),
        ({"host": "node1"}, "it has grader of no version, here it is 1.0"),
        ({**GOOD, "ros": ""}, "no ROS 1 there"),
        ({**GOOD, "kept_out": "/srv/out is a different place there"}, "/srv/out is a different place there"),
        (ModuleNotFoundError("No module named 'grader'"), "no grader like this one is installed there"),
        (Exception("ModuleNotFoundError(\"No module named 'grader'\")"), "no grader like this one"),
        (ValueError("broken"), "it cannot answer: ValueError: broken"),
    ],
)
def test_a_worker_that_differs_is_told_why(answer: Answer, why: str) -> None:
    assert answer is not None
    said = why_not(answer, NEEDS)
    assert said.startswith(why)
    assert bool(said) == bool(why)


def test_without_anything_to_run_no_ros_is_asked_for() -> None:
    assert why_not({**GOOD, "ros": ""}, Needs(versions=VERSIONS, ros=False)) == ""


class _Cluster:
    """A client whose workers have `threads`, and answer what `says` holds for them."""

    def __init__(self, says: dict[str, Answer]) -> None:
        self.says, self.threads, self.lines = says, {}, []
        self.recruits = Recruits(self, "/exchange", "0123", NEEDS, self.lines.append)

    def nthreads(self) -> dict[str, int]:
        return dict(self.threads)

    def run(self, _function, *_args, workers: list[str], on_error: str) -> dict[str, Answer]:
        assert on_error == "return"
        return {address: self.says[address] for address in workers if self.says[address] is not None}

    def look(self, threads: dict[str, int], answers: int) -> dict[str, int]:
        """The workers that can grade, once all have answered."""
        self.threads = threads
        self.recruits.look()
        until(lambda: self.recruits._answers.qsize() == answers)
        self.recruits.settle()
        return self.recruits.fit


@pytest.mark.parametrize(
    ("address", "fits"), [("tls://10.0.0.1:1", True), (A, False), ("ucx://10.0.0.1:1", False)]
)
def test_if_certificates_are_asked_for_a_worker_without_is_left_out(address: str, fits: bool) -> None:
    cluster = _Cluster({address: GOOD})
    cluster.recruits._needs = Needs(versions=VERSIONS, ros=True, encrypted=True)
    assert (cluster.look({address: 4}, 1) == {address: 4}) is fits
    assert any("listens without certificates" in line for line in cluster.lines) is not fits


def test_workers_come_and_go() -> None:
    cluster = _Cluster({A: GOOD, B: GOOD})
    assert cluster.look({A: 4}, 1) == {A: 4}
    assert cluster.look({A: 4, B: 2}, 1) == {A: 4, B: 2}
    assert cluster.recruits.threads == 6
    assert cluster.look({B: 2}, 0) == {B: 2}
    assert cluster.look({A: 4, B: 2}, 1) == {A: 4, B: 2}


def test_one_that_is_left_out_is_named_once_and_asked_again_when_it_comes_back() -> None:
    cluster = _Cluster({A: {**GOOD, "grader": "0.9"}})
    assert cluster.look({A: 4}, 1) == {}
    assert cluster.look({A: 4}, 0) == {}
    assert cluster.lines == [f"this worker is left out: {A} (node1): it has grader 0.9, here it is 1.0"]
    assert cluster.look({}, 0) == {}
    cluster.says[A] = GOOD
    assert cluster.look({A: 4}, 1) == {A: 4}
    assert cluster.recruits.asked == 0


@pytest.mark.parametrize("lost", [None, OSError("in <closed TCP>: Stream is closed")])
def test_one_that_was_lost_while_it_was_asked_is_asked_again(lost: Answer) -> None:
    cluster = _Cluster({A: lost})
    assert cluster.look({A: 4}, 1) == {}
    cluster.says[A] = GOOD
    assert cluster.look({A: 4}, 1) == {A: 4}


def test_an_answer_that_comes_after_its_worker_has_gone_counts_for_nothing() -> None:
    cluster = _Cluster({A: GOOD})
    cluster.threads = {A: 4}
    cluster.recruits.look()
    assert cluster.look({}, 1) == {}
