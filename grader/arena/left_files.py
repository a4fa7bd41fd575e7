"""The files that a run's processes left behind: from the arena into the evidence."""

from __future__ import annotations

import base64
from pathlib import PurePosixPath

from grader.arena.process_environment import ProcessEnvironment
from grader.arena.sandbox_files import HOME
from grader.evidence.events import ActorEvent
from grader.evidence.run import left_name
from grader.evidence.writer import EvidenceWriter
from grader.files import open_untrusted

LISTED_MAX = 200


class LeftFiles:
    """The files that a run's processes left, as `ros/processes.py` reads them.

    Each is an event, and what is kept of it an attachment, within the run's limits. A file of the package that is as it
    was handed in is not left by the run.
    """

    def __init__(self, place: ProcessEnvironment, writer: EvidenceWriter) -> None:
        self._place, self._writer = place, writer
        self._left_bytes, self._left_files = place.limits.kept_bytes, place.limits.kept_files
        self._listed = 0

    def add(self, process: str, path: str, size_bytes: int, data: str | None, time_ns: int) -> None:
        """Add a file by its path in the sandbox; `data` is base64, or None where the arena does not keep it."""
        content = None if data is None else base64.b64decode(data)
        if self._listed >= LISTED_MAX or self._is_handed_in(path, size_bytes, content):
            return
        self._listed += 1
        shown = path.replace(HOME, "~", 1)
        event = ActorEvent(action="left", actor=process, value=size_bytes, detail=shown)
        self._writer.event("/grader/actor", time_ns, event)
        if content is not None and self._left_files and len(content) <= self._left_bytes:
            self._left_bytes -= len(content)
            self._left_files -= 1
            self._writer.attach(left_name(process, shown), content, time_ns, "application/octet-stream")

    def _is_handed_in(self, path: str, size_bytes: int, content: bytes | None) -> bool:
        sources = PurePosixPath(self._place.inside_workspace, "src")
        if not PurePosixPath(path).is_relative_to(sources):
            return False
        try:
            with open_untrusted(
                self._place.workspace.repaired, *PurePosixPath(path).relative_to(sources).parts
            ) as file:
                before = file.read(size_bytes + 1)
        except OSError:
            return False
        return len(before) == size_bytes and content in {None, before}
