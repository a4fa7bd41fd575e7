"""Which workers of a cluster can grade: each is asked once who it is, and left out by name where it differs."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from grader.arena.ros_env import INSTALL_HINT
from grader.classes.cluster import worker
from grader.classes.cluster.connect import is_encrypted

OPEN = "it listens without certificates: start it with the protocol of its scheduler"
Answer = Mapping[str, str] | BaseException | None


@dataclass(frozen=True, kw_only=True)
class Needs:
    """What a worker must have: the client's `versions`, what its answer must say of the exchange, and ROS.

    `encrypted`: it must listen as the scheduler does, with certificates.
    """

    versions: Mapping[str, str]
    ros: bool
    encrypted: bool = False


class Crew:
    """`fit` maps the address of each worker that can grade to its number of threads.

    `ask(address)` blocks until the worker has answered; `heard(address, answer)` is called with what it said, in any
    thread, and is to call `settle` in the client's own.
    """

    def __init__(
        self, needs: Needs, ask: Callable[[str], Answer], heard: Callable[[str, Answer], None]
    ) -> None:
        self.fit: dict[str, int] = {}
        self.left_out: dict[str, str] = {}
        self._needs, self._ask, self._heard = needs, ask, heard
        self._threads: dict[str, int] = {}

    @property
    def threads(self) -> int:
        """Of all that can grade, together."""
        return sum(self.fit.values())

    @property
    def asked(self) -> int:
        """How many have not answered yet."""
        return len(self._threads) - len(self.fit) - len(self.left_out)

    def update(self, threads: Mapping[str, int]) -> None:
        """The workers that the scheduler knows now, and how many threads each has."""
        for address in self._threads.keys() - threads.keys():
            self._forget(address)
        for address in threads.keys() - self._threads.keys():
            self._threads[address] = threads[address]
            threading.Thread(target=self._asked, args=(address,), daemon=True).start()

    def settle(self, address: str, answer: Answer) -> str:
        """Take a worker's answer in; why it is left out, in one line, or nothing."""
        if address not in self._threads:
            return ""
        if answer is None or isinstance(answer, OSError):
            self._forget(address)  # gone while it was asked, or asked again
            return ""
        is_open = self._needs.encrypted and not is_encrypted(address)
        why = OPEN if is_open else why_not(answer, self._needs)
        if not why:
            self.fit[address] = self._threads[address]
            return ""
        host = "" if isinstance(answer, BaseException) else f" ({answer.get('host', '')})"
        self.left_out[address] = f"{address}{host}: {why}"
        return self.left_out[address]

    def _asked(self, address: str) -> None:
        self._heard(address, self._ask(address))

    def _forget(self, address: str) -> None:
        self._threads.pop(address, None)
        self.fit.pop(address, None)
        self.left_out.pop(address, None)


def ask_of(client: Any, exchange: str, word: str) -> Callable[[str], Answer]:  # noqa: ANN401 - Dask has no types
    """How a worker is asked by that client."""

    def ask(address: str) -> Answer:
        try:
            said = client.run(worker.answer, exchange, word, workers=[address], on_error="return")
        except Exception as error:  # noqa: BLE001 - whatever it is, it is this worker's answer
            return error
        found: Answer = said.get(address)
        return found

    return ask


def why_not(answer: Mapping[str, str] | BaseException, needs: Needs) -> str:
    """Why a worker that says this cannot grade; nothing where it can."""
    if isinstance(answer, BaseException) and has_no_grader(answer):
        return "no grader like this one is installed there"
    if isinstance(answer, BaseException):
        return f"it cannot answer: {type(answer).__name__}: {answer}"
    for name, here in needs.versions.items():
        there = answer.get(name, "")
        if there != here and name == "code":
            return "its grader has other files than this one: update both, and start it again"
        if there != here:
            return f"it has {name} {there or 'of no version'}, here it is {here}"
    if needs.ros and not answer.get("ros"):
        return f"no ROS 1 there; {INSTALL_HINT}"
    return answer.get("kept_out", "")


def has_no_grader(error: BaseException) -> bool:
    """Whether that is why a worker or scheduler could not answer. Dask sends some errors as their text."""
    return isinstance(error, ImportError) or "ModuleNotFoundError" in str(error)
