"""Messages that the grader makes up for one run: nobody can guess them."""

from __future__ import annotations

import base64
import random
import string
from collections.abc import Iterator
from itertools import zip_longest
from typing import Any, NamedTuple

from grader.evidence.decode import definition, encode, md5sum
from grader.rubric.model import Probe

TEXT_LENGTH = 10
RANGES = {"std_msgs/Int8": (-128, 127)}
_random = random.SystemRandom()


class Shot(NamedTuple):
    """One message to send; `pause_s` is the time to the next one."""

    topic: str
    type: str
    value: str | int
    pause_s: float


def make_shots(probes: tuple[Probe, ...]) -> list[Shot]:
    """All probes' messages in the order of sending: the topics take turns."""
    rows = zip_longest(*(_values(probe) for probe in probes))
    shots: list[Shot] = []
    for row in rows:
        sent = [(p, v) for p, v in zip(probes, row, strict=True) if v is not None]
        shots += [Shot(p.topic, p.type, v, 1 / p.rate_hz / len(sent)) for p, v in sent]
    return shots


def advertisement(probe: Probe) -> dict[str, Any]:
    """The fields of the arena's command `advertise`."""
    return {
        "topic": probe.topic,
        "type": probe.type,
        "md5sum": md5sum(probe.type),
        "definition": definition(probe.type),
        "latching": False,
    }


def publication(shot: Shot) -> dict[str, Any]:
    """The fields of the arena's command `publish`."""
    record = {
        "action": "publish",
        "actor": "grader",
        "topic": shot.topic,
        "type": shot.type,
        "value": shot.value,
    }
    data = base64.b64encode(encode(shot.type, {"data": shot.value})).decode()
    return {"topic": shot.topic, "data": data, "record": record}


def _values(probe: Probe) -> Iterator[str | int]:
    values: list[str | int] = [_text() for _ in range(probe.text)]
    if probe.integers or probe.among:
        low, high = RANGES[probe.type]
        others = [n for n in range(low, high + 1) if n not in probe.among]
        values += [*_random.sample(others, probe.integers), *probe.among]
    _random.shuffle(values)
    yield from values


def _text() -> str:
    """Letters first: never to be taken for a number of another probe."""
    return "".join(_random.choice(string.ascii_lowercase) for _ in range(TEXT_LENGTH))
