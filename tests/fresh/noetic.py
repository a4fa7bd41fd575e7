"""An install space `/opt/ros/noetic`, as ROS's packages of Noetic leave it, in a root without Debian's ROS packages.

ROS's own archive, and Debian's archive of sources, are not to be had everywhere. So the files are those of Debian's
binary packages, moved to where Noetic has them, with the paths inside them; `setup.bash`, `env.sh` and
`_setup_util.py` are made by catkin itself. ROS's interpreter is a Python 3.8 of this machine where there is one, as on
Ubuntu 20.04, else Debian's.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

from tests.fresh.room import Root

PREFIX = "/opt/ros/noetic"
PYTHON = "/usr/bin/python3"
ROS = (
    "catkin rosbash rosout ros-environment ros-message-generation ros-message-runtime rospack-tools "
    "python3-rospy python3-rosmaster python3-roslaunch python3-rostopic python3-rosnode python3-rosservice "
    "python3-rosmsg python3-rosparam python3-rosbag python3-rostest python3-actionlib "
    "python3-std-msgs python3-rosgraph-msgs python3-geometry-msgs python3-sensor-msgs python3-nav-msgs "
    "python3-actionlib-msgs python3-std-srvs ros-std-msgs ros-rosgraph-msgs ros-geometry-msgs ros-sensor-msgs "
    "ros-nav-msgs ros-actionlib-msgs ros-std-srvs ros-roscpp-msg "
    "libactionlib-dev libroscpp-dev libstd-msgs-dev libgeometry-msgs-dev libsensor-msgs-dev libnav-msgs-dev"
)
OTHERS = (
    "bubblewrap cmake g++ git make python3-venv python3-empy python3-yaml python3-defusedxml python3-netifaces "
    "python3-pycryptodome python3-gnupg python3-pyparsing python3-dateutil python3-docutils python3-distro"
)
MODULES = "rospkg catkin_pkg pyyaml defusedxml netifaces pycryptodomex python-gnupg empy<4 distro"
"""What ROS's Python imports of others, by pip: Debian's are for Debian's Python alone."""
UNPACK = """
set -e
apt-get update -q
apt-get install -y -q --no-install-recommends $2
mkdir -p /stage/debs && cd /stage/debs && chmod 777 .
apt-get install -s --no-install-recommends $1 | sed -n 's/^Inst \\([^ ]*\\).*/\\1/p' | sort >../all
for package in $(cat ../all); do
  source=$(apt-cache show "$package" | sed -n 's/^Source: \\([^ ]*\\).*/\\1/p' | head -n 1)
  case "${source:-$package}" in
    ros-rospkg|ros-catkin-pkg) echo "$package" >>../others ;;
    ros-*) echo "$package" >>../ros ;;
    *) echo "$package" >>../others ;;
  esac
done
apt-get install -y -q --no-install-recommends $(cat ../others)
apt-get download -q $(cat ../ros)
for deb in *.deb; do dpkg-deb -x "$deb" /stage/files; done
gcc -print-multiarch
"""
SETUP = f"""
set -e
mkdir -p /stage/empty && ln -s {PREFIX}/share/catkin/cmake/toplevel.cmake /stage/empty/CMakeLists.txt
export PYTHONPATH={PREFIX}/lib/python3/dist-packages PATH={PREFIX}/bin:$PATH CMAKE_PREFIX_PATH={PREFIX}
cmake -S /stage/empty -B /stage/build -DCMAKE_INSTALL_PREFIX={PREFIX} -DPYTHON_EXECUTABLE={PYTHON}
cmake --install /stage/build
rm -rf /stage && apt-get clean
"""
NEWER = f"""
set -e
ldconfig
/usr/local/bin/python3.8 -m pip install -q --root-user-action=ignore {" ".join(f"'{m}'" for m in MODULES.split())}
ln -sfn /usr/local/bin/python3.8 {PYTHON}
"""
LEFT_OUT = {"bash-completion", "doc", "fish", "lintian", "man", "pkgconfig", "python3", "zsh"}


def install(root: Root) -> None:
    """Put the install space, and what ROS takes from elsewhere, into a bare root."""
    done = root.run(["sh", "-c", UNPACK, "sh", ROS, OTHERS], network=True, timeout=900)
    multiarch = done.stdout.split()[-1]
    prefix = root.path / PREFIX.strip("/")
    _move_files(root.path / "stage" / "files", prefix, multiarch)
    for path in prefix.rglob("*"):
        if (
            path.is_file()
            and not path.is_symlink()
            and path.suffix in {".cmake", ".context", ".in", ".pc", ".sh"}
        ):
            path.write_text(_relocated(path.read_text(), multiarch))
    root.run(["sh", "-c", SETUP])
    if (python := python38()) is not None:
        _copy_python(python, root.path / "usr" / "local")
        root.run(["sh", "-c", NEWER], network=True)


def _move_files(stage: Path, prefix: Path, multiarch: str) -> None:
    usr = stage / "usr"
    libraries = usr / "lib" / multiarch
    for folder in (libraries / "cmake").iterdir():
        _move(folder, prefix / "share" / folder.name / "cmake")
    (libraries / "cmake").rmdir()
    _move(libraries, prefix / "lib")
    for name in ("bin", "include", "lib"):
        _move(usr / name, prefix / name)
    shared = {folder.name: folder for folder in (usr / "share").iterdir()}
    for name in shared.keys() - LEFT_OUT:
        _move(shared[name], prefix / "share" / name)
    _move(shared["pkgconfig"], prefix / "lib" / "pkgconfig")
    _move(shared["bash-completion"] / "completions" / "rosbash", prefix / "share" / "rosbash" / "rosbash")
    _move(stage / "etc", prefix / "etc")
    _move(prefix / "share" / "rosbash" / "catkin_env_hook", prefix / "etc" / "catkin" / "profile.d")


def _move(source: Path, target: Path) -> None:
    """Move a file, or what is in a folder into the folder that is there already."""
    if target.is_dir() and source.is_dir() and not source.is_symlink():
        for child in source.iterdir():
            _move(child, target / child.name)
    else:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(source, target)


def _relocated(text: str, multiarch: str) -> str:
    """Return a file of a package for /usr as it is in the install space."""
    rules = (
        (r'"/usr" STREQUAL "/usr"', f'"{PREFIX}" STREQUAL "/usr"'),
        (r"_INSTALL_PREFIX /usr\)", f"_INSTALL_PREFIX {PREFIX})"),
        (rf"/usr/lib/{multiarch}(?=[;)\"'/ ])", f"{PREFIX}/lib"),
        (r"(?<![\w.])/usr/(lib|share|etc|bin(?!/(?:env|python3)\b))(?=/)", rf"{PREFIX}/\1"),
        (r"(?<![\w.])/usr/lib(?=[;)\"' ])", f"{PREFIX}/lib"),
        (r"^prefix=/usr$", f"prefix={PREFIX}"),
        (rf"/lib/{multiarch}", "/lib"),
        (r"WORKSPACE//etc", "WORKSPACE/etc"),
        (r'(ROS_DISTRO=|!= ")Debian', r"\1noetic"),
    )
    for pattern, replacement in rules:
        text = re.sub(pattern, replacement, text, flags=re.MULTILINE)
    return text


def python38() -> Path | None:
    """Return where a Python 3.8 of this machine is installed that can be copied; None without one."""
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    on_path = shutil.which("python3.8")
    found = [*pyenv.glob("versions/3.8*/bin/python3.8"), *([Path(on_path)] if on_path else [])]
    for program in found:
        ask = [program, "-c", "import ctypes, pip, ssl, sys; print(sys.base_prefix)"]
        done = subprocess.run(ask, capture_output=True, text=True, check=False)
        if done.returncode == 0 and done.stdout.strip() != "/usr":
            return Path(done.stdout.strip())
    return None


def _copy_python(python: Path, target: Path) -> None:
    without = shutil.ignore_patterns("test", "__pycache__", "idlelib", "config-3.8-*")
    shutil.copytree(python / "lib/python3.8", target / "lib/python3.8", symlinks=True, ignore=without)
    for file in (python / "bin/python3.8", *python.glob("lib/libpython3.8.so*")):
        shutil.copy2(file, target / file.parent.name / file.name, follow_symlinks=False)
