"""What repeated runs, and runs of a repaired copy, say of a criterion that the first runs lost. Pure.

All runs of the evidence come in, and `split_runs` sorts them into the first ones, repeats and those of the copy. With
the verdicts on these, `drop_unrepeated_losses` takes back losses that did not come again, and `apply_repaired_copy`
gives the shares of points that were earned on the copy. `repairs_of` says what was repaired there; `concerns` and
`is_used_by` say which criteria and scenarios a repair could matter to, before the copy is run (`repaired_copy.py`).

Verdicts on the copy are given with the lines and names that its files have in the package as handed in: a repair
may add lines, take some out or rename a file, and students look into their own files.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from types import MappingProxyType
from typing import NamedTuple

from pydantic import ValidationError

from grader.checks.support.scripts import PYTHON, copies_of, find_script, installed, names_script
from grader.evidence.events import CATKIN_MAKE, PACKAGE_RUN
from grader.evidence.run import Run
from grader.judging import repair_charges
from grader.model.package import MANIFEST, PackageFacts
from grader.model.repair import OF_LOGIC, RENAMED, Repair
from grader.model.result import CriterionResult, Repaired
from grader.model.verdict import FileCitation, Status, Verdict, cited_lines
from grader.rubric.model import Criterion, Rubric
from grader.rubric.scenario import Scenario
from grader.wording import AT_THE_END

REPAIRS = "repairs"
AT_ANY_RATE = {"node-name", "node-lives", "topic-type"}
"""Checks of runs that a loop which does not sleep passes too."""
OF_WAYS = {"path", "ends-at", "stays-within"}
"""Checks of where a robot drives, which a turn to the wrong side can fail."""
OF_ANY_WORDS = AT_ANY_RATE | {"rate", "connected", "launch-connects", "launch-runs"}
"""Checks of runs that a node passes whatever it says."""
GENERATION = re.compile(
    r"generate_messages|message_generation|add_(message|service|action)_files|add_executable|\.(msg|srv|action)\b"
)
"""Where these are wrong in CMakeLists.txt, a build may succeed without the package's definitions or programs."""
# What only makes `rosrun` find a script: runs start it from its source anyway.
INSTALLING = re.compile(r"\bcatkin_install_python\b|\bPROGRAMS\b")

REPAIRED, REPAIRED_AGAIN, REPEATED = "repaired-1", "repaired-2", "repeated-1"
"""The folders of the other runs: of the repaired copy, of the copy once more, of the package as it is once more."""

Runs = dict[str, Run]


class SplitRuns(NamedTuple):
    """Runs by their scenarios."""

    first: Runs
    repeated: Runs
    repaired: Runs
    """Those of the repaired copy."""
    repaired_again: Runs
    """What is repeated of these."""


def split_runs(runs: Mapping[str, Run]) -> SplitRuns:
    """Return the first runs, the repeated ones, those of the repaired copy and what is repeated of these."""
    split = SplitRuns({}, {}, {}, {})
    others = {REPAIRED: split.repaired, REPAIRED_AGAIN: split.repaired_again, "": split.first}
    for name, run in runs.items():
        folder, _, scenario = name.rpartition("/")
        others.get(folder, split.repeated)[scenario] = run
    return split


def drop_unrepeated_losses(
    rubric: Rubric, first: Mapping[str, Verdict], again: Mapping[str, Verdict], scenarios: Collection[str]
) -> dict[str, Verdict]:
    """Return the verdicts without those losses that one run's timing could have made and that did not come again."""
    verdicts = dict(first)
    for criterion in rubric.criteria:
        one, other = first[criterion.id], again[criterion.id]
        if criterion.scenario not in scenarios or not one.status.is_lost:
            continue
        if (one.basis.timing or one.status is Status.BLOCKED) and other.status is Status.PASS:
            message = f"{other.message} (seen once and not again, so it costs nothing: {one.message})"
            verdicts[criterion.id] = other.model_copy(update={"message": message})
        elif one.basis.timing and other.status.is_lost:
            update = {"citations": tuple(dict.fromkeys(one.citations + other.citations))}
            verdicts[criterion.id] = one.model_copy(update=update)
        elif one.basis.timing and other.status.is_open:
            verdicts[criterion.id] = other
    return verdicts


def was_built(runs: Mapping[str, Run]) -> bool:
    """Return whether `catkin_make` worked."""
    events = runs[PACKAGE_RUN].processes if PACKAGE_RUN in runs else ()
    return any(e.event == "exit" and e.name == CATKIN_MAKE and e.exit_code == 0 for _, e in events)


def needs_build(package: PackageFacts | None) -> bool:
    """Return whether its nodes need what the build makes: messages, programs, modules. Scripts run without."""
    packages = (package, *package.also) if package is not None else ()
    paths = [PurePosixPath(file.path) for one in packages for file in one.files]
    return any(path.suffix in repair_charges.MADE_BY_BUILDS or path.name == "setup.py" for path in paths)


def programs_of_build(package: PackageFacts) -> set[str]:
    """Return the paths of the scripts of which the build makes programs: neither their bit nor first line is used."""
    named = [one for one in installed(package) if one.call.name == PYTHON]
    return {file.path for file in package.files if any(names_script(one, file.path) for one in named)}


def never_run(package: PackageFacts, rubric: Rubric) -> set[str]:
    """Return the paths of the scripts beside which another of their name is the one that the rubric starts."""
    starts = [s.script for scenario in rubric.scenarios.values() for s in scenario.start if s.script]
    run = {file.path for script in starts if (file := find_script(package, script))}
    return {file.path for path in run for file in copies_of(package, path)} - run


def repairs_of(rubric: Rubric, repaired: Mapping[str, Run]) -> tuple[Repair, ...]:
    """Return the repairs of the copy that was run, as far as the rubric lets them count."""
    written = repaired[PACKAGE_RUN].metadata.get(REPAIRS, "[]") if PACKAGE_RUN in repaired else "[]"
    try:
        found = tuple(Repair.model_validate(entry) for entry in json.loads(written))
    except (ValueError, ValidationError):
        return ()
    # All or none: the copy ran with all of them, so what it shows cannot be told apart.
    return found if all(rubric.share_of(one.kind) > 0 for one in found) else ()


def apply_repaired_copy(
    rubric: Rubric,
    first: Mapping[str, Verdict],
    on_copy: Mapping[str, Verdict],
    repairs: tuple[Repair, ...],
    *,
    built: bool,
    builds: bool,
    launched: Launched,
) -> tuple[dict[str, Verdict], dict[str, Repaired]]:
    """Return the verdicts with what the copy shows, and for each criterion that it changes the repairs behind it.

    For each repair, the criterion that asks for what was wrong keeps its loss. The others earn the share of the repairs
    that they needed; where they are lost on the copy too, they say why.
    """
    verdicts, uses = dict(first), dict[str, Repaired]()
    on_copy = {name: with_lines_as_handed_in(verdict, repairs) for name, verdict in on_copy.items()}
    by_logic = {one for one in repairs if one.kind in OF_LOGIC}
    helped = _helped(rubric, first, on_copy) if by_logic else set[str]()
    needs = {
        c.id: tuple(
            one
            for one in repairs
            if (one not in by_logic or c.id in helped)
            and concerns(one, c, rubric, first, built=built, builds=builds, launched=launched)
        )
        for c in rubric.criteria
    }
    needs.update(dict.fromkeys(_of_own_rate(rubric, first, repairs, built, launched), ()))
    better = {c.id for c in rubric.criteria if _is_better(first, on_copy, c, needs[c.id])}
    charges = repair_charges.charge_repairs(rubric, first, better, needs)
    for criterion in rubric.criteria:
        charged = tuple(one for one in repairs if criterion.id in charges.get(one, ()))
        needed = repair_charges.without_idle(needs[criterion.id], charges) or charged
        if criterion.id not in better or not needed:
            continue
        verdict, copy = first[criterion.id], on_copy[criterion.id]  # of two repairs, the dearer one counts
        share = min(rubric.share_of(one.kind) for one in needed) if criterion.points else 1.0
        told = repairs_as_handed_in(charged or needed, repairs)
        placed = with_names_as_handed_in(copy, repairs)
        if charged:
            own = _without_others(verdict, [one for one in needed if one not in charged], charged)
            verdicts[criterion.id] = repair_charges.charged_verdict(
                own, copy, told, cited_lines(placed.citations)
            )
        else:
            verdicts[criterion.id] = repair_charges.shared_verdict(placed, told, share)
        uses[criterion.id] = Repaired(repairs=told, share=share, charged=bool(charged))
    installing = {c.id for c in rubric.criteria if c.check == repair_charges.INSTALL}
    return {i: _at_new_paths(v, repairs) if i in installing else v for i, v in verdicts.items()}, uses


def _of_own_rate(
    rubric: Rubric,
    first: Mapping[str, Verdict],
    repairs: Sequence[Repair],
    built: bool,
    launched: Launched,
) -> Iterator[str]:
    """Yield the criteria that have judged a rate which the copy changed: what they pass with is not the student's."""
    rates = [one for one in repairs if one.kind == repair_charges.OF_RATES]
    for one in (
        c for c in rubric.criteria if c.check == "rate" and c.scenario and not first[c.id].blocked_by
    ):
        scenario = rubric.scenarios[str(one.scenario)]
        if any(is_used_by(scenario, rate, rubric, built=built, launched=launched) for rate in rates):
            yield one.id


def _is_better(
    first: Mapping[str, Verdict],
    on_copy: Mapping[str, Verdict],
    criterion: Criterion,
    needed: Sequence[Repair],
) -> bool:
    """Return whether the copy shows more of a lost criterion: no loss, a next fault, or what the machine lacks behind
    the line that is repaired."""
    verdict, copy = first[criterion.id], on_copy[criterion.id]
    if (
        verdict.blocked_by
        and copy.blocked_by == verdict.blocked_by
        and not on_copy[copy.blocked_by].blocked_by
    ):
        return False  # what it waits for is not repaired
    return verdict.status.is_lost and (
        not _is_worse(first, on_copy, criterion)
        or repair_charges.is_next_fault(verdict, copy, needed)
        or (copy.basis.of_machine and any(repair_charges.fails_in(verdict, one) for one in needed))
    )


def _helped(rubric: Rubric, first: Mapping[str, Verdict], on_copy: Mapping[str, Verdict]) -> set[str]:
    """Return the criteria that pass on a copy whose logic is changed; none where another one is lost by the change."""
    judged = [c.id for c in rubric.criteria if c.check not in AT_ANY_RATE]
    worse = any(on_copy[i].status.is_lost and not first[i].status.is_lost for i in judged)
    # a robot whose way is right for one criterion alone turns as it should by chance
    strays = {c.scenario for c in rubric.criteria if c.check in OF_WAYS and on_copy[c.id].status.is_lost}
    chance = {c.id for c in rubric.criteria if c.check in OF_WAYS and c.scenario in strays}
    return set() if worse else {i for i, one in on_copy.items() if one.status is Status.PASS} - chance


def _at_new_paths(verdict: Verdict, repairs: Iterable[Repair]) -> Verdict:
    """Return the verdict with a hint that names the scripts that are to be renamed where they lie then."""
    hint = verdict.hint
    for one in repairs:
        name = re.escape(PurePosixPath(one.after).name) if one.kind == "file-name" else ""
        hint = re.sub(rf"(?<![\w./-])(?:[\w.-]+/)*{name}(?![\w.-])", one.after, hint) if name else hint
    return verdict.model_copy(update={"hint": hint})


def _without_others(verdict: Verdict, others: Sequence[Repair], charged: Sequence[Repair]) -> Verdict:
    """Return the loss as blocked where what was found is in lines that other repairs made readable, or is repaired by
    these alone: the criterion that these are charged to tells it."""
    of_build = verdict.basis.unbuilt and any(one.kind in repair_charges.OF_BUILDS for one in others)
    theirs = of_build or any(repair_charges.is_told(one, verdict.hint) for one in others)
    own = any(repair_charges.is_told(one, verdict.hint) for one in charged)
    lines = repair_charges.lines_read_now(others)
    if cited_lines(verdict.citations).isdisjoint(lines) and (own or not theirs):
        return verdict
    return verdict.model_copy(update={"status": Status.BLOCKED, "citations": ()})


def concerns(
    repair: Repair,
    criterion: Criterion,
    rubric: Rubric,
    found: Mapping[str, Verdict] | Mapping[str, CriterionResult],
    *,
    built: bool,
    launched: Launched,
    builds: bool = False,
) -> bool:
    """Return whether the criterion may depend on what was repaired: its run or build uses it, or it, or what blocks it,
    cites the file. What the files of the build lack stays lost, though: the criteria of these files ask for just that.

    `found` is what each criterion came to without the repair, `built` whether what is run was built without it, or
    needs no build; `builds`, whether the package as handed in was: its build needs no further line of the manifest, and
    none that only installs scripts, which the criterion of installing asks for.
    """
    if criterion.scenario is not None:
        at_end = repair.message.endswith(AT_THE_END)
        is_other = criterion.check in _checks_of_others(repair) or (
            at_end and criterion.check != "node-lives"
        )
        return not is_other and is_used_by(
            rubric.scenarios[criterion.scenario], repair, rubric, built=built, launched=launched
        )
    if repair.kind == "package-name" and repair.file in repair_charges.OF_PACKAGES:
        wrong = repair_charges.words_of(repair.before) - repair_charges.words_of(repair.after)
        return bool(
            wrong & repair_charges.words_of(found[criterion.id].message)
        ) or repair_charges.cites_file(found[criterion.id], repair)
    if repair.kind in repair_charges.OF_BUILDS and (
        criterion.check == repair_charges.BUILD or repair_charges.is_unmade(found[criterion.id])
    ):
        idle = repair.kind == "manifest-line" and (builds or not _is_of_manifest(found[criterion.id], repair))
        return not idle and (not builds or not _only_installs(repair))
    seen = f"{found[criterion.id].message} {found[criterion.id].measured}"
    if repair.kind == "file-name" and PurePosixPath(repair.before).name in seen:
        return True
    if root := found[criterion.id].blocked_by:
        asking = criterion.requires if repair.kind in repair_charges.NAMES else (root,)
        return any(repair_charges.asks_for(found[name], repair) for name in asking)
    return repair.kind not in repair_charges.OF_BUILDS and repair_charges.asks_for(
        found[criterion.id], repair
    )


def _checks_of_others(repair: Repair) -> Collection[str]:
    """Return the checks of runs that do not depend on what was repaired, or judge it as it is."""
    if repair.kind == "loop-rate":
        return {"rate"}
    if repair.before.endswith(".sleep") and repair.after == f"{repair.before}()":
        return AT_ANY_RATE
    return OF_ANY_WORDS if repair.kind == "missing-call" and _is_of_words(repair) else ()


def _is_of_words(repair: Repair) -> bool:
    """Return whether the repair changes no more than what a line prints: its `%`, or the `f` in front of its text."""
    prints = (
        "\n" not in repair.before and re.search(r"\b(?:print|log\w+|write)\s*\(", repair.before) is not None
    )
    no_f = prints and re.sub(r"""\bf(?=["'])""", "", repair.after, count=1) == repair.before
    told, right = (re.sub(r"""%[sdf]|["'\s]""", "", text) for text in (repair.before, repair.after))
    return no_f or (prints and told == right) or repair.before.replace("+", "%", 1) == repair.after


def _added(repair: Repair) -> str:
    return "\n".join({*repair.after.split("\n")} - {*repair.before.split("\n")})


def _only_installs(repair: Repair) -> bool:
    return INSTALLING.search(_added(repair)) is not None and not GENERATION.search(_added(repair))


def _is_of_manifest(found: Verdict | CriterionResult, repair: Repair) -> bool:
    """Return whether a build may have failed for want of the line: it says so, or names what the line does. For a
    package that is needed to run alone, CMake asks for none."""
    names = re.findall(r">\s*([\w-]+)\s*<", _added(repair))
    named = any(re.search(rf"\b{re.escape(name)}\b", found.message) for name in (*names, MANIFEST))
    return not names or named or repair_charges.cites_file(found, repair)


Launched = Mapping[str, Collection[str]]
"""The names of launch files, each with those of the programs that it starts, and of scripts with those they name."""


def launched_in(package: PackageFacts | None, build: Run | None = None) -> Launched:
    """Return which programs each launch file starts, and which others it includes. One that can also run something else
    (a file that is not in the packages, a command, what only roslaunch works out) starts `ANY`. Of scripts whose lines
    the build has, which others they can use."""
    packages = (package, *package.also) if package is not None else ()
    files = [file for one in packages for file in one.launch_files]
    found: dict[str, set[str]] = {PurePosixPath(file.path).name: set() for file in files}
    for file in files:
        types = {node.type or "$(" for node in (*file.nodes, *file.brings)}
        included = {PurePosixPath(one).name for one in file.includes}
        unclear = file.fault is not None or any("$(" in one for one in types) or not included <= found.keys()
        unclear = unclear or any(param.value is None for param in file.params)
        found[PurePosixPath(file.path).name].update({ANY} if unclear else types | included)
    _add_what_those_name(found)
    if build is not None and len(packages) == 1:
        found.update(_scripts_named(packages[0], build))
    return found


def _scripts_named(package: PackageFacts, build: Run) -> dict[str, set[str]]:
    """Return for each script of the package those whose names stand in it, or in one of these: what it may import."""
    words: dict[str, set[str]] = {}
    for file in (one for one in package.files if one.path.endswith(".py")):
        lines = build.file_lines(file.path)
        if not lines and file.size_bytes:
            return {}
        # who imports a package runs its `__init__.py`, and does not name it
        said = {"__init__", *repair_charges.words_of(" ".join(lines).replace(".", " "))}
        words.setdefault(PurePosixPath(file.path).name, set()).update(said)
    named = {name: {one for one in words if one.removesuffix(".py") in said} for name, said in words.items()}
    _add_what_those_name(named)
    return named


def _add_what_those_name(named: Mapping[str, set[str]]) -> None:
    """Add to what each file names all that those name, and so on."""
    for name, found in named.items():
        for others in named.values():
            others.update(found if name in others else ())


ANY = "*"
"""Stands for all programs, where a launch file may start any."""


def is_used_by(
    scenario: Scenario,
    repair: Repair,
    rubric: Rubric,
    *,
    built: bool,
    launched: Launched = MappingProxyType({}),
) -> bool:
    """Return whether the scenario runs the repaired file, as far as the rubric says and as is known of what it has
    `launched`. A launch file that is not may run any, and a script may import what no launch file starts."""
    name = PurePosixPath(repair.after if repair.kind == "file-name" else repair.file).name
    both = {name, PurePosixPath(repair.after).name} if repair.kind == "exchanged-files" else {name}
    launches = any(start.launch for start in scenario.start)
    known = any(name in _started_files(one) for one in rubric.scenarios.values())
    if repair.kind in repair_charges.DONE_BEFORE_RUNS:
        return not known and _may_launch(scenario, name, launched)
    if repair.kind in repair_charges.OF_BUILDS:
        of_file = PurePosixPath(repair.file).suffix in repair_charges.MADE_BY_BUILDS
        changed = {*repair.after.split("\n")} - {*repair.before.split("\n")}
        made = of_file or any(map(GENERATION.search, changed))
        return made or not built or any(start.built for start in scenario.start)
    if repair.kind == "package-name" and repair.file in repair_charges.OF_PACKAGES:
        return True
    # what hides a module is imported by every script beside it
    if both & _started_files(scenario) or name == f"{RENAMED}{PurePosixPath(repair.before).name}":
        return True
    if name.endswith((".launch", ".launch.xml")):
        included = any({ANY, name} & {*launched.get(one, {ANY})} for one in _started_files(scenario))
        return launches and not known and included
    a_program = any(name in found for file, found in launched.items() if not file.endswith(".py"))
    imported = [launched.get(one, {name}) for one in _started_files(scenario)]
    unused = name.endswith(".py") and imported != [] and not any(name in found for found in imported)
    not_run = repair.kind == "launch-type" or (
        repair.kind == "yaml-syntax"
        and name in {PurePosixPath(param.file).name for param in scenario.params if param.file}
    )
    return not not_run and (launches or not (known or a_program or unused))


def _may_launch(scenario: Scenario, program: str, launched: Launched) -> bool:
    files = [PurePosixPath(start.launch).name for start in scenario.start if start.launch]
    return any(file not in launched or {ANY, program} & {*launched[file]} for file in files)


def is_first_line_added(repair: Repair, rubric: Rubric, repairs: Iterable[Repair] = ()) -> bool:
    """Return whether a script that the rubric starts, by its name or by the one that it gets in `repairs`, lacks its
    first line. The arena adds it before any run, and a copy with it would have all lines one further down than the
    script that was handed in."""
    added = repair.kind == "shebang" and repair.after.count("\n") > repair.before.count("\n")
    new = {one.before: one.after for one in repairs if one.kind == "file-name"}
    name = PurePosixPath(new.get(repair.file, repair.file)).name
    return added and any(name in _started_files(one) for one in rubric.scenarios.values())


def _started_files(scenario: Scenario) -> set[str]:
    return {PurePosixPath(path).name for s in scenario.start for path in (s.script, s.launch) if path}


def _is_worse(first: Mapping[str, Verdict], on_copy: Mapping[str, Verdict], criterion: Criterion) -> bool:
    """Return whether the copy shows no more of a lost criterion than the package as it is."""
    one, copy = first[criterion.id], on_copy[criterion.id]
    if copy.status.is_lost and copy.score <= one.score:
        same = copy.basis.cause == one.basis.cause and copy.blocked_by == one.blocked_by
        return not one.basis.unjudged or (copy.basis.unjudged and same)
    # what was judged before, and could not be on the copy, shows nothing of the repair, unless it ended in the same way
    by_machine = copy.basis.cause != "" and copy.basis.cause == one.basis.cause
    return copy.status is Status.ERROR or (copy.status.is_open and not one.basis.unjudged and not by_machine)


LINES = re.compile(
    r"(?:(?P<before>[\w./-]+\.\w+),? )?\blines? (?P<numbers>\d+(?:(?:, | and | to )\d+)*)"
    r"(?: of (?P<behind>[\w./-]*\w))?"
)
WHOLE_FILES = ("encoding", "byte-order-mark", "line-ends", "file-name", "executable-bit", "exchanged-files")
"""Repairs of these kinds change no line."""


def with_lines_as_handed_in(verdict: Verdict, repairs: Sequence[Repair]) -> Verdict:
    """Return a verdict on a copy with these repairs, whose citations and texts name the lines before them."""
    moving, renamed = _moving(repairs), {**_renamed(repairs), **_exchanged(repairs)}
    if not moving:
        return verdict
    cited = tuple(
        one.model_copy(update={"line": _before(moving, renamed.get(one.file, one.file), one.line)})
        if isinstance(one, FileCitation) and one.line is not None
        else one
        for one in verdict.citations
    )
    files = {one.file for one in verdict.citations if isinstance(one, FileCitation)}
    alone = files.pop() if len(files) == 1 else ""
    message, hint, cause = (
        text_as_handed_in(text, repairs, alone)
        for text in (verdict.message, verdict.hint, verdict.basis.cause)
    )
    update = {"citations": cited, "message": message, "hint": hint}
    return verdict.model_copy(update=update).based_on(cause=cause)


def text_as_handed_in(text: str, repairs: Sequence[Repair], alone: str = "") -> str:
    """Return a text on the copy that names the lines before these repairs; a line without a file is of `alone`."""
    moving, renamed = _moving(repairs), {**_renamed(repairs), **_exchanged(repairs)}

    def counted(found: re.Match[str]) -> str:
        file = found["before"] or found["behind"] or alone
        file = renamed.get(file, file)
        numbers = re.sub(r"\d+", lambda n: str(_before(moving, file, int(n[0]))), found["numbers"])
        start = found.start("numbers") - found.start()
        return found[0][:start] + numbers + found[0][start + len(found["numbers"]) :]

    return LINES.sub(counted, text) if moving else text


def repairs_as_handed_in(needed: Iterable[Repair], repairs: Sequence[Repair]) -> tuple[Repair, ...]:
    """Return the repairs with files and lines as in the package as it is: the copy's repairs before each of them may
    have renamed the one and moved the others."""
    names = {new: old for old, new in _renamed(repairs).items()}
    told = []
    for one in needed:
        file, earlier = names.get(one.file, one.file), repairs[: repairs.index(one)] if one in repairs else ()
        line = one.line if one.line is None else _before(_moving(earlier), one.file, one.line)
        message = text_as_handed_in(one.message, earlier, one.file).replace(one.file, file)
        fix = text_as_handed_in(one.fix, earlier, one.file)
        told.append(one.model_copy(update={"file": file, "line": line, "message": message, "fix": fix}))
    return tuple(told)


def with_names_as_handed_in(copy: Verdict, repairs: Iterable[Repair]) -> Verdict:
    """Return a verdict on the copy that cites files by the names that they have in the package as it is."""
    repairs = tuple(repairs)
    names = {new: old for old, new in _renamed(repairs).items()}
    names |= {file: names.get(held, held) for file, held in _exchanged(repairs).items()}
    cited = tuple(
        one.model_copy(update={"file": names.get(one.file, one.file)})
        if isinstance(one, FileCitation)
        else one
        for one in copy.citations
    )
    return copy.model_copy(update={"citations": cited})


def _renamed(repairs: Iterable[Repair]) -> dict[str, str]:
    return {one.before: one.after for one in repairs if one.kind == "file-name"}


def _exchanged(repairs: Iterable[Repair]) -> dict[str, str]:
    """Return for each of two files on the copy in which one its lines were."""
    return {
        new: old
        for one in repairs
        if one.kind == "exchanged-files"
        for new, old in ((one.before, one.after), (one.after, one.before))
    }


def _moving(repairs: Sequence[Repair]) -> list[Repair]:
    """Return the repairs that add lines or take some out, of files by the names that they get."""
    renamed = _renamed(repairs)
    return [
        one.model_copy(update={"file": renamed.get(one.file, one.file)})
        for one in repairs
        if one.kind not in WHOLE_FILES
        and (
            one.before.count("\n") != one.after.count("\n")
            or (one.before != one.after and sorted(one.before.split("\n")) == sorted(one.after.split("\n")))
        )
    ]


def _before(moving: Sequence[Repair], file: str, line: int) -> int:
    """Return the number that the line of a file had before the repairs, the last of which is undone first."""
    for one in reversed(moving):
        first, old, new = one.line or 1, one.before.split("\n"), one.after.split("\n")
        if one.file != file or line < first:
            continue
        at = line - first
        if at >= len(new):
            line += len(old) - len(new)
        else:
            same = [i for i, text in enumerate(old) if text == new[at]]
            line = first + min(same or [min(at, len(old) - 1)], key=lambda i: abs(i - at))
    return line
