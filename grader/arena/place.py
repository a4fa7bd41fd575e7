"""The folders and the environment that one submission's processes see, and the process specs made from them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from grader.arena.ros_env import SYSTEM_PATH, RosInstallation
from grader.arena.sandbox import (
    BUILT_WORKSPACE,
    HOME,
    INSIDE_WORKSPACE,
    LARGE,
    OUTPUT,
    SHIMS,
    STANDINS,
    Limits,
    Sandbox,
)
from grader.arena.standins import SOURCES, with_standins
from grader.arena.workspace import Workspace

LOOPBACK = "127.0.0.1"
"""As an address: not every machine knows the name localhost."""
LIBSTDBUF = Path("/usr/libexec/coreutils/libstdbuf.so")
LIFELINE = "echo >&{lifeline} && read -r _ <&{lifeline} && exec {lifeline}>&- || exit 125; "
"""The first thing that runs says that it is there and waits for leave: an arena that has died gives none."""
BUILD_STEP = 'cd "$HOME" && exec "$@"'
RUN_STEP = (
    f"mkdir {INSIDE_WORKSPACE} && cp -R --preserve=mode,links {BUILT_WORKSPACE}/* {INSIDE_WORKSPACE}/"
    ' && cd "$HOME" && exec "$@"'
)


@dataclass(frozen=True, kw_only=True)
class Place:
    """`folder` is this submission's own, `env` what the built workspace's `setup.bash` adds."""

    folder: Path
    ros: RosInstallation
    sandbox: Sandbox
    limits: Limits
    workspace: Workspace
    package: str
    env: dict[str, str] = field(default_factory=dict)

    @property
    def inside_workspace(self) -> str:
        """Where processes find the workspace."""
        return INSIDE_WORKSPACE if self.sandbox.bubblewrap else str(self.workspace.built)

    @property
    def output(self) -> str:
        """Where processes may leave files for the grader."""
        return OUTPUT if self.sandbox.bubblewrap else str(self.workspace.output)

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

    def from_source(self) -> Place:
        """Without a build: ROS still finds the package's sources."""
        path = f"{self.inside_workspace}/src:{self.ros.env.get('ROS_PACKAGE_PATH', '')}"
        return replace(self, env={"ROS_PACKAGE_PATH": path.rstrip(":")})

    def find_program(self, script: str) -> tuple[str, str] | None:
        """What `rosrun` would start for a script: (its path for a process, its path in the package), or None.

        A program that the build installed wins, as with `rosrun`; then the script's own place, then any other.
        """
        name = Path(script).name
        found = self.script_path(script)
        installed = self.workspace.built / "devel" / "lib" / self.package / name
        if installed.is_file() and not installed.is_symlink() and os.access(installed, os.X_OK):
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
        return (*known, self.folder / "standins" / "share", SOURCES)

    def package_file(self, file: str) -> Path | None:
        """Where a file of the package is on disk, found as `script_path` finds it."""
        found = self.script_path(file)
        return None if found is None else self.workspace.repaired / self.workspace.folder / found

    def script_path(self, script: str) -> str | None:
        """Where a script is in the package: at its place, else the shallowest file of that name."""
        package = self.workspace.repaired / self.workspace.folder
        if (package / script).is_file():
            return script
        others = sorted(package.rglob(Path(script).name), key=lambda p: (len(p.parts), str(p)))
        return next((p.relative_to(package).as_posix() for p in others if p.is_file()), None)

    def arena_env(self) -> dict[str, str]:
        """The managed roscore's environment: ROS and nothing of the shell's."""
        return {"LANG": "C.UTF-8", "ROS_IP": LOOPBACK, **self.ros.env, "PATH": _path(self.ros, "")}

    def spec(
        self,
        name: str,
        argv: Sequence[str],
        *,
        role: str = "student",
        copy: bool = True,
        build: bool = False,
        **more: Any,  # noqa: ANN401 - fields of the spec
    ) -> dict[str, Any]:
        """What the arena needs to start a process. `build` gives it the workspace as handed in, writable; otherwise,
        with `copy`, it gets a copy of its own with the repairs."""
        step = RUN_STEP if copy and not build and self.sandbox.bubblewrap else BUILD_STEP
        shell = ["/bin/bash", "-c", LIFELINE + step, "bash"]
        inner = self.sandbox.inner(
            [*shell, *argv],
            ros=self.ros,
            place=self.folder,
            binds=self._binds(build=build, copy=copy),
            net=not build,
            info=True,
        )
        return {
            "name": name,
            "role": role,
            "argv": inner,
            "argv_shown": list(argv),
            "env": self._process_env(),
            "cwd": "/" if self.sandbox.bubblewrap else str(self.folder / "home"),
            "sandboxed": self.sandbox.bubblewrap,
            "script": None,
            "repairs": [],
            **more,
        }

    def _binds(self, *, build: bool, copy: bool) -> list[str]:
        workspace = self.workspace
        large = ["--ro-bind", str(workspace.large), LARGE]
        if build:
            written = [
                "--bind",
                str(workspace.built),
                INSIDE_WORKSPACE,
                "--bind",
                str(workspace.output),
                OUTPUT,
            ]
            return [*large, *written]
        if not copy:
            return []
        binds = [*large, "--ro-bind", str(workspace.repaired), f"{BUILT_WORKSPACE}/src"]
        devel = workspace.built / "devel"
        if devel.is_dir() and not devel.is_symlink():
            binds += ["--ro-bind", str(devel), f"{BUILT_WORKSPACE}/devel"]
        return binds

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
        }
        if LIBSTDBUF.exists():
            base |= {"LD_PRELOAD": str(LIBSTDBUF), "_STDBUF_O": "L", "_STDBUF_E": "L"}
        merged = with_standins({**base, **self.ros.env, **self.env}, self.folder / "standins", self.standins)
        return {**merged, "PATH": _path(self.ros, merged.get("PATH", ""), self.shims)}


def _path(ros: RosInstallation, path: str, *first: str) -> str:
    entries = [*first, *path.split(os.pathsep), *ros.env["PATH"].split(os.pathsep), *SYSTEM_PATH.split(":")]
    return os.pathsep.join(dict.fromkeys(e for e in entries if e))
