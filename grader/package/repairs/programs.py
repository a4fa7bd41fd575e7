"""What a build installs and links: scripts, launch files and C++ programs that `CMakeLists.txt` names."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from itertools import takewhile
from pathlib import PurePosixPath

from cmake_parser.ast import Command, Token

from grader.model.package import CMAKE, PackageFacts
from grader.package.repairs.cmake_calls import (
    CALLS_MAX,
    all_words,
    calls_of,
    change_line,
    change_word,
    cmake_text,
    find_commented,
    has_call,
    replace_token,
    words_of,
)
from grader.package.repairs.editing import Files
from grader.package.repairs.files import is_own
from grader.package.repairs.names import CPP, Wanted, is_near
from grader.wording import join_words, numbers_text

BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"
INSTALL = "catkin_install_python"
_IS_BIN = re.compile(
    r"\$\{CATKIN_PACKAGE_BIN_DESTINATION\}|\$\{CATKIN_(GLOBAL|PACKAGE)_LIB_DESTINATION\}/\$\{(CMAKE_)?PROJECT_NAME\}"
)
"""How the place where rosrun looks can be written with catkin's variables."""


def _turn_programs(files: Files) -> None:
    """Write the program's name in front of its source, where the two have changed places."""
    for call in reversed(calls_of(files, "add_executable")[:CALLS_MAX]):  # places above stay
        first, second, *_ = [*words_of(call), None, None]
        if first is None or second is None or not first.value.endswith(CPP) or "." in second.value:
            continue
        if (files.folder / first.value).is_file() and not (files.folder / second.value).exists():
            text = replace_token(replace_token(cmake_text(files), second, first.value), first, second.value)
            fix = f"write add_executable({second.value} {first.value})"
            why = "the program's name comes first in add_executable(…), and its source behind it"
            change_line(files, call, text, why, fix)


def make_programs(files: Files, package: PackageFacts) -> None:
    """Make the program that a call is about, and none makes, of the only program's source that no call names."""
    if calls_of(files, "foreach", "function", "macro", "include", "add_subdirectory"):
        return
    made = {target.value for call in calls_of(files, *MAKING) for target in words_of(call)[:1]}
    named = {_plain(word.value) for call in calls_of(files, *MAKING) for word in words_of(call)[1:]}
    sources = [f.path for f in package.files if is_own(f.path) and f.path.endswith(CPP)]
    left = [path for path in sources if path not in named and _MAIN.search(files.text(path) or "")]
    for call in calls_of(files, *OF_TARGETS[1:]):
        target = _target_of(call)
        if target is None or target.value in made or "$" in target.value or len(left) != 1:
            continue
        text, line = cmake_text(files), f"add_executable({target.value} {left[0]})"
        at, commented = find_commented(text, rf"add_executable\s*\(\s*{re.escape(target.value)}\s") or (0, [])
        fix = f"remove the `#` on line {at + 1}" if commented else f"above line {call.line}, write {line}"
        changed = f"{text[: call.span.start]}{line}\n{text[call.span.start :]}"
        change_line(files, call, changed, f"no add_executable(…) makes the program {target.value}", fix)
        return


_MAIN = re.compile(r"\bint\s+main\s*\(")


def link_programs(files: Files, package: PackageFacts) -> None:
    """Link ROS to programs that nothing is linked to. A program without ROS is none the worse for it."""
    linked = {words[0].value for c in calls_of(files, "target_link_libraries") if (words := words_of(c))}
    told = package.cmake.calls if package.cmake is not None else ()  # loops and variables are followed there
    linked |= {call.args[0] for call in told if call.name == "target_link_libraries" and call.args}
    if has_call(files, package, "link_libraries"):
        return
    for call in reversed(calls_of(files, "add_executable")):  # places above stay
        words = words_of(call)
        if words and words[0].value not in linked and not _is_elsewhere(words):
            text, line = cmake_text(files), f"target_link_libraries({words[0].value} ${{catkin_LIBRARIES}})"
            changed = f"{text[: call.span.stop]}\n{line}{text[call.span.stop :]}"
            change_line(files, call, changed, f"nothing is linked to the program {words[0].value}")


def name_targets(files: Files) -> None:
    """Call what waits for a target, links to it or installs it by the target's name, below the call that makes it."""
    _turn_programs(files)
    # Where a file makes targets in such ways, which there are is for CMake to say.
    if calls_of(files, "foreach", "function", "macro", "include", "add_subdirectory"):
        return
    for _ in range(CALLS_MAX):
        made = dict[str, Command]()
        for call in calls_of(files, *MAKING):
            for word in words_of(call)[:1]:
                made.setdefault(word.value, call)
        if any(_OF_VARIABLE.search(name) for name in made):
            return
        if not (_correct_target(files, made) or _move_below(files, made)):
            return


OF_CATKIN = ("catkin_LIBRARIES", "catkin_INCLUDE_DIRS", "catkin_EXPORTED_TARGETS", BIN[2:-1])
"""Variables that find_package(catkin …) and catkin_package(…) set."""
_VARIABLE = re.compile(r"\$\{(\w+)\}")


def spell_variables(files: Files) -> None:
    """Write catkin's variables for slips of them, which CMake takes for empty."""
    plain = {token.value for token in all_words(files)}
    using = ("target_link_libraries", "include_directories", "add_dependencies", "install", INSTALL)
    for call in reversed(calls_of(files, *using)):
        for token in reversed(words_of(call)):  # places in front stay
            name = found[1] if (found := _VARIABLE.fullmatch(token.value)) else ""
            singular = name.replace("LIBRARY", "LIBRARIES")
            right = next(
                (one for one in OF_CATKIN if one != name and (singular == one or is_near(name, one))), ""
            )
            if right and name not in plain:  # nothing sets it
                why, fix = f"there is no variable {name}", f"write ${{{right}}} instead of ${{{name}}}"
                change_word(files, token, f"${{{right}}}", why, fix, call=call)


def _correct_target(files: Files, made: Mapping[str, Command]) -> bool:
    """Write the name of a target in place of one that is not there; return whether there was one."""
    for name in (*OF_TARGETS[1:], "install"):
        about = [(call, target) for call in calls_of(files, name) if (target := _target_of(call))]
        given = {target.value for _, target in about}
        for call, target in about:
            meant = [one for one in made if one not in given and is_near(target.value, one)]
            if "$" not in target.value and target.value not in made and len(meant) == 1:
                why = f"there is no target {target.value}: it is called {meant[0]}"
                fix = f"write {meant[0]} instead of {target.value}"
                change_word(files, target, meant[0], why, fix, call=call)
                return True
    return False


def _target_of(call: Command) -> Token | None:
    """Return the target that a call is about: its first word, or of install(TARGETS …) the second."""
    words = words_of(call)
    if call.identifier.lower() == "install":
        words = words[1:] if words and words[0].value == "TARGETS" else []
    return words[0] if words else None


def _move_below(files: Files, made: Mapping[str, Command]) -> bool:
    """Move a call that is about a target below the one that makes it; return whether there was one."""
    for call in calls_of(files, *OF_TARGETS[1:]):
        target = _target_of(call)
        maker = made.get(target.value) if target is not None else None
        if maker is None or maker.line <= call.line:
            continue
        text, span, at = cmake_text(files), call.span, maker.span.stop
        # Its line stays, empty, so that those between them keep the numbers that they were handed in with.
        changed = f"{text[: span.start]}{text[span.stop : at]}\n{text[span]}{text[at:]}"
        what = f"{call.identifier}({target.value if target else ''} …)"
        why = f"{what} is called above {maker.identifier}(…), which makes its target"
        change_line(files, call, changed, why, f"move {what}, line {call.line}, below line {maker.line}")
        return True
    return False


MAKING = (
    *("add_executable", "add_library", "add_custom_target", "cuda_add_executable", "cuda_add_library"),
    *("catkin_add_gtest", "catkin_add_gmock", "add_rostest_gtest", "add_rostest_gmock"),
)
_OF_VARIABLE = re.compile(r"\$\{(?!(CMAKE_)?PROJECT_NAME\})")


def _is_elsewhere(words: Sequence[Token]) -> bool:
    """Return whether add_executable(…) only gives a name to what is made elsewhere."""
    return not {"ALIAS", "IMPORTED"}.isdisjoint(token.value for token in words)


def name_programs(files: Files, wanted: Wanted) -> None:
    """Give the program of a source that has the lab's name this name too."""
    calls = {words[0].value: c for c in calls_of(files, "add_executable") if (words := words_of(c))}
    stems = {target: {PurePosixPath(t.value).stem for t in words_of(c)[1:]} for target, c in calls.items()}
    if "OUTPUT_NAME" in cmake_text(files):
        return
    for name in (one for one in wanted.scripts if "." not in one and "/" not in one and one not in calls):
        others = [t for t in stems if t not in wanted.scripts and "$" not in t and name in stems[t]]
        if len(others) == 1:
            old = others[0]
            changed = re.sub(rf"(?<![\w/.-]){re.escape(old)}(?![\w/.-])", name, cmake_text(files))
            why = f"the program is called {old}, and the lab wants {name}"
            change_line(
                files, calls[old], changed, why, f"write {name} in place of {old} wherever it is named"
            )


def install_scripts(files: Files, package: PackageFacts, wanted: Wanted) -> None:
    own = [f.path for f in package.files if is_own(f.path)]
    there = {path for path in (_place(own, files, script) for script in wanted.installed) if path}
    calls = calls_of(files, INSTALL)
    named = {_plain(t.value) for c in calls for t in words_of(c)}
    told = package.cmake.calls if package.cmake is not None else ()
    by_others = any(call.name == INSTALL and call.file != CMAKE for call in told)
    if by_others or any("$" in name and not name.upper().startswith("${CATKIN_") for name in named):
        return  # which scripts a variable holds, or another file installs, is for CMake to say
    missing = sorted(there - named)
    if missing and not calls:
        line = f"{INSTALL}(PROGRAMS {' '.join(missing)}\n  DESTINATION {BIN}\n)"
        at, call = find_commented(cmake_text(files), rf"{INSTALL}\s*\(") or (0, [])
        if all(path in "\n".join(call) for path in missing):
            lines = cmake_text(files).split("\n")
            changed = "\n".join([*lines[:at], *call, *lines[at + len(call) :]])
        else:
            changed = f"{cmake_text(files).rstrip()}\n\n{line}\n"
        fix = f"write {' '.join(line.split())}"
        files.change("build-line", CMAKE, changed, f"{CMAKE} does not install {join_words(missing)}", fix)
        return
    _name_scripts(files, own, missing)
    _correct_destination(files, there)


def correct_paths(files: Files, package: PackageFacts) -> None:
    """Of files that a call names and that lie elsewhere in the package, each by its name alone, or that have nearly
    this name in the same folder: where they lie."""
    own = [f.path for f in package.files if is_own(f.path)]
    written = {_plain(token.value) for token in all_words(files)}
    for call in reversed(calls_of(files, INSTALL, "add_executable", "add_library")):  # places above stay
        words = words_of(call)
        named = words if call.identifier.lower() == INSTALL else words[1:]  # a target may be called mean.cpp
        moved = [(one, there) for one in named if (there := _meant_file(files, one.value, own, written))]
        text = cmake_text(files)
        for token, right in reversed(moved):
            text = replace_token(text, token, right)
        names, there = join_words(t.value for t, _ in moved), join_words(right for _, right in moved)
        why = f"{call.identifier}(…) names {names}, which the package has as {there}"
        fix = " and ".join(f"write {right} instead of {token.value}" for token, right in moved)
        change_line(files, call, text, why, fix)


def _meant_file(files: Files, word: str, own: Sequence[str], written: Collection[str]) -> str:
    """Return where the only file lies that a word means which names none; "" where it is not plain. What `written`
    names is meant there."""
    path = PurePosixPath(_plain(word))
    if not path.suffix or not _is_missing(files, word, ()):
        return ""
    same = [one for one in own if PurePosixPath(one).name == path.name]
    sources = (one for one in own if one not in written and one.endswith((".py", *CPP)))
    near = [one for one in sources if _is_slip_of(path, PurePosixPath(one))]
    found = same or near
    return found[0] if len(found) == 1 else ""


def _is_slip_of(written: PurePosixPath, path: PurePosixPath) -> bool:
    """Return whether a letter is wrong in a file's name. Where only a digit differs, they are two files."""
    letters = {re.sub(r"\d", "", one.name) for one in (written, path)}
    return written.parent == path.parent and len(letters) > 1 and is_near(written.name, path.name)


OF_TARGETS = ("add_executable", "target_link_libraries", "add_dependencies", "set_target_properties")
"""Calls that begin with a target's name."""
WRITING = ("configure_file", "add_custom_command", "file")
"""Calls that name files which the build writes."""


def leave_out_missing(files: Files, wanted: Wanted) -> None:
    """Leave out of the copy's build what two calls name and the package does not have, so that the rest is made. What
    the lab asks for is not left out: a criterion of its own is lost by it."""
    asked = {PurePosixPath(path).name for path in wanted.scripts}
    for call in reversed(calls_of(files, INSTALL)):  # places above stay
        words = [token for token in words_of(call) if token.value]
        if any(token.value == "OPTIONAL" for token in words):
            continue
        first = next((i for i, token in enumerate(words) if token.value == "PROGRAMS"), 0) + 1
        listed = list(takewhile(lambda token: not token.value.isupper(), words[first:]))
        lost = [token for token in listed if _is_missing(files, token.value, asked)]
        whole = [call] if len(lost) == len(listed) else lost
        _leave_out(files, call, lost, [one.span for one in whole], "remove {it} from that call")
    made = [words for call in calls_of(files, "add_executable") if (words := words_of(call))]
    made = [words for words in made if not _is_elsewhere(words)]
    asked |= {PurePosixPath(token.value).name for c in calls_of(files, *WRITING) for token in words_of(c)}
    sources = [
        (words[0], [t for t in words[1:] if not t.value.isupper() and _is_missing(files, t.value, asked)])
        for words in made
    ]
    targets = {target.value for target, lost in sources if lost}
    about = [c for c in calls_of(files, *OF_TARGETS) if words_of(c) and words_of(c)[0].value in targets]
    lines = f"{'lines' if len(about) > 1 else 'line'} {numbers_text([call.line for call in about])}"
    instead = f"delete what is built from {{it}}: the calls on {lines}"
    all_lost = [token for _, lost in sources for token in lost]
    _leave_out(files, next(iter(about), None), all_lost, [one.span for one in about], instead)


def _leave_out(
    files: Files, call: Command | None, lost: Sequence[Token], spans: Sequence[slice], instead: str
) -> None:
    if call is None or not lost:
        return
    text = cmake_text(files)
    for span in sorted(spans, key=lambda one: -one.start):
        text = text[: span.start].rstrip(" ") + text[span.stop :]
    names, them = join_words(token.value for token in lost), "them" if len(lost) > 1 else "it"
    fix = f"add {names} and push {them}, or {instead.format(it=them)}"
    change_line(
        files, call, text, f"{call.identifier}(…) names {names}, which the package does not have", fix
    )


def _is_missing(files: Files, word: str, asked: Collection[str]) -> bool:
    path = PurePosixPath(_plain(word))
    renamed = {repair.after for repair in files.repairs if repair.kind == "file-name"}
    known = "$" in word or path.name in asked or str(path) in renamed or ".." in path.parts
    return not known and not path.is_absolute() and not (files.folder / path).exists()


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
    call = next((c for c in calls_of(files, INSTALL) if _installs_programs(c)), None)
    if not unnamed:
        return
    text, listed = cmake_text(files), " ".join(unnamed)
    if call is None:
        line = f"{INSTALL}(PROGRAMS {listed} DESTINATION {BIN})"
        message = f"{CMAKE} does not install {join_words(unnamed)} where rosrun looks"
        files.change("build-line", CMAKE, f"{text.rstrip()}\n\n{line}\n", message, f"write {line}")
        return
    words = words_of(call)
    programs = next(t for t in words if t.value == "PROGRAMS")
    behind = words[words.index(programs) + 1 :][:1]
    known = {"DESTINATION", *(PurePosixPath(one).name for one in own)}  # that it lies elsewhere is told of it
    strays = (t for t in behind if PurePosixPath(_plain(t.value)).name not in known)
    stray = next((t for t in strays if "$" not in t.value), None)
    fix = f"write {listed} in place of {stray.value}" if stray else f"write {listed} after PROGRAMS"
    new, why = listed if stray else f"PROGRAMS {listed}", f"{INSTALL}(…) does not name {join_words(unnamed)}"
    change_word(files, stray or programs, new, why, fix, call=call)


def _replace_stray(files: Files, own: Sequence[str], path: str) -> bool:
    name = PurePosixPath(path).name
    for call in calls_of(files, INSTALL):
        for token in words_of(call):
            given = _plain(token.value)
            same = re.sub(r"[\\/]", "", given) == path.replace("/", "")
            if given not in own and (same or _is_about(PurePosixPath(given).name, name)):
                why = f"{token.value} is named, but does not exist; the script is {path}"
                change_word(files, token, path, why, f"write {path} instead of {token.value}")
                return True
    return False


def _installs_programs(call: Command) -> bool:
    """Return whether the call installs programs where rosrun looks, or gives no place."""
    words = [token.value for token in words_of(call)]
    given = words[words.index("DESTINATION") + 1 :][:1] if "DESTINATION" in words else []
    return "PROGRAMS" in words and given in ([], [BIN])


def _is_about(given: str, name: str) -> bool:
    return given == name or is_near(given, name) or f"{given}.py" == name


def _correct_destination(files: Files, scripts: Collection[str]) -> None:
    """Write the place of a call that has none, and, of one that names one of the scripts, catkin's place for these in
    place of another, or of a slip of its name."""
    for call in calls_of(files, INSTALL):
        words = words_of(call)
        at = next((i for i, t in enumerate(words) if t.value == "DESTINATION"), len(words))
        given = words[at + 1] if at + 1 < len(words) else None
        names_one = any(_plain(t.value) in scripts for t in words)
        place = next((w for w in words if "CATKIN_PACKAGE_BIN_DESTINATION" in w.value.upper()), None)
        if at in (len(words), len(words) - 1) and "PROGRAMS" in [t.value for t in words]:
            text, last = cmake_text(files), words[-1].span.stop
            lacks = "DESTINATION" if at == len(words) else "place behind DESTINATION"
            if place is not None:
                text = replace_token(text, words[at], "") if at < len(words) else text
                changed = replace_token(text, place, f"DESTINATION {BIN}")
            elif at < len(words):
                changed = f"{text[:last]} {BIN}{text[last:]}"
            else:
                changed = f"{text[:last]}\n  DESTINATION {BIN}{text[last:]}"
            change_line(files, call, changed, f"{call.identifier}(…) has no {lacks}")
            return
        if given and names_one and not _IS_BIN.fullmatch(given.value) and "CATKIN_" in given.value.upper():
            why, fix = f"{given.value} is not where rosrun looks", f"write DESTINATION {BIN}"
            change_word(files, given, BIN, why, fix, call=call)
            return
