"""Jobs of GitHub Actions and GitLab CI: what they ask for, in variables, and how they are told what came of it; how a
grading in one ended, and the folder of reports that is kept.

GitHub gets annotations, the step's summary and outputs. Values go into files, each between lines that cannot be
guessed; while anything of a student's may be printed, the runner is told to ignore commands. For GitLab the reports are
files that `ci/gitlab.yml` names; later jobs get the points as variables.

A new system needs a class with the methods of `GitHubRunner` and an entry in `RUNNERS`, its name in `grader ci`
(`cli/commands/integrations.py`), its job number in `COUNTERS`, a file in `ci/` and a guide.
"""

from __future__ import annotations

import re
import secrets
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import cast

from grader.errors import ExitCode, GraderError, OutputError, SubmissionError, UsageError
from grader.files import atomic_write, make_folder
from grader.intake.names import is_package_name
from grader.judging.summary import scaled_pass_mark
from grader.model import SandboxMode
from grader.model.result import GradingResult
from grader.report.findings import EACH_MAX, Severity, github_annotation, render_annotations
from grader.report.forms import FORMS, ReportInput
from grader.report.losses import arrange
from grader.report.markdown import render_markdown
from grader.report.platform_results import render_classroom
from grader.report.sentences import RUBRIC_FROM
from grader.report.text import line, markdown
from grader.report.view import hidden_ids, is_students_fault
from grader.results import EVIDENCE, RESULT
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.wording import number, plural


class JobStatus(str, Enum):
    """The values of the output `status` and of the input `fail-on`, which later steps compare."""

    PASSED = "passed"
    BELOW = "below-pass-mark"
    INCONCLUSIVE = "inconclusive"
    NOT_GRADED = "not-graded"
    WRONG_INPUT = "wrong-input"


OF_CODE = {
    ExitCode.PASSED: JobStatus.PASSED,
    ExitCode.BELOW_PASS_MARK: JobStatus.BELOW,
    ExitCode.USAGE: JobStatus.WRONG_INPUT,
    ExitCode.NOT_GRADED: JobStatus.NOT_GRADED,
    ExitCode.INCONCLUSIVE: JobStatus.INCONCLUSIVE,
}
TITLES = {
    JobStatus.PASSED: "Passed",
    JobStatus.BELOW: "Below the pass mark",
    JobStatus.INCONCLUSIVE: "Not decided yet",
    JobStatus.NOT_GRADED: "Not graded",
    JobStatus.WRONG_INPUT: "Wrong input",
}
LET_IT_RUN = "without `static` (GRADER_STATIC: true), the job runs the nodes"
NO_MARK_LOST = "this is not the submission's fault, and this costs no marks"
WITH_LINES = ("junit", "code-quality", "sarif")
"""Forms that are rendered once more, or only here, with files as the repository has them."""
REPORT_NAMES = frozenset(
    {
        "console.log", EVIDENCE, "grader.env", RESULT, *(FORMS[name].file for name in WITH_LINES),
        *(form.file for form in FORMS.values() if form.in_results),
    }
)  # fmt: skip
SECTION = "== "


@dataclass(frozen=True, kw_only=True)
class JobResult:
    """A result without its hidden criteria. `fails` is whether the job fails.

    `message` and `hint` are a line each about the outcome. `counted` holds the criteria that were asked for, which may
    be only those of the files. `folder` has the reports, `prefix` is the package's folder in the repository.
    """

    outcome: JobStatus
    fails: bool
    message: str
    hint: str
    result: GradingResult
    counted: GradingResult
    rubric: Rubric
    folder: Path
    prefix: str

    @property
    def title(self) -> str:
        """The outcome in a few words; a rubric that the student can change is never a plain pass."""
        judged = self.outcome not in (JobStatus.NOT_GRADED, JobStatus.WRONG_INPUT)
        theirs = judged and self.result.rubric_origin == "submission"
        return TITLES[self.outcome] + (f", by a rubric {RUBRIC_FROM['submission']}" if theirs else "")


def describe_outcome(
    counted: GradingResult, rubric: Rubric, outcome: JobStatus, *, static: bool
) -> tuple[str, str]:
    """Return a line about the outcome, with its cause where that is not the student's, and a hint or ""."""
    if outcome is JobStatus.NOT_GRADED and static and counted.error is None and not counted.criteria:
        return "no criterion of this lab can be judged from the files alone, and nothing was run", LET_IT_RUN
    if outcome is JobStatus.NOT_GRADED:
        return _describe_error(counted)
    files = " that can be judged from the files alone (nothing was run)" if static else ""
    reached = f"{number(counted.points)} of {number(counted.max_points)} points{files}"
    if outcome is not JobStatus.INCONCLUSIVE:
        return f"{reached}; {points_to_pass(rubric, counted.max_points)}", ""
    waiting = arrange(counted, rubric).open
    if not waiting:
        return f"{reached}; something could not be judged, and this costs no marks", ""
    points = number(sum(loss.points for loss in waiting))
    first = waiting[0].criterion
    return (
        f"{reached}; {points} more are not decided yet, and this costs no marks: {first.message}",
        first.hint,
    )


def points_to_pass(rubric: Rubric, points: float) -> str:
    """Return what it takes to pass, out of the `points` that are counted."""
    needed = scaled_pass_mark(rubric, points)
    if needed is None:
        return "to pass, every visible criterion has to be met"
    return f"to pass, you need {number(needed)}"


def summarize(graded: JobResult) -> str:
    """Return the report as Markdown, of what was asked for alone: with one verdict, that of the job."""
    if graded.counted is graded.result:
        report = graded.folder / "report.md"
        return report.read_text(encoding="utf-8") if report.is_file() else ""
    mark = scaled_pass_mark(graded.rubric, graded.counted.max_points)
    rubric = graded.rubric.model_copy(update={"pass_mark": mark})
    return render_markdown(graded.counted, rubric, hidden=len(hidden_ids(rubric)))


def _describe_error(result: GradingResult) -> tuple[str, str]:
    if result.error is None:
        return (
            f"a check of the grader failed; {NO_MARK_LOST}",
            "report it; the submission can be graded again",
        )
    own = is_students_fault(result)
    return result.error.message if own else f"{result.error.message}; {NO_MARK_LOST}", result.error.hint


def clear(out: Path) -> None:
    """Make the folder and empty it, so that reports of an earlier run are not taken for this one's.

    Raises OutputError if it is a link or holds anything that is not the grader's.
    """
    try:
        names = {entry.name for entry in out.iterdir()} if out.is_dir() else set()
        if out.is_symlink() or (out.exists() and not out.is_dir()) or names - REPORT_NAMES:
            # the folder is in a checkout, into which the student may have put anything
            raise OutputError(f"{out} is in the way of the results", hint="remove it from the repository")
        for name in names:
            path = out / name
            # a link is removed itself, never what it leads to
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        make_folder(out)
    except OSError as error:
        raise OutputError(
            f"{out} cannot be written: {error.strerror}", hint="choose another folder"
        ) from error


def keep(made: Path, out: Path, rubric: Rubric) -> None:
    """Move a submission's reports to `out`, without the runs that only hidden criteria use. Raises OutputError."""
    unseen = _hidden_scenarios(rubric)
    try:
        for name in sorted(REPORT_NAMES):
            if (made / name).exists():
                shutil.move(made / name, out / name)
        for name in unseen:
            (out / "evidence" / f"{name}.mcap").unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            console = (out / "console.log").read_text(encoding="utf-8")
            atomic_write(out / "console.log", _without(console, unseen).encode())
    except OSError as error:
        raise OutputError(
            f"{out} cannot be written: {error.strerror}", hint="free some space there"
        ) from error


def add_forms(
    out: Path, result: GradingResult, rubric: Rubric, prefix: str, docs: dict[str, dict[str, str]]
) -> None:
    """Write the reports that name files by their path in the repository. Raises OutputError."""
    shown = ReportInput(result=result, rubric=rubric, prefix=prefix, docs=docs)
    for name in WITH_LINES:
        atomic_write(out / FORMS[name].file, FORMS[name].render(shown))


def _hidden_scenarios(rubric: Rubric) -> frozenset[str]:
    used = {"visible": set[str](), "hidden": set[str]()}
    for criterion in rubric.criteria:
        if criterion.scenario is not None:
            used[criterion.visibility].add(criterion.scenario)
    return frozenset(used["hidden"] - used["visible"])


def _without(console: str, unseen: frozenset[str]) -> str:
    """Return the console log without the sections of the runs `unseen`."""
    kept, shown = [], True
    for row in console.splitlines(keepends=True):
        # nothing that a node prints begins so: every other line begins with a time
        if row.startswith(SECTION):
            shown = row.removeprefix(SECTION).strip() not in unseen
        if shown:
            kept.append(row)
    return "".join(kept)


MODES = ("auto", "require", "none")
YES, NO = {"true", "yes", "on", "1"}, {"", "false", "no", "off", "0"}
FAILING = (JobStatus.BELOW, JobStatus.NOT_GRADED, JobStatus.INCONCLUSIVE)
NEVER = "never"
OUT = "grader-results"
COUNTERS = ("GITHUB_RUN_NUMBER", "CI_PIPELINE_IID")
"""By which GitHub numbers a workflow's runs, and GitLab a project's pipelines. To run one again is the same attempt."""
SHOWN_CHARS = 100
MARK_PATTERN = re.compile(r"(\d{1,6}(?:\.\d{1,6})?)\s*(%?)")
MARK_HINT = "write points (12.5) or a percentage of the visible points (60%)"


@dataclass(frozen=True, kw_only=True)
class JobSettings:
    """`lab` is a rubric's id or file, or None if the package's name decides. `package` is the name of the package to
    grade in place of the lab's, or "". `attempt` is the number of this run by the system's count, `attempts` how many
    are graded at most; None where no limit is asked for. `fail_on` holds the outcomes that fail the job. `out` is the
    folder for the reports, `repository` the student's checkout, as the system names it."""

    lab: str | None
    path: Path
    package: str
    mark: PassMark | None
    fail_on: frozenset[JobStatus]
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
                f"this is attempt {self.attempt}, and only {plural(self.attempts, 'attempt')} can be graded"
            )
            raise SubmissionError(
                message, hint="what was graded before counts; ask your teachers for one more"
            )


def read_settings(variables: Mapping[str, str]) -> JobSettings:
    """Read `GRADER_LAB`, `_PATH`, `_PACKAGE`, `_PASS_MARK`, `_FAIL_ON`, `_STATIC`, `_SANDBOX`, `_ATTEMPTS` and
    `_OUT`. One that is missing or empty has its default. Raises UsageError that names the input of the action, as the
    variable is named."""

    def given(name: str) -> str:
        return variables.get(f"GRADER_{name}", "").strip()

    workspace = variables.get("GITHUB_WORKSPACE") or variables.get("CI_PROJECT_DIR")
    return JobSettings(
        lab=given("LAB") or None,
        path=Path(given("PATH") or "."),
        package=_package(given("PACKAGE")),
        mark=read_pass_mark(given("PASS_MARK")),
        fail_on=_fail_on(given("FAIL_ON")),
        static=_yes(given("STATIC")),
        sandbox=_sandbox(given("SANDBOX")),
        out=Path(given("OUT") or OUT),
        repository=Path(workspace) if workspace else None,
        # the first is set by one system, the second by the other
        attempt=next((int(text) for name in COUNTERS if (text := variables.get(name, "")).isdecimal()), None),
        attempts=_attempts(given("ATTEMPTS")),
    )


def _package(text: str) -> str:
    if text and not is_package_name(text):
        raise UsageError(f"package: {_quote(text)} cannot be a package's name", hint="write its <name>")
    return text


def _attempts(text: str) -> int | None:
    if text and not re.fullmatch(r"[1-9]\d{0,5}", text):
        raise UsageError(
            f"attempts: {_quote(text)} is not a number of attempts", hint="write 5, say, or nothing"
        )
    return int(text) if text else None


def _fail_on(text: str) -> frozenset[JobStatus]:
    words = [word for word in re.split(r"[\s,]+", text.lower()) if word]
    if words == [NEVER]:
        return frozenset()
    known = {outcome.value: outcome for outcome in FAILING}
    unknown = [word for word in words if word not in known]
    if unknown:
        raise UsageError(
            f"fail-on: {_quote(unknown[0])} is not an outcome",
            hint=f"name any of {', '.join(known)}, or {NEVER} alone",
        )
    return frozenset(known[word] for word in words) or frozenset(FAILING)


def _yes(text: str) -> bool:
    if text.lower() in YES | NO:
        return text.lower() in YES
    raise UsageError(f"static: {_quote(text)} is neither true nor false", hint="write true or false")


def _sandbox(text: str) -> SandboxMode:
    if (text or "auto") not in MODES:
        raise UsageError(f"sandbox: {_quote(text)} is not a mode", hint=f"write {', '.join(MODES)}")
    return cast("SandboxMode", text or "auto")


def _quote(text: str) -> str:
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


def with_pass_mark(loaded: LoadedRubric, mark: PassMark | None) -> LoadedRubric:
    """Return the rubric with that pass mark, scaled from the visible points to all points.

    Raises UsageError for more points than there are.
    """
    if mark is None:
        return loaded
    rubric, most = loaded.rubric, sum(c.points for c in loaded.rubric.criteria if c.visibility == "visible")
    if not mark.percent and mark.value > most:
        raise UsageError(
            f"pass-mark: {number(mark.value)} points, but {rubric.id} has {number(most)} visible ones",
            hint=MARK_HINT,
        )
    # the submission is marked by all points, and its mark was given in visible ones
    share = mark.value / (100 if mark.percent else most or 1)
    return loaded.model_copy(
        update={"rubric": rubric.model_copy(update={"pass_mark": share * rubric.max_points})}
    )


LINE_CHARS = 1000


class GitHubRunner:
    """Tells GitHub's runner. `variables` are those of the step; without the name of a file, that part is left out."""

    def __init__(self, variables: Mapping[str, str]) -> None:
        self._outputs = variables.get("GITHUB_OUTPUT", "")
        self._summary = variables.get("GITHUB_STEP_SUMMARY", "")

    @contextmanager
    def commands_stopped(self) -> Iterator[None]:
        """Keep the runner from taking anything printed in this block for a command."""
        # one that a student's code cannot guess, and so cannot print to end the block
        token = secrets.token_hex(20)
        _print(f"::stop-commands::{token}\n")
        try:
            yield
        finally:
            _print(f"\n::{token}::\n")

    def tell(self, graded: JobResult) -> None:
        """Write the annotations, summary and outputs of a result. Raises OutputError."""
        result = graded.counted.model_copy(update={"error": None})  # it is in `text`, with whose fault it is
        text = "\n".join(part for part in (graded.message, graded.hint) if part)
        _print(github_annotation(_severity(graded), graded.title, text))
        _print(render_annotations(result, graded.prefix, each_max=EACH_MAX - 1))  # the outcome is one of them
        self._add(self._summary, f"{_heading(graded.title, graded.message)}\n\n{summarize(graded)}\n")
        self._write_outputs(_values(graded))

    def tell_error(self, error: GraderError) -> None:
        """Write the same where there is no result. Raises OutputError."""
        outcome = OF_CODE[error.exit_code]
        text = "\n".join(part for part in (error.message, error.hint) if part)
        _print(github_annotation(Severity.ERROR, TITLES[outcome], text))
        self._add(
            self._summary,
            f"{_heading(TITLES[outcome], error.message)}\n\n{markdown(line(error.hint, LINE_CHARS))}\n",
        )
        self._write_outputs({"status": outcome.value, "passed": "false"})

    def _write_outputs(self, values: Mapping[str, str]) -> None:
        rows = []
        for name, value in values.items():
            end = f"end-{secrets.token_hex(20)}"  # a value that ends early could set other outputs
            rows.append(f"{name}<<{end}\n{value}\n{end}\n")
        self._add(self._outputs, "".join(rows))

    def _add(self, file: str, text: str) -> None:
        if not file:
            return
        try:
            # others have written to it: the workflow's earlier commands
            with Path(file).open("a", encoding="utf-8", errors="backslashreplace") as stream:
                stream.write(text)
        except OSError as error:
            message = f"{file} cannot be written: {error.strerror}"
            raise OutputError(
                message, hint="GitHub made this file: does it belong to the container's user?"
            ) from error


def _values(graded: JobResult) -> dict[str, str]:
    counted = graded.outcome is not JobStatus.NOT_GRADED
    passed = graded.outcome is JobStatus.PASSED
    encoded = render_classroom(graded.counted, graded.rubric, passed=passed, prefix=graded.prefix).rstrip()
    report = graded.folder / "report.html"
    return {
        "points": number(graded.counted.points) if counted else "",
        "max-points": number(graded.counted.max_points),
        "status": graded.outcome.value,
        "passed": str(passed).lower(),
        "rubric-origin": graded.result.rubric_origin or "",
        "report": str(report) if report.is_file() else "",
        "result": encoded,
    }


def _severity(graded: JobResult) -> Severity:
    if graded.outcome is JobStatus.PASSED and graded.result.rubric_origin != "submission":
        return Severity.NOTICE
    return Severity.ERROR if graded.fails else Severity.WARNING


def _heading(title: str, text: str) -> str:
    return f"**{title}:** {markdown(line(text, LINE_CHARS))}"


def _print(text: str) -> None:
    """Print at once, in order with the report on the terminal."""
    # what the log's encoding lacks must not end the job
    encoding = sys.stdout.encoding or "ascii"
    sys.stdout.write(text.encode(encoding, "backslashreplace").decode(encoding))
    sys.stdout.flush()


VARIABLES = "grader.env"


class GitLabRunner:
    """Tells GitLab's runner through files in the folder of the results."""

    def __init__(self, variables: Mapping[str, str]) -> None:
        self._out = Path(variables.get("GRADER_OUT") or OUT)

    @contextmanager
    def commands_stopped(self) -> Iterator[None]:
        """Do nothing: GitLab obeys only escape sequences, and the reports have none."""
        yield

    def tell(self, graded: JobResult) -> None:
        """Write the points as variables. Raises OutputError."""
        counted = graded.outcome is not JobStatus.NOT_GRADED
        self._write(
            {
                "GRADER_POINTS": number(graded.counted.points) if counted else "",
                "GRADER_MAX_POINTS": number(graded.counted.max_points),
                "GRADER_STATUS": graded.outcome.value,
                "GRADER_RUBRIC_ORIGIN": graded.result.rubric_origin or "",
            }
        )

    def tell_error(self, error: GraderError) -> None:
        """Write the outcome where there is no result. Raises OutputError."""
        # a link of the student's repository is not followed
        if not self._out.is_symlink() and (self._out.is_dir() or not self._out.exists()):
            self._write({"GRADER_STATUS": OF_CODE[error.exit_code].value})

    def _write(self, values: dict[str, str]) -> None:
        atomic_write(
            self._out / VARIABLES, "".join(f"{name}={value}\n" for name, value in values.items()).encode()
        )


RUNNERS: Mapping[str, type[GitHubRunner | GitLabRunner]] = {"github": GitHubRunner, "gitlab": GitLabRunner}
