"""What a package's messages, services and actions lack of the handout's definitions, and have otherwise."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

from grader.installable import noetic_definitions
from grader.model.message_definitions import (
    DIVIDER,
    DIVIDING,
    FULL_NAMES,
    PARTS,
    WRITE_ALL,
    as_written,
    exchanged_parts,
    full_type,
    integer_limits,
    lacking_field,
    parse_interface,
    under_other_names,
    whole_definition,
)
from grader.model.package import Interface, InterfaceField, PackageFacts
from grader.package.repairs.editing import Files
from grader.package.repairs.files import is_own
from grader.package.repairs.names import CPP, Wanted, is_near
from grader.wording import join_words, numbers_text

LINES_MAX = 20
"""Of one definition that are put right: each reads the file again."""


def define_as_asked(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Put the parts of a service or an action, and the fields of a part, into the order of the handout where they have
    changed places, and between parts the `---` that are missing; give fields the handout's names where theirs are
    nearly these, and its types where others cannot stand for them; write those that are not there where no other could
    be meant."""
    for path, fields in wanted.definitions:
        _write_lacking(files, path, fields)
        _add_absent(files, path, [*fields, *dict(wanted.constants).get(path, ())])
        text = files.text(path)
        if text is None or all(one.path != path for one in package.interfaces):
            continue
        own = parse_interface(text.encode(), path)
        if own.fault is not None:
            _divide(files, own, fields, text)
        elif places := exchanged_parts(own.fields, fields):
            _move_parts(files, path, text, places)
        else:
            own = _correct_names(files, package, own, fields)
            _change_types(files, own, fields, package.name or "")
            _move_fields(files, own, fields)


def _write_lacking(files: Files, path: str, fields: Sequence[InterfaceField]) -> None:
    """Write the handout's field in place of each line that cannot be read, where it is plain which one is meant."""
    for _ in range(LINES_MAX):
        text = files.text(path) or ""
        own = parse_interface(text.encode(), path)
        meant = lacking_field(own.fault, own.fields, fields) if own.fault else None
        if own.fault is None or own.fault.line is None or meant is None or meant.value is not None:
            return
        lines = text.split("\n")
        comment = re.search(r"\s*#.*|$", lines[own.fault.line - 1])
        lines[own.fault.line - 1] = f"{meant.type} {meant.name}{comment[0] if comment else ''}"
        fix = f"write `{meant.type} {meant.name}`"
        files.change("build-line", path, "\n".join(lines), f"{path}: {own.fault.cause}", fix)


def _add_absent(files: Files, path: str, fields: Sequence[InterfaceField]) -> None:
    """Write the handout's fields and constants that are not there, where the file has none of its own beside them."""
    text, parts = files.text(path) or "", PARTS[PurePosixPath(path).suffix]
    own = parse_interface(text.encode(), path)
    there = {(one.part, one.name) for one in own.fields}
    asked = {(one.part, one.name) for one in fields}
    if files.text(path) is None or not there <= asked or (own.fault and own.fault.kind != "OtherParts"):
        return
    lines = text.split("\n")
    if not there:
        notes = [line for line in lines if line.strip() and not DIVIDER.match(line)]
        whole = whole_definition(fields, PurePosixPath(path).suffix)
        fix = WRITE_ALL.format(join_words(f"`{line}`" for line in whole))
        files.change("build-line", path, "\n".join([*notes, *whole, ""]), f"{path} has no field", fix)
        return
    for part in parts[len(DIVIDER.findall(text)) + 1 :]:
        new = [as_written(one) for one in fields if one.part == part]
        lines = [*"\n".join(lines).rstrip().split("\n"), DIVIDING, *new, ""]
        below = f", and {join_words(f'`{line}`' for line in new)} below it" if new else ""
        fix = f"at the end of the file, write a line `{DIVIDING}`{below}"
        files.change("build-line", path, "\n".join(lines), f"{path}: the {part} is missing", fix)
    there |= {(one.part, one.name) for one in parse_interface("\n".join(lines).encode(), path).fields}
    for one in (field for field in fields if (field.part, field.name) not in there):
        before = [f.name for f in fields[: fields.index(one)] if f.part == one.part]
        read = parse_interface("\n".join(lines).encode(), path).fields
        above = [f.line for f in read if f.part == one.part and f.name in before]
        top = [0, *(at for at, line in enumerate(lines, 1) if DIVIDER.match(line))]
        lines.insert(max(above, default=top[parts.index(one.part)]), as_written(one))
        message, fix = f"{path}: there is no field {one.path}", f"add the line `{as_written(one)}`"
        files.change("build-line", path, "\n".join(lines), message, fix)


def _move_parts(files: Files, path: str, text: str, places: Mapping[str, str]) -> None:
    """Write each part where it belongs; `places` tell where it is now."""
    order = PARTS[PurePosixPath(path).suffix]
    parts = [part.strip("\n") for part in DIVIDER.split(text)]
    changed = "\n---\n".join(parts[order.index(places.get(part, part))] for part in order)
    moved = join_words(part for part, other in places.items() if part != other)
    fix = f"the order of the parts is {join_words(order)}, with `---` between them"
    files.change("build-line", path, f"{changed}\n", f"{path}: {moved} have changed places", fix)


def _move_fields(files: Files, own: Interface, fields: Sequence[InterfaceField]) -> None:
    """Put the fields of a part into the order of the handout's `fields`, where it has these very names."""
    for part in PARTS[PurePosixPath(own.path).suffix]:
        there = [one for one in own.fields if one.part == part and one.value is None]
        asked = [one.name for one in fields if one.part == part and one.value is None]
        names = [one.name for one in there]
        if names == asked or sorted(names) != sorted(asked):
            continue
        lines = (files.text(own.path) or "").split("\n")
        ordered = [lines[there[names.index(name)].line - 1] for name in asked]
        for one, line in zip(there, ordered, strict=True):
            lines[one.line - 1] = line
        where = f" of the {part}" if part else ""
        message = f"{own.path}: the fields{where} are in a different order: {join_words(names, 'then')}"
        fix = f"order them as the handout does: {join_words(asked, 'then')}"
        files.change("build-line", own.path, "\n".join(lines), message, fix)


def _correct_names(
    files: Files, package: PackageFacts, own: Interface, fields: Sequence[InterfaceField]
) -> Interface:
    """Give the fields the names of the handout's `fields` where theirs are nearly these, or where a part has the
    handout's types in order, whatever the names are; and the code the same ones. Returns the definition with its new
    names."""
    asked = {(one.part, one.name) for one in fields}
    lacking = asked - {(one.part, one.name) for one in own.fields}
    for one in own.fields:
        meant = [name for part, name in lacking if part == one.part and is_near(one.name, name)]
        if one.value is None and len(meant) == 1 and (one.part, one.name) not in asked:
            _rename_fields(files, package, own.path, {one: meant[0]})
    own = parse_interface((files.text(own.path) or "").encode(), own.path)
    name, fields = package.name or "", [one for one in fields if one.value is None]
    types = [
        [(one.part, full_type(one.type, name)) for one in given if one.value is None]
        for given in (fields, own.fields)
    ]
    pairs = under_other_names(fields, own.fields, name) if types[0] == types[1] else []
    initials = [(one.part, wanted.name[0].lower(), one.name[0].lower()) for wanted, one in pairs]
    # `high` and `low` in place of `lower` and `higher` may be in another order
    is_crossed = any(b != a and (part, b) in {one[:2] for one in initials} for part, a, b in initials)
    if pairs and not is_crossed:
        _rename_fields(files, package, own.path, {one: wanted.name for wanted, one in pairs})
    return parse_interface((files.text(own.path) or "").encode(), own.path)


def _rename_fields(
    files: Files, package: PackageFacts, path: str, names: Mapping[InterfaceField, str]
) -> None:
    """Give fields other names, in their definition and in the code of its type; none where a name is quite another one,
    and the code has messages of ROS with a field of the old one."""
    new = {one.name: name for one, name in names.items()}
    either = "|".join(map(re.escape, new))
    # As an attribute, and by its name in a call: what else is called so is no field.
    use = re.compile(rf"(?:(?<=\.)|(?<=->))(?:{either})\b|(?<=[(,\s])(?:{either})(?==[^=])")
    texts = {f.path: files.text(f.path) or "" for f in package.files if is_own(f.path)}
    using = {
        p: use.findall(text) for p, text in texts.items() if p.endswith((".py", *CPP)) and use.search(text)
    }
    if not all(is_near(old, name) for old, name in new.items()):
        using = {p: old for p, old in using.items() if re.search(rf"\b{PurePosixPath(path).stem}", texts[p])}
        if any(_has_field(old, texts[p]) for p, found in using.items() for old in found):
            return
    for one, name in names.items():
        lines = (files.text(path) or "").split("\n")
        lines[one.line - 1] = re.sub(rf"(?<=\s){one.name}\b", name, lines[one.line - 1], count=1)
        there = [p for p, found in using.items() if one.name in found]
        fix = f"write `{one.type} {name}`" + (f", and {name} in {join_words(there)}" if there else "")
        message = f"line {one.line} of {path} calls it {one.name}, but the handout calls it {name}"
        files.change("build-line", path, "\n".join(lines), message, fix)
    for file, found in using.items():
        old = [name for name in new if name in found]
        said = f"{'fields' if len(old) > 1 else 'field'} {join_words(old)}"
        why = f"{file} uses the {said}, which the handout calls {join_words(new[name] for name in old)}"
        files.change("missing-call", file, use.sub(lambda one: new[one[0]], texts[file]), why)


def _has_field(name: str, text: str) -> bool:
    """Return whether a message of ROS that code names has a field of that name."""
    words = set(re.findall(r"\w+", text))
    known = (found for full, (found, _) in noetic_definitions().items() if full.rpartition("/")[2] in words)
    return any(re.search(rf"^\S+\s+{name}\b", found, re.MULTILINE) for found in known)


def _change_types(files: Files, own: Interface, fields: Sequence[InterfaceField], package: str) -> None:
    """Give the fields the types of the handout's `fields` where theirs cannot stand for these, and all are there: with
    other fields it would not be the handout's definition either, and what the programs do with their own would fail."""
    types = {(one.part, one.name): one.type for one in fields if one.value is None}
    if not types.keys() <= {(one.part, one.name) for one in own.fields}:
        return
    for one in own.fields:
        asked = types.get((one.part, one.name), "")
        if one.value is None and asked and _cannot_stand_for(one.type, asked, own.path, package):
            lines = (files.text(own.path) or "").split("\n")
            kind = rf"^(\s*){re.escape(one.type)}(?=\s)"
            lines[one.line - 1] = re.sub(kind, rf"\g<1>{asked}", lines[one.line - 1])
            why = f"{one.path} is {one.type}, but the handout asks for {asked}"
            message, fix = f"line {one.line} of {own.path}: {why}", f"write `{asked} {one.name}`"
            files.change("build-line", own.path, "\n".join(lines), message, fix)


def _cannot_stand_for(kind: str, asked: str, path: str, package: str) -> bool:
    """Return whether a field of one type is none of the other: in a service or an action, who calls it needs the very
    type; in a message, a number that holds the values of the other does as well."""
    names = [FULL_NAMES.get(one.partition("[")[0], one.partition("[")[0]) for one in (kind, asked)]
    lists = [one.partition("[")[2] for one in (kind, asked)]
    same = names[0].removeprefix(f"{package}/") == names[1].removeprefix(f"{package}/")
    limits = [integer_limits(one) for one in names]
    holds = limits[0] and limits[1] and limits[0][0] <= limits[1][0] <= limits[1][1] <= limits[0][1]
    alike = path.endswith(".msg") and (holds or all(one.startswith("float") for one in names))
    return lists[0] != lists[1] or not (same or alike)


def _divide(files: Files, own: Interface, fields: Sequence[InterfaceField], text: str) -> None:
    """Write the `---` that a definition has not at all, where it is plain between which of its fields they belong."""
    order, parts = PARTS[PurePosixPath(own.path).suffix], {one.name: one.part for one in fields}
    there = [(one.line, order.index(parts[one.name])) for one in own.fields if one.name in parts]
    numbers = [number for _, number in there]
    is_whole = len(there) == len(own.fields) and numbers == sorted(numbers) and len({*numbers}) == len(order)
    if DIVIDER.search(text) or not is_whole or len(order) == 1:
        return
    below = [max(line for line, number in there if number == part) for part in range(len(order) - 1)]
    lines = text.split("\n")
    for line in reversed(below):
        lines.insert(line, DIVIDING)
    fault = own.fault.message if own.fault else ""
    fix = f"write a line `---` below lines {numbers_text(below)}" if len(below) > 1 else ""
    files.change("build-line", own.path, "\n".join(lines), f"{own.path}: {fault}", fix)
