"""Finds ROS 1 on this machine, in the order that docs/how-to/install.md gives, and the packages that it knows.

The stand-ins are among them. What exists nowhere is a slip of the rubric's author; what exists but is not installed
here is what this machine lacks.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

from grader.errors import RosMissing
from grader.host_programs import HOST_PATH, find_host_program, run_host_program
from grader.installable import PROGRAMS_OF_ROS, install_command, known_packages, noetic_messages
from grader.model.package import MANIFEST
from grader.model.record import Record
from grader.portable import system
from grader.wording import closest, did_you_mean

DEBIAN_PACKAGES = (
    "python3-rospy python3-rosmaster python3-roslaunch rosout rosbash catkin "
    "python3-std-msgs python3-rosgraph-msgs python3-geometry-msgs python3-sensor-msgs"
)
NO_ROS = "no ROS 1 on this machine"
INSTALL_HINT = f"on Debian 12: apt-get install {DEBIAN_PACKAGES} (or: make setup)"
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
    # the newest first: ROS names its distributions in the order of the alphabet
    for candidate in sorted(Path("/opt/ros").glob("*/setup.bash"), reverse=True):
        if (candidate.parent / "bin" / "rosmaster").exists():
            return _from_setup(candidate)
    return _debian() or _conda(conda)


def _from_setup(setup: Path) -> RosInstallation:
    script = 'source "$1" >/dev/null && env -0'
    # without a home, so that no file of the user's has a say in it
    base = {"PATH": HOST_PATH, "HOME": "/nonexistent"}
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
    python = shutil.which("python3", path=env.get("PATH", HOST_PATH)) or "/usr/bin/python3"
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
    # a sandbox shows /usr anyway
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
        env={"PATH": HOST_PATH, "ROS_PACKAGE_PATH": "/usr/share"},
    )


def _debian_version() -> str:
    manifest = Path("/usr/share/rosmaster/package.xml")
    text = manifest.read_text(errors="replace") if manifest.is_file() else ""
    return text.partition("<version>")[2].partition("</version>")[0].strip() or "1"


def _conda(prefix: str) -> RosInstallation | None:
    if not prefix or not (Path(prefix) / "bin" / "rosmaster").exists():
        return None
    env = keep_ros_variables({**os.environ, "PATH": f"{prefix}/bin:{HOST_PATH}"})
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
            # packages that are installed lie right below `share`; a workspace may have folders in between
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
        # names with a hyphen are rosdep's or Debian's, not ROS's
        if "-" in package or package in COMMON:
            return ""
        known = {*known_packages(), *noetic_messages(), *COMMON}
        # letters that are swapped make a short name look less alike
        swapped = next((name for name in sorted(known) if sorted(name) == sorted(package)), "")
        near = swapped or closest(package, known, cutoff=NEAR_WITHOUT_ROS)
        is_slip = near and near[0] == package[0] and package not in known and package not in self.folders
        return f'there is no ROS package "{package}" (did you mean "{near}"?)' if is_slip else ""

    def program_fault(self, program: str) -> str:
        """Return why no machine has this program (`turtlesim/turtlesim_node`); empty where one may."""
        package, _, name = program.partition("/")
        if package not in self.folders:
            return self._unknown(package, ())
        there = self.programs(package)
        is_known = name in there or name in PROGRAMS_OF_ROS.get(package, ())
        return "" if is_known else f'{package} has no program "{name}"{did_you_mean(name, there)}'

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
