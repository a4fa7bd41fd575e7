"""Load a rubric's file, naming every fault at once as `file:line: key.path: what is wrong`; what a rubric needs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping
from pathlib import Path, PurePosixPath

from grader.checks import Check
from grader.errors import RubricError, UsageError
from grader.model.record import Record
from grader.model.version import RUBRIC, UPDATE, Versioned
from grader.rubric.consistency import cross_faults
from grader.rubric.faults import model_faults
from grader.rubric.find import BUILT_IN, known_labs, locate, rubric_ids, rubrics_folder
from grader.rubric.instructor import Beside, known_checks, read_instructor, run_checks_file
from grader.rubric.model import Criterion, Rubric
from grader.rubric.source import Source, read_source


class LoadedRubric(Record):
    """A rubric and where it came from; `digest` is the sha256 of the file's bytes, and of the instructor's files.

    `own` is the text of the instructor's file of checks: another process, to which this record is sent, runs it again.
    `handed_out` holds the sha256 of each file of the starter.
    """

    rubric: Rubric
    path: Path
    digest: str
    own: bytes | None = None
    handed_out: frozenset[str] = frozenset()

    @property
    def checks(self) -> dict[str, Check]:
        """Every check that the rubric may name: the grader's, `pytest`, and the instructor's own."""
        folder = self.path.parent
        if self.own is None or self.rubric.checks is None:
            return known_checks(folder, {})
        return known_checks(folder, run_checks_file(folder.resolve() / self.rubric.checks, self.own).checks)

    @property
    def docs(self) -> dict[str, dict[str, str]]:
        """Of each of these checks the sections of its docstring, for reports."""
        return {name: check.sections for name, check in self.checks.items()}


def load_rubric(name_or_path: str) -> LoadedRubric:
    """Return the rubric of that id (of those that come with the grader), or in that file.

    Raises RubricError with every fault that it has.
    """
    path, name = locate(name_or_path)
    source = read_source(path, name)
    refuse_newer(source, RUBRIC)
    beside = read_instructor(source.data, path.parent)
    faults = _faults(source, beside)
    if faults:
        raise RubricError(faults)
    rubric = share_points(Rubric.model_validate_json(json.dumps(source.data), strict=True))
    own = beside.files[rubric.checks] if rubric.checks is not None else None
    digest = _digest(source.raw, beside)
    return LoadedRubric(rubric=rubric, path=path, digest=digest, own=own, handed_out=beside.handed_out)


def share_points(rubric: Rubric) -> Rubric:
    """Return the rubric with the points of each group shared out to its criteria by their weights.

    Shares are rounded down to the rubric's digits; what is left goes, a step at a time, to those that lost most by it.
    """
    weights = {c.id: c.points for c in rubric.criteria}
    for group in rubric.groups.values():
        if group.points is not None:
            counted = group.best or len(group.criteria)
            whole = group.points * len(group.criteria) / counted
            weights |= _shares(whole, {name: weights[name] for name in group.criteria}, rubric.digits)
    criteria = tuple(c.model_copy(update={"points": weights[c.id]}) for c in rubric.criteria)
    return rubric.model_copy(update={"criteria": criteria})


def _shares(whole: float, weights: dict[str, float], digits: int) -> dict[str, float]:
    steps = round(whole * 10**digits)
    exact = {name: steps * weight / sum(weights.values()) for name, weight in weights.items()}
    shares = {name: int(share + 1e-9) for name, share in exact.items()}
    for name in sorted(exact, key=lambda name: shares[name] - exact[name])[: steps - sum(shares.values())]:
        shares[name] += 1
    return {name: share / 10**digits for name, share in shares.items()}


def read_beside_rubric(rubric: LoadedRubric) -> dict[str, bytes]:
    """Return the files that a rubric brings along, by their paths from its folder: checks, tests, recordings, packages
    and the starter.

    Raises RubricError where its file is not there any more.
    """
    source = read_source(rubric.path, rubric.path.name)
    return read_instructor(source.data, rubric.path.parent).files


def refuse_newer(source: Source, known: Versioned) -> None:
    """Raise RubricError where the file is for a newer grader: what else may be strange in it follows from that."""
    said = source.data.get("schema") if isinstance(source.data, dict) else None
    if newer := known.newer(said):
        raise RubricError([source.fault(("schema",), newer)], hint=UPDATE)


def _digest(raw: bytes, beside: Beside) -> str:
    """Of the rubric alone where nothing else belongs to it."""
    digest = hashlib.sha256(raw)
    for name, content in sorted(beside.files.items()):
        digest.update(f"\0{name}\0{hashlib.sha256(content).hexdigest()}".encode())
    return digest.hexdigest()


def all_rubrics() -> tuple[LoadedRubric, ...]:
    """Those that come with the grader, in order of their ids."""
    return tuple(load_rubric(str(rubrics_folder() / f"{name}.yaml")) for name in rubric_ids())


def find_rubric_for_package(name: str) -> str | None:
    """Return the id of the rubric for a package of that name, or None. Raises UsageError where there are several."""
    found = [lab for lab in known_labs() if lab.package.lower() == name.lower()]
    if len(found) > 1:
        labs = ", ".join(lab.id if lab.source == BUILT_IN else f"{lab.id} ({lab.path})" for lab in found)
        raise UsageError(
            f"{len(found)} rubrics are for a package named {name}: {labs}", hint="choose one with --rubric"
        )
    return found[0].id if found else None


def packages_of_labs() -> dict[str, str]:
    """By the id of each lab that is known here, the package that it is for."""
    return {lab.id: lab.package for lab in known_labs()}


def _faults(source: Source, beside: Beside) -> list[str]:
    if not isinstance(source.data, dict):
        return [
            source.fault((), "a rubric is a map of keys and values, beginning with schema: grader.rubric/1")
        ]
    found = [
        *source.faults,
        *model_faults(Rubric, source.data),
        *cross_faults(source.data, beside.known, complete=beside.own.complete),
        *beside.faults,
    ]
    unique = dict.fromkeys(found)
    told = [source.fault(*fault) for fault in sorted(unique, key=lambda fault: source.line(fault[0]))]
    file = Path(source.name).parent / str(source.data.get("checks"))
    return [*told, *(f"{file}:{line}: {message}" for line, message in beside.own.faults)]


def started(rubric: Rubric, only: Collection[str] | None = None) -> Rubric:
    """Return the rubric without the scenarios for which nothing is run, and with `only` these of the others."""
    scenarios = {
        name: s
        for name, s in rubric.scenarios.items()
        if s.recording is None and (only is None or name in only)
    }
    return rubric.model_copy(update={"scenarios": scenarios})


def files_of(rubric: Rubric) -> frozenset[str]:
    """Return the names of the scripts, launch files and other files that the rubric asks for, without folders."""
    paths = [
        path for s in rubric.scenarios.values() for p in s.start for path in (p.script, p.launch, p.load)
    ]
    names = {PurePosixPath(path).name for path in paths if path is not None}
    return frozenset(names.union(*(names_in(criterion) for criterion in rubric.criteria)))


def names_in(criterion: Criterion) -> set[str]:
    """Return the names of the files that a criterion's parameters name, without folders."""
    given = criterion.parameters
    scripts = given.get("scripts")
    paths = [given.get("path"), given.get("file"), given.get("launch")]
    paths += scripts if isinstance(scripts, list | tuple) else []
    return {PurePosixPath(path).name for path in paths if isinstance(path, str)}


def needs_package(loaded: LoadedRubric) -> bool:
    """Return whether there is anything to run, or any check that looks at the package's files."""
    rubric, checks = loaded.rubric, loaded.checks
    return bool(started(rubric).scenarios) or any(_looks_at_files(c, checks) for c in rubric.criteria)


def needs_ros(loaded: LoadedRubric) -> bool:
    """Return whether anything is to be built or run: files alone decide everything else."""
    rubric, checks = loaded.rubric, loaded.checks
    return bool(started(rubric).scenarios) or any(_needs_build(c, checks) for c in rubric.criteria)


def _needs_build(criterion: Criterion, checks: Mapping[str, Check]) -> bool:
    check = checks.get(criterion.check)
    return check is not None and "build" in check.facts


def _looks_at_files(criterion: Criterion, checks: Mapping[str, Check]) -> bool:
    check = checks.get(criterion.check)
    return check is not None and not check.messages_only and bool({"package", "build"} & set(check.facts))
