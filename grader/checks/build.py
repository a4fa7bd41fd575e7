"""Whether the package builds, and its own programs run."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.registry import NoParams, check
from grader.checks.support.build_errors import MAY_FAIL, UNKNOWN_COMMAND, explain_error_of_build
from grader.checks.support.cpp_errors import FIRST_ERROR_HINT, BuildError, first_error, further_errors
from grader.checks.support.exit_causes import RUN_IT, explain_end
from grader.checks.support.launch import IGNORE
from grader.checks.support.processes import NO_SCRIPT_HINT, Life, lives
from grader.checks.support.scripts import (
    BUILD_FIRST_HINT,
    CPP_SUFFIXES,
    add_hint,
    cmake_calls,
    copies_of,
    find_script,
    handed_in_with_git,
    is_elsewhere,
    paths_by_name,
    programs,
    scripts_of_role,
)
from grader.checks.support.text import near_names, shown
from grader.checks.support.topics import cite
from grader.evidence.events import CATKIN_MAKE, STOPPED
from grader.evidence.run import Run
from grader.installable import noetic_messages
from grader.model.generated_headers import fixes_of, reasons_of, unwaited_targets
from grader.model.package import CMAKE, Executable, PackageFacts, meant_manifest
from grader.model.record import Record
from grader.model.verdict import (
    FileCitation,
    Status,
    Verdict,
    failed,
    failed_or_blocked,
    grade_again,
    inconclusive,
    machine_lacks,
    passed,
)
from grader.untrusted_text import without_colours
from grader.wording import join_words, seconds, there_is

NO_PROGRAM = {"IMPORTED", "ALIAS", "EXCLUDE_FROM_ALL"}
CANNOT_START = {126, 127}
LOADER = (
    "error while loading shared libraries",
    "symbol lookup error",
    "cannot execute",
    "Exec format error",
)
TELLING = ("[FATAL]", "what():")
SAME_NAME = "new node registered with same name"
INVALID_MEMORY_HINT = "run it with rosrun, and look for an invalid pointer or an out-of-range index"
LINK_LIBRARIES_HINT = (
    "list every library in target_link_libraries(<program> ${catkin_LIBRARIES}), and every package in "
    "find_package(catkin REQUIRED COMPONENTS …)"
)
EXPECTED = "catkin_make exits with 0"
NOT_BUILT = "not built"
INSTALL_ROS = (
    "install ROS 1 with `make setup`, or `apt-get install python3-rospy python3-roslaunch rosbash catkin`, "
    "and grade again"
)


def run_hint(reason: str) -> str:
    """Return what brings evidence that was not recorded, by the recording's own reason."""
    if "only the files" in reason:
        return "grade without --static"
    return INSTALL_ROS if "no ROS" in reason else "grade the submission again"


class BuildParams(Record):
    """What the build has to leave ready to run."""

    scripts: tuple[str, ...] = ()
    """What has to be there after the build: scripts with their paths as the handout gives them, `src/talker.py`, and
    programs of C++ by name, `talker`."""


@check("build", params=BuildParams, run_anyway=True)
def build(package: PackageFacts, build: Run, params: BuildParams) -> Verdict:
    """The package builds.

    What it checks
        That `catkin_make` succeeds in a fresh workspace with this package, and the packages of the same
        repository that it depends on. If the lab asks for scripts, that each can be run afterwards.

    Why it matters on a robot
        On the robot the workspace is built from what was pushed. A package that needs other files from your
        own machine does not build there.

    How it is measured
        By the exit code of `catkin_make`; the first error that it printed is quoted. A package with a file
        `CATKIN_IGNORE` is not built at all. Nodes are run anyway, from their sources. A script can be run
        if `catkin_install_python` puts it into `devel/lib`, or if `rosrun` finds it in the package; another
        criterion judges whether it is executable. Whether a C++ program waits for the headers of your own
        messages is read in `CMakeLists.txt`: where none makes it wait, a build with several processes fails
        on one day and not on the next.

    How to fix
        Clone your repository into a new workspace, run `catkin_make`, and fix the first error: the later
        ones often follow from it.
    """
    scripts = f", and {join_words(params.scripts)} there to run" if params.scripts else ""
    verdict = _with_unwaited(package, judge_build(package, build))
    if verdict.status is Status.PASS:
        verdict = _unseen(package) or _lost_scripts(package, params.scripts) or verdict
    return verdict.about(expected=f"{verdict.expected or EXPECTED}{scripts}")


def _unseen(package: PackageFacts) -> Verdict | None:
    """Return the loss of a package that catkin does not find, or is told to pass over: it builds nothing of it."""
    if package.has_no_manifest:
        why = "catkin_make builds nothing of the package: catkin does not see one without package.xml"
        meant = next(filter(None, (meant_manifest(file.path) for file in package.files)), "")
        return failed_or_blocked(
            why, measured=NOT_BUILT, hint=meant or "write package.xml, then run catkin_make"
        )
    if package.file(IGNORE) is None:
        return None
    message = f"catkin_make builds nothing of the package: {IGNORE} hides it from catkin"
    place = (FileCitation(file=IGNORE),)
    return failed(message, measured=NOT_BUILT, hint=f"git rm {IGNORE}", citations=place)


def _with_unwaited(package: PackageFacts, verdict: Verdict) -> Verdict:
    """Return the verdict with the programs that may be compiled too early: by the files, since luck decides whether a
    build shows them."""
    views = ((one, unwaited_targets(one, noetic_messages())) for one in package.views())
    other, found = next((pair for pair in views if pair[1]), (package, []))
    is_judged = verdict.status in (Status.PASS, Status.FAIL, Status.BLOCKED) or verdict.measured == NOT_BUILT
    if not found or not is_judged or MAY_FAIL in verdict.message:
        return verdict
    why, hint = f"{MAY_FAIL}: {'; '.join(reasons_of(found))}", "; ".join(fixes_of(found))
    lines = tuple(dict.fromkeys(one.line.place for one in found))
    if not verdict.status.is_lost or verdict.status.is_open:
        lost = failed(why, expected=EXPECTED, measured=verdict.measured, hint=hint, citations=lines)
        return lost.moved(package.way_to(other)) if other.path != package.path else lost
    if other.path != package.path:
        why, lines = f"{other.name}: {why}", ()
    update = {
        "message": f"{verdict.message}; besides, {why}",
        "hint": "; ".join(filter(None, (verdict.hint, hint))),
        "citations": tuple(dict.fromkeys((*verdict.citations, *lines))),
    }
    return verdict.model_copy(update=update)


def judge_build(package: PackageFacts, build: Run) -> Verdict:
    """Return whether `catkin_make` succeeded, and if not, why."""
    found = {e.event: (t, e) for t, e in build.processes if e.name == CATKIN_MAKE}
    if "start" not in found and "exit" not in found:
        reason = build.metadata.get("not_run") or (build.outcome.detail if build.outcome else "")
        message = f"the package was not built{': ' + reason if reason else ''}"
        return inconclusive(message, expected=EXPECTED, measured=NOT_BUILT, hint=run_hint(reason))
    if "exit" not in found or (build.outcome is not None and build.outcome.outcome == "host"):
        detail = build.outcome.detail if build.outcome else "the recording was cut short"
        message = f"the build failed on the grading machine: {detail}"
        return inconclusive(message, expected=EXPECTED, hint="`grader doctor`, then grade again")
    end_ns, end = found["exit"]
    took = seconds(end_ns - found.get("start", found["exit"])[0])
    if end.exit_code == 0:
        return passed("catkin_make succeeded", expected=EXPECTED, measured=f"exit code 0 after {took}")
    if end.stopped_by is not None:
        return _stopped_build(build, took)
    return _broken_build(package, build, end.exit_code)


def explain_by_build(
    package: PackageFacts | None,
    build: Run | None,
    verdict: Verdict,
    asked: Sequence[str] = (),
    beside: Sequence[str] = (),
) -> Verdict:
    """Return a loss of what the build alone makes as `inconclusive` where the machine is why it was not built, and one
    of what is not there, of all that was `asked` for, with its name. So is a loss `beside` which a program did not
    run."""
    if verdict.hint == NO_SCRIPT_HINT and package is not None:
        verdict = _name_missing(package, build, verdict, asked)
    elif (
        beside
        and package is not None
        and verdict.status.is_lost
        and not (verdict.basis.unjudged or verdict.basis.cause)
    ):
        one = _name_missing(package, build, failed_or_blocked("there is no script to run"), beside)
        if one.basis.unbuilt:
            which = "" if set(beside) & set(asked) else ", which runs beside it"
            message = f"{verdict.message}; {one.message}{which}"
            verdict = one.model_copy(update={"message": message}).about(expected=verdict.expected)
    if not (verdict.basis.unbuilt and verdict.status.is_lost) or package is None or build is None:
        return verdict
    built = judge_build(package, build)
    if not built.status.is_open:
        return verdict
    said = built.model_copy(update={"message": f"{verdict.message}; {built.message}"})
    said = said.about(expected=verdict.expected, measured=verdict.measured)
    return said.based_on(cause=verdict.basis.cause)


def _name_missing(
    package: PackageFacts, build: Run | None, verdict: Verdict, asked: Sequence[str]
) -> Verdict:
    """Return the verdict on what was not started with the file that is missing, or the program that was not made."""
    made = next((name for name in asked if any(one.is_called(name) for one in programs(package))), "")
    lost = next((name for name in asked if find_script(package, name) is None), "")
    if made and build is not None and judge_build(package, build).status is not Status.PASS:
        why, hint = f"the build did not make the program {made}", BUILD_FIRST_HINT
    elif lost and PurePosixPath(lost).suffix and not made:
        why = f"there is no {lost} to run"
        hint = f"{add_hint(package, lost)}{or_rename(scripts_of_role(package, lost))}"
    elif lost and not made and package.cmake is not None:
        sources = [one for end in CPP_SUFFIXES for one in copies_of(package, f"{lost}{end}")]
        source = sources[0].path if sources else f"src/{lost}.cpp"
        why = f"{CMAKE} makes no program {lost}"
        link = f"target_link_libraries({lost} ${{catkin_LIBRARIES}})"
        hint = f"write add_executable({lost} {source}), and below it {link}"
        hint = hint if sources else f"{add_hint(package, source)}; then {hint}"
        loops = (
            c for c in cmake_calls(package, "foreach") if len(c.args) == 1 or c.args[1:] == ("IN", "LISTS")
        )
        if (loop := next(loops, None)) is not None and sources:
            why = f"{why}: the foreach(…) on line {loop.line} goes through nothing, as its variable has no value"
            listed = next((c for c in cmake_calls(package, "set") if lost in c.args[1:]), None)
            right = f"${{{listed.args[0]}}}" if listed else "…"
            hint = f"on line {loop.line}, write `foreach({loop.args[0]} {right})`"
    else:
        return verdict
    # A function, as a backslash in the text would begin an escape.
    message = re.sub("there (is no script|was nothing) to run", lambda _: why, verdict.message)
    told = verdict.model_copy(update={"message": message, "hint": hint})
    return told.based_on(unbuilt=hint == BUILD_FIRST_HINT)


def or_rename(alike: Sequence[str]) -> str:
    """Return what to put behind the hint that a script has to be written, where these may be meant to be it."""
    return f", or rename the one that is meant to be it: {join_words(alike, 'or')}" if alike else ""


def _stopped_build(build: Run, took: str) -> Verdict:
    """By a limit that it broke, which is named, or because its time was up."""
    limits = (e.detail for _, e in build.actors if e.action == "limit" and e.actor == CATKIN_MAKE)
    limit = next((detail for detail in limits if detail.startswith(STOPPED)), "")
    return failed(
        f"catkin_make was {limit}" if limit else f"catkin_make had not finished after {took} and was stopped",
        expected=EXPECTED,
        measured=limit or f"stopped after {took}",
        hint="look at what CMakeLists.txt runs: a command that waits, never ends, or needs far too much",
    )


def _broken_build(package: PackageFacts, build: Run, exit_code: int | None) -> Verdict:
    lines = [c.line for _, c in build.console if c.process == CATKIN_MAKE]
    error = first_error(lines, package)
    if error is None or error.place is None:
        # all of the lab's packages are built together, and the first error may be another one's
        found = ((one, first_error(lines, one)) for one in package.views()[1:])
        other = next((one for one, its in found if its is not None and its.place is not None), None)
        if other is not None:
            verdict = _broken_build(other, build, exit_code).moved(package.way_to(other))
            return verdict.model_copy(update={"message": f"{other.name}: {verdict.message}"})
    told = explain_error_of_build(error, package, lines) if error else None
    place = (told.place if told else None) or (error.place if error else None)
    told_where = told is not None and told.place is not None
    line = (
        f"{place.file}:{place.line}: " if error and place and error.kind == "cmake" and not told_where else ""
    )
    explained = package.manifest is None or (error is not None and error.kind == "cmake")
    kind = machine_lacks if told and told.of_machine else failed_or_blocked if explained else failed
    verdict = kind(
        f"catkin_make failed: {line}{told.why}" if told else "catkin_make failed without naming an error",
        expected=EXPECTED,
        measured=f"exit code {exit_code}",
        hint=_with_further(told.hint, lines, package, error) if told and error else FIRST_ERROR_HINT,
        citations=(place or cite(build, "/grader/console"),),
    )
    if told:
        verdict = verdict.seeking("component", *filter(None, [told.lacks]))
        verdict = verdict.seeking("uncalled", *filter(None, [told.uncalled]))
    # what the package lacks of catkin's own lines shows as a command that CMake does not know
    if not line or told is None or error is None:
        return verdict
    if UNKNOWN_COMMAND in error.text and not told.by_itself:
        return verdict
    return verdict.based_on(cause=f"{line}{told.why}")


def _with_further(hint: str, lines: Sequence[str], package: PackageFacts, first: BuildError) -> str:
    """Return the hint with what to write on other lines of the same source, behind a wrong name, where it is sure: what
    follows from a bracket that is missing, for one, says nothing. Of other sources, what is wrong first."""
    told, others = list[str](), dict[str, str]()
    for one in further_errors(lines, package, first):
        place, explained = one.place, explain_error_of_build(one, package, lines)
        if place is None or first.place is None:
            continue
        if place.file != first.place.file:
            others.setdefault(place.file, f"; then {place.file}, line {place.line}: {explained.why}")
        elif _OF_NAMES.search(first.text) and _SURE.match(explained.hint):
            told.append(f"; on line {place.line}, {explained.hint}")
    more, place = "".join([*told, *others.values()][:FURTHER_MAX]), first.place
    return f"on line {place.line} of {place.file}, {hint}{more}" if more and place else hint


_OF_NAMES = re.compile(r"not (?:been )?declared|not name a |has no member|not a member")
_SURE = re.compile(r"^write (?:\w+::\w+$|\S+ in place of |the \w+'s variable )")
FURTHER_MAX = 4


def _lost_scripts(package: PackageFacts, scripts: Sequence[str]) -> Verdict | None:
    """Scripts that are nowhere in the package: their own criteria say so first."""
    there = paths_by_name(package)
    made = {one.name for one in programs(package)}
    lost = [s for s in scripts if PurePosixPath(s).name not in there and s not in made]
    if not lost:
        return None
    near = [there[n] for s in lost for n in near_names(PurePosixPath(s).name, there)]
    seen = f"; {there_is(dict.fromkeys(near))}" if near else ""
    push = ", then git add, commit and push" if handed_in_with_git(package) else ""
    message = f"catkin_make succeeded, but there is no {join_words(lost, 'or')} to run{seen}"
    measured = f"rosrun finds no {join_words((PurePosixPath(s).name for s in lost), 'or')}"
    hint = f"add {join_words(lost)} to the package{push}"
    return failed_or_blocked(message, expected=EXPECTED, measured=measured, hint=hint)


class Broken(NamedTuple):
    """A program that does not run: what it came to, and what to do."""

    program: str
    why: str
    hint: str
    life: Life


@check("build-and-run", params=NoParams)
def build_and_run(package: PackageFacts, build: Run, run: Run) -> Verdict:
    """The package builds, and its C++ programs run.

    What it checks
        That `catkin_make` succeeds, and that each program that `add_executable` makes from your sources can
        be started. A package without such programs only has to build.

    Why it matters on a robot
        A program can be compiled and still not start: a library is missing, or it crashes at once. On the
        robot that shows when it is too late.

    How it is measured
        By the exit code of `catkin_make`. Then every program is started with a roscore: one that is ended
        by a signal (a segmentation fault), or that cannot be loaded, fails. A program may end by itself,
        with any exit code, and two programs may use the same node name.

    How to fix
        Fix the first error of `catkin_make`. For a program that does not start: `rosrun <package>
        <program>` shows what is missing; `target_link_libraries(<program> ${catkin_LIBRARIES})` links ROS.
    """
    verdict = _with_unwaited(package, judge_build(package, build))
    expected = f"{verdict.expected}; each program of add_executable starts"
    verdict = (_unseen(package) if verdict.status is Status.PASS else None) or verdict
    if verdict.status is not Status.PASS:
        return verdict.about(expected=expected)
    started = [one for one in lives(run) if "/" in one.name]
    made = {one.name: one for one in _built_programs(package)}
    if made and not started:
        return _not_started(package, made).about(expected=expected)
    broken = list(_broken_programs(package, run, started))
    measured = f"{verdict.measured}; programs: {join_words(_name(p) for p in started) or 'none'}"
    if not broken:
        return passed(f"{verdict.message}{_how_they_went(started)}", expected=expected, measured=measured)
    first = broken[0]
    calls = (made[b.program].call for b in broken if b.program in made)
    cited = tuple(call.place for call in calls)
    start = cite(run, "/grader/process", first.life.start_ns, first.life.end_ns)
    message = f"{verdict.message}, but {'; '.join(f'{b.program} does not run: {b.why}' for b in broken)}"
    return failed(message, expected=expected, measured=measured, hint=first.hint, citations=(*cited, start))


def _built_programs(package: PackageFacts) -> Iterator[Executable]:
    for one in programs(package):
        if len(one.call.args) > 1 and not NO_PROGRAM & set(one.call.args[1:3]):
            yield one


def _not_started(package: PackageFacts, made: dict[str, Executable]) -> Verdict:
    """No program came out where `rosrun` looks: `catkin_package()` sets that place, a target's property another one."""
    away = next((one for one in made.values() if is_elsewhere(one, package)), None)
    if away is not None:
        call = away.named or away.call
        return failed(
            f"catkin_make succeeded, but rosrun finds no {away.name}: {call.file}, line {call.line}, puts it into "
            f"{shown(away.folder)}",
            measured="built, not where rosrun looks",
            hint="remove RUNTIME_OUTPUT_DIRECTORY: catkin puts programs into lib/<package>",
            citations=(call.place,),
        )
    set_at = next(iter(cmake_calls(package, "catkin_package")), None)
    calls = {name: one.call for name, one in made.items()}
    early = {
        name: c for name, c in calls.items() if set_at and c.file == set_at.file and c.line < set_at.line
    }
    if not early:
        message = f"catkin_make succeeded, but no program was started ({join_words(made)})"
        return grade_again(message, measured="built, not started")
    message = (
        f"catkin_make succeeded, but rosrun finds no {join_words(early, 'or')}: "
        "add_executable(…) comes before catkin_package(…)"
    )
    cited = tuple(c.place for c in early.values())
    hint = "move add_executable(…) below catkin_package(…), which says where programs go"
    return failed(message, measured="built, not where rosrun looks", hint=hint, citations=cited)


def _broken_programs(package: PackageFacts, run: Run, programs: list[Life]) -> Iterator[Broken]:
    for one in programs:
        if not one.ended_early or one.end is None or _gave_way(run, one):
            continue
        code, words = one.end.exit_code, _last_words(run, one)
        quoted = f"; its last output: {words}" if words else ""
        unloaded = next((mark for mark in LOADER if mark in words), None)
        if one.end.signal is not None or one.end.stopped_by is not None:
            end = explain_end(one, run, package)
            told = "fix the error in its last output" if any(mark in words for mark in TELLING) else ""
            hint = end.hint if end.hint != RUN_IT else told or INVALID_MEMORY_HINT
            yield Broken(_name(one), f"{end.cause}{quoted}", hint, one)
        elif unloaded or code in CANNOT_START:
            yield Broken(_name(one), f"it cannot start (exit code {code}){quoted}", LINK_LIBRARIES_HINT, one)


def _gave_way(run: Run, one: Life) -> bool:
    """Another program took its node's name: then ROS shuts this one down."""
    return any(SAME_NAME in line.line for _, line in run.lines(one.name))


def _last_words(run: Run, one: Life) -> str:
    """Return the loader's complaint, or ROS's, or that of an exception where there is one, or else the last line."""
    lines = [line.line for _, line in run.lines(one.name) if line.line.strip()]
    complaints = [line for line in lines if any(mark in line for mark in (*LOADER, *TELLING))]
    return shown(without_colours((complaints or lines[-1:] or [""])[0]))


def _how_they_went(programs: list[Life]) -> str:
    if not programs:
        return "; the package makes no programs"
    codes = {_name(p): p.end.exit_code for p in programs if p.ended_early and p.end is not None}
    why = "perhaps because it needs arguments"
    ended = [f"{name} ends with exit code {code}, {why}" for name, code in codes.items() if code]
    return "; ".join([f", and {join_words(_name(p) for p in programs)} can be started", *ended])


def _name(one: Life) -> str:
    return one.name.rpartition("/")[2]
