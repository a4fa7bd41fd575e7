"""What a launch file would be marked down for next, once the mistake that hides it is fixed, for `later_faults.py`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath

from grader.checks.support.launch import NOT_STARTED, refusal
from grader.checks.support.launch_connections import find_renaming
from grader.checks.support.launch_slips import find_launch, later_fixes, refusals, unset_arg_fixes
from grader.checks.support.text import texts_in
from grader.evidence.run import Run
from grader.judging.facts import Facts
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict
from grader.rubric.model import Criterion, Rubric

OF_LAUNCHES = ("launch-xml", "launch-runs", "launch-connects")


def later_launch_faults(
    criterion: Criterion, verdicts: Mapping[str, Verdict], package: PackageFacts, facts: Facts
) -> Iterator[tuple[str, str]]:
    """Yield how what comes next in a criterion's launch file is fixed, each with the criterion that is to tell it."""
    verdict = verdicts[criterion.id]
    teller = verdict.blocked_by or criterion.id
    if criterion.check == "launch-xml":
        for one in _later_in_file(criterion, package) if verdict.blocked_by else ():
            yield teller, f"for {criterion.id}, {one}"
    elif verdict.blocked_by and criterion.check == "launch-runs":
        own = _criterion_of_file(criterion, verdicts, facts.rubric)
        for one in _later_in_launch(criterion, package, facts):
            yield own or teller, one if own else f"for {criterion.id}, {one}"
    elif file := find_launch(package, str(criterion.parameters["launch"])):
        given = [word for start in facts.rubric.starts_of(criterion) for word in start.args]
        yield from ((teller, one) for one in unset_arg_fixes(file, verdict.hint, given))


def _criterion_of_file(launched: Criterion, verdicts: Mapping[str, Verdict], rubric: Rubric) -> str | None:
    """Return the criterion that is lost by the launch file itself: what comes next in the file is told there."""
    file = launched.parameters.get("launch")
    of_file = (c.id for c in rubric.criteria if c.scenario is None and c.parameters.get("launch") == file)
    return next((i for i in of_file if verdicts[i].status.is_lost and not verdicts[i].blocked_by), None)


def _later_in_file(criterion: Criterion, package: PackageFacts) -> Iterator[str]:
    """Yield what a launch file would be lost by once the scripts that it lacks are written."""
    file = find_launch(package, str(criterion.parameters.get("launch", "")))
    scripts = texts_in(criterion.parameters.get("scripts"))
    yield from (fix for script in scripts if file is not None for fix in later_fixes(file, script))


def _later_in_launch(criterion: Criterion, package: PackageFacts, facts: Facts) -> Iterator[str]:
    """Yield what a launch file would be lost by next: what roslaunch said of it, and namespaces of the lab's nodes."""
    wanted, run = criterion.parameters, facts.runs.get(criterion.scenario or "")
    file, topic = find_launch(package, str(wanted.get("launch", ""))), str(wanted.get("topic") or "")
    names = {PurePosixPath(script).name for script in texts_in(wanted.get("scripts"))}
    if file is None or file.fault is not None:
        return
    refused = refusal(run, package) if isinstance(run, Run) else None
    if refused and refused.refused != NOT_STARTED and not any(refusals(package, file)):
        yield f"{refused.hint}: {refused.why}"
    given = [word for start in facts.rubric.starts_of(criterion) for word in start.args]
    yield from unset_arg_fixes(file, refused.hint if refused else "", given)
    nodes = [one for one in file.brings if {one.type, f"{one.type}.py"} & names]
    if topic and (renaming := find_renaming(package, nodes, topic, main=file.path)):
        yield f"in {file.path} {renaming.fix}"
