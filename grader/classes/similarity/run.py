"""The comparison, from outside: it runs in a process of its own that has limits and can be ended."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from pydantic import ValidationError

import grader
from grader.classes.similarity.compare import Request
from grader.errors import HostError, SubmissionError, UsageError
from grader.files import atomic_write
from grader.intake import Limits
from grader.intake.archive import unpack
from grader.model.similarity import Lines, Pair, Similarity
from grader.outside import anywhere, own_module
from grader.report.text import csv_text, json_text
from grader.temporary import temporary_folder

THRESHOLD = 0.8
INSTALL = "pip install 'ros-lab-grader[similarity]'"
TIMEOUT_S = 1800.0
SAID_CHARS = 200


def compare(
    folders: Mapping[str, Path],
    *,
    starter: Sequence[Path] = (),
    groups: Mapping[str, str] | None = None,
    threshold: float = THRESHOLD,
    jobs: int = 2,
) -> Similarity:
    """Which of these submissions are nearly the same. `folders` are their folders of results, by id.

    What is in `starter` (folders, archives, single files) is nobody's own. Two of one group (`groups` by id) are not
    named. `threshold` is the share (0 to 1) of the one's own code that is in the other, `jobs` how many are read side
    by side.

    Raises UsageError without `copydetect` and for starter code that cannot be read, HostError where the machine gives
    out.
    """
    require_library()
    with temporary_folder("source") as place:
        request = Request(
            folders={name: folder.absolute() for name, folder in folders.items()},
            starter=tuple(_unpacked(path, place / str(number)) for number, path in enumerate(starter)),
            groups=dict(groups or {}),
            threshold=threshold,
            jobs=max(1, jobs),
        )
        return _answer(request, place)


def require_library() -> None:
    """Raise UsageError where the extra is not installed."""
    if find_spec("copydetect") is None:
        raise UsageError("comparing submissions needs copydetect, which is not installed", hint=INSTALL)


def _unpacked(path: Path, into: Path) -> Path:
    """The folder that an archive becomes; folders and programs stay where they are."""
    if not path.exists():
        raise UsageError(f"--starter {path}: not found", hint="name a folder, an archive or a program")
    if path.is_dir() or path.suffix in {".py", ".cpp", ".cc", ".h", ".hpp"}:
        return path.absolute()
    try:
        unpack(path, into, Limits())
    except SubmissionError as error:
        raise UsageError(f"--starter {error.message}", hint=error.hint) from error
    except OSError as error:
        raise UsageError(f"--starter {path}: cannot be read: {error.strerror}") from error
    return into


def _answer(request: Request, place: Path) -> Similarity:
    """What the process says. It, and what it has started, end with this."""
    said = place / "said"
    with (place / "answer").open("w+b") as answer, said.open("wb") as errors:
        process = subprocess.Popen(
            own_module("grader.classes.similarity.compare"),
            env=_environment(),
            stdin=subprocess.PIPE,
            stdout=answer,
            stderr=errors,
            start_new_session=True,
        )
        try:
            process.communicate(request.model_dump_json().encode(), timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired as error:
            raise HostError(
                f"comparing took longer than {TIMEOUT_S:g} s", hint="compare fewer submissions"
            ) from error
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        answer.seek(0)
        try:
            return Similarity.model_validate_json(answer.read())
        except ValidationError as error:
            raise HostError(_failed(process.returncode, said), hint="give it more memory") from error


def _failed(code: int, said: Path) -> str:
    lines = said.read_text(errors="replace").strip().splitlines()
    reason = lines[-1][-SAID_CHARS:] if lines else f"it ended with {code}"
    return f"the submissions could not be compared: {reason}"


def _environment() -> dict[str, str]:
    """Equal texts have equal fingerprints in every run; no threads, which a process that forks must not have."""
    return {
        **anywhere(os.environ),
        "MPLBACKEND": "Agg",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONHASHSEED": "0",
        "PYTHONPATH": str(Path(grader.__file__).resolve().parent.parent),
    }


# [classes.similarity.files] `similarity.json` and `similarity.csv`, beside the class's other files.

HEAD = (
    "a", "name_a", "b", "name_b", "similarity_a_percent", "similarity_b_percent", "lines_a", "lines_b", "files"
)  # fmt: skip


def write_similarity(
    similarity: Similarity, folder: Path, names: Mapping[str, str] | None = None
) -> tuple[Path, ...]:
    """Write both files into `folder`; gives their paths. `names` are the students', by id. Raises OutputError."""
    rows = [HEAD, *_rows(similarity, names or {})]
    files = {
        "similarity.json": json_text(similarity.model_dump(mode="json", by_alias=True)),
        "similarity.csv": "\ufeff" + csv_text(rows),
    }
    for name, text in files.items():
        atomic_write(folder / name, text.encode())
    return tuple(folder / name for name in files)


def percent(share: float) -> int:
    """Never 100 where anything is missing."""
    return int(share * 100)


def stretches(lines: Lines) -> str:
    """`3-9, 12`."""
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in lines)


def _rows(similarity: Similarity, names: Mapping[str, str]) -> Iterator[tuple[str | float, ...]]:
    for pair in similarity.pairs:
        shares = (percent(pair.similarity_a), percent(pair.similarity_b))
        known = (pair.a, names.get(pair.a, ""), pair.b, names.get(pair.b, ""))
        yield (*known, *shares, pair.lines_a, pair.lines_b, _files(pair))


def _files(pair: Pair) -> str:
    return "; ".join(
        f"{match.file_a}:{stretches(match.lines_a)} ~ {match.file_b}:{stretches(match.lines_b)}"
        for match in pair.files
    )
