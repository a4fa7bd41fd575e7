"""What repeated runs, and runs of a repaired copy, say of a criterion that the first runs lost. Pure.

All runs of the evidence come in, and `split_runs` sorts them into the first ones, repeats and those of the copy. With
the verdicts on these, `drop_unrepeated_losses` takes back losses that did not come again, and `apply_repaired_copy`
gives the shares of points that were earned on the copy. `repairs_of` says what was repaired there; `concerns` and
`is_used_by` say which criteria and scenarios a repair could matter to, before the copy is run (`repaired_copy.py`).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from graphlib import TopologicalSorter
from pathlib import PurePosixPath
from types import MappingProxyType

from pydantic import ValidationError

from grader.checks.support.scripts import PYTHON, installed, names_script
from grader.checks.support.text import texts_in
from grader.evidence.events import CATKIN_MAKE, PACKAGE_RUN
from grader.evidence.run import Run
from grader.judging.as_handed_in import repairs_as_handed_in, with_lines_as_handed_in, with_names_as_handed_in
from grader.model.package import CMAKE, MANIFEST, PackageFacts
from grader.model.repair import Repair, advice_on, messages_of, place_of
from grader.model.result import CriterionResult, Repaired
from grader.model.verdict import FileCitation, Status, Verdict, cited_lines, failed, share_text
from grader.rubric.model import Criterion, Rubric
from grader.rubric.scenario import Scenario
from grader.wording import join_words

REPAIRS, BUILD, INSTALL = "repairs", "build", "cmake-install"
NAMES = {
    "topic-name",
    "service-name",
    "node-name",
    "parameter-name",
    "file-name",
    "package-name",
    "launch-type",
}
OF_BUILDS = {"build-line", "manifest-line"}
"""These explain nothing but the build and the files, unless something is run that the build makes."""
SEEN_IN_RUNS = {"missing-import", "missing-call", "topic-name", "service-name", "node-name", "parameter-name"}
"""These are lost in runs, so no criterion of the files asks for them."""
DONE_BEFORE_RUNS = {"executable-bit", "line-ends", "shebang", "byte-order-mark", "encoding"}
"""The arena repairs these in the scripts that the rubric starts, so no run of those is lost by them."""
OF_SYNTAX = {"python-syntax", "launch-syntax"}
"""Of a line that could not be read, the copy shows for the first time what it says."""
AT_ANY_RATE = {"node-name", "node-lives", "topic-type"}
"""Checks of runs that a loop which does not sleep passes too."""
OF_ANY_WORDS = AT_ANY_RATE | {"rate", "connected", "launch-connects", "launch-runs"}
"""Checks of runs that a node passes whatever it says."""
MADE_BY_BUILDS = {".msg", ".srv", ".action", ".c", ".cc", ".cpp", ".cxx"}
OF_PACKAGES = {MANIFEST, CMAKE}
GENERATION = re.compile(
    r"generate_messages|message_generation|add_(message|service|action)_files|add_executable"
)
"""Where these are wrong in CMakeLists.txt, a build can succeed that makes nothing of the package's own definitions, or
another program."""
INSTALLING = re.compile(r"\bcatkin_install_python\b|\bPROGRAMS\b")
NUMBER = re.compile(r"\d+(\.\d+)?")

Runs = dict[str, Run]


def split_runs(runs: Mapping[str, Run]) -> tuple[Runs, Runs, Runs]:
    """Return the first runs, the repeated ones and those of the repaired copy, each by scenario."""
    first, repeated, repaired = Runs(), Runs(), Runs()
    for name, run in runs.items():
        folder, _, scenario = name.rpartition("/")
        found = repaired if folder.startswith("repaired") else repeated if folder else first
        found[scenario] = run
    return first, repeated, repaired


def drop_unrepeated_losses(
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
            update = {"citations": tuple(dict.fromkeys(one.citations + other.citations))}
            verdicts[criterion.id] = one.model_copy(update=update)
        elif one.timing and other.status.is_open:
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
    return any(path.suffix in MADE_BY_BUILDS or path.name == "setup.py" for path in paths)


def programs_of_build(package: PackageFacts) -> set[str]:
    """Return the paths of the scripts of which the build makes programs: neither their bit nor their first line is
    used."""
    named = [one for one in installed(package) if one.call.name == PYTHON]
    return {file.path for file in package.files if any(names_script(one, file.path) for one in named)}


def repairs_of(rubric: Rubric, repaired: Mapping[str, Run]) -> tuple[Repair, ...]:
    """Return the repairs of the copy that was run, as far as the rubric lets them count."""
    written = repaired[PACKAGE_RUN].metadata.get(REPAIRS, "[]") if PACKAGE_RUN in repaired else "[]"
    try:
        found = tuple(Repair.model_validate(entry) for entry in json.loads(written))
    except (ValueError, ValidationError):
        return ()
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
    needs = {
        c.id: tuple(
            one
            for one in repairs
            if concerns(one, c, rubric, first, built=built, builds=builds, launched=launched)
        )
        for c in rubric.criteria
    }
    better = {
        c.id
        for c in rubric.criteria
        if first[c.id].status.is_lost
        and (not _is_worse(first, on_copy, c) or _is_next(first[c.id], on_copy[c.id], needs[c.id]))
    }
    charges = _charges(rubric, first, better, needs)
    for criterion in rubric.criteria:
        charged = tuple(one for one in repairs if criterion.id in charges.get(one, ()))
        needed = needs[criterion.id] or charged
        if criterion.id not in better or not needed:
            continue
        verdict, copy = first[criterion.id], on_copy[criterion.id]
        share = min(rubric.share_of(one.kind) for one in needed) if criterion.points else 1.0
        told = repairs_as_handed_in(charged or needed, repairs)
        verdict = (
            _without_others(verdict, [one for one in needed if one not in charged]) if charged else verdict
        )
        placed = with_names_as_handed_in(copy, repairs)
        verdicts[criterion.id] = (
            _charge(verdict, copy, told, cited_lines(placed.citations))
            if charged
            else _share(placed, told, share)
        )
        uses[criterion.id] = Repaired(repairs=told, share=share, charged=bool(charged))
    installing = {c.id for c in rubric.criteria if c.check == INSTALL}
    return {i: _at_new_paths(v, repairs) if i in installing else v for i, v in verdicts.items()}, uses


def _at_new_paths(verdict: Verdict, repairs: Iterable[Repair]) -> Verdict:
    """Return the verdict with a hint that names the scripts that are to be renamed where they lie then."""
    hint = verdict.hint
    for one in repairs:
        name = re.escape(PurePosixPath(one.after).name) if one.kind == "file-name" else ""
        hint = re.sub(rf"(?<![\w./-])(?:[\w.-]+/)*{name}(?![\w.-])", one.after, hint) if name else hint
    return verdict.model_copy(update={"hint": hint})


def _without_others(verdict: Verdict, others: Sequence[Repair]) -> Verdict:
    """Return the loss as blocked where what was found is in lines that other repairs made readable: the criterion that
    these are charged to tells it."""
    if cited_lines(verdict.citations).isdisjoint(_lines_read_now(others)):
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
        sleeps = repair.before.endswith(".sleep") and repair.after == f"{repair.before}()"
        words = repair.kind == "missing-call" and repair.before.replace("+", "%", 1) == repair.after
        of_others = AT_ANY_RATE if sleeps else OF_ANY_WORDS if words else set[str]()
        return criterion.check not in of_others and is_used_by(
            rubric.scenarios[criterion.scenario], repair, rubric, built=built, launched=launched
        )
    if repair.kind == "package-name" and repair.file in OF_PACKAGES:
        wrong = _words(repair.before) - _words(repair.after)
        return bool(wrong & _words(found[criterion.id].message)) or _cites(found[criterion.id], repair)
    if repair.kind in OF_BUILDS and (criterion.check == BUILD or is_unmade(found[criterion.id])):
        return not builds or not (repair.kind == "manifest-line" or _only_installs(repair))
    seen = f"{found[criterion.id].message} {found[criterion.id].measured}"
    if repair.kind == "file-name" and PurePosixPath(repair.before).name in seen:
        return True
    if root := found[criterion.id].blocked_by:
        asking = criterion.requires if repair.kind in NAMES else (root,)
        return any(_asks_for(found[name], repair) for name in asking)
    return repair.kind not in OF_BUILDS and _asks_for(found[criterion.id], repair)


def _only_installs(repair: Repair) -> bool:
    added = "\n".join({*repair.after.split("\n")} - {*repair.before.split("\n")})
    return INSTALLING.search(added) is not None and not GENERATION.search(added)


def is_unmade(found: Verdict | CriterionResult) -> bool:
    """Return whether a script is lost because the build failed that was to make a program of it."""
    return found.mistake is not None and found.mistake.kind == "not-made"


Launched = Mapping[str, Collection[str]]
"""The names of launch files, each with those of the programs that it starts."""


def launched_in(package: PackageFacts | None) -> Launched:
    """Return which programs each launch file starts. One that can also run something else (what it includes, a command,
    what only roslaunch works out) starts `ANY`."""
    packages = (package, *package.also) if package is not None else ()
    found: dict[str, set[str]] = {}
    for file in (file for one in packages for file in one.launch_files):
        types = {node.type or "$(" for node in (*file.nodes, *file.brings)}
        unclear = file.fault is not None or any("$(" in one for one in types) or len(file.includes) > 0
        unclear = unclear or any(param.value is None for param in file.params)
        found.setdefault(PurePosixPath(file.path).name, set()).update({ANY} if unclear else types)
    return found


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
    launches = any(start.launch for start in scenario.start)
    known = any(name in _started_files(one) for one in rubric.scenarios.values())
    if repair.kind in DONE_BEFORE_RUNS:
        return not known and _may_launch(scenario, name, launched)
    if repair.kind in OF_BUILDS:
        of_file = PurePosixPath(repair.file).suffix in MADE_BY_BUILDS
        changed = {*repair.after.split("\n")} - {*repair.before.split("\n")}
        made = of_file or any(map(GENERATION.search, changed))
        return made or not built or any(start.built for start in scenario.start)
    if repair.kind == "package-name" and repair.file in OF_PACKAGES:
        return True
    if name in _started_files(scenario):
        return True
    if name.endswith((".launch", ".launch.xml")):
        return launches and not known
    a_program = any(name in programs for programs in launched.values())
    return repair.kind != "launch-type" and (launches or not (known or a_program))


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
    """Return the names of the files that the scenario starts."""
    return {PurePosixPath(path).name for s in scenario.start for path in (s.script, s.launch) if path}


def _is_worse(first: Mapping[str, Verdict], on_copy: Mapping[str, Verdict], criterion: Criterion) -> bool:
    """Return whether the copy shows no more of a lost criterion than the package as it is."""
    one, copy = first[criterion.id], on_copy[criterion.id]
    if copy.status.is_lost and copy.score <= one.score:
        same = copy.cause == one.cause and copy.blocked_by == one.blocked_by
        return not one.unjudged or (copy.unjudged and same)
    # what was judged before, and could not be on the copy, shows nothing of the repair
    return copy.status is Status.ERROR or (copy.status.is_open and not one.unjudged)


def _is_next(one: Verdict, copy: Verdict, repairs: Sequence[Repair]) -> bool:
    """Return whether a loss is in what was repaired, and the copy loses the criterion by another fault."""
    files = {repair.file for repair in repairs}
    found = {(c.file, c.line) for c in one.citations if isinstance(c, FileCitation) and c.file in files}
    again = cited_lines(copy.citations)
    again -= _lines_read_now(repairs)
    return found != set() and not copy.unjudged and not found & again and _is_other_fault(one, copy)


def _lines_read_now(repairs: Iterable[Repair]) -> set[tuple[str, int]]:
    """Return the lines that could not be read before these repairs."""
    return {
        (repair.file, repair.line + further)
        for repair in repairs
        if repair.kind in OF_SYNTAX and repair.line is not None
        for further in range(len(repair.before.split("\n")))
    }


def _is_other_fault(one: Verdict, copy: Verdict) -> bool:
    said, then = (NUMBER.sub("", verdict.message) for verdict in (one, copy))
    return copy.status.is_lost and said != then


def _charges(
    rubric: Rubric,
    first: Mapping[str, Verdict],
    better: AbstractSet[str],
    needs: Mapping[str, tuple[Repair, ...]],
) -> dict[Repair, set[str]]:
    """Return for each repair the criterion that asks for what was wrong: one of the files, else by its name where a
    name was wrong, else the first that failed by itself, at best in that file, and not for its name. What others
    require comes first."""
    charges: dict[Repair, set[str]] = {}
    misnamed: set[str] = set()
    by_id = {c.id: c for c in rubric.criteria}
    order = TopologicalSorter({c.id: c.requires for c in rubric.criteria}).static_order()
    criteria = [by_id[name] for name in order if name in better]
    needed = dict.fromkeys(one for repairs in needs.values() for one in repairs)
    for repair in sorted(needed, key=lambda one: one.kind not in NAMES):
        asking = [c for c in rubric.criteria if c.scenario is None and _asks_for(first[c.id], repair)]
        if repair.kind in OF_BUILDS:  # of a file with several faults, those that speak of this line
            new = _new_words(repair)
            better_by_it = better - {c.id for c in rubric.criteria if c.check == INSTALL}
            asking = [c for c in asking if c.id in better_by_it or new & _words(first[c.id].message)]
        sought = [c for c in asking if _seeks(first[c.id], repair)]
        asking = sought or [c for c in asking if _names(c, repair)] or asking
        if asking:
            charges[repair] = {min(asking, key=lambda c: _lines_away(first[c.id], repair)).id}
            continue
        own = [c for c in rubric.criteria if repair.kind == "node-name" and _names(c, repair)]
        if any(first[c.id].status.is_lost and c.id not in better for c in own):
            continue  # the criterion of the name says by itself what is wrong with it
        possible = [c for c in criteria if repair in needs[c.id] and _may_ask_for(first[c.id], repair)]
        named = [c for c in possible if repair.kind in NAMES and _names(c, repair)]
        failing = [c for c in possible if first[c.id].status is not Status.BLOCKED]
        citing = [c for c in failing if _cites(first[c.id], repair)]
        builds = [c for c in possible if repair.kind in OF_BUILDS and c.check == BUILD]
        counting = [c.id for c in (*builds, *named, *citing, *failing, *possible) if c.points > 0]
        other = [name for name in counting if name not in misnamed]
        charges[repair] = set((counting if named else other or counting)[:1])
        misnamed |= charges[repair] if named else set()
    return charges


def _may_ask_for(found: Verdict, repair: Repair) -> bool:
    """Return whether a criterion can be lost by what was repaired: by what keeps a script from being started only where
    that script is named."""
    return repair.kind not in DONE_BEFORE_RUNS or PurePosixPath(repair.file).name in found.message


def _seeks(found: Verdict, repair: Repair) -> bool:
    """Return whether a criterion is lost by the very call that the repair adds."""
    return found.sought_name("call") in _new_words(repair)


def _lines_away(found: Verdict, repair: Repair) -> float:
    """Return how far the nearest line that a verdict cites is from the repaired one. The line below which a call that
    is missing goes is not a fault."""
    if repair.line is None or found.sought_name("call") or found.sought_name("below"):
        return math.inf
    lines = [line for file, line in cited_lines(found.citations) if file == repair.file]
    return min((abs(line - repair.line) for line in lines), default=math.inf)


def _cites(found: Verdict | CriterionResult, repair: Repair) -> bool:
    if repair.kind == "executable-bit" and not _is_told(repair, found.hint):
        return False  # the build installs what runs the script, bit or not
    return any(getattr(citation, "file", None) == repair.file for citation in found.citations)


def _asks_for(found: Verdict | CriterionResult, repair: Repair) -> bool:
    """Return whether a criterion of the files is lost by what was repaired. What is otherwise seen in runs, such as a
    node's name, one of a launch file can refuse at its very line."""
    lost = found.status.is_lost and found.status is not Status.BLOCKED
    if repair.kind in SEEN_IN_RUNS:
        return lost and (repair.file, repair.line) in cited_lines(found.citations)
    absent = found.mistake.name if found.mistake and found.mistake.is_absence else ""
    if is_unmade(found):
        return False  # the build's own criterion asks for it
    is_it = repair.kind == "file-name" and PurePosixPath(absent).name == PurePosixPath(repair.after).name
    return lost and (is_it or _cites(found, repair))


def _names(criterion: Criterion, repair: Repair) -> bool:
    """Return whether the criterion asks for the name that the repair puts in place; of a parameter's name, for one that
    has it as a part."""
    before, after = (set(re.findall(r"[\w.~/-]*\w", text)) for text in (repair.before, repair.after))
    new = {word.rpartition("/")[2].lstrip("~") for word in after - before}
    texts = texts_in(criterion.parameters)
    if repair.kind == "parameter-name":
        return any(text.startswith("/") and new.intersection(text.split("/")) for text in texts)
    return any(text.strip("/").rpartition("/")[2] in new for text in texts)


def _words(text: str) -> set[str]:
    return set(re.findall(r"[\w.-]+", text))


def _new_words(repair: Repair) -> set[str]:
    return _words(repair.after) - _words(repair.before)


def _charge(
    verdict: Verdict, copy: Verdict, repairs: Sequence[Repair], lines: Collection[tuple[str, int]]
) -> Verdict:
    """Return the loss, with the repairs that were seen to help as its hint, and what the copy loses it by, at these
    lines of the package as it is."""
    blocked = verdict.status is Status.BLOCKED
    is_next = _is_next(verdict, copy, repairs) or (blocked and copy.status.is_lost and not copy.unjudged)
    if blocked:
        message = "; ".join(messages_of(repairs))
        verdict = failed(
            message, expected=copy.expected, measured=verdict.measured, citations=verdict.citations
        )
    further = copy.status is Status.BLOCKED and verdict.unjudged and copy.cause != verdict.cause
    paths = re.findall(r"[\w-]+(?:/[\w.-]+)+", copy.hint)
    told_at_once = paths != [] and all(path in verdict.hint for path in paths)
    if copy.status.is_lost and verdict.hint and (told_at_once or not (is_next or further)):
        return verdict  # the repair brings up what its own advice is about
    told = [one for one in repairs if _is_told(one, verdict.hint) and not _is_further_down(one, verdict)]
    clauses = verdict.hint.split("; ") if told else []
    if any(one not in told for one in repairs):
        clauses = [clause for clause in clauses if any(_is_told(one, clause) for one in told)]
    hints = clauses + advice_on(one for one in repairs if one not in told)
    said = verdict.message
    unsaid = [one for one in repairs if PurePosixPath(one.file).name not in said]
    words = [said, *(words for words in messages_of(unsaid) if words not in said)]
    is_new = not copy.hint or not set(copy.hint.split("; ")) <= set(hints)
    if further:
        words += [f"with that repaired, it is blocked by {copy.blocked_by}"]
        hints += [f"then fix {copy.blocked_by}"]
    elif is_next and is_new:
        untold = [clause for clause in copy.message.split("; ") if clause not in said]
        words += [f"with that repaired, {'; '.join(untold)}"] if untold else []
        hints = _hints_and_next(clauses, [one for one in repairs if one not in told], copy, lines)
    if verdict.mistake and any(one.kind == "file-name" for one in repairs):
        verdict = verdict.lost_by("file-elsewhere", verdict.mistake.name)
    update: dict[str, object] = {
        "message": "; ".join(words),
        "hint": "; ".join(hints),
        "citations": (*_uncited(verdict, repairs, told), *verdict.citations),
    }
    of_cmake = (one for one in repairs if PurePosixPath(one.file).name == CMAKE)
    if any(one not in told for one in of_cmake):  # how the call is written is told
        update["sought"] = tuple(one for one in verdict.sought if one.kind not in {"call", "uncalled"})
    return verdict.model_copy(update=update)


def _hints_and_next(
    clauses: list[str], repairs: Iterable[Repair], copy: Verdict, lines: Collection[tuple[str, int]]
) -> list[str]:
    """Return the hints on the repairs, followed by the copy's own. Where this one rewrites the only one of `lines`, no
    other hint on that line is needed; of a launch file's line it gives one attribute."""
    then = _at_its_line(copy)
    whole = then.startswith("on line ")
    rewritten = [
        one
        for one in repairs
        if whole and one.kind != "launch-syntax" and {(one.file, one.line)} == set(lines)
    ]
    for one in rewritten:  # by the name that the file still has
        then = re.sub(r"^on line \d+ of [^,]+", f"on line {one.line} of {one.file}", then)
    hints = clauses + advice_on(one for one in repairs if one not in rewritten)
    return [*hints, *([f"{'then ' if hints else ''}{then}"] if then else [])]


def _uncited(verdict: Verdict, repairs: Sequence[Repair], told: Collection[Repair]) -> Iterator[FileCitation]:
    """Yield the lines of the repairs that the verdict does not cite; of one that it tells, only in another file."""
    cited = {(c.file, c.line) for c in verdict.citations if isinstance(c, FileCitation)}
    with_lines = {file for file, line in cited if line is not None}
    for one in repairs:
        is_new = one.line is not None and (one.file, one.line) not in cited
        cited.add((one.file, one.line))
        if is_new and not (one in told and one.file in with_lines):
            yield FileCitation(file=one.file, line=one.line)


def _at_its_line(copy: Verdict) -> str:
    """Return the hint of a verdict on the copy; what is to be written with its line, where that is plain."""
    lines = [c for c in copy.citations if isinstance(c, FileCitation) and c.line is not None]
    if len(lines) != 1 or not copy.hint.startswith("write ") or " line " in copy.hint:
        return copy.hint
    return f"on line {lines[0].line} of {lines[0].file}, {copy.hint}"


def _is_told(repair: Repair, hint: str) -> bool:
    """Return whether the check's own hint says how this is repaired: how git learns of a bit, what has a name."""
    if repair.kind == "executable-bit":
        return repair.file in hint and "chmod" in hint
    if repair.kind == "parameter-name" and repair.before.strip() == repair.after.strip():
        return f"line {repair.line}" in hint
    new = _new_words(repair)
    of_package = repair.kind in {"package-name", *OF_BUILDS} and repair.file in OF_PACKAGES
    return of_package and new <= _words(hint) and new != set()


def _is_further_down(repair: Repair, verdict: Verdict) -> bool:
    """Return whether the wrong word of a call over several lines stands below the only line that the verdict cites."""
    lines = [line for file, line in cited_lines(verdict.citations) if file == repair.file]
    one_word = repair.kind in OF_BUILDS and "\n" not in repair.before + repair.after
    return one_word and "; " not in verdict.hint and len(lines) == 1 and lines[0] < (repair.line or 0)


def _what_was_done(repairs: Iterable[Repair]) -> str:
    """Return `a.py renamed and b.py line 6 repaired`."""
    done: dict[str, dict[str, None]] = {}
    for one in repairs:
        done.setdefault("renamed" if one.kind == "file-name" else "repaired", {})[place_of(one)] = None
    return " and ".join(f"{join_words(places)} {how}" for how, places in done.items())


def _share(copy: Verdict, repairs: tuple[Repair, ...], share: float) -> Verdict:
    score = copy.score * share
    status = Status.PARTIAL if share < 1 and copy.status is Status.PASS else copy.status
    points = f"{share_text(share)} of the points; " if copy.score and not copy.right else ""
    message = f"judged on a copy with {_what_was_done(repairs)}: {points}{copy.message}"
    return copy.model_copy(update={"status": status, "score": score, "message": message})
