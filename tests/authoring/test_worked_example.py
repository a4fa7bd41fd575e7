"""Every command of docs/how-to/writing-a-rubric.md, in a folder of its own and in the page's order."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from grader.rubric.load import load_rubric

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "how-to" / "writing-a-rubric.md").read_text(encoding="utf-8")
COMMANDS = [
    line[2:] for block in re.findall(r"```console\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()
]
PIECES = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
RUN_S = 240


def _run(command: str, folder: Path) -> None:
    words, _, target = command.partition(" > ")
    argv = shlex.split(words)
    assert argv[0] == "grader"
    done = subprocess.run(
        [sys.executable, "-m", *argv], cwd=folder, capture_output=True, text=True, check=False, timeout=RUN_S
    )
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    if target:
        (folder / target).write_text(done.stdout, encoding="utf-8")


def _edited(path: Path) -> None:
    """The proposal with the page's own pieces in it, the points brought to 100 again."""
    rubric = yaml.safe_load(path.read_text(encoding="utf-8"))
    criteria = yaml.safe_load(PIECES[0])
    scenarios = yaml.safe_load(next(piece for piece in PIECES if "watcher-hears:" in piece))
    given = {c["id"]: c for c in criteria}
    known = [c["id"] for c in rubric["criteria"]]
    spare = sum(c["points"] for c in criteria) - sum(
        c["points"] for c in rubric["criteria"] if c["id"] in given
    )
    rubric["criteria"] = [given.get(c["id"], c) for c in rubric["criteria"]]
    rubric["criteria"] += [c for i, c in given.items() if i not in known]
    next(c for c in rubric["criteria"] if c["id"] == "ticks-wrap")["points"] -= spare
    assert set(scenarios) <= set(rubric["scenarios"])
    rubric["scenarios"] |= scenarios
    path.write_text(yaml.safe_dump(rubric, sort_keys=False), encoding="utf-8")


def test_the_page_shows_each_command_once() -> None:
    assert len(COMMANDS) == len(set(COMMANDS)) == 6


@pytest.mark.full
@pytest.mark.ros
@pytest.mark.slow
def test_every_command_works_as_printed(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "reference_solutions" / "ticker", tmp_path / "reference_solutions" / "ticker")
    for command in COMMANDS:
        _run(command, tmp_path)
        if command.startswith("grader rubric new"):
            assert load_rubric(str(tmp_path / "ticker.yaml")).rubric.max_points == 100
            assert "# NOTE:" not in (tmp_path / "ticker.yaml").read_text(encoding="utf-8")
        if command.startswith("grader rubric validate"):
            _edited(tmp_path / "ticker.yaml")
    assert '"status": "pass"' in (tmp_path / "criteria.json").read_text(encoding="utf-8")
