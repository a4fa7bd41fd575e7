"""`check: pytest`: an instructor's own tests, run over the evidence in a process of their own."""

from __future__ import annotations

import ast
import inspect
import os
import pickle
import re
import socket
import subprocess
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, ValidationError, model_validator

import grader
from grader.checks import Check, Evidence, FileCitation, Record, Verdict, failed, inconclusive, passed
from grader.checks import partial as partial_
from grader.checks.registry import parts
from grader.files import temporary_folder
from grader.model.verdict import Status
from grader.portable import own_session
from grader.rubric.yaml_lines import Fault, WrittenRubric
from grader.wording import closest, did_you_mean, join_words, plural

HINTS = 4
SHOWN_TESTS = 20
TAIL_BYTES = 8192
# pytest's own exit codes: every test was run, some may have failed; an error of pytest's own, or a wrong -k
ALL_RUN = {0, 1}
NOT_RUN = {3, 4}
Outcome = Literal["passed", "failed", "skipped", "open"]
MAX_BYTES = 1_000_000
# More than all calls may take together (`TOGETHER_S` in `arena/unit_tests.py`), with pytest's own start.
RECORDING_S = 120.0


class PytestParams(Record):
    """Which tests are run."""

    file: str
    """A Python file beside the rubric."""
    select: str = ""
    """What pytest's `-k` takes: `comes_around or range`; empty: all tests."""
    timeout_s: Annotated[float, Field(gt=0, le=600)] = 60.0
    """For all tests together."""

    @model_validator(mode="after")
    def _select_tells_tests_apart(self) -> PytestParams:
        if dangling := re.search(r"(?:^|\s)(and|or|not)\s*$", self.select):
            raise ValueError(f'select: a name is missing after "{dangling[1]}"')
        words = (word for word in re.findall(r"\w+", self.select) if word not in {"and", "or", "not"})
        # pytest's `-k` compares with the file's name as well.
        if word := next((word for word in words if word.lower() in self.file.lower()), ""):
            raise ValueError(
                f'select: "{word}" is in the name of the file, too, and so fits all its tests: rename one'
            )
        return self


_Names = tuple[str, ...]
"""The names by which pytest's `-k` knows a test: its own, then those of its class and its decorators."""


def faults_of_tests(rubric: WrittenRubric, files: Mapping[str, bytes]) -> Iterator[Fault]:
    """Yield what is wrong with an instructor's test files: they are no Python, they ask for files and functions that
    the handout calls otherwise, or none of their tests is called as a criterion selects."""
    broken, read = set[str](), set[str]()
    for criterion in rubric.criteria:
        file, select = str(criterion.given.get("file")), criterion.given.get("select")
        if criterion.check != "pytest" or file not in files or file in broken:
            continue
        try:
            tree = ast.parse(files[file])
        except (SyntaxError, ValueError) as error:
            line = f", line {error.lineno}" if isinstance(error, SyntaxError) else ""
            yield (*criterion.at, "file"), f"{file}{line}: {getattr(error, 'msg', error)}"
            broken.add(file)
            continue
        if file not in read and (fault := _called_otherwise(tree, rubric.handout)):
            yield (*criterion.at, "file"), f"{file}, {fault}"
        read.add(file)
        tests = _tests_in(tree, files[file])
        if isinstance(select, str) and select.strip() and not _selects(select.strip(), tests):
            there = join_words(sorted({name for name, *_ in tests}))
            yield (*criterion.at, "select"), f"fits no test of {file}: there is {there}"


def _called_otherwise(tree: ast.Module, handout: str) -> str:
    """Return which file or function of the student's the tests ask for, where the handout has one that is much like
    it, or with more arguments than the handout has; "" where it says no such thing."""
    texts = {
        ast.unparse(target): node.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
    }
    files = {PurePosixPath(name).name for name in re.findall(r"[\w./-]+\.py\b", handout)}
    mentions = re.findall(r"`(\w+)\(((?:[A-Za-z_]\w*(?:, *)?)+)\)`", handout)
    most: dict[str, int] = {}
    for name, given in mentions:
        most[name] = max(most.get(name, 0), len(given.split(",")))
    tries_wrong_calls = any(isinstance(node, ast.Name) and node.id == "TypeError" for node in ast.walk(tree))
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and node.args]
    for call in calls:
        if ast.unparse(call.func) == "student":
            path = getattr(texts.get(ast.unparse(call.args[0]), call.args[0]), "value", None)
            name = PurePosixPath(path).name if isinstance(path, str) else ""
            if near := _other_name(name, files, handout):
                return f"line {call.lineno}: the handout says {near}, not {name}"
        elif isinstance(call.func, ast.Attribute) and ast.unparse(call.func).startswith("student("):
            name = call.func.attr
            if near := _other_name(name, most, handout):
                return f"line {call.lineno}: the handout says {near}, not {name}"
            if name in most and not tries_wrong_calls and len(call.args) > most[name]:
                takes = plural(most[name], "argument")
                return f"line {call.lineno}: {name} has {takes} in the handout, and {len(call.args)} here"
    return ""


def _other_name(name: str, known: Collection[str], handout: str) -> str:
    """Return what the handout has in place of a name; names that differ in their digits alone are others."""
    if not name or name in handout:
        return ""
    near = closest(name, known)
    return near if re.sub(r"\d", "", near) != re.sub(r"\d", "", name) else ""


def _selects(select: str, tests: Sequence[_Names]) -> bool:
    """Return whether one of the tests is selected, or may be: pytest has more forms of it than are read here."""
    try:
        expression = ast.parse(select, mode="eval").body
        return not tests or any(_fits(expression, names) for names in tests)
    except (SyntaxError, ValueError):
        return True


def _tests_in(tree: ast.Module, raw: bytes) -> list[_Names]:
    """Return the tests of a file; none where they cannot be known."""
    if "params=" in raw.decode(errors="replace"):  # of fixtures: their ids are selected, too
        return []
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    places = [(tree.body, []), *((one.body, [one.name, *_words_of(one)]) for one in classes)]
    return [
        (node.name, *above, *_words_of(node))
        for body, above in places
        for node in body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test")
    ]


def _words_of(node: ast.ClassDef | ast.FunctionDef) -> list[str]:
    """Return the words of the decorators, of which pytest makes markers and ids."""
    return [word for one in node.decorator_list for word in re.findall(r"\w+", ast.unparse(one))]


def _fits(expression: ast.expr, names: Sequence[str]) -> bool:
    """Return whether a test is selected, as pytest's `-k` says. Raises ValueError for what is no such expression."""
    if isinstance(expression, ast.BoolOp):
        found = [_fits(one, names) for one in expression.values]
        return all(found) if isinstance(expression.op, ast.And) else any(found)
    if isinstance(expression, ast.UnaryOp) and isinstance(expression.op, ast.Not):
        return not _fits(expression.operand, names)
    if isinstance(expression, ast.Name):
        return any(expression.id.lower() in name.lower() for name in names)
    raise ValueError(ast.dump(expression))


class TestsBroken(Exception):
    """The tests could not be run, which is not the student's fault."""

    # pytest would take it for a test by its name.
    __test__ = False


@lru_cache(maxsize=8)
def pytest_check(folder: Path) -> Check:
    """Return the check `pytest` for the rubric in this folder."""
    title, sections = parts(inspect.getdoc(run_tests) or "")
    return Check(
        name="pytest",
        function=partial(run_tests, folder.resolve()),
        params=PytestParams,
        facts=("evidence", "params"),
        title=title,
        sections=sections,
        messages_only=True,
    )


def run_tests(folder: Path, evidence: Evidence, params: PytestParams) -> Verdict:
    """The instructor's own tests pass.

    What it checks
        What the tests of this lab's instructor check, each for its share of the points.

    Why it matters on a robot
        The instructor knows this lab's robot, and what it must and must not do.

    How it is measured
        Each test reads what was recorded while the package ran, and passes or fails. Tests that are skipped
        do not count. If the tests themselves are broken, this costs no marks.

    How to fix
        The hint names each test that failed, and what it said.
    """
    try:
        path, _ = read_beside(folder, params.file)
        return _verdict(_session(path, evidence, params), params)
    except (FileFault, TestsBroken) as error:
        message = f"the tests in {params.file} could not be run; this costs no marks"
        hint = f"for the instructor: {error}"
        return Verdict(status=Status.ERROR, score=0.0, message=message, hint=hint)


def _session(path: Path, evidence: Evidence, params: PytestParams) -> SessionOutcome:
    """Run the file's tests. Raises TestsBroken."""
    with temporary_folder("tests") as folder:
        (folder / "evidence").write_bytes(pickle.dumps(evidence))
        code = _run(_command(path, folder, params), folder, params.timeout_s)
        try:
            outcome = SessionOutcome.model_validate_json((folder / "outcome").read_bytes())
        except (OSError, ValidationError) as error:
            raise TestsBroken(_last_words(folder, code)) from error
        # A wrong `-k` leaves an outcome without tests: pytest's own words say more.
        if code in NOT_RUN and not outcome.faults:
            raise TestsBroken(_last_words(folder, code))
    if outcome.faults:
        raise TestsBroken(outcome.faults[0])
    if not outcome.tests:
        fitting = f" that fits {params.select!r}" if params.select else ""
        raise TestsBroken(f"{path.name} holds no test{fitting}")
    if code not in ALL_RUN:
        raise TestsBroken(f"pytest ended with code {code} before all tests were run")
    return outcome


def record_calls(path: Path, connection: socket.socket) -> None:
    """Run the file's tests while a run is recorded, for the calls that they make over the connection, which is closed
    then. What comes of the tests is judged later, from the evidence."""
    nothing = inconclusive("nothing is recorded yet")
    evidence = Evidence({}, scenario=None, package=nothing)
    with connection, temporary_folder("tests") as folder:
        (folder / "evidence").write_bytes(pickle.dumps(evidence))
        number = connection.fileno()
        command = _command(path.resolve(), folder, PytestParams(file=path.name))
        command += ["--grader-calls", str(number)]
        with suppress(TestsBroken):
            _run(command, folder, RECORDING_S, (number,))


def _command(path: Path, folder: Path, params: PytestParams) -> list[str]:
    """Return the call of pytest, with nothing of the surrounding folders: no settings, conftest.py, cache or other
    plugin."""
    own = ["-p", "grader.rubric.pytest_plugin", "--grader-evidence", str(folder / "evidence")]
    own += ["--grader-outcome", str(folder / "outcome"), "--basetemp", str(folder / "tmp")]
    alone = ["-c", os.devnull, "--rootdir", str(path.parent), "--noconftest", "-p", "no:cacheprovider"]
    select = ["-k", params.select] if params.select else []
    return [
        sys.executable, "-m", "pytest", *own, *alone, "--import-mode=importlib", "-q", "--tb=line", *select, str(path)
    ]  # fmt: skip


def _environment() -> dict[str, str]:
    env = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    return {
        **env,
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        # The order of sets would differ from run to run, and with it what tests say.
        "PYTHONHASHSEED": "0",
        # pytest runs in a folder of its own, and has to find this grader and no other.
        "PYTHONPATH": str(Path(grader.__file__).resolve().parent.parent),
    }


def _run(command: list[str], folder: Path, timeout_s: float, handed: tuple[int, ...] = ()) -> int:
    """Return the exit code. What the tests started ends with them. Raises TestsBroken after `timeout_s`."""
    with (
        (folder / "output").open("wb") as output,
        own_session(
            command, cwd=folder, env=_environment(), stdout=output, stderr=subprocess.STDOUT, pass_fds=handed
        ) as process,
    ):
        try:
            return process.wait(timeout_s)
        except subprocess.TimeoutExpired as error:
            raise TestsBroken(f"the tests took longer than {timeout_s:g} s") from error


def _last_words(folder: Path, code: int) -> str:
    """Return what the last line of output says of a session that left no outcome."""
    with (folder / "output").open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - TAIL_BYTES))
        lines = [line.strip() for line in file.read().decode(errors="replace").splitlines() if line.strip()]
    how = f"signal {-code}" if code < 0 else f"code {code}"
    said = next((line for line in reversed(lines) if "rror" in line), lines[-1] if lines else "")
    return f"pytest ended with {how}" + (f": {said[:200]}" if said else "")


def _verdict(outcome: SessionOutcome, params: PytestParams) -> Verdict:
    """Return the share of the points of the tests that passed, of those that count."""
    verdict = _judge_tests(outcome, params)
    lost = [t for t in outcome.tests if t.outcome == "failed"]
    lines = dict.fromkeys((t.file, t.line) for t in lost if t.file)
    cited = tuple(FileCitation(file=file, line=line) for file, line in lines)
    if any(t.late for t in lost):
        verdict = verdict.if_repeated()
    return verdict.about(
        expected=f"the tests in {params.file} pass", measured=_sub_scores(outcome.tests), citations=cited
    )


def _judge_tests(outcome: SessionOutcome, params: PytestParams) -> Verdict:
    counted = [t for t in outcome.tests if t.outcome in {"passed", "failed"}]
    unsettled = [t for t in outcome.tests if t.outcome == "open"]
    if unsettled:
        return inconclusive(f"{unsettled[0].name} could not be run: {unsettled[0].message}")
    if not counted:
        reason = next((t.message for t in outcome.tests if t.message), "")
        skipped = inconclusive(f"every test was skipped{f': {reason}' if reason else ''}")
        return skipped.based_on(unjudged=True)
    total = sum(t.points for t in counted)
    reached = sum(t.points for t in counted if t.outcome == "passed")
    if total <= 0:
        raise TestsBroken(f"the tests of {params.file} that count have 0 points in total")
    return _score_tests(counted, reached / total)


def _score_tests(counted: list[TestOutcome], score: float) -> Verdict:
    lost = [t for t in counted if t.outcome == "failed"]
    passing = f"{len(counted) - len(lost)} of {len(counted)} tests pass"
    with_hint = {t.hint: t for t in reversed(lost) if t.hint}
    # what the first test came to is told in the message, what another one raised only here
    what_to_do = [
        hint if t is lost[0] or " raises " not in t.message else f"{t.name}: {t.message}: {hint}"
        for hint, t in reversed(with_hint.items())
    ]
    untold = [t for t in lost if not t.hint]
    same = {
        message: [t for t in untold if t.message == message]
        for message in dict.fromkeys(t.message for t in untold)
    }
    each = [*what_to_do, *(f"{_names(tests)}: {message}" for message, tests in same.items())]
    hint = "; ".join(each[:HINTS])
    if len(each) > HINTS:
        hint += f"; and {len(each) - HINTS} more"
    places = dict.fromkeys(t.place for t in untold if t.place)
    hint += f"; what these tests call is {join_words(places)}" if places else ""
    if score >= 1:
        return passed(passing, hint=hint)
    message = f"{passing}; failed: {lost[0].title.rstrip('.') or lost[0].name} ({lost[0].message})"
    return partial_(score, message, hint=hint) if score > 0 else failed(message, hint=hint)


def _names(tests: list[TestOutcome]) -> str:
    more = f" and {len(tests) - 1} more" if len(tests) > 1 else ""
    return f"{tests[0].name}{more}"


def _sub_scores(tests: tuple[TestOutcome, ...]) -> str:
    """Return `test_counts 1/1, test_resets 0/2, test_extra skipped`."""
    shown = [_sub_score(t) for t in tests[:SHOWN_TESTS]]
    more = [f"and {len(tests) - SHOWN_TESTS} more"] if len(tests) > SHOWN_TESTS else []
    return ", ".join([*shown, *more])


def _sub_score(test: TestOutcome) -> str:
    if test.outcome in {"skipped", "open"}:
        return f"{test.name} {'skipped' if test.outcome == 'skipped' else 'not run'}"
    return f"{test.name} {test.points if test.outcome == 'passed' else 0:g}/{test.points:g}"


class TestOutcome(Record):
    """One test. `open`: a run that it asks for was not recorded. `message` is one line, empty where it passed.

    `hint` says what to do, where that is known. `file` and `line` are the student's where an exception came from, or
    where the tested function is, of which `place` names all lines. `late` says that a function took too long.
    """

    __test__ = False

    name: str
    title: str
    outcome: Outcome
    message: str
    points: float
    hint: str = ""
    file: str = ""
    line: int | None = None
    place: str = ""
    late: bool = False


class SessionOutcome(Record):
    """`faults` are the instructor's: a file that cannot be read, a marker that is wrong."""

    tests: tuple[TestOutcome, ...]
    faults: tuple[str, ...]


class FileFault(ValueError):
    """The file is not there, or is none that may be used."""


class Kind(NamedTuple):
    """A kind of files that lie beside a rubric."""

    what: str
    suffixes: frozenset[str]
    example: str
    bytes_max: int


PYTHON = Kind("Python file", frozenset({".py"}), "my_checks.py", MAX_BYTES)
BAG = Kind("recording", frozenset({".bag", ".mcap"}), "bags/corridor.bag", 20 * MAX_BYTES)


FILES_MAX = 1000
"""So many files beside the rubric are looked at for one with a similar name."""


def _like(wanted: PurePosixPath, there: list[str]) -> str:
    """Return which of these files is meant: one of the same name, or of the same words in it, else one like it."""
    words = sorted(re.split(r"[_-]", wanted.stem))
    same = [one for one in there if sorted(re.split(r"[_-]", PurePosixPath(one).stem)) == words]
    return f' (did you mean "{min(same)}"?)' if same else did_you_mean(str(wanted), there)


def read_beside(folder: Path, name: str, kind: Kind = PYTHON) -> tuple[Path, bytes]:
    """Return the file of that name in the rubric's folder, or below it. Raises FileFault."""
    plain = PurePosixPath(name)
    if plain.suffix not in kind.suffixes or plain.is_absolute() or ".." in plain.parts or "\0" in name:
        raise FileFault(f"must name a {kind.what} beside the rubric, like {kind.example}")
    path = folder.resolve() / plain
    try:
        with path.open("rb") as file:
            raw = file.read(kind.bytes_max + 1)
    except OSError as error:
        there = (one.relative_to(folder).as_posix() for one in islice(folder.rglob("*"), FILES_MAX))
        near = _like(plain, [one for one in there if one.endswith(tuple(kind.suffixes))])
        raise FileFault(f"{name} cannot be read beside the rubric: {error.strerror}{near}") from error
    if len(raw) > kind.bytes_max:
        raise FileFault(f"{name} is larger than {kind.bytes_max // 1_000_000} MB")
    return path, raw
