"""Text as a student reads it: names that nearly fit, numbers and lists, templates of messages and lines."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice

from grader.untrusted_text import visible
from grader.wording import is_one_edit, shorten

SIMILARITY = 0.8
OTHER_WORDS_SHARE = 0.5
"""Of the points, for what is said at the right place in other words than the handout's."""
SLIP_CHARS_MIN = 4
"""Of the last part of a name, so that one letter more, less or another is a slip."""
NAMES_MAX, NAME_CHARS_MAX = 1_000, 60
"""Of names that students may give by the thousand: so many are looked at, and so much of each."""
SHOWN_CHARS = 160
SHOWN_BEFORE_CHARS = 10_000
_ANSI = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
SECONDS = "{seconds}"
VALUE = "{value}"
NUMBER = r"[-+]?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?"


def texts_in(value: object) -> Iterator[str]:
    """Yield every string of a value of JSON or YAML, the keys of mappings among them."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from texts_in(key)
            yield from texts_in(item)
    elif isinstance(value, list | tuple | set | frozenset):
        for item in value:
            yield from texts_in(item)


def near_names(wanted: str, names: Iterable[str]) -> tuple[str, ...]:
    """Those of `names` that look like a slip of `wanted`: case, namespace, separator, a typing error."""
    looked_at = islice(dict.fromkeys(names), NAMES_MAX)
    found = [n for n in looked_at if n != wanted and _is_near(wanted, n)]
    return tuple(sorted(found, key=lambda n: -_similarity(wanted, n)))


def _is_near(wanted: str, name: str) -> bool:
    last_wanted, last_name = (n.rstrip("/").rpartition("/")[2] for n in (wanted, name))
    same_words = sorted(_words(last_wanted)) == sorted(_words(last_name)) != []
    squeezed = _squeezed(last_wanted), _squeezed(last_name)
    same = same_words or squeezed[0] == squeezed[1]
    slip = min(map(len, squeezed)) >= SLIP_CHARS_MIN and is_one_edit(*squeezed)
    return same or slip or _is_similar(wanted, name)


def _is_similar(first: str, second: str) -> bool:
    """The quick ratios are never less than the ratio."""
    matcher = _matcher(first, second)
    return all(
        ratio() >= SIMILARITY for ratio in (matcher.real_quick_ratio, matcher.quick_ratio, matcher.ratio)
    )


def _similarity(first: str, second: str) -> float:
    return _matcher(first, second).ratio()


def _matcher(first: str, second: str) -> difflib.SequenceMatcher[str]:
    one, other = (_squeezed(name)[:NAME_CHARS_MAX] for name in (first, second))
    return difflib.SequenceMatcher(None, one, other)


def _words(name: str) -> list[str]:
    return re.findall(r"[a-z0-9]+", name.casefold())


def _squeezed(name: str) -> str:
    return "".join(_words(name))


def bare(text: str) -> str:
    """Without the terminal's colours."""
    return _ANSI.sub("", text)


def shown(text: str) -> str:
    """One line of someone's output, without colours, what cannot be seen written out, cut to fit a report."""
    return in_one_line(bare(text[:SHOWN_BEFORE_CHARS]))


def in_one_line(text: str) -> str:
    """Return the same of a message: its colours are part of it."""
    line = visible(" ".join(text[:SHOWN_BEFORE_CHARS].split()))
    return shorten(line, SHOWN_CHARS)


def words_pattern(words: str) -> str:
    """A regular expression for words without regard to case and to how many blanks stand between them."""
    parts = r"\s+".join(re.escape(part) for part in re.split(r"\s+", words))
    return f"(?i:{parts})" if words else ""


def message_pattern(template: str, value: str) -> re.Pattern[str]:
    """Return the whole text: the template's words, and `value` (a regular expression) where it says `{seconds}`."""
    first, *others = template.strip().split(SECONDS)
    inner = "".join(f"({value}){words_pattern(words)}" for words in others)
    return re.compile(rf"\s*{words_pattern(first)}{inner}\s*", re.DOTALL)


def line_pattern(template: str, value: str) -> re.Pattern[str]:
    """Return the template's words around `value`, which has to stand there letter by letter, blanks squeezed."""
    squeezed = re.escape(" ".join(value.split()))
    return re.compile(squeezed.join(words_pattern(words) for words in template.strip().split(VALUE)))


def in_words(template: str) -> str:
    """Return the template as a student reads it: `hello world <seconds>`."""
    return template.replace(SECONDS, "<seconds>").replace(VALUE, "<message>")
