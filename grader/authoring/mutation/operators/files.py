"""Files that are missing, misplaced, of the wrong mode, or that begin with a line that the system cannot use."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import PurePosixPath

from grader.authoring.mutation.package_tree import Tree
from grader.authoring.mutation.registry import operator
from grader.authoring.mutation.solution import CMAKE, MANIFEST, CodePlace, Solution

OTHER_FOLDER = {"src": "scripts", "scripts": "src"}
TELLING = (".py", ".sh", ".launch", ".yaml", ".yml")
PYTHON = re.compile(r"python(?:\d(?:\.\d+)?)?$")


def _files(solution: Solution) -> Iterator[tuple[CodePlace, Solution, str]]:
    return ((CodePlace(path=path, at={"file": path}), solution, path) for path in solution.files)


def _programs(solution: Solution) -> Iterator[tuple[CodePlace, Solution, str]]:
    return ((CodePlace(path=path, at={"script": path}), solution, path) for path in solution.programs)


def _contents(solution: Solution) -> Iterator[tuple[CodePlace, bytes]]:
    for path in solution.programs:
        yield CodePlace(path=path, at={"script": path}, line=1), solution.entry(path).data


@operator("bit-removed", each=_programs)
def bit_removed(solution: Solution, path: str) -> Tree:
    """Never makes the script executable.

    Fits every executable file with a shebang.
    """
    return solution.with_entry(path, replace(solution.entry(path), executable=False))


@operator("file-missing", each=_files)
def file_missing(solution: Solution, path: str) -> Tree | None:
    """Forgets to hand in the file.

    Fits every script, launch file and YAML file.
    """
    return solution.without(path) if path.endswith(TELLING) or path in solution.programs else None


@operator("file-misnamed", each=_files)
def file_misnamed(solution: Solution, path: str) -> Tree | None:
    """Gives the file another name than the handout.

    Fits every script, launch file and YAML file.
    """
    name = PurePosixPath(path)
    return solution.moved(path, str(name.with_stem(f"my_{name.stem}"))) if path.endswith(TELLING) else None


@operator("script-elsewhere", each=_programs)
def script_elsewhere(solution: Solution, path: str) -> Tree | None:
    """Puts the script into another folder than the handout says.

    Fits every script under src/ or scripts/.
    """
    first, _, rest = path.partition("/")
    return solution.moved(path, f"{OTHER_FOLDER[first]}/{rest}") if rest and first in OTHER_FOLDER else None


@operator("launch-elsewhere", each=_files)
def launch_elsewhere(solution: Solution, path: str) -> Tree | None:
    """Keeps the launch file beside package.xml, not in its folder.

    Fits every launch file that lies in a folder.
    """
    inside = path.endswith(".launch") and "/" in path
    return solution.moved(path, PurePosixPath(path).name) if inside else None


@operator("build-file-missing", each=_files)
def build_file_missing(solution: Solution, path: str) -> Tree | None:
    """Forgets to hand in CMakeLists.txt.

    Fits a package with a CMakeLists.txt and a package.xml.
    """
    return solution.without(path) if path == CMAKE and MANIFEST in solution.files else None


# ---- first lines


def _first_line(data: bytes, change: Callable[[str], str]) -> bytes:
    line, rest = data.split(b"\n", 1) if b"\n" in data else (data, b"")
    return change(line.decode(errors="replace")).encode() + b"\n" + rest


@operator("crlf", each=_contents)
def crlf(data: bytes) -> bytes:
    """Saves the script with Windows line endings, so that its shebang names no program.

    Fits every script whose lines end as on Linux.
    """
    return data if b"\r\n" in data else data.replace(b"\n", b"\r\n")


@operator("byte-order-mark", each=_contents)
def byte_order_mark(data: bytes) -> bytes:
    """Saves the script with a byte order mark, so that the system does not see the shebang.

    Fits every script.
    """
    return b"\xef\xbb\xbf" + data


@operator("no-shebang", each=_contents)
def no_shebang(data: bytes) -> bytes:
    """Leaves out the shebang.

    Fits every script.
    """
    return data.partition(b"\n")[2]


@operator("shebang-typo", each=_contents)
def shebang_typo(data: bytes) -> bytes:
    """Names a program in the shebang that does not exist.

    Fits every script.
    """
    return _first_line(data, lambda line: line.replace("bin/", "bni/", 1))


@operator("shebang-commented", each=_contents)
def shebang_commented(data: bytes) -> bytes:
    """Puts a space into the shebang, which makes it a comment.

    Fits every script.
    """
    return _first_line(data, lambda line: line.replace("#!", "# !", 1))


@operator("shebang-python2", each=_contents)
def shebang_python2(data: bytes) -> bytes:
    """Asks for Python 2, which the machine does not have.

    Fits every Python script whose shebang ends in its interpreter.
    """
    return _first_line(data, lambda line: PYTHON.sub("python2", line.rstrip()))
