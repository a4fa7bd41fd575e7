"""Load a rubric's file, naming every fault at once as `file:line: key.path: what is wrong`; what a rubric needs."""

from __future__ import annotations

import hashlib
import math
import re
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath

from grader.checks import CHECKS, Check
from grader.checks.actions import ActionResultParams
from grader.errors import RubricError, UsageError
from grader.model.message_rate import RateBounds
from grader.model.record import Record
from grader.model.result import RubricOrigin
from grader.model.version import RUBRIC, UPDATE, Versioned
from grader.rubric.consistency import cross_faults, swallowed_keys
from grader.rubric.course import load_course, split_name
from grader.rubric.fault_words import model_faults
from grader.rubric.find import BUILT_IN, known_labs, locate, rubric_ids, rubrics_folder
from grader.rubric.made_up import draw_values, faults_of_sample, made_up_faults, sample_data, with_values
from grader.rubric.model import Criterion, Rubric
from grader.rubric.own_checks import Beside, known_checks, read_instructor, run_checks_file
from grader.rubric.scenario import JudgedGoal
from grader.rubric.spelling import misspelt_names, names_seen_once
from grader.rubric.validation_warnings import warnings
from grader.rubric.yaml_lines import Fault, KeyPath, Source, Value, WrittenRubric, as_map, read_source

PIN = "#sha256:"
"""Between a rubric's name and the digest that it must have."""
ADDRESS = re.compile("https?://", re.IGNORECASE)


class LoadedRubric(Record):
    """A rubric and where it came from; `digest` is the sha256 of the file's bytes, and of the instructor's files.

    `own` is the text of the instructor's file of checks: another process, to which this record is sent, runs it again.
    `handed_out` holds the sha256 of each file of the starter. `origin` says where it came from, as far as that can be
    said without a submission.
    """

    rubric: Rubric
    path: Path
    digest: str
    own: bytes | None = None
    handed_out: frozenset[str] = frozenset()
    origin: RubricOrigin = "elsewhere"

    @property
    def checks(self) -> dict[str, Check]:
        """Every check that the rubric may name: the grader's, `pytest`, and the instructor's own."""
        folder = self.path.parent
        if self.own is None or self.rubric.checks is None:
            return known_checks(folder, {})
        return known_checks(folder, run_checks_file(folder.resolve() / self.rubric.checks, self.own).checks)

    @classmethod
    def to_record(cls, package: str, scenarios: Mapping[str, object]) -> LoadedRubric:
        """Return a rubric that only says what to run; its criterion is never judged."""
        first = next(iter(scenarios), None)
        criterion = Criterion.model_validate(
            {"id": "recorded", "title": "Recorded", "points": 0, "check": "none", "scenario": first}
        )
        about = {"schema": "grader.rubric/1", "id": "record", "title": "Recording", "version": "0"}
        made = {**about, "package": package, "scenarios": dict(scenarios), "criteria": (criterion,)}
        return cls(rubric=Rubric.model_validate(made), path=Path(), digest="")

    def of_submission(self, digest: str, package: str = "") -> LoadedRubric:
        """Return the rubric with the values that are made up for the submission whose content has this digest, and with
        the name that its package has in the types that are the package's own."""
        rubric = self.rubric.with_types_of(package)
        if rubric.made_up:
            rubric = with_values(rubric, draw_values(rubric, digest))
        return self.model_copy(update={"rubric": rubric}) if rubric is not self.rubric else self

    @property
    def docs(self) -> dict[str, dict[str, str]]:
        """Of each of these checks the sections of its docstring, for reports."""
        return {name: check.sections for name, check in self.checks.items()}


def load_rubric(name_or_path: str) -> LoadedRubric:
    """Return the rubric of that id (of those that come with the grader), in that file, at that address, or of a
    course's lab (`course.yaml#lab1`). `#sha256:…` behind it pins its digest, which an address needs.

    Raises RubricError with every fault that it has, UsageError where it has another digest, or the course has no such
    lab.
    """
    name, pin = split_pin(name_or_path)
    if ADDRESS.match(name):
        from grader.rubric.download import fetch_rubric  # noqa: PLC0415 - slow to import, and seldom needed

        loaded = _load_file(fetch_rubric(name, pin), name)
    elif of_course := split_name(name):
        loaded = _load_of_course(*of_course)
    else:
        loaded = _load_file(*locate(name))
    if not pin:
        return loaded
    if pin != loaded.digest:
        raise UsageError(
            f"{name} is not the rubric that was pinned: its digest is sha256:{loaded.digest}, not sha256:{pin}",
            hint="take the pinned file, or pin the digest that `grader rubric validate` prints for this one",
        )
    return loaded.model_copy(update={"origin": "pinned"})


_FAULTLESS: set[tuple[str, Path]] = set()
"""What this process has looked through already, by digest and folder: to look takes most of the time of loading."""


def _load_file(path: Path, name: str) -> LoadedRubric:
    source = read_source(path, name)
    # First: an unknown key of a newer format would be told as a slip.
    refuse_newer(source, RUBRIC)
    samples = sample_data(source.data)
    beside = read_instructor(samples[0], path.parent)
    digest = _digest(source.raw, beside)
    seen = (digest, path.parent)
    if seen not in _FAULTLESS or beside.faults or beside.own.faults:
        if faults := _faults(source, samples, beside, path.parent):
            raise RubricError(faults)
        _FAULTLESS.add(seen)
    rubric = share_points(Rubric.from_data(samples[0]))
    if rubric.made_up:
        rubric.remember(as_map(source.data), {})
    own = beside.files[rubric.checks] if rubric.checks is not None else None
    return LoadedRubric(
        rubric=rubric,
        path=path,
        digest=digest,
        own=own,
        handed_out=beside.handed_out,
        origin="grader" if path.resolve().is_relative_to(rubrics_folder().resolve()) else "elsewhere",
    )


def split_pin(text: str) -> tuple[str, str]:
    """Return a rubric's name and the digest behind it, "" where none is given. Raises UsageError for half a one."""
    name, mark, digest = str(text).rpartition(PIN)
    if not mark:
        return str(text), ""
    if not re.fullmatch("[0-9a-f]{64}", digest.lower()):
        raise UsageError(
            f"{text}: {PIN} is followed by 64 hexadecimal digits", hint="`grader rubric validate` prints them"
        )
    return name, digest.lower()


def _load_of_course(file: Path, name: str) -> LoadedRubric:
    """Return a lab's rubric with the course's deadline and late policy in place of its own. Its digest stays, since
    nothing is judged by these."""
    found = load_course(file)
    lab = found.lab(name)
    rubric_name, pin = split_pin(lab.rubric)
    beside = found.beside(rubric_name)
    loaded = load_rubric(f"{beside}{PIN if pin else ''}{pin}" if beside.is_file() else lab.rubric)
    terms = {"deadline": lab.deadline, "late": found.late(name)}
    rubric = loaded.rubric.model_copy(
        update={key: value for key, value in terms.items() if value is not None}
    )
    if found.course.late_days and rubric.deadline is None:
        hint = f"give the lab {name} a deadline"
        raise UsageError(f"{file}: late days need a deadline, and {lab.rubric} has none", hint=hint)
    return loaded.model_copy(update={"rubric": rubric})


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
    # A share that is whole may be a hair less as a float.
    shares = {name: int(share + 1e-9) for name, share in exact.items()}
    # Those that were rounded down most come first; of equals the first in the rubric, on every machine.
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


def warnings_of(loaded: LoadedRubric, name: str) -> list[str]:
    """Return what may be a slip in the rubric of that file, each as `name:line: key.path: why`."""
    source = read_source(loaded.path, name)
    rubric = WrittenRubric(source.data)
    return source.in_order([*names_seen_once(rubric, loaded.path.parent), *warnings(rubric)])


def refuse_newer(source: Source, known: Versioned) -> None:
    """Raise RubricError where the file is for a newer grader: what else may be strange in it follows from that."""
    said = source.data.get("schema") if isinstance(source.data, dict) else None
    if newer := known.newer(said):
        raise RubricError([source.fault(("schema",), newer)], hint=UPDATE)


def _digest(raw: bytes, beside: Beside) -> str:
    """Return the digest, of the rubric alone where nothing else belongs to it."""
    digest = hashlib.sha256(raw)
    for name, content in sorted(beside.files.items()):
        # No path has a NUL: no other names and contents make the same bytes.
        digest.update(f"\0{name}\0{hashlib.sha256(content).hexdigest()}".encode())
    return digest.hexdigest()


def all_rubrics() -> tuple[LoadedRubric, ...]:
    """Return the rubrics that come with the grader, in order of their ids."""
    return tuple(load_rubric(str(rubrics_folder() / f"{name}.yaml")) for name in rubric_ids())


def find_rubric_for_package(name: str) -> str | None:
    """Return the id of the rubric for a package of that name, or None. Raises UsageError where there are several."""
    asking = [lab for lab in known_labs() if name.lower() in map(str.lower, lab.packages)]
    found = [lab for lab in asking if lab.package.lower() == name.lower()] or asking
    if len(found) > 1:
        labs = ", ".join(lab.id if lab.source == BUILT_IN else f"{lab.id} ({lab.path})" for lab in found)
        raise UsageError(
            f"{len(found)} rubrics are for a package named {name}: {labs}", hint="choose one with --rubric"
        )
    return found[0].id if found else None


def packages_of_labs() -> dict[str, str]:
    """Return by the id of each lab that is known here the package that it is for."""
    return {lab.id: lab.package for lab in known_labs()}


_NO_FIELD = re.compile(r"has no field \w+")


def _faults(source: Source, samples: Sequence[Value], beside: Beside, folder: Path) -> list[str]:
    if not isinstance(source.data, dict):
        return [
            source.fault((), "a rubric is a map of keys and values, beginning with schema: grader.rubric/1")
        ]
    found = [*source.faults, *swallowed_keys(source.data), *made_up_faults(source.data), *beside.faults]
    # Faults of a later sample count only where the first has none: they would be the same with another number.
    written = WrittenRubric(source.data)
    for sample in samples:
        rubric = written if sample is source.data else WrittenRubric(sample)
        faults = [
            *model_faults(Rubric, sample),
            *cross_faults(rubric, beside.known, complete=beside.own.complete, files=beside.files),
        ]
        known = {path for path, _ in found} if sample is not samples[0] else set()
        found += [one for one in faults_of_sample(faults, source.data, rubric.data) if one[0] not in known]
    known = {path for path, _ in found}
    found += [
        (path, fault)
        for path, fault in misspelt_names(written, folder)
        if known.isdisjoint(path[:n] for n in range(1, len(path) + 1))
    ]
    unique: dict[tuple[KeyPath, str], Fault] = {}
    for path, fault in found:  # where ROS is, its files and the known types both lack a field
        lacked = _NO_FIELD.search(fault)
        unique.setdefault((path, lacked[0] if lacked else fault), (path, fault))
    file = Path(source.name).parent / str(source.data.get("checks"))
    return [
        *source.in_order(unique.values()),
        *(f"{file}:{line}: {message}" for line, message in beside.own.faults),
    ]


def select_started(rubric: Rubric, only: Collection[str] | None = None) -> Rubric:
    """Return the rubric without the scenarios for which nothing is run, and with `only` these of the others."""
    scenarios = {
        name: s
        for name, s in rubric.scenarios.items()
        if s.recording is None and (only is None or name in only)
    }
    return rubric.model_copy(update={"scenarios": scenarios})


def files_of(rubric: Rubric, package: str) -> frozenset[str]:
    """Return the paths of the scripts, launch files and other files that the rubric asks for in one of its packages; of
    a launch file, which may be in any folder, only the name."""
    starts = [p for s in rubric.scenarios.values() for p in s.start if rubric.package_of(p) == package]
    paths = {path for p in starts for path in (p.script, p.launch, p.load) if path is not None}
    criteria = [c for c in rubric.criteria if rubric.package_of(c) == package]
    return frozenset(paths.union(*(_paths_in(criterion) for criterion in criteria)))


def names_in(criterion: Criterion) -> set[str]:
    """Return the names of the files that a criterion's parameters name, without folders."""
    return {PurePosixPath(path).name for path in _paths_in(criterion)}


def _paths_in(criterion: Criterion) -> set[str]:
    """Return the paths of the files that a criterion's parameters name."""
    given = criterion.parameters
    scripts = given.get("scripts")
    paths = [given.get("path"), given.get("file"), given.get("launch")]
    paths += scripts if isinstance(scripts, list | tuple) else []
    return {path for path in paths if isinstance(path, str)}


def needs_package(loaded: LoadedRubric) -> bool:
    """Return whether there is anything to run, or any check that looks at the package's files."""
    return _needs(loaded, lambda check: not check.messages_only and not _OF_FILES.isdisjoint(check.facts))


def needs_ros(loaded: LoadedRubric) -> bool:
    """Return whether anything is to be built or run: files alone decide everything else."""
    return _needs(loaded, lambda check: "build" in check.facts)


_OF_FILES = {"package", "build"}


def _needs(loaded: LoadedRubric, is_meant: Callable[[Check], bool]) -> bool:
    """Return whether there is anything to run, or a criterion with a check that is meant."""
    checks = loaded.checks
    found = (checks[c.check] for c in loaded.rubric.criteria if c.check in checks)
    return bool(select_started(loaded.rubric).scenarios) or any(map(is_meant, found))


def rates_of(rubric: Rubric) -> dict[str, tuple[RateBounds, ...]]:
    """Return, by scenario, the rates that end a run once they are clear: none where another criterion may wait for what
    comes later."""
    found: dict[str, list[RateBounds]] = defaultdict(list)
    lasting = {c.scenario for c in rubric.criteria if c.scenario and _may_come_late(c, rubric)}
    for criterion in rubric.criteria:
        check = CHECKS.get(criterion.check)
        bounds = check.rate_bounds(criterion.parameters) if check and criterion.scenario else None
        if bounds is not None and criterion.scenario not in lasting:
            found[criterion.scenario or ""].append(bounds)
    return {scenario: tuple(rates) for scenario, rates in found.items()}


def _may_come_late(criterion: Criterion, rubric: Rubric) -> bool:
    """Return whether what a criterion judges may come only after the rates of its run are clear."""
    given, topics = criterion.parameters, rubric.scenarios[criterion.scenario or ""].until.topics
    if given.get("values") or given.get("when") in {"any", "last"}:
        return True
    return criterion.check not in SEEN_AT_ONCE or given.get("topic", next(iter(topics), "")) not in topics


SEEN_AT_ONCE = {
    "rate", "node-lives", "node-name", "topic-type", "stamps", "message", "field-equals", "field-bounds",
}  # fmt: skip
"""Checks of what the first messages on a run's topics show as the later ones do."""


def watched_of(rubric: Rubric) -> dict[str, float]:
    """Return, by scenario, for how many seconds its nodes have to be watched for all to be judged."""
    found: dict[str, float] = defaultdict(float)
    for criterion in rubric.criteria:
        check = CHECKS.get(criterion.check)
        for one in check.references(criterion.parameters) if check and criterion.scenario else ():
            if one.to == "watched_s" and isinstance(one.value, int | float):
                found[criterion.scenario or ""] = max(found[criterion.scenario or ""], one.value)
    return dict(found)


def goals_of(rubric: Rubric) -> dict[str, dict[tuple[str, int], JudgedGoal]]:
    """Return, by scenario, the goals that criteria judge, by action and number."""
    found: dict[str, dict[tuple[str, int], JudgedGoal]] = defaultdict(dict)
    for criterion in rubric.criteria:
        if criterion.check == "action-result" and criterion.scenario:
            one = ActionResultParams.model_validate(criterion.parameters)
            own, goal = found[criterion.scenario], (one.action, one.goal)
            known = own.get(goal, JudgedGoal(0.0, within_s=0.0))
            more_s = math.inf if one.matters_s is None else one.matters_s
            within_s = 0.0 if one.of_feedback_alone else one.within_s or math.inf
            own[goal] = JudgedGoal(
                max(known.matters_s, more_s),
                max(known.feedback, one.least_feedback),
                max(known.within_s, within_s),
            )
    return dict(found)


def origin_of(rubric: LoadedRubric, students: Iterable[Path | None]) -> RubricOrigin:
    """Return where the rubric came from; `students` are the folders that the student can change, if they are known.

    A checkout of another repository in one of them is not the student's; a submodule is, since the student names it.
    """
    if rubric.origin != "elsewhere":
        return rubric.origin
    # A link of the student's chooses a file, too.
    files = {rubric.path.parent.resolve() / rubric.path.name, rubric.path.resolve()}
    roots = [folder.resolve() for folder in students if folder is not None]
    return "submission" if any(_holds(root, file) for root in roots for file in files) else "elsewhere"


def checkout_around(path: Path) -> Path | None:
    """Return the top of the git checkout around a path; None where there is none. A submodule, whose `.git` is a file,
    belongs to the one around it."""
    absolute = path.resolve()
    return next((folder for folder in (absolute, *absolute.parents) if (folder / ".git").is_dir()), None)


def _holds(root: Path, file: Path) -> bool:
    checkout = checkout_around(file.parent)
    return file.is_relative_to(root) and (checkout is None or root.is_relative_to(checkout))
