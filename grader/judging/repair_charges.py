"""Which criterion each repair of a copy is charged to, and what that criterion says then.

One mistake costs one criterion. The others that it kept from passing are judged on the repaired copy, and earn the
share that the rubric gives for that kind of repair.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from graphlib import TopologicalSorter
from pathlib import PurePosixPath

from grader.checks.interfaces import NEW_NAMES
from grader.checks.support.text import IN_PLACE_OF_ALL, texts_in
from grader.model.message_definitions import PARTS
from grader.model.package import CMAKE, MANIFEST
from grader.model.repair import Repair, advice_on, messages_of, place_of
from grader.model.result import CriterionResult
from grader.model.verdict import Citation, FileCitation, Status, Verdict, cited_lines, failed, share_text
from grader.rubric.model import Criterion, Rubric
from grader.wording import ASKED_TYPE, join_words

BUILD, INSTALL = "build", "cmake-install"
OF_EXCEPTIONS = "callbacks-clean"
"""The check that asks for what others are lost by where a callback fails."""
OF_PACKAGES = {MANIFEST, CMAKE}

OF_RATES = "loop-rate"
"""The rate's own criteria keep their loss, and no other is charged."""
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
OF_LINES = {"python-syntax", "launch-syntax", "yaml-syntax", "missing-call", "missing-import"}
"""Of a line that could not be read or did nothing, the copy shows for the first time what it does."""
MADE_BY_BUILDS = {".msg", ".srv", ".action", ".c", ".cc", ".cpp", ".cxx"}
_PLACE = re.compile(r"^line \d+ of [^:]+: ")
TAG = re.compile(r"<(\w+)>[^<>]*</\1>")
NUMBER = re.compile(r"\d+(\.\d+)?")
PARAMETER = re.compile(r"~?[\w/]*\w")


def is_unmade(found: Verdict | CriterionResult) -> bool:
    """Return whether a script is lost because the build failed that was to make a program of it."""
    return found.mistake is not None and found.mistake.kind == "not-made"


def charge_repairs(
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
    criteria.sort(key=lambda c: c.check != OF_EXCEPTIONS)
    criteria_of_runs = [c for c in rubric.criteria if c.scenario is not None and c.points > 0]
    needed = dict.fromkeys(one for repairs in needs.values() for one in repairs if one.kind != OF_RATES)
    # Names first: `misnamed` keeps other repairs from their criteria.
    for repair in sorted(needed, key=lambda one: one.kind not in NAMES):
        if repair.kind == "ros-clock" and not any(
            _is_simulated(c, rubric) for c in criteria if repair in needs[c.id]
        ):
            continue  # the clock is only fast to save time
        if asking := _asking(rubric, first, better, repair):
            is_other = {c.id: repair.file not in texts_in(c.parameters) for c in asking}
            nearest = min(asking, key=lambda c: (_lines_away(first[c.id], repair), is_other[c.id]))
            charges[repair] = {nearest.id}
            continue
        own = [c.id for c in rubric.criteria if repair.kind == "node-name" and _names(c, repair)]
        own = [name for name in own if first[name].status.is_lost]
        if own and better.isdisjoint(own):
            continue  # the criterion of the name says by itself what is wrong with it
        failed_by_it = [c for c in criteria_of_runs if c.id not in better and fails_in(first[c.id], repair)]
        if repair.kind in OF_LINES and failed_by_it:
            continue  # that the copy shows nothing of that criterion is no reason to charge another
        possible = _possible([c for c in criteria if repair in needs[c.id]], first, repair)
        named = any(repair.kind in NAMES and _names(c, repair) for c in possible)
        counting = [c.id for c in _nearest_first(possible, first, repair) if c.points > 0]
        # names of two kinds are two mistakes
        taken = {name for one in charges if repair.kind in NAMES - {one.kind} for name in charges[one]}
        other = [name for name in counting if name not in misnamed | taken]
        charges[repair] = set((counting if named else other or counting)[:1])
        misnamed |= charges[repair] if named else set()
    # A field's new name in the code is no mistake beside that in its definition, whose fix names the file.
    for defined in [one for one in charges if PurePosixPath(one.file).suffix in PARTS]:
        files = re.split(r"[,\s]+", defined.fix)
        in_code = [one for one in charges if one.kind == "missing-call" and one.file in files]
        charges |= dict.fromkeys(in_code, charges[defined])
    return charges


def _asking(
    rubric: Rubric, first: Mapping[str, Verdict], better: AbstractSet[str], repair: Repair
) -> list[Criterion]:
    """Return the criteria of the files that ask for what was wrong; at best those that ask for it by its name."""
    asking = [c for c in rubric.criteria if c.scenario is None and asks_for(first[c.id], repair)]
    if repair.kind in OF_BUILDS:  # of a file with several faults, those that speak of this line
        new = _new_words(repair)
        better_by_it = better - {c.id for c in rubric.criteria if c.check == INSTALL}
        at_line = (repair.file, repair.line)  # all that there is to go by where only a comma goes
        told = {
            c.id
            for c in asking
            if is_told(repair, first[c.id].hint)
            or (not new and at_line in cited_lines(first[c.id].citations))
        }
        asking = [c for c in asking if c.id in better_by_it | told or new & words_of(first[c.id].message)]
    sought = [c for c in asking if _seeks(first[c.id], repair)]
    return sought or [c for c in asking if _names(c, repair)] or asking


def _possible(criteria: Iterable[Criterion], first: Mapping[str, Verdict], repair: Repair) -> list[Criterion]:
    """Return the criteria that what was repaired can lose."""
    possible = [c for c in criteria if _may_ask_for(first[c.id], repair)]
    without_values = [c for c in possible if not first[c.id].basis.wrong]
    # where a value came, its topic is not to blame
    return (repair.kind in {"topic-name", "service-name"} and without_values) or possible


def _nearest_first(
    possible: Sequence[Criterion], first: Mapping[str, Verdict], repair: Repair
) -> Iterator[Criterion]:
    yield from (c for c in possible if repair.kind in OF_BUILDS and c.check == BUILD)
    yield from (c for c in possible if repair.kind in NAMES and _names(c, repair))
    failing = [c for c in possible if first[c.id].status is not Status.BLOCKED]
    # where nothing was printed, the line that is cited would print it, and is not to blame
    yield from (c for c in failing if cites_file(first[c.id], repair) and not first[c.id].basis.silent)
    yield from (*failing, *possible)


def _is_simulated(criterion: Criterion, rubric: Rubric) -> bool:
    """Return whether a program, the simulator, runs beside the scripts: its clock is the one to go by."""
    return criterion.scenario is not None and any(
        s.program for s in rubric.scenarios[criterion.scenario].start
    )


def _may_ask_for(found: Verdict, repair: Repair) -> bool:
    """Return whether what was repaired can lose a criterion; what keeps a script from starting, where it is named, and
    what an `except` names, where an exception came so far."""
    if is_of_handler(repair):
        return fails_in(found, repair)
    return repair.kind not in DONE_BEFORE_RUNS or PurePosixPath(repair.file).name in found.message


def is_of_handler(repair: Repair) -> bool:
    """Return whether the line names what it catches: no run reaches the name without an exception."""
    return repair.before.lstrip().startswith("except ") and repair.kind in SEEN_IN_RUNS


def without_idle(repairs: Iterable[Repair], charges: Mapping[Repair, AbstractSet[str]]) -> tuple[Repair, ...]:
    """Return the repairs without those of what an `except` names that no criterion was lost by."""
    return tuple(one for one in repairs if charges.get(one) or not is_of_handler(one))


def fails_in(found: Verdict, repair: Repair) -> bool:
    """Return whether a criterion is lost by itself, and cites a line of what was repaired."""
    lines = set(range(repair.line or 0, (repair.line or 0) + len(repair.before.split("\n"))))
    cited = {line for file, line in cited_lines(found.citations) if file == repair.file}
    return found.status is Status.FAIL and not lines.isdisjoint(cited)


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


def cites_file(found: Verdict | CriterionResult, repair: Repair) -> bool:
    if repair.kind == "executable-bit" and not is_told(repair, found.hint):
        return False  # the build installs what runs the script, bit or not
    return any(getattr(citation, "file", None) == repair.file for citation in found.citations)


def asks_for(found: Verdict | CriterionResult, repair: Repair) -> bool:
    """Return whether a criterion of the files is lost by what was repaired. What is otherwise seen in runs, such as a
    node's name, one of a launch file can refuse at its very line."""
    lost = found.status.is_lost and found.status is not Status.BLOCKED
    if repair.kind in SEEN_IN_RUNS:
        return lost and (repair.file, repair.line) in cited_lines(found.citations)
    absent = found.mistake.name if found.mistake and found.mistake.is_absence else ""
    if is_unmade(found) or repair.kind == "exchanged-files":
        return False  # the build's own criterion asks for it, and none for what is in which file
    is_it = repair.kind == "file-name" and PurePosixPath(absent).name == PurePosixPath(repair.after).name
    is_said = repair.kind in OF_BUILDS and is_told(repair, found.hint)
    return lost and (is_it or is_said or cites_file(found, repair))


def _names(criterion: Criterion, repair: Repair) -> bool:
    """Return whether the criterion asks for the name that the repair puts in place; of a parameter's name, for one that
    has it as a part."""
    before, after = (set(re.findall(r"[\w.~/-]*\w", text)) for text in (repair.before, repair.after))
    new = {word.rpartition("/")[2].lstrip("~") for word in after - before}
    texts = texts_in(criterion.parameters)
    if repair.kind == "parameter-name":
        return any(text.startswith("/") and new.intersection(text.split("/")) for text in texts)
    return any(text.strip("/").rpartition("/")[2] in new for text in texts)


def words_of(text: str) -> set[str]:
    return set(re.findall(r"[\w.-]+", text))


def _new_words(repair: Repair) -> set[str]:
    return words_of(repair.after) - words_of(repair.before)


def charged_verdict(
    verdict: Verdict, copy: Verdict, repairs: Sequence[Repair], lines: Collection[tuple[str, int]]
) -> Verdict:
    """Return the loss, with the repairs that were seen to help as its hint, and what the copy loses it by, at these
    lines of the package as it is."""
    blocked = verdict.status is Status.BLOCKED
    is_next = is_next_fault(verdict, copy, repairs) or (
        blocked and copy.status.is_lost and not copy.basis.unjudged
    )
    if blocked:
        message = "; ".join(messages_of(repairs))
        cited = verdict.citations
        verdict = failed(message, expected=copy.expected, measured=verdict.measured, citations=cited)
    further = (
        copy.status is Status.BLOCKED and verdict.basis.unjudged and copy.basis.cause != verdict.basis.cause
    )
    paths = re.findall(r"[\w-]+(?:/[\w.-]+)+", copy.hint)
    told_at_once = paths != [] and all(path in verdict.hint for path in paths)
    if copy.status.is_lost and verdict.hint and (told_at_once or not (is_next or further)):
        return _with_passed(verdict, copy, repairs)  # the repair brings up what its own advice is about
    told, beside = _told(repairs, verdict)
    clauses = verdict.hint.split("; ") if told or beside else []
    if any(one not in [*told, *beside] for one in repairs):
        clauses = [c for c in clauses if any(c in one.fix or is_told(one, c) for one in told)]
    hints = clauses + advice_on(one for one in repairs if one not in told)
    hints += _new_names(verdict, repairs, hints) + _bits_of_moved(verdict, repairs, hints)
    said = verdict.message
    unsaid = [one for one in repairs if one.kind == "node-name" or not _is_said(one, verdict)]
    words = [said, *(one for one in messages_of(unsaid) if (_PLACE.sub("", one) or one) not in said)]
    is_new = not copy.hint or not set(copy.hint.split("; ")) <= set(hints)
    if further:
        words += [f"with that repaired, it is blocked by {copy.blocked_by}"]
        hints += [f"then fix {copy.blocked_by}"]
    elif is_next and is_new:
        untold = [clause for clause in copy.message.split("; ") if clause not in said]
        words += [f"with that repaired, {'; '.join(untold)}"] if untold else []
        hints = _hints_and_next(clauses, [one for one in repairs if one not in told], copy, lines)
    of_file = verdict.mistake is not None and verdict.mistake.kind != "steers-wrong"
    if verdict.mistake and of_file and any(one.kind == "file-name" for one in repairs):
        verdict = verdict.lost_by("file-elsewhere", verdict.mistake.name)
    update = {
        "message": "; ".join(words),
        "hint": "; ".join(hints),
        "citations": _with_repaired(verdict, repairs, told),
    }
    of_cmake = (one for one in repairs if PurePosixPath(one.file).name == CMAKE)
    if any(one not in told for one in of_cmake):  # how the call is written is told
        untold_of = tuple(one for one in verdict.basis.sought if one.kind not in {"call", "uncalled"})
        verdict = verdict.based_on(sought=untold_of)
    return verdict.model_copy(update=update)


def _bits_of_moved(verdict: Verdict, repairs: Iterable[Repair], told: Collection[str]) -> list[str]:
    """Return the check's own hints that a script which is renamed is not executable either."""
    moved = [one.after for one in repairs if one.kind == "file-name"]
    of_bits = [clause for clause in verdict.hint.split("; ") if clause.startswith("chmod +x ")]
    return [c for c in of_bits if c not in told and any(f" {path}," in c for path in moved)]


def _new_names(verdict: Verdict, repairs: Iterable[Repair], told: Collection[str]) -> list[str]:
    """Return the hints on names in the code that the copy does not rename."""
    if any(one.kind == "missing-call" for one in repairs):
        return []
    return [one for one in verdict.hint.split("; ") if one.startswith(NEW_NAMES) and one not in told]


def _is_said(repair: Repair, verdict: Verdict) -> bool:
    """Return whether the verdict speaks of the file, and where it cites one line of CMakeLists.txt, of the repair's own
    call in it."""
    call = re.match(r"line (\d+) of ", repair.message) if repair.kind in OF_BUILDS else None
    lines = {line for file, line in cited_lines(verdict.citations) if file == repair.file}
    is_other = call is not None and len(lines) == 1 and lines.isdisjoint({int(call[1]), repair.line})
    return PurePosixPath(repair.file).name in verdict.message and not is_other


def _with_passed(verdict: Verdict, copy: Verdict, repairs: Sequence[Repair]) -> Verdict:
    """Return the loss of a node that ended; where the copy ended by another cause, with what it got past besides."""
    if not copy.basis.cause or not verdict.basis.cause or copy.basis.cause == verdict.basis.cause:
        return verdict
    cited = cited_lines(verdict.citations)
    others = [one for one in repairs if (one.file, one.line) not in cited and one.kind in SEEN_IN_RUNS]
    return verdict.model_copy(update={"hint": "; ".join((verdict.hint, *advice_on(others)))})


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


def _with_repaired(
    verdict: Verdict, repairs: Sequence[Repair], told: Collection[Repair]
) -> tuple[Citation, ...]:
    """Return the verdict's citations with the repaired lines: before them, unless it names one of these lines itself
    and so tells a cause."""
    added = tuple(_uncited(verdict, repairs, told))
    names_one = not cited_lines(verdict.citations).isdisjoint((one.file, one.line) for one in repairs)
    return (*verdict.citations, *added) if names_one else (*added, *verdict.citations)


def _uncited(verdict: Verdict, repairs: Sequence[Repair], told: Collection[Repair]) -> Iterator[FileCitation]:
    """Yield the lines of the repairs that the verdict does not cite; of one that it tells, only in another file."""
    cited = {(c.file, c.line) for c in verdict.citations if isinstance(c, FileCitation)}
    with_lines = {file for file, line in cited if line is not None}
    for one in repairs:
        is_new = one.line is not None and (one.file, one.line) not in cited
        cited.add((one.file, one.line))
        if is_new and not (one in told and one.file in with_lines):
            line = one.line if one.before else None  # an empty file has no line
            yield FileCitation(file=one.file, line=line)


def _at_its_line(copy: Verdict) -> str:
    """Return the hint of a verdict on the copy; what is to be written with its line, where that is plain."""
    lines = [c for c in copy.citations if isinstance(c, FileCitation) and c.line is not None]
    if len(lines) != 1 or not copy.hint.startswith("write ") or " line " in copy.hint:
        return copy.hint
    return f"on line {lines[0].line} of {lines[0].file}, {copy.hint}"


def is_told(repair: Repair, hint: str) -> bool:
    """Return whether the check's own hint says how this is repaired: how git learns of a bit, what has a name."""
    if repair.kind == "executable-bit":
        return repair.file in hint and "chmod" in hint
    if repair.kind == "message-type":
        return ASKED_TYPE.search(hint) is not None
    if IN_PLACE_OF_ALL in hint and PurePosixPath(repair.file).name == CMAKE:
        return True
    if repair.kind == "parameter-name" and repair.before.strip() == repair.after.strip():
        return f"line {repair.line}" in hint
    new = {
        word for word in _new_words(repair) if not word.endswith("depend")
    }  # one tag is as good as the other
    of_package = repair.kind in {"package-name", *OF_BUILDS} and repair.file in OF_PACKAGES
    # A line of the manifest says nothing of the same name in CMakeLists.txt.
    of_file = TAG.sub(" ", hint) if PurePosixPath(repair.file).name == CMAKE else hint
    call = re.search(r"\b(find_package)\(", repair.message)
    is_of_call = call is None or call[1] in of_file
    return of_package and is_of_call and new <= words_of(of_file) and new != set()


def _told(repairs: Iterable[Repair], verdict: Verdict) -> tuple[list[Repair], list[Repair]]:
    """Return the repairs that the verdict's own hint tells, and those of the same words in CMakeLists.txt, where it is
    only about package.xml."""
    told = [one for one in repairs if is_told(one, verdict.hint) and not _is_further_down(one, verdict)]
    cited = {one.file for one in verdict.citations if isinstance(one, FileCitation)}
    beside = [one for one in told if one.file == CMAKE and cited == {MANIFEST}]
    return [one for one in told if one not in beside], beside


def _is_further_down(repair: Repair, verdict: Verdict) -> bool:
    """Return whether the wrong word of a call over several lines stands below the only line that the verdict cites."""
    lines = [line for file, line in cited_lines(verdict.citations) if file == repair.file]
    one_word = repair.kind in OF_BUILDS and "\n" not in repair.before + repair.after
    return one_word and "; " not in verdict.hint and len(lines) == 1 and lines[0] < (repair.line or 0)


def _what_was_done(repairs: Iterable[Repair]) -> str:
    """Return `a.py renamed and b.py line 6 repaired`."""
    done: dict[str, dict[str, None]] = {}
    for one in repairs:
        if one.kind == "exchanged-files":
            done.setdefault("exchanged", {}).update(dict.fromkeys((one.before, one.after)))
        else:
            done.setdefault("renamed" if one.kind == "file-name" else "repaired", {})[place_of(one)] = None
    return " and ".join(f"{join_words(places)} {how}" for how, places in done.items())


def shared_verdict(copy: Verdict, repairs: tuple[Repair, ...], share: float) -> Verdict:
    score = copy.score * share
    status = Status.PARTIAL if share < 1 and copy.status is Status.PASS else copy.status
    points = f"{share_text(share)} of the points; " if copy.score and not copy.right else ""
    message = f"judged on a copy with {_what_was_done(repairs)}: {points}{copy.message}"
    return copy.model_copy(update={"status": status, "score": score, "message": message})


def is_next_fault(one: Verdict, copy: Verdict, repairs: Sequence[Repair]) -> bool:
    """Return whether a loss is in what was repaired, and the copy loses the criterion by another fault."""
    files = {repair.file for repair in repairs}
    found = {(c.file, c.line) for c in one.citations if isinstance(c, FileCitation) and c.file in files}
    again = cited_lines(copy.citations)
    again -= lines_read_now(repairs)
    unread = any(_names_new(repair, one.hint) and not _names_new(repair, copy.hint) for repair in repairs)
    in_repaired = found != set() or one.basis.unjudged or unread
    in_repaired = in_repaired or any(is_told(repair, one.hint) for repair in repairs)
    # an exception at a known line of what was repaired is seen, whatever it keeps from being judged
    raised = one.basis.unjudged or copy.basis.charged_once
    shown = not copy.basis.unjudged or (raised and found != set())
    return in_repaired and shown and not found & again and _is_other_fault(one, copy)


def _names_new(repair: Repair, hint: str) -> bool:
    """Return whether the hint has the name of a parameter that the repair puts in place."""
    before, after, said = (set(PARAMETER.findall(text)) for text in (repair.before, repair.after, hint))
    return repair.kind == "parameter-name" and not said.isdisjoint(after - before)


def lines_read_now(repairs: Iterable[Repair]) -> set[tuple[str, int]]:
    """Return the lines that could not be read, or did nothing, before these repairs."""
    return {
        (repair.file, repair.line + further)
        for repair in repairs
        if repair.kind in OF_LINES and repair.line is not None
        for further in range(len(repair.before.split("\n")))
    }


def _is_other_fault(one: Verdict, copy: Verdict) -> bool:
    # The same fault may be measured a little otherwise in another run.
    said, then = (NUMBER.sub("", verdict.message) for verdict in (one, copy))
    return copy.status.is_lost and said != then
