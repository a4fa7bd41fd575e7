"""What every sandbox shows besides the system: paths inside of it, one user, `python`, and what stands in for programs
and packages that the machine lacks (docs/how-to/standins.md)."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from grader.model.package import MANIFEST
from grader.ros_env import RosInstallation

HOME = "/home/student"
INSIDE_WORKSPACE = f"{HOME}/catkin_ws"
OUTPUT = "/run/grader/out"
SOURCES = "/run/grader/src"
BUILT = "/run/grader/built.tar"
BASE_WORKSPACE = "/run/grader/base.tar"
LARGE = "/run/grader/large"
SHIMS = "/run/grader/bin"
STANDINS = "/run/grader/standins"
RECORD, RECORD_INSIDE = "lib/rosbag/record", "/run/grader/rosbag-record"
RECORD_SHIM = "grader-rosbag-record"
COURSE = "/run/grader/course"
FUNCTIONS, ROSTESTS = "grader-functions.py", "grader-rostests.py"
ROS_SIDE = Path(__file__).parent / "ros"
LINT = Path(__file__).parents[1] / "package" / "lint"
TERMINALS = (
    "gnome-terminal", "konsole", "lxterminal", "mate-terminal", "rxvt", "terminator", "tilix", "urxvt",
    "x-terminal-emulator", "xfce4-terminal", "xterm",
)  # fmt: skip
BROWSERS = (
    "brave-browser", "chromium", "chromium-browser", "firefox", "firefox-esr", "google-chrome", "google-chrome-stable",
    "opera", "sensible-browser", "www-browser", "x-www-browser", "xdg-open",
)  # fmt: skip
ASKING = (
    "curl", "fping", "host", "nslookup", "notify-send", "ping", "wget", "wmctrl", "xdpyinfo", "xrandr", "xset",
)  # fmt: skip
"""What scripts ask whether there is a network or a screen, before they open a page."""
ANSWERS = "grader-known"
QUESTIONS = (
    "lsb_release -si", "lsb_release -sd", "lsb_release -sr", "lsb_release -sc", "rosversion roslaunch", "rosversion -d",
)  # fmt: skip
"""What catkin asks in every build, and roslaunch on every start."""
EM = "lib/python3/dist-packages/em.py"
STANDIN_SOURCES = Path(__file__).resolve().parent / "standins"
SHEBANG = b"#!"
SHARE = "share"
TWO_NAMES = {"rospy_tutorials": ("talker", "listener")}
"""Programs that the real package has with an ending, too."""
LIBRARY = "python"
COMPLETED = "completed"
"""Packages that this ROS has without a program, each with the grader's program beside its files."""
MESSAGES = "from standin_messages import define\n\ndefine(globals())\n"
CMAKE = "cmake"


def prepare(place: Path, ros: RosInstallation) -> None:
    """Write what every sandbox binds: `etc/` with one user in it, `bin/` with `python` as ROS means it, stand-ins
    for terminals, which launch files name as their `launch-prefix`, for browsers, and for what is asked before a page
    is opened, and `standins/` with the packages that this ROS lacks."""
    etc, shims = place / "etc", place / "bin"
    for folder in (etc, shims, place / "home"):
        folder.mkdir(parents=True)
    # Some programs fail for a user without a name, and the machine's own users are not shown.
    (etc / "passwd").write_text(f"student:x:1000:1000:student:{HOME}:/bin/bash\n")
    (etc / "group").write_text("student:x:1000:\n")
    # roslaunch resolves its own host name, which is `localhost` in a sandbox.
    (etc / "hosts").write_text("127.0.0.1 localhost\n::1 localhost\n")
    # Both are ROS's interpreter: a newer system has no `python`, and its `python3` may be another one.
    for name in ("python", "python3"):
        (shims / name).symlink_to(ros.python)
    shutil.copyfile(LINT / "syntax.py", shims / "grader-syntax.py")
    for module in (LINT / "slips.py", *LINT.glob("script_*.py"), ROS_SIDE / "small_changes.py"):
        shutil.copyfile(module, shims / module.name)
    shutil.copyfile(ROS_SIDE / "functions.py", shims / FUNCTIONS)
    shutil.copyfile(ROS_SIDE / "rostests.py", shims / ROSTESTS)
    _program(shims, "terminal.sh", "grader-terminal", TERMINALS)
    _program(shims, "open.sh", "grader-open", BROWSERS)
    _program(shims, "network_and_screen.sh", "grader-reachable", ASKING)
    _program(shims, "rosbag_record.sh", RECORD_SHIM, ())
    shutil.copyfile(ROS_SIDE / "opener.py", shims / "grader-open.py")
    _write_quick_programs(shims, ros)
    copy_standins(place / "standins", ros)
    for installed, programs in packages_without_program(ros):
        _copy(installed, _made(place / COMPLETED) / installed.name)
        for program in programs:
            _copy(program, place / COMPLETED / installed.name / program.name)


def _write_quick_programs(shims: Path, ros: RosInstallation) -> None:
    """Write programs that come before ROS's own on a sandbox's PATH and are quicker: they know the answer, or load
    less."""
    (shims / ANSWERS).mkdir()
    asked = sorted({question.split()[0] for question in QUESTIONS})
    _program(shims, "cached_answers.sh", "grader-answers", [name for name in asked if ros.program(name)])
    if ros.program("catkin_find_pkg"):
        _program(shims, "find_pkg.sh", "catkin_find_pkg", ())
    empy, modules = ros.program("empy"), [Path(prefix) / EM for prefix in (*ros.prefixes, "/usr")]
    module = next((path for path in modules if path.is_file()), None)
    # Only where the program is the module with another first line: a distribution may have changed either.
    if empy and module and _below_shebang(Path(empy)) == _below_shebang(module):
        _write_filled_in(shims / "empy", "empy.py", "@EM@", str(module))
    roslaunch = ros.program("roslaunch")
    if roslaunch and b"python" in Path(roslaunch).read_bytes().partition(b"\n")[0]:
        _write_filled_in(shims / "roslaunch", "roslaunch.py", "@PROGRAM@", roslaunch)


def _write_filled_in(program: Path, source: str, name: str, value: str) -> None:
    program.write_text((ROS_SIDE / source).read_text().replace(name, value))
    program.chmod(0o755)


def _below_shebang(path: Path) -> bytes:
    return path.read_bytes().partition(b"\n")[2]


def _program(shims: Path, source: str, name: str, called: Sequence[str]) -> None:
    """Put one program under each name that it is called by."""
    shutil.copyfile(ROS_SIDE / source, shims / name)
    (shims / name).chmod(0o755)
    for other in called:
        (shims / other).symlink_to(name)


def standin_packages() -> tuple[str, ...]:
    """Return every package that the grader has a stand-in for."""
    return tuple(sorted(p.parent.name for p in STANDIN_SOURCES.glob(f"*/{MANIFEST}")))


def packages_without_program(ros: RosInstallation) -> Iterator[tuple[Path, list[Path]]]:
    """Yield the folder of each package that this ROS has, and the grader's programs that it lacks."""
    for source in sorted(path for path in STANDIN_SOURCES.iterdir() if path.name not in {LIBRARY, CMAKE}):
        prefixes = [] if (source / MANIFEST).is_file() else list(map(Path, (*ros.prefixes, "/usr")))
        found = next((p for p in prefixes if (p / SHARE / source.name / MANIFEST).is_file()), None)
        if found is None:
            continue
        places = [found / "lib" / source.name, found / SHARE / source.name]
        lacking = [p for p in sorted(source.iterdir()) if not any((q / p.name).exists() for q in places)]
        if lacking := [path for path in lacking if path.is_file()]:
            yield places[1], lacking


def missing_packages(ros: RosInstallation) -> tuple[str, ...]:
    """Return those of the packages that this ROS does not know."""
    known = set(_installed_standins(ros)) | set(_overlaid(ros))
    return tuple(name for name in standin_packages() if name not in known)


def copy_standins(folder: Path, ros: RosInstallation) -> None:
    """Write what this ROS lacks into `folder`, an install space: `share/<package>`, programs executable whatever an
    archive made of their bits."""
    (folder / SHARE).mkdir(parents=True)
    for name in (LIBRARY, CMAKE):
        _copy(STANDIN_SOURCES / name, folder / name)
    for name in missing_packages(ros):
        _copy(STANDIN_SOURCES / name, folder / SHARE / name)
        _write_modules(folder / SHARE / name)
        for program in TWO_NAMES.get(name, ()):
            _copy(STANDIN_SOURCES / name / program, folder / SHARE / name / f"{program}.py")


def with_standins(env: Mapping[str, str], copied: Path, inside: str) -> dict[str, str]:
    """Return the environment in which ROS finds the stand-ins after everything else. `copied` is the folder that
    `copy_standins` wrote, `inside` where processes see it."""
    packages = sorted(p.name for p in (copied / SHARE).iterdir())
    if not packages:
        return dict(env)
    python = [f"{inside}/{LIBRARY}", *(f"{inside}/{SHARE}/{name}/{LIBRARY}" for name in packages)]
    added = {"ROS_PACKAGE_PATH": [f"{inside}/{SHARE}"], "PYTHONPATH": python, "CMAKE_PREFIX_PATH": [inside]}
    return {**env, **{name: _append(env.get(name, ""), entries) for name, entries in added.items()}}


def with_course(env: Mapping[str, str], course: Path, inside: str) -> dict[str, str]:
    """Return the environment in which ROS finds the course's workspace, which was built in the folder `course`, before
    ROS's own packages. `inside` is where processes see it."""
    modules = sorted(path.relative_to(course) for path in course.glob("devel/lib/python3*/*-packages"))
    added = {
        "ROS_PACKAGE_PATH": [f"{inside}/src"],
        "CMAKE_PREFIX_PATH": [f"{inside}/devel"],
        "LD_LIBRARY_PATH": [f"{inside}/devel/lib"],
        "PYTHONPATH": [f"{inside}/{path}" for path in modules],
    }
    return {**env, **{name: _prepend(env.get(name, ""), entries) for name, entries in added.items()}}


def _prepend(path: str, entries: list[str]) -> str:
    """Return the path with the entries in front of it. One that is there already stays where it is, so the student's
    workspace goes before the course's."""
    before = [entry for entry in path.split(os.pathsep) if entry]
    return os.pathsep.join([*(entry for entry in entries if entry not in before), *before])


def _made(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return folder


def _copy(source: Path, target: Path) -> None:
    """Copy a file, or a folder with all that is in it."""
    if source.is_dir():
        target.mkdir()
        for name in os.listdir(source):  # noqa: PTH208 - as in `evidence/reader.py`
            if name != "__pycache__":
                _copy(source / name, target / name)
        return
    data = source.read_bytes()
    target.write_bytes(data)
    target.chmod(0o755 if data.startswith(SHEBANG) else 0o644)


def _write_modules(package: Path) -> None:
    """Write the Python modules `<package>.msg` and `<package>.srv`, which make their classes when they are asked."""
    library = package / LIBRARY / package.name
    library.mkdir(parents=True)
    (library / "__init__.py").touch()
    for kind in ("msg", "srv"):
        if (package / kind).is_dir():
            (library / kind).mkdir()
            (library / kind / "__init__.py").write_text(MESSAGES)


def _append(path: str, entries: list[str]) -> str:
    before = [entry for entry in path.split(os.pathsep) if entry and entry not in entries]
    return os.pathsep.join([*before, *entries])


def _installed_standins(ros: RosInstallation) -> Iterator[str]:
    entries = [Path(entry) for entry in _package_path(ros)]
    for share in (*entries, *(Path(prefix) / SHARE for prefix in ros.prefixes)):
        yield from (name for name in standin_packages() if (share / name / MANIFEST).is_file())


def _overlaid(ros: RosInstallation) -> Iterator[str]:
    """Yield the packages of source workspaces on ROS_PACKAGE_PATH, which may lie deeper, or be the entry itself."""
    from catkin_pkg.packages import find_package_paths  # noqa: PLC0415 - slow to load, and not needed to read files

    for entry in _package_path(ros):
        if Path(entry).name != SHARE and Path(entry).is_dir():
            yield from (Path(entry, path).resolve().name for path in find_package_paths(entry))


def _package_path(ros: RosInstallation) -> list[str]:
    return [entry for entry in ros.env.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if entry]
