"""Whether a launch file puts parameters where its node reads them, before it does so."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath
from typing import Annotated, Any

from pydantic import AfterValidator

from grader.checks.launch_files import missing_node
from grader.checks.registry import LaunchName, check
from grader.checks.support.console_output import SUMMARY, Line, printed_lines
from grader.checks.support.launch import (
    BAD_FILE,
    NO_FILE,
    Absence,
    finished,
    nodes_up,
    not_run,
    quoted,
    refusal,
    why_died,
    why_not_up,
)
from grader.checks.support.launch_slips import Slip, nodes_of_script, read_launch, refusals
from grader.checks.support.parameters import (
    absolute_name,
    describe_missing,
    is_printed,
    name_in_its_place,
    params_on_server,
    without_system_params,
)
from grader.checks.support.scripts import add_hint, find_script
from grader.checks.support.text import near_names
from grader.checks.support.topics import cite
from grader.evidence.run import Run
from grader.model.launch_file import LaunchFile, LaunchLoad, LaunchNode, LaunchParam
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, failed_or_blocked, passed
from grader.wording import join_words, on_lines, significant, there_is

OUTSIDE = 'write <rosparam file="$(find {})/{}"/> outside {}, without ns'
Wanted = Mapping[str, int | float | str]


class LaunchLoadsParams(Record):
    """Parameters that a launch file loads."""

    launch: LaunchName
    """The launch file's name, in whatever folder of the package it lies."""
    file: str
    """The parameter file that it loads, as YAML."""
    script: str
    """The script that reads the parameters."""
    names: tuple[str, ...]
    """Names of parameters that have to be on the server once the file is loaded."""


@check("launch-loads", params=LaunchLoadsParams)
def launch_loads(package: PackageFacts, build: Run, run: Run, params: LaunchLoadsParams) -> Verdict:
    """The launch file loads the parameters before the node reads them.

    What it checks
        That `roslaunch` puts the YAML file's parameters on the server under the names that the node reads,
        before it starts the node, and that the node runs.

    Why it matters on a robot
        No one types `rosparam load` on a robot. A node that starts without its parameters runs with wrong
        ones, or dies.

    How it is measured
        By every change of the parameter server up to the node's registration, and by what `roslaunch` says
        about the node. `<rosparam>` may come before or after the `<node>`: `roslaunch` sets parameters
        first. In a namespace, the file counts as loaded if the node prints all of its values from there.
        Each name that is loaded earns its share of one half, and the running node earns the other half.

    How to fix
        `<rosparam file="$(find <package>)/config/<file>.yaml"/>` beside the `<node>`, not inside it and without
        `ns`. `rosparam list` shows what is on the server.
    """
    expected = f"{params.launch} loads {params.file} and runs {PurePosixPath(params.script).name}"
    file = read_launch(package, params.launch, (params.script,))
    if isinstance(file, Verdict):
        return file.about(expected=expected)
    verdict = (
        not_run(run)
        or missing_node(package, file, params.script)
        or _other_tag(package, build, file, params)
        or _judge_loaded(package, file, run, params)
        or passed(f"roslaunch loads {params.file}, then runs {PurePosixPath(params.script).name}")
    )
    found = without_system_params(params_on_server(run, by=lambda caller: caller not in run.student_nodes()))
    place = FileCitation(file=file.path, line=_line(file, params))
    measured = f"on the server: {join_words(found) or 'nothing'}"
    cited = verdict.citations or (place, cite(run, "/grader/param"))
    return verdict.about(expected=expected, measured=measured, citations=cited)


def _judge_loaded(
    package: PackageFacts, file: LaunchFile, run: Run, params: LaunchLoadsParams
) -> Verdict | None:
    node = nodes_of_script(package, file, params.script)[0]
    up = nodes_up(run, node)
    start_ns = min((t for t, event in run.graph if set(up) & set(event.nodes)), default=run.end_ns)
    # What the node sets itself was not loaded.
    before = params_on_server(run, until_ns=start_ns, by=lambda caller: caller not in up)
    missing = [name for name in map(absolute_name, params.names) if name not in before]
    if missing and not (
        _read_where_loaded(file, run, params, before) or _read_by_other_names(run, params, before)
    ):
        there = [name for name in map(absolute_name, params.names) if name not in missing]
        runs = _not_running(package, run, node) is None
        share = (len(there) / len(params.names) + runs) / 2
        lost = _not_loaded(package, file, run, params, missing, judged=bool(there))
        return lost.in_part(share if there else 0.0, join_words([*there, *[f"{node.type} runs"] * runs]))
    if not (
        any(_is_of(load, params) for load in file.loads)
        or _by_node(file, params)
        or _of_another_name(package, file, params)
    ):
        message = f"{file.path} sets the parameters, but does not load {params.file}"
        return failed(message, hint=OUTSIDE.format(package.name, params.file, "the <node>"))
    return _not_running(package, run, node)


def _read_where_loaded(
    file: LaunchFile, run: Run, params: LaunchLoadsParams, before: Mapping[str, Any]
) -> bool:
    """The file is loaded into a namespace, and the node reads it there: it prints all that is in it."""
    lines = _lines_of_nodes(run)
    return any(
        all(name in before and is_printed(before[name], lines) for name in _names_in_namespace(load, params))
        for load in file.loads
        if _is_of(load, params)
    )


def _read_by_other_names(run: Run, params: LaunchLoadsParams, before: Mapping[str, Any]) -> bool:
    """The file has other names, and the node reads these: it prints all of their values."""
    lines = _lines_of_nodes(run)
    names = [absolute_name(name) for name in params.names]
    there = [name if name in before else name_in_its_place(name, before, names) for name in names]
    return all(name is not None and is_printed(before[name], lines) for name in there)


def _lines_of_nodes(run: Run) -> list[Line]:
    """Return what was printed, without roslaunch's own summary: that shows the values of all parameters."""
    return [line for line in printed_lines(run) if not SUMMARY.match(line.text)]


def _other_tag(
    package: PackageFacts, build: Run, file: LaunchFile, params: LaunchLoadsParams
) -> Verdict | None:
    """Return the loss by a tag that names the file and loads no parameters, where none does: `<param file=…>`."""
    if any(_is_of(load, params) for load in file.loads) or _by_node(file, params):
        return None
    name = PurePosixPath(params.file).name
    for number, line in enumerate(build.file_lines(file.path), start=1):
        tag = re.search(r"<(?!node\b)([a-z][\w-]*)", line)
        if tag is not None and name in line:
            why = f"<{tag[1]}> does not load {params.file}"
            right = f'<rosparam file="$(find {package.name})/{params.file}" command="load"/>'
            return Slip(file.path, number, why, f"on line {number}, write `{right}`").verdict()
    return None


def _names_in_namespace(load: LaunchLoad, params: LaunchLoadsParams) -> list[str]:
    return [load.namespace.rstrip("/") + absolute_name(name) for name in params.names]


def _not_running(package: PackageFacts, run: Run, node: LaunchNode) -> Verdict | None:
    """With its parameters in place, the node died or never ran."""
    died = why_died(package, run, node)
    if died is None and (nodes_up(run, node) or finished(run, node)):
        return None
    absence = died or why_not_up(package, run, node)
    what = "does not run to its end" if died else "does not run"
    return absence.verdict(f"the parameters are loaded, but {node.type} {what}: {absence.why}")


def _not_loaded(
    package: PackageFacts,
    file: LaunchFile,
    run: Run,
    params: LaunchLoadsParams,
    missing: list[str],
    *,
    judged: bool,
) -> Verdict:
    if find_script(package, params.file) is None:
        message = f"there is no {PurePosixPath(params.file).name} in the package to load"
        return failed_or_blocked(message, hint=add_hint(package, params.file)).lost_by(
            "file-missing", params.file
        )
    if slip := next(refusals(package, file), None):
        return slip.verdict(quoted(run))
    if absence := refusal(run, package):
        slip = _misplaced(package, file, params) if absence.refused == NO_FILE else None
        return slip.verdict(quoted(run)) if slip else _refusal_verdict(file, params, absence)
    loads = [load for load in file.loads if _is_of(load, params)]
    if not loads:
        message = f"{file.path} has no <rosparam> that loads {params.file}"
        return failed(message, hint=OUTSIDE.format(package.name, params.file, "the <node>"))
    other = _loaded_otherwise(package, run, params, loads, missing[0])
    return other.based_on(unjudged=other.basis.unjudged and not judged)


def _loaded_otherwise(
    package: PackageFacts, run: Run, params: LaunchLoadsParams, loads: list[LaunchLoad], missing: str
) -> Verdict:
    found = params_on_server(run)
    for load in loads:
        moved = load.namespace.rstrip("/") + missing
        if moved in found and moved != missing:
            why = f"the file is loaded into {load.namespace}, where {missing} becomes {moved}"
            hint = OUTSIDE.format(package.name, params.file, "any <node> and <group>")
            return Slip(load.file, load.line, why, hint).verdict()
    if missing in found:
        message = f"{missing} is set only after the node has started"
        return failed(message, hint=OUTSIDE.format(package.name, params.file, "the <node>"))
    message = f"{params.file} is loaded, but {describe_missing(found, missing)}"
    return failed_or_blocked(message, hint=f"fix the names in {params.file}")


def _misplaced(package: PackageFacts, file: LaunchFile, params: LaunchLoadsParams) -> Slip | None:
    """A `<rosparam>` that looks for the file in another folder of the package than the one in which it lies."""
    there = find_script(package, params.file)
    here = f"$(find {package.name})/"
    for load in file.loads if there else ():
        source = load.source or ""
        if there and _is_of(load, params) and source.startswith(here) and source != here + there.path:
            why = f"there is no {source.removeprefix(here)} in the package; the file is {there.path}"
            return Slip(load.file, load.line, why, f'write file="{here}{there.path}"')
    return None


def _refusal_verdict(file: LaunchFile, params: LaunchLoadsParams, absence: Absence) -> Verdict:
    """roslaunch starts nothing. Where it found the file and could not read it, the file is at fault."""
    broken = absence.refused == BAD_FILE
    what = f", {params.file}" if broken else ""
    cited = (FileCitation(file=file.path, line=_line(file, params)),)
    return absence._replace(of_script=broken, citations=cited).verdict(f"{absence.why}{what}")


def _is_of(load: LaunchLoad, params: LaunchLoadsParams) -> bool:
    name = PurePosixPath(params.file).name
    source = load.source or ""
    # What is in an environment variable, only roslaunch knows.
    return load.command == "load" and (PurePosixPath(source).name == name or "$(env" in source)


def _of_another_name(package: PackageFacts, file: LaunchFile, params: LaunchLoadsParams) -> bool:
    """The package has no file of that name, and the launch file loads one: how it is called is judged elsewhere."""
    loads = any(load.command == "load" and load.source for load in file.loads)
    return loads and find_script(package, params.file) is None


def _by_node(file: LaunchFile, params: LaunchLoadsParams) -> bool:
    """A `rosparam load` that the launch file runs as a node."""
    name = PurePosixPath(params.file).name
    return any(n.pkg == "rosparam" and name in (n.args or "") for n in file.brings)


def _line(file: LaunchFile, params: LaunchLoadsParams) -> int:
    here = [load for load in file.loads if load.file == file.path]
    named = [load for load in here if _is_of(load, params)]
    return (named or here)[0].line if here else 1


def params_misplaced(run: Run, file: LaunchFile, nodes: Iterable[str], wanted: Wanted) -> Verdict | None:
    """Return None where all of `wanted` are in one place where one of the nodes reads them.

    A node reads its private parameters (`/sim/background_r`), or those of its namespace, as older ones do.
    """
    verdicts = [_of_node(run, file, node, wanted) for node in nodes]
    return None if None in verdicts else verdicts[0]


def _below_node(name: str) -> str:
    if name.startswith(("/", "~")):
        meant = re.split(r"[/~]", name)[-1]
        raise ValueError(f'"{name}" is looked for below the node and beside it: write {meant}')
    return name


NodeParam = Annotated[str, AfterValidator(_below_node)]
"""A parameter's name as its node knows it."""


def params_in_place(run: Run, nodes: Iterable[str], wanted: Wanted) -> list[str]:
    """Return the names of those of `wanted` that are where one of the nodes reads them."""
    read = [_read_by(run, node) for node in nodes]
    return [
        name
        for name, value in wanted.items()
        if any(_is_there(before, places, {name: value}) for before, places in read)
    ]


def _read_by(run: Run, node: str) -> tuple[dict[str, Any], tuple[str, str]]:
    """Return the parameters as they were when the node started, and where it reads its own."""
    start_ns = next((t for t, event in run.graph if node in event.nodes), run.end_ns)
    before = params_on_server(run, until_ns=start_ns, by=lambda caller: caller != node)
    return before, (f"{node}/", f"{node.rpartition('/')[0]}/")


def _of_node(run: Run, file: LaunchFile, node: str, wanted: Wanted) -> Verdict | None:
    before, places = _read_by(run, node)
    if _is_there(before, places, wanted):
        return None
    if _is_there(params_on_server(run, by=lambda caller: caller != node), places, wanted):
        message = f"{join_words(wanted)} are set after {node} has started, and it reads them as it starts"
        verdict = failed(message, hint="set them with <param> inside the <node>: roslaunch does that first")
    else:
        verdict = _wrong_value(file, before, places, wanted) or _elsewhere(before, node, wanted)
    lines = verdict.citations or _lines(file, wanted)
    return verdict.about(citations=(*lines, cite(run, "/grader/param")))


def _is_there(found: Mapping[str, Any], places: Iterable[str], wanted: Wanted) -> bool:
    return any(all(_fits(found.get(p + name), value) for name, value in wanted.items()) for p in places)


def _renamed(again: Iterable[LaunchParam], missing: Iterable[str], wanted: Wanted) -> str:
    """Return which of the lines of one name is to have which of the missing ones: by their values, where these say."""
    left, found = list(missing), list[str]()
    own = list(dict.fromkeys(p.name.rpartition("/")[2] for p in again))
    for param in again:
        fits = [name for name in (*own, *left) if param.value == str(wanted[name])]
        if fits and fits[0] in own:
            own.remove(fits[0])  # the others are the copies
        elif fits:
            left.remove(fits[0])
            found.append(f"{fits[0]} on line {param.line}")
    return f"write {join_words(found)}" if not left else f"write {join_words(missing)} for the others"


def _wrong_value(
    file: LaunchFile, before: Mapping[str, Any], places: tuple[str, str], wanted: Wanted
) -> Verdict | None:
    place = next((p for p in places if any(p + name in before for name in wanted)), None)
    if place is None:
        return None
    missing = [name for name in wanted if place + name not in before]
    if missing:
        return _missing(file, before, place, missing, wanted)
    others = [name for name, value in wanted.items() if not _fits(before[place + name], value)]
    name = others[0]
    read = {p.name.removeprefix(place): p for p in file.params if p.name in {place + one for one in others}}
    cited = tuple(p.place for p in read.values())
    found, value = before[place + name], wanted[name]
    if isinstance(found, str) and found.strip() == str(value):
        message = f'{place}{name} is the text "{found}", which the node does not read as a number'
        hint = f'write <param name="{name}" type="int" value="{value}"/>'
        return failed(message, hint=hint, citations=cited)
    seen = ", ".join(_value_text(before[place + n]) for n in wanted)
    right = ", ".join(map(_value_text, wanted.values()))
    message = (
        f"{place}{name} is {_value_text(found)}, not {_value_text(value)}: {join_words(wanted)} are {seen}"
    )
    hint = f"{join_words(wanted)} have to be {right}"
    if len(read) == len(others) and all(p.value != str(wanted[key]) for key, p in read.items()):
        hint = "; ".join(f'on line {p.line}, write value="{wanted[k]}" for {k}' for k, p in read.items())
    return failed(message, hint=hint, citations=cited)


def _missing(
    file: LaunchFile, before: Mapping[str, Any], place: str, missing: list[str], wanted: Wanted
) -> Verdict:
    """Of some parameters that are not there: what the launch file calls them, and which of the others are wrong."""
    known = [name for name in wanted if name not in missing]
    verb = "is" if len(missing) == 1 else "are"
    message = f"{join_words(place + name for name in missing)} {verb} not set"
    message += f", only {join_words(place + name for name in known)}"
    named = [(param, param.name.rpartition("/")[2]) for param in file.params]
    names = [param.name for param in file.params]
    again = [param for param, name in named if names.count(param.name) > 1 and name in wanted]
    if len(again) > 1:  # the values of the others may be those of the copies
        hint = f"{on_lines(p.line for p in again)} give the same name: {_renamed(again, missing, wanted)}"
        return failed(message, hint=hint, citations=tuple(p.place for p in again))
    near = [(param, n) for param, name in named if name not in wanted for n in near_names(name, missing)]
    hint = "; ".join(f'on line {param.line}, write name="{name}"' for param, name in near)
    hint = hint or "write one <param> for each inside the <node>, with exactly these names"
    wrong = [name for name in known if not _fits(before[place + name], wanted[name])]
    message += "".join(f"; {place}{name} is {_value_text(before[place + name])}" for name in wrong)
    hint += "".join(f"; {name} has to be {_value_text(wanted[name])}" for name in wrong)
    return failed(message, hint=hint, citations=tuple(param.place for param, _ in near))


def _elsewhere(before: Mapping[str, Any], node: str, wanted: Wanted) -> Verdict:
    first = next(iter(wanted))
    hint = f'write <param name="{first}" value="{wanted[first]}"/> inside the <node> itself, and the others'
    found = next((name for name in before if name.rpartition("/")[2] in wanted), None)
    if found is not None:
        message = f"{found} is on the parameter server, but {node} reads {node}/{found.rpartition('/')[2]}"
        return failed(message, hint=hint)
    near = [name for name in before if name.startswith(f"{node}/")]
    seen = f"; under {node}/ {there_is(near)}" if near else ""
    message = f"{join_words(wanted)} are not on the parameter server{seen}: {node} reads {node}/{first}"
    return failed(message, hint=hint)


def _fits(found: object, wanted: float | str) -> bool:
    """As roscpp reads it: a number with a fraction is rounded where an integer is asked for, a text is none."""
    if isinstance(wanted, str) or isinstance(found, bool) or not isinstance(found, int | float):
        return found == wanted
    return abs(found - wanted) < (0.5 if isinstance(wanted, int) else 1e-9)


def _value_text(value: object) -> str:
    return (
        significant(value) if isinstance(value, int | float) and not isinstance(value, bool) else f'"{value}"'
    )


def _lines(file: LaunchFile, wanted: Wanted) -> tuple[FileCitation, ...]:
    found = [p for p in file.params if p.name.rpartition("/")[2] in wanted]
    return tuple(p.place for p in found[:3])
