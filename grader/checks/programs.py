"""Whether a package with programs of its own builds, and the programs run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from grader.checks.build import judge_build
from grader.checks.registry import NoParams, check
from grader.checks.support.exit_cause import explain_end
from grader.checks.support.process import Life, lives
from grader.checks.support.text import bare, shown
from grader.evidence.run import Run
from grader.model.package import CMakeCall, PackageFacts
from grader.model.verdict import EvidenceCitation, FileCitation, Status, Verdict, failed, inconclusive, passed
from grader.wording import join_words

NO_PROGRAM = {"IMPORTED", "ALIAS", "EXCLUDE_FROM_ALL"}
CANNOT_START = {126, 127}
LOADER = (
    "error while loading shared libraries",
    "symbol lookup error",
    "cannot execute",
    "Exec format error",
)
TELLING = ("[FATAL]", "what():")
ASTRAY = "run it with rosrun, and look for a pointer or an index that goes astray"
SAME_NAME = "new node registered with same name"
LINK = (
    "name every library in target_link_libraries(<program> ${catkin_LIBRARIES}), and every package in "
    "find_package(catkin REQUIRED COMPONENTS …)"
)


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
        That `catkin_make` succeeds, and that each program which `add_executable` makes of your sources can
        be started. A package without such programs only has to build.

    Why it matters on a robot
        A program can be compiled and still not start: a library is missing, or it crashes at once. On the
        robot that shows when it is too late.

    How it is measured
        By the exit code of `catkin_make`. Then every program is started beside a roscore: one that a signal
        ends (a segmentation fault), or that cannot be loaded, fails. That it comes to its end by itself is
        fine, whatever its exit code, and so are two programs that use the same node name.

    How to fix
        Mend the first error of `catkin_make`. For a program that does not start: `rosrun <package>
        <program>` shows what is missing; `target_link_libraries(<program> ${catkin_LIBRARIES})` links ROS.
    """
    verdict = judge_build(package, build)
    expected = f"{verdict.expected}; each program of add_executable starts"
    if verdict.status is not Status.PASS:
        return verdict.model_copy(update={"expected": expected})
    programs = [one for one in lives(run) if "/" in one.name]
    made = {call.args[0]: call for call in _made(package)}
    if made and not programs:
        return _not_started(package, made).model_copy(update={"expected": expected})
    broken = list(_broken(package, run, programs))
    measured = f"{verdict.measured}; programs: {join_words(_name(p) for p in programs) or 'none'}"
    if not broken:
        message = f"{verdict.message}{_how_they_went(programs)}"
        return passed(message, expected=expected, measured=measured)
    first = broken[0]
    calls = (made[b.program] for b in broken if b.program in made)
    cited = tuple(FileCitation(file=call.file, line=call.line) for call in calls)
    start = EvidenceCitation(
        evidence=run.evidence, topic="/grader/process", from_ns=first.life.start_ns, to_ns=first.life.end_ns
    )
    return failed(
        f"{verdict.message}, but {'; '.join(f'{b.program} does not run: {b.why}' for b in broken)}",
        expected=expected,
        measured=measured,
        hint=first.hint,
        citations=(*cited, start),
    )


def _made(package: PackageFacts) -> Iterator[CMakeCall]:
    """The calls that make programs of sources."""
    for call in package.cmake.calls if package.cmake else ():
        if call.name == "add_executable" and len(call.args) > 1 and not NO_PROGRAM & set(call.args[1:3]):
            yield call


def _not_started(package: PackageFacts, made: dict[str, CMakeCall]) -> Verdict:
    """No program came out where `rosrun` looks: catkin sets that place in `catkin_package()`."""
    calls = package.cmake.calls if package.cmake else ()
    set_at = next((c for c in calls if c.name == "catkin_package"), None)
    early = [c for c in made.values() if set_at and c.file == set_at.file and c.line < set_at.line]
    if not early:
        message = f"catkin_make succeeded, but no program was started ({join_words(made)})"
        return inconclusive(message, measured="built, not started", hint="grade again")
    message = (
        f"catkin_make succeeded, but rosrun finds no {join_words((c.args[0] for c in early), 'or')}: "
        "add_executable(…) stands above catkin_package(…)"
    )
    cited = tuple(FileCitation(file=c.file, line=c.line) for c in early)
    hint = "move add_executable(…) below catkin_package(…), which says where programs go"
    return failed(message, measured="built, not where rosrun looks", hint=hint, citations=cited)


def _broken(package: PackageFacts, run: Run, programs: list[Life]) -> Iterator[Broken]:
    for one in programs:
        if not one.ended_early or one.end is None or _gave_way(run, one):
            continue
        code, words = one.end.exit_code, _last_words(run, one)
        quoted = f"; its last words: {words}" if words else ""
        unloaded = next((mark for mark in LOADER if mark in words), None)
        if one.end.signal is not None or one.end.stopped_by is not None:
            end = explain_end(one, run, package)
            told = any(mark in words for mark in TELLING)
            hint = "mend what its last words say" if told else ASTRAY
            yield Broken(_name(one), f"{end.cause}{quoted}", hint, one)
        elif unloaded or code in CANNOT_START:
            yield Broken(_name(one), f"it cannot be started (exit code {code}){quoted}", LINK, one)


def _gave_way(run: Run, one: Life) -> bool:
    """Another program took its node's name: then ROS shuts this one down."""
    return any(SAME_NAME in line.line for _, line in run.lines(one.name))


def _last_words(run: Run, one: Life) -> str:
    """The loader's complaint, or ROS's, or that of an exception where there is one, or else the last line."""
    lines = [line.line for _, line in run.lines(one.name) if line.line.strip()]
    complaints = [line for line in lines if any(mark in line for mark in (*LOADER, *TELLING))]
    return shown(bare((complaints or lines[-1:] or [""])[0]))


def _how_they_went(programs: list[Life]) -> str:
    if not programs:
        return "; the package makes no programs"
    codes = {_name(p): p.end.exit_code for p in programs if p.ended_early and p.end is not None}
    ended = [
        f"{name} ends with exit code {code}, perhaps for want of arguments"
        for name, code in codes.items()
        if code
    ]
    return "; ".join([f", and {join_words(_name(p) for p in programs)} can be started", *ended])


def _name(one: Life) -> str:
    return one.name.rpartition("/")[2]
