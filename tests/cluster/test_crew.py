"""Who may grade: workers that come and go, and workers that differ."""

from __future__ import annotations

from queue import SimpleQueue

import pytest

from grader.classes.cluster.crew import Answer, Crew, Needs, why_not

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
        ({**GOOD, "kept_out": "/srv/out is another place there"}, "/srv/out is another place there"),
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


@pytest.mark.parametrize(
    ("address", "fits"), [("tls://10.0.0.1:1", True), (A, False), ("ucx://10.0.0.1:1", False)]
)
def test_where_certificates_are_asked_for_a_worker_without_is_left_out(address: str, fits: bool) -> None:
    needs = Needs(versions=VERSIONS, ros=True, encrypted=True)
    heard: SimpleQueue[tuple[str, Answer]] = SimpleQueue()
    crew = Crew(needs, lambda _: GOOD, lambda *said: heard.put(said))
    crew.update({address: 4})
    said = crew.settle(*heard.get(timeout=10))
    assert (crew.fit == {address: 4}) is fits
    assert ("listens without certificates" in said) is not fits


class _Asked:
    """A crew whose workers answer what `says` holds for them."""

    def __init__(self) -> None:
        self.says: dict[str, Answer] = {A: GOOD, B: GOOD}
        self.heard: SimpleQueue[tuple[str, Answer]] = SimpleQueue()
        self.crew = Crew(NEEDS, lambda address: self.says[address], lambda *said: self.heard.put(said))

    def update(self, threads: dict[str, int], answers: int) -> list[str]:
        self.crew.update(threads)
        assert self.crew.asked == answers
        return [self.crew.settle(*self.heard.get(timeout=10)) for _ in range(answers)]


def test_workers_come_and_go() -> None:
    asked = _Asked()
    assert asked.update({A: 4}, 1) == [""]
    assert asked.update({A: 4, B: 2}, 1) == [""]
    assert asked.crew.threads == 6
    assert asked.update({B: 2}, 0) == []
    assert asked.crew.fit == {B: 2}
    assert asked.update({A: 4, B: 2}, 1) == [""]
    assert asked.crew.threads == 6


def test_one_that_is_left_out_is_named_once_and_asked_again_when_it_comes_back() -> None:
    asked = _Asked()
    asked.says[A] = {**GOOD, "grader": "0.9"}
    assert asked.update({A: 4}, 1) == [f"{A} (node1): it has grader 0.9, here it is 1.0"]
    assert asked.update({A: 4}, 0) == []
    assert asked.crew.fit == {}
    asked.update({}, 0)
    asked.says[A] = GOOD
    assert asked.update({A: 4}, 1) == [""]
    assert asked.crew.fit == {A: 4}
    assert asked.crew.left_out == {}


@pytest.mark.parametrize("lost", [None, OSError("in <closed TCP>: Stream is closed")])
def test_one_that_was_lost_while_it_was_asked_is_asked_again(lost: Answer) -> None:
    asked = _Asked()
    asked.says[A] = lost
    assert asked.update({A: 4}, 1) == [""]
    assert asked.crew.fit == {}
    asked.says[A] = GOOD
    assert asked.update({A: 4}, 1) == [""]
    assert asked.crew.fit == {A: 4}


def test_an_answer_that_comes_after_its_worker_has_gone_counts_for_nothing() -> None:
    asked = _Asked()
    asked.crew.update({A: 4})
    asked.crew.update({})
    assert asked.crew.settle(*asked.heard.get(timeout=10)) == ""
    assert asked.crew.fit == {}
