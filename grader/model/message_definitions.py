"""Definitions of messages, services and actions (`.msg`, `.srv`, `.action`), line by line, and how two differ."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import PurePosixPath

from grader.model.file_fault import Fault
from grader.model.package import Interface, InterfaceField
from grader.wording import is_one_edit, plural

FIELDS_MAX = 500
PARTS = {".msg": ("",), ".srv": ("request", "response"), ".action": ("goal", "result", "feedback")}
"""What a file is divided into by `---`, by its ending."""
NOT_FINITE = {".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf, ".nan": math.nan}
"""As YAML writes them. A rubric's data holds them as text, as JSON has no other form for them."""
DIVIDER = re.compile(r"^---.*$", re.MULTILINE)
"""ROS looks at the first three signs of a line alone: `-----` divides, and an indented `---` does not."""
DIVIDING = "---"
WRITE_ALL = "write into it, each on a line of its own: {}"
RULE = "=" * 80
"""Before the types that a full definition brings along, behind its own."""
BUILT_IN = {*(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)), "bool", "float32", "float64",
            "string", "time", "duration"}  # fmt: skip
FULL_NAMES = {"byte": "int8", "char": "uint8", "Header": "std_msgs/Header"}
OTHER_TYPES = {
    "float": "float64",
    "double": "float64",
    "int": "int32",
    "integer": "int32",
    "long": "int64",
    "short": "int16",
    "unsigned": "uint32",
    "str": "string",
    "text": "string",
    "boolean": "bool",
}
"""What other languages call the types of fields."""
# At most nine digits, so that a length is a number of ordinary size.
_TYPE = r"(?P<type>[A-Za-z]\w*(?:/[A-Za-z]\w*)?(?:\[\d{0,9}\])?)"
# ASCII: ROS knows no other letters in names.
_FIELD = re.compile(rf"{_TYPE}\s+(?P<name>[A-Za-z]\w*)", re.ASCII)
_CONSTANT = re.compile(rf"{_TYPE}\s+(?P<name>[A-Za-z]\w*)\s*=\s*(?P<value>.*)", re.ASCII)
_CHARS_MAX = 200


def parse_interface(data: bytes, path: str) -> Interface:
    """Return one definition from its bytes. Never raises: the first line that is none is the record's `fault`."""
    parts = PARTS[PurePosixPath(path).suffix]
    # Not `splitlines()`: ROS ends lines where Python's `open()` does, and a comment may hold other signs.
    lines = re.split(r"\r\n?|\n", data.decode("utf-8-sig", "replace"))
    fields: list[InterfaceField] = []
    number, fault = 0, None
    for line, text in enumerate(lines, 1):
        if text.startswith(DIVIDING):
            number += 1
            continue
        one = _parse_line(text, parts[min(number, len(parts) - 1)], line)
        if one is None and text.partition("#")[0].strip():
            fault = fault or _no_field(text, path, line)
        elif one is not None and len(fields) < FIELDS_MAX:
            fields.append(one)
            fault = fault or _refused(text, one, path)
    if number != len(parts) - 1:
        fault = fault or _other_parts(path, number, parts)
    return Interface(path=path, fields=tuple(fields), fault=fault)


def parse_definition(text: str, suffix: str) -> Iterator[InterfaceField]:
    """Yield the fields of a rubric's own definition. Raises ValueError for what is none."""
    found = parse_interface(text.encode(), f"definition{suffix}")
    if found.fault is not None:
        raise ValueError(found.fault.message)
    for field in found.fields:
        refuse_unknown(field.type)
        yield field


def exchanged_parts(found: Collection[InterfaceField], wanted: Collection[InterfaceField]) -> dict[str, str]:
    """Return by each part the one in which its fields are, where whole parts have changed places; nothing otherwise."""
    there = {one.name: one.part for one in found}
    # A name that is in two parts could be from either.
    if len(there) < len(found) or any(one.name not in there for one in wanted):
        return {}
    places = list(dict.fromkeys((one.part, there[one.name]) for one in wanted))
    is_whole = len(places) == len(dict(places)) and {old for old, _ in places} == {new for _, new in places}
    return dict(places) if is_whole and any(old != new for old, new in places) else {}


def integer_limits(type_: str) -> tuple[int, int] | None:
    """Return the least and the greatest value of an integer type, `uint8` or `std_msgs/UInt8`; None of any other."""
    plain = type_.removeprefix("std_msgs/").lower() if type_.startswith("std_msgs/") else type_
    match = re.fullmatch(r"(u?)int(8|16|32|64)", plain)
    if match is None:
        return None
    values = 2 ** int(match[2])
    return (0, values - 1) if match[1] else (-values // 2, values // 2 - 1)


def refuse_unknown(type_: str) -> None:
    """Raise ValueError where a type has the form of a built-in one, and is none."""
    base = type_.partition("[")[0]
    # Built-in types are small, and messages begin with a capital letter.
    if base.islower() and "/" not in base and base not in {*BUILT_IN, *FULL_NAMES}:
        near = get_close_matches(base, sorted(BUILT_IN), n=1)
        raise ValueError(f'there is no type "{type_}"' + (f' (did you mean "{near[0]}"?)' if near else ""))


def _parse_line(text: str, part: str, line: int) -> InterfaceField | None:
    bare = text.partition("#")[0].strip()
    # In a constant of type string, # begins no comment (wiki.ros.org/msg).
    if constant := _CONSTANT.fullmatch(text.strip() if bare.startswith("string") else bare):
        value = constant["value"].strip()[:_CHARS_MAX]
        return InterfaceField(part=part, type=constant["type"], name=constant["name"], value=value, line=line)
    field = _FIELD.fullmatch(bare)
    return field and InterfaceField(part=part, type=field["type"], name=field["name"], line=line)


def _no_field(text: str, path: str, line: int) -> Fault:
    shown = text.strip()[:60]
    right = corrected_line(text, path)
    why, fix = ("", "") if right else _lacks(text.partition("#")[0].split())
    cause = f"`{shown}` on line {line} is not a field{why and f': {why}'}"
    message = f"`{shown}` is not a field: {why or 'a line is a type and a name, like `float64 speed`'}"
    if right == DIVIDING:
        message = cause = f"`{shown}` on line {line} does not divide its parts" + (
            ": it has to stand at the beginning of the line"
            if shown.startswith(DIVIDING)
            else ": that takes three of `-`"
        )
        fix = f"write `{DIVIDING}`{' without spaces before it' if shown.startswith(DIVIDING) else ''}"
        return Fault(file=path, line=line, kind="NoField", message=message, cause=cause, fix=fix)
    return Fault(
        file=path,
        line=line,
        kind="NoField",
        message=message,
        cause=cause,
        fix=f"write `{right}`" if right else fix,
    )


def _lacks(words: Sequence[str]) -> tuple[str, str]:
    """Return what a line lacks, or has too much, that is not a field, and what to write; "" where that is not plain."""
    first = words[0]
    is_type = first.partition("[")[0] in {*BUILT_IN, *FULL_NAMES, *OTHER_TYPES} or "/" in first
    if len(words) == 1 and is_type:
        return "it has a type, and no name", f"write the name of the field behind `{first}`"
    if len(words) == 1 and first.isidentifier():
        return "it has a name, and no type", f"write the type of the field before `{first}`"
    if is_type and words[1] == "=":
        return "it has no name before its `=`", f"write the name of the constant behind `{first}`"
    if is_type and len(words) == 4 and words[2].partition("[")[0] in BUILT_IN:
        return "it has two fields", f"write `{' '.join(words[2:])}` on a line of its own"
    return "", ""


def lacking_field(
    fault: Fault, found: Collection[InterfaceField], wanted: Collection[InterfaceField]
) -> InterfaceField | None:
    """Return which of the fields that are wanted, and not there, the line is meant to be that cannot be read: the only
    one, or the one that it is most like; None where that is not plain."""
    there = {(one.part, one.name) for one in found}
    lacking = {
        f"{one.type} {one.name}": one for one in wanted if one.type and (one.part, one.name) not in there
    }
    line = re.match(r"`(.*)` ", fault.cause)
    if fault.kind != "NoField" or line is None or fault.fix.startswith("write `"):
        return None
    likest = [*lacking] if len(lacking) == 1 else get_close_matches(line[1], lacking, n=1, cutoff=0.5)
    return lacking[likest[0]] if likest else None


def constant_type(value: str) -> str:
    """Return a type that fits a constant where the handout leaves it open."""
    if value in {"True", "False"}:
        return "bool"
    try:
        return "int32" if float(value).is_integer() else "float64"
    except ValueError:
        return "string"


def as_written(field: InterfaceField) -> str:
    """Return the line of a definition that makes a field, or a constant."""
    value = "" if field.value is None else f"={field.value}"
    return f"{field.type or constant_type(field.value or '')} {field.name}{value}"


def whole_definition(fields: Iterable[InterfaceField], suffix: str) -> list[str]:
    """Return the lines of a definition with these fields, with `---` between its parts."""
    own = list(fields)
    parts = ([as_written(one) for one in own if one.part == part] for part in PARTS[suffix])
    return [line for part in parts for line in (DIVIDING, *part)][1:]


def corrected_line(text: str, path: str) -> str:
    """Return what a line that ROS does not read as a field, a constant or a divider should be, without a comment behind
    `#`; "" where that is not plain."""
    code = text.partition("#")[0].strip()
    bare = code.partition("//")[0].strip().rstrip(";, ")
    if len(code) > _CHARS_MAX:
        return ""
    if not bare:
        return f"# {code.lstrip('/ ')}" if code.startswith("//") else ""
    # Also dashes that a word processor made of `---`.
    if re.fullmatch(r"[-_=*\u2013\u2014]+", bare) and not path.endswith(".msg"):
        return DIVIDING
    note = f"  # {note.strip()}" if (note := code.partition("//")[2]) else ""
    read = _parse_line(bare, "", 0)
    if read is not None:
        return f"{right}{note}" if (right := _rewritten(bare, read)) != code else ""
    changed = (re.sub(pattern, new, bare) for pattern, new in _SLIPS)
    right = next(
        (one for one in changed if (read := _parse_line(one, "", 0)) and not _refusal(one, read)), ""
    )
    return right and f"{right}{note}"


_PLAIN = "|".join(sorted({*BUILT_IN, *FULL_NAMES}, key=len, reverse=True))
_SLIPS = (
    (r"^(\w+\s+\w+)\s*(?::=?|==|\s)\s*(?=[-\d])", r"\1 = "),
    (r"^(\w+)\.(?=[A-Z])", r"\1/"),
    (rf"^((?:{_PLAIN})(?:\[\d*\])?)\s*[:;,=]\s*(?=\w+$)", r"\1 "),
    (rf"^(\w+)\s*:\s*((?:{_PLAIN})(?:\[\d*\])?)$", r"\2 \1"),
    (rf"^({_PLAIN})\s+(\[\d*\])\s*", r"\1\2 "),
    (rf"^({_PLAIN})\s+(\w+)\s*(\[\d*\])$", r"\1\3 \2"),
    (r"^(u?int|float) (8|16|32|64)\b", r"\1\2"),
    (r"^(u?int(?:8|16|32|64)|float(?:32|64))(?=[A-Za-z]\w*$)", r"\1 "),
    (rf"^({_PLAIN})\[?(\d*)\]?(?=\s+\w+$)", r"\1[\2]"),
    (r"^(\w+)(?: ?[/\\] ?)(?=\w+(?:\[\d*\])?\s+\w+$)", r"\1/"),
    (r"^[-*]\s+", ""),
    (r"['\"`.\])]+$|(?<=\s)['\"`]|^['\"`]", ""),
    (rf"^((?:{_PLAIN})(?:\[\d*\])?\s+[A-Za-z]\w*) ([A-Za-z]\w*)$", r"\1_\2"),
    (r"(?<=\w)-(?=\w)", "_"),
)  # fmt: skip
"""What lines have that are no fields, and what is meant: `float64: speed`, `int32 A: 5`, `std_msgs.Header header`."""


def _refused(text: str, field: InterfaceField, path: str) -> Fault | None:
    if not (why := _refusal(text.partition("#")[0].strip(), field)):
        return None
    cause, right = f"line {field.line} cannot be read: {why}", corrected_line(text, path)
    fix = f"write `{right}`" if right else ""
    return Fault(file=path, line=field.line, kind="NoField", message=cause, cause=cause, fix=fix)


def _refusal(code: str, field: InterfaceField) -> str:
    """Return why ROS refuses a line that has the form of a field or a constant; "" where it does not."""
    if code.split(" ", maxsplit=1)[0].strip() != field.type:
        return "a tab stands between its type and its name, and ROS asks for a space"
    if field.value is None:
        return ""
    if field.type not in {*BUILT_IN, "byte", "char"} - {"time", "duration"}:
        return f"a constant cannot be a {field.type}"
    if field.type == "string":
        return ""
    if not field.value:
        return f"nothing stands behind the `=` of {field.name}"
    return (
        ""
        if _is_value(field.value, field.type)
        else f"`{field.value}` is not a value of the type {field.type}"
    )


def _is_value(value: str, type_: str) -> bool:
    limits = integer_limits(FULL_NAMES.get(type_, type_))
    try:
        if limits is not None:
            return limits[0] <= int(value) <= limits[1]
        if type_ != "bool" or value not in {"True", "False"}:
            float(value)
    except ValueError:
        return False
    return True


def _rewritten(code: str, field: InterfaceField) -> str:
    """Return a line that has the form of a field as ROS reads it; as it is where that is not plain."""
    value = field.value
    if value is None or not _refusal(f"{field.type} {field.name}", field):
        end = "" if value is None else f" = {value}"
        return f"{field.type} {field.name}{end}"
    other = re.sub(
        r"^=\s*|(?<=[\d.])[fFuUlL]$|\.0*$", "", value.capitalize() if field.type == "bool" else value
    )
    if re.fullmatch(r"-?0[xX][0-9a-fA-F]{1,16}", other):
        other = str(int(other, 16))
    return f"{field.type} {field.name} = {other}" if _is_value(other, field.type) else code


def _other_parts(path: str, number: int, parts: tuple[str, ...]) -> Fault:
    lines = "one line" if len(parts) == 2 else "two lines" if parts[1:] else "no line"
    message = f"there must be {lines} `---`, not {number}"
    if parts[1:] and not number:
        message = f"it has no line `---` between {parts[0]} and {parts[1]}"
    elif parts[1:]:
        message += f", between {', '.join(parts[:-1])} and {parts[-1]}"
    fix = f"write `{DIVIDING}` on a line of its own between the parts" if number < len(parts) - 1 else ""
    return Fault(file=path, line=None, kind="OtherParts", message=message, cause=message, fix=fix)


def sound_message(text: str | None) -> str | None:
    """Return the text of a `.msg`. Raises ValueError where it is none."""
    for _ in parse_definition(text or "", ".msg"):
        pass
    return text


def other_fields(type_: str, found: str, wanted: str) -> str:
    """Return how the fields of a `.msg` or `.srv` text differ from those that are wanted: names, types, order.

    Nothing where they are the same; constants and comments do not count.
    """
    there, asked = (
        [_own_fields(type_, part) for part in DIVIDER.split(text.partition(RULE)[0])]
        for text in (found, wanted)
    )
    if len(there) != len(asked):
        much = "no line `---`" if len(there) == 1 else f"{plural(len(there) - 1, 'line')} `---`"
        return f"it has {much} between its parts" + (f", not {len(asked) - 1}" if len(there) > 1 else "")
    names = ("its request", "its response") if len(asked) > 1 else ("it",)
    for name, own, other in zip(names, there, asked, strict=False):
        if own != other:
            has, asks = (", ".join(fields) or "no fields" for fields in (own, other))
            return f"{name} has {has}; the handout asks for {asks}"
    return ""


def fields_to_read(given: str, wanted: str) -> str:
    """Return which fields a callback reads of a message of another type than it was written for; "" where that is the
    same: most types of std_msgs have the one field `data`."""
    if given.startswith("std_msgs/") == wanted.startswith("std_msgs/"):
        return ""
    if wanted.startswith("std_msgs/"):
        return "its callback then reads the message's `data`"
    return f"its callback then reads the fields that `rosmsg show {wanted}` lists"


def _own_fields(type_: str, text: str) -> list[str]:
    """Return `type name` of each field, types in full."""
    package, found = type_.partition("/")[0], []
    for line in text.splitlines():
        field = _parse_line(line, "", 0)
        if field is not None and field.value is None:  # a constant has a value
            kind, bracket, length = field.type.partition("[")
            full = FULL_NAMES.get(kind, kind.removeprefix(f"{package}/"))
            found.append(f"{full}{bracket}{length} {field.name}")
    return found


def full_type(type_: str, package: str) -> str:
    """Return the type of a field with its package in front, unless it is one of ROS's own."""
    base, bracket, size = type_.partition("[")
    base = FULL_NAMES.get(base, base)
    return (base if base in BUILT_IN or "/" in base else f"{package}/{base}") + bracket + size


def under_other_names(
    wanted: Iterable[InterfaceField], found: Iterable[InterfaceField], package: str
) -> list[tuple[InterfaceField, InterfaceField]]:
    """Return pairs of a wanted field and the one that stands for it under another name: where a part has as many others
    as it lacks, of the same types in order. No constants."""
    asked, there = ([one for one in fields if one.value is None] for fields in (wanted, found))
    pairs = list[tuple[InterfaceField, InterfaceField]]()
    for part in dict.fromkeys(one.part for one in asked):
        names = [{one.name for one in fields if one.part == part} for fields in (asked, there)]
        own = [one for one in asked if one.part == part and one.name not in names[1]]
        given = [one for one in there if one.part == part and one.name not in names[0]]
        if {one.name for one in given} & {one.name for one in asked}:
            continue  # of another part
        if [full_type(one.type, package) for one in own] == [full_type(one.type, package) for one in given]:
            pairs += zip(own, given, strict=True)
    return pairs


def meant_field(
    field: InterfaceField, own: Collection[str], known: Mapping[str, Collection[str]]
) -> tuple[str, str]:
    """Return the type and the name that a field is meant to have, as `meant_type` does; `speed float64` has them the
    wrong way round."""
    is_type = not field.type.isidentifier() or field.type in {*BUILT_IN, *FULL_NAMES, *own}
    if field.name in BUILT_IN and field.value is None and not is_type:
        return field.name, field.type
    return meant_type(field.type, own, known), field.name


def meant_type(type_: str, own: Collection[str], known: Mapping[str, Collection[str]]) -> str:
    """Return the type of a field that is meant by one that there is none of; the type itself where there is one. `own`
    are types of the same package, `known` those of others."""
    base, bracket, size = type_.partition("[")
    if "/" in base:
        package, _, name = base.partition("/")
        return f"{_meant_full_name(package, name, known)}{bracket}{size}"
    if base in {*BUILT_IN, *FULL_NAMES, *own}:
        return type_
    # Small letters on both sides: `pose` is meant for the package's own `Pose`.
    near = get_close_matches(base.lower(), sorted(map(str.lower, own)), 1)
    plain = OTHER_TYPES.get(base.lower(), base.lower())
    having = [package for package, types in known.items() if base in types]
    meant = [
        *([plain] if plain in BUILT_IN else []),
        *(f"{package}/{base}" for package in having),
        *(one for one in own if near == [one.lower()]),
        *get_close_matches(plain, sorted(BUILT_IN), 1),
    ]
    return f"{meant[0] if meant else base}{bracket}{size}"


def _meant_full_name(package: str, name: str, known: Mapping[str, Collection[str]]) -> str:
    """Return `std_msgs/Header` for `std_msg/Header` and for `std_msgs/header`; the name itself of any other package."""
    if name in known.get(package, ()):
        return f"{package}/{name}"
    # Not another first letter: there are packages `mav_msgs` and `nav_msgs`.
    near = [one for one in known if one[0] == package[0] and is_one_edit(package, one) and name in known[one]]
    alike = [one for one in known.get(package, ()) if one.lower() == name.lower() or is_one_edit(name, one)]
    meant = [f"{one}/{name}" for one in near] or [f"{package}/{one}" for one in alike]
    return meant[0] if len(meant) == 1 else f"{package}/{name}"
