"""Two senders of the same topic at once, and which of their messages a listener printed.

Both may send the same text in the same second: then it has to be printed once more than the other one sent it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable
from typing import NamedTuple

from grader.checks.support.printed import stream_lines
from grader.checks.support.wording import VALUE, words_pattern
from grader.evidence.run import Run

_BEFORE, _BEHIND = r"(?<![\w.])", r"(?![\w]|[.,]\d)"
_Lines = list[tuple[str, str]]
"""Lines with their blanks squeezed, and as they are."""

LOOKED_AT, LOOKED_AT_LEAST = 400, 8
TEXT_CHARS_MAX = 200
SEARCHED_CHARS_MAX = 100_000_000
"""Texts are as many times fewer as what was printed is longer, and none is longer than a lab's are."""
PUNCTUATION = ".,;:!?'\"()[]{}<>"


class Sent(NamedTuple):
    """The texts that one sender published from `from_ns` on, with how many times."""

    texts: Counter[str]

    @property
    def total(self) -> int:
        return self.texts.total()


def sent_by(run: Run, topic: str, nodes: Collection[str], from_ns: int = 0) -> Sent:
    """What these nodes published as text on the topic at `from_ns` or later."""
    texts = (
        text
        for channel in run.student_channels(topic)
        if channel.callerid in nodes
        for t, text in zip(channel.times_ns, channel.data, strict=True)
        if t >= from_ns and _is_text(text)
    )
    return Sent(Counter(texts))


def both_from_ns(run: Run, topic: str, first: Collection[str], second: Collection[str]) -> int | None:
    """From when on both had sent a text; None where one of them never did."""
    begins = [
        [
            t
            for channel in run.student_channels(topic)
            if channel.callerid in nodes
            for t, text in zip(channel.times_ns, channel.data, strict=True)
            if _is_text(text)
        ]
        for nodes in (first, second)
    ]
    return max(min(times) for times in begins) if all(begins) else None


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip())


def printed_times(run: Run, process: str, texts: Collection[str], template: str) -> Counter[str]:
    """How many times a process printed each text: by the stream, stdout, stderr or /rosout, that shows it most.

    Of a flood of texts, some that seem to have been printed are enough to look at.
    """
    streams = [[(_squeezed(line.text), line.text) for line in lines] for lines in stream_lines(run, process)]
    printed_chars = sum(len(line) for lines in streams for _, line in lines)
    most = min(LOOKED_AT, max(LOOKED_AT_LEAST, SEARCHED_CHARS_MAX // (1 + printed_chars)))
    texts = [text for text in texts if len(text) <= TEXT_CHARS_MAX]
    if len(texts) > most:
        texts = _worth_a_look(texts, streams, most)
    counts = {text: max((_times(lines, text, template) for lines in streams), default=0) for text in texts}
    return Counter({text: count for text, count in counts.items() if count})


def _squeezed(text: str) -> str:
    return " ".join(text.split())


def _worth_a_look(texts: Iterable[str], streams: Iterable[_Lines], most: int) -> list[str]:
    """Texts whose last word was printed, evenly spread."""
    said = {word.strip(PUNCTUATION) for lines in streams for _, line in lines for word in line.split()}
    found = [text for text in texts if text.split()[-1].strip(PUNCTUATION) in said]
    return found[:: max(1, len(found) // most)]


def heard_of(sent: Sent, other: Sent, printed: Counter[str]) -> int:
    """How many messages were printed that can only be this sender's."""
    return sum(min(count, max(0, printed[text] - other.texts[text])) for text, count in sent.texts.items())


def _times(lines: _Lines, text: str, template: str) -> int:
    before, _, behind = template.partition(VALUE)
    words = text.split()
    whole = r"\s+".join(map(re.escape, words))
    pattern = re.compile(
        f"{words_pattern(before)}{_edge(_BEFORE, whole, before)}{whole}{_BEHIND}{words_pattern(behind)}"
    )
    plain = " ".join(words)
    return sum(bool(pattern.search(line)) for squeezed, line in lines if plain in squeezed)


def _edge(mark: str, whole: str, before: str) -> str:
    """A number has to stand for itself; a word may follow on others (`I heardThe time`)."""
    return mark if whole[:1].isdigit() and not before else ""
