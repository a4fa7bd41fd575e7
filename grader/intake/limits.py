"""How much a submission may be. Generous for students' work, small for what is sent to do harm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePosixPath

from grader.errors import SubmissionError
from grader.intake.tree import MAX_DEPTH, too_deep

# What is not run and not read: pictures, models, data, archives.
NO_CODE = frozenset(
    (
        ".avi", ".bag", ".bak", ".bz2", ".csv", ".dae", ".db", ".db3", ".gif", ".gz", ".h5", ".jpeg", ".jpg", ".key",
        ".log", ".mcap", ".md", ".mp4", ".npy", ".npz", ".obj", ".onnx", ".pcd", ".pdf", ".pem", ".pgm", ".ply", ".png",
        ".pt", ".pth", ".pyc", ".sqlite", ".stl", ".svg", ".swp", ".tar", ".webm", ".xz", ".zip",
    )
)  # fmt: skip
_RECORDINGS = (".bag", ".mcap", ".db3")
# A file takes whole blocks of a disk, however little is in it.
_BLOCK_BYTES = 4096


@dataclass(frozen=True, kw_only=True)
class IntakeLimits:
    """Of an archive: `packed_bytes` as it is handed in, `stream_bytes` that come out of a packed tar, kept or not.

    Of an archive or a commit: `entries`, and `total_bytes` on this machine's disk. A file of more than `file_bytes`
    (`recording_bytes` for a recording) is left out, and so are pictures, models and data once they are more than
    `material_bytes` together, and the largest files of a package of more than `package_bytes`, which is copied twice.
    `links` have a relative target: each is followed to see where it leads.
    """

    packed_bytes: int = 1 << 30
    stream_bytes: int = 1 << 30
    total_bytes: int = 100 << 20
    material_bytes: int = 64 << 20
    file_bytes: int = 32 << 20
    recording_bytes: int = 96 << 20
    package_bytes: int = 48 << 20
    entries: int = 100_000
    folders: int = 10_000
    package_files: int = 10_000
    links: int = 2_000

    def largest_bytes(self, path: str) -> int:
        """Return how large the file of that name may be."""
        return self.recording_bytes if path.lower().endswith(_RECORDINGS) else self.file_bytes


class Meter:
    """Counts what is taken from a source and refuses more than the limits allow."""

    def __init__(self, limits: IntakeLimits, *, name: str) -> None:
        self._limits = limits
        self._name = name
        self._entries = 0
        self._bytes = 0
        self._material_bytes = 0
        self._folders: set[str] = set()

    def entry(self, path: str) -> None:
        """Count an entry of any kind, by its path."""
        self._entries += 1
        if path.count("/") > MAX_DEPTH:
            raise too_deep(self._name)
        if self._entries > self._limits.entries:
            raise too_much(self._name, f"holds more than {self._limits.entries} files")

    def folders(self, path: str) -> None:
        """Count the folders on the way to `path`, each once: they take room as well."""
        above = path.rpartition("/")[0]
        while above and above not in self._folders:
            self._folders.add(above)
            self.data(1)
            if len(self._folders) > self._limits.folders:
                raise too_much(self._name, f"holds more than {self._limits.folders} folders")
            above = above.rpartition("/")[0]

    def has_room(self, path: str, size_bytes: int) -> bool:
        """Return whether a file is taken: not one that is too large, nor one more picture where there are too many."""
        if size_bytes > self._limits.largest_bytes(path):
            return False
        suffix = PurePosixPath(path).suffix.lower()
        # a recording may be what the lab asks for, so it does not count as material
        if suffix not in NO_CODE or suffix in _RECORDINGS:
            return True
        self._material_bytes += size_bytes
        return self._material_bytes <= self._limits.material_bytes

    def data(self, size_bytes: int) -> None:
        """Count a file that is to be written; an empty one is not for nothing either."""
        self._bytes += max(1, -(-size_bytes // _BLOCK_BYTES)) * _BLOCK_BYTES
        if self._bytes > self._limits.total_bytes:
            raise too_much(self._name, f"is larger than {self._limits.total_bytes >> 20} MiB when unpacked")


def too_much(name: str, what: str) -> SubmissionError:
    """Return the error for a source that goes beyond the limits."""
    return SubmissionError(
        f"{name} {what}, which is more than a lab's submission may be",
        hint="Hand in the package alone, without build/, devel/ and recordings.",
    )
