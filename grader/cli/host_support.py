"""What this machine can run, and how safely: each part of the sandbox, and what a machine without ROS 1 can do.

Rows for `grader doctor` go out, and warnings before students' code is run. Nothing is changed.
"""

from __future__ import annotations

import locale
import os
import platform
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Literal, NamedTuple

from rich.table import Table
from rich.text import Text

from grader.arena.control_groups import describe, find_cgroups, has_memory
from grader.arena.sandbox import (
    NAMESPACES,
    ULIMIT_HINT,
    choose_sandbox,
    is_shown,
    last_error_line,
    refused_limits,
    words_to_drop_root,
)
from grader.arena.sandbox_files import missing_packages
from grader.cli.output import say_beside
from grader.errors import GraderError, HostError, RosMissing
from grader.host_programs import LISTS, LOCALHOST, LOCALHOST_HINT, find_host_program, resolves
from grader.installable import install_command
from grader.model import SandboxMode
from grader.portable import cores, system, user_id
from grader.report.sentences import without_sandbox
from grader.report.terminal import emit, open_console
from grader.report.text import visible
from grader.ros_env import (
    INSTALL_HINT,
    STANDINS,
    Need,
    RosInstallation,
    RosPackages,
    find_ros,
    look_for,
    ros_packages,
    why_nodes_cannot_run,
)
from grader.rubric.load import LoadedRubric, needs_ros
from grader.wording import join_words

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


class DoctorRow(NamedTuple):
    """A line of `grader doctor`. `missing`: not everything can be graded; `limited`: it can, but less well."""

    name: str
    state: Literal["ok", "limited", "missing"]
    detail: str
    fix: str = ""

    def for_json(self) -> dict[str, str]:
        """Return the row as `--json` prints it."""
        # the key is a part of the format
        return {"name": self.name, "state": self.state, "detail": self.detail, "mend": self.fix}


def sandbox_rows() -> Iterator[DoctorRow]:
    """Return a row for each part, then one for the sandbox that `--sandbox auto` chooses."""
    for name, package in PROGRAMS.items():
        yield program_row(name, find_host_program(name), "limited", f"apt-get install {package}")
    unshare = find_host_program("unshare") or "unshare"
    yield _probe(
        "user namespaces", [*words_to_drop_root(), unshare, "--user", "--pid", "--fork", "/bin/true"]
    )
    # -I: nothing that lies in the current folder or is set by the user is loaded
    yield _probe("network", [sys.executable, "-I", str(NAMESPACES), "/bin/true"])
    yield _limits_of_trees()
    yield from _inherited_rows()
    yield _limits_of_processes()
    yield _chosen_sandbox()


def program_row(name: str, path: str | None, without: Literal["limited", "missing"], fix: str) -> DoctorRow:
    """Return the row of a program: where it is, or what its lack means and how to fix that."""
    if path is None:
        return DoctorRow(name, without, "not found", fix)
    return DoctorRow(name, "ok", path)


def _probe(name: str, command: list[str]) -> DoctorRow:
    """Return whether namespaces of that kind can be made."""
    if reason := last_error_line(command):
        return DoctorRow(name, "limited", reason, _switch())
    return DoctorRow(name, "ok", "namespaces can be made")


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
        yield DoctorRow(limit.name, "missing" if limit.command else "ok", detail, limit.command)


def _limits_of_trees() -> DoctorRow:
    if find_cgroups().memory is not None:
        return DoctorRow("limits", "ok", describe())
    others = DELEGATE if has_memory() else OLD_GROUPS
    return DoctorRow("limits", "limited", describe(), ROOTS_GROUPS if user_id() == 0 else others)


def _limits_of_processes() -> DoctorRow:
    refused = refused_limits()
    if not refused:
        return DoctorRow("ulimit", "ok", "limits of students' processes can be set")
    return DoctorRow("ulimit", "missing", refused, ULIMIT_HINT)


def _chosen_sandbox() -> DoctorRow:
    try:
        sandbox = choose_sandbox("auto")
    except HostError as error:
        return DoctorRow("sandbox", "missing", error.message, error.hint)
    if sandbox.bubblewrap:
        return DoctorRow("sandbox", "ok", f"--sandbox auto takes {sandbox.label}")
    detail = f"{without_sandbox(sandbox.label)} --sandbox require refuses."
    return DoctorRow("sandbox", "limited", detail, "fix the rows above")


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
    yield DoctorRow(system(), "ok", f"can: {WITHOUT}")
    way = WAYS.get(system(), WAYS["macOS"])
    yield DoctorRow("ROS 1", "missing", f"cannot: {LACKS}", f"{way}; see {PAGE}")


def require_room(*, gradings: int) -> None:
    """Check that the limits inherited from the shell leave enough for so many gradings at a time. Raises HostError."""
    if sys.platform == "linux":
        from grader.arena.inherited_limits import make_room  # noqa: PLC0415 - other systems lack what it imports

        make_room(gradings=gradings)


STYLES = {"ok": "green", "limited": "yellow", "missing": "red"}
ROS_TOOLS = {"git": "git", "cmake": "cmake", "make": "make", "c++": "g++"}
ROS_PROGRAMS = ("catkin_make", "roslaunch", "rosrun", "rospack")
ROS_MODULES = {
    "rospy": "python3-rospy",
    "rosgraph": "python3-rosgraph",
    "rosmaster": "python3-rosmaster",
    "roslaunch": "python3-roslaunch",
    "std_msgs": "python3-std-msgs",
    "rosgraph_msgs": "python3-rosgraph-msgs",
    "geometry_msgs": "python3-geometry-msgs",
    "sensor_msgs": "python3-sensor-msgs",
}
FIND_MODULES = (
    "import importlib.util, sys; print(*[m for m in sys.argv[1:] if not importlib.util.find_spec(m)])"
)
ROOT = "root; students' code runs as an unprivileged user in the sandbox"
GIB = 1 << 30
MIN_MEMORY_BYTES, MIN_DISK_BYTES = GIB, GIB


def diagnose() -> tuple[DoctorRow, ...]:
    """Return every row, in the order in which things are needed; on other systems than Linux, only what helps there."""
    if system():
        # of all programs git alone is of use there: by it `check` says what is not pushed
        git = program_row("git", shutil.which("git"), "limited", "https://git-scm.com/downloads")
        return (_python(), git, *platform_rows(), *_resources(), _encoding())
    return (
        _python(),
        *(
            program_row(name, shutil.which(name), "missing", f"apt-get install {package}")
            for name, package in ROS_TOOLS.items()
        ),
        *_ros(),
        *sandbox_rows(),
        DoctorRow("user", "ok", ROOT if user_id() == 0 else f"uid {user_id()}"),
        _search_paths(),
        *_resources(),
        _hostname(),
        _encoding(),
    )


def diagnose_rubric(loaded: LoadedRubric) -> tuple[DoctorRow, ...]:
    """Return a row for each ROS package that the rubric's programs and types come from, and for what it `needs`."""
    packages, own, needs = ros_packages(), loaded.rubric.packages, loaded.rubric.needs
    needed = _needed_by_package(loaded)
    rows = [_package(name, needed[name], packages) for name in sorted(needed) if name not in own]
    brought = [DoctorRow(n, "ok", "beside the rubric; built when the lab is graded") for n in own]
    return (*rows, *brought, *map(_need, look_for(ros=(), apt=needs.apt, pip=needs.pip)))


def _need(need: Need) -> DoctorRow:
    state: Literal["ok", "missing"] = "ok" if need.here else "missing"
    detail = f"the rubric needs it ({need.kind})" + ("" if need.here else ": not installed")
    return DoctorRow(need.name, state, detail, "" if need.here else need.install)


def _needed_by_package(loaded: LoadedRubric) -> dict[str, list[str]]:
    """Return by package what the rubric asks of it, nothing where it only needs it; the student's own left out."""
    rubric = loaded.rubric
    names = [start.program for s in rubric.scenarios.values() for start in s.start if start.program]
    names += [probe.type for s in rubric.scenarios.values() for probe in s.probes]
    names += [call.type for s in rubric.scenarios.values() for call in s.calls]
    names += [served.type for s in rubric.scenarios.values() for served in s.serves]
    steps = [step for s in rubric.scenarios.values() for step in s.steps]
    names += [sent.type for step in steps if (sent := step.published) is not None]
    names += [asked.type for step in steps if (asked := step.call or step.action) is not None]
    names += [
        str(one.value)
        for criterion in rubric.criteria
        if (check := loaded.checks.get(criterion.check))
        for one in check.references(criterion.parameters)
        if one.to in {"program", "message", "service"} and one.value
    ]
    found: dict[str, list[str]] = {}
    for package, _, name in (one.partition("/") for one in dict.fromkeys(names)):
        if package not in rubric.package_names:
            found.setdefault(package, []).append(name)
    for package in rubric.needs.ros:
        found.setdefault(package, [])
    return found


def _package(name: str, asked: Sequence[str], packages: RosPackages) -> DoctorRow:
    folder = packages.folders.get(name)
    wanted = f"for {join_words(asked)}" if asked else "which the rubric needs"
    if folder is None:
        return DoctorRow(
            name, "missing", f"not installed, {wanted}", install_command(name, _distro(packages.ros))
        )
    if folder.is_relative_to(STANDINS):
        return DoctorRow(name, "ok", f"the grader's stand-in, {wanted}")
    if packages.ros is not None and not is_shown(folder, packages.ros):
        fix = "install its workspace below /opt (catkin_make install), and name that setup.bash in $GRADER_ROS_SETUP"
        return DoctorRow(name, "missing", f"{folder} is hidden from the sandbox, {wanted}", fix)
    return DoctorRow(name, "ok", f"{folder}, {wanted}")


def _distro(ros: RosInstallation | None) -> str:
    """Return the distribution of ROS's own repository; "" for Debian's ROS, or none."""
    return ros.distro if ros is not None and ros.kind == "setup" else ""


def _python() -> DoctorRow:
    return DoctorRow("Python", "ok", f"{platform.python_version()} ({sys.executable})")


def _ros() -> Iterator[DoctorRow]:
    try:
        ros = find_ros()
    except RosMissing as error:
        yield DoctorRow("ROS 1", "missing", error.message, error.hint)
        return
    if ros is None:
        yield DoctorRow("ROS 1", "missing", "not found", INSTALL_HINT)
        return
    yield DoctorRow("ROS 1", "ok", ros.label)
    for program in ROS_PROGRAMS:
        yield program_row(program, ros.program(program), "missing", INSTALL_HINT)
    yield from _modules(ros)
    yield _standins(ros)


def _modules(ros: RosInstallation) -> Iterator[DoctorRow]:
    """Look for ROS's Python packages with its own interpreter."""
    command = [ros.python, "-c", FIND_MODULES, *ROS_MODULES]
    try:
        done = subprocess.run(
            command,
            env=ros.env,
            cwd="/",  # `-c` looks into the current folder first, which may be a student's
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=True,
            timeout=20,
        )
    except (OSError, subprocess.SubprocessError) as error:
        yield DoctorRow("ROS's Python", "missing", f"{ros.python}: {error}", INSTALL_HINT)
        return
    missing = done.stdout.split()
    yield DoctorRow("ROS's Python", "ok", ros.python)
    for module, package in ROS_MODULES.items():
        if module in missing:
            fix = f"apt-get install {package}" if ros.kind == "debian" else INSTALL_HINT
            yield DoctorRow(module, "missing", f"{ros.python} cannot import it", fix)
        else:
            yield DoctorRow(module, "ok", "found")


def _standins(ros: RosInstallation) -> DoctorRow:
    missing = missing_packages(ros)
    detail = f"for {', '.join(missing)}, which this ROS lacks" if missing else "not needed for any package"
    return DoctorRow("stand-ins", "ok", detail)


def _search_paths() -> DoctorRow:
    """Look for entries that are not absolute paths: they mean the current folder, which may be a student's."""
    # without the variable, nothing is wrong with it
    odd = [name for name in LISTS if not all(map(os.path.isabs, os.environ.get(name, "/").split(os.pathsep)))]
    if not odd:
        return DoctorRow("search paths", "ok", "every entry is an absolute path")
    detail = f"{', '.join(odd)}: an entry means the current folder, so programs load files from there"
    fix = "write ${NAME:+$NAME:} before what you add, without an empty entry"
    return DoctorRow("search paths", "limited", detail, fix)


def _resources() -> Iterator[DoctorRow]:
    if (number := cores()) >= 2:
        yield DoctorRow("cores", "ok", str(number))
    else:
        detail = "1: runs take turns, and rates may be inconclusive"
        yield DoctorRow("cores", "limited", detail)
    if sys.platform != "win32":
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        yield _amount("memory", memory, MIN_MEMORY_BYTES, "GiB")
    folder = Path(tempfile.gettempdir())
    yield _amount("disk", shutil.disk_usage(folder).free, MIN_DISK_BYTES, f"GiB free in {folder}")


def _amount(name: str, size_bytes: int, least_bytes: int, unit: str) -> DoctorRow:
    enough = size_bytes >= least_bytes
    detail = f"{size_bytes / GIB:.1f} {unit}"
    detail += "" if enough else f"; {least_bytes / GIB:.0f} GiB is recommended"
    return DoctorRow(name, "ok" if enough else "limited", detail)


def _hostname() -> DoctorRow:
    """Look up the names by which ROS nodes look for their own machine."""
    name = socket.gethostname()
    if not resolves(LOCALHOST):
        detail = "localhost does not resolve: without a sandbox, roslaunch cannot start anything"
        return DoctorRow("host name", "limited", detail, LOCALHOST_HINT)
    if resolves(name):
        return DoctorRow("host name", "ok", f"{name} resolves")
    fix = f"echo '127.0.1.1 {name}' >> /etc/hosts"
    return DoctorRow("host name", "limited", f"{name} does not resolve", fix)


def _encoding() -> DoctorRow:
    name = locale.getpreferredencoding(do_setlocale=False)
    if name.lower().replace("-", "") == "utf8":
        return DoctorRow("encoding", "ok", name)
    detail = f"{name}: reports use plain characters"
    return DoctorRow("encoding", "limited", detail, "export LC_ALL=C.UTF-8")


def print_rows(rows: Sequence[DoctorRow], stream: IO[str]) -> None:
    """Print a row for each thing that grading needs, and what is missing."""
    grid = Table.grid(padding=(0, 2, 0, 0))
    for _ in range(2):
        grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for row in rows:
        grid.add_row(Text(row.state, STYLES[row.state]), Text(row.name), Text(visible(row.detail)))
        if row.fix:
            grid.add_row(Text(), Text("fix:", "bold"), Text(visible(row.fix), "bold"))
    missing = sum(row.state == "missing" for row in rows)
    verdict = f"{missing} missing: grading is not fully possible here." if missing else "Ready to grade."
    emit(open_console(stream), [grid, Text(f"\n{verdict}")])
