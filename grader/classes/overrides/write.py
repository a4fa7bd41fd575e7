"""Overrides written into `overrides.yaml`; everything else in the file stays as it was written.

The text is changed in place by cutting and inserting pieces (`Splice`): writing parsed YAML again would lose comments.
"""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import date
from decimal import Decimal
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from grader.classes.overrides import SCHEMA_KEY, parse
from grader.errors import Busy, RubricError, UsageError
from grader.files import atomic_write, lock, open_lock, read_given, writing
from grader.intake.names import folder_key
from grader.model.result import BankComment, Override, WrittenOverride
from grader.model.version import COMMENTS, OVERRIDES
from grader.rubric.yaml_lines import as_map, compose

WAIT_S, LOOK_S = 30.0, 0.02


Entry = Override | WrittenOverride | BankComment
OverrideChange = tuple[str, str, Entry | None]
"""A submission, a criterion, and what is to stand there; None takes it out. Of a comment: its criterion and its id."""


def write_override(path: Path, submission: str, criterion: str, override: Entry | None) -> None:
    """Put one override into the file, or take it out (None). Raises as `write_overrides` does."""
    write_overrides(path, [(submission, criterion, override)])


def write_overrides(path: Path, changes: Iterable[OverrideChange]) -> None:
    """Make all of these changes in the file, which need not exist, or none. Several writers wait for each other.

    The file may be one of comments, which is written in the same way.
    The file is replaced once, so a writer that is killed leaves it as it was before or as it is to be.
    Raises RubricError where the file has faults already, UsageError where it is written in a way that cannot be
    changed here, OutputError where it cannot be written, Busy where another writer does not come to its end.
    """
    path = path.resolve()
    # The lock is a file beside it, which stays: another writer may be waiting for it.
    with hold_lock(path.with_name(f".{path.name}.lock"), path, wait_s=WAIT_S):
        raw = (read_given(path) if os.path.lexists(path) else None) or b""
        # the file may be one that others are allowed to read, and stays so
        mode = path.stat().st_mode & 0o777 if path.exists() else None
        wanted = {(name, criterion): given for name, criterion, given in changes}  # of two for one, the last
        data = _changed_text(path, raw, [(*of, _fields(given)) for of, given in wanted.items()]).encode()
        if data != raw:
            atomic_write(path, data)
            if mode is not None:
                path.chmod(mode)


@contextmanager
def hold_lock(file: Path, path: Path, *, wait_s: float = math.inf) -> Iterator[None]:
    """Hold `file`, which all lock that write `path`. Raises OutputError, or Busy if another does for so long."""
    with writing(path):
        file.parent.mkdir(parents=True, exist_ok=True)
        descriptor = open_lock(file, public=True)
    try:
        with suppress(OSError):  # a file system without locks: its users must not write at the same time
            _wait(descriptor, path, wait_s)
        yield
    finally:
        os.close(descriptor)


def _wait(descriptor: int, path: Path, wait_s: float) -> None:
    until = time.monotonic() + wait_s
    while not lock(descriptor):
        if time.monotonic() > until:
            raise Busy(f"another program is writing {path}", hint="wait until it has ended, then try again")
        time.sleep(LOOK_S)


def _fields(entry: Entry | None) -> Fields | None:
    """Return the entry as the file's data have it; what is empty is left out."""
    if entry is None:
        return None
    given = {name: getattr(entry, name) for name in type(entry).model_fields}
    given |= {name: value.isoformat() for name, value in given.items() if isinstance(value, date)}
    given |= {name: list(value) for name, value in given.items() if isinstance(value, tuple)}
    return {name: value for name, value in given.items() if value is not None and value not in ("", [])}


def _changed_text(path: Path, raw: bytes, changes: Sequence[tuple[str, str, Fields | None]]) -> str:
    """Return the file's new text, which is read back and compared before it counts."""
    before = _data(path, raw)
    if any(submission == SCHEMA_KEY for submission, _, _ in changes):
        raise UsageError(
            f"a submission cannot be called {SCHEMA_KEY} in {path}", hint="rename it in the roster"
        )
    # reversed: of two the first counts
    called = {folder_key(key): key for key in reversed(before) if key != SCHEMA_KEY}
    edits = [
        OverrideEdit(called.setdefault(folder_key(submission), submission), criterion, fields)
        for submission, criterion, fields in changes
    ]
    # an editor of Windows may have put a byte order mark before it
    new = edited(raw.decode("utf-8-sig"), before, edits)
    try:
        sound = _without_empty(_data(path, new.encode())) == _without_empty(_expected_data(before, edits))
    except RubricError:
        sound = False
    if not sound:
        what = (
            f"{changes[0][1]} of {changes[0][0]}" if len(changes) == 1 else f"one of {len(changes)} overrides"
        )
        message = f"{path}: {what} is written in a way that cannot be changed here"
        raise UsageError(message, hint="change it by hand")
    return new


def _data(path: Path, raw: bytes) -> dict[str, Any]:
    """Return the file's data. Raises RubricError where the file is not a sound map."""
    source = parse(raw, str(path))
    faults = [source.fault(*fault) for fault in source.faults]
    if not isinstance(source.data, dict):
        faults.append(source.fault((), "must be a map from submissions to criteria"))
    if faults:
        raise RubricError(faults, hint="fix it by hand")
    return as_map(source.data)


def _expected_data(before: dict[str, Any], edits: Iterable[OverrideEdit]) -> dict[str, Any]:
    after = {key: dict(value) if isinstance(value, dict) else value for key, value in before.items()}
    for key, criterion, fields in edits:
        if fields is not None:
            there = as_map(as_map(after.get(key)).get(criterion))
            # a field that a newer grader or a person has added stays
            others = {name: value for name, value in there.items() if name not in KNOWN}
            after[key] = {**as_map(after.get(key)), criterion: {**others, **fields}}
        elif criterion in as_map(after.get(key)):
            del after[key][criterion]
    return after


def _without_empty(data: dict[str, Any]) -> dict[str, Any]:
    """Return the data without what is empty, which means nothing; the schema's line may be there or not."""
    plain = {key: _without_empty(value) if isinstance(value, dict) else value for key, value in data.items()}
    return {key: value for key, value in plain.items() if value not in (None, {}) and key != SCHEMA_KEY}


PLAIN_KEY = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.@-]*")
KNOWN = frozenset({*WrittenOverride.model_fields, *BankComment.model_fields})
Fields = dict[str, Any]
"""An override as the file's data have it, what is empty left out."""


class OverrideEdit(NamedTuple):
    """What is to be changed: `submission` is what it is called in the file; None takes the override out."""

    submission: str
    criterion: str
    fields: Fields | None


def edited(text: str, before: Mapping[str, Any], edits: Iterable[OverrideEdit]) -> str:
    """Return the text with all edits made. `before` are the text's data.

    Where the text uses what this does not know (anchors, say), the new one may hold other data than it should.
    """
    left = list(edits)
    while left:
        text, left = _pass(text, before, left)
    return text


def _pass(
    text: str, before: Mapping[str, Any], edits: Sequence[OverrideEdit]
) -> tuple[str, list[OverrideEdit]]:
    """Change each submission once, and return what is left to do; a map in braces is changed in one place at a time."""
    root = compose(text)
    if not isinstance(root, yaml.MappingNode):
        first = next((i for i, edit in enumerate(edits) if edit.fields is not None), None)
        if first is None:
            return text, []
        return spliced(text, [_first(text, edits[first])]), [*edits[:first], *edits[first + 1 :]]
    pairs = {key.value: (key, value) for key, value in root.value if isinstance(key, yaml.ScalarNode)}
    splices, new, later, done = list[Splice](), list[OverrideEdit](), list[OverrideEdit](), set[str]()
    for edit in edits:
        # two changes in one place would overlap; after the first, the text is parsed again
        if edit.submission in done or (root.flow_style and done):
            later.append(edit)
            continue
        done.add(edit.submission)
        found = pairs.get(edit.submission)
        if found is not None and edit.fields is None:
            splices += _without(text, root, found, edit.criterion)
        elif found is not None and edit.fields is not None:
            now = as_map(before.get(edit.submission)).get(edit.criterion)
            splices += _with(text, found, now, edit.criterion, edit.fields)
        elif edit.fields is not None:
            new.append(edit)
    return spliced(text, [*splices, *([_add_entries(text, root, new)] if new else [])]), later


def _without(text: str, root: yaml.MappingNode, submission: NodePair, criterion: str) -> list[Splice]:
    of = submission[1]
    found = _pair(of, criterion)
    if found is None or not isinstance(of, yaml.MappingNode):
        return []
    # a submission without any override goes too
    return [drop_pair(text, of, found) if len(of.value) > 1 else drop_pair(text, root, submission)]


def _with(text: str, submission: NodePair, now: object, criterion: str, fields: Fields) -> list[Splice]:
    of, entry = submission[1], _entry(criterion, fields)
    if not isinstance(of, yaml.MappingNode):
        return [set_value(text, submission, f"{{{entry}}}")]
    found = _pair(of, criterion)
    return _update_entry(text, found, now, fields) if found else [add_pairs(text, of, [entry])]


def _pair(node: yaml.Node, key: str) -> NodePair | None:
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    return next(((k, v) for k, v in pairs if isinstance(k, yaml.ScalarNode) and k.value == key), None)


def _first(text: str, edit: OverrideEdit) -> Splice:
    """Return the first override of a file that is empty, or holds comments only."""
    lines = _lines(edit)
    schema = COMMENTS if "text" in (edit.fields or {}) else OVERRIDES
    return block_lines(text, len(text), 0, lines if text.strip() else [f"{SCHEMA_KEY}: {schema}", *lines])


def _add_entries(text: str, root: yaml.MappingNode, edits: Iterable[OverrideEdit]) -> Splice:
    """Return the splice that adds submissions at the end."""
    if root.flow_style or not root.value:
        entries = [f"{_key(e.submission)}: {{{_entry(e.criterion, e.fields or {})}}}" for e in edits]
        return add_pairs(text, root, entries)
    return add_pairs(text, root, [line for edit in edits for line in _lines(edit)])


def _lines(edit: OverrideEdit) -> list[str]:
    return [f"{_key(edit.submission)}:", f"  {_entry(edit.criterion, edit.fields or {})}"]


def _update_entry(text: str, found: NodePair, now: object, fields: Fields) -> list[Splice]:
    """Return splices for what changed alone, so that comments inside of it stay; for all if something is to go."""
    node, current = found[1], as_map(now)
    gone = [name for name in current if current[name] is not None and name in KNOWN and name not in fields]
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
    if isinstance(value, float):
        return f"{Decimal(repr(value)).normalize():f}"  # `7`, not `7.0`, and no exponent
    if isinstance(value, list):
        return f"[{', '.join(map(_key, value))}]"
    return str(value) if name == "date" else _quote(str(value))


@lru_cache(maxsize=4096)
def _key(text: str) -> str:
    """Return the text as a key: plain where every reader of YAML takes it for a text."""
    # `no`, `12` and `2026-11-02` are no texts without quotes
    plain = PLAIN_KEY.fullmatch(text) and yaml.safe_load(text) == text
    return text if plain else _quote(text)


@lru_cache(maxsize=4096)
def _quote(text: str) -> str:
    # without a width, YAML would break a long text into lines
    return str(yaml.safe_dump(text, default_style='"', allow_unicode=True, width=10**9)).rstrip("\n")


NodePair = tuple[yaml.Node, yaml.Node]


class Splice(NamedTuple):
    """`text` takes the place of what stands from `start` to `end`, counted in characters."""

    start: int
    end: int
    text: str


def spliced(text: str, splices: Iterable[Splice]) -> str:
    """Return the text with all of these made; they do not overlap."""
    pieces, at = [], 0
    for start, end, piece in sorted(splices):
        pieces += [text[at:start], piece]
        at = end
    return "".join([*pieces, text[at:]])


def end_of(text: str, node: yaml.Node) -> int:
    """Return where what is written of a node ends, without the comments and blank lines that follow."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        key, value = last if isinstance(last, tuple) else (last, last)
        return max(end_of(text, key), end_of(text, value))
    # PyYAML may put the end of a node behind the blanks and line ends that follow
    end = node.end_mark.index
    while end and text[end - 1].isspace():
        end -= 1
    return int(end)


def set_value(text: str, pair: NodePair, written: str) -> Splice:
    """Return the splice that puts `written` in place of the pair's value."""
    start = pair[1].start_mark.index
    end = max(start, end_of(text, pair[1]))
    return Splice(start, end, written if end > start else f" {written}")  # `name:` with nothing behind it


def add_pairs(text: str, node: yaml.MappingNode, written: list[str]) -> Splice:
    """Return the splice that adds these pairs at the end of a map, in its own style."""
    if not node.value:
        # `{}`: between its braces
        return Splice(node.end_mark.index - 1, node.end_mark.index - 1, ", ".join(written))
    end = end_of(text, node) if not node.flow_style else _end_of_pair(text, node.value[-1])
    if node.flow_style:
        return Splice(end, end, "".join(f", {pair}" for pair in written))
    return block_lines(text, end, node.value[0][0].start_mark.column, written)


def block_lines(text: str, after: int, column: int, written: list[str]) -> Splice:
    """Return the splice that puts lines below the one in which `after` lies."""
    line_end = "\r\n" if "\r\n" in text else "\n"
    newline = text.find("\n", after)
    lines = "".join(f"{' ' * column}{line}{line_end}" for line in written)
    if newline < 0:
        # the last line has no line end yet
        apart = line_end if text and not text.endswith("\n") else ""
        return Splice(len(text), len(text), apart + lines)
    return Splice(newline + 1, newline + 1, lines)


def drop_pair(text: str, node: yaml.MappingNode, pair: NodePair) -> Splice:
    """Return the splice that removes a pair: its lines in a map of lines, the pair and a comma in a map in braces."""
    start, end = pair[0].start_mark.index, _end_of_pair(text, pair)
    if not node.flow_style:
        newline = text.find("\n", end)
        return Splice(text.rfind("\n", 0, start) + 1, len(text) if newline < 0 else newline + 1, "")
    place = next(i for i, other in enumerate(node.value) if other[0] is pair[0])
    if place + 1 < len(node.value):
        return Splice(start, node.value[place + 1][0].start_mark.index, "")
    return Splice(_end_of_pair(text, node.value[place - 1]) if place else start, end, "")


def _end_of_pair(text: str, pair: NodePair) -> int:
    return max(end_of(text, pair[0]), end_of(text, pair[1]))
