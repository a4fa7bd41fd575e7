"""Every command that runs students' code says once, before it begins, that there is no sandbox."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from grader.arena.sandbox import Sandbox
from grader.cli.main import run
from grader.errors import HostError
from tests.faulty import ROOT

LAB = "leeds-comp3631-lab1"
SOLUTION = str(ROOT / "reference_solutions" / LAB)
SAID = "grader: The grading machine has no sandbox (bwrap is not installed): students' code runs with all the rights of"
GRADE = "grader.pipeline.grade"
COMMANDS = {
    "grade": (["grade", SOLUTION, "--rubric", LAB, "--out", "o"], GRADE),
    "check": (["check", SOLUTION, "--rubric", LAB], GRADE),
    "ci": (["ci", "gitlab"], GRADE),
    "batch": (["batch", "roster.csv", "--rubric", LAB, "--out", "o"], "grader.cli.class_actions.run_batch"),
    "record": (["record", SOLUTION, "--rubric", LAB, "--out", "o"], "grader.pipeline.record"),
    "rubric new": (["rubric", "new", "--from", SOLUTION], "grader.authoring.propose.propose_rubric"),
    "rubric test": (["rubric", "test", LAB], "grader.cli.labs.run_test"),
}


@pytest.fixture
def _begins(tmp_path: Path, monkeypatch) -> None:
    """Nothing is graded: what begins then says so.

    What takes these functions' names at its import is imported before, or it would keep the stand-ins for later tests.
    """
    for module in ("grader.cli.class_actions", "grader.cli.labs", "grader.authoring.propose"):
        importlib.import_module(module)

    def begin(*_args: object, **_more: object) -> None:
        raise HostError("it has begun")

    for _, begun in COMMANDS.values():
        monkeypatch.setattr(begun, begin)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GRADER_PATH", SOLUTION)
    monkeypatch.setenv("GRADER_LAB", LAB)
    (tmp_path / "roster.csv").write_text(f"id,source\nada,{SOLUTION}\n")
    monkeypatch.setattr("grader.cli.host_support.why_nodes_cannot_run", lambda: "")


@pytest.mark.usefixtures("_begins")
@pytest.mark.parametrize("command", COMMANDS)
def test_it_is_said_before_anything_is_run(command: str, monkeypatch, capsys) -> None:
    none = Sandbox(bubblewrap=False, uid=None, reason="bwrap is not installed")
    monkeypatch.setattr("grader.cli.host_support.choose_sandbox", lambda _: none)
    assert run(COMMANDS[command][0]) == 3
    said = capsys.readouterr().err
    assert said.count(SAID) == 1, said
    assert said.index(SAID) < said.index("it has begun")


@pytest.mark.usefixtures("_begins")
@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_is_said_of_a_sandbox_that_is_there(command: str, monkeypatch, capsys) -> None:
    there = Sandbox(bubblewrap=True, uid=None)
    monkeypatch.setattr("grader.cli.host_support.choose_sandbox", lambda _: there)
    assert run(COMMANDS[command][0]) == 3
    assert "students' code" not in capsys.readouterr().err


@pytest.mark.usefixtures("_begins")
def test_nothing_is_said_where_only_files_are_looked_at(capsys) -> None:
    assert run(["check", SOLUTION, "--rubric", LAB, "--static", "--sandbox", "none"]) == 3
    assert "sandbox" not in capsys.readouterr().err


@pytest.mark.ros
@pytest.mark.usefixtures("_begins")
def test_who_asked_for_none_is_told_in_other_words(capsys) -> None:
    assert run(["grade", SOLUTION, "--rubric", LAB, "--out", "o", "--sandbox", "none"]) == 3
    assert "grader: The sandbox is switched off (--sandbox none): students' code" in capsys.readouterr().err
