"""Lines of `CMakeLists.txt` without which nothing builds, or which the lab asks for, and the package's name."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise, takewhile
from pathlib import PurePosixPath

from cmake_parser.ast import Command, Token

from grader.installable import is_no_package, known_packages, noetic_messages
from grader.line_slips.cmake import find_slip, is_open
from grader.model.generated_headers import GENERATE
from grader.model.package import (
    CMAKE,
    INTERFACE_FOLDERS,
    MAKES_PACKAGE,
    MANIFEST,
    SIMPLE,
    PackageFacts,
    meant_command,
)
from grader.model.repair import RepairKind
from grader.package.cmake_parse import commands_of, half_comments, join_half_comment, parse_tree_of
from grader.package.manifest import parse_manifest
from grader.package.repairs.cmake_calls import (
    CALLS_MAX,
    add_call,
    all_calls,
    calls_of,
    change_line,
    change_word,
    cmake_text,
    has_call,
    replace_token,
    values_behind,
    words_of,
)
from grader.package.repairs.definitions import define_as_asked
from grader.package.repairs.editing import Files, keep_first_version, naming_files, rename_word
from grader.package.repairs.interfaces import (
    depend_on_exported,
    make_interfaces,
    name_roscpp,
    needs_interfaces,
    wait_for_headers,
)
from grader.package.repairs.manifest import OF_ROS, declare_for_running
from grader.package.repairs.names import Wanted, is_near
from grader.package.repairs.programs import (
    INSTALL,
    correct_paths,
    install_scripts,
    leave_out_missing,
    link_programs,
    make_programs,
    name_programs,
    name_targets,
    spell_variables,
)
from grader.wording import join_words, name_package, numbers_text

OF_WORKSPACE = "catkin_workspace"
DEPENDS_MAX = 50
"""Of one call: each that is missing reads the manifest again."""


# ---- the name


def rename_package(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Find a name in the manifest in place of which the lab's is meant; whatever else has it follows."""
    text = files.text(MANIFEST)
    manifest, _ = parse_manifest(text.encode()) if text is not None else (None, None)
    if text is None or manifest is None or not _is_meant(files, package, manifest.name, wanted.package):
        return
    old, new = manifest.name, wanted.package
    message = f"line {manifest.name_line} of {MANIFEST}: the package is called {old}, not {new}"
    files.change("package-name", MANIFEST, rename_word(text, old, new), message, name_package(new))
    for file in naming_files(files.folder):
        other = files.text(file)
        if file != MANIFEST and other is not None:
            files.put(file, rename_word(other, old, new))


def _is_meant(files: Files, package: PackageFacts, name: str, wanted: str) -> bool:
    """Return whether the name is nearly the lab's, or the package has another one elsewhere: CMakeLists.txt the lab's,
    or all launch files the lab's or the folder's."""
    projects = [words[0].value for command in calls_of(files, "project") if (words := words_of(command))]
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
    keep_first_version(files, CMAKE, "build-line")
    _correct_line(files)
    _close_bracket(files)
    if commands_of(cmake_text(files).encode()) is None or _is_of_another(files):
        return
    if has_call(files, package, SIMPLE):  # what it makes by itself is lacking nowhere
        _name_project(files, package, name, wanted.package)
        return
    _spell_commands(files)
    _spell_keywords(files)
    _correct_version(files)
    _leave_out_rosbuild(files)
    needs = " ".join(wanted.dependencies or ("rospy", "std_msgs"))
    if not has_call(files, package, "project"):
        add_call(files, "project(…)", f"project({name or wanted.package})", ("cmake_minimum_required",))
    _move_project(files)
    _spell_catkin(files)
    _leave_out_modules(files)
    _spell_packages(files, {"find_package": "COMPONENTS", GENERATE: "DEPENDENCIES"})
    if not _calls_catkin(files, package):
        line = f"find_package(catkin REQUIRED COMPONENTS {needs})"
        add_call(files, "find_package(catkin …)", line, ("project",))
    if not any(has_call(files, package, name) for name in MAKES_PACKAGE):
        below = (GENERATE, "find_package", "project")
        add_call(files, "catkin_package()", "catkin_package()", below)
    name_roscpp(files, package)
    name_targets(files)
    make_programs(files, package)
    spell_variables(files)
    wait_for_headers(files, package, name)
    if needs_interfaces(files, package, name, scripts):
        make_interfaces(files, package, name, scripts, wanted)
        define_as_asked(files, package, wanted)
        depend_on_exported(files, package, name)
    name_programs(files, wanted)
    if not package.folder_beside:  # what it names is right once it lies there itself
        install_scripts(files, package, wanted)
        correct_paths(files, package)
        leave_out_missing(files, wanted)
    link_programs(files, package)
    _correct_include(files)
    _declare_exported(files)
    _name_project(files, package, name, wanted.package)


def _is_of_another(files: Files) -> bool:
    """Return whether the file is what `catkin_init_workspace` makes, or one for ROS 2: the package needs its own."""
    found = [words[0].value for words in map(words_of, calls_of(files, "find_package")) if words]
    ament = any(name.startswith("ament_") for name in found) and "catkin" not in found
    return ament or (bool(calls_of(files, OF_WORKSPACE)) and not calls_of(files, "catkin_package"))


def _calls_catkin(files: Files, package: PackageFacts) -> bool:
    told = package.cmake.calls if package.cmake is not None else ()
    written = [[t.value for t in words_of(c)] for c in calls_of(files, "find_package")]
    known = [list(c.args) for c in told if c.name == "find_package"]
    return any(words[:1] == ["catkin"] for words in (*written, *known))


def _leave_out_modules(files: Files) -> None:
    """Leave modules of Python out of find_package(catkin …): no package of ROS is one."""
    for command in reversed(calls_of(files, "find_package")):  # places above stay
        words = words_of(command)
        of_catkin = words[1:] if words and words[0].value == "catkin" else []
        lost = [word for word in of_catkin if is_no_package(word.value)]
        text, names = cmake_text(files), join_words(word.value for word in lost)
        for word in reversed(lost):
            text = replace_token(text, word, "")
        why = f"find_package(…) names {names}, and no package of ROS is called so"
        change_line(files, command, text, why, f"take {names} out of find_package(…)")


def _join_names(files: Files) -> None:
    """Write a package's name as one word in find_package(catkin …) where a space stands for its `_`: `std msgs`."""
    known = {*known_packages(), *noetic_messages()}
    for command in reversed(calls_of(files, "find_package")):  # places above stay
        for first, second in reversed(list(pairwise(words_of(command)))):
            whole, halves = f"{first.value}_{second.value}", f"{first.value} and {second.value}"
            if whole in known and known.isdisjoint((first.value, second.value)):
                text = replace_token(replace_token(cmake_text(files), second, ""), first, whole)
                why = f"find_package(…) names {halves}, which are one package: {whole}"
                change_line(files, command, text, why, f"write {whole} in place of {halves}")


def _spell_catkin(files: Files) -> None:
    """Write the name of catkin as the first word of find_package(…): in place of a slip of it, or in front of what is
    there in its place."""
    for command in calls_of(files, "find_package"):
        words = words_of(command)
        first = words[0] if words else None
        if first is None or first.value == "catkin":
            continue
        behind = next((word for word in words[1:] if word.value == "catkin"), None)
        text, new, fix = cmake_text(files), "catkin", f"write catkin instead of {first.value}"
        if first.value in ("REQUIRED", "COMPONENTS"):
            text = replace_token(text, behind, "") if behind is not None else text
            new, fix = f"catkin {first.value}", f"write catkin before {first.value}"
        elif not is_near(first.value, "catkin"):
            continue
        why = f"find_package(…) names {first.value}, and not catkin"
        change_line(files, command, replace_token(text, first, new), why, fix)
        return


KEYWORDS = {
    "cmake_minimum_required": ("VERSION",),
    "find_package": ("REQUIRED", "COMPONENTS"),
    "add_message_files": ("FILES",),
    "add_service_files": ("FILES",),
    "add_action_files": ("FILES",),
    "generate_messages": ("DEPENDENCIES",),
    INSTALL: ("PROGRAMS", "DESTINATION"),
    "install": ("TARGETS", "PROGRAMS", "DIRECTORY", "ARCHIVE", "LIBRARY", "RUNTIME", "DESTINATION"),
}
"""Words of these calls that have to be in capitals and spelt so."""
FIRST = {
    "cmake_minimum_required": "VERSION",
    INSTALL: "PROGRAMS",
    GENERATE: "DEPENDENCIES",
    **dict.fromkeys(INTERFACE_FOLDERS, "FILES"),
}
"""The words without which these calls mean nothing, and that come first."""


def _spell_keywords(files: Files) -> None:
    """Spell the keywords of calls right, and write those that have to be the first word."""
    for name, keywords in KEYWORDS.items():
        for at in range(len(calls_of(files, name))):
            for keyword in keywords:
                words = words_of(calls_of(files, name)[at])
                if name == INSTALL and words and words[0].value.upper() == keyword:
                    continue  # the capitals of this word alone do not count
                strays = [w for w in words if is_near(w.value, keyword) and w.value not in keywords]
                # Files and targets may be called as these words are, in small letters.
                strays = [w for w in strays if name != "install" or w.value.isupper()]
                if strays and keyword not in [w.value for w in words]:
                    why = f"{name}(…) has no keyword {strays[0].value}: it is {keyword}"
                    change_word(files, strays[0], keyword, why)
            _put_first(files, name, words_of(calls_of(files, name)[at]))


def _put_first(files: Files, name: str, words: Sequence[Token]) -> None:
    right = FIRST.get(name, "")
    values = [word.value for word in words]
    if not right or not words or values[0] == right or "$" in values[0] or values[0].upper() == right:
        return
    if values[0].isupper() and right in ("DEPENDENCIES", "FILES"):
        return  # DIRECTORY and LANGS may come first
    text = cmake_text(files)
    behind = words[values.index(right)] if right in values else None
    text = replace_token(text, behind, "") if behind is not None else text
    other = values[0] in {"FILES", "TARGETS", "SCRIPTS", "DIRECTORY"}  # install(…) has them
    changed = replace_token(text, words[0], right if other else f"{right} {values[0]}")
    fix = f"write {right} {'instead of' if other else 'before'} {values[0]}"
    change_line(files, words[0], changed, f"{name}(…) does not begin with {right}", fix)


def _correct_version(files: Files) -> None:
    """Give cmake_minimum_required(VERSION …) a version that there is."""
    for command in calls_of(files, "cmake_minimum_required"):
        words = words_of(command)
        given = words[1] if len(words) > 1 else None
        if [word.value for word in words] == ["VERSION"]:
            why = f"{command.identifier}(…) has no version"
            change_word(files, words[0], "VERSION 3.0.2", why, call=command)
            return
        right = re.fullmatch(r"[23](\.\d+){1,3}(\.\.\.[\d.]+)?", given.value) if given is not None else None
        if given is not None and right is None and "$" not in given.value:
            change_word(files, given, "3.0.2", f"there is no version {given.value} of CMake")


def _correct_line(files: Files) -> None:
    """Correct the one line with which the file cannot be read, or a variable is not closed."""
    text = cmake_text(files)
    fault = parse_tree_of(text.encode(), CMAKE)[1]
    words = [token for command in all_calls(files) for token in words_of(command)]
    line = fault.line if fault is not None else next((t.line for t in words if is_open(t.value)), None)
    slip = find_slip(text, line or 0) if join_half_comment(text) is None else None
    if slip is not None:
        message = f"line {slip.number} of {CMAKE}: {slip.why}"
        files.change("build-line", CMAKE, slip.text, message, slip.fix)


def _close_bracket(files: Files) -> None:
    """Take a call wholly out of its comment, begin one whose first line is missing, or close a bracket: where its call
    ends, else at the end of the last line that is not a comment, or on a line of its own."""
    text = cmake_text(files)
    if commands_of(text.encode()) is not None:
        return
    if steps := _closing_steps(text, BRACKETS_MAX):
        for step in steps:
            files.change("build-line", CMAKE, *step)
        return
    lines = text.rstrip().split("\n")
    last = max((i for i, line in enumerate(lines) if line.split("#", maxsplit=1)[0].strip()), default=0)
    for added in ([lines[last] + ")"], [lines[last], ")"]):
        changed = [*lines[:last], *added, *lines[last + 1 :], ""]
        if commands_of("\n".join(changed).encode()) is not None:
            message = f"line {last + 1} of {CMAKE}: an opening bracket is never closed"
            files.change("build-line", CMAKE, "\n".join(changed), message)
            return


BRACKETS_MAX = 3


def _closing_steps(text: str, most: int) -> list[tuple[str, str, str]]:
    """Return the text after each repair of a bracket, what is wrong and how it is fixed, up to where CMake can read the
    file; nothing where so many do not suffice."""
    if (half := join_half_comment(text)) and commands_of(half.text.encode()) is not None:
        return [(half.text, f"line {half.line} of {CMAKE}: {half.cause}: {half.fix}", half.fix)]
    lines, tried = text.rstrip().split("\n"), list[tuple[str, str, str]]()
    fault = parse_tree_of(text.encode(), CMAKE)[1]
    if fault is not None and (place := _PLACE.fullmatch(fault.fix)):
        number, begins = int(place["above"] or place["end"]), place["head"]
        changed = [
            *lines[: number - 1],
            begins or f"{lines[number - 1]})",
            *lines[number - bool(begins) :],
            "",
        ]
        tried = [("\n".join(changed), f"line {fault.line} of {CMAKE}: {fault.cause}", "")]
    for half in half_comments(text):
        tried.append((half.text, f"line {half.line} of {CMAKE}: {half.cause}: {half.fix}", half.fix))
    for step in tried:
        if commands_of(step[0].encode()) is not None:
            return [step]
    for step in tried if most > 1 else ():
        if rest := _closing_steps(step[0], most - 1):
            return [step, *rest]
    return []


_PLACE = re.compile(
    r"write `\)` at the end of line (?P<end>\d+)|above line (?P<above>\d+), write `(?P<head>.+)`"
)
"""Where a bracket is to be closed, or a call to be begun."""


def _spell_commands(files: Files) -> None:
    """Spell commands right that have nearly the name of a known one, unless the file defines them."""
    defined = {words[0].value.lower() for c in calls_of(files, "function", "macro") if (words := words_of(c))}
    meant = [(c, meant_command(c.identifier.lower())) for c in all_calls(files)]
    slips = [(c, right) for c, right in meant if right and c.identifier.lower() not in defined]
    for command, right in reversed(slips[:CALLS_MAX]):  # each change reads the file again
        name, text = command.identifier, cmake_text(files)
        start = text.index(name, command.span.start)
        changed = text[:start] + right + text[start + len(name) :]
        change_line(files, command, changed, f"there is no command {name}; it is called {right}")


def _leave_out_rosbuild(files: Files) -> None:
    """Leave out what only rosbuild has, which was there before catkin: its targets are CMake's own."""
    made = {"rosbuild_add_executable": "add_executable", "rosbuild_add_library": "add_library"}
    calls = [c for c in all_calls(files) if c.identifier.lower().startswith("rosbuild_")]
    calls += [c for c in calls_of(files, "include") if any("rosbuild" in t.value for t in words_of(c))]
    text = cmake_text(files)
    for call in sorted(calls, key=lambda one: -one.span.start):
        new = text[call.span].replace(call.identifier, made.get(call.identifier.lower(), ""), 1)
        new = new if call.identifier.lower() in made else ""
        text = text[: call.span.start] + new + text[call.span.stop :]
    gone = [c.line for c in calls if c.identifier.lower() not in made]
    spelt = {c.identifier: made[c.identifier.lower()] for c in calls if c.identifier.lower() in made}
    where = f"{'lines' if len(gone) > 1 else 'line'} {numbers_text(sorted(gone))}"
    fixes = [f"delete the calls on {where}"] if gone else []
    fixes += [f"write {new} instead of {old}" for old, new in spelt.items()]
    message = f"{CMAKE} calls what only rosbuild has, and catkin does not"
    files.change("build-line", CMAKE, text, message, join_words(fixes))


def _correct_include(files: Files) -> None:
    """`INCLUDE_DIRS include`, which `catkin_create_pkg` writes in a comment, in a package without such a folder."""
    for call in calls_of(files, "catkin_package"):
        words = words_of(call)
        at = next((i for i, t in enumerate(words) if t.value == "INCLUDE_DIRS"), len(words))
        given = list(takewhile(lambda token: not token.value.isupper(), words[at + 1 :]))
        absent = [t for t in given if "$" not in t.value and not (files.folder / t.value.strip('"')).is_dir()]
        if not absent:
            continue
        text = cmake_text(files)
        taken = [words[at], *absent] if absent == given else absent
        for token in reversed(taken):
            text = replace_token(text, token, "")
        listed = " ".join(t.value for t in absent)
        folders = join_words(f"the folder {t.value.strip('/')}/" for t in absent)
        why = f"catkin_package(…) names {folders}, which is not in the package"
        fix = f"remove INCLUDE_DIRS {listed}" if absent == given else f"remove {listed} from INCLUDE_DIRS"
        change_line(files, call, text, why, f"{fix}, as git keeps no empty folder")
        return


def _declare_exported(files: Files) -> None:
    """Declare in `package.xml` what `catkin_package(CATKIN_DEPENDS …)` names, as catkin asks for."""
    _spell_packages(files, {"catkin_package": "CATKIN_DEPENDS"})
    for call in calls_of(files, "catkin_package"):
        for name in values_behind(call, "CATKIN_DEPENDS")[:DEPENDS_MAX]:
            if re.fullmatch(r"\w+", name):
                why = f"catkin_package(…) names {name}, and {MANIFEST} does not"
                declare_for_running(files, name, f"line {call.line} of {CMAKE}: {why}")


def _spell_packages(files: Files, keywords: Mapping[str, str]) -> None:
    """Spell the packages that calls name behind these keywords as `package.xml` does, where there are none of those
    names."""
    _join_names(files)
    declared = _declared(files)
    known = {*declared, *known_packages(), *noetic_messages(), *OF_ROS}
    listed = [(c, t) for name, k in keywords.items() for c in calls_of(files, name) for t in _listed(c, k)]
    meant = [
        (c, t, [one for one in declared if is_near(t.value, one)]) for c, t in listed if t.value not in known
    ]
    slips = [(call, token, right[0]) for call, token, right in meant if len(right) == 1]
    for call, token, right in sorted(
        slips[:CALLS_MAX], key=lambda one: -one[1].span.start
    ):  # places above stay
        why = f"{call.identifier}(…) names {token.value}, which is called {right}"
        change_word(files, token, right, why, f"write {right} instead of {token.value}", call=call)


def _listed(call: Command, keyword: str) -> list[Token]:
    """Return the words behind a keyword."""
    names = values_behind(call, keyword)[:DEPENDS_MAX]
    return [token for token in words_of(call) if token.value in names]


def _declared(files: Files) -> set[str]:
    """Return the packages that `package.xml` names."""
    manifest, _ = parse_manifest((files.text(MANIFEST) or "").encode())
    return {one.name for one in manifest.dependencies} if manifest is not None else set()


def _move_project(files: Files) -> None:
    """Call project(…) above catkin_package(…), which asks for the project's name."""
    project, of_catkin = calls_of(files, "project"), calls_of(files, "catkin_package")
    if not project or not of_catkin or project[0].line < of_catkin[0].line:
        return
    call = project[0]
    first = next((c for c in calls_of(files, "find_package", "catkin_package")), call).span.start
    text, span = cmake_text(files), call.span
    changed = f"{text[:first]}{text[span]}\n{text[first : span.start].rstrip()}\n{text[span.stop :].lstrip()}"
    above = text.count("\n", 0, first) + 1
    change_line(
        files, call, changed, "project(…) is called after catkin_package(…)", f"move it above line {above}"
    )


def _name_project(files: Files, package: PackageFacts, name: str, wanted: str) -> None:
    """Name the project. A manifest in whose name the lab's is meant gets that name later."""
    right = wanted if _is_meant(files, package, name, wanted) else name
    for command in calls_of(files, "project")[:1]:
        words = words_of(command)
        if not words:
            text, at = cmake_text(files), command.span.stop - 1
            change_line(files, command, f"{text[:at]}{name}{text[at:]}", "project(…) has no name")
        call, token = _set_by(files, command, words[0]) if words else (command, None)
        if token is not None and token.value.strip('"') not in (name, right) and "$" not in token.value:
            given = token.value
            by = "" if call is command else f", by line {call.line},"
            message = (
                f"line {command.line} of {CMAKE}: project({given}){by} is not the package's name, {name}"
            )
            kind: RepairKind = "package-name" if is_near(given, name) else "build-line"
            both = f"write project({wanted}) here, and <name>{wanted}</name> in {MANIFEST}"
            fix = both if wanted and wanted != right else ""
            files.change(kind, CMAKE, replace_token(cmake_text(files), token, name), message, fix)


def _set_by(files: Files, command: Command, token: Token) -> tuple[Command, Token]:
    """Return the one `set(NAME value)` above that gives a variable its value, and that word; else what is given."""
    name = token.value.strip('"').removeprefix("${").removesuffix("}")
    above = [c for c in calls_of(files, "set") if c.line < command.line and words_of(c)[0].value == name]
    words = words_of(above[0]) if len(above) == 1 and "${" in token.value else []
    return (above[0], words[1]) if len(words) == 2 else (command, token)
