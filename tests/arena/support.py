"""Runs made-up packages in a real arena."""

from __future__ import annotations

import asyncio
import contextlib
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from grader.arena.limits import RunLimits
from grader.arena.process_environment import ProcessEnvironment
from grader.arena.run_scenario import run_scenario
from grader.arena.run_state import RunState
from grader.arena.sandbox import choose_sandbox, why_no_sandbox
from grader.arena.sandbox_files import prepare
from grader.arena.workspace import make_workspace, run_in_place
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.model.submission import SourcePackage, Submission
from grader.package.facts import read_package
from grader.ros_env import RosInstallation, find_ros
from grader.rubric.scenario import JudgedGoal, Scenario, Start, Until

MANIFEST = """<?xml version="1.0"?>
<package format="2"><name>lab</name><version>0.0.0</version><description>lab</description>
<maintainer email="student@example.org">a</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
CMAKE = (
    "cmake_minimum_required(VERSION 3.0.2)\nproject(lab)\nfind_package(catkin REQUIRED)\ncatkin_package()\n"
)
SCRIPT = "#!/usr/bin/env python3\n"
RUN_S = 60.0
needs_sandbox = pytest.mark.skipif(bool(why_no_sandbox()), reason=f"no sandbox here: {why_no_sandbox()}")


def require_ros() -> RosInstallation:
    ros = find_ros()
    assert ros is not None
    return ros


def make_submission(folder: Path, files: Mapping[str, str]) -> Submission:
    """A submission that holds the package `lab` with these files; scripts are executable."""
    for name, text in {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, **files}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    executable = {
        p.relative_to(folder).as_posix(): p.suffix == ".py" for p in folder.rglob("*") if p.is_file()
    }
    package = SourcePackage(name="lab", folder=folder, path=".", mode_source="disk", executable=executable)
    return Submission(
        id="lab",
        source=str(folder),
        root=folder,
        commit=None,
        archive_sha256=None,
        digest="0",
        package=package,
        packages=(),
    )


@contextlib.contextmanager
def make_place(
    files: Mapping[str, str],
    *,
    sandbox: str = "auto",
    limits: RunLimits | None = None,
    folder: Path | None = None,
) -> Iterator[ProcessEnvironment]:
    """A place with the package unbuilt: ROS finds its sources."""
    with tempfile.TemporaryDirectory(prefix="grader-test-") as name:
        top = Path(name)
        top.chmod(0o711)
        submission = make_submission(folder or top / "submission", files)
        chosen, ros = choose_sandbox(sandbox), require_ros()  # type: ignore[arg-type]
        prepare(top / "place", ros)
        scripts = [f for f in files if f.endswith(".py")]
        facts = read_package(submission.package)
        workspace = make_workspace(top / "place", submission, facts, scripts, chosen)
        place = ProcessEnvironment(
            folder=top / "place",
            ros=ros,
            sandbox=chosen,
            limits=limits or RunLimits(),
            workspace=workspace,
            package="lab",
        )
        yield place.from_source()


def repaired(place: ProcessEnvironment) -> ProcessEnvironment:
    """As after a build: what runs are the repaired sources."""
    if not place.sandbox.bubblewrap:
        run_in_place(place.workspace, place.sandbox)
    return place


def run(
    place: ProcessEnvironment,
    scenario: Scenario,
    path: Path,
    *,
    beside: Path | None = None,
    watched_s: float = 0.0,
    goals: Mapping[tuple[str, int], JudgedGoal] | None = None,
) -> Run:
    """Record a scenario and read it back. `beside` is the rubric's folder."""
    about = {"beside": beside, "watched_s": watched_s, "goals": goals}
    asyncio.run(_bounded(repaired(place), scenario, path, about))
    return load_run(path)


def run_script(
    tmp_path: Path, code: str, *, sandbox: str = "auto", limits: RunLimits | None = None, **until: object
) -> Run:
    """Run one script as `node.py` until the conditions hold."""
    scenario = Scenario(
        title="test",
        clock=until.pop("clock", "real"),  # type: ignore[arg-type]
        start=(Start(name="node", script="src/node.py"),),
        until=Until.model_validate(until),
    )
    with make_place({"src/node.py": SCRIPT + code}, sandbox=sandbox, limits=limits) as place:
        return run(place, scenario, tmp_path / "run.mcap")


async def _bounded(
    place: ProcessEnvironment, scenario: Scenario, path: Path, about: Mapping[str, object]
) -> None:
    more = {"path": path, "metadata": {}, "tell": lambda _: None, **about}
    await asyncio.wait_for(run_scenario("run", scenario, place, **more), RUN_S)  # type: ignore[arg-type]


def exit_of(run: Run, name: str = "node") -> object:
    """The process's exit event."""
    return next(e for _, e in run.processes if e.name == name and e.event == "exit")


def printed(run: Run, name: str = "node") -> list[str]:
    return [line.line for _, line in run.lines(name)]


def state_of(**topics: tuple[int, float, float]) -> RunState:
    """Topics as count, first, last; the run started at 0, its process runs and is a node."""
    live = RunState(running={"node"}, registered={"node"})
    for name, (count, first_s, last_s) in topics.items():
        seen = live.topics["/" + name]
        seen.count, seen.first_s, seen.last_s = count, first_s, last_s
    return live
