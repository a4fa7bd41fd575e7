"""Messages of ROS 2 (CDR, with `ros2msg` definitions) as ROS 1's, so that whatever reads those reads them too."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from grader.evidence.definitions import DefinitionError, sections_of
from grader.evidence.run import Channel

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


def ros1_type(name: str) -> str:
    """`std_msgs/String` for `std_msgs/msg/String`."""
    return name.replace("/msg/", "/")


def ros1_definition(type_: str, definition: str) -> str:
    """Return a `ros2msg` definition in ROS 1's words: without bounds, defaults and constants, its times as `time`.

    Raises DefinitionError for a part without a name.
    """
    parts: list[str] = []
    for name, lines in sections_of(ros1_type(type_), definition.replace("/msg/", "/")):
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
    from grader.evidence.decode import Decoder  # noqa: PLC0415 - numpy, which few recordings need

    decoder = Decoder(type_, definition)
    return [decoder.from_cdr(one) for one in data]


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
