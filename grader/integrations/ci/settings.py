"""What to grade, and when a job fails: read from variables, since no shell has to quote these."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from grader.errors import UsageError
from grader.integrations.ci.outcome import Outcome
from grader.integrations.ci.pass_mark import Mark, read_mark
from grader.model.submission import SandboxMode
from grader.untrusted_text import line

MODES = ("auto", "require", "none")
YES, NO = {"true", "yes", "on", "1"}, {"", "false", "no", "off", "0"}
FAILING = (Outcome.BELOW, Outcome.NOT_GRADED, Outcome.INCONCLUSIVE)
NEVER = "never"
OUT = "grader-results"
SHOWN_CHARS = 100


@dataclass(frozen=True, kw_only=True)
class Settings:
    """`lab` is a rubric's id or file, None where the package's name chooses it. `fail_on` has the outcomes with which
    the job fails. `out` is the folder that the results go to."""

    lab: str | None
    path: Path
    mark: Mark | None
    fail_on: frozenset[Outcome]
    static: bool
    sandbox: SandboxMode
    out: Path


def read_settings(variables: Mapping[str, str]) -> Settings:
    """`GRADER_LAB`, `_PATH`, `_PASS_MARK`, `_FAIL_ON`, `_STATIC`, `_SANDBOX` and `_OUT`; one that is missing or empty
    says nothing. Raises UsageError that names the variable, and the action's input of that name."""

    def given(name: str) -> str:
        return variables.get(f"GRADER_{name}", "").strip()

    return Settings(
        lab=given("LAB") or None,
        path=Path(given("PATH") or "."),
        mark=read_mark(given("PASS_MARK")),
        fail_on=_fail_on(given("FAIL_ON")),
        static=_yes(given("STATIC")),
        sandbox=_sandbox(given("SANDBOX")),
        out=Path(given("OUT") or OUT),
    )


def _fail_on(text: str) -> frozenset[Outcome]:
    words = [word for word in re.split(r"[\s,]+", text.lower()) if word]
    if words == [NEVER]:
        return frozenset()
    known = {outcome.value: outcome for outcome in FAILING}
    unknown = [word for word in words if word not in known]
    if unknown:
        raise UsageError(
            f"fail-on: {_quoted(unknown[0])} is no outcome",
            hint=f"name any of {', '.join(known)}, or {NEVER} alone",
        )
    return frozenset(known[word] for word in words) or frozenset(FAILING)


def _yes(text: str) -> bool:
    if text.lower() in YES | NO:
        return text.lower() in YES
    raise UsageError(f"static: {_quoted(text)} is neither true nor false", hint="write true or false")


def _sandbox(text: str) -> SandboxMode:
    if (text or "auto") not in MODES:
        raise UsageError(f"sandbox: {_quoted(text)} is none", hint=f"write {', '.join(MODES)}")
    return cast("SandboxMode", text or "auto")


def _quoted(text: str) -> str:
    return f'"{line(text, SHOWN_CHARS)}"'
