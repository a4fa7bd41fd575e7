"""Whether a node reads parameters and prints them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import PurePosixPath

from grader.checks.registry import check
from grader.checks.support.names import GlobalName
from grader.checks.support.param_given import broken, given, is_printed
from grader.checks.support.printed import printed_lines
from grader.checks.support.process import lives
from grader.checks.support.text import shown
from grader.checks.support.unheard import HAND_IN
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, passed, unjudged
from grader.wording import join_words, plural


class ParamsReadParams(Record):
    """`names` are parameters that the scenario made up; `file` is where the student keeps their usual values."""

    names: tuple[GlobalName, ...]
    file: str = ""


@check("params-read", params=ParamsReadParams)
def params_read(package: PackageFacts, build: Run, run: Run, params: ParamsReadParams) -> Verdict:
    """The node reads its parameters and prints them.

    What it checks
        That the node prints or logs the value of each parameter as it is on the parameter server.

    Why it matters on a robot
        A value that is written into the script instead of read cannot be changed on the robot: the node goes
        on with the old one, whatever the file says.

    How it is measured
        The parameters have values that the grader makes up for this run. Each has to be on stdout, on stderr or
        on /rosout; a number has to stand for itself (`12` is not in `127`).

    How to fix
        `rospy.get_param('/details/name/first')`, or `rospy.get_param('details')` for a map of them all, then
        `rospy.loginfo(…)` each. `rosparam list` shows the names.
    """
    known = given(run)
    lines = printed_lines(run)
    missing = [n for n in params.names if n not in known or not is_printed(known[n].value, lines)]
    expected = f"the values of {join_words(params.names)} on the server are printed"
    verdict = (
        _not_printed(package, build, run, params, missing)
        if missing
        else passed(f"prints the values of {join_words(params.names)} that are on the server")
    )
    cite = EvidenceCitation(evidence=run.evidence, topic="/grader/console")
    measured = f"{len(params.names) - len(missing)} of {plural(len(params.names), 'value')} printed"
    update = {"expected": expected, "measured": measured, "citations": (*verdict.citations, cite)}
    return verdict.model_copy(update=update)


def _not_printed(
    package: PackageFacts, build: Run, run: Run, params: ParamsReadParams, missing: Sequence[str]
) -> Verdict:
    known = given(run)
    names = join_words(missing)
    if not lives(run):
        return unjudged("the node was not started: there is no script to run", hint=HAND_IN)
    if end := broken(package, run):
        message = f"{names} {_are(missing)} not printed: the node ended with {end.cause}"
        return failed(message, hint=end.hint, citations=end.citations)
    strange = [n for n in missing if n not in known or not known[n].in_file]
    if strange:
        file = params.file or "the student's file"
        message = (
            f"{names} {_are(missing)} not printed, and {join_words(strange)} {_are(strange)} not in {file}"
        )
        return unjudged(message, hint=f"mend the names in {file} first")
    lines = printed_lines(run)
    hard = next(
        (n for n in missing if any(is_printed(v, lines) for v in _in_file(build, params.file, n))), None
    )
    if hard is not None:
        message = f"{hard} is printed as {params.file} has it, not as the parameter server has it"
        hint = f"read it with rospy.get_param('{hard}'), and not from the file or the script"
        return failed(message, hint=hint)
    texts = [line.text.strip() for line in lines if line.text.strip()]
    seen = f"; it prints {shown(texts[-1])!r}" if texts else "; it prints nothing at all"
    message = f"{names} {_are(missing)} not printed with the values on the server{seen}"
    return failed(message, hint=f"rospy.loginfo(rospy.get_param('{missing[0]}'))")


def _in_file(build: Run, file: str, name: str) -> list[str]:
    """What stands behind the name's last part in the file as handed in."""
    base = PurePosixPath(file).name
    data = next((d for path, d in build.attachments.items() if PurePosixPath(path).name == base), b"")
    last = re.escape(name.rpartition("/")[2])
    found = re.findall(rf"(?m)^\s*{last}\s*:\s*(.*?)\s*(?:\s#.*)?$", data.decode("utf-8", "replace"))
    return [value.strip("'\"") for value in found if value.strip("'\"")]


def _are(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"
