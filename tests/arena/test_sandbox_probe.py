"""When a grading goes without a sandbox, when it goes with one, and when it stops instead."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from grader.arena import sandbox
from grader.arena.sandbox import system_call_filter
from grader.errors import ExitCode, HostError, SandboxMissing
from grader.host_programs import HOST_ENV, find_host_program

FORBIDDEN = (
    (
        "bwrap: No permissions to create new namespace, likely because the kernel does not allow non-privileged user "
        "namespaces. See <https://deb.li/bubblewrap> or <file:///usr/share/doc/bubblewrap/README.Debian.gz>."
    ),
    (
        "bwrap: No permissions to creating new namespace, likely because the kernel does not allow non-privileged user "
        "namespaces. On e.g. debian this can be enabled with 'sysctl kernel.unprivileged_userns_clone=1'."
    ),
    (
        "bwrap: Creating new namespace failed, likely because the kernel does not support user namespaces.  "
        "bwrap must be installed setuid on such systems."
    ),
    "bwrap: Creating new namespace failed: nesting depth or /proc/sys/user/max_*_namespaces exceeded (ENOSPC)",
    "bwrap: Creating new namespace failed: Operation not permitted",
    "bwrap: setting up uid map: Permission denied",
    "bwrap: Failed to make / slave: Permission denied",
    "bwrap: Can't mount proc on /newroot/proc: Operation not permitted",
    "bwrap: pivot_root: Invalid argument",
    "[Errno 1] no namespaces of its own: Operation not permitted",
    "[Errno 28] no namespaces of its own: No space left on device",
    "no namespaces of its own: Operation not permitted",
    "[Errno 1] Operation not permitted",
    "[Errno 13] Permission denied: '/proc/self/uid_map'",
)
UNKNOWN = (
    "bwrap: Creating new namespace failed: Resource temporarily unavailable",
    "bwrap: Creating new namespace failed: Cannot allocate memory",
    "bwrap: Can't fork for pid 1: Resource temporarily unavailable",
    "bwrap: Can't read /proc/sys/kernel/overflowuid: No such file or directory",
    "bwrap: Unexpected setuid user 65534, should be 0",
    "bwrap: execvp /bin/true: No such file or directory",
    "bwrap: error while loading shared libraries: libcap.so.2: cannot open shared object file: Permission denied",
    "setpriv: setresuid failed: Operation not permitted",
    "PermissionError: [Errno 13] Permission denied: '/usr/bin/bwrap'",
    "MemoryError",
    "exit code -9",
    "no answer within 20 s",
)


@pytest.fixture(autouse=True)
def _asked_again():
    sandbox._walls.cache_clear()
    yield
    sandbox._walls.cache_clear()


def bwrap(folder: Path, monkeypatch, script: str) -> None:
    """This program in bubblewrap's place, where the student's user finds it too."""
    path = folder / "bwrap"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)
    found = {**{name: find_host_program(name) for name in sandbox.PROGRAMS}, "bwrap": str(path)}
    monkeypatch.setattr(sandbox, "find_host_program", found.get)
    monkeypatch.setattr(sandbox, "NAMESPACES", Path(__file__).parent / "no_network.py")
    monkeypatch.setattr(sandbox, "words_to_drop_root", list)


@pytest.mark.parametrize("said", FORBIDDEN)
def test_where_the_kernel_forbids_it_grading_goes_without(monkeypatch, said: str) -> None:
    monkeypatch.setattr(sandbox, "_refusal", lambda *_: said)
    assert sandbox.why_no_sandbox() == said
    assert (sandbox.choose_sandbox("auto").bubblewrap, sandbox.choose_sandbox("auto").reason) == (False, said)
    with pytest.raises(SandboxMissing):
        sandbox.choose_sandbox("require")


@pytest.mark.parametrize("said", UNKNOWN)
@pytest.mark.parametrize("mode", ["auto", "require"])
def test_an_answer_that_is_not_known_stops_the_grading(monkeypatch, said: str, mode) -> None:
    monkeypatch.setattr(sandbox, "_refusal", lambda *_: said)
    with pytest.raises(SandboxMissing) as caught:
        sandbox.choose_sandbox(mode)
    assert caught.value.exit_code == ExitCode.NOT_GRADED
    assert said in caught.value.message
    assert "--sandbox none" in caught.value.hint
    assert not sandbox.choose_sandbox("none").bubblewrap


def test_a_bubblewrap_that_does_not_answer_stops_the_grading(tmp_path, monkeypatch) -> None:
    bwrap(tmp_path, monkeypatch, "exec sleep 60")
    monkeypatch.setattr(sandbox, "PROBE_S", 0.5)
    with pytest.raises(SandboxMissing, match=r"no answer within 0\.5 s"):
        sandbox.choose_sandbox("auto")


def test_what_did_not_answer_is_asked_again(monkeypatch) -> None:
    monkeypatch.setattr(sandbox, "_refusal", lambda *_: "no answer within 20 s")
    with pytest.raises(SandboxMissing):
        sandbox.why_no_sandbox()
    monkeypatch.setattr(sandbox, "_refusal", lambda *_: "")
    assert sandbox.why_no_sandbox() == ""


@pytest.mark.parametrize("name", sandbox.PROGRAMS)
def test_where_a_program_is_not_installed_grading_goes_without(monkeypatch, name: str) -> None:
    monkeypatch.setattr(
        sandbox, "find_host_program", lambda asked: None if asked == name else f"/usr/bin/{asked}"
    )
    assert sandbox.why_no_sandbox() == f"{name} is not installed"


def test_a_program_that_cannot_be_started_stops_the_grading(tmp_path, monkeypatch) -> None:
    bwrap(tmp_path, monkeypatch, "exit 0")
    monkeypatch.setattr(sandbox.sys, "executable", str(tmp_path / "no-python"))
    with pytest.raises(SandboxMissing, match="No such file"):
        sandbox.choose_sandbox("auto")


@pytest.mark.parametrize(
    ("first", "nesting"),
    [
        ("", False),
        ("bwrap: Unknown option --disable-userns", True),
        ("bwrap: cannot open /proc/sys/user/max_user_namespaces: Read-only file system", True),
        ("bwrap: sysctl user.max_user_namespaces = 1: Permission denied", True),
        ("bwrap: creation of new user namespaces was not disabled as requested", True),
    ],
)
def test_namespaces_in_the_sandbox_are_allowed_only_where_they_cannot_be_forbidden(
    monkeypatch, first: str, nesting: bool
) -> None:
    monkeypatch.setattr(sandbox, "_refusal", lambda *more: first if more else "")
    assert sandbox.choose_sandbox("auto").bubblewrap
    assert sandbox.choose_sandbox("auto").nesting is nesting


def test_a_probe_that_fails_only_now_allows_no_namespaces_in_the_sandbox(monkeypatch) -> None:
    busy = "bwrap: Creating new namespace failed: Resource temporarily unavailable"
    monkeypatch.setattr(sandbox, "_refusal", lambda *more: busy if more else "")
    with pytest.raises(SandboxMissing, match="Resource temporarily unavailable"):
        sandbox.choose_sandbox("auto")


def test_the_probe_sees_nothing_of_whoever_grades(tmp_path, monkeypatch) -> None:
    bwrap(tmp_path, monkeypatch, f"{{ pwd; env; }} >{tmp_path}/seen; cat >{tmp_path}/input")
    for name in ("PATH", "LD_LIBRARY_PATH", "PYTHONPATH", "BASH_ENV", "LC_ALL"):
        monkeypatch.setenv(name, str(tmp_path))
    assert sandbox.why_no_sandbox() == ""
    lines = (tmp_path / "seen").read_text().splitlines()
    assert lines[0] == "/"
    assert (tmp_path / "input").read_bytes() == (system_call_filter() or b"")
    own = {"PWD", "OLDPWD", "SHLVL", "_", "LC_CTYPE"}
    seen = dict(line.split("=", 1) for line in lines[1:])
    assert {name: value for name, value in seen.items() if name not in own} == HOST_ENV


def test_root_who_may_not_become_a_student_is_told_so(monkeypatch) -> None:
    monkeypatch.setattr(
        sandbox, "refused_limits", lambda: "setpriv: setresuid failed: Operation not permitted"
    )
    with pytest.raises(HostError) as caught:
        sandbox.choose_sandbox("auto")
    assert "CAP_SETUID" in caught.value.hint


@pytest.mark.skipif(os.geteuid() != 0, reason="root gives up what it may do")
def test_limits_are_asked_for_as_the_user_who_gets_them(monkeypatch) -> None:
    """Root may raise a limit that its student's user may not."""
    command = sandbox.words_to_drop_root()
    assert Path(command[0]).name == "setpriv"
    asked: list[list[str]] = []
    monkeypatch.setattr(sandbox, "last_error_line", lambda argv: asked.append(argv) or "")
    sandbox.refused_limits.cache_clear()
    try:
        assert sandbox.refused_limits() == ""
    finally:
        sandbox.refused_limits.cache_clear()
    assert asked[0][: len(command)] == command


def test_without_a_sandbox_the_machine_has_to_know_localhost(monkeypatch) -> None:
    """`roslaunch` asks for its address; in a sandbox there is a file of its own."""
    monkeypatch.setattr(sandbox, "resolves", lambda name: name != "localhost")
    assert sandbox.choose_sandbox("require").bubblewrap
    with pytest.raises(HostError, match="localhost does not resolve") as caught:
        sandbox.choose_sandbox("none")
    assert caught.value.hint == "echo '127.0.0.1 localhost' >> /etc/hosts"
