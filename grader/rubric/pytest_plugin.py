"""The pytest plugin with the fixtures `evidence`, `run`, `package` and `student`; `-p` loads it in a process of its
own.

`student("src/kinematics.py").forward(0.1, 0.2)` calls a student's function. While a run is recorded, it is called in
the sandbox, and call and answer become evidence. While the run is judged, the same calls are answered from the
evidence. The process of the tests never loads a student's code.
"""

from __future__ import annotations

import builtins
import inspect
import json
import pickle
import re
import socket
import time
from collections import defaultdict, deque
from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from grader.checks import Evidence, PackageFacts, Run, inconclusive
from grader.checks.registry import NoSuchScenario, NotRecorded
from grader.checks.support.console_output import Frame, Traceback
from grader.checks.support.exit_causes import MAIN, explain_traceback
from grader.installable import exists_somewhere, install_hint
from grader.model.python_slip import PythonSlip
from grader.model.verdict import Status, machine_lacks
from grader.rubric.pytest_check import Outcome, SessionOutcome, TestOutcome
from grader.wording import lines_text, shorten

MESSAGE_CHARS = 300
SAYING = (AssertionError, NotRecorded, pytest.fail.Exception, pytest.skip.Exception)
"""What a test says of the student's work; any other exception is a fault of the test."""
# An object's address in a message differs from run to run, and the same evidence must give the same bytes.
_ADDRESS = re.compile(r"\b0x[0-9a-fA-F]{6,}\b")
_EVIDENCE = pytest.StashKey[Evidence]()
_CALLED = pytest.StashKey[set[tuple[str, str]]]()
_CALLS = pytest.StashKey["ArenaCalls"]()
_AGAIN = pytest.StashKey[Callable[[], object]]()
CHANGES_S = 10.0
CHANGES_MAX = 300
CHANGES_SHOWN = 2
"""How long small changes of functions are tried at most, how many of one function, and how many of them are shown."""
NAMED = frozenset({"NameError", "UnboundLocalError", "AttributeError", "ImportError", "ModuleNotFoundError"})
"""Exceptions that say themselves what to change."""


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
    number = config.getoption("--grader-calls")
    if number is not None:
        config.stash[_CALLS] = ArenaCalls(socket.socket(fileno=number))


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
    calls = pytestconfig.stash.get(_CALLS, None)
    return calls or ask_evidence(pytestconfig.stash[_EVIDENCE].run)


@pytest.fixture
def student(request: pytest.FixtureRequest, _ask: Ask) -> Callable[[str], StudentFile]:
    """Return the functions of a file of the package: `student("src/kinematics.py").forward(0.1, 0.2)`."""
    called = request.node.stash.setdefault(_CALLED, set[tuple[str, str]]())
    return lambda file: StudentFile(file, request.node.name, _ask, called)


class _Notes:
    """What became of each test, written down when all are done."""

    def __init__(self, path: Path, config: pytest.Config) -> None:
        self._path = path
        self._evidence = config.stash[_EVIDENCE]
        self._folder = str(path.parent)
        self._rootdir = str(config.rootpath)
        self._tests: dict[str, TestOutcome] = {}
        self._faults: list[str] = []

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Take note of a file that cannot be read: it is the instructor's fault."""
        if report.failed:
            lines = [line for line in report.longreprtext.splitlines() if line.strip()]
            self._faults.append(
                self._short(lines[-1].removeprefix("E ").strip() if lines else "cannot be read")
            )

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Take one note for each test: the worst of its setup, its call and its teardown."""
        report = yield
        error = call.excinfo.value if call.excinfo else None
        if isinstance(error, NoSuchScenario | pytest.FixtureLookupError):
            text = error.msg if isinstance(error, pytest.FixtureLookupError) else str(error)
            fixture = getattr(error, "argname", "")
            self._faults.append(f"{item.name}: {text or f'there is no fixture {fixture!r}'}")
        elif call.excinfo is not None and report.failed and not isinstance(error, SAYING):
            self._faults.append(self._exception(item, call.excinfo))
        if report.when == "call":
            self._remember(item, error)
        if report.when == "call" or not report.passed:
            self._note(item, error, report)
        return report

    def _remember(self, item: pytest.Item, error: BaseException | None) -> None:
        """Keep what calls the test again, unless its exception says itself what to change."""
        raised = error.raised if isinstance(error, StudentError) else None
        if isinstance(item, pytest.Function) and not (raised and raised.kind in NAMED):
            given = {
                name: value
                for name, value in item.funcargs.items()
                if name in inspect.signature(item.obj).parameters
            }
            again: Callable[[], object] = partial(item.obj, **given)
            item.stash[_AGAIN] = again

    @pytest.hookimpl(wrapper=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Generator[None, object, object]:
        """While a run is recorded, look for a small change of a function with which all its tests would pass."""
        done = yield
        calls = session.config.stash.get(_CALLS, None)
        tests, until_s = defaultdict[tuple[str, str], list[pytest.Item]](list), time.monotonic() + CHANGES_S
        for item in session.items if calls else ():
            called = item.stash.get(_CALLED, set[tuple[str, str]]())
            if len(called) == 1 and item.nodeid in self._tests:
                tests[min(called)].append(item)
        for (file, function), items in tests.items():
            failed = [item for item in items if self._tests[item.nodeid].outcome == "failed"]
            again = [item.stash.get(_AGAIN, None) for item in (*failed, *items)]
            known = [test for test in again if test is not None]
            if (
                calls
                and failed
                and len(known) == len(again)
                and (found := _small_changes(calls, known, until_s))
            ):
                calls({"test": "", "file": file, "function": function, "small_changes": found})
        return done

    def pytest_sessionfinish(self) -> None:
        """Write the outcome down."""
        outcome = SessionOutcome(tests=tuple(self._tests.values()), faults=tuple(self._faults))
        self._path.write_bytes(outcome.model_dump_json().encode())

    def _note(self, item: pytest.Item, error: BaseException | None, report: pytest.TestReport) -> None:
        outcome: Outcome = report.outcome
        if isinstance(error, NotRecorded):
            outcome = "open" if error.verdict.status is Status.INCONCLUSIVE else "failed"
        title = (inspect.getdoc(getattr(item, "function", None)) or "").partition("\n")[0].strip()
        message = "" if outcome == "passed" else self._message(error, report)
        own = error if isinstance(error, StudentError) else StudentError("")
        cause, hint = self._explanation(own)
        unreached = None if cause or hint or outcome != "failed" else self._unreached(item)
        if unreached is not None:
            message = f"{message}; line {unreached.line} of {unreached.file}: {unreached.message}"
            hint = f"in {unreached.file}, {unreached.fix}"
        # a function that gives back no value needs more than another sign
        told = hint or isinstance(error, StudentError)
        changed = {} if told or outcome != "failed" else self._found_changes(item)
        hint = changed.get("hint", hint)
        at: Answer = {"file": own.file, "line": own.line or None} if own.file and not hint else changed
        noted = self._tests.get(item.nodeid)
        # A teardown that fails counts, too, but does not take the place of what failed before it.
        if noted is None or noted.outcome == "passed":
            self._tests[item.nodeid] = TestOutcome(
                name=item.name,
                title=title,
                outcome=outcome,
                message=self._short(f"{own.call} raises {cause}") if cause else message,
                points=self._points(item),
                hint=hint,
                file=unreached.file if unreached else at.get("file", own.file),
                line=unreached.line if unreached else at.get("line", own.line or None),
                place=changed.get("place", ""),
                late=own.late,
            )

    def _unreached(self, item: pytest.Item) -> PythonSlip | None:
        """Return why a function that the test called never comes to its `return`."""
        try:
            slips = self._evidence.package.slips
        except NotRecorded:
            return None
        called = item.stash.get(_CALLED, set[tuple[str, str]]())
        found = (s for s in slips if s.kind == "wrong-value" and s.name == "unreached")
        return next((s for s in found if (s.file, s.message.split("`")[1]) in called), None)

    def _found_changes(self, item: pytest.Item) -> Answer:
        """Return where the function is that the test called, and a small change with which its tests pass."""
        called = item.stash.get(_CALLED, set[tuple[str, str]]())
        try:
            found = _recorded_changes(self._evidence.run) if len(called) == 1 else {}
        except (NoSuchScenario, NotRecorded):
            return {}
        file, function = min(called, default=("", ""))
        change = found.get((file, function))
        if change is None:
            return {}
        first, last = change["lines"]
        passing = change["passing"]
        if not passing:
            lacks = "" if change.get("returns", True) else ", which has no `return` with a value"
            place = f"`{function}`, {lines_text(first - 1, last - 1)} of {file}{lacks}"
            return {"file": file, "line": first, "place": place}
        writes = [f"write `{one['after']}`{_indent(one)} on line {one['line']}" for one in passing]
        hint = f"in {file}, {' or '.join(writes)}: with that, each test of `{function}` passes"
        return {"file": file, "line": passing[0]["line"], "hint": hint}

    def _explanation(self, error: StudentError) -> tuple[str, str]:
        """Return the cause and the hint of what a student's function raised; neither while a run is recorded."""
        try:
            package = self._evidence.package
        except NotRecorded:
            return "", ""
        if error.raised is None:
            return "", error.hint
        ending = explain_traceback(error.raised, package)
        return ending.cause, error.hint or ending.hint

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
        """Return the first line of what was asserted."""
        said = report.longreprtext if error is None else str(error).strip() or "an assertion does not hold"
        return self._short(said.strip().partition("\n")[0])

    def _exception(self, item: pytest.Item, info: pytest.ExceptionInfo[BaseException]) -> str:
        """Return what a test raised in place of an assertion, with the last line of its file that took part."""
        lines = [entry.lineno + 1 for entry in info.traceback if Path(entry.path) == item.path]
        text = str(info.value).strip().partition("\n")[0]
        place = f"{item.path.name}:{lines[-1]}" if lines else item.path.name
        return self._short(f"{item.name}: {place}: {info.typename}{': ' if text else ''}{text}")

    def _short(self, text: str) -> str:
        """Return a text without what differs from run to run (addresses, folders), as UTF-8 can hold it, and short."""
        text = text.encode("utf-8", "backslashreplace").decode()
        text = text.replace(self._folder, "…").replace(f"{self._rootdir}/", "")
        text = _ADDRESS.sub("0x…", text)
        return shorten(text, MESSAGE_CHARS)


def _small_changes(calls: ArenaCalls, tests: list[Callable[[], object]], until_s: float) -> Answer:
    """Return the function's lines, and up to `CHANGES_SHOWN` small changes with which all tests pass."""
    found: Answer = {}
    passing: list[Answer] = []
    for number in range(CHANGES_MAX):
        calls.change, calls.changed = number, {}
        passes = all(_passes(test) for test in tests)
        tried = "line" in calls.changed
        if passes and tried:
            passing.append(calls.changed)
        found = calls.changed or found
        over = not tried and (number == 0 or "lines" in calls.changed)
        if over or len(passing) == CHANGES_SHOWN or time.monotonic() > until_s:
            break
    calls.change = None
    return {**found, "passing": passing} if found else {}


def _passes(test: Callable[[], object]) -> bool:
    try:
        test()
    except (Exception, pytest.fail.Exception, pytest.skip.Exception):  # noqa: BLE001 - an answer may be anything
        return False
    return True


class ArenaCalls:
    """Calls functions in the run that is being recorded; with a number in `change`, as that small change makes them,
    which is `changed` then."""

    def __init__(self, connection: socket.socket) -> None:
        self._ask = ask_arena(connection)
        self.change: int | None = None
        self.changed: Answer = {}

    def __call__(self, request: Answer) -> Answer:
        answer = self._ask(request if self.change is None else {**request, "change": self.change})
        changed = answer.get("changed")
        self.changed = changed if isinstance(changed, dict) else self.changed
        return answer


CALLED, ANSWERED = "type", "answer"
"""The actions of `/grader/actor` that hold a call, and its answer."""
ARGUMENTS_CHARS = 60
REQUEST_CHARS_MAX = 30_000
LONG = "gives back more than 3900 characters"
FAULTS = {"ended": "its process ended", "long": LONG, "late": "it did not end within its time"}
MISSING_MODULE = re.compile(r"No module named '(\w+)[\w.]*'")
Answer = dict[str, Any]
Ask = Callable[[Answer], Answer]


class StudentError(AssertionError):
    """A student's function did not give back a value. `raised` has the last line of theirs that took part in an
    exception, `call` what raised it, and `hint` what to do, where the exception does not tell."""

    def __init__(
        self,
        message: str,
        *,
        hint: str = "",
        call: str = "",
        raised: Traceback | None = None,
        late: bool = False,
    ) -> None:
        super().__init__(message)
        self.hint, self.call, self.raised, self.late = hint, call, raised, late
        own = raised.frames[-1] if raised is not None and raised.frames else Frame("", 0)
        self.file, self.line = own.file, own.line


class StudentFile:
    """A Python file of the package; its attributes are its functions."""

    def __init__(self, file: str, test: str, ask: Ask, called: set[tuple[str, str]]) -> None:
        self._file, self._test, self._ask, self._called = file, test, ask, called

    def __getattr__(self, function: str) -> Callable[..., Any]:
        # Python itself asks for such attributes (`__iter__`): they are no functions of the student's.
        if function.startswith("__"):
            raise AttributeError(function)

        def call(*args: object, **kwargs: object) -> object:
            about = {"test": self._test, "file": self._file, "function": function}
            request = {**about, "args": encode(list(args)), "kwargs": encode(kwargs)}
            if len(json.dumps(request)) > REQUEST_CHARS_MAX:
                raise ValueError(
                    f"the arguments of {function} are longer than {REQUEST_CHARS_MAX} characters"
                )
            self._called.add((self._file, function))
            answer = self._ask(request)
            return _value(answer, _call_text(function, args, kwargs))

        return call


def _call_text(function: str, args: tuple[object, ...], kwargs: dict[str, object]) -> str:
    given = ", ".join([*map(repr, args), *(f"{name}={value!r}" for name, value in kwargs.items())])
    return f"{function}({given if len(given) <= ARGUMENTS_CHARS else '…'})"


def _value(answer: Answer, shown: str) -> object:
    """Return what the function gave back. Raises StudentError, and what is one and the exception that was raised."""
    if "value" in answer:
        try:
            return decode(answer["value"])
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise StudentError(f"{shown}: its answer cannot be read") from error
    if "raised" in answer:
        raise _student_error(answer, shown)
    if "other" in answer:
        kind = str(answer["other"])
        returned = getattr(builtins, kind, None)
        if isinstance(returned, type) and issubclass(returned, BaseException):
            message = f"{shown} gives back a {kind}, and does not raise it"
            raise StudentError(message, hint=f"write `raise {kind}(…)`, not `return`")
        raise StudentError(f"{shown} gives back a {kind}, not numbers, text, lists, tuples or dicts")
    fault = FAULTS.get(str(answer.get("fault")), "its answer cannot be read")
    message = str(answer["missing"]) if "missing" in answer else f"{shown}: {fault}"
    raise StudentError(message, late=answer.get("fault") == "late")


def _student_error(answer: Answer, shown: str) -> StudentError:
    """Return what a student's function raised as a StudentError, which is also of the builtin kind that was raised:
    `pytest.raises(ValueError)` takes it."""
    file, line = str(answer.get("file", "")), answer.get("line")
    line = line if isinstance(line, int) else 0
    module = MISSING_MODULE.fullmatch(str(answer.get("message", "")))
    if answer["raised"] == "ModuleNotFoundError" and module and exists_somewhere(module[1], ()):
        hint = install_hint(module[1], module=True)
        raise NotRecorded(machine_lacks(f"{module[1]} is not installed", hint=hint))
    frames = (Frame(file, line, str(answer.get("source", ""))),) if file else ()
    raised = Traceback(str(answer["raised"]), str(answer.get("message", "")), frames, 0, 0)
    shown = f"import of {answer['imports']}" if "imports" in answer else shown
    asks = "imports" in answer and raised.kind == "EOFError"
    hint = (
        f"put what the file does by itself below {MAIN}: who imports it wants its functions" if asks else ""
    )
    place = f" ({file}:{line})" if file else ""
    message = f"{shown} raises {raised.text}{place}"
    about: dict[str, Any] = {"hint": hint, "call": shown, "raised": raised}
    # The name comes from the sandbox: only an exception of Python's own is taken, and no other object.
    base = getattr(builtins, str(answer.get("builtin")), None)
    if isinstance(base, type) and issubclass(base, Exception):
        try:
            kind: type[StudentError] = type(base.__name__, (StudentError, base), {})
            return kind(message, **about)
        except TypeError:  # its layout is another one
            pass
    return StudentError(message, **about)


def ask_arena(connection: socket.socket) -> Ask:
    """Return what calls functions in the run that is being recorded."""
    lines = connection.makefile("rw", encoding="utf-8")

    def ask(request: Answer) -> Answer:
        lines.write(json.dumps(request) + "\n")
        lines.flush()
        line = lines.readline()
        if not line:
            raise RuntimeError("the run is over")
        return _answer(line)

    return ask


def ask_evidence(run: Run) -> Ask:
    """Return what answers as the recorded run did, equal calls one after the other. Raises NotRecorded."""
    answers: dict[str, deque[Answer]] = defaultdict(deque)
    called: str | None = None
    for _, event in run.actors:
        if event.action == CALLED and event.actor == "grader":
            called = _key(event.value)
        elif event.action == ANSWERED and called is not None:
            answers[called].append(_answer(event.value))
            called = None

    def ask(request: Answer) -> Answer:
        found = answers[_key(json.dumps(request)) or ""]
        if not found:
            shown = f"{request['function']} of {request['file']}"
            raise NotRecorded(inconclusive(f"this call of {shown} was not recorded: grade again"))
        return found.popleft()

    return ask


def _recorded_changes(run: Run) -> dict[tuple[str, str], Answer]:
    """Return what was found of the functions whose tests fail, by file and function."""
    typed = [_answer(e.value) for _, e in run.actors if e.action == CALLED and e.actor == "grader"]
    found = [(one, one["small_changes"]) for one in typed if isinstance(one.get("small_changes"), dict)]
    return {(one["file"], one["function"]): changes for one, changes in found if _is_sound(changes)}


def _is_sound(changes: Answer) -> bool:
    """Return whether all is there and of its type: it comes from the sandbox."""
    lines, passing = changes.get("lines"), changes.get("passing")
    if not (isinstance(lines, list) and len(lines) == 2 and isinstance(passing, list)):
        return False
    numbers = [*lines, *(n for one in passing for n in (one.get("line"), one.get("spaces", 0)))]
    return all(isinstance(n, int) for n in numbers) and all(
        isinstance(one.get("after"), str) for one in passing
    )


def _indent(change: Answer) -> str:
    return f" with {change['spaces']} spaces before it" if "spaces" in change else ""


def _answer(text: object) -> Answer:
    """Return what was answered; an empty one where it is not an answer, as the student's code may have written it."""
    try:
        found = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        found = None
    return found if isinstance(found, dict) else {}


def _key(line: object) -> str | None:
    """Return the call without its number; None for any other line that was typed."""
    try:
        request = json.loads(line) if isinstance(line, str) else None
    except ValueError:
        return None
    if not isinstance(request, dict) or "function" not in request:
        return None
    return json.dumps({name: value for name, value in request.items() if name != "id"}, sort_keys=True)


def encode(value: object) -> Any:  # noqa: ANN401 - JSON
    """Return the value as JSON has it, tuples, sets and dicts with their names. Raises TypeError."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list):
        return [encode(item) for item in value]
    if isinstance(value, tuple | set):
        return {type(value).__name__: [encode(item) for item in value]}
    if isinstance(value, dict):
        return {"dict": [[encode(key), encode(item)] for key, item in value.items()]}
    raise TypeError(f"a {type(value).__name__} cannot be given to a student's function")


def decode(value: Any) -> Any:  # noqa: ANN401 - JSON
    """Return what `encode` was given. Raises ValueError, TypeError or KeyError where it is from no such value."""
    if isinstance(value, list):
        return [decode(item) for item in value]
    if not isinstance(value, dict):
        return value
    # One key: anything else is no value that `encode` made, and raises ValueError.
    ((kind, items),) = value.items()
    return {"tuple": tuple, "set": set, "dict": dict}[kind](decode(items))
