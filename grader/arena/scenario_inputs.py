"""What the grader gives to a run: messages and parameters with values that cannot be guessed."""

from __future__ import annotations

import math
import random
import string
from collections.abc import Callable, Iterator, Mapping
from itertools import cycle, pairwise, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from grader.files import read_untrusted
from grader.model.message_definitions import integer_limits
from grader.rubric.scenario import Param, Probe

PROBE_SHAPES = (
    "aaaaaa aaaaaa", "aaaaa aaaaa 5555555.55", "aaaa, aaaaaaa, aaaa and aaa", "aaaaaaa: aaaaa, aaaaaaa: 5555",
    "aaaaaaaaa aaaaaaa aaa aaaaaaaa aaaaaa aaaaa aaaaaaaa", "aaaaaaaaaaaa",
)  # fmt: skip
"""Long and short, with numbers as a lab's own texts, with commas and colons: a text that is cut anywhere is noticed. No
number is one that a lab counts."""
# With fewer, there is no place in the middle for a value that comes twice.
VALUES_FOR_ONE_TWICE = 4
INTEGER_MAX = 10_000
PAUSE_BEFORE_SAME = 3
# The system's randomness: a student's process cannot work out the next values from those that it has seen.
_random = random.SystemRandom()
FILE_BYTES_MAX = 256 << 10
EVENTS_MAX = 2_000
VALUES_MAX = 5_000
DEPTH_MAX = 20
ALIASES_MAX = 20
WORD_LETTERS = 9
LEAST_LETTERS = 5
TEXT_CHARS_MAX = 2_000
NOT_IN_FILE = "not in the file"
OVER = TOO_LARGE, TOO_MUCH = "too large", "too much in it"
"""How the remark on a file ends that is more than is read."""
_EXAMPLES: dict[str, Any] = {"text": "", "integer": 10_000, "number": 1.0}


class Shot(NamedTuple):
    """One message to send; `pause_s` is the time to the next one. `value` is its `data`, or a map of its fields."""

    topic: str
    type: str
    value: Any
    pause_s: float


def make_shots(probes: tuple[Probe, ...]) -> list[Shot]:
    """Return all probes' messages in the order of sending: the topics take turns.

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


def _values(probe: Probe) -> Iterator[Any]:
    twice = probe.text >= VALUES_FOR_ONE_TWICE
    again = probe.integers >= VALUES_FOR_ONE_TWICE
    shapes = cycle(_random.sample(PROBE_SHAPES, len(PROBE_SHAPES)))
    values: list[str | int] = [_made_up_text(next(shapes)) for _ in range(probe.text - twice)]
    if limits := integer_limits(probe.type):
        values += [*_integers(probe, probe.integers - again, *limits), *probe.among]
    _random.shuffle(values)
    if twice or again:
        _repeat_one(values)
    yield from values
    for _ in range(probe.times if probe.values else 0):
        yield from probe.values


def _repeat_one(values: list[str | int]) -> None:
    """Let one value come twice running, neither first nor last: a listener may not leave out what it knows already."""
    at = _random.randrange(1, len(values) - 1)
    values.insert(at, values[at])


def _integers(probe: Probe, count: int, low: int, high: int) -> Iterator[int]:
    """Yield so many integers that differ from each other and from those of `among`, none so large that a node which
    adds or doubles them gets more than the type holds."""
    taken = set(probe.among)
    low, high = max(low, -INTEGER_MAX), min(high, INTEGER_MAX)
    for _ in range(min(count, high - low + 1 - len(taken))):
        value = _random.randint(low, high)
        while value in taken:
            value = _random.randint(low, high)
        taken.add(value)
        yield value


class Setting(NamedTuple):
    """One parameter to set. `name` begins with a slash, `detail` says where it comes from."""

    name: str
    value: Any
    detail: str


def settings(
    params: tuple[Param, ...], find: Callable[[str], Path | None]
) -> tuple[list[Setting], list[str]]:
    """Return what to set in this order, and a remark for each file that could not be read. `find` gives a file's
    place."""
    found: list[Setting] = []
    remarks: list[str] = []
    for param in params:
        if param.file is None:
            value = param.value if param.made_up is None else made_up(_EXAMPLES[param.made_up])
            found.append(Setting(_absolute(param.name or ""), value, "made up" if param.made_up else "given"))
            continue
        leaves, alike, remark = _file(find(param.file))
        remarks += [f"{param.file}: {remark}"] if remark else []
        found += [Setting(name, value, f"made up, for {param.file}") for name, value in leaves.items()]
        lacking = [name for name in map(_absolute, param.also) if name not in leaves]
        detail = f"made up, {NOT_IN_FILE} {param.file}"
        found += [Setting(name, made_up(alike.get(name.rpartition("/")[2], "")), detail) for name in lacking]
    return found, remarks


def made_up(like: object) -> Any:  # noqa: ANN401 - of the type that it stands for
    """Return a value of the same type and shape that cannot be guessed."""
    if isinstance(like, bool) or like is None:
        return like
    if isinstance(like, int):
        return int(_digits(min(max(len(str(min(abs(like), 10**9))), 5), 9)))
    if isinstance(like, float):
        return round(_random.uniform(100, 1000), 3)
    if isinstance(like, list):
        return [made_up(item) for item in like]
    text = str(like)
    if text.strip().isdigit():
        return _digits(max(len(text), 5))
    return _made_up_text(text[:TEXT_CHARS_MAX])


def _made_up_text(like: str) -> str:
    """Return a text of the same shape, which a program may take apart in the same way: letters for letters, digits for
    digits, and the rest as it is. One of few letters gets more of them."""
    count = sum(c.isalnum() for c in like)
    text = "".join(_like_letter(c) for c in like)
    more = "".join(_like_letter("a") for _ in range(LEAST_LETTERS - count if count else WORD_LETTERS))
    return text.rstrip() + more if more else text


def _like_letter(letter: str) -> str:
    if letter.isdigit():
        return _random.choice("123456789")
    if letter.isalpha():
        return _random.choice(string.ascii_uppercase if letter.isupper() else string.ascii_lowercase)
    return letter


def _digits(count: int) -> str:
    """Return digits of which no two neighbours are the same: nothing that a handout would print."""
    found = [_random.choice("123456789")]
    while len(found) < count:
        found.append(_random.choice([d for d in "0123456789" if d != found[-1]]))
    return "".join(found)


class _Loader(yaml.SafeLoader):
    """`yaml.safe_load`, and `rosparam`'s own tags (`!degrees`) as plain text."""


def _plain(loader: yaml.SafeLoader, _suffix: str, node: yaml.Node) -> Any:  # noqa: ANN401 - YAML
    if isinstance(node, yaml.ScalarNode):
        return loader.construct_scalar(node)
    return loader.construct_sequence(node) if isinstance(node, yaml.SequenceNode) else {}


_Loader.add_multi_constructor("!", _plain)


class _UnreadableError(ValueError):
    """Why nothing comes of a file, in a few words."""


def _file(path: Path | None) -> tuple[dict[str, Any], dict[str, Any], str]:
    """Return values made up for the file's leaves, by their names, what the file has by the last part of each name, in
    lists too, and why there are none."""
    data = read_untrusted(path, FILE_BYTES_MAX + 1) if path else None
    try:
        leaves = dict(_leaves(_content(data), "", 0))
        _check_size(list(leaves.values()))
        return {name: made_up(value) for name, value in leaves.items()}, dict(_by_key(leaves)), ""
    except _UnreadableError as error:
        return {}, {}, str(error)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        return {}, {}, f"not YAML: {str(error).splitlines()[0]}"


def _content(data: bytes | None) -> dict[Any, Any]:
    if data is None:
        raise _UnreadableError("no such file")
    if len(data) > FILE_BYTES_MAX:
        raise _UnreadableError(TOO_LARGE)
    text = data.decode()
    aliases = depth = 0
    # Events are counted before anything is made of them: an alias costs a few letters, its value any memory.
    for count, event in enumerate(yaml.parse(text, _Loader)):
        aliases += isinstance(event, yaml.AliasEvent)
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if count > EVENTS_MAX or aliases > ALIASES_MAX or depth > 2 * DEPTH_MAX:
            raise _UnreadableError(TOO_MUCH)
    content = yaml.load(text, _Loader)  # noqa: S506 - a SafeLoader
    if not isinstance(content, dict):
        raise _UnreadableError("no names in it")
    return content


def _check_size(values: list[Any]) -> None:
    """Raise for too large a file: with aliases, a few letters can stand for lists without number or end."""
    count, waiting = 0, [(values, 0)]
    # The list grows while it is walked through.
    for items, depth in waiting:
        count += len(items)
        if count > VALUES_MAX or depth > DEPTH_MAX:
            raise _UnreadableError(TOO_MUCH)
        waiting += [(item, depth + 1) for item in items if isinstance(item, list)]


def _leaves(content: Mapping[Any, Any], prefix: str, depth: int) -> Iterator[tuple[str, Any]]:
    for key, value in content.items():
        name = f"{prefix}/{str(key).strip('/')}".encode(errors="replace").decode()
        if isinstance(value, dict) and value and depth < DEPTH_MAX:
            yield from _leaves(value, name, depth + 1)
        elif isinstance(value, float) and not math.isfinite(value):
            yield name, 1.0
        elif isinstance(value, bool | int | float | str | list):
            yield name, value
        else:
            yield name, str(value)


def _by_key(leaves: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield each leaf, and those in lists, by the last part of its name. The lists are of a checked size."""
    for name, value in leaves.items():
        for item in value if isinstance(value, list) else ():
            if isinstance(item, dict):
                yield from _by_key(dict(_leaves(item, "", 0)))
        yield name.rpartition("/")[2], value


def _absolute(name: str) -> str:
    return "/" + name.strip("/")
