"""The packages that this machine's ROS knows, the stand-ins among them: their programs and their types.

What exists nowhere is a slip of the rubric's author; what exists but is not installed here is what this machine lacks.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

from grader.errors import RosMissing
from grader.host_programs import find_host_program, run_host_program
from grader.installable import install_command, known_packages, noetic_messages
from grader.ros_env import RosInstallation, find_ros
from grader.wording import closest, did_you_mean

MANIFEST = "package.xml"
STANDINS = Path(__file__).resolve().parent / "arena" / "standins"
DEPTH_MAX = 5
LOOK_S = 20
NEAR_WITHOUT_ROS = 0.85
"""Where there is no ROS, only a name that is one letter off is known to be wrong."""
COMMON = frozenset({
    "catkin", "message_generation", "message_runtime", "roscpp", "roslaunch", "roslib", "rospy",
    "std_msgs", "std_srvs", "geometry_msgs", "sensor_msgs", "nav_msgs",
})  # fmt: skip
"""What most students' packages depend on: known without a look at all that there is, which takes a while."""
IGNORED = frozenset({"CATKIN_IGNORE", "AMENT_IGNORE"})
TypeKind = Literal["msg", "srv", "action"]
WORDS: Mapping[TypeKind, str] = {"msg": "message", "srv": "service", "action": "action"}


@dataclass(frozen=True)
class RosPackages:
    """`ros` is None where there is none: then only the stand-ins are known, and any other package may exist."""

    ros: RosInstallation | None

    @cached_property
    def folders(self) -> dict[str, Path]:
        """Return each package's folder; of two with one name, the one that ROS finds."""
        found: dict[str, Path] = {}
        for entry in (*self._entries("ROS_PACKAGE_PATH"), *(p / "share" for p in self._prefixes()), STANDINS):
            for folder in _packages_below(entry, 1 if entry.name == "share" else DEPTH_MAX):
                found.setdefault(_name(folder), folder)
        return found

    def programs(self, package: str) -> tuple[str, ...]:
        """Return the names of what `rosrun` would start of a package."""
        folder = self.folders.get(package)
        if folder is None:
            return ()
        prefixes = [*self._prefixes(), *self._entries("CMAKE_PREFIX_PATH"), folder.parent.parent]
        places = [*(prefix / "lib" / package for prefix in prefixes), folder]
        files = (path for place in places if place.is_dir() for path in place.rglob("*"))
        return tuple(dict.fromkeys(path.name for path in files if _is_program(path)))

    def types(self, package: str, kind: TypeKind) -> tuple[str, ...]:
        """Return the names of a package's types, as installed here, else as ROS Noetic has them."""
        folder = self.folders.get(package)
        there = sorted(p.stem for p in (folder / kind).glob(f"*.{kind}")) if folder else []
        return tuple(there) or (tuple(noetic_messages().get(package, ())) if kind == "msg" else ())

    def text(self, type_: str, kind: Literal["srv", "action"]) -> str | None:
        """Return the text of a service's or an action's file; None where it is not installed here."""
        package, _, name = type_.partition("/")
        file = self.folders.get(package, Path()) / kind / f"{name}.{kind}"
        return file.read_text("utf-8", "replace") if package in self.folders and file.is_file() else None

    def lacks(self, package: str) -> bool:
        """Return whether a package exists that is not installed here."""
        return package not in self.folders and not self._unknown(package, ())

    def misspelt(self, package: str) -> str:
        """Return what is to be said of a dependency that is all but a ROS package; rosdep has many more names."""
        if "-" in package or package in COMMON:
            return ""
        known = {*known_packages(), *noetic_messages(), *COMMON}
        near = closest(package, known, cutoff=NEAR_WITHOUT_ROS)
        is_slip = near and near[0] == package[0] and package not in known and package not in self.folders
        return f'there is no ROS package "{package}" (did you mean "{near}"?)' if is_slip else ""

    def program_fault(self, program: str) -> str:
        """Return why no machine has this program (`turtlesim/turtlesim_node`); empty where one may."""
        package, _, name = program.partition("/")
        if package not in self.folders:
            return self._unknown(package, ())
        there = self.programs(package)
        return "" if name in there else f'{package} has no program "{name}"{did_you_mean(name, there)}'

    def type_fault(self, type_: str, kind: TypeKind, own: Collection[str] = ()) -> str:
        """Return why there is no such type; empty where there may be. Packages of `own` are the student's."""
        package, _, name = type_.partition("/")
        there = self.types(package, kind)
        if package in own or name in there:
            return ""
        if there or package in self.folders:
            return f'{package} has no {WORDS[kind]} type "{name}"{did_you_mean(name, there)}'
        return self._unknown(package, own)

    def package_fault(self, package: str) -> str:
        """Return why no machine has this package; empty where one may."""
        return "" if package in self.folders else self._unknown(package, ())

    def _unknown(self, package: str, own: Collection[str]) -> str:
        """Return what is to be said of a package that is not here; empty where it may be elsewhere."""
        known = {*own, *self.folders, *known_packages()}
        if package in known_packages() or package in noetic_messages():
            return ""
        if self.ros is not None:
            return f'this machine has no ROS package "{package}"{did_you_mean(package, known)}'
        near = closest(package, known, cutoff=NEAR_WITHOUT_ROS)
        return f'there is no ROS package "{package}" (did you mean "{near}"?)' if near else ""

    def _prefixes(self) -> list[Path]:
        return [Path(prefix) for prefix in self.ros.prefixes] if self.ros else []

    def _entries(self, variable: str) -> list[Path]:
        value = self.ros.env.get(variable, "") if self.ros else ""
        return [Path(entry) for entry in value.split(os.pathsep) if entry]


def ros_packages() -> RosPackages:
    """Return the packages of the ROS that the grader would use."""
    try:
        ros = find_ros()
    except RosMissing:
        ros = None
    return _read(ros.model_dump_json() if ros else "")


class Need(NamedTuple):
    """What a lab needs of the machine: whether it is here, and how it is installed. `kind` is `ros`, `apt` or `pip`."""

    kind: str
    name: str
    here: bool
    install: str


FIND_MODULE = """
import importlib.metadata, importlib.util, sys
try:
    importlib.metadata.version(sys.argv[1])
except importlib.metadata.PackageNotFoundError:
    if importlib.util.find_spec(sys.argv[1].replace("-", "_")) is None:
        sys.exit()
print("here")
"""


@lru_cache(maxsize=16)
def look_for(ros: tuple[str, ...], apt: tuple[str, ...], pip: tuple[str, ...]) -> tuple[Need, ...]:
    """Return which of these packages are here. What this machine has no way to tell (no dpkg) counts as here."""
    packages = ros_packages()
    distro = packages.ros.distro if packages.ros is not None and packages.ros.kind == "setup" else ""
    found = [Need("ros", n, n in packages.folders, install_command(n, distro)) for n in ros]
    found += [Need("apt", n, _is_installed(n), f"apt-get install {n}") for n in apt]
    python = packages.ros.python if packages.ros is not None else ""
    found += [
        Need("pip", n, _has_module(python, n), f"{python or 'python3'} -m pip install {n}") for n in pip
    ]
    return tuple(found)


def _is_installed(package: str) -> bool:
    dpkg = find_host_program("dpkg-query")
    return dpkg is None or _prints([dpkg, "-W", "-f=${db:Status-Status}", package]) == "installed"


def _has_module(python: str, name: str) -> bool:
    """Return whether ROS's Python has a distribution or a module of that name, where every user has it."""
    return not python or _prints([python, "-I", "-c", FIND_MODULE, name]) == "here"


def _prints(command: list[str]) -> str:
    try:
        return run_host_program(command, LOOK_S).stdout.decode(errors="replace").strip()
    except (OSError, subprocess.TimeoutExpired):
        return ""


@lru_cache(maxsize=4)
def _read(ros: str) -> RosPackages:
    return RosPackages(RosInstallation.model_validate_json(ros) if ros else None)


def _packages_below(folder: Path, depth: int) -> Iterator[Path]:
    """Yield the folders with a manifest, none of them inside another."""
    if (folder / MANIFEST).is_file():
        yield folder
        return
    try:
        inside = sorted(path for path in folder.iterdir() if path.is_dir()) if depth else []
    except OSError:
        return
    for path in inside:
        if not path.name.startswith(".") and not any((path / name).exists() for name in IGNORED):
            yield from _packages_below(path, depth - 1)


def _name(folder: Path) -> str:
    """Return the name in the manifest, which is the folder's where the manifest cannot be read."""
    try:
        text = (folder / MANIFEST).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return folder.name
    return text.partition("<name>")[2].partition("</name>")[0].strip() or folder.name


def _is_program(path: Path) -> bool:
    """Return whether it can be started; a stand-in's bits may be lost, so its first line says so."""
    if not path.is_file():
        return False
    if path.is_relative_to(STANDINS):
        with path.open("rb") as file:
            return file.read(2) == b"#!"
    return os.access(path, os.X_OK)
