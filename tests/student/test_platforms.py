"""What `grader check --static` loads has no name that Windows or macOS lacks."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOADED = (
    *(
        "portable",
        "files",
        "results",
        "faults",
        "pipeline",
        "intake",
        "package",
        "student",
        "judging",
    ),
    *(
        "checks",
        "evidence",
        "report",
        "arena/recording_files",
        "arena/static_recorder",
        "ros_env",
    ),
    *(
        "cli/checking",
        "cli/commands",
        "cli/declare",
        "cli/results",
        "cli/explanation",
        "cli/main",
        "cli/select_rubric",
    ),
    *(
        "classes/overrides",
        "rubric",
        "model",
        "untrusted_text",
        "wording",
        "errors",
    ),
)


def test_every_name_is_still_there() -> None:
    assert [m for m in LOADED if not any((ROOT / "grader" / n).exists() for n in (m, f"{m}.py"))] == []


@pytest.mark.full
@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_types_fit(platform: str) -> None:
    command = [sys.executable, "-m", "mypy", "--platform", platform, "--cache-dir", f".mypy_cache/{platform}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    places = tuple(f"grader/{m}{end}" for m in LOADED for end in (".py:", "/"))
    assert [line for line in done.stdout.splitlines() if line.startswith(places) and "error" in line] == []
