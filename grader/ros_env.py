"""Finds ROS 1 on this machine, in the order that docs/how-to/install.md gives."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Literal

from grader.errors import RosMissing
from grader.model.record import Record
from grader.portable import system

DEBIAN_PACKAGES = (
    "python3-rospy python3-rosmaster python3-roslaunch rosout rosbash catkin "
    "python3-std-msgs python3-rosgraph-msgs python3-geometry-msgs python3-sensor-msgs"
)
NO_ROS = "no ROS 1 on this machine"
INSTALL_HINT = f"on Debian 12: apt-get install {DEBIAN_PACKAGES} (or: make setup)"
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
ROS_VARIABLES = frozenset(
    (
        "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "PATH", "PKG_CONFIG_PATH", "PYTHONPATH", "ROSCONSOLE_FORMAT",
        "ROSLISP_PACKAGE_DIRECTORIES", "ROS_DISTRO", "ROS_ETC_DIR", "ROS_LANG_DISABLE", "ROS_OS_OVERRIDE",
        "ROS_PACKAGE_PATH", "ROS_PYTHON_VERSION", "ROS_ROOT", "ROS_VERSION",
    )
)  # fmt: skip
"""What ROS's `setup.bash` sets, and a workspace's extends. Nothing else of an environment is passed on."""
DUMP_BYTES, NAMES_MAX, VALUE_BYTES = 64 << 10, 200, 8 << 10
NAME_SHOWN = 60


class RosInstallation(Record):
    """`python` is ROS's interpreter, `prefixes` what a sandbox must show of it beside /usr, `env` what `setup.bash`
    sets (without it: what Debian's packages need)."""

    kind: Literal["setup", "debian", "conda"]
    where: str
    distro: str
    python: str
    prefixes: tuple[str, ...]
    env: dict[str, str]

    @property
    def label(self) -> str:
        return f"{self.distro} ({self.where})"

    @property
    def python_version(self) -> tuple[int, ...]:
        """Return the version of ROS's interpreter as its file is named, (3, 11); empty where that does not say."""
        found = re.fullmatch(r"python(\d+)\.(\d+)", Path(self.python).resolve().name)
        return tuple(map(int, found.groups())) if found else ()

    def program(self, name: str) -> str | None:
        """Return the path of one of ROS's programs, or None."""
        return shutil.which(name, path=self.env["PATH"])


def find_ros() -> RosInstallation | None:
    """Return the ROS 1 to use, or None. `$GRADER_ROS_SETUP` names a `setup.bash`, or `none`."""
    return _find(os.environ.get("GRADER_ROS_SETUP", ""), os.environ.get("CONDA_PREFIX", ""))


def why_nodes_cannot_run() -> str:
    """Return why no node can be run here, "" where one can. Raises RosMissing where ROS is not where it should be."""
    if system():
        return f"ROS 1's nodes run on Linux, and this is {system()}"
    return "" if find_ros() is not None else NO_ROS


@lru_cache(maxsize=4)
def _find(setup: str, conda: str) -> RosInstallation | None:
    if setup == "none":
        return None
    if setup:
        if not Path(setup).is_file():
            raise RosMissing(
                f"$GRADER_ROS_SETUP names no file: {setup}", hint="set it to a setup.bash, or unset it"
            )
        return _from_setup(Path(setup))
    for candidate in sorted(Path("/opt/ros").glob("*/setup.bash"), reverse=True):
        if (candidate.parent / "bin" / "rosmaster").exists():
            return _from_setup(candidate)
    return _debian() or _conda(conda)


def _from_setup(setup: Path) -> RosInstallation:
    script = 'source "$1" >/dev/null && env -0'
    base = {"PATH": SYSTEM_PATH, "HOME": "/nonexistent"}
    done = subprocess.run(
        ["/bin/bash", "-c", script, "bash", str(setup)],
        env=base,
        cwd="/",
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
        timeout=30,
    )
    if done.returncode != 0:
        raise RosMissing(f"{setup} does not load: {done.stderr.decode(errors='replace').strip()[-200:]}")
    env = keep_ros_variables(parse_env(done.stdout))
    python = shutil.which("python3", path=env.get("PATH", SYSTEM_PATH)) or "/usr/bin/python3"
    distro = env.get("ROS_DISTRO", setup.parent.name)
    return RosInstallation(
        kind="setup", where=str(setup), distro=distro, python=python, prefixes=_prefixes(setup, env), env=env
    )


def _prefixes(setup: Path, env: Mapping[str, str]) -> tuple[str, ...]:
    """Return the folders that a `setup.bash` stands for: of a workspace its own, and those of all below it."""
    named = (env.get(name, "") for name in ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH"))
    paths = [
        setup.parent,
        *(Path(entry) for entries in named for entry in entries.split(os.pathsep) if entry),
    ]
    known = [path for path in paths if path.is_absolute() and path.is_dir()]
    outside = dict.fromkeys(path for path in known if not path.resolve().is_relative_to("/usr"))
    return tuple(str(path) for path in outside if not outside.keys() & set(path.parents))


def _debian() -> RosInstallation | None:
    modules = Path("/usr/lib/python3/dist-packages")
    if not all((modules / name).is_dir() for name in ("rospy", "rosmaster", "std_msgs")):
        return None
    version = _debian_version()
    return RosInstallation(
        kind="debian",
        where="Debian's packages",
        distro=f"ros_comm {version}",
        python="/usr/bin/python3",
        prefixes=(),
        env={"PATH": SYSTEM_PATH, "ROS_PACKAGE_PATH": "/usr/share"},
    )


def _debian_version() -> str:
    manifest = Path("/usr/share/rosmaster/package.xml")
    text = manifest.read_text(errors="replace") if manifest.is_file() else ""
    return text.partition("<version>")[2].partition("</version>")[0].strip() or "1"


def _conda(prefix: str) -> RosInstallation | None:
    if not prefix or not (Path(prefix) / "bin" / "rosmaster").exists():
        return None
    env = keep_ros_variables({**os.environ, "PATH": f"{prefix}/bin:{SYSTEM_PATH}"})
    return RosInstallation(
        kind="conda",
        where=prefix,
        distro=env.get("ROS_DISTRO", "RoboStack"),
        python=f"{prefix}/bin/python3",
        prefixes=(prefix,),
        env=env,
    )


def parse_env(dump: bytes) -> dict[str, str]:
    """Parse what `env -0` printed."""
    pairs = (entry.partition("=") for entry in dump.decode(errors="replace").split("\0") if "=" in entry)
    return {name: value for name, _, value in pairs}


def excess_of(dump: bytes) -> str:
    """Return what an environment that `env -0` printed has too much of, in words; "" where it keeps within bounds."""
    entries = [entry for entry in dump.split(b"\0") if entry]
    longest = max(entries, key=len, default=b"")
    if len(dump) > DUMP_BYTES:
        return f"more than {DUMP_BYTES >> 10} kB of variables"
    if len(entries) > NAMES_MAX:
        return f"{len(entries)} variables, of which {NAMES_MAX} are allowed"
    if len(longest) > VALUE_BYTES:
        name = longest.partition(b"=")[0][:NAME_SHOWN].decode(errors="replace")
        return f"a variable of more than {VALUE_BYTES >> 10} kB ({name})"
    return ""


def keep_ros_variables(env: Mapping[str, str]) -> dict[str, str]:
    """Keep only what ROS sets: no secret of the shell's goes on to a student's process, and no other program's
    setting."""
    return {name: value for name, value in env.items() if name in ROS_VARIABLES}
