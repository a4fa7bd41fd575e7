"""Whether parameters are read and set by a node, and have their values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from pathlib import PurePosixPath
from typing import Annotated, Any

from grader.checks.registry import Refers, check
from grader.checks.support.console_output import Line, printed_lines
from grader.checks.support.fields import differences, is_number, value_text
from grader.checks.support.parameters import (
    Given,
    absolute_name,
    duplicate_advice,
    explain_failure,
    is_printed,
    keys_of,
    name_in_its_place,
    params_given,
    params_on_server,
    text_of,
    without_system_params,
)
from grader.checks.support.processes import (
    GlobalName,
    first_interrupt_ns,
    is_written_as,
    lives,
    named_at,
    not_started,
    run_scripts,
    run_slips,
)
from grader.checks.support.text import get_param, log_param, near_names, set_param, shown
from grader.checks.support.topics import cite, no_node, run_slip
from grader.checks.support.wrong_lines import of_no_node
from grader.evidence.events import ParamEvent
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, failed_or_blocked, joined, passed
from grader.wording import join_words, plural, there_is

EXACT = 1e-9
MISSING = object()


class ParamsReadParams(Record):
    """Parameters that the node has to read."""

    names: tuple[Annotated[GlobalName, Refers("set")], ...]
    """Parameters that the scenario sets to made-up values, with their slash."""
    file: str = ""
    """The student's file with the parameters' usual values, as YAML; empty: none."""


@check("params-read", params=ParamsReadParams)
def params_read(package: PackageFacts, build: Run, run: Run, params: ParamsReadParams) -> Verdict:
    """The node reads its parameters and prints them.

    What it checks
        That the node prints or logs the value of each parameter as it is on the parameter server.

    Why it matters on a robot
        A value that is written into the script instead of read cannot be changed on the robot: the node goes
        on with the old one, whatever the file says.

    How it is measured
        The parameters have values that the grader makes up for this run. Each has to appear on stdout, on
        stderr or on /rosout; a number has to stand alone (`12` is not in `127`). Each value earns its
        share; two values that are only printed under each other's name (`First name: Lovelace`) earn none.
        If the student's file has another name for a parameter (`First` for `first`), which another
        criterion judges, its value will do.

    How to fix
        `rospy.get_param('/details/name/first')`, or `rospy.get_param('details')` for a map of them all, then
        `rospy.loginfo(…)` each. `rosparam list` shows the names.
    """
    known = params_given(run)
    lines = printed_lines(run)
    in_file = [name for name, one in known.items() if one.in_file]
    missing = [
        n
        for n in params.names
        if not any(
            name in known and is_printed(known[name].value, lines)
            for name in (n, name_in_its_place(n, in_file, params.names) if n not in in_file else None)
            if name is not None
        )
    ]
    expected = f"the values of {join_words(params.names)} on the server are printed"
    exchanged = _exchanged(params.names, known, lines) if not missing else None
    verdict = (
        _not_printed(package, build, run, params, missing)
        if missing
        else _beside_wrong_label(params, exchanged)
        if exchanged is not None
        else passed(f"prints the values of {join_words(params.names)} that are on the server")
    )
    cited = cite(run, "/grader/console")
    measured = f"{len(params.names) - len(missing)} of {plural(len(params.names), 'value')} printed"
    return verdict.about(expected=expected, measured=measured, citations=(cited,))


def _exchanged(
    names: Sequence[str], known: Mapping[str, Given], lines: Sequence[Line]
) -> tuple[str, str] | None:
    """Return two parameters each of which is printed only on lines that have the other's name, and not its own."""

    def has_value(name: str, line: Line) -> bool:
        return name in known and is_printed(known[name].value, [line])

    def labels(line: Line) -> list[str]:
        words = {word.casefold() for word in re.findall(r"[A-Za-z]+", line.text)}
        return [name for name in names if name.rpartition("/")[2].casefold() in words]

    found = [(name, labels(line)) for name in names for line in lines if has_value(name, line)]
    for one, other in combinations(names, 2):
        beside = [[label for name, label in found if name == asked] for asked in (one, other)]
        if beside == [[[other]] * len(beside[0]), [[one]] * len(beside[1])] and all(beside):
            return one, other
    return None


def _beside_wrong_label(params: ParamsReadParams, exchanged: tuple[str, str]) -> Verdict:
    first, second = (name.rpartition("/")[2] for name in exchanged)
    message = f"{join_words(exchanged)} are exchanged: each is printed on the line of the other"
    hint = f"print the value of {first} on the line that says {first}, and that of {second} on the other"
    return _share_printed(params, exchanged, message, hint)


def _not_printed(
    package: PackageFacts, build: Run, run: Run, params: ParamsReadParams, missing: Sequence[str]
) -> Verdict:
    known = params_given(run)
    names = join_words(missing)
    if not lives(run):
        return not_started("the node")
    if end := explain_failure(package, run):
        return end.verdict(failed, f"{names} {_are(missing)} not printed: the node ended with {end.cause}")
    strange = [n for n in missing if n not in known or not known[n].in_file]
    if strange:
        file = params.file or "the student's file"
        message = f"{names} {_are(missing)} not printed; {join_words(strange)} {_are(strange)} not in {file}"
        return failed_or_blocked(message, hint=f"fix the names in {file} first")
    lines = printed_lines(run)
    copied = (n for n in missing if any(is_printed(v, lines) for v in _in_file(build, params.file, n)))
    if (hard := next(copied, None)) is not None:
        message = f"{hard} is printed with the value in {params.file}, not with that on the parameter server"
        hint = f"read it with {get_param(hard)}, not from the file or the script"
        return _share_printed(params, missing, message, hint)
    texts = [line.text.strip() for line in lines if line.text.strip()]
    seen = f"; it prints {shown(texts[-1])!r}" if texts else "; it prints nothing at all"
    message = f"{names} {_are(missing)} not printed with the values on the server{seen}"
    own = [e for _, e in run.params if e.action == "set" and run.is_student_node(e.caller_id)]
    early = next((e for e in own if [absolute_name(e.name)] == missing and is_printed(e.value, lines)), None)
    if early is None:
        lost = _share_printed(params, missing, message, log_param(missing[0]))
        stuck = run_slip(package, run, "stuck")
        lost = lost.explained(stuck.message, stuck.fix, (stuck.place,)) if stuck is not None else lost
        return lost if texts else of_no_node(lost, package, run_scripts(run))
    hint = f"read {missing[0]} into a variable above the line that sets it, and print that variable"
    why = f"{message}: it is set to that value before it is read"
    cited = named_at(package, run, "sets-parameter", missing[0])
    return _share_printed(params, missing, why, hint).about(citations=cited)


def _share_printed(params: ParamsReadParams, missing: Sequence[str], message: str, hint: str) -> Verdict:
    """Return what is earned by those that are printed."""
    printed = [name for name in params.names if name not in missing]
    return failed(message, hint=hint).in_part(len(printed) / len(params.names), join_words(printed))


def _in_file(build: Run, file: str, name: str) -> list[str]:
    """Return what stands behind the name's last part in the file as handed in."""
    last = re.escape(name.rpartition("/")[2])
    found = re.findall(rf"(?m)^\s*{last}\s*:\s*(.*?)\s*(?:\s#.*)?$", text_of(build, file))
    return [value.strip("'\"") for value in found if value.strip("'\"")]


def _are(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


class ParamsSetParams(Record):
    """A parameter that the node sets."""

    name: GlobalName
    """The parameter, with its slash."""
    value: int | float | str
    """What it has to be afterwards, as a number or as text."""
    unchanged: tuple[GlobalName, ...] = ()
    """Parameters that have to keep their values, with their slash."""
    logged: bool = True
    """Whether the new value has to be printed too."""


@check("params-set", params=ParamsSetParams)
def params_set(package: PackageFacts, run: Run, params: ParamsSetParams) -> Verdict:
    """The node sets a parameter and leaves the others alone.

    What it checks
        That the parameter has its new value on the parameter server afterwards, that the others are as they
        were, and that the new value is printed or logged.

    Why it matters on a robot
        All nodes share the parameters. A node that writes back a whole map with names missing takes these
        away from all others.

    How it is measured
        By every change of the parameter server up to Ctrl-C or the node's own end. The value may be a
        number or text. Once it is set, the parameter itself, the unchanged others and the printed value
        earn equal shares. If the student's file has another name for a parameter, which another criterion
        judges, the node may set that one.

    How to fix
        `rospy.set_param('/details/contact/phone', 55555)`: use the full name of the one value, never a map.
        Read it back with `rospy.get_param` and log it.
    """
    params, until_ns = _as_in_file(run, params), _until_ns(run)
    after = params_on_server(run, until_ns=until_ns)
    got = after.get(params.name)
    others = f", {join_words(params.unchanged)} as before" if params.unchanged else ""
    expected = f"{params.name} is {params.value}{others}" + (", and it is logged" if params.logged else "")
    verdict = (
        (None if _is_value(got, params.value) else _not_set(package, run, after, params, until_ns))
        or _set_in_part(package, run, after, params)
        or passed(f"sets {params.name} to {params.value}{' and logs it' if params.logged else ''}")
    )
    cited = cite(run, "/grader/param")
    measured = f"{params.name}: {'not there' if got is None else shown(str(got))}"
    return verdict.about(expected=expected, measured=measured, citations=(cited,))


def _as_in_file(run: Run, params: ParamsSetParams) -> ParamsSetParams:
    """Return the parameters by the names that the student's file has for them, where the node sets the one of these."""
    in_file = [name for name, one in params_given(run).items() if one.in_file]
    own = {
        absolute_name(e.name) for _, e in run.params if e.action == "set" and run.is_student_node(e.caller_id)
    }
    names = (params.name, *params.unchanged)
    places = {n: n if n in in_file else name_in_its_place(n, in_file, names) or n for n in names}
    if params.name in own or places[params.name] not in own:
        return params
    unchanged = tuple(places[name] for name in params.unchanged)
    return params.model_copy(update={"name": places[params.name], "unchanged": unchanged})


def _set_in_part(
    package: PackageFacts, run: Run, after: dict[str, Any], params: ParamsSetParams
) -> Verdict | None:
    """Return what is wrong besides where the value is set, with the share of what is right."""
    asked: dict[str, Verdict | None] = {f"{params.name} is set": None}
    asked |= {"the others are as before": _judge_unchanged(run, after, params)} if params.unchanged else {}
    asked |= {"the new value is printed": _not_logged(package, run, params)} if params.logged else {}
    lost = joined([one for one in asked.values() if one])
    right = [what for what, one in asked.items() if one is None]
    return lost and lost.in_part(len(right) / len(asked), join_words(right))


def _is_value(got: object, wanted: object) -> bool:
    # In Python, true equals 1.
    return not isinstance(got, bool) and (
        got == wanted or (got is not None and str(got).strip() == str(wanted))
    )


def _not_set(
    package: PackageFacts, run: Run, after: dict[str, Any], params: ParamsSetParams, until_ns: int
) -> Verdict:
    if not lives(run):
        return not_started("the node")
    sets = [e for t, e in run.params if e.action == "set" and t <= until_ns]
    mine = [e for e in sets if run.is_student_node(e.caller_id)]
    last = next((e for e in reversed(mine) if absolute_name(e.name) == params.name), None)
    hint = f"write {set_param(params.name, params.value)}"
    if last is not None and params.name in after:
        verdict = _set_to_another(mine, after[params.name], params)
        return verdict.about(citations=named_at(package, run, "sets-parameter", params.name))
    if params.name not in after and params.name in params_given(run):
        cause = _taken_away(run, params.name)
        if last is not None and _is_value(last.value, params.value) and DELETES in cause:
            gone = cause.partition(DELETES)[2]
            hint = f"remove `rospy.delete_param('{gone}')`: the parameters stay after the node has ended"
        return failed(f"{params.name} is no longer on the server{cause}", hint=hint)
    if end := explain_failure(package, run):
        return end.verdict(failed_or_blocked, f"{params.name} was never set: the node ended with {end.cause}")
    # Without a limit, what came after Ctrl-C shows as well.
    if _is_value(params_on_server(run).get(params.name), params.value):
        message = f"{params.name} is set to {params.value} only after Ctrl-C: the node waits too long"
        return failed(message, hint="set it as soon as the values are read, without a long sleep before it")
    return _never_set(package, run, mine, params)


def _never_set(
    package: PackageFacts, run: Run, mine: Sequence[ParamEvent], params: ParamsSetParams
) -> Verdict:
    """The node sets other names, or nothing calls the function that would set it."""
    others = dict.fromkeys(absolute_name(e.name) for e in mine)
    spare = run_slip(package, run, "never-called") if not mine else None
    if spare is not None and (setting := named_at(package, run, "sets-parameter", params.name)):
        hint = spare.fix or f"call `{spare.name}()` where {spare.file} should set it"
        return failed(
            f"{params.name} is never set: {spare.message}", hint=hint, citations=(spare.place, *setting)
        )
    copied = [s for s in run_slips(package, run, "changes-copy") if absolute_name(s.message) == params.name]
    if copied and not others:
        why = f"line {copied[0].line} of {copied[0].file} changes `{copied[0].name}`, which is the script's own copy"
        return failed(f"{params.name} is never set: {why}", hint=copied[0].fix, citations=(copied[0].place,))
    gets = [s for s in run_slips(package, run, "read-to-set") if is_written_as(s.message, params.name)]
    gets = [s for s in gets if _is_value(s.name, params.value)]
    if gets and not others:
        why = f"on line {gets[0].line} of {gets[0].file}, `get_param(…)` only reads: a second value is its default"
        return failed(f"{params.name} is never set: {why}", hint=gets[0].fix, citations=(gets[0].place,))
    instead = f"; the node sets {join_words(others)}" if others else ""
    cited = named_at(package, run, "sets-parameter", next(iter(others))) if len(others) == 1 else ()
    hint = f"write {set_param(params.name, params.value)}"
    return failed(f"{params.name} is never set to {params.value}{instead}", hint=hint, citations=cited)


def _set_to_another(mine: Sequence[ParamEvent], got: object, params: ParamsSetParams) -> Verdict:
    now = shown(str(got))
    if any(absolute_name(e.name) == params.name and _is_value(e.value, params.value) for e in mine):
        message = f"{params.name} is set to {params.value}, and to {now} after that"
        return failed(message, hint=f"remove the later line that sets {params.name} to {now}")
    hint = f"write {set_param(params.name, params.value)}"
    return failed(f"{params.name} is set to {now}, not to {params.value}", hint=hint)


def _judge_unchanged(run: Run, after: dict[str, Any], params: ParamsSetParams) -> Verdict | None:
    known = params_given(run)
    before = params_on_server(run, by=lambda caller: not run.is_student_node(caller))
    for name in params.unchanged:
        was = known[name].value if name in known else before.get(name)
        if was is None or after.get(name) == was:
            continue
        hint = f"set only that one value: {set_param(params.name, params.value)}"
        if name in after:
            message = f"{name} was {shown(str(was))} and is {shown(str(after[name]))} afterwards"
            return failed(message, hint=hint)
        return failed(f"{name} is no longer on the server{_taken_away(run, name)}", hint=hint)
    return None


DELETES = ": the node deletes "


def _taken_away(run: Run, name: str) -> str:
    """Return the change that took a name away: a map that lacks it, a value in the map's place, or a delete."""
    # The last change is the one that took it away.
    for _, event in reversed(run.params):
        above = absolute_name(event.name)
        if run.is_student_node(event.caller_id) and f"{name}/".startswith(f"{above.rstrip('/')}/"):
            if event.action == "delete":
                return f"{DELETES}{above}"
            return f": set_param('{above}', …) replaces all that was below {above}"
    return ""


def _not_logged(package: PackageFacts, run: Run, params: ParamsSetParams) -> Verdict | None:
    if not params.logged or is_printed(params.value, printed_lines(run)):
        return None
    message = f"{params.name} is set to {params.value}, but the new value is never printed"
    if end := explain_failure(package, run):
        return end.verdict(failed, f"{message}: the node ended with {end.cause}")
    lost = failed(message, hint=log_param(params.name))
    return lost if printed_lines(run) else of_no_node(lost, package, run_scripts(run))


class ParamValueParams(Record):
    """A parameter and its value."""

    name: GlobalName
    """The parameter, with its slash."""
    value: Any
    """Its value, as in YAML: a number, text, true or false, a list or a map."""


@check("param-value", params=ParamValueParams)
def param_value(package: PackageFacts, build: Run, run: Run, params: ParamValueParams) -> Verdict:
    """The parameter has its value.

    What it checks
        That the parameter is on the parameter server under this name when the run ends, with this value and
        this type: the text `'3'` is not the number 3.

    Why it matters on a robot
        Speeds, lengths and names of frames are parameters. A node that finds none under the name it asks
        for goes on with its default, and one that finds text where it expects a number dies.

    How it is measured
        By every change on the parameter server, up to the Ctrl-C at the end of the run.

    How to fix
        `rospy.set_param('<name>', value)`, a `<param>` in the launch file, or a YAML file that `rosparam`
        loads. Within `<node>`, and with `~`, a name is below the node's own. `rosparam get <name>` shows it.
    """
    held = params_on_server(run, until_ns=_until_ns(run))
    got = _value_below(held, absolute_name(params.name))
    verdict = (
        _not_there(package, run, without_system_params(held), params)
        if got is MISSING
        else _given_before(package, build, params, got) or _judge_value(package, build, got, params)
    )
    cited = cite(run, "/grader/param")
    expected = f"{params.name}: {shown(value_text(params.value))}"
    measured = verdict.measured or ("not set" if got is MISSING else shown(value_text(got)))
    return verdict.about(expected=expected, measured=measured, citations=(cited,))


def _given_before(package: PackageFacts, build: Run, params: ParamValueParams, got: object) -> Verdict | None:
    """Return the loss where a YAML file gives the right value, and another one for the same name below it."""
    for file in (f.path for f in package.files if f.path.endswith((".yaml", ".yml"))):
        text = text_of(build, file).splitlines()
        keys = [key for key in keys_of(build, file) if absolute_name(params.name).endswith(key.path)]
        values = [
            text[key.line - 1].partition(":")[2].partition(" #")[0].strip().strip("'\"") for key in keys
        ]
        # Of a key that is there twice, YAML takes the last value.
        if len(values) < 2 or len({key.path for key in keys}) > 1 or values[-1] != str(got):
            continue
        if values[0] == str(params.value) != values[-1]:
            last = keys[-1].line
            place = FileCitation(file=file, line=last)
            return failed(duplicate_advice(file, tuple(keys)), hint=f"delete line {last}", citations=(place,))
    return None


def _until_ns(run: Run) -> int:
    """Return the first Ctrl-C: what a node clears away as it ends does not count."""
    pressed_ns = first_interrupt_ns(run)
    return run.end_ns if pressed_ns is None else pressed_ns


def _value_below(leaves: Mapping[str, Any], name: str) -> Any:  # noqa: ANN401 - a parameter may be anything
    """Return the value, or the map of all values below the name."""
    if name in leaves:
        return leaves[name]
    parts = [n.removeprefix(f"{name}/").partition("/")[0] for n in leaves if n.startswith(f"{name}/")]
    return {part: _value_below(leaves, f"{name}/{part}") for part in dict.fromkeys(parts)} or MISSING


def _judge_value(package: PackageFacts, build: Run, got: object, params: ParamValueParams) -> Verdict:
    wrong = [str(one) for one in differences(got, params.value, EXACT)]
    if not wrong:
        return passed(f"{params.name} is {shown(value_text(got))}")
    hint = _kind_hint(got, params.value) or f"rosparam get {params.name} shows it; set it to the lab's value"
    places = _given_at(package, build, absolute_name(params.name))
    if len(places) == 1:
        hint = f"{places[0].file}, line {places[0].line}: {hint}"
    loads = [one for file in package.launch_files for one in file.loads if one.source]
    loads = [one for one in loads if absolute_name(params.name).startswith(one.namespace)]
    if len(places) != 1 and len(loads) == 1:
        source = PurePosixPath(loads[0].source or "").name
        hint = f"see whether it is right that line {loads[0].line} of {loads[0].file} loads {source}: {hint}"
        places = (loads[0].place,)
    message = shown(f"{params.name} is {join_words(wrong)}")
    return failed(message, hint=hint, citations=places[:1] if len(places) == 1 else ())


def _kind_hint(got: object, wanted: object) -> str:
    """Return how a value of the right kind is written; empty where the kind is right."""
    if isinstance(got, dict) and isinstance(wanted, dict):
        return next(filter(None, (_kind_hint(got[key], wanted[key]) for key in wanted if key in got)), "")
    if isinstance(wanted, bool) and not isinstance(got, bool):
        return f"write {str(wanted).lower()} without quotes ({wanted} in Python)"
    if isinstance(wanted, str) and not isinstance(got, str):
        return f'write text in quotes: "{wanted}"'
    if is_number(wanted) and not is_number(got):
        return f"write {value_text(wanted)}, a number without quotes"
    return ""


def _given_at(package: PackageFacts, build: Run, name: str) -> tuple[FileCitation, ...]:
    """Return the lines of launch and YAML files that give this parameter a value."""
    launched = [
        one for file in package.launch_files for one in file.params if absolute_name(one.name) == name
    ]
    found = [one.place for one in launched]
    for file in (f.path for f in package.files if f.path.endswith((".yaml", ".yml"))):
        keys = [key for key in keys_of(build, file) if key.path and name.endswith(key.path)]
        found += [FileCitation(file=file, line=key.line) for key in keys]
    return tuple(dict.fromkeys(found))


def _not_there(package: PackageFacts, run: Run, names: Iterable[str], params: ParamValueParams) -> Verdict:
    near = near_names(params.name, names)
    if near:
        message = f"there is no parameter {params.name}; {there_is(near)}"
        hint = "with ~, or inside <node>, a parameter gets the node's name in front; otherwise it does not"
        node, _, key = params.name.rpartition("/")
        outside = [
            one
            for file in package.launch_files
            for one in file.params
            if absolute_name(one.name) == f"/{key}" and any(n.full_name == node for n in file.brings)
        ]
        if outside and f"/{key}" in near:
            hint = f"move the <param> on line {outside[0].line} of {outside[0].file} into the <node> {node.strip('/')}"
        for load in (one for file in package.launch_files for one in file.loads):
            rest = near[0].removeprefix(load.namespace)
            above = params.name.removesuffix(f"/{rest}")
            if rest != near[0] and above != params.name and "/" in rest:
                space = load.namespace.rstrip("/") or "/"
                goes = f"line {load.line} of {load.file} loads it into the namespace {space}"
                hint = f"{goes}, and it belongs into {above}: see which <group ns=…> the line is in"
        return failed(message, hint=hint)
    if absent := no_node(package, run, f"there is no parameter {params.name}"):
        return absent
    message = f"nothing set the parameter {params.name}, or it was deleted again"
    return failed(message, hint=f"{set_param(params.name)}, or a <param> in the launch file")
