"""What the child that reads hostile data may take, and what it is given."""

from __future__ import annotations

import json
import os
import signal

import pytest

from grader import limited_child
from grader.limited_child import Answer, ChildLimits, run_limited

LIMITS = ChildLimits(memory_bytes=256 << 20, cpu_s=1, wall_s=30.0, file_bytes=1 << 20)


def ask(name: str, *arguments: object, limits: ChildLimits = LIMITS) -> Answer:
    return run_limited(f"tests.limited_child:{name}", *arguments, limits=limits)


def test_values_come_back_as_they_are() -> None:
    values = ["a\udce9", None, {"b": [1.5, True]}]
    answer = ask("repeat", *values)
    assert [json.loads(line) for line in answer.lines.splitlines()] == values
    assert (answer.done, answer.timed_out) == (True, False)


@pytest.mark.full
@pytest.mark.parametrize("what", ["take_memory", "take_processor_time", "write_much", "crash"])
def test_what_goes_beyond_a_limit_ends_and_what_came_before_counts(what, tmp_path) -> None:
    arguments = (str(tmp_path / "file"),) if what == "write_much" else ()
    assert ask(what, *arguments) == Answer(lines=b"1\n", done=False)


@pytest.mark.full
def test_what_takes_too_long_is_ended() -> None:
    found = ask("take_time", limits=LIMITS._replace(wall_s=3.0))
    assert found == Answer(lines=b"1\n", done=False, timed_out=True)


def test_an_answer_without_end_is_cut() -> None:
    assert len(ask("say_much", limits=LIMITS._replace(answer_bytes=1000)).lines) == 1000


def test_nothing_is_inherited_but_what_loading_takes(monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/tmp")
    monkeypatch.setenv("GRADER_GIT_TOKEN", "secret")
    names, folder, packages = (json.loads(line) for line in ask("look_around").lines.splitlines())
    assert not {"PYTHONPATH", "GRADER_GIT_TOKEN", "HOME"} & set(names)
    assert (folder, packages) == (os.sep, [])


@pytest.mark.skipif(not limited_child.CAN_COPY, reason="Linux only")
def test_children_after_the_first_are_copies_of_one_template_and_leave_nothing_to_each_other() -> None:
    _, first, second = (json.loads(ask("remember").lines) for _ in range(3))
    assert first["parent"] == second["parent"] != os.getpid()
    assert first["own"] != second["own"]
    assert first["remembered"] == second["remembered"] == 1


@pytest.mark.skipif(not limited_child.CAN_COPY, reason="Linux only")
def test_a_template_that_was_killed_costs_no_answer() -> None:
    _, before = (json.loads(ask("remember").lines) for _ in range(2))
    os.kill(before["parent"], signal.SIGKILL)
    assert [ask("repeat", 1).lines, ask("repeat", 2).lines] == [b"1\n", b"2\n"]
    assert json.loads(ask("remember").lines)["parent"] not in {before["parent"], os.getpid()}


def test_without_templates_each_child_is_a_process_of_its_own(monkeypatch) -> None:
    monkeypatch.setattr(limited_child, "CAN_COPY", False)
    assert json.loads(ask("remember").lines)["parent"] == os.getpid()
