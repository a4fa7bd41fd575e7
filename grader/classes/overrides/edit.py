"""The text of `overrides.yaml` with one override put in, changed or taken out."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from typing import Any

import yaml

from grader.classes.overrides.read import SCHEMA, SCHEMA_KEY
from grader.classes.overrides.splice import (
    Pair,
    Splice,
    add_pairs,
    block_lines,
    drop_pair,
    set_value,
    spliced,
)
from grader.model.result import Override
from grader.rubric.source import as_map

PLAIN_KEY = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.@-]*")
Fields = dict[str, Any]
"""An override as the file's data have it, what is empty left out."""


def edited(text: str, before: Mapping[str, Any], key: str, criterion: str, fields: Fields | None) -> str:
    """`before` are the text's data, `key` is what the submission is called there; None takes the override out.

    Where the text uses what this does not know (anchors, say), the new one may hold other data than it should.
    """
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    if not isinstance(root, yaml.MappingNode):
        return text if fields is None else spliced(text, [_first(text, key, criterion, fields)])
    submission = _pair(root, key)
    if submission is None:
        return text if fields is None else spliced(text, [_added(text, root, key, _entry(criterion, fields))])
    if fields is None:
        return spliced(text, _without(text, root, submission, criterion))
    now = as_map(before.get(key)).get(criterion)
    return spliced(text, _with(text, submission, now, criterion, fields))


def _without(text: str, root: yaml.MappingNode, submission: Pair, criterion: str) -> list[Splice]:
    of = submission[1]
    found = _pair(of, criterion)
    if found is None or not isinstance(of, yaml.MappingNode):
        return []
    return [drop_pair(text, of, found) if len(of.value) > 1 else drop_pair(text, root, submission)]


def _with(text: str, submission: Pair, now: object, criterion: str, fields: Fields) -> list[Splice]:
    of, entry = submission[1], _entry(criterion, fields)
    if not isinstance(of, yaml.MappingNode):
        return [set_value(text, submission, f"{{{entry}}}")]
    found = _pair(of, criterion)
    return _updated(text, found, now, fields) if found else [add_pairs(text, of, [entry])]


def _pair(node: yaml.Node, key: str) -> Pair | None:
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    return next(((k, v) for k, v in pairs if isinstance(k, yaml.ScalarNode) and k.value == key), None)


def _first(text: str, key: str, criterion: str, fields: Fields) -> Splice:
    """The first override of a file that is empty, or holds comments only."""
    lines = [f"{_key(key)}:", f"  {_entry(criterion, fields)}"]
    return block_lines(text, len(text), 0, lines if text.strip() else [f"{SCHEMA_KEY}: {SCHEMA}", *lines])


def _added(text: str, root: yaml.MappingNode, key: str, entry: str) -> Splice:
    """One more submission."""
    if root.flow_style or not root.value:
        return add_pairs(text, root, [f"{_key(key)}: {{{entry}}}"])
    return add_pairs(text, root, [f"{_key(key)}:", f"  {entry}"])


def _updated(text: str, found: Pair, now: object, fields: Fields) -> list[Splice]:
    """Only what changed, so that comments inside of it stay; the whole where something is to go."""
    node, current = found[1], as_map(now)
    gone = [name for name in Override.model_fields if current.get(name) is not None and name not in fields]
    if not isinstance(node, yaml.MappingNode) or not node.value or gone:
        return [set_value(text, found, _flow(fields))]
    splices, new = [], []
    for name, value in fields.items():
        pair = _pair(node, name)
        if pair is None:
            new.append(f"{name}: {_scalar(name, value)}")
        elif current.get(name) != value:
            splices.append(set_value(text, pair, _scalar(name, value)))
    return [*splices, add_pairs(text, node, new)] if new else splices


def _entry(criterion: str, fields: Fields) -> str:
    return f"{_key(criterion)}: {_flow(fields)}"


def _flow(fields: Fields) -> str:
    return "{" + ", ".join(f"{name}: {_scalar(name, value)}" for name, value in fields.items()) + "}"


def _scalar(name: str, value: object) -> str:
    if name == "points":
        return f"{Decimal(repr(value)).normalize():f}"
    return str(value) if name == "date" else _quoted(str(value))


def _key(text: str) -> str:
    """Plain where every reader of YAML takes it for a text."""
    plain = PLAIN_KEY.fullmatch(text) and yaml.safe_load(text) == text
    return text if plain else _quoted(text)


def _quoted(text: str) -> str:
    return str(yaml.safe_dump(text, default_style='"', allow_unicode=True, width=10**9)).rstrip("\n")
