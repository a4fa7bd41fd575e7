"""C++ targets that may be compiled before the build has made the headers of messages that they include.

Under `make -j` such a package builds on one day and not on the next, so that it is told by the files alone.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import NamedTuple

from grader.model.package import CMAKE, INTERFACE_FOLDERS, CMakeCall, CMakeFacts, PackageFacts
from grader.wording import join_words

GENERATE = "generate_messages"
MAKES_TARGETS = ("add_executable", "add_library")
OF_GENERATION = re.compile(
    r"_generate_messages(?:_(?:cpp|py|eus|lisp|nodejs))?$|_gen(?:cpp|py|eus|lisp|nodejs)$"
)
"""The targets that `generate_messages(…)` makes, behind the package's name."""
LIKE_GENERATED = re.compile(r"_gen(?!cfg|param)\w*$|EXPORTED?_TARGETS?$")
"""A name that means a target of `generate_messages(…)`, spelt right or not."""
_FOLDERS = re.compile(r"^\$\{(?:CMAKE_CURRENT_SOURCE_DIR|PROJECT_SOURCE_DIR|CMAKE_SOURCE_DIR)\}/")
_DEPTH_MAX = 20
_NO_PROGRAM = {"IMPORTED", "ALIAS", "EXCLUDE_FROM_ALL", "INTERFACE"}


class Unwaited(NamedTuple):
    """A target that `call` makes, a header that it includes by `source`, and what makes such headers, as it is written.

    `lost` is the call of `add_dependencies` for it, where there is one, and `absent` what that names although there is
    no such target. `above` is the call below which its dependencies count. `commented` is the call that would be right,
    where it is in a comment.
    """

    target: str
    call: CMakeCall
    header: str
    source: str
    exported: str
    lost: CMakeCall | None
    absent: tuple[str, ...]
    above: CMakeCall
    commented: CMakeCall | None

    @property
    def line(self) -> CMakeCall:
        """The call to look at."""
        return self.commented or self.lost or self.call

    @property
    def fix(self) -> str:
        """What to write, and where."""
        if self.commented is not None:
            return f"remove the `#` on line {self.commented.line}"
        if self.lost is None:
            below = f"{self.above.name}(…) on line {self.above.line}"
            return f"below the {below}, write add_dependencies({self.target} {self.exported})"
        if self.lost.line < self.above.line:
            call = f"the add_dependencies({self.target} …) on line {self.lost.line}"
            return f"move {call} below the {self.above.name}(…) on line {self.above.line}, and add {self.exported}"
        if self.absent:
            return f"on line {self.lost.line}, write {self.exported} in place of {' '.join(self.absent)}"
        return f"add {self.exported} to the add_dependencies({self.target} …) on line {self.lost.line}"


def unwaited_targets(
    package: PackageFacts,
    known: Collection[str],
    cmake: CMakeFacts | None = None,
    *,
    all_made: bool = False,
) -> list[Unwaited]:
    """Return the targets that include headers of definitions handed in, by themselves or by the package's own headers,
    and that nothing makes wait for what makes these. `known` are ROS's packages of messages; `cmake`
    stands for the package's `CMakeLists.txt`; `all_made`: as if each definition were named there."""
    cmake = cmake or package.cmake
    calls, commented = (cmake.calls, cmake.commented) if cmake is not None else ((), ())
    makers = {package.name: _headers_made(package, calls, all_made=all_made)}
    for one in package.also:
        makers[one.name] = _headers_made(one, one.cmake.calls if one.cmake else (), all_made=all_made)
    headers = {file.path: file.headers for file in package.files if file.headers}
    if not any(header in made for made in makers.values() for own in headers.values() for header in own):
        return []
    waits_for = _read_dependencies(calls, package.name)
    found = []
    for call in calls:
        if call.name not in MAKES_TARGETS or not call.args or _NO_PROGRAM & {*call.args[1:3]}:
            continue
        missing: dict[str, tuple[str, str]] = {}
        included = [(header, path) for path in _sources(call, headers) for header in headers[path]]
        for header, path in included:
            maker = header.partition("/")[0]
            if header in makers.get(maker, ()):
                missing.setdefault(maker, (header, path))
        reached = _reach(call.args[0], waits_for) if missing else ()
        missing = {
            maker: one
            for maker, one in missing.items()
            if not any(_makes(word, maker, package.name) for word in reached)
        }
        if missing:
            new = _describe(call, calls, missing, package.name, known)
            found.append(new._replace(commented=_find_commented(new, commented, missing, package.name)))
    return found


def surely_waits(package: PackageFacts) -> bool:
    """Return whether the files show that each source which includes such headers is of a target that waits for them:
    then no build of it is a matter of luck."""
    calls = package.cmake.calls if package.cmake is not None else ()
    makers = {package.name, *(one.name for one in package.also)}
    of_lab = {f.path for f in package.files if any(h.partition("/")[0] in makers for h in f.headers)}
    named = {path for call in calls if call.name in MAKES_TARGETS for path in _sources(call, of_lab)}
    return named == of_lab and not unwaited_targets(package, (), all_made=True)


def reasons_of(found: Sequence[Unwaited]) -> list[str]:
    """Return what is wrong with these targets, those that wait for nothing together."""
    alone = [one for one in found if one.lost is None]
    whys = []
    if alone:
        headers = join_words(dict.fromkeys(one.header for one in alone))
        include = "which it includes" if len(alone) == 1 else "which they include"
        targets = join_words(one.target for one in alone)
        whys.append(f"nothing in {alone[0].call.file} makes {targets} wait for {headers}, {include}")
    whys += [
        f"the add_dependencies({one.target} …) on line {one.commented.line} is commented out"
        for one in found
        if one.commented is not None
    ]
    for one in found:
        if one.lost is not None:
            line = f"line {one.lost.line} of {one.lost.file}"
            absent = join_words(one.absent)
            does = "do" if len(one.absent) > 1 else "does"
            why = f"add_dependencies({one.target} …), {line}, does not make it wait for that header"
            if one.absent:
                why = f"what it waits for by {line}, {absent}, {does} not exist"
            whys.append(f"{one.target} includes {one.header}, and {why}")
    return whys


def fixes_of(found: Sequence[Unwaited]) -> list[str]:
    """Return what to write for these targets; of those that one call in a loop makes, below the loop."""
    by_place: dict[tuple[str, int], list[Unwaited]] = {}
    for one in found:
        by_place.setdefault((one.line.file, one.line.line), []).append(one)
    fixes = []
    for (_, line), alike in by_place.items():
        written = [f"add_dependencies({one.target} {one.exported})" for one in alike]
        below = (
            f"below the foreach(…) loop around line {line}, write {join_words(written, most=len(written))}"
        )
        fixes.append(alike[0].fix if len(alike) == 1 else below)
    return fixes


def _headers_made(package: PackageFacts, calls: Sequence[CMakeCall], *, all_made: bool) -> set[str]:
    """Return the headers that the build of a package makes of its definitions."""
    if not all_made and all(call.name != GENERATE for call in calls):
        return set()
    named = {word for call in calls if call.name in INTERFACE_FOLDERS for word in call.args}
    whole = all_made or any("$" in word for word in named) or "FILES" not in named
    names = {PurePosixPath(word).name for word in named}
    return {
        f"{package.name}/{name}.h"
        for one in package.interfaces
        if whole or PurePosixPath(one.path).name in names
        for name in one.classes
    }


def _sources(call: CMakeCall, paths: Collection[str]) -> Iterator[str]:
    """Yield which of the paths a call names: from the package's folder, or from the folder of its own file."""
    for word in call.args[1:]:
        place = _FOLDERS.sub("", word)
        if place.startswith("/"):
            parts = place.strip("/").split("/")[-_DEPTH_MAX:]
            tried = ["/".join(parts[at:]) for at in range(len(parts))]
        else:
            tried = [
                posixpath.normpath(posixpath.join(posixpath.dirname(call.file), place)),
                posixpath.normpath(place),
            ]
        yield from (one for one in tried[:_DEPTH_MAX] if one in paths)


def _read_dependencies(calls: Sequence[CMakeCall], own: str) -> dict[str, set[str]]:
    """Return what each target waits for, as it is named; of a target with commands of its own, only CMake knows."""
    begun = next((index for index, call in enumerate(calls) if call.name == GENERATE), len(calls))
    found: dict[str, set[str]] = {}
    for index, call in enumerate(calls):
        if call.name in ("add_dependencies", "target_link_libraries") and call.args:
            # The variable has no value above the call that makes the targets.
            words = (w for w in call.args[1:] if index > begun or _exports(w) != own)
            found.setdefault(call.args[0], set()).update(words)
        elif call.name == "add_custom_target" and call.args:
            found.setdefault(call.args[0], set()).add("${unknown}")
    return found


def _reach(target: str, waits_for: Mapping[str, Collection[str]]) -> set[str]:
    """Return all that a target waits for, by itself or by what it links."""
    reached = new = {target}
    while new:
        new = {word for one in new for word in waits_for.get(one, ())} - reached
        reached = reached | new
    return reached


def _makes(word: str, maker: str, own: str) -> bool:
    """Return whether what is waited for makes the headers of a package; also where only CMake could tell."""
    if word in (f"{maker}_generate_messages", f"{maker}_generate_messages_cpp", f"{maker}_gencpp"):
        return True
    exported = _exports(word)
    if exported == "catkin":
        return maker != own
    if exported or "EXPORT" in word:
        return exported == maker
    # What `find_package(…)` gives to be linked with is no target of the build.
    return "$" in word and "LIB" not in word and not word.startswith("$<")


def _exports(word: str) -> str:
    """Return the package of `${lab_EXPORTED_TARGETS}`, "" of anything else."""
    found = re.fullmatch(r"\$\{(\w+)_EXPORTED_TARGETS\}", word)
    return found[1] if found else ""


def _describe(
    call: CMakeCall,
    calls: Sequence[CMakeCall],
    missing: Mapping[str, tuple[str, str]],
    own: str,
    known: Collection[str],
) -> Unwaited:
    """Return what is wrong with a target. `missing` holds a header and a source that includes it, by the package that
    makes it."""
    target = call.args[0]
    found = {word for one in calls if one.name == "find_package" for word in one.args}
    words = ["${${PROJECT_NAME}_EXPORTED_TARGETS}"] if own in missing else []
    words += ["${catkin_EXPORTED_TARGETS}"] if found & {*missing} else []
    words += [f"{maker}_generate_messages_cpp" for maker in sorted({*missing} - {*found, own})]
    mine = [one for one in calls if one.name == "add_dependencies" and one.args[:1] == (target,)]
    lost = next(
        (one for one in mine if any(map(LIKE_GENERATED.search, one.args[1:]))), mine[0] if mine else None
    )
    there = {one.args[0] for one in calls if one.name in (*MAKES_TARGETS, "add_custom_target") and one.args}
    made = tuple(f"{name}_gen" for name in {*found, *missing, *known, own})
    absent = [
        word
        for word in (lost.args[1:] if lost else ())
        if "$" not in word and word not in there and LIKE_GENERATED.search(word)
        and not (word.startswith(made) and OF_GENERATION.search(word))
    ]  # fmt: skip
    above = [one for one in calls if one.name == GENERATE and one.file == call.file and own in missing]
    header, source = next(iter(missing.values()))
    return Unwaited(
        target=target,
        call=call,
        header=header,
        source=source,
        exported=" ".join(words),
        lost=lost,
        absent=tuple(absent),
        above=max((call, *above), key=lambda one: one.line),
        commented=None,
    )


def _find_commented(
    one: Unwaited, commented: Sequence[CMakeCall], makers: Collection[str], own: str
) -> CMakeCall | None:
    """Return the call in a comment that would make the target wait for these makers."""
    for call in commented if one.lost is None and one.above.file == CMAKE else ():
        is_right = all(any(_makes(word, maker, own) for word in call.args[1:]) for maker in makers)
        if call.args[:1] == (one.target,) and call.line > one.above.line and is_right:
            return call
    return None
