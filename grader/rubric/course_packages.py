"""The folders that lie beside a rubric: ROS packages of the course (messages, simulators, bags), and the starter.

Their files belong to the rubric: they are part of its digest, and go wherever it goes.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from grader.model.package import MANIFEST
from grader.rubric.scenario import FOLDER_PATTERN, ROSTEST_ENDING
from grader.rubric.yaml_lines import Fault, WrittenRubric, as_texts
from grader.wording import did_you_mean

FILES_MAX = 500
BYTES_MAX = 20_000_000
IGNORED = frozenset({"build", "devel", "install", "__pycache__"})
LAUNCH_ENDINGS = (".launch", ".launch.xml")
SCRIPT = b"#!"
_NAME = re.compile(rb"<name>\s*([\w-]+)\s*</name>")
_TEST_NAME = re.compile(r"""<test\b[^>]*\btest-name\s*=\s*["']([^"']+)["']""")
_COMMENT = re.compile("<!--.*?-->", re.DOTALL)
_TARGET = re.compile(r"(?:add_executable\s*\(\s*|\bOUTPUT_NAME\s+)\"?([\w.-]+)")


def folder_files(folder: Path, name: str) -> dict[str, bytes]:
    """Return the files of the folder `name` beside a rubric, by their paths from the rubric's folder.

    Raises OSError, and ValueError for more than a rubric may bring along.
    """
    found: dict[str, bytes] = {}
    size = 0
    for place, folders, files in os.walk(folder / name):
        # Sorted, so that the first files past a limit are the same on every file system.
        folders[:] = sorted(f for f in folders if f not in IGNORED and not f.startswith("."))
        for file in sorted(files):
            path = Path(place) / file
            # A link could make any file of the machine's a part of the rubric.
            if path.is_symlink() or not path.is_file():
                continue
            size += path.stat().st_size
            if size > BYTES_MAX or len(found) == FILES_MAX:
                raise ValueError(f"is more than {BYTES_MAX // 1_000_000} MB or {FILES_MAX} files")
            found[path.relative_to(folder).as_posix()] = path.read_bytes()
    return found


def read_packages(rubric: WrittenRubric, folder: Path) -> tuple[dict[str, bytes], list[Fault]]:
    """Return the files of all packages that the rubric names, and what is wrong with them or with what starts them."""
    read: dict[str, bytes] = {}
    faults: list[Fault] = []
    for index, name in as_texts(rubric.data.get("packages")):
        if not re.fullmatch(r"[A-Za-z]\w*", name):
            continue  # said elsewhere
        try:
            files = folder_files(folder, name)
        except (OSError, ValueError) as error:
            faults.append((("packages", index), str(error)))
            continue
        read |= files
        named = _NAME.search(files.get(f"{name}/{MANIFEST}", b""))
        if f"{name}/{MANIFEST}" not in files:
            faults.append((("packages", index), f"there is no {name}/{MANIFEST} beside the rubric"))
        elif named is None or named[1].decode() != name:
            faults.append((("packages", index), f"{name}/{MANIFEST} does not say <name>{name}</name>"))
        else:
            faults += _programs(rubric, name, files)
    listed = {PurePosixPath(name).name for name in rubric.own_packages}
    for path, start in rubric.starts():
        name = str(start.get("program")).partition("/")[0]
        is_here = re.fullmatch(r"[A-Za-z]\w*", name) and (folder / name / MANIFEST).is_file()
        if is_here and name not in listed:
            faults.append(((*path, "program"), f"{name} lies beside the rubric: write packages: [{name}]"))
    return read, faults


def read_starter(rubric: WrittenRubric, folder: Path) -> tuple[dict[str, bytes], list[Fault]]:
    """Return the files that the course hands out, and what is wrong with their folder."""
    name = rubric.data.get("starter")
    if not isinstance(name, str) or not re.fullmatch(FOLDER_PATTERN, name):
        return {}, []  # said elsewhere
    try:
        files = folder_files(folder, name)
    except (OSError, ValueError) as error:
        return {}, [(("starter",), str(error))]
    if not any(files.values()):
        return {}, [(("starter",), f"there is no folder {name} with files in it beside the rubric")]
    return files, []


def _programs(rubric: WrittenRubric, package: str, files: Mapping[str, bytes]) -> Iterator[Fault]:
    """Yield a fault for each program that the package does not have."""
    known = {path.rpartition("/")[2] for path, data in files.items() if data.startswith(SCRIPT)}
    known |= {path.rpartition("/")[2] for path in files if path.endswith((*LAUNCH_ENDINGS, ROSTEST_ENDING))}
    cmake = files.get(f"{package}/CMakeLists.txt", b"").decode(errors="replace")
    known |= set(_TARGET.findall(cmake))
    for at, start in rubric.starts():
        path, (owner, _, name) = (*at, "program"), str(start.get("program")).partition("/")
        # With a variable of CMake's in it, a target's name is not known.
        if owner == package and name not in known and "${" not in cmake:
            yield path, f'{package} has no program or launch file "{name}"{did_you_mean(name, known)}'
        elif owner == package and name.endswith(ROSTEST_ENDING):
            data = next(data for file, data in files.items() if file.endswith(f"/{name}"))
            text = _COMMENT.sub("", data.decode(errors="replace"))
            # Where tests are, nothing of a student's runs.
            for own in rubric.packages:
                if re.search(rf"""pkg\s*=\s*["']{own}["']|\$\(find {own}\)""", text):
                    there = f"{name} starts something of {own}: take it out"
                    yield path, f"{there}, and start it in the scenario, before the tests"
            yield from _unknown_tests(rubric, at[1], start.get("name"), name, text)


def _unknown_tests(
    rubric: WrittenRubric, run: object, process: object, name: str, text: str
) -> Iterator[Fault]:
    """Yield the tests that criteria ask for and that the `.test` file, started as that process, does not have."""
    tests = set(_TEST_NAME.findall(text))
    for criterion in rubric.criteria:
        test = criterion.given.get("test")
        is_asked = criterion.run == run and criterion.given.get("process") == process
        if is_asked and isinstance(test, str) and test and "$(" not in text and test not in tests:
            fault = f'{name} has no <test test-name="{test}">{did_you_mean(test, tests)}'
            yield (*criterion.at, "test"), fault
