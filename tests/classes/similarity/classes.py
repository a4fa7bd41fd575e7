"""Classes of submissions, as evidence: hand-written programs, fixtures, and disguised copies."""

from __future__ import annotations

import ast
import io
import keyword
import tokenize
from collections.abc import Callable, Mapping
from pathlib import Path

from fixtures.make import declared, faulty_package
from grader.evidence.writer import EvidenceWriter

HERE = Path(__file__).parent
Files = dict[str, bytes]


def solution(name: str) -> str:
    """One of the programs in `solutions/`: each written for itself."""
    return (HERE / "solutions" / f"{name}.txt").read_text(encoding="utf-8")


def hand_in(folder: Path, files: Mapping[str, bytes]) -> Path:
    """A folder of results whose evidence holds these files."""
    (folder / "evidence").mkdir(parents=True)
    path = folder / "evidence" / "package.mcap"
    with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
        for name, data in files.items():
            writer.attach(name, data, 0, "text/plain")
    return folder


def class_of(folder: Path, submissions: Mapping[str, Mapping[str, bytes]]) -> dict[str, Path]:
    return {name: hand_in(folder / name, files) for name, files in submissions.items()}


def fixture_variants(lab: str, count: int) -> dict[str, Files]:
    """Fixtures of a lab: one solution, each with a small change of its own."""
    found = {}
    for name in sorted(declared(lab)):
        package = faulty_package(lab, name) / "lab1"
        programs = [path for path in package.rglob("*") if path.suffix in {".py", ".xml", ".txt"}]
        if programs and len(found) < count:
            found[name] = {path.relative_to(package).as_posix(): path.read_bytes() for path in programs}
    return found


def renamed(code: str) -> str:
    """Every name that the program itself gives becomes another one."""
    names, rows = _given(ast.parse(code)), code.splitlines(keepends=True)
    for token in reversed(_tokens(code)):
        if token.type == tokenize.NAME and token.string in names:
            (row, begin), (_, end) = token.start, token.end
            rows[row - 1] = f"{rows[row - 1][:begin]}zz_{token.string[::-1]}{rows[row - 1][end:]}"
    return "".join(rows)


def commented(code: str) -> str:
    """Other comments in other places, and empty lines between."""
    ends = {token.start[0] for token in _tokens(code) if token.type == tokenize.NEWLINE}
    rows = []
    for number, row in enumerate(code.splitlines(), 1):
        rows.append(row + (f"  # step {number}: look here" if number in ends and "#" not in row else ""))
        if number in ends and number % 3 == 0:
            rows += ["", ""]
    return "\n".join([rows[0], "# my own work", "", *rows[1:]]) + "\n"


def respaced(code: str) -> str:
    """Tabs, no blanks around signs, other line ends."""
    rows = []
    for row in code.splitlines():
        text = row.lstrip(" ")
        rows.append("\t" * ((len(row) - len(text)) // 4) + text.replace(" = ", "=").replace(", ", " ,"))
    return "\r\n".join(rows) + "\r\n"


def reordered(code: str) -> str:
    """Functions and classes in turned-around order, before all else that the program does."""
    lines, tree = code.splitlines(), ast.parse(code)
    blocks = [n for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)]
    imports = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
    parts = [lines[n.lineno - 1 : n.end_lineno] for n in [*imports, *reversed(blocks)]]
    taken = {number for n in [*imports, *blocks] for number in range(n.lineno - 1, n.end_lineno or 0)}
    rest = [line for number, line in enumerate(lines) if number not in taken]
    return "\n".join([rest[0], *(line for part in parts for line in [*part, ""]), *rest[1:]]) + "\n"


DISGUISES: dict[str, Callable[[str], str]] = {
    "other names": renamed,
    "other comments": commented,
    "other layout": respaced,
    "other order": reordered,
    "all at once": lambda code: respaced(commented(reordered(renamed(code)))),
}


def _tokens(code: str) -> list[tokenize.TokenInfo]:
    return list(tokenize.generate_tokens(io.StringIO(code).readline))


def _given(tree: ast.AST) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
    return {
        name for name in names if not keyword.iskeyword(name) and not name.startswith("__") and name != "self"
    }
