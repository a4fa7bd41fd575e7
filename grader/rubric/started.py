"""What scenarios start, and what criteria ask of that: files of another package, runs without the student's processes,
topics that no program of the run has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from grader.checks.registry import Check
from grader.rubric.scenario import ROSTEST_ENDING
from grader.rubric.simulators import PROGRAMS, asked_topics
from grader.rubric.yaml_lines import Fault, KeyPath, as_maps, criteria_of, packages_in
from grader.wording import join_words

KINDS_OF_FILES = ("script", "launch", "load")
OPEN_ENDINGS = (".launch", ".xml", ROSTEST_ENDING)
"""Of programs that may start others."""
NAMED_AS_PACKAGE = frozenset({"manifest", "cmake"})
"""Checks whose `name` is that of the package that they judge."""


def started_faults(
    rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield what of that can be seen in the rubric alone."""
    yield from _nothing_of_students(rubric, scenarios, checks)
    yield from _tests_without_run(rubric, scenarios)
    yield from _other_packages(rubric, scenarios)
    yield from _without_program(rubric)


def starts_of(scenario: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what a scenario starts."""
    return [start for _, start in as_maps(scenario.get("start"))]


def _nothing_of_students(
    rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield runs that start the grader's programs only, and by which a criterion judges the student's package."""
    of_runs = {name for name, check in checks.items() if check.needs_run}
    judged = {criterion.run for criterion in criteria_of(rubric) if criterion.check in of_runs}
    for name, scenario in scenarios.items():
        starts = starts_of(scenario)
        programs = [str(start["program"]) for start in starts if start.get("program") is not None]
        is_open = any(program.endswith(OPEN_ENDINGS) for program in programs)
        if name in judged and programs and len(programs) == len(starts) and not is_open:
            fault = (
                f"starts {join_words(programs)}, and nothing of the student's: add a script or a launch file"
            )
            yield ("scenarios", name, "start"), fault


def _tests_without_run(rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield criteria by tests that a scenario runs and that do not name it."""
    runs = {
        str(start["tests"]): name
        for name, scenario in scenarios.items()
        for start in starts_of(scenario)
        if start.get("tests") is not None
    }
    for criterion in criteria_of(rubric):
        file = str(criterion.given.get("file"))
        if criterion.check == "pytest" and not criterion.has_run and file in runs:
            yield (*criterion.place, "scenario"), f"is missing: {runs[file]} runs {file}"


def _other_packages(rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield files that are of another package elsewhere in the rubric, and names of packages that are not judged."""
    packages = packages_in(rubric)
    first = packages[0] if packages else ""
    named: list[tuple[KeyPath, str, str, bool]] = []
    for name, scenario in scenarios.items():
        for index, start in as_maps(scenario.get("start")):
            for key in KINDS_OF_FILES:
                if isinstance(start.get(key), str):
                    owner, is_given = str(start.get("package") or first), start.get("package") is not None
                    at: KeyPath = ("scenarios", name, "start", index, key)
                    named.append((at, _plain(start[key]), owner, is_given))
    for criterion in criteria_of(rubric):
        given, package = criterion.given, criterion.data.get("package")
        owner, asked = str(package or first), given.get("name")
        if criterion.check == "executable" and isinstance(given.get("path"), str):
            named.append(((*criterion.at, "path"), _plain(given["path"]), owner, package is not None))
        if criterion.check in NAMED_AS_PACKAGE and asked in packages and asked != owner:
            fault = (
                f"this criterion judges {owner}: write name: {owner}, or package: {asked} beside its check"
            )
            yield (*criterion.at, "name"), fault
    for at, file, owner, is_given in named:
        others = {other for _, same, other, is_said in named if same == file and other != owner and is_said}
        if not is_given and others:
            elsewhere = join_words(sorted(others))
            fault = (
                f"is looked for in {owner}, and elsewhere it is in {elsewhere}: write package: {elsewhere}"
            )
            yield at, fault


def _plain(path: str) -> str:
    return PurePosixPath(path).name


def _without_program(rubric: dict[str, Any]) -> Iterator[Fault]:
    """Yield topics of the turtle simulator's and the robot world's that nothing in the run publishes."""
    for criterion in criteria_of(rubric):
        starts = starts_of(criterion.scenario)
        programs = [str(start.get("program")) for start in starts if start.get("program") is not None]
        are_others = [one.endswith(OPEN_ENDINGS) or one.partition("/")[0] not in OWNERS for one in programs]
        may_start_others = [
            {"launch", "built"} & one.keys() or str(one.get("script")) in PROGRAMS for one in starts
        ]
        is_open = any(are_others) or any(may_start_others)
        for at, topic in asked_topics(criterion.given):
            owner = next((known for known, one in PROGRAMS.items() if one.published.fullmatch(topic)), "")
            if starts and not is_open and owner and owner not in programs and _is_own(topic, owner):
                fault = f"{criterion.run} does not start {owner}, which publishes {topic}"
                yield (*criterion.at, *at), fault


OWNERS = frozenset(program.partition("/")[0] for program in PROGRAMS)


def _is_own(topic: str, program: str) -> bool:
    """Return whether nothing but the program would publish there: `/scan` and `/odom` may come from anywhere."""
    return program.startswith("turtlesim/") or topic == "/base_pose_ground_truth"
