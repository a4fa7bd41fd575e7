"""An environment as RoboStack makes it with conda: all of ROS and its Python below one prefix, beside no other ROS.

Conda's channels are not to be had everywhere. So the files are those of the install space of `noetic.py`, moved to the
prefix with the paths inside them. The Python is a copy of Debian's with a `site-packages` of its own, where ROS's
modules are too.
"""

from __future__ import annotations

from tests.fresh import noetic
from tests.fresh.room import PATH, Root

PREFIX = "/opt/conda/envs/ros"
MODULES = "lib/python3.11/site-packages"
OLD_MODULES = "lib/python3/dist-packages"
ACTIVATE = f"{PREFIX}/etc/conda/activate.d/ros-noetic-catkin_activate.sh"
ENV = {"CONDA_PREFIX": PREFIX, "CONDA_DEFAULT_ENV": "ros", "PATH": f"{PREFIX}/bin:{PATH}"}
"""What `conda activate` sets before it runs the scripts in `activate.d`."""
MOVE = f"""
set -e
/usr/bin/python3.11 -m venv --copies {PREFIX}
{PREFIX}/bin/pip install -q {" ".join(f"'{m}'" for m in noetic.MODULES.split() if m != "netifaces")}
cp /usr/lib/python3/dist-packages/netifaces*.so {PREFIX}/{MODULES}
mv {noetic.PREFIX}/{OLD_MODULES}/* {PREFIX}/{MODULES}
cp -a {noetic.PREFIX}/. {PREFIX} && rm -r /opt/ros
grep -rlIE '{noetic.PREFIX}|{OLD_MODULES}|^#!/usr/bin/(env )?python3' {PREFIX} --exclude-dir=pip | xargs sed -i -E \\
  -e 's|{noetic.PREFIX}|{PREFIX}|g' -e 's|{OLD_MODULES}|{MODULES}|g' \\
  -e '1s|^#!/usr/bin/(env )?python3$|#!{PREFIX}/bin/python3|'
sed -i 's|EXISTS "/etc/debian_version"|FALSE|' {PREFIX}/share/catkin/cmake/python.cmake
mkdir -p $(dirname {ACTIVATE}) {PREFIX}/conda-meta
echo '. "$CONDA_PREFIX/setup.sh"' >{ACTIVATE}
"""


def install(root: Root) -> None:
    """Make the environment of a root that has the install space of Noetic, which goes."""
    root.run(["bash", "-c", MOVE], network=True)


def active(*argv: str) -> list[str]:
    """Return the command as a shell runs it in which the environment, whose variables are `ENV`, is active."""
    return ["bash", "-c", f'. {ACTIVATE} && exec "$@"', "bash", *argv]
