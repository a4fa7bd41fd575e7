"""Namespaces of the arena's own: a network in which nothing but the loopback is up, and mounts that no other process
sees (man 7 namespaces).

The calling process enters them itself, so there is no helper that could be left behind when a process is killed. Run as
a script it enters them, mounts what a stage would, and becomes the program that its arguments name.
"""

import contextlib
import ctypes
import fcntl
import os
import socket
import stat
import struct
import sys

CLONE_NEWNS = 0x00020000
CLONE_NEWUSER = 0x10000000
CLONE_NEWNET = 0x40000000
MS_NOSUID, MS_NODEV, MS_REC, MS_PRIVATE = 0x2, 0x4, 0x4000, 0x40000
MNT_DETACH = 2
SIOCGIFFLAGS = 0x8913
SIOCSIFFLAGS = 0x8914
IFF_UP = 1
IFREQ = struct.Struct("16sh14x")
SIZE_BYTES = 512 << 20
"""More than any package, with what its build left, can have."""
INODES = 100_000
COPIED_BYTES = 1 << 20
KEYCTL_JOIN_SESSION_KEYRING = 1
# Neither Python nor the C library has a function for it: the call's number by processor (asm/unistd.h).
KEYCTL = {
    "x86_64": 250,
    "aarch64": 219,
    "i686": 288,
    "armv7l": 311,
    "riscv64": 219,
    "ppc64le": 271,
    "s390x": 280,
}
PROBED = "/sys"  # in a namespace that ends with the probe
LIBC = ctypes.CDLL(None, use_errno=True)
"""Every arena is a copy of a process that has it already."""


def enter_own_namespaces():
    """Enter them; the process has one thread. A user who may not make them gets a user namespace, with the same user
    in it. Raises OSError where the machine allows neither."""
    if os.geteuid() == 0:
        _unshare(CLONE_NEWNET | CLONE_NEWNS)
    else:
        uid, gid = os.geteuid(), os.getegid()
        _unshare(CLONE_NEWUSER | CLONE_NEWNET | CLONE_NEWNS)
        # The kernel lets an unprivileged user map a group only after that (man 7 user_namespaces).
        _write("/proc/self/setgroups", "deny")
        _write("/proc/self/uid_map", "{0} {0} 1".format(uid))
        _write("/proc/self/gid_map", "{0} {0} 1".format(gid))
    # Otherwise mounts made here would appear in the machine's own namespace.
    _mount("none", "/", None, MS_REC | MS_PRIVATE, None)
    _raise_loopback()


def mount_tmpfs(folder, size_bytes, inodes, owner, mode):
    """Files in memory, of a size and a number that are held by the kernel. Raises OSError."""
    options = "size={},nr_inodes={},mode={:o},uid={},gid={}".format(size_bytes, inodes, mode, owner, owner)
    _mount("tmpfs", folder, "tmpfs", MS_NOSUID | MS_NODEV, options)


def unmount(folder):
    """Unmount it now, or as soon as it is used no more."""
    LIBC.umount2(os.fsencode(folder), MNT_DETACH)


def _unshare(flags):
    if LIBC.unshare(flags) != 0:
        number = ctypes.get_errno()
        raise OSError(number, "no namespaces of its own: " + os.strerror(number))


def _mount(source, target, kind, flags, options):
    words = [None if word is None else os.fsencode(word) for word in (source, target, kind, options)]
    if LIBC.mount(words[0], words[1], words[2], ctypes.c_ulong(flags), words[3]) != 0:
        number = ctypes.get_errno()
        raise OSError(number, "nothing can be mounted: " + os.strerror(number))


def _write(path, text):
    with open(path, "w") as file:
        file.write(text)


def _raise_loopback():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        request = IFREQ.pack(b"lo", 0)
        _, flags = IFREQ.unpack(fcntl.ioctl(sock, SIOCGIFFLAGS, request))
        fcntl.ioctl(sock, SIOCSIFFLAGS, IFREQ.pack(b"lo", flags | IFF_UP))


def leave_keys_behind():
    """Join a new, empty session keyring (man 7 keyrings), which all that the process starts inherits: the keys of the
    person who grades are not for students. Where the kernel has no keys, or forbids this, none can be read anyway."""
    number = KEYCTL.get(os.uname().machine)
    if number is not None:
        LIBC.syscall(number, KEYCTL_JOIN_SESSION_KEYRING, None)


class Stage:
    """What sandboxes are shown of the grader's files: copies in memory, in the arena's own mount namespace.

    A bind mount tells where it comes from (`/proc/self/mountinfo`); what comes from here has a number in place of a
    path of the machine. The memory in which a process tree may write comes from here too: bubblewrap's own tmpfs would
    have no bound for the number of files.

    `folder` is empty, and every user may pass through it. Raises OSError where nothing can be mounted.
    """

    def __init__(self, folder, owner):
        self.folder = folder
        self._owner = owner
        self._copies = {}
        self._number = 0
        mount_tmpfs(folder, SIZE_BYTES, INODES, os.geteuid(), 0o711)

    def copy(self, path):
        """Return the name, relative to `folder`, of a copy of this file or folder as it was when it was first asked
        for."""
        if path not in self._copies:
            name = self._new_name()
            copy_tree(path, os.path.join(self.folder, name))
            self._copies[path] = name
        return self._copies[path]

    def scratch(self, size_bytes, inodes):
        """Return the name of new memory for files that students' processes may write."""
        name = self._new_name()
        folder = os.path.join(self.folder, name)
        os.mkdir(folder)
        mount_tmpfs(folder, size_bytes, inodes, self._owner, 0o755)
        return name

    def used_bytes(self, name):
        """Return how many bytes are written in a scratch."""
        try:
            found = os.statvfs(os.path.join(self.folder, name))
        except OSError:
            return 0
        return (found.f_blocks - found.f_bfree) * found.f_frsize

    def give_up(self, name):
        """Give up a scratch whose processes have ended."""
        folder = os.path.join(self.folder, name)
        unmount(folder)
        with contextlib.suppress(OSError):  # it goes with the arena
            os.rmdir(folder)

    def _new_name(self):
        self._number += 1
        return str(self._number)


def copy_tree(source, target):
    """Links as links, files with their modes, nothing else. What was written by a student is followed nowhere."""
    # Not `shutil.copytree`, which looks at each file several times: every run copies a whole workspace.
    mode = os.lstat(source).st_mode
    if stat.S_ISLNK(mode):
        os.symlink(os.readlink(source), target)
    elif stat.S_ISDIR(mode):
        os.mkdir(target, 0o755)
        for name in os.listdir(source):
            copy_tree(source + "/" + name, target + "/" + name)
    elif stat.S_ISREG(mode):
        with open(source, "rb", buffering=0) as ours, open(target, "xb", buffering=0) as theirs:
            while theirs.write(ours.read(COPIED_BYTES)):
                pass
            os.fchmod(theirs.fileno(), mode & 0o777)


if __name__ == "__main__":
    try:
        enter_own_namespaces()
        mount_tmpfs(PROBED, 4096, 16, os.geteuid(), 0o755)
    except OSError as error:
        sys.exit(error.strerror)
    os.execv(sys.argv[1], sys.argv[1:])  # noqa: S606 - becoming that program is what it is for
