"""Read evidence files into `Run`s: the grader's own, and recordings of other tools (MCAP, bags)."""

from __future__ import annotations

import os
import struct
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from io import BytesIO
from operator import itemgetter
from pathlib import Path, PurePath
from stat import S_ISREG
from typing import Any, BinaryIO

from mcap import records as mcap
from mcap.exceptions import McapError
from pydantic import ValidationError
from zstandard import ZstdError

from grader.errors import EvidenceError
from grader.evidence.events import FIELDS, METADATA_NAME, PACKAGE_TOPIC, TOPICS
from grader.evidence.mcap_records import MAX_FILE_BYTES, McapRecordError, records
from grader.evidence.run import (
    LESS,
    OTHER_RUNS,
    BudgetExceeded,
    Channel,
    MemoryBudget,
    Message,
    Run,
    merge_channels,
)
from grader.model.package import PackageFacts
from grader.model.version import EVIDENCE, UPDATE

MAX_CHANNELS = 4_096
NAMES_SHOWN = 5
NAME_CHARS_SHOWN = 80
READ = {str(number) for number in range(1, EVIDENCE.version + 1)}
SUFFIXES = {".mcap", ".bag", ".db3"}
MAGIC = b"\x89MCAP0\r\n"
BAG_MAGIC = b"#ROSBAG V"
SQLITE_MAGIC = b"SQLite format 3\0"
SCHEMAS = {"ros1": "ros1msg", "cdr": "ros2msg"}
"""By the encoding of messages, that of their definitions: of ROS 1, and of ROS 2."""
ARRIVAL = itemgetter(Message._fields.index("log_time_ns"))
# What the libraries raise for a damaged file: these have no base of their own.
_DAMAGE = (
    McapError,
    ZstdError,
    struct.error,
    ValueError,
    RuntimeError,
    EOFError,
    KeyError,
    OverflowError,
    MemoryError,
)


def load_run(source: Path | BinaryIO, budget: MemoryBudget | None = None) -> Run:
    """Read one recorded run. A file without the grader's metadata is a real-time run named after the file.

    `budget` is shared with what is loaded beside it. Raises EvidenceError, on one line that names the file, for
    whatever cannot be read to its end.
    """
    budget = budget or MemoryBudget()
    if not isinstance(source, Path):
        name = Path(str(getattr(source, "name", "evidence.mcap"))).name
        return _load(name, BytesIO(source.read(MAX_FILE_BYTES + 1)), budget)
    with _named_errors(source):
        about = source.stat()
        if not S_ISREG(about.st_mode):
            raise EvidenceError(f"{source}: not a file")
        if about.st_size > MAX_FILE_BYTES:
            raise EvidenceError(f"{source}: larger than {MAX_FILE_BYTES >> 20} MiB")
    with _named_errors(source), source.open("rb") as file:
        head = file.read(len(SQLITE_MAGIC))
        # By its first bytes: a file that is named alone may have any ending.
        file.seek(0)
        if head.startswith(BAG_MAGIC):
            from grader.evidence.bag import load_bag  # noqa: PLC0415 - few submissions hold a bag

            return load_bag(source, budget)
        if head == SQLITE_MAGIC:
            from grader.evidence.ros2 import load_rosbag2  # noqa: PLC0415 - few submissions hold one

            return load_rosbag2(source, budget)
        return _load(source.name, file, budget, shown=str(source))


def load_recording(name: str, data: bytes) -> Run:
    """Read a bag or MCAP file that a run left behind. Raises EvidenceError."""
    if data.startswith(BAG_MAGIC):
        from grader.evidence.bag import load_bag  # noqa: PLC0415 - few runs leave a bag

        return load_bag(Path(name), data=data)
    return _load(name, BytesIO(data), MemoryBudget())


def load_evidence(paths: Sequence[Path]) -> dict[str, Run]:
    """Read the runs of these files by scenario; a folder stands for its recordings and those of `evidence/` in it.

    Recordings are `*.mcap`, `*.bag` and `*.db3`. What a repaired copy or a repeated run showed has its folder before
    its name: `repaired-1/talker`. Raises EvidenceError where nothing is found, a file cannot be read, another tool's
    recording is empty, or two files hold the same scenario.
    """
    runs: dict[str, Run] = {}
    origin: dict[str, Path] = {}
    budgets: dict[str, MemoryBudget] = defaultdict(MemoryBudget)
    for path in _files(paths):
        other = path.parent.name if OTHER_RUNS.fullmatch(path.parent.name) else ""
        run = load_run(path, budgets[other])
        if other:
            run = replace(run, scenario=f"{other}/{run.scenario}", evidence=f"{other}/{run.evidence}")
        if run.foreign and not any(channel.messages for channel in run.channels):
            raise EvidenceError(f"{path}: holds no messages", hint="record while the nodes run")
        if run.scenario in runs:
            message = f"{origin[run.scenario]} and {path} both hold the scenario {run.scenario!r}"
            raise EvidenceError(message, hint="give the evidence of one submission at a time")
        runs[run.scenario], origin[run.scenario] = run, path
    return runs


def package_facts(run: Run) -> PackageFacts:
    """Return the package facts that the run carries (`package.mcap` does). Raises EvidenceError without any."""
    if run.package_json is None:
        message = f"{run.evidence}: holds no package facts"
        raise EvidenceError(message, hint="give package.mcap of the same recording")
    try:
        return PackageFacts.read_json(run.package_json)
    except ValidationError as error:
        raise EvidenceError(f"{run.evidence}: the package facts cannot be read: {_first(error)}") from error


def _load(name: str, stream: BinaryIO, budget: MemoryBudget, *, shown: str = "") -> Run:
    shown = shown or name
    size_bytes = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    if size_bytes > MAX_FILE_BYTES:
        raise EvidenceError(f"{shown}: larger than {MAX_FILE_BYTES >> 20} MiB")
    if not size_bytes:
        raise EvidenceError(f"{shown}: the file is empty")
    try:
        return _RunBuilder(name, budget, shown).read(stream)
    except ValidationError as error:
        message = f"{shown}: a record of the grader's own cannot be read: {_first(error)}"
        raise EvidenceError(message) from error
    except BudgetExceeded as error:
        raise EvidenceError(f"{shown}: {error}", hint=LESS) from error
    except McapRecordError as error:
        raise EvidenceError(f"{shown}: not sound MCAP: {error}") from error
    except _DAMAGE as error:
        wrong, hint = _damage(stream)
        raise EvidenceError(f"{shown}: {wrong}", hint=hint) from error


def _damage(stream: BinaryIO) -> tuple[str, str]:
    stream.seek(0)
    head = stream.read(32)
    stream.seek(-min(stream.seek(0, os.SEEK_END), len(MAGIC)), os.SEEK_END)
    tail = stream.read()
    if head.startswith(b"version https://git-lfs"):
        return "only a pointer of Git LFS, the recording itself is not here", "`git lfs pull` fetches it"
    again = "record it again, or copy it again"
    # Without the version and the line end behind it, which a copy as text changes.
    if not head.startswith(MAGIC[:5]):
        return "not an MCAP file and not a bag", again
    return ("damaged" if tail == MAGIC else "cut short: it has no end"), again


def _first(error: ValidationError) -> str:
    """Return the first of pydantic's errors on one line."""
    fault = error.errors(include_url=False, include_input=False)[0]
    place = ".".join(str(part) for part in fault["loc"])
    return f"{error.title}{'.' + place if place else ''}: {fault['msg']}"


@contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise EvidenceError(f"{path}: {error.strerror or type(error).__name__}") from error


def _files(paths: Iterable[Path]) -> list[Path]:
    found: dict[object, Path] = {}
    for path in paths:
        inside = _recordings(path) if path.is_dir() else [path]
        if not inside:
            message = f"{path}: no evidence (*.mcap, *.bag, *.db3) in this folder or in evidence/ below it"
            raise EvidenceError(message)
        for file in inside:
            # A folder and a file in it may both be named, or a link to it.
            found.setdefault(_identity(file), file)
    if not found:
        raise EvidenceError("no evidence given", hint="name evidence files, or a graded submission's folder")
    return list(found.values())


def _identity(file: Path) -> object:
    """Return what is equal of two names of one file."""
    with suppress(OSError, ValueError):  # reading it says so
        about = file.stat()
        return about.st_dev, about.st_ino
    return file


def _recordings(folder: Path) -> list[Path]:
    with _named_errors(folder):
        listed = {place: _names(place) for place in (folder, folder / "evidence")}
        for place, names in list(listed.items()):
            listed |= {place / name: _names(place / name) for name in names if OTHER_RUNS.fullmatch(name)}
        found = [place / name for place, names in listed.items() for name in names if _is_recording(name)]
        return [file for file in found if file.is_file()]


def _names(folder: Path) -> list[str]:
    """Return the names in a folder, in order; none where there is no such folder, or it may not be looked into."""
    try:
        return sorted(os.listdir(folder))  # noqa: PTH208 - names alone: Path objects of all take most of the time
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        return []


def _is_recording(name: str) -> bool:
    return not name.startswith(".") and os.path.splitext(name)[1] in SUFFIXES  # noqa: PTH122 - as above


class _RunBuilder:
    """Builds a run in one pass over a file's records. Messages are collected by channel and not decoded; only the
    grader's own JSON channels are read into records.

    `budget` limits the memory of all that is loaded together, `shown` is what error messages call the file.
    """

    def __init__(self, name: str, budget: MemoryBudget, shown: str) -> None:
        self._name, self._shown = name, shown
        self._budget = budget
        self._schemas: dict[int, mcap.Schema] = {}
        self._channels: dict[int, mcap.Channel] = {}
        self._messages: dict[int, list[Message]] = defaultdict(list)
        self._attachments: dict[str, bytes] = {}
        # The grader writes it before all messages: as long as there is none, the file counts as another tool's.
        self._metadata: dict[str, str] | None = None

    def read(self, stream: BinaryIO) -> Run:
        """Raises EvidenceError for another format, BudgetExceeded, and what `records` and pydantic raise."""
        for found in records(stream):
            if isinstance(found, dict):
                for number, messages in found.items():
                    self._hold_messages(number, messages)
                    self._messages[number] += messages
            else:
                self._describe(found)
        if unknown := self._messages.keys() - self._channels.keys():
            raise McapRecordError(f"messages on {len(unknown)} channels that are not there")
        # Stable: messages of one time keep the order of the file.
        for messages in self._messages.values():
            messages.sort(key=ARRIVAL)
        return self._run()

    def _describe(self, record: mcap.McapRecord) -> None:
        if isinstance(record, mcap.Schema):
            # A file may repeat its schemas, in its chunks and in its summary: they are held once.
            if record.id not in self._schemas:
                self._budget.hold(len(record.data), foreign=self._metadata is None)
                self._schemas[record.id] = record
        elif isinstance(record, mcap.Channel):
            self._channels.setdefault(record.id, record)
            if len(self._channels) > MAX_CHANNELS:
                raise McapRecordError(f"more than {MAX_CHANNELS} channels")
        elif isinstance(record, mcap.Attachment):
            self._attach(record)
        elif isinstance(record, mcap.Metadata) and record.name == METADATA_NAME and self._metadata is None:
            self._metadata = record.metadata

    def _hold_messages(self, number: int, messages: list[Message]) -> None:
        """The arena has limits of its own for its events."""
        channel, foreign = self._channels.get(number), self._metadata is None
        if foreign or channel is None or channel.message_encoding != "json":
            size_bytes = sum([len(message.data) for message in messages])
            self._budget.hold(size_bytes, foreign=foreign, count=len(messages))

    def _attach(self, record: mcap.Attachment) -> None:
        """Another tool's attachments are of no use; the grader's own come behind its metadata."""
        if self._metadata is not None:
            self._budget.hold(len(record.data), foreign=False)
            self._attachments[record.name] = record.data

    def _run(self) -> Run:
        about = self._about()
        times = [t for m in self._messages.values() for t in (m[0].log_time_ns, m[-1].log_time_ns)]
        own: dict[str, Any] = {}
        if self._metadata is None:
            self._refuse_what_is_not_ros()
        else:
            own = {name: self._events(topic) for name, topic in FIELDS.items()}
            own["package_json"] = self._package()
        return Run(
            evidence=self._name,
            metadata=self._metadata or {},
            start_ns=min(times, default=0),
            end_ns=max(times, default=0),
            channels=self._ros_channels(),
            attachments=self._attachments,
            **about,
            **own,
        )

    def _about(self) -> dict[str, Any]:
        if self._metadata is None:
            return {"scenario": PurePath(self._name).stem, "clock": "real", "warp": 1.0}
        version = self._metadata.get("format", "")[:NAME_CHARS_SHOWN]
        if newer := EVIDENCE.newer(f"{EVIDENCE.name}/{version}"):
            raise EvidenceError(f"{self._shown}: {newer}", hint=UPDATE)
        if version not in READ:
            message = f"{self._shown}: evidence of format {version!r}, which no grader wrote"
            raise EvidenceError(message, hint="record it again, or copy it again")
        try:
            scenario, clock = self._metadata["scenario"], self._metadata["clock"]
            return {"scenario": scenario, "clock": clock, "warp": float(self._metadata["warp"])}
        except (KeyError, ValueError) as error:
            raise McapRecordError("its metadata does not say scenario, clock and warp") from error

    def _refuse_what_is_not_ros(self) -> None:
        """Of another tool's recording; channels of other encodings beside ROS's are left alone."""
        encodings = {channel.message_encoding for channel in self._channels.values()}
        if encodings and not encodings & SCHEMAS.keys():
            names = ", ".join(map(_one_line, sorted(encodings)[:NAMES_SHOWN]))
            raise EvidenceError(f"{self._shown}: no message of ROS in it, only {names}")
        for channel in self._channels.values():
            schema, wanted = self._schemas.get(channel.schema_id), SCHEMAS.get(channel.message_encoding)
            if wanted and (schema is None or schema.encoding != wanted):
                message = f"{self._shown}: {_one_line(channel.topic)} has no message definition ({wanted})"
                raise EvidenceError(message)

    def _ros_channels(self) -> tuple[Channel, ...]:
        foreign = self._metadata is None
        read = (
            {"ros1": self._ros_channel, "cdr": self._ros2_channel} if foreign else {"ros1": self._ros_channel}
        )
        found = (
            read[channel.message_encoding](number, channel)
            for number, channel in self._channels.items()
            if channel.message_encoding in read
        )
        return merge_channels(found, renumber=foreign)

    def _ros_channel(self, number: int, channel: mcap.Channel) -> Channel:
        schema, about = self._schemas.get(channel.schema_id), channel.metadata
        return Channel(
            topic=channel.topic,
            callerid=about.get("callerid", ""),
            type=schema.name.replace("/msg/", "/") if schema else "",
            md5sum=about.get("md5sum", ""),
            definition=schema.data.decode(errors="replace") if schema else "",
            latching=about.get("latching") in {"1", "true", "True"},
            # Taken out, so that the messages are not in memory twice.
            messages=tuple(self._messages.pop(number, ())),
            budget=self._budget,
        )

    def _ros2_channel(self, number: int, channel: mcap.Channel) -> Channel:
        from grader.evidence.ros2 import as_ros1  # noqa: PLC0415 - few submissions hold one

        return as_ros1(self._ros_channel(number, channel), channel.metadata.get("offered_qos_profiles", ""))

    def _json(self, topic: str) -> list[Message]:
        """Messages on the grader's own channel; one of that name that a node published is no JSON channel."""
        found = [
            message
            for number, channel in self._channels.items()
            if channel.topic == topic
            and channel.message_encoding == "json"
            and self._has_json_schema(channel)
            for message in self._messages.get(number, ())
        ]
        return sorted(found, key=ARRIVAL)

    def _has_json_schema(self, channel: mcap.Channel) -> bool:
        schema = self._schemas.get(channel.schema_id)
        return schema is not None and schema.encoding == "jsonschema"

    def _events(self, topic: str) -> tuple[tuple[int, Any], ...]:
        messages = self._json(topic)
        events = TOPICS[topic].read_all([message.data for message in messages])
        return tuple(zip([message.log_time_ns for message in messages], events, strict=True))

    def _package(self) -> bytes | None:
        messages = self._json(PACKAGE_TOPIC)
        return messages[-1].data if messages else None


def _one_line(name: str) -> str:
    """Return a name from a foreign file so that it can be shown on one line."""
    text = name[:NAME_CHARS_SHOWN] + ("…" if len(name) > NAME_CHARS_SHOWN else "")
    return text if text.isprintable() else repr(text)
