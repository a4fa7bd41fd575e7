"""`result.json`: schema `grader.result/1`, its keys in their fixed order."""

from __future__ import annotations

import json
from typing import Any

from grader.model.result import GradingResult


def result_bytes(result: GradingResult) -> bytes:
    """The file's bytes, UTF-8. `error` is there only where there is one; whole points are whole numbers."""
    data: dict[str, Any] = result.model_dump(mode="json", by_alias=True)
    if data["error"] is None:
        del data["error"]
    for record in (data, *data["criteria"]):
        record["points"], record["max_points"] = _plain(record["points"]), _plain(record["max_points"])
    return (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _plain(value: float) -> float:
    return int(value) if float(value).is_integer() else value
