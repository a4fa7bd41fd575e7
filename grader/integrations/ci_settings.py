"""What a CI job grades and when it fails, read from variables, which no shell has to quote.

Among them is the pass mark that a workflow asks for: `60%`, or points.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from grader.errors import SubmissionError, UsageError
from grader.intake.names import is_package_name
from grader.integrations.ci_results import Outcome
from grader.model.sandbox_mode import SandboxMode
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.untrusted_text import line
from grader.wording import number, plural

MODES = ("auto", "require", "none")
YES, NO = {"true", "yes", "on", "1"}, {"", "false", "no", "off", "0"}
FAILING = (Outcome.BELOW, Outcome.NOT_GRADED, Outcome.INCONCLUSIVE)
NEVER = "never"
OUT = "grader-results"
COUNTERS = ("GITHUB_RUN_NUMBER", "CI_PIPELINE_IID")
"""By which GitHub numbers a workflow's runs, and GitLab a project's pipelines. To run one again is the same attempt."""
SHOWN_CHARS = 100
MARK_PATTERN = re.compile(r"(\d{1,6}(?:\.\d{1,6})?)\s*(%?)")
MARK_HINT = "write points (12.5) or a percentage of the visible points (60%)"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """`lab` is a rubric's id or file, or None if the package's name decides. `package` is the name of the package to
    grade in place of the lab's, or "". `attempt` is the number of this run by the system's count, `attempts` how many
    are graded at most; None where no limit is asked for. `fail_on` holds the outcomes that fail the job. `out` is the
    folder for the reports, `repository` the student's checkout, as the system names it."""

    lab: str | None
    path: Path
    package: str
    mark: PassMark | None
    fail_on: frozenset[Outcome]
    static: bool
    sandbox: SandboxMode
    out: Path
    repository: Path | None = None
    attempt: int | None = None
    attempts: int | None = None

    def check_attempt(self) -> None:
        """Raise SubmissionError if this is an attempt too many, UsageError if it has no number."""
        if self.attempts is None:
            return
        if self.attempt is None:
            raise UsageError(
                "attempts: this job has no number", hint=f"set one of {' and '.join(COUNTERS)}, or no limit"
            )
        if self.attempt > self.attempts:
            message = (
                f"attempt {self.attempt}, and {plural(self.attempts, 'attempt')} can be graded: nothing was"
            )
            raise SubmissionError(
                message, hint="what was graded before counts; ask your teachers for one more"
            )


def read_settings(variables: Mapping[str, str]) -> Settings:
    """Read `GRADER_LAB`, `_PATH`, `_PACKAGE`, `_PASS_MARK`, `_FAIL_ON`, `_STATIC`, `_SANDBOX`, `_ATTEMPTS` and
    `_OUT`. One that is missing or empty has its default. Raises UsageError that names the input of the action, as the
    variable is named."""

    def given(name: str) -> str:
        return variables.get(f"GRADER_{name}", "").strip()

    workspace = variables.get("GITHUB_WORKSPACE") or variables.get("CI_PROJECT_DIR")
    return Settings(
        lab=given("LAB") or None,
        path=Path(given("PATH") or "."),
        package=_package(given("PACKAGE")),
        mark=read_pass_mark(given("PASS_MARK")),
        fail_on=_fail_on(given("FAIL_ON")),
        static=_yes(given("STATIC")),
        sandbox=_sandbox(given("SANDBOX")),
        out=Path(given("OUT") or OUT),
        repository=Path(workspace) if workspace else None,
        attempt=next((int(text) for name in COUNTERS if (text := variables.get(name, "")).isdecimal()), None),
        attempts=_attempts(given("ATTEMPTS")),
    )


def _package(text: str) -> str:
    if text and not is_package_name(text):
        raise UsageError(f"package: {_quoted(text)} cannot be a package's name", hint="write its <name>")
    return text


def _attempts(text: str) -> int | None:
    if text and not re.fullmatch(r"[1-9]\d{0,5}", text):
        raise UsageError(
            f"attempts: {_quoted(text)} is not a number of attempts", hint="write 5, say, or nothing"
        )
    return int(text) if text else None


def _fail_on(text: str) -> frozenset[Outcome]:
    words = [word for word in re.split(r"[\s,]+", text.lower()) if word]
    if words == [NEVER]:
        return frozenset()
    known = {outcome.value: outcome for outcome in FAILING}
    unknown = [word for word in words if word not in known]
    if unknown:
        raise UsageError(
            f"fail-on: {_quoted(unknown[0])} is not an outcome",
            hint=f"name any of {', '.join(known)}, or {NEVER} alone",
        )
    return frozenset(known[word] for word in words) or frozenset(FAILING)


def _yes(text: str) -> bool:
    if text.lower() in YES | NO:
        return text.lower() in YES
    raise UsageError(f"static: {_quoted(text)} is neither true nor false", hint="write true or false")


def _sandbox(text: str) -> SandboxMode:
    if (text or "auto") not in MODES:
        raise UsageError(f"sandbox: {_quoted(text)} is not a mode", hint=f"write {', '.join(MODES)}")
    return cast("SandboxMode", text or "auto")


def _quoted(text: str) -> str:
    return f'"{line(text, SHOWN_CHARS)}"'


@dataclass(frozen=True, kw_only=True)
class PassMark:
    """`value` is a percentage of the points of the visible criteria, or a number of these points."""

    value: float
    percent: bool


def read_pass_mark(text: str) -> PassMark | None:
    """Parse a pass mark; None for an empty text. Raises UsageError."""
    if not text:
        return None
    found = MARK_PATTERN.fullmatch(text)
    if found is None:
        raise UsageError(f'pass-mark: "{line(text, SHOWN_CHARS)}" is not a mark', hint=MARK_HINT)
    mark = PassMark(value=float(found[1]), percent=bool(found[2]))
    if not mark.percent and 0 < mark.value < 1:  # 0.6 is more likely to be meant as 60%
        raise UsageError(f"pass-mark: {found[1]} is less than a point", hint=MARK_HINT)
    if mark.percent and mark.value > 100:
        raise UsageError(f"pass-mark: {number(mark.value)}% is more than 100%", hint=MARK_HINT)
    return mark


def visible_points(rubric: Rubric) -> float:
    """Return the points that students can see they may get."""
    return sum(c.points for c in rubric.criteria if c.visibility == "visible")


def with_pass_mark(loaded: LoadedRubric, mark: PassMark | None) -> LoadedRubric:
    """Return the rubric with that pass mark, scaled from the visible points to all points.

    Raises UsageError for more points than there are.
    """
    if mark is None:
        return loaded
    rubric, most = loaded.rubric, visible_points(loaded.rubric)
    if not mark.percent and mark.value > most:
        raise UsageError(
            f"pass-mark: {number(mark.value)} points, but {rubric.id} has {number(most)} visible ones",
            hint=MARK_HINT,
        )
    share = mark.value / (100 if mark.percent else most or 1)
    return loaded.model_copy(
        update={"rubric": rubric.model_copy(update={"pass_mark": share * rubric.max_points})}
    )
