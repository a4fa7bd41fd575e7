"""The student's code beside a criterion: the files that it is about, with the lines that it cites and what differs from
the course's starter.

Everything is bounded, and nothing of a file becomes markup.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from fnmatch import fnmatch
from functools import lru_cache
from keyword import kwlist
from pathlib import Path, PurePosixPath

from markupsafe import Markup, escape

from grader.classes.review.submissions import Stamp, stamp_of
from grader.classes.similarity.sources import EVIDENCE_BYTES_MAX, PLACE, SUFFIXES
from grader.errors import EvidenceError
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.files import open_untrusted
from grader.model.result import CriterionResult
from grader.model.verdict import FileCitation
from grader.rubric.load import names_in
from grader.rubric.model import Criterion
from grader.untrusted_text import line

FILES_MAX = 12
LINES_MAX = 1500
LINE_CHARS = 300
RUNS_KEPT = 24


@dataclass(frozen=True, kw_only=True)
class CodeLine:
    """A line: its `number`, None for one of the starter that is gone; `kind` is `plus`, `minus` or empty."""

    number: int | None
    text: Markup
    kind: str = ""
    marked: bool = False


@dataclass(frozen=True, kw_only=True)
class CodeFile:
    """A file of the student's; `told` says in words what differs from the starter, and what is left out."""

    path: str
    rows: Sequence[CodeLine]
    cited: bool
    told: str


def code_of(
    folder: Path,
    criterion: Criterion,
    result: CriterionResult,
    starter: Mapping[str, bytes],
    hide: Callable[[str], str] = str,
) -> list[CodeFile]:
    """Return the files that the criterion is about, those that it cites first; none without evidence.

    They are what it cites and what its parameters name, or else all programs; a pattern of its `files` that fits none
    is one without lines. `starter` has the course's files by path;
    `hide` takes out of each line what is not to be read.
    """
    run = _package_run(folder, stamp_of(folder.joinpath(*PLACE)))
    if run is None:
        return []
    marks: dict[str, set[int]] = {}
    for citation in result.citations:
        if isinstance(citation, FileCitation):
            marks.setdefault(citation.file, set()).add(citation.line or 0)
    paths = [path for path in marks if path in run.attachments]
    paths += [path for path in sorted(run.attachments) if path not in marks and _is_about(criterion, path)]
    missing = [
        CodeFile(path=pattern, rows=(), cited=False, told="no such file is in the evidence")
        for pattern in map(str, criterion.parameters.get("files", ()))
        if criterion.check == "manual" and not any(_fits(path, pattern) for path in run.attachments)
    ]
    if not paths and not missing:
        paths = [path for path in sorted(run.attachments) if PurePosixPath(path).suffix in SUFFIXES]
    found = [_file(run, path, marks.get(path, set()), starter, hide) for path in paths[:FILES_MAX]]
    return [*found, *missing]


def _is_about(criterion: Criterion, path: str) -> bool:
    """Return whether its parameters name the file, by its path, its name or a pattern."""
    patterns = [str(one) for one in criterion.parameters.get("files", ())]
    return PurePosixPath(path).name in names_in(criterion) or any(_fits(path, one) for one in patterns)


def _fits(path: str, pattern: str) -> bool:
    return fnmatch(path, pattern) or fnmatch(PurePosixPath(path).name, pattern)


@lru_cache(maxsize=RUNS_KEPT)
def _package_run(folder: Path, stamp: Stamp) -> Run | None:  # noqa: ARG001 - another file is another key
    try:
        with open_untrusted(folder, *PLACE) as file:
            if os.fstat(file.fileno()).st_size > EVIDENCE_BYTES_MAX:
                return None
            return load_run(file)
    except (OSError, EvidenceError):
        return None


def _file(
    run: Run, path: str, marks: set[int], starter: Mapping[str, bytes], hide: Callable[[str], str]
) -> CodeFile:
    lines = run.file_lines(path)
    before = _handed_out(path, starter)
    shown = highlighted(
        [line(text.expandtabs(4), LINE_CHARS) for text in lines[:LINES_MAX]], PurePosixPath(path).suffix
    )
    rows = list(_rows(shown, lines[:LINES_MAX], before[:LINES_MAX] if before is not None else None, marks))
    told = []
    if before is not None:
        plus, minus = (sum(row.kind == kind for row in rows) for kind in ("plus", "minus"))
        told.append(f"{plus} new and {minus} removed" if plus or minus else "as the course handed it out")
    if len(lines) > LINES_MAX:
        told.append(f"{len(lines) - LINES_MAX} more lines are not shown")
    return CodeFile(path=hide(path), rows=rows, cited=bool(marks), told="; ".join(told))


def _rows(
    shown: Sequence[Markup], lines: Sequence[str], before: Sequence[str] | None, marks: set[int]
) -> Iterator[CodeLine]:
    if before is None:
        yield from (CodeLine(number=i, text=text, marked=i in marks) for i, text in enumerate(shown, start=1))
        return
    plain = [[text.rstrip() for text in part] for part in (before, lines)]
    for kind, was, was_end, now, now_end in SequenceMatcher(None, plain[0], plain[1]).get_opcodes():
        if kind in ("delete", "replace"):
            gone = (line(text.expandtabs(4), LINE_CHARS) for text in before[was:was_end])
            yield from (CodeLine(number=None, text=escape(text), kind="minus") for text in gone)
        new = "" if kind == "equal" else "plus"
        for place in range(now, now_end):
            yield CodeLine(number=place + 1, text=shown[place], kind=new, marked=place + 1 in marks)


def _handed_out(path: str, starter: Mapping[str, bytes]) -> list[str] | None:
    """Return the lines of the starter's file at that path of the package; None where it has none."""
    own = re.sub(r"^(\.\./)+", "", path)
    found = next((data for name, data in starter.items() if f"/{name}".endswith(f"/{own}")), None)
    return None if found is None else found.decode("utf-8", "replace").splitlines()


CPP_WORDS = (
    "auto bool break case catch char class const constexpr continue default delete do double else enum explicit false "
    "float for friend if inline int long namespace new nullptr operator private protected public return short signed "
    "size_t sizeof static struct switch template this throw true try typedef typename union unsigned using virtual "
    "void while"
)
_STRING = r"""(?P<string>"(?:[^"\\\n]|\\.)*"?|'(?:[^'\\\n]|\\.)*'?)"""
_LONG = r'''(?P<long>"""(?:(?!""").)*(?:""")?|\'\'\'(?:(?!\'\'\').)*(?:\'\'\')?)'''
_NUMBER = r"(?P<number>\b\d[\w.]*)"


def _words(words: Iterable[str]) -> str:
    return rf"(?P<word>\b(?:{'|'.join(words)})\b)"


# Not Pygments: `similarity` has to interrupt its patterns where a text keeps them busy, which a server's thread cannot.
_HASH = r"(?P<comment>#[^\n]*)"
_PYTHON = re.compile("|".join([_HASH, _LONG, _STRING, _words(kwlist), _NUMBER]), re.DOTALL)
_CPP = re.compile(
    "|".join(
        [r"(?P<comment>//[^\n]*|/\*(?:(?!\*/).)*(?:\*/)?)", _STRING, _words(CPP_WORDS.split()), _NUMBER]
    ),
    re.DOTALL,
)
_XML = re.compile(r"(?P<comment><!--(?:(?!-->).)*(?:-->)?)|(?P<word></?[\w:-]+|/?>)|" + _STRING, re.DOTALL)
_OTHER = re.compile(f"{_HASH}|{_STRING}|{_NUMBER}")


def highlighted(lines: Sequence[str], suffix: str) -> list[Markup]:
    """Return the lines, escaped, with comments, strings, numbers and words of the language in elements of their own.

    The patterns look at each character a bounded number of times.
    """
    if suffix in SUFFIXES:
        pattern = _PYTHON if SUFFIXES[suffix] == "python" else _CPP
    else:
        pattern = _XML if suffix in {".xml", ".launch", ".urdf", ".xacro"} else _OTHER
    text = "\n".join(lines)
    made, at = [], 0
    for found in pattern.finditer(text):
        made += [escape(text[at : found.start()]), _mark_up(found[0], found.lastgroup or "")]
        at = found.end()
    return [Markup(part) for part in "".join([*made, escape(text[at:])]).split("\n")]  # noqa: S704 - escaped


def _mark_up(text: str, kind: str) -> str:
    """Return an element for each line of it."""
    parts = escape(text).split("\n")
    return "\n".join(part and f'<span class="hl-{kind}">{part}</span>' for part in parts)
