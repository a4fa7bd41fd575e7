"""Whether `rosrun` can run a script as it was handed in, and Python can parse it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

from grader.checks.build import judge_build, or_rename
from grader.checks.registry import check
from grader.checks.support.exit_causes import syntax_hint
from grader.checks.support.scripts import (
    RIGHT_SHEBANG,
    Obstacle,
    add_hint,
    asks_for_wrapper,
    can_be_moved,
    find_script,
    installed,
    move_hint,
    names_script,
    paths_by_name,
    scripts_of_role,
    shebang_obstacles,
    syntax_fault,
)
from grader.checks.support.text import near_names, shown
from grader.evidence.events import CATKIN_MAKE
from grader.evidence.run import Run
from grader.model.file_fault import Fault
from grader.model.package import CMAKE, PackageFacts, SourceFile
from grader.model.record import Record
from grader.model.repair import as_code
from grader.model.submission import chmod_hint
from grader.model.verdict import (
    FileCitation,
    MistakeKind,
    Verdict,
    failed,
    failed_or_blocked,
    inconclusive,
    passed,
)
from grader.wording import is_of_other_role, join_words, there_is

# a script without its first line is run by the shell, which knows no `import`
TELLING = ("Couldn't find", "import: command not found", "No such file or directory")
HOME = "/home/student"
"""Of the sandbox: to a student it is their own."""


class ExecutableParams(Record):
    """The script."""

    path: str
    """Where the handout puts the script; it is found by its name in other folders too."""


@check("executable", params=ExecutableParams, run_anyway=True)
def executable(package: PackageFacts, build: Run, params: ExecutableParams) -> Verdict:
    """The script can be run as a node.

    What it checks
        That the script is there, is executable (the system may run it as a program), and begins with a `#!`
        line that names an existing interpreter. A script that `catkin_install_python` installs need not be
        executable itself. A Python script must also be free of syntax errors.

    Why it matters on a robot
        `rosrun` and `roslaunch` only find files that may be executed, and the `#!` line is all that tells
        the robot that a file is Python. Without them, your script still runs in the editor, but not on the
        robot.

    How it is measured
        In a repository, git says whether it is executable; otherwise the archive or the disk does. The
        first line is read as the kernel reads it: a line that ends in CR LF, or a byte order mark or a
        blank line before it, breaks it. A script in another folder counts, with a hint. ROS's own Python
        parses the file without running it, and says which line it does not understand.

    How to fix
        `chmod +x <file>`, then with git `git add --chmod=+x <file>`, commit and push; pack an archive again
        with tar or zip. Write `#!/usr/bin/env python3` as the very first line; `dos2unix <file>` for a file
        from Windows. `ls -lF` shows executable files with a `*`. `python3 -m py_compile <file>` shows a
        syntax error: fix that line, or the one above it.
    """
    found = find_script(package, params.path)
    if found is None:
        verdict = _missing(package, params.path)
    else:
        verdict = _dangling(found) if found.link_problem else _judge_file(package, build, found, params)
    whole = ", all of it valid Python" if found is not None and syntax_fault(found) else ""
    expected = f"{params.path}, executable, beginning with {_asked_first_line(found)}{whole}"
    return verdict.about(expected=expected)


def _asked_first_line(found: SourceFile | None) -> str:
    """Return the file's own first line where that is right: of several that are, another one is no fault."""
    own = found is not None and found.shebang is not None and not any(shebang_obstacles(found))
    return f"#!{found.shebang.text}" if found and found.shebang and own else RIGHT_SHEBANG


def _moved(package: PackageFacts, path: str, wanted: str) -> str:
    """Return that the script goes elsewhere, and what names its place; "" where it is there."""
    if path in (wanted, f"{package.folder_beside}/{wanted}"):
        return ""
    calls = {one.call.line: one.call for one in installed(package) if names_script(one, path)}
    where = join_words(f"in the {one.name}(…) on line {line} of {one.file}" for line, one in calls.items())
    if not where and _is_named(package, PurePosixPath(path).name):
        where = f"where you name it in {CMAKE}"
    return f"the handout puts it at {wanted}; move it there{where and f', and write {wanted} {where}'}"


def _is_named(package: PackageFacts, name: str) -> bool:
    """Return whether CMake is told of a file of this name, in whatever way; True also where it cannot be read."""
    cmake = package.cmake
    if cmake is None or cmake.fault is not None:
        return cmake is not None
    return any(name in argument for call in cmake.calls for argument in call.args)


def _judge_file(package: PackageFacts, build: Run, found: SourceFile, params: ExecutableParams) -> Verdict:
    remarks = package.hints_on(found.path)
    of_first_line = list(shebang_obstacles(found))
    obstacles = [*of_first_line, *_mode_obstacles(found, remarks)]
    hint = _moved(package, found.path, params.path) or "; ".join(remarks)
    fault = syntax_fault(found)
    what = f"{found.path} {'; it also '.join(o.why for o in obstacles)}"
    if fault is not None:
        may_do = asks_for_wrapper(package, found.path)  # once the build passes, which is judged by itself
        verdict = _syntax_verdict(found, fault, [] if may_do else obstacles)
    elif found.executable and not obstacles:
        verdict = passed(f"{found.path} is executable and names {_interpreter(found)}", hint=hint)
    elif has_wrapper(package, build, found.path):
        advice = f", though the file itself {obstacles[0].why}" if obstacles else ""
        told = f"catkin_install_python makes {found.path} a program that rosrun starts{advice}"
        verdict = passed(told, measured=f"{found.path}: made a program by catkin_install_python", hint=hint)
    elif obstacles and (unmade := _unmade_wrapper(package, build, found.path)):
        verdict = _judge_unmade(what, found.path, unmade)
    elif obstacles and asks_for_wrapper(package, found.path):  # and no build was tried
        message = f"{what}: only the build shows whether catkin_install_python makes a program of it"
        verdict = inconclusive(message, hint="; ".join(o.fix for o in obstacles))
    elif obstacles:
        message = f"{what}{_rosrun_answer(build, found.path)}"
        kind: MistakeKind = "cannot-be-run" if of_first_line else "not-executable"
        verdict = failed(message, hint="; ".join(o.fix for o in obstacles))
        verdict = verdict if found.shebang_fault == "empty-file" else verdict.lost_by(kind, found.path)
    else:
        message = f"whether {found.path} is executable cannot be told: the submission has no file modes"
        fix = "hand in a git repository or a .tar.gz: both keep which files are executable"
        verdict = inconclusive(message, hint=fix)
    measured = verdict.measured or f"{found.path}: {_mode(found)}, {_first_line(found)}"
    only_mode = bool(obstacles) and not of_first_line
    place = FileCitation(file=found.path) if only_mode else _cite_shebang(found)
    return verdict.about(measured=measured, citations=verdict.citations or (place,))


def _syntax_verdict(file: SourceFile, fault: Fault, obstacles: list[Obstacle]) -> Verdict:
    where = f"line {fault.line}" if fault.line else "cannot be parsed"
    if fault.line is None and fault.kind == "SyntaxError" and not (file.bom and file.shebang_problem):
        obstacles = []  # the whole file is no script, so nothing of it is told by itself
    others = f"; it also {' and '.join(o.why for o in obstacles)}" if obstacles else ""
    hint = syntax_hint(fault)
    why = (fault.cause or fault.message) if fault.fix and fault.fix in hint else fault.explanation
    fixes = [hint, *(o.fix for o in obstacles)]
    source = f", {where}: {as_code(shown(fault.source.strip()))}" if fault.source.strip() else ""
    return (failed_or_blocked if file.is_no_script else failed)(
        f"{file.path} {where}: {fault.kind}: {why}{others}",
        measured=f"{file.path}: {_mode(file)}, {_first_line(file)}{source}",
        hint="; ".join(fixes),
        citations=(fault.place, *((_cite_shebang(file),) if any(shebang_obstacles(file)) else ())),
    )


def _cite_shebang(file: SourceFile) -> FileCitation:
    """The first line, and in it the interpreter that does not exist."""
    text = f"#!{file.shebang.text}" if file.shebang else ""
    if file.shebang is None or file.shebang.found is not False or file.shebang.interpreter not in text:
        return FileCitation(file=file.path, line=1)
    return FileCitation(file=file.path, line=1, column=text.rindex(file.shebang.interpreter) + 1, source=text)


def has_wrapper(package: PackageFacts, build: Run, path: str) -> bool:
    """Return whether the build worked, and `catkin_install_python` put this script where `rosrun` looks."""
    return 0 in _builds(build) and asks_for_wrapper(package, path)


def _builds(build: Run) -> list[int | None]:
    """Return the exit code of each build that was tried."""
    return [e.exit_code for _, e in build.processes if e.event == "exit" and e.name == CATKIN_MAKE]


def _unmade_wrapper(package: PackageFacts, build: Run, path: str) -> Verdict | None:
    """Return why the build did not come to the wrapper that the package asks for; None where it was not tried."""
    return judge_build(package, build) if _builds(build) and asks_for_wrapper(package, path) else None


def _judge_unmade(why: str, path: str, build: Verdict) -> Verdict:
    """The build's own criterion is what a build that failed costs: here it is the reason."""
    message = f"{why}; catkin_install_python would make a program of it, but {build.message}"
    if build.status.is_open:
        return inconclusive(message, hint=build.hint, citations=build.citations)
    hint = "get the build to pass: catkin_make then makes a program of the script"
    return failed(message, hint=hint, citations=build.citations).lost_by("not-made", path)


def _dangling(file: SourceFile) -> Verdict:
    """Return the verdict on a link in place of the script, which leads to no file that was handed in."""
    target = f"{file.path} is a link to {shown(file.link)}; " if file.link else ""
    verdict = failed_or_blocked(
        f"{target}{file.link_problem}", hint="hand in the file itself, in place of the link"
    )
    return verdict.about(citations=(FileCitation(file=file.path),)).lost_by("file-missing", file.path)


def _missing(package: PackageFacts, path: str) -> Verdict:
    names = paths_by_name(package)
    wanted = PurePosixPath(path)
    near = [names[n] for n in near_names(wanted.name, names) if not is_of_other_role(n, wanted.name)]
    near += [p for n, p in names.items() if n == wanted.stem and p not in near]
    movable = [p for p in near if can_be_moved(p, path)]
    scripts = [p for n, p in names.items() if n.endswith(".py")]
    alike = [] if movable else scripts_of_role(package, path)
    meant = movable[:1] or (alike if len(alike) == 1 else [])
    there = dict.fromkeys([*near, *meant])
    seen = f"; {there_is(there)}" if there else ""
    hint = f"{add_hint(package, path)}{or_rename([] if meant else alike)}"
    if meant:
        moved, named = move_hint(package, meant[0], path), _where_named(package, meant[0])
        plain = len(movable) == 1 or PurePosixPath(meant[0]).name == wanted.name
        named += _bit_there(package, meant[0], path)
        hint = f"{moved}{named}" if plain else f"{hint}, or {moved} if that is meant to be it{named}"
    kind: MistakeKind = "file-elsewhere" if meant else "file-missing"
    if not movable and (elsewhere := (*package.hints_on(wanted.name), *package.hints_on(str(wanted.parent)))):
        where, _, hint = elsewhere[0].partition(": ")
        seen, kind = f"; {where}", "file-elsewhere"
    return failed_or_blocked(
        f"{path} is not in the package{seen}",
        measured=f"scripts: {join_words(sorted(scripts))}" if scripts else "no Python script in the package",
        hint=hint,
        citations=tuple(FileCitation(file=p) for p in (near or meant)[:3]),
    ).lost_by(kind, path, meant=next(iter(meant), ""))


def _bit_there(package: PackageFacts, path: str, wanted: str) -> str:
    """Return that the script that is moved lacks its executable bit too, to put behind the command."""
    there = next((file for file in package.files if file.path == path), None)
    if there is None or there.executable is not False or asks_for_wrapper(package, path):
        return ""
    return f"; {chmod_hint(there.mode_source, wanted)}"


def _where_named(package: PackageFacts, path: str) -> str:
    """Return where else the name of a script that is renamed stands, to put behind the command."""
    calls = (one.call for one in installed(package) if names_script(one, path))
    places = [f"{call.file}, line {call.line}" for call in calls]
    nodes = ((launch.path, node) for launch in package.launch_files for node in launch.nodes)
    places += [
        f"{n.file or file}, line {n.line}"
        for file, n in nodes
        if n.type == PurePosixPath(path).name and n.pkg == package.name
    ]
    return f"; write the new name in {join_words(dict.fromkeys(places))} too" if places else ""


def _mode_obstacles(file: SourceFile, remarks: tuple[str, ...]) -> Iterator[Obstacle]:
    if file.executable is False:
        yield Obstacle("is not executable", "; ".join(remarks) or chmod_hint(file.mode_source, file.path))


def _rosrun_answer(build: Run, path: str) -> str:
    """The line that tells of what `rosrun` said to the file as handed in, where the build's recording has it."""
    names = {f"rosrun {path}", f"rosrun {PurePosixPath(path).name}"}
    said = (c.line for _, c in build.console if c.process in names and c.line.strip())
    lines = [line for line in said if "parsing manifest" not in line]
    answer = next((line for words in TELLING for line in lines if words in line), lines[-1] if lines else "")
    return f"; rosrun answers: {shown(answer.replace(HOME, '~'))}" if answer else ""


def _mode(file: SourceFile) -> str:
    return {True: "executable", False: "not executable", None: "mode unknown"}[file.executable]


def _first_line(file: SourceFile) -> str:
    return f"#!{shown(file.shebang.text)}" if file.shebang else "no #! line"


def _interpreter(file: SourceFile) -> str:
    return file.shebang.interpreter if file.shebang else "its target's interpreter"
