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
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, TypeAlias, TypeVar, get_args

from grader.errors import UsageError
from grader.evidence.events import PACKAGE_RUN
from grader.evidence.run import Run
from grader.files import check_writable
from grader.model import SandboxMode
from grader.model.result import NO_TIME, GradingResult, Progress, Silence, StepState, SubmissionInfo
from grader.portable import on_interrupt, wait_for_children
from grader.rubric.load import LoadedRubric
from grader.rubric.load import load_rubric as load_file

if TYPE_CHECKING:
    from grader.arena.interruption import Stop

StrPath: TypeAlias = "str | os.PathLike[str]"
SANDBOXES = get_args(SandboxMode)
T = TypeVar("T")
OnStep: TypeAlias = Callable[[str, str, str], None]
"""Of a step: its name, its state (`waiting`, `running`, `done`, `failed`, `skipped`), and what it does or waits for."""


def load_rubric(id_or_path: StrPath) -> LoadedRubric:
    """Load the rubric with that id, one of those that come with the grader, or the one in that YAML file.

    A `Path` is always a file; a string is an id if there is such a rubric. `.rubric` holds what the file says,
    `.digest` its sha256. Raises RubricError, whose `faults` name each fault with file, line and key.

    >>> from grader import load_rubric
    >>> lab = load_rubric("leeds-comp3631-lab1")
    >>> lab.rubric.package, lab.rubric.max_points
    ('lab1', 100.0)
    """
    text = _text(id_or_path)
    # a `Path` is made absolute, so that a file of that name in the current folder is never taken for an id
    return load_file(text if isinstance(id_or_path, str) else f"{Path(text).absolute()}")


def grade(
    source: StrPath,
    rubric: StrPath | LoadedRubric,
    out: StrPath = "grader-results",
    *,
    submission_id: str | None = None,
    package: str | None = None,
    sandbox: SandboxMode = "auto",
    static_only: bool = False,
    keep_hidden: bool = True,
    progress: OnStep | None = None,
) -> GradingResult:
    """Grade one submission, as `grader grade` does: build it, run it, record it, judge the recording, write reports.

    `source` is a folder, an archive (`.zip`, `.tar.*`), a recording (`.bag`, `.mcap`, `.db3`) or a git URL with an
    optional `@ref`. `rubric` is what `load_rubric` takes or returns. Results go to `out/<submission id>/` and replace
    older ones; missing folders are made. By default, the id is made from `source`, and `package` is the rubric's.

    `sandbox`: `auto` confines students' code where this machine can, `require` raises SandboxMissing (a HostError)
    where it cannot, `none` never does. `static_only` runs nothing: what only a run can show is `inconclusive`. Without
    `keep_hidden`, hidden criteria are left out of the files; the returned result has them all.

    It takes as long as the rubric's scenarios (usually half a minute). Where an event loop runs, as in a notebook, the
    loop waits until then; `await asyncio.to_thread(grade, …)` lets it go on. Ctrl-C ends the runs in order and raises
    KeyboardInterrupt. `progress` is called, from any thread, with a step (`intake`, `build`, a scenario's name), its
    state and a detail; an exception from it ends the runs in order and is raised from here.

    Points are those of the rubric, times seconds. Raises GraderError: SubmissionError where the submission is at fault,
    HostError where this machine is, RubricError and UsageError for wrong arguments. All but the last two leave a
    `result.json` with the status `error`, unless there is a complete one from before.
    """
    from grader import pipeline  # noqa: PLC0415 - loading a rubric needs nothing of it

    if sandbox not in SANDBOXES:
        raise UsageError(f"sandbox is {sandbox!r}", hint=f"it is one of {', '.join(SANDBOXES)}")
    given, loaded, folder = _text(source), _load_rubric(rubric), Path(out)
    check_writable(folder)

    def work(stop: Stop, steps: Progress) -> GradingResult:
        options = pipeline.GradeOptions(
            sandbox=sandbox,
            submission_id=submission_id,
            package=package or "",
            static_only=static_only,
            keep_hidden=keep_hidden,
            stop=stop,
        )
        return pipeline.grade(given, loaded, folder, options, steps)

    return _run_stoppable(work, progress)


def judge(evidence: StrPath | Sequence[StrPath], rubric: StrPath | LoadedRubric) -> GradingResult:
    """Judge what was recorded before, as `grader judge` does: nothing is run or written, and no ROS is needed.

    `evidence` is a folder of results, its `evidence/`, or files (`.mcap`, `.bag`, `.db3`) of one submission. The same
    evidence and rubric always give an equal result, apart from `environment`, which names this grader and Python; its
    `criteria` are those that `grade` returns. It holds no overrides and no late penalty, and all its times are 0.

    `submission` is what the evidence says of it; for another tool's recording, the file's name.

    Raises EvidenceError where the evidence cannot be read (or a newer grader wrote it), RubricError.
    """
    from grader.evidence.reader import load_evidence  # noqa: PLC0415 - slow to load
    from grader.judging import judge as criteria_of  # noqa: PLC0415 - as above
    from grader.judging.summary import assemble_result, environment_info  # noqa: PLC0415 - as above

    paths = [evidence] if isinstance(evidence, (str, os.PathLike)) else evidence
    loaded = _load_rubric(rubric)
    runs = load_evidence([Path(path) for path in paths])
    criteria = criteria_of(loaded.rubric, runs, loaded.checks, loaded.handed_out)
    return assemble_result(
        _submission(runs),
        loaded,
        criteria,
        runs=runs,
        environment=environment_info(_metadata(runs, "ros"), _metadata(runs, "sandbox")),
        timing=NO_TIME,
    )


def _run_stoppable(work: Callable[[Stop, Progress], T], on_step: OnStep | None) -> T:
    """Return what `work` returns. Whatever `on_step` raises stops it, and is raised when it has ended in order."""
    from grader.arena.interruption import Stop, Stopped  # noqa: PLC0415 - loading a rubric needs nothing of it

    stop = Stop()
    listener = _StepListener(on_step, stop.ask)
    try:
        with wait_for_children():
            result = _run_beside_loop(lambda: work(stop, listener), stop.ask)
    except Stopped:
        if listener.error is None:
            raise
    if listener.error is not None:
        raise listener.error
    return result


def _run_beside_loop(work: Callable[[], T], stop: Callable[[], None]) -> T:
    """Return what `work` returns. It starts an event loop: where one runs in this thread, it gets a thread of its own,
    and Ctrl-C asks `stop` to end it, and is raised when it has ended.
    """
    if not _loop_runs_here():
        return work()
    with ThreadPoolExecutor(1, thread_name_prefix="grader") as executor:
        future = executor.submit(work)
        try:
            # asyncio's own handler takes effect when its loop goes on, which is too late
            with on_interrupt(signal.default_int_handler):
                return future.result()
        except KeyboardInterrupt:
            stop()
            raise


def _loop_runs_here() -> bool:
    if "asyncio" not in sys.modules:  # slow to import, and there is no loop without it
        return False
    import asyncio  # noqa: PLC0415

    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


class _StepListener(Silence):
    """Calls `on_step` with each step. An exception from it ends the run, and is kept in `error`."""

    def __init__(self, on_step: OnStep | None, stop: Callable[[], None]) -> None:
        self._on_step = on_step
        self._stop = stop
        self.error: BaseException | None = None

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:  # noqa: ARG002
        if self._on_step is None or self.error is not None:
            return
        try:
            self._on_step(name, state, detail)
        except BaseException as error:  # noqa: BLE001 - raised again when the run has ended in order
            self.error = error
            self._stop()


def _text(path: StrPath) -> str:
    text = os.fspath(path)
    if isinstance(text, bytes):
        raise TypeError("paths are text, not bytes")
    return text


def _load_rubric(rubric: StrPath | LoadedRubric) -> LoadedRubric:
    return rubric if isinstance(rubric, LoadedRubric) else load_rubric(rubric)


def _metadata(runs: Mapping[str, Run], key: str) -> str:
    """Return what the evidence says of itself: the package's own file first, then those of the runs."""
    ordered = sorted(runs.values(), key=lambda run: run.scenario != PACKAGE_RUN)
    return next((run.metadata[key] for run in ordered if run.metadata.get(key)), "")


def _submission(runs: Mapping[str, Run]) -> SubmissionInfo:
    name = next(iter(runs.values())).evidence
    return SubmissionInfo(
        id=_metadata(runs, "submission.id") or PurePath(name).stem,
        source=_metadata(runs, "submission.source") or name,
        commit=_metadata(runs, "submission.commit") or None,
        digest=_metadata(runs, "submission.digest"),
        package=_metadata(runs, "submission.package"),
    )
