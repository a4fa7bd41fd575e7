"""The Python API: the same flow, files and errors as the command line's, for scripts, notebooks and servers.

    from grader import GraderError, grade, judge, load_rubric

    rubric = load_rubric("leeds-comp3631-lab1")
    try:
        result = grade("submissions/ada", rubric, "results")
    except GraderError as error:
        print(error.message, error.hint)
    else:
        print(result.points, result.max_points)

Nothing here prints, reads the command line or changes handlers of signals for longer than a run. Everything may be
called from any thread, and from several at once; gradings take turns at starting processes, as those of other graders
on the machine do.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePath
from platform import python_version
from typing import TypeAlias, get_args

from grader import __version__
from grader.errors import EvidenceError, UsageError
from grader.evidence.run import Run
from grader.faults import NOTHING_RUN
from grader.files import check_writable
from grader.judging.recordings import PACKAGE_RUN
from grader.model.progress import Silence, StepState
from grader.model.result import EnvironmentInfo, GradingResult, SubmissionInfo
from grader.model.submission import SandboxMode
from grader.results import RESULT, read_result_file
from grader.rubric.load import LoadedRubric
from grader.rubric.load import load_rubric as load_file
from grader.steps import NOTHING_TOOK, outcome, run_aside, waited_for

StrPath: TypeAlias = "str | os.PathLike[str]"
SANDBOXES = get_args(SandboxMode)
Told: TypeAlias = Callable[[str, str, str], None]
"""Of a step: its name, its state (`waiting`, `running`, `done`, `failed`, `skipped`), and what it does or waits for."""


def load_rubric(id_or_path: StrPath) -> LoadedRubric:
    """The rubric of that id, of those that come with the grader, or in that YAML file.

    A `Path` is always a file; a text is an id if there is such a rubric. `.rubric` has what the file says, `.digest`
    its sha256. Raises RubricError, whose `faults` name each fault with file, line and key.

    >>> from grader import load_rubric
    >>> lab = load_rubric("leeds-comp3631-lab1")
    >>> lab.rubric.package, lab.rubric.max_points
    ('lab1', 100.0)
    """
    text = _text(id_or_path)
    return load_file(text if isinstance(id_or_path, str) else f"{Path(text).absolute()}")


def grade(
    source: StrPath,
    rubric: StrPath | LoadedRubric,
    out: StrPath = "grader-results",
    *,
    submission_id: str | None = None,
    sandbox: SandboxMode = "auto",
    static_only: bool = False,
    keep_hidden: bool = True,
    progress: Told | None = None,
) -> GradingResult:
    """Grade one submission, as `grader grade` does: build it, run it, record it, judge the recording, write reports.

    `source` is a folder, an archive (`.zip`, `.tar.*`), a recording (`.bag`, `.mcap`) or a git URL with an optional
    `@ref`. `rubric` is what `load_rubric` takes or gives. Results go to `out/<submission id>/` and take the place of
    older ones; the folders are made. `submission_id` is by default made from `source`.

    `sandbox`: `auto` shuts students' code in where this machine can, `require` raises SandboxMissing (a HostError)
    where it cannot, `none` never does. `static_only` runs nothing: what only a run can show is `inconclusive`. Without
    `keep_hidden`, hidden criteria are left out of the files; the record that is returned has them all.

    It takes as long as the rubric's scenarios (half a minute, usually), and may be called where an event loop runs, as
    in a notebook: that waits meanwhile. `await asyncio.to_thread(grade, …)` lets it go on. Ctrl-C ends what runs in
    order and raises KeyboardInterrupt. `progress` is called with a step (`intake`, `build`, a scenario's name), its
    state and a detail, from whatever thread is at it; what it raises ends what runs in order, and is raised from here.

    Points are those of the rubric, times seconds. Raises GraderError where it cannot be graded: SubmissionError where
    the submission is at fault, HostError where this machine is, RubricError and UsageError for wrong arguments. All but
    the last two leave a `result.json` of status `error`, as long as there is no complete one from before.
    """
    from grader import pipeline  # noqa: PLC0415 - judging needs nothing of it
    from grader.arena.asynchronous import Stop, Stopped  # noqa: PLC0415 - as above

    if sandbox not in SANDBOXES:
        raise UsageError(f"sandbox is {sandbox!r}", hint=f"it is one of {', '.join(SANDBOXES)}")
    given, loaded, folder = _text(source), _loaded(rubric), Path(out)
    check_writable(folder)
    stop = Stop()
    telling = _Telling(progress, stop.ask)
    options = pipeline.GradeOptions(
        sandbox=sandbox,
        submission_id=submission_id,
        static_only=static_only,
        keep_hidden=keep_hidden,
        stop=stop,
    )
    try:
        with waited_for():
            result = run_aside(lambda: pipeline.grade(given, loaded, folder, options, telling), stop.ask)
    except Stopped:
        if telling.error is None:
            raise
    if telling.error is not None:
        raise telling.error
    return result


def judge(evidence: StrPath | Sequence[StrPath], rubric: StrPath | LoadedRubric) -> GradingResult:
    """Judge what was recorded before, as `grader judge` does: nothing is run and nothing written, no ROS is needed.

    `evidence` is a folder of results, its `evidence/`, or files (`.mcap`, `.bag`) of one submission. The same evidence
    and rubric always give an equal result, apart from `environment`, which names this grader and Python; its `criteria`
    are those that `grade` gives. What people decided and what being late costs is not in it, and all times are 0.

    `submission` is what the evidence says of it: of another tool's recording, the file's name.

    Raises EvidenceError where the evidence cannot be read (by a newer grader's, it says so), RubricError.
    """
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - slow to load
    from grader.judging import judge as criteria_of  # noqa: PLC0415 - as above

    paths = [evidence] if isinstance(evidence, (str, os.PathLike)) else evidence
    loaded = _loaded(rubric)
    runs = load_evidence([Path(path) for path in paths])
    criteria = criteria_of(loaded.rubric, runs, loaded.checks)
    result = outcome(_submission(runs), loaded, runs, criteria, timing=NOTHING_TOOK)
    return result.model_copy(update={"environment": _environment(runs)})


def load_result(path: StrPath) -> GradingResult:
    """A `result.json` of any version that a grader wrote, or the one in that folder of results.

    Raises EvidenceError where there is none, where it is damaged, and where a newer grader wrote it.
    """
    file = Path(path) / RESULT if Path(path).is_dir() else Path(path)
    try:
        result = read_result_file(file)
    except OSError as error:
        raise EvidenceError(f"{file}: {error.strerror}", hint="give a folder of results") from error
    if result is None:
        raise EvidenceError(f"{file}: not what a grader writes", hint="grade the submission again")
    return result


class _Telling(Silence):
    """Tells a caller of each step. What the caller raises ends the run, and is kept in `error`."""

    def __init__(self, told: Told | None, stop: Callable[[], None]) -> None:
        self._told = told
        self._stop = stop
        self.error: BaseException | None = None

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:  # noqa: ARG002
        """One step is now in that state."""
        if self._told is None or self.error is not None:
            return
        try:
            self._told(name, state, detail)
        except BaseException as error:  # noqa: BLE001 - it is raised again when the run has ended in order
            self.error = error
            self._stop()


def _text(path: StrPath) -> str:
    text = os.fspath(path)
    if isinstance(text, bytes):
        raise TypeError("paths are text, not bytes")
    return text


def _loaded(rubric: StrPath | LoadedRubric) -> LoadedRubric:
    return rubric if isinstance(rubric, LoadedRubric) else load_rubric(rubric)


def _said(runs: Mapping[str, Run], key: str) -> str:
    """What the evidence says of itself; the package's own file comes first in it."""
    ordered = sorted(runs.values(), key=lambda run: run.scenario != PACKAGE_RUN)
    return next((run.metadata[key] for run in ordered if run.metadata.get(key)), "")


def _submission(runs: Mapping[str, Run]) -> SubmissionInfo:
    name = next(iter(runs.values())).evidence
    return SubmissionInfo(
        id=_said(runs, "submission.id") or PurePath(name).stem,
        source=_said(runs, "submission.source") or name,
        commit=_said(runs, "submission.commit") or None,
        digest=_said(runs, "submission.digest"),
        package=_said(runs, "submission.package"),
    )


def _environment(runs: Mapping[str, Run]) -> EnvironmentInfo:
    return EnvironmentInfo(
        grader=__version__,
        ros=_said(runs, "ros"),
        python=python_version(),
        sandbox=_said(runs, "sandbox") or NOTHING_RUN,
    )
