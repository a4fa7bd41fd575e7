"""Repairs of files as such: permission bits, line ends, first lines, encodings and names."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import PurePosixPath

from grader.model.package import CMAKE, MANIFEST, PackageFacts, SourceFile
from grader.model.repair import Repair, RepairKind
from grader.model.submission import chmod_hint
from grader.package.reading import LEFT_OUT
from grader.package.repairs.editing import (
    BOM,
    CODE,
    UTF16,
    Files,
    as_text,
    is_executable,
    naming_files,
    read_data,
    rename_type,
    rename_word,
)
from grader.package.repairs.names import Wanted, is_near
from grader.package.repairs.python import Name
from grader.portable import MODES_ON_DISK
from grader.wording import has_role_of, join_words

SHEBANG = "#!/usr/bin/env python3"
SHELL = "#!/bin/bash"
COOKIE = re.compile(r"^[ \t\f]*#.*?coding[:=][ \t]*([-\w.]+).*$")
SHOWN_BYTES = 200


def repair_files(files: Files, scripts: Iterable[SourceFile], started: Collection[str]) -> None:
    """Find what keeps the scripts from being started or read: bit, line ends, first line, mark, encoding. A script that
    others import and that is none of the `started` needs no bit and no first line: Python reads it."""
    for script in scripts:
        is_started = script.path in started
        if is_started and script.executable is False:
            on_disk = not MODES_ON_DISK or is_executable(files.folder, script.path)
            only_git_lacks_it = script.mode_source == "git" and on_disk
            how = chmod_hint(script.mode_source, script.path, only_git_lacks_it=only_git_lacks_it)
            message = f"{script.path} is not executable"
            files.add(Repair(kind="executable-bit", file=script.path, message=message, fix=how))
        if script.link is None and not script.binary:
            _repair_bytes(files, script, is_started=is_started)


def _repair_bytes(files: Files, script: SourceFile, *, is_started: bool) -> None:
    data = read_data(files.folder, script.path)
    if not data:
        return
    if data.startswith(UTF16) or (script.encoding == "unknown-8bit" and as_text(data) is None):
        data = _repair_encoding(files, script, data)
    if is_started and data.startswith(BOM) and data[3:5] == b"#!":
        message = (
            f"{script.path} begins with an invisible byte order mark (BOM), so it does not begin with #!"
        )
        fix = "save it as UTF-8 without BOM"
        _add_bytes(files, "byte-order-mark", script.path, data, message=message, fix=fix)
        data = data.removeprefix(BOM)
    if is_started and b"\r\n" in data and (data.startswith(b"#!") or script.path.endswith(".sh")):
        message = f"{script.path} has Windows line endings (CR LF)"
        _add_bytes(files, "line-ends", script.path, data, message=message, fix=f"dos2unix {script.path}")
    text = as_text(data)
    files.put(script.path, text)
    if text is not None and script.python:
        _repair_cookie(files, script, text)
    if text is not None and is_started and script.shebang_problem:
        _repair_shebang(files, script, text)


def _repair_cookie(files: Files, script: SourceFile, text: str) -> None:
    """Write `utf-8` in place of an encoding that Python does not know."""
    lines = text.split("\n")
    for at, line in enumerate(lines[:2]):
        named = COOKIE.match(line)
        if named is None:
            continue
        try:
            codecs.lookup(named[1])
        except LookupError:
            lines[at] = line[: named.start(1)] + "utf-8" + line[named.end(1) :]
            message = f"line {at + 1} of {script.path}: Python knows no encoding {named[1]}"
            files.change("python-syntax", script.path, "\n".join(lines), message)
        return


def _add_bytes(files: Files, kind: RepairKind, file: str, data: bytes, *, message: str, fix: str) -> None:
    first = data.split(b"\n", 1)[0][:SHOWN_BYTES].decode("utf-8", "replace")
    after = first.removeprefix("\ufeff").removesuffix("\r")
    files.add(Repair(kind=kind, file=file, line=1, before=first, after=after, message=message, fix=fix))


def _repair_encoding(files: Files, script: SourceFile, data: bytes) -> bytes:
    after = to_utf8(data)
    wide = data.startswith(UTF16)
    message = f"{script.path} is {'saved as UTF-16' if wide else 'not saved as UTF-8'}"
    old = b"" if wide else next((line for line in data.split(b"\n") if not line.isascii()), b"")
    line = data[: data.find(old)].count(b"\n")
    lines = [one[:SHOWN_BYTES].decode("utf-8", "replace") for one in (old, after.split(b"\n")[line])]
    words = {"before": lines[0], "after": lines[1], "fix": f"save {script.path} as UTF-8 in your editor"}
    files.add(Repair(kind="encoding", file=script.path, line=line + 1, message=message, **words))
    return after


def to_utf8(data: bytes) -> bytes:
    """Return the bytes as UTF-8: from UTF-16, or from the encoding of Windows in China or in western Europe."""
    if data.startswith(UTF16):
        text = data.decode("utf-16", "replace")
    else:
        encodings = OLD_ENCODINGS[not TWO_OF_CHINA.search(data) :]
        text = next(filter(None, (_decoded(data, one) for one in encodings)), "")
    lines = text.split("\n", 2)
    for number, line in enumerate(lines[:2]):
        if COOKIE.match(line):
            lines[number] = "# -*- coding: utf-8 -*-"
    return "\n".join(lines).encode()


OLD_ENCODINGS = ("gb2312", "cp1252", "latin-1")
TWO_OF_CHINA = re.compile(rb"[\xa1-\xfe]{4}")
"""Two characters of GB 2312, which comes first then. Two accents may stand together, as in Größe, but not four."""


def _decoded(data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return ""


def _repair_shebang(files: Files, script: SourceFile, text: str) -> None:
    """What a line that ends in CR, or stands behind a mark, says is judged by itself."""
    lines = text.split("\n")
    wanted = SHELL if script.path.endswith((".sh", ".bash")) else SHEBANG if script.python else ""
    problem = script.shebang_problem
    if script.shebang_fault in ("byte-order-mark", "line-end"):
        usable = script.shebang is None or script.shebang.found
        problem = "" if usable else f"there is no {script.shebang.interpreter} on a ROS machine"  # type: ignore[union-attr]
    if not wanted or not problem or script.shebang_fault == "empty-file":
        return
    first = next((i for i, line in enumerate(lines[:50]) if re.match(r"\s*(#\s*!|!\s*#)", line)), len(lines))
    looks_like = first < len(lines) and re.search(r"python|/(ba)?sh|bin/", lines[first])
    after = [wanted, *lines]
    if looks_like and all(not line.strip() or line.startswith("#") for line in lines[:first]):
        after = [wanted, *(line for line in lines[:first] if line.strip()), *lines[first + 1 :]]
    message = f"{script.path} cannot be started: {problem}"
    files.change("shebang", script.path, "\n".join(after), message, f"write {wanted} as the very first line")
    if after == [wanted, *lines]:
        files.put(script.path, text)  # what else is repaired is told by its line in the file as it is


# ---- names of files


def find_renames(package: PackageFacts, wanted: Wanted) -> dict[str, str]:
    """Return the paths of files whose names are nearly those that are wanted, and their paths with the right names."""
    present = [f.path for f in package.files if is_own(f.path) and f.link is None]
    names = {PurePosixPath(path).name for path in present}
    right = {PurePosixPath(path).name: path for path in _wanted_files(wanted)}
    programs = package.cmake.executables if package.cmake is not None else ()
    names |= {name for name in right if any(one.is_called(name) for one in programs)}
    renames: dict[str, str] = {}
    for name, path in right.items():
        free = [p for p in present if p not in renames and PurePosixPath(p).name not in right]
        near = [p for p in free if _is_slip(p, name)]
        if name not in names and near:
            old = min(near, key=lambda p: (PurePosixPath(p).parent != PurePosixPath(path).parent, p))
            renames[old] = str(PurePosixPath(old).with_name(name))
        elif name not in names:
            other = {*right, *renames}
            meant = _meant_launch(package, wanted, name, renames)
            meant = meant or _meant_script(package, wanted, name, other)
            meant = meant or _meant_definition(package, wanted, name, other)
            renames |= {meant: str(PurePosixPath(meant).with_name(name))} if meant else {}
    return renames


def _meant_script(package: PackageFacts, wanted: Wanted, name: str, others: set[str]) -> str:
    """Return the only script that has all of the topics of the one of this name, and makes the lab's node or is called
    by another word for it; "" if there is none. One that only has the topics, where the lab names no node, may do
    something else, and so may one that has some of them, such as a handed out one."""
    does = [
        (kind, used.lstrip("/"))
        for path, kind, used in wanted.does
        if PurePosixPath(path).name == name and kind not in OF_SERVICES
    ]
    topics = {one for one in does if one[0] != "node-name"}
    nodes = {one for one in does if one[0] == "node-name"}
    found: dict[str, set[tuple[str, str]]] = {}
    for slip in package.slips:
        if slip.file not in others and PurePosixPath(slip.file).name not in others:
            found.setdefault(slip.file, set()).add((slip.kind, slip.message.lstrip("/")))
    does_it = {path: done for path, done in found.items() if does and topics <= done}
    called = [path for path in does_it if topics and has_role_of(path, name)]
    meant = [path for path, done in does_it.items() if nodes & done] or called
    if not meant:  # `talker_pub.py` for `talker.py`, whatever its topic is called
        kinds, word = {kind for kind, _ in topics}, PurePosixPath(name).stem.casefold()
        folders = {PurePosixPath(path).parent for path, *_ in wanted.does if PurePosixPath(path).name == name}
        alike = [PurePosixPath(path) for path, done in found.items() if kinds & {kind for kind, _ in done}]
        words = {path: re.split(r"[_-]", path.stem.casefold()) for path in alike if path.parent in folders}
        meant = [str(path) for path, parts in words.items() if word in parts]
    return meant[0] if len(meant) == 1 else ""


def _meant_definition(package: PackageFacts, wanted: Wanted, name: str, others: set[str]) -> str:
    """Return the only definition of the kind that has exactly the fields of the one of this name; "" otherwise."""
    fields = dict(wanted.definitions).get(
        next((f for f, _ in wanted.definitions if f.endswith(f"/{name}")), "")
    )
    asked = {(one.part, one.type, one.name) for one in fields or ()}
    found = [
        one.path
        for one in package.interfaces
        if one.path.endswith(PurePosixPath(name).suffix)
        and not {one.path, PurePosixPath(one.path).name} & others
        and {(field.part, field.type, field.name) for field in one.fields} == asked
    ]
    return found[0] if asked and len(found) == 1 else ""


def _meant_launch(package: PackageFacts, wanted: Wanted, name: str, renames: Mapping[str, str]) -> str:
    """Return the only launch file that starts what the one of this name has to start, by the names that the scripts
    have before `renames`; "" if there is none."""
    before = {PurePosixPath(new).name: PurePosixPath(old).name for old, new in renames.items()}
    asked = {script for launch, script in wanted.started if PurePosixPath(launch).name == name}
    right = {PurePosixPath(path).name for path in _wanted_files(wanted)}
    starting = package.launches_of({before.get(script, script) for script in asked})
    found = [path for path in starting if PurePosixPath(path).name not in right and path not in renames]
    return found[0] if len(found) == 1 else ""


def rename_files(files: Files, renames: dict[str, str]) -> None:
    """Give files their names, here and where the build files and launch files name them."""
    for old, new in renames.items():
        name = PurePosixPath(new).name
        message = f"{old} should be called {name}"
        fix = f"git mv {old} {new}"
        others = [file for file in naming_files(files.folder) if file != old]
        naming = [file for file in others if _put_word(files, file, PurePosixPath(old).name, name)]
        words = f"{fix}, and write {name} in {join_words(naming)}" if naming else fix
        code = [
            file
            for file in naming_files(files.folder, CODE)
            if _put_word(files, file, PurePosixPath(old).name, name, rename_type)
        ]
        if code:
            stems = f"{PurePosixPath(new).stem} instead of {PurePosixPath(old).stem}"
            words += f", and {stems} in {join_words(code)}"
        files.add(Repair(kind="file-name", file=old, before=old, after=new, message=message, fix=words))
        files.rename(old, new)


def _put_word(
    files: Files, file: str, old: str, new: str, rename: Callable[[str, str, str], str] = rename_word
) -> bool:
    text = files.text(file)
    if text is None or (changed := rename(text, old, new)) == text:
        return False
    files.put(file, changed)
    return True


# ---- two files that hold each other's code

OF_SERVICES = {"server": "client", "client": "server"}
OTHER_END = {"publisher": "subscriber", "subscriber": "publisher", **OF_SERVICES}


def exchange_files(files: Files, names: Mapping[str, Sequence[Name]], wanted: Wanted) -> None:
    """Find two scripts of the lab each of which does just what the other should. Such a repair is the last one: the
    others are told by the names that the files have."""
    asked = {PurePosixPath(path).name for path in wanted.scripts}
    scripts = [path for path in names if PurePosixPath(path).name in asked]
    for one, other in combinations(scripts, 2):
        if _holds(one, other, names, wanted) and _holds(other, one, names, wanted):
            parts = PurePosixPath(one), PurePosixPath(other)
            what = f"{one} holds the code of {parts[1].name}, and {other} that of {parts[0].name}"
            away = parts[0].with_stem(f"{parts[0].stem}_other")
            fix = f"exchange the two files: mv {one} {away} && mv {other} {one} && mv {away} {other}"
            files.add(
                Repair(kind="exchanged-files", file=one, before=one, after=other, message=what, fix=fix)
            )
            return


def _doing(wanted: Wanted) -> dict[str, set[tuple[str, str]]]:
    """Return what each script has to do, by its name."""
    found: dict[str, set[tuple[str, str]]] = {}
    for path, kind, used in wanted.does:
        found.setdefault(PurePosixPath(path).name, set()).add((kind, used.strip("/")))
    return found


def _holds(path: str, other: str, names: Mapping[str, Sequence[Name]], wanted: Wanted) -> bool:
    """Return whether a script does all that the other should, or at least the counterpart of what it should itself, and
    nothing of that."""
    doing = _doing(wanted)
    own, meant = (doing.get(PurePosixPath(file).name, set()) for file in (path, other))
    roles = {"node": "node-name"}
    found = {(roles.get(one.role, one.role), one.value.strip("/")) for one in names[path]}
    asked = {one for one in meant - own if one[0] != "node-name"}
    ends = {(OTHER_END[role], name) for role, name in own if role != "node-name"}
    return not found & (own - meant) and (asked or ends) != set() and (asked or ends) <= found


def _wanted_files(wanted: Wanted) -> Iterator[str]:
    yield from (MANIFEST, CMAKE)
    yield from (*wanted.scripts, *wanted.launch_files, *wanted.files, *wanted.installed)


def _is_slip(path: str, name: str) -> bool:
    """One letter or capitals; of a script or launch file, the suffix may be missing, and is else right."""
    given, right = PurePosixPath(path), PurePosixPath(name)
    if name in (MANIFEST, CMAKE):
        return given.name == path and (is_near(path, name) or path == f"{name}.txt")
    return (
        is_near(given.name, name)
        or given.name == f"{name}.txt"
        or (right.suffix == ".launch" and given.name == f"{right.stem}.xml")
        or given.name == right.stem
        or (given.suffix == right.suffix and is_near(given.stem, right.stem))
    )


def is_own(path: str) -> bool:
    """Return whether the student wrote it; what a build made is none of theirs."""
    return not LEFT_OUT & set(PurePosixPath(path).parts[:1])
