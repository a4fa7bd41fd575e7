"""Two senders of the same topic at once, and which of their messages a listener printed.

Both may send the same text in the same second: then it has to be printed once more than the other one sent it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable
from typing import NamedTuple

from grader.checks.support.printed import Line, stream_lines
from grader.checks.support.wording import VALUE, words_pattern
from grader.evidence.run import Run

_BEFORE, _BEHIND = r"(?<![\w.])", r"(?![\w]|[.,]\d)"


LOOKED_AT = 400
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
    streams = stream_lines(run, process)
    if len(texts) > LOOKED_AT:
        texts = _worth_a_look(texts, streams)
    counts = {text: max((_times(lines, text, template) for lines in streams), default=0) for text in texts}
    return Counter({text: count for text, count in counts.items() if count})


def _worth_a_look(texts: Iterable[str], streams: Iterable[Iterable[Line]]) -> list[str]:
    """Texts whose last word was printed, evenly spread."""
    said = {word.strip(PUNCTUATION) for lines in streams for line in lines for word in line.text.split()}
    found = [text for text in texts if text.split()[-1].strip(PUNCTUATION) in said]
    return found[:: max(1, len(found) // LOOKED_AT)]


def heard_of(sent: Sent, other: Sent, printed: Counter[str]) -> int:
    """How many messages were printed that can only be this sender's."""
    return sum(min(count, max(0, printed[text] - other.texts[text])) for text, count in sent.texts.items())


def _times(lines: Iterable[Line], text: str, template: str) -> int:
    before, _, behind = template.partition(VALUE)
    words = text.split()
    whole = r"\s+".join(map(re.escape, words))
    pattern = re.compile(
        f"{words_pattern(before)}{_edge(_BEFORE, whole, before)}{whole}{_BEHIND}{words_pattern(behind)}"
    )
    return sum(bool(pattern.search(line.text)) for line in lines if words[-1] in line.text)


def _edge(mark: str, whole: str, before: str) -> str:
    """A number has to stand for itself; a word may follow on others (`I heardThe time`)."""
    return mark if whole[:1].isdigit() and not before else ""
