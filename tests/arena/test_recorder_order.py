"""Which run begins first, what a run waits for, and which files ROS's own Python reads."""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from grader.arena.recorder import _python_files, order_runs
from grader.arena.run_state import RunState
from grader.arena.session import ArenaSession
from grader.package.facts import read_package
from grader.ros_env import RosInstallation
from grader.rubric.model import Rubric
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import SCRIPT
from tests.package.trees import MANIFEST, make_package


def scenario(clock: str = "real", **until: object) -> Scenario:
    start = (Start(name="node", script="node.py"),)
    return Scenario(title="run", clock=clock, start=start, until=Until.model_validate(until))  # type: ignore[arg-type]


def order(*rated: str, **scenarios: Scenario) -> tuple[str, ...]:
    """The order of these runs, of which `rated` are to show a rate."""
    about = {"schema": "grader.rubric/1", "id": "r", "title": "r", "version": "1", "package": "p"}
    criteria = [{"id": "c", "title": "c", "points": 1, "check": "manifest"}]
    return order_runs(Rubric.model_validate({**about, "scenarios": scenarios, "criteria": criteria}), rated)


LONG = scenario(window_s=6)
WATCHING = scenario(alive_s=5)
WARPED = scenario("warped", messages={"/x": 258})
SHORT = scenario(quiet_s=1)


def test_what_measures_a_rate_begins_first() -> None:
    runs = {"lives": scenario(alive_s=20), "hears": SHORT, "rate": LONG, "wraps": WARPED, "again": LONG}
    assert order("rate", "again", **runs) == ("rate", "again", "lives", "wraps", "hears")


def test_then_the_longest() -> None:
    assert order(a=SHORT, b=SHORT, lives=WATCHING) == ("lives", "a", "b")


def test_a_warped_run_measures_no_rate() -> None:
    assert order("slow", long=LONG, slow=scenario("warped", window_s=1)) == ("long", "slow")


@pytest.mark.parametrize(
    ("publishes", "looks"),
    [("/average", 3), ("/alarm", 0)],  # what a node alone publishes and hears needs no other
)
def test_nodes_that_share_a_topic_are_waited_for(
    publishes: str, looks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    live = RunState(running={"node"})
    live.published, live.listened = {"/mean": {publishes}, "/rosout": {"/a"}}, {"/mean": {"/alarm"}}
    asked: list[float] = []

    async def look(session: ArenaSession) -> None:
        asked.append(1)
        live.note_connections({"/mean"} if len(asked) == 3 else (), 1.0)

    async def wait(session: ArenaSession, condition: object, timeout_s: float) -> bool:
        return False

    monkeypatch.setattr(ArenaSession, "look_at_connections", look)
    monkeypatch.setattr(ArenaSession, "wait", wait)
    session = ArenaSession.__new__(ArenaSession)
    session.live = live
    asyncio.run(session.await_connections())
    assert len(asked) == looks


@pytest.mark.parametrize("exact", [True, False])
def test_what_is_sent_at_a_rate_is_not_held_up_where_others_fill_the_machine(exact: bool) -> None:
    """A wait for a node gets longer by the time that others take, and one for a time does not."""

    async def wait() -> float:
        session = ArenaSession.__new__(ArenaSession)
        session.live, session._changed = RunState(), asyncio.Event()
        session._error, session._failure = None, ""
        begun_s = time.monotonic()
        asyncio.get_running_loop().call_soon(lambda: setattr(session.live, "lost_s", 0.3))
        assert not await session.wait(lambda: False, 0.02, exact=exact)
        return time.monotonic() - begun_s

    assert (asyncio.run(wait()) < 0.3) == exact


HERE = sys.version_info[:2]


def read_by_ros(folder: Path, source: str, version: tuple[int, ...]) -> list[str]:
    facts = read_package(make_package(folder / "lab1", {"package.xml": MANIFEST, "node.py": source}))
    place = cast("Any", SimpleNamespace(ros=SimpleNamespace(python_version=version)))
    return _python_files(place, facts)


@pytest.mark.parametrize("version", [(), (3, 8)])
def test_all_where_it_may_be_another_python(tmp_path: Path, version: tuple[int, ...]) -> None:
    assert read_by_ros(tmp_path, SCRIPT, version) == ["node.py"]


def test_none_that_the_same_python_has_read_already(tmp_path: Path) -> None:
    assert read_by_ros(tmp_path, SCRIPT, HERE) == []


@pytest.mark.parametrize(
    ("module", "read"), [("no_such_module", True), ("std_msgs.msg", False), ("math", False)]
)
def test_all_where_one_imports_what_only_some_machines_have(tmp_path: Path, module: str, read: bool) -> None:
    """ROS's own Python has other modules than the grader's."""
    assert (read_by_ros(tmp_path, f"{SCRIPT}import {module}\n", HERE) == ["node.py"]) == read


def test_all_where_one_is_wrong(tmp_path: Path) -> None:
    """What is said of it is said in the words of the Python that students have."""
    assert read_by_ros(tmp_path, SCRIPT + "print 'two'\n", HERE) == ["node.py"]


def test_the_version_is_that_of_the_file_behind_all_links(tmp_path: Path) -> None:
    (tmp_path / "python3.8").touch()
    (tmp_path / "python3").symlink_to("python3.8")
    (tmp_path / "other").touch()
    versions = [
        RosInstallation(
            kind="debian", where="", distro="", python=str(tmp_path / name), prefixes=(), env={}
        ).python_version
        for name in ("python3", "other")
    ]
    assert versions == [(3, 8), ()]
