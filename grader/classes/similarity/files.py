"""`similarity.json` and `similarity.csv`, beside the class's other files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from grader.files import atomic_write
from grader.model.similarity import Lines, Pair, Similarity
from grader.report.text import csv_text, json_text

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
