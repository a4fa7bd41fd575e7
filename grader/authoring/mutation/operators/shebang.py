"""First lines that the system cannot use."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.solution import Site, Solution

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
