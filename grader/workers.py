"""A process that does one job after the other, and that nothing which happens in a job can take others along with.

Both sides send pickles, each with its length before it, over pipes that nobody else holds. The process ends when its
parent is gone.
"""

from __future__ import annotations

import os
import pickle
import select
import signal
import subprocess
import threading
from contextlib import suppress
from types import FrameType
from typing import IO, Any

from grader.classes.batch.job import Job, Outcome
from grader.outside import anywhere, own_module

HEAD_BYTES = 8
LEAVE_S = 30.0  # to end its work in order, once it is told to
HINT = "look whether the machine has too little memory, and grade it once more with --only"


class Child:
    """A process of this machine. It is started with its first job, and anew after one that ended it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        self._lock = threading.Lock()

    def do(self, job: Job) -> Outcome:
        """The job's outcome; one of status `error` where the process ends, with kind `killed` or `interrupted`."""
        with self._lock:
            if self._stopped:
                return _ended(job, "interrupted", "interrupted")
            process = self._process = self._process if _lives(self._process) else _started()
        assert process is not None  # noqa: S101 - just made
        assert process.stdin is not None  # noqa: S101 - opened with PIPE
        assert process.stdout is not None  # noqa: S101 - opened with PIPE
        try:
            _send(process.stdin, job)
            return Outcome.model_validate(_received(process.stdout))
        except (EOFError, OSError, pickle.UnpicklingError):
            if self._stopped:
                return _ended(job, "interrupted", "interrupted")
            process.kill()
            code = process.wait()
            by = f"by signal {-code}" if code < 0 else f"with {code}"
            return _ended(job, "killed", f"the process that graded it ended {by}")

    def interrupt(self) -> None:
        """Let the job that runs clean up and end, and begin no other."""
        with self._lock:
            self._stopped = True
            if self._process is not None and self._process.poll() is None:
                self._process.send_signal(signal.SIGINT)

    def close(self) -> None:
        """End the process, by force where it does not end in time."""
        self.interrupt()
        process = self._process
        if process is None:
            return
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        try:
            process.wait(LEAVE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _lives(process: subprocess.Popen[bytes] | None) -> bool:
    return process is not None and process.poll() is None


def _started() -> subprocess.Popen[bytes]:
    """In a session of its own: a Ctrl-C on the terminal is its parent's to hand on."""
    return subprocess.Popen(
        own_module("grader.workers"),
        env=anywhere(os.environ),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    )


def _ended(job: Job, kind: str, message: str) -> Outcome:
    return Outcome(
        id=job.entry.id,
        status="error",
        max_points=job.rubric.rubric.max_points,
        kind=kind,
        message=message,
        hint=HINT if kind == "killed" else "",
    )


def _send(stream: IO[bytes], data: object) -> None:
    content = pickle.dumps(data)
    stream.write(len(content).to_bytes(HEAD_BYTES, "big") + content)
    stream.flush()


def _received(stream: IO[bytes]) -> Any:  # noqa: ANN401 - what the other side has pickled
    size = int.from_bytes(_exactly(stream, HEAD_BYTES), "big")
    return pickle.loads(_exactly(stream, size))  # noqa: S301 - our own process at the other end


def _exactly(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


class _Worker:
    """What the process knows of itself."""

    busy = False
    stopped = False


def main() -> None:
    """Do what comes on stdin until it ends. What anything here prints goes to stderr."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in grader.__main__
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    inward = os.fdopen(os.dup(0), "rb", buffering=0)
    outward = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    threading.Thread(target=_leave_with_parent, args=(inward.fileno(),), daemon=True).start()
    from grader.classes.batch.job import work  # noqa: PLC0415 - slow to load: signals and pipes come first

    with suppress(EOFError, BrokenPipeError, KeyboardInterrupt):
        while not _Worker.stopped:
            job = _whole(inward)
            _Worker.busy = True
            try:
                if _Worker.stopped:
                    break
                outcome = work(job)
            finally:
                _Worker.busy = False
            _send(outward, outcome)


def _whole(stream: Any) -> Any:  # noqa: ANN401 - an unbuffered file, and what the other side has pickled
    def read(size: int) -> bytes:
        parts = bytearray()
        while len(parts) < size:
            part = stream.read(size - len(parts))
            if not part:
                raise EOFError
            parts += part
        return bytes(parts)

    size = int.from_bytes(read(HEAD_BYTES), "big")
    return pickle.loads(read(size))  # noqa: S301 - our own process at the other end


def _stop(_number: int, _frame: FrameType | None) -> None:
    _Worker.stopped = True
    if not _Worker.busy:
        os._exit(130)
    raise KeyboardInterrupt


def _leave_with_parent(descriptor: int) -> None:
    """A process whose parent is gone cleans up as an interrupted one does; a parent that lives holds its end open."""
    poll = select.poll()
    poll.register(descriptor, 0)
    poll.poll()
    os.kill(os.getpid(), signal.SIGINT)
    threading.Event().wait(LEAVE_S)
    os._exit(1)


if __name__ == "__main__":
    main()
