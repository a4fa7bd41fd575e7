"""A rubric's test with real nodes: few mutants, one of which survives."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.grader_process import Grader

pytestmark = [pytest.mark.ros, pytest.mark.slow]

ROOT = Path(__file__).resolve().parent.parent.parent.parent
LAB = "leeds-comp3631-lab1"
MUTANTS = ("talker-not-executable", "reset-to-one")


@pytest.fixture
def grader() -> Iterator[Grader]:
    grader = Grader()
    yield grader
    grader.end()


def without_the_wrap(folder: Path) -> Path:
    """The lab's rubric with a criterion taken out, its points given to another."""
    text = (ROOT / "rubrics" / f"{LAB}.yaml").read_text(encoding="utf-8")
    start, end = text.index("  - id: counter-wrap"), text.index("  - id: listener-chatter")
    path = folder / "mine.yaml"
    path.write_text(text[:start] + text[end:].replace("points: 5", "points: 20", 1), encoding="utf-8")
    return path


@pytest.mark.full
def test_a_rubric_with_a_criterion_taken_out_lets_a_mutant_survive(grader, tmp_path):
    argv = ("rubric", "test", without_the_wrap(tmp_path), "--only", *MUTANTS, "--jobs", "2", "--json")
    code, out, err = grader.run(*argv)
    assert code == 1, err
    test = json.loads(out)
    assert test["reference"]["lost"] == []
    states = {mutant["name"]: mutant["state"] for mutant in test["mutants"]}
    assert states == {"talker-not-executable": "killed", "counter-resets-to-1": "survived"}
    (survivor,) = [mutant for mutant in test["mutants"] if mutant["state"] == "survived"]
    assert survivor["missing"] == ["counter-wrap (the rubric has no such criterion)"]
    assert "-            counter = 0\n+            counter = 1\n" in survivor["diff"]
    assert (Path(survivor["evidence"]) / "evidence" / "wraps.mcap").is_file()
    assert [path.name for path in Path(survivor["evidence"]).parent.iterdir()] == [survivor["name"]]


@pytest.mark.full
@pytest.mark.parametrize("how", ["interrupt", "terminate", "kill"])
def test_stopping_leaves_nothing_behind(how, grader):
    process = grader.start("rubric", "test", LAB, "--only", *MUTANTS, "--jobs", "2")
    assert process.stderr is not None
    for line in process.stderr:
        if "running" in line and "counter-resets-to-1" in line:
            break
    process.send_signal(
        {"interrupt": signal.SIGINT, "terminate": signal.SIGTERM, "kill": signal.SIGKILL}[how]
    )
    process.communicate()
    assert process.returncode == (-signal.SIGKILL if how == "kill" else 130)
    assert grader.await_none(15) == []
    if how != "kill":
        assert list(grader.temporary.iterdir()) == []
