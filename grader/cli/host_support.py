"""What this machine can run, and how safely: each part of the sandbox, and what a machine without ROS 1 can do.

Rows for `grader doctor` go out, and warnings before students' code is run. What else is looked at is in `doctor`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Literal

from pydantic import AliasChoices, Field

from grader.arena.control_groups import describe, find_cgroups, has_memory
from grader.arena.sandbox import (
    NAMESPACES,
    ULIMIT_HINT,
    choose_sandbox,
    last_error_line,
    refused_limits,
    words_to_drop_root,
)
from grader.cli.output import say_beside
from grader.errors import GraderError, HostError, RosMissing
from grader.host_programs import find_host_program
from grader.model import SandboxMode
from grader.model.record import Record
from grader.portable import system, user_id
from grader.report.sentences import without_sandbox
from grader.ros_env import why_nodes_cannot_run
from grader.rubric.load import LoadedRubric, needs_ros

PROGRAMS = {"bwrap": "bubblewrap", "setpriv": "util-linux", "prlimit": "util-linux"}
SETTINGS = Path("/proc/sys")
SWITCHES = {
    "kernel/unprivileged_userns_clone": ("0", "sysctl -w kernel.unprivileged_userns_clone=1"),
    "user/max_user_namespaces": ("0", "sysctl -w user.max_user_namespaces=10000"),
    "kernel/apparmor_restrict_unprivileged_userns": (
        "1",
        "sysctl -w kernel.apparmor_restrict_unprivileged_userns=0",
    ),
}
CONTAINER = "in a container: start it with --privileged, or with --security-opt seccomp=unconfined apparmor=unconfined"
DELEGATE = "loginctl enable-linger, or systemd-run --user --scope -p Delegate=yes grader …, or run it as root"
OLD_GROUPS = "run it as root, or boot with cgroup v2 (systemd.unified_cgroup_hierarchy=1)"
ROOTS_GROUPS = "in a container: start it with --privileged; in a service: Delegate=yes in its unit"
PAGE = "docs/how-to/without-ros.md"
WAYS = {
    "Windows": "WSL 2 or the Docker image",
    "macOS": "the Docker image",
    "": "grader doctor, RoboStack or the Docker image",
}
WITHOUT = "check --static, judge, report, explain, labs, rubric validate"
LACKS = "grade, record, and check beyond the files: ROS 1 nodes run on Linux"


class DoctorRow(Record):
    """A line of `grader doctor`. `missing`: not everything can be graded; `limited`: it can, but less well."""

    name: str
    state: Literal["ok", "limited", "missing"]
    detail: str
    fix: str = Field(default="", validation_alias=AliasChoices("mend", "fix"), serialization_alias="mend")


def sandbox_rows() -> Iterator[DoctorRow]:
    """Return a row for each part, then one for the sandbox that `--sandbox auto` chooses."""
    yield from map(_program, PROGRAMS)
    unshare = find_host_program("unshare") or "unshare"
    yield _probe(
        "user namespaces", [*words_to_drop_root(), unshare, "--user", "--pid", "--fork", "/bin/true"]
    )
    yield _probe("network", [sys.executable, "-I", str(NAMESPACES), "/bin/true"])
    yield _limits_of_trees()
    yield from _inherited_rows()
    yield _limits_of_processes()
    yield _chosen_sandbox()


def _program(name: str) -> DoctorRow:
    return program_row(name, find_host_program(name), "limited", f"apt-get install {PROGRAMS[name]}")


def program_row(name: str, path: str | None, without: Literal["limited", "missing"], fix: str) -> DoctorRow:
    """Return the row of a program: where it is, or what its lack means and how to fix that."""
    if path is None:
        return DoctorRow(name=name, state=without, detail="not found", fix=fix)
    return DoctorRow(name=name, state="ok", detail=path)


def _probe(name: str, command: list[str]) -> DoctorRow:
    """Return whether namespaces of that kind can be made."""
    if reason := last_error_line(command):
        return DoctorRow(name=name, state="limited", detail=reason, fix=_switch())
    return DoctorRow(name=name, state="ok", detail="namespaces can be made")


def _switch() -> str:
    """Return the command that lifts the kernel's ban on it, if a setting forbids it."""
    for name, (forbidding, fix) in SWITCHES.items():
        path = SETTINGS / name
        if path.is_file() and path.read_text(errors="replace").strip() == forbidding:
            return fix
    return CONTAINER


def _inherited_rows() -> Iterator[DoctorRow]:
    from grader.arena.inherited_limits import group, limits  # noqa: PLC0415 - other systems lack what it imports

    for limit in (*limits(), *group()):
        detail = f"{limit.what}: {limit.found}; a run needs {limit.needed}"
        yield DoctorRow(
            name=limit.name, state="missing" if limit.command else "ok", detail=detail, fix=limit.command
        )


def _limits_of_trees() -> DoctorRow:
    if find_cgroups().memory is not None:
        return DoctorRow(name="limits", state="ok", detail=describe())
    others = DELEGATE if has_memory() else OLD_GROUPS
    return DoctorRow(
        name="limits", state="limited", detail=describe(), fix=ROOTS_GROUPS if user_id() == 0 else others
    )


def _limits_of_processes() -> DoctorRow:
    refused = refused_limits()
    if not refused:
        return DoctorRow(name="ulimit", state="ok", detail="limits of students' processes can be set")
    return DoctorRow(name="ulimit", state="missing", detail=refused, fix=ULIMIT_HINT)


def _chosen_sandbox() -> DoctorRow:
    try:
        sandbox = choose_sandbox("auto")
    except HostError as error:
        return DoctorRow(name="sandbox", state="missing", detail=error.message, fix=error.hint)
    if sandbox.bubblewrap:
        return DoctorRow(name="sandbox", state="ok", detail=f"--sandbox auto takes {sandbox.label}")
    detail = f"{without_sandbox(sandbox.label)} --sandbox require refuses."
    return DoctorRow(name="sandbox", state="limited", detail=detail, fix="fix the rows above")


def warn_without_sandbox(mode: SandboxMode, rubric: LoadedRubric | None = None) -> None:
    """Warn on stderr that students' code will run without a sandbox, if it will.

    A rubric that runs nothing needs no warning; if no sandbox can be chosen, the grading itself says so.
    """
    with suppress(GraderError):
        if (rubric is not None and not needs_ros(rubric)) or why_nodes_cannot_run():
            return
        words = without_sandbox(choose_sandbox(mode).label)
        if words:
            say_beside(words)


def why_nothing_runs() -> str:
    """Return why `grader check` only looks at files on this machine, or "" if it can run nodes."""
    with suppress(RosMissing):  # if ROS is not where GRADER_ROS_SETUP says, the grading reports it
        return why_nodes_cannot_run()
    return ""


def how_to_run_nodes() -> tuple[str, str]:
    """Return two lines: that only files were checked, and how to check the rest."""
    here = f"Only your files were checked: {why_nothing_runs()}."
    way = WAYS.get(system(), WAYS["macOS"])
    return here, f"For the rest: {way}; see {PAGE}."


def platform_rows() -> Iterator[DoctorRow]:
    """Return what can and cannot be done on a system other than Linux."""
    yield DoctorRow(name=system(), state="ok", detail=f"can: {WITHOUT}")
    way = WAYS.get(system(), WAYS["macOS"])
    yield DoctorRow(name="ROS 1", state="missing", detail=f"cannot: {LACKS}", fix=f"{way}; see {PAGE}")


def require_room(*, gradings: int) -> None:
    """Check that the limits inherited from the shell leave enough for so many gradings at a time. Raises HostError."""
    if sys.platform == "linux":
        from grader.arena.inherited_limits import make_room  # noqa: PLC0415 - other systems lack what it imports

        make_room(gradings=gradings)
