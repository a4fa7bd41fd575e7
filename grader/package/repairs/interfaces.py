"""What makes a package's messages, services and actions: the calls in `CMakeLists.txt`, and the definitions."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from pathlib import PurePosixPath

from cmake_parser.ast import Command

from grader.installable import noetic_definitions, noetic_messages
from grader.model.generated_headers import (
    GENERATE,
    LIKE_GENERATED,
    MAKES_TARGETS,
    OF_GENERATION,
    Unwaited,
    fixes_of,
    unwaited_targets,
)
from grader.model.message_definitions import (
    DIVIDING,
    corrected_line,
    meant_field,
    parse_interface,
)
from grader.model.package import CMAKE, INTERFACE_FOLDERS, PackageFacts
from grader.package.cmake_parse import commands_of, read_calls
from grader.package.repairs.cmake_calls import (
    add_call,
    all_words,
    calls_of,
    change_line,
    change_word,
    cmake_text,
    has_call,
    replace_token,
    values_behind,
    words_of,
)
from grader.package.repairs.editing import Files
from grader.package.repairs.files import is_own
from grader.package.repairs.names import CPP, Wanted, is_near
from grader.wording import is_one_edit, join_words, lines_text

OF_PACKAGE = re.compile(r"^MSG: (\w+)/", re.MULTILINE)
"""What stands above each further type in a full definition."""
GENERATION = "message_generation"
EXPORTED = "${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS}"
LINES_MAX = 20
"""Of one definition that are put right: each reads the file again."""
GENERATORS = {GENERATION, "genmsg", "actionlib_msgs"}
"""Packages of which each brings the calls that make messages; the last one finds genmsg."""


def needs_interfaces(files: Files, package: PackageFacts, name: str, scripts: Collection[str]) -> bool:
    """Return whether what is run uses the package's own definitions, or the build asks for what is made of them. Those
    of another exercise in the same package keep nothing from running."""
    asked = any(word.kind != "COMMENT" and OF_GENERATION.search(word.value) for word in all_words(files))
    run = [f.path for f in package.files if is_own(f.path) and (f.path in scripts or f.path.endswith(CPP))]
    return asked or bool(calls_of(files, GENERATE)) or bool(_used_kinds(files, package, name, run))


def make_interfaces(
    files: Files, package: PackageFacts, name: str, scripts: Collection[str], wanted: Wanted
) -> None:
    """Find what CMakeLists.txt lacks to make the package's own messages, services and actions, where code uses them.

    One that only other scripts than those that are run would use is not added to those that the file names already.
    """
    code = [f.path for f in package.files if is_own(f.path) and (f.python or f.path.endswith(CPP))]
    used = _used_kinds(files, package, name, code)
    _delete_empty(files, package, used)
    made = {
        c: _definitions(files, package, folder) for c, folder in INTERFACE_FOLDERS.items() if folder in used
    }
    if not any(calls_of(files, call) for call in made):  # of a copy, the package is meant that the lab names
        others = {one.rpartition("/")[2] for one in wanted.types if one.partition("/")[0] != name}
        made = {c: [one for one in own if PurePosixPath(one).stem not in others] for c, own in made.items()}
    if not any(made.values()):
        _delete_generation(files, package)
        return
    _correct_lines(files, package)
    _correct_types(files, package, wanted)
    _call_by_kind(files)
    run = [path for path in code if path in scripts or path.endswith(CPP)]
    needed = {word for path in run for word in re.findall(r"\w+", files.text(path) or "")}
    needed |= {
        word for one in package.interfaces for field in one.fields for word in re.findall(r"\w+", field.type)
    }
    lacking = _generate(files, package, needed)  # from below, so that the lines above stay where they are
    for call, names in reversed(made.items()):
        _name_definitions(files, call, names, needed)
    of_catkin, named = _components(files)
    lacks = of_catkin and GENERATORS.isdisjoint(named)
    if lacks and not any("$" in word for word in named):
        words = words_of(of_catkin[0])
        near = next((token for token in words if is_one_edit(token.value, GENERATION)), None)
        if near is not None:
            why, fix = f"there is no package {near.value}", f"write {GENERATION} instead of {near.value}"
            change_word(files, near, GENERATION, why, fix, call=of_catkin[0])
            return
        lacking.append(GENERATION)
    _name_components(files, lacking)


def _delete_generation(files: Files, package: PackageFacts) -> None:
    """Delete the call of generate_messages(…) that has nothing to make, where CMake does not know it."""
    calls, (of_catkin, named) = calls_of(files, GENERATE), _components(files)
    folders = {PurePosixPath(file.path).suffix.removeprefix(".") for file in package.files}
    known = not GENERATORS.isdisjoint(named) or any("$" in word for word in named)
    if len(calls) != 1 or not of_catkin or known or folders & {*INTERFACE_FOLDERS.values()}:
        return
    _delete(files, calls[0], f"{GENERATE}(…) is called, and there are no messages to make")


def _delete_empty(files: Files, package: PackageFacts, used: Collection[str]) -> None:
    """Delete calls that ask for a folder that is not there, where they name no file, or only what was not handed in and
    no code uses."""
    paths = [file.path for file in package.files]
    handed_in = {PurePosixPath(path).name for path in paths}
    for name, folder in INTERFACE_FOLDERS.items():
        there = any(path.startswith(f"{folder}/") for path in paths)
        unused = folder not in used and not any(path.endswith(f".{folder}") for path in paths)
        for call in reversed(calls_of(files, name)) if not there else ():
            words = [token.value for token in words_of(call)]
            if words in ([], ["FILES"]):
                why = f"{name}(…) names no file, and needs the folder {folder}/, which is not there"
                _delete(files, call, why)
            elif unused and handed_in.isdisjoint(words):
                _delete(files, call, f"{name}(…) needs the folder {folder}/, which is not there")


def _delete(files: Files, call: Command, why: str) -> None:
    """Delete a call; its lines stay, empty, so that the numbers of those below it are the ones handed in."""
    text, span = cmake_text(files), call.span
    first, last = (text.count("\n", 0, at) for at in (span.start, span.stop))
    changed = text[: span.start] + "\n" * (last - first) + text[span.stop :]
    change_line(files, call, changed, why, f"delete {lines_text(first, last)}, {call.identifier}(…)")


def wait_for_headers(files: Files, package: PackageFacts, name: str) -> None:
    """Make programs wait for the headers of definitions that were handed in, which they include and nothing makes them
    wait for."""
    cmake = read_calls(cmake_text(files).encode(), files.folder, name)
    found = unwaited_targets(package, noetic_messages(), cmake, all_made=True)
    found = [one for one in found if {one.line.file, one.above.file} == {CMAKE}]
    if not found:
        return
    text, last = cmake_text(files), 0
    for one in sorted(found, key=_place_changed, reverse=True):  # places above stay
        if (place := _place_changed(one)) != last:  # a loop makes several by one call
            text = _wait_by(text, one, name)
        last = place
    why = f"{join_words(one.target for one in found)} may be compiled before the headers of the messages"
    message = f"line {found[0].line.line} of {CMAKE}: {why}"
    files.change("build-line", CMAKE, text, message, "; ".join(fixes_of(found)))


def _place_changed(one: Unwaited) -> int:
    """Return the line of the call that is changed, or below which one is written."""
    return (one.commented or one.lost or one.above).line


def _wait_by(text: str, one: Unwaited, name: str) -> str:
    """Return the text of `CMakeLists.txt` with which a target waits for the headers that it includes."""
    if one.commented is not None:
        lines, at = text.split("\n"), one.commented.line - 1
        return "\n".join([*lines[:at], lines[at].lstrip("# \t"), *lines[at + 1 :]])
    commands = {command.line: command for command in commands_of(text.encode()) or ()}
    target = words_of(commands[one.call.line])[0].value
    if one.lost is None or one.lost.line < one.above.line:
        at = commands[one.above.line].span.stop
        text = f"{text[:at]}\nadd_dependencies({target} {one.exported}){text[at:]}"
        return text if one.lost is None else _without(text, commands[one.lost.line])
    words = words_of(commands[one.lost.line])
    absent = [word for word in words[1:] if word.value.replace("${PROJECT_NAME}", name) in one.absent]
    for word in reversed(absent[1:]):
        text = replace_token(text, word, "")
    place = absent[0] if absent else words[-1]
    return replace_token(text, place, one.exported if absent else f"{place.value} {one.exported}")


def _without(text: str, call: Command) -> str:
    """Return the text without a call; its lines stay, empty."""
    return text[: call.span.start] + "\n" * text[call.span].count("\n") + text[call.span.stop :]


def depend_on_exported(files: Files, package: PackageFacts, name: str) -> None:
    """Make programs wait for all that is exported in place of headers that nothing makes, at which CMake stops from
    version 3 on."""
    versions = [t.value for c in calls_of(files, "cmake_minimum_required") for t in words_of(c)[1:]]
    known = {*_components(files)[1], *noetic_messages(), *(one.name for one in package.also)}
    own = {name, "${PROJECT_NAME}"}
    known |= own if has_call(files, package, GENERATE) else set()
    made = {w[0].value for c in calls_of(files, *MAKES_TARGETS, "add_custom_target") if (w := words_of(c))}
    text, fixes, found = cmake_text(files), list[str](), list[tuple[Command, str]]()
    for call in reversed(calls_of(files, "add_dependencies")):  # places above stay
        target, *waited = [token.value for token in words_of(call)] or [""]
        lost = [
            one
            for one in waited
            if one not in made and _is_no_target(one.replace("${PROJECT_NAME}", name), known)
        ]
        if not lost:
            continue
        kept = [one for one in waited if one not in lost and "EXPORTED_TARGETS}" not in one]
        new = f"add_dependencies({' '.join([target, *kept, EXPORTED])})"
        text = text[: call.span.start] + new + text[call.span.stop :]
        fixes.insert(0, f"write {new}")
        found.insert(0, (call, lost[0]))
    if found and re.match(r"[3-9]|\d\d", "".join(versions[:1])):
        call, lost_target = found[0]
        change_line(files, call, text, f"there is no target {lost_target} to wait for", "; ".join(fixes))


def _is_no_target(word: str, known: Collection[str]) -> bool:
    """Return whether a word means a target of `generate_messages(…)`, and none of these packages makes it."""
    found = OF_GENERATION.search(word)
    return (
        "$" not in word
        and bool(LIKE_GENERATED.search(word))
        and (not found or word[: found.start()] not in known)
    )


def _components(files: Files) -> tuple[list[Command], list[str]]:
    """Return the calls of find_package(catkin …), and the words in them."""
    calls = [c for c in calls_of(files, "find_package") if [t.value for t in words_of(c)][:1] == ["catkin"]]
    return calls, [token.value for call in calls for token in words_of(call)]


def _name_components(files: Files, names: Sequence[str]) -> None:
    """Name these packages in find_package(catkin …), where it lists its packages in plain words."""
    of_catkin, named = _components(files)
    absent = [name for name in names if name not in named]
    missing = " ".join(absent)
    if not of_catkin or not missing or any("$" in word for word in named):
        return
    words = words_of(of_catkin[0])
    listed = next((t for t in words if t.value == "COMPONENTS"), None)
    token, new = (listed, missing) if listed else (words[-1], f"COMPONENTS {missing}")
    why, fix = (
        f"find_package(catkin …) does not name {join_words(absent)}",
        f"write {new} after {token.value}",
    )
    change_word(files, token, f"{token.value} {new}", why, fix, call=of_catkin[0])


def name_roscpp(files: Files, package: PackageFacts) -> None:
    """Name roscpp in find_package(catkin …) where the source of a program includes ROS, and nothing named brings it."""
    named = [name for name in _components(files)[1] if not name.isupper()]
    sources = [f.path for f in package.files if is_own(f.path) and f.path.endswith(CPP)]
    includes = re.compile(r"^\s*#\s*include\s*[<\"]ros/ros\.h", re.MULTILINE)
    needed = calls_of(files, "add_executable") and any(includes.search(files.text(p) or "") for p in sources)
    if needed and all(name.endswith("_msgs") or name in _WITHOUT_ROSCPP for name in named):
        _name_components(files, ["roscpp"])


_WITHOUT_ROSCPP = {"catkin", "rospy", "std_srvs", GENERATION, "message_runtime"}


def _correct_types(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Give fields of which there is no type the one that is meant: what the lab asks for is told where that is."""
    own = {PurePosixPath(one.path).stem for one in package.interfaces}
    asked = {(path, one.part, one.name) for path, fields in wanted.definitions for one in fields}
    for one in package.interfaces:
        others = own - {PurePosixPath(one.path).stem}  # no message holds itself
        for field in one.fields:
            if (one.path, field.part, field.name) in asked:
                continue
            right, name = meant_field(field, others, noetic_messages())
            lines = (files.text(one.path) or "").split("\n")
            if (right, name) == (field.type, field.name) or field.line > len(lines):
                continue
            why = f"there is no field type `{field.type}`"
            if name != field.name:
                why = f"the name {field.type} stands before its type"
            written = rf"^(\s*){re.escape(field.type)}(\s+){re.escape(field.name)}"
            lines[field.line - 1] = re.sub(written, rf"\g<1>{right}\g<2>{name}", lines[field.line - 1])
            files.change("build-line", one.path, "\n".join(lines), f"line {field.line} of {one.path}: {why}")


def _correct_lines(files: Files, package: PackageFacts) -> None:
    """Write each line that ROS cannot read as it is meant: `float64 level` for `float64: level`, and `---` for other
    dashes."""
    for path in [one.path for one in package.interfaces if one.fault]:
        for _ in range(LINES_MAX):
            text = files.text(path) or ""
            fault, lines = parse_interface(text.encode(), path).fault, text.split("\n")
            line = fault.line if fault is not None else None
            right = corrected_line(lines[line - 1], path) if line and line <= len(lines) else ""
            if fault is None or line is None or not right:
                break
            comment = lines[line - 1].partition("#")[2]
            lines[line - 1] = f"{right}  #{comment}" if comment and right != DIVIDING else right
            files.change("build-line", path, "\n".join(lines), f"{path}: {fault.cause}", fault.fix)


def _call_by_kind(files: Files) -> None:
    """Call `add_service_files(…)` where `add_message_files(…)` names services alone, and so on."""
    for name, folder in INTERFACE_FOLDERS.items():
        for call in calls_of(files, name):
            named = values_behind(call, "FILES")
            kinds = {PurePosixPath(word).suffix.removeprefix(".") for word in named}
            right = next((c for c, kind in INTERFACE_FOLDERS.items() if kinds == {kind} != {folder}), "")
            if right:
                text, at = cmake_text(files), call.span.start
                changed = text[:at] + re.sub(r"^\w+", right, text[at:], count=1)
                why = f"{name}(…) names {join_words(named)}"
                change_line(files, call, changed, why, f"write {right} instead of {name}")


def _definitions(files: Files, package: PackageFacts, folder: str) -> list[str]:
    paths = (PurePosixPath(files.path_of(file.path)) for file in package.files)
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


def _name_definitions(files: Files, name: str, made: Sequence[str], needed: Collection[str]) -> None:
    """Name them in the call, in place of files that do not exist and have nearly their names, or beside others if
    `needed` has their types."""
    if made and not calls_of(files, name):
        line, below = f"{name}(FILES {' '.join(made)})", ("find_package", "project")
        add_call(files, f"{name}(…)", line, below, made)
    for file in made:
        call = calls_of(files, name)[0]
        named = {word for one in calls_of(files, name) for word in values_behind(one, "FILES")}
        if file in named or any("$" in word for word in named):
            continue
        stray = next((word for word in sorted(named - {*made}) if is_near(word, file)), "FILES")
        if stray == "FILES" and named and PurePosixPath(file).stem not in needed:
            continue
        token = next((t for one in calls_of(files, name) for t in words_of(one) if t.value == stray), None)
        if token is not None:
            new, place = (f"FILES {file}", "after") if stray == "FILES" else (file, "instead of")
            why, fix = f"{name}(…) does not name {file}", f"write {file} {place} {stray}"
            change_word(files, token, new, why, fix, call=call)


def _brought_by(names: Collection[str]) -> set[str]:
    """Return the packages that generate_messages(…) finds by those that it names, since their messages need them."""
    texts = (text for full, (text, _) in noetic_definitions().items() if full.partition("/")[0] in names)
    return {package for text in texts for package in OF_PACKAGE.findall(text)}


def _is_left_out(files: Files, path: PurePosixPath, needed: Collection[str]) -> bool:
    """Return whether the build makes nothing of a definition, which is not named among the others, nor `needed`."""
    calls = [
        c
        for name, folder in INTERFACE_FOLDERS.items()
        if folder == path.parent.name
        for c in calls_of(files, name)
    ]
    words = {token.value for call in calls for token in words_of(call)}
    meant = any("$" in word or is_near(word, path.name) for word in words)
    return "FILES" in words and path.name not in words and path.stem not in needed and not meant


def _is_slip_of_messages(name: str) -> bool:
    return any(is_near(name, known) for known in noetic_messages())


def _generate(files: Files, package: PackageFacts, used: Collection[str]) -> list[str]:
    """Call generate_messages(…) where nothing does, with the packages whose types are used, above catkin_package(…).
    Return those that find_package(catkin …) has to name with it."""
    calls, of_catkin = calls_of(files, GENERATE), calls_of(files, "catkin_package")
    made = [one for one in package.interfaces if not _is_left_out(files, PurePosixPath(one.path), used)]
    types = {field.type for one in made for field in one.fields}
    needed = {"std_msgs"} if types & {"Header", "Header[]"} else set[str]()
    needed |= {"actionlib_msgs"} if any(one.path.endswith(".action") for one in made) else set()
    named = {name.partition("/")[0] for name in types if "/" in name} - {package.name}
    # A slip of a package's name is corrected in the definition.
    needed |= {one for one in named if one in noetic_messages() or not _is_slip_of_messages(one)}
    if not calls:
        line = f"{GENERATE}({' '.join(['DEPENDENCIES', *sorted(needed)] if needed else [])})"
        lines = {name: max((c.line for c in calls_of(files, name)), default=0) for name in INTERFACE_FOLDERS}
        below = (*sorted(lines, key=lambda name: -lines[name]), "find_package")
        add_call(files, f"{GENERATE}(…)", line, below, sorted(needed))
        return sorted(needed)
    late = [c for name in INTERFACE_FOLDERS for c in calls_of(files, name) if c.line > calls[0].line]
    if late and (not of_catkin or late[0].line < of_catkin[0].line):
        _move_above(files, late[0], calls[0], GENERATE)
        return []
    if of_catkin and calls[0].line > of_catkin[0].line:
        _move_above(files, calls[0], of_catkin[0], "catkin_package")
    call = calls_of(files, GENERATE)[0]
    named = {token.value for token in words_of(call)}
    missing = sorted(needed - named - _brought_by(named))
    # What the messages of another package need, and a variable holds, is for CMake to say.
    others = (word for word in named if word not in noetic_messages() and not word.isupper())
    if missing and not any(not is_near(word, name) for word in others for name in missing):
        text, listed = cmake_text(files), " ".join(missing)
        token = next((t for t in words_of(call) if t.value == "DEPENDENCIES"), None)
        at = token.span.stop if token else text.index("(", call.span.start) + 1
        added = f" {listed}" if token else f"DEPENDENCIES {listed}"
        fix = f"write {listed} after DEPENDENCIES" if token else f"write {GENERATE}({added})"
        why = f"{GENERATE}(…) does not name {join_words(missing)}"
        change_line(files, call, text[:at] + added + text[at:], why, fix)
        _name_components(files, missing)
    return []


def _move_above(files: Files, call: Command, other: Command, what: str) -> None:
    """Move a call above another one, which is called `what`."""
    text, span, at, name = cmake_text(files), call.span, other.span.start, call.identifier
    changed = f"{text[:at]}{text[span]}\n\n{text[at : span.start].rstrip()}\n{text[span.stop :].lstrip()}"
    fix = f"move {name}(…), from line {call.line}, above {what}(…)"
    change_line(files, call, changed, f"{name}(…) is called after {what}(…)", fix)
