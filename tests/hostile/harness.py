"""Puts an attack into a room, and says what of README.md's list does not hold."""

from __future__ import annotations

import json
import os
import re
import secrets
import shutil
import subprocess
import sys
import tarfile
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import IO, Any

from grader.arena.control_groups import find_cgroups
from grader.errors import ExitCode
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from tests.hostile.form import HERE, Attack, Run, load_attack, rubric_path, submission_job
from tests.hostile.outputs import control_characters, secrets_in

ROOT = HERE.parents[1]
MEMORY_BYTES_MAX = 300 << 20
DISK_BYTES_MAX = 200 << 20
ROOM_LIMITS = {"memory": ("memory.limit_in_bytes", 6 << 30), "pids": ("pids.max", 4096)}
MACHINE_BYTES_MAX = 1600 << 20
WATCHED_BYTES_MAX = 3000 << 20
"""Without control groups: a tree may grow beyond its limit until somebody looks (SECURITY.md)."""
SPARE_S = 90.0
UNSHARE = (
    "unshare", "--mount", "--pid", "--fork", "--kill-child", "--net", "--ipc", "--uts", "--propagation", "private"
)  # fmt: skip
NEEDED = ("unshare", "pivot_root", "ip", "useradd", "mount")
HARM = re.compile(r"HARM")
BUSY = (Status.PASS, Status.INCONCLUSIVE)
RATE_ALONE = re.compile(r"^90 of 100 points.*^\? rate ", re.MULTILINE | re.DOTALL)


@cache
def why_no_room() -> str:
    """Empty where rooms can be made, else the reason."""
    if os.geteuid() != 0:
        return "rooms for attacks need root"
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        return f"{', '.join(missing)} not installed"
    with tempfile.TemporaryDirectory() as scratch:
        script = (
            'mount -t tmpfs t "$1" && cd "$1" && mkdir a b c'
            " && mount -t overlay -o lowerdir=/,upperdir=a,workdir=b o c"
        )
        done = subprocess.run(
            [*UNSHARE, "sh", "-c", script, "sh", scratch], capture_output=True, text=True, check=False
        )
    return "" if done.returncode == 0 else f"no overlay here: {done.stderr.strip()[-200:]}"


def why_no_groups() -> str:
    """Empty where a grading in a room can make control groups, else the reason."""
    found = find_cgroups()
    if found.memory is None or found.memory.version != 1:
        return "rooms have control groups of version 1 only, and there are none here"
    return ""


class Graded:
    """What became of an attack: the room's report, and the result's folder as it was left."""

    def __init__(self, report: dict[str, Any], folder: Path, run: Run) -> None:
        self.report = report
        self.folder = folder
        self.run = run

    @property
    def result(self) -> GradingResult | None:
        path = self.folder / "result.json"
        return GradingResult.model_validate_json(path.read_text(encoding="utf-8")) if path.is_file() else None

    @property
    def console(self) -> str:
        path = self.folder / "console.log"
        return path.read_text(encoding="utf-8") if path.is_file() else ""


def grade_in_room(name: str, run: Run, folder: Path, **changes: object) -> Graded:
    """Grade the attack in a room of its own; its outputs are copied into `folder`. `changes` are to the job."""
    attack = load_attack(name)
    secret = f"CANARY{secrets.token_hex(8)}"
    rubric = rubric_path(name).read_text(encoding="utf-8")
    job = {
        "submission": submission_job(name),
        "user": run.user,
        "may_make_groups": run.groups,
        "through": list(attack.through),
        "container": attack.container,
        "secret": secret,
        "rubric": rubric,
        "after": attack.after,
        "after_rubric": rubric
        if attack.after == "full"
        else (HERE / "after.yaml").read_text(encoding="utf-8"),
        "source": attack.source,
        "arguments": list(attack.arguments),
        "env": attack.env,
        "installed": attack.installed,
        "wall_s": attack.wall_s,
        **changes,
    }
    with tempfile.TemporaryDirectory(prefix="hostile-room-") as scratch, _groups() as groups:
        report = _in_room(job | {"groups": groups}, scratch, folder)
    return Graded(report | {"secret": secret}, folder / "results", run)


def _in_room(job: Mapping[str, Any], scratch: str, folder: Path) -> dict[str, Any]:
    argv = [*UNSHARE, sys.executable, "-B", "-m", "tests.hostile.room", scratch]
    folder.mkdir(parents=True, exist_ok=True)
    with subprocess.Popen(argv, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        watchdog = threading.Timer(job["wall_s"] + SPARE_S, process.kill)
        watchdog.start()
        try:
            process.stdin.write(json.dumps(job).encode())
            process.stdin.close()
            _unpack(process.stdout, folder)
            code = process.wait()
        finally:
            watchdog.cancel()
            process.kill()
    assert code == 0, f"the room itself failed with exit code {code}"
    report: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return report


def _unpack(stream: IO[bytes], folder: Path) -> None:
    with suppress(tarfile.ReadError), tarfile.open(fileobj=stream, mode="r|") as tar:
        tar.extractall(folder, filter="data")


@contextmanager
def _groups() -> Iterator[list[str]]:
    """Control groups for the room: they bound what an attack can do that gets through, and show what is left."""
    made = []
    for controller, (key, amount) in ROOM_LIMITS.items():
        found = getattr(find_cgroups(), controller)
        if found is not None and found.version == 1:
            group = Path(found.folder, f"hostile-room-{secrets.token_hex(6)}")
            group.mkdir()
            (group / key).write_text(str(amount), encoding="utf-8")
            made.append(group)
    try:
        yield [str(group) for group in made]
    finally:
        for group in made:
            for path in (*sorted(group.rglob("*/"), reverse=True), group):
                with suppress(OSError):  # what is left in it was reported
                    path.rmdir()


def faults(name: str, graded: Graded) -> list[str]:
    """What does not hold, a line each; empty where all is well."""
    attack, report = load_attack(name), graded.report
    watched = graded.run.groups == "without" or graded.run == ("ordinary", "found")
    most = WATCHED_BYTES_MAX if watched else MACHINE_BYTES_MAX
    if attack.machine_mb is not None:
        most = attack.machine_mb << 20
    everywhere = [*machine_faults(report, machine_bytes_max=most), *_outputs(graded)]
    if was_refused(attack, report):
        return everywhere
    return [
        *everywhere,
        *_statuses(attack, graded),
        *wall_faults(attack, graded),
        *_words(attack, graded),
        *_after(report.get("after")),
    ]


def was_refused(attack: Attack, report: Mapping[str, Any]) -> bool:
    """It said why it grades nothing here, before anything of a student's ran: no harm, and no marks lost."""
    said = report["stderr"] + report["stdout"]
    return (
        attack.refused is not None
        and report["exit_code"] == ExitCode.NOT_GRADED
        and re.search(attack.refused, said, re.IGNORECASE) is not None
    )


def machine_faults(report: Mapping[str, Any], *, machine_bytes_max: int = MACHINE_BYTES_MAX) -> Iterator[str]:
    for key, words in {
        "changed": "files changed outside",
        "scratch": "left in $TMPDIR",
        "shared": "left in /dev/shm",
        "processes": "processes left",
        "sockets": "sockets left",
        "groups": "control groups left",
        "settings": "settings of the kernel changed",
        "asked": "services of the machine were asked",
        "odd": "no files or folders in the results, or open to others",
    }.items():
        if report[key]:
            yield f"{words}: {report[key][:10]}"
    if report["packets"]:
        yield f"{report['packets']} packets were sent to the machine's network"
    if report["late"]:
        yield f"the grader did not end within {report['wall_s']:.0f} s"
    if report["memory_bytes"] >= MEMORY_BYTES_MAX:
        yield f"the grader held {report['memory_bytes'] >> 20} MB"
    if report["machine_bytes"] >= machine_bytes_max:
        yield f"the machine had {report['machine_bytes'] >> 20} MB less"
    if report["disk_bytes"] >= DISK_BYTES_MAX:
        yield f"the disk grew by {report['disk_bytes'] >> 20} MB"


def _outputs(graded: Graded) -> Iterator[str]:
    secret = graded.report["secret"]
    texts = {key: graded.report[key] for key in ("stdout", "stderr")}
    for where in secrets_in(secret, graded.folder, texts):
        yield f"a secret is in an output: {where}"
    for where in control_characters(graded.folder, texts):
        yield f"control characters in an output: {where}"


def _statuses(attack: Attack, graded: Graded) -> Iterator[str]:
    result, code = graded.result, graded.report["exit_code"]
    if result is None:
        yield f"no result was written: exit code {code}, {graded.report['stderr'][-500:]!r}"
        return
    if attack.error is not None:
        yield from _error(attack, result, code)
        return
    if result.error is not None:
        yield f"it could not be graded: {result.error}"
        return
    if "document" in graded.report:
        yield from document_faults(graded.report["document"], result)
    elif code not in _codes(result):
        yield f"exit code {code} for a result of status {result.status} and {result.points:g} points"
    for criterion in result.criteria:
        wanted = attack.expect.get(criterion.id, _expected(criterion))
        if criterion.status not in (wanted if isinstance(wanted, tuple) else (wanted,)):
            said = f"{criterion.message} [{criterion.measured}]"
            yield f"{criterion.id}: wanted {_shown(wanted)}, got {criterion.status.value}: {said}"


def document_faults(document: Any, result: GradingResult) -> Iterator[str]:
    """A platform has to be told what the result says."""
    told = document.get("score") if isinstance(document, dict) else document
    if told != result.points:
        yield f"results.json says {told!r} for {result.points:g} points"


def wall_faults(attack: Attack, graded: Graded) -> Iterator[str]:
    """Whoever asked for no other sandbox has one, and memory is held as the run wanted it."""
    result = graded.result
    said = result.environment.sandbox if result is not None and result.error is None else None
    if said is None or "--sandbox" in attack.arguments:
        return
    if said.startswith("bubblewrap") == attack.container:
        yield f"wrong sandbox: {said}"
    if graded.run.held_by not in said:
        yield f"memory is not held by {graded.run.held_by}: {said}"


def _expected(criterion: CriterionResult) -> Status | tuple[Status, ...]:
    """A rate is judged only where the machine that runs the tests had time for it; an attack that takes all of that
    time itself is not excused by it."""
    if criterion.check != "rate":
        return Status.PASS
    if "this run's own processes" in criterion.message:
        return (*BUSY, Status.FAIL)
    return BUSY if "machine was late" in criterion.message else Status.PASS


def _shown(wanted: Status | tuple[Status, ...]) -> str:
    return " or ".join(s.value for s in (wanted if isinstance(wanted, tuple) else (wanted,)))


def _codes(result: GradingResult) -> tuple[int, ...]:
    if result.status == "inconclusive":
        return (ExitCode.INCONCLUSIVE, ExitCode.BELOW_PASS_MARK)
    return (ExitCode.PASSED,) if result.points == result.max_points else (ExitCode.BELOW_PASS_MARK,)


def _error(attack: Attack, result: GradingResult, code: int) -> Iterator[str]:
    wanted = attack.error
    assert wanted is not None
    if result.error is None:
        yield f"it was graded ({result.points:g} points), where an error was wanted"
        return
    kinds = (wanted.kind,) if isinstance(wanted.kind, str) else wanted.kind
    if code != ExitCode.NOT_GRADED or result.status != "error" or result.error.kind not in kinds:
        yield f"exit code {code}, status {result.status}, error {result.error.kind}: {result.error.message}"
    if not re.search(wanted.message, result.error.message, re.IGNORECASE):
        yield f"the error says nothing like {wanted.message!r}: {result.error.message}"
    if result.points or any(c.points for c in result.criteria):
        yield "points were given for what could not be graded"


def _words(attack: Attack, graded: Graded) -> Iterator[str]:
    console, result = graded.console, graded.result
    for line in console.splitlines():
        if HARM.search(line):
            yield f"harm was done: {line[:300]}"
    yield from _missing("console.log", console, attack.must_say)
    for pattern in attack.never:
        if re.search(pattern, console):
            yield f"console.log says {pattern!r}"
    noted = [f"{n.scenario} {n.actor}: {n.text}" for n in getattr(result, "notes", ())]
    yield from _missing("the notes", "\n".join(noted), attack.noticed)
    reports = [p.read_text(encoding="utf-8") for p in graded.folder.glob("*.md")]
    yield from _missing(
        "what is shown", "\n".join((graded.report["stdout"], graded.report["stderr"], *reports)), attack.shows
    )


def _missing(where: str, text: str, patterns: Iterable[str]) -> Iterator[str]:
    for pattern in patterns:
        if not re.search(pattern, text, re.MULTILINE):
            yield f"{where} says nothing like {pattern!r}: {text[-1000:]!r}"


def _after(after: Mapping[str, Any] | None) -> Iterator[str]:
    if after is None:
        return
    busy = after["exit_code"] == ExitCode.INCONCLUSIVE and RATE_ALONE.search(after["stdout"])
    if (after["exit_code"] != ExitCode.PASSED and not busy) or after["late"]:
        said = after["stdout"][-1500:] + after["stderr"][-500:]
        yield f"the victim, graded next: exit code {after['exit_code']}: {said}"
