"""The fixture `student` of tests: `student("src/kinematics.py").forward(0.1, 0.2)` calls a student's function.

While a run is recorded, it is called in the sandbox, and call and answer become evidence. While the run is judged, the
same calls are answered from the evidence. The process of the tests never loads a student's code.
"""

from __future__ import annotations

import builtins
import json
import re
import socket
from collections import defaultdict, deque
from collections.abc import Callable
from typing import Any

from grader.checks import Run, inconclusive
from grader.checks.all_runs import NotRecorded
from grader.installable import install_hint, known_packages

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
    """A student's function did not give back a value. `file` and `line` are the last of theirs that took part."""

    def __init__(self, message: str, *, file: str = "", line: int = 0, late: bool = False) -> None:
        super().__init__(message)
        self.file, self.line, self.late = file, line, late


class StudentFile:
    """A Python file of the package; its attributes are its functions."""

    def __init__(self, file: str, test: str, ask: Ask) -> None:
        self._file, self._test, self._ask = file, test, ask

    def __getattr__(self, function: str) -> Callable[..., Any]:
        if function.startswith("__"):
            raise AttributeError(function)

        def call(*args: object, **kwargs: object) -> object:
            about = {"test": self._test, "file": self._file, "function": function}
            request = {**about, "args": encode(list(args)), "kwargs": encode(kwargs)}
            if len(json.dumps(request)) > REQUEST_CHARS_MAX:
                raise ValueError(
                    f"the arguments of {function} are longer than {REQUEST_CHARS_MAX} characters"
                )
            answer = self._ask(request)
            return _value(answer, _shown(function, args, kwargs))

        return call


def _shown(function: str, args: tuple[object, ...], kwargs: dict[str, object]) -> str:
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
        raise _raised(answer, shown)
    if "other" in answer:
        raise StudentError(
            f"{shown} gives back a {answer['other']}, not numbers, text, lists, tuples or dicts"
        )
    fault = FAULTS.get(str(answer.get("fault")), "its answer cannot be read")
    message = str(answer["missing"]) if "missing" in answer else f"{shown}: {fault}"
    raise StudentError(message, late=answer.get("fault") == "late")


def _raised(answer: Answer, shown: str) -> StudentError:
    """`pytest.raises(ValueError)` takes it where a student's function raises a ValueError."""
    file, line = str(answer.get("file", "")), answer.get("line")
    line = line if isinstance(line, int) else 0
    module = MISSING_MODULE.fullmatch(str(answer.get("message", "")))
    if answer["raised"] == "ModuleNotFoundError" and module and module[1] in known_packages():
        raise NotRecorded(inconclusive(f"{module[1]} is not installed", hint=install_hint(module[1])))
    place = f" ({file}:{line})" if file else ""
    message = f"{shown} raises {answer['raised']}: {answer.get('message', '')}{place}"
    base = getattr(builtins, str(answer.get("builtin")), None)
    if isinstance(base, type) and issubclass(base, Exception):
        try:
            kind: type[StudentError] = type(base.__name__, (StudentError, base), {})
            return kind(message, file=file, line=line)
        except TypeError:  # its layout is another one
            pass
    return StudentError(message, file=file, line=line)


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


def _answer(text: object) -> Answer:
    """Return what was answered; an empty one where it is no answer, as the student's code may have written it."""
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
    ((kind, items),) = value.items()
    return {"tuple": tuple, "set": set, "dict": dict}[kind](decode(items))
