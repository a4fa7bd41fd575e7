"""The parameter server over time, parameters that the grader made up, and what `rosparam load` says of a YAML file.

Maps are taken apart into their leaves (`/details/name/first`).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Any, NamedTuple

from grader.checks.registry import Check
from grader.checks.support.console_output import Line
from grader.checks.support.exit_causes import Ending, explain_end, explain_error
from grader.checks.support.fields import value_text
from grader.checks.support.processes import base_name, early_end, lives
from grader.checks.support.text import get_param, init, near_names, python_or_cpp, shown
from grader.checks.support.topics import cite, files_that_run, nodes_on, published_topics
from grader.evidence.events import ParamEvent
from grader.evidence.run import Run
from grader.line_slips.yaml import YAML_LINES_MAX, slip_of_yaml
from grader.model.launch_file import LaunchNode, LaunchParam
from grader.model.package import PackageFacts
from grader.model.verdict import EvidenceCitation, FileCitation, Verdict, cited_lines
from grader.wording import join_words, plural, there_is

UNNAMED = "/unnamed"
"""What rospy calls a node before `init_node`."""
SYSTEM = (
    "/rosdistro",
    "/rosversion",
    "/run_id",
    "/use_sim_time",
    "/rosout_disable_topics_generation",
    "/roslaunch/",
)
NOT_IN_FILE = "not in the file"
UNREAD_SHOWN = 4
PRINTED_INDENT = 4
_BETWEEN_PARTS = re.compile(r"[,;]?\s*\n\s*|[,;]\s+")
_YAML_KEY = re.compile(r"^( *)[\"']?([A-Za-z]\w{0,99})[\"']?\s*:(?:\s|$)")
_PLACE = re.compile(r"line (\d+), column (\d+)")
_IN_LINE = "line {line} has a tab after a name or a value, which YAML does not accept"
_QUOTED = re.compile(r"(['\"])(.*)\1")
_NO_COLON = re.compile(r"(?<!\S)_\w{1,99}=(?!=)\S+")
INDENT = "indent with spaces only, two per level"
# what is printed, what it means ({line}: where), and what to do
_CAUSES = (
    (r"found character '\\t'", "line {line} is indented with a tab, which YAML does not accept", INDENT),
    (r"cannot marshal None", "a name has no value: nothing follows it, and nothing is indented below it",
     "write a value after the name; what belongs to a name is indented by two spaces more than the name"),
    (r"exceeds XML-RPC limits|Overflow Error", "a number is larger than 2147483647, the largest that ROS can hold",
     'write a long number in quotes, as text: phone: "9876543210"'),
    (r"mapping values are not allowed here",
     "on line {line} or above it, the space after a `:` is missing, or a `:` is part of a value",
     'write `name: value` with a space, and a value that holds a `:` in "quotes"'),
    (r"scanning a quoted scalar|found unexpected end of stream", "a closing quote is missing near line {line}",
     'close every " on its own line'),
    (r"expected <block end>|unindent does not match|expected ',' or '[\]}}]'|could not find expected ':'",
     "line {line} does not line up with those above it: names of one level begin in the same column", INDENT),
    (r"cannot start any token", "line {line} has a character that needs quotes", 'write the value in "quotes"'),
    (r"can only be set to a dictionary", "it holds no `name: value`", "write `details:` and its values below it"),
    (r"UnicodeDecodeError|codec can't decode|special characters are not allowed", "it is not saved as UTF-8",
     "save it as UTF-8"),
    (r"is not iterable|NoneType", "it is empty, or a part of it is", "write `details:` and its values below it"),
)  # fmt: skip


def absolute_name(name: str) -> str:
    """Return the name with the slash in front, and none at the end."""
    return "/" + name.strip("/")


def leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - as XML-RPC gives it
    """Yield a parameter as its leaves; an empty map is one of its own."""
    if isinstance(value, Mapping) and value:
        for key, item in value.items():
            yield from leaves(f"{name.rstrip('/')}/{key}", item)
    else:
        yield name, value


def params_on_server(
    run: Run, *, until_ns: int | None = None, by: Callable[[str], bool] = lambda _: True
) -> dict[str, Any]:
    """Return the server's leaves after all changes up to `until_ns` by those callers that `by` wants."""
    found: dict[str, Any] = {}
    for at_ns, event in run.params:
        if (until_ns is None or at_ns <= until_ns) and by(event.caller_id):
            _apply(found, event)
    return found


def resolved_param(name: str, node: str) -> str:
    """Return the whole name of a parameter that a node reads by this one: `~rate`, `rate` or `/rate`."""
    if name.startswith("~"):
        return f"{node}/{name.lstrip('~/')}"
    return absolute_name(name if name.startswith("/") else f"{node.rpartition('/')[0]}/{name}")


def where_given(package: PackageFacts, name: str) -> LaunchParam | None:
    """Return the `<param>` of the package's launch files that gives a parameter; None where it is another's doing."""
    given = (param for launch in package.launch_files for param in launch.params)
    return next((param for param in given if absolute_name(param.name) == name), None)


def without_system_params(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters without those that ROS itself keeps there."""
    return {name: value for name, value in found.items() if not name.startswith(SYSTEM)}


def _apply(found: dict[str, Any], event: ParamEvent) -> None:
    name = absolute_name(event.name)
    below = f"{name.rstrip('/')}/"
    for known in [n for n in found if n == name or n.startswith(below)]:
        del found[known]
    if event.action == "set":
        for known in [n for n in found if name.startswith(f"{n}/")]:
            del found[known]  # a value gives way to a map
        found.update(leaves(name, event.value))


def describe_missing(found: Mapping[str, Any], name: str) -> str:
    """Return `there is no /details/name/first`, with what is there in its place."""
    last = name.rpartition("/")[2]
    others = without_system_params(found)
    same = [n for n in others if n.rpartition("/")[2] == last]
    near = same or near_names(name, others) or list(others)
    return f"there is no {name}" + (f"; {there_is(near)}" if near else "")


def name_in_its_place(name: str, found: Iterable[str], names: Iterable[str]) -> str | None:
    """Return the one of `found` that is there for a name that is not: nearly the same in the same map, or the same in
    another map. It is not another of `names`."""
    above, _, last = name.rpartition("/")
    others = [n for n in found if n not in set(names)]
    beside = {n.rpartition("/")[2]: n for n in others if n.rpartition("/")[0] == above}
    longer = [n for n in beside if n.casefold().startswith(last.casefold())]
    near = {beside[n] for n in (*near_names(last, beside), *longer)}
    there = near or {n for n in others if n.rpartition("/")[2] == last}
    return there.pop() if len(there) == 1 else None


class Key(NamedTuple):
    """A name in a YAML file: `path` is that of its parameter, `indent` how many spaces stand before it."""

    path: str
    line: int
    indent: int


def yaml_keys(text: str) -> tuple[Key, ...]:
    """Return the names of a file of `name: value` lines, as far as its lines alone say it."""
    found: list[Key] = []
    above: list[Key] = []
    for number, line in enumerate(text.splitlines()[:YAML_LINES_MAX], start=1):
        match = _YAML_KEY.match(line)
        if match is None:
            continue
        indent = len(match[1])
        while above and above[-1].indent >= indent:
            above.pop()
        key = Key(f"{above[-1].path if above else ''}/{match[2]}", number, indent)
        above.append(key)
        found.append(key)
    return tuple(found)


class Given(NamedTuple):
    """A parameter as the grader set it before the run."""

    name: str
    value: Any
    in_file: bool


def text_of(build: Run, file: str) -> str:
    """Return the text of a parameter file of the package, found by its name."""
    base = PurePosixPath(file).name
    data = next((d for path, d in build.attachments.items() if PurePosixPath(path).name == base), b"")
    return data.decode("utf-8", "replace")


def keys_of(build: Run, path: str) -> tuple[Key, ...]:
    """Return the keys of a parameter file of the package."""
    return yaml_keys(text_of(build, path))


def lines_of(keys: tuple[Key, ...]) -> dict[str, list[int]]:
    """Return the lines in which each name of a file is given."""
    lines: dict[str, list[int]] = {}
    for key in keys:
        lines.setdefault(key.path, []).append(key.line)
    return lines


def duplicate_advice(path: str, keys: tuple[Key, ...]) -> str:
    """Return the advice where a name is given twice: YAML keeps only the last, and says nothing."""
    twice = next(((name, at) for name, at in lines_of(keys).items() if len(at) > 1), None)
    if twice is None:
        return ""
    name, lines = twice
    return f"{path} gives {name} on line {lines[0]} and again on line {lines[-1]}, and only the last counts"


def params_given(run: Run) -> dict[str, Given]:
    """Return what the grader set before anything started, by name."""
    events = [e for _, e in run.actors if e.action == "param"]
    names = (absolute_name(e.topic or "") for e in events)
    return {n: Given(n, e.value, NOT_IN_FILE not in e.detail) for n, e in zip(names, events, strict=True)}


def _may_rest_on_one(check: Check, verdict: Verdict) -> bool:
    """Return whether a parameter may be the cause of a loss that nothing explains yet: what a node does upon what it
    hears, or other words of its own than the lab's."""
    says = check.name in {"logs", "params-read", "prints"} and not verdict.basis.unjudged
    return (check.of_callbacks or says) and not verdict.basis.cause


def explain_by_unread_parameter(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the parameter that the run sets and that no node asked for, whatever it did instead."""
    if not _may_rest_on_one(check, verdict) or _is_misread(package, run, verdict):
        return verdict
    # Why it failed says more than what it did not read.
    if (early := early_end(run)) and (early.end is None or early.end.exit_code != 0):
        return verdict
    reads = [(e.actor, absolute_name(e.topic or "")) for _, e in run.actors if e.action == "read"]
    names = {name for _, name in reads}  # a program of the grader's reads some of them itself
    asked = [(node, name) for node, name in reads if run.is_student_node(node)]
    unread = [
        one
        for name, one in params_given(run).items()
        # To read a map is to read what is in it, and a name below another one asks for a part of it.
        if not any(f"{name}/".startswith(f"{n}/") or f"{n}/".startswith(f"{name}/") for n in names)
    ]
    if verdict.basis.unjudged and not published_topics(run):
        return verdict  # what no node publishes at all, no parameter explains
    if not asked or not unread:
        return _not_private(run, verdict)
    name = unread[0].name
    above, _, last = name.rpartition("/")
    own = [(node, n) for node, n in asked if last in n.split("/") or near_names(last, n.split("/"))]
    seen = f"; {own[0][0]} asks for {own[0][1]}" if own else ""
    hint = f"read it with {get_param(f'~{last}' if above in run.student_nodes() else name)}"
    hint += _asked_before(run, own[0][1] if own else "", f"~{last}" if above in run.student_nodes() else name)
    if _is_too_early(run):
        hint = "move `rospy.init_node(…)` above the line that reads it: before, the node has no name"
    if own and own[0][1].rpartition("/")[0] == own[0][0] and above not in run.student_nodes():
        hint = _named(own[0][0], above)
    sets = join_words(f"{one.name} to {one.value!r}" for one in unread[:UNREAD_SHOWN])
    them = "it" if len(unread) == 1 else "them"
    why = f"the run sets {sets}, and no node reads {them}{seen}"
    return verdict.explained(why, hint, cause=name).about(citations=(cite(run, "/grader/actor"),))


def _not_private(run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the private parameter of a node which it has, and asks for without the `~`."""
    reads = [(e.actor, absolute_name(e.topic or ""), e.detail) for _, e in run.actors if e.action == "read"]
    there, got = params_on_server(run), {name for _, name, lacks in reads if not lacks}
    for node, name, lacks in reads if run.student_nodes() else ():
        last = name.rpartition("/")[2]
        own = f"{node}/{last}"
        if lacks and own in there and own not in got and node in _publishing(verdict, run) and name != own:
            why = f"{node} is given {own}, and asks for {name}"
            hint = f"read it with {get_param(f'~{last}')}{_asked_before(run, name, f'~{last}')}"
            return verdict.explained(why, hint, cause=own)
    for node, own, word in _given_as_arguments(run):
        # To read a map is to read what is in it.
        asked = [f"{name}/" for actor, name, _ in reads if actor == node]
        if (
            asked
            and own in there
            and node in _publishing(verdict, run)
            and not any(map(f"{own}/".startswith, asked))
        ):
            last = own.rpartition("/")[2]
            why = f"the run gives {node} `{shown(word)}`, and it reads no parameter of that name"
            return verdict.explained(why, f"read it with {get_param(f'~{last}')}", cause=own)
    return verdict


def _given_as_arguments(run: Run) -> Iterator[tuple[str, str, str]]:
    """Yield the private parameters that the run gives scripts as arguments: the node, the name and the argument."""
    words = [word for life in lives(run) for word in life.start.argv[1:]]
    named = [(word, match[1]) for word in words if (match := re.match(r"_([A-Za-z]\w*):=", word))]
    yield from (
        (node, f"{node}/{name}", word) for node in sorted(run.student_nodes()) for word, name in named
    )


def _is_misread(package: PackageFacts, run: Run, verdict: Verdict) -> bool:
    """Return whether a line that reads a parameter the wrong way explains a wrong value: `wrong-value` tells it."""
    files = files_that_run(package, run)
    found = (s for s in package.slips if s.kind == "wrong-value" and s.name in ("early", "unset"))
    return verdict.basis.wrong == "value" and any(s.file in files for s in found)


def _asked_before(run: Run, asked: str, right: str) -> str:
    """Return what else to write where a node asked whether the parameter is there, and so never read it."""
    events = (e for _, e in run.actors if e.action == "read" and absolute_name(e.topic or "") == asked)
    # roscpp asks by itself, in `nh.param(…)`
    has = python_or_cpp(f", and ask `rospy.has_param('{shown(right)}')`, too", "")
    return has if any("has_param" in e.detail for e in events) else ""


def _named(node: str, wanted: str) -> str:
    """Return what to do where the node's private parameters are not those of the node that the lab asks for."""
    if base_name(node) == wanted:
        flag = python_or_cpp("`anonymous=True`", "`ros::init_options::AnonymousName`")
        return (
            f"take out {flag}: with it, the node has another name each time, and so have its own parameters"
        )
    return f"name the node {wanted}: {init(wanted.lstrip('/'))}"


def explain_by_misplaced_parameter(
    check: Check, package: PackageFacts, run: Run, verdict: Verdict
) -> Verdict:
    """Return a lost mark with the parameter that the node reads and a launch file sets somewhere else."""
    if not _may_rest_on_one(check, verdict) or early_end(run) or _is_misread(package, run, verdict):
        return verdict
    found = next(_misplaced(package, run, _publishing(verdict, run)), None)
    if _is_too_early(run):
        why = "a parameter is read before `rospy.init_node(…)`, when the node has no name yet"
        return verdict.explained(why, "move `rospy.init_node(…)` above the line that reads it", cause=why)
    if found is None:
        return _without_colon(package, run, verdict)
    asked, param, node = found
    sets = f"line {param.line} of {param.file} sets {param.name}, and {node.full_name} reads {asked}"
    last, within = asked.rpartition("/")[2], f"{node.full_name}/"
    hint = f"on line {param.line} of {param.file}, write "
    if param.name.startswith(within) and not asked.startswith(within):
        own = param.name.removeprefix(within)
        too = _asked_before(run, asked, f"~{own}")
        hint = f"in the script, read it with {get_param(f'~{own}')}{too}: it is the node's own"
    elif asked.startswith(within) and not param.name.startswith(within):
        place = f"the <node> on line {node.line}"
        hint = f'move line {param.line} of {param.file} into {place}, as <param name="{last}" …/>'
    else:
        hint += f'{param.attribute}="{last if asked.startswith(within) else asked}"'
    return verdict.explained(sets, hint, (param.place,), cause=asked)


def _without_colon(package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with an argument `_color=red` of a node, which roslaunch takes for no parameter, or with one
    that the launch file gives another node alone."""
    nodes = _publishing(verdict, run)
    for node in (one for file in package.launch_files for one in file.brings if one.full_name in nodes):
        if given := _NO_COLON.search(node.args or ""):
            why = f"`{shown(given[0])}` in args on line {node.line} of {node.file} sets no parameter"
            hint = f"write `{shown(given[0].replace('=', ':=', 1))}`"
            return verdict.explained(why, hint, (node.place,), cause=why)
        if (own := _given_to_another(package, run, node)) and not verdict.basis.cause:
            why = f"nothing sets {node.full_name}/{own}, which other nodes of {node.type} are given"
            if other := _nearly_given(run, node.full_name, own):
                why += f"; {node.full_name}/{other} is set, and nothing reads it"
                loads = [one for file in package.launch_files for one in file.loads]
                loads = [one for one in loads if one.namespace.rstrip("/") == node.full_name and one.source]
                where = (
                    f" in {loads[0].source}, which line {loads[0].line} of {loads[0].file} loads"
                    if loads
                    else ""
                )
                places = tuple(FileCitation(file=one.file, line=one.line) for one in loads[:1]) or (
                    node.place,
                )
                return verdict.explained(why, f"write {own} in place of {other}{where}", places, cause=why)
            if off := next((one for one in node.left_out if one.tag == own), None):
                why = f"{off.value} on line {off.line} of {off.file} leaves the <param> of {own} out"
                fix = f"remove {off.value} from that line, or give its <arg> the other default"
                return verdict.explained(why, fix, (off.place,), cause=why)
            hint = f'add <param name="{own}" value="…"/> to the <node> on line {node.line} of {node.file}'
            return verdict.explained(why, f"{hint}: {verdict.hint}", (node.place,), cause=why)
    return verdict


def _nearly_given(run: Run, node: str, own: str) -> str:
    """Return the parameter of a node that is nearly called so; "" where none is."""
    names = [one.rpartition("/")[2] for one in params_on_server(run) if one.rpartition("/")[0] == node]
    return next(iter(near_names(own, names)), "") if own not in names else ""


def _given_to_another(package: PackageFacts, run: Run, node: LaunchNode) -> str:
    """Return a private parameter that the node asks for, and that only another one of its program has; else ""."""
    same = [
        n for file in package.launch_files for n in file.brings if (n.pkg, n.type) == (node.pkg, node.type)
    ]
    names = {n.full_name for n in same}
    reads = [(e, absolute_name(e.topic or "")) for _, e in run.actors if e.action == "read"]
    own = [(e, n.removeprefix(f"{e.actor}/")) for e, n in reads if n.startswith(f"{e.actor}/")]
    got = {name for event, name in own if event.actor in names and not event.detail}
    lacks = (name for event, name in own if event.actor == node.full_name and event.detail)
    return next((name for name in lacks if name in got), "")


def explain_by_overwritten_parameter(
    check: Check, package: PackageFacts, run: Run, verdict: Verdict
) -> Verdict:
    """Return a lost mark with the line that sets a parameter which the run or the launch file gives another value."""
    # What the lab has a node set, `params-read` says by itself
    if not _may_rest_on_one(check, verdict) or check.name == "params-read":
        return verdict
    given, nodes = {name: one.value for name, one in params_given(run).items()}, run.student_nodes()
    found: dict[str, Verdict] = {}  # by the node that sets it
    for _, event in run.params:
        name = absolute_name(event.name)
        param = where_given(package, name)
        own = event.caller_id in nodes and event.action == "set"
        if not own and (name in given or param is not None):
            given[name] = event.value
        elif own and name in given and given[name] != event.value:
            slips = [s for s in package.slips if s.kind == "sets-parameter"]
            slips = [s for s in slips if resolved_param(s.message, event.caller_id) == name]
            where = f"line {slips[0].line} of {slips[0].file}" if slips else event.caller_id
            giver = f"line {param.line} of {param.file}" if param is not None else "the run"
            why = f"{where} sets {name} to {value_text(event.value)}, in place of the one that {giver} gives"
            hint = "read it with `rospy.get_param(…)`, and do not set it"
            hint = f"on {where}, write `get_param` instead of `set_param`" if slips else hint
            places = tuple(s.place for s in slips[:1])
            found.setdefault(event.caller_id, verdict.explained(why, hint, places, cause=name))
    judged = _publishing(verdict, run)  # of two nodes that do so, the one whose messages are wrong
    return min(found.items(), key=lambda one: one[0] not in judged, default=("", verdict))[1]


def explain_by_given_value(check: Check, package: PackageFacts, run: Run, verdict: Verdict) -> Verdict:
    """Return a lost mark with the line of a launch file that gives a node the very value that it wrongly publishes."""
    if check.name != "field-equals" or verdict.basis.cause or verdict.basis.unjudged:
        return verdict
    nodes, there = _publishing(verdict, run), params_on_server(run)
    read = {absolute_name(e.topic or "") for _, e in run.actors if e.action == "read" and e.actor in nodes}
    for name in sorted(read & there.keys()):
        value, param = there[name], where_given(package, name)
        if param is None or value in ("", 0, 1) or value_text(value) != verdict.measured:
            continue
        by_arg = param.by_arg or param
        place = f"line {param.line} of {param.file}"
        hint = f"change the value on line {by_arg.line} of {by_arg.file}: {verdict.hint}"
        if param.attribute == "name" and (inner := _QUOTED.fullmatch(param.value or "")):
            hint = f'on {place}, write value="{shown(inner[2])}": the quotes within are part of the text'
        why = f"{place} sets {name} to {value_text(value)}"
        if param.by_arg is not None:
            why += f", which line {by_arg.line} of {by_arg.file} gives"
        return verdict.explained(why, hint, (by_arg.place,), cause=f"{by_arg.file}:{by_arg.line}")
    return verdict


def _is_too_early(run: Run) -> bool:
    """Return whether a node asked for a private parameter before it had a name: rospy takes another one then."""
    early = (e for _, e in run.actors if e.action == "read" and e.actor.endswith(UNNAMED))
    return any((e.topic or "").startswith(f"{e.actor}/") for e in early)


def _publishing(verdict: Verdict, run: Run) -> set[str]:
    """Return the student's nodes that publish on the topics of the verdict's evidence; all, if it has none."""
    topics = {c.topic for c in verdict.citations if isinstance(c, EvidenceCitation)}
    nodes = {node for topic in topics for node in nodes_on(run, topic, "publishers")}
    return nodes or set(run.student_nodes())


def _misplaced(
    package: PackageFacts, run: Run, nodes: Collection[str]
) -> Iterator[tuple[str, LaunchParam, LaunchNode]]:
    """Yield the names that nodes ask for and that are not there, each with the parameter of the same name that a launch
    file sets and no node reads, and with the node in that file."""
    reads = [(e, absolute_name(e.topic or "")) for _, e in run.actors if e.action == "read"]
    got = {name for event, name in reads if not event.detail}
    there = params_on_server(run).keys() - got
    for event, name in reads:
        if not event.detail or event.actor not in nodes or name in SYSTEM:
            continue
        for file in package.launch_files:
            node = next((one for one in file.brings if one.full_name == event.actor), None)
            last = name.rpartition("/")[2]
            own = [p for p in file.params if p.name in there and p.name.startswith(f"{event.actor}/")]
            # What stands where the node looks for it is in its place: the run has another file, or the node set it
            params = [p for p in (*own, *file.params) if p.name in there and p.name != name]
            same = [p for p in params if p.name.rpartition("/")[2] == last]
            near = [p for p in params if p in own and near_names(last, [p.name.rpartition("/")[2]])]
            if node is not None and (param := next(iter(same or near), None)):
                yield name, param, node


def is_printed(value: object, lines: Sequence[Line]) -> bool:
    """In one line, a number as one of its own; of a list, each of its items, and of a text that has commas or lines, at
    least each of its parts."""
    if isinstance(value, list | tuple):
        return all(is_printed(item, lines) for item in value)
    text = str(value).strip()
    # A number stands alone: 12 is neither in 127 nor in 12.5.
    edges = (r"(?<!\w)(?<!\d\.)", r"(?!\w|\.\d)") if text[-1:].isdigit() else ("", "")
    word = re.compile(re.escape(text).join(edges))
    if any(word.search(line.text) for line in lines):
        return True
    parts = [part for part in _BETWEEN_PARTS.split(text) if part]
    return len(parts) > 1 and all(is_printed(part, lines) for part in parts)


def _beside(wrong: str, names: Sequence[str]) -> str:
    """Return which of the parameters on the server is meant by a name that is not there."""
    above, _, last = absolute_name(wrong).rpartition("/")
    beside = [name for name in names if above and name.rpartition("/")[0] == above]
    meant = [name for name in beside if name.rpartition("/")[2] in re.split(r"[_-]", last)]
    if len(meant) == 1:
        return f"write {get_param(meant[0])}; {above} has {join_words(beside)}"
    return "write the name as rosparam list shows it, one key for each level: get_param('details')['name']['first']"


def explain_failure(package: PackageFacts, run: Run) -> Ending | None:
    """Return an error that ended the node, or its last traceback."""
    ended = early_end(run)
    if ended is not None and ended.end is not None and ended.end.exit_code != 0:
        end: Ending | None = explain_end(ended, run, package)
    else:
        end = explain_error(package, run)
    if end is None:
        return None
    key = re.match(r"KeyError: ['\"]?([^'\" (]+)", end.cause)
    of_letters = {(s.file, s.line) for s in package.slips if s.name == "letters"}
    if key is None or of_letters.intersection(cited_lines(end.citations)):
        return end
    names = list(without_system_params(params_on_server(run)))
    parts = {part for name in names for part in name.split("/") if part}
    last = PurePosixPath(key[1]).name.lstrip("~")
    deeper = [name for name in names if name.endswith(f"/{last}")]
    asked = ((e.actor, e.topic) for _, e in run.actors if e.action == "read" and e.detail)
    node = next((actor for actor, name in asked if name == f"{actor}/{last}" and key[1] == f"~{last}"), "")
    if len(deeper) == 1 and node:
        above = deeper[0].rpartition("/")[0]
        cause = f"{end.cause}: ~{last} is {node}/{last} here, and {deeper[0]} is set"
        hint = _named(node, above) if above else f"write {get_param(deeper[0])}: it is no node's own"
        return end._replace(cause=cause, hint=hint)
    if len(deeper) == 1:
        levels = "".join(f"['{part}']" for part in deeper[0].split("/") if part)
        hint = f"write {get_param(deeper[0])}, or a key for each level: {levels}"
        return end._replace(cause=f"{end.cause}: {last} is not there but in {deeper[0]}", hint=hint)
    near = near_names(last, parts - {last})
    seen = f"; {there_is(near)}" if near else ""
    hint = _beside(key[1], names)
    return end._replace(cause=f"{end.cause}: nothing is named {key[1]} there{seen}", hint=hint)


class Words(NamedTuple):
    """Why the file cannot be loaded, what to do, and the line if one is named."""

    why: str
    hint: str
    line: int | None


def explain_yaml(lines: Sequence[str]) -> Words | None:
    """Return the cause among the lines that were printed; None where none is known."""
    text = "\n".join(lines)
    places = _PLACE.findall(text)
    # YAML's parser names first where it began to read something, and last where the fault is.
    line = int(places[-1][0]) if places else None
    if "found character '\\t'" in text and _is_within(lines):
        return Words(_IN_LINE.format(line=line), "replace the tab with a space", line)
    for pattern, why, hint in _CAUSES:
        if re.search(pattern, text):
            return Words(why.format(line=line or "?"), hint, line)
    return None


def _is_within(lines: Sequence[str]) -> bool:
    """Whether the place that was named last has more than blanks before it, by the line that is printed below it."""
    for line, below in reversed(list(pairwise(lines))):
        if place := _PLACE.search(line):
            return bool(below[PRINTED_INDENT : PRINTED_INDENT + int(place[2]) - 1].strip())
    return False


def explain_yaml_line(text: str, until: int) -> Words | None:
    """Return what keeps the first lines of a file, up to `until`, from being `name: value`; None where they look right.
    What YAML's parser names is often a line further down."""
    found = slip_of_yaml(text, until)
    return found and Words(
        f"line {found.number} {found.why}", f"line {found.number}: write `{found.right}`", found.number
    )


def explain_yaml_column(text: str, line: int) -> Words | None:
    """Return which of two names, that at the line or the one above it, begins in a column that no other name has; None
    where that is not plain."""
    keys = yaml_keys(text)
    at = next((i for i, key in enumerate(keys) if key.line == line and i), None)
    if at is None or keys[at].indent == keys[at - 1].indent:
        return None
    columns = Counter(key.indent for i, key in enumerate(keys) if i not in (at, at - 1))
    odd, other = sorted((keys[at], keys[at - 1]), key=lambda key: columns[key.indent])
    if columns[odd.indent] or not columns[other.indent]:
        return None
    spaces = plural(other.indent, "space")
    why = f"line {odd.line} does not line up with line {other.line}: names of one level begin in the same column"
    return Words(why, f"begin line {odd.line} with {spaces}, as line {other.line} does", odd.line)
