"""What a scenario puts on the parameter server before anything starts, with values that nobody can guess."""

from __future__ import annotations

import math
import random
import string
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from grader.files import read_untrusted
from grader.rubric.model import Param

FILE_BYTES_MAX = 256 << 10
EVENTS_MAX = 2_000
VALUES_MAX = 5_000
DEPTH_MAX = 20
ALIASES_MAX = 20
WORD_LETTERS = 9
NOT_IN_FILE = "not in the file"
OVER = TOO_LARGE, TOO_MUCH = "too large", "too much in it"
"""How the remark on a file ends that is more than is read."""
_random = random.SystemRandom()


class Setting(NamedTuple):
    """One parameter to set. `name` begins with a slash, `detail` says where it comes from."""

    name: str
    value: Any
    detail: str


def settings(
    params: tuple[Param, ...], find: Callable[[str], Path | None]
) -> tuple[list[Setting], list[str]]:
    """What to set in this order, and a remark for each file that could not be read. `find` gives a file's place."""
    found: list[Setting] = []
    remarks: list[str] = []
    for param in params:
        if param.file is None:
            value = param.value if param.made_up is None else made_up(_EXAMPLES[param.made_up])
            found.append(Setting(_absolute(param.name or ""), value, "made up" if param.made_up else "given"))
            continue
        leaves, remark = _file(find(param.file))
        remarks += [f"{param.file}: {remark}"] if remark else []
        found += [Setting(name, value, f"made up, for {param.file}") for name, value in leaves.items()]
        lacking = [name for name in map(_absolute, param.also) if name not in leaves]
        found += [Setting(name, made_up(""), f"made up, {NOT_IN_FILE} {param.file}") for name in lacking]
    return found, remarks


def made_up(like: object) -> Any:  # noqa: ANN401 - of the type that it stands for
    """A value of the same type that nobody can guess; digits stay digits."""
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
    return "".join(_random.choice(string.ascii_letters) for _ in range(WORD_LETTERS))


def _digits(count: int) -> str:
    """Digits of which no two neighbours are the same: nothing that a handout would print."""
    found = [_random.choice("123456789")]
    while len(found) < count:
        found.append(_random.choice([d for d in "0123456789" if d != found[-1]]))
    return "".join(found)


_EXAMPLES: dict[str, Any] = {"text": "", "integer": 10_000, "number": 1.0}


class _Loader(yaml.SafeLoader):
    """`yaml.safe_load`, and `rosparam`'s own tags (`!degrees`) as plain text."""


def _plain(loader: yaml.SafeLoader, _suffix: str, node: yaml.Node) -> Any:  # noqa: ANN401 - YAML
    if isinstance(node, yaml.ScalarNode):
        return loader.construct_scalar(node)
    return loader.construct_sequence(node) if isinstance(node, yaml.SequenceNode) else {}


_Loader.add_multi_constructor("!", _plain)


class _UnreadableError(ValueError):
    """Why nothing comes of a file, in a few words."""


def _file(path: Path | None) -> tuple[dict[str, Any], str]:
    """Values made up for the file's leaves, by their names, or why there are none."""
    data = read_untrusted(path, FILE_BYTES_MAX + 1) if path else None
    try:
        leaves = dict(_leaves(_content(data), "", 0))
        _check_size(list(leaves.values()))
        return {name: made_up(value) for name, value in leaves.items()}, ""
    except _UnreadableError as error:
        return {}, str(error)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        return {}, f"not YAML: {str(error).splitlines()[0]}"


def _content(data: bytes | None) -> dict[Any, Any]:
    if data is None:
        raise _UnreadableError("no such file")
    if len(data) > FILE_BYTES_MAX:
        raise _UnreadableError(TOO_LARGE)
    text = data.decode()
    aliases = depth = 0
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
    """Aliases let a few letters stand for lists without number or end."""
    count, waiting = 0, [(values, 0)]
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


def _absolute(name: str) -> str:
    return "/" + name.strip("/")
