"""`result.json`: schema `grader.result/1`, its keys in their fixed order."""

from __future__ import annotations

import json
from typing import Any

from grader.model.result import GradingResult


def result_bytes(result: GradingResult) -> bytes:
    """The file's bytes, UTF-8. `error` is there only where there is one.

    Numbers and text are written as `judge.summary.criteria_bytes` writes them.
    """
    data: dict[str, Any] = result.model_dump(mode="json", by_alias=True)
    if data["error"] is None:
        del data["error"]
    return (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
