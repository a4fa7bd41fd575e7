"""The fixtures of the labs, graded: for the tests and for `make stress`."""

from __future__ import annotations

import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import cache
from itertools import zip_longest
from pathlib import Path

import yaml

from fixtures.make import FIXTURES, declaration, faulty_package, lost_points
from fixtures.make import rubric_of as loaded
from grader.model.mutants import Mutant
from grader.model.result import CriterionResult, GradingResult, Silence
from grader.model.verdict import Status
from grader.package.manifest import read_manifest
from grader.pipeline import GradeOptions, grade
from grader.ros_env import ros_packages
from grader.rubric.model import Rubric

ROOT = Path(__file__).resolve().parent.parent
GIT = shutil.which("git") or "git"
REFERENCE = "reference"
CORRECT = Mutant.model_construct(summary="The reference solution.", expect={}, message={}, says={})
TOGETHER = {
    "avoid-obstacles": ("build-unknown-component+node-named-otherwise+never-stops+too-slow",),
    "cpp-and-python": (
        "roscpp-not-declared+node-named-otherwise+last-of-two+alarm-not-executable+launch-starts-one",
        "cpp-does-not-compile",
    ),
    "eyantra-ros-basics": (
        "chatter-own-package+cmake-no-catkin-package+hello-print+load-yaml-find+turtlesim-colour-unread+web-chromium",
        "config-nesting+hello-ends+manifest-roscpp-missing+param-clobbers",
        "cpp-crashes+hello-not-executable",
        "ok-param-one-line+param-crlf",
    ),
    "follow-wall": ("build-unknown-component+node-named-otherwise+drives-straight",),
    "go-to-goal": (
        "build-unknown-component+node-named-otherwise+too-fast",
        "turns-the-wrong-way",
    ),
    "latched-map": ("build-unknown-component+node-named-otherwise+not-latched+nan-unchecked",),
    "leeds-comp3631-lab1": (
        "counter-every-second-loop+cmake-no-catkin-package+launch-malformed+talker-crlf",
        "talker-asks-input+listener-bom+manifest-malformed",
        "chatter-capital+counter-int16-never-resets+ok-no-dependencies+ok-talker-name-other+build-missing-source",
        "ok-cmake-by-variables+ok-listener-print+rate-11hz+counter-starts-at-1",
    ),
    "mcr2-basic-comms": (
        "talker-missing+listener-name",
        "chatter-other-topic+build-unknown-component",
        "rate-sleep-without-brackets+listener-not-executable+manifest-no-buildtool",
        "message-constant-time+launch-namespace-apart+cmake-no-catkin-package",
        "ok-launch-terminals+talker-anonymous",
    ),
    "tf-broadcaster": (
        "rotation-not-copied+laser-swapped+node-named-otherwise+stamps-not-set+distance-of-base",
        "build-unknown-component+distance-ends",
    ),
    "action-server": (
        "field-int64+node-named-otherwise+no-feedback+preempt-not-heeded+below-zero",
        "build-unknown-component",
        "result-empty",
    ),
    "own-message": (
        "field-float32+fahrenheit+no-stamp+node-named-otherwise+too-slow",
        "build-unknown-component",
    ),
    "params-and-namespaces": (
        "build-unknown-component+node-named-otherwise+launch-without-a-namespace",
        "no-default+topic-absolute",
    ),
    "record-and-replay": (
        "build-unknown-component+recorder-name+steps-in-cm+bag-elsewhere+node-name+backward-less+table-no-names",
    ),
    "service-client": (
        "build-unknown-component",
        "fields-of-32-bits",
        "numbers-swapped+adds-by-itself",
    ),
    "sheffield-com2009-week1": (
        "publisher-not-executable+subscriber-name+manifest-malformed",
        "chatter-float+subscriber-other-topic+cmake-no-catkin-package",
        "rate-1hz+subscriber-bom",
        "launch-remapped-apart+layout-launch-capital+build-no-setup-py",
        "ok-manifest-format-1+publisher-not-anonymous",
    ),
    "turtle-square": (
        "build-unknown-component+node-named-otherwise",
        "goes-on+status-not-latched+launch-remapped",
        "restart-fails+too-fast",
        "ok-drives-slower",
    ),
    "two-packages": (
        "field-misspelt+sensor-not-executable+sensor-too-slow+alarm-always+launch-other-package",
        "build-unknown-component",
        "station-missing",
    ),
    "unit-tests": ("build-unknown-component+forward-prints+name-not-defined+wrap-missing",),
    "york-ele00118m-lab7": (
        "sender-missing+manifest-dependency-build-only",
        "data-float+cmake-no-catkin-package",
        "rate-2hz+receiver-crlf",
        "sender-name-other+maintainer-todo+build-missing-source",
        "message-constant+ok-deep-workspace",
    ),
}
"""Faults, and what is correct too, that get the same together as each by itself: for `make test`."""
SIDE_BY_SIDE = 4  # they wait most of the time, and take turns at starting


@cache
def rubric_of(lab: str) -> Rubric:
    return loaded(lab).rubric


@cache
def fixture_names(lab: str) -> list[str]:
    """Return the names of a lab's packages. They are read as YAML alone, since every worker asks while it collects."""
    data = yaml.load((FIXTURES / f"{lab}.yaml").read_bytes(), getattr(yaml, "CSafeLoader", yaml.SafeLoader))  # noqa: S506
    return sorted(data["mutants"])


def shorter_round(lab: str) -> list[str]:
    """Return the faulty packages that `make test` grades. They miss every criterion of a lab between them: those of
    `TOGETHER`, and of what these leave each time the one that misses most. Of an example it grades only the
    correct package. `make test-all` grades every package by itself."""
    if is_example(lab):
        return []
    names, chosen = fixture_names(lab), [*TOGETHER.get(lab, ())]
    left = {criterion.id for criterion in rubric_of(lab).criteria} - {
        i for name in chosen for i in missed(lab, name)
    }
    while left:
        best = max(names, key=lambda name: len(missed(lab, name) & left))
        if not missed(lab, best) & left:
            break
        chosen.append(best)
        left -= missed(lab, best)
    return chosen


def is_example(lab: str) -> bool:
    return not (ROOT / "rubrics" / f"{lab}.yaml").exists()


def missed(lab: str, name: str) -> frozenset[str]:
    """Return the criteria that the package does not reach for a fault of their own."""
    lost = {Status.FAIL.value, Status.PARTIAL.value}
    return frozenset(i for i, status in read_fixture(lab, name).expect.items() if status in lost)


def source_of(lab: str, name: str) -> Path:
    """The folder to grade: of a fixture, or of the reference solution."""
    return ROOT / "reference_solutions" / lab if name == REFERENCE else faulty_package(lab, name)


def read_fixture(lab: str, name: str) -> Mutant:
    """What is expected; of the reference solution, that everything passes."""
    return CORRECT if name == REFERENCE else declaration(lab, name)


def grade_fixture(lab: str, name: str, out: Path) -> GradingResult:
    """Grade it for real into `out/<lab>/<name>/`. Called in a process of its own."""
    source, links = source_of(lab, name), read_fixture(lab, name).git_links
    with tempfile.TemporaryDirectory(prefix="grader-fixture-") as folder:
        if links:
            source = _repository(source, Path(folder) / name, links)
        options = GradeOptions(submission_id=name)
        return grade(str(source), loaded(lab), out / lab, options, Silence())


def _repository(source: Path, folder: Path, links: tuple[str, ...]) -> Path:
    """`folder`, made a repository of what `source` holds, one commit with links to other repositories in it."""
    shutil.copytree(source, folder, symlinks=True)
    nobody = ["-c", "user.name=A student", "-c", "user.email=student@localhost"]
    commands = [["init", "--quiet"], ["add", "--all", "--force"]]
    commands += [["update-index", "--add", "--cacheinfo", f"160000,{'1' * 40},{link}"] for link in links]
    for command in [*commands, [*nobody, "commit", "--quiet", "--message", "Hand in"]]:
        subprocess.run([GIT, *command], cwd=folder, check=True)
    return folder


def in_turn(named: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """The labs take turns: some take much CPU, others mostly wait."""
    by_lab: dict[str, list[tuple[str, str]]] = {}
    for pair in named:
        by_lab.setdefault(pair[0], []).append(pair)
    return [pair for row in zip_longest(*by_lab.values()) for pair in row if pair is not None]


@contextmanager
def workers(count: int = SIDE_BY_SIDE) -> Iterator[ProcessPoolExecutor]:
    """Processes that grade side by side. They end when the block is left, whatever they are at: nobody waits for it."""
    spawn = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=spawn, initializer=_end_with_parent)
    try:
        yield pool
    finally:
        ours = list((pool._processes or {}).values())  # `shutdown` waits for what has begun
        pool.shutdown(wait=False, cancel_futures=True)
        for process in ours:
            process.terminate()
        for process in ours:
            process.join()


def _end_with_parent() -> None:
    """End this worker with its parent, also if that is killed."""

    def watch() -> None:
        if (parent := multiprocessing.parent_process()) is not None:
            parent.join()
            os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()


def expected_points(fixture: Mutant, rubric: Rubric) -> float:
    return rubric.max_points - lost_points(fixture, rubric)


@cache
def lacking_packages(lab: str) -> list[str]:
    """Return what the lab's correct package depends on and this machine does not have."""
    manifest = read_manifest(source_of(lab, REFERENCE) / rubric_of(lab).package)[0]
    return [one.name for one in manifest.dependencies if ros_packages().lacks(one.name)] if manifest else []


def surprises(result: GradingResult, fixture: Mutant, rubric: Rubric) -> list[str]:
    """What is not as the fixture expects, a line each; empty where all is well."""
    found = [line for c in result.criteria for line in _surprises_of(c, fixture)]
    points = expected_points(fixture, rubric)
    if result.points != points:
        found.append(f"points: wanted {points:g}, got {result.points:g}")
    return found


def _surprises_of(criterion: CriterionResult, fixture: Mutant) -> Iterator[str]:
    said = f"{criterion.message} [measured: {criterion.measured}] [hint: {criterion.hint}]"
    wanted = fixture.expect.get(criterion.id, Status.PASS.value)
    if criterion.status.value != wanted:
        yield f"{criterion.id}: wanted {wanted}, got {criterion.status.value}: {said}"
    pattern = fixture.message.get(criterion.id, "")
    if not re.search(pattern, said, re.IGNORECASE):
        yield f"{criterion.id}: says nothing like {pattern!r}: {said}"
    yield from fixture.wrong_words(criterion)
