"""What sandboxes are shown of the grader's files: copies in memory, in the arena's own mount namespace.

A bind mount tells where it comes from (`/proc/self/mountinfo`). What comes from here has a number in place of a path of
the machine. The memory in which a process tree may write comes from here too: bubblewrap's own tmpfs would have no
bound for the number of files.
"""

import contextlib
import os
import shutil

from namespaces import mount_tmpfs, unmount

SIZE_BYTES = 512 << 20
"""More than any package, with what its build left, can have."""
INODES = 100_000


class Stage:
    """`folder` is empty, and every user may pass through it. Raises OSError where nothing can be mounted."""

    def __init__(self, folder, owner):
        self.folder = folder
        self._owner = owner
        self._copies = {}
        self._number = 0
        mount_tmpfs(folder, SIZE_BYTES, INODES, os.geteuid(), 0o711)

    def copy(self, path):
        """The name, relative to `folder`, of a copy of this file or folder as it was when it was first asked for."""
        if path not in self._copies:
            name = self._new_name()
            copy_tree(path, os.path.join(self.folder, name))
            self._copies[path] = name
        return self._copies[path]

    def scratch(self, size_bytes, inodes):
        """The name of new memory for files that students' processes may write."""
        name = self._new_name()
        folder = os.path.join(self.folder, name)
        os.mkdir(folder)
        mount_tmpfs(folder, size_bytes, inodes, self._owner, 0o755)
        return name

    def used_bytes(self, name):
        """What is written in a scratch."""
        try:
            found = os.statvfs(os.path.join(self.folder, name))
        except OSError:
            return 0
        return (found.f_blocks - found.f_bfree) * found.f_frsize

    def give_up(self, name):
        """A scratch whose processes have ended."""
        folder = os.path.join(self.folder, name)
        unmount(folder)
        with contextlib.suppress(OSError):  # it goes with the arena
            os.rmdir(folder)

    def _new_name(self):
        self._number += 1
        return str(self._number)


def copy_tree(source, target):
    """Links as links, files with their modes, nothing else. What was written by a student is followed nowhere."""
    if os.path.islink(source):
        os.symlink(os.readlink(source), target)
    elif os.path.isdir(source):
        os.mkdir(target, 0o755)
        for entry in os.scandir(source):
            copy_tree(entry.path, os.path.join(target, entry.name))
    elif os.path.isfile(source):
        shutil.copyfile(source, target)
        os.chmod(target, os.stat(source).st_mode & 0o777)
