"""What scenarios start, and what criteria ask of that: files of another package, runs without the student's processes,
topics that no program of the run has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from grader.checks.registry import Check
from grader.rubric.scenario import ROSTEST_ENDING
from grader.rubric.simulators import PROGRAMS, asked_topics
from grader.rubric.yaml_lines import Fault, KeyPath, as_map, as_maps, packages_in
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
    yield from _without_program(rubric, scenarios)


def starts_of(scenario: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what a scenario starts."""
    return [start for _, start in as_maps(scenario.get("start"))]


def _nothing_of_students(
    rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    """Yield runs that start the grader's programs only, and by which a criterion judges the student's package."""
    judged = {
        str(one.get("scenario"))
        for _, one in as_maps(rubric.get("criteria"))
        if (check := checks.get(str(one.get("check")))) and check.needs_run
    }
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
    for index, criterion in as_maps(rubric.get("criteria")):
        file = str(as_map(criterion.get("with")).get("file"))
        if criterion.get("check") == "pytest" and criterion.get("scenario") is None and file in runs:
            yield ("criteria", index, "scenario"), f"is missing: {runs[file]} runs {file}"


def _other_packages(rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield files that are of another package elsewhere in the rubric, and names of packages that are not judged."""
    packages = packages_in(rubric)
    first = packages[0] if packages else ""
    named: list[tuple[KeyPath, str, str, bool]] = []
    for name, scenario in scenarios.items():
        for index, start in as_maps(scenario.get("start")):
            for key in KINDS_OF_FILES:
                if isinstance(start.get(key), str):
                    at: KeyPath = ("scenarios", name, "start", index, key)
                    named.append(
                        (
                            at,
                            _plain(start[key]),
                            str(start.get("package") or first),
                            start.get("package") is not None,
                        )
                    )
    for index, criterion in as_maps(rubric.get("criteria")):
        given, owner = as_map(criterion.get("with")), str(criterion.get("package") or first)
        at, is_given = ("criteria", index, "with"), criterion.get("package") is not None
        if criterion.get("check") == "executable" and isinstance(given.get("path"), str):
            named.append(((*at, "path"), _plain(given["path"]), owner, is_given))
        asked = given.get("name")
        if str(criterion.get("check")) in NAMED_AS_PACKAGE and asked in packages and asked != owner:
            fault = (
                f"this criterion judges {owner}: write name: {owner}, or package: {asked} beside its check"
            )
            yield (*at, "name"), fault
    for at, file, owner, is_given in named:
        others = {other for _, same, other, is_said in named if same == file and other != owner and is_said}
        if not is_given and others:
            elsewhere = join_words(sorted(others))
            yield (
                at,
                f"is looked for in {owner}, and elsewhere it is in {elsewhere}: write package: {elsewhere}",
            )


def _plain(path: str) -> str:
    return PurePosixPath(path).name


def _without_program(rubric: dict[str, Any], scenarios: Mapping[str, dict[str, Any]]) -> Iterator[Fault]:
    """Yield topics of the turtle simulator's and the robot world's that nothing in the run publishes."""
    for index, criterion in as_maps(rubric.get("criteria")):
        name = str(criterion.get("scenario"))
        starts = starts_of(scenarios.get(name, {}))
        programs = [str(start.get("program")) for start in starts if start.get("program") is not None]
        is_open = any(
            {"launch", "built"} & start.keys() or str(start.get("script")) in PROGRAMS for start in starts
        ) or any(
            program.endswith(OPEN_ENDINGS) or program.partition("/")[0] not in OWNERS for program in programs
        )
        for at, topic in asked_topics(as_map(criterion.get("with"))):
            owner = next((known for known, one in PROGRAMS.items() if one.published.fullmatch(topic)), "")
            if starts and not is_open and owner and owner not in programs and _is_own(topic, owner):
                yield (
                    ("criteria", index, "with", *at),
                    f"{name} does not start {owner}, which publishes {topic}",
                )


OWNERS = frozenset(program.partition("/")[0] for program in PROGRAMS)


def _is_own(topic: str, program: str) -> bool:
    """Return whether nothing but the program would publish there: `/scan` and `/odom` may come from anywhere."""
    return program.startswith("turtlesim/") or topic == "/base_pose_ground_truth"
