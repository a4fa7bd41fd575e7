"""Runs one of the grader's own functions on hostile data in a child process with limits on memory, CPU, files and time.

The arguments, and each value that the function yields, travel as JSON. The child is this Python without site-packages,
and inherits none of the user's variables but those that a program needs to be loaded. It imports little: to start it
takes as long as most of what it is started for. A process for many jobs is not
its business (`workers.py`), and neither are students' programs (`arena/`).
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import sys
from importlib import import_module
from typing import NamedTuple

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # noqa: PTH100, PTH120 - see above
BOOTSTRAP = "import sys; sys.path.append(sys.argv[1]); from grader.limited_child import main; main()"
COLLECT_AFTER = 50_000
"""As in `workers.py`: what it parses is many small objects."""


class ChildLimits(NamedTuple):
    """What the child may take: `memory_bytes` of address space, `cpu_s` of processor time, `wall_s` in all,
    `file_bytes` for each file that it writes; of its answer, `answer_bytes` are read."""

    memory_bytes: int
    cpu_s: int
    wall_s: float
    file_bytes: int
    answer_bytes: int = 8 << 20


class Answer(NamedTuple):
    """What the function yielded, a line of JSON each; `done` if it came to its end, `timed_out` if it took longer than
    `wall_s`. Where it is neither, the child went beyond another limit, or crashed."""

    lines: bytes
    done: bool
    timed_out: bool = False


def run_limited(function: str, *arguments: object, limits: ChildLimits) -> Answer:
    """Call `function` (`module:name`), which yields values for JSON, with these arguments."""
    import subprocess  # noqa: PLC0415 - as below, the child needs none of them
    import tempfile  # noqa: PLC0415

    from grader.host_programs import loading_environment  # noqa: PLC0415

    request = {"function": function, "arguments": arguments, "limits": limits._asdict()}
    with tempfile.TemporaryFile() as out:
        code: int | None = None
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = subprocess.run(
                [sys.executable, "-I", "-S", "-B", "-c", BOOTSTRAP, ROOT],
                cwd="/",
                env=loading_environment(os.environ),
                input=json.dumps(request).encode("ascii"),
                stdout=out,
                stderr=subprocess.DEVNULL,
                timeout=limits.wall_s,
                check=False,
            ).returncode
        out.seek(0)
        return Answer(lines=out.read(limits.answer_bytes), done=code == 0, timed_out=code is None)


def main() -> None:
    """Answer the request on standard input, as the child."""
    gc.set_threshold(COLLECT_AFTER)
    request = json.load(sys.stdin)
    _set_limits(ChildLimits(**request["limits"]))
    module, _, name = request["function"].partition(":")
    for value in getattr(import_module(module), name)(*request["arguments"]):
        print(json.dumps(value), flush=True)
    gc.freeze()  # as in `grader/__main__.py`


def _set_limits(limits: ChildLimits) -> None:
    """macOS refuses to limit a process's memory, and Windows knows no such limits."""
    if resource is None:
        return
    refused = () if sys.platform == "linux" else (OSError, ValueError)
    for kind, value in (
        (resource.RLIMIT_AS, limits.memory_bytes),
        (resource.RLIMIT_CPU, limits.cpu_s),
        (resource.RLIMIT_FSIZE, limits.file_bytes),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(*refused):
            _, most = resource.getrlimit(kind)
            value = value if most == resource.RLIM_INFINITY else min(value, most)  # noqa: PLW2901
            resource.setrlimit(kind, (value, value))
