"""What runs besides the first say of a criterion: scenarios that were run once more, and a repaired copy. Pure."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping
from graphlib import TopologicalSorter
from pathlib import PurePosixPath

from pydantic import ValidationError

from grader.checks.build import CATKIN_MAKE
from grader.evidence.run import Run
from grader.model.repair import Repair, place_of
from grader.model.result import Repaired
from grader.model.verdict import Status, Verdict, failed
from grader.rubric.model import Criterion, Rubric, Scenario
from grader.wording import join_words

PACKAGE_RUN, REPAIRS = "package", "repairs"
NAMES = {"topic-name", "node-name", "parameter-name", "file-name", "package-name", "launch-type"}
EVERYWHERE = {"build-line", "manifest-line", "package-name"}
OF_BUILDS = {"build-line", "manifest-line"}
"""These explain nothing but the build and the files, where the package as handed in was built."""
SHARES = {1.0: "all", 0.5: "half"}

Runs = dict[str, Run]


def split_runs(runs: Mapping[str, Run]) -> tuple[Runs, Runs, Runs]:
    """Return the first runs, the repeated ones and those of the repaired copy, each by scenario."""
    first, repeated, repaired = Runs(), Runs(), Runs()
    for name, run in runs.items():
        folder, _, scenario = name.rpartition("/")
        found = repaired if folder.startswith("repaired") else repeated if folder else first
        found[scenario] = run
    return first, repeated, repaired


def seen_twice(
    rubric: Rubric, first: Mapping[str, Verdict], again: Mapping[str, Verdict], scenarios: Collection[str]
) -> dict[str, Verdict]:
    """Return the verdicts without those losses that one run's timing could have made and that did not come again."""
    verdicts = dict(first)
    for criterion in rubric.criteria:
        one, other = first[criterion.id], again[criterion.id]
        if criterion.scenario not in scenarios or not one.status.is_lost:
            continue
        if (one.timing or one.status is Status.BLOCKED) and other.status is Status.PASS:
            message = f"{other.message} (seen once and not again, so it costs nothing: {one.message})"
            verdicts[criterion.id] = other.model_copy(update={"message": message})
        elif one.timing and other.status.is_lost:
            update = {"citations": one.citations + other.citations}
            verdicts[criterion.id] = one.model_copy(update=update)
        elif one.timing and other.status.is_open:
            verdicts[criterion.id] = other
    return verdicts


def was_built(runs: Mapping[str, Run]) -> bool:
    """Return whether `catkin_make` worked."""
    events = runs[PACKAGE_RUN].processes if PACKAGE_RUN in runs else ()
    return any(e.event == "exit" and e.name == CATKIN_MAKE and e.exit_code == 0 for _, e in events)


def repairs_of(rubric: Rubric, repaired: Mapping[str, Run]) -> tuple[Repair, ...]:
    """Return the repairs of the copy that was run, as far as the rubric lets them count."""
    written = repaired[PACKAGE_RUN].metadata.get(REPAIRS, "[]") if PACKAGE_RUN in repaired else "[]"
    try:
        found = tuple(Repair.model_validate(entry) for entry in json.loads(written))
    except (ValueError, ValidationError):
        return ()
    return found if all(rubric.share_of(one.kind) > 0 for one in found) else ()


def judged_on_copy(
    rubric: Rubric,
    first: Mapping[str, Verdict],
    on_copy: Mapping[str, Verdict],
    repairs: tuple[Repair, ...],
    *,
    built: bool,
) -> tuple[dict[str, Verdict], dict[str, Repaired]]:
    """Return the verdicts with what the copy shows, and for each criterion that it changes the repairs behind it.

    For each repair, the criterion that asks for what was wrong keeps its loss. The others earn the share of the repairs
    that they needed; where they are lost on the copy too, they say why.
    """
    verdicts, uses = dict(first), dict[str, Repaired]()
    better = {
        c.id
        for c in rubric.criteria
        if first[c.id].status.is_lost
        and not _is_worse(first, on_copy, c)
        and not _of_build(first, c, repairs)
    }
    needs = {
        c.id: tuple(one for one in repairs if concerns(one, c, rubric, first[c.id], built=built))
        for c in rubric.criteria
    }
    charges = _charges(rubric, first, better, needs)
    for criterion in rubric.criteria:
        needed = needs[criterion.id]
        if criterion.id not in better or not needed:
            continue
        verdict, copy = first[criterion.id], on_copy[criterion.id]
        charged = tuple(one for one in needed if criterion.id in charges.get(one, ()))
        share = min(rubric.share_of(one.kind) for one in needed)
        if charged:
            verdicts[criterion.id] = _charge(verdict, copy, charged[0])
        else:
            verdicts[criterion.id] = _share(copy, needed, share)
        uses[criterion.id] = Repaired(repairs=charged or needed, share=share, charged=bool(charged))
    return verdicts, uses


def concerns(repair: Repair, criterion: Criterion, rubric: Rubric, verdict: Verdict, *, built: bool) -> bool:
    """Return whether the criterion may depend on what was repaired: it cites the file, or its run uses it. What the
    files of the build lack stays lost, though: the criteria of these files ask for just that.

    `built` is whether the package was built without the repair, or not even with it.
    """
    if criterion.scenario is not None:
        return is_used_by(rubric.scenarios[criterion.scenario], repair, rubric, built=built)
    return repair.kind == "package-name" or (repair.kind not in OF_BUILDS and _cites(verdict, repair))


def is_used_by(scenario: Scenario, repair: Repair, rubric: Rubric, *, built: bool) -> bool:
    """Return whether the scenario runs the repaired file, as far as the rubric says. A launch file may run any."""
    if repair.kind in OF_BUILDS:
        return not built or any(start.built for start in scenario.start)
    if any(start.launch for start in scenario.start) or repair.kind in EVERYWHERE:
        return True
    name = PurePosixPath(repair.file).name
    started = {PurePosixPath(s.script).name for s in scenario.start if s.script}
    every = {PurePosixPath(s.script).name for one in rubric.scenarios.values() for s in one.start if s.script}
    return name in started or name not in every


def _is_worse(first: Mapping[str, Verdict], on_copy: Mapping[str, Verdict], criterion: Criterion) -> bool:
    """Return whether the copy shows no more of a lost criterion than the package as it is."""
    one, copy = first[criterion.id], on_copy[criterion.id]
    if copy.status.is_lost and copy.score <= one.score:
        return not one.unjudged or copy.unjudged
    return copy.status is Status.ERROR


def _of_build(first: Mapping[str, Verdict], criterion: Criterion, repairs: tuple[Repair, ...]) -> bool:
    """Return whether a criterion of the files asks for what one of the repairs wrote into a file of the build."""
    return criterion.scenario is None and any(
        one.kind in OF_BUILDS and _asks_for(first[criterion.id], one) for one in repairs
    )


def _charges(
    rubric: Rubric,
    first: Mapping[str, Verdict],
    better: Collection[str],
    needs: Mapping[str, tuple[Repair, ...]],
) -> dict[Repair, set[str]]:
    """Return for each repair the criterion that asks for what was wrong: one of the files, else by its name where a
    name was wrong, else the first that failed by itself. What others require comes first."""
    charges: dict[Repair, set[str]] = {}
    by_id = {c.id: c for c in rubric.criteria}
    order = TopologicalSorter({c.id: c.requires for c in rubric.criteria}).static_order()
    criteria = [by_id[name] for name in order if name in better]
    for repair in dict.fromkeys(one for repairs in needs.values() for one in repairs):
        asking = [c.id for c in rubric.criteria if c.scenario is None and _asks_for(first[c.id], repair)]
        if asking:
            charges[repair] = {asking[0]}
            continue
        possible = [c for c in criteria if repair in needs[c.id]]
        named = [c for c in possible if repair.kind in NAMES and _names(c, repair)]
        failing = [c for c in possible if first[c.id].status is not Status.BLOCKED]
        counting = [c for c in (*named, *failing, *possible) if c.points > 0]
        charges[repair] = {counting[0].id} if counting else set()
    return charges


def _cites(verdict: Verdict, repair: Repair) -> bool:
    return any(getattr(citation, "file", None) == repair.file for citation in verdict.citations)


def _asks_for(verdict: Verdict, repair: Repair) -> bool:
    """Return whether a criterion of the files is lost by what was repaired."""
    return verdict.status.is_lost and verdict.status is not Status.BLOCKED and _cites(verdict, repair)


def _names(criterion: Criterion, repair: Repair) -> bool:
    """Return whether the criterion asks for the name that the repair puts in place."""
    new = set(re.findall(r"[\w.-]+", repair.after)) - set(re.findall(r"[\w.-]+", repair.before))
    return any(text.strip("/").rpartition("/")[2] in new for text in _texts(criterion.parameters))


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _texts(item)
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from _texts(item)


def _charge(verdict: Verdict, copy: Verdict, repair: Repair) -> Verdict:
    """Return the loss, with the repair that was seen to help as its hint."""
    if verdict.status is Status.BLOCKED:
        verdict = failed(
            repair.message, expected=copy.expected, measured=verdict.measured, citations=verdict.citations
        )
    return verdict.model_copy(update={"hint": f"{place_of(repair)}: {repair.fix}"})


def _share(copy: Verdict, repairs: tuple[Repair, ...], share: float) -> Verdict:
    where = join_words([place_of(repair) for repair in repairs])
    earned = SHARES.get(share, f"{share:.0%}")
    score = copy.score * share
    status = Status.PARTIAL if share < 1 and copy.status is Status.PASS else copy.status
    message = f"judged on a copy with {where} repaired: {earned} of the points; {copy.message}"
    return copy.model_copy(update={"status": status, "score": score, "message": message})
