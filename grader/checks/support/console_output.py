"""What nodes printed and logged, whether the messages that were sent are in it, and Python's tracebacks as records.

Two senders of a topic may send the same text at once: then it has to be printed once more than the other one sent it.
"""

from __future__ import annotations

import ast
import re
import struct
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import partial
from itertools import accumulate
from typing import Literal, NamedTuple

from grader.checks.support.text import VALUE, line_pattern, words_pattern
from grader.evidence.run import Run, once_for_each_run
from grader.untrusted_text import without_colours

OTHER_NUMBERS_PER_LINE = 6
"""Besides those that were sent: a line with more of them hears nothing."""
LINES_PER_PROBE = 8
LINES_SPARE = 20
LINES_MAX = 20_000
"""A text is looked for in so much of each stream."""
NAMES_MAX = 100
"""Of the student's nodes, those whose names are left out of lines."""
CLOCK_SLACK_NS = 50_000_000
_LOG_PREFIX = re.compile(r"^\s*\[\s*(?:DEBUG|INFO|WARN|ERROR|FATAL)\s*\]\s*(?:\[[^\]]*\]\s*)*:?\s?")
_WORD = re.compile(r"/?[A-Za-z][\w/]*")
# A lookahead, so that matches may overlap.
_ANONYMOUS_END = re.compile(r"(?=(_\d+_\d{9,}))")
_HEX = re.compile(r"0[xX][0-9a-fA-F]+")
_TIME = re.compile(
    r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d)?|\d{1,2}:\d\d:\d\d(?:[.,]\d+)?|(?<=\d:\d\d):\d\d(?:[.,]\d+)?"
)
# Neither a part of another number nor the digits behind its point.
_NUMBER = re.compile(r"(?<!\d)(?<!\d\.)(?<!\s\.)(?<!^\.)([-+]?)(\d+)(\.\d+)?(?!\d)", re.ASCII)
_BEFORE, _BEHIND = r"(?<![\w.])", r"(?![\w]|[.,]\d)"
_Lines = list[tuple[str, str]]
"""Lines with their blanks squeezed, and as they are."""
LOOKED_AT, LOOKED_AT_LEAST = 400, 8
TEXT_CHARS_MAX = 200
SEARCHED_CHARS_MAX = 100_000_000
"""Texts are as many times fewer as what was printed is longer, and none is longer than a lab's are."""
PUNCTUATION = ".,;:!?'\"()[]{}<>"
Level = Literal["debug", "info", "warn", "error", "fatal"]
LEVELS: dict[int, Level] = {1: "debug", 2: "info", 4: "warn", 8: "error", 16: "fatal"}
_CONSOLE = re.compile(r"^\s*\[\s*(DEBUG|INFO|WARN|ERROR|FATAL)\s*\]\s*\[[^\]]*\]\s*:?\s?(.*)$")


HEADING = "Traceback (most recent call last):"
HANDLING = "During handling of the above exception, another exception occurred:"
_FRAME = re.compile(r'^\s+File "([^"]+)", line (\d+)')
_CARETS = re.compile(r"    \s*([~^]*\^[~^]*)")
_LAST = re.compile(r"^([A-Za-z_][\w.]*)(?:: ?(.*))?$")
_LIBRARY = ("/dist-packages/", "/site-packages/", "/usr/lib/python", "<frozen", "/opt/ros/")


FLOAT32_MAX = 3e38
ROUNDED = 0.01
"""The share by which a float that is printed with fewer digits may differ."""


class Probe(NamedTuple):
    """What the grader published, and when."""

    at_ns: int
    value: object


class Line(NamedTuple):
    """One line of output without the logger's prefix, colours and the node's own name."""

    at_ns: int
    text: str


def probes_on(run: Run, topic: str) -> tuple[Probe, ...]:
    """Return what the grader published on it. Of a message that was given as a map of the one field `data`, that
    is the field, as a listener prints it."""
    sent = [(t, e.value) for t, e in run.actors if e.action == "publish" and e.topic == topic]
    return tuple(Probe(t, v["data"] if isinstance(v, dict) and [*v] == ["data"] else v) for t, v in sent)


@once_for_each_run
def printed_lines(run: Run) -> tuple[Line, ...]:
    """Return all that the student's processes printed and their nodes logged, by time; tracebacks left out."""
    students = {e.name for _, e in run.processes if e.role == "student"}
    lines = [
        line
        for process in sorted(students)
        for stream in ("stdout", "stderr")
        # Stream by stream, as lines of one may come between those of a traceback on the other.
        for line in _without_tracebacks([(t, c.line) for t, c in run.lines(process) if c.stream == stream])
    ]
    # Longest first, as one name may begin with another.
    names = sorted(run.student_nodes()[:NAMES_MAX], key=len, reverse=True)
    return tuple(
        Line(t, _bare(text, names))
        for t, text in sorted([*lines, *_logged_lines(run)], key=lambda line: line[0])
    )


SUMMARY = re.compile(r"\s*\*\s+/")
"""How a line of roslaunch's list of parameters begins."""


def in_summary(texts: Iterable[str]) -> list[bool]:
    """Return of each line whether it stands in roslaunch's list of parameters, which no node prints."""
    found, inside = [], False
    for text in texts:
        inside = text.strip() == "PARAMETERS" or (inside and text.strip() != "NODES")
        found.append(inside and SUMMARY.match(text) is not None)
    return found


def stream_lines(run: Run, process: str, *, with_names: bool = False) -> tuple[tuple[Line, ...], ...]:
    """Return what one process printed on stdout and on stderr, and what its nodes logged, each by time. Names of
    anonymous nodes and of its own are left out, unless the lines are wanted `with_names`."""
    nodes = run.student_nodes(process)[:NAMES_MAX]
    console = ([(t, c.line) for t, c in run.lines(process) if c.stream == s] for s in ("stdout", "stderr"))
    streams = (*console, _logged_lines(run, nodes))
    plain = without_colours if with_names else partial(_bare, names=nodes)
    return tuple(tuple(Line(t, plain(text)) for t, text in stream) for stream in streams)


def lines_and_errors(run: Run, process: str) -> tuple[list[Line], list[Line]]:
    """Return the lines that a process prints, and the last line of each traceback, which says what was raised. The
    other lines of a traceback are Python's: the number in `line 40` is no output."""
    lines: list[Line] = []
    errors: list[Line] = []
    for stream in stream_lines(run, process):
        listed = in_summary(line.text for line in stream[:LINES_MAX])
        read = [line for line, is_listed in zip(stream, listed, strict=False) if not is_listed]
        found = tracebacks([line.text for line in read])
        hidden = {index for one in found for index in range(one.first, one.last + 1)}
        lines += [line for index, line in enumerate(read) if index not in hidden and line.text.strip()]
        errors += [read[one.last] for one in found]
    return lines, errors


def _logged_lines(run: Run, nodes: Collection[str] | None = None) -> list[tuple[int, str]]:
    """Return the messages on /rosout, line by line: of these nodes, or of all that are the student's."""
    texts = (
        (t, str(value.get("msg", "")))
        for channel in run.student_channels("/rosout")
        if nodes is None or channel.callerid in nodes
        for t, value in zip(channel.times_ns, channel.values, strict=True)
        if isinstance(value, dict)
    )
    return [(t, line) for t, text in texts if HEADING not in text for line in text.splitlines()]


def _without_tracebacks(lines: Sequence[tuple[int, str]]) -> list[tuple[int, str]]:
    hidden = {
        i for found in tracebacks([text for _, text in lines]) for i in range(found.first, found.last + 1)
    }
    return [line for index, line in enumerate(lines) if index not in hidden]


def _bare(text: str, names: Iterable[str]) -> str:
    text = _LOG_PREFIX.sub("", without_colours(text))
    for name in names:
        text = text.replace(name, " ")
    return _WORD.sub(_without_anonymous, text) if _ANONYMOUS_END.search(text) else text


def _without_anonymous(word: re.Match[str]) -> str:
    """A word up to the last digits that `anonymous=True` puts behind a node's name becomes a blank."""
    end = max((found.end(1) for found in _ANONYMOUS_END.finditer(word[0])), default=0)
    return f" {word[0][end:]}" if end else word[0]


def numbers_in(text: str) -> frozenset[int]:
    """Return a line's whole numbers: `12` is not in `127` and not in `3.12`. A `-` after a letter may be a dash."""
    return frozenset(n for dashes in (False, True) for _, n in _numbers(text, dashes=dashes))


def _numbers(text: str, *, dashes: bool) -> Iterator[tuple[int, int]]:
    """Yield each whole number with its offset. With `dashes`, a `-` after a letter or a dot is not a sign."""
    # Digits of an address or a time of day are no value that was sent.
    if "x" in text or "X" in text:
        text = _HEX.sub(_blanks_for, text)
    if ":" in text or "-" in text:
        text = _TIME.sub(_blanks_for, text)
    for match in _NUMBER.finditer(text):
        sign, whole, fraction = match.groups()
        if len(whole) > 18 or (fraction and fraction.strip(".0")):
            continue
        before = match.string[: match.start()][-1:]
        yield match.start(), int(whole if dashes and (before.isalpha() or before == ".") else sign + whole)


def _blanks_for(match: re.Match[str]) -> str:
    return " " * len(match[0])


def places_of(
    run: Run, probes: Sequence[Probe], lines: Sequence[Line], template: str
) -> list[tuple[int, ...]] | None:
    """Return for each probe where it was printed; None where so many numbers are printed that no one can tell.

    Places are offsets in all that was printed; `line_finder` gives a place's line.
    """
    if not _are_numbers(probes):
        return text_places(probes, lines, template)
    texts = {e.value for _, e in run.actors if e.action == "publish" and isinstance(e.value, str)}
    return number_places(probes, lines, texts)


def line_finder(probes: Sequence[Probe], lines: Sequence[Line], template: str) -> Callable[[int], Line]:
    """Return a function from a place of `places_of` to the line that begins there, or before it."""
    joined = () if _are_numbers(probes) else _join_lines(lines, _between(probes, template))[1]
    starts = [offset for _, offset in joined] or _starts(lines)
    return lambda place: lines[bisect_right(starts, place) - 1]


def _are_numbers(probes: Sequence[Probe]) -> bool:
    return all(isinstance(p.value, int) and not isinstance(p.value, bool) for p in probes)


def _starts(lines: Sequence[Line]) -> list[int]:
    return list(accumulate((len(line.text) + 1 for line in lines[:-1]), initial=0))


def number_places(
    probes: Sequence[Probe], lines: Sequence[Line], texts: Iterable[str]
) -> list[tuple[int, ...]] | None:
    """Return for each probe the offsets at which it was printed, at its time or later.

    `texts` are other probes that the lines may show too; digits in them are not numbers. None where so many
    numbers are printed that any probe would be among them. A `-` after a letter is a sign in all lines or in none.
    """
    # Longest first, as one text may begin with another; without texts, a pattern that matches nothing.
    hidden = re.compile("|".join(map(re.escape, sorted(texts, key=len, reverse=True))) or r"(?!)")
    shown = [Line(line.at_ns, hidden.sub(_blanks_for, line.text)) for line in lines]
    rows = sum(_NUMBER.search(line.text) is not None for line in shown)
    if rows > LINES_PER_PROBE * (len(probes) + len(set(texts))) + LINES_SPARE:
        return None
    signs = _places_read(probes, shown, dashes=False)
    if all(signs):
        return signs
    # A `-` is taken for a dash only where a number is not found otherwise.
    dashes = _places_read(probes, shown, dashes=True)
    return dashes if any(found and not other for found, other in zip(dashes, signs, strict=True)) else signs


def _places_read(probes: Sequence[Probe], lines: Sequence[Line], *, dashes: bool) -> list[tuple[int, ...]]:
    sent = {p.value for p in probes}
    found = defaultdict[int, list[tuple[int, int]]](list)
    for start, line in zip(_starts(lines), lines, strict=False):
        numbers = list(_numbers(line.text, dashes=dashes))
        # In a line full of other numbers, any number would be found.
        if len({n for _, n in numbers} - sent) <= OTHER_NUMBERS_PER_LINE:
            for at, n in numbers:
                found[n].append((start + at, line.at_ns))
    values = ((p.at_ns, p.value) for p in probes if isinstance(p.value, int))
    return [tuple(at for at, t in found[value] if t >= sent_ns - CLOCK_SLACK_NS) for sent_ns, value in values]


def text_places(probes: Sequence[Probe], lines: Sequence[Line], template: str) -> list[tuple[int, ...]]:
    """Return the same for texts, as offsets in all that was printed. A text may be split over lines.

    The template's own words may be in capitals or not; the text itself stands letter by letter.
    """
    blank = _between(probes, template)
    blob, starts = _join_lines(lines, blank)
    places = []
    for probe in probes:
        begin = next((at for t, at in starts if t >= probe.at_ns - CLOCK_SLACK_NS), len(blob))
        alone = isinstance(probe.value, bool | float)
        spellings = {blank.join(text.split()) for text in _spellings(probe.value)}
        patterns = [line_pattern(template, text, alone=alone) for text in spellings if text]
        found = {m.start() for pattern in patterns for m in pattern.finditer(blob, begin)}
        places.append(tuple(sorted(found)))
    return places


def _spellings(value: object) -> set[str]:
    """Return how a value may be printed: a float also as a shorter one, or by C++ as its type rounds it."""
    match value:
        case bool():
            return {str(value), str(value).lower(), str(int(value))}
        case float():
            single = struct.unpack("f", struct.pack("f", value))[0] if abs(value) < FLOAT32_MAX else value
            texts = {f"{x:.{digits}f}" for x in (value, single) for digits in range(1, 10)}
            near = {text for text in texts if abs(float(text) - value) <= ROUNDED * abs(value)}
            return {str(value), str(single), f"{value:g}", f"{value:.17g}", *near}
        case _:  # in a printed list or message, a text has its escapes
            return {str(value), repr(value)[1:-1]}


def _between(probes: Sequence[Probe], template: str) -> str:
    """Return what stands for blanks. A text alone may be split anywhere, so that they do not count; the words of a
    template, and numbers, stay apart."""
    return "" if template == VALUE and all(isinstance(p.value, str) for p in probes) else " "


def _join_lines(lines: Sequence[Line], blank: str) -> tuple[str, list[tuple[int, int]]]:
    """Return all that was printed, and when and at which offset each line begins."""
    parts, starts, offset = [], [], 0
    for line in lines:
        starts.append((line.at_ns, offset))
        parts.append(blank.join(line.text.split()) + blank)
        offset += len(parts[-1])
    return "".join(parts), starts


def chosen(places: Sequence[tuple[int, ...]]) -> list[int | None]:
    """Return for each probe the first of its places that is behind the one before; None where it has none."""
    position, found = -1, list[int | None]()
    for choices in places:
        later = next((place for place in choices if place > position), None)
        position = position if later is None else later
        found.append(later)
    return found


def in_order(places: Sequence[tuple[int, ...]]) -> bool:
    """Return whether one place can be chosen for each probe, each behind the one before."""
    return None not in chosen(places)


def sent_by(run: Run, topic: str, nodes: Collection[str], from_ns: int = 0) -> Counter[str]:
    """Return what these nodes published as text on the topic at `from_ns` or later, with how many times."""
    return Counter(text for t, text in _texts_of(run, topic, nodes) if t >= from_ns)


def both_from_ns(run: Run, topic: str, first: Collection[str], second: Collection[str]) -> int | None:
    """Return from when on both had sent a text; None where one of them never did."""
    begins = [[t for t, _ in _texts_of(run, topic, nodes)] for nodes in (first, second)]
    return max(min(times) for times in begins) if all(begins) else None


def _texts_of(run: Run, topic: str, nodes: Collection[str]) -> Iterator[tuple[int, str]]:
    for channel in run.student_channels(topic):
        if channel.callerid in nodes:
            pairs = zip(channel.times_ns, channel.data, strict=True)
            yield from ((t, text) for t, text in pairs if isinstance(text, str) and text.strip())


def printed_times(run: Run, process: str, texts: Collection[str], template: str) -> Counter[str]:
    """Return how many times a process printed each text: by the stream, stdout, stderr or /rosout, that shows it most.

    A text may hold the name of an anonymous node, as `rospy.get_name()` gives it. Of a flood of texts, some that seem
    to have been printed are enough to look at.
    """
    named = any(_ANONYMOUS_END.search(text) for text in texts)
    streams = [
        [(" ".join(line.text.split()), line.text) for line in lines]
        for lines in stream_lines(run, process, with_names=named)
    ]
    printed_chars = sum(len(line) for lines in streams for _, line in lines)
    most = min(LOOKED_AT, max(LOOKED_AT_LEAST, SEARCHED_CHARS_MAX // (1 + printed_chars)))
    texts = [text for text in texts if len(text) <= TEXT_CHARS_MAX]
    if len(texts) > most:
        texts = _worth_a_look(texts, streams, most)
    counts = {text: max((_times(lines, text, template) for lines in streams), default=0) for text in texts}
    return Counter({text: count for text, count in counts.items() if count})


def _worth_a_look(texts: Iterable[str], streams: Iterable[_Lines], most: int) -> list[str]:
    """Return texts whose last word was printed, evenly spread."""
    said = {word.strip(PUNCTUATION) for lines in streams for _, line in lines for word in line.split()}
    found = [text for text in texts if text.split()[-1].strip(PUNCTUATION) in said]
    return found[:: max(1, len(found) // most)]


def heard_of(sent: Counter[str], other: Counter[str], printed: Counter[str]) -> int:
    """Return how many messages were printed that can only be this sender's."""
    # What the other sender sent, too, may have come from there.
    return sum(min(count, max(0, printed[text] - other[text])) for text, count in sent.items())


def _times(lines: _Lines, text: str, template: str) -> int:
    before, _, behind = template.partition(VALUE)
    words = text.split()
    whole = r"\s+".join(map(re.escape, words))
    # a number has to stand for itself; a word may follow on others (`I heardThe time`)
    edge = _BEFORE if whole[:1].isdigit() and not before else ""
    pattern = re.compile(f"{words_pattern(before)}{edge}{whole}{_BEHIND}{words_pattern(behind)}")
    plain = " ".join(words)
    # The plain search is quick, and leaves few lines to the pattern.
    return sum(bool(pattern.search(line)) for squeezed, line in lines if plain in squeezed)


class Logged(NamedTuple):
    """One log message; `level` is None for a number that ROS does not know."""

    at_ns: int
    node: str
    level: Level | None
    text: str


def logged_by(run: Run, nodes: Collection[str]) -> tuple[Logged, ...]:
    """Return the log messages of these nodes by time; all of them in another tool's recording, which knows no graph."""
    found = [
        Logged(
            t,
            # Another tool's recording may not have the sender, whom the message itself names.
            channel.callerid or str(value.get("name", "")),
            LEVELS.get(value.get("level", 0)),
            str(value.get("msg", "")),
        )
        for channel in run.student_channels("/rosout")
        if run.foreign or channel.callerid in nodes
        for t, value in zip(channel.times_ns, channel.values, strict=True)
        if isinstance(value, dict)
    ]
    return tuple(sorted(found, key=lambda one: one.at_ns))


def split_log_line(line: str) -> tuple[str, str] | None:
    """Return the level and text of a line as rospy and roscpp print what they log; None for any other line."""
    match = _CONSOLE.match(without_colours(line))
    return (match[1].lower(), match[2]) if match else None


# ---- tracebacks


class Frame(NamedTuple):
    """A line of a file, and its source where Python printed it."""

    file: str
    line: int
    source: str = ""
    marked: tuple[int, int] | None = None
    """What Python's carets point at, as a slice of `source`."""

    @property
    def in_library(self) -> bool:
        return any(part in self.file for part in _LIBRARY)


class Traceback(NamedTuple):
    """`kind` is the exception's class without its module; `first` and `last` are the indices of its lines."""

    kind: str
    message: str
    frames: tuple[Frame, ...]
    first: int
    last: int
    is_handled: bool = False
    """Whether another one was raised while it was handled."""

    @property
    def text(self) -> str:
        """The last line, as Python prints it."""
        return f"{self.kind}: {self.message}" if self.message else self.kind

    @property
    def own_frames(self) -> tuple[Frame, ...]:
        """Those outside Python's and ROS's own code, the innermost last."""
        return tuple(f for f in self.frames if not f.in_library)

    @property
    def innermost(self) -> Frame:
        """The innermost of these; one without a file where there is none."""
        return self.own_frames[-1] if self.own_frames else Frame("", 0)

    @property
    def is_of_timer(self) -> bool:
        """Whether a timer's own thread divides by its period."""
        innermost = self.frames[-1].file if self.frames else ""
        return self.kind == "ZeroDivisionError" and innermost.endswith("/rospy/timer.py")


def tracebacks(lines: Sequence[str]) -> tuple[Traceback, ...]:
    """Return every traceback, also the bare `File …` of a syntax error, and none that was cut short."""
    found: list[Traceback] = []
    frames: list[Frame] = []
    first: int | None = None
    bare, is_mixed = _followed_by_syntax_error(lines), False
    for index, line in enumerate(lines):
        frame = _FRAME.match(line)
        if HEADING in line:
            is_mixed |= first is not None
            first, frames = index, []
        elif found and line == HANDLING:
            found[-1] = found[-1]._replace(is_handled=True)
        elif frame and (first is not None or bare[index]):
            first = index if first is None else first
            frames.append(Frame(frame[1], int(frame[2])))
        elif frames and not frames[-1].source and line.startswith("    "):
            frames[-1] = frames[-1]._replace(source=line.strip())
        elif frames and frames[-1].source and not frames[-1].marked and (carets := _CARETS.fullmatch(line)):
            place = (carets.start(1) - 4, carets.end(1) - 4)  # indented by four, as the source is
            frames[-1] = frames[-1]._replace(marked=place)
        elif first is not None and line and not line[0].isspace():
            last = _LAST.match(line)
            if last:
                kind = last[1].rpartition(".")[2]
                found.append(Traceback(kind, (last[2] or "").strip(), tuple(frames), first, index))
            first = None
    return (_mixed(lines) if is_mixed else ()) or tuple(found)


def _mixed(lines: Sequence[str]) -> tuple[Traceback, ...]:
    """Return the traceback that several processes printed at once, with their lines mixed, if it is the same."""
    last = {m.groups(): n for n, m in enumerate(map(_LAST.match, lines)) if m and m[1].endswith("Error")}
    starts = [n for n, line in enumerate(lines) if HEADING in line]
    frames, at = dict[tuple[str, int], Frame](), ("", 0)
    for line in lines[starts[0] :] if len(starts) > 1 == len(last) else ():
        if frame := _FRAME.match(f"  {line.lstrip()}"):
            frames.setdefault(at := (frame[1], int(frame[2])), Frame(*at))
        elif at in frames and re.search(r"\w", line):
            frames[at] = frames[at]._replace(source=frames[at].source or line.strip())
    about = [(k.rpartition(".")[2], text or "", n) for (k, text), n in last.items() if frames]
    return tuple(Traceback(kind, text, (*frames.values(),), starts[0], n) for kind, text, n in about)


def unpack_traceback(line: str) -> list[str]:
    """Return the lines of a traceback that rospy logs as a list on one line: that of a service's callback. Any other
    line stays as it is."""
    start = line.find("['" + HEADING)
    if start < 0:
        return [line]
    # It is written as a Python list; nothing of it is run.
    try:
        parts = ast.literal_eval(line[start:].strip())
    except (SyntaxError, ValueError):
        return [line]
    return "".join(map(str, parts)).splitlines()


def _followed_by_syntax_error(lines: Sequence[str]) -> list[bool]:
    """For each line whether only indented ones come, then a syntax error's name: that of the script has no heading."""
    found, named = [False] * len(lines), False
    for index in range(len(lines) - 1, -1, -1):
        found[index], line = named, lines[index]
        if line and not line[0].isspace():
            named = line.startswith(("SyntaxError", "IndentationError", "TabError"))
    return found
