"""An exported grader as Gradescope's container has it: root without the rights to make namespaces, and no sandbox.

What `setup.sh` installs there (ROS, and the packages that the grader needs) is this machine's. tests/fresh runs all of
its steps.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import zipfile
from pathlib import Path
from typing import Any

from tests.hostile.room.world import run

TOP = Path("/autograder")
RESULTS = TOP / "results"
DOCUMENT = RESULTS / "results.json"
OWN_ID = "submission"
ENVIRONMENT = Path("/opt/ros-lab-grader")
KEPT = (
    "chown", "dac_override", "fowner", "fsetid", "kill", "setgid", "setuid", "setpcap", "net_bind_service", "net_raw",
    "sys_chroot", "mknod", "audit_write", "setfcap",
)  # fmt: skip
"""Of root's rights, as Docker has it where nobody asked for more."""
COMMAND = (
    "setpriv", "--bounding-set", "-all," + ",".join(f"+{name}" for name in KEPT),
    "--inh-caps", "-all", str(TOP / "run_autograder"),
)  # fmt: skip


def install(rubric: Path, own: Path) -> None:
    """Unpack what `grader export gradescope` makes of `rubric`; `own` is the folder of the grader's source."""
    file = TOP / "lab.zip"
    (TOP / "source").mkdir(parents=True)
    RESULTS.mkdir()
    words = ("export", "gradescope", rubric, "--assume-executable", "--out", file)
    run("env", f"PYTHONPATH={own}", "PYTHONDONTWRITEBYTECODE=1", sys.executable, "-m", "grader", *words)
    with zipfile.ZipFile(file) as archive:
        for about in archive.infolist():
            Path(archive.extract(about, TOP / "source")).chmod(about.external_attr >> 16 & 0o777)
    file.unlink()
    shutil.copy2(TOP / "source" / "run_autograder", TOP / "run_autograder")
    _environment(next((TOP / "source").glob("*.whl")))
    run("chmod", "-R", "go-rwx", TOP / "source")


def hand_in(path: Path) -> None:
    """As uploaded through the web: every file has the same mode."""
    shutil.copytree(path, TOP / "submission", symlinks=True)
    for folder, _, names in os.walk(TOP / "submission"):
        for name in names:
            if not Path(folder, name).is_symlink():
                Path(folder, name).chmod(0o644)


TEMPLATES = (
    "from grader.report.html.shell import environment as made; "
    "[made().get_template(name) for name in made().list_templates()]"
)


def document() -> Any:
    """What Gradescope is told; None where it cannot be read."""
    try:
        return json.loads(DOCUMENT.read_bytes())
    except (OSError, ValueError):
        return None


def _environment(wheel: Path) -> None:
    run(sys.executable, "-m", "venv", "--without-pip", ENVIRONMENT)
    (packages,) = ENVIRONMENT.glob("lib/python*/site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    run(ENVIRONMENT / "bin" / "python", "-I", "-m", "compileall", "-q", packages)  # as pip does
    (others,) = Path(sys.prefix).glob("lib/python*/site-packages")
    (packages / "machine.pth").write_text(f"{others}\n", encoding="utf-8")
    run(ENVIRONMENT / "bin" / "python", "-I", "-c", TEMPLATES)  # as the first grading does
