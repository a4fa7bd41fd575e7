"""What the client sends to a worker, and what comes back."""

from __future__ import annotations

from grader.classes.batch.job import Job, Outcome
from grader.classes.cluster.exchange import Parcel
from grader.errors import PackageNotFound, SubmissionError
from grader.model.record import Record

NOT_THE_MACHINES = (SubmissionError.kind, PackageNotFound.kind)


class Errand(Record):
    """A job on its way to a worker.

    `exchange` is the URL to leave the results at, `batch` whose job it is, and the topic of its events. `seen`: its
    source is a path that the client sees.
    """

    job: Job
    exchange: str
    batch: str
    seen: bool


class Report(Record):
    """What became of it on `machine`. Without a `parcel` there are no results to be put into place."""

    outcome: Outcome
    machine: str
    parcel: Parcel | None = None


def failed(job: Job, *, kind: str, message: str, hint: str) -> Outcome:
    """The outcome of a job that could not be done."""
    most = job.rubric.rubric.max_points
    return Outcome(id=job.entry.id, status="error", max_points=most, kind=kind, message=message, hint=hint)


def is_machines(outcome: Outcome) -> bool:
    """Whether it is an error that is not the submission's."""
    return outcome.status == "error" and outcome.kind not in NOT_THE_MACHINES
