"""The guides of CONTRIBUTING.md: what each tells the reader to write is written into a clone, and CI accepts it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from scripts.pages import ROOT
from tests.docs.console import TITLE, fences

AT_ITS_END = ", at its end"
GIT = shutil.which("git") or "git"
STYLE = (("check", "--no-cache"), ("format", "--no-cache", "--check"))
LIKE, LIKE_PACKAGE = "york-ele00118m-lab7", "lab_exercises"
LAB, PACKAGE = "a-lab1", "our_first_node"
INHERITED = re.compile(
    r"(PATH|HOME|PIP_\w+|UV_\w+|SSL_\w+|REQUESTS_\w+|https?_proxy|no_proxy)$", re.IGNORECASE
)
"""What a machine has to say about where programs and packages come from."""
LAB_FILES = re.compile(r"^\| `([^`]+)` \| .* \|$", re.MULTILINE)


def _section(title: str) -> str:
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return page.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def _follow(title: str, clone: Path) -> None:
    """Write the files of a section, lengthen those that it adds to, and apply its diffs."""
    for info, content in fences(_section(title)):
        named = TITLE.search(info)
        if info.startswith("diff "):
            subprocess.run([GIT, "apply", "-"], cwd=clone, input=content, text=True, check=True)
        elif named and named[1].endswith(AT_ITS_END):
            path = clone / named[1].removesuffix(AT_ITS_END)
            between = "\n\n" if path.suffix == ".py" else ""
            path.write_text(path.read_text(encoding="utf-8") + between + content, encoding="utf-8")
        elif named:
            (clone / named[1]).write_text(content, encoding="utf-8")


def _write_check(clone: Path) -> None:
    _follow("A new check", clone)


def _write_form(clone: Path) -> None:
    _follow("A new report form", clone)


def _write_lab(clone: Path) -> None:
    """Another lab under a new id, with a package of another name."""

    def renamed(text: str) -> str:
        return text.replace(LIKE, LAB).replace(LIKE_PACKAGE, PACKAGE)

    solutions = clone / "reference_solutions"
    tracked = [solutions / LIKE, *(clone / kind / f"{LIKE}.yaml" for kind in ("rubrics", "fixtures"))]
    for path in (file for one in tracked for file in (one.rglob("*") if one.is_dir() else [one])):
        target = clone / renamed(path.relative_to(clone).as_posix())
        if path.is_file():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(renamed(path.read_text(encoding="utf-8")), encoding="utf-8")
            shutil.copymode(path, target)
    readme = (clone / "README.md").read_text(encoding="utf-8")
    row = next(line for line in readme.splitlines() if line.startswith(f"| `{LIKE}` |"))
    (clone / "README.md").write_text(readme.replace(row, f"{row}\n{renamed(row)}"), encoding="utf-8")


GUIDES: dict[str, Callable[[Path], None]] = {"check": _write_check, "form": _write_form, "lab": _write_lab}
QUICK = {
    "check": [
        "tests/checks/test_timelines.py",
        "tests/docs/test_reference.py",
        "tests/test_fixtures.py",
        *("-k", "message or status-in-the-loop or docs_are or shorter_round or enough or place_in_a_rubric"),
    ],
    "form": ["tests/report/test_golden.py", "tests/docs/test_reference.py"],
    "lab": ["tests/test_fixtures.py", "tests/docs/test_reference.py", "-k", f"{LAB} or reference"],
}
"""Of each guide the tests that look at what it adds."""


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return the clone in which a guide was followed, but for what a command writes."""

    @cache
    def clone_of(guide: str) -> Path:
        clone = tmp_path_factory.mktemp("contributing") / guide
        subprocess.run([GIT, "clone", "-q", ROOT, clone], check=True)
        GUIDES[guide](clone)
        return clone

    return clone_of


@pytest.fixture(scope="module")
def clones(followed: Callable[[str], Path]) -> Callable[[str], Path]:
    """Return the clone in which a guide was followed, up to its `make reference`."""

    @cache
    def clone_of(guide: str) -> Path:
        clone = followed(guide)
        if guide == "form":
            _run(clone, "-m", "pytest", "-q", "tests/report/test_golden.py", GRADER_REGENERATE="1")
        _run(clone, "-m", "scripts.reference")
        return clone

    return clone_of


def _run(clone: Path, *words: str, limit_s: int = 250, **environment: str) -> str:
    """Return what Python prints in the clone. Raises AssertionError where it does not end with 0."""
    own = {"PYTHONPATH": str(clone), "PYTEST_ADDOPTS": "-p no:cacheprovider"}
    inherited = {name: value for name, value in os.environ.items() if INHERITED.match(name)}
    done = subprocess.run(
        [sys.executable, *words],
        cwd=clone,
        env={**inherited, **own, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=limit_s,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def _ruff(clone: Path, *paths: str) -> list[str]:
    """Return what ruff prints as it checks these paths, and as it looks whether they are formatted."""
    return [_run(clone, "-m", "ruff", *words, *paths) for words in STYLE]


def _changed(clone: Path) -> set[str]:
    """Return every file that differs from the commit or is new."""
    command = [GIT, "ls-files", "--modified", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=clone, capture_output=True, text=True, check=True).stdout
    return set(listed.splitlines())


each_guide = pytest.mark.parametrize("guide", GUIDES)


@pytest.mark.full
@each_guide
def test_the_tests_of_what_it_adds_accept_it(guide: str, clones: Callable[[str], Path]) -> None:
    said = _run(clones(guide), "-m", "pytest", "-q", "-m", "not ros and not full", *QUICK[guide])
    passed = re.search(r"(\d+) passed", said)
    assert passed, said
    assert int(passed[1]) >= 7


@each_guide
def test_its_code_is_in_shape(guide: str, followed: Callable[[str], Path]) -> None:
    """And its diffs apply to the files as they are."""
    clone = followed(guide)
    changed = _changed(clone)
    assert changed
    if python := sorted(name for name in changed if name.startswith("grader/")):
        checked, formatted = _ruff(clone, *python)
        assert checked == "All checks passed!\n"
        assert re.fullmatch(r"\d+ files? already formatted\n", formatted)


@pytest.mark.full
def test_a_form_is_a_file_an_entry_a_row_and_a_golden_file(clones: Callable[[str], Path]) -> None:
    assert _changed(clones("form")) == {
        "grader/report/tap.py",
        "grader/report/forms.py",
        "docs/how-to/reports.md",
        "docs/reference/commands.md",
        "tests/report/golden/report.tap",
    }


@pytest.mark.full
def test_a_lab_is_the_files_of_the_table(clones: Callable[[str], Path]) -> None:
    listed = {name.replace("<lab>", LAB) for name in LAB_FILES.findall(_section("A new lab"))}
    changed = _changed(clones("lab"))
    assert {name for name in changed if not name.startswith(tuple(listed))} == set()
    assert {name for name in listed if not any(one.startswith(name) for one in changed)} == set()


@pytest.mark.full
def test_the_rubric_is_valid_and_the_check_explains_itself(clones: Callable[[str], Path]) -> None:
    clone = clones("check")
    _run(clone, "-m", "grader", "rubric", "validate", "rubrics/examples/turtle-square.yaml")
    assert "carries no more messages" in _run(clone, "-m", "grader", "explain", "message-count")
    assert "## message-count" in (clone / "docs" / "reference" / "checks.md").read_text(encoding="utf-8")


@pytest.mark.full
@pytest.mark.timeout(1800)
@each_guide
def test_everything_that_needs_no_ros_accepts_it(guide: str, clones: Callable[[str], Path]) -> None:
    clone = clones(guide)
    assert _ruff(clone, ".", "fixtures/make.py")[0] == "All checks passed!\n"
    assert "no issues found" in _run(clone, "-m", "mypy", f"--cache-dir={os.devnull}", limit_s=600)
    own = f"--ignore={Path(__file__).relative_to(ROOT)}"
    said = _run(clone, "-m", "pytest", "-q", "-n", "2", "-m", "not ros and not full", own, limit_s=1700)
    passed = re.search(r"(\d+) passed", said)
    assert passed, said
    assert int(passed[1]) > 2000
