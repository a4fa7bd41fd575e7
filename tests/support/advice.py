"""What is wrong with the advice of a report, as far as the package's files show it: for the tests of all fixtures."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation
from grader.report.view import ON_COPY, steps

FILE = r"(?P<file>(?:\.\./)?[\w./-]*\w\.(?:py|launch|xml|txt|yaml|yml|msg|srv|action|cpp|sh))"
PLACE = re.compile(rf"{FILE},? line (?P<line>\d+)|line (?P<line2>\d+) of {FILE.replace('file', 'file2')}")
WRITE = re.compile(
    r"\bwrite (?:`(?P<marked>[^`]+)`|(?P<plain>#!\S+(?: \w+)?|<[^<>]+>(?:[\w@.]+</\w+>)?|\w+=\"[^\"]*\"))"
)
REMOVE = re.compile(r"\b(?:remove|delete|take out) (?:`(?P<marked>[^`]+)`|(?P<plain>\w+=\"[^\"]*\"))")
FIRST_LINE = "as the very first line"


def faulty_advice(criteria: Sequence[CriterionResult], source: Path) -> list[str]:
    """Return what is wrong, a line each; empty where all is well. `source` is what was submitted, with the package."""
    files = {path.relative_to(source).as_posix(): path for path in source.rglob("*") if path.is_file()}
    told = [c for c in criteria if c.status.is_lost and c.hint and not re.fullmatch(r"fix \S+ first", c.hint)]
    lines = _Lines(files)
    found = [f"{c.id}: {fault}: {c.hint} [{c.message}]" for c in told for fault in _faults(c, lines)]
    return found + list(_contradictions(told))


class _Lines:
    """The lines of a submission's files, by the paths that a report gives them."""

    def __init__(self, files: dict[str, Path]) -> None:
        self._files = files

    def of(self, name: str) -> list[str] | None:
        """Return the lines of the file of that path below some folder; None where there is none."""
        wanted = name.removeprefix("../")
        path = next((p for at, p in self._files.items() if f"/{at}".endswith(f"/{wanted}")), None)
        return path.read_text(encoding="utf-8-sig", errors="replace").splitlines() if path else None


def _faults(criterion: CriterionResult, lines: _Lines) -> Iterator[str]:
    cited = [c for c in criterion.citations if isinstance(c, FileCitation) and c.line]
    named = _places(criterion.hint)
    for file, line in [*named, *((c.file, c.line or 0) for c in cited)]:
        there = lines.of(file)
        if there is None or not 0 < line <= len(there):
            yield f"there is no line {line} of {file}"
    texts = {(lines.of(file) or [])[line - 1 : line][0].strip() for file, line in _there(named, cited, lines)}
    for code in _codes(WRITE, criterion.hint):
        if code in texts:
            yield f"{code} is there already"
    if FIRST_LINE in criterion.hint and (code := next(_codes(WRITE, criterion.hint), "")):
        first = next((there[0] for c in cited if (there := lines.of(c.file))), "")
        if first.strip() == code:
            yield f"the first line is {code}"
    seen = [(m["file"] or m["file2"]) for m in PLACE.finditer(ON_COPY.sub("", criterion.message))]
    if seen and not named and not any(isinstance(c, FileCitation) for c in criterion.citations):
        yield f"{seen[0]} is known, and is not cited"


def _places(text: str) -> list[tuple[str, int]]:
    return [(m["file"] or m["file2"], int(m["line"] or m["line2"])) for m in PLACE.finditer(text)]


def _there(
    named: list[tuple[str, int]], cited: list[FileCitation], lines: _Lines
) -> Iterator[tuple[str, int]]:
    for file, line in dict.fromkeys([*named, *((c.file, c.line or 0) for c in cited)]):
        if 0 < line <= len(lines.of(file) or []):
            yield file, line


def _codes(pattern: re.Pattern[str], hint: str) -> Iterator[str]:
    for found in pattern.finditer(hint):
        yield found["marked"] or found["plain"]


def _contradictions(told: Sequence[CriterionResult]) -> Iterator[str]:
    """Yield two pieces of advice for one line that differ, and what one tells to remove and another to write."""
    for_line: dict[tuple[str, int], set[str]] = defaultdict(set)
    for criterion in told:
        cited = [(c.file, c.line or 0) for c in criterion.citations if isinstance(c, FileCitation) and c.line]
        places = set(_places(criterion.hint) or cited)
        codes = list(_codes(WRITE, criterion.hint))
        if len(places) == len(codes) == 1:
            (file, line), code = next(iter(places)), codes[0]
            for_line[file, line].add(code)
    for (file, line), codes_of_line in for_line.items():
        if len(codes_of_line) > 1:
            yield f"{file}, line {line}: write {' or '.join(sorted(codes_of_line))}?"
    written = {code for c in told for code in _codes(WRITE, c.hint)}
    for criterion in told:
        for code in _codes(REMOVE, criterion.hint):
            if code in written:
                yield f"{criterion.id}: remove {code}, which other advice says to write"


def apply_advice(criterion: CriterionResult, package: Path) -> None:
    """Do in the package's files what the advice says, word by word and one thing after the other. Raises ValueError for
    advice that no one could follow so."""
    places = [c for c in criterion.citations if isinstance(c, FileCitation)]
    for step in steps(criterion.hint):
        placed = re.match(rf"{FILE}(?: line (?P<line>\d+))?: (?P<rest>.+)", step)
        texts = [step, placed["rest"]] if placed else [step]
        found = [
            (do, match) for text in texts for pattern, do in _DEEDS if (match := re.search(pattern, text))
        ]
        if not found:
            raise ValueError(f"what is to be done? {step}")
        do, match = found[0]
        named = placed or re.search(FILE, step)
        cited = places[0].file if places and not placed else named["file"] if named else ""
        at = (
            int(placed["line"])
            if placed and placed["line"]
            else next((c.line for c in places if c.line), None)
        )
        do(package, package / cited, match, at)


def _edit(file: Path, line: int, new: Sequence[str], *, below: bool = False) -> None:
    """Write these lines in place of the line, or below it, as far in as it is."""
    lines = file.read_text(encoding="utf-8").splitlines()
    indent = lines[line - 1][: len(lines[line - 1]) - len(lines[line - 1].lstrip())]
    lines[line - (not below) : line] = [indent + one for one in new]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _replace(file: Path, line: int, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8").splitlines()[line - 1]
    changed = re.sub(old, lambda _: new, text, count=1)
    if changed == text:
        raise ValueError(f"there is no {old} in {text}")
    _edit(file, line, [changed.strip()])


def _indent(file: Path, line: int, more: int = 4, *, to: int | None = None) -> None:
    """Start the line so many spaces further in than the one above, or with so many."""
    lines = file.read_text(encoding="utf-8").splitlines()
    above = lines[line - 2]
    beside = len(above) - len(above.lstrip()) + more
    lines[line - 1] = " " * (beside if to is None else to) + lines[line - 1].strip()
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _uncomment(file: Path, first: int, last: int) -> None:
    for line in range(first, last + 1):
        _replace(file, line, r"#+ ?", "")


def _below_call(file: Path, line: int, code: str) -> None:
    lines = file.read_text(encoding="utf-8").splitlines()
    last = next(number for number, text in enumerate(lines, 1) if number >= line and ")" in text)
    _edit(file, last, [code], below=True)


def _move(old: Path, new: Path) -> None:
    new.parent.mkdir(parents=True, exist_ok=True)
    old.rename(new)


_CODE_AT = r"write (?:`(?P<code>[^`]+)`|(?P<bare>[a-z_]+\(.*\)))"
_TAG, _NAME = r"<(?:\w+)>[^<]*</\w+>", r"<name>.*</name>"
_DEEDS: tuple[tuple[str, Callable[[Path, Path, re.Match[str], int | None], object]], ...] = (
    (r"^chmod \+x ([^,]+)", lambda top, _f, m, _l: [(top / one).chmod(0o755) for one in m[1].split()]),
    (r"^dos2unix ([^,]+)", lambda top, _f, m, _l: (top / m[1]).write_text((top / m[1]).read_text())),
    (r"as UTF-8 without BOM$", lambda _t, f, _m, _l: f.write_text(f.read_text(encoding="utf-8-sig"))),
    (r"^write (#!\S+ \S+) as the very first line",
     lambda _t, f, m, _l: f.write_text(f"{m[1]}\n{f.read_text()}")),
    (r"^(?:mkdir -p \S+ && )?(?:git )?mv (\S+) (\S+)$", lambda top, _f, m, _l: _move(top / m[1], top / m[2])),
    (r"^replace the tabs: start line (\d+) with (\d+) spaces$",
     lambda _t, f, m, _l: _indent(f, int(m[1]), to=int(m[2]))),
    (r"^below line (\d+) add `(<.+>)`$",
     lambda _t, f, m, _l: _edit(f, int(m[1]), re.findall(_TAG, m[2]), below=True)),
    (r"^add (<.+>) below line (\d+)$",
     lambda _t, f, m, _l: _edit(f, int(m[2]), re.findall(_TAG, m[1]), below=True)),
    (r"^(?:add|write) (.+) below the \w+\(…\) on line (\d+)$",
     lambda _t, f, m, _l: _below_call(f, int(m[2]), m[1])),
    (r"^in place of lines? (\d+).* write (.+?)(?:, without # before it)?$",
     lambda _t, f, m, _l: _edit(f, int(m[1]), [m[2]])),
    (r"remove the `#` on lines? (\d+)(?: to (\d+))?$",
     lambda _t, f, m, _l: _uncomment(f, int(m[1]), int(m[2] or m[1]))),
    (r"^line (\d+): delete `(</\w+>)`$", lambda _t, f, m, _l: _replace(f, int(m[1]), m[2], "")),
    (r"^write <name>([\w-]+)</name> in (package\.xml)",
     lambda top, _f, m, at: _replace(top / m[2], at or 1, _NAME, f"<name>{m[1]}</name>")),
    (r"^write (\w+) instead of (\w+)$", lambda _t, f, m, at: _replace(f, at or 1, rf"\b{m[2]}\b", m[1])),
    (r'^write (\w+)="([\w.-]+)"$',
     lambda _t, f, m, at: _replace(f, at or 1, rf'\b{m[1]}="[^"]*"', f'{m[1]}="{m[2]}"')),
    (r"^write project\((\w+)\)$",
     lambda _t, f, m, at: _replace(f, at or 1, r"project\([^)]*\)", f"project({m[1]})")),
    (r"line (\d+): end it with `/>` or with `(</\w+>)`$",
     lambda _t, f, m, _l: _replace(f, int(m[1]), r"$", m[2])),
    (r"line \d+: let your editor turn the tabs into spaces, at a tab size of (\d)$",
     lambda _t, f, m, _l: f.write_text(f.read_text().expandtabs(int(m[1])))),
    (rf"line (\d+): {_CODE_AT}", lambda _t, f, m, _l: _edit(f, int(m[1]), [m["code"] or m["bare"]])),
    (r"^write (\S+) into it, after PROGRAMS$",
     lambda _t, f, m, at: _replace(f, at or 1, "PROGRAMS", f"PROGRAMS {m[1]}")),
    (r"^write `\)` at the end of line (\d+)$", lambda _t, f, m, _l: _replace(f, int(m[1]), r"$", ")")),
    (r"line (\d+): start it exactly below that one$", lambda _t, f, m, _l: _indent(f, int(m[1]), 0)),
    (r"line (\d+): start it four spaces further to the right than the one above$",
     lambda _t, f, m, _l: _indent(f, int(m[1]))),
)  # fmt: skip
"""What can be told to do to files, and how it is done."""
