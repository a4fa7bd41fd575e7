"""What `.gitignore` files keep out of git, and the hint on a file that is missing because of one."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.checks.support.scripts import add_hint
from grader.model.git_ignores import IgnoreLine, hiding_line
from grader.package.facts import read_package
from tests.package.trees import CMAKE, MANIFEST, make_package

LAUNCH = "launch/lab1.launch"


@pytest.mark.parametrize(
    ("pattern", "file", "below", "hidden"),
    [
        ("*.launch", "../.gitignore", "lab1", True),
        ("launch/", "../../.gitignore", "src/lab1", True),
        ("launch", ".gitignore", "", True),
        ("/launch", ".gitignore", "", True),
        ("/launch", "../.gitignore", "lab1", False),
        ("lab1/launch/*", "../.gitignore", "lab1", True),
        ("**/launch/", ".gitignore", "", True),
        ("lab1.launch/", ".gitignore", "", False),
        ("*", "launch/.gitignore", "launch", True),
        ("*", "scripts/.gitignore", "scripts", False),
        ("*.py", ".gitignore", "", False),
    ],
)
def test_a_pattern_hides_what_it_hides_for_git(pattern: str, file: str, below: str, *, hidden: bool) -> None:
    line = IgnoreLine(file=file, line=1, pattern=pattern, below=below)
    assert (hiding_line([line], LAUNCH) is line) is hidden
    back = IgnoreLine(file=".gitignore", line=2, pattern="!*.launch")
    assert hiding_line([line, back], LAUNCH) is None


def test_a_missing_file_that_git_ignores_is_told_with_the_line(tmp_path: Path) -> None:
    (tmp_path / ".gitignore").write_text("build/\n# mine\n*.launch\n")
    files = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, ".gitignore": "scripts\n"}
    source = make_package(tmp_path / "lab1", files, path="lab1")
    facts = read_package(source)
    assert add_hint(facts, LAUNCH) == (
        "line 3 of ../.gitignore, `*.launch`, keeps launch/lab1.launch out of git: "
        "git add -f launch/lab1.launch, then commit and push it"
    )
    assert "line 1 of .gitignore, `scripts`," in add_hint(facts, "scripts/talker.py")
    assert add_hint(facts, "src/talker.py") == "write src/talker.py, then git add, commit and push it"
    assert not read_package(source.model_copy(update={"mode_source": "archive"})).git_ignores
