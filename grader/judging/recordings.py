"""Which recording of another tool stands for which scenario."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

from grader.evidence.events import RECORDING_MISSING, RECORDING_PROBLEM
from grader.evidence.run import Run
from grader.model.verdict import Verdict, inconclusive, unjudged
from grader.rubric.model import Rubric, Scenario

PACKAGE_RUN = "package"


def with_recordings(rubric: Rubric, runs: Mapping[str, Run]) -> dict[str, Run]:
    """The grader's own runs by scenario, and for each scenario without one the recording that stands for it.

    A recording is known by its name (`talker.bag` for the scenario `talker`) or by the scenario's pattern. A single
    one that was judged without a package stands for everything.
    """
    own = {name: run for name, run in runs.items() if not run.foreign}
    foreign = [run for run in runs.values() if run.foreign]
    alone = foreign[0] if len(foreign) == 1 and PACKAGE_RUN not in own else None
    found = dict(own)
    for name, scenario in rubric.scenarios.items():
        run = own.get(name) or _named(name, scenario, foreign) or alone
        if run is not None:
            found[name] = run
    return found


def _named(name: str, scenario: Scenario, foreign: list[Run]) -> Run | None:
    by_name = [run for run in foreign if run.scenario == name]
    pattern = PurePosixPath(scenario.recording or "").name
    fitting = [run for run in foreign if fnmatchcase(run.evidence.casefold(), pattern.casefold())]
    found = by_name or fitting
    return found[0] if len(found) == 1 else None


def unread_recording(run: Run) -> Verdict | None:
    """Why there is nothing to judge where a scenario's recording was not found or could not be read."""
    if RECORDING_MISSING in run.metadata:
        pattern = run.metadata[RECORDING_MISSING]
        message = f"no recording {pattern} is in the submission"
        hint = "record with `rosbag record`, end it with Ctrl-C, and hand the file in"
        return unjudged(message, measured="no recording", hint=hint)
    if RECORDING_PROBLEM in run.metadata:
        return inconclusive(
            run.metadata[RECORDING_PROBLEM], hint="hand in one recording that `rosbag info` can read"
        )
    return None
