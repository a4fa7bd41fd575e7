"""Recordings of ROS 2 as runs of ROS 1, so that whatever reads those reads them too: messages (CDR, with `ros2msg`
definitions), and bags in SQLite (`.db3`, rosbag2's own storage). Of such a bag the file alone is read: what
`metadata.yaml` beside it says, its tables say too.
"""

from __future__ import annotations

import re
import sqlite3
import struct
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from grader.errors import EvidenceError
from grader.evidence.definitions import PACKAGE, DefinitionError, alias, bound, canonical, parse, sections_of
from grader.evidence.run import (
    DECODED_BYTES_MAX,
    BudgetExceeded,
    Channel,
    MemoryBudget,
    Message,
    Run,
    merge_channels,
    recorded_elsewhere,
)

OWN_TYPES = {
    "byte": "uint8",
    "char": "uint8",
    "builtin_interfaces/Time": "time",
    "builtin_interfaces/Duration": "duration",
}
CLOCKS = frozenset({"builtin_interfaces/Time", "builtin_interfaces/Duration"})
RULE = "=" * 80
_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?\d*\])?\s+(?P<name>[A-Za-z]\w*)(?:\s+.*)?",
    re.ASCII,
)
_CONSTANT = re.compile(r"\S+\s+\w+\s*=")
_BOUNDED = re.compile(r"\[<=\d+\]")
_KEPT_FOR_LATE = re.compile(r"durability: *(?:1|transient_local)\b")


def ros1_definition(type_: str, definition: str) -> str:
    """Return a `ros2msg` definition in ROS 1's words: without bounds, defaults and constants, its times as `time`.

    Raises DefinitionError for a part without a name.
    """
    parts: list[str] = []
    for name, lines in sections_of(type_.replace("/msg/", "/"), definition.replace("/msg/", "/")):
        if name not in CLOCKS:
            heading = [f"MSG: {name}"] if parts else []
            parts.append("\n".join([*heading, *_fields(lines)]))
    return f"\n{RULE}\n".join(parts)


def _fields(lines: tuple[str, ...]) -> Iterator[str]:
    """Yield the fields. What is none stays, so that whoever parses the definition refuses it."""
    for line in lines:
        bare = line.partition("#")[0].strip()
        found = _FIELD.fullmatch(bare)
        if _CONSTANT.match(bare):
            continue
        if found is None:
            yield bare
        else:
            kind, array = OWN_TYPES.get(found["type"], found["type"]), found["array"] or ""
            yield f"{kind}{_BOUNDED.sub('[]', array)} {found['name']}"


def ros1_messages(type_: str, definition: str, data: list[bytes]) -> list[bytes]:
    """Return messages in CDR as ROS 1's bytes, by a definition of ROS 1's; what does not fit becomes empty."""
    convert = _converter(type_, definition)
    return [convert(one) if convert is not None else b"" for one in data]


def _converter(type_: str, definition: str) -> Callable[[bytes], bytes] | None:
    """Return what makes ROS 1's bytes of a message in CDR; None where there are none to make."""
    from rosbags.serde import SerdeError  # noqa: PLC0415 - numpy, which few recordings need
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: PLC0415 - as above
    from rosbags.typesys.base import TypesysError  # noqa: PLC0415 - as above

    # Without ROS's own types: the recording's definition counts, also for a type of the same name.
    store, name = get_typestore(Stores.EMPTY), f"{PACKAGE}/msg/{alias(type_)}"
    try:
        types = parse(type_, definition)
        store.register(get_types_from_msg(canonical(types), name))
        store.get_msgdef(name)
    except (DefinitionError, TypesysError, SyntaxError, RecursionError):
        return None
    memory = bound(types)

    def convert(data: bytes) -> bytes:
        if memory.decoded(len(data)) > DECODED_BYTES_MAX:
            return b""
        try:
            return bytes(store.cdr_to_ros1(data, name))
        except (SerdeError, struct.error, ValueError, IndexError, OverflowError, AssertionError):
            return b""

    return convert if types[type_] else None  # CDR makes a byte of a message without fields


def as_ros1(channel: Channel, qos_profiles: str) -> Channel:
    """Return a channel of ROS 2, with its definition as `ros2msg` and messages in CDR, as one of ROS 1."""
    try:
        definition = ros1_definition(channel.type, channel.definition)
    except DefinitionError:
        definition = channel.definition  # then none of its messages can be read
    data = ros1_messages(channel.type, definition, [message.data for message in channel.messages])
    told = zip(channel.messages, data, strict=True)
    return replace(
        channel,
        definition=definition,
        latching=is_latched(qos_profiles),
        messages=tuple(message._replace(data=one) for message, one in told),
    )


def is_latched(qos_profiles: str) -> bool:
    """Return whether a publisher keeps its last message for those that come later, by rosbag2's own metadata."""
    return _KEPT_FOR_LATE.search(qos_profiles) is not None


TOPICS_MAX = 4_096
STEPS_MAX = 100_000_000
"""Of SQLite's machine. A message takes about ten, and a bag has at most 700,000 of them (`run.py`)."""
VALUE_BYTES_MAX = 96 << 20
_LESS = "record the lab's topics only: `ros2 bag record /topic …`"
_AGAIN = "record it again and end it with Ctrl-C, or copy it again"
_CONVERT = "`ros2 bag convert` to MCAP writes the definition into it, on a machine that has the package"
_STEPS_AT_ONCE = 100_000
_COMPUTED = re.compile(r"\b(?:as|generated)\b", re.IGNORECASE)


class _Topic(NamedTuple):
    number: int
    name: str
    type: str
    encoding: str
    qos_profiles: str


def load_rosbag2(path: Path, budget: MemoryBudget) -> Run:
    """Read a bag as a real-time run named after the file, without processes. Raises EvidenceError."""
    try:
        with closing(_open(path)) as bag:
            topics, definitions = _topics(bag, path), _definitions(bag)
            messages = _messages(bag, budget)
    except BudgetExceeded as error:
        raise EvidenceError(f"{path}: {error}", hint=_LESS) from error
    except (sqlite3.Error, ValueError, OverflowError, MemoryError) as error:
        raise EvidenceError(f"{path}: a bag of ROS 2 in SQLite, damaged or cut short", hint=_AGAIN) from error
    found = (_channel(path, topic, definitions, messages[topic.number], budget) for topic in topics)
    return recorded_elsewhere(path, merge_channels(found, renumber=True))


def _open(path: Path) -> sqlite3.Connection:
    """Open a file that may be hostile: read only, no journal beside it, plain tables only, a bounded amount of work."""
    bag = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
    bag.text_factory = lambda text: text.decode(errors="replace")
    bag.execute("PRAGMA trusted_schema=OFF")
    if hasattr(bag, "setlimit"):  # of Python 3.11
        bag.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, VALUE_BYTES_MAX)
    steps_left = STEPS_MAX

    def stop() -> bool:
        nonlocal steps_left
        steps_left -= _STEPS_AT_ONCE
        return steps_left < 0

    bag.set_progress_handler(stop, _STEPS_AT_ONCE)
    return bag


def _columns(bag: sqlite3.Connection, table: str) -> frozenset[str]:
    """Return the names of a table's columns, none where the file lacks it.

    A view, a virtual table or a computed column could be any program, so these raise ValueError.
    """
    made = bag.execute("SELECT rootpage, sql FROM sqlite_master WHERE name = ?", (table,)).fetchall()
    if any(not page or _COMPUTED.search(str(text)) for page, text in made):
        raise ValueError(table)
    return frozenset(row[1] for row in bag.execute(f"PRAGMA table_info({table})"))


def _topics(bag: sqlite3.Connection, path: Path) -> list[_Topic]:
    qos = "offered_qos_profiles" if "offered_qos_profiles" in _columns(bag, "topics") else "''"
    rows = bag.execute(f"SELECT id, name, type, serialization_format, {qos} FROM topics")  # noqa: S608 - our own names
    topics = [_Topic(int(row[0]), *map(str, row[1:])) for row in rows.fetchmany(TOPICS_MAX + 1)]
    if len(topics) > TOPICS_MAX:
        raise EvidenceError(f"{path}: more than {TOPICS_MAX} topics")
    return [topic for topic in topics if topic.encoding == "cdr"]


def _definitions(bag: sqlite3.Connection) -> dict[str, str]:
    """Return the definitions that the bag holds, by type: bags of ROS 2 before Iron hold none."""
    if not _columns(bag, "message_definitions"):
        return {}
    rows = bag.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    return {str(row[0]): str(row[2]) for row in rows.fetchmany(TOPICS_MAX) if row[1] == "ros2msg"}


def _messages(bag: sqlite3.Connection, budget: MemoryBudget) -> dict[int, list[Message]]:
    _columns(bag, "messages")
    found: dict[int, list[Message]] = defaultdict(list)
    for number, at_ns, data in bag.execute("SELECT topic_id, timestamp, data FROM messages"):
        if not (isinstance(number, int) and isinstance(at_ns, int) and isinstance(data, bytes)):
            raise ValueError(f"a message of {number}")  # noqa: TRY004 - of a file, not of a caller
        budget.hold(len(data), foreign=True)
        found[number].append(Message(at_ns, len(found[number]), data))
    for messages in found.values():
        messages.sort(key=lambda message: message.log_time_ns)
    return found


def _channel(
    path: Path, topic: _Topic, definitions: dict[str, str], messages: list[Message], budget: MemoryBudget
) -> Channel:
    definition = definitions.get(topic.type) or _released_definition(topic.type)
    if definition is None:
        raise EvidenceError(f"{path}: no definition of {topic.type[:80]!a} in it", hint=_CONVERT)
    channel = Channel(
        topic=topic.name,
        callerid="",
        type=topic.type.replace("/msg/", "/"),
        md5sum="",
        definition=definition,
        latching=False,
        messages=tuple(messages),
        budget=budget,
    )
    return as_ros1(channel, topic.qos_profiles)


def _released_definition(type_: str) -> str | None:
    """Return the definition of a type of ROS 2's own packages, as ROS 2 Humble has it, or None."""
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - numpy, which few recordings need

    store = get_typestore(Stores.ROS2_HUMBLE)
    return store.generate_msgdef(type_, ros_version=2)[0] if type_ in store.types else None
