"""Small rubrics and runs for tests of judging and of reports."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from grader.evidence.run import Run
from grader.model.repair import Repair
from grader.rubric.model import Rubric
from tests.support.timeline import build_runs

SCENARIO = {
    "title": "t",
    "start": [{"name": "talker", "script": "src/numeric_talker.py"}],
    "until": {"window_s": 6, "topics": ["/chatter"]},
}


def rubric(*criteria: dict[str, Any], **keys: Any) -> Rubric:
    """A rubric of these criteria; what they do not say is filled in. The scenario is called `talker`."""
    filled = [{"title": c["id"], "points": 10, **c} for c in criteria]
    data = {
        "schema": "grader.rubric/1",
        "id": "r",
        "title": "r",
        "version": "1",
        "package": "lab1",
        "scenarios": {"talker": SCENARIO},
        "criteria": filled,
        **keys,
    }
    return Rubric.model_validate(data)


def on_copy(runs: Mapping[str, Run], *repairs: Repair) -> dict[str, Run]:
    """The runs as those of a copy with these repairs."""
    about = {"repairs": json.dumps([repair.model_dump() for repair in repairs])}
    return {
        f"repaired-1/{name}": replace(run, metadata={**run.metadata, **about}) for name, run in runs.items()
    }


CMAKE_CHECK = {"id": "cmake", "check": "cmake", "with": {"name": "lab1"}}
EXECUTABLE = {"id": "executable", "check": "executable", "with": {"path": "src/numeric_talker.py"}}
NODE = {
    "id": "node",
    "check": "node-lives",
    "with": {"process": "talker"},
    "scenario": "talker",
    "requires": ["executable"],
}
CHATTER = {
    "id": "chatter",
    "check": "topic-type",
    "with": {"topic": "/chatter", "type": "std_msgs/String"},
    "scenario": "talker",
    "requires": ["node"],
}
RATE = {
    "id": "rate",
    "check": "rate",
    "with": {"topic": "/chatter", "rate_hz": 10},
    "scenario": "talker",
    "requires": ["chatter", "node"],
}
ALL = (RATE, CHATTER, NODE, EXECUTABLE)

SCRIPT = {"path": "src/numeric_talker.py", "shebang": "#!/usr/bin/env python3"}
PACKAGE = {"files": [SCRIPT]}
GOOD_RUN = {
    "topics": [{"topic": "/chatter", "count": 61}],
    "processes": [{"name": "talker", "stopped_by": "INT", "exit_code": 0, "exit_s": 6.8}],
    "actors": [{"action": "interrupt", "actor": "grader", "detail": "talker", "at_s": 6.6}],
}


def built(package: dict[str, Any], *, exit_code: int, said: Sequence[str] = ()) -> dict[str, Run]:
    """Return the run of a build that ended so, of a package with these facts."""
    made = {"name": "catkin_make", "role": "build", "exit_s": 3, "exit_code": exit_code}
    console = [{"process": "catkin_make", "stream": "stderr", "lines": [*said]}] if said else []
    run = {"package": package, "processes": [made], "console": console}
    return build_runs({"runs": {"package": run}})
