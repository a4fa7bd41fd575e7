"""`python -m tests.hostile.room SCRATCH < job > report.tar`, as the first process of its namespaces."""

from __future__ import annotations

import io
import json
import os
import stat
import sys
import tarfile
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tests.hostile.room import canaries, container, groups, state, submission, world
from tests.hostile.room.watch import Used, Watched, reap, watch

ROOT = Path(__file__).resolve().parents[3]
LEFT_S = 2.0
KEPT = ("PATH", "GRADER_ROS_SETUP", "CONDA_PREFIX")
AFTER_WALL_S = 60.0
GRADER = (sys.executable, "-m", "grader")


def main() -> None:
    job = json.load(sys.stdin)
    room = Room(job, world.enter(Path(sys.argv[1])))
    with tarfile.open(fileobj=sys.stdout.buffer, mode="w|") as tar:
        report = room.grade_attack()
        _add_results(tar, room.results)
        if job["after"] != "none":
            report["after"] = asdict(room.grade_victim())
        _add_report(tar, report)


class Room:
    """One grading of a hostile submission, then one of the victim, by one user."""

    def __init__(self, job: Mapping[str, Any], place: world.World) -> None:
        self._job, self._world = job, place
        ordinary = job["user"] == "ordinary"
        groups.enter(job["groups"], job["may_make_groups"], world.ORDINARY_UID if ordinary else 0)
        world.bring_up_loopback()
        if ordinary:
            world.add_user()
        self._uid = world.ORDINARY_UID if ordinary else 0
        self._home = Path("/home", world.ORDINARY_NAME) if ordinary else Path("/root")
        self._python_path = world.install() if job["installed"] else ROOT
        canaries.place(job["secret"], job["rubric"], self._home)
        submission.give(self._home / ".ssh", self._uid)
        self._path = submission.make(job["submission"], canaries.HANDED_IN, self._uid)
        os.chown(canaries.RESULTS, self._uid, self._uid)
        self._name = job["submission"]["name"]
        if job["container"]:
            container.install(canaries.RUBRIC, ROOT)
            container.hand_in(self._path)
        self._services = canaries.Services(job["secret"])

    def grade_attack(self) -> dict[str, Any]:
        if self._job["container"]:
            observed = self._observed([*container.COMMAND])
            return observed | {
                "document": container.document(),
                "packets": 0,
            }  # nodes speak over this loopback
        source = self._job["source"].replace("{path}", str(self._path))
        argv = ["grade", source, "--rubric", str(canaries.RUBRIC), "--out", str(canaries.RESULTS)]
        return self._observed(
            [*self._job["through"], *GRADER, *argv, "--id", self._name, *self._job["arguments"]]
        )

    def grade_victim(self) -> Watched:
        """In the place of what was handed in before, by the same student."""
        folder = canaries.TOP / "again" / self.results.name
        submission.victim(folder / "lab")
        submission.give(folder, self._uid)
        rubric = canaries.RUBRIC.with_name("after.yaml")
        rubric.write_text(self._job["after_rubric"], encoding="utf-8")
        command = (
            ["grade", str(folder)] if self._job["after"] == "full" else ["check", str(folder), "--static"]
        )
        argv = [*GRADER, *command, "--rubric", str(rubric), "--out", str(canaries.RESULTS)]
        return self._watch(argv, {}, AFTER_WALL_S)

    def _observed(self, argv: list[str]) -> dict[str, Any]:
        files, sockets, packets = self._files(), state.sockets(), state.packets()
        settings = state.settings()
        scratch, shared = state.folder(canaries.SCRATCH), state.folder(Path("/dev/shm"))
        watched = self._watch(argv, self._job["env"], self._job["wall_s"])
        left = self._processes_left()
        return asdict(watched) | {
            "processes": left,
            "sockets": sorted(state.sockets() - sockets),
            "groups": sorted(state.control_groups(self._job["groups"])),
            "packets": state.packets() - packets,
            "asked": self._services.asked,
            "settings": [name for name, value in state.settings().items() if value != settings[name]],
            "scratch": sorted(set(state.folder(canaries.SCRATCH)) ^ set(scratch)),
            "shared": sorted(set(state.folder(Path("/dev/shm"))) ^ set(shared)),
            "changed": state.changed(files, self._files()),
            "odd": self._odd_results(),
        }

    def _files(self) -> dict[str, state.Entry]:
        return state.files(self._world, container.RESULTS if self._job["container"] else canaries.RESULTS)

    @property
    def results(self) -> Path:
        """The folder of the submission's id, which an attack may choose."""
        if self._job["container"]:
            return container.RESULTS / "grader" / container.OWN_ID
        made = {path for path in canaries.RESULTS.iterdir() if path.name != canaries.OTHER.name}
        named = canaries.RESULTS / self._name
        return min(made - {named}, default=named)

    def _odd_results(self) -> list[str]:
        """What is no plain file or folder, and folders that are too many."""
        if self._job["container"]:
            return [str(path) for path in container.RESULTS.rglob("*") if not _plain(path)]
        made = [path.name for path in canaries.RESULTS.iterdir() if path.name != canaries.OTHER.name]
        odd = [str(path) for path in canaries.RESULTS.rglob("*") if not _plain(path)]
        odd += [f"{path} is open to others" for path in (self.results,) if _is_open(path)]
        return odd if len(made) < 2 else [*odd, *made]

    def _watch(self, argv: list[str], env: Mapping[str, str], wall_s: float) -> Watched:
        secret = self._job["secret"]
        env = {
            **{name: os.environ[name] for name in KEPT if name in os.environ},
            "HOME": str(self._home), "LANG": "C.UTF-8", "TMPDIR": str(canaries.SCRATCH),
            "XDG_RUNTIME_DIR": str(canaries.RUNTIME),
            "PYTHONPATH": str(self._python_path), "PYTHONDONTWRITEBYTECODE": "1",
            "GITHUB_TOKEN": f"{secret}-environment", "ROS_MARKS_PASSWORD": f"{secret}-environment-ros",
            **env,
        }  # fmt: skip
        used = Used(disk=self._world.used_bytes, memory=lambda: groups.memory_bytes(self._job["groups"]))
        return watch(argv, env, self._uid, wall_s, used)

    def _processes_left(self) -> list[str]:
        """Those that are still there when the time is over in which they have to go."""
        deadline = time.monotonic() + LEFT_S
        reap()
        while (left := state.processes(os.getpid())) and time.monotonic() < deadline:
            os.sched_yield()
            reap()
        return left


def _is_open(path: Path) -> bool:
    """What holds marks is for its owner alone."""
    return path.is_dir() and path.stat().st_mode & 0o077 != 0


def _plain(path: Path) -> bool:
    mode = path.lstat().st_mode
    return stat.S_ISREG(mode) or stat.S_ISDIR(mode)


def _add_results(tar: tarfile.TarFile, results: Path) -> None:
    for path in sorted(results.rglob("*")):
        if path.is_file() and _plain(path):
            tar.add(path, f"results/{path.relative_to(results)}")


def _add_report(tar: tarfile.TarFile, report: dict[str, Any]) -> None:
    data = json.dumps(report).encode()
    info = tarfile.TarInfo("report.json")
    info.size = len(data)
    tar.addfile(info, io.BytesIO(data))


main()
