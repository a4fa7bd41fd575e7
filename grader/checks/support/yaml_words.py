"""What `rosparam load` said of a YAML file, in plain words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

PRINTED_INDENT = 4
_PLACE = re.compile(r"line (\d+), column (\d+)")
_IN_LINE = "line {line} has a tab behind a name or a value, which YAML does not take"
_INDENT = "indent with spaces alone, two for each level"

# what is printed, what it means ({line}: where), and what to do
_CAUSES = (
    (r"found character '\\t'", "line {line} is indented with a tab, which YAML does not take", _INDENT),
    (r"cannot marshal None", "a name has no value: nothing stands behind it, and nothing is indented below it",
     "write a value behind the name; what belongs to a name is indented by two spaces more than the name"),
    (r"exceeds XML-RPC limits|Overflow Error", "a number is larger than 2147483647, the largest that ROS can hold",
     'write a long number in quotes, as text: phone: "9876543210"'),
    (r"mapping values are not allowed here",
     "in line {line} or above it, the space behind a `:` is missing, or a `:` is part of a value",
     'write `name: value` with a space, and a value that holds a `:` in "quotes"'),
    (r"scanning a quoted scalar|found unexpected end of stream", "a closing quote is missing near line {line}",
     'close every " on its own line'),
    (r"expected <block end>|unindent does not match|expected ',' or '[\]}}]'|could not find expected ':'",
     "line {line} does not fit those above it: names of one level begin in the same column", _INDENT),
    (r"cannot start any token", "line {line} has a character that needs quotes", 'write the value in "quotes"'),
    (r"can only be set to a dictionary", "it holds no `name: value`", "write `details:` and its values below it"),
    (r"UnicodeDecodeError|codec can't decode|special characters are not allowed", "it is not saved as UTF-8",
     "save it as UTF-8"),
    (r"is not iterable|NoneType", "it is empty, or a part of it is", "write `details:` and its values below it"),
)  # fmt: skip


class Words(NamedTuple):
    """Why the file cannot be loaded, what to do, and the line if one is named."""

    why: str
    hint: str
    line: int | None


def explain_yaml(lines: Sequence[str]) -> Words | None:
    """The cause among the lines that were printed; None where none is known."""
    text = "\n".join(lines)
    places = _PLACE.findall(text)
    line = int(places[-1][0]) if places else None
    if "found character '\\t'" in text and _is_within(lines):
        return Words(_IN_LINE.format(line=line), "write a space in the tab's place", line)
    for pattern, why, hint in _CAUSES:
        if re.search(pattern, text):
            return Words(why.format(line=line or "?"), hint, line)
    return None


def _is_within(lines: Sequence[str]) -> bool:
    """Whether the place that was named last has more than blanks before it, by the line that is printed below it."""
    for line, below in reversed(list(pairwise(lines))):
        if place := _PLACE.search(line):
            return bool(below[PRINTED_INDENT : PRINTED_INDENT + int(place[2]) - 1].strip())
    return False
