"""What submissions have in common: which fingerprints are no one's own, and for two submissions what they share.

A file's fingerprints are `copydetect`'s: without names, texts, comments and layout. Each submission is read in a worker
process with little memory and little time: what a file does to the process costs its own submission the comparison,
and no other.
"""

from __future__ import annotations

import re
import signal
from base64 import b64decode, b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import metadata
from importlib.resources import files
from pathlib import Path
from types import FrameType
from typing import Annotated, TypeAlias

import numpy as np
from copydetect.utils import filter_code, get_copied_slices, hashed_kgrams
from numpy.typing import NDArray
from pydantic import PlainSerializer, PlainValidator
from pygments import token
from pygments.lexer import Lexer
from pygments.lexers import get_lexer_by_name

from grader.classes.similarity.sources import (
    Language,
    ProgramText,
    read_starter,
    read_submission,
)
from grader.errors import GraderError
from grader.model.batch import FileMatch, Lines, NotCompared, Pair, Similarity, TakenOut
from grader.workers import WorkerEnded, WorkerLimits, run_each

FILE_S = 5.0
"""Of the processor's time, like `cpu_s`: a busy machine leaves no file out."""
LIMITS = WorkerLimits(memory_bytes=2 << 30, cpu_s=30.0, wall_s=300.0)
ENVIRONMENT = {
    "MPLBACKEND": "Agg",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONDONTWRITEBYTECODE": "1",
    "PYTHONHASHSEED": "0",  # equal texts have equal fingerprints in every process
}
GRAM = 25
"""Signs in one fingerprint, `copydetect`'s own default: about two short statements."""


def _decode_numbers(text: str) -> NDArray[np.int64]:
    return np.frombuffer(b64decode(text), dtype=np.int64)


Numbers: TypeAlias = Annotated[
    NDArray[np.int64],
    PlainValidator(_decode_numbers),
    PlainSerializer(lambda numbers: b64encode(numbers.tobytes()).decode(), return_type=str),
]
"""In a worker's answer, the numbers' bytes in base64."""
BoolArray: TypeAlias = NDArray[np.bool_]

# In Python; what C++ includes becomes one sign anyway.
_IMPORT = re.compile(
    r"^[ \t]*(?:from\b[^\n]*?\bimport\b[ \t]*(?:\([^)]*\)|[^\n]*)|import\b[^\n]*)", re.MULTILINE
)
_NOT_LINE_ENDS = re.compile(r"[^\n]+")
_LAID_ASIDE = (token.Comment.Single, token.Comment.Multiline, token.Comment.Hashbang, token.String.Doc)


@dataclass(frozen=True, kw_only=True)
class CodeSource:
    """What to read: the folder of a submission's results, or starter code. Without a folder, the tutorials' code."""

    name: str = ""
    folder: Path | None = None
    is_starter: bool = False


@dataclass(frozen=True, kw_only=True)
class Text:
    """`prints[i]` is the fingerprint of the signs from i to i + GRAM, `lines[i]` the line of sign i, from 1."""

    path: str
    prints: Numbers
    lines: Numbers


@dataclass(frozen=True, kw_only=True)
class Fingerprints:
    """Those of a place's files, and which files could not be read."""

    place: CodeSource
    texts: tuple[Text, ...] = ()
    left_out: tuple[NotCompared, ...] = ()


class _TooLong(Exception):
    """A file took too long."""


def read_place(place: CodeSource) -> Fingerprints:
    """Return the fingerprints of a place's programs. This runs in a worker with `LIMITS` and `ENVIRONMENT`."""
    if place.folder is None:
        return read_files(place, TUTORIALS)
    try:
        read = read_starter(place.folder) if place.is_starter else read_submission(place.name, place.folder)
        return read_files(place, read.files, read.left_out)
    except GraderError as error:
        reason = error.message
    except FileNotFoundError:
        reason = "there is no evidence of it here"
    except OSError as error:
        reason = f"its evidence cannot be opened: {error.strerror}"
    except MemoryError:
        reason = "takes too much memory to read"
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are compared
        reason = f"could not be read: {type(error).__name__}"
    return Fingerprints(place=place, left_out=(leave_out(place, reason),))


def reading_ended(place: CodeSource, _: WorkerEnded) -> Fingerprints:
    """Return what there is of a place whose worker ended."""
    return Fingerprints(
        place=place, left_out=(leave_out(place, "reading it took too long or too much memory"),)
    )


def leave_out(place: CodeSource, reason: str) -> NotCompared:
    """Return that nothing of the place is compared."""
    return NotCompared(id=place.name, reason=reason)


def read_files(
    place: CodeSource, files: tuple[ProgramText, ...], left_out: tuple[NotCompared, ...] = ()
) -> Fingerprints:
    """Return the fingerprints of these files, each within `FILE_S`."""
    tried = [_try_read(place.name, file) for file in files]
    return Fingerprints(
        place=place,
        texts=tuple(one for one in tried if isinstance(one, Text)),
        left_out=left_out + tuple(one for one in tried if isinstance(one, NotCompared)),
    )


def _try_read(name: str, file: ProgramText) -> Text | NotCompared:
    try:
        return _read_in_time(file)
    except _TooLong:
        reason = f"took longer than {FILE_S:g} s to read"
    except MemoryError:
        reason = "takes too much memory to read"
    except Exception as error:  # noqa: BLE001 - whatever a lexer does, the other files are compared
        reason = f"could not be read: {type(error).__name__}"
    return NotCompared(id=name, file=file.path, reason=reason)


def _read_in_time(file: ProgramText) -> Text:
    """Read a file within `FILE_S`. Regular expressions look for signals, so that even an endless one is interrupted."""
    before = signal.signal(signal.SIGVTALRM, _interrupt)
    signal.setitimer(signal.ITIMER_VIRTUAL, FILE_S)
    try:
        return read_text(file.path, file.code, file.language)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise _TooLong


def read_text(path: str, code: str, language: Language) -> Text:
    """Return all fingerprints of a file's code: labs are short, and no window has to be thinned out."""
    plain = _without_comments(code, language)
    signs, offsets = filter_code(plain, path, language)
    prints = hashed_kgrams(signs, GRAM).astype(np.int64)
    skipped = len(plain) - len(plain.lstrip("\n"))  # pygments begins behind them
    places = np.arange(len(signs)) + _count_removed(offsets, len(signs)) + skipped
    # four bytes for each character, so that places in the array are places in the text
    ends = np.flatnonzero(np.frombuffer(plain.encode("utf-32-le"), dtype=np.uint32) == ord("\n"))
    return Text(path=path, prints=prints, lines=np.searchsorted(ends, places).astype(np.int64) + 1)


def mark_covered(text: Text, chosen: BoolArray) -> BoolArray:
    """Mark the signs that lie in one of the chosen fingerprints."""
    marks = np.zeros(len(text.lines), dtype=np.bool_)
    for begin, end in get_copied_slices(np.flatnonzero(chosen), GRAM).T.astype(int):
        marks[begin:end] = True
    return marks


def _without_comments(code: str, language: Language) -> str:
    """Return the same lines without comments, docstrings and imports, which are alike by nature.

    Classes get names of one letter: `filter_code` counts their length wrongly."""
    code = code.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    if language == "python":
        # line ends stay, so that the lines that are reported are those of the file
        code = _IMPORT.sub(lambda found: "\n" * found.group().count("\n"), code)
    parts = []
    for kind, text in _lexer(language).get_tokens(code):
        if any(_is(kind, laid) for laid in _LAID_ASIDE):
            parts.append(_NOT_LINE_ENDS.sub("", text))
        else:
            parts.append("C" if _is(kind, token.Name.Class) else text)
    return "".join(parts)


def _is(kind: tuple[str, ...], wanted: tuple[str, ...]) -> bool:
    return kind[: len(wanted)] == wanted


@cache
def _lexer(language: Language) -> Lexer:
    return get_lexer_by_name(language, stripnl=False)


def _count_removed(offsets: Numbers, size: int) -> Numbers:
    """Return how many characters are left out before each sign: `filter_code` notes it where it leaves some out."""
    rows = offsets[1:][offsets[1:, 0] >= 0]
    if not len(rows):
        return np.zeros(size, dtype=np.int64)
    counts = np.maximum.accumulate(rows[:, 1])
    at = np.searchsorted(rows[:, 0], np.arange(size))
    return counts[np.minimum(at, len(rows) - 1)].astype(np.int64)


def _tutorial(name: str) -> str:
    """Return what a student types from ROS's tutorials, in words of our own: names and texts do not count."""
    return files(__package__).joinpath("tutorials", f"{name}.txt").read_text(encoding="utf-8")


_TALKER, _LISTENER = _tutorial("talker.py"), _tutorial("listener.py")
_QUIET_TALKER = _TALKER.replace(", anonymous=True", "").replace("        rospy.loginfo(text)\n", "")
_QUIET_LISTENER = _LISTENER.replace(", anonymous=True", "").replace('rospy.get_caller_id() + "it', '"it')
TUTORIALS = (
    ProgramText(path="talker.py", code=_TALKER, language="python"),
    ProgramText(path="talker.py without a log", code=_QUIET_TALKER, language="python"),
    ProgramText(path="listener.py", code=_LISTENER, language="python"),
    ProgramText(path="listener.py without its id", code=_QUIET_LISTENER, language="python"),
    ProgramText(path="talker.cpp", code=_tutorial("talker.cpp"), language="cpp"),
    ProgramText(path="listener.cpp", code=_tutorial("listener.cpp"), language="cpp"),
)


LIBRARY = "copydetect"
MIN_LINES = 10
"""Independent solutions of a small lab share up to nine lines that anyone would write so."""
PRINTS_MAX = 20_000_000
PAIRS_MAX = 2_000
STARTER_NOTES = 20
LARGE_CLUSTER = 6
NO_PROGRAM = "holds no program in Python or C++"
COMMON_FROM = 6
"""Submissions a class must have before what most of them share counts as no one's own."""
MATRIX_COLUMNS = 4096
CANDIDATES_MAX = 20_000
NEAR = 0.25
"""The share of fingerprints from which two submissions are looked at character by character."""
_NONE = np.zeros(0, dtype=np.int64)


def compare_class(
    folders: Mapping[str, Path],
    starter: Sequence[Path],
    groups: Mapping[str, str],
    *,
    threshold: float,
    jobs: int,
) -> Similarity:
    """Compare a class as `comparison.compare` says. Its submissions are read in workers."""
    read = read_all(folders, starter, jobs)
    given = [text for one in read.starter for text in one.texts]
    several = len(read.submissions) >= COMMON_FROM
    common = common_prints(list(read.submissions.values())) if several else _NONE
    taken_out = distinct([*(text.prints for text in (*given, *read.tutorials)), common])
    works = [own_work(name, files, taken_out) for name, files in read.submissions.items()]
    enough = [work for work in works if work.lines >= MIN_LINES]
    pairs, same_group, cut = _pairs(enough, groups, threshold)
    found = clusters([(one.a, one.b) for one in pairs])
    cut = cut or len(pairs) > PAIRS_MAX
    return Similarity(
        library=LIBRARY,
        library_version=metadata.version(LIBRARY),
        threshold=threshold,
        min_lines=MIN_LINES,
        compared=len(works),
        pairs=tuple(pairs[:PAIRS_MAX]),
        clusters=found,
        taken_out=TakenOut(
            starter=tuple(text.path for text in given),
            tutorials=tuple(text.path for text in read.tutorials),
            common=len(common) if several else None,
        ),
        too_little=tuple(work.id for work in works if work.lines < MIN_LINES),
        not_compared=tuple(sorted(read.left_out, key=lambda one: (one.id, one.file))),
        same_group=same_group,
        notes=(*_starter_notes(read.starter), *_notes(len(works), found, has_starter=bool(starter), cut=cut)),
    )


@dataclass(kw_only=True)
class _Class:
    """The fingerprints of a class, as far as there is room for them."""

    starter: list[Fingerprints] = field(default_factory=list)
    tutorials: tuple[Text, ...] = ()
    submissions: dict[str, tuple[Text, ...]] = field(default_factory=dict)
    left_out: list[NotCompared] = field(default_factory=list)


def read_all(folders: Mapping[str, Path], starter: Sequence[Path], jobs: int) -> _Class:
    """Read submissions, starter code and tutorials, `jobs` at a time, each in a worker."""
    places = [
        CodeSource(),
        *(CodeSource(folder=folder, is_starter=True) for folder in starter),
        *(CodeSource(name=name, folder=folder) for name, folder in folders.items()),
    ]
    found, held = _Class(), 0
    for one in run_each(read_place, places, jobs, ended=reading_ended, limits=LIMITS, env=ENVIRONMENT):
        size = sum(len(text.prints) for text in one.texts)
        if one.place.folder is None:
            found.tutorials = one.texts
        elif one.place.is_starter:
            found.starter.append(one)
        elif held + size > PRINTS_MAX:
            found.left_out.append(leave_out(one.place, "the class has too much code to compare all of it"))
        else:
            found.left_out += one.left_out
            if not (one.texts or one.left_out):
                found.left_out.append(leave_out(one.place, NO_PROGRAM))
            found.submissions |= {one.place.name: one.texts} if one.texts else {}
            held += size
    # workers end in any order; the report has the order of the command line
    found.starter.sort(key=lambda one: places.index(one.place))
    found.submissions = dict(sorted(found.submissions.items()))
    return found


def _starter_notes(starter: Sequence[Fingerprints]) -> list[str]:
    """Return what to say about starter code that cannot be taken out."""
    notes = []
    for one in starter:
        notes += [f"starter code: {left.file}: {left.reason}" for left in one.left_out]
        notes += [] if one.texts or one.left_out else [f"starter code: {NO_PROGRAM}"]
    return notes[:STARTER_NOTES]


def _pairs(
    works: Sequence[Work], groups: Mapping[str, str], threshold: float
) -> tuple[list[Pair], int, bool]:
    """Return the pairs that a person should see, how many were left out for their group, and whether some were cut."""
    near, cut = candidates(works)
    found, same_group = [], 0
    for first, second in near:
        one = pair(works[first], works[second])
        share = max(one.similarity_a, one.similarity_b)
        if share < threshold or min(one.lines_a, one.lines_b) < MIN_LINES:
            continue
        group = groups.get(one.a, "")
        if group and group == groups.get(one.b):
            same_group += 1
        else:
            found.append(one)
    found.sort(
        key=lambda one: (-max(one.similarity_a, one.similarity_b), -one.lines_a - one.lines_b, one.a, one.b)
    )
    return found, same_group, cut


def _notes(count: int, found: Sequence[Sequence[str]], *, has_starter: bool, cut: bool) -> list[str]:
    notes = []
    if count < COMMON_FROM and not has_starter:
        notes.append(
            f"fewer than {COMMON_FROM} submissions and no starter code: what the task itself makes alike is not "
            "taken out; give the handout's package, or a reference solution, with --starter"
        )
    if any(len(group) >= LARGE_CLUSTER for group in found):
        notes.append(
            f"{LARGE_CLUSTER} or more submissions are linked: they may share a source (a tutorial, "
            "code from the lecture); give it with --starter"
        )
    if cut:
        notes.append("more pairs are alike than are listed here")
    return notes


@dataclass(frozen=True, kw_only=True)
class Own:
    """One file without what is no one's own: `prints` and `signs` mark what is left of the text's."""

    text: Text
    prints: BoolArray
    signs: BoolArray


@dataclass(frozen=True)
class Work:
    """One submission."""

    id: str
    files: tuple[Own, ...]

    @cached_property
    def prints(self) -> Numbers:
        """Its own fingerprints, sorted, each once."""
        return distinct(file.text.prints[file.prints] for file in self.files)

    @cached_property
    def signs(self) -> int:
        """How long its own code is."""
        return sum(int(file.signs.sum()) for file in self.files)

    @cached_property
    def lines(self) -> int:
        """How many lines its own code is on."""
        return sum(len(np.unique(file.text.lines[file.signs])) for file in self.files)


def common_prints(texts: Sequence[Sequence[Text]]) -> Numbers:
    """Return the fingerprints that are in more than half of the submissions."""
    each = [distinct(text.prints for text in one) for one in texts]
    prints, counts = np.unique(np.concatenate([_NONE, *each]), return_counts=True)
    return prints[counts * 2 > len(texts)]


def own_work(name: str, texts: Sequence[Text], taken_out: Numbers) -> Work:
    """Return the submission without the fingerprints in `taken_out`, which is sorted."""
    others = [np.isin(text.prints, taken_out) for text in texts]
    files = [Own(text=t, prints=~o, signs=~mark_covered(t, o)) for t, o in zip(texts, others, strict=True)]
    return Work(name, tuple(files))


def candidates(works: Sequence[Work]) -> tuple[list[tuple[int, int]], bool]:
    """Return the pairs that share enough fingerprints for a closer look, those that share most first, and whether some
    had to be left out."""
    shared = _shared_counts(works)
    # by the smaller of both: a copy stays one if much is added to it
    sizes = np.array([max(len(work.prints), 1) for work in works])
    ratio = shared / np.minimum(sizes[:, None], sizes[None, :])
    # above the diagonal: each pair once, and none with itself
    first, second = np.nonzero(np.triu(ratio >= NEAR, 1))
    order = np.argsort(-ratio[first, second], kind="stable")
    pairs = [(int(first[i]), int(second[i])) for i in order[:CANDIDATES_MAX]]
    return pairs, len(order) > CANDIDATES_MAX


def pair(a: Work, b: Work) -> Pair:
    """Return what the two have in common."""
    here, there = _hits(a, b.prints), _hits(b, a.prints)
    return Pair(
        a=a.id,
        b=b.id,
        similarity_a=round(_size(here) / max(a.signs, 1), 4),
        similarity_b=round(_size(there) / max(b.signs, 1), 4),
        lines_a=_line_count(a, here),
        lines_b=_line_count(b, there),
        files=tuple(_file_matches(a, b)),
    )


def clusters(pairs: Sequence[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    """Return the submissions that hang together by pairs, the largest clusters first."""
    found: dict[str, set[str]] = {}
    for a, b in pairs:
        joined = found.get(a, {a}) | found.get(b, {b})
        found.update(dict.fromkeys(joined, joined))
    unique = {tuple(sorted(group)) for group in found.values()}
    return tuple(sorted(unique, key=lambda group: (-len(group), group)))


def distinct(prints: Iterable[Numbers]) -> Numbers:
    """Return all of them, sorted, each once."""
    return np.unique(np.concatenate([_NONE, *prints]))


def _shared_counts(works: Sequence[Work]) -> np.ndarray:
    """Return how many fingerprints each two share, a square. Only a strip of the whole table is in memory at a time."""
    prints = np.concatenate([_NONE, *(work.prints for work in works)])
    owners = np.repeat(np.arange(len(works)), [len(work.prints) for work in works])
    _, numbers, counts = np.unique(prints, return_inverse=True, return_counts=True)
    # what one submission alone has can be in no pair, and is most of it
    several = counts[numbers] > 1
    columns, owners = np.unique(numbers[several], return_inverse=True)[1], owners[several]
    order = np.argsort(columns, kind="stable")
    columns, owners = columns[order], owners[order]
    # float32 has fast products, and is exact up to 16 million
    shared = np.zeros((len(works), len(works)), dtype=np.float32)
    for begin in range(0, int(columns[-1]) + 1 if len(columns) else 0, MATRIX_COLUMNS):
        low, high = np.searchsorted(columns, [begin, begin + MATRIX_COLUMNS])
        strip = np.zeros((len(works), MATRIX_COLUMNS), dtype=np.float32)
        strip[owners[low:high], columns[low:high] - begin] = 1
        shared += strip @ strip.T
    return shared


def _hits(work: Work, others: Numbers) -> list[BoolArray]:
    """Return for each file which of its own signs are in the other submission too."""
    return [
        file.signs & mark_covered(file.text, file.prints & np.isin(file.text.prints, others))
        for file in work.files
    ]


def _size(hits: Sequence[BoolArray]) -> int:
    return sum(int(marks.sum()) for marks in hits)


def _line_count(work: Work, hits: Sequence[BoolArray]) -> int:
    return sum(len(np.unique(file.text.lines[marks])) for file, marks in zip(work.files, hits, strict=True))


def _file_matches(a: Work, b: Work) -> Iterator[FileMatch]:
    """Yield each file of a with the one of b that has most of it."""
    for file in a.files:
        best = max(b.files, key=lambda other: _common(file, other), default=None)
        if best is None or not _common(file, best):
            continue
        yield FileMatch(
            file_a=file.text.path,
            file_b=best.text.path,
            lines_a=_stretches(file, best),
            lines_b=_stretches(best, file),
        )


def _common(one: Own, other: Own) -> int:
    return len(np.intersect1d(one.text.prints[one.prints], other.text.prints[other.prints]))


def _stretches(one: Own, other: Own) -> Lines:
    """Return the lines of the one file that are in the other, neighbours joined."""
    hits = mark_covered(one.text, one.prints & np.isin(one.text.prints, other.text.prints[other.prints]))
    lines = np.unique(one.text.lines[one.signs & hits])
    if not len(lines):
        return ()
    filled = np.unique(one.text.lines)  # empty lines and comments between two of them do not part them
    at = np.searchsorted(filled, lines)
    parts = np.split(lines, np.flatnonzero(np.diff(at) > 1) + 1)
    return tuple((int(part[0]), int(part[-1])) for part in parts)
