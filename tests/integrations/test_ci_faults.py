"""What a CI system is told where the machine or the grader is at fault."""

from __future__ import annotations

import pytest

from grader.cli.main import run
from grader.errors import SandboxMissing
from tests.integrations.conftest import handed_in
from tests.integrations.runner import heard, outputs_in


@pytest.fixture
def job(tmp_path, monkeypatch):
    """A job of GitHub with a correct package; gives the files of its outputs and its summary."""
    (tmp_path / "work").mkdir()
    handed_in(tmp_path / "work")
    monkeypatch.chdir(tmp_path / "work")
    files = tmp_path / "output", tmp_path / "summary"
    monkeypatch.setenv("GITHUB_OUTPUT", str(files[0]))
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(files[1]))
    monkeypatch.setenv("GRADER_OUT", str(tmp_path / "out"))
    return files


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            SandboxMissing("no sandbox on this machine: bwrap is not installed", hint="install it"),
            "no sandbox on",
        ),
        (RuntimeError("boom\n::error::x"), "internal error: RuntimeError: boom"),
        (OSError(28, "No space left on device"), "the disk is full"),
        (MemoryError(), "the grader ran out of memory"),
    ],
    ids=["sandbox", "internal", "disk", "memory"],
)
def test_no_fault_of_ours_ends_without_a_word(job, monkeypatch, capsys, error, said):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr("grader.pipeline.grade", fail)
    assert run(["ci", "github"]) == 3
    ((_, told, text),) = heard(capsys.readouterr().out)
    assert told["title"] == "Not graded"
    assert text.startswith(said)
    outputs = outputs_in(job[0].read_text())
    assert (outputs["status"], outputs["passed"]) == ("not-graded", "false")
    assert job[1].read_text().startswith("**Not graded:**")


def test_a_file_of_githubs_that_cannot_be_written(job, monkeypatch, capsys):
    monkeypatch.setenv("GITHUB_OUTPUT", "/nowhere/output")
    monkeypatch.setenv("GRADER_STATIC", "true")
    assert run(["ci", "github"]) == 2
    assert "/nowhere/output cannot be written" in capsys.readouterr().err


def test_systems_that_know_neither_outputs_nor_summaries(job, monkeypatch):
    monkeypatch.delenv("GITHUB_OUTPUT")
    monkeypatch.delenv("GITHUB_STEP_SUMMARY")
    monkeypatch.setenv("GRADER_STATIC", "true")
    assert run(["ci", "github"]) == 0


ONLY_RUN = """\
schema: grader.rubric/1
id: only-run
title: Nothing of the files
version: "1"
package: lab1
scenarios:
  talks: {title: The talker, start: [{name: talker, script: scripts/talker.py}], until: {alive_s: 2}}
criteria:
  - {id: node, title: It is a node, points: 100, check: node-lives, scenario: talks, with: {process: talker, min_s: 1}}
"""


def test_a_lab_of_which_the_files_alone_show_nothing(job, tmp_path, monkeypatch, capsys):
    (tmp_path / "only-run.yaml").write_text(ONLY_RUN)
    monkeypatch.setenv("GRADER_LAB", str(tmp_path / "only-run.yaml"))
    monkeypatch.setenv("GRADER_STATIC", "true")
    assert run(["ci", "github"]) == 3
    ((_, told, text),) = heard(capsys.readouterr().out)
    assert told["title"] == "Not graded"
    assert text.startswith("no criterion of this lab can be judged from the files alone, and nothing was run")
