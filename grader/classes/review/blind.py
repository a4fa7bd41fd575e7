"""Marking without names: what submissions are called, and what is taken out of their texts."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import ValidationError

from grader.model.batch import Entry
from grader.model.record import Record
from grader.model.result import GradingResult, SubmissionInfo
from grader.report.class_page.submissions import LEFT_OUT, WORDS, order, words_in

HASH_CHARS = (7, 8, 10, 12)
KEPT = frozenset(
    {
        *("check", "criterion", "digest", "id", "kind", "scenario", "schema", "status", "rubric"),
        *("at", "before", "date", "deadline"),
    }
)
"""Keys whose values are the rubric's or the grader's own words, or times."""
_ADDRESS = re.compile(
    r"[\w.+-]{1,100}@[\w-]{1,100}(?:\.[\w-]{1,60}){0,6}(?::\S{1,200})?|\b(?:https?|ssh|git)://\S{1,300}"
)
T = TypeVar("T", bound=Record)


def aliases(ids: Sequence[str], salt: bytes) -> dict[str, str]:
    """Return what each submission is called in addresses, by its id, in an order that depends on `salt` alone."""
    return {ids[place]: f"submission-{number}" for number, place in enumerate(order(ids, salt), start=1)}


@dataclass(frozen=True)
class Mask:
    """Takes `words`, mail addresses and repositories out of texts."""

    words: frozenset[str]

    def text(self, text: str) -> str:
        """Return the text with `…` for each of them."""
        found = _ADDRESS.sub(LEFT_OUT, text)
        return WORDS.sub(lambda word: LEFT_OUT if word[0].casefold() in self.words else word[0], found)

    def record(self, record: T) -> T | None:
        """Return the record with all its texts so; None where nothing sound is left of it."""
        data = self._data(record.model_dump(mode="json", by_alias=True))
        try:
            return type(record).model_validate_json(json.dumps(data))
        except ValidationError:
            return None

    def result(self, result: GradingResult, title: str) -> GradingResult | None:
        """Return the result under another name."""
        package = result.submission.package
        info = SubmissionInfo(id=title, source="", commit=None, digest="", package=self.text(package))
        return self.record(result.model_copy(update={"submission": info}))

    def _data(self, data: Any) -> Any:  # noqa: ANN401 - JSON
        if isinstance(data, str):
            return self.text(data)
        if isinstance(data, Mapping):
            return {key: value if key in KEPT else self._data(value) for key, value in data.items()}
        return [self._data(item) for item in data] if isinstance(data, list) else data


def mask_of(entry: Entry, commit: str, common: frozenset[str]) -> Mask:
    """Return the mask of one submission: words of its id, name and commit, and of its source those that are not
    `common` to the class."""
    hashes = [commit[:chars] for chars in HASH_CHARS]
    own = frozenset(words_in(entry.id, entry.name, commit, *hashes))
    return Mask(own | (frozenset(words_in(entry.source, entry.ref or "")) - common))
