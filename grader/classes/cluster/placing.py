"""A report that came back: its parcel is unpacked into the batch's folder, and every attempt of that job deleted."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import BinaryIO

from grader.classes.batch.job import Job, Outcome
from grader.classes.cluster.errands import Report, is_machines
from grader.classes.cluster.exchange import Exchange, Parcel, unpack
from grader.errors import HostError
from grader.intake import safe_name
from grader.results import RESULT, Results

READS = 5
PAUSE_S = 1.0


class ParcelLost(HostError):
    """What a worker left cannot be had: the job is done once more."""


def place(job: Job, report: Report, exchange: Exchange) -> Outcome:
    """The outcome, once the results are in `job.out`. An error that is not the submission's takes no complete result's
    place.

    Raises ParcelLost, and what `Results` raises.
    """
    name, outcome = safe_name(job.entry.id), report.outcome
    if report.parcel is None:
        return outcome
    with Results(job.out / name) as results:
        if is_machines(outcome) and results.complete:
            stays = f"the result of an earlier run stays as it is: {results.folder / RESULT}"
            outcome = outcome.model_copy(update={"hint": stays})
        else:
            _unpack(report.parcel, exchange, results)
            results.commit()
    with suppress(HostError, OSError):  # whatever is left goes with the exchange
        exchange.forget(name)
    return outcome


def _unpack(parcel: Parcel, exchange: Exchange, results: Results) -> None:
    try:
        with _opened(exchange, parcel) as stream:
            unpack(stream, parcel, results.new)
    except (HostError, OSError) as error:
        message = getattr(error, "message", "") or str(error)
        raise ParcelLost(message, hint=getattr(error, "hint", "")) from error
    if not any(results.evidence.iterdir()):
        results.evidence.rmdir()
    if not (results.new / RESULT).is_file():
        raise ParcelLost(f"{parcel.name} holds no {RESULT}")


def _opened(exchange: Exchange, parcel: Parcel) -> BinaryIO:
    """A shared folder may show a new file some time later."""
    for _ in range(READS - 1):
        with suppress(FileNotFoundError):
            return exchange.open(parcel)
        time.sleep(PAUSE_S)
    return exchange.open(parcel)
