"""Kills graders at random moments, in a PID namespace of its own, of which this is the first process.

Run as `python -m tests.killing FOLDER SECONDS…`, one kill after so many seconds of a run each. Prints one line of
JSON: what was wrong after each.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from lxml import etree

from grader.errors import GraderError
from grader.evidence.reader import load_evidence, load_run
from grader.judging import criteria_bytes, judge
from grader.rubric.load import load_rubric
from tests.faulty import RUBRIC, VICTIM

GONE_S = 120.0
LOOK_S = 0.05
WHOLE_EVERY = 5
LIMIT_S = 600.0
RESULT = {"result.json", "report.html", "report.md", "junit.xml", "console.log", "evidence"}

LOCKS = "ros-lab-grader-"
"""The folder of the locks that graders share stays."""


def start(out: Path, tmp: Path) -> subprocess.Popen[bytes]:
    argv = [sys.executable, "-m", "grader", "grade", VICTIM, "--rubric", RUBRIC, "--out", out, "--id", "ada"]
    return subprocess.Popen(
        [str(word) for word in argv],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(tmp)},
    )


def killed(out: Path, tmp: Path, moment_s: float) -> Iterator[str]:
    """Kill a grader then, and say what was wrong."""
    grader = start(out, tmp)
    with suppress(subprocess.TimeoutExpired):
        grader.communicate(timeout=moment_s)
    grader.kill()
    grader.communicate()
    left = alive_after(GONE_S)
    if left:
        yield f"processes left after {GONE_S} s: {left}"
    yield from broken(out)


def alive_after(patience_s: float) -> list[str]:
    """The command lines of what else lives in this namespace, when nothing does or the time is over.

    All that has lost its parent comes to this process, which is told when it ends.
    """
    deadline = time.monotonic() + patience_s
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGCHLD})
    try:
        while (left := alive()) and time.monotonic() < deadline:
            signal.sigtimedwait({signal.SIGCHLD}, LOOK_S)
            with suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    continue
        return left
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGCHLD})


def alive() -> list[str]:
    found = []
    for path in Path("/proc").iterdir():
        if not path.name.isdigit() or int(path.name) == os.getpid():
            continue
        with suppress(OSError):  # it has ended since
            if path.joinpath("stat").read_text().rpartition(")")[2].split()[0] != "Z":
                found.append(path.joinpath("cmdline").read_text(errors="replace").replace("\0", " ")[:150])
    return found


def broken(out: Path) -> Iterator[str]:
    """Result files that are there and not whole, or do not belong together."""
    folder = out / "ada"
    for path in folder.rglob("*.mcap") if folder.exists() else ():
        with suppress_told(path) as told:
            load_run(path)
        yield from told
    for name, read in {"result.json": json.loads, "junit.xml": etree.fromstring}.items():
        if (folder / name).exists():
            with suppress_told(folder / name) as told:
                read((folder / name).read_bytes())
            yield from told
    if (folder / "result.json").exists():
        yield from unfitting(folder)


class suppress_told:  # noqa: N801 - used as contextlib's own are
    """What cannot be read becomes a remark."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._told: list[str] = []

    def __enter__(self) -> list[str]:
        return self._told

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if isinstance(error, (GraderError, ValueError, OSError, etree.XMLSyntaxError)):
            self._told.append(f"{self._path}: {error}")
            return True
        return False


def unfitting(folder: Path) -> Iterator[str]:
    loaded = load_rubric(str(RUBRIC))
    result = json.loads((folder / "result.json").read_bytes())
    again = json.loads(
        criteria_bytes(judge(loaded.rubric, load_evidence([folder / "evidence"]), loaded.checks))
    )
    if result["criteria"] != again:
        yield "the result does not fit the evidence beside it"


def whole(out: Path, tmp: Path) -> Iterator[str]:
    """Grade to the end: it succeeds, and nothing is left of those that were killed."""
    grader = start(out, tmp)
    _, err = grader.communicate(timeout=LIMIT_S)
    if grader.returncode != 0:
        yield f"the next grading ended with {grader.returncode}: {err.decode(errors='replace')[-500:]}"
    yield from broken(out)
    names = {path.name for path in (out / "ada").iterdir()}
    if not names <= RESULT or [path.name for path in out.iterdir()] != ["ada"]:
        yield f"left in the output folder: {sorted(names - RESULT)} {sorted(p.name for p in out.iterdir())}"
    left = [path.name for path in tmp.iterdir() if not path.name.startswith(LOCKS)]
    if left:
        yield f"left among the temporary files: {left}"


def main(folder: Path, chosen: list[float]) -> None:
    out, tmp = folder / "out", folder / "tmp"
    tmp.mkdir(parents=True)
    tmp.chmod(0o711)
    wrong = []
    for number, moment_s in enumerate(chosen, 1):
        wrong += [f"killed after {moment_s:.2f} s: {what}" for what in killed(out, tmp, moment_s)]
        if number % WHOLE_EVERY == 0 or number == len(chosen):
            wrong += [f"after a kill at {moment_s:.2f} s: {what}" for what in whole(out, tmp)]
    print(json.dumps(wrong))


if __name__ == "__main__":
    main(Path(sys.argv[1]), [float(word) for word in sys.argv[2:]])
