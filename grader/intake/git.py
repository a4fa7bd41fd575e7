"""git as a subprocess that asks nothing, ends in time, and runs nothing that a repository brings along."""

from __future__ import annotations

import os
import re
import select
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from grader.host_programs import find_user_program, git_setting, loading_environment, with_absolute_paths
from grader.intake.credentials import SILENT, Access, is_refusal, scrubbed
from grader.portable import own_session

# no setting may run a program, change a file on its way to the disk, or leave a process behind
_QUIET = {
    "core.hooksPath": os.devnull,
    "core.fsmonitor": "false",
    "core.pager": "cat",
    "core.autocrlf": "false",
    "core.symlinks": "true",
    "credential.interactive": "false",
    "fetch.recurseSubmodules": "false",
    "submodule.recurse": "false",
    "protocol.ext.allow": "never",
    "gc.auto": "0",
    "maintenance.auto": "false",
    "core.protectHFS": "true",
    "core.protectNTFS": "true",
    "core.bigFileThreshold": "16m",
    "credential.guiPrompt": "false",
}
# Of each of git's processes: a pack (or a list of refs) is one file, and a delta can stand for any size.
_FILE_BYTES = 180 << 20
_MEMORY_BYTES = 2 << 30
# What a hook or another git sets (GIT_DIR, GIT_INDEX_FILE, …) would lead us to another repository; what says
# how to reach a server stays.
_NETWORK_KEPT = re.compile(
    r"GIT_(SSH.*|SSL_.*|PROXY_.*|HTTP_.*|CONFIG_(GLOBAL|SYSTEM|NOSYSTEM|COUNT|(KEY|VALUE)_\d+)|EXEC_PATH)"
)
_ANSWER_BYTES = 16 << 20
_SILENCE_S = 20.0
_SAID_BYTES = 64 << 10
# Windows has no such signal; a program that git starts reports it as 128 + its number
_XFSZ = int(getattr(signal, "SIGXFSZ", 25))
_TOO_LARGE = (-_XFSZ, 128 + _XFSZ)
_TOO_MUCH = re.compile(r"File too large|signal 25\b|[Oo]ut of memory|cannot allocate|mmap failed")


class GitFailed(Exception):
    """git ended with an error; `stderr` is what it said, in English."""

    def __init__(self, stderr: str) -> None:
        super().__init__(stderr)
        self.stderr = stderr


class GitMissing(GitFailed):
    """There is no git on this machine."""


class GitTimeout(GitFailed):
    """git was stopped because its time was up."""


class GitTooMuch(GitFailed):
    """git was stopped because it wrote more than a submission may be."""


@dataclass(frozen=True, kw_only=True)
class Repository:
    """Where git is to look, so that it never goes and finds a repository by itself: one may lie in any folder."""

    git_dir: Path
    top: Path


class Git:
    """All calls together take at most `timeout_s`. `home` is a folder of ours for git's own settings."""

    def __init__(self, home: Path, *, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._deadline = time.monotonic() + timeout_s
        self.home = home
        self._ssh_command: str | None = None
        home.mkdir(parents=True, exist_ok=True)
        # Only a file of settings is heeded for this key by every git since 2.25, by `upload-pack` too.
        (home / ".gitconfig").write_text("[safe]\n\tdirectory = *\n", encoding="utf-8")

    def run(
        self,
        *args: str,
        cwd: Path,
        repository: Repository | None = None,
        remote: bool = False,
        accesses: tuple[Access, ...] = (Access(),),
    ) -> bytes:
        """Return what `git *args` prints in `cwd`. `remote` lets it use the network and the user's own settings; of the
        `accesses` each is tried where the server did not let git in with those before.

        Raises GitFailed, GitMissing or GitTimeout.
        """
        first, *others = accesses
        try:
            return self._run(args, cwd, repository, remote=remote, access=first)
        except GitFailed as failure:
            if not others or not is_refusal(failure.stderr):
                raise
        return self.run(*args, cwd=cwd, repository=repository, remote=remote, accesses=tuple(others))

    def _run(
        self, args: tuple[str, ...], cwd: Path, repository: Repository | None, *, remote: bool, access: Access
    ) -> bytes:
        if time.monotonic() >= self._deadline:
            raise GitTimeout(f"no answer within {self.timeout_s:g} s")
        # files, because their size is limited (`_limits`), and no pipe can fill up
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            whole = (*access.options, *_place(repository), *args)
            environment = self._environment(cwd, access) if remote else self._local_environment()
            with self._start(whole, cwd, environment, stdout=out, stderr=err) as process:
                try:
                    code = process.wait(max(0.0, self._deadline - time.monotonic()))
                except subprocess.TimeoutExpired:
                    raise GitTimeout(f"no answer within {self.timeout_s:g} s") from None
            out.seek(0)
            err.seek(0)
            if code in _TOO_LARGE:
                raise GitTooMuch("larger than the limit")
            if code != 0:
                said = scrubbed(err.read(_SAID_BYTES).decode("utf-8", "replace"), access.secrets)
                raise GitTooMuch(said) if _TOO_MUCH.search(said) else GitFailed(said)
            answer = out.read(_ANSWER_BYTES + 1)
        if len(answer) > _ANSWER_BYTES:
            raise GitTooMuch(f"git {args[0]} does not finish")
        return answer

    def records(self, *args: str, cwd: Path, repository: Repository) -> Generator[bytes]:
        """Yield the NUL-ended records that git prints, one by one, so that a caller can stop an endless listing."""
        whole = (*_place(repository), *args)
        environment = self._local_environment()
        with self._start(
            whole, cwd, environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        ) as process:
            stream = process.stdout
            assert stream is not None  # noqa: S101 - opened with PIPE
            rest = b""
            with stream, self._ended_in_time(process):
                while block := self._read(stream.fileno()):
                    *ended, rest = (rest + block).split(b"\0")
                    yield from ended
            if process.wait() != 0:
                raise GitFailed(f"git {args[0]} failed")

    def _read(self, descriptor: int) -> bytes:
        """Return what there is, as soon as there is something; b"" at the end. Raises GitTimeout after a silence: git
        can look through empty folders for years."""
        left_s = min(max(0.0, self._deadline - time.monotonic()), _SILENCE_S)
        if sys.platform == "win32":  # no pipe can be asked there; git's own end comes by `_ended_in_time`
            return os.read(descriptor, 1 << 16)
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        if not poll.poll(left_s * 1000):
            raise GitTimeout(f"not finished within {min(self.timeout_s, _SILENCE_S):g} s")
        return os.read(descriptor, 1 << 16)

    @contextmanager
    def _ended_in_time(self, process: subprocess.Popen[bytes]) -> Iterator[None]:
        """Where output cannot be waited for with a limit (Windows), the process is ended when its time is up."""
        if sys.platform != "win32":
            yield
            return
        timer = threading.Timer(max(0.0, self._deadline - time.monotonic()), process.kill)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    @contextmanager
    def _start(
        self,
        args: tuple[str, ...],
        cwd: Path,
        environment: Mapping[str, str],
        *,
        stdout: IO[bytes] | int,
        stderr: IO[bytes] | int,
    ) -> Iterator[subprocess.Popen[bytes]]:
        options = [part for key, value in _QUIET.items() for part in ("-c", f"{key}={value}")]
        git = find_user_program("git")
        if git is None:
            raise GitMissing("git is not installed")
        command = [*_limits(), git, *options, *args]
        with own_session(command, cwd=cwd, env=environment, stdout=stdout, stderr=stderr) as process:
            yield process

    def _local_environment(self) -> dict[str, str]:
        """Return the variables for repositories on this machine: no settings but ours, so no filter and no network."""
        return {
            **loading_environment(os.environ),
            **_ASK_NOTHING,
            "HOME": str(self.home),
            "GIT_CONFIG_GLOBAL": str(self.home / ".gitconfig"),
            "GIT_CONFIG_NOSYSTEM": "1",
            "GIT_ALLOW_PROTOCOL": "file",
            "GIT_NO_LAZY_FETCH": "1",
        }

    def _environment(self, cwd: Path, access: Access) -> dict[str, str]:
        """Return the variables for servers: the user's settings hold the credentials, the proxy, perhaps a mirror."""
        kept = {
            key: value
            for key, value in with_absolute_paths(os.environ).items()
            if not key.startswith("GIT_") or _NETWORK_KEPT.fullmatch(key)
        }
        environment = {**kept, **_ASK_NOTHING, "GIT_ALLOW_PROTOCOL": "https:http:ssh:git:file"}
        # git prefers GIT_SSH_COMMAND, so it may not take the place of a program that the user has chosen
        if "GIT_SSH" not in kept or "GIT_SSH_COMMAND" in kept:
            environment["GIT_SSH_COMMAND"] = self._ssh(kept, cwd)
        return {**environment, **access.environment}

    def _ssh(self, environment: dict[str, str], cwd: Path) -> str:
        """Return the user's ssh command, told to fail where it would ask and to leave no connection open."""
        if self._ssh_command is None:
            self._ssh_command = (
                environment.get("GIT_SSH_COMMAND")
                or git_setting("core.sshCommand", environment, cwd)
                or "ssh"
            )
        try:
            is_openssh = Path(shlex.split(self._ssh_command)[0]).name == "ssh"
        except (ValueError, IndexError):
            is_openssh = False
        # PuTTY's plink and others do not know these options
        return self._ssh_command + (" -o BatchMode=yes -o ControlMaster=no" if is_openssh else "")


_ASK_NOTHING = {
    **SILENT,
    "LC_ALL": "C",
    "SSH_ASKPASS_REQUIRE": "never",
    "GIT_LFS_SKIP_SMUDGE": "1",  # else a checkout would fetch what LFS's pointers stand for
    "GIT_OPTIONAL_LOCKS": "0",
}


def _place(repository: Repository | None) -> tuple[str, ...]:
    if repository is None:
        return ()
    return (f"--git-dir={repository.git_dir}", f"--work-tree={repository.top}")


def _limits() -> tuple[str, ...]:
    """Return the command that limits git and all that it starts, and ends git when the grader is killed. Where there is
    no `prlimit`, there is no ROS either, nor a sandbox."""
    setpriv, prlimit = find_user_program("setpriv"), find_user_program("prlimit")
    if setpriv is None or prlimit is None:
        return ()
    return (
        setpriv,
        "--pdeathsig",
        "KILL",
        prlimit,
        f"--fsize={_FILE_BYTES}",
        f"--as={_MEMORY_BYTES}",
        "--core=0",
        "--",
    )
