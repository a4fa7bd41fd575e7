"""Worker processes: each does one job after another, and whatever ends it costs only the job that it was doing.

A job is a function of a module and its argument. Both sides send messages, each preceded by its length, through pipes
that no other process holds. A worker imports nothing from the current folder, and ends itself when its parent is gone.

A job travels as a pickle: what the parent sends is the grader's own, and a submission is in it as text only. An answer
travels as JSON, because a worker reads recordings and source files, and what is hostile in them may one day take a
decoder over: a pickle would then run code in the parent. The parent reads an answer as the type that the job's function
is declared to return, and an exception as one of the grader's or of Python's by its name, and calls nothing else.

The workers of one `run_each` are copies of a template: a process that has imported what their jobs need, and has never
seen a job.
"""

from __future__ import annotations

import builtins
import gc
import json
import os
import pickle
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path
from queue import LifoQueue
from types import FrameType
from typing import IO, Any, TypeVar, get_type_hints

from pydantic import TypeAdapter

from grader import errors
from grader.errors import GraderError, RubricError
from grader.host_programs import module_command, with_absolute_paths
from grader.limited_child import CAN_COPY, COLLECT_AFTER, Template, TemplateCopy, stand_by

HEAD_BYTES = 8
ANSWER_BYTES_MAX = 256 << 20
LEAVE_S = 30.0
"""How long a worker may take to clean up once it is told to stop."""
IDLE_CODE = 75
QUICK = {"OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "__all__"}
"""As in `grader/__main__.py`."""
Job = TypeVar("Job")
Result = TypeVar("Result")


class WorkerEnded(Exception):
    """The process ended before its job was done. `interrupted`: because it was told to stop."""

    def __init__(self, reason: str, *, interrupted: bool = False) -> None:
        super().__init__(reason)
        self.reason, self.interrupted = reason, interrupted


@dataclass(frozen=True, kw_only=True)
class WorkerLimits:
    """What a worker may take; None sets no limit.

    `memory_bytes` is address space beside what is mapped when the first job begins. `cpu_s` and `wall_s` are for each
    job. A worker that waits longer than `idle_s` for its next job ends, and is started again with that job.
    """

    memory_bytes: int | None = None
    cpu_s: float | None = None
    wall_s: float | None = None
    idle_s: float | None = None


class _Copy(TemplateCopy):
    """A copy of a template that is a worker, with its ends of the pipes that a `subprocess.Popen` has too."""

    def __init__(self, template: Template) -> None:
        (jobs_r, jobs_w), (answers_r, answers_w) = os.pipe(), os.pipe()
        self.stdin, self.stdout = os.fdopen(jobs_w, "wb"), os.fdopen(answers_r, "rb")
        try:
            super().__init__(template, jobs_r, answers_w)
        except OSError:
            _close(self)
            raise
        finally:
            os.close(jobs_r)
            os.close(answers_w)


class Worker:
    """A process that is started with its first job, and again after a job that ended it.

    It is a copy of `template`, or else a Python of its own; `env` is added to this process's environment then.
    `stopped`: it was told to stop, and does no more jobs.
    """

    def __init__(
        self,
        limits: WorkerLimits | None = None,
        env: Mapping[str, str] | None = None,
        template: Template | None = None,
    ) -> None:
        self._limits, self._env = limits or WorkerLimits(), dict(env or {})
        self._template = template
        self._process: subprocess.Popen[bytes] | _Copy | None = None
        self._function: tuple[object, bytes] = None, b""
        self._told: object = None
        self.stopped = False
        self._lock = threading.Lock()

    def run(self, function: Callable[[Job], Result], job: Job) -> Result:
        """Return what `function(job)` returns in the process, or raise what it raises. Raises WorkerEnded.

        Its declared type must survive JSON as pydantic writes it. Of an exception arrive the type, unless it is of
        another library (then RuntimeError), and the text.
        """
        answer_type: TypeAdapter[Result] = _answer_type(_plain(function))
        if self._function[0] is not function:
            # once for many jobs: a rubric may be bound to it
            self._function = function, pickle.dumps(function)
        while True:
            with self._lock:
                if self.stopped:
                    raise WorkerEnded("interrupted", interrupted=True)
                process, is_new = self._process, False
                if process is None or process.poll() is not None:
                    process, is_new = self._start(), True
            function_told = b"" if self._told is function and not is_new else self._function[1]
            try:
                answer = self._exchange(process, pickle.dumps((function_told, job, self._limits)))
                self._told = function
            except (EOFError, OSError) as error:
                if self.stopped:
                    raise WorkerEnded("interrupted", interrupted=True) from error
                process.kill()
                code = process.wait()
                if code == IDLE_CODE and not is_new:
                    continue  # it had waited too long just as the job came
                how = f"by signal {-code}" if code < 0 else f"with {code}"
                raise WorkerEnded(f"ended {how}") from error
            try:
                return _read_answer(answer, answer_type)
            except ValueError as error:
                process.kill()
                process.wait()
                raise WorkerEnded("gave an answer that cannot be read") from error

    def interrupt(self) -> None:
        """Let the current job clean up and end, and begin no other."""
        with self._lock:
            self.stopped = True
            if self._process is not None and self._process.poll() is None:
                if sys.platform == "win32":
                    self._process.kill()
                else:
                    self._process.send_signal(signal.SIGINT)

    def close(self) -> None:
        """End the process, by force if it does not end in time."""
        self.interrupt()
        process = self._process
        if process is None:
            return
        _close(process)
        try:
            process.wait(LEAVE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _start(self) -> subprocess.Popen[bytes] | _Copy:
        """Start it in a session of its own: its parent passes on a Ctrl-C from the terminal."""
        if self._process is not None:
            _close(self._process)
        if self._template is not None:
            with suppress(OSError):  # then without a template
                self._process = _Copy(self._template)
                return self._process
        self._process = subprocess.Popen(
            module_command("grader.workers"),
            env=_environment(self._env),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        return self._process

    def _exchange(self, process: subprocess.Popen[bytes] | _Copy, message: bytes) -> bytes:
        assert process.stdin is not None  # noqa: S101 - opened with PIPE
        assert process.stdout is not None  # noqa: S101 - opened with PIPE
        timer = threading.Timer(self._limits.wall_s or 0.0, process.kill)
        timer.daemon = True
        if self._limits.wall_s is not None:
            timer.start()
        try:
            _send(process.stdin, message)
            return _receive(process.stdout, ANSWER_BYTES_MAX)
        finally:
            timer.cancel()


def run_each(
    function: Callable[[Job], Result],
    jobs: Iterable[Job],
    count: int,
    *,
    ended: Callable[[Job, WorkerEnded], Result],
    begun: Callable[[Job], None] = lambda _: None,
    limits: WorkerLimits | None = None,
    env: Mapping[str, str] | None = None,
    warm_up: str = "",
) -> Iterator[Result]:
    """Yield each job's result as it comes, with up to `count` workers at a time.

    Jobs are taken when there is a worker for them; `begun` is then called with each. `ended` makes the result of a job
    whose worker ended. When the caller stops iterating, running jobs are interrupted and have cleaned up on return.
    `warm_up` (`module:name`) is called once in the template, by default it only imports the function's module.
    """
    count = max(count, 1)
    waiting = iter(jobs)
    template = _template(count, warm_up or _plain(function).__module__, env)
    workers = [Worker(limits, env, template) for _ in range(count)]
    # the worker that was used last goes first: it is warm, and the others may end as idle
    idle: LifoQueue[Worker] = LifoQueue()
    for worker in workers:
        idle.put(worker)

    def work(job: Job) -> Result:
        worker = idle.get()
        try:
            return worker.run(function, job)
        except WorkerEnded as error:
            return ended(job, error)
        finally:
            idle.put(worker)

    running: set[Future[Result]] = set()
    with ThreadPoolExecutor(count) as threads:
        try:
            while True:
                for job in islice(waiting, count - len(running)):
                    begun(job)
                    running.add(threads.submit(work, job))
                if not running:
                    break
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            _end(workers, running, template)


def _template(count: int, warm_up: str, env: Mapping[str, str] | None) -> Template | None:
    """Return a template for so many workers, where they need one and this system can have one."""
    # a template takes as long to start as the one worker that it would save
    if count == 1 or not CAN_COPY:
        return None
    return Template([*module_command("grader.workers"), warm_up], _environment(env))


def _end(workers: Sequence[Worker], running: Iterable[Future[Any]], template: Template | None) -> None:
    """Interrupt what is running, wait until it has cleaned up, and end the processes."""
    for worker in workers:
        worker.interrupt()
    wait(running)
    for worker in workers:
        worker.close()
    if template is not None:
        template.close()


def _environment(env: Mapping[str, str] | None) -> dict[str, str]:
    """Return the variables of a process of the grader, with `env`."""
    return {**with_absolute_paths(os.environ), **QUICK, **(env or {})}


def _close(process: subprocess.Popen[bytes] | _Copy) -> None:
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with suppress(OSError):
                stream.close()


def _send(stream: IO[bytes], content: bytes) -> None:
    stream.write(len(content).to_bytes(HEAD_BYTES, "big") + content)
    stream.flush()


def _receive(stream: IO[bytes], bytes_max: int = sys.maxsize) -> bytes:
    """Return the next message. Raises EOFError at the end, OSError for one that is too long."""
    size = int.from_bytes(_read(stream, HEAD_BYTES), "big")
    if size > bytes_max:
        raise OSError(f"a message of {size} bytes")
    return _read(stream, size)


def _read(stream: IO[bytes], size: int) -> bytes:
    """Read exactly `size` bytes; an unbuffered stream gives fewer at a time. Raises EOFError."""
    parts = bytearray()
    while len(parts) < size:
        part = stream.read(size - len(parts))
        if not part:
            raise EOFError
        parts += part
    return bytes(parts)


def _plain(function: Callable[..., Result]) -> Callable[..., Result]:
    """Return the function that a partial one calls."""
    while isinstance(function, partial):
        function = function.func
    return function


@lru_cache(maxsize=8)
def _answer_type(function: Callable[..., Result]) -> TypeAdapter[Result]:
    """Return what reads and writes the type that a plain function is declared to return."""
    return TypeAdapter(get_type_hints(function, include_extras=True)["return"])


def _read_answer(answer: bytes, answer_type: TypeAdapter[Result]) -> Result:
    """Return the result in an answer, or raise the exception in it. Raises ValueError if it is neither."""
    found = json.loads(answer)
    if not isinstance(found, dict) or found.keys() not in ({"result"}, {"raised", "message", "hint"}):
        raise ValueError("neither a result nor an exception")
    if "result" in found:
        return answer_type.validate_python(found["result"])
    raise _exception(*(str(value) for value in found.values()))


def _exception(name: str, message: str, hint: str) -> Exception:
    """Return an exception of the grader's or of Python's with this name; RuntimeError for any other."""
    kind = getattr(errors, name, None) or getattr(builtins, name, None)
    if isinstance(kind, type) and issubclass(kind, RubricError):
        return kind(message.splitlines(), hint=hint)
    if isinstance(kind, type) and issubclass(kind, GraderError):
        return kind(message, hint=hint)
    if isinstance(kind, type) and issubclass(kind, Exception):
        with suppress(TypeError):  # it takes more than a text
            return kind(message)
    return RuntimeError(f"{name}: {message}")


# ---- inside the process


class _State:
    """What the process knows about itself."""

    busy = False
    stopped = False


def main() -> None:
    """Do the jobs that come on stdin until it ends; as a template (its argument is what that warms up with), first
    stand by, until this is a copy that is to do jobs."""
    if len(sys.argv) == 1 or stand_by(sys.argv[1]):
        _work()
    gc.freeze()  # as in `grader/__main__.py`


def _work() -> None:
    """Do the jobs. Whatever one prints goes to stderr."""
    gc.set_threshold(COLLECT_AFTER)
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    jobs = os.fdopen(os.dup(0), "rb", buffering=0)
    # a `print` in a job must not end up in the answers
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    if hasattr(select, "poll"):  # not on Windows, where only an idle worker hears of its parent's end
        threading.Thread(target=_leave_with_parent, args=(jobs.fileno(),), daemon=True).start()
    limits: WorkerLimits | None = None
    function: Callable[[Any], object] = id
    with suppress(EOFError, BrokenPipeError, KeyboardInterrupt):
        while not _State.stopped:
            _wait_for_job(jobs.fileno(), limits)
            told, job, now = pickle.loads(_receive(jobs))  # noqa: S301 - from the parent; see above
            _State.busy = True
            try:
                # a signal that came before `busy` was set interrupts no job
                if _State.stopped:
                    break
                _limit(now, is_first=limits is None)
                if told:  # with what is bound to it (a rubric, say), it is the same for many jobs
                    function = pickle.loads(told)  # noqa: S301 - as above
                answer = _answer(function, job)
            finally:
                _State.busy = False
            limits = now
            _send(answers, answer)


def _answer(function: Callable[[Any], object], job: object) -> bytes:
    """Return the job's result, or the exception that it raised, as JSON."""
    try:
        result = _answer_type(_plain(function)).dump_python(
            function(job), mode="json", by_alias=True, warnings="error"
        )
        return json.dumps({"result": result}).encode()
    except Exception as error:  # noqa: BLE001 - it is raised again in the parent
        message, hint = (error.message, error.hint) if isinstance(error, GraderError) else (str(error), "")
        return json.dumps({"raised": type(error).__name__, "message": message, "hint": hint}).encode()


def _limit(limits: WorkerLimits, *, is_first: bool) -> None:
    if limits.memory_bytes is None and limits.cpu_s is None:
        return
    import resource  # noqa: PLC0415 - not on Windows

    def lower(kind: int, most: int) -> int:
        hard = resource.getrlimit(kind)[1]
        return most if hard == resource.RLIM_INFINITY else min(most, hard)

    if limits.memory_bytes is not None and is_first:
        most = lower(resource.RLIMIT_AS, _mapped_bytes(resource.getpagesize()) + limits.memory_bytes)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    if limits.cpu_s is not None:
        most = lower(resource.RLIMIT_CPU, int(time.process_time() + limits.cpu_s) + 1)
        # the soft limit alone, since the next job's is higher and a hard one cannot be raised again
        resource.setrlimit(resource.RLIMIT_CPU, (most, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def _mapped_bytes(page_bytes: int) -> int:
    """Return what this process has mapped: the first number of statm, in pages (proc(5))."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0]) * page_bytes
    except OSError:  # not Linux
        return 0


def _wait_for_job(descriptor: int, limits: WorkerLimits | None) -> None:
    if limits is None or limits.idle_s is None:
        return
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    if not poll.poll(limits.idle_s * 1000):
        os._exit(IDLE_CODE)


def _stop(_number: int, _frame: FrameType | None) -> None:
    """Leave as every Python does, so that what the jobs shared (an arena's template) is ended, and waited for."""
    if _State.stopped and not _State.busy:
        return  # it is leaving already
    _State.stopped = True
    raise KeyboardInterrupt


def _leave_with_parent(descriptor: int) -> None:
    """Clean up like an interrupted process once the parent, which holds the other end of the pipe, is gone."""
    poll = select.poll()
    poll.register(descriptor, 0)  # asks for no event: a pipe's other end that closes is reported in any case
    poll.poll()
    # as Ctrl-C would, so that a job leaves its `with` blocks; by force where that takes too long
    os.kill(os.getpid(), signal.SIGINT)
    threading.Event().wait(LEAVE_S)
    os._exit(1)


if __name__ == "__main__":
    main()
