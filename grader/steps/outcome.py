"""What it all came to: the result, and what was printed while it ran."""

from __future__ import annotations

import time
from platform import python_version
from typing import TYPE_CHECKING

from grader import __version__
from grader.evidence.run import Run
from grader.faults import NOTHING_RUN
from grader.judging.summary import notes_of, overall_status, total_points
from grader.model.result import (
    CriterionResult,
    EnvironmentInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
    TimingInfo,
)
from grader.rubric.load import LoadedRubric

if TYPE_CHECKING:
    from grader.arena.recorded import Recording


NOTHING_TOOK = TimingInfo(wall_s=0.0, cpu_s=0.0, student_cpu_s=0.0)


class Clock:
    """Seconds since now: of the wall, and of this process's CPU."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.monotonic(), time.process_time()

    def timing(self, recording: Recording | None) -> TimingInfo:
        """What it took until now, with what the recording took in other processes."""
        cpu_s, student_cpu_s = (recording.cpu_s, recording.student_cpu_s) if recording else (0.0, 0.0)
        return TimingInfo(
            wall_s=round(time.monotonic() - self._wall, 3),
            cpu_s=round(time.process_time() - self._cpu + cpu_s, 3),
            student_cpu_s=round(student_cpu_s, 3),
        )


def outcome(
    submission: SubmissionInfo,
    rubric: LoadedRubric,
    runs: dict[str, Run],
    criteria: tuple[CriterionResult, ...],
    *,
    recording: Recording | None = None,
    timing: TimingInfo,
) -> GradingResult:
    """The automatic result. Without a `recording`, nothing was run."""
    ros, sandbox = (recording.ros, recording.sandbox) if recording else (None, None)
    return GradingResult(
        submission=submission,
        rubric=RubricInfo(id=rubric.rubric.id, version=rubric.rubric.version, digest=rubric.digest),
        status=overall_status(criteria),
        points=total_points(rubric.rubric, criteria),
        max_points=rubric.rubric.max_points,
        criteria=criteria,
        environment=EnvironmentInfo(
            grader=__version__,
            ros=ros.label if ros else "",
            python=python_version(),
            sandbox=sandbox.label if sandbox else NOTHING_RUN,
        ),
        timing=timing,
        notes=notes_of(runs),
    )


def console_log(runs: dict[str, Run]) -> str:
    """What the build and the student's processes printed, by scenario, with seconds since the run began."""
    lines = []
    for name, run in runs.items():
        lines += [f"== {name}"] if run.console else []
        own = {event.name for _, event in run.processes if event.role == "grader"}
        for time_ns, line in run.console:
            if line.process in own:
                continue
            text = line.line.replace("\n", "\\n")  # a line is one, whatever a recording says
            lines.append(f"{(time_ns - run.start_ns) / 1e9:8.3f} {line.process} {line.stream}: {text}")
    return "".join(f"{line}\n" for line in lines)
