"""`CMakeLists.txt` as CMake reads it where a trace is at hand, and by `cmake_parser` where none is."""

from __future__ import annotations

from pathlib import Path

from grader.model.package import CMakeCall, CMakeFacts
from grader.package.cmake_parse import parse_cmake
from grader.package.cmake_trace import read_trace

CMAKE_FILE = "CMakeLists.txt"

# What steers CMake or only talks; everything else is a fact.
_LEFT_OUT = frozenset(
    {
        *("if", "elseif", "else", "endif", "foreach", "endforeach", "while", "endwhile", "block", "endblock"),
        *("function", "endfunction", "macro", "endmacro", "return", "break", "continue", "message"),
    },
)


def read_cmake(
    folder: Path, name: str, *, trace: Path | None = None, root: str | None = None
) -> CMakeFacts | None:
    """The calls of the package's CMake files; None where there is no `CMakeLists.txt`.

    `name` is the package's name for variables that catkin sets. For `trace` and `root` see `refine_cmake`.
    """
    facts = parse_cmake(folder, name)
    if facts is None:
        return None
    facts = facts.model_copy(update={"calls": _kept(facts.calls)})
    return facts if trace is None else refine_cmake(facts, (name, folder.name), trace=trace, root=root)


def refine_cmake(
    facts: CMakeFacts, names: tuple[str, ...], *, trace: Path, root: str | None = None
) -> CMakeFacts:
    """`facts` of the parser, replaced by what CMake itself was told.

    `trace` is what CMake wrote by `--trace-expand --trace-format=json-v1`, `root` the package's folder as
    CMake saw it; without it, a folder that has one of the `names` is looked for. Where CMake gave up before
    the end of the file, the parser's calls from there on are kept. A trace without any call of the package
    changes nothing.
    """
    calls = read_trace(trace, names, root)
    if facts.source == "trace" or not calls:
        return facts
    reached = max(call.line for call in calls if call.file == CMAKE_FILE)
    returned = any(call.name == "return" for call in calls)
    stopped = not returned and facts.last_line is not None and reached < facts.last_line
    rest = tuple(c for c in facts.calls if stopped and c.file == CMAKE_FILE and c.line > reached)
    return CMakeFacts(
        file=facts.file,
        source="trace",
        calls=(*_kept(calls), *rest),
        last_line=facts.last_line,
        stopped_line=reached if stopped else None,
    )


def _kept(calls: tuple[CMakeCall, ...]) -> tuple[CMakeCall, ...]:
    return tuple(call for call in calls if call.name not in _LEFT_OUT)
