"""Names that a rubric uses, and names in scripts and YAML files that are nearly the same."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any, Literal

from grader.model.message_definitions import constant_type, parse_definition
from grader.model.package import InterfaceField, PackageFacts
from grader.model.record import Record
from grader.model.repair import RepairKind, as_code
from grader.package.repairs.editing import Files
from grader.package.repairs.python import Name
from grader.rubric.model import Criterion, Rubric
from grader.wording import is_one_edit, plural

Doing = Literal["node-name", "publisher", "subscriber", "server", "client"]


class Wanted(Record):
    """Names as the rubric writes them, each once: topics and parameters from `/` on, paths from the package's folder
    on. `installed` are the scripts that `CMakeLists.txt` has to install, `dependencies` what the manifest has to
    declare, `types` the message types (`std_msgs/Int8`) of topics."""

    package: str
    scripts: tuple[str, ...] = ()
    launch_files: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    servers: tuple[str, ...] = ()
    """Services and actions that the package offers."""
    clients: tuple[str, ...] = ()
    """Services and actions that it asks."""
    definitions: tuple[tuple[str, tuple[InterfaceField, ...]], ...] = ()
    """Files of messages, services and actions, with the fields that they have to define."""
    constants: tuple[tuple[str, tuple[InterfaceField, ...]], ...] = ()
    """These files, with the constants that they have to define beside the fields."""
    nodes: tuple[str, ...] = ()
    plain: tuple[str, ...] = ()
    """Nodes that must not be anonymous."""
    params: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    installed: tuple[str, ...] = ()
    dependencies: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    private: tuple[str, ...] = ()
    """Private parameters that scripts are given on their command line (`_color:=red`), without the `~`."""
    remapped: tuple[str, ...] = ()
    """Topics that the command line gives another name (`state:=light`), as the scripts have to write them."""
    started: tuple[tuple[str, str], ...] = ()
    """Launch files, and the names of the scripts that each has to start."""
    launched: tuple[tuple[str, str], ...] = ()
    """Launch files, and the full names of the nodes that each has to bring up."""
    does: tuple[tuple[str, Doing, str], ...] = ()
    """Scripts that a scenario starts alone, each with a name that it has to use: of its node, a topic or a service."""


ANONYMOUS = re.compile(r",\s*anonymous\s*=\s*True\b")
NAMES_ARE = {
    **dict.fromkeys(("node-name", "node-lives"), "nodes"),
    "dependencies": "dependencies",
    **dict.fromkeys(("params-loaded", "params-read", "launch-loads"), "params"),
}
"""What the parameter `names` of a check holds."""
STARTED_BY = ("launch-xml", "launch-runs", "launch-loads")
PARAMETER_CHECKS = ("params-set", "param-value")
TOPIC_KEYS = ("topic", "asked_on")
TOPICS_OF = {
    "robot_world/robot_world": ("/scan", "/odom", "/cmd_vel"),
    "turtlesim/turtlesim_node": ("/turtle1/pose", "/turtle1/cmd_vel"),
}
"""What a program that a scenario starts has for the student's nodes: a rubric need not name it."""


def wanted_of(rubric: Rubric, package: str = "") -> Wanted:
    """Return what the rubric's scenarios and criteria name in one of its packages, the main one if none is given."""
    package = package or rubric.package
    criteria = [one for one in rubric.criteria if rubric.package_of(one) == package]
    found: dict[str, dict[str, None]] = {}
    for field, name in (*_of_scenarios(rubric, package), *_of_criteria(criteria)):
        if isinstance(name, str) and name and "*" not in name:
            found.setdefault(field, {})[name] = None
    started = dict.fromkeys(
        (c.parameters["launch"], PurePosixPath(script).name)
        for c in criteria
        if "launch" in c.parameters and c.check in STARTED_BY
        for script in (*c.parameters.get("scripts", ()), *filter(None, [c.parameters.get("script")]))
    )
    launched = (
        (c.parameters["launch"], f"/{name.lstrip('/')}")
        for c in criteria
        if c.check == "launch-runs"
        for name in c.parameters.get("nodes", ())
    )
    return Wanted(
        package=package,
        started=tuple(started),
        launched=tuple(dict.fromkeys(launched)),
        definitions=tuple(dict([*_of_steps(rubric, package), *_definitions(criteria)]).items()),
        constants=tuple(_constants(criteria)),
        does=tuple(dict.fromkeys(_of_scripts(rubric, criteria))),
        **{field: tuple(names) for field, names in found.items()},
    )


def _definitions(criteria: Iterable[Criterion]) -> Iterator[tuple[str, tuple[InterfaceField, ...]]]:
    for given in (one.parameters for one in criteria if one.check == "definition"):
        file, text = given["file"], given.get("text")
        types = dict(given.get("fields", {}))
        parts = ((*path.rpartition("."), str(kind)) for path, kind in types.items())
        named = (InterfaceField(part=part, type=kind, name=name, line=0) for part, _, name, kind in parts)
        yield file, tuple(parse_definition(text, PurePosixPath(file).suffix) if text else named)


def _constants(criteria: Iterable[Criterion]) -> Iterator[tuple[str, tuple[InterfaceField, ...]]]:
    for given in (one.parameters for one in criteria if one.check == "definition"):
        values = ((*path.rpartition("."), str(value)) for path, value in given.get("constants", {}).items())
        yield (
            given["file"],
            tuple(
                InterfaceField(part=part, type=constant_type(value), name=name, value=value, line=0)
                for part, _, name, value in values
            ),
        )


def _of_steps(rubric: Rubric, package: str) -> Iterator[tuple[str, tuple[InterfaceField, ...]]]:
    """Yield the definitions of the package's services that the grader itself calls, or offers, and of its messages that
    the grader sends."""
    for scenario in rubric.scenarios.values():
        calls = [step.call for step in scenario.steps if step.call is not None]
        sent = [step.publish for step in scenario.steps if step.publish is not None]
        named = [(one.type, one.definition, "srv") for one in (*scenario.calls, *calls)]
        named += [(one.type, one.definition, "srv") for one in scenario.serves]
        for kind, text, folder in (*named, *((one.type, one.definition, "msg") for one in sent)):
            maker, _, name = kind.partition("/")
            if text and maker == package:
                yield f"{folder}/{name}.{folder}", tuple(parse_definition(text, f".{folder}"))


def _of_scripts(rubric: Rubric, criteria: Sequence[Criterion]) -> Iterator[tuple[str, Doing, str]]:
    for key, scenario in rubric.scenarios.items():
        if len(scenario.start) != 1 or (script := scenario.start[0].script) is None:
            continue
        yield from ((script, "subscriber", probe.topic) for probe in scenario.probes)
        yield from ((script, "server", call.service) for call in scenario.calls)
        yield from ((script, "client", one.service) for one in scenario.serves if one.service)
        for one in criteria:
            if one.scenario == key and one.check == "node-name":
                yield from ((script, "node-name", name) for name in one.parameters["names"])
            elif one.scenario == key and one.check == "topic-type":
                yield script, "publisher", one.parameters["topic"]


def _of_scenarios(rubric: Rubric, package: str) -> Iterator[tuple[str, Any]]:
    for scenario in rubric.scenarios.values():
        for start in scenario.start:
            yield from _of_arguments(start.args)
            yield from _each("topics", TOPICS_OF.get(start.program or ""))
            if rubric.package_of(start) == package:
                yield from (("scripts", start.script), ("launch_files", start.launch), ("files", start.load))
        for param in scenario.params:
            yield from (("params", param.name), ("files", param.file))
            yield from _each("params", param.also)
        for probe in scenario.probes:
            yield from (("topics", probe.topic), ("types", probe.type))
        yield from (("servers", call.service) for call in scenario.calls)
        yield from (("clients", one.service or one.action) for one in scenario.serves)
        for step in scenario.steps:
            yield ("servers", step.call.service if step.call is not None else None)
            yield ("servers", step.action.name if step.action is not None else None)
            sent, waited = step.published, step.wait
            yield from (("topics", sent.topic), ("types", sent.type)) if sent is not None else ()
            yield ("topics", waited.topic if waited is not None else None)
            yield ("params", step.set_param.name if step.set_param is not None else None)
        until = scenario.until
        yield from _each("topics", (*until.topics, *until.messages, *until.connected))


def _of_arguments(args: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield what a command line sets and renames: `_color:=red`, `state:=light`."""
    for name, assigned, _ in (str(arg).partition(":=") for arg in args):
        if assigned and not name.startswith("__"):
            yield ("private", name[1:]) if name.startswith("_") else ("remapped", name)


def _of_criteria(criteria: Iterable[Criterion]) -> Iterator[tuple[str, Any]]:
    for criterion in criteria:
        check, given = criterion.check, criterion.parameters
        yield from (("launch_files", given.get("launch")), ("files", given.get("file")))
        yield from (("topics", topic) for topic in _topics_in(given))
        yield ("clients" if check == "calls" else "servers", given.get("service") or given.get("action"))
        yield ("types", given.get("type") if "topic" in given else None)
        yield from _each("topics", given.get("topics"))
        yield from _each("files", given.get("files"))
        yield from _each("dependencies", given.get("dependencies"))
        yield from _each("installed" if check == "cmake-install" else "scripts", given.get("scripts"))
        yield from (("scripts", given.get("script")), ("scripts", given.get("path")))
        yield from _each(NAMES_ARE.get(check, ""), given.get("names"))
        yield from _each("plain" if given.get("anonymous") == "forbidden" else "", given.get("names"))
        if check in PARAMETER_CHECKS:
            yield "params", given.get("name")
            yield from _each("params", given.get("unchanged"))


def _topics_in(given: Any) -> Iterator[Any]:  # noqa: ANN401 - as an instructor wrote it
    """Yield the topics that a check's parameters name, at any depth."""
    if isinstance(given, dict):
        yield from (given[key] for key in TOPIC_KEYS if key in given)
        for value in given.values():
            yield from _topics_in(value)


def _each(field: str, names: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - as an instructor wrote it
    if field and isinstance(names, list | tuple | dict):
        yield from ((field, name) for name in names)


# ---- names that are nearly right


def is_near(name: str, wanted: str) -> bool:
    """Return whether `name` is a slip of `wanted`: one letter, capitals, a leading slash, or no `.msg` behind it."""
    if name == wanted or min(len(name), len(wanted)) < SHORTEST:
        return False
    one, other = (text.casefold().lstrip("/~") for text in (name, wanted))
    return (
        one == other
        or is_one_edit(one, other)
        or other in {f"{one}{end}" for end in (".msg", ".srv", ".action")}
    )


SHORTEST = 3
"""Shorter names differ by one letter because they are different names."""


KINDS: dict[str, RepairKind] = {
    **dict.fromkeys(("publisher", "subscriber"), "topic-name"),
    **dict.fromkeys(("server", "client"), "service-name"),
    "node": "node-name",
    **dict.fromkeys(("param", "set-param", "key"), "parameter-name"),
}
TOPIC_ROLES = frozenset({"publisher", "subscriber"})
ROLES = ("node", "publisher", "subscriber", "server", "client", "param", "set-param")
WORDS = {"topic-name": "topic", "service-name": "service", "node-name": "node", "parameter-name": "parameter"}
_KEY = re.compile(r"^(?P<indent> *)(?P<quote>[\"']?)(?P<key>[A-Za-z_][\w-]*:?)(?P=quote)(?=\s*:(\s|$))")


def _called(name: Name, lines: Sequence[str]) -> str:
    """Return what the name is a name of, in words."""
    kind = KINDS[name.role]
    of_action = kind == "service-name" and re.search(r"Action(Server|Client)\b", lines[name.line - 1])
    return "action" if of_action else WORDS[kind]


def repair_script_names(
    files: Files, file: str, names: Sequence[Name], wanted: Wanted, others: Collection[str] = ()
) -> None:
    """Find the literals of a script that are slips of what the lab asks for, where it asks for nothing else there. What
    other scripts call their nodes (`others`) is not meant."""
    node = next((name.value.strip("/") for name in names if name.role == "node"), "") or _name_node(
        files, file, wanted
    )
    names = [name for name in names if not _repair_slash(files, file, name, wanted)]
    wanted = wanted.model_copy(update={"params": (*wanted.params, *(f"/{node}/{p}" for p in wanted.private))})
    asked_of = {
        "node": wanted.nodes,
        **dict.fromkeys(TOPIC_ROLES, wanted.topics),
        "server": wanted.servers,
        "client": wanted.clients,
    }
    branches = [f"/{'/'.join(branch)}" for branch in _branches(wanted)]
    names = _repair_dots(files, file, names, branches)
    names = _repair_whole_names(files, file, names, node, wanted)
    done = set[Name]()  # with another of the same name
    for role in ROLES:
        asked = asked_of.get(role, branches)
        given = [name for name in names if name.role == role and name not in done]
        # of a topic that the script has too, one of nearly the name is another one
        alike_roles = TOPIC_ROLES if role in TOPIC_ROLES else {role}
        used = {_resolve(name, node) for name in names if name.role in alike_roles}
        absent = [w for w in asked if _bare(w, role) not in used]
        absent = [w for w in absent if not _is_of_other_role(file, role, w, wanted)]
        absent = [w for w in absent if role != "node" or w.strip("/") not in others]
        for name in dict.fromkeys(given):
            near = (w for w in absent if _is_slip(name, w, node) and _has_keys(w, name.keys, branches))
            right = next(near, "") or _elsewhere(name, given, absent, node)
            alike = {_resolve(one, node) for one in given if right and _is_slip(one, right, node)}
            if role in TOPIC_ROLES and len(alike) > 1:
                continue  # any of them may be meant, or none
            if right and name not in done and _resolve(name, node) not in {_bare(w, role) for w in asked}:
                literal = _literal(name, right, node)
                shown = literal if literal.startswith("~") else right
                same = [one for one in dict.fromkeys(names) if _is_same(one, name)]
                if len(same) > 1:  # waited for, and called; read, and set
                    _replace_all(files, file, dict.fromkeys(same, literal), shown)
                    done |= {*same}
                    continue
                _replace_literal(files, file, name, literal, shown, plain=right in wanted.plain)
                node = literal if role == "node" else node


def _elsewhere(name: Name, given: Iterable[Name], absent: Iterable[str], node: str) -> str:
    """Return the one name that is asked for and is written in another place, or order; "" where any may be meant."""
    if KINDS[name.role] not in {"topic-name", "service-name"} or not name.value.startswith("/"):
        return ""
    alike = [one for one in absent if _is_moved(_resolve(name, node), one)]
    found = [one for one in alike if one.count("/") == min(each.count("/") for each in alike)]
    own = {_resolve(one, node) for one in given}
    return found[0] if len(found) == 1 and sum(_is_moved(one, found[0]) for one in own) == 1 else ""


def _is_moved(name: str, wanted: str) -> bool:
    """Return whether the names end alike, or have the same words: `/robot/cmd_vel` for `/cmd_vel`, `/open_gate`."""
    words, asked = (sorted(re.findall(r"[a-z0-9]+", one.lower())) for one in (name, wanted))
    return words == asked or name.rpartition("/")[2] == wanted.rpartition("/")[2]


def _is_same(one: Name, other: Name) -> bool:
    """Return whether both stand for one service that is asked, or one parameter, and are written alike."""
    of_both = {KINDS[one.role], KINDS[other.role]} == {"parameter-name"} or one.role == other.role == "client"
    return of_both and "key" not in (one.role, other.role) and one.value == other.value


def _repair_whole_names(
    files: Files, file: str, names: Sequence[Name], node: str, wanted: Wanted
) -> list[Name]:
    """Find the node's own parameters that are written with its name in front, `/lamp/color`, which is right for no
    other name or namespace, and return the other names."""
    whole = {f"/{node}/{own}": f"~{own}" for own in wanted.private}
    found = {
        name: whole[name.value]
        for name in names
        if KINDS[name.role] == "parameter-name" and name.value in whole
    }
    for value in dict.fromkeys(name.value for name in found):
        _replace_all(files, file, {n: to for n, to in found.items() if n.value == value}, whole[value])
    return [name for name in names if name not in found]


def _name_node(files: Files, file: str, wanted: Wanted) -> str:
    """Give `init_node()` the lab's name that the script has too, and return it; "" where it needs none."""
    text, name = files.text(file) or "", PurePosixPath(file).stem
    found = re.search(r"(?<=\binit_node\()\s*(?=\))", text)
    if found is None or name not in [one.strip("/") for one in wanted.nodes]:
        return ""
    after = f"{text[: found.start()]}'{name}'{text[found.end() :]}"
    line = text.count("\n", 0, found.start()) + 1
    files.change("missing-call", file, after, f"line {line} of {file}: the node has no name")
    return name


def _is_of_other_role(file: str, role: str, topic: str, wanted: Wanted) -> bool:
    """Return whether the script has to subscribe to the topic and this is a publisher, or the other way round."""
    name = PurePosixPath(file).name
    kinds = {kind for path, kind, used in wanted.does if used == topic and PurePosixPath(path).name == name}
    return role in TOPIC_ROLES and bool(kinds & TOPIC_ROLES) and role not in kinds


def _repair_dots(files: Files, file: str, names: Sequence[Name], branches: Sequence[str]) -> list[Name]:
    """Find the parameters whose parts are written with dots between them, all as one repair, and return the others."""
    meant = {}
    for name in names:
        whole = f"/{name.value.strip('/').replace('.', '/')}"
        if KINDS[name.role] == "parameter-name" and "." in name.value and whole in branches:
            above = (w for w in (whole, *_above(whole)) if _has_keys(w, name.keys, branches))
            meant[name] = next(above, "")
    wrong = [name for name, right in meant.items() if right]
    if files.text(file) is None or not wrong:
        return list(names)
    right = {name: meant[name] if name.value.startswith("/") else meant[name].strip("/") for name in wrong}
    _replace_all(files, file, right, meant[wrong[0]])
    return [name for name in names if name not in wrong]


def _replace_all(files: Files, file: str, written: Mapping[Name, str], right: str) -> None:
    """Replace several literals as one repair, told by the first of them."""
    lines = (files.text(file) or "").split("\n")
    for name in sorted(written, key=lambda one: -one.start):
        line = lines[name.line - 1]
        lines[name.line - 1] = line[: name.start] + line[name.start :].replace(name.value, written[name], 1)
    first, numbers = next(iter(written)), sorted({name.line for name in written})
    each = [f"write {as_code(lines[n - 1].strip())}" for n in numbers]
    more = [f"on line {n}, {one}" for n, one in zip(numbers[1:], each[1:], strict=True)]
    kind = KINDS[first.role]
    told = f"line {first.line} of {file}: the {_called(first, lines)} {first.value} should be {right}"
    files.change(kind, file, "\n".join(lines), told, "; ".join([each[0], *more]) if more else "")


def _above(param: str) -> Iterator[str]:
    """Yield what a parameter lies below, the nearest first."""
    yield from (str(path) for path in PurePosixPath(param).parents if str(path) != "/")


def _has_keys(param: str, keys: Sequence[str], branches: Sequence[str]) -> bool:
    """Return whether the lab's parameters below this one are all that a script reads of it."""
    return all(f"{param}/{key}" in branches for key in keys)


def repair_script_keys(
    files: Files, package: PackageFacts, file: str, names: Sequence[Name], wanted: Wanted
) -> None:
    """Find the keys in `details['name']['First']` that differ from a part of the lab's parameters by capitals or a
    letter, where the script has no other key for that part, or no file and no other line of it has that key."""
    parts = dict.fromkeys(part for branch in _branches(wanted) for part in branch)
    used = {name.value for name in names}
    of_files = "\n".join(files.text(one.path) or "" for one in package.files if one.path.endswith(YAML))
    for name in dict.fromkeys(one for one in names if one.role == "key" and one.value not in parts):
        word = re.compile(rf"\b{re.escape(name.value)}\b")
        is_slip = len(word.findall(files.text(file) or "")) == 1 and not word.search(of_files)
        near = [part for part in parts if is_near(name.value, part)]
        near = [part for part in near if part not in used or (is_slip and f"{part}:" in of_files)]
        if len(near) == 1:
            _replace_literal(files, file, name, near[0], near[0])


YAML = (".yaml", ".yml")
CPP = (".c", ".cc", ".cpp", ".cxx", ".h", ".hpp")
ROLES_OF_CPP: dict[str, Literal["publisher", "subscriber", "server", "client", "node"]] = {
    "advertise": "publisher",
    "subscribe": "subscriber",
    "advertiseService": "server",
    "serviceClient": "client",
    "init": "node",
}
_NAMED_IN_CPP = re.compile(
    r'\b(?P<call>advertiseService|serviceClient|advertise|subscribe|init)\b\s*(?:<[^;()]*>)?\s*\(\s*(?:\w+\s*,\s*\w+\s*,\s*)?"(?P<name>[^"\\]{1,200})"'
)


def names_in_cpp(text: str) -> tuple[Name, ...]:
    """Return the texts in a source of C++ that name its node and its topics; what stands in a comment is none."""
    # a call may be spread over several lines
    code = "\n".join(
        " " * len(line) if len(line) > CPP_CHARS_MAX or line.lstrip().startswith(("//", "*")) else line
        for line in text.split("\n")
    )
    return tuple(
        Name(
            role=ROLES_OF_CPP[found["call"]],
            value=found["name"],
            line=code.count("\n", 0, found.start("name")) + 1,
            start=found.start("name") - begin,
            end=found.end("name") - begin,
        )
        for found in _NAMED_IN_CPP.finditer(code)
        for begin in (code.rfind("\n", 0, found.start("name")) + 1,)
    )


CPP_CHARS_MAX = 500


def names_remapped(package: PackageFacts) -> tuple[str, ...]:
    """Return the topics that launch files rename in a namespace, as scripts have to write them: without a slash."""
    nodes = (node for launch in package.launch_files for node in launch.brings if node.namespace != "/")
    return tuple(dict.fromkeys(old for node in nodes for old, _ in node.remaps if not old.startswith("/")))


def _repair_slash(files: Files, file: str, name: Name, wanted: Wanted) -> bool:
    """Find a topic that is written with a slash, which keeps it from being renamed as the lab asks."""
    relative = name.value.lstrip("/")
    if KINDS[name.role] != "topic-name" or name.value == relative or relative not in wanted.remapped:
        return False
    _replace_literal(files, file, name, relative, f"{relative}, without the slash")
    return True


def _bare(name: str, role: str) -> str:
    return name.strip("/") if role == "node" else f"/{name.lstrip('/')}"


def _resolve(name: Name, node: str) -> str:
    """Return the whole name, as ROS resolves it for a node in the root namespace."""
    if name.role == "node":
        return name.value  # with a slash, it is no name
    if name.value.startswith("~"):
        return f"/{node}/{name.value[1:].lstrip('/')}"
    return f"/{name.value.lstrip('/')}"


def _is_slip(name: Name, right: str, node: str) -> bool:
    resolved, bare = _resolve(name, node), _bare(right, name.role)
    astray = resolved != bare and name.value.lstrip("/~") == bare.lstrip("/")
    if name.role != "node" and name.value.lstrip("/") == bare.removeprefix(f"/{node.strip('/')}/"):
        return True  # `color` for `~color`
    return is_near(resolved, bare) or astray


def _literal(name: Name, right: str, node: str) -> str:
    """Return the right name in the way that the wrong one is written: relative, private, or whole."""
    own = f"/{node.strip('/')}/"
    if name.role == "node":
        return right.strip("/")
    if node and right.startswith(own):
        return f"~{right.removeprefix(own)}"
    whole = name.value.startswith("/") or (name.role == "param" and name.value.startswith("~"))
    return right if whole else right.lstrip("/")  # relative, so that the node stays in its namespace


def _replace_literal(
    files: Files, file: str, name: Name, value: str, right: str, *, plain: bool = False
) -> None:
    """Replace the literal; where an earlier replacement has moved it, it is found by its value. A node that is `plain`
    is not anonymous any more."""
    text = files.text(file)
    if text is None:
        return
    lines = text.split("\n")
    line = lines[name.line - 1]
    found = [at for at in (line.find(name.value, name.start), line.find(name.value)) if at >= 0]
    if not found:
        return
    at = found[0]
    line = line[:at] + value + line[at + len(name.value) :]
    lines[name.line - 1] = ANONYMOUS.sub("", line) if plain and name.role == "node" else line
    kind = KINDS[name.role]
    message = f"line {name.line} of {file}: the {_called(name, lines)} {name.value} should be {right}"
    files.change(kind, file, "\n".join(lines), message)


def _branches(wanted: Wanted) -> Iterator[tuple[str, ...]]:
    """Yield the lab's parameters, and all that they lie below, by their parts."""
    for param in wanted.params:
        parts = param.strip("/").split("/")
        yield from (tuple(parts[:length]) for length in range(len(parts), 0, -1))


# ---- YAML files


def repair_yaml_names(
    files: Files, package: PackageFacts, scripts: dict[str, tuple[Name, ...]], wanted: Wanted
) -> None:
    """Find keys of parameter files that are slips of the lab's parameters, and the scripts that read them so."""
    branches = set(_branches(wanted))
    names = {PurePosixPath(file).name for file in wanted.files}
    keys = [(script, name) for script, used in scripts.items() for name in used if name.role == "key"]
    paths = (f.path for f in package.files if f.path.endswith(YAML))
    for file in (path for path in paths if PurePosixPath(path).name in names):
        _indent_keys(files, file, branches)
        for old, new in _repair_keys(files, file, branches):
            for script, name in (pair for pair in keys if pair[1].value == old):
                _replace_literal(files, script, name, new, new)


def _repair_keys(files: Files, file: str, branches: set[tuple[str, ...]]) -> Iterator[tuple[str, str]]:
    text = files.text(file)
    keys = list(_keys(text)) if text else []
    there = {path for _, path in keys}
    for number, path in keys:
        absent = sorted(b for b in branches if b not in there and b[:-1] == path[:-1])
        right = next((b[-1] for b in absent if path not in branches and is_near(path[-1], b[-1])), "")
        text = files.text(file)
        if not right or text is None:
            continue
        lines = text.split("\n")
        lines[number] = _KEY.sub(rf"\g<indent>\g<quote>{right}\g<quote>", lines[number])
        message = f"line {number + 1} of {file}: the key {path[-1]} should be {right}"
        files.change("parameter-name", file, "\n".join(lines), message)
        there.add((*path[:-1], right))
        yield path[-1], right


def _indent_keys(files: Files, file: str, branches: set[tuple[str, ...]]) -> None:
    """Move a key that stands one level too far to the left, right behind the block that it belongs to, into it."""
    text = files.text(file)
    keys = list(_keys(text)) if text else []
    there = {path for _, path in keys}
    for at, (number, path) in enumerate(keys):
        meant = [b for b in branches - there if len(b) > 2 and (*b[:-2], b[-1]) == path and b[:-1] in there]
        block = [n for n, other in keys[:at] if other[:-1] == meant[0][:-1]] if len(meant) == 1 else []
        text = files.text(file)
        if path in branches or not block or keys[at - 1][1][: len(meant[0]) - 1] != meant[0][:-1] or not text:
            continue
        lines = text.split("\n")
        right = lines[block[0]][: len(lines[block[0]]) - len(lines[block[0]].lstrip())]
        if not lines[number].rstrip().endswith(":"):
            lines[number] = right + lines[number].lstrip()
            why = f"{path[-1]} stands beside {meant[0][-2]}, and not below it"
            message, fix = (
                f"line {number + 1} of {file}: {why}",
                f"indent it by {plural(len(right), 'space')}",
            )
            files.change("parameter-name", file, "\n".join(lines), message, fix)
            there.add(meant[0])


def _keys(text: str) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Yield the line (from 0) and the whole path of each key of a block of YAML, by its indentation."""
    above: list[tuple[int, str]] = []
    for number, line in enumerate(text.split("\n")):
        found = _KEY.match(line)
        if found:
            depth = len(found["indent"])
            above = [(d, key) for d, key in above if d < depth]
            above.append((depth, found["key"]))
            yield number, tuple(key for _, key in above)
