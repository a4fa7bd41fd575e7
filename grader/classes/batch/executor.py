"""Who does the jobs of a batch: processes of this machine here, a cluster's workers in `grader.classes.cluster`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from queue import SimpleQueue
from typing import Protocol

from grader.classes.batch.child import Child
from grader.classes.batch.job import Job, Outcome


class Hands(Protocol):
    """Does jobs, many at a time."""

    def run(self, jobs: Iterable[Job], *, begun: Callable[[str], None]) -> Iterator[Outcome]:
        """Each job's outcome as it comes. Jobs are taken when there are hands for them; `begun` is told of each.

        There is an outcome for every job, whatever happens to it. When the caller stops asking, what runs is
        interrupted and has cleaned up when this returns.
        """
        ...


class Processes:
    """`count` processes of this machine, each of which does one job at a time."""

    def __init__(self, count: int) -> None:
        self.count = max(count, 1)

    def run(self, jobs: Iterable[Job], *, begun: Callable[[str], None]) -> Iterator[Outcome]:
        """As `Hands.run` says."""
        waiting = iter(jobs)
        idle: SimpleQueue[Child] = SimpleQueue()
        children: list[Child] = []
        running: set[Future[Outcome]] = set()
        with ThreadPoolExecutor(self.count) as threads:
            try:
                while True:
                    for job in islice(waiting, self.count - len(running)):
                        if idle.empty() and len(children) < self.count:
                            children.append(Child())
                            idle.put(children[-1])
                        begun(job.entry.id)
                        running.add(threads.submit(_done, idle, job))
                    if not running:
                        break
                    done, running = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        yield future.result()
            finally:
                for child in children:
                    child.interrupt()
                wait(running)
                for child in children:
                    child.close()


def _done(idle: SimpleQueue[Child], job: Job) -> Outcome:
    child = idle.get()
    try:
        return child.do(job)
    finally:
        idle.put(child)
