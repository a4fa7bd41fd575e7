"""`comments.yaml`: comments that are used again and again, and what an override with some of them comes to.

An override names them by id, and is put into words and points when it is read: a change here changes it everywhere.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

from grader.errors import RubricError
from grader.model.result import COMMENT_CHARS, BankComment, CommentId, Override, WrittenOverride
from grader.model.version import COMMENTS
from grader.rubric.faults import model_faults, shown
from grader.rubric.load import refuse_newer
from grader.rubric.model import Criterion, Rubric
from grader.rubric.source import Fault, Form, Source, as_map, read_source
from grader.wording import did_you_mean

FILE = "comments.yaml"
SCHEMA_KEY, SCHEMA = "schema", str(COMMENTS)
FORM = Form(
    what="a file of comments",
    usual="the comments of a lab are far less",
    bytes_max=2_000_000,
    nodes_max=50_000,
    written_keys=True,
    may_be_empty=True,
)
HINT = "each is `criterion: {id: {text: …, points: 7}}`, or `change: -2` in place of `points`"
Bank: TypeAlias = Mapping[str, Mapping[CommentId, BankComment]]
"""By criterion, then by the comment's id."""


def read_bank(path: Path, rubric: Rubric) -> Bank:
    """Return the comments; none where there is no such file. Raises RubricError with every fault."""
    if not os.path.lexists(path):
        return {}
    source = read_source(path, str(path), FORM)
    refuse_newer(source, COMMENTS)
    faults = [*source.faults, *_faults(source, {c.id: c for c in rubric.criteria})]
    if faults:
        raise RubricError([source.fault(*fault) for fault in faults], hint=HINT)
    return {
        criterion: {name: BankComment.model_validate(one, strict=True) for name, one in as_map(found).items()}
        for criterion, found in as_map(source.data).items()
        if criterion != SCHEMA_KEY
    }


def _faults(source: Source, criteria: Mapping[str, Criterion]) -> Iterator[Fault]:
    if not isinstance(source.data, dict):
        yield (), f"must be a map from criteria to comments, not {shown(source.data)}"
        return
    for criterion, found in source.data.items():
        if criterion == SCHEMA_KEY:
            if found != SCHEMA:
                yield (SCHEMA_KEY,), f'must be "{SCHEMA}", not {shown(found)}'
        elif criterion not in criteria:
            yield (criterion,), f'there is no criterion "{criterion}"{did_you_mean(criterion, criteria)}'
        else:
            for name, one in as_map(found).items():
                yield from _comment_faults((criterion, name), one, criteria[criterion])


def _comment_faults(path: tuple[str, str], given: object, criterion: Criterion) -> Iterator[Fault]:
    yield from model_faults(WrittenOverride, {"comments": [path[1]]}, path)
    yield from model_faults(BankComment, given, path)
    points, (least, most) = as_map(given).get("points"), bounds(criterion)
    if points is not None and as_map(given).get("change") is not None:
        yield path, "has points and a change: give one of them"
    elif isinstance(points, int | float) and not least <= points <= most:
        yield (*path, "points"), f"must be from {least:g} to {most:g}, not {points:g}"


def bounds(criterion: Criterion) -> tuple[float, float]:
    """Return the fewest and the most points that a person can give."""
    return min(0.0, criterion.extra), criterion.points + max(0.0, criterion.extra)


def resolve(written: WrittenOverride, criterion: Criterion, bank: Bank) -> Override:
    """Return what an override comes to. Points that it does not have are those of its last comment with points, else
    the criterion's own; the changes of all its comments are added."""
    known = bank.get(criterion.id, {})
    used = [known[name] for name in written.comments if name in known]
    least, most = bounds(criterion)
    points = written.points
    if points is None:
        whole = [one.points for one in used if one.points is not None]
        points = (whole[-1] if whole else criterion.points) + sum(one.change or 0.0 for one in used)
    texts = [*(one.text for one in used), *([written.comment] if written.comment else [])]
    fields = written.model_dump() | {"points": min(most, max(least, points))}
    return Override(**fields | {"comment": "\n".join(texts)[:COMMENT_CHARS]})
