"""A batch from its roster to its gradebook. Begin reading at `run_batch`."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Protocol

from grader import __version__
from grader.classes.batch.folder import RUN, BatchFolder, open_batch, write_run
from grader.classes.batch.job import Executor, GradingJob, SubmissionOutcome
from grader.classes.batch.renew_results import Settler, rewrite
from grader.classes.gradebook import write_gradebook
from grader.classes.overrides import COMMENTS_FILE as BANK
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides import read_overrides
from grader.errors import Busy, GraderError, UsageError
from grader.files import check_writable, keep_private, make_folder, try_lock
from grader.intake.credentials import without_password
from grader.intake.names import folder_key
from grader.judging.summary import passed
from grader.model import SandboxMode
from grader.model.batch import MISSING, BatchRun, Counts, CriterionInfo, Entry, Roster, RosterFault, State
from grader.model.result import GradingResult, RubricInfo
from grader.pipeline import GradeOptions, provide_base_workspace
from grader.report.class_page.page import write_class_page
from grader.results import finish_killed
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.untrusted_text import line

GRADEBOOK, RESULTS, INDEX = "gradebook.csv", "results.jsonl", "index.html"
RESERVED = frozenset(
    {RUN, GRADEBOOK, RESULTS, INDEX, OVERRIDES, BANK, "changes.csv", "similarity.csv", "similarity.json"}
    | {"published.jsonl", "sent.jsonl", "feedback", "mails", "markers.json"}
)
"""No submission may be called so: its folder of results would lie there."""
FAILED, INCONCLUSIVE, CHANGED = "failed", "inconclusive", "changed"
WORDS = (FAILED, INCONCLUSIVE, CHANGED)
NAME_CHARS = 80


@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """`jobs` submissions side by side; `only` as on the command line. With `same_commit`, the commit of the earlier
    result is graded again. `cluster` and the fields below it stand in `run.json`, for `regrade` to use again.
    """

    out: Path
    jobs: int
    sandbox: SandboxMode = "auto"
    static_only: bool = False
    before: datetime | None = None
    only: Sequence[str] = ()
    same_commit: bool = False
    cluster: str = ""
    cluster_insecure: bool = False
    allow_local: tuple[str, ...] = ()
    remote_only: bool = False


class Watcher(Protocol):
    """Follows a batch."""

    def planned(self, total: int) -> None:
        """`total` submissions will be graded."""

    def begun(self, name: str) -> None:
        """The submission of that id begins."""

    def ended(self, outcome: SubmissionOutcome) -> None:
        """A submission has its outcome."""


@dataclass(frozen=True, kw_only=True)
class _Batch:
    """What every part of a batch knows. `folder.run.entries` are the roster's without passwords."""

    roster: Roster
    rubric: LoadedRubric
    options: BatchOptions
    folder: BatchFolder
    settler: Settler


def run_batch(
    roster: Roster,
    rubric_source: str,
    rubric: LoadedRubric,
    options: BatchOptions,
    *,
    executor: Executor,
    watcher: Watcher,
) -> BatchFolder:
    """Grade the roster's submissions into `options.out`, and write `run.json`, `results.jsonl`, `gradebook.csv` and
    `index.html`.

    What is complete is not done again. If this is interrupted, the gradebook holds what there is by then.
    Raises UsageError for an option that does not fit the roster, Busy if another batch works in the same folder,
    EvidenceError if a newer grader has written there, OutputError if it cannot be written, and KeyboardInterrupt.
    """
    roster = _gradable(roster, options.out)
    _check_only(roster.entries, options.only)
    check_writable(options.out)
    is_new = make_folder(options.out)
    with hold_folder(options.out):
        batch = _begin(roster, rubric_source, rubric, options, is_new=is_new)
        # until the last outcome is there: whatever ends the loop, the gradebook says how far it came
        state: State = "interrupted"
        kept = 0
        try:
            for outcome in _grade_all(batch, executor, watcher):
                kept += outcome.kept
                watcher.ended(outcome)
            state = "complete"
        finally:
            folder = write_books(batch.folder, rubric.rubric, state, kept)
    return folder


def _begin(
    roster: Roster, rubric_source: str, rubric: LoadedRubric, options: BatchOptions, *, is_new: bool
) -> _Batch:
    """Take over the folder from an earlier batch, and write the `run.json` of one that is running."""
    out = options.out
    finish_killed(out)
    # before anything is written: a faulty file refuses the batch and changes nothing
    overrides = read_overrides(out / OVERRIDES, rubric.rubric, ids_of(roster))
    own_folder = _keep_private(out, is_new=is_new)
    folder = BatchFolder(out, _describe_run(roster, rubric_source, rubric, options, own_folder=own_folder))
    folder.refuse_newer()
    write_run(out, folder.run)
    settler = Settler(rubric.rubric, overrides)
    return _Batch(roster=roster, rubric=rubric, options=options, folder=folder, settler=settler)


def _keep_private(out: Path, *, is_new: bool) -> bool:
    """A folder that a batch made is for its owner alone; any other one keeps its mode. Return which of them it is."""
    # there was no batch here, or its `run.json` cannot be read
    with suppress(UsageError):
        is_new = is_new or open_batch(out).run.own_folder
    if is_new:
        keep_private(out)
    return is_new


def _grade_all(batch: _Batch, executor: Executor, watcher: Watcher) -> Iterator[SubmissionOutcome]:
    """Yield each submission's outcome as it comes; one that was complete is settled again."""
    options = batch.options
    todo = list(_select(batch.roster.entries, options.only, batch.folder.earlier))
    watcher.planned(len(todo))
    if todo and not options.cluster:  # what is made here is of no use on the machines of a cluster
        provide_base_workspace(GradeOptions(sandbox=options.sandbox, static_only=options.static_only))
    # whatever is fetched from here on is fresh enough for every job
    since = time.time()
    entries = {entry.id: entry for entry, _ in todo}
    jobs = (_job(batch, entry, again=again, since=since) for entry, again in todo)
    for outcome in executor.run(jobs, begun=watcher.begun):
        entry = entries[outcome.id]
        decided = outcome.status == "error" and batch.settler.of(entry.id)
        yield _settle_again(batch, entry, outcome) if outcome.kept or decided else outcome


def _job(batch: _Batch, entry: Entry, *, again: bool, since: float) -> GradingJob:
    options = batch.options
    earlier = batch.folder.earlier(entry)
    return GradingJob(
        entry=entry,
        rubric=batch.rubric,
        out=options.out.absolute(),
        sandbox=options.sandbox,
        static_only=options.static_only,
        before=options.before,
        overrides=batch.settler.of(entry.id),
        earlier=earlier,
        commit=earlier.submission.commit if earlier and options.same_commit else None,
        again=again,
        fetched_since=since,
    )


def _settle_again(batch: _Batch, entry: Entry, outcome: SubmissionOutcome) -> SubmissionOutcome:
    """An override, an extension or a deadline may be newer than the result, and people may award points for what could
    not be graded."""
    earlier = batch.folder.earlier(entry)
    if earlier is None or earlier.rubric.digest != batch.rubric.digest:
        return outcome
    now = batch.settler.settle_again(earlier, entry.id, outcome.handed_in)
    if now == earlier:
        return outcome
    try:
        rewrite(batch.folder.folder_of(entry), now, batch.rubric.rubric, batch.rubric.docs)
    except GraderError as error:
        return outcome.model_copy(update={"status": "error", "kind": error.kind, "message": error.message})
    ok = passed(batch.rubric.rubric, now)
    return outcome.model_copy(update={"status": now.status, "points": now.points, "passed": ok})


def _describe_run(
    roster: Roster, rubric_source: str, rubric: LoadedRubric, options: BatchOptions, *, own_folder: bool
) -> BatchRun:
    return BatchRun(
        state="running",
        grader=__version__,
        **describe_rubric(rubric, rubric_source),
        roster=roster.file,
        static_only=options.static_only,
        before=options.before,
        started_at=datetime.now(timezone.utc),
        jobs=options.jobs,
        cluster=options.cluster,
        cluster_insecure=options.cluster_insecure,
        own_folder=own_folder,
        allow_local=options.allow_local,
        remote_only=options.remote_only,
        columns=roster.columns,
        faults=roster.faults,
        entries=tuple(
            entry.model_copy(update={"source": without_password(entry.source)}) for entry in roster.entries
        ),
    )


def describe_rubric(rubric: LoadedRubric, rubric_source: str) -> dict[str, Any]:
    """Return what `run.json` says about the rubric, by key."""
    lab = rubric.rubric
    return {
        "rubric": RubricInfo(id=lab.id, version=lab.version, digest=rubric.digest),
        "rubric_source": rubric_source,
        "title": lab.title,
        "max_points": lab.max_points,
        "criteria": tuple(
            CriterionInfo(id=c.id, title=c.title, max_points=c.points, extra=c.extra) for c in lab.criteria
        ),
    }


def ids_of(roster: Roster | BatchRun) -> list[str]:
    """Return the ids that may stand in `overrides.yaml`: those that cannot be graded, too."""
    return [
        *(entry.id for entry in roster.entries),
        *(fault.id for fault in roster.faults if fault.id is not None),
    ]


def _gradable(roster: Roster, out: Path) -> Roster:
    """Return the roster without the folder of results itself, and without ids that name the batch's own files."""
    entries, faults = [], list(roster.faults)
    for entry in roster.entries:
        # a roster that is a folder of submissions may have the results in it
        if Path(entry.source) == out.absolute():
            continue
        if folder_key(entry.id) in RESERVED:
            text = f"id: {entry.id} is the name of one of the batch's own files"
            faults.append(RosterFault(where=entry.where, id=entry.id, text=text))
        else:
            entries.append(entry)
    return roster.model_copy(update={"entries": tuple(entries), "faults": tuple(faults)})


def write_books(
    folder: BatchFolder, rubric: Rubric, state: State, kept: int, *, ended_at: datetime | None = None
) -> BatchFolder:
    """Write `gradebook.csv`, `results.jsonl`, `index.html`, and `run.json` with counts; return the folder with them.

    `ended_at` is when the batch ended, by default now.
    """
    write_gradebook(folder.book(), folder.rows(), folder.path / RESULTS, "jsonl")
    write_gradebook(folder.book(), folder.rows(), folder.path / GRADEBOOK, "csv")
    at, counts = ended_at or datetime.now(timezone.utc), _counts(folder, rubric, kept)
    update = {"state": state, "ended_at": at, "counts": counts}
    ended = BatchFolder(folder.path, folder.run.model_copy(update=update))
    pairs = ((row.entry, row.result) for row in folder.rows())
    write_class_page(ended.run, pairs, folder.path / INDEX)
    write_run(folder.path, ended.run)
    return ended


def _counts(folder: BatchFolder, rubric: Rubric, kept: int) -> Counts:
    found: Counter[str] = Counter()
    for row in folder.rows():
        found["submissions"] += 1
        missing = row.result.error is not None and row.result.error.kind == MISSING
        found["missing" if missing else row.result.status] += 1
        found["passed"] += row.result.status != "error" and passed(rubric, row.result)
    return Counts(kept=kept, **found)


@contextmanager
def hold_folder(out: Path, who: str = "another batch works") -> Iterator[None]:
    """Hold a batch's folder. Raises Busy, which says `who` does, if another program holds it."""
    descriptor = os.open(out, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        if not try_lock(descriptor):
            raise Busy(f"{who} in {out} just now", hint="wait until it has ended, or choose another --out")
        yield
    finally:
        os.close(descriptor)


def _select(
    entries: Sequence[Entry], only: Sequence[str], earlier: Callable[[Entry], GradingResult | None]
) -> Iterator[tuple[Entry, bool]]:
    """Yield the entries that `--only` asks for, each with whether it is graded even if it is complete.

    Without `only`, all. `failed`: those that could not be graded, or have no result. `inconclusive`: those whose result
    is. `changed`: those with a result, which stays unless the submission, the rubric or the grader has changed. An id:
    that one.
    """
    names = {folder_key(name) for name in only if name not in WORDS}
    for entry in entries:
        if not only:
            yield entry, False
        elif folder_key(entry.id) in names:
            yield entry, True
        elif any(word in only for word in WORDS):
            result = earlier(entry)
            status = result.status if result else "error"
            if (status == "error" and FAILED in only) or (status == "inconclusive" and INCONCLUSIVE in only):
                yield entry, True
            elif result is not None and CHANGED in only:
                yield entry, False


def _check_only(entries: Sequence[Entry], only: Sequence[str]) -> None:
    """Raise UsageError for an id that no entry has, with the nearest one."""
    known = {folder_key(entry.id): entry.id for entry in entries}
    for name in only:
        if name in WORDS or folder_key(name) in known:
            continue
        near = get_close_matches(name, list(known.values()), n=1)
        hint = f"did you mean {line(near[0], NAME_CHARS)}?" if near else f"an id, or {', '.join(WORDS)}"
        raise UsageError(
            f"--only {line(name, NAME_CHARS)}: no submission of that id in the roster", hint=hint
        )
