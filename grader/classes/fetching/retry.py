"""What the network failed at is tried again, after a while."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from grader.errors import SubmissionError
from grader.intake.git import GitFailed
from grader.intake.git_errors import explained, may_pass
from grader.intake.source import Source

Answer = TypeVar("Answer")


@dataclass(frozen=True, kw_only=True)
class Patience:
    """How often something is tried, and how long it waits before: `wait_s`, then `growth` times as long each time.

    Each wait is up to half longer or shorter, so that a class does not come back to its server all at once.
    """

    tries: int = 3
    wait_s: float = 1.0
    growth: float = 4.0
    sleep: Callable[[float], None] = time.sleep
    chance: Callable[[], float] = random.random

    def wait(self, failed: int) -> None:
        """After that many failures."""
        self.sleep(self.wait_s * self.growth ** (failed - 1) * (0.5 + self.chance()))


class GivenUp(Exception):
    """What may pass did not, as often as it was tried."""

    def __init__(self, failure: GitFailed, tries: int) -> None:
        super().__init__(failure.stderr)
        self.failure = failure
        self.tries = tries


def patiently(ask: Callable[[], Answer], patience: Patience) -> Answer:
    """The answer of `ask`. Raises GivenUp, or the GitFailed that no waiting would help."""
    failed = 0
    while True:
        try:
            return ask()
        except GitFailed as failure:
            failed += 1
            if not may_pass(failure):
                raise
            if failed >= patience.tries:
                raise GivenUp(failure, failed) from None
        patience.wait(failed)


def error_of(problem: GitFailed | GivenUp, source: Source) -> SubmissionError:
    """The error to raise, which says how often it was tried."""
    if isinstance(problem, GitFailed):
        return explained(problem, source)
    error = explained(problem.failure, source)
    again = f" (tried {problem.tries} times)" if problem.tries > 1 else ""
    return type(error)(f"{error.message}{again}", hint=error.hint)
