"""The tasks that are under way on a cluster."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from pickle import dumps
from typing import Any

from grader.classes.batch.job import Job
from grader.classes.cluster import worker
from grader.classes.cluster.errands import Errand

MISSES = 2


@dataclass(kw_only=True, eq=False)
class Task:
    """A job under way. `begun` counts the workers that began it, `lost` how often what they left was lost; `missed` how
    often in a row nobody had it when we looked. `placing`: its results are being put into place."""

    job: Job
    future: Any = None
    begun: int = 0
    lost: int = 0
    missed: int = 0
    placing: bool = False


class Tasks:
    """Those that the cluster has, by key, and `back`: those that are to be handed out again.

    `ended(key)` is called, in a thread of the client's, when one has ended.
    """

    def __init__(self, client: Any, exchange: str, batch: str, ended: Callable[[str], None]) -> None:  # noqa: ANN401
        self.back: deque[Task] = deque()
        self._client, self._exchange, self._batch, self._ended = client, exchange, batch, ended
        self._held: dict[str, Task] = {}
        self._numbers = count()

    def __len__(self) -> int:
        return len(self._held)

    def get(self, key: str) -> Task | None:
        """The task that was handed out with that key last."""
        return self._held.get(key)

    def hand_out(self, task: Task, workers: list[str]) -> None:
        """To one of these workers."""
        source = Path(task.job.entry.source)
        errand = Errand(
            job=task.job,
            exchange=self._exchange,
            batch=self._batch,
            seen=source.is_absolute() and (source.exists() or source.is_symlink()),
        )
        key = f"grade-{self._batch}-{next(self._numbers)}"
        task.missed, task.placing = 0, False
        task.future = self._client.submit(
            worker.perform, dumps(errand), key=key, pure=False, workers=workers, allow_other_workers=False
        )
        self._held[key] = task
        task.future.add_done_callback(lambda _: self._ended(key))

    def take_out(self, key: str) -> Task:
        """It is no longer under way."""
        task = self._held.pop(key)
        with suppress(Exception):  # its worker is gone, or the scheduler
            task.future.cancel()
        return task

    def take_back(self, key: str) -> None:
        """It will be handed out again."""
        self.back.append(self.take_out(key))

    def missed_by(self, held: set[str]) -> list[str]:
        """The keys that nobody has, several times in a row: they wait for workers that are gone, or are done and no
        report came."""
        found = []
        for key, task in self._held.items():
            missing = key not in held and not task.placing and task.future.status in ("pending", "finished")
            task.missed = task.missed + 1 if missing else 0
            found += [key] if task.missed >= MISSES else []
        return found

    def cancel_all(self) -> None:
        """Whatever they were doing."""
        futures = [task.future for task in self._held.values()]
        self._held.clear()
        self._client.cancel(futures)
