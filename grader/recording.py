"""Records what a rubric needs of one submission: by which recorder, what is recorded again, and what besides.

A `RecordingJob` comes in: the submission, its facts, the rubric and a folder. Evidence goes out, in that folder.
`make_recorder` chooses the arena, the files alone or recordings that were handed in; `record_all` records each
scenario. `judge_recorded` judges them and records again what the machine was too late for; `record_other_runs` adds
repeats of losses and the runs of a repaired copy. How a run is recorded is the business of `arena`.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from grader.errors import HostError
from grader.evidence.run import Run
from grader.files import make_folder
from grader.judging.judge import Judgement, judge_all_runs
from grader.judging.repeats_and_repairs import REPAIRED, REPAIRED_AGAIN, REPAIRS, REPEATED, was_built
from grader.model.package import PackageFacts
from grader.model.result import Progress
from grader.model.submission import Submission
from grader.package.facts import read_packages
from grader.ros_env import look_for, why_nodes_cannot_run
from grader.rubric.load import LoadedRubric, goals_of, needs_ros, rates_of, select_started, watched_of
from grader.rubric.made_up import KEY
from grader.rubric.model import Rubric
from grader.wording import join_words

if TYPE_CHECKING:
    from grader.arena.interruption import Stop
    from grader.arena.recorder import Recorder
    from grader.arena.static_recorder import StaticRecorder
    from grader.model import SandboxMode

DEFERRED_IMPORTS = "grader.evidence.reader"
"""Slow to import, and needed by no verdict that the files alone decide: imported while the build runs. The arena is
imported when it begins, and what judges or reports recordings when it is called."""

RunsAndJudgement: TypeAlias = tuple[dict[str, Run], Judgement]
"""The runs by scenario, and what was judged by them."""


@dataclass(frozen=True, kw_only=True)
class RecordingOptions:
    """How a submission is recorded.

    `static_only` runs nothing. `reused` is evidence by scenario that still holds: these scenarios are not run again.
    `stop` ends the runs in order, from another thread; then `arena.interruption.Stopped` is raised.
    """

    sandbox: SandboxMode = "auto"
    static_only: bool = False
    reused: Mapping[str, Path] = field(default_factory=dict)
    stop: Stop | None = None


@dataclass(frozen=True, kw_only=True)
class RecordingJob:
    """A submission to record into the folder `evidence`."""

    submission: Submission
    facts: PackageFacts
    rubric: LoadedRubric
    evidence: Path
    options: RecordingOptions
    progress: Progress


def make_recorder(
    job: RecordingJob, *, only: Collection[str] | None = None, about: Mapping[str, str] | None = None
) -> Recorder | StaticRecorder:
    """Return what records the rubric's scenarios (`only` these), to be used as a context: the arena, or a recorder of
    files alone where nothing is to be run, or can be. `about` goes into the metadata."""
    from grader.arena.static_recorder import STATIC_ONLY, StaticRecorder  # noqa: PLC0415 - see DEFERRED_IMPORTS

    make_folder(job.evidence)
    rubric, options = job.rubric.rubric, job.options
    scenarios = select_started(rubric, only)
    # without ROS nothing is an error: the files are judged, and the rest is inconclusive
    reason = STATIC_ONLY if options.static_only or not needs_ros(job.rubric) else why_nodes_cannot_run()
    if reason:
        return StaticRecorder(
            job.submission,
            job.facts,
            scenarios,
            job.evidence,
            reason=reason,
            progress=job.progress,
            recorded=options.reused,
        )
    from grader.arena.recorder import Recorder  # noqa: PLC0415 - see DEFERRED_IMPORTS

    refuse_missing(rubric)
    made_up = {KEY: json.dumps(rubric.values)} if rubric.values else {}
    return Recorder(
        job.submission,
        job.facts,
        scenarios,
        job.evidence,
        whole=rubric,
        beside=job.rubric.path.parent,
        rates=rates_of(rubric),
        watched=watched_of(rubric),
        goals=goals_of(rubric),
        mode=options.sandbox,
        progress=job.progress,
        recorded=options.reused,
        stop=options.stop,
        about={**made_up, **(about or {})},
    )


def refuse_missing(rubric: Rubric) -> None:
    """Raise HostError where this machine lacks what the rubric says that the lab needs."""
    lacking = [need for need in look_for(**rubric.needs.model_dump()) if not need.here]
    if lacking:
        raise HostError(
            f"the lab needs {join_words(need.name for need in lacking)}, which this machine lacks",
            hint="; ".join(need.install for need in lacking),
        )


def record_all(job: RecordingJob, recorder: Recorder | StaticRecorder) -> None:
    """Record every scenario, and copy the recordings that scenarios name in the submission."""
    recorder.record_all(import_deferred)
    from grader.submitted_recordings import copy_recordings  # noqa: PLC0415 - see DEFERRED_IMPORTS

    copy_recordings(job.rubric.rubric, job.submission, job.evidence, job.progress)


def import_deferred() -> None:
    """Import it before it is needed."""
    import_module(DEFERRED_IMPORTS)


def judge_folder(evidence: Path, rubric: LoadedRubric) -> RunsAndJudgement:
    """Read and judge what is in the folder. Raises EvidenceError."""
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - see DEFERRED_IMPORTS

    runs = load_evidence([evidence])
    return runs, judge_all_runs(rubric.rubric, runs, rubric.checks, rubric.handed_out)


def judge_recorded(
    recorder: Recorder | StaticRecorder, evidence: Path, rubric: LoadedRubric
) -> RunsAndJudgement:
    """Judge what is in the folder. What this recorder recorded and cannot be judged because the machine was late is
    recorded again, alone, at most `RETRIES` times."""
    from grader.arena.recording_files import RETRIES  # noqa: PLC0415 - see DEFERRED_IMPORTS

    runs, judged = judge_folder(evidence, rubric)
    for _ in range(RETRIES):
        # what was recorded earlier and reused has been through this
        again = judged.undecided & {path.stem for path in recorder.recording.files}
        if not again:
            break
        recorder.record_again(sorted(again))
        runs, judged = judge_folder(evidence, rubric)
    return runs, judged


def record_other_runs(
    job: RecordingJob, recorder: Recorder | StaticRecorder, judged: RunsAndJudgement
) -> bool:
    """Record what a lost mark needs besides the first runs, which were `judged`, and return whether there was anything.

    A run whose timing could have cost the mark is repeated. Where a mechanical repair could be the reason for the loss,
    a repaired copy is run.
    """
    # nothing was run, so no run can be repeated
    if recorder.recording.sandbox is None and recorder.recording.ros is None:
        return False
    from grader import repaired_copy as copies  # noqa: PLC0415 - only a lost mark needs it

    runs, judgement = judged
    repairs, scenarios = copies.choose_repairs(
        job.submission,
        recorder.recording.facts,
        job.rubric.rubric,
        judgement.criteria,
        built=was_built(runs),
    )
    # those scenarios are run with the repaired copy, which shows as much
    doubtful = sorted(judgement.doubtful - set(scenarios))
    if doubtful:
        recorder.repeat(doubtful, job.evidence / REPEATED)
    if not repairs:
        return bool(doubtful)
    with copies.repaired_copy(job.submission, repairs) as copy:
        if copy is None:
            return bool(doubtful)
        of_copy = replace(
            job,
            submission=copy,
            facts=read_packages(copy, job.rubric.rubric.launch_commands),
            evidence=job.evidence / REPAIRED,
            options=replace(job.options, reused={}),  # earlier evidence is of the package as it is
            progress=copies.CopyProgress(job.progress),
        )
        about = {REPAIRS: copies.dump_repairs(repairs)}
        with make_recorder(of_copy, only=scenarios, about=about) as again:
            again.record_all(lambda: None)
            _, on_copy = judge_recorded(again, job.evidence, job.rubric)
            if on_copy.doubtful_on_copy:
                again.repeat(sorted(on_copy.doubtful_on_copy), job.evidence / REPAIRED_AGAIN)
        recorder.recording.add(again.recording)
    return True
