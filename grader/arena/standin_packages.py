"""Packages that stand in for those that a machine lacks (docs/how-to/standins.md): which, and how ROS finds them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from catkin_pkg.package import PACKAGE_MANIFEST_FILENAME
from catkin_pkg.packages import find_package_paths

from grader.arena.ros_env import RosInstallation

STANDIN_SOURCES = Path(__file__).resolve().parent / "standins"
SHEBANG = b"#!"
SHARE = "share"
LIBRARY = "python"
CMAKE = "cmake"


def known_packages() -> tuple[str, ...]:
    """Every package that can be stood in for."""
    return tuple(sorted(p.parent.name for p in STANDIN_SOURCES.glob(f"*/{PACKAGE_MANIFEST_FILENAME}")))


def missing_packages(ros: RosInstallation) -> tuple[str, ...]:
    """Those of them that this ROS does not know."""
    known = set(_installed(ros)) | set(_overlaid(ros))
    return tuple(name for name in known_packages() if name not in known)


def copy_standins(folder: Path, ros: RosInstallation) -> None:
    """Write what this ROS lacks into `folder`, an install space: `share/<package>`, programs executable whatever an
    archive made of their bits."""
    (folder / SHARE).mkdir(parents=True)
    for name in (LIBRARY, CMAKE):
        _copy(STANDIN_SOURCES / name, folder / name)
    for name in missing_packages(ros):
        _copy(STANDIN_SOURCES / name, folder / SHARE / name)
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o755 if path.is_dir() or _is_program(path) else 0o644)


def with_standins(env: Mapping[str, str], copied: Path, inside: str) -> dict[str, str]:
    """The environment in which ROS finds the stand-ins after everything else. `copied` is the folder that
    `copy_standins` wrote, `inside` where processes see it."""
    packages = sorted(p.name for p in (copied / SHARE).iterdir())
    if not packages:
        return dict(env)
    python = [f"{inside}/{LIBRARY}", *(f"{inside}/{SHARE}/{name}/{LIBRARY}" for name in packages)]
    added = {"ROS_PACKAGE_PATH": [f"{inside}/{SHARE}"], "PYTHONPATH": python, "CMAKE_PREFIX_PATH": [inside]}
    return {**env, **{name: _append(env.get(name, ""), entries) for name, entries in added.items()}}


def _copy(source: Path, target: Path) -> None:
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(source, target, ignore=ignored, copy_function=shutil.copyfile)


def _append(path: str, entries: list[str]) -> str:
    before = [entry for entry in path.split(os.pathsep) if entry and entry not in entries]
    return os.pathsep.join([*before, *entries])


def _is_program(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(SHEBANG)) == SHEBANG


def _installed(ros: RosInstallation) -> Iterator[str]:
    entries = [Path(entry) for entry in _package_path(ros)]
    for share in (*entries, *(Path(prefix) / SHARE for prefix in ros.prefixes)):
        yield from (name for name in known_packages() if (share / name / PACKAGE_MANIFEST_FILENAME).is_file())


def _overlaid(ros: RosInstallation) -> Iterator[str]:
    """Packages of the workspaces that a `setup.bash` is made of, which may lie deeper, or be the entry itself."""
    for entry in _package_path(ros):
        if Path(entry).name != SHARE and Path(entry).is_dir():
            yield from (Path(entry, path).resolve().name for path in find_package_paths(entry))


def _package_path(ros: RosInstallation) -> list[str]:
    return [entry for entry in ros.env.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if entry]
