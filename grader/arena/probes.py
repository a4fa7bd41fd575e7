"""Messages that the grader makes up for one run: nobody can guess them."""

from __future__ import annotations

import base64
import random
import string
from collections.abc import Iterator, Mapping
from itertools import pairwise, zip_longest
from typing import Any, NamedTuple

from grader.rubric.model import Probe

PROBE_LETTERS = 6
TEXTS_FOR_ONE_TWICE = 4
PAUSE_BEFORE_SAME = 3
RANGES = {
    f"std_msgs/{'U' * (not signed)}Int{bits}": (-(1 << bits - 1), (1 << bits - 1) - 1)
    if signed
    else (0, (1 << bits) - 1)
    for bits in (8, 16, 32, 64)
    for signed in (True, False)
}
_random = random.SystemRandom()


class Shot(NamedTuple):
    """One message to send; `pause_s` is the time to the next one. `value` is its `data`, or a map of its fields."""

    topic: str
    type: str
    value: Any
    pause_s: float

    @property
    def word(self) -> str | None:
        """What a listener prints of it; None where that is no single word."""
        return (
            str(self.value)
            if isinstance(self.value, str | int) and not isinstance(self.value, bool)
            else None
        )


def make_shots(probes: tuple[Probe, ...]) -> list[Shot]:
    """All probes' messages in the order of sending: the topics take turns.

    Before a text comes a second time there is a longer pause, in which the first one can be printed.
    """
    rows = zip_longest(*(list(_values(probe)) for probe in probes))
    shots: list[Shot] = []
    for row in rows:
        sent = [(p, v) for p, v in zip(probes, row, strict=True) if v is not None]
        shots += [Shot(p.topic, p.type, v, 1 / p.rate_hz / len(sent)) for p, v in sent]
    return [*(_before(shot, following) for shot, following in pairwise(shots)), *shots[-1:]]


def _before(shot: Shot, following: Shot) -> Shot:
    same = (shot.topic, shot.value) == (following.topic, following.value) and isinstance(shot.value, str)
    return shot._replace(pause_s=shot.pause_s * PAUSE_BEFORE_SAME) if same else shot


def advertisement(probe: Probe) -> dict[str, Any]:
    """The fields of the arena's command `advertise`."""
    from grader.evidence.decode import definition, md5sum  # noqa: PLC0415 - numpy, which not every run needs

    return {
        "topic": probe.topic,
        "type": probe.type,
        "md5sum": md5sum(probe.type),
        "definition": definition(probe.type),
        "latching": False,
    }


def publication(shot: Shot) -> dict[str, Any]:
    """The fields of the arena's command `publish`."""
    from grader.evidence.decode import encode  # noqa: PLC0415 - as above

    record = {
        "action": "publish",
        "actor": "grader",
        "topic": shot.topic,
        "type": shot.type,
        "value": shot.value,
    }
    data = base64.b64encode(encode(shot.type, fields_of(shot.value))).decode()
    return {"topic": shot.topic, "data": data, "record": record}


def fields_of(value: object) -> Mapping[str, Any]:
    """A message by its fields; a bare value is the field `data`."""
    return value if isinstance(value, Mapping) else {"data": value}


def _values(probe: Probe) -> Iterator[Any]:
    twice = probe.text >= TEXTS_FOR_ONE_TWICE
    values: list[str | int] = [_two_words() for _ in range(probe.text - twice)]
    if probe.integers or probe.among:
        low, high = RANGES[probe.type]
        values += [*_integers(probe, low, high), *probe.among]
    _random.shuffle(values)
    if twice:
        _repeat_one(values)
    yield from values
    for _ in range(probe.times if probe.values else 0):
        yield from probe.values


def _repeat_one(values: list[str | int]) -> None:
    """One text comes twice running, neither first nor last: a listener may not leave out what it knows already."""
    texts = [i for i, value in enumerate(values) if isinstance(value, str)]
    at = _random.choice(texts[1:-1])
    values.insert(at, values[at])


def _integers(probe: Probe, low: int, high: int) -> Iterator[int]:
    """Different from each other and from those of `among`."""
    taken = set(probe.among)
    for _ in range(min(probe.integers, high - low + 1 - len(taken))):
        value = _random.randint(low, high)
        while value in taken:
            value = _random.randint(low, high)
        taken.add(value)
        yield value


def _two_words() -> str:
    """Two words of letters, large and small: never to be taken for a number of another probe."""
    return " ".join(
        "".join(_random.choice(string.ascii_letters) for _ in range(PROBE_LETTERS)) for _ in range(2)
    )
