"""`result.json`: schema `grader.result/1`, its keys in their fixed order."""

from __future__ import annotations

from typing import Any

from grader.model.result import GradingResult
from grader.untrusted_text import clipped, json_text, text_limit

LIMIT = 2000


def result_bytes(result: GradingResult) -> bytes:
    """Return the file's bytes, UTF-8 (see `result_text`)."""
    return result_text(result).encode()


def result_text(result: GradingResult, *, ascii_only: bool = False) -> str:
    """`notes`, `overrides`, `handed_in`, `late`, `standing` and `error` are there only where there are any.

    What a person wrote is bounded by its record and stays whole: a later grading compares it. Criteria are written as
    `judge.summary.criteria_bytes` writes them.
    """
    data: dict[str, Any] = result.model_dump(mode="json", by_alias=True)
    for name in ("notes", "overrides", "handed_in", "late", "standing", "error"):
        if not data[name]:
            del data[name]
    data = clipped(data, text_limit(len(result.criteria), LIMIT))
    for written, override in zip(data.get("overrides", ()), result.overrides, strict=False):
        written |= {"comment": override.comment, "author": override.author}
    return json_text(data, ascii_only=ascii_only)
