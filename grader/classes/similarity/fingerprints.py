"""A file's code as fingerprints, as `copydetect` makes them: without names, texts, comments and layout.

Each submission is read in a worker process with little memory and little time: what a file does to the process costs
its own submission the comparison, and no other.
"""

from __future__ import annotations

import re
import signal
from base64 import b64decode, b64encode
from dataclasses import dataclass
from functools import cache
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

from grader.classes.similarity.sources import Language, ProgramText, read_starter, read_submission
from grader.errors import GraderError
from grader.model.batch import NotCompared
from grader.workers import WorkerEnded, WorkerLimits

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
    return leave_out(place, reason)


def reading_ended(place: CodeSource, _: WorkerEnded) -> Fingerprints:
    """Return what there is of a place whose worker ended."""
    return leave_out(place, "reading it took too long or too much memory")


def leave_out(place: CodeSource, reason: str) -> Fingerprints:
    """Return that nothing of the place is compared."""
    return Fingerprints(place=place, left_out=(NotCompared(id=place.name, reason=reason),))


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
    """Regular expressions look out for signals, so that even one without end is interrupted."""
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
