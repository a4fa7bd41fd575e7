"""What intake remarked reaches the student, at the criterion that it concerns."""

from __future__ import annotations

import pytest

from grader.checks.build import run_hint
from grader.checks.executable import ExecutableParams, executable
from grader.checks.package_files import ManifestParams, manifest
from grader.evidence.reader import package_facts
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Status
from tests.support.timeline import build_runs

NOT_IN_GIT = "src/a.py is executable on this disk but not in git: git update-index --chmod=+x src/a.py"
SPELLED = "the package is spelled Lab1 here, the lab calls it lab1"


def _facts(*, is_executable: bool) -> tuple[PackageFacts, Run]:
    file = {"path": "src/a.py", "executable": is_executable, "shebang": "#!/usr/bin/env python3"}
    run = build_runs(
        {"runs": {"package": {"package": {"name": "lab1", "manifest": {"name": "lab1"}, "files": [file]}}}}
    )["package"]
    return package_facts(run).model_copy(update={"hints": (SPELLED, NOT_IN_GIT)}), run


def test_a_file_that_git_does_not_have_as_executable_says_so() -> None:
    facts, run = _facts(is_executable=False)
    verdict = executable(facts, run, ExecutableParams(path="src/a.py"))
    assert verdict.status is Status.FAIL
    assert verdict.hint == NOT_IN_GIT


def test_the_manifest_carries_what_concerns_the_whole_submission() -> None:
    facts, _ = _facts(is_executable=True)
    verdict = manifest(facts, ManifestParams(name="lab1"))
    assert verdict.status is Status.PASS
    assert verdict.hint == SPELLED


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        ("no ROS 1 on this machine", "apt-get install python3-rospy"),
        ("nothing was run: only the files were asked for", "grade without --static"),
        ("the managed roscore ended", "grade the submission again"),
    ],
)
def test_what_was_not_run_says_how_to_run_it(reason: str, words: str) -> None:
    assert words in run_hint(reason)
