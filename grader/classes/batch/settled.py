"""What a person decided and when it was handed in, applied to a result that is there already."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from grader.checks import CHECKS
from grader.classes.batch.judging import fitting_runs
from grader.evidence.reader import load_evidence
from grader.judging.settle import settle, unsettled
from grader.model.figure import Figures
from grader.model.result import GradingResult, HandedIn, Override
from grader.report.figures import figures_of
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


def rewrite(
    folder: Path, result: GradingResult, rubric: Rubric, docs: Mapping[str, Mapping[str, str]] | None = None
) -> None:
    """Write the result's reports; the evidence that it was judged from stays. Raises as `Results` does.

    `docs` has the sections of the checks' docstrings; without them, those of the grader's own checks are taken.
    """
    with Results(folder) as results:
        figures = figures_in(folder, result, rubric)
        docs = docs or {name: check.sections for name, check in CHECKS.items()}
        write_reports(result, results.new, console="", rubric=rubric, figures=figures, docs=docs)
        (results.new / CONSOLE).unlink()
        results.commit(keep=(EVIDENCE, CONSOLE))


def figures_in(folder: Path, result: GradingResult, rubric: Rubric) -> Figures | None:
    """Of a submission's folder of results, drawn from its evidence; None where there is none, or it cannot be read."""
    with suppress(Exception):  # no mark hangs on a picture
        runs = fitting_runs(rubric, load_evidence([folder / EVIDENCE]))
        return figures_of(rubric, runs, result.criteria)
    return None
