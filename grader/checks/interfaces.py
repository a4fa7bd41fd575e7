"""Whether the package's own messages, services and actions are those of the handout."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from grader.checks.registry import Refers, check
from grader.checks.support.scripts import OF_FILES, cmake_calls
from grader.checks.support.text import near_names, shown
from grader.model.file_fault import Fault
from grader.model.message_definitions import (
    BUILT_IN,
    FULL_NAMES,
    PARTS,
    WRITE_ALL,
    as_written,
    exchanged_parts,
    full_type,
    lacking_field,
    parse_definition,
    refuse_unknown,
    under_other_names,
    whole_definition,
)
from grader.model.package import Interface, InterfaceField, PackageFacts
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, passed
from grader.wording import closest, join_words, on_lines, plural

FAULTS_SHOWN = 3
NEW_NAMES = "then write the new name"
FILE_PATTERN = r"^(msg/\w+\.msg|srv/\w+\.srv|action/\w+\.action)$"
FieldType = Annotated[str, Field(pattern=r"^[A-Za-z]\w*(/[A-Za-z]\w*)?(\[\d*\])?$"), Refers("field")]


class DefinitionParams(Record):
    """Give `fields`, `constants` or both, or the whole definition as `text`.

    In a service or action, a name says its part too: `request.a`, `response.sum`, `goal.order`.
    """

    file: Annotated[str, Field(pattern=FILE_PATTERN)]
    """The file, from the package's root: `msg/Reading.msg`, `srv/AddTwoInts.srv`, `action/Count.action`."""
    fields: dict[str, FieldType] = Field(default_factory=dict)
    """Each field's type by its name; there may be others."""
    constants: dict[str, str | int | float | bool] = Field(default_factory=dict)
    """Each constant's value by its name."""
    ordered: bool = False
    """Whether the fields have to come in the order of `fields`."""
    text: str = ""
    """The whole definition, which is compared as ROS's md5 sum does: types, names, order and constants, and no others.
    Comments and blanks do not matter.
    """

    @model_validator(mode="after")
    def _is_whole(self) -> DefinitionParams:
        if bool(self.text) == bool(self.fields or self.constants):
            raise ValueError("give fields, constants or both, or text alone")
        if both := sorted(self.fields.keys() & self.constants.keys()):
            raise ValueError(f"{both[0]} is a field and a constant")
        self.wanted()
        return self

    def wanted(self) -> list[InterfaceField]:
        """Return what is asked for. Raises ValueError for a part or a type that there is not."""
        suffix = PurePosixPath(self.file).suffix
        if self.text:
            return list(parse_definition(self.text, suffix))
        given = [(name, type_, None) for name, type_ in self.fields.items()]
        given += [(name, "", str(value)) for name, value in self.constants.items()]  # type: ignore[misc]
        found = []
        for name, type_, value in given:
            part, _, bare = name.rpartition(".")
            if part not in PARTS[suffix]:
                parts = join_words((f"{part}.{bare}" for part in PARTS[suffix]), "or")
                raise ValueError(f'name it {parts.removeprefix(".")}, not "{name}"')
            if name in {*BUILT_IN, *FULL_NAMES} and type_ not in {*BUILT_IN, *FULL_NAMES} and type_.islower():
                raise ValueError(f"the name comes first, and then the type: write {type_}: {name}")
            refuse_unknown(type_)
            found.append(InterfaceField(part=part, type=type_, name=bare, value=value, line=0))
        return found


class _Fault(NamedTuple):
    message: str
    line: int | None
    hint: str
    renames: bool = False


@check("definition", params=DefinitionParams)
def definition(package: PackageFacts, params: DefinitionParams) -> Verdict:
    """The package's own message, service or action is defined as the handout asks.

    What it checks
        That the file has the handout's fields, by name and type, and its constants; in their order if the
        lab asks for that; and nothing else if the handout gives the whole definition.

    Why it matters on a robot
        Two programs understand each other only if their definitions are the same, letter by letter: a field
        with another name or type gives another md5 sum, and ROS does not connect them.

    How it is measured
        The file is read as ROS does. Comments and blanks do not matter; `Header` is `std_msgs/Header`, and a
        type without a package is the package's own.

    How to fix
        Write one field per line, with the type before the name: `float64 temperature`. Then list the file
        in `add_message_files` (`add_service_files`, `add_action_files`) of CMakeLists.txt, and build again.
    """
    found = next((one for one in package.interfaces if one.path == params.file), None)
    wanted = params.wanted()
    faults = [_not_there(package, params)] if found is None else list(_faults(found, wanted, package, params))
    if faults:
        more = f"; and {len(faults) - FAULTS_SHOWN} more" if len(faults) > FAULTS_SHOWN else ""
        said = "; ".join(fault.message for fault in faults[:FAULTS_SHOWN])
        message = f"{f'{params.file}: ' if found else ''}{said}{more}"
        hint = "; ".join(filter(None, (*_fixes(faults[:FAULTS_SHOWN]), _unlisted(found, package))))
        verdict = failed(message, hint=hint)
    else:
        verdict = passed(f"{params.file} defines {_words(wanted)}", hint=_unlisted(found, package))
    lines = dict.fromkeys(fault.line for fault in faults) or {None: None}
    there = found.path if found else "CMakeLists.txt"
    measured = _words(found.fields) if found and found.fields else "no field" if found else "no such file"
    cited = tuple(FileCitation(file=there, line=line) for line in lines) if found else ()
    return verdict.about(expected=_words(wanted), measured=measured, citations=cited)


def _unlisted(found: Interface | None, package: PackageFacts) -> str:
    """Return where to list a definition of which the build makes nothing, since only others are listed."""
    name = PurePosixPath(found.path).name if found else ""
    command = next((one for one, kind in OF_FILES.items() if name.endswith(kind)), "")
    calls = cmake_calls(package, command)
    words = {PurePosixPath(word).name for call in calls for word in call.args}
    if not name or "FILES" not in words or name in words or any("$" in word for word in words):
        return ""
    place = f"line {calls[-1].line} of {calls[-1].file}"
    near = near_names(name, words) or [word for word in words if name.startswith(f"{word}.")]
    if near:
        return f"in {command}(…), {place}, write {name} instead of {near[0]}"
    return f"list {name} in {command}(…), {place}: the build makes nothing of it yet"


def _fixes(faults: list[_Fault]) -> Iterator[str]:
    """Yield each fix once, with its line where there are several."""
    for fault in dict.fromkeys(faults):
        yield f"on line {fault.line}, {fault.hint}" if fault.line and len(faults) > 1 else fault.hint
    if renamed := sum(fault.renames for fault in faults):
        yield f"{NEW_NAMES}{'s' if renamed > 1 else ''} in your programs too"


def _words(fields: Iterator[InterfaceField] | list[InterfaceField] | tuple[InterfaceField, ...]) -> str:
    return shown(", ".join(f"{one.type} {one.path}{_value(one)}".strip() for one in fields))


def _value(one: InterfaceField) -> str:
    return "" if one.value is None else f"={one.value}"


def _not_there(package: PackageFacts, params: DefinitionParams) -> _Fault:
    wanted = PurePosixPath(params.file)
    near = closest(wanted.name, [PurePosixPath(one.path).name for one in package.interfaces], cutoff=0.7)
    other = next((one.path for one in package.interfaces if PurePosixPath(one.path).name == near), "")
    other = other or _of_same_fields(package, params)
    seen = f"; there is {shown(other)}" if other else ""
    hint = (
        f"rename it to {params.file}"
        if other
        else f"write {params.file}, and list {wanted.name} in CMakeLists.txt"
    )
    return _Fault(f"there is no {params.file}{seen}", None, hint)


def _of_same_fields(package: PackageFacts, params: DefinitionParams) -> str:
    """Return the only other file of this kind whose fields are the handout's; "" where there is none, or several."""
    asked = {(one.part, one.type, one.name) for one in params.wanted()}
    alike = [one for one in package.interfaces if one.path.endswith(PurePosixPath(params.file).suffix)]
    same = [one.path for one in alike if {(f.part, f.type, f.name) for f in one.fields} == asked]
    return same[0] if len(same) == 1 and asked else ""


def _empty(package: PackageFacts, params: DefinitionParams) -> _Fault:
    """Of a file without a field: the handout's may be written in another place."""
    if other := _of_same_fields(package, params):
        fix = f"git mv -f {shlex.quote(other)} {shlex.quote(params.file)}"
        return _Fault(f"it has no field: they are in {shown(other)}", None, fix)
    lines = whole_definition(params.wanted(), PurePosixPath(params.file).suffix)
    return _Fault("it has no field", None, WRITE_ALL.format(join_words(f"`{line}`" for line in lines)))


def _faults(
    found: Interface, wanted: list[InterfaceField], package: PackageFacts, params: DefinitionParams
) -> Iterator[_Fault]:
    if not found.fields and (found.fault is None or found.fault.kind == "OtherParts"):
        yield _empty(package, params)
        return
    if found.fault is not None:
        yield _unreadable(found, found.fault, wanted)
        return
    if exchanged := exchanged_parts(found.fields, wanted):
        moved = [part for part, other in exchanged.items() if part != other]
        parts = join_words(PARTS[PurePosixPath(found.path).suffix])
        line = min(one.line for one in found.fields if one.part in moved)
        fix = f"the order of the parts is {parts}, with `---` between them"
        yield _Fault(f"{join_words(moved)} have changed places", line, fix)
        return
    there = {(one.part, one.name): one for one in found.fields}
    asked = {(one.part, one.name) for one in wanted}
    others = {key: one for key, one in there.items() if key not in asked}
    renamed = _renamed(wanted, there, others, package.name)
    for one in wanted:
        key = one.part, one.name
        if key in renamed:
            yield _other_name(one, renamed[key])
        else:
            yield from _differs(one, there.get(key), others, package.name)
    if params.text:
        for one in (one for one in others.values() if one not in renamed.values()):
            yield _Fault(f"{shown(one.path)} (line {one.line}) is not asked for", one.line, "take it out")
    if (params.text or params.ordered) and asked <= there.keys():
        yield from _other_order(wanted, there)


def _renamed(
    wanted: list[InterfaceField],
    there: Mapping[tuple[str, str], InterfaceField],
    others: Mapping[tuple[str, str], InterfaceField],
    package: str,
) -> dict[tuple[str, str], InterfaceField]:
    """Return the fields under other names: where a part has as many others as it lacks, of the same types in order; or
    where all of its types are right, in order, and some are under the name of another field."""
    pairs = under_other_names(wanted, there.values(), package)
    found = {(a.part, a.name): b for a, b in pairs}
    lacking = [one for one in wanted if one.value is None and (one.part, one.name) not in there]
    for part in dict.fromkeys(one.part for one in lacking):
        own, given = (
            [full_type(f.type, package) for f in group if f.part == part and f.value is None]
            for group in (lacking, others.values())
        )
        whole = [
            [f for f in group if f.part == part and f.value is None] for group in (wanted, there.values())
        ]
        kinds = [[full_type(one.type, package) for one in group] for group in whole]
        if kinds[0] == kinds[1] and len({*kinds[0]}) > 1 and own != given:
            found.update({(a.part, a.name): b for a, b in zip(*whole, strict=True) if a.name != b.name})
    return found


def _other_name(wanted: InterfaceField, found: InterfaceField) -> _Fault:
    line = f"{wanted.type} {wanted.name}{_value(wanted)}".strip()
    message = f"line {found.line} calls it {found.name}, but the handout calls it {wanted.name}"
    return _Fault(message, found.line, f"write `{line}`", renames=True)


def _unreadable(found: Interface, fault: Fault, wanted: list[InterfaceField]) -> _Fault:
    """Of a line that is not a field, or of a missing `---`: it belongs below the last field of a part, or in front of
    the last part where its fields are missing too."""
    fix = fault.fix or "one field per line, type before name"
    line = fault.line
    if meant := lacking_field(fault, found.fields, wanted):
        fix = f"write `{meant.type} {meant.name}{_value(meant)}`"
    if fault.kind == "OtherParts":
        parts = {one.name: one.part for one in wanted}
        there = sorted((one for one in found.fields if one.name in parts), key=lambda one: one.line)
        ends = [a.line for a, b in pairwise(there) if parts[a.name] != parts[b.name] and a.part == b.part]
        last = PARTS[PurePosixPath(found.path).suffix][-1]
        lacking = [f"`{one.type} {one.name}`" for one in wanted if one.part == last]
        if ends:
            line = ends[0]
            fix = f"write a line `---` below {on_lines(ends)}"
        elif lacking and there and last not in (parts[one.name] for one in there):
            fix = f"at the end of the file, write a line `---`, and {join_words(lacking)} below it"
    return _Fault(shown(fault.message), line, fix)


def _differs(
    wanted: InterfaceField,
    found: InterfaceField | None,
    others: Mapping[tuple[str, str], InterfaceField],
    package: str,
) -> Iterator[_Fault]:
    name, line = wanted.path, f"{wanted.type} {wanted.name}{_value(wanted)}".strip()
    if found is None:
        near = closest(wanted.name, [one.name for one in others.values() if one.part == wanted.part])
        other = others.get((wanted.part, near))
        apart = next((one for one in others.values() if one.name == wanted.name), None)
        turned = next((one for one in others.values() if one.type == wanted.name), None)
        if turned is not None and turned.name == wanted.type:
            message = f"line {turned.line} has the name {turned.type} before its type {turned.name}"
            yield _Fault(message, turned.line, f"write `{line}`")
        elif other is not None:
            yield _other_name(wanted, other)
        elif apart is not None:
            message = f"{wanted.name} is in the {apart.part} (line {apart.line}), not in the {wanted.part}"
            yield _Fault(message, apart.line, "--- separates the parts: put the field into the other part")
        else:
            kind = "constant" if wanted.value is not None else "field"
            yield _Fault(f"there is no {kind} {name}", None, f"add the line `{as_written(wanted)}`")
    elif (wanted.value is None) != (found.value is None):
        kinds = ("constant", "field") if wanted.value is None else ("field", "constant")
        message = f"{name} is a {kinds[0]} (line {found.line}), but the handout asks for a {kinds[1]}"
        yield _Fault(message, found.line, f"write `{line}`")
    elif wanted.type and full_type(wanted.type, package) != full_type(found.type, package):
        message = f"{name} is {found.type} (line {found.line}), but the handout asks for {wanted.type}"
        yield _Fault(message, found.line, f"write `{line}`")
    elif wanted.value is not None and not _equal(wanted.value, found.value or ""):
        message = f"{name} is {shown(found.value or '')} (line {found.line}), not {wanted.value}"
        fix = f"write `{found.type} {line}`" if not wanted.type else f"write `{line}`"
        yield _Fault(message, found.line, fix)


def _equal(wanted: str, found: str) -> bool:
    try:
        # 1 and 1.0 are the same constant.
        return float(wanted) == float(found)
    except ValueError:
        return wanted.lower() == found.lower() if wanted in {"True", "False"} else wanted == found


def _other_order(
    wanted: list[InterfaceField], there: Mapping[tuple[str, str], InterfaceField]
) -> Iterator[_Fault]:
    """Constants may stand anywhere."""
    fields = [there[one.part, one.name] for one in wanted if one.value is None]
    for part in dict.fromkeys(one.part for one in fields):
        own = [one for one in fields if one.part == part]
        if [one.line for one in own] != sorted(one.line for one in own):
            first = next(b for a, b in pairwise(own) if b.line < a.line)
            names = join_words([one.name for one in own], "then")
            count = plural(len(own), "field")
            message = f"the {count} are in a different order: the handout has {names}"
            yield _Fault(message, first.line, f"order the {count} as the handout does")
