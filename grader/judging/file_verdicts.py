"""What a package's files alone decide, before anything is built or run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from graphlib import TopologicalSorter
from typing import Any, cast

from grader.checks import CHECKS, Check
from grader.evidence.run import Run
from grader.judging.annotate import name_unchanged_files
from grader.judging.facts import NOT_RUN, PACKAGE_RUN, Facts, views_of
from grader.judging.judge import Requirements, result_of, verdict_of
from grader.model.package import PackageFacts
from grader.model.result import EarlyVerdict
from grader.rubric.model import Rubric

FROM_FILES = {"package", "build", "params"}
REFINED = frozenset({"cmake", "slips"})
REFINED_OF_FILES = frozenset({"python_fault"})
"""What the build makes more precise (`package.facts.with_build_facts`)."""
UNBUILT = Run(
    evidence=f"{PACKAGE_RUN}.mcap",
    scenario=PACKAGE_RUN,
    clock="real",
    warp=1.0,
    metadata={NOT_RUN: "it is not built yet"},
    start_ns=0,
    end_ns=0,
)


def judge_files(
    rubric: Rubric,
    package: PackageFacts,
    checks: Mapping[str, Check] = CHECKS,
    handed_out: Collection[str] = (),
) -> tuple[EarlyVerdict, ...]:
    """Return the criteria that need no run, as far as the files decide them, in the rubric's order; with them those
    of a launch file that nothing can read.

    What needs the build, or a criterion that is not decided yet, is left out. A verdict is final where nothing that
    the build makes more precise was looked at for it.
    """
    judging = _Judging(rubric, package, checks)
    for name in TopologicalSorter({c.id: c.requires for c in rubric.criteria}).static_order():
        judging.judge(name)
    found = (judging.results[c.id] for c in rubric.criteria if c.id in judging.results)
    return tuple(
        one.model_copy(update={"criterion": name_unchanged_files(one.criterion, rubric, package, handed_out)})
        for one in found
    )


class _Judging:
    """Goes through the criteria, each after those that it requires."""

    def __init__(self, rubric: Rubric, package: PackageFacts, checks: Mapping[str, Check]) -> None:
        self._rubric = rubric
        self._package = package
        self._checks = checks
        self._criteria = {c.id: c for c in rubric.criteria}
        self._requirements = Requirements(rubric, checks)
        self.results: dict[str, EarlyVerdict] = {}

    def judge(self, name: str) -> None:
        criterion = self._criteria[name]
        check = self._checks.get(criterion.check)
        if check is None:
            return
        asked: set[str] = set()
        facts = self._facts(asked)
        from_files = FROM_FILES.issuperset(check.facts)
        if not from_files and not facts.unreadable_launch(criterion.scenario or ""):
            return
        verdict = verdict_of(criterion, facts, self._checks)
        final = not asked
        if verdict.unjudged:
            if not self.results.keys() >= set(criterion.requires):
                return
            final = final and all(self.results[r].final for r in criterion.requires)
            verdict = self._requirements.apply(criterion, verdict)
        if not verdict.status.is_open:
            self._requirements.verdicts[name] = verdict
            result = result_of(criterion, verdict, self._rubric.digits)
            self.results[name] = EarlyVerdict(criterion=result, final=final)

    def _facts(self, asked: set[str]) -> Facts:
        """Return the facts; `asked` collects what was looked at that the build makes more precise, or that only a build
        gives."""
        main, others = views_of(self._rubric, self._package)
        runs = {PACKAGE_RUN: cast("Run", _Watched(UNBUILT, asked))}
        return Facts(
            rubric=self._rubric,
            runs=runs,
            package=_watched(main, asked),
            others={name: _watched(package, asked) for name, package in others.items()},
        )


def _watched(package: PackageFacts, asked: set[str]) -> PackageFacts:
    files = tuple(_Watched(file, asked, REFINED_OF_FILES) for file in package.files)
    also = tuple(_watched(other, asked) for other in package.also)
    seen = package.model_copy(update={"files": files, "also": also})
    return cast("PackageFacts", _Watched(seen, asked, REFINED))


class _Watched:
    """A record that notes in `asked` which of its attributes it was asked for: of these, or of all."""

    def __init__(self, record: object, asked: set[str], noted: frozenset[str] | None = None) -> None:
        self._watched = record, asked, noted

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the record has
        record, asked, noted = self._watched
        if noted is None or name in noted:
            asked.add(name)
        return getattr(record, name)
