"""Whether `CMakeLists.txt` makes a catkin package and installs the scripts."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import PurePosixPath
from typing import Annotated, NamedTuple

from pydantic import Field

from grader.checks.registry import PackageName, check
from grader.checks.support.build_errors import misspelt_cmake_lists, move_into, repair_of_file
from grader.checks.support.scripts import (
    PYTHON,
    Installed,
    cmake_calls,
    copies_of,
    installed,
    is_bin,
    names_script,
    where_written,
)
from grader.checks.support.text import IN_PLACE_OF_ALL, near_names, shown
from grader.model.file_fault import Fault
from grader.model.package import (
    CMAKE,
    MAKES_PACKAGE,
    SIMPLE,
    CMakeCall,
    CMakeFacts,
    PackageFacts,
    meant_command,
)
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, failed_or_blocked, inconclusive, passed
from grader.wording import is_one_edit, join_words

NOT_CALLED = "no catkin_install_python(…) is called"
NO_FILE = "there is no CMakeLists.txt"
BIN = "${CATKIN_PACKAGE_BIN_DESTINATION}"
CALLS_SHOWN, ARGS_SHOWN = 6, 12


class CMakeParams(Record):
    """The package's name in CMake."""

    name: PackageName
    """The handout's name for the package; it is right even if the manifest has another."""


@check("cmake", params=CMakeParams, run_anyway=True)
def cmake(package: PackageFacts, params: CMakeParams) -> Verdict:
    """CMakeLists.txt makes it a catkin package.

    What it checks
        That `CMakeLists.txt` calls `project(…)` with the manifest's name, `find_package(catkin …)` and
        `catkin_package(…)`.

    Why it matters on a robot
        These three lines make a folder with code a package that catkin can build and ROS can find. A name
        that differs from the manifest's stops the build of the whole workspace, other people's packages
        included.

    How it is measured
        By the calls that CMake made while the package was built: variables are expanded and comments
        ignored. If it was not built, the file is parsed.

    How to fix
        Begin with `cmake_minimum_required(VERSION 3.0.2)`, `project(<name in package.xml>)`,
        `find_package(catkin REQUIRED COMPONENTS rospy std_msgs)` and `catkin_package()`.
    """
    given = package.manifest.name if package.manifest else params.name
    names = (given, params.name)
    expected = f"project({params.name}), find_package(catkin …), catkin_package(…)"
    facts = package.cmake
    if facts is None:
        return _no_file(package, params.name).about(expected=expected)
    # what is missing may stand behind the line that cannot be read
    wrong = [one for one in _wrong(package, facts, names) if facts.fault is None or one.line is not None]
    named = [c for c in facts.calls if c.name in {"project", "find_package", "catkin_package"}]
    measured = ", ".join(map(_call_text, named[:CALLS_SHOWN])) or "none of the three calls"
    fault = facts.fault
    if not wrong and fault is None:
        places = tuple(c.place for c in named[:3])
        all_there = passed(f"{facts.file} has all three calls")
        return all_there.about(expected=expected, measured=measured, citations=places)
    lines = tuple(FileCitation(file=facts.file, line=one.place) for one in wrong)
    if fault:
        lines = (*lines, FileCitation(file=fault.file, line=fault.line))
    verdict = failed(
        f"{facts.file}: {'; '.join([*_fault(fault), *(one.why for one in wrong)])}",
        expected=expected,
        measured=measured,
        hint="; ".join(
            [*([repair_of_file(fault)] if fault else []), *(f"{one.fix}{_below(one.below)}" for one in wrong)]
        ),
        citations=tuple(dict.fromkeys(lines)),
    )
    verdict = verdict.seeking("uncalled", *(one.uncalled for one in wrong if one.uncalled))
    above = [one.below for one in wrong if one.below is not None]
    return verdict.seeking("below", above[0].name) if above and len(above) == len(wrong) else verdict


def _call_text(call: CMakeCall) -> str:
    args = call.args if len(call.args) <= ARGS_SHOWN else (*call.args[:ARGS_SHOWN], "…")
    return f"{call.name}({' '.join(args)})"


def _no_file(package: PackageFacts, wanted: str) -> Verdict:
    if slip := misspelt_cmake_lists(package):
        message = f"the file is called {slip}, and CMake looks for CMakeLists.txt"
        hint = f"git mv {slip} CMakeLists.txt"
        return failed(message, measured=slip, hint=hint, citations=(FileCitation(file=slip),))
    hint = f"create one with project({wanted}), find_package(catkin REQUIRED) and catkin_package()"
    if package.manifest is None and package.has_no_manifest:
        hint = f"catkin_create_pkg {wanted} makes it beside package.xml"
    absent = failed(NO_FILE, measured="no file", hint=hint)
    return absent.based_on(cause=NO_FILE)


def _fault(fault: Fault | None) -> Iterator[str]:
    if fault is not None:
        line = f"line {fault.line}: " if fault.line else ""
        yield f"{line}CMake cannot read it: {fault.explanation}"


def _misspelt(facts: CMakeFacts, name: str) -> CMakeCall | None:
    """The first call whose name is a slip of the command's."""
    return next((call for call in facts.calls if meant_command(call.name) == name), None)


class Wrong(NamedTuple):
    """What is wrong, its fix and its line; or the command that is `uncalled`, and the call below which it goes."""

    why: str
    fix: str
    line: int | None = None
    below: CMakeCall | None = None
    uncalled: str = ""

    @property
    def place(self) -> int | None:
        """The line to look at."""
        return self.below.line if self.below is not None else self.line


def _respell(call: CMakeCall, name: str) -> Wrong:
    why = f"line {call.line}: there is no command {call.name}(…)"
    return Wrong(why, f"write {name} instead of {call.name}", call.line)


def _of_another(package: PackageFacts, facts: CMakeFacts, wanted: str) -> Wrong | None:
    """Return the fault of a file that was never a package's of catkin: a workspace's, or one for ROS 2 or rosbuild."""
    made, rosbuild = _first(facts, "catkin_workspace"), _first(facts, "rosbuild_init")
    found = [c for c in facts.calls if c.name == "find_package" and c.args]
    ament = next((c for c in found if c.args[0].startswith("ament_")), None)
    if made is not None and _first(facts, "catkin_package") is None:
        why = f"it is the file that catkin_init_workspace makes for the folder src/ of a workspace: line {made.line}"
        why = f"{why} calls catkin_workspace()"
    elif ament is not None and all(c.args[0] != "catkin" for c in found):
        made, why = ament, f"it is for a ROS 2 package: line {ament.line} finds {ament.args[0]}"
    elif rosbuild is not None and all(_makes_nothing(c) for c in facts.calls):
        made = rosbuild
        why = f"it is for rosbuild, which came before catkin: line {made.line} calls {made.name}()"
    else:
        return None
    declared = package.manifest.dependencies if package.manifest and made is not ament else ()
    needs = " ".join(dict.fromkeys(d.name for d in declared if d.name != "catkin"))
    catkin = f"find_package(catkin REQUIRED{f' COMPONENTS {needs}' if needs else ''})"
    lines = f"cmake_minimum_required(VERSION 3.0.2), project({wanted}), {catkin} and catkin_package()"
    return Wrong(why, f"write these lines {IN_PLACE_OF_ALL}: {lines}", made.line)


def _makes_nothing(call: CMakeCall) -> bool:
    """Return whether a call neither finds nor makes anything, so that nothing is lost with its line."""
    makes = call.name.startswith(("add_", "rosbuild_add_", "rosbuild_gen", "target_", "generate_"))
    return not makes and call.name not in ("find_package", "catkin_package")


def _other_name(package: PackageFacts, project: CMakeCall, names: tuple[str, str], both: str) -> Wrong:
    given, wanted = names
    name = project.args[0] if project.args else ""
    message = f"line {project.line}: project({name}) differs from the package's name {given}"
    written = where_written(package, name, project)
    fix = f"write project({wanted}){both}"
    if written is not project:
        fix = f"on line {written.line}, write {wanted} in place of {name}{both}"
    return Wrong(message, fix, written.line)


def _wrong(package: PackageFacts, facts: CMakeFacts, names: tuple[str, str]) -> Iterator[Wrong]:
    """Yield what is wrong or missing. The names are the manifest's and the lab's, which both are to have."""
    given, wanted = names
    # All that such a file lacks follows from what it is.
    if other := _of_another(package, facts, wanted):
        yield other
        return
    both = "" if given == wanted else f" here, and <name>{wanted}</name> in package.xml"
    project = _first(facts, "project")
    if project is None and (slip := _misspelt(facts, "project")):
        yield _respell(slip, "project")
    elif project is None:
        least = _first(facts, "cmake_minimum_required")
        yield Wrong("project(…) is missing", f"add project({wanted}){both}", below=least, uncalled="project")
    elif not project.args or project.args[0] not in names:
        yield _other_name(package, project, names, both)
    packages = [c for c in facts.calls if c.name == "find_package"]
    if slip := _misspelt(facts, "find_package"):
        yield _respell(slip, "find_package")
    elif not any(c.args[:1] in (("catkin",), (SIMPLE,)) for c in packages):
        slip = next((c for c in packages if c.args and _stands_for_catkin(c.args[0])), None)
        why = "find_package(catkin …) is missing"
        if slip is None:
            yield Wrong(why, "add find_package(catkin REQUIRED)", below=project, uncalled="find_package")
        else:
            why = f"{why} (line {slip.line} says {slip.args[0]})"
            # `find_package(REQUIRED …)` lacks the name alone.
            place = "before" if slip.args[0].isupper() else "instead of"
            yield Wrong(why, f"write catkin {place} {slip.args[0]}", slip.line)
    if slip := _misspelt(facts, "catkin_package"):
        yield _respell(slip, "catkin_package")
    elif all(c.name not in MAKES_PACKAGE for c in facts.calls):
        above = next((c for c in packages if c.args[:1] == ("catkin",)), project)
        above = _first(facts, "generate_messages") or above  # catkin refuses it the other way round
        why = "catkin_package(…) is missing"
        yield Wrong(why, "add catkin_package()", below=above, uncalled="catkin_package")


def _stands_for_catkin(word: str) -> bool:
    """Return whether the first word of find_package(…) is a slip of catkin's name, or what comes behind it."""
    name = word.casefold()
    return name == "catkin" or is_one_edit(name, "catkin") or word in ("REQUIRED", "COMPONENTS")


def _below(call: CMakeCall | None) -> str:
    """Return where a new call goes: below this one, which may go on over several lines."""
    return f" below the {call.name}(…) on line {call.line}" if call else ""


def _first(facts: CMakeFacts, name: str) -> CMakeCall | None:
    return next((c for c in facts.calls if c.name == name), None)


class CMakeInstallParams(Record):
    """The scripts that are installed."""

    scripts: Annotated[tuple[str, ...], Field(min_length=1)]
    """Paths as the handout gives them: `src/talker.py`. If a script is in another folder, its path there
    counts."""


class Lack(NamedTuple):
    """Why a script is not installed, how to fix that, and the line; `{}` in both stands for the scripts.

    `path` is where the script lies. `unsure` where only CMake could tell; `follows` where it follows from a missing
    `catkin_package()`, which gives the destination its value; `uncalled` where nothing installs any script.
    """

    why: str
    fix: str
    line: FileCitation | None
    path: str = ""
    unsure: bool = False
    follows: bool = False
    uncalled: bool = False


@check("cmake-install", params=CMakeInstallParams, run_anyway=True)
def cmake_install(package: PackageFacts, params: CMakeInstallParams) -> Verdict:
    """CMakeLists.txt installs the scripts with catkin_install_python.

    What it checks
        That `catkin_install_python(PROGRAMS … DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})` names each
        script, in one call or in several.

    Why it matters on a robot
        A robot often runs the installed packages, not the sources. What CMake does not install is missing
        there, and `catkin_install_python` also makes the scripts name the right Python.

    How it is measured
        By the calls that CMake made while the package was built: variables and `file(GLOB …)` are expanded,
        comments and `if(FALSE)` ignored. If it was not built, the file is parsed. `install(PROGRAMS …)` is
        another command and does not count. Each script earns its share.

    How to fix
        Remove the `#` before each line of the block that `catkin_create_pkg` wrote, and name your scripts:
        `catkin_install_python(PROGRAMS scripts/talker.py scripts/listener.py DESTINATION
        ${CATKIN_PACKAGE_BIN_DESTINATION})`. Then run `catkin_make`.
    """
    names = join_words(params.scripts)
    expected = f"catkin_install_python(PROGRAMS … DESTINATION {BIN}) with {names}"
    facts = package.cmake
    if facts is None:
        message = f"{NO_FILE}, so nothing is installed"
        absent = failed_or_blocked(
            message, expected=expected, measured="no file", hint="first add CMakeLists.txt"
        )
        return absent.based_on(cause=NO_FILE)
    all_named = list(installed(package))
    of_python = [one for one in all_named if one.call.name == PYTHON]
    named = join_words(dict.fromkeys(shown(one.path) for one in of_python))
    measured = f"catkin_install_python installs {named or 'no script'}"
    calls = tuple(o.call.place for o in of_python)
    lacks = {s: lack for s in params.scripts if (lack := _lack(package, all_named, s, params.scripts))}
    if not lacks:
        message = f"{facts.file} installs {names}"
        cited = tuple(dict.fromkeys(calls))
        return passed(message, expected=expected, measured=measured, citations=cited)
    cited = tuple(dict.fromkeys([*(lack.line for lack in lacks.values() if lack.line), *calls]))
    right = [script for script in params.scripts if script not in lacks]
    found = _not_installed(facts, lacks).in_part(len(right) / len(params.scripts), join_words(right))
    places = cited or (FileCitation(file=facts.file),)
    return found.about(expected=expected, measured=measured, citations=places)


def _not_installed(facts: CMakeFacts, lacks: dict[str, Lack]) -> Verdict:
    verdict = inconclusive if any(lack.unsure for lack in lacks.values()) else failed
    follows = all(lack.follows for lack in lacks.values())
    # Where CMake itself fails, or catkin_package() is missing, this follows from another criterion's loss.
    found = (failed_or_blocked if facts.fault or follows else verdict)(
        f"{facts.file}: {'; '.join(_reasons(lacks))}", hint="; ".join(_fixes(lacks))
    )
    if any(lack.follows for lack in lacks.values()):
        found = found.seeking("uncalled", "catkin_package")
    return found.seeking("call", PYTHON) if all(lack.uncalled for lack in lacks.values()) else found


def _reasons(lacks: dict[str, Lack]) -> Iterator[str]:
    """Yield each reason once, with the scripts that it is true of."""
    for why in dict.fromkeys(lack.why for lack in lacks.values()):
        yield why.replace("{}", join_words([name for name, lack in lacks.items() if lack.why == why]))


def _fixes(lacks: dict[str, Lack]) -> Iterator[str]:
    """Yield each repair once, as one line for all scripts that it is true of."""
    for fix in dict.fromkeys(lack.fix for lack in lacks.values()):
        yield fix.replace("{}", " ".join(lack.path for lack in lacks.values() if lack.fix == fix))


def _lack(
    package: PackageFacts, all_named: Sequence[Installed], script: str, wanted: Sequence[str]
) -> Lack | None:
    """Return None where `catkin_install_python` puts the script where `rosrun` looks."""
    there = sorted((f.path for f in copies_of(package, script)), key=lambda path: path != script)
    paths, name = there or [script], PurePosixPath(script).name
    hits = [one for one in all_named if any(names_script(one, path) for path in paths)]
    if not there and not hits:  # that it is missing is another criterion's
        hits = [one for one in all_named if PurePosixPath(one.path).name == name]
    by_python = [one for one in hits if one.call.name == PYTHON]
    if any(one.kind == "PROGRAMS" and is_bin(one.destination or "", package) for one in by_python):
        return None
    if by_python:
        return _why_misplaced(package, by_python[0])
    blurred = next((o for o in all_named if o.call.name == PYTHON and not o.known), None)
    if blurred is not None:
        why = f"only CMake knows which scripts {blurred.path} holds, and it did not finish"
        return Lack(why, "build the package with catkin_make", _line(blurred), unsure=True)
    unread = package.cmake.fault if package.cmake else None
    if unread is not None and not by_python:
        why = "CMake cannot read it, so nothing installs {}"
        return Lack(why, f"first fix {unread.file}: {repair_of_file(unread)}", None)
    if not hits and not any(one.call.name == PYTHON for one in all_named):
        return _without_call(package, all_named, paths[0], {PurePosixPath(one).name for one in wanted})
    return _why_unnamed(package, all_named, hits, paths[0])


def _why_misplaced(package: PackageFacts, one: Installed) -> Lack:
    where = f"line {one.call.line}"
    if one.kind != "PROGRAMS":
        why = f"{where}: catkin_install_python(…) does not begin with the word PROGRAMS"
        instead = f"write PROGRAMS instead of {one.kind} in it"
        fix = instead if one.kind else f"write catkin_install_python(PROGRAMS … DESTINATION {BIN})"
        return Lack(why, fix, _line(one))
    empty = "DESTINATION" in one.call.args and not one.destination
    if empty and not cmake_calls(package, "catkin_package"):
        why = f"{where}: {BIN} has no value, because catkin_package() is not called before it"
        return Lack(why, "call catkin_package() above catkin_install_python(…)", _line(one), follows=True)
    if one.destination is None:
        why = f"{where}: catkin_install_python(…) has no DESTINATION for {{}}"
    elif not one.destination:
        why = f"{where}: nothing follows DESTINATION, or only a variable that has no value (is its name misspelt?)"
    else:
        why = f"{where}: the destination of {{}} is {shown(one.destination)}, not {BIN} (lib/{package.name})"
    fix = f"write DESTINATION {BIN}"
    if one.destination:
        return Lack(why, f"{fix} in place of DESTINATION {shown(one.destination)}", _line(one))
    where = ", below find_package(catkin …)" if one.destination == "" else " as the last words of this call"
    return Lack(why, f"{fix}{where}", _line(one))


def _why_unnamed(
    package: PackageFacts, all_named: Sequence[Installed], hits: Sequence[Installed], path: str
) -> Lack:
    """Another command names it, a slip of its name or place is named, or nothing is."""
    if hits:
        other = f"install({hits[0].kind} …)"
        why = f"line {hits[0].call.line}: {other} names {{}}, where catkin_install_python(PROGRAMS …) should"
        hint = f"replace {other} with catkin_install_python(PROGRAMS … DESTINATION {BIN})"
        return Lack(why, hint, _line(hits[0]))
    of_python = [one for one in all_named if one.call.name == PYTHON]
    names = {
        PurePosixPath(one.path).name: one
        for one in of_python
        if not any(names_script(one, file.path) for file in package.files)
    }
    wanted = PurePosixPath(path).name
    near = [wanted] if wanted in names else list(near_names(wanted, names))
    if near:
        return _named_elsewhere(package, names[near[0]], path)
    why = "catkin_install_python(…) does not name {}"
    if any(one.kind == "PROGRAMS" and is_bin(one.destination or "", package) for one in of_python):
        own = [PurePosixPath(file.path).name for file in package.files]
        # a slip of another script's name is told there
        nowhere = (
            one
            for name, one in names.items()
            if one.known and not copies_of(package, name) and not near_names(name, own)
        )
        absent = next((shown(one.path) for one in nowhere), "")
        fix = "write {} " + (f"in place of `{absent}`" if absent else "into it, after PROGRAMS")
        why += f", and names `{absent}`, which does not exist" if absent else ""
        return Lack(why, fix, None, path)
    fix = f"write catkin_install_python(PROGRAMS {{}} DESTINATION {BIN}){_below(of_python[-1].call)}"
    return Lack(why, fix, None, path)


def _named_elsewhere(package: PackageFacts, one: Installed, path: str) -> Lack:
    """The call names a file that is not there, and the script lies at `path`."""
    written = where_written(package, one.path, one.call)
    where = f"line {written.line}"
    if path == f"{package.folder_beside}/{one.path}":
        why = f"{where}: {shown(one.path)} is in {package.folder_beside}/, beside which {CMAKE} lies"
        return Lack(why, move_into(package.folder_beside), _line(one))
    why = f"{where}: {shown(one.path)} is named, but does not exist; the script is {path}"
    if one.path.rstrip(",;\\") == path:
        why = f"{where}: in {shown(one.path)}, the {one.path[-1]} counts as part of the name"
    if one.path.rstrip("\\") == path:
        return Lack(why, f"delete each \\ behind {path}: in CMake a line goes on without it", written.place)
    on_line = "" if written is one.call else f"on line {written.line}, "
    return Lack(why, f"{on_line}write {path} in place of {shown(one.path)}", written.place)


def _without_call(
    package: PackageFacts, all_named: Sequence[Installed], path: str, wanted: Collection[str]
) -> Lack:
    if package.cmake and (slip := _misspelt(package.cmake, PYTHON)):
        why, respelt = _respell(slip, PYTHON)[:2]
        return Lack(f"{why}, so nothing installs {{}}", respelt, slip.place)
    fix = f"write catkin_install_python(PROGRAMS {{}} DESTINATION {BIN})"
    if beside := package.folder_beside:
        path = path.removeprefix(f"{beside}/")
    if folder := _folder_above(all_named, path):
        other = "install(DIRECTORY …)"
        why = f"line {folder.call.line}: {other} names {{}}, where catkin_install_python(PROGRAMS …) should"
        return Lack(why, f"{fix} below it", _line(folder), path)
    if of_programs := next(
        (one for one in all_named if one.kind == "PROGRAMS" and one.path.endswith(".py")), None
    ):
        why = f"line {of_programs.call.line}: install(PROGRAMS …) does not name {{}}"
        if any(
            PurePosixPath(one.path).name in wanted for one in all_named
        ):  # it is told to become the right one
            return Lack(why, "write {} into it, after PROGRAMS", _line(of_programs), path)
        return Lack(f"{why}, and is not {PYTHON}(…)", f"{fix} below it", _line(of_programs), path)
    # CMake knows no variable by its $ alone: the path is that of a file, which is not there.
    if plain := next((one for one in all_named if re.search(r"\$\w", one.path)), None):
        why = (
            f"line {plain.call.line}: install({plain.kind} …) names {shown(plain.path)}, which does not exist"
        )
        return Lack(f"{why}, and not {{}}", f"{fix} in place of it", _line(plain), path)
    why = f"{NOT_CALLED}, so nothing installs {{}}"
    above = next(iter(cmake_calls(package, "catkin_package")), None)
    line = above.place if above else None
    return Lack(why, f"{fix}{below_catkin_package(package)}", line, path, uncalled=True)


def below_catkin_package(package: PackageFacts) -> str:
    """Return where the call that installs scripts goes, as the end of a hint."""
    above = next(iter(cmake_calls(package, "catkin_package")), None)
    return _below(above) or " below catkin_package()"


def _folder_above(all_named: Sequence[Installed], path: str) -> Installed | None:
    """Return the call that copies the folder in which the script lies."""
    above = PurePosixPath(path).parent.as_posix()
    folders = (one for one in all_named if one.kind == "DIRECTORY")
    return next((one for one in folders if names_script(one, above)), None)


def _line(one: Installed) -> FileCitation:
    return one.call.place
