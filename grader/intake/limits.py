"""How much a submission may be. Generous for students' work, small for what is sent to do harm."""

from __future__ import annotations

from dataclasses import dataclass

from grader.errors import SubmissionError
from grader.intake.tree import MAX_DEPTH, too_deep


@dataclass(frozen=True, kw_only=True)
class Limits:
    """`ratio` is unpacked to packed size; it counts above `ratio_floor_bytes`: an empty map packs well."""

    total_bytes: int = 1 << 30
    entries: int = 100_000
    ratio: int = 200
    ratio_floor_bytes: int = 100 << 20


class Meter:
    """Counts what is taken from a source and refuses more than the limits, and `allowance_bytes`, allow."""

    def __init__(
        self, limits: Limits, *, name: str, packed_bytes: int | None = None, allowance_bytes: int = 0
    ) -> None:
        self._limits = limits
        self._name = name
        self._packed_bytes = packed_bytes
        self._entries = 0
        self._bytes = -allowance_bytes

    def entry(self, path: str) -> None:
        self._entries += 1
        if path.count("/") > MAX_DEPTH:
            raise too_deep(self._name)
        if self._entries > self._limits.entries:
            self._refuse(f"holds more than {self._limits.entries} files")

    def data(self, size_bytes: int) -> None:
        self._bytes += size_bytes
        if self._bytes > self._limits.total_bytes:
            self._refuse(f"is larger than {self._limits.total_bytes >> 20} MiB when unpacked")
        packed = self._packed_bytes
        if packed is None or self._bytes <= self._limits.ratio_floor_bytes:
            return
        if self._bytes > self._limits.ratio * packed:
            self._refuse(f"unpacks to more than {self._limits.ratio} times its size")

    def _refuse(self, what: str) -> None:
        raise SubmissionError(
            f"{self._name} {what}, which is more than a lab's submission may be",
            hint="Hand in the package alone, without build/, devel/ and recordings.",
        )
