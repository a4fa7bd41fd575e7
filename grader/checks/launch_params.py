"""Whether parameters are where a node of the launch file reads them when it starts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from grader.checks.support.param_tree import tree
from grader.evidence.run import Run
from grader.model.package import LaunchFile
from grader.model.verdict import EvidenceCitation, FileCitation, Verdict, failed
from grader.wording import join_words, significant

Wanted = Mapping[str, int | float | str]


def params_misplaced(run: Run, file: LaunchFile, nodes: Iterable[str], wanted: Wanted) -> Verdict | None:
    """None where all of `wanted` are in one place where one of the nodes reads them.

    A node reads its private parameters (`/sim/background_r`), or those of its namespace, as older ones do.
    """
    verdicts = [_of_node(run, file, node, wanted) for node in nodes]
    return None if None in verdicts else verdicts[0]


def _of_node(run: Run, file: LaunchFile, node: str, wanted: Wanted) -> Verdict | None:
    start_ns = next((t for t, event in run.graph if node in event.nodes), run.end_ns)
    before = tree(run, until_ns=start_ns, by=lambda caller: caller != node)
    places = (f"{node}/", f"{node.rpartition('/')[0]}/")
    if any(all(_fits(before.get(place + name), value) for name, value in wanted.items()) for place in places):
        return None
    later = tree(run, by=lambda caller: caller != node)
    late = any(
        all(_fits(later.get(place + name), value) for name, value in wanted.items()) for place in places
    )
    if late:
        message = (
            f"{join_words(wanted)} are set only after {node} has started, and it reads them as it starts"
        )
        verdict = failed(message, hint="set them with <param> inside the <node>: roslaunch does that first")
    else:
        verdict = _wrong_value(before, places, wanted) or _elsewhere(before, node, wanted)
    return verdict.model_copy(update={"citations": (*_lines(file, wanted), _evidence(run))})


def _wrong_value(before: Mapping[str, Any], places: tuple[str, str], wanted: Wanted) -> Verdict | None:
    """There where the node looks, with another value."""
    place = next((p for p in places if any(p + name in before for name in wanted)), None)
    if place is None:
        return None
    missing = [name for name in wanted if place + name not in before]
    if missing:
        known = [place + name for name in wanted if place + name in before]
        verb = "is" if len(missing) == 1 else "are"
        message = f"{join_words(place + name for name in missing)} {verb} not set, only {join_words(known)}"
        return failed(
            message, hint="write one <param> for each inside the <node>, the names letter by letter"
        )
    name = next(name for name, value in wanted.items() if not _fits(before[place + name], value))
    found, value = before[place + name], wanted[name]
    if isinstance(found, str) and found.strip() == str(value):
        message = f'{place}{name} is the text "{found}", which the node does not take for a number'
        return failed(message, hint=f'write <param name="{name}" type="int" value="{value}"/>')
    colour = f"{', '.join(map(_shown, (before[place + n] for n in wanted)))}"
    right = ", ".join(map(_shown, wanted.values()))
    message = f"{place}{name} is {_shown(found)}, not {_shown(value)}: {join_words(wanted)} are {colour}"
    return failed(message, hint=f"{join_words(wanted)} have to be {right}")


def _elsewhere(before: Mapping[str, Any], node: str, wanted: Wanted) -> Verdict:
    """Somewhere else on the server, or nowhere."""
    first = next(iter(wanted))
    hint = f'write <param name="{first}" value="{wanted[first]}"/> inside the <node> itself, and the others'
    found = next((name for name in before if name.rpartition("/")[2] in wanted), None)
    if found is not None:
        message = f"{found} is on the parameter server, but {node} reads {node}/{found.rpartition('/')[2]}"
        return failed(message, hint=hint)
    near = [name for name in before if name.startswith(f"{node}/")]
    seen = f"; under {node}/ there is {join_words(near)}" if near else ""
    message = f"{join_words(wanted)} are not on the parameter server{seen}: {node} reads {node}/{first}"
    return failed(message, hint=hint)


def _fits(found: object, wanted: float | str) -> bool:
    """As roscpp reads it: a number with a fraction is rounded where an integer is asked for, a text is none."""
    if isinstance(wanted, str) or isinstance(found, bool) or not isinstance(found, int | float):
        return found == wanted
    return abs(found - wanted) < (0.5 if isinstance(wanted, int) else 1e-9)


def _shown(value: object) -> str:
    return (
        significant(value) if isinstance(value, int | float) and not isinstance(value, bool) else f'"{value}"'
    )


def _lines(file: LaunchFile, wanted: Wanted) -> tuple[FileCitation, ...]:
    found = [p for p in file.params if p.name.rpartition("/")[2] in wanted]
    return tuple(FileCitation(file=p.file, line=p.line) for p in found[:3])


def _evidence(run: Run) -> EvidenceCitation:
    return EvidenceCitation(evidence=run.evidence, topic="/grader/param")
