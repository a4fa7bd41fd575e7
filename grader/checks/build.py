"""Whether the package builds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.registry import check
from grader.checks.support.text import near_names, shown
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    EvidenceCitation,
    FileCitation,
    Status,
    Verdict,
    failed,
    inconclusive,
    passed,
    unjudged,
)
from grader.wording import join_words, seconds

CATKIN_MAKE = "catkin_make"
EXPECTED = "catkin_make exits with 0"
INSTALL_ROS = (
    "install ROS 1 with `make setup`, or `apt-get install python3-rospy python3-roslaunch rosbash catkin`, "
    "and grade again"
)
_CMAKE_ERROR = re.compile(
    r"^CMake Error(?: at (?P<file>[^:()]+):(?P<line>\d+) \((?P<call>\w+)\))?:?\s*(?P<text>.*)"
)
_COMPILER_ERROR = re.compile(r"^(?P<file>[^:\s][^:]*):(?P<line>\d+):(?:\d+:)? (?:fatal )?error: (?P<text>.*)")
_OTHER_ERROR = re.compile(
    r"(?P<text>.*(?:\b[Ee]rror:|Error\(s\)|undefined reference|No rule to make|[A-Za-z]Error:|\*\*\*).*)"
)


def run_hint(reason: str) -> str:
    """What brings evidence that was not recorded, by the recording's own reason."""
    if "only the files" in reason:
        return "grade without --static"
    return INSTALL_ROS if "no ROS" in reason else "grade the submission again"


class BuildParams(Record):
    """`scripts` have to be there to run after the build, paths as the handout gives them."""

    scripts: tuple[str, ...] = ()


class BuildError(NamedTuple):
    """The first error that the build printed; `kind` is `cmake`, `compiler` or `other`."""

    kind: str
    text: str
    file: str
    line: int | None


@check("build", params=BuildParams)
def build(package: PackageFacts, build: Run, params: BuildParams) -> Verdict:
    """The package builds.

    What it checks
        That `catkin_make` succeeds in a fresh workspace which holds this package, and the packages of the
        same repository that it depends on. Where the lab asks for scripts, that each is there to run
        afterwards.

    Why it matters on a robot
        On the robot the workspace is built from what was pushed. What only builds beside files on your own
        machine does not exist there.

    How it is measured
        By the exit code of `catkin_make`; the first error that it printed is quoted. Nodes are run all the
        same, from their sources. A script is there where `catkin_install_python` puts it into `devel/lib`,
        or where `rosrun` finds it in the package; whether it has its executable bit counts elsewhere.

    How to fix
        Clone your repository into a new workspace, run `catkin_make`, and mend the first error: the later
        ones often follow from it.
    """
    scripts = f", and {join_words(params.scripts)} there to run" if params.scripts else ""
    verdict = judge_build(package, build)
    if verdict.status is Status.PASS:
        verdict = _lost_scripts(package, params.scripts) or verdict
    return verdict.model_copy(update={"expected": f"{verdict.expected or EXPECTED}{scripts}"})


def judge_build(package: PackageFacts, build: Run) -> Verdict:
    """Whether `catkin_make` succeeded, and if not, why."""
    found = {e.event: (t, e) for t, e in build.processes if e.name == CATKIN_MAKE}
    if "start" not in found and "exit" not in found:
        reason = build.metadata.get("not_run") or (build.outcome.detail if build.outcome else "")
        message = f"the package was not built{': ' + reason if reason else ''}"
        return inconclusive(message, expected=EXPECTED, measured="not built", hint=run_hint(reason))
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


def _stopped_build(build: Run, took: str) -> Verdict:
    """By a limit that it broke, which is named, or because its time was up."""
    limits = (e.detail for _, e in build.actors if e.action == "limit" and e.actor == CATKIN_MAKE)
    limit = next((detail for detail in limits if detail.startswith("stopped by the grader")), "")
    return failed(
        f"catkin_make was {limit}" if limit else f"catkin_make had not finished after {took} and was stopped",
        expected=EXPECTED,
        measured=limit or f"stopped after {took}",
        hint="look at what CMakeLists.txt runs: a command that waits, never ends, or needs far too much",
    )


def _broken_build(package: PackageFacts, build: Run, exit_code: int | None) -> Verdict:
    error = _first_error([c.line for _, c in build.console if c.process == CATKIN_MAKE])
    place = _place(error, package)
    explained = package.manifest is None or (error is not None and error.kind == "cmake")
    verdict = unjudged if explained else failed
    return verdict(
        f"catkin_make failed: {error.text}" if error else "catkin_make failed without naming an error",
        expected=EXPECTED,
        measured=f"exit code {exit_code}",
        hint="run catkin_make in a fresh clone and mend the first error that it prints",
        citations=(place or EvidenceCitation(evidence=build.evidence, topic="/grader/console"),),
    )


def _lost_scripts(package: PackageFacts, scripts: Sequence[str]) -> Verdict | None:
    """Scripts that are nowhere in the package: their own criteria say so first."""
    there = {PurePosixPath(f.path).name: f for f in package.files if not is_product(f.path)}
    lost = [s for s in scripts if PurePosixPath(s).name not in there]
    if not lost:
        return None
    near = [there[n].path for s in lost for n in near_names(PurePosixPath(s).name, there)]
    seen = f"; there is {join_words(dict.fromkeys(near))}" if near else ""
    return unjudged(
        f"catkin_make succeeded, but there is no {join_words(lost, 'or')} to run{seen}",
        expected=EXPECTED,
        measured=f"rosrun finds no {join_words((PurePosixPath(s).name for s in lost), 'or')}",
        hint=f"add {join_words(lost)} to the package, then git add, commit and push",
    )


def is_product(path: str) -> bool:
    """Whether a build made it: nothing of what was handed in counts there."""
    return PurePosixPath(path).parts[0] in {"build", "devel", "install"}


def _first_error(lines: Sequence[str]) -> BuildError | None:
    """The first line that fits: a compiler's error comes before make's summary of it."""
    for index, line in enumerate(lines):
        if match := _CMAKE_ERROR.match(line):
            place = f"{match['file']}:{match['line']}: " if match["file"] else ""
            text = f"{place}{match['text'] or _paragraph(lines[index + 1 :])}"
            number = int(match["line"]) if match["line"] else None
            return BuildError("cmake", shown(text), match["file"] or "", number)
        if match := _COMPILER_ERROR.match(line):
            text = f"{match['file'].rpartition('/')[2]}:{match['line']}: {match['text']}"
            return BuildError("compiler", shown(text), match["file"], int(match["line"]))
    other = next((m["text"] for m in map(_OTHER_ERROR.match, lines) if m), None)
    return BuildError("other", shown(other), "", None) if other else None


def _paragraph(lines: Sequence[str]) -> str:
    """The text of a CMake error: the first paragraph after its heading, and the one that its colon announces."""
    words: list[str] = []
    for line in lines:
        if words and not line.strip() and not words[-1].endswith(":"):
            break
        words += line.split()
    return " ".join(words)


def _place(error: BuildError | None, package: PackageFacts) -> FileCitation | None:
    """The error's place if it lies in the package: the longest of the package's paths that ends it."""
    if error is None or not error.file:
        return None
    fits = [f.path for f in package.files if ("/" + error.file).endswith("/" + f.path)]
    return FileCitation(file=max(fits, key=len), line=error.line) if fits else None
