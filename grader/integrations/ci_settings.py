"""What to grade, and when a job fails: read from variables, since no shell has to quote these."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast
from grader.errors import UsageError
from grader.integrations.ci_results import Outcome
from grader.shown import line
from grader.report.text import number
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric


Mode = Literal["auto", "require", "none"]
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
    sandbox: Mode
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


def _sandbox(text: str) -> Mode:
    if (text or "auto") not in MODES:
        raise UsageError(f"sandbox: {_quoted(text)} is none", hint=f"write {', '.join(MODES)}")
    return cast("Mode", text or "auto")


def _quoted(text: str) -> str:
    return f'"{line(text, SHOWN_CHARS)}"'


# [integrations.ci.pass_mark] The pass mark that a workflow asks for: `60%`, or points.

FORM = re.compile(r"(\d{1,6}(?:\.\d{1,6})?)\s*(%?)")
HINT = "write points (12.5) or a percentage of the visible points (60%)"
SHOWN_CHARS_pass_mark = 100


@dataclass(frozen=True, kw_only=True)
class Mark:
    """`value` in percent of the points of the visible criteria, or in these points themselves."""

    value: float
    percent: bool


def read_mark(text: str) -> Mark | None:
    """None for an empty text. Raises UsageError."""
    if not text:
        return None
    found = FORM.fullmatch(text)
    if found is None:
        raise UsageError(f'pass-mark: "{line(text, SHOWN_CHARS_pass_mark)}" is no mark', hint=HINT)
    mark = Mark(value=float(found[1]), percent=bool(found[2]))
    if not mark.percent and 0 < mark.value < 1:  # 0.6 is more likely to be meant as 60%
        raise UsageError(f"pass-mark: {found[1]} is less than a point", hint=HINT)
    if mark.percent and mark.value > 100:
        raise UsageError(f"pass-mark: {number(mark.value)}% is more than 100%", hint=HINT)
    return mark


def visible_points(rubric: Rubric) -> float:
    """What a student can see to be reached."""
    return sum(c.points for c in rubric.criteria if c.visibility == "visible")


def with_mark(loaded: LoadedRubric, mark: Mark | None) -> LoadedRubric:
    """The rubric with that mark in place of its own, as large a part of all its points as it is of the visible ones.

    Raises UsageError for more points than can be reached.
    """
    if mark is None:
        return loaded
    rubric, most = loaded.rubric, visible_points(loaded.rubric)
    if not mark.percent and mark.value > most:
        raise UsageError(
            f"pass-mark: {number(mark.value)} points, but {rubric.id} has {number(most)} visible ones",
            hint=HINT,
        )
    share = mark.value / (100 if mark.percent else most or 1)
    return loaded.model_copy(
        update={"rubric": rubric.model_copy(update={"pass_mark": share * rubric.max_points})}
    )


def needed_words(rubric: Rubric, points: float) -> str:
    """What passing takes, of that many points that are counted."""
    if rubric.pass_mark is None:
        return "to pass, every visible criterion has to be reached"
    needed = rubric.pass_mark * points / (rubric.max_points or 1)
    return f"to pass, it takes {number(needed)}"
