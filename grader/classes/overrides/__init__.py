"""`overrides.yaml`: what people decided about criteria, read here and edited in `write`.

Comments that are used again and again are in `comments.yaml`. An override names them by id, and is put into words and
points when it is read: a change there changes it everywhere.

All faults are reported at once, as `file:line: submission.criterion: what is wrong`.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from grader.errors import RubricError
from grader.intake.names import folder_key
from grader.model.result import COMMENT_CHARS, BankComment, CommentId, Override, WrittenOverride
from grader.model.version import COMMENTS, OVERRIDES
from grader.rubric.fault_words import model_faults, shown
from grader.rubric.load import refuse_newer
from grader.rubric.model import Criterion, Rubric
from grader.rubric.yaml_lines import Fault, Form, Source, as_map, read_bytes, read_source, source_of
from grader.wording import did_you_mean

FILE = "overrides.yaml"
SCHEMA_KEY, SCHEMA = "schema", str(OVERRIDES)
FORM = Form(
    what="an overrides file",
    usual="the overrides of a class are far smaller",
    bytes_max=20_000_000,
    nodes_max=300_000,
    times=frozenset({"date"}),
    written_keys=True,
    may_be_empty=True,
)
HINT = "each is `submission: {criterion: {points: 7, comment: …, author: …, date: 2026-11-02}}`"
Overrides: TypeAlias = Mapping[str, Mapping[str, Override]]
"""By the submission's id as the roster has it, then by criterion."""


Written: TypeAlias = Mapping[str, Mapping[str, WrittenOverride]]
"""The same as the file has it."""


def read_overrides(path: Path, rubric: Rubric, ids: Collection[str]) -> Overrides:
    """Return what people decided about the submissions of these ids; nothing where there is no such file.

    In the file a submission may go by its id, or by the name of its folder of results. Comments that it names are those
    of `comments.yaml` beside it. Raises RubricError with every fault.
    """
    bank = read_bank(path.with_name(COMMENTS_FILE), rubric)
    return resolve_all(read_written(path, rubric, ids, bank), rubric, bank)


def resolve_all(written: Written, rubric: Rubric, bank: Bank) -> Overrides:
    """Return what all of them come to."""
    criteria = {criterion.id: criterion for criterion in rubric.criteria}
    return {
        name: {of: resolve(one, criteria[of], bank) for of, one in found.items()}
        for name, found in written.items()
    }


def read_written(path: Path, rubric: Rubric, ids: Collection[str], bank: Bank) -> Written:
    """Return what the file has. Raises RubricError as `read_overrides` does."""
    if not os.path.lexists(path):
        return {}
    source = parse(read_bytes(path, str(path), FORM), str(path))
    refuse_newer(source, OVERRIDES)
    reading = _Reading(source, rubric, ids, bank)
    reading.read()
    if reading.faults:
        # a submission that stands there twice brings each fault twice
        raise RubricError(source.in_order(reading.faults), hint=HINT)
    return reading.found


def parse(raw: bytes, name: str) -> Source:
    """Return the data of such a file, called `name`. Raises RubricError. The last two are kept: writers read again."""
    try:
        return replace(_parse(raw), name=name)
    except RubricError:
        return source_of(raw, name, FORM)  # raises it with that name


@lru_cache(maxsize=2)
def _parse(raw: bytes) -> Source:
    return source_of(raw, FILE, FORM)


class _Reading:
    """Goes through the file, and collects what is sound in `found` and the rest in `faults`."""

    def __init__(self, source: Source, rubric: Rubric, ids: Collection[str], bank: Bank) -> None:
        self._source, self._bank = source, bank
        self._points = {c.id: bounds(c) for c in rubric.criteria}
        self._ids = {folder_key(name): name for name in ids}
        self.found: dict[str, dict[str, WrittenOverride]] = {}
        self.faults: list[Fault] = list(source.faults)

    def read(self) -> None:
        data = self._source.data
        if not isinstance(data, dict):
            self.faults.append(((), f"must be a map from submissions to criteria, not {shown(data)}"))
            return
        first: dict[str, str] = {}
        for key, value in data.items():
            if key == SCHEMA_KEY:
                if value != SCHEMA:
                    self.faults.append(((SCHEMA_KEY,), f'must be "{SCHEMA}", not {shown(value)}'))
                continue
            name = self._ids.get(folder_key(key))
            if name is None:
                near = did_you_mean(key, self._ids.values()) or did_you_mean(folder_key(key), self._ids)
                self.faults.append(((key,), f'there is no submission "{key}"{near}'))
            elif first.setdefault(name, key) != key:
                line = self._source.line((first[name],))
                self.faults.append(((key,), f"is the submission on line {line} already, {first[name]}"))
            self._submission(key, value, name)

    def _submission(self, key: str, value: object, name: str | None) -> None:
        if value is not None and not isinstance(value, dict):
            self.faults.append(((key,), f"must be a map from criteria to points, not {shown(value)}"))
        for criterion, given in as_map(value).items():
            faults = self._faults(key, criterion, given)
            self.faults += faults
            if not faults and name is not None:
                override = WrittenOverride.from_data(_without_empty(given))
                self.found.setdefault(name, {})[criterion] = override

    def _faults(self, key: str, criterion: str, given: object) -> list[Fault]:
        path = (key, criterion)
        comments = as_map(given).get("comments")
        found = model_faults(WrittenOverride, _without_empty(given), path)
        if isinstance(given, dict) and given.get("points") is None and not comments:
            if "points" in given:
                found.append(((*path, "points"), "must be a number, not empty"))
            elif not given.get("comment") and not given.get("answer"):
                found.append(((*path, "points"), "is missing"))
        if criterion not in self._points:
            near = did_you_mean(criterion, self._points)
            return [(path, f'there is no criterion "{criterion}"{near}'), *found]
        known = self._bank.get(criterion, {})
        for name in comments if isinstance(comments, list) else ():
            if isinstance(name, str) and name not in known:
                near = did_you_mean(name, known)
                found.append(
                    ((*path, "comments"), f'there is no comment "{name}" of it in {COMMENTS_FILE}{near}')
                )
        points, (least, most) = as_map(given).get("points"), self._points[criterion]
        if isinstance(points, int | float) and not isinstance(points, bool):
            if points > most:
                found.append(((*path, "points"), f"{points:g} is more than the criterion has: {most:g}"))
            if points < least:
                # before what the model says of a negative number
                found.insert(0, ((*path, "points"), f"must be at least {least:g}, not {points:g}"))
        return found


def _without_empty(value: object) -> object:
    """Return the value without what was left empty, as in a form that someone has begun to fill in."""
    if not isinstance(value, dict):
        return value
    return {
        key: item
        for key, item in value.items()
        if item is not None
        or key not in {"comment", "author", "date", "comments", "answer", "answered", "together"}
    }


COMMENTS_FILE = "comments.yaml"
COMMENTS_SCHEMA = str(COMMENTS)
COMMENTS_FORM = Form(
    what="a file of comments",
    usual="the comments of a lab are far smaller",
    bytes_max=2_000_000,
    nodes_max=50_000,
    written_keys=True,
    may_be_empty=True,
)
COMMENTS_HINT = "each is `criterion: {id: {text: …, points: 7}}`, or `change: -2` in place of `points`"
Bank: TypeAlias = Mapping[str, Mapping[CommentId, BankComment]]
"""By criterion, then by the comment's id."""


def read_bank(path: Path, rubric: Rubric) -> Bank:
    """Return the comments; none where there is no such file. Raises RubricError with every fault."""
    if not os.path.lexists(path):
        return {}
    source = read_source(path, str(path), COMMENTS_FORM)
    refuse_newer(source, COMMENTS)
    faults = [*source.faults, *_bank_faults(source, {c.id: c for c in rubric.criteria})]
    if faults:
        raise RubricError([source.fault(*fault) for fault in faults], hint=COMMENTS_HINT)
    return {
        criterion: {name: BankComment.model_validate(one, strict=True) for name, one in as_map(found).items()}
        for criterion, found in as_map(source.data).items()
        if criterion != "schema"
    }


def _bank_faults(source: Source, criteria: Mapping[str, Criterion]) -> Iterator[Fault]:
    if not isinstance(source.data, dict):
        yield (), f"must be a map from criteria to comments, not {shown(source.data)}"
        return
    for criterion, found in source.data.items():
        if criterion == "schema":
            if found != COMMENTS_SCHEMA:
                yield ("schema",), f'must be "{COMMENTS_SCHEMA}", not {shown(found)}'
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
    the criterion's own; the changes of all its comments are added. Where no comment says anything of points, there are
    none: the check's verdict counts."""
    known = bank.get(criterion.id, {})
    used = [known[name] for name in written.comments if name in known]
    least, most = bounds(criterion)
    points = written.points
    if points is None and any((one.points, one.change) != (None, None) for one in used):
        whole = [one.points for one in used if one.points is not None]
        points = (whole[-1] if whole else criterion.points) + sum(one.change or 0.0 for one in used)
    texts = [*(one.text for one in used), *([written.comment] if written.comment else [])]
    # the changes of several comments may add up to more than there is, or to less than nothing
    fields = written.model_dump() | {"points": None if points is None else min(most, max(least, points))}
    return Override(**fields | {"comment": "\n".join(texts)[:COMMENT_CHARS]})
