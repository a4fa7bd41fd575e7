"""What a person decided and when it was handed in, applied to a result that is there already."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from grader.judge.settle import settle, unsettled
from grader.model.handed_in import HandedIn, Override
from grader.model.result import GradingResult
from grader.report.files import write_reports
from grader.results import EVIDENCE, Results
from grader.rubric.model import Rubric

CONSOLE = "console.log"


@dataclass(frozen=True)
class Settler:
    """Settles results by the rubric's late policy and by `overrides`: by submission, then by criterion."""

    rubric: Rubric
    overrides: Mapping[str, Mapping[str, Override]]

    def of(self, submission_id: str) -> Mapping[str, Override]:
        """A submission's overrides."""
        return self.overrides.get(submission_id, {})

    def settled(
        self, automatic: GradingResult, submission_id: str, handed_in: HandedIn | None, earlier: GradingResult
    ) -> GradingResult:
        """An automatic result made the one that counts; `earlier` is the one that it takes the place of."""
        return settle(
            automatic,
            self.rubric,
            overrides=self.of(submission_id),
            handed_in=handed_in or earlier.handed_in,
            before=earlier.overrides,
        )

    def again(self, result: GradingResult, submission_id: str, handed_in: HandedIn | None) -> GradingResult:
        """The same result as it counts now: an override or an extension may have come since."""
        automatic = unsettled(result, self.rubric)
        return self.settled(automatic, submission_id, handed_in, result)


def rewrite(folder: Path, result: GradingResult, rubric: Rubric) -> None:
    """Write the result's reports; the evidence that it was judged from stays. Raises as `Results` does."""
    with Results(folder) as results:
        write_reports(result, results.new, console="", rubric=rubric)
        (results.new / CONSOLE).unlink()
        results.commit(keep=(EVIDENCE, CONSOLE))
