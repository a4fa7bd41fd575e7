"""Lines of `package.xml` and `CMakeLists.txt` without which nothing builds, or which the lab asks for."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import takewhile
from pathlib import PurePosixPath

from cmake_parser.ast import Command, Token

from grader.model.package import PackageFacts, meant_command
from grader.model.repair import RepairKind
from grader.package.cmake_parse import commands_of
from grader.package.manifest import parse_manifest
from grader.package.repairs.editing import CMAKE, MANIFEST, Files, naming_files, rename_word, repair_xml
from grader.package.repairs.files import is_own
from grader.package.repairs.names import Wanted, is_near
from grader.package.xml import parse_xml
from grader.wording import join_words

BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"
INSTALL = "catkin_install_python"
CALL_LINES_MAX = 30
ALL_NEEDS = re.compile(r"<(build_depend|depend|run_depend|exec_depend)>\s*([\w-]+)\s*<")


# ---- package.xml


def repair_manifest(files: Files, package: PackageFacts, wanted: Wanted) -> str:
    """Find what the manifest lacks, and return the name that the package has in the end."""
    text = files.text(MANIFEST)
    if text is None:
        return package.name
    repair_xml(files, MANIFEST, "package", "manifest-line")
    _add_buildtool(files)
    for name in wanted.dependencies:
        _add_dependency(files, name)
    manifest, _ = parse_manifest((files.text(MANIFEST) or "").encode())
    if manifest is None:
        return package.name
    return manifest.name


def rename_package(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    """Find a name in the manifest in place of which the lab's is meant; whatever else has it follows."""
    text = files.text(MANIFEST)
    manifest, _ = parse_manifest(text.encode()) if text is not None else (None, None)
    if text is None or manifest is None or not _is_meant(files, package, manifest.name, wanted.package):
        return
    old, new = manifest.name, wanted.package
    message = f"line {manifest.name_line} of {MANIFEST}: the package is called {old}, not {new}"
    fix = f'write {new} for {old} in {MANIFEST}, in project(…) and in every pkg="…"'
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


def _parses(text: str) -> bool:
    return parse_xml(text.encode(), MANIFEST, root="package")[0] is not None


def _add_buildtool(files: Files) -> None:
    text = files.text(MANIFEST) or ""
    if not re.search(r"<buildtool_depend[^>]*>\s*catkin\s*<", _without_comments(text)) and _parses(text):
        message = f"{MANIFEST} does not name catkin as its build tool"
        _insert(files, "<buildtool_depend>catkin</buildtool_depend>", message)


def _add_dependency(files: Files, name: str) -> None:
    text = files.text(MANIFEST) or ""
    given = {match[2] for match in ALL_NEEDS.finditer(_without_comments(text))}
    if name in given or not _parses(text):
        return
    old = re.search(r"<package(\s+format\s*=\s*[\"']1[\"'])?\s*>", text) is not None
    lines = [f"<build_depend>{name}</build_depend>", f"<run_depend>{name}</run_depend>"]
    message = f"{MANIFEST} does not name {name}, which the lab needs"
    _insert(files, "\n".join(lines) if old else f"<depend>{name}</depend>", message)


def _without_comments(text: str) -> str:
    return re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)


def _insert(files: Files, tags: str, message: str) -> None:
    """Put the tags below the last dependency, or the licence, or before the end, where the file still parses."""
    text = files.text(MANIFEST) or ""
    lines = text.split("\n")
    after = [i for i, line in enumerate(lines) if re.search(r"</(\w*depend|license)>\s*$", line)]
    end = next((i for i, line in reversed(list(enumerate(lines))) if "</package>" in line), len(lines))
    for at in (*[i + 1 for i in reversed(after)], end):
        around = lines[at - 1] if at else ""
        indentation = around[: len(around) - len(around.lstrip())] if at in [i + 1 for i in after] else "  "
        changed = "\n".join([*lines[:at], *(f"{indentation}{tag}" for tag in tags.split("\n")), *lines[at:]])
        if (
            _parses(changed)
            and _without_comments(changed) != _without_comments(text)
            and tags.split("\n", 1)[0] in _without_comments(changed)
        ):
            files.change("manifest-line", MANIFEST, changed, message)
            return


# ---- CMakeLists.txt


def repair_cmake(files: Files, package: PackageFacts, name: str, wanted: Wanted) -> None:
    """Find what `CMakeLists.txt` lacks. `name` is the package's name in the manifest."""
    if files.text(CMAKE) is None:
        return
    _close_bracket(files)
    if commands_of(_cmake(files).encode()) is None:
        return
    _spell_commands(files)
    needs = " ".join(wanted.dependencies or ("rospy", "std_msgs"))
    if not _calls_catkin(files, package):
        line = f"find_package(catkin REQUIRED COMPONENTS {needs})"
        _add_call(files, "find_package(catkin …)", r"find_package\s*\(\s*catkin\b", line, ("project",))
    if not _has(files, package, "catkin_package"):
        below = ("find_package", "project")
        _add_call(files, "catkin_package()", r"catkin_package\s*\(", "catkin_package()", below)
    _install(files, package, wanted)
    _correct_include(files)
    _name_project(files, package, name, wanted.package)


def _cmake(files: Files) -> str:
    return files.text(CMAKE) or ""


def _commands(files: Files, *names: str) -> list[Command]:
    found = commands_of(_cmake(files).encode()) or []
    return [c for c in found if c.identifier.lower() in names]


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


def _replace_token(text: str, token: Token, new: str) -> str:
    return text[: token.span.start] + new + text[token.span.stop :]


def _close_bracket(files: Files) -> None:
    """Close the bracket at the end of the last line that is no comment, or in a line of its own."""
    text = _cmake(files)
    if commands_of(text.encode()) is not None:
        return
    lines = text.rstrip().split("\n")
    last = max((i for i, line in enumerate(lines) if line.split("#", maxsplit=1)[0].strip()), default=0)
    for added in ([lines[last] + ")"], [lines[last], ")"]):
        changed = "\n".join([*lines[:last], *added, *lines[last + 1 :], ""])
        if commands_of(changed.encode()) is not None:
            message = f"line {last + 1} of {CMAKE}: an opening bracket is never closed"
            files.change("build-line", CMAKE, changed, message)
            return


def _spell_commands(files: Files) -> None:
    """Spell commands right that have nearly the name of a known one, unless the file defines them."""
    defined = {words[0].value.lower() for c in _commands(files, "function", "macro") if (words := _words(c))}
    for command in reversed(commands_of(_cmake(files).encode()) or []):
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
        fix = f"take INCLUDE_DIRS {listed} out" if absent == given else f"take {listed} out of INCLUDE_DIRS"
        files.change("build-line", CMAKE, text, message, fix)
        return


def _name_project(files: Files, package: PackageFacts, name: str, wanted: str) -> None:
    """Name the project. A manifest in whose name the lab's is meant gets that name later."""
    right = wanted if _is_meant(files, package, name, wanted) else name
    for command in _commands(files, "project")[:1]:
        words = _words(command)
        if words and words[0].value.strip('"') not in (name, right) and "$" not in words[0].value:
            given = words[0].value
            message = f"line {command.line} of {CMAKE}: project({given}) is not the package's name, {name}"
            kind: RepairKind = "package-name" if is_near(given, name) else "build-line"
            files.change(kind, CMAKE, _replace_token(_cmake(files), words[0], name), message)


def _add_call(files: Files, what: str, pattern: str, line: str, below: Sequence[str]) -> None:
    """Take the call out of its comment, or write it below the first of these commands that is there."""
    text = _cmake(files)
    changed = _uncomment(text, pattern)
    if changed is None:
        lines = text.split("\n")
        above = next((found[0] for name in below if (found := _commands(files, name))), None)
        at = text.count("\n", 0, above.span.stop) + 1 if above is not None else len(lines)
        changed = "\n".join([*lines[:at], line, *lines[at:]])
    files.change("build-line", CMAKE, changed, f"{CMAKE} does not call {what}")


def _uncomment(text: str, pattern: str) -> str | None:
    """The text with the first such call taken out of its comment, up to its closing bracket; None without one."""
    lines = text.split("\n")
    for first, line in enumerate(lines):
        if not re.match(rf"\s*#+\s?{pattern}", line, re.IGNORECASE):
            continue
        call: list[str] = []
        for line_of_call in lines[first : first + CALL_LINES_MAX]:
            call.append(re.sub(r"^(\s*)#+ ?", r"\1", line_of_call, count=1))
            if commands_of("\n".join(call).encode()):
                return "\n".join([*lines[:first], *call, *lines[first + len(call) :]])
    return None


def _install(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    own = [f.path for f in package.files if is_own(f.path)]
    there = {path for path in (_place(own, files, script) for script in wanted.installed) if path}
    calls = _commands(files, INSTALL)
    named = {_plain(t.value) for c in calls for t in _words(c)}
    if any("$" in name and not name.startswith("${CATKIN_") for name in named):
        return  # which scripts a variable holds is for CMake to say
    missing = sorted(there - named)
    if missing and not calls:
        line = f"{INSTALL}(PROGRAMS {' '.join(missing)}\n  DESTINATION {BIN}\n)"
        changed = _uncomment(_cmake(files), rf"{INSTALL}\s*\(")
        if changed is None or not all(path in changed for path in missing):
            changed = f"{_cmake(files).rstrip()}\n\n{line}\n"
        fix = f"write {' '.join(line.split())}"
        files.change("build-line", CMAKE, changed, f"{CMAKE} does not install {join_words(missing)}", fix)
        return
    _name_scripts(files, own, missing)
    _correct_destination(files, there)


def _place(own: Sequence[str], files: Files, script: str) -> str:
    """Return where the script lies; "" where it is not there."""
    name = PurePosixPath(script).name
    copies = [p for p in own if PurePosixPath(p).name == name]
    renamed = [
        r.after for r in files.repairs if r.kind == "file-name" and PurePosixPath(r.after).name == name
    ]
    return script if script in (*copies, *renamed) else next(iter([*copies, *renamed]), "")


def _plain(word: str) -> str:
    return re.sub(r"^\$\{(PROJECT_SOURCE_DIR|CMAKE_CURRENT_SOURCE_DIR)\}/|^\./", "", word.strip('"'))


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
            if _plain(token.value) not in own and _is_about(PurePosixPath(token.value).name, name):
                message = f"line {call.line} of {CMAKE}: {token.value} does not exist; the script is {path}"
                fix = f"write {path} for {token.value}"
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
        if given and names_one and given.value != BIN and given.value.strip("${}").startswith("CATKIN_"):
            message = f"line {call.line} of {CMAKE}: {given.value} is not where rosrun looks"
            fix = f"write DESTINATION {BIN}"
            files.change("build-line", CMAKE, _replace_token(_cmake(files), given, BIN), message, fix)
            return
