"""A build's first error in a student's words, and what to do."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Sequence
from pathlib import PurePosixPath

from grader.checks.support.cpp_errors import (
    CPP_ERRORS,
    FIRST_ERROR_HINT,
    BuildError,
    Explain,
    Explained,
    folder_names,
    missing_header,
    missing_link,
    other_namespace,
    plainly,
    programs_without,
)
from grader.checks.support.cpp_types import TYPE_ERRORS
from grader.checks.support.missing_packages import is_declared, missing_package
from grader.checks.support.scripts import (
    CPP_SUFFIXES,
    OF_FILES,
    OF_INTERFACES,
    cmake_calls,
    installed,
    own_header,
    where_written,
)
from grader.checks.support.text import in_one_line, near_names, shown
from grader.installable import (
    LIBRARIES,
    known_packages,
    noetic_messages,
)
from grader.model.file_fault import Fault
from grader.model.generated_headers import fixes_of, reasons_of, unwaited_targets
from grader.model.message_definitions import meant_field
from grader.model.package import CMAKE, INTERFACE_FOLDERS, MANIFEST, CMakeCall, PackageFacts, meant_command
from grader.model.verdict import FileCitation
from grader.wording import ON_THE_MACHINE, join_words, on_lines, there_is

UNKNOWN_COMMAND = "Unknown CMake command"
BACKSLASH = 'bad character with text "\\"'
_QUOTES = dict.fromkeys(map(ord, "\u2018\u2019`"), "'")
"""As compilers and linkers write them."""
OF_TARGETS = (
    "add_executable", "add_library", "target_link_libraries", "add_dependencies", "set_target_properties",
)  # fmt: skip
OF_CATKIN = ("catkin_package", "catkin_install_python", "catkin_python_setup")
"""Commands that `find_package(catkin …)` defines."""


def explain_error_of_build(error: BuildError, package: PackageFacts, lines: Sequence[str]) -> Explained:
    """Return the error in a student's words, else as it was printed."""
    text = error.text.translate(_QUOTES)
    if error.kind == "cmake" and (explained := _beside_the_folder(text, package)):
        return explained
    for pattern, explain in _EXPLAINED:
        if found := re.search(pattern, text):
            explained = explain(found, package, lines)
            return explained._replace(why=explained.why.replace(text, in_one_line(text)))
    return Explained(in_one_line(error.text), FIRST_ERROR_HINT)


def _beside_the_folder(text: str, package: PackageFacts) -> Explained | None:
    """Explain what CMake does not find where it looks, and what lies in the folder beside the build files."""
    folder = package.folder_beside
    there = {f.path.removeprefix(f"{folder}/") for f in package.files if folder}
    there |= {f"{posixpath.dirname(path)}/" for path in there} - {"/"}
    words = (word.strip("/.") for word in re.findall(r"[\w./+-]+", text))
    absent = next(
        (path for word in words for path in there if f"/{word}/".endswith(f"/{path.rstrip('/')}/")), ""
    )
    if not absent:
        return None
    why = f"{absent} is in {folder}/, and {CMAKE} and {MANIFEST} lie beside that folder"
    return Explained(why, move_into(folder))


def move_into(folder: str) -> str:
    """Return how the build files come into the folder that they are for."""
    return f"git mv {CMAKE} {MANIFEST} {folder}/"


def unreadable_file(package: PackageFacts) -> Explained | None:
    """Return what is wrong with `package.xml`, else `CMakeLists.txt`, where nothing is built because of it."""
    of_cmake = package.cmake.fault if package.cmake is not None else None
    fault = next((f for f in (package.manifest_fault, of_cmake) if f and f.kind != "Missing"), None)
    if fault is None:
        return None
    line = f", line {fault.line}" if fault.line else ""
    why = f"{fault.file}{line} cannot be read: {fault.explanation}"
    return Explained(why, repair_of_file(fault), place=fault.place)


def repair_of_file(fault: Fault) -> str:
    """Return what to do where `package.xml` or `CMakeLists.txt` cannot be read."""
    return (fault.fix if fault.unclosed else fault.advice) or "correct that line, then run catkin_make"


def _unreadable(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    if BACKSLASH in " ".join(word for line in lines for word in line.split()):
        why = "a line of this call ends with \\, as in a shell: in CMake a call goes on without it"
        return Explained(why, "delete the \\ at the end of each line of that call")
    return unreadable_file(package) or Explained(found.string, FIRST_ERROR_HINT)


def _missing_library(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    """A library beside ROS, or a package that is not among catkin's components."""
    name = found[1]
    if name not in LIBRARIES:
        return missing_package(found, package, lines)
    why = f"it needs the library {name}, which this grading machine lacks"
    hint = f"{ON_THE_MACHINE}apt-get install {LIBRARIES[name]}, then grade again"
    return Explained(why, hint, of_machine=True)


def _missing_folder(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    call, folder = found[1], posixpath.basename(found[2].rstrip("/"))
    if wrong := _misplaced(call, package, f".{folder}"):
        return wrong
    why = f"{call}(…) needs the folder {folder}/, which is not in the package"
    return Explained(why, f"put your .{folder} files into {folder}/ and push them, or remove {call}(…)")


def _missing_launch(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    path, call = _below(found[1], package), "roslaunch_add_file_check(…)"
    if posixpath.splitext(path)[1]:
        return _missing_files([path], package, f"{call} names {path}", leave=f"remove {call}")
    why = f"{call} names the folder {path}/, which is not in the package"
    return Explained(why, f"put your launch files into {path}/ and push them, or remove {call}")


def _missing_source(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    made = [*cmake_calls(package, "add_executable"), *cmake_calls(package, "add_library")]
    named = [word for call in made for word in _sources(call)]
    absent = [word for word in dict.fromkeys(named) if package.file(word) is None]
    if len(absent) > 1 and found[1] in absent:
        words = f"targets are built from {join_words(absent)}"
        taken = _calls_of_targets(package, made, absent)
        return _missing_files(absent, package, words, "the calls that name them", taken)
    path = PurePosixPath(found[1])
    if not path.stem.strip(".") or path.name in CPP_SUFFIXES:
        why = f"a target is built from {found[1]}: a variable in its name has no value"
        return Explained(why, "correct the name of the variable in `${…}` on that line")
    taken = _calls_of_targets(package, made, [found[1]])
    own = next((call for call in made if found[1] in call.args), None)
    loop = own and where_written(package, path.stem, own)
    if own is not None and loop is not own and loop is not None:
        there = [f.path for f in package.files if f.path.endswith(CPP_SUFFIXES)]
        near = near_names(found[1], there)
        seen = f"; {there_is(near)}" if near else ""
        why = f"line {loop.line} names {path.stem}, and so a target is built from {found[1]}"
        add = f"add {found[1]} and push it, or remove {path.stem} from line {loop.line}"
        right = near and f"on line {loop.line}, write {PurePosixPath(near[0]).stem} in place of {path.stem}"
        return Explained(f"{why}, which is not in the package{seen}", right or add, place=loop.place)
    return _missing_files([found[1]], package, f"a target is built from {found[1]}", leave=taken)


def _calls_of_targets(package: PackageFacts, made: Sequence[CMakeCall], absent: Sequence[str]) -> str:
    """Return how the targets that are built of nothing but absent files are left out: all of their calls."""
    targets = {c.args[0] for c in made if c.args and set(_sources(c)) and set(_sources(c)) <= set(absent)}
    lines = {c.line for c in cmake_calls(package, *OF_TARGETS) if c.args and c.args[0] in targets}
    return f"delete what is built from them: the calls on {on_lines(sorted(lines))}" if lines else ""


def _same_target(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of two calls that make one target: the name of the later one's source is meant, where nothing has it."""
    made = [c for c in cmake_calls(package, "add_executable", "add_library") if c.args]
    same = [c for c in made if c.args[0] == found[1]]
    if len(same) < 2:
        return Explained(found.string, FIRST_ERROR_HINT)
    why = f"the target {found[1]} is made twice, on line {same[0].line} and on line {same[1].line}"
    stems = [PurePosixPath(word).stem for word in _sources(same[1])]
    if len(stems) == 1 and stems[0] not in {c.args[0] for c in made}:
        fix = f"on line {same[1].line}, write {stems[0]} in place of {found[1]}"
        others = [c for c in cmake_calls(package, *OF_TARGETS[2:]) if c.args[:1] == (found[1],)]
        below = sorted({c.line for c in others if c.line > same[1].line})
        return Explained(why, f"{fix}, and the same on {on_lines(below)}" if below else fix)
    return Explained(why, f"delete one of the two, or give it another name than {found[1]}")


def _sources(call: CMakeCall) -> list[str]:
    return [word for word in call.args[1:] if posixpath.splitext(word)[1] in CPP_SUFFIXES]


def no_types(package: PackageFacts) -> Explained | None:
    """Return which fields of the package's own definitions have types that do not exist; None where all do."""
    own = {posixpath.basename(one.path).partition(".")[0] for one in package.interfaces}
    faults = [one.fault for one in package.interfaces if one.fault is not None]
    if faults:
        hint = faults[0].fix or "write each line as a type and a name: `float64 speed`"
        return Explained(f"{faults[0].file}: {faults[0].cause}", hint, place=faults[0].place)
    wrong = [
        (FileCitation(file=one.path, line=field.line), field, right)
        for one in package.interfaces
        for field in one.fields
        if (right := meant_field(field, own, noetic_messages())) != (field.type, field.name)
    ]
    if not wrong:
        return None
    place, first, _ = wrong[0]
    listed = {word for call in cmake_calls(package, "generate_messages") for word in call.args}
    others = {right.partition("/")[0] for _, _, (right, _) in wrong if "/" in right} - listed
    named = f", and {join_words(sorted(others))} after DEPENDENCIES in generate_messages(…)" if others else ""
    is_alone = len(wrong) == 1 and not others  # then the place is cited, and need not be told
    where = "" if is_alone else "on line {0.line} of {0.file}, "
    fixes = [f"{where.format(at)}write `{' '.join(right)}`" for at, _, right in wrong]
    why = f"line {place.line} of {place.file}: there is no field type `{shown(first.type)}`"
    return Explained(why, join_words(fixes) + named, place=place)


def _no_definition(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of a line that is not a field."""
    return no_types(package) or Explained(found.string, FIRST_ERROR_HINT)


def _message_of_another(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    words = " ".join(word for line in lines for word in line.split())
    named = re.search(r"Cannot locate message \[(\w+)\]: unknown package \[(\w+)\]", words)
    message = posixpath.basename(found[1])
    if wrong := no_types(package):
        return wrong
    if named is None:
        why = f"{message} needs messages that generate_messages(DEPENDENCIES …) does not name"
        return Explained(why, FIRST_ERROR_HINT)
    why = f"{message} has a field of the type {named[2]}/{named[1]}, and generate_messages(…) does not name {named[2]}"
    found_already = {word for call in cmake_calls(package, "find_package") for word in call.args}
    more = "" if named[2] in found_already else ", and in find_package(…) and package.xml"
    return Explained(why, f"write {named[2]} after DEPENDENCIES in generate_messages(…){more}")


def _unfound_dependency(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    name, calls = found[1], cmake_calls(package, "find_package")
    of_catkin = next((call.line for call in calls if call.args[:1] == ("catkin",)), None)
    where = f" on line {of_catkin}" if of_catkin else ""
    why = f"generate_messages(…) names {name}, and find_package(catkin …) does not"
    is_old = package.manifest is not None and package.manifest.format == 1
    kinds = ("build_depend", "run_depend") if is_old else ("depend",)
    lines = join_words(f"<{kind}>{name}</{kind}>" for kind in kinds)
    more = "" if is_declared(name, package) else f"; in package.xml, add {lines}"
    return Explained(why, f"write {name} after COMPONENTS in the find_package(…){where}{more}")


def _late_project(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """CMake gives a name of its own to what comes before `project(…)`."""
    call = next(iter(cmake_calls(package, "project")), None)
    why = f"project(…) comes after {found[1]}(…)" if call else f"there is no project(…) before {found[1]}(…)"
    fix = f"move project(…) from line {call.line} to" if call else f"write project({package.name})"
    return Explained(why, f"{fix} just below cmake_minimum_required(…), with find_package(…) next")


def _other_project(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    why = f"project({found[1]}) differs from the package's name {package.name}"
    return Explained(why, f"write project({package.name})")


def _missing_message(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    path, call = _below(found[1], package), f"add_{found[2]}_files"
    if wrong := _misplaced(call, package, posixpath.basename(path)):
        return wrong
    return _missing_files([path], package, f"{call}(…) names {path}")


def _misplaced(call: str, package: PackageFacts, ending: str) -> Explained | None:
    """Explain `add_message_files(FILES Add.srv)`, and a definition that lies in another folder."""
    named = [word for one in cmake_calls(package, call) for word in one.args]
    folder = INTERFACE_FOLDERS[call]
    for other, kind in INTERFACE_FOLDERS.items():
        if other != call and (name := next((word for word in named if word.endswith(f".{kind}")), "")):
            mixed = any(not word.endswith(f".{kind}") for word in named if "." in word)
            fix = f"name {name} in {other}(…)" if mixed else f"write {other} instead of {call}"
            return Explained(f"{call}(…) names {name}, which is for {other}(…)", fix)
    there = [f.path for f in package.files if f.path.endswith(ending) and posixpath.dirname(f.path) != folder]
    meant = {posixpath.basename(word) for word in named}
    there.sort(key=lambda path: (posixpath.basename(path) not in meant, path.count("/")))
    if there:
        why = f"{call}(…) looks for {posixpath.basename(there[0])} in {folder}/, and it is {there[0]}"
        return Explained(why, f"make the folder {folder}/, if there is none, and move {there[0]} into it")
    return None


def _missing_script(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    path, there = _below(found[1], package), {f.path for f in package.files}
    named = [one for one in installed(package) if one.call.name == "catkin_install_python" and one.known]
    others = [_below(one.path, package) for one in named if not one.path.startswith("$")]
    absent = [p for p in dict.fromkeys((path, *others)) if there.isdisjoint((p, p.removeprefix("./")))]
    paths = absent if len(absent) > 1 else [path]
    told = _missing_files(paths, package, f"catkin_install_python(…) names {join_words(paths)}")
    call = next((one.call for one in named if one.path.endswith(path)), None)
    written = where_written(package, path, call) if call is not None else None
    if written is None or written is call or len(paths) > 1:
        return told
    hint = told.hint.replace("remove it from that call", f"remove it from line {written.line}")
    hint = hint if "remove it" in hint else f"on line {written.line}, {hint}"
    return told._replace(hint=hint, place=written.place)


def _missing_files(
    paths: Sequence[str], package: PackageFacts, words: str, where: str = "that call", leave: str = ""
) -> Explained:
    """Return what `words` says of files that are not in the package, with the paths of those that lie elsewhere in it.

    `where` is what names them, and `leave` how to leave them out where it is more than not to name them.
    """
    there = [f.path for f in package.files]
    alike = {path: [one for one in there if _is_same_language(one, path)] for path in paths}
    near = {path: found[0] for path in paths if (found := near_names(path, alike[path]))}
    seen = f"; {there_is(dict.fromkeys(near.values()))}" if near else ""
    if len(paths) == 1:
        hint = f"add {paths[0]} and push it, or {leave.replace('them', 'it') or f'remove it from {where}'}"
        if near:
            (old_folder, old), (folder, new) = map(posixpath.split, (paths[0], near[paths[0]]))
            here = f"write {new} instead of {old}"
            hint = here if folder == old_folder else f"write {folder}/{new} there"
        return Explained(f"{words}, which is not in the package{seen}", hint)
    hints = [f"write {right} instead of {path}" for path, right in near.items()]
    if rest := [path for path in paths if path not in near]:
        them = "them" if len(rest) > 1 else "it"
        hints.append(f"add {join_words(rest)} and push {them}, or {leave or f'take {them} out of {where}'}")
    return Explained(f"{words}, which are not in the package{seen}", "; ".join(hints))


def _is_same_language(one: str, other: str) -> bool:
    """Return whether one file could be built or run in the place of the other: none of Python's for one of C++."""
    is_cpp = [posixpath.splitext(path)[1] in CPP_SUFFIXES for path in (one, other)]
    return is_cpp[0] == is_cpp[1]


def _below(path: str, package: PackageFacts) -> str:
    """An absolute path in the build's workspace, from the package's folder."""
    folders = "|".join(re.escape(name) for name in folder_names(package) if name)
    return re.sub(rf"^/.*/src/(?:.*/)?(?:{folders})/", "", path, count=1) if folders else path


def _no_cmake_lists(_found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    name, file = misspelt_cmake_lists(package), package.file(CMAKE)
    if not name and file is not None and file.link_problem:
        why = f"CMakeLists.txt is a link to {file.link or 'a file'}, which was not handed in"
        return Explained(why, "replace it with the CMakeLists.txt that catkin_create_pkg writes")
    if not name:
        return Explained("there is no CMakeLists.txt", "add the CMakeLists.txt that catkin_create_pkg writes")
    return Explained(f"the file is called {name}, and CMake looks for {CMAKE}", f"git mv {name} {CMAKE}")


def misspelt_cmake_lists(package: PackageFacts) -> str:
    """Return the file that is called almost `CMakeLists.txt`, "" where there is none."""
    names = [f.path for f in package.files if "/" not in f.path]
    slips = ("cmakelists.txt", "cmakelist.txt", "cmakelists", "cmakelists.txt.txt")
    return next((n for n in names if n.casefold() in slips and n != "CMakeLists.txt"), "")


def _missing_dependency(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    target = found[1]
    why = f"add_dependencies({found[2]} {target}) names the target {target}, which does not exist"
    targets = "${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS}"
    calls = [call for call in cmake_calls(package, "add_dependencies") if target in call.args[1:]]
    written = {c.line: f"add_dependencies({c.args[0]} {targets})" for c in calls}
    hint = f"write add_dependencies({found[2]} {targets})"
    if len(written) > 1:
        hint = join_words(f"on line {line} write {one}" for line, one in written.items())
    if not any(PurePosixPath(file.path).suffix in OF_FILES.values() for file in package.files):
        return Explained(f"{why}: the package has no messages of its own", hint)
    if cmake_calls(package, "generate_messages"):
        return Explained(why, hint)
    hint = f"{hint}; messages of your own need generate_messages(…) above it"
    return Explained(why, hint, uncalled="generate_messages")


def _run_dependency(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    name = found[1]
    tag = "run_depend" if package.manifest and package.manifest.format == 1 else "exec_depend"
    why = f"catkin_package(…) depends on {name}, and package.xml does not declare it as a run-time dependency"
    hint = f"add <{tag}>{name}</{tag}> to package.xml, or take {name} out of catkin_package(…)"
    return Explained(why, hint)


def _unused_argument(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    why = f"{found[1]}(…) does not know what to do with {shown(found[2].replace(';', ' '))}"
    kept = f"write it after {_KEYWORDS.get(found[1], 'its keyword')}, spelt like this"
    return Explained(why, "remove each `...` from its brackets" if "..." in found[2].split(";") else kept)


_KEYWORDS = dict.fromkeys(OF_INTERFACES, "FILES") | {
    "catkin_package": "INCLUDE_DIRS, LIBRARIES, CATKIN_DEPENDS or DEPENDS",
    "generate_messages": "DEPENDENCIES",
}
_PLACE = "end it with `DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}}`, spelt like this"


MAY_FAIL = "a parallel build (-j) sometimes fails"
FIXES_MAX = 4
MADE = (".msg", ".srv", ".action")
"""Files of which the build makes headers."""
OWN_TARGETS = "${${PROJECT_NAME}_EXPORTED_TARGETS}"
NO_TARGET = r'dependency target "([^"]+)" of target "([^"]+)" does not exist'


def _header_race(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    text = f"{found[1]}/{found[2]}.h does not exist when the program is compiled"
    action = re.sub("(Action)?(Goal|Result|Feedback)?$", "", found[2])
    made = {f"msg/{found[2]}.msg", f"srv/{found[2]}.srv", f"action/{action}.action"}
    if found[1] != package.name or not made & {f.path for f in package.files}:
        own = [PurePosixPath(f.path).stem for f in package.files if f.path.endswith(tuple(MADE))]
        there = own if found[1] == package.name else noetic_messages().get(found[1], ())
        near = near_names(found[2], there) if found[2] not in there else ()
        if near:
            why = f"there is no header {found[1]}/{found[2]}.h"
            return Explained(why, f"write `#include <{found[1]}/{near[0]}.h>`")
        if found[1] in known_packages():
            return missing_package(found, package, lines)
        if any(found[1] in call.args for call in cmake_calls(package, "find_package")):
            # found, and so built beside this package: its messages come too late
            what = f"the messages of {found[1]}"
            return _unwaited(package, text, what, "${catkin_EXPORTED_TARGETS}", lines)
        if made & {f.path for f in package.files}:
            lacks = "" if cmake_calls(package, "generate_messages") else "generate_messages"
            why = f"{text}: the build makes {found[2]}.h in {package.name}/, the package's name"
            why += lacks and f", once CMakeLists.txt calls {lacks}(…)"
            return Explained(why, f'write `#include "{package.name}/{found[2]}.h"`', uncalled=lacks)
        hint = own_header(package, f"{found[1]}/{found[2]}.h")
        why = "the compiler does not look into its folder" if hint else "there is no such header"
        return Explained(f"{text}: {why}", hint or "check the #include and find_package(…)")
    return _unwaited(package, text, "its message", OWN_TARGETS, lines)


def _half_written(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    """What a header declares is not there although it is included: the build is just writing it."""
    made = any(file.path.endswith(MADE) for file in package.files)
    if found[1] != package.name or not made or not cmake_calls(package, "generate_messages"):
        return other_namespace(found, package)
    text = f"{found[1]} is not declared, since the header of its message was not written yet"
    return _unwaited(package, text, "its message", OWN_TARGETS, lines)


def _unwaited(package: PackageFacts, text: str, what: str, targets: str, lines: Sequence[str]) -> Explained:
    """Return that programs do not wait for a header that the build makes. Any of them may be compiled too early."""
    if found := unwaited_targets(package, noetic_messages()):
        why = "; ".join(reasons_of(found))
        return Explained(
            f"{text}: {why}, so {MAY_FAIL}", "; ".join(fixes_of(found)), place=found[0].line.place
        )
    warned = re.search(NO_TARGET, " ".join(line.strip() for line in lines))
    if warned is not None:  # older policies only warn of it
        one = _missing_dependency(warned, package, lines)
        return one._replace(why=f"{text}: {one.why}, so {MAY_FAIL}")
    why = f"{text}: nothing makes it wait for {what}, so {MAY_FAIL}"
    waiting = programs_without(package, "add_dependencies")
    fixes = [
        f"below the add_executable(…) on line {call.line}, write add_dependencies({call.args[0]} {targets})"
        for call in cmake_calls(package, "add_executable")
        if call.args and call.args[0] in waiting
    ]
    programs = join_words(waiting, most=len(waiting)) or "each program"
    other = f"write add_dependencies(<program> {targets}) below the add_executable(…) of {programs}"
    return Explained(why, "; ".join(fixes) if 0 < len(fixes) <= FIXES_MAX else other)


def _unknown_command(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    name = found[1]
    if right := meant_command(name.lower()):
        return Explained(f"there is no command {name}(…)", f"write {right} instead of {name}")
    has_catkin = any(one.args[:1] == ("catkin",) for one in cmake_calls(package, "find_package"))
    if name.lower() in OF_INTERFACES and has_catkin:
        why = f"{name}(…) comes with message_generation, which find_package(catkin …) does not name"
        call = next(iter(cmake_calls(package, name.lower())), None)
        catkin = [one for one in cmake_calls(package, "find_package") if one.args[:1] == ("catkin",)]
        words = "" if "COMPONENTS" in catkin[0].args else "COMPONENTS "
        fix = f"in the find_package(…) on line {catkin[0].line}, add {words}message_generation"
        if call is not None and not package.interfaces:
            fix = f"delete {name}(…), line {call.line}: the package has no messages, services or actions of its own"
        return Explained(why, fix, by_itself=True)
    if name.lower() in {*OF_CATKIN, *OF_INTERFACES}:
        why = f"{name}(…) is catkin's, and find_package(catkin …) is not called above it"
        hint = f"call find_package(catkin REQUIRED COMPONENTS …) above {name}(…)"
        return Explained(why, hint, uncalled="find_package")
    return Explained(f"there is no command {name}(…)", "check the spelling of the command")


def _not_catkin(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    kind = package.manifest.build_type if package.manifest is not None else None
    if not (kind or "").startswith("ament"):
        return Explained(found.string, FIRST_ERROR_HINT)
    return Explained(f"{package.manifest.file} is for a ROS 2 package", "make a package for ROS 1")  # type: ignore[union-attr]


_EXPLAINED: tuple[tuple[str, Explain], ...] = (
    (r'Could not find a package \w+ file provided by "([\w-]+(?:[,;.:][\w,;.:-]*)?)"', missing_package),
    (r'By not providing "Find([\w-]+)\.cmake"', _missing_library),
    (r"Could NOT find ([\w-]+) \(missing:", _missing_library),
    (r"(add_\w+_files)\(\) directory not found: (\S+)", _missing_folder),
    (
        r"Assertion failed: file '([^']+)' does not exist\. Message: (message|service|action)",
        _missing_message,
    ),
    (r"catkin_install_python\(\) called with non-existing file '([^']+)'", _missing_script),
    (
        r"catkin_package\(\)(?: absolute)? include dir '([^']+?)/*' does not exist",
        plainly(
            "catkin_package(…) names the folder {1}/, which is not in the package",
            "remove INCLUDE_DIRS {1}: it is for C++ header files, and git keeps no empty folder; "
            "or put them into {1}/ and push them",
        ),
    ),
    (r"roslaunch_add_file_check\(\) path '([^']+)' was not found", _missing_launch),
    (r"Cannot find source file: (\S+)", _missing_source),
    (r'cannot create target "([^"]+)" because another target', _same_target),
    (r"Could not find messages which '([^']+)' depends on", _message_of_another),
    (r"Messages depends on unknown pkg: ([\w-]+)", _unfound_dependency),
    (r"(Invalid declaration|is not a legal message|InvalidMsgSpec|MsgNotFound)", _no_definition),
    (r"genaction\.py", _no_definition),
    (
        r"generate_messages\(\) must be called after (\w+)\(\)",
        plainly("{1}(…) is called after generate_messages(…)", "move {1}(…) above generate_messages(…)"),
    ),
    (
        r"(generate_messages)\(\) must be called before catkin_package\(\)",
        plainly("{1}() is called after catkin_package()", "move {1}(…) above catkin_package(…)"),
    ),
    (r"You must call project\(\) before calling (\w+)\(\)", _late_project),
    (r"does not match current PROJECT_NAME '([^']*)'", _other_project),
    (UNKNOWN_COMMAND + r' "(\w+)"', _unknown_command),
    (r"Parse error\.|Error\(s\) in package", _unreadable),
    (r"does not contain a CMakeLists\.txt", _no_cmake_lists),
    (r"contains non-catkin packages", _not_catkin),
    (NO_TARGET, _missing_dependency),
    (
        r"catkin package '([^']+)' has been find_package\(\)-ed but is not listed as a build",
        plainly(
            "find_package(…) names {1}, and package.xml does not declare it as a build dependency",
            "add <build_depend>{1}</build_depend> to package.xml",
        ),
    ),
    (r"(\w+)\(\) called with unused arguments: (\S+)", _unused_argument),
    (
        r"(\w+)\(\) called without required DESTINATION",
        plainly("{1}(…) does not say where to install", _PLACE),
    ),
    (r"catkin_package\(\) DEPENDS on the catkin package '([^']+)' which must", _run_dependency),
    (
        r"catkin_package\(\) DEPENDS on (?:the catkin package )?'([^']+)'",
        plainly(
            "DEPENDS in catkin_package(…) names {1}, which is not a library that find_package(…) found",
            "take {1} out of DEPENDS; ROS packages go after CATKIN_DEPENDS",
        ),
    ),
    (r"(?<![\w+/.-])(\w+)/(\w+)\.h: No such file or directory", _header_race),
    (r"cannot find -l(\S+?)(?::|$)", missing_link),
    (r"([\w+./-]+): No such file or directory", missing_header),
    (r"'(\w+)' has not been declared", _half_written),
    *TYPE_ERRORS,
    *CPP_ERRORS,
)
