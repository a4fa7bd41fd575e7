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
from grader.classes.batch.job import Hands, Job, Outcome, Sandbox
from grader.classes.batch.reports import Settler, rewrite
from grader.classes.fetching import prefetch
from grader.classes.gradebook import write_gradebook
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides import read_overrides
from grader.errors import Busy, GraderError, UsageError
from grader.files import check_writable, keep_private, lock, make_folder
from grader.intake import safe_name, without_password
from grader.judging.summary import passed
from grader.model.batch import MISSING, BatchRun, Counts, CriterionInfo, State
from grader.model.result import GradingResult, RubricInfo
from grader.model.roster import Entry, Roster, RosterFault
from grader.pipeline import GradeOptions, prepare
from grader.report.class_page import write_class_page
from grader.results import finish_killed
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.shown import line

GRADEBOOK, RESULTS, INDEX = "gradebook.csv", "results.jsonl", "index.html"
RESERVED = frozenset(
    {RUN, GRADEBOOK, RESULTS, INDEX, OVERRIDES, "similarity.json", "similarity.csv", "changes.csv"}
)


@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """`jobs` submissions side by side; `only` as `--only` has it. With `same_commit`, what is
    graded again is the commit of the earlier result. What `cluster` and those below it say stands in `run.json`, so
    that the same can be asked for again."""

    out: Path
    jobs: int
    sandbox: Sandbox = "auto"
    static_only: bool = False
    before: datetime | None = None
    only: Sequence[str] = ()
    same_commit: bool = False
    cluster: str = ""
    cluster_insecure: bool = False
    allow_local: tuple[str, ...] = ()
    remote_only: bool = False


class Watcher(Protocol):
    """Is told how a batch goes."""

    def planned(self, total: int) -> None:
        """So many submissions are to be done."""

    def begun(self, name: str) -> None:
        """This one is being done."""

    def ended(self, outcome: Outcome) -> None:
        """One came to its end."""


@dataclass(frozen=True, kw_only=True)
class _Batch:
    """What all of a batch knows. `folder.run.entries` are the roster's without passwords."""

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
    hands: Hands,
    watcher: Watcher,
) -> BatchFolder:
    """Grade what the roster names into `options.out`, and write `run.json`, `results.jsonl`, `gradebook.csv`
    and `index.html`.

    What is complete is not done again. Where this is interrupted, what there is by then is in the gradebook.
    Raises UsageError for an option that does not fit the roster, Busy where another batch works in the same folder,
    EvidenceError where a newer grader has written there, OutputError where it cannot be written, and KeyboardInterrupt.
    """
    roster = _gradable(roster, options.out)
    check(roster.entries, options.only)
    check_writable(options.out)
    is_new = make_folder(options.out)
    with alone(options.out):
        finish_killed(options.out)
        overrides = read_overrides(options.out / OVERRIDES, rubric.rubric, ids_of(roster))
        own = _kept_private(options.out, is_new=is_new)
        folder = BatchFolder(options.out, _run_of(roster, rubric_source, rubric, options, own_folder=own))
        folder.refuse_newer()
        write_run(options.out, folder.run)
        batch = _Batch(
            roster=roster,
            rubric=rubric,
            options=options,
            folder=folder,
            settler=Settler(rubric.rubric, overrides),
        )
        state: State = "interrupted"
        kept = 0
        try:
            for outcome in _outcomes(batch, hands, watcher):
                kept += outcome.kept
                watcher.ended(outcome)
            state = "complete"
        finally:
            folder = write_books(folder, rubric.rubric, state, kept)
    return folder


def _kept_private(out: Path, *, is_new: bool) -> bool:
    """Whether a batch made this folder: then it is for its owner alone. Any other one keeps the mode that it has."""
    with suppress(UsageError):
        is_new = is_new or open_batch(out).run.own_folder
    if is_new:
        keep_private(out)
    return is_new


def _outcomes(batch: _Batch, hands: Hands, watcher: Watcher) -> Iterator[Outcome]:
    """Each submission's, as it comes to its end; one that was complete is settled as it counts now."""
    options = batch.options
    todo = list(chosen(batch.roster.entries, options.only, batch.folder.earlier))
    watcher.planned(len(todo))
    if todo and not options.cluster:
        prepare(GradeOptions(sandbox=options.sandbox, static_only=options.static_only))
    since = time.time()
    entries = {entry.id: entry for entry, _ in todo}
    ahead = [entry for entry, _ in todo] if not options.cluster else []
    with prefetch(ahead, fetched_since=since):
        jobs = (_job(batch, entry, again=again, since=since) for entry, again in todo)
        for outcome in hands.run(jobs, begun=watcher.begun):
            entry = entries[outcome.id]
            decided = outcome.status == "error" and batch.settler.of(entry.id)
            yield _settled(batch, entry, outcome) if outcome.kept or decided else outcome


def _job(batch: _Batch, entry: Entry, *, again: bool, since: float) -> Job:
    options = batch.options
    earlier = batch.folder.earlier(entry)
    return Job(
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


def _settled(batch: _Batch, entry: Entry, outcome: Outcome) -> Outcome:
    """An override, an extension or a deadline may be new since its result was written, and people may give points for
    what could not be graded."""
    earlier = batch.folder.earlier(entry)
    if earlier is None or earlier.rubric.digest != batch.rubric.digest:
        return outcome
    now = batch.settler.again(earlier, entry.id, outcome.handed_in)
    if now == earlier:
        return outcome
    try:
        rewrite(batch.folder.folder_of(entry), now, batch.rubric.rubric, batch.rubric.docs)
    except GraderError as error:
        return outcome.model_copy(update={"status": "error", "kind": error.kind, "message": error.message})
    ok = passed(batch.rubric.rubric, now)
    return outcome.model_copy(update={"status": now.status, "points": now.points, "passed": ok})


def _run_of(
    roster: Roster, rubric_source: str, rubric: LoadedRubric, options: BatchOptions, *, own_folder: bool
) -> BatchRun:
    return BatchRun(
        state="running",
        grader=__version__,
        **described(rubric, rubric_source),
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
        entries=tuple(_without_password(entry) for entry in roster.entries),
    )


def described(rubric: LoadedRubric, rubric_source: str) -> dict[str, Any]:
    """What `run.json` says of the rubric, by its keys."""
    lab = rubric.rubric
    return {
        "rubric": RubricInfo(id=lab.id, version=lab.version, digest=rubric.digest),
        "rubric_source": rubric_source,
        "title": lab.title,
        "max_points": lab.max_points,
        "criteria": tuple(CriterionInfo(id=c.id, title=c.title, max_points=c.points) for c in lab.criteria),
    }


def _without_password(entry: Entry) -> Entry:
    return entry.model_copy(update={"source": without_password(entry.source)})


def ids_of(roster: Roster | BatchRun) -> list[str]:
    """Of all that may stand in `overrides.yaml`: what cannot be graded, too."""
    return [
        *(entry.id for entry in roster.entries),
        *(fault.id for fault in roster.faults if fault.id is not None),
    ]


def _gradable(roster: Roster, out: Path) -> Roster:
    """The roster without the folder of results itself, and without ids whose folders would be in the way of files."""
    entries, faults = [], list(roster.faults)
    for entry in roster.entries:
        if Path(entry.source) == out.absolute():
            continue
        if safe_name(entry.id).casefold() in RESERVED:
            text = f"id: {entry.id} is the name of a file of the batch's own"
            faults.append(RosterFault(where=entry.where, id=entry.id, text=text))
        else:
            entries.append(entry)
    return roster.model_copy(update={"entries": tuple(entries), "faults": tuple(faults)})


def write_books(
    folder: BatchFolder, rubric: Rubric, state: State, kept: int, *, ended_at: datetime | None = None
) -> BatchFolder:
    """`gradebook.csv`, `results.jsonl`, `index.html`, and `run.json` with what it all came to, which is given back.

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
def alone(out: Path) -> Iterator[None]:
    """Hold a batch's folder. Raises Busy where another batch does."""
    descriptor = os.open(out, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        held = True
        with suppress(OSError):  # a file system without locks: whoever shares it has to know what they do
            held = lock(descriptor)
        if not held:
            raise Busy(
                f"another batch works in {out} just now",
                hint="wait until it has ended, or choose another --out",
            )
        yield
    finally:
        os.close(descriptor)


# [classes.batch.selection] `--only`: which submissions of a batch are done, and whether once more.

FAILED, INCONCLUSIVE, CHANGED = "failed", "inconclusive", "changed"
WORDS = (FAILED, INCONCLUSIVE, CHANGED)
NAME_CHARS = 80


def chosen(
    entries: Sequence[Entry], only: Sequence[str], earlier: Callable[[Entry], GradingResult | None]
) -> Iterator[tuple[Entry, bool]]:
    """The entries to look at, each with whether it is graded even where it is complete.

    Without `only`, all. `failed`: those that could not be graded, or have no result. `inconclusive`: those that say so.
    `changed`: those with a result; it stays unless the submission, the rubric or the grader is another one now. An id:
    that one. Raises UsageError for an id that is none.
    """
    check(entries, only)
    names = {safe_name(name).casefold() for name in only if name not in WORDS}
    for entry in entries:
        if not only:
            yield entry, False
        elif safe_name(entry.id).casefold() in names:
            yield entry, True
        elif any(word in only for word in WORDS):
            result = earlier(entry)
            status = result.status if result else "error"
            if (status == "error" and FAILED in only) or (status == "inconclusive" and INCONCLUSIVE in only):
                yield entry, True
            elif result is not None and CHANGED in only:
                yield entry, False


def check(entries: Sequence[Entry], only: Sequence[str]) -> None:
    """Raise UsageError for an id that no entry has."""
    known = {safe_name(entry.id).casefold(): entry.id for entry in entries}
    for name in only:
        if name in WORDS or safe_name(name).casefold() in known:
            continue
        near = get_close_matches(name, list(known.values()), n=1)
        hint = f"did you mean {line(near[0], NAME_CHARS)}?" if near else f"an id, or {', '.join(WORDS)}"
        raise UsageError(
            f"--only {line(name, NAME_CHARS)}: no submission of that id in the roster", hint=hint
        )
