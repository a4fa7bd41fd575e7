"""Whether the files of a package lie where the handout wants them, and what `package.xml` says."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.checks.registry import DependencyName, NoParams, PackageName, check
from grader.checks.support.scripts import add_folder_hint, add_hint, find_script, is_product, move_hint
from grader.checks.support.text import near_names, shown
from grader.installable import known_packages, noetic_messages
from grader.model.package import MANIFEST, Dependency, Manifest, PackageFacts, meant_manifest
from grader.model.record import Record
from grader.model.verdict import FileCitation, Verdict, failed, failed_or_blocked, passed
from grader.wording import is_one_edit, is_word_of, join_words, name_package, on_lines, plural

CORE = ("rospy", "roscpp", "message_generation", "message_runtime")
OTHERS = {
    "launch": ("launcher", "launchers", "launchfile", "launchfiles", "launch_files"),
    "src": ("scripts", "source", "sources", "nodes", "bin"),
    "scripts": ("src", "script", "nodes", "bin"),
    "config": ("configs", "cfg", "conf", "params", "param", "yaml"),
}


class LayoutParams(Record):
    """Everything relative to the package's folder."""

    folders: tuple[str, ...] = ()
    """Folders that the package holds."""
    files: tuple[str, ...] = ()
    """Files that the package holds."""
    scripts: tuple[str, ...] = ()
    """Scripts that have to lie in their right folder: `scripts/talker.py`."""


class Slip(NamedTuple):
    """What is not in its place, how to fix it, where it lies. `explained`: another criterion names the cause;
    `missing`: the file that is nowhere."""

    what: str
    fix: str
    place: str = ""
    explained: bool = False
    missing: str = ""


@check("layout", params=LayoutParams, run_anyway=True)
def layout(package: PackageFacts, params: LayoutParams) -> Verdict:
    """The package is laid out as the handout says.

    What it checks
        That the folders and files of the handout exist under one package folder, with exactly these names,
        and that each script is in the folder where the handout puts it, or below that.

    Why it matters on a robot
        People and programs expect things in their usual folders; someone who repairs the robot at night
        does not want to search.

    How it is measured
        By the files that were handed in. Git keeps no empty folders, so put a file into each. Further files
        and folders do not matter. Another criterion judges a script that is missing altogether.

    How to fix
        `mkdir <folder>` and `git mv <file> <folder>/`, then commit and push. Capital letters matter:
        `Launch` is not `launch`.
    """
    wanted = [*(f"{name}/" for name in params.folders), *params.files, *params.scripts]
    expected = f"{join_words(wanted)} under one package folder"
    top = sorted({PurePosixPath(f.path).parts[0] + "/" * ("/" in f.path) for f in package.files})
    measured = f"in the package: {join_words(top) or 'nothing'}"
    slips = list(_slips(package, params))
    if not slips:
        message = (
            f"{plural(len(wanted), 'folder or file') if len(wanted) == 1 else 'everything'} is in its place"
        )
        return passed(message, expected=expected, measured=measured)
    places = tuple(FileCitation(file=slip.place) for slip in slips if slip.place)
    verdict = failed_or_blocked if all(slip.explained for slip in slips) else failed
    lost = verdict(
        "; ".join(slip.what for slip in slips),
        expected=expected,
        measured=measured,
        hint="; ".join(dict.fromkeys(slip.fix for slip in slips)),
        citations=tuple(dict.fromkeys(places)),
    )
    return lost.lost_by("file-missing", slips[0].missing) if len(slips) == 1 and slips[0].missing else lost


def _slips(package: PackageFacts, params: LayoutParams) -> Iterator[Slip]:
    """Folders, files, scripts; a script that moves with its folder is not named once more."""
    folders = {parent.as_posix() for f in package.files for parent in PurePosixPath(f.path).parents}
    lost = [
        _lost_folder(package, f, params)
        for f in (one.strip("/") for one in params.folders)
        if f not in folders
    ]
    yield from lost
    for name in params.files:
        if package.file(name) is None:
            yield _lost_file(package, name)
    moved = tuple(slip.place for slip in lost if slip.place)
    for script in params.scripts:
        found = find_script(package, script)
        if found is None or _is_below(found.path, script) or found.path.startswith(moved):
            continue
        what = f"{PurePosixPath(script).name} is at {found.path}, not at {script}"
        yield Slip(what, move_hint(package, found.path, script), found.path)


def _is_below(path: str, script: str) -> bool:
    """`src/nodes/a.py` for `src/a.py`: `rosrun` finds both, and both are in `src/`."""
    folder = PurePosixPath(script).parent
    return path == script or (folder.name != "" and folder in PurePosixPath(path).parents)


def _lost_folder(package: PackageFacts, folder: str, params: LayoutParams) -> Slip:
    """Another folder in its place, or none. Where all its scripts are nowhere, they are the cause."""
    instead = _instead(package, folder)
    if instead:
        what = f"there is no folder {folder}/, but {instead}/"
        return Slip(what, move_hint(package, instead, folder), f"{instead}/")
    own = [s for s in params.scripts if PurePosixPath(s).parts[0] == folder]
    nowhere = bool(own) and all(find_script(package, s) is None for s in own)
    below = [path for path in (*params.files, *params.scripts) if path.startswith(f"{folder}/")]
    fix = add_folder_hint(package, folder, below)
    outside = re.compile(rf"\S+ is at (\S*\b{re.escape(folder)}/)\S+, outside of the package: .* to (\S+/)")
    if found := next(filter(None, map(outside.match, package.hints)), None):
        what = f"there is no folder {folder}/, but {found[1]}, outside of the package"
        return Slip(what, f"move {found[1]} to {found[2]}")
    return Slip(f"there is no folder {folder}/", fix, explained=nowhere)


def _instead(package: PackageFacts, folder: str) -> str:
    """A folder that stands in for this one: its name in other letters, another customary name, or it lies further
    down."""
    there = dict.fromkeys(PurePosixPath(f.path).parts[0] for f in package.files if "/" in f.path)
    slips = [n for n in there if n.casefold() == folder.casefold()] or list(near_names(folder, there))
    customary = [n for n in there if n.casefold() in OTHERS.get(folder, ())]
    paths = (f.path for f in package.files if not is_product(f.path))
    parents = dict.fromkeys(parent.as_posix() for path in paths for parent in PurePosixPath(path).parents)
    deeper = sorted(one for one in parents if one.endswith(f"/{folder}"))
    return next(iter([*slips, *customary, *deeper[:1]]), "")


def _lost_file(package: PackageFacts, name: str) -> Slip:
    """A slip of its name, another folder, or nothing. What needs the file has said so at its own criterion."""
    paths = {f.path: PurePosixPath(f.path) for f in package.files}
    wanted = PurePosixPath(name)
    same = [p for p, path in paths.items() if path.name == wanted.name]
    near = [
        p
        for p, path in paths.items()
        if path.parent == wanted.parent and near_names(wanted.name, [path.name])
    ]
    other = next(iter([*near, *same]), "")
    if other:
        fix = move_hint(package, other, name)
        return Slip(f"there is no {name}, but {other}", fix, other, explained=True)
    return Slip(f"there is no {name}", add_hint(package, name), explained=True, missing=name)


RUNTIME_KINDS = ("depend", "exec_depend", "run_depend")
OF_BUILD = frozenset({"message_generation", "genmsg", "cmake_modules", "roslint"})
"""Packages that only the build uses: `<build_depend>`, as the ROS wiki writes it, declares them too."""
BUILD_TOOL_KINDS = ("buildtool_depend", "build_depend", "depend")
PLACES_SHOWN = 6
LEFT_AS_MADE = "@todo.todo"


class ManifestParams(Record):
    """What package.xml has to say."""

    name: PackageName
    """The name that the handout gives the package."""
    dependencies: tuple[DependencyName, ...] = ()
    """Packages that it has to declare for run time."""


class DependenciesParams(Record):
    """Packages that the nodes need."""

    names: tuple[DependencyName, ...]
    """The packages that the nodes need at run time."""


@check("manifest", params=ManifestParams, run_anyway=True)
def manifest(package: PackageFacts, params: ManifestParams) -> Verdict:
    """The manifest names the package.

    What it checks
        That `package.xml` can be read, gives the package the handout's name, has `catkin` as its build
        tool, and, if the lab asks for that, declares the packages that it needs at run time.

    Why it matters on a robot
        A robot's software is found by the names in its manifests. With a broken or misnamed one, `rosrun`
        and `roslaunch` cannot find the package at all.

    How it is measured
        The manifest is read with `catkin_pkg`, the library that catkin itself uses, and nothing is
        executed. `<depend>`, `<exec_depend>` and `<run_depend>` count as dependencies at run time;
        `<build_depend>` alone does not. A `TODO` licence or maintainer costs nothing here.

    How to fix
        Open `package.xml` at the line that the message names. `<name>` has to be the package's name exactly
        as in the handout, `<buildtool_depend>catkin</buildtool_depend>` names the build tool, and one
        `<exec_depend>` line (`<run_depend>` in format 1) each package that a node imports.
    """
    needs = f", {join_words(params.dependencies)} at run time" if params.dependencies else ""
    verdict = _judge_manifest(package, params)
    return verdict.about(expected=f"package.xml, readable, name {params.name}, build tool catkin{needs}")


def _judge_manifest(package: PackageFacts, params: ManifestParams) -> Verdict:
    found = package.manifest
    if found is None:
        return _unreadable(package, params)
    if (found.build_type or "").startswith("ament"):
        return _of_ros_2(found, params)
    wrong = [v for v in (_judge_misnamed(package, found, params.name), _unbuilt(found)) if v is not None]
    if lacking := _lacking(found, params.dependencies):
        wrong.append(lacking)
    strays = [*_strays(found, {one.name for one in package.also})]
    if wrong:
        of_all = package.general_hints() if found.name != params.name else ()
        named = f"the package is named {found.name} in"  # which the message says
        others = [one for one in of_all if not one.startswith(named)]
        hints = [*(v.hint for v in wrong), *strays, *others]
        further = [v.message.removeprefix(f"{found.file} ") for v in wrong[1:]]
        update = {"message": join_words([wrong[0].message, *further]), "hint": "; ".join(hints)}
        return wrong[0].model_copy(update=update)
    place = (FileCitation(file=found.file, line=found.name_line),)
    declares = f", declares {join_words(params.dependencies)}" if params.dependencies else ""
    message = f"{found.file} names {found.name}, built with catkin{declares}"
    measured, hint = (
        f"name {found.name}, format {found.format}",
        "; ".join([*strays, *package.general_hints()]),
    )
    return passed(message, measured=measured, hint=hint, citations=place)


def _of_ros_2(found: Manifest, params: ManifestParams) -> Verdict:
    made = " ".join((params.name, *params.dependencies))
    message = f"{found.file} is for a ROS 2 package (its build type is {found.build_type})"
    measured = f"name {found.name}, build type {found.build_type}"
    hint = f"make a package for ROS 1: `catkin_create_pkg {made}`"
    cited = (FileCitation(file=found.file, line=found.name_line),)
    return failed(message, measured=measured, hint=hint, citations=cited)


def _judge_misnamed(package: PackageFacts, found: Manifest, name: str) -> Verdict | None:
    if found.name == name:
        return None
    slip = " (a typo in the name)" if near_names(name, [found.name]) else ""
    message = f"{found.file} names the package {found.name!r} instead of {name!r}{slip}"
    cited = (FileCitation(file=found.file, line=found.name_line),)
    return failed(message, measured=f"name {found.name}", hint=_rename(package, found, name), citations=cited)


def _unbuilt(found: Manifest) -> Verdict | None:
    if _builds_with_catkin(found):
        return None
    message = f"{found.file} does not name catkin as its build tool"
    measured = f"build tool {found.build_type or 'none'}, no dependency on catkin"
    hint = f"add <buildtool_depend>catkin</buildtool_depend> below line {_last_line(found)}"
    cited = (FileCitation(file=found.file, line=_last_line(found)),)
    return failed(message, measured=measured, hint=hint, citations=cited)


@check("dependencies", params=DependenciesParams, run_anyway=True)
def dependencies(package: PackageFacts, params: DependenciesParams) -> Verdict:
    """The manifest declares what the nodes need at run time.

    What it checks
        That `package.xml` lists each package that the nodes import, as a dependency at run time.

    Why it matters on a robot
        The manifest says what else to install on the robot. A package that is missing in it is missing on
        the robot, and the node stops at its first import.

    How it is measured
        The names under `<depend>`, `<exec_depend>` and `<run_depend>` are compared with the names that the
        lab needs. `<build_depend>` alone does not count, except for `message_generation` and others that
        only the build uses.

    How to fix
        Add one `<exec_depend>` line for each package named (`<run_depend>` in a manifest of format 1).
    """
    found = package.manifest
    expected = f"{join_words(params.names)} at run time"
    if found is None:
        message = "package.xml cannot be read, so its dependencies are not known"
        return failed_or_blocked(message, expected=expected, hint="first fix package.xml")
    declared = passed(f"{found.file} declares {join_words(params.names)}", measured=_declared_text(found))
    return (_lacking(found, params.names) or declared).about(expected=expected)


@check("maintainer", params=NoParams, run_anyway=True)
def maintainer(package: PackageFacts) -> Verdict:
    """The manifest names a maintainer who can be reached.

    What it checks
        That no maintainer of `package.xml` still has the e-mail address that `catkin_create_pkg` fills in,
        which ends in `@todo.todo`.

    Why it matters on a robot
        When a package breaks on someone else's robot, they write to the maintainer.

    How it is measured
        By the `email` attribute of each `<maintainer>`. Any other address will do: the grader sends no
        mail.

    How to fix
        Open `package.xml` and write your own address: `<maintainer email="you@university.ac.uk">Your
        Name</maintainer>`. The comments with examples beside it may go.
    """
    expected = "your own e-mail address as maintainer, not one that ends in @todo.todo"
    found = package.manifest
    if found is None:
        message = "package.xml cannot be read, so its maintainer is not known"
        return failed_or_blocked(
            message, expected=expected, measured="not known", hint="first fix package.xml"
        )
    people = found.maintainers
    measured = join_words(shown(p.email) for p in people) or "no maintainer"
    left = [p for p in people if p.email.strip().casefold().endswith(LEFT_AS_MADE)]
    cited = tuple(FileCitation(file=found.file, line=p.line) for p in left or people)
    cited = cited or (FileCitation(file=found.file, line=found.name_line),)
    hint = 'write your own: <maintainer email="you@university.ac.uk">Your Name</maintainer>'
    if left:
        message = f"{found.file} still has {shown(left[0].email)}, which catkin_create_pkg fills in"
        verdict = failed(message, hint=hint)
    elif not any(p.email.strip() for p in people):
        verdict = failed(f"{found.file} has no maintainer e-mail address", hint=hint)
    else:
        verdict = passed(f"the maintainer is {measured}")
    return verdict.about(expected=expected, measured=measured, citations=cited)


def _rename(package: PackageFacts, found: Manifest, name: str) -> str:
    """Return where to write the right name: all the places where the wrong one stands, as they have to agree."""
    calls = package.cmake.calls if package.cmake else ()
    places = [f"<name>{name}</name> in {found.file}"]
    places += [
        f"project({name}) in {c.file}, line {c.line}"
        for c in calls
        if c.name == "project" and c.args[:1] != (name,)
    ]
    lines: dict[str, dict[int, None]] = {}
    for launch in package.launch_files:
        for node in launch.nodes:
            if node.pkg == found.name:
                lines.setdefault(node.file or launch.path, {})[node.line] = None
    places += [f'pkg="{name}" in {file}, {on_lines(own)}' for file, own in lines.items()]
    such = f"$(find {found.name})"
    such += f" or `from {found.name}.msg import …`" if package.interfaces else ""
    has_cpp = any(PurePosixPath(file.path).suffix == ".cpp" for file in package.files)
    such += f' or `#include "{found.name}/….h"`' if package.interfaces and has_cpp else ""
    made = next((word for c in calls for word in c.args if word.startswith(f"{found.name}_gen")), "")
    # With `-w`, grep would not find the name in `<name>_generate_messages_py`.
    words, such = ("", f"{such} or {made}") if made else ("w", such)
    search = f"`grep -rn{words} {found.name} .` shows whether it stands anywhere else, as in {such}"
    return f"{name_package(name, places[:PLACES_SHOWN])}; {search}"


def _strays(found: Manifest, own: Collection[str | None]) -> Iterator[str]:
    """Yield what to do with a dependency that no package has, beside that of which it is a slip."""
    known = {*CORE, *noetic_messages()}
    declared = {d.name for d in found.dependencies if d.kind in RUNTIME_KINDS} & known
    for one in found.dependencies:
        meant = next((name for name in sorted(declared) if is_one_edit(one.name, name)), "")
        if meant and one.name not in {*known, *known_packages(), *own}:
            tag, line = f"<{one.kind}>{one.name}</{one.kind}>", f"line {one.line} of {found.file}"
            yield f"delete {tag}, which is {line}: there is no package {one.name}, and {meant} is declared"


def _declared_text(found: Manifest) -> str:
    names = dict.fromkeys(d.name for d in found.dependencies if d.kind in RUNTIME_KINDS)
    return f"at run time: {join_words(names) or 'none'}"


def _lacking(found: Manifest, names: tuple[str, ...]) -> Verdict | None:
    """Return what the manifest does not declare as a run-time dependency; None where it declares all."""
    declared = {d.name for d in found.dependencies if d.kind in RUNTIME_KINDS or d.name in OF_BUILD}
    missing = [n for n in names if n not in declared]
    if not missing:
        return None
    at_run = "run_depend" if found.format == 1 else "exec_depend"
    at_build = [d for d in found.dependencies if d.name in missing]
    only = (
        f"; {join_words(dict.fromkeys(d.name for d in at_build))} only as a build dependency"
        if at_build
        else ""
    )
    slips = _misspelt(found, missing, names)
    misspelt = [d for deps in slips.values() for d in deps]
    slip = f"; it declares {join_words(dict.fromkeys(d.name for d in misspelt))}" if slips else ""
    last = max((d.line for d in at_build), default=_last_line(found))
    lines = tuple(FileCitation(file=found.file, line=d.line) for d in misspelt or at_build)
    if joined := _in_one_tag(found, missing, at_run):
        return joined
    hints = [_respell(n, d, deps) for n, deps in slips.items() for d in deps]
    names_too = {d.name for d in misspelt}
    if also := sorted(d.line for d in found.dependencies if d.name in names_too and d not in misspelt):
        hints.append(f"do the same on {on_lines(also)}")
    if absent := [n for n in missing if n not in slips]:
        tags = {n: "build_depend" if n in OF_BUILD else at_run for n in absent}
        hints.append(f"add {' '.join(f'<{tag}>{n}</{tag}>' for n, tag in tags.items())} below line {last}")
    message = f"{found.file} does not declare {_as_dependencies(missing)}{slip or only}"
    cited = lines or (FileCitation(file=found.file, line=last),)
    verdict = failed(message, measured=_declared_text(found), hint="; ".join(hints), citations=cited)
    return verdict.seeking("dependency", missing[0]) if len(missing) == 1 else verdict


def _as_dependencies(names: Sequence[str]) -> str:
    kinds = {
        "run-time": [n for n in names if n not in OF_BUILD],
        "build": [n for n in names if n in OF_BUILD],
    }
    return join_words(f"{join_words(own)} as a {kind} dependency" for kind, own in kinds.items() if own)


def _misspelt(found: Manifest, missing: Sequence[str], names: Sequence[str]) -> dict[str, list[Dependency]]:
    """Return what is declared in place of a missing name: the only slip of it, or its words one by one. A name that is
    another package's is none: who declares actionlib_msgs may need it beside actionlib."""
    others = {*names, *CORE, *known_packages(), *noetic_messages()}
    at_run_time = [d for d in found.dependencies if d.kind in RUNTIME_KINDS and d.name not in others]
    declared = {d.name for d in at_run_time}
    slips = {n: [d for d in at_run_time if d.name in near_names(n, declared)] for n in missing}
    apart = {n: [d for d in at_run_time if is_word_of(d.name, n, declared)] for n in missing}
    return {n: deps for n in missing if (deps := apart[n] or (slips[n] if len(slips[n]) == 1 else []))}


def _respell(name: str, one: Dependency, slips: Sequence[Dependency]) -> str:
    """Return what to do with one of a name's slips: catkin refuses a <depend> beside another tag for that name."""
    if one is not slips[0] and "depend" in {d.kind for d in slips}:
        return f"delete <{one.kind}>{one.name}</{one.kind}> on line {one.line}"
    return f"write {name} instead of {one.name} on line {one.line}"


def _in_one_tag(found: Manifest, missing: Sequence[str], at_run: str) -> Verdict | None:
    """Return the tags that name several packages at once, with what else is missing."""
    apart = {d: re.split(r"[\s,;]+", d.name.strip(" ,;")) for d in found.dependencies}
    joined = {d: names for d, names in apart.items() if len(names) > 1 and set(names) & set(missing)}
    declared = {n for d, names in joined.items() for n in names if n in OF_BUILD or d.kind in RUNTIME_KINDS}
    if not declared.intersection(missing):
        return None
    tags = {d: [f"<{d.kind}>{n}</{d.kind}>" for n in names] for d, names in joined.items()}
    kinds = {n: "build_depend" if n in OF_BUILD else at_run for n in missing if n not in declared}
    last = max(joined, key=lambda d: d.line)
    tags[last] += [f"<{kind}>{n}</{kind}>" for n, kind in kinds.items()]
    if len(joined) == 1:
        said = f"line {last.line} names {join_words(joined[last])} in one tag"
    else:
        said = f"{on_lines(sorted(d.line for d in joined))} name several packages in one tag each"
    message = f"{found.file} does not declare {_as_dependencies(missing)}: {said}"
    hints = (f"on line {d.line}, write {' '.join(one)}" for d, one in tags.items())
    cited = tuple(FileCitation(file=found.file, line=d.line) for d in joined)
    return failed(message, measured=_declared_text(found), hint=join_words(hints), citations=cited)


def _last_line(found: Manifest) -> int:
    """Return the line below which a new dependency goes: that of the last one, or else of the name."""
    return max((d.line for d in found.dependencies), default=found.name_line)


OF_WORKSPACE = (".catkin_workspace", ".catkin_tools/")
"""How paths begin that only a workspace has, and no package."""


def _unreadable(package: PackageFacts, params: ManifestParams) -> Verdict:
    name, fault = params.name, package.manifest_fault
    if fault is None or package.has_no_manifest:
        paths = [file.path for file in package.files if not is_product(file.path)]
        meant = next(filter(None, map(meant_manifest, paths)), "")
        hint = "write package.xml beside CMakeLists.txt, as catkin_create_pkg makes it, and push it"
        if package.cmake is None:
            hint = "write package.xml and CMakeLists.txt, as catkin_create_pkg makes them, and push both"
        if package.cmake is None and any(path.startswith(OF_WORKSPACE) for path in paths):
            made = " ".join(("catkin_create_pkg", name, *params.dependencies))
            hint = f"this folder is a workspace: run `{made}` in its src/, and move the package's files into src/{name}"
        absent = failed("there is no package.xml", measured="no file", hint=meant or hint)
        return absent.lost_by("file-elsewhere" if meant else "file-missing", MANIFEST)
    line = f", line {fault.line}" if fault.line else ""
    hint = fault.advice or "open the file at that line and close or correct the element"
    lacks_tag = "exactly one" in fault.message and '"name"' not in fault.message  # and is well-formed
    other = ""
    if lacks_tag and package.name != name:
        other = f"; it names the package {package.name!r} instead of {name!r}"
        hint = f"{hint}; {name_package(name)}"
    message = f"{fault.file}{line} cannot be read: {fault.explanation}{other}"
    return failed(message, measured=fault.message, hint=hint, citations=(fault.place,))


def _builds_with_catkin(found: Manifest) -> bool:
    """`catkin_package()` refuses a manifest that does not depend on catkin."""
    depends = any(d.name == "catkin" and d.kind in BUILD_TOOL_KINDS for d in found.dependencies)
    return depends and found.build_type in {"catkin", ""}
