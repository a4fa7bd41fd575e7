"""What is said wherever students' code runs without a sandbox: one sentence, made of what a result says of it."""

from __future__ import annotations

import re

LABEL = re.compile(
    r"none \((?P<reason>.*?)\)(?P<other>, but for an unprivileged user)?(; memory held by [^;]*)?"
)
"""As `arena.sandbox.Sandbox.label` words it, and earlier graders did."""
ASKED = "--sandbox none"


def without_sandbox(label: str) -> str:
    """Of `environment.sandbox`: the sentence, or nothing where there was a sandbox, or nothing was run."""
    found = LABEL.fullmatch(label)
    if found is None:
        return ""
    if found["reason"] == ASKED:
        why = f"The sandbox is switched off ({ASKED})"
    else:
        why = f"The grading machine has no sandbox ({found['reason']})"
    who = "an unprivileged user there" if found["other"] else "the user who grades"
    return f"{why}: students' code runs with all rights of {who}."
