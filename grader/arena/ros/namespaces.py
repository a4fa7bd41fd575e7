"""Namespaces of the arena's own: a network in which nothing but the loopback is up, and mounts that nobody else sees
(man 7 namespaces).

The calling process enters them itself, so there is no helper that could be left behind when a process is killed. Run as
a script it enters them, mounts what a stage would (`stage.py`), and becomes the program that its arguments name.
"""

import ctypes
import fcntl
import os
import socket
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
PROBED = "/sys"  # in a namespace that ends with the probe


def enter_own_namespaces():
    """For a process of one thread. Who may not make them makes a user namespace for it, with the same user in it.
    Raises OSError where the machine allows neither."""
    if os.geteuid() == 0:
        _unshare(CLONE_NEWNET | CLONE_NEWNS)
    else:
        uid, gid = os.geteuid(), os.getegid()
        _unshare(CLONE_NEWUSER | CLONE_NEWNET | CLONE_NEWNS)
        _write("/proc/self/setgroups", "deny")
        _write("/proc/self/uid_map", "{0} {0} 1".format(uid))
        _write("/proc/self/gid_map", "{0} {0} 1".format(gid))
    _mount("none", "/", None, MS_REC | MS_PRIVATE, None)
    _raise_loopback()


def mount_tmpfs(folder, size_bytes, inodes, owner, mode):
    """Files in memory, of a size and a number that are held by the kernel. Raises OSError."""
    options = "size={},nr_inodes={},mode={:o},uid={},gid={}".format(size_bytes, inodes, mode, owner, owner)
    _mount("tmpfs", folder, "tmpfs", MS_NOSUID | MS_NODEV, options)


def unmount(folder):
    """Now, or as soon as nobody uses it any more."""
    _libc().umount2(os.fsencode(folder), MNT_DETACH)


def _libc():
    return ctypes.CDLL(None, use_errno=True)


def _unshare(flags):
    if _libc().unshare(flags) != 0:
        number = ctypes.get_errno()
        raise OSError(number, "no namespaces of its own: " + os.strerror(number))


def _mount(source, target, kind, flags, options):
    words = [None if word is None else os.fsencode(word) for word in (source, target, kind, options)]
    if _libc().mount(words[0], words[1], words[2], ctypes.c_ulong(flags), words[3]) != 0:
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


if __name__ == "__main__":
    try:
        enter_own_namespaces()
        mount_tmpfs(PROBED, 4096, 16, os.geteuid(), 0o755)
    except OSError as error:
        sys.exit(error.strerror)
    os.execv(sys.argv[1], sys.argv[1:])  # noqa: S606 - becoming that program is what it is for
