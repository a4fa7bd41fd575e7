"""What `.gitignore` files keep out of git, and the hint on a file that is missing because of one."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from grader.checks.support.scripts import add_hint
from grader.model.git_ignores import IgnoreLine, hiding_line
from grader.package.facts import read_package
from tests.package.trees import CMAKE, MANIFEST, make_package

LAUNCH = "launch/lab1.launch"


@pytest.mark.parametrize(
    ("pattern", "file", "below", "hides"),
    [
        ("*.launch", "../.gitignore", "lab1", "file"),
        ("launch/", "../../.gitignore", "src/lab1", "folder"),
        ("launch", ".gitignore", "", "folder"),
        ("/launch", ".gitignore", "", "folder"),
        ("/launch", "../.gitignore", "lab1", ""),
        ("lab1/launch/*", "../.gitignore", "lab1", "file"),
        ("lab1/", "../.gitignore", "lab1", "folder"),
        ("**/launch/", ".gitignore", "", "folder"),
        ("**/launch/*", "../.gitignore", "lab1", "file"),
        ("lab1/**/lab1.launch", "../.gitignore", "lab1", "file"),
        ("launch/**/lab1.launch", ".gitignore", "", "file"),
        ("launch/**", ".gitignore", "", "file"),
        ("lab1/**", "../.gitignore", "lab1", "folder"),
        ("**", ".gitignore", "", "folder"),
        ("lab1.launch/", ".gitignore", "", ""),
        ("*", "launch/.gitignore", "launch", "file"),
        ("*", "scripts/.gitignore", "scripts", ""),
        ("*.py", ".gitignore", "", ""),
        ("/*.launch", ".gitignore", "", ""),
        ("lab1/*.launch", "../.gitignore", "lab1", ""),
        ("launch/?ab[0-9].launch", ".gitignore", "", "file"),
        ("launch?lab1.launch", ".gitignore", "", ""),
        ("lab[^1].launch", ".gitignore", "", ""),
        ("lab[^2].launch", ".gitignore", "", "file"),
        (r"\*.launch", ".gitignore", "", ""),
        (r"lab\1.launch", ".gitignore", "", "file"),
        ("**/" * 30 + "x", ".gitignore", "", ""),
        ("*" + "l*" * 45 + "x", ".gitignore", "", ""),
    ],
)
def test_a_pattern_hides_what_it_hides_for_git(
    pattern: str, file: str, below: str, hides: str, tmp_path: Path
) -> None:
    line = IgnoreLine(file=file, line=1, pattern=pattern, below=below)
    assert (hiding_line([line], LAUNCH) is line) is bool(hides)
    # what is in a folder that is ignored does not come back
    back = IgnoreLine(file=".gitignore", line=2, pattern="!*.launch")
    assert (hiding_line([line, back], LAUNCH) is line) is (hides == "folder")
    package = tmp_path / (below if file.startswith("../") else "")
    (package / "launch").mkdir(parents=True)
    (package / "scripts").mkdir()
    run_git("init", "-q", folder=tmp_path)
    (package / file).write_text(f"{pattern}\n")
    assert bool(run_git("check-ignore", LAUNCH, folder=package)) is bool(hides)
    with (package / ".gitignore").open("a") as own:
        own.write("!*.launch\n")
    if not file.startswith("launch/"):  # there, the line in it comes later
        assert bool(run_git("check-ignore", LAUNCH, folder=package)) is (hides == "folder")


def run_git(*arguments: str, folder: Path) -> str:
    command = ["git", *arguments]  # the machine's git
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False).stdout


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
