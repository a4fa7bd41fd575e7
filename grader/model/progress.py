"""How the rooms report what they are doing, without knowing the display."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, Protocol

from grader.model.result import EarlyVerdict

StepState = Literal["waiting", "running", "done", "failed", "skipped"]


class Progress(Protocol):
    """A display of a grading's progress. Safe to call from any thread, cheap enough to call often."""

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        """Show that one step (`intake`, `build`, a scenario's name) is now in `state`.

        `detail` says what it does or waits for; `expected_s` is how long the whole step is likely to take.
        """

    def early(self, verdicts: Callable[[], tuple[EarlyVerdict, ...]]) -> None:
        """Show what the files alone decide, which `verdicts` works out. A display need not call it."""


class Silence:
    """Shows nothing."""

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        """Show that one step (`intake`, `build`, a scenario's name) is now in `state`."""

    def early(self, verdicts: Callable[[], tuple[EarlyVerdict, ...]]) -> None:
        """Show what the files alone decide, which `verdicts` works out. A display need not call it."""
