"""What the tests of pages stand on: Debian's Chromium and two tools from npm, or why they are missing."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
AXE = HERE / "node_modules" / "axe-core" / "axe.min.js"
VALIDATE = HERE / "node_modules" / "html-validate" / "bin" / "html-validate.mjs"
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def chromium() -> str | None:
    """The program; None where there is none. `GRADER_CHROMIUM` names another one."""
    named = os.environ.get("GRADER_CHROMIUM")
    return named or next((path for name in CHROMIUMS if (path := shutil.which(name))), None)


def missing() -> str | None:
    """In one line what is missing here and how it comes; None where all is there."""
    lacking = []
    if chromium() is None:
        lacking.append("chromium")
    if shutil.which("node") is None:
        lacking.append("nodejs")
    if not (AXE.exists() and VALIDATE.exists()):
        lacking.append("the packages of tests/browser/package.json (npm)")
    if not lacking:
        return None
    return f"no {', no '.join(lacking)}: apt-get install chromium nodejs npm, then make setup"


def validate(*paths: Path) -> list[str]:
    """What html-validate has against HTML files, a line each: `12:3 rule: text`."""
    command = ["node", str(VALIDATE), "--config", str(HERE / "htmlvalidate.mjs"), "--formatter", "json"]
    with tempfile.TemporaryFile() as out:  # into a pipe, node writes the beginning only
        done = subprocess.run(
            [*command, *map(str, paths)],
            cwd=HERE,
            stdout=out,
            stderr=subprocess.PIPE,
            check=False,
        )
        if done.returncode not in (0, 1):
            raise RuntimeError(done.stderr.decode())
        out.seek(0)
        found = json.load(out)
    return [
        f"{message['line']}:{message['column']} {message['ruleId']}: {message['message']}"
        for file in found
        for message in file["messages"]
    ]
