"""Channels of another tool's recording, as the checks know them: one a publisher on a topic."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from grader.evidence.run import Channel, Message


def merged(channels: Iterable[Channel], *, renumber: bool) -> tuple[Channel, ...]:
    """Channels that differ in nothing but their messages (a publisher that connected twice) become one.

    `renumber` counts each channel's messages anew: other tools number them across channels, or not at all.
    """
    groups: dict[tuple[str, str, str, str, str], list[Channel]] = {}
    for one in channels:
        key = (one.topic, one.callerid, one.type, one.md5sum, one.definition)
        groups.setdefault(key, []).append(one)
    return tuple(_merged(groups.pop(key), renumber=renumber) for key in list(groups))


def _merged(group: list[Channel], *, renumber: bool) -> Channel:
    messages = sorted((m for one in group for m in one.messages), key=lambda message: message.log_time_ns)
    if renumber and any(m.sequence != number for number, m in enumerate(messages)):
        messages = [Message(m.log_time_ns, number, m.data) for number, m in enumerate(messages)]
    return replace(group[0], latching=any(one.latching for one in group), messages=tuple(messages))
