"""What ROS's own Python runs stays Python 3.8: its syntax, and what of the standard library it uses."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.packaging.making import BIN, ROOT, find

SIDES = ("grader/arena/ros", "grader/package/lint", "grader/arena/standins")
NEWER = {
    "syntax": "match 1:\n    case 1:\n        pass\n",
    "library": "import zoneinfo\n",
    "function": "import math\nmath.lcm(1, 2)\n",
    "types": "def f(a: list[int]) -> dict[str, int]:\n    return {}\n",
    "walrus-in-brackets": "with (open('a') as a, open('b') as b):\n    pass\n",
}


def scripts() -> list[Path]:
    """Python of both sides, programs without an ending as well."""
    files = [path for side in SIDES for path in sorted((ROOT / side).rglob("*")) if path.is_file()]
    return [
        path
        for path in files
        if path.suffix == ".py" or (not path.suffix and b"python" in path.read_bytes()[:40])
    ]


def vermin(*paths: Path) -> subprocess.CompletedProcess[str]:
    """Refuses what needs a Python newer than 3.8."""
    command = [BIN / "vermin", "--no-tips", "--eval-annotations", "--violations", "--target=3.8-", *paths]
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)


def test_both_sides_are_found():
    assert {path.relative_to(ROOT).as_posix() for path in scripts()} > {
        "grader/package/lint/syntax.py",
        "grader/arena/ros/__main__.py",
        "grader/arena/standins/turtlesim/turtlesim_node",
    }


def test_nothing_needs_a_newer_python():
    done = vermin(*scripts())
    assert done.returncode == 0, done.stdout


@pytest.mark.full
@pytest.mark.parametrize("kind", NEWER)
def test_what_needs_one_is_found(tmp_path, kind):
    path = tmp_path / "newer.py"
    path.write_text(NEWER[kind], encoding="utf-8")
    done = vermin(path)
    assert done.returncode != 0
    assert "Minimum required versions:" in done.stdout


def test_python_3_8_itself_compiles_it():
    python = find("3.8")
    if python is None:
        pytest.skip("no Python 3.8 here, neither on PATH nor in ~/.pyenv/versions")
    script = "import sys; [compile(open(p, 'rb').read(), p, 'exec') for p in sys.argv[1:]]"
    done = subprocess.run(
        [python, "-c", script, *map(str, scripts())], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
