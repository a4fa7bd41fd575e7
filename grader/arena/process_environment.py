"""The folders and the environment that one submission's processes see, and the process specs made from them."""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

from grader.arena.limits import RunLimits
from grader.arena.sandbox import Sandbox, Word, copy_of, scratch, system_call_filter
from grader.arena.sandbox_files import (
    BASE_WORKSPACE,
    BUILT,
    COURSE,
    HOME,
    INSIDE_WORKSPACE,
    LARGE,
    OUTPUT,
    SHIMS,
    SOURCES,
    STANDIN_SOURCES,
    STANDINS,
    with_course,
    with_standins,
)
from grader.arena.workspace import Built, Workspace, read_archive, read_folder
from grader.evidence.decode import FindText
from grader.evidence.message_values import action_texts
from grader.files import read_untrusted
from grader.host_programs import HOST_PATH, find_host_program
from grader.ros_env import RosInstallation

TEXT_BYTES_MAX = 64 << 10
LOOPBACK = "127.0.0.1"
"""As an address: not every machine knows the name localhost."""
# What `stdbuf -oL` preloads: a C++ program's `printf` into a pipe would come only at its end.
LIBSTDBUF = Path("/usr/libexec/coreutils/libstdbuf.so")
HEAD = (
    "echo >&{lifeline} && read -r _ <&{lifeline} && exec {lifeline}>&-"
    ' && mapfile -d "" -t words <&{words} && exec {words}<&- || exit 125; '
)
"""The first thing that runs says that it is there and waits for leave: an arena that has died gives none. Then it reads
its variables and arguments (`ros/launching.py`)."""
TAKE = 'export -- "${words[@]:1:words[0]}"; set -- "${words[@]:1+words[0]}"; unset words; '
"""From here on what is the package's holds: until then, every program runs as it does anywhere."""
RUN = 'cd "$HOME" && exec "$@"'
RUN_AS_NUMBER = 'cd "$HOME" && trap : INT TERM && { for ((n = 1; n < %d; n++)); do (:); done; "$@"; exit; }'
"""In its sandbox, every process tree counts its processes from 1. So that those of one run that are named after their
number have different ones, each but the first is run as a later child of its shell, which waits for it."""
COPY = (
    f"[ -e {INSIDE_WORKSPACE} ] || {{ mkdir {INSIDE_WORKSPACE}"
    f" && cp -R --preserve=mode,links {SOURCES} {INSIDE_WORKSPACE}/"
    f" && {{ [ ! -e {BUILT} ] || tar -xpf {BUILT} -C {INSIDE_WORKSPACE} devel 2>/dev/null || true; }}; }} || exit 125; "
)
"""Each process tree has a workspace of its own: the sources, and what the build made of them. One that is started again
finds what it left there."""
BUILD_COPY = (
    f"mkdir {INSIDE_WORKSPACE} && cp -R --preserve=mode,links {SOURCES} {INSIDE_WORKSPACE}/"
    f" && {{ [ ! -e {BASE_WORKSPACE} ] || tar -xmf {BASE_WORKSPACE} -C {INSIDE_WORKSPACE} build"
    f" || rm -rf {INSIDE_WORKSPACE}/build; }} || exit 125; "
)
BUILD_RUN = (
    'cd "$HOME" && { "$@" {collect}>&-; code=$?; }; '
    f"tar -cf - -C {INSIDE_WORKSPACE} --ignore-failed-read devel -C {OUTPUT} . >&{{collect}} 2>/dev/null; exit $code"
)
"""What the build made is handed over through a pipe, whatever came of it. The base workspace is as old as the build."""
ARCHIVE = "built.tar"
BASE = "base.tar"
NO_DISPLAY = ":99"
"""There is no screen behind it. A script that asks for `$DISPLAY` before it opens a page finds one, as on a desktop."""
STAGE = "stage"
"""The folder over which the arena mounts what sandboxes see (`Stage` in `ros/namespaces.py`)."""
OUTPUT_FILES = 1_000
OWN_VARIABLES = (
    "ROS_MASTER_URI",
    "ROS_IP",
    "ROS_HOSTNAME",
    "ROS_HOME",
    "ROS_LOG_DIR",
    "ROSCONSOLE_CONFIG_FILE",
)
"""The arena's to set: what a package's environment hooks say of them would lead its nodes elsewhere."""
SERVICE_TYPES_MAX = 500
UNLESS_SAID: Mapping[str, Any] = {"script": None, "repairs": (), "stdin": False, "keeps": (), "again": False}
"""What a process's spec has where nothing else is asked for."""
SOURCE_ENDINGS = frozenset({"", ".py", ".cpp", ".cc", ".cxx", ".h", ".hpp"})
SOURCES_MAX, SOURCE_BYTES_MAX = 200, 256 << 10


@dataclass(frozen=True, kw_only=True)
class ProcessEnvironment:
    """`folder` is this submission's own, `env` what the built workspace's `setup.bash` adds. `sees_course`: processes
    see the packages that the rubric brings along, if it does. `missing` are those of the lab's packages, by name, that
    were not handed in."""

    folder: Path
    ros: RosInstallation
    sandbox: Sandbox
    limits: RunLimits
    workspace: Workspace
    package: str
    env: dict[str, str] = field(default_factory=dict)
    sees_course: bool = True
    missing: frozenset[str] = frozenset()

    def of(self, package: str | None) -> ProcessEnvironment | None:
        """Return the same for one of the lab's packages, by its name in the rubric, None for the main one; None where
        it was not handed in."""
        if package in self.missing:
            return None
        workspace = self.workspace.others.get(package or "")
        return replace(self, workspace=workspace, package=workspace.name) if workspace else self

    @property
    def course(self) -> Path:
        """The workspace of the packages that the rubric brings along (`base_workspace.py`), if it does."""
        return self.folder / "course"

    @property
    def archive(self) -> Path:
        """What the build handed over, where it ran in a sandbox."""
        return self.workspace.kept / ARCHIVE

    @property
    def base(self) -> Path:
        """The base workspace for this place's build (`base_workspace.py`), where there is one."""
        return self.workspace.kept / BASE

    @cached_property
    def built(self) -> Built:
        """Return what `rosrun` finds of the build. Ask only once the build is over."""
        if self.sandbox.bubblewrap:
            return read_archive(self.archive, self.package)
        return read_folder(self.workspace.built / "devel", self.package)

    @property
    def inside_workspace(self) -> str:
        """Where processes find the workspace."""
        return INSIDE_WORKSPACE if self.sandbox.bubblewrap else str(self.workspace.built)

    @property
    def output(self) -> str:
        """Where the build may leave files for the grader."""
        return OUTPUT if self.sandbox.bubblewrap else str(self.folder / "home")

    @property
    def package_folder(self) -> str:
        return f"{self.inside_workspace}/src/{self.workspace.folder}"

    @property
    def shims(self) -> str:
        """Where processes find `python` and the grader's helpers."""
        return SHIMS if self.sandbox.bubblewrap else str(self.folder / "bin")

    @property
    def standins(self) -> str:
        """Where processes find the packages that stand in for missing ones."""
        return STANDINS if self.sandbox.bubblewrap else str(self.folder / "standins")

    def from_source(self) -> ProcessEnvironment:
        """Return the environment without a build, in which ROS still finds the package's sources."""
        path = f"{self.inside_workspace}/src:{self.ros.env.get('ROS_PACKAGE_PATH', '')}"
        return replace(self, env={"ROS_PACKAGE_PATH": path.rstrip(":")})

    def find_program(self, script: str) -> tuple[str, str] | None:
        """Return what `rosrun` would start for a script: (its path for a process, its path in the package), or None.

        A program that the build installed wins, as with `rosrun`; then the script's own place, then any other.
        """
        name = Path(script).name
        found = self.script_path(script)
        # `rosrun` looks in devel/lib first.
        if name in self.built.programs:
            return f"{self.devel_programs}/{name}", found or script
        if found is None:
            return None
        return f"{self.package_folder}/{found}", found

    @property
    def devel_programs(self) -> str:
        """Where the build puts the package's programs, as processes see it."""
        return f"{self.inside_workspace}/devel/lib/{self.package}"

    @property
    def share_folders(self) -> tuple[Path, ...]:
        """Folders that hold installed packages side by side, the stand-ins' last."""
        known = [Path(p) / "share" for p in self.ros.prefixes]
        known += [Path(p) for p in self.ros.env.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
        return (self.course / "src", *known, self.folder / "standins" / "share", STANDIN_SOURCES)

    def type_text(self, type_: str, kind: str) -> str | None:
        """Return the text of `<package>/<kind>/<Name>.<kind>`: the student's own, ROS's, or a stand-in's.

        Raises ValueError where it is too large.
        """
        package, _, name = type_.partition("/")
        own = self.workspace.repaired / package
        for folder in (own, *(share / package for share in self.share_folders)):
            data = read_untrusted(folder / kind / f"{name}.{kind}", TEXT_BYTES_MAX + 1)
            if data is not None and len(data) > TEXT_BYTES_MAX:
                raise ValueError(f"{name}.{kind} is larger than {TEXT_BYTES_MAX >> 10} kB")
            if data is not None:
                return data.decode(errors="replace")
        return None

    def action_texts(self, type_: str) -> FindText:
        """Return what finds the texts of the messages that an action consists of, and of all others.

        Raises ValueError where the text of the action is none.
        """
        text = self.type_text(type_, "action")
        own = {} if text is None else action_texts(type_, text)
        return lambda name: own.get(name) or self.type_text(name, "msg")

    def is_own(self, type_: str) -> bool:
        """Return whether a type belongs to a package of the submission."""
        return (self.workspace.repaired / type_.partition("/")[0]).is_dir()

    def service_types(self) -> tuple[str, ...]:
        """Return the types of services in the package and on this machine, as far as these are not too many."""
        folders = (self.workspace.repaired, *self.share_folders)
        files = (path for folder in folders for path in folder.glob("*/srv/*.srv"))
        found = (f"{path.parent.parent.name}/{path.stem}" for path in islice(files, SERVICE_TYPES_MAX))
        return tuple(dict.fromkeys(found))

    def has_line(
        self,
        pattern: re.Pattern[bytes] | Callable[[bytes], object],
        script: str | None = None,
        *,
        programs: re.Pattern[bytes] | None = None,
    ) -> bool:
        """Return whether a script or a source file of the lab's packages has it, or this script of theirs; with
        `programs`, this one or a file that has nothing like that and may be imported."""
        search = pattern.search if isinstance(pattern, re.Pattern) else pattern
        folders = self._folders()
        own = [folder / script for folder in folders] if script is not None else []
        found = (path for folder in folders for path in folder.rglob("*") if path.suffix in SOURCE_ENDINGS)
        files = own if script is not None and programs is None else [*own, *islice(found, SOURCES_MAX)]
        texts = ((path, read_untrusted(path, SOURCE_BYTES_MAX) or b"") for path in files if path.is_file())
        return any(
            search(text)
            for path, text in texts
            if programs is None or path in own or not programs.search(text)
        )

    def text_of(self, script: str) -> bytes:
        """Return the text of a script of the lab's packages."""
        found = (folder / script for folder in self._folders())
        return next((read_untrusted(path, SOURCE_BYTES_MAX) or b"" for path in found if path.is_file()), b"")

    def _folders(self) -> list[Path]:
        return [one.repaired / one.folder for one in (self.workspace, *self.workspace.others.values())]

    def package_file(self, file: str) -> Path | None:
        """Return where a file of the package is on disk, found as `script_path` finds it."""
        found = self.script_path(file)
        return None if found is None else self.workspace.repaired / self.workspace.folder / found

    def script_path(self, script: str) -> str | None:
        """Return where a script is in the package: at its place, else the shallowest file of that name."""
        package = self.workspace.repaired / self.workspace.folder
        if (package / script).is_file():
            return script
        # The path breaks ties, so that every run starts the same file.
        others = sorted(package.rglob(Path(script).name), key=lambda p: (len(p.parts), str(p)))
        return next((p.relative_to(package).as_posix() for p in others if p.is_file()), None)

    def spec(
        self,
        name: str,
        argv: Sequence[str],
        *,
        role: str = "student",
        copy: bool = True,
        as_handed_in: bool = False,
        collect: str | None = None,
        collect_bytes: int | None = None,
        build: bool = False,
        number: int = 0,
        binds: Sequence[Word] = (),
        **more: Any,  # noqa: ANN401 - fields of the spec
    ) -> dict[str, Any]:
        """Return what the arena needs to start a process.

        With `copy` it gets a workspace of its own: the sources with the repairs, or `as_handed_in`, and what the build
        made. `build` is the build itself, `number` says how many others the run starts before it. What the process
        writes to `{collect}`, `collect_bytes` at most, becomes the file of that name in `workspace.kept`. `binds` are
        more arguments of bubblewrap's.
        """
        boxed = self.sandbox.bubblewrap
        limits = self._limits(copy=copy)
        filtered = system_call_filter() if boxed else None
        first = self._words(copy=copy and boxed, build=build, number=number if boxed else 0)
        room = collect_bytes or self.limits.built_bytes
        collected = {"file": str(self.workspace.kept / collect), "bytes": room} if collect and boxed else None
        return {
            "name": name,
            "role": role,
            "argv": list(argv),
            "env": self._process_env(),
            "outer": self.sandbox.outer(limits),
            "bwrap": find_host_program("bwrap"),
            "wall": self.sandbox.wall(
                ros=self.ros,
                place=self.folder,
                limits=limits,
                binds=[*self._binds(copy=copy, as_handed_in=as_handed_in or build, output=build), *binds],
                # What the grader runs without a master (the base workspace, a compilation) needs no network.
                net=role != "grader" or not as_handed_in,
            ),
            "filter": base64.b64encode(filtered).decode() if filtered else None,
            "shell": ["/bin/bash", "-c", first, "bash"],
            "collect": collected,
            **UNLESS_SAID,
            **more,
        }

    def _words(self, *, copy: bool, build: bool, number: int) -> str:
        """Return the script of the first shell. Nothing of the submission is in it."""
        before, run = (BUILD_COPY, BUILD_RUN) if build else (COPY, RUN_AS_NUMBER % number if number else RUN)
        # `ulimit` before all else: a process tree inherits it from the shell.
        first = self.sandbox.first_words(self.limits) + HEAD
        return first + (before + TAKE + run if copy else TAKE + RUN)

    def _limits(self, *, copy: bool) -> RunLimits:
        """Return the limits of one process. With a `copy` of the workspace, its home has room for that beside what else
        may be written."""
        room = self.limits.home_bytes + (2 * self.workspace.copied_bytes if copy else 0)
        return self.limits.model_copy(update={"home_bytes": room})

    def _binds(self, *, copy: bool, as_handed_in: bool, output: bool) -> list[Word]:
        shown = {COURSE: self.course} if self.sees_course and self.course.is_dir() else {}
        if copy:
            workspace = self.workspace
            shown[LARGE] = workspace.large
            shown[SOURCES] = workspace.built / "src" if as_handed_in else workspace.repaired
            inside, kept = (BASE_WORKSPACE, self.base) if output else (BUILT, self.archive)
            shown |= {inside: kept} if kept.is_file() else {}
        binds = [word for inside, path in shown.items() for word in ("--ro-bind", copy_of(path), inside)]
        if not (copy and output):
            return binds
        return [*binds, "--bind", scratch(self.limits.tmp_bytes, OUTPUT_FILES), OUTPUT]

    def stage(self) -> dict[str, Any] | None:
        """Return where the arena makes its stage, and the user who writes there; None without a sandbox."""
        if not self.sandbox.bubblewrap:
            return None
        folder = self.folder / STAGE
        folder.mkdir(mode=0o711, exist_ok=True)
        # `mkdir`'s mode is cut by the umask.
        folder.chmod(0o711)
        return {"folder": str(folder), "owner": self.sandbox.uid or os.geteuid()}

    def _process_env(self) -> dict[str, str]:
        home = HOME if self.sandbox.bubblewrap else str(self.folder / "home")
        base = {
            "HOME": home,
            "LANG": "C.UTF-8",
            "LOGNAME": "student",
            "PYTHONUNBUFFERED": "1",
            "ROSCONSOLE_STDOUT_LINE_BUFFERED": "1",
            "ROS_IP": LOOPBACK,
            "ROS_HOME": f"{home}/.ros",
            "SHELL": "/bin/bash",
            "TERM": "dumb",
            "USER": "student",
            "DISPLAY": NO_DISPLAY,
        }
        if LIBSTDBUF.exists():
            base |= {"LD_PRELOAD": str(LIBSTDBUF), "_STDBUF_O": "L", "_STDBUF_E": "L"}
        added = {name: value for name, value in self.env.items() if name not in OWN_VARIABLES}
        merged = {**base, **self.ros.env, **added}
        if self.sees_course and self.course.is_dir():
            inside = COURSE if self.sandbox.bubblewrap else str(self.course)
            merged = with_course(merged, self.course, inside)
        merged = with_standins(merged, self.folder / "standins", self.standins)
        return {**merged, "PATH": search_path(self.ros, merged.get("PATH", ""), self.shims)}


def search_path(ros: RosInstallation, path: str, *first: str) -> str:
    """Return the search path for programs. What the package adds comes last: a program of its own never takes the place
    of the system's or of ROS's."""
    entries = [*first, *ros.env["PATH"].split(os.pathsep), *HOST_PATH.split(":"), *path.split(os.pathsep)]
    return os.pathsep.join(dict.fromkeys(e for e in entries if e))
