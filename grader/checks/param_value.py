"""Whether a parameter has its value at the end of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from grader.checks.registry import check
from grader.checks.support.absence import no_node
from grader.checks.support.calls import text
from grader.checks.support.comparing import differences
from grader.checks.support.names import GlobalName
from grader.checks.support.param_tree import absolute, own, tree
from grader.checks.support.process import lives
from grader.checks.support.text import near_names, shown
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, passed
from grader.wording import join_words

EXACT = 1e-9
MISSING = object()


class ParamValueParams(Record):
    """`name` with its slash; `value` as in YAML: a number, text, true or false, a list or a map."""

    name: GlobalName
    value: Any


@check("param-value", params=ParamValueParams)
def param_value(package: PackageFacts, run: Run, params: ParamValueParams) -> Verdict:
    """The parameter has its value.

    What it checks
        That the parameter is on the parameter server under this name when the run ends, with this value and
        of its kind: the text `'3'` is not the number 3.

    Why it matters on a robot
        Speeds, lengths and names of frames are parameters. A node that finds none under the name it asks
        for goes on with its default, and one that finds text where it expects a number dies.

    How it is measured
        By every change that the parameter server was asked for, up to the Ctrl-C at the end of the run.

    How to fix
        `rospy.set_param('<name>', value)`, a `<param>` in the launch file, or a YAML file that `rosparam`
        loads. Within `<node>`, and with `~`, a name is below the node's own. `rosparam get <name>` shows it.
    """
    held = tree(run, until_ns=_until_ns(run))
    got = _held(held, absolute(params.name))
    verdict = _not_there(package, run, own(held), params) if got is MISSING else _judged(got, params)
    cite = EvidenceCitation(evidence=run.evidence, topic="/grader/param")
    return verdict.model_copy(
        update={
            "expected": f"{params.name}: {shown(text(params.value))}",
            "measured": verdict.measured or ("not set" if got is MISSING else shown(text(got))),
            "citations": (*verdict.citations, cite),
        }
    )


def _until_ns(run: Run) -> int:
    """Up to the first Ctrl-C: what a node clears away as it ends does not count."""
    pressed = (one.interrupt_ns for one in lives(run) if one.interrupt_ns is not None)
    return min(pressed, default=run.end_ns)


def _held(leaves: Mapping[str, Any], name: str) -> Any:  # noqa: ANN401 - a parameter may be anything
    """The value, or the map of all values below the name."""
    if name in leaves:
        return leaves[name]
    parts = [n.removeprefix(f"{name}/").partition("/")[0] for n in leaves if n.startswith(f"{name}/")]
    return {part: _held(leaves, f"{name}/{part}") for part in dict.fromkeys(parts)} or MISSING


def _judged(got: object, params: ParamValueParams) -> Verdict:
    wrong = [str(one) for one in differences(got, params.value, EXACT)]
    if not wrong:
        return passed(f"{params.name} is {shown(text(got))}")
    hint = "numbers stand without quotes, text with them" if "(text, not" in wrong[0] else ""
    message = shown(f"{params.name} is {join_words(wrong)}")
    return failed(message, hint=hint or f"rosparam get {params.name} shows it; set it to the lab's value")


def _not_there(package: PackageFacts, run: Run, names: Iterable[str], params: ParamValueParams) -> Verdict:
    near = near_names(params.name, names)
    if near:
        message = f"there is no parameter {params.name}; there is {join_words(near)}"
        hint = "with ~, or within <node>, a parameter's name is below the node's own; without, it is not"
        return failed(message, hint=hint)
    if absent := no_node(package, run, f"there is no parameter {params.name}"):
        return absent
    message = f"nothing set the parameter {params.name}, or it was deleted again"
    return failed(message, hint=f"rospy.set_param('{params.name}', …), or a <param> in the launch file")
