"""Lines of `CMakeLists.txt` without which nothing builds, or which the lab asks for, and the package's name."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import takewhile
from pathlib import PurePosixPath

from cmake_parser.ast import Command, Token

from grader.installable import known_packages, noetic_messages
from grader.model.message_definitions import DIVIDER, PARTS, exchanged_parts, meant_type
from grader.model.package import CMAKE, INTERFACE_FOLDERS, MANIFEST, PackageFacts, meant_command
from grader.model.repair import RepairKind
from grader.package.cmake_parse import commands_of, join_half_comment, parse_tree_of
from grader.package.cmake_slips import find_slip, is_open
from grader.package.manifest import parse_manifest
from grader.package.repairs.editing import Files, naming_files, rename_word
from grader.package.repairs.files import is_own
from grader.package.repairs.manifest import OF_ROS, declare_for_running
from grader.package.repairs.names import CPP, Wanted, is_near
from grader.wording import is_one_edit, join_words, lines_text

BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"
INSTALL = "catkin_install_python"
CALL_LINES_MAX = 30
OF_WORKSPACE = "catkin_workspace"
OF_GENERATION = re.compile(r"_generate_messages|_gen(cpp|py)$")
"""Targets that generate_messages(…) makes."""
GENERATE, GENERATION = "generate_messages", "message_generation"


# ---- the name


def rename_package(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Find a name in the manifest in place of which the lab's is meant; whatever else has it follows."""
    text = files.text(MANIFEST)
    manifest, _ = parse_manifest(text.encode()) if text is not None else (None, None)
    if text is None or manifest is None or not _is_meant(files, package, manifest.name, wanted.package):
        return
    old, new = manifest.name, wanted.package
    message = f"line {manifest.name_line} of {MANIFEST}: the package is called {old}, not {new}"
    fix = f'write {new} instead of {old} in {MANIFEST}, in project(…) and in every pkg="…"'
    files.change("package-name", MANIFEST, rename_word(text, old, new), message, fix)
    for file in naming_files(files.folder):
        other = files.text(file)
        if file != MANIFEST and other is not None:
            files.put(file, rename_word(other, old, new))


def _is_meant(files: Files, package: PackageFacts, name: str, wanted: str) -> bool:
    """Return whether the name is nearly the lab's, or the package has another one elsewhere: CMakeLists.txt the lab's,
    or all launch files the lab's or the folder's."""
    projects = [words[0].value for command in _commands(files, "project") if (words := _words(command))]
    launched = {node.pkg for launch in package.launch_files for node in launch.nodes}
    others = {wanted, PurePosixPath(package.path).name} - {name}
    called = projects == [wanted] or (bool(launched & others) and name not in launched)
    return is_near(name, wanted) or (name != wanted and called)


# ---- CMakeLists.txt


def repair_cmake(
    files: Files, package: PackageFacts, name: str, wanted: Wanted, scripts: Collection[str]
) -> None:
    """Find what `CMakeLists.txt` lacks. `name` is the package's name in the manifest, `scripts` are those that are
    run."""
    if files.text(CMAKE) is None:
        return
    _correct_line(files)
    _close_bracket(files)
    if commands_of(_cmake(files).encode()) is None or _is_of_workspace(files):
        return
    _spell_commands(files)
    _spell_keywords(files)
    _correct_version(files)
    needs = " ".join(wanted.dependencies or ("rospy", "std_msgs"))
    if not _has(files, package, "project"):
        _add_call(files, "project(…)", f"project({name or wanted.package})", ("cmake_minimum_required",))
    _move_project(files)
    _spell_catkin(files)
    if not _calls_catkin(files, package):
        line = f"find_package(catkin REQUIRED COMPONENTS {needs})"
        _add_call(files, "find_package(catkin …)", line, ("project",))
    if not _has(files, package, "catkin_package"):
        below = (GENERATE, "find_package", "project")
        _add_call(files, "catkin_package()", "catkin_package()", below)
    if _needs_interfaces(files, package, name, scripts):
        _make_interfaces(files, package, name, scripts)
        _exchange_parts(files, package, wanted)
    _name_programs(files, wanted)
    if not package.folder_beside:  # what it names is right once it lies there itself
        _install(files, package, wanted)
        _correct_paths(files, package)
    _link_programs(files)
    _correct_include(files)
    _declare_exported(files)
    _name_project(files, package, name, wanted.package)


def _is_of_workspace(files: Files) -> bool:
    """Return whether the file is what `catkin_init_workspace` makes: the package needs one of its own."""
    return bool(_commands(files, OF_WORKSPACE)) and not _commands(files, "catkin_package")


def _cmake(files: Files) -> str:
    return files.text(CMAKE) or ""


def _commands_of(files: Files) -> list[Command]:
    return commands_of(_cmake(files).encode()) or []


def _commands(files: Files, *names: str) -> list[Command]:
    return [c for c in _commands_of(files) if c.identifier.lower() in names]


def _words(command: Command) -> list[Token]:
    return [token for token in command.args if token.kind != "COMMENT"]


def _has(files: Files, package: PackageFacts, name: str) -> bool:
    told = package.cmake.calls if package.cmake is not None else ()
    return bool(_commands(files, name)) or any(call.name == name for call in told)


def _calls_catkin(files: Files, package: PackageFacts) -> bool:
    told = package.cmake.calls if package.cmake is not None else ()
    written = [[t.value for t in _words(c)] for c in _commands(files, "find_package")]
    known = [list(c.args) for c in told if c.name == "find_package"]
    return any(words[:1] == ["catkin"] for words in (*written, *known))


def _spell_catkin(files: Files) -> None:
    """Write the name of catkin as the first word of find_package(…): in place of a slip of it, or in front of what is
    there in its place."""
    for command in _commands(files, "find_package"):
        words = _words(command)
        first = words[0] if words else None
        if first is None or first.value == "catkin":
            continue
        behind = next((word for word in words[1:] if word.value == "catkin"), None)
        text = _cmake(files)
        if first.value in ("REQUIRED", "COMPONENTS"):
            text = _replace_token(text, behind, "") if behind is not None else text
            text, fix = (
                _replace_token(text, first, f"catkin {first.value}"),
                f"write catkin before {first.value}",
            )
        elif is_near(first.value, "catkin"):
            text, fix = _replace_token(text, first, "catkin"), f"write catkin instead of {first.value}"
        else:
            continue
        message = f"line {command.line} of {CMAKE}: find_package(…) names {first.value}, and not catkin"
        files.change("build-line", CMAKE, text, message, fix)
        return


KEYWORDS = {
    "cmake_minimum_required": ("VERSION",),
    "find_package": ("REQUIRED", "COMPONENTS"),
    "add_message_files": ("FILES",),
    "add_service_files": ("FILES",),
    "add_action_files": ("FILES",),
    "generate_messages": ("DEPENDENCIES",),
    INSTALL: ("PROGRAMS", "DESTINATION"),
}
"""Words of these calls that have to be in capitals and spelt so."""
FIRST = {"cmake_minimum_required": "VERSION", INSTALL: "PROGRAMS"}
"""The words without which these calls mean nothing, and that come first."""


def _spell_keywords(files: Files) -> None:
    """Spell the keywords of calls right, and write those that have to be the first word."""
    for name, keywords in KEYWORDS.items():
        for at in range(len(_commands(files, name))):
            for keyword in keywords:
                words = _words(_commands(files, name)[at])
                stray = next(
                    (w for w in words if is_near(w.value, keyword) and w.value not in keywords), None
                )
                if stray is not None and keyword not in [w.value for w in words]:
                    message = f"line {stray.line} of {CMAKE}: {name}(…) has no keyword {stray.value}: it is {keyword}"
                    changed = _replace_token(_cmake(files), stray, keyword)
                    files.change("build-line", CMAKE, changed, message)
            _put_first(files, name, _words(_commands(files, name)[at]))


def _put_first(files: Files, name: str, words: Sequence[Token]) -> None:
    right = FIRST.get(name, "")
    values = [word.value for word in words]
    if not right or not words or values[0] == right or "$" in values[0] or values[0].upper() == right:
        return
    text = _cmake(files)
    behind = words[values.index(right)] if right in values else None
    text = _replace_token(text, behind, "") if behind is not None else text
    message = f"line {words[0].line} of {CMAKE}: {name}(…) does not begin with {right}"
    fix = f"write {right} before {values[0]}"
    files.change("build-line", CMAKE, _replace_token(text, words[0], f"{right} {values[0]}"), message, fix)


def _correct_version(files: Files) -> None:
    """Give cmake_minimum_required(VERSION …) a version that there is."""
    for command in _commands(files, "cmake_minimum_required"):
        words = _words(command)
        given = words[1] if len(words) > 1 else None
        if [word.value for word in words] == ["VERSION"]:
            message = f"line {command.line} of {CMAKE}: {command.identifier}(…) has no version"
            files.change(
                "build-line", CMAKE, _replace_token(_cmake(files), words[0], "VERSION 3.0.2"), message
            )
            return
        right = re.fullmatch(r"[23](\.\d+){1,3}(\.\.\.[\d.]+)?", given.value) if given is not None else None
        if given is not None and right is None and "$" not in given.value:
            message = f"line {given.line} of {CMAKE}: there is no version {given.value} of CMake"
            files.change("build-line", CMAKE, _replace_token(_cmake(files), given, "3.0.2"), message)


def _replace_token(text: str, token: Token, new: str) -> str:
    return text[: token.span.start] + new + text[token.span.stop :]


def _correct_line(files: Files) -> None:
    """Correct the one line with which the file cannot be read, or a variable is not closed."""
    text = _cmake(files)
    fault = parse_tree_of(text.encode(), CMAKE)[1]
    words = [token for command in _commands_of(files) for token in _words(command)]
    line = fault.line if fault is not None else next((t.line for t in words if is_open(t.value)), None)
    slip = find_slip(text, line or 0) if join_half_comment(text) is None else None
    if slip is not None:
        message = f"line {slip.number} of {CMAKE}: {slip.why}"
        files.change("build-line", CMAKE, slip.text, message, slip.fix)


def _close_bracket(files: Files) -> None:
    """Take a call wholly out of its comment, begin one whose first line is missing, or close a bracket: where its call
    ends, else at the end of the last line that is not a comment, or on a line of its own."""
    text = _cmake(files)
    if commands_of(text.encode()) is not None:
        return
    if half := join_half_comment(text):
        files.change(
            "build-line", CMAKE, half.text, f"line {half.line} of {CMAKE}: {half.cause}: {half.fix}", half.fix
        )
        return
    lines = text.rstrip().split("\n")
    fault = parse_tree_of(text.encode(), CMAKE)[1]
    if fault is not None and (place := _PLACE.fullmatch(fault.fix)):
        number, begins = int(place["above"] or place["end"]), place["head"]
        changed = [*lines[: number - 1], begins or f"{lines[number - 1]})", *lines[number - bool(begins) :]]
        if commands_of("\n".join(changed).encode()) is not None:
            message = f"line {fault.line} of {CMAKE}: {fault.cause}"
            files.change("build-line", CMAKE, "\n".join([*changed, ""]), message)
            return
    last = max((i for i, line in enumerate(lines) if line.split("#", maxsplit=1)[0].strip()), default=0)
    for added in ([lines[last] + ")"], [lines[last], ")"]):
        changed = [*lines[:last], *added, *lines[last + 1 :], ""]
        if commands_of("\n".join(changed).encode()) is not None:
            message = f"line {last + 1} of {CMAKE}: an opening bracket is never closed"
            files.change("build-line", CMAKE, "\n".join(changed), message)
            return


_PLACE = re.compile(
    r"write `\)` at the end of line (?P<end>\d+)|above line (?P<above>\d+), write `(?P<head>.+)`"
)
"""Where a bracket is to be closed, or a call to be begun."""


def _spell_commands(files: Files) -> None:
    """Spell commands right that have nearly the name of a known one, unless the file defines them."""
    defined = {words[0].value.lower() for c in _commands(files, "function", "macro") if (words := _words(c))}
    for command in reversed(_commands_of(files)):
        name = command.identifier
        right = "" if name.lower() in defined else meant_command(name.lower())
        if right:
            text, start = _cmake(files), command.span.start
            start = text.index(name, start)
            message = f"line {command.line} of {CMAKE}: there is no command {name}; it is called {right}"
            files.change("build-line", CMAKE, text[:start] + right + text[start + len(name) :], message)


def _correct_include(files: Files) -> None:
    """`INCLUDE_DIRS include`, which `catkin_create_pkg` writes in a comment, in a package without such a folder."""
    for call in _commands(files, "catkin_package"):
        words = _words(call)
        at = next((i for i, t in enumerate(words) if t.value == "INCLUDE_DIRS"), len(words))
        given = list(takewhile(lambda token: not token.value.isupper(), words[at + 1 :]))
        absent = [t for t in given if "$" not in t.value and not (files.folder / t.value.strip('"')).is_dir()]
        if not absent:
            continue
        text = _cmake(files)
        taken = [words[at], *absent] if absent == given else absent
        for token in reversed(taken):
            text = _replace_token(text, token, "")
        listed = " ".join(t.value for t in absent)
        folders = join_words(f"the folder {t.value.strip('/')}/" for t in absent)
        message = (
            f"line {call.line} of {CMAKE}: catkin_package(…) names {folders}, which is not in the package"
        )
        fix = f"remove INCLUDE_DIRS {listed}" if absent == given else f"remove {listed} from INCLUDE_DIRS"
        files.change("build-line", CMAKE, text, message, fix)
        return


def _link_programs(files: Files) -> None:
    """Link ROS to programs that nothing is linked to. A program without ROS is none the worse for it."""
    linked = {words[0].value for c in _commands(files, "target_link_libraries") if (words := _words(c))}
    for call in _commands(files, "add_executable"):
        words = _words(call)
        if words and words[0].value not in linked and "IMPORTED" not in [t.value for t in words]:
            text, line = _cmake(files), f"target_link_libraries({words[0].value} ${{catkin_LIBRARIES}})"
            at = call.span.stop
            message = f"line {call.line} of {CMAKE}: nothing is linked to the program {words[0].value}"
            files.change("build-line", CMAKE, f"{text[:at]}\n{line}{text[at:]}", message)


def _declare_exported(files: Files) -> None:
    """Declare in `package.xml` what `catkin_package(CATKIN_DEPENDS …)` names, as catkin asks for."""
    for call in _commands(files, "catkin_package"):
        for name in _values_of(call, "CATKIN_DEPENDS"):
            meant = [one for one in _declared(files) if is_one_edit(name, one) or name.lower() == one]
            token = next(t for t in _words(call) if t.value == name)
            known = {*_declared(files), *known_packages(), *noetic_messages(), *OF_ROS}
            if name not in known and len(meant) == 1:
                message = (
                    f"line {call.line} of {CMAKE}: catkin_package(…) names {name}, which is called {meant[0]}"
                )
                fix = f"write {meant[0]} instead of {name}"
                files.change(
                    "build-line", CMAKE, _replace_token(_cmake(files), token, meant[0]), message, fix
                )
            elif re.fullmatch(r"\w+", name):
                message = (
                    f"line {call.line} of {CMAKE}: catkin_package(…) names {name}, and {MANIFEST} does not"
                )
                declare_for_running(files, name, message)


def _declared(files: Files) -> set[str]:
    """Return the packages that `package.xml` names."""
    manifest, _ = parse_manifest((files.text(MANIFEST) or "").encode())
    return {one.name for one in manifest.dependencies} if manifest is not None else set()


# ---- messages, services and actions of the package's own


def _needs_interfaces(files: Files, package: PackageFacts, name: str, scripts: Collection[str]) -> bool:
    """Return whether what is run uses the package's own definitions, or the build asks for what is made of them. Those
    of another exercise in the same package keep nothing from running."""
    asked = any(word.kind != "COMMENT" and OF_GENERATION.search(word.value) for word in _all_words(files))
    run = [f.path for f in package.files if is_own(f.path) and (f.path in scripts or f.path.endswith(CPP))]
    return asked or bool(_commands(files, GENERATE)) or bool(_used_kinds(files, package, name, run))


def _all_words(files: Files) -> Iterator[Token]:
    for command in commands_of(_cmake(files).encode()) or []:
        yield from command.args


def _make_interfaces(files: Files, package: PackageFacts, name: str, scripts: Collection[str]) -> None:
    """Find what CMakeLists.txt lacks to make the package's own messages, services and actions, where code uses them.

    One that only other scripts than those that are run would use is not added to those that the file names already.
    """
    code = [f.path for f in package.files if is_own(f.path) and (f.python or f.path.endswith(CPP))]
    used = _used_kinds(files, package, name, code)
    made = {c: _definitions(package, folder) for c, folder in INTERFACE_FOLDERS.items() if folder in used}
    if not any(made.values()):
        return
    _correct_types(files, package)
    _generate(files, package)  # from below, so that the lines above stay where they are
    run = [path for path in code if path in scripts or path.endswith(CPP)]
    needed = {word for path in run for word in re.findall(r"\w+", files.text(path) or "")}
    needed |= {
        word for one in package.interfaces for field in one.fields for word in re.findall(r"\w+", field.type)
    }
    for call, names in reversed(made.items()):
        _name_definitions(files, call, names, needed)
    of_catkin = [
        c for c in _commands(files, "find_package") if [t.value for t in _words(c)][:1] == ["catkin"]
    ]
    named = [token.value for call in of_catkin for token in _words(call)]
    if (
        of_catkin
        and not {GENERATION, "genmsg"}.intersection(named)
        and not any("$" in word for word in named)
    ):
        words = _words(of_catkin[0])
        near = next((token for token in words if is_one_edit(token.value, GENERATION)), None)
        if near is not None:
            message = f"line {of_catkin[0].line} of {CMAKE}: there is no package {near.value}"
            fix = f"write {GENERATION} instead of {near.value}"
            files.change("build-line", CMAKE, _replace_token(_cmake(files), near, GENERATION), message, fix)
            return
        listed = next((t for t in words if t.value == "COMPONENTS"), None)
        token, new = (listed, GENERATION) if listed else (words[-1], f"COMPONENTS {GENERATION}")
        changed = _replace_token(_cmake(files), token, f"{token.value} {new}")
        message = f"line {of_catkin[0].line} of {CMAKE}: find_package(catkin …) does not name {GENERATION}"
        files.change("build-line", CMAKE, changed, message, f"write {new} after {token.value}")


def _exchange_parts(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Put the parts of a service or an action into their order, where whole parts have changed places."""
    for path, fields in wanted.definitions:
        own = next((one for one in package.interfaces if one.path == path and one.fault is None), None)
        text = files.text(path)
        places = exchanged_parts(own.fields, fields) if own else {}
        if not places or text is None:
            continue
        order = PARTS[PurePosixPath(path).suffix]
        parts = [part.strip("\n") for part in DIVIDER.split(text)]
        changed = "\n---\n".join(parts[order.index(places.get(part, part))] for part in order)
        moved = join_words(part for part, other in places.items() if part != other)
        fix = f"the order of the parts is {join_words(order)}, with `---` between them"
        files.change("build-line", path, f"{changed}\n", f"{path}: {moved} have changed places", fix)


def _name_programs(files: Files, wanted: Wanted) -> None:
    """Give the program of a source that has the lab's name this name too."""
    made = {
        words[0]: words[1:]
        for c in _commands(files, "add_executable")
        if (words := [t.value for t in _words(c)])
    }
    if "OUTPUT_NAME" in _cmake(files):
        return
    for name in (one for one in wanted.scripts if "." not in one and "/" not in one and one not in made):
        stems = {
            target: {PurePosixPath(source).stem for source in sources} for target, sources in made.items()
        }
        meant = [
            t for t, found in stems.items() if t not in wanted.scripts and "$" not in t and name in found
        ]
        if len(meant) != 1:
            continue
        call = next(c for c in _commands(files, "add_executable") if _words(c)[0].value == meant[0])
        changed = re.sub(rf"(?<![\w/.-]){re.escape(meant[0])}(?![\w/.-])", name, _cmake(files))
        message = f"line {call.line} of {CMAKE}: the program is called {meant[0]}, and the lab wants {name}"
        files.change(
            "build-line", CMAKE, changed, message, f"write {name} in place of {meant[0]} wherever it is named"
        )


def _correct_types(files: Files, package: PackageFacts) -> None:
    """Give fields of which there is no type the one that is meant."""
    own = {PurePosixPath(one.path).stem for one in package.interfaces}
    for one in package.interfaces:
        for field in one.fields:
            right, lines = (
                meant_type(field.type, own, noetic_messages()),
                (files.text(one.path) or "").split("\n"),
            )
            if right != field.type and field.line <= len(lines):
                lines[field.line - 1] = lines[field.line - 1].replace(field.type, right, 1)
                message = f"line {field.line} of {one.path}: there is no field type `{field.type}`"
                files.change("build-line", one.path, "\n".join(lines), message)


def _definitions(package: PackageFacts, folder: str) -> list[str]:
    paths = (PurePosixPath(file.path) for file in package.files)
    return sorted(p.name for p in paths if str(p.parent) == folder and p.suffix == f".{folder}")


def _used_kinds(files: Files, package: PackageFacts, name: str, sources: Iterable[str]) -> set[str]:
    """Return of which folders of definitions these sources import, or include, what is made of them: itself, or in a
    field of another definition. Which one a header of C++ is made of is not asked."""
    made = re.compile(rf"\b{re.escape(name)}(?:\.(msg|srv)\b|/\w+\.h\b)")
    found = {one[1] for path in sources for one in made.finditer(files.text(path) or "")}
    paths = [PurePosixPath(one.path) for one in package.interfaces]
    folders = {path.stem: path.parent.name for path in paths}
    fields = {field.type.partition("[")[0] for one in package.interfaces for field in one.fields}
    inner = {folders.get(kind.removeprefix(f"{name}/"), "") for kind in fields} if found else set[str]()
    used = set(INTERFACE_FOLDERS.values()) if None in found else found | inner
    return used | ({"action"} if "msg" in used else set())


def _values_of(call: Command, keyword: str) -> list[str]:
    words = [token.value for token in _words(call)]
    behind = words[words.index(keyword) + 1 :] if keyword in words else []
    return list(takewhile(lambda word: not word.isupper(), behind))


def _name_definitions(files: Files, name: str, made: Sequence[str], needed: Collection[str]) -> None:
    """Name them in the call, in place of files that do not exist and have nearly their names, or beside others if
    `needed` has their types."""
    if made and not _commands(files, name):
        line, below = f"{name}(FILES {' '.join(made)})", ("find_package", "project")
        _add_call(files, f"{name}(…)", line, below, made)
    for file in made:
        call = _commands(files, name)[0]
        named = {word for one in _commands(files, name) for word in _values_of(one, "FILES")}
        if file in named or any("$" in word for word in named):
            continue
        stray = next((word for word in sorted(named - {*made}) if is_near(word, file)), "FILES")
        if stray == "FILES" and named and PurePosixPath(file).stem not in needed:
            continue
        token = next((t for one in _commands(files, name) for t in _words(one) if t.value == stray), None)
        if token is not None:
            new, place = (f"FILES {file}", "after") if stray == "FILES" else (file, "instead of")
            message = f"line {call.line} of {CMAKE}: {name}(…) does not name {file}"
            changed = _replace_token(_cmake(files), token, new)
            files.change("build-line", CMAKE, changed, message, f"write {file} {place} {stray}")


def _generate(files: Files, package: PackageFacts) -> None:
    """Call generate_messages(…) where nothing does, with the packages whose types are used, above catkin_package(…)."""
    calls, of_catkin = _commands(files, GENERATE), _commands(files, "catkin_package")
    types = {field.type for one in package.interfaces for field in one.fields}
    needed = {"std_msgs"} if types & {"Header", "Header[]"} else set[str]()
    needed |= {"actionlib_msgs"} if any(one.path.endswith(".action") for one in package.interfaces) else set()
    needed |= {name.partition("/")[0] for name in types if "/" in name} - {package.name}
    if not calls:
        line = f"{GENERATE}({' '.join(['DEPENDENCIES', *sorted(needed)] if needed else [])})"
        _add_call(files, f"{GENERATE}(…)", line, (*INTERFACE_FOLDERS, "find_package"), sorted(needed))
        return
    if of_catkin and calls[0].line > of_catkin[0].line:
        text, call, at = _cmake(files), calls[0].span, of_catkin[0].span.start
        changed = f"{text[:at]}{text[call]}\n\n{text[at : call.start].rstrip()}\n{text[call.stop :].lstrip()}"
        message = f"line {calls[0].line} of {CMAKE}: {GENERATE}(…) is called after catkin_package(…)"
        fix = f"move {GENERATE}(…), from line {calls[0].line}, above catkin_package(…)"
        files.change("build-line", CMAKE, changed, message, fix)
    call = _commands(files, GENERATE)[0]
    missing = sorted(needed - {token.value for token in _words(call)})
    if missing and not any("$" in token.value for token in _words(call)):
        text, listed = _cmake(files), " ".join(missing)
        token = next((t for t in _words(call) if t.value == "DEPENDENCIES"), None)
        at = token.span.stop if token else text.index("(", call.span.start) + 1
        added = f" {listed}" if token else f"DEPENDENCIES {listed}"
        message = f"line {call.line} of {CMAKE}: {GENERATE}(…) does not name {join_words(missing)}"
        fix = f"write {listed} after DEPENDENCIES" if token else f"write {GENERATE}({added})"
        files.change("build-line", CMAKE, text[:at] + added + text[at:], message, fix)


def _move_project(files: Files) -> None:
    """Call project(…) above catkin_package(…), which asks for the project's name."""
    project, of_catkin = _commands(files, "project"), _commands(files, "catkin_package")
    if not project or not of_catkin or project[0].line < of_catkin[0].line:
        return
    call = project[0]
    first = next((c for c in _commands(files, "find_package", "catkin_package")), call).span.start
    text, span = _cmake(files), call.span
    changed = f"{text[:first]}{text[span]}\n{text[first : span.start].rstrip()}\n{text[span.stop :].lstrip()}"
    message = f"line {call.line} of {CMAKE}: project(…) is called after catkin_package(…)"
    above = text.count("\n", 0, first) + 1
    files.change("build-line", CMAKE, changed, message, f"move it above line {above}")


def _name_project(files: Files, package: PackageFacts, name: str, wanted: str) -> None:
    """Name the project. A manifest in whose name the lab's is meant gets that name later."""
    right = wanted if _is_meant(files, package, name, wanted) else name
    for command in _commands(files, "project")[:1]:
        words = _words(command)
        if not words:
            text, at = _cmake(files), command.span.stop - 1
            message = f"line {command.line} of {CMAKE}: project(…) has no name"
            files.change("build-line", CMAKE, f"{text[:at]}{name}{text[at:]}", message)
        if words and words[0].value.strip('"') not in (name, right) and "$" not in words[0].value:
            given = words[0].value
            message = f"line {command.line} of {CMAKE}: project({given}) is not the package's name, {name}"
            kind: RepairKind = "package-name" if is_near(given, name) else "build-line"
            both = f"write project({wanted}) here, and <name>{wanted}</name> in {MANIFEST}"
            fix = both if wanted and wanted != right else ""
            files.change(kind, CMAKE, _replace_token(_cmake(files), words[0], name), message, fix)


def _add_call(files: Files, what: str, line: str, below: Sequence[str], names: Sequence[str] = ()) -> None:
    """Take the call out of its comment, write it in place of a comment that has not the `names`, or write it below the
    first of these commands that is there; without one, at the end of the file, and project(…) at its beginning."""
    text = _cmake(files)
    lines = text.split("\n")
    name, _, first = line.partition("(")
    commented = _commented(text, rf"{name}\s*\(" + (r"\s*catkin\b" if first.startswith("catkin ") else ""))
    fix = ""
    if commented is not None:
        at, call = commented
        places = lines_text(at, at + len(call) - 1)
        fix, new = f"remove the `#` on {places}", call
        if not set(names) <= set(re.findall(r"[^\s()]+", "\n".join(call))):
            fix, new = f"in place of {places} write {line}", [line]
        changed = "\n".join([*lines[:at], *new, *lines[at + len(call) :]])
    else:
        above = next((found[0] for name in below if (found := _commands(files, name))), None)
        end = 0 if name == "project" else len(lines)
        at = text.count("\n", 0, above.span.stop) + 1 if above is not None else end
        changed = "\n".join([*lines[:at], line, *lines[at:]])
    files.change("build-line", CMAKE, changed, f"{CMAKE} does not call {what}", fix)


def _commented(text: str, pattern: str) -> tuple[int, list[str]] | None:
    """Return the first such call that is commented out, up to its closing bracket: its first line, from 0, and its
    lines without `#`."""
    lines = text.split("\n")
    for first, line in enumerate(lines):
        if not re.match(rf"\s*#+\s?{pattern}", line, re.IGNORECASE):
            continue
        call: list[str] = []
        for line_of_call in lines[first : first + CALL_LINES_MAX]:
            call.append(re.sub(r"^(\s*)#+ ?", r"\1", line_of_call, count=1))
            if commands_of("\n".join(call).encode()):
                return first, call
    return None


def _install(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    own = [f.path for f in package.files if is_own(f.path)]
    there = {path for path in (_place(own, files, script) for script in wanted.installed) if path}
    calls = _commands(files, INSTALL)
    named = {_plain(t.value) for c in calls for t in _words(c)}
    if any("$" in name and not name.upper().startswith("${CATKIN_") for name in named):
        return  # which scripts a variable holds is for CMake to say
    missing = sorted(there - named)
    if missing and not calls:
        line = f"{INSTALL}(PROGRAMS {' '.join(missing)}\n  DESTINATION {BIN}\n)"
        at, call = _commented(_cmake(files), rf"{INSTALL}\s*\(") or (0, [])
        if all(path in "\n".join(call) for path in missing):
            lines = _cmake(files).split("\n")
            changed = "\n".join([*lines[:at], *call, *lines[at + len(call) :]])
        else:
            changed = f"{_cmake(files).rstrip()}\n\n{line}\n"
        fix = f"write {' '.join(line.split())}"
        files.change("build-line", CMAKE, changed, f"{CMAKE} does not install {join_words(missing)}", fix)
        return
    _name_scripts(files, own, missing)
    _correct_destination(files, there)


def _correct_paths(files: Files, package: PackageFacts) -> None:
    """Of files that a call names and that lie elsewhere in the package, each by its name alone: where they lie."""
    own = [f.path for f in package.files if is_own(f.path)]
    for call in reversed(_commands(files, INSTALL, "add_executable", "add_library")):  # places above stay
        moved: list[tuple[Token, str]] = []
        for token in _words(call):
            path = PurePosixPath(_plain(token.value))
            copies = [one for one in own if PurePosixPath(one).name == path.name]
            is_file = path.suffix in (".py", *CPP) and "$" not in str(path)
            if is_file and len(copies) == 1 and not (files.folder / path).exists():
                moved.append((token, copies[0]))
        text = _cmake(files)
        for token, right in reversed(moved):
            text = _replace_token(text, token, right)
        named, there = join_words(t.value for t, _ in moved), join_words(right for _, right in moved)
        message = f"line {call.line} of {CMAKE}: {call.identifier}(…) names {named}, which the package has as {there}"
        fix = " and ".join(f"write {right} instead of {token.value}" for token, right in moved)
        files.change("build-line", CMAKE, text, message, fix)


def _place(own: Sequence[str], files: Files, script: str) -> str:
    """Return where the script lies; "" where it is not there."""
    name = PurePosixPath(script).name
    copies = [p for p in own if PurePosixPath(p).name == name]
    renamed = [
        r.after for r in files.repairs if r.kind == "file-name" and PurePosixPath(r.after).name == name
    ]
    return script if script in (*copies, *renamed) else next(iter([*copies, *renamed]), "")


def _plain(word: str) -> str:
    path = re.sub(r"^\$\{(PROJECT_SOURCE_DIR|CMAKE_CURRENT_SOURCE_DIR)\}/|^\./", "", word.strip('"'))
    return re.sub("/{2,}", "/", path)


def _name_scripts(files: Files, own: Sequence[str], paths: Sequence[str]) -> None:
    """In place of files that do not exist and have nearly their names, or beside the others."""
    unnamed = [path for path in paths if not _replace_stray(files, own, path)]
    call = next((c for c in _commands(files, INSTALL) if _installs_programs(c)), None)
    if not unnamed:
        return
    text, listed = _cmake(files), " ".join(unnamed)
    if call is None:
        line = f"{INSTALL}(PROGRAMS {listed} DESTINATION {BIN})"
        message = f"{CMAKE} does not install {join_words(unnamed)} where rosrun looks"
        files.change("build-line", CMAKE, f"{text.rstrip()}\n\n{line}\n", message, f"write {line}")
        return
    words = _words(call)
    programs = next(t for t in words if t.value == "PROGRAMS")
    message = f"line {call.line} of {CMAKE}: {INSTALL}(…) does not name {join_words(unnamed)}"
    behind = words[words.index(programs) + 1 :][:1]
    known = {"DESTINATION", *own}
    stray = next((t for t in behind if "$" not in t.value and _plain(t.value) not in known), None)
    fix = f"write {listed} in place of {stray.value}" if stray else f"write {listed} after PROGRAMS"
    changed = _replace_token(text, stray or programs, listed if stray else f"PROGRAMS {listed}")
    files.change("build-line", CMAKE, changed, message, fix)


def _replace_stray(files: Files, own: Sequence[str], path: str) -> bool:
    name = PurePosixPath(path).name
    for call in _commands(files, INSTALL):
        for token in _words(call):
            given = _plain(token.value)
            same = re.sub(r"[\\/]", "", given) == path.replace("/", "")
            if given not in own and (same or _is_about(PurePosixPath(given).name, name)):
                message = f"line {call.line} of {CMAKE}: {token.value} does not exist; the script is {path}"
                fix = f"write {path} instead of {token.value}"
                files.change("build-line", CMAKE, _replace_token(_cmake(files), token, path), message, fix)
                return True
    return False


def _installs_programs(call: Command) -> bool:
    """Return whether the call installs programs where rosrun looks, or gives no place."""
    words = [token.value for token in _words(call)]
    given = words[words.index("DESTINATION") + 1 :][:1] if "DESTINATION" in words else []
    return "PROGRAMS" in words and given in ([], [BIN])


def _is_about(given: str, name: str) -> bool:
    return given == name or is_near(given, name) or f"{given}.py" == name


def _correct_destination(files: Files, scripts: Collection[str]) -> None:
    """Of a call that names one of the scripts: another of catkin's places, or a slip in this one's name."""
    for call in _commands(files, INSTALL):
        words = _words(call)
        at = next((i for i, t in enumerate(words) if t.value == "DESTINATION"), len(words))
        given = words[at + 1] if at + 1 < len(words) else None
        names_one = any(_plain(t.value) in scripts for t in words)
        place = next((w for w in words if "CATKIN_PACKAGE_BIN_DESTINATION" in w.value.upper()), None)
        if names_one and at in (len(words), len(words) - 1) and "PROGRAMS" in [t.value for t in words]:
            text, last = _cmake(files), words[-1].span.stop
            lacks = "DESTINATION" if at == len(words) else "place behind DESTINATION"
            message = f"line {call.line} of {CMAKE}: {call.identifier}(…) has no {lacks}"
            if place is not None:
                text = _replace_token(text, words[at], "") if at < len(words) else text
                changed = _replace_token(text, place, f"DESTINATION {BIN}")
            elif at < len(words):
                changed = f"{text[:last]} {BIN}{text[last:]}"
            else:
                changed = f"{text[:last]}\n  DESTINATION {BIN}{text[last:]}"
            files.change("build-line", CMAKE, changed, message)
            return
        if given and names_one and given.value != BIN and "CATKIN_" in given.value.upper():
            message = f"line {call.line} of {CMAKE}: {given.value} is not where rosrun looks"
            fix = f"write DESTINATION {BIN}"
            files.change("build-line", CMAKE, _replace_token(_cmake(files), given, BIN), message, fix)
            return
