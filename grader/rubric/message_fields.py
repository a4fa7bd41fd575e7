"""What a rubric says of the fields of messages, against the definitions of their types."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any

from grader.checks.support.fields import is_number
from grader.evidence.definitions import Field
from grader.installable import noetic_messages
from grader.model.message_definitions import (
    BUILT_IN,
    FULL_NAMES,
    PARTS,
    integer_limits,
    other_fields,
    parse_definition,
    parse_interface,
)
from grader.ros_env import ros_packages
from grader.rubric.definitions import (
    SUFFIXES,
    Definitions,
    Misfit,
    Shape,
    instead_of,
    no_name,
    no_value,
    own_texts,
    slip_of,
)
from grader.rubric.simulators import topics_of_programs
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_list,
    as_map,
    as_maps,
    given_steps,
    items_in,
    published_in,
    services_in,
)
from grader.wording import did_you_mean, join_words

USUAL_PACKAGES = ("std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs")
USUAL_TYPES = {"cmd_vel": "geometry_msgs/Twist", "odom": "nav_msgs/Odometry", "scan": "sensor_msgs/LaserScan"}
"""Of topics whose type a rubric does not say, most often: a name that is all but one of a field's is a slip."""
SYSTEM_TYPES = {
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "/rosout": "rosgraph_msgs/Log",
    "/rosout_agg": "rosgraph_msgs/Log",
    "/clock": "rosgraph_msgs/Clock",
}
POSES = (
    "nav_msgs/Odometry",
    "geometry_msgs/Pose",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovariance",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/Pose2D",
    "turtlesim/Pose",
)
"""Types of which a pose can be read, odometry before all others."""
VELOCITIES = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
PLACES = frozenset({"ends-at", "path", "stays-within"})
"""Checks of where a robot is."""
COUNTERS = frozenset({"counter-start", "counter-step", "counter-wrap"})
COUNTED = ("start", "minimum", "maximum")
"""Of counters, the values that their field has."""
STAMPED = "is_stamp"
"""Beside what a criterion says: its field has to be a stamp."""
_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")


def field_faults(rubric: WrittenRubric, known: Definitions) -> Iterator[Fault]:
    """Yield fields that are not there, and values that they can never have."""
    yield from _no_types(rubric, known)
    yield from _two_definitions(rubric)
    yield from _quoted_params(rubric)
    # Told only where the type of the topic shows nothing wrong: it says more, and which of the two it is.
    other_kinds = list(_other_kinds(rubric))
    for criterion in rubric.criteria:
        path, given = criterion.at, criterion.given
        if criterion.check == "stamps":
            given = {"field": "header", STAMPED: True, **given}
        judged = list(_judged_fields(path, given, known, rubric, criterion.scenario))
        yield from judged or (one for one in other_kinds if one[0][: len(path)] == path)
        if criterion.check in PLACES:
            yield from _no_place(criterion, rubric)
        if criterion.check == "topic-type":
            yield from _other_type(criterion, rubric)
        if criterion.check in COUNTERS:
            yield from _counted(criterion, known, rubric)
        yield from _expected(criterion, known)
        yield from _reported(criterion, known)
        yield from _other_size(criterion, rubric)
        yield from _other_definitions(criterion, known, rubric)
    yield from _other_depths(rubric)
    for name, scenario in rubric.scenarios.items():
        yield from ((("scenarios", name, *at), fault) for at, fault in _sent_fields(scenario, known))


def _other_depths(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield fields of a topic that are elsewhere in the rubric without what is before them, where no type is known:
    `twist.linear.x` and `linear.x`."""
    found: dict[str, list[tuple[KeyPath, str]]] = defaultdict(list)
    for criterion in rubric.criteria:
        for path, given in _maps_in(criterion.at, criterion.given):
            topic, field = given.get("topic"), given.get("field")
            if not isinstance(topic, str) or not isinstance(field, str):
                continue
            if next(types_of(topic, rubric, criterion.scenario), None) is None:
                found[topic].append(((*path, "field"), field))
    for topic, fields in found.items():
        counts = Counter(field for _, field in fields)
        for path, field in fields:
            near = [other for other in counts if other.endswith(f".{field}") or field.endswith(f".{other}")]
            if near and counts[near[0]] > counts[field]:
                yield path, f"elsewhere in the rubric this field of {topic} is {near[0]}"


def _maps_in(path: KeyPath, value: object) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    if isinstance(value, dict):
        yield path, value
    for key, inner in items_in(value):
        yield from _maps_in((*path, key), inner)


def _other_size(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield the cells of a map that are not as many as its width and height say, while those of another one are."""
    topic, cells = criterion.given.get("topic"), criterion.given.get("value")
    same = [
        one.given for one in rubric.criteria if one.run == criterion.run and one.given.get("topic") == topic
    ]
    sizes = [
        [one.get("value") for one in same if one.get("field") == f"info.{side}"]
        for side in ("width", "height")
    ]
    # A map may grow.
    width, height = (side[0] if side and side.count(side[0]) == len(side) else None for side in sizes)
    counts = [len(as_list(one.get("value"))) for one in same if one.get("field") == "data"]
    if not isinstance(width, int) or not isinstance(height, int) or width * height not in counts:
        return
    if criterion.given.get("field") == "data" and isinstance(cells, list) and len(cells) != width * height:
        yield (
            (*criterion.at, "value"),
            f"has {len(cells)} cells, and a map of {width} by {height} has {width * height}",
        )


def _no_types(rubric: WrittenRubric, known: Definitions) -> Iterator[Fault]:
    """Yield types of fields in the rubric's definitions that there are not, or not without their package."""
    for path, type_ in rubric.texts:
        package, _, name = type_.partition("/")
        there = [one.partition("/")[2] for one in known.of_course if one.startswith(f"{package}/")]
        if path[-1] == "type" and there and name and name not in there:
            yield path, f'{package} has no type "{name}"{did_you_mean(name, there)}'
    for path, type_, suffix, own in own_texts(rubric):
        package = type_.partition("/")[0]
        messages = known.messages_of(package)
        for one in parse_interface(own.text.encode(), f"definition{suffix}").fields:
            kind = one.type.partition("[")[0]
            at = path if own.whole else (*path, one.path)
            if "/" in kind:
                fault = ros_packages().type_fault(kind, "msg", rubric.own_packages) if own.whole else ""
            elif kind.islower() or kind in {*BUILT_IN, *FULL_NAMES, *messages}:
                fault = ""  # one that is none is said where it stands
            else:
                fault = _no_type(kind, package, messages)
            if fault:
                yield at, fault


def _no_type(kind: str, package: str, messages: set[str]) -> str:
    """Return why a type without a package is none of the package's own; empty where it may be."""
    if near := slip_of(kind, [*FULL_NAMES, *messages, *sorted(BUILT_IN)]):
        return f'there is no type "{kind}" (did you mean "{near}"?)'
    owner = next((name for name in USUAL_PACKAGES if kind in noetic_messages().get(name, ())), "")
    instead = f"write {owner}/{kind}, or {package}/{kind} for the package's own"
    return f'"{kind}" without a package is one of {package}: {instead}' if owner else ""


def _judged_fields(
    path: KeyPath, given: dict[str, Any], known: Definitions, rubric: WrittenRubric, scenario: dict[str, Any]
) -> Iterator[Fault]:
    """Yield fields that no type of the topic has, and bounds and values that such a field never has."""
    topic = given.get("topic")
    if isinstance(topic, str):
        types = sorted({kind for kind in types_of(topic, rubric, scenario) if isinstance(kind, str)})
        named: list[tuple[KeyPath, object]] = [(("field",), given["field"])] if "field" in given else []
        named += [(("fields", key), one) for key, one in as_map(given.get("fields")).items()]
        for at, field in named:
            faults = [_no_such(shape, field, given) if (shape := known.shape(kind)) else "" for kind in types]
            usual = USUAL_TYPES.get(topic.rpartition("/")[2])
            if not faults and usual and (shape := known.shape(usual)):
                values: dict[str, Any] = {key: given[key] for key in given if key in {"value", "values"}}
                # As if only some fields were known: the topic may have another type, so only a near miss is a fault.
                faults = [_no_such(shape._replace(partial=frozenset(shape.types)), field, values)]
            if isinstance(field, str) and faults and all(faults):
                yield (*path, *at), faults[0]
        quoted = [one for key in ("value", "values") for one in _quoted((*path, key), given.get(key), topic)]
        if quoted and "tolerance" not in given:
            is_known = any(_has_field(known.shape(kind), given.get("field")) for kind in types)
            # With a known type, the misfit of the value is told already.
            yield from () if is_known else quoted
    for key, inner in given.items():
        if isinstance(inner, dict):
            yield from _judged_fields((*path, key), inner, known, rubric, scenario)


def _no_place(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield topics of which no place of a robot can be read."""
    given = criterion.given
    types = {str(kind) for kind in types_of(str(given.get("topic")), rubric, criterion.scenario)}
    are_known = types and all(kind.partition("/")[0] in noetic_messages() for kind in types)
    if are_known and "fields" not in given and types.isdisjoint({*POSES, *VELOCITIES}):
        fault = f"{given['topic']} carries {min(types)}, which has neither a pose nor a velocity"
        yield (*criterion.at, "topic"), fault


def _counted(criterion: WrittenCriterion, known: Definitions, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield fields that cannot count, and values of a counter that its field never has."""
    at, given = criterion.at, criterion.given
    name = str(given.get("field", "data"))
    types = sorted({str(kind) for kind in types_of(str(given.get("topic")), rubric)})
    shapes = [known.shape(kind) for kind in types]
    if "field" not in given and shapes and all(shape and _lacks(shape, name) for shape in shapes):
        yield (*at, "topic"), f"{types[0]} has no field data: say which field counts (field)"
    found = [shape.field_at(name) for shape in shapes if shape and _has_field(shape, name, said=False)]
    kinds = [field.type for field in found if field]
    if "field" in given and kinds and not any(integer_limits(kind) or "float" in kind for kind in kinds):
        yield (*at, "field"), f"{name} of {types[0]} is {kinds[0]}, which counts nothing"
    for key in COUNTED if len(kinds) == len(types) else ():
        wrong = [no_value(kind, given[key]) for kind in kinds if key in given and integer_limits(kind)]
        if wrong and all(wrong):
            yield (*at, key), f"{name} of {types[0]} {wrong[0]}"


def _lacks(shape: Shape, name: str) -> bool:
    return name not in {one.name for one in shape.types[shape.root.type]}


def _has_field(shape: Shape | None, path: object, *, said: bool = True) -> bool:
    """Return whether it has the field; `said` for one that it cannot have, which is a fault of its own."""
    try:
        return shape is not None and shape.field_at(str(path)) is not None
    except Misfit:
        return said


def _quoted(path: KeyPath, value: object, topic: str = "", *, are_fields: bool = False) -> Iterator[Fault]:
    """Yield truth values in quotes where nothing is known of the type; of a topic's field, numbers too. Of a map of
    fields, yield names that no field has."""
    if isinstance(value, str) and value.lower() in {"true", "false"}:
        yield path, f'"{value}" in quotes is text: write {value.lower()}{_or_type(topic)}'
    elif isinstance(value, str) and topic and _NUMBER.fullmatch(value):
        yield path, f'"{value}" in quotes is text: write {value}{_or_type(topic)}'
    for key, one in items_in(value):
        if are_fields and (fault := no_name(str(key))):
            yield path, fault
        yield from _quoted((*path, key), one, topic, are_fields=are_fields)


def _or_type(topic: str) -> str:
    return f", or give {topic} its type in a criterion with topic-type" if topic else ""


def _quoted_params(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield values of parameters in quotes that are meant as a truth value, or that are numbers elsewhere."""
    given = [((*at, "value"), one.get("name"), one.get("value")) for at, one in rubric.params()]
    for criterion in rubric.criteria:
        at, asked = criterion.at, criterion.given
        if criterion.check in {"param-value", "params-set"}:
            given.append(((*at, "value"), asked.get("name"), asked.get("value")))
        elif criterion.check == "launch-runs":
            written = [((*at, "params", key), key, one) for key, one in as_map(asked.get("params")).items()]
            given += written
            for path, _, one in written:
                if isinstance(one, str) and _NUMBER.fullmatch(one):
                    yield path, f'"{one}" in quotes is text, and roslaunch reads a number: write {one}'
    # `/node/rate` and `node/rate` are one parameter.
    numbers = {str(name).strip("/") for _, name, value in given if is_number(value)}
    for at, param, value in given:
        yield from _quoted(at, value)
        if isinstance(value, bool) and str(param).strip("/") in numbers:
            yield at, f"is true or false, and elsewhere {param} is a number"
        if isinstance(value, str) and _NUMBER.fullmatch(value) and str(param).strip("/") in numbers:
            yield at, f'"{value}" in quotes is text, and elsewhere {param} is a number: write {value}'


def _other_kinds(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield values of a field that are of another kind than those which earlier criteria ask for in it."""
    first: dict[tuple[str, str], tuple[str, str]] = {}
    for criterion in rubric.criteria:
        for at, asked in criterion.conditions:
            for key in ("value", "min", "max"):
                kind, place = _kind_of(asked.get(key)), (str(asked.get("topic")), str(asked.get("field")))
                if kind and "field" in asked and "*" not in place[1]:
                    earlier, other = first.setdefault(place, (criterion.id, kind))
                    if other != kind:
                        fault = f"is {kind}, and {earlier} has {other} for {place[1]} of {place[0]}"
                        yield (*at, key), fault


def _kind_of(value: object) -> str:
    """Return what kind of a value it is, in words; "" for none, and for one that is made up."""
    if isinstance(value, dict) and value.keys() == {"made_up"}:
        return ""
    kinds = {
        bool: "true or false",
        int: "a number",
        float: "a number",
        str: "a text",
        list: "a list",
        dict: "a map",
    }
    return kinds.get(type(value), "")


def _other_type(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield a type that a topic has not elsewhere in the rubric: two types on one topic are never connected."""
    topic, kind, own = criterion.given.get("topic"), str(criterion.given.get("type")), rubric.own_packages
    there = {str(one) for one in (kind, *types_of(str(topic), rubric))}
    there = {one for one in there if not ros_packages().type_fault(one, "msg", own)}
    others = sorted(there - {kind})
    if isinstance(topic, str) and kind in there and others:
        fault = f"elsewhere in the rubric {topic} carries {join_words(others)}, not {kind}"
        yield (*criterion.at, "type"), fault


def _no_such(shape: Shape, path: object, given: dict[str, Any]) -> str:
    values = given.get("values")
    judged = [given.get("value"), *(values if isinstance(values, list) else ())]
    try:
        field = shape.field_at(str(path))
        if field is None:
            return ""
        for value in judged:
            is_each = isinstance(value, list) and "[*]" in str(path) and not field.array
            for one in value if is_each else () if value is None else (value,):
                shape.compare(field, one, str(path))
    except Misfit as error:
        return str(error)
    return _no_bounds(field, given, f"{path} of {shape.what} is")


def _no_bounds(field: Field, given: dict[str, Any], what: str) -> str:
    """Return why a field is not a stamp, or is never within the bounds."""
    if STAMPED in given and field.type not in {"std_msgs/Header", "time"}:
        return f"{what} {field.type}, neither a Header nor a time"
    bounds = {key: given[key] for key in ("min", "max") if isinstance(given.get(key), int | float)}
    if not bounds:
        return ""
    if field.array:
        return f"{what} a list: name one item with [0], or all with [*]"
    if field.type == "string" or not field.primitive:
        return f"{what} {field.type}, and bounds are for numbers"
    low, high = integer_limits(field.type) or (-math.inf, math.inf)
    if bounds.get("min", low) > high or bounds.get("max", high) < low:
        return f"{what} {field.type}, {low} to {high}: none of these is within the bounds"
    return ""


def types_of(topic: str, rubric: WrittenRubric, run: dict[str, Any] | None = None) -> Iterator[object]:
    """Yield the types that the rubric gives a topic: those that it sends there or asks for, and that of a program of
    the run."""
    yield from (SYSTEM_TYPES[topic],) if topic in SYSTEM_TYPES else ()
    programs = topics_of_programs(run or {})
    yield from (programs[topic],) if topic in programs else ()
    for criterion in rubric.criteria:
        if criterion.check == "topic-type" and criterion.given.get("topic") == topic:
            yield criterion.given.get("type")
        left = as_map(as_map(criterion.given.get("topics")).get(topic)).get("type")
        yield from (left,) if left else ()
    yield from said_types(topic, rubric.handout)
    for scenario in rubric.scenarios.values():
        yield from (one.get("type") for one in published_in(scenario) if one.get("topic") == topic)


def said_types(topic: str, handout: str, *, of_service: bool = False) -> Iterator[str]:
    """Yield the types of ROS's that the handout says the topic, or the service, has: `/scan, a sensor_msgs/LaserScan`,
    or `a geometry_msgs/Twist on /cmd_vel`."""
    name, kind, tick = re.escape(topic), r"(\w+)/([A-Z]\w*)", "`?"
    of_other = (
        rf"(?!\w|{tick}(?:\s+messages?)?\s+(?:on|to)\s+{tick}/)"  # "/level as a std_msgs/Bool on /full"
    )
    after = rf"{tick}{name}{tick}(?![\w/])[\s,:(]*(?:(?:an?|as|of type)\s+)*{tick}{kind}{of_other}"
    before = rf"{kind}{tick}(?:\s+messages?)?\s+on\s+(?:the\s+topic\s+)?{tick}{name}{tick}(?![\w/])"
    for pattern in (rf"(?<![\w/]){after}", before):
        for package, message in re.findall(pattern, handout) if topic.startswith("/") else ():
            if of_service != (message in noetic_messages().get(package, ())):
                yield f"{package}/{message}"


def _asked(
    check: str, given: dict[str, Any], scenario: dict[str, Any]
) -> tuple[str, dict[str, Any] | None, bool]:
    """Return the part of a service or action that a criterion judges, what the scenario says of that, None where it
    has nothing of the name, and whether it is an action."""
    part = {"calls": "request", "service-answers": "response", "action-result": "result"}.get(check, "")
    name = given.get("action" if part == "result" else "service")
    services = [(one.get("service"), one) for _, _, one in services_in(scenario)]
    offered = [one for _, one in as_maps(scenario.get("serves")) if one.get("action")]
    of_actions = [*given_steps(scenario, "action"), *offered]
    actions = [(one.get("name") or one.get("action"), one) for one in of_actions]
    of_action = part == "request" and any(name == called for called, _ in actions)
    about = next((one for called, one in (*services, *actions) if called == name and name), None)
    return part, about if part else None, of_action


def type_judged(criterion: dict[str, Any], rubric: WrittenRubric) -> str:
    """Return the type of the service or action whose fields a criterion judges; "" where the rubric says none."""
    scenario = as_map(rubric.scenarios.get(str(criterion.get("scenario"))))
    _, about, _ = _asked(str(criterion.get("check")), as_map(criterion.get("with")), scenario)
    return str((about or {}).get("type") or "")


def _expected(criterion: WrittenCriterion, known: Definitions) -> Iterator[Fault]:
    """Yield fields of requests, answers, goals and results that their types do not have."""
    part, about, of_action = _asked(criterion.check, criterion.given, criterion.scenario)
    key = "result" if part == "result" else "expect"
    if about is None:
        return
    shape = known.shape(str(about.get("type")), "goal" if of_action else part)
    expected = criterion.given.get(key)
    each = [((), expected)] if isinstance(expected, dict) else [((n,), one) for n, one in as_maps(expected)]
    for at, one in each:
        if shape is None:
            yield from _quoted((*criterion.at, key, *at), one, are_fields=True)
        elif fault := shape.misfit(one) or _of_other_part(one, str(about.get("type")), shape, known):
            yield (*criterion.at, key, *at), fault


def _reported(criterion: WrittenCriterion, known: Definitions) -> Iterator[Fault]:
    """Yield fields of feedback, and of the result that is compared with it, that an action does not have: a field that
    is never there is compared with nothing."""
    _, about, _ = _asked(criterion.check, criterion.given, criterion.scenario)
    kind, compared = str(as_map(about).get("type")), as_map(criterion.given.get("as_reported"))
    named = [(("reports", name), "feedback", name) for name in as_map(criterion.given.get("reports"))]
    named += [(("as_reported", name), "result", name) for name in compared]
    named += [(("as_reported", name), "feedback", field) for name, field in compared.items()]
    for at, part, field in named:
        shape = known.shape(kind, part)
        if shape is not None and isinstance(field, str):
            fault = _of_other_part({field: None}, kind, shape, known)
            try:
                shape.field_at(field)
            except Misfit as error:
                fault = str(error)
            if fault:
                yield (*criterion.at, *at), fault


def _of_other_part(value: dict[str, Any], kind: str, shape: Shape, known: Definitions) -> str:
    """Return that a field is one of the request, and not of the answer, or the like; empty where none is."""
    names = {one.name for one in shape.types[shape.root.type]}
    for part in (one for parts in PARTS.values() for one in parts if one):
        other = known.shape(kind, part)
        there = {one.name for one in other.types[other.root.type]} if other else set()
        name = next((key for key in value if key in there - names), None)
        if other is not None and name is not None:
            return f"{shape.what} has no field {name}, which is one of {other.what}"
    return ""


def _sent_fields(scenario: dict[str, Any], known: Definitions) -> Iterator[tuple[KeyPath, str]]:
    """Yield what is sent in messages, requests, answers and goals whose types the rubric alone knows."""
    sent: list[tuple[KeyPath, str, str, object]] = []
    for index, step in as_maps(scenario.get("steps")):
        publish, action = as_map(step.get("publish")), as_map(step.get("action"))
        at: KeyPath = ("steps", index, "publish")
        values = publish.get("values")
        sent += [((*at, "value"), str(publish.get("type")), "", publish.get("value"))]
        sent += [((*at, "values", n), str(publish.get("type")), "", one) for n, one in as_maps(values)]
        sent += [(("steps", index, "action", "goal"), str(action.get("type")), "goal", action.get("goal"))]
    for at, part, one in services_in(scenario):
        key = "answer" if part == "response" else part
        if "definition" in one:
            continue  # looked at with it
        sent += [((*at, key), str(one.get("type")), part, one.get(key))]
        sent += [((*at, "answers", n), str(one.get("type")), part, v) for n, v in as_maps(one.get("answers"))]
    for index, one in as_maps(scenario.get("serves")):
        kind = str(one.get("type"))
        sent += [(("serves", index, "result"), kind, "result", one.get("result"))]
        sent += [
            (("serves", index, "feedback", n), kind, "feedback", v) for n, v in as_maps(one.get("feedback"))
        ]
    for at, kind, part, value in sent:
        own = known.text(kind, SUFFIXES[part])
        is_known = own or part in PARTS[".action"]  # other types are looked at where they are sent
        shape = known.shape(kind, part) if is_known and isinstance(value, dict | list) else None
        names = {one.name for one in shape.types[kind]} if shape and isinstance(value, list) else {"data"}
        if "data" not in names:
            yield at, f"is one message, a map of the fields of {kind}: several are values"
        elif shape is not None and (fault := shape.misfit(value)):
            yield at, fault
        elif shape is None and (part or kind.partition("/")[0] not in noetic_messages()):
            yield from _quoted(at, value, are_fields=True)


def _two_definitions(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield texts of a definition that differ from an earlier one of the same type."""
    first: dict[tuple[str, str], str] = {}
    for path, type_, suffix, own in own_texts(rubric):
        earlier = first.setdefault((type_, suffix), own.text) if own.whole else own.text
        if earlier != own.text and other_fields(type_, own.text, earlier):
            yield path, f"differs from the definition of {type_} above: write it once, with & and *"


def _other_definitions(
    criterion: WrittenCriterion, known: Definitions, rubric: WrittenRubric
) -> Iterator[Fault]:
    """Yield fields that a criterion asks of a definition, and that another place in the rubric defines otherwise."""
    file = PurePosixPath(str(criterion.given.get("file")))
    if criterion.check != "definition" or file.suffix not in PARTS:
        return
    type_ = f"{rubric.package_of(criterion.data)}/{file.stem}"
    own = known.text(type_, file.suffix)
    if own is None or not own.whole or not all(known.shape(type_, part) for part in PARTS[file.suffix]):
        return
    try:
        found = {one.path: one.type for one in parse_definition(own.text, file.suffix)}
    except ValueError:  # said where it stands
        return
    for name, kind in as_map(criterion.given.get("fields")).items():
        at = (*criterion.at, "fields", name)
        if name not in found:
            yield at, f"the rubric's definition of {type_} has no {name}{instead_of(str(name), found)}"
        elif found[name] != kind:
            yield at, f"is {found[name]} in the rubric's definition of {type_}, not {kind}"
