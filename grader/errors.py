"""Every error that a user can meet, in one tree.

    GraderError                 exit code 3
    ├── UsageError              2   the command line asks for something that cannot be
    │   ├── OutputError         2   the output folder cannot be written
    │   └── RubricError         2   one or more faults in a rubric, all of them named
    ├── SubmissionError         3   the submission cannot be read
    │   ├── PackageNotFound     3   no package of the lab in it
    │   └── Unreachable         3   it could not be fetched: the network, the server, no git or no room here
    ├── EvidenceError           3   an evidence file cannot be read
    ├── NotSent                 3   feedback could not be sent to one student
    ├── InternalError           3   the grader itself failed
    └── HostError               3   this machine cannot do what is asked
        ├── RosMissing          3   no ROS 1 here
        ├── SandboxMissing      3   `--sandbox require`, and none to be had
        ├── ArenaError          3   the managed roscore failed
        ├── OutputLost          3   the output folder could be written, and then it could not
        └── Busy                3   another grader works on the same submission

Each carries one line that says what is wrong and, as `hint`, what to do about it.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from typing import Literal

Blame = Literal["submission", "machine", "grader"]


class ExitCode(IntEnum):
    """What `grader` returns to the shell."""

    PASSED = 0
    BELOW_PASS_MARK = 1
    USAGE = 2
    NOT_GRADED = 3
    INCONCLUSIVE = 4
    INTERRUPTED = 130


class GraderError(Exception):
    """The root. `kind` is the word in `result.json`, `blame` says whose fault it is: only a fault of the submission
    replaces an earlier result. `note` says what happened to the result."""

    kind = "grader"
    blame: Blame = "grader"
    exit_code = ExitCode.NOT_GRADED
    note = ""

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class UsageError(GraderError):
    """What was asked for is not possible; nothing was graded, and no result is written."""

    kind = "usage"
    exit_code = ExitCode.USAGE


class OutputError(UsageError):
    kind = "output"
    blame = "machine"


class RubricError(UsageError):
    """Faults of a rubric, or of a file that goes with it, one line each, as `file:line: key.path: what is wrong`."""

    kind = "rubric"

    def __init__(self, faults: list[str], *, hint: str = "") -> None:
        super().__init__("\n".join(faults), hint=hint)
        self.faults = faults


class SubmissionError(GraderError):
    """The submission is at fault."""

    kind = "submission"
    blame: Blame = "submission"


class PackageNotFound(SubmissionError):
    kind = "package-not-found"


class Unreachable(SubmissionError):
    kind = "host"
    blame = "machine"


class EvidenceError(GraderError):
    """Evidence or a result cannot be read, or a newer grader wrote it."""

    kind = "evidence"


class NotSent(GraderError):
    """Feedback could not be sent to one student; the others get theirs."""

    kind = "feedback"


class InternalError(GraderError):
    kind = "internal"


class HostError(GraderError):
    """This machine cannot do what is asked. It costs no marks."""

    kind = "host"
    blame = "machine"


class RosMissing(HostError):
    kind = "ros-missing"


class SandboxMissing(HostError):
    kind = "sandbox-missing"


class ArenaError(HostError):
    kind = "arena"


class OutputLost(HostError):
    kind = "output"


class Busy(HostError):
    kind = "busy"


def blame(kind: str) -> Blame:
    """Return whose fault an error of this kind is."""
    # kinds without a class, such as `killed` and `worker-lost`, are the grader's own
    return next((found.blame for found in _kinds(GraderError) if found.kind == kind), "grader")


def _kinds(error: type[GraderError]) -> Iterator[type[GraderError]]:
    yield error
    for below in error.__subclasses__():
        yield from _kinds(below)
