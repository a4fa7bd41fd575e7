"""The rubrics of the labs, and whole submissions as evidence for labs of a talker, a listener and a launch file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from grader.checks import CHECKS
from grader.judging import judge, total_points
from grader.model.result import CriterionResult
from grader.package.launch import parse_launch_files
from grader.rubric.model import Rubric
from tests.support.timeline import build_runs

ROOT = Path(__file__).parents[2]
STOPPED = {"stopped_by": "INT", "exit_code": 0}
SHEBANG = "#!/usr/bin/env python"
WORDS = ["qwertz", "asdfgh", "yxcvbn"]


@dataclass(frozen=True, kw_only=True)
class Lab:
    """`talker` and `listener` are paths; their stems are the scenarios' and the processes' names."""

    id: str
    package: str
    talker: str
    listener: str
    talker_node: str
    listener_node: str
    launch: str
    text: str
    heard: str

    @cached_property
    def rubric(self) -> Rubric:
        return rubric_of(self.id)

    @property
    def launch_text(self) -> str:
        return (ROOT / "reference_solutions" / self.id / self.package / self.launch).read_text(
            encoding="utf-8"
        )

    def submission(
        self,
        *,
        channel: dict[str, Any] | None = None,
        listener_node: str = "",
        heard: str = "",
        depends: tuple[str, ...] = ("rospy", "std_msgs"),
        calls: tuple[list[str], ...] | None = None,
        files: tuple[str, ...] = (),
        launch: str = "",
        launched: dict[str, Any] | None = None,
    ) -> dict[str, Any]:
        """The reference solution's evidence, but for what is given."""
        talker, listener = Path(self.talker).stem, Path(self.listener).stem
        topic = {"topic": "/chatter", "callerid": self.talker_node, "count": 62}
        topic |= {"values": {"text": self.text}} | (channel or {})
        up = launched or {"topics": [{"topic": "/chatter", "callerid": "/pub_node"}]}
        return {
            "runs": {
                talker: {
                    "topics": [topic],
                    "processes": [{"name": talker, "nodes": [topic["callerid"]], "exit_s": 6.9, **STOPPED}],
                },
                listener: {
                    "subscribers": {"/chatter": [listener_node or self.listener_node]},
                    "processes": [
                        {"name": listener, "nodes": [listener_node or self.listener_node], **STOPPED}
                    ],
                    "actors": [{"action": "publish", "topic": "/chatter", "values": WORDS, "at_s": 1}],
                    "console": [
                        {
                            "process": listener,
                            "lines": [(heard or self.heard) % word for word in WORDS],
                            "at_s": 1.01,
                        }
                    ],
                },
                "launch": {"processes": [{"name": "roslaunch", **STOPPED}], **up},
                "package": {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0}]},
            },
            "package": {
                **self._files(files or (self.talker, self.listener), launch),
                "name": self.package,
                "manifest": {
                    "dependencies": [["buildtool_depend", "catkin"], *(["exec_depend", d] for d in depends)]
                },
                "cmake": {"calls": list(calls or self.calls())},
            },
        }

    def _files(self, scripts: tuple[str, ...], launch: str) -> dict[str, Any]:
        texts = {self.launch: (launch or self.launch_text).encode()}
        return {
            "files": [
                {"path": "package.xml"},
                {"path": "CMakeLists.txt"},
                {"path": self.launch},
                *({"path": path, "shebang": SHEBANG} for path in scripts),
            ],
            "launch_files": [file.model_dump() for file in parse_launch_files(texts, (self.package,))],
        }

    def calls(self, *scripts: str) -> tuple[list[str], ...]:
        """CMake's calls, with these scripts (both where none is named) installed."""
        named = scripts or (self.talker, self.listener)
        install = ["catkin_install_python", "PROGRAMS", *named, "DESTINATION", f"lib/{self.package}"]
        return (["project", self.package], ["find_package", "catkin"], ["catkin_package"], install)

    def judge(self, **changes: Any) -> tuple[CriterionResult, ...]:
        """Return the results where the submission has these changes."""
        return judge(self.rubric, build_runs(self.submission(**changes)))

    def lost(self, **changes: Any) -> dict[str, str]:
        """The status of each criterion that is not reached, where the submission has these changes."""
        return lost_of(self.rubric, self.judge(**changes))


def rubric_of(lab: str) -> Rubric:
    """The rubric of a lab that comes with the grader."""
    text = (ROOT / "rubrics" / f"{lab}.yaml").read_text(encoding="utf-8")
    return Rubric.model_validate(yaml.safe_load(text))


def lost_of(rubric: Rubric, results: Sequence[CriterionResult]) -> dict[str, str]:
    """The status of each criterion that is not reached."""
    lost = {r.id: r.status.value for r in results if r.status.value != "pass"}
    assert bool(lost) == (total_points(rubric, results) < 100)
    for result in results:
        if result.status.value == "blocked":
            assert result.message.startswith("blocked by ")
    return lost


def assert_sound(rubric: Rubric, points: dict[str, int]) -> None:
    """The points that are fixed, parameters that fit their checks, and a command to try for each criterion."""
    assert {c.id: c.points for c in rubric.criteria} == points
    assert rubric.max_points == sum(points.values()) == 100
    for criterion in rubric.criteria:
        check = CHECKS[criterion.check]
        check.params.model_validate(criterion.parameters)
        assert (criterion.scenario is not None) is check.needs_run
        assert criterion.reproduce
