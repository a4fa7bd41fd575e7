"""The pytest plugin with `evidence`, `run`, `package`, `student`; `-p` loads it in a process of its own."""

from __future__ import annotations

import inspect
import pickle
import re
import socket
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from grader.checks import Evidence, PackageFacts, Run
from grader.checks.all_runs import NoSuchScenario, NotRecorded
from grader.model.verdict import Status
from grader.rubric.pytest_check import Outcome, SessionOutcome, TestOutcome
from grader.rubric.student_functions import Ask, StudentError, StudentFile, ask_arena, ask_evidence
from grader.wording import shorten

MESSAGE_CHARS = 200
SAYING = (AssertionError, NotRecorded, pytest.fail.Exception, pytest.skip.Exception)
"""What a test says of the student's work; any other exception is a fault of the test."""
_ADDRESS = re.compile(r"\b0x[0-9a-fA-F]{6,}\b")
_EVIDENCE = pytest.StashKey[Evidence]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options of ours: where the evidence is, where the outcome goes, and the descriptor that calls go over."""
    parser.addoption("--grader-evidence", type=Path, required=True)
    parser.addoption("--grader-outcome", type=Path, required=True)
    parser.addoption("--grader-calls", type=int, default=None)


def pytest_configure(config: pytest.Config) -> None:
    """Read the evidence, and begin to take notes."""
    config.addinivalue_line("markers", "points(n): how much this test weighs among the others (default: 1)")
    data = config.getoption("--grader-evidence").read_bytes()
    config.stash[_EVIDENCE] = pickle.loads(data)  # noqa: S301 - written by the grader, in a folder of its own
    config.pluginmanager.register(_Notes(config.getoption("--grader-outcome"), config))


@pytest.fixture(scope="session")
def evidence(pytestconfig: pytest.Config) -> Evidence:
    """Return the runs by scenario: `evidence["talker"]`."""
    return pytestconfig.stash[_EVIDENCE]


@pytest.fixture(scope="session")
def run(evidence: Evidence) -> Run:
    """Return the run of the criterion's own scenario."""
    return evidence.run


@pytest.fixture(scope="session")
def package(evidence: Evidence) -> PackageFacts:
    """Return what the package's files say."""
    return evidence.package


@pytest.fixture(scope="session")
def _ask(pytestconfig: pytest.Config) -> Ask:
    """Return what calls a student's functions; where the run is over, what answers as they did."""
    number = pytestconfig.getoption("--grader-calls")
    if number is not None:
        return ask_arena(socket.socket(fileno=number))
    return ask_evidence(pytestconfig.stash[_EVIDENCE].run)


@pytest.fixture
def student(request: pytest.FixtureRequest, _ask: Ask) -> Callable[[str], StudentFile]:
    """Return the functions of a file of the package: `student("src/kinematics.py").forward(0.1, 0.2)`."""
    return lambda file: StudentFile(file, request.node.name, _ask)


class _Notes:
    """What became of each test, written down when all are done."""

    def __init__(self, path: Path, config: pytest.Config) -> None:
        self._path = path
        self._folder = str(path.parent)
        self._rootdir = str(config.rootpath)
        self._tests: dict[str, TestOutcome] = {}
        self._faults: list[str] = []

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A file that cannot be read is the instructor's fault."""
        if report.failed:
            lines = [line for line in report.longreprtext.splitlines() if line.strip()]
            self._faults.append(
                self._short(lines[-1].removeprefix("E ").strip() if lines else "cannot be read")
            )

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """One note a test: the worst of its setup, its call and its teardown."""
        report = yield
        error = call.excinfo.value if call.excinfo else None
        if isinstance(error, NoSuchScenario | pytest.FixtureLookupError):
            text = error.msg if isinstance(error, pytest.FixtureLookupError) else str(error)
            fixture = getattr(error, "argname", "")
            self._faults.append(f"{item.name}: {text or f'there is no fixture {fixture!r}'}")
        elif call.excinfo is not None and report.failed and not isinstance(error, SAYING):
            self._faults.append(self._exception(item, call.excinfo))
        if report.when == "call" or not report.passed:
            self._note(item, self._outcome(report, error), error, report)
        return report

    def pytest_sessionfinish(self) -> None:
        """Write the outcome down."""
        outcome = SessionOutcome(tests=tuple(self._tests.values()), faults=tuple(self._faults))
        self._path.write_bytes(outcome.model_dump_json().encode())

    def _outcome(self, report: pytest.TestReport, error: BaseException | None) -> Outcome:
        if isinstance(error, NotRecorded):
            return "open" if error.verdict.status is Status.INCONCLUSIVE else "failed"
        return report.outcome

    def _note(
        self, item: pytest.Item, outcome: Outcome, error: BaseException | None, report: pytest.TestReport
    ) -> None:
        function = getattr(item, "function", None)
        title = (inspect.getdoc(function) or "").partition("\n")[0].strip()
        message = "" if outcome == "passed" else self._message(error, report)
        name = item.name
        own = error if isinstance(error, StudentError) else StudentError("")
        noted = self._tests.get(item.nodeid)
        if noted is None or noted.outcome == "passed":
            self._tests[item.nodeid] = TestOutcome(
                name=name,
                title=title,
                outcome=outcome,
                message=message,
                points=self._points(item),
                file=own.file,
                line=own.line or None,
                late=own.late,
            )

    def _points(self, item: pytest.Item) -> float:
        marker = item.get_closest_marker("points")
        if marker is None:
            return 1.0
        given = marker.args[0] if len(marker.args) == 1 and not marker.kwargs else None
        if isinstance(given, bool) or not isinstance(given, int | float) or not 0 <= given < float("inf"):
            self._faults.append(f"{item.name}: points(…) takes one number, 0 or more")
            return 1.0
        return float(given)

    def _message(self, error: BaseException | None, report: pytest.TestReport) -> str:
        """The first line of what was asserted."""
        if error is None:
            return self._short(report.longreprtext.strip().partition("\n")[0])
        return self._short(str(error).strip().partition("\n")[0] or "an assertion does not hold")

    def _exception(self, item: pytest.Item, info: pytest.ExceptionInfo[BaseException]) -> str:
        """What a test raised in place of an assertion, with the last line of its file that took part."""
        lines = [entry.lineno + 1 for entry in info.traceback if Path(entry.path) == item.path]
        text = str(info.value).strip().partition("\n")[0]
        place = f"{item.path.name}:{lines[-1]}" if lines else item.path.name
        return self._short(f"{item.name}: {place}: {info.typename}{': ' if text else ''}{text}")

    def _short(self, text: str) -> str:
        """Without what differs from run to run, addresses and folders, and as what can be written down."""
        text = text.encode("utf-8", "backslashreplace").decode()
        text = text.replace(self._folder, "…").replace(f"{self._rootdir}/", "")
        text = _ADDRESS.sub("0x…", text)
        return shorten(text, MESSAGE_CHARS)
