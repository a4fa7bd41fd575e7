"""A lost mark says which of its files are still as the course handed them out."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from grader.checks import CHECKS
from grader.integrations.bundle import Bundle, add_lab
from grader.judging import judge
from grader.judging.early import judge_files
from grader.package import read_package
from grader.rubric.load import load_rubric, read_beside_rubric
from tests.judging.rubrics import ALL, EXECUTABLE, GOOD_RUN, SCRIPT, rubric
from tests.package.trees import CMAKE, MANIFEST, NODE, make_package
from tests.rubric.samples import faults, spoiled
from tests.support.timeline import build_runs

TALKER = "src/numeric_talker.py"
HANDED_OUT = "a" * 64
SAID = f"; {TALKER} is still as the course handed it out"
DIED = {"processes": [{"name": "talker", "exit_s": 0.3, "exit_code": 1}], "outcome": "ended"}


def told(
    digest: str, run: dict[str, Any] = GOOD_RUN, *, executable: bool = True
) -> dict[str, tuple[str, bool]]:
    """Each criterion's status, and whether its message ends with what is said of the script of this content."""
    files = [{**SCRIPT, "sha256": digest, "executable": executable}]
    runs = build_runs({"runs": {"talker": run}, "package": {"files": files}})
    results = judge(rubric(*ALL), runs, CHECKS, {HANDED_OUT})
    return {c.id: (c.status.value, c.message.endswith(SAID)) for c in results}


def test_a_lost_criterion_names_its_unchanged_file() -> None:
    assert told(HANDED_OUT, executable=False)["executable"] == ("fail", True)
    assert told("b" * 64, executable=False)["executable"] == ("fail", False)
    assert told(HANDED_OUT)["executable"] == ("pass", False)


def test_the_program_of_a_run_is_named_and_what_is_blocked_names_nothing() -> None:
    assert told(HANDED_OUT, DIED) == {
        "rate": ("blocked", False),
        "chatter": ("blocked", False),
        "node": ("fail", True),
        "executable": ("pass", False),
    }


def test_a_verdict_from_the_files_alone_names_it_too(tmp_path: Path) -> None:
    tree = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, TALKER: NODE}
    facts = read_package(make_package(tmp_path / "lab1", tree, executable={TALKER: False}))
    (found,) = judge_files(rubric(EXECUTABLE), facts, CHECKS, {sha256(NODE.encode()).hexdigest()})
    assert found.criterion.message.endswith(SAID)


def with_starter(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        path = folder / "handed_out" / "src" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return spoiled(folder, ("package: lab1\n", "package: lab1\nstarter: handed_out\n"))


def test_the_starter_belongs_to_the_rubric(tmp_path: Path) -> None:
    path = with_starter(tmp_path, talker="# TODO\n", empty="")
    loaded = load_rubric(str(path))
    assert loaded.handed_out == {sha256(b"# TODO\n").hexdigest()}  # what is empty says nothing
    names = {"handed_out/src/talker.py", "handed_out/src/empty.py"}
    assert read_beside_rubric(loaded).keys() == names
    bundle = Bundle()
    add_lab(bundle, loaded, "lab")
    assert {name for name, _, _ in bundle.entries()} == {"lab/lab.yaml", *(f"lab/{name}" for name in names)}
    with_starter(tmp_path, talker="# TO DO\n")
    assert load_rubric(str(path)).digest != loaded.digest


@pytest.mark.parametrize("files", [{}, {"empty": ""}])
def test_a_starter_without_files_is_a_fault(tmp_path: Path, files: dict[str, str]) -> None:
    (fault,) = faults(with_starter(tmp_path, **files))
    assert fault == "lab.yaml:6: starter: there is no folder handed_out with files in it beside the rubric"
