"""What GitHub Classroom's autograding reporter makes of a grader's result, step by step as it does."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass

ENVIRONMENT_BYTES_MAX = 128 * 1024  # of one variable: Linux' MAX_ARG_STRLEN


@dataclass(frozen=True, kw_only=True)
class Reported:
    """`points` and `of` are what Classroom is told, None where it is told nothing; `console` what the log shows."""

    points: float | None
    of: float | None
    failed: str
    console: str
    tests: tuple[dict, ...]


def reporter(encoded: str) -> Reported:
    """Read one grader's `result`, as the reporter reads `<RUNNER>_RESULTS`."""
    encoded = encoded.removesuffix("\n")
    assert len(f"LAB_RESULTS={encoded}") < ENVIRONMENT_BYTES_MAX
    results = json.loads(base64.b64decode(encoded, validate=True).decode("utf-8"))
    assert results["version"] == 1
    assert results["status"] in {"pass", "fail", "error"}
    assert results["tests"], "the reporter divides by their number"
    points = 0.0
    for test in results["tests"]:
        assert set(test) >= {"name", "status", "score", "message", "test_code", "filename", "line_no"}
        points += test["score"]
    told = bool(results["max_score"])
    said = {"fail": "Some tests failed.", "error": "Some tests errored."}
    return Reported(
        points=points if told else None,
        of=results["max_score"] if told else None,
        failed=said.get(results["status"], ""),
        console="\n".join(line for test in results["tests"] for line in _printed(test)),
        tests=tuple(results["tests"]),
    )


def _printed(test: dict) -> list[str]:
    if test["status"] == "error":
        shown = [f"Error: {test['message'] or test['name']}"]
    else:
        mark = "✅" if test["status"] == "pass" else "❌"
        place = f" - line {test['line_no']}" if test["line_no"] != 0 else ""
        shown = [f"{mark} {test['name']}{place}"]
    return [*shown, *([f"Test code:\n{test['test_code']}\n"] if test["test_code"] else [])]
