"""`grader check --fix`: shown, asked about, repaired, and checked again."""

from __future__ import annotations

import builtins
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from grader.cli.fixing import is_fixed
from grader.cli.main import run
from grader.model.repair import Repair
from tests.fixture_runs import ROOT

SOLUTION = ROOT / "reference_solutions" / "mcr2-basic-comms" / "basic_comms"
RUBRIC = ROOT / "rubrics" / "mcr2-basic-comms.yaml"
SHARE = "scripts/talker.py is not executable"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A package with a mode, line ends, a topic and a launch file's type to repair, and a call that is missing."""
    package = tmp_path / "basic_comms"
    shutil.copytree(SOLUTION, package)
    talker, listener, launch = (
        package / name for name in ("scripts/talker.py", "scripts/listener.py", "launch/activity1.launch")
    )
    talker.write_text(talker.read_text().replace("rate.sleep()", "rate.sleep"))
    talker.chmod(0o644)
    text = listener.read_text().replace('"chatter"', '"chater"')
    listener.write_bytes(text.replace("\n", "\r\n").encode())
    listener.chmod(0o755)
    launch.write_text(launch.read_text().replace('"talker.py"', '"talker"'))
    return package


def contents(folder: Path) -> dict[str, tuple[int, bytes]]:
    files = (path for path in folder.rglob("*") if path.is_file() and ".git" not in path.parts)
    return {str(path): (path.stat().st_mode, path.read_bytes()) for path in files}


@pytest.fixture
def terminal(monkeypatch):
    """A terminal at which a word is answered."""

    def answering(word: str) -> list[str]:
        asked: list[str] = []
        monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
        monkeypatch.setattr(builtins, "input", lambda words="": asked.append(words) or word)
        return asked

    return answering


def test_a_dry_run_shows_and_changes_nothing(folder, capsys):
    before = contents(folder)
    assert run(["check", str(folder), "--fix", "--dry-run"]) == 1
    shown = capsys.readouterr().out
    assert SHARE in shown
    assert "old mode 100644\nnew mode 100755" in shown
    assert '-    <node name="talker" pkg="basic_comms" type="talker" output="screen"/>' in shown
    assert '+    <node name="talker" pkg="basic_comms" type="talker.py" output="screen"/>' in shown
    assert '-    rospy.Subscriber("chater", String, callback)^M' in shown
    assert '+    rospy.Subscriber("chatter", String, callback)' in shown
    assert "rate.sleep" not in shown
    assert contents(folder) == before


def test_yes_repairs_what_is_no_logic_and_checks_again(folder, capsys):
    assert run(["check", str(folder), "--fix", "--yes", "--static"]) == 0
    shown = capsys.readouterr().out
    assert shown.index("What --fix repairs") < shown.index("40 of 100 points")
    assert (folder / "scripts" / "listener.py").read_text() == (SOLUTION / "scripts/listener.py").read_text()
    assert (folder / "launch" / "activity1.launch").read_text() == (
        SOLUTION / "launch/activity1.launch"
    ).read_text()
    assert (folder / "scripts" / "talker.py").stat().st_mode & 0o111 == 0o111
    assert "rate.sleep\n" in (folder / "scripts" / "talker.py").read_text()
    assert run(["check", str(folder), "--fix", "--dry-run"]) == 0
    assert "There is nothing here that --fix repairs." in capsys.readouterr().out


@pytest.mark.parametrize(("word", "repaired"), [("y", True), ("YES", True), ("", False), ("n", False)])
def test_it_asks_at_a_terminal(word, repaired, folder, terminal, capsys):
    before = contents(folder)
    asked = terminal(word)
    run(["check", str(folder), "--fix", "--static"])
    assert asked == ["Make these 4 changes? [y/N] "]
    assert (contents(folder) != before) is repaired
    assert ("Nothing was changed." in capsys.readouterr().out) is not repaired


def test_without_a_terminal_it_refuses(folder, capsys):
    before = contents(folder)
    assert run(["check", str(folder), "--fix", "--static"]) == 2
    assert "there is no terminal to ask on" in capsys.readouterr().err
    assert contents(folder) == before


@pytest.mark.parametrize("options", [["--yes"], ["--dry-run"], ["--yes", "--static"]])
def test_a_lab_may_forbid_it(options, folder, tmp_path, capsys):
    rubric = tmp_path / "rubric.yaml"
    rubric.write_text(RUBRIC.read_text() + "\nfixes: none\n")
    before = contents(folder)
    assert run(["check", str(folder), "--fix", *options, "--rubric", str(rubric)]) == 2
    assert "This lab asks you to fix mistakes yourself" in capsys.readouterr().err
    assert contents(folder) == before


@pytest.mark.parametrize(
    "options",
    [
        ["--yes"],
        ["--dry-run"],
        ["--fix", "--watch"],
        ["--fix", "--json"],
        ["--fix", "--static", "--staged"],
    ],
)
def test_options_that_do_not_go_together(options, folder, capsys):
    assert run(["check", str(folder), *options]) == 2
    assert "--fix" in capsys.readouterr().err


def test_an_archive_is_no_folder_of_the_student(folder, tmp_path, capsys):
    archive = shutil.make_archive(str(tmp_path / "handed-in"), "zip", folder.parent, folder.name)
    arguments = ["check", archive, "--fix", "--yes", "--rubric", "mcr2-basic-comms"]
    assert run(arguments) == 2
    assert "is not a folder on your disk" in capsys.readouterr().err


def test_a_bit_that_git_lacks_is_told_below_the_report(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder.parent)

    def git(*words: str) -> None:
        user = ("-c", "user.name=a", "-c", "user.email=a@example.org")
        subprocess.run(
            ["/usr/bin/env", "git", *user, *words], cwd=folder.parent, check=True, capture_output=True
        )

    git("init", "-q", ".")
    git("add", ".")
    git("commit", "-qm", "Lab")
    assert (
        run(["check", str(folder), "--fix", "--yes", "--static"]) == 0
    )  # the build may still make programs of them
    assert "git update-index --chmod=+x basic_comms/scripts/talker.py" in capsys.readouterr().out
    assert run(["check", str(folder), "--fix", "--dry-run"]) == 0
    told = "scripts/talker.py is executable on this disk but not in git: git update-index --chmod=+x"
    assert told in capsys.readouterr().out
    git("update-index", "--chmod=+x", "basic_comms/scripts/talker.py")
    git("config", "core.fileMode", "false")
    (folder / "scripts/talker.py").chmod(0o644)
    assert run(["check", str(folder), "--fix", "--yes", "--static"]) == 0
    assert "scripts/talker.py is executable in git but not on this disk" in capsys.readouterr().out
    assert (folder / "scripts/talker.py").stat().st_mode & 0o777 == 0o755


@pytest.mark.parametrize(
    ("kind", "before", "after", "fixed"),
    [
        ("python-syntax", "\tx = 1", "        x = 1", True),
        ("python-syntax", "\tprint 1", "        print(1)", False),
        ("python-syntax", "if x", "if x:", False),
        ("missing-call", "rate.sleep", "rate.sleep()", False),
        ("build-line", "project(a)", "project(b)", False),
        ("topic-name", "'a'", "'b'", True),
    ],
)
def test_logic_is_left_to_the_student(kind, before, after, fixed, tmp_path):
    repair = Repair(kind=kind, file="a.py", line=1, before=before, after=after, message="x", fix="x")
    assert is_fixed(tmp_path, repair) is fixed


def test_an_explanation_says_how_it_is_done_by_hand(capsys):
    assert run(["explain", "mcr2-basic-comms/talker-executable"]) == 0
    shown = capsys.readouterr().out
    assert "Common mistakes, and how to repair them by hand" in shown
    assert shown.index("How to fix") < shown.index("What it checks")
    assert "What a rubric can set" not in shown
    assert "chmod +x FILE" in shown
    assert run(["explain", "manifest"]) == 0
    assert capsys.readouterr().out.count("manifest: The manifest names the package.\n") == 1
