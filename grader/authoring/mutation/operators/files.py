"""Files that are missing, misplaced or of the wrong mode."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import PurePosixPath

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import CMAKE, MANIFEST, Site, Solution

OTHER_FOLDER = {"src": "scripts", "scripts": "src"}
TELLING = (".py", ".sh", ".launch", ".yaml", ".yml")


@operator("bit-removed")
def bit_removed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Never makes the script executable.

    Fits every executable file with a shebang.
    """
    for path in solution.programs:
        entry = solution.entry(path)
        if entry.executable:
            tree = solution.with_entry(path, replace(entry, executable=False))
            yield Site(at={"script": path}, tree=tree)


@operator("file-missing")
def file_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to hand in the file.

    Fits every script, launch file and YAML file.
    """
    for path in solution.files:
        if path.endswith(TELLING) or path in solution.programs:
            yield Site(at={"file": path}, tree=solution.without(path))


@operator("file-misnamed")
def file_misnamed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives the file another name than the handout.

    Fits every script, launch file and YAML file.
    """
    for path in solution.files:
        if path.endswith(TELLING):
            name = PurePosixPath(path)
            yield Site(at={"file": path}, tree=solution.moved(path, str(name.with_stem(f"my_{name.stem}"))))


@operator("script-elsewhere")
def script_elsewhere(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Puts the script into another folder than the handout says.

    Fits every script under src/ or scripts/.
    """
    for path in solution.programs:
        first, _, rest = path.partition("/")
        if rest and first in OTHER_FOLDER:
            yield Site(at={"script": path}, tree=solution.moved(path, f"{OTHER_FOLDER[first]}/{rest}"))


@operator("launch-elsewhere")
def launch_elsewhere(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Keeps the launch file beside package.xml, not in its folder.

    Fits every launch file that lies in a folder.
    """
    for path in solution.files:
        if path.endswith(".launch") and "/" in path:
            yield Site(at={"file": path}, tree=solution.moved(path, PurePosixPath(path).name))


@operator("build-file-missing")
def build_file_missing(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets to hand in CMakeLists.txt.

    Fits a package with a CMakeLists.txt and a package.xml.
    """
    if {CMAKE, MANIFEST} <= set(solution.files):
        yield Site(at={"file": CMAKE}, tree=solution.without(CMAKE))


# [authoring.mutation.operators.shebang] First lines that the system cannot use.

PYTHON = re.compile(r"python(?:\d(?:\.\d+)?)?$")


def _sites(solution: Solution, change: Callable[[bytes], bytes]) -> Iterator[Site]:
    for path in solution.programs:
        data = change(solution.entry(path).data)
        yield Site(at={"script": path}, tree=solution.with_data(path, data), line=1)


def _first_line(data: bytes, change: Callable[[str], str]) -> bytes:
    line, rest = data.split(b"\n", 1) if b"\n" in data else (data, b"")
    return change(line.decode(errors="replace")).encode() + b"\n" + rest


@operator("crlf")
def crlf(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Saves the script with Windows line endings, so that its shebang names no program.

    Fits every script whose lines end as on Linux.
    """
    yield from _sites(solution, lambda data: data if b"\r\n" in data else data.replace(b"\n", b"\r\n"))


@operator("byte-order-mark")
def byte_order_mark(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Saves the script with a byte order mark, so that the system does not see the shebang.

    Fits every script.
    """
    yield from _sites(solution, lambda data: b"\xef\xbb\xbf" + data)


@operator("no-shebang")
def no_shebang(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves the shebang away.

    Fits every script.
    """
    yield from _sites(solution, lambda data: data.partition(b"\n")[2])


@operator("shebang-typo")
def shebang_typo(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Names a program in the shebang that does not exist.

    Fits every script.
    """
    yield from _sites(solution, lambda data: _first_line(data, lambda line: line.replace("bin/", "bni/", 1)))


@operator("shebang-commented")
def shebang_commented(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Puts a space into the shebang, which makes it a comment.

    Fits every script.
    """
    yield from _sites(solution, lambda data: _first_line(data, lambda line: line.replace("#!", "# !", 1)))


@operator("shebang-python2")
def shebang_python2(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Asks for Python 2, which the machine does not have.

    Fits every Python script whose shebang ends in its interpreter.
    """
    yield from _sites(
        solution, lambda data: _first_line(data, lambda line: PYTHON.sub("python2", line.rstrip()))
    )
