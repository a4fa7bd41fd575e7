"""What `grader similar` compares and prints: submissions that are nearly the same, for a person to look at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from grader.classes.batch.folder import RUN, open_batch
from grader.classes.similarity.comparison import percent, stretches
from grader.classes.similarity.sources import PLACE
from grader.errors import GraderError, UsageError
from grader.model.batch import NotCompared, Pair, Similarity
from grader.report.terminal import emit, open_console
from grader.report.text import line
from grader.rubric.load import load_rubric
from grader.wording import first_few

NAME_CHARS = 22
PATH_CHARS = 40
TEXT_CHARS = 300
PAIRS_SHOWN = 50
IDS_SHOWN = 20
HARMLESS = "For a person to look at: no mark depends on it, and similarity alone proves nothing."


def print_similarity(
    similarity: Similarity, names: Mapping[str, str], written: Sequence[Path], stream: IO[str]
) -> None:
    """Print the pairs that are alike, and the files that were `written`."""
    console = open_console(stream)
    emit(console, _report(similarity, names))
    emit(console, [Text(f"Written: {line(str(path), TEXT_CHARS)}") for path in written])


def submissions_in(folder: Path) -> tuple[dict[str, Path], dict[str, str], dict[str, str]]:
    """Return the folders, names and groups of submissions by id: the batch's, or every folder with evidence in it."""
    if (folder / RUN).exists():
        batch = open_batch(folder)
        entries = batch.run.entries
        folders = {entry.id: batch.folder_of(entry) for entry in entries}
        return folders, {e.id: e.name for e in entries}, {e.id: e.group for e in entries}
    try:
        below = sorted(path for path in folder.iterdir() if path.joinpath(*PLACE).is_file())
    except OSError as error:
        raise UsageError(f"{folder}: {error.strerror}", hint="give the --out of `grader batch`") from error
    if not below:
        raise UsageError(
            f"{folder} contains no submissions with evidence", hint="give the --out of `grader batch`"
        )
    return {path.name: path for path in below}, {}, {}


def starter_of(folder: Path) -> list[Path]:
    """Return the folder of the starter that the batch's rubric names, as far as the rubric is still there."""
    with suppress(GraderError):
        if (folder / RUN).exists():
            rubric = load_rubric(open_batch(folder).run.rubric_source)
            return [rubric.path.parent / rubric.rubric.starter] if rubric.rubric.starter else []
    return []


def _report(similarity: Similarity, names: Mapping[str, str]) -> Iterator[RenderableType]:
    count = len(similarity.pairs)
    what = "1 pair is" if count == 1 else f"{count or 'no'} pairs are"
    yield Text(f"{similarity.compared} submissions compared, {what} nearly the same.")
    yield Text(HARMLESS)
    if similarity.pairs:
        yield _table(similarity, names)
    yield from map(Text, _tail(similarity))


def _table(similarity: Similarity, names: Mapping[str, str]) -> Padding:
    """Each pair on two lines and more: how alike, then where."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in ("share", "lines", "submission", "where"):
        table.add_column(Text(name), justify="right" if name in {"share", "lines"} else "left", no_wrap=False)
    for pair in similarity.pairs[:PAIRS_SHOWN]:
        for row in _rows(pair, names):
            table.add_row(*(Text(cell) for cell in row))
        table.add_row()
    return Padding(table, (1, 0, 0, 0))


def _rows(pair: Pair, names: Mapping[str, str]) -> Iterator[tuple[str, str, str, str]]:
    """The one, then the other."""
    for name, share, lines, where in (
        (pair.a, pair.similarity_a, pair.lines_a, [(m.file_a, m.lines_a) for m in pair.files]),
        (pair.b, pair.similarity_b, pair.lines_b, [(m.file_b, m.lines_b) for m in pair.files]),
    ):
        places = [f"{line(path, PATH_CHARS)}:{stretches(found)}" for path, found in where if found]
        shown = names.get(name) or name
        yield f"{percent(share)} %", str(lines), line(shown, NAME_CHARS), "\n".join(dict.fromkeys(places))


def _tail(similarity: Similarity) -> Iterator[str]:
    if len(similarity.pairs) > PAIRS_SHOWN:
        yield f"{len(similarity.pairs) - PAIRS_SHOWN} more pairs are in the files below."
    for group in similarity.clusters:
        if len(group) > 2:
            names = first_few([line(name, NAME_CHARS) for name in group], IDS_SHOWN)
            yield f"{len(group)} belong together: {names}"
    if similarity.same_group:
        count = similarity.same_group
        yield (
            "1 pair within a group is not listed."
            if count == 1
            else f"{count} pairs within a group are not listed."
        )
    if similarity.too_little:
        count, total = len(similarity.too_little), similarity.compared
        yield (
            f"{count} of {total} have fewer than {similarity.min_lines} lines of their own besides the starter code, "
            f"the tutorials and what most share: too few to compare."
        )
    for one in similarity.not_compared[:IDS_SHOWN]:
        yield f"Not compared: {_not_compared(one)}"
    if len(similarity.not_compared) > IDS_SHOWN:
        yield f"Not compared: {len(similarity.not_compared) - IDS_SHOWN} more"
    yield from (f"Note: {note}" for note in similarity.notes)


def _not_compared(one: NotCompared) -> str:
    place = line(f"{one.id}: {one.file}" if one.file else one.id, TEXT_CHARS)
    return f"{place}: {line(one.reason, TEXT_CHARS)}"
