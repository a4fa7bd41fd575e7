"""The hook, by the real pre-commit: what is staged decides, and only what fails keeps a commit from being made."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.student.conftest import git

ROOT = Path(__file__).resolve().parents[2]
SOLUTIONS = ROOT / "reference_solutions"
HOOKS = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
pytest.importorskip("pre_commit", reason="pre-commit comes with the extra dev")


def _hook(identity: str, **changes: object) -> dict[str, object]:
    """A hook of this repository that runs in this environment: installing it anew takes a minute."""
    (hook,) = (dict(hook) for hook in HOOKS if hook["id"] == identity)
    hook.pop("minimum_pre_commit_version")
    program, rest = str(hook["entry"]).split(" ", 1)
    assert program == "grader"
    return {**hook, "language": "system", "entry": f"'{sys.executable}' -m grader {rest}", **changes}


@pytest.fixture
def student(tmp_path: Path, monkeypatch) -> Path:
    """A repository with two labs' packages and the hook, nothing committed yet."""
    monkeypatch.setenv("PRE_COMMIT_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    top = tmp_path / "student"
    shutil.copytree(SOLUTIONS / "leeds-comp3631-lab1", top)
    shutil.copytree(SOLUTIONS / "mcr2-basic-comms", top, dirs_exist_ok=True)
    _configure(top, _hook("grader-check"))
    git(top, "init", "-q", "-b", "main")
    subprocess.run([sys.executable, "-m", "pre_commit", "install"], cwd=top, check=True, capture_output=True)
    git(top, "add", "-A")
    return top


def _configure(top: Path, *hooks: dict[str, object]) -> None:
    config = {"repos": [{"repo": "local", "hooks": list(hooks)}]}
    (top / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")


def _commit(top: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """A commit as a student makes it, with the variables that git gives to its hooks."""
    variables = os.environ.items()
    environment = {k: v for k, v in variables if not k.startswith("GIT_") and k != "CI"}
    command = ["git", "-c", "user.name=Ada", "-c", "user.email=ada@x.org", "commit", "-m", "Work", *options]
    return subprocess.run(command, cwd=top, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.full
def test_correct_packages_are_committed(student: Path) -> None:
    done = _commit(student)
    assert done.returncode == 0, done.stderr
    assert git(student, "log", "--format=%s") == "Work"


@pytest.mark.full
def test_a_failing_criterion_of_any_package_keeps_the_commit_back(student: Path) -> None:
    assert _commit(student).returncode == 0
    manifest = student / "basic_comms" / "package.xml"
    manifest.write_text(manifest.read_text().replace("<name>basic_comms</name>", "<name>basic_com</name>"))
    git(student, "add", "-A")
    done = _commit(student)
    assert done.returncode == 1
    assert "- exit code: 1" in done.stderr
    assert "manifest" in done.stderr


@pytest.mark.full
def test_what_is_staged_decides_and_not_the_disk(student: Path) -> None:
    assert _commit(student).returncode == 0
    script = student / "lab1" / "src" / "numeric_talker.py"
    git(student, "rm", "-q", "--cached", "lab1/src/numeric_talker.py")
    done = _commit(student)
    assert (done.returncode, script.exists()) == (1, True)
    assert "src/numeric_talker.py is not in the package" in done.stderr
    assert "1 file of the package is not in git: src/numeric_talker.py" in done.stderr
    git(student, "add", "-A")
    script.chmod(0o644)
    assert _commit(student, "--allow-empty").returncode == 0
    done = _commit(student, "--all")
    assert (done.returncode, "is not executable" in done.stderr) == (1, True)


@pytest.mark.full
def test_a_package_that_nobody_staged(student: Path) -> None:
    git(student, "rm", "-r", "-q", "--cached", "lab1")
    done = _commit(student)
    assert done.returncode == 1
    assert "git has nothing of the package in lab1" in done.stderr


@pytest.mark.full
def test_a_rubric_without_static_criteria_keeps_nothing_back(student: Path) -> None:
    rubric = yaml.safe_load((ROOT / "rubrics" / "leeds-comp3631-lab1.yaml").read_text(encoding="utf-8"))
    rubric["criteria"] = [
        {k: v for k, v in c.items() if k not in ("requires", "hint", "blocked_by")}
        for c in rubric["criteria"]
        if c["id"] in ("chatter-rate", "numeric-type")
    ]
    for criterion in rubric["criteria"]:
        criterion["points"] = 50
    rubric.pop("pass_mark", None)
    used = {c.get("scenario") for c in rubric["criteria"]}
    rubric["scenarios"] = {n: s for n, s in rubric["scenarios"].items() if n in used}
    (student / "course.yaml").write_text(yaml.safe_dump(rubric, sort_keys=False), encoding="utf-8")
    _configure(student, _hook("grader-check", args=["--rubric", "course.yaml"]))
    git(student, "add", "-A")
    done = _commit(student)
    assert done.returncode == 0, done.stderr + done.stdout


@pytest.mark.full
def test_rubrics_are_validated(student: Path) -> None:
    _configure(student, _hook("grader-rubric-validate"))
    (student / "rubrics").mkdir()
    (student / "rubrics" / "week2.yaml").write_text("schema: grader.rubric/1\n")
    git(student, "add", "-A")
    done = _commit(student)
    assert done.returncode == 1
    assert "rubrics/week2.yaml" in done.stderr


def test_pre_commit_knows_the_manifest() -> None:
    command = [sys.executable, "-m", "pre_commit", "validate-manifest", ".pre-commit-hooks.yaml"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert all(hook["language"] == "python" for hook in HOOKS)


@pytest.mark.full
@pytest.mark.slow
def test_pre_commit_installs_it_from_a_repository(student: Path, tmp_path: Path) -> None:
    """As a student gets it: this repository, installed into an environment of the hook's own."""
    source = tmp_path / "source"
    left_out = (":!tests", ":!fixtures", ":!benchmarks", ":!docs/images")
    names = filter(None, git(ROOT, "ls-files", "-z", "--", ".", *left_out).split("\0"))
    for name in names:
        if (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, source / name)
    git(source, "init", "-q", "-b", "main")
    git(source, "add", "-A", "-f")
    git(source, "commit", "-q", "-m", "Grader")
    revision = git(source, "rev-parse", "HEAD")
    config = {"repos": [{"repo": source.as_uri(), "rev": revision, "hooks": [{"id": "grader-check"}]}]}
    (student / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    git(student, "add", "-A")
    (student / "lab1" / "src" / "numeric_talker.py").chmod(0o644)
    git(student, "add", "-A")
    done = _commit(student)
    assert done.returncode == 1
    assert "src/numeric_talker.py is not executable" in done.stderr, done.stderr
