"""The files that a process tree left in its memory, looked at once its processes have ended.

What lies there was written by students: it is listed and read as data. No link is followed and no pipe is waited for.
"""

import base64
import contextlib
import os
import stat
from pathlib import PurePosixPath

DEPTH_MAX = 12
LOOKED_AT_MAX = 20000
LISTED_MAX = 50
SHOWN = ".ros"
"""The one hidden folder in which results lie: nodes that roslaunch starts work there."""
LEFT_OUT = ("/.ros/log", "/catkin_ws/build", "/catkin_ws/devel", "/__pycache__")
OPEN = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


def left_files(places, patterns, limits):
    """Yield `path`, `bytes` and `data` of each file. `places` maps paths as processes see them to folders here.

    `data` is base64 where the path ends as one of the patterns says, as long as the limits last; else None.
    """
    room, files, listed = limits["kept_bytes"], limits["kept_files"], 0
    for inside, top in places.items():
        for path, size, name, folder in _walk(top, inside):
            data = None
            if files and size <= room and any(PurePosixPath(path).match(pattern) for pattern in patterns):
                data = _read(name, folder, size)
            if data is not None:
                room, files = room - len(data), files - 1
                yield {"path": path, "bytes": len(data), "data": base64.b64encode(data).decode()}
            elif listed < LISTED_MAX:
                listed += 1
                yield {"path": path, "bytes": size, "data": None}


def _walk(top, inside):
    """Yield (path for the processes, size, name, descriptor of its folder) of each regular file that shows."""
    looked_at = 0
    for folder, folders, files, descriptor in os.fwalk(top):
        below = inside + folder[len(top) :]
        deep = below.count("/") >= DEPTH_MAX
        folders[:] = [] if deep else sorted(name for name in folders if _shows(below, name))
        for name in sorted(files):
            looked_at += 1
            if looked_at > LOOKED_AT_MAX:
                return
            with contextlib.suppress(OSError):  # it cannot be looked at
                about = os.stat(name, dir_fd=descriptor, follow_symlinks=False)
                if stat.S_ISREG(about.st_mode) and _shows(below, name):
                    path = os.fsencode(os.path.join(below, name)).decode("utf-8", "replace")
                    yield path, about.st_size, name, descriptor


def _shows(below, name):
    hidden = name.startswith((".", "rospack_cache_", "rosstack_cache_")) and name != SHOWN
    return not hidden and not os.path.join(below, name).endswith(LEFT_OUT)


def _read(name, folder, size):
    """Return the bytes of a regular file, `size` at most; None for anything else."""
    with contextlib.suppress(OSError), open(os.open(name, OPEN, dir_fd=folder), "rb") as file:
        if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            return file.read(size)
    return None
