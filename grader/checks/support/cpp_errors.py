"""What the compiler and the linker say of a C++ source, in a student's words, and what to do."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

from grader.checks.support.scripts import (
    CPP_SUFFIXES,
    cmake_calls,
    loop_variable,
    own_header,
    part_not_linked,
    path_in_package,
)
from grader.checks.support.text import near_names, shown
from grader.installable import noetic_messages
from grader.model.package import CMAKE, PackageFacts
from grader.model.verdict import FileCitation
from grader.wording import ON_THE_MACHINE, ask_semicolon, on_lines, there_is

_CMAKE_ERROR = re.compile(
    r"^CMake Error(?: at (?P<file>[^:()]+):(?P<line>\d+)(?: \((?P<call>\w+)\))?)?:?\s*(?P<text>.*)"
)
_COMPILER_ERROR = re.compile(r"^(?P<file>[^:\s][^:]*):(?P<line>\d+):(?:\d+:)? (?:fatal )?error: (?P<text>.*)")
_REQUIRED = re.compile(r"^(?P<file>[^:\s][^:]*):(?P<line>\d+):\d+:\s+required from here")
_OTHER_ERROR = re.compile(
    r"(?P<text>.*(?:\b[Ee]rror:|Error\(s\)|undefined reference|cannot find -l|No rule to make|[A-Za-z]Error:|\*\*\*).*)"
)
_CALLER = re.compile(r"^\s+(?P<file>[^:()]+):(?P<line>\d+) \(\w+\)$")
CALL_STACK = "Call Stack (most recent call first):"
CALLERS_MAX = 40
ERROR_CHARS = 1000
"""Of an error, so much is looked at: the paths in it may be long, and what they are said of comes behind them."""
SYSTEM = ("/usr/", "/opt/")
FIRST_ERROR_HINT = "run catkin_make in a fresh clone and fix the first error that it prints"


class BuildError(NamedTuple):
    """The first error that the build printed; `kind` is `cmake`, `compiler` or `other`.

    `place` is the line of the package's own that it comes from.
    """

    kind: str
    text: str
    place: FileCitation | None


class Explained(NamedTuple):
    """The error in a student's words, and what to do; `of_machine`: the grading machine lacks something; `place`: the
    line that is wrong, where that is not the one that the build names; `lacks`: the package that it lacks; `by_itself`:
    a command that CMake does not know, and no line of catkin's own is why; `uncalled`: a command to call."""

    why: str
    hint: str
    of_machine: bool = False
    place: FileCitation | None = None
    lacks: str = ""
    by_itself: bool = False
    uncalled: str = ""


Explain = Callable[[re.Match[str], PackageFacts, Sequence[str]], Explained]
"""From what was found in an error, the package and the build's lines to the error in a student's words."""


def plainly(why: str, hint: str) -> Explain:
    """Return what explains an error in these words; {0} stands for all of it, {1} for the pattern's first group."""

    def explain(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
        printed = (found.string, *found.groups())
        return Explained(why.format(*printed), hint.format(*printed))

    return explain


def first_error(lines: Sequence[str], package: PackageFacts) -> BuildError | None:
    """Return the first line that fits: a compiler's error comes before make's summary of it."""
    required: FileCitation | None = None
    for index, line in enumerate(lines):
        if match := _REQUIRED.match(line):
            required = _own_line(package, match["file"], int(match["line"])) or required
        if match := _CMAKE_ERROR.match(line):
            below = lines[index + 1 :]
            called = [(match["file"] or "", int(match["line"] or 0)), *_callers(below)]
            places = (_own_line(package, file, number) for file, number in called)
            text = match["text"] or _paragraph(below)
            place = next(filter(None, places), None)
            named = place is None and match["file"] and not match["file"].startswith(SYSTEM)
            text = f"{match['file']}:{match['line']}: {text}" if named else text
            return BuildError("cmake", shown(text, ERROR_CHARS), place)
        if match := _COMPILER_ERROR.match(line):
            return _of_compiler(match, package, required)
    other = next((m["text"] for m in map(_OTHER_ERROR.match, lines) if m), None)
    return BuildError("other", shown(other, ERROR_CHARS), None) if other else None


def _of_compiler(match: re.Match[str], package: PackageFacts, required: FileCitation | None) -> BuildError:
    place = _own_line(package, match["file"], int(match["line"]))
    of_system = match["file"].startswith(SYSTEM)
    # in a header of ROS, where the student's own line is the last one that led there
    place = required if of_system else place
    file, number = (place.file, place.line) if of_system and place else (match["file"], match["line"])
    where = f"{posixpath.basename(file)}:{number}: "
    name = "" if of_system and not place else where
    # the other name of a type is long, and would leave no room for what is wrong with it
    text = name + re.sub(r" \{aka [^}]*\}", "", match["text"])
    return BuildError("compiler", shown(text, ERROR_CHARS), place)


def further_errors(lines: Sequence[str], package: PackageFacts, first: BuildError) -> list[BuildError]:
    """Return what the compiler says of other lines of the package's own sources, the first of each line, in the order
    in which it says so."""
    matches = filter(None, map(_COMPILER_ERROR.match, lines if first.kind == "compiler" else ()))
    found = dict[FileCitation | None, BuildError]()
    for one in (_of_compiler(match, package, None) for match in matches):
        found.setdefault(one.place, one)
    return [one for place, one in found.items() if place not in {None, first.place}]


def _callers(lines: Sequence[str]) -> list[tuple[str, int]]:
    """The call stack below an error, the innermost call first."""
    end = next((i for i, line in enumerate(lines[:CALLERS_MAX]) if line.startswith("CMake ")), CALLERS_MAX)
    begin = next((i for i, line in enumerate(lines[:end]) if line.startswith(CALL_STACK)), end)
    found = (_CALLER.match(line) for line in lines[begin + 1 : end])
    return [(match["file"], int(match["line"])) for match in found if match]


def _own_line(package: PackageFacts, file: str, line: int) -> FileCitation | None:
    """The line if it lies in the package. A bare `CMakeLists.txt` is the workspace's own."""
    outside = not line or "/" not in file or file.startswith(SYSTEM)
    path = None if outside else path_in_package(package, file)
    folder = posixpath.basename(posixpath.dirname(file))
    of_another = path == "CMakeLists.txt" and folder not in folder_names(package)
    return FileCitation(file=path, line=line) if path and not of_another else None


def folder_names(package: PackageFacts) -> set[str]:
    """The names that the package's folder may have in the build's workspace."""
    manifest = {package.manifest.name} if package.manifest else set()
    return {package.name, posixpath.basename(package.path), *manifest}


def _paragraph(lines: Sequence[str]) -> str:
    """The text of a CMake error: the first paragraph after its heading, and the one that its colon announces."""
    words: list[str] = []
    for line in lines:
        ends = bool(words) and not line.strip() and not _goes_on(words)
        if ends or line.startswith((CALL_STACK, "CMake ")):
            break
        words += line.split()
    return " ".join(words)


def _goes_on(words: Sequence[str]) -> bool:
    """CMake sets a path apart by blank lines in the middle of this sentence."""
    return words[-1].endswith(":") or (words[:3] == ["The", "source", "directory"] and words[-1][-1] != ".")


STANDARD = {
    **dict.fromkeys(("cout", "cin", "cerr", "endl"), "iostream"),
    **dict.fromkeys(("string", "to_string", "stoi"), "string"),
    **{
        name: name for name in ("vector", "map", "deque", "list", "set", "queue", "array", "function", "pair")
    },
    "function": "functional",
    "pair": "utility",
    **dict.fromkeys(("unique_ptr", "shared_ptr", "make_shared", "make_unique"), "memory"),
    **dict.fromkeys(("sqrt", "abs", "pow", "isnan", "isinf"), "cmath"),
    **dict.fromkeys(("sort", "min_element", "max_element"), "algorithm"),
}
"""Names of C++'s standard library that are written without `std::`, with their headers."""


KEYWORDS = (
    "return",
    "while",
    "for",
    "if",
    "else",
    "int",
    "void",
    "bool",
    "double",
    "float",
    "class",
    "const",
    "true",
)
OF_ROS = {
    "init": 'ros::init(argc, argv, "name")',
    "advertise": 'nh.advertise<std_msgs::String>("topic", 10)',
    "subscribe": 'nh.subscribe("topic", 10, callback)',
    "advertiseService": 'nh.advertiseService("service", callback)',
    "serviceClient": 'nh.serviceClient<package::Type>("service")',
    "publish": "pub.publish(msg)",
    "Rate": "ros::Rate rate(10)",
}
"""Calls of roscpp, as they are written."""
_OF_ROS_H = re.compile(
    r"(?:init|ok|spin|spinOnce|shutdown|NodeHandle|Publisher|Subscriber|Rate|Time|Duration|Service(?:Server|Client))"
    r"|ROS_(?:DEBUG|INFO|WARN|ERROR|FATAL)(?:_STREAM)?"
)
"""What `ros/ros.h` declares: unknown only where that is not included."""


def _source(found: re.Match[str], lines: Sequence[str], number: str = "") -> str:
    """Return the line of the source that the compiler shows below its error; "" for none."""
    place = re.search(r":(\d+):", found.string)
    shown_there = re.compile(rf"\s*{number or (place[1] if place else '0')} \|(.*)")
    return next((match[1].strip() for line in lines if (match := shown_there.match(line))), "")


def _no_semicolon(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    if _source(found, lines).startswith("for"):
        why = f"{found.string}: a `;` is missing between the parts of the `for`"
        return Explained(why, "write it as in `for (int i = 0; i < 3; i++)`")
    if found[2] == ")":
        why = f"{found.string}: there is a `)` that no `(` opens"
        return Explained(why, "on that line, write the `(` that is missing, or delete a `)`")
    hint = f"write a `;` at the end of the statement before `{found[2]}`" if found[1] else ask_semicolon()
    return Explained(f"{found.string}: a `;` is missing", hint)


def _no_bracket(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    return Explained(
        f"{found.string}: a `{found[1]}` is missing", f"write a `{found[1]}` before `{found[2]}`"
    )


def _no_end_of_macro(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    """The compiler looks for the bracket down to the file's end, and names the line of the call only then."""
    called = re.compile(
        rf"([^:\s]+):(\d+):\d+: (?:error: .{found[1]}. was not declared|warning: missing terminating (\"))"
    )
    place = next((match for line in lines if (match := called.match(line))), None)
    path = path_in_package(package, place[1]) if place else None
    at = FileCitation(file=path, line=int(place[2])) if path and place else None
    where = f" on line {at.line} of {path}" if at else ""
    if place and place[3]:
        return Explained(
            f'the text{where} has no `"` at its end', 'write a `"` where its text ends', place=at
        )
    return Explained(
        f"the `(` of {found[1]}{where} is not closed", "write a `)` before the `;` of that call", place=at
    )


def _no_quote(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    source = _source(found, lines)
    sign = found[1] or (">" if "<" in source else "<" if ">" in source else '"')
    where = "at the end of" if sign != "<" else "before the file's name on"
    hint = (
        f"write a `{sign}` {where} that line"
        if source.startswith("#")
        else f"write a `{sign}` where its text ends"
    )
    return Explained(f"{found.string}: a `{sign}` is missing", hint)


def _no_head(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    why = f"{found.string}: what is above this `{{` does not begin a function"
    head = "`int main(int argc, char **argv)`"
    return Explained(
        why, f"above it, write the function's head with its brackets and without a `;`, as in {head}"
    )


def _outside(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of a statement, or a brace, that stands in no function."""
    why = f"{found.string}: that line is outside of every function"
    return Explained(why, "count the braces above it: a `{` is missing there, or a `}` is too many")


def _twice(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    name = re.sub(r"\(.*", "", found[1]).split()[-1]
    above = re.compile(r"\S+?:(\d+):\d+: note: .*previous")
    first = next((f" on line {match[1]}" for line in lines if (match := above.match(line))), "")
    why = f"{found.string}: {name} is declared{first} already"
    return Explained(why, f"delete that line, or give what it declares another name than {name}")


def _other_arguments(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    """Of a call of roscpp's with too few, too many or other arguments, or with them in another order."""
    place, source = re.search(r":(\d+):", found.string), _source(found, lines)
    if any(place and f":{place[1]}:" in line and "character constant" in line for line in lines):
        why = f"{found.string}: single quotes are for a single character"
        return Explained(why, "write the text of that line in double quotes")
    if found[1] == "init" and "ros::init" not in source:
        return Explained(found.string, FIRST_ERROR_HINT)
    return Explained(f"{found.string}: these arguments do not fit", f"write it as in `{OF_ROS[found[1]]}`")


def _no_call(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    """A function that is named without its brackets: called, or given to another function."""
    method = re.split(r"::|\s", re.sub(r"\(.*", "", found[1] or ""))[-1] or r"\w+"
    named = re.search(rf"(?:\.|->|^ros::){method}\b(?!\s*\()", _source(found, lines))
    if named is None:
        return _no_address(found, package, lines) if found[1] else Explained(found.string, FIRST_ERROR_HINT)
    method = re.sub(r"\W*(?:ros::)?", "", named[0], count=1)
    place = found.string.partition(" ")[0]
    return Explained(f"{place} `{method}` is not called without brackets", f"write `{method}()` on that line")


def _no_semicolon_above(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    """Where what the compiler did not expect begins its line, the statement above has no end."""
    place = re.search(r":(\d+):", found.string)
    if not _source(found, lines).startswith(found[1]):
        return Explained(found.string, FIRST_ERROR_HINT)
    return Explained(f"{found.string}: a `;` is missing above it", ask_semicolon(place[1] if place else ""))


_OUTSIDE = re.compile(
    r"([^/\s:]+):(\d+):\d+: error: expected (?:unqualified-id before .(?:return|while|for|if)|declaration before .\})"
)


def _explain_undeclared(found: re.Match[str], _package: PackageFacts, lines: Sequence[str]) -> Explained:
    name, near = found[1], found[2]
    source = _source(found, lines)
    if "not name a type" in found.string and re.match(rf"{name}\s*(?:\.|->|=|\()", source):
        return _outside(found, _package, lines)
    if re.search(rf"\b(?:ros|std|\w+_msgs):{name}\b", source):
        return Explained(found.string, f"write `::` in place of the `:` before {name}")
    if re.fullmatch(r"_\d", name) and any("boost::bind" in line for line in lines):
        return _no_placeholder(name)
    is_bound = re.fullmatch(r"_\d", name) is not None and any("std::bind" in line for line in lines)
    if is_bound or name in STANDARD:
        whole, header = (f"placeholders::{name}", "functional") if is_bound else (name, STANDARD[name])
        return Explained(found.string, f"write std::{whole}, and #include <{header}> at the top")
    is_first = re.match(rf"(?:.*[{{}};]\s*)?{name}\s*[(\w]", source)
    if not near and is_first and (keyword := near_names(name, KEYWORDS)):
        return Explained(found.string, f"write `{keyword[0]}` in place of `{name}`")
    declare = f"declare {name} above that line, or include the header that does"
    meant = f"write {near} there, if that is what you mean; otherwise {declare}"
    outside = next((match for line in lines if (match := _OUTSIDE.search(line))), None)
    why, hint = found.string, meant if near else declare
    if outside is not None and outside[1] == why.partition(":")[0]:
        why = f"{why}, and line {outside[2]} is outside of every function"
        hint = "count the braces above these lines: a `{` is missing there, or a `}` is too many"
    return Explained(why, hint)


def _no_ros_h(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    if not _OF_ROS_H.fullmatch(found[1]):
        return Explained(found.string, FIRST_ERROR_HINT)
    return Explained(f"{found.string}: ros/ros.h is not included", "write `#include <ros/ros.h>` at the top")


def other_namespace(found: re.Match[str], package: PackageFacts, _lines: Sequence[str] = ()) -> Explained:
    """Of `ROS::init`, and of `std_msg::String`."""
    named = [name for call in cmake_calls(package, "find_package") for name in call.args]
    near = near_names(found[1], ["ros", "std", *named])
    hint = f"write {near[0]}:: instead of {found[1]}::" if near else FIRST_ERROR_HINT
    return Explained(f"{found.string}: it is no namespace" if near else found.string, hint)


def _no_placeholder(name: str) -> Explained:
    """The Boost of ROS Noetic knows `_1` by itself, and later ones do not."""
    why = f"{name} in boost::bind(…) is unknown to this grading machine's Boost, which is newer than ROS Noetic's"
    hint = f"{ON_THE_MACHINE}build it with ROS Noetic's Boost; boost::placeholders::{name} works with both"
    return Explained(why, hint, of_machine=True)


def _no_address(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    method = re.sub(r"\(.*", "", found[1]).split()[-1]
    hint = f"write &{method} where you give it to another function, without brackets behind it"
    return Explained(found.string, hint)


def no_type(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """A service's type has two parts, and nothing else; a message's package has its messages."""
    scope, name = found["scope"], found["name"]
    own = [posixpath.basename(one.path).partition(".")[0] for one in package.interfaces]
    own += [
        f"{one}{part}" for one in own for part in ("Request", "Response") if package.file(f"srv/{one}.srv")
    ]
    types = [*own] if scope == package.name else noetic_messages().get(scope, ())
    if name in types:
        why = f"{found.string}: its header is not included"
        return Explained(why, f"write `#include <{scope}/{name}.h>` at the top")
    near = near_names(name, types or ("Request", "Response"))
    what = f"the names of {scope}'s messages" if types else f"the name of that part of {scope}"
    return Explained(
        f"there is no {name} in {scope}", f"write {scope}::{near[0]}" if near else f"look up {what}"
    )


def _without_main(package: PackageFacts, lines: Sequence[str]) -> Explained:
    """Name the program that has no `main`, by the target that make gives up, and where it is but a comment."""
    left = [
        one[1] for line in lines if (one := re.search(r"\*\*\* \[.*/CMakeFiles/([^/]+)\.dir/build", line))
    ]
    made = [
        call.args for call in cmake_calls(package, "add_executable") if left and call.args[:1] == (left[0],)
    ]
    sources = [one for args in made for one in args[1:] if one.endswith(CPP_SUFFIXES)]
    why = f"the program {left[0]} has no `main` function" if left else "a program has no `main` function"
    slip = next((s for s in package.slips if s.kind == "commented-out" and s.file in sources), None)
    if slip is not None:
        return Explained(f"{why}: in {slip.file}, it is a comment", slip.fix, place=slip.place)
    place = sources[0] if len(sources) == 1 else "one of its sources"
    return Explained(why, f"write `int main(int argc, char **argv)` in {place}")


def _explain_unlinked(found: re.Match[str], package: PackageFacts, lines: Sequence[str]) -> Explained:
    if found[1] == "main":
        return _without_main(package, lines)
    name = found[1].partition("(")[0]
    alone = programs_without(package, "target_link_libraries") if name.startswith("ros::") else []
    program = alone[0] if alone else "<program>"
    own = "" if alone else "; a function of your own needs its .cpp file in add_executable(…)"
    why = f"{name} is used, but nothing that is linked defines it"
    catkin = [call for call in cmake_calls(package, "find_package") if call.args[:1] == ("catkin",)]
    if name.startswith("ros::") and catkin and not alone and not any("roscpp" in c.args for c in catkin):
        words = "roscpp" if "COMPONENTS" in catkin[0].args else "COMPONENTS roscpp"
        return Explained(why, f"in the find_package(…) on line {catkin[0].line}, add {words}")
    part = "" if name.startswith("ros::") else part_not_linked(package)
    made = next((c for c in cmake_calls(package, "add_executable") if c.args[:1] == (program,)), None)
    program = (made and loop_variable(package, made)) or program
    hint = f"write {call_below(program, 'target_link_libraries', '${catkin_LIBRARIES}')}{own}"
    return Explained(why, part or hint)


def programs_without(package: PackageFacts, command: str) -> list[str]:
    """Return the programs that no such command is called for."""
    named = {call.args[0] for call in cmake_calls(package, command) if call.args}
    made = [call.args[0] for call in cmake_calls(package, "add_executable") if call.args]
    return [program for program in made if program not in named]


def call_below(program: str, command: str, words: str) -> str:
    return f"{command}({program} {words}) below its add_executable(…)"


def _missing_target(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    name = found[1]
    why = f"it names the target {name}, which no add_executable(…) or add_library(…) above it makes"
    made = [call for call in cmake_calls(package, "add_executable", "add_library") if call.args]
    below = next((call for call in made if call.args[0] == name), None)
    if below is not None:
        there = f"{below.name}({name} …) is below it, on line {below.line}"
        return Explained(f"{why}: {there}", f"move {below.name}({name} …) above that line")
    source = next(
        (f.path for f in package.files if f.path.endswith(tuple(f"/{name}{end}" for end in CPP_SUFFIXES))), ""
    )
    other = next((call for call in made if source and source in call.args), None)
    if other is not None:
        there = f"{other.name}({other.args[0]} …) on line {other.line} makes {other.args[0]} of {source}"
        return Explained(f"{why}: {there}", f"write {name} instead of {other.args[0]} on line {other.line}")
    if source:
        return Explained(why, f"above it, write add_executable({name} {source})")
    if near := near_names(name, [call.args[0] for call in made]):
        return Explained(f"{why}; {there_is(near)}", f"write {near[0]} instead of {name}")
    return Explained(why, f"take that line out, or make {name} above it")


OF_INSTALL = ("TARGETS", "PROGRAMS", "DIRECTORY", "FILES", "ARCHIVE", "LIBRARY", "RUNTIME", "DESTINATION")


_UNKNOWN_KEYWORD = (
    r"install (?:called with unknown mode|does not recognize sub-command|TARGETS given unknown argument) "
    r'"?(\w+)'
)


def _unknown_keyword(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    near = near_names(found[1], OF_INSTALL)
    hint = f"write {near[0]} instead of {found[1]}" if near else "check the spelling of its words in capitals"
    return Explained(f"install(…) does not know the word {found[1]}", hint)


def _no_language(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """Of targets that are built from scripts, or from nothing that CMake can compile."""
    made = [
        call for call in cmake_calls(package, "add_executable", "add_library")
        if len(call.args) > 1 and all(word.endswith(".py") for word in call.args[1:])
    ]  # fmt: skip
    if not made:
        return Explained(
            f"CMake knows none of the sources of {found[1]} as C or C++", "name its .cpp file there"
        )
    targets = {call.args[0] for call in made}
    linked = cmake_calls(package, "target_link_libraries", "add_dependencies", "set_target_properties")
    lines = sorted({call.line for call in (*made, *linked) if call.args and call.args[0] in targets})
    why = f"{made[0].name}({made[0].args[0]} …) is for C++, and {made[0].args[1]} is a script of Python"
    place = FileCitation(file=CMAKE, line=made[0].line)
    return Explained(
        why, f"delete the calls on {on_lines(lines)} of {CMAKE}: Python is not compiled", place=place
    )


CPP_ERRORS: tuple[tuple[str, Explain], ...] = (
    (r"Cannot determine link language for target \"([^\"]+)\"", _no_language),
    (r"expected (',' or )?';' before '([^']+)'", _no_semicolon),
    (r"expected '([()])' before '([^']+)'", _no_bracket),
    (r"unterminated argument list invoking macro \"(\w+)\"", _no_end_of_macro),
    (r"missing terminating ([\">]) character|#include expects", _no_quote),
    (
        r"invalid preprocessing directive #\w+; did you mean (#\w+)\?",
        plainly("{0}", "write `{1}` there"),
    ),
    (r"expected unqualified-id before '{'", _no_head),
    (r"'(ROS_(?:DEBUG|INFO|WARN|ERROR|FATAL)(?:_STREAM)?)' was not declared", _no_ros_h),
    (
        r"expected (?:unqualified-id before '(?:return|while|for|if|else|do|switch|})|declaration before '})'",
        _outside,
    ),
    (r"re(?:declaration|definition) of '([^']+)'", _twice),
    (rf"no matching function for call to '(?:ros::(?:\w+::)?)?({'|'.join(OF_ROS)})[<(]", _other_arguments),
    (r"statement cannot resolve address of overloaded function()", _no_call),
    (r"'(\w+)' is not a member of 'ros'(?!;)", _no_ros_h),
    (r"expected initializer before '([^']+)'", _no_semicolon_above),
    (
        r"a function-definition is not allowed here before '{'",
        plainly(
            "{0}: the function above it is not closed",
            "write the `}}` that ends the function above that line",
        ),
    ),
    (
        r"expected '}' at end of input",
        plainly(
            "{0}: a `}}` is missing", "write a `}}` for each `{{`; the indentation shows where one is missing"
        ),
    ),
    (
        r"'([^']+)' (?:was not declared in this scope|does not name a (?:template )?type)(?:; did you mean '([^']+)')?",
        _explain_undeclared,
    ),
    (r"invalid use of (?:non-static )?member function '([^']+)'", _no_call),
    (r"'(?P<scope>[^']+)::(?P<name>\w+)' has not been declared", no_type),
    (r"'(?P<name>\w+)' is not a member of '(?P<scope>\w+_msgs)'(?!;)", no_type),
    (
        r"could not convert '.*operator=\(",
        plainly("a single `=` sets a value, and compares nothing", "write `==` on that line"),
    ),
    (r"'(\w+)' (?:has not been declared|is not a class, namespace, or enumeration)", other_namespace),
    (
        r"<lambda.* of 'constexpr' variable '([^']+)' is not literal",
        plainly("{1} is a lambda, which before C++17 is no constant", "on that line, remove `constexpr`"),
    ),
    (
        r"base operand of '->' has non-pointer type",
        plainly("`->` is for pointers, and this is none", "on that line, write a dot in place of `->`"),
    ),
    (
        r"(?:has no member named '([^']+)'|'([^']+)' is not a member of .*); did you mean '([^']+)'",
        lambda found, _package, _lines: Explained(
            found.string, f"write {found[3]} in place of {found[1] or found[2]}"
        ),
    ),
    (r"undefined reference to '([^']+)", _explain_unlinked),
    (
        r"multiple definition of 'main",
        plainly("two sources of one program have a `main`", "write an add_executable(…) for each program"),
    ),
    (r'dependencies to non-existent target "([^"]+)"', _missing_target),
    (r'link libraries for target "([^"]+)" which is not built', _missing_target),
    (r'install TARGETS given target "([^"]+)" which does not exist', _missing_target),
    (_UNKNOWN_KEYWORD, _unknown_keyword),
)


def missing_header(found: re.Match[str], package: PackageFacts, _lines: Sequence[str]) -> Explained:
    """A header of no ROS package: a file of the student's own, or a library's, which are included by their folder."""
    header = found[1]
    near = near_names(posixpath.basename(header), [posixpath.basename(f.path) for f in package.files])
    if near or "/" not in header or header.partition("/")[0] == package.name:
        fix = f"write {near[0]} in the #include" if near else f"push {header}, or correct the #include"
        return Explained(f"there is no header {header}", own_header(package, header) or fix)
    why = f"it needs the header {header} of a library that this grading machine lacks"
    hint = f"{ON_THE_MACHINE}install the library of {header}, then grade again; "
    return Explained(why, f"{hint}a header of the student's own has to be pushed", of_machine=True)


def missing_link(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
    why = f"it is linked with the library {found[1]}, which this grading machine lacks"
    return Explained(
        why, f"{ON_THE_MACHINE}install the library {found[1]}, then grade again", of_machine=True
    )
