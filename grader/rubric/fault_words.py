"""What pydantic found wrong, in an author's words."""

from __future__ import annotations

import json
import re
import types
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from grader.checks import CHECKS
from grader.checks.interfaces import FILE_PATTERN
from grader.checks.support.frames import FRAME_PATTERN
from grader.installable import noetic_messages
from grader.model.record import Record
from grader.rubric.scenario import NAME_PATTERN, PACKAGE_PATTERN, PROGRAM_PATTERN, TYPE_PATTERN
from grader.rubric.yaml_lines import Fault, KeyPath
from grader.wording import did_you_mean, join_words, shorten

KEYS_LISTED = 6
UNITS = {"hz": "Hz", "s": "seconds", "m": "metres", "deg": "degrees", "rad": "radians"}
"""By what a parameter's name ends in."""
SIZES: dict[str, dict[str, float]] = {
    "hz": {"khz": 1000},
    "s": {"ms": 0.001, "s": 1, "sec": 1, "second": 1, "seconds": 1, "min": 60, "minutes": 60},
    "m": {"mm": 0.001, "cm": 0.01, "m": 1, "metres": 1, "meters": 1},
    "deg": {"deg": 1, "degrees": 1},
    "rad": {"rad": 1, "radians": 1},
}
"""By these endings, units that are written behind a number, and how large they are."""
USUAL_ELSEWHERE = {
    "description": "title", "name": "title", "depends": "requires", "depends_on": "requires", "needs": "requires",
    "weight": "points",
    "params": "with", "parameters": "with", "hidden": "visibility: hidden", "visible": "visibility: hidden",
    "msg": "type", "data": "value, or values", "timeout": "limit_s", "sleep": "wait: {seconds: …}",
    "exited": "ended", "finished": "ended", "frequency": "rate_hz",
    "pattern": "text: {number} in it stands for a number", "regex": "text: {number} in it stands for a number",
}  # fmt: skip
"""Words that other tools have for a key."""
ALONE: dict[str, dict[type, str]] = {
    "until": {int: "limit_s", float: "limit_s"}, "wait": {int: "seconds", float: "seconds", str: "topic"},
    "needs": {list: "ros"}, "play": {str: "bag"},
}  # fmt: skip
"""By a key whose value is a map, the key in it that is meant if something of another type is written there."""
PATTERN_RULES = {
    NAME_PATTERN: "must be lower-case letters, digits and hyphens, beginning with a letter",
    TYPE_PATTERN: "must be a type like std_msgs/String",
    FRAME_PATTERN: "must be a frame without blanks or a slash before it, as tf2 has them, like base_link",
    FILE_PATTERN: "must be a file like srv/Add.srv, with its folder",
    PROGRAM_PATTERN: "must be a program like turtlesim/turtlesim_node",
    PACKAGE_PATTERN: "must be the name of a package, without folders: one of the course lies beside the rubric",
}
TIME = "a time with its zone, such as 2026-11-20T23:59:00+01:00"
DAY = "a day such as 2026-11-02"
# As Python imports a type (`std_msgs.msg.String`), and ROS 2 writes it.
_TYPE_ELSEWHERE = re.compile(r"(\w+)[./](?:msg|srv|action)[./](\w+)")
# `5 Hz`, `30s`, `90 %`: keys have their unit in their names.
_NUMBER_AND_UNIT = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*([A-Za-z%]*)\s*")
MUST_BE = {
    "string_type": "text",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a map of keys and values",
    "model_type": "a map of keys and values",
    "date_type": DAY,
    "date_parsing": DAY,
    "date_from_datetime_parsing": DAY,
    "date_from_datetime_inexact": DAY,
    "datetime_type": TIME,
    "datetime_parsing": TIME,
    "timezone_aware": TIME,
}
TRUE_FALSE = {"true": "true", "yes": "true", "on": "true", "false": "false", "no": "false", "off": "false"}
BOUNDS = {
    "greater_than_equal": ("ge", "at least"),
    "greater_than": ("gt", "more than"),
    "less_than_equal": ("le", "at most"),
    "less_than": ("lt", "less than"),
}


def model_faults(model: type[Record], data: object, base: KeyPath = ()) -> list[Fault]:
    """Return every fault of `data` as a `model`, as the key's path (below `base`) and what is wrong there.

    `data` is read as JSON, strictly: text is not a number, and a number no text.
    """
    try:
        model.from_data(data)
    except ValidationError as error:
        found = _friendly(model, data, error.errors(include_url=False), base)
        return [((*base, *path), message) for path, message in found]
    return []


def _friendly(
    model: type[Record], data: object, details: Iterable[ErrorDetails], base: KeyPath
) -> list[Fault]:
    """Return one fault for each path: each member of a union complains, and these are joined by "or"."""
    by_path: dict[KeyPath, list[str]] = {}
    for detail in details:
        if detail["type"] == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"]:
            continue  # pydantic counts only the items that are sound
        path = _data_path(data, detail)
        message = _message(model, path, detail)
        if detail["type"] == "extra_forbidden":
            message += _elsewhere(model, data, path, base) or _unknown(
                str(path[-1]), detail["input"], _keys(model, path[:-1])
            )
        by_path.setdefault(path, [])
        if message not in by_path[path]:
            by_path[path].append(message)
    return [(path, ", or ".join(messages)) for path, messages in by_path.items()]


def _data_path(data: object, detail: ErrorDetails) -> KeyPath:
    """Return the location as far as the data goes: pydantic also puts types' names into it."""
    path: KeyPath = ()
    for part in detail["loc"]:
        if not _holds(data, part):
            # A missing key is not in the data, and its name is what has to be said.
            return (*path, part) if detail["type"] == "missing" else path
        data = data[part]  # type: ignore[index]
        path = (*path, part)
    return path


def _holds(data: object, part: str | int) -> bool:
    return part in (data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ())


def _elsewhere(model: type[Record], data: Any, path: KeyPath, base: KeyPath) -> str:  # noqa: ANN401 - as above
    """Return where a key belongs that is one level too deep, or not deep enough; "" where nothing there knows it."""
    key = str(path[-1])
    if not base and path[0] == "criteria" and len(path) == 3:
        check = CHECKS.get(str(data["criteria"][path[1]].get("check")))
        return ": it belongs into with" if check and key in check.params.model_fields else ""
    for end in range(len(path) - 2, -1, -1):
        if not isinstance(path[end], int) and key in _keys(model, path[:end]):
            return f": it belongs beside {path[end]}, and not into it"
    if base[-1:] == ("with",) and key in {"scenario", "requires", "points", "title", "hint", "reproduce"}:
        return ": it belongs beside with, and not into it"
    if len(path) == 1 and not base:
        parts: dict[str, KeyPath] = {
            "one of the criteria": ("criteria", 0),
            "a scenario": ("scenarios", "any"),
        }
        return next(
            (f": it belongs into {name}" for name, at in parts.items() if key in _keys(model, at)), ""
        )
    inside = {name for name, one in _fields(model, path[:-1]) if key in dict(_fields(one.annotation))}
    return f": it belongs into {inside.pop()}" if len(inside) == 1 else ""


def _unknown(key: str, value: object, keys: Collection[str]) -> str:
    """Return what an unknown key may be: a slip, or the rest of a text that YAML has cut off at a comma."""
    usual = USUAL_ELSEWHERE.get(key, "")
    if re.split("[:,]", usual)[0] in keys:
        return f": write {usual}"
    if key.startswith("/") and {"name", "value"} <= {*keys}:
        return f": write {{name: {key}, value: …}}"
    if other := _of_other_unit(key, value, keys):
        return other
    glued = re.match(r"(\w+)(?:\s*[:=]\s*|\s+)(?=\S)", key)
    if glued and glued[1] in keys:
        return f": write {glued[1]}, a colon and a blank before its value"
    near = did_you_mean(key, keys)
    cut = value is None and (" " in key or not near)
    there = f": there is {join_words(sorted(keys))}" if len(keys) <= KEYS_LISTED else ""
    return ": between { and }, text with a comma needs quotes" if cut else near or there


def _of_other_unit(key: str, value: object, keys: Collection[str]) -> str:
    """Return how a key is written that has its value in another unit: `window_ms`, `period_s`."""
    name, _, unit = key.rpartition("_")
    known = {one.rpartition("_")[2]: one for one in keys if one.rpartition("_")[0] == name}
    for ending, one in known.items():
        if size := SIZES.get(ending, {}).get(unit):
            number = f": {value * size:g}" if isinstance(value, int | float) else ""
            return f": write {one}{number}, in {UNITS[ending]}"
    if name == "period" and "rate_hz" in keys and isinstance(value, int | float) and value > 0:
        return f": write rate_hz: {1 / value:.4g}, in messages a second"
    return ""


def _message(model: type[Record], path: KeyPath, detail: ErrorDetails) -> str:
    kind, context, value = detail["type"], detail.get("ctx", {}), detail["input"]
    words: dict[str, Callable[[], str]] = {
        "missing": lambda: "is missing",
        "extra_forbidden": lambda: "is not known here",
        "string_pattern_mismatch": lambda: (
            f"{PATTERN_RULES.get(context['pattern'], 'must match ' + context['pattern'])}, not {shown(value)}"
            f"{_as_named(context['pattern'], value)}"
        ),
        "literal_error": lambda: _literal(value, context["expected"]),
        "string_too_long": lambda: f"has at most {context['max_length']} characters, not {len(value)}",
        "too_long": lambda: f"has at most {context['max_length']} items, not {context['actual_length']}",
        "too_short": lambda: f"needs at least {context['min_length']}, has {context['actual_length']}",
    }
    if kind in words:
        return words[kind]()
    if kind in MUST_BE:
        return f"must be {MUST_BE[kind]}, not {shown(value)}{_remedy(model, path, kind, value)}"
    if kind in BOUNDS:
        key, bound = BOUNDS[kind]
        is_percent = key == "le" and context[key] == 1 and isinstance(value, int | float) and value <= 100
        share = f": it is a share, write {value / 100:g} for {value:g} %" if is_percent else ""
        return f"must be {bound} {context[key]:g}, not {shown(value)}{share}"
    return str(context.get("error", detail["msg"])).removeprefix("Value error, ")


def _remedy(model: type[Record], path: KeyPath, kind: str, value: object) -> str:
    """Return how to write what was meant."""
    if shape := _other_shape(path, kind, value):
        return shape
    if kind == "string_type" and isinstance(value, int | float):
        return ": put it in quotes"
    if isinstance(value, str) and MUST_BE[kind].endswith("number"):
        percent = re.fullmatch(r"(\d+(?:\.\d+)?) ?%", value)
        if percent and _is_share(model, path):
            return f": it is a share, write {float(percent[1]) / 100:g} for {percent[1]} %"
        return _plain_number(str(path[-1]) if path else "", value)
    return ""


def _plain_number(key: str, text: str) -> str:
    """Return how a number is written that has its unit, or its exponent, behind it."""
    if re.fullmatch(r"[-+]?\d+(?:\.\d*)?[eE][-+]?\d{1,2}", text):
        return f": YAML takes this for text, write {float(text):.15g}"
    if re.fullmatch(r"\d[\d.]*[Oo][\dOo.]*", text):
        return f": write {text.upper().replace('O', '0')}, with the digit 0 in place of the letter O"
    number = _NUMBER_AND_UNIT.fullmatch(text)
    if not number:
        return ""
    ending = key.rpartition("_")[2]
    unit, size = UNITS.get(ending, ""), SIZES.get(ending, {}).get(number[2].lower())
    if not unit or not number[2] or number[2].lower() == unit.lower():
        size = 1
    if size is None:
        return f": it is a number of {unit}"
    return f": write {float(number[1]) * size:g}" + (f", the key says {unit}" if unit and number[2] else "")


def _other_shape(path: KeyPath, kind: str, value: object) -> str:
    """Return what is missing, or too much, where a list is a map, a map is a text, and the like."""
    if MUST_BE[kind] == "a list":
        return _list_of(value)
    if MUST_BE[kind] == "a whole number" and isinstance(value, list):
        return f": write how many there are, {len(value)}"
    if MUST_BE[kind] == "true or false" and (meant := TRUE_FALSE.get(str(value).lower())):
        return f": write {meant}, without quotes"
    is_map = kind in {"dict_type", "model_type"}
    return (_map_of(str(path[-1]), value) if is_map and path else "") or _glued(path, value, is_map=is_map)


def _list_of(value: object) -> str:
    """Return how a list is written that is a map, a text or a number."""
    if isinstance(value, dict):
        if value and not value.keys() - {"x", "y", "z"}:
            return f": write [{', '.join(str(value[key]) for key in sorted(value))}]"
        if value and all(str(key).startswith("/") for key in value):
            return f": each is written {{name: {next(iter(value))}, value: …}}"
    elif isinstance(value, str) and value.startswith("("):
        return ": a list is in [ and ], and not in ( and )"
    elif type(value) in {str, int, float} and not re.search(r"[\s,]", str(value)):
        return f": write [{value}]"
    is_known = isinstance(value, dict | str)
    return ": write a dash and a blank before each item, or [ and ] around them all" if is_known else ""


def _glued(path: KeyPath, value: object, *, is_map: bool) -> str:
    """Return that a key and its value are not apart, or a map's keys have dashes."""
    if is_map and isinstance(value, list) and all(isinstance(one, dict) for one in value):
        return ": its keys have no dash before them"
    is_text = isinstance(value, str) and is_map and re.match(r"\w+\s*[:=]?\s*\S", value)
    if is_text or (value is None and path and re.search(r"[:\s]", str(path[-1]))):
        return ": between a key and its value are a colon and a blank"
    return ""


def _map_of(key: str, value: object) -> str:
    """Return how a map is written that is a number, a text, or a list of texts."""
    alone = ALONE.get(key, {}).get(type(value), "")
    if alone and not isinstance(value, list) and not re.search(r"[\s,]", str(value)):
        return f": write {{{alone}: {value}}}"
    if not isinstance(value, list) or not value or not all(isinstance(one, str) for one in value):
        return ""
    if alone:
        return f": write {{{alone}: [{', '.join(value[:KEYS_LISTED])}]}}"
    pairs = [re.fullmatch(r"([\w/~-]+)(?:\s*[:=]\s*(\S+))?", one) for one in value[:KEYS_LISTED]]
    written = [f"{pair[1]}: {pair[2] or '…'}" for pair in pairs if pair]
    return f": write {{{', '.join(written)}}}" if len(written) == len(pairs) else ""


def _as_named(pattern: str, text: str) -> str:
    """Return how a type or a file's name is written that has another form: `std_msgs.msg.String`, `Add.srv`."""
    if pattern == TYPE_PATTERN and (parts := _TYPE_ELSEWHERE.fullmatch(text)):
        return f": write {parts[1]}/{parts[2]}"
    if pattern == TYPE_PATTERN and (
        known := [f"{p}/{text}" for p, types in noetic_messages().items() if text in types]
    ):
        return f" (did you mean {join_words([json.dumps(one) for one in known[:3]], 'or')}?)"
    if pattern == TYPE_PATTERN and text.startswith("/"):
        return ", which is a name: a type has a package before it, and no slash at its beginning"
    ending = text.rpartition(".")[2]
    if pattern == FILE_PATTERN and ending in {"msg", "srv", "action"}:
        return f": write {ending}/{text.rpartition('/')[2]}"
    return ""


def _literal(value: object, expected: str) -> str:
    """Return what one of several words has to be. pydantic gives these as `'real' or 'warped'`."""
    words = expected.replace(" or ", ", ").replace("'", "").split(", ")
    near = did_you_mean(value, words) if isinstance(value, str) else ""
    return f"must be {expected.replace(chr(39), chr(34))}, not {shown(value)}{near}"


def shown(value: object) -> str:
    """Return the value as YAML's author knows it, cut where it is long."""
    if isinstance(value, dict):
        return "a map"
    if isinstance(value, list):
        return "a list"
    if value is None:
        return "empty"
    text = json.dumps(value, ensure_ascii=False)
    return shorten(text, 60)


def _keys(model: type[Record], path: KeyPath) -> list[str]:
    """Return the keys that the record at `path` knows."""
    return [name for name, _ in _fields(model, path)]


def _fields(model: object, path: KeyPath = ()) -> Iterator[tuple[str, FieldInfo]]:
    """Yield the fields of the record at `path`, by their keys."""
    for part in path:
        model = next(_inside(model, part), None)
    yield from ((f.alias or n, f) for m in _models(model) for n, f in m.model_fields.items())


def _is_share(model: type[Record], path: KeyPath) -> bool:
    """Return whether a field is between 0 and 1."""
    fields = [field for name, field in _fields(model, path[:-1]) if (name,) == path[-1:]]
    return any(getattr(one, "le", None) == 1 for field in fields for one in field.metadata)


def _inside(annotation: object, part: str | int) -> Iterator[object]:
    """Yield the types of what is under `part`."""
    for model in _models(annotation):
        for name, field in model.model_fields.items():
            if part in {name, field.alias}:
                yield field.annotation
    origin, arguments = get_origin(_bare(annotation)), get_args(_bare(annotation))
    if origin is tuple and arguments:
        yield arguments[0]
    if origin is dict:
        yield arguments[1]


def _models(annotation: object) -> list[type[Record]]:
    annotation = _bare(annotation)
    if get_origin(annotation) in {Union, types.UnionType}:
        return [model for member in get_args(annotation) for model in _models(member)]
    return [annotation] if isinstance(annotation, type) and issubclass(annotation, Record) else []


def _bare(annotation: object) -> object:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
