"""What is not committed or not pushed is told, with the command that fixes it; and nothing else is."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from grader.student.git_status import advise, read_environment
from tests.student.conftest import SCRIPT, Clone, git, write_package


def _texts(found) -> str:
    return "\n".join(point.text for point in found.points)


def test_all_pushed_is_one_line(clone: Clone, tmp_path: Path) -> None:
    found = clone.standing(tmp_path)
    assert found.points == ()
    assert found.summary.startswith("Everything is committed and pushed: origin/main has it")


def test_a_changed_file(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "uncommitted"
    assert point.text == "1 change is not committed: scripts/talker.py"
    assert point.fix == "git add scripts/talker.py && git commit -m Lab"


def test_staged_files_need_a_commit_alone(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "new file.py").write_text(SCRIPT)
    clone.git("add", "-A")
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.fix) == ("uncommitted", "git commit -m Lab")


def test_a_file_that_is_not_in_git(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "it's new.py").write_text(SCRIPT)
    (clone.package / "scripts" / "talker.pyc").write_text("made")
    (clone.package / "scripts" / ".talker.py.swp").write_text("made")
    (clone.package / "build").mkdir()
    (clone.package / "build" / "Makefile").write_text("made")
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "untracked"
    assert point.text == "1 file of the package is not in git: scripts/it's new.py"
    subprocess.run(point.fix.partition(" && ")[0], shell=True, cwd=clone.package, check=True)  # noqa: S602 - as typed
    assert clone.kinds(tmp_path / "again") == ["uncommitted"]


def test_commands_fit_the_folder_that_they_are_typed_in(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    for here in (clone.top, clone.package / "scripts", tmp_path):
        (point,) = clone.standing(tmp_path / here.name, here=here).points
        subprocess.run(point.fix.partition(" && ")[0], shell=True, cwd=here, check=True)  # noqa: S602 - as typed
        assert clone.git("diff", "--cached", "--name-only") == "lab1/scripts/talker.py"
        clone.git("reset", "-q")


def test_a_script_that_gitignore_hides(clone: Clone, tmp_path: Path) -> None:
    (clone.top / ".gitignore").write_text("talk_*.py\nlaunch/\n*.log\n__pycache__/\nbuild/\n.vscode/\n")
    (clone.package / "launch").mkdir()
    (clone.package / "launch" / "lab1.launch").write_text("<launch/>")
    for name in ("scripts/talk_two.py", "run.log", "__pycache__/a.py", "build/b.py", ".vscode/settings.py"):
        (clone.package / name).parent.mkdir(exist_ok=True)
        (clone.package / name).write_text(SCRIPT)
    clone.commit()
    clone.git("push", "-q")
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "ignored"
    assert point.text.endswith(": launch/lab1.launch, scripts/talk_two.py")
    assert point.fix.startswith("git add -f launch/lab1.launch scripts/talk_two.py && ")


def test_a_package_that_is_ignored_as_a_whole(clone: Clone, tmp_path: Path) -> None:
    (clone.top / ".gitignore").write_text("lab2/\n")
    clone.commit()
    clone.git("push", "-q")
    other = write_package(clone.top / "lab2", "lab2")
    (point,) = advise(other, tmp_path / "a", read_environment({}, other)).points
    assert point.kind == "ignored"
    assert "package.xml" in point.text


@pytest.mark.parametrize("heeded", ["true", "false"])
def test_an_executable_bit_that_git_does_not_have(clone: Clone, tmp_path: Path, heeded: str) -> None:
    clone.git("update-index", "--chmod=-x", "lab1/scripts/talker.py")
    clone.git("commit", "-q", "-m", "As from Windows")
    clone.git("push", "-q")
    clone.git("config", "core.fileMode", heeded)
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "mode"
    assert point.text == "git does not know that this is executable: scripts/talker.py"
    assert point.fix == "git update-index --chmod=+x scripts/talker.py && git commit -m Lab"


def test_an_executable_bit_that_is_staged(clone: Clone, tmp_path: Path) -> None:
    clone.git("update-index", "--chmod=-x", "lab1/scripts/talker.py")
    clone.git("commit", "-q", "-m", "As from Windows")
    clone.git("push", "-q")
    clone.git("update-index", "--chmod=+x", "lab1/scripts/talker.py")
    (point,) = clone.standing(tmp_path).points
    assert point.text == "1 change is not committed: scripts/talker.py"
    assert point.fix == "git commit -m Lab"


def test_a_disk_on_which_everything_is_executable_says_nothing_of_bits(clone: Clone, tmp_path: Path) -> None:
    clone.git("update-index", "--chmod=-x", "lab1/scripts/talker.py")
    clone.git("config", "core.fileMode", "false")
    clone.git("commit", "-q", "-m", "On a disk of Windows")
    clone.git("push", "-q")
    for path in clone.package.rglob("*"):
        path.chmod(0o777)
    assert clone.kinds(tmp_path) == []


def test_a_deleted_file_is_still_in_git(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "talker.py").unlink()
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.text) == ("uncommitted", "1 change is not committed: scripts/talker.py")


def test_commits_that_are_not_pushed(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    clone.commit()
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.fix, point.remark) == ("unpushed", "git push", False)
    assert point.text == "1 commit is not pushed to origin/main; origin/main differs in scripts/talker.py"


def test_commits_that_do_not_concern_the_package_do_not_matter(clone: Clone, tmp_path: Path) -> None:
    (clone.top / "README.md").write_text("hello")
    clone.commit()
    assert clone.kinds(tmp_path) == []


def test_what_the_server_has_and_this_clone_has_not(clone: Clone, tmp_path: Path) -> None:
    other = tmp_path / "partner"
    git(tmp_path, "clone", "-q", str(clone.server), str(other))
    (other / "lab1" / "scripts" / "talker.py").write_text(SCRIPT + "# theirs\n")
    git(other, "commit", "-q", "-a", "-m", "Theirs")
    git(other, "push", "-q")
    assert clone.kinds(tmp_path / "before") == []  # nobody asks the network
    clone.git("fetch", "-q")
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.text, point.fix) == (
        "unpushed",
        "origin/main has 1 commit that is not here",
        "git pull",
    )


def test_a_branch_that_was_never_pushed(clone: Clone, tmp_path: Path) -> None:
    clone.git("checkout", "-q", "-b", "feature")
    assert clone.kinds(tmp_path / "same") == []  # all of its commits are on the server
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    clone.commit()
    assert clone.kinds(tmp_path) == ["other-branch"]
    clone.git("remote", "set-head", "-d", "origin")
    clone.git("update-ref", "-d", "refs/remotes/origin/main")
    clone.git("update-ref", "refs/remotes/origin/other", "main")
    clone.git("update-ref", "refs/remotes/origin/third", "main")
    (point,) = clone.standing(tmp_path / "unknown").points
    assert (point.kind, point.text) == ("unpushed", "The branch feature was never pushed.")
    assert point.fix == "git push -u origin feature"


def test_both_sides_have_commits(clone: Clone, tmp_path: Path) -> None:
    script = clone.package / "scripts" / "talker.py"
    script.write_text(SCRIPT + "# theirs\n")
    clone.commit()
    clone.git("push", "-q")
    clone.git("reset", "-q", "--hard", "HEAD~")
    script.write_text(SCRIPT + "# mine\n")
    clone.commit()
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.fix) == ("unpushed", "git pull && git push")


def test_a_branch_that_is_not_the_one_that_is_marked(clone: Clone, tmp_path: Path) -> None:
    clone.git("checkout", "-q", "-b", "feature")
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    clone.commit()
    clone.git("push", "-q", "-u", "origin", "feature")
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "other-branch"
    assert point.text == (
        "You are on the branch feature; what is marked is usually main; origin/main differs in scripts/talker.py"
    )
    assert point.fix == "git switch main && git merge feature && git push"


def test_no_branch_is_checked_out(clone: Clone, tmp_path: Path) -> None:
    clone.git("checkout", "-q", "--detach")
    assert clone.kinds(tmp_path / "same") == []
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    clone.commit()
    (point,) = clone.standing(tmp_path / "lost").points
    assert (point.kind, point.fix) == ("other-branch", "git switch -c BRANCH")
    assert clone.kinds(tmp_path / "ci", GITHUB_ACTIONS="true") == []


def test_an_older_commit_is_checked_out(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    clone.commit()
    clone.git("push", "-q")
    clone.git("checkout", "-q", "HEAD~")
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "other-branch"
    assert "origin/main differs in scripts/talker.py" in point.text
    assert point.fix == "git switch main"


def test_no_commit_yet(tmp_path: Path, clone: Clone) -> None:
    top = tmp_path / "fresh"
    package = write_package(top)
    git(top, "init", "-q", "-b", "main")
    found = advise(package, tmp_path / "a", read_environment({}, package))
    assert [p.kind for p in found.points] == ["untracked", "unpushed"]
    assert found.points[0].text.startswith("3 files of the package are not in git: CMakeLists.txt, ")


def test_no_repository_at_all(tmp_path: Path) -> None:
    package = write_package(tmp_path / "lab1")
    (point,) = advise(package, tmp_path / "a", read_environment({}, package)).points
    assert (point.kind, point.remark) == ("no-repository", True)
    assert advise(package, tmp_path / "b", read_environment({"CI": "1"}, package)).points == ()


def test_a_shallow_clone_is_as_good(clone: Clone, tmp_path: Path) -> None:
    (clone.top / "README.md").write_text("hello")
    clone.commit()
    clone.git("push", "-q")
    top = tmp_path / "shallow"
    git(tmp_path, "clone", "-q", "--depth=1", clone.server.as_uri(), str(top))
    found = advise(top / "lab1", tmp_path / "a", read_environment({}, top))
    assert found.points == ()
    assert "origin/main has it" in found.summary


def test_a_shallow_clone_of_a_ci_system_is_not_nagged(clone: Clone, tmp_path: Path) -> None:
    top = tmp_path / "ci"
    git(tmp_path, "init", "-q", str(top))
    git(top, "fetch", "-q", "--depth=1", clone.server.as_uri(), "main")
    git(top, "checkout", "-q", "--detach", "FETCH_HEAD")
    found = advise(top / "lab1", tmp_path / "a", read_environment({"GITHUB_ACTIONS": "true"}, top))
    assert (found.points, found.summary) == ((), "")


def test_a_package_in_a_submodule(clone: Clone, tmp_path: Path) -> None:
    outer = tmp_path / "outer"
    git(tmp_path, "init", "-q", "-b", "main", str(outer))
    git(outer, "submodule", "--quiet", "add", clone.server.as_uri(), "mine")
    package = outer / "mine" / "lab1"
    assert advise(package, tmp_path / "a", read_environment({}, package)).points == ()


def test_a_repository_inside_of_the_one_that_is_handed_in(clone: Clone, tmp_path: Path) -> None:
    inner = write_package(clone.top / "lab2", "lab2")
    git(inner, "init", "-q", "-b", "main")
    git(inner, "add", "-A")
    git(inner, "commit", "-q", "-m", "Mine")
    (point,) = advise(inner, tmp_path / "a", read_environment({}, inner)).points
    assert (point.kind, point.text) == ("unpushed", "The repository has no server to push to (no remote).")


def test_in_the_middle_of_a_merge(clone: Clone, tmp_path: Path) -> None:
    script = clone.package / "scripts" / "talker.py"
    clone.git("checkout", "-q", "-b", "two")
    script.write_text(SCRIPT + "# two\n")
    clone.commit()
    clone.git("checkout", "-q", "main")
    script.write_text(SCRIPT + "# one\n")
    clone.commit()
    with pytest.raises(subprocess.CalledProcessError):
        clone.git("merge", "two")
    uncommitted, unpushed = clone.standing(tmp_path).points
    assert (uncommitted.kind, uncommitted.fix) == ("uncommitted", "git status")
    assert unpushed.kind == "unpushed"


def test_a_further_worktree_is_a_repository_as_any(clone: Clone, tmp_path: Path) -> None:
    clone.git("worktree", "add", "-q", "-b", "side", str(clone.top / "side"))
    package = clone.top / "side" / "lab1"
    (package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    found = advise(package, tmp_path / "a", read_environment({}, package))
    assert [p.kind for p in found.points] == ["uncommitted"]


def test_another_case_than_git_has(clone: Clone, tmp_path: Path) -> None:
    clone.git("config", "core.ignoreCase", "true")
    (clone.package / "scripts").rename(clone.package / "Scripts")
    (point,) = clone.standing(tmp_path).points
    assert point.fix == "git mv -f scripts/talker.py Scripts/talker.py && git commit -m Lab"
    assert "git calls it scripts/talker.py, this disk Scripts/talker.py" in point.text


def test_what_git_was_told_not_to_look_at(clone: Clone, tmp_path: Path) -> None:
    clone.git("update-index", "--assume-unchanged", "lab1/scripts/talker.py")
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.remark) == ("unknown", True)
    assert "git was told not to look at scripts/talker.py" in point.text


def test_line_ends_that_git_turns_are_no_change(clone: Clone, tmp_path: Path) -> None:
    clone.git("config", "core.autocrlf", "true")
    shutil.rmtree(clone.package)
    clone.git("checkout", "-q", "--", "lab1")
    script = clone.package / "scripts" / "talker.py"
    assert script.read_bytes().endswith(b"\r\n")
    os.utime(script, (1, 1))
    assert clone.kinds(tmp_path) == []


def test_before_a_commit_what_is_staged_is_on_its_way(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "scripts" / "talker.py").write_text(SCRIPT + "# more\n")
    clone.git("add", "-A")
    (clone.package / "forgotten.py").write_text(SCRIPT)
    assert clone.kinds(tmp_path, PRE_COMMIT="1") == ["untracked"]


def test_git_that_is_missing(clone: Clone, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    (point,) = clone.standing(tmp_path).points
    assert (point.kind, point.remark) == ("unknown", True)
    assert "git is not installed here" in point.text


def test_no_time(clone: Clone, tmp_path: Path) -> None:
    found = advise(clone.package, tmp_path / "a", read_environment({}, tmp_path), seconds=0.0)
    assert "git took longer than 0 seconds" in found.points[0].text


def test_a_repository_that_cannot_be_read(clone: Clone, tmp_path: Path) -> None:
    (clone.top / ".git" / "index").write_bytes(b"nothing of the kind")
    (point,) = clone.standing(tmp_path).points
    assert point.kind == "unknown"


def test_nothing_of_a_repository_is_run(clone: Clone, tmp_path: Path) -> None:
    spoor = tmp_path / "ran"
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\ntouch {spoor}\nexec cat\n")
    program.chmod(0o755)
    for key in (
        *(
            "core.fsmonitor",
            "core.sshCommand",
            "core.pager",
            "core.editor",
            "diff.external",
            "filter.x.clean",
        ),
        *("filter.x.smudge", "filter.x.process", "diff.x.textconv", "diff.x.command", "credential.helper"),
        *("gpg.program", "remote.origin.uploadpack", "remote.origin.receivepack", "core.gitProxy"),
    ):
        clone.git("config", key, str(program))
    for alias in ("status", "ls-files", "rev-list", "diff-tree", "for-each-ref", "config"):
        clone.git("config", f"alias.{alias}", f"!{program}")
    hooks = clone.top / ".git" / "hooks"
    hooks.mkdir(exist_ok=True)
    for name in ("fsmonitor-watchman", "post-index-change", "reference-transaction"):
        shutil.copy(program, hooks / name)
    (clone.top / ".gitattributes").write_text("* filter=x diff=x\n")
    script = clone.package / "scripts" / "talker.py"
    script.write_text(SCRIPT + "# more\n")
    before = (clone.top / ".git" / "index").read_bytes()
    assert "uncommitted" in clone.kinds(tmp_path)
    assert not spoor.exists()
    assert (clone.top / ".git" / "index").read_bytes() == before


def test_settings_that_include_others_are_not_followed(clone: Clone, tmp_path: Path) -> None:
    (tmp_path / "included").write_text("[core]\n\tautocrlf = true\n[include]\n\tpath = included\n")
    clone.git("config", "include.path", str(tmp_path / "included"))
    assert clone.kinds(tmp_path) == []


def test_hostile_names_steer_nothing(clone: Clone, tmp_path: Path) -> None:
    (clone.package / "a\x1b[31m\n::error::b.py").write_text(SCRIPT)
    (clone.package / os.fsdecode(b"\xe9.py")).write_text(SCRIPT)
    found = clone.standing(tmp_path)
    assert found.points[0].kind == "untracked"
    assert found.points[0].text.isprintable()
    assert "".join(p.fix for p in found.points).isprintable()
