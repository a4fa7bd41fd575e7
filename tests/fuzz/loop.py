"""The inner side of a fuzzing process: takes cases from stdin, runs one after the other, tells how each ended.

Runs under ROS's Python too (3.8, standard library). A case is `<H I`, the target's name and the bytes; the answer is a
line of JSON. CPU time and memory are limited here; whoever waits for the answer limits the wall time.
"""

import json
import os
import resource
import signal
import struct
import sys
import time
import traceback
from pathlib import Path

HEADER = struct.Struct("<HI")
SPACE_BYTES = 3 << 30
FRAMES_SHOWN = 6


class TooLongError(BaseException):
    """Past what a case may take. No `except Exception` catches it."""


def serve(targets, cpu_s, memory_bytes):
    """`targets` are functions of bytes by name, each with the exceptions that its parser promises."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a parser prints is no answer
    resource.setrlimit(resource.RLIMIT_AS, (SPACE_BYTES, SPACE_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGPROF, _too_long)
    while True:
        header = sys.stdin.buffer.read(HEADER.size)
        if len(header) < HEADER.size:
            return
        name_length, length = HEADER.unpack(header)
        name = sys.stdin.buffer.read(name_length).decode()
        function, promised = targets[name]
        answer = run(function, promised, sys.stdin.buffer.read(length), cpu_s, memory_bytes)
        answers.write(json.dumps(answer).encode() + b"\n")


def run(function, promised, data, cpu_s, memory_bytes):
    """How it ended: `fine`, `refused` as promised, or a finding: `raised`, `hang`, `memory`."""
    before = _status_bytes("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # forgets the peak
    began_s = time.process_time()
    kind, error = _ended(function, promised, data, cpu_s)
    answer = {"kind": kind, "error": "", "where": "", "trace": "", "cpu_s": time.process_time() - began_s}
    answer["bytes"] = _status_bytes("VmHWM") - before
    if error is not None:
        answer["error"] = f"{type(error).__name__}: {error}"[:2000]
    if kind in ("raised", "hang", "memory") and error is not None:
        frames = traceback.extract_tb(error.__traceback__)
        answer["where"] = _place(frames)
        answer["trace"] = "".join(traceback.format_list(frames[-FRAMES_SHOWN:]))
    if kind in ("fine", "refused") and answer["bytes"] > memory_bytes:
        answer["kind"] = "memory"
        answer["error"] = "took {} MiB".format(answer["bytes"] >> 20)
    return answer


def _ended(function, promised, data, cpu_s):
    try:
        signal.setitimer(signal.ITIMER_PROF, cpu_s, cpu_s)
        try:
            function(data)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    except promised as error:
        return "refused", error
    except TooLongError as error:
        return "hang", error
    except MemoryError as error:
        return "memory", error
    except BaseException as error:  # noqa: BLE001 - whatever comes is the finding
        return "raised", error
    return "fine", None


def _too_long(*_):
    raise TooLongError("took too much CPU")


def _place(frames):
    """The innermost line of the project's own, else the innermost of all."""
    own = [f for f in frames if "/grader/" in f.filename and "site-packages" not in f.filename]
    frame = (own or list(frames))[-1] if frames else None
    return "" if frame is None else f"{Path(frame.filename).stem}:{frame.name}"


def _status_bytes(key):
    with open("/proc/self/status") as file:  # noqa: PTH123 - hundreds of times a second
        for line in file:
            if line.startswith(key):
                return int(line.split()[1]) << 10
    return 0
