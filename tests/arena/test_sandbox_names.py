"""A machine that cannot resolve `localhost`, nor its own name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from grader.arena.sandbox import why_no_sandbox

pytestmark = pytest.mark.ros
ROOT = Path(__file__).resolve().parents[2]
LAB = "leeds-comp3631-lab1"


@pytest.mark.full
@pytest.mark.skipif(bool(why_no_sandbox()), reason=f"no sandbox here: {why_no_sandbox()}")
def test_no_name_is_needed(tmp_path: Path) -> None:
    hosts = tmp_path / "hosts"
    hosts.write_text("192.0.2.1 elsewhere\n")
    outer = ["bwrap", "--dev-bind", "/", "/", "--ro-bind", str(hosts), "/etc/hosts", "--"]
    argv = [sys.executable, "-m", "grader", "grade", str(ROOT / "reference_solutions" / LAB)]
    argv += ["--rubric", LAB, "--out", str(tmp_path / "out")]
    done = subprocess.run([*outer, *argv], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
