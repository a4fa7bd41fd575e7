"""A repaired copy of a submission: which repairs could be the reason for a lost mark, and what runs with them.

A judged submission comes in, another submission with a copy of its package goes out. What the copy then shows is the
business of `judging`, what a repair is of `package.repairs`. A copy is built and run within the limits of every
submission (`arena/limits.py`, `arena/build.py`, `Until` in `rubric/scenario.py`).
"""

from __future__ import annotations

import json
import posixpath
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import chain
from pathlib import Path

from grader.files import temporary_folder
from grader.judging.repair_charges import BUILD, DONE_BEFORE_RUNS, OF_PACKAGES, is_unmade
from grader.judging.repeats_and_repairs import (
    OF_WAYS,
    concerns,
    is_first_line_added,
    is_used_by,
    launched_in,
    needs_build,
    never_run,
    programs_of_build,
)
from grader.model.package import MANIFEST, PackageFacts
from grader.model.repair import Repair
from grader.model.result import CriterionResult, Progress, Silence, StepState
from grader.model.submission import SourcePackage, Submission
from grader.model.verdict import FileCitation
from grader.package.manifest import parse_manifest
from grader.package.repairs import NotRepairable, apply_repair, find_repairs, wanted_of
from grader.package.repairs.editing import read_data
from grader.package.repairs.of_runs import other_field, other_item, repairs_by_hint
from grader.package.repairs.python import ros_clock, turn_sign
from grader.rubric.model import Rubric
from grader.wording import ASKED_ITEM, fields_told

STEERS_WRONG, WARPED, OWN = "steers-wrong", "warped", "student"
REPAIRS_MAX = 4
"""So many lines of each script and launch file are repaired, however many mistakes are on one."""


def choose_repairs(
    submission: Submission,
    facts: PackageFacts,
    rubric: Rubric,
    criteria: Sequence[CriterionResult],
    *,
    built: bool,
) -> tuple[tuple[Repair, ...], tuple[str, ...]]:
    """Return the repairs to try together, and the scenarios to run with them: those that lost a mark.

    The copy is built even where there is nothing to run, if that could unblock a criterion of the files. There are no
    repairs where nothing was lost in a run or blocked, or none could be the reason. `built` is whether the package was
    built as it is.
    """
    lost = {c.scenario for c in criteria if c.status.is_lost and c.scenario is not None}
    by_id = {c.id: c for c in criteria}
    of_files = [c for c in rubric.criteria if c.scenario is None and by_id[c.id].status.is_lost]
    blocked = [c for c in of_files if by_id[c.id].blocked_by or c.check == BUILD or is_unmade(by_id[c.id])]
    if not lost and not blocked:
        return (), ()
    found = _find_in_all(submission, facts, rubric)
    found += _of_errors(submission, rubric, criteria, found)
    # an `input()` waits for ever in a run in which nothing is typed
    typed = any(scenario.typed_to for scenario in rubric.scenarios.values())
    counting = [one for one in found if rubric.share_of(one.kind) > 0 and (typed or not one.asks_input)]
    counting = [one.of_typing() if typed else one for one in counting]
    built, launched = built or not needs_build(facts), launched_in(facts)

    def uses(name: str, one: Repair) -> bool:
        return is_used_by(rubric.scenarios[name], one, rubric, built=built, launched=launched)

    def unblocks(one: Repair) -> bool:
        return any(concerns(one, c, rubric, by_id, built=built, launched=launched) for c in blocked)

    later = [one for one in counting if one.kind not in DONE_BEFORE_RUNS]
    helping = [one for one in later if any(uses(name, one) for name in lost) or unblocks(one)]
    chosen = most_of(helping)
    scenarios = sorted(name for name in lost if any(uses(name, one) for one in chosen))
    # only where nothing mechanical explains a loss is the logic of a script touched
    if not scenarios:
        logic, scenarios = _choose_logic(submission, rubric, criteria, lost)
        if not logic and not any(map(unblocks, chosen)):
            return (), ()
        chosen += logic
    # of a script that the build makes a program of, neither its bit nor its first line is used
    made = {c.mistake.name for c in criteria if c.mistake is not None and is_unmade(c)}
    made |= programs_of_build(facts) & {one.before for one in chosen if one.kind == "file-name"}
    before = [one for one in counting if one.kind in DONE_BEFORE_RUNS and one.file not in made]
    before = [one for one in before if not is_first_line_added(one, rubric, chosen)]
    return (*before, *chosen), tuple(scenarios)


def _of_errors(
    submission: Submission, rubric: Rubric, criteria: Sequence[CriterionResult], found: Collection[Repair]
) -> Iterator[Repair]:
    """Yield the repairs of what only a run shows: of a value's or a topic's type, or of a loop's rate. A topic's type
    matters to other criteria where a program of the course's should have heard it."""
    lost = {one.id for one in criteria if one.status.is_lost}
    of_others = {c.scenario for c in rubric.criteria if c.id in lost and c.parameters.get("of", OWN) != OWN}
    known = {(one.file, one.line) for one in found}
    for criterion in (one for one in criteria if one.status.is_lost and not one.blocked_by):
        cited = next((one for one in criterion.citations if isinstance(one, FileCitation)), None)
        if cited is None or cited.line is None or cited.file.startswith("../"):
            continue
        for repair in repairs_by_hint(submission.package.folder, criterion.hint, cited.file, cited.line):
            own_type = criterion.check == "topic-type" and repair.kind == "message-type"
            if own_type and criterion.scenario not in of_others:
                continue
            if (repair.file, repair.line) not in known:
                known.add((repair.file, repair.line))
                yield repair


def _choose_logic(
    submission: Submission, rubric: Rubric, criteria: Sequence[CriterionResult], lost: Collection[str]
) -> tuple[list[Repair], list[str]]:
    """Return the only repair of logic that could be the reason for a lost mark, and all scenarios that run its script:
    ROS's clock in place of the computer's, the other sign for a turn to the wrong side, or one field for another."""
    turning = {c.scenario: c.mistake.name for c in criteria if c.mistake and c.mistake.kind == STEERS_WRONG}
    led = {c.scenario for c in criteria if c.check in OF_WAYS and c.status.is_lost and not c.blocked_by}
    fields = {c.scenario: told for c in criteria if c.status.is_lost and (told := fields_told(c.hint))}
    asked = ((c.scenario, ASKED_ITEM.search(c.hint)) for c in criteria if c.status.is_lost)
    items = {scenario: (found[1], found[2]) for scenario, found in asked if found is not None}
    folder, scripts = submission.package.folder, dict[str, str]()
    for name in sorted(lost) if not submission.also else ():
        if len(own := [start.script for start in rubric.scenarios[name].start if start.script]) == 1:
            scripts[name] = own[0]
    warped = [name for name in scripts if rubric.scenarios[name].clock == WARPED]
    possible = chain(
        (turn_sign(folder, scripts[name], turning[name]) for name in scripts if name in turning),
        (ros_clock(folder, scripts[name]) for name in warped),
        (other_field(folder, scripts[name], *fields[name]) for name in scripts if name in fields),
        (other_item(folder, scripts[name], *items[name]) for name in scripts if name in items),
        (turn_sign(folder, scripts[name]) for name in scripts if name in led),
    )
    for found in filter(None, possible):
        if rubric.share_of(found.kind) > 0:
            run = (i for i, one in rubric.scenarios.items() if found.file in {s.script for s in one.start})
            return [found], sorted(run)
    return [], []


def most_of(helping: Sequence[Repair]) -> list[Repair]:
    """Return the repairs of so many lines of each file, and all of the manifest and of CMakeLists.txt: they need no run
    of their own, and without one of them the build shows nothing of the others."""
    places = dict[str, dict[int | str, None]]()
    for one in helping:
        places.setdefault(one.file, {})[one.line or one.before] = None
    of_build = {file for file in places if posixpath.basename(file) in OF_PACKAGES}
    chosen = {file: lines if file in of_build else [*lines][:REPAIRS_MAX] for file, lines in places.items()}
    return [one for one in helping if (one.line or one.before) in chosen[one.file]]


def _find_in_all(submission: Submission, facts: PackageFacts, rubric: Rubric) -> list[Repair]:
    """Return the repairs of all of the lab's packages, with paths from the main one."""
    found = list(find_repairs(submission.package.folder, facts, wanted_of(rubric)))
    never = never_run(facts, rubric)
    found = [one for one in found if one.file not in never]
    for package, own in zip(submission.also, facts.views()[1:], strict=True):
        way = facts.way_to(own)
        others = find_repairs(package.folder, own, wanted_of(rubric, own.asked))
        found += [one.with_paths(partial(posixpath.join, way)) for one in others]
    return found


@contextmanager
def repaired_copy(submission: Submission, repairs: Sequence[Repair]) -> Iterator[Submission | None]:
    """Return the submission with a repaired copy of its package, there for as long as the block runs; None where a file
    turns out to be none that can be repaired."""
    with temporary_folder("repaired") as folder:
        try:
            of_main = [r for r in repairs if not r.file.startswith("../")]
            main = _repair_copy(submission.package, folder / "main", of_main)
            also = tuple(
                _repair_copy(package, folder / package.asked, _of(submission, package, repairs))
                for package in submission.also
            )
        except (NotRepairable, OSError):
            yield None
            return
        yield submission.model_copy(update={"package": main, "also": also})


def _of(submission: Submission, package: SourcePackage, repairs: Sequence[Repair]) -> list[Repair]:
    """Return the repairs of a package beside the main one, with paths from its own folder."""
    way = posixpath.relpath(package.path, submission.package.path) + "/"
    return [r.with_paths(lambda path: path.removeprefix(way)) for r in repairs if r.file.startswith(way)]


def _repair_copy(package: SourcePackage, folder: Path, repairs: Sequence[Repair]) -> SourcePackage:
    """Return a copy of the package in `folder` with the repairs. Raises NotRepairable, OSError."""
    copy = folder / package.folder.name

    def left_out(above: str, names: list[str]) -> set[str]:
        below = Path(above).relative_to(package.folder)
        return {name for name in names if (below / name).as_posix() in package.left_out}

    # a link stays one: what a student's link points to is not theirs to copy
    shutil.copytree(package.folder, copy, symlinks=True, ignore=left_out)
    # the bits on the disk may be lost; the runs set them from this list
    executable = dict(package.executable)
    for repair in repairs:
        apply_repair(copy, repair)
        if repair.kind == "executable-bit":
            executable[repair.file] = True
        elif repair.kind == "file-name" and repair.before in executable:
            executable[repair.after] = executable.pop(repair.before)
    manifest, _ = parse_manifest(read_data(copy, MANIFEST) or b"")
    name = manifest.name if manifest is not None else package.name
    return package.model_copy(update={"name": name, "folder": copy, "executable": executable})


def dump_repairs(repairs: Sequence[Repair]) -> str:
    """Return the repairs as the metadata of the copy's evidence holds them."""
    return json.dumps([one.model_dump() for one in repairs])


class CopyProgress(Silence):
    """Shows the steps of a copy's runs beside those of the first."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        """Show the step under a name of its own."""
        self._progress.step(f"{name} (repaired copy)", state, detail, expected_s)
