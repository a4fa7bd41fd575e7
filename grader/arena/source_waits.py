"""What the text of a program says of how long it may yet do something: the grader executes none of it, and parses none,
since it is hostile. What is not understood counts as something that may yet come."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import islice, takewhile

NAPS = re.compile(rb"sleep\s*\(\s*[^)\s]|Timer\s*\(")
"""A sleep of so many seconds, `rospy.sleep(0.5)` and not `rate.sleep()`, or a timer."""
PUBLISHES = re.compile(
    rb"^[^#\n]*?(?:publish(?!er)|sendTransform|send_goal|set_succeeded|set_aborted)", re.MULTILINE
)
"""A line that sends a message, or may."""
PUBLISHER = re.compile(rb"(?:Publisher|Broadcaster)\(|\.advertise\s*<")
PROGRAM = re.compile(rb"\binit_node\s*\(|\bros::init\s*\(")
GIVES_UP = re.compile(rb"[wW]ait_?[fF]or_?[sS]erv(?:er|ice)\([^)\n]*(?:,|timeout|Duration|\b\d)")
"""A wait for a service or an action's server that ends without it."""
ENDS_FOR_NEWER = re.compile(
    rb"^[^#\n]*?(?:is_?[pP]reempt_?[rR]equested|register_?[pP]reempt_?[cC]allback)", re.MULTILINE
)
"""An action's server that looks whether its goal was cancelled, or a newer one has come."""
ENDLESS = rb"(?:True|1|not\s+(?:rospy\.)?is_shutdown\(\))"
IDLE = re.compile(
    rb"^[ \t]*while(?:\s*\()?\s*" + ENDLESS + rb"\s*(?:\)\s*)?:\s*(?:#[^\n]*\n\s*)*(?:pass|continue)\b",
    re.MULTILINE,
)
"""A loop that does nothing and never ends: `while True: pass`."""
SLEEPS = rb"(?:print|rospy\.log\w+|[\w.]*sleep)\b[^\n;]*(?:\n|\Z)|[ \t]*(?:#[^\n]*)?\n"
SLEEPING = re.compile(
    rb"^([ \t]*)while(?:\s*\()?\s*" + ENDLESS + rb"\s*(?:\)\s*)?:[ \t]*"
    rb"(?:[\w.]*sleep\([^\n;]*(?:\n|\Z)|(?:#[^\n]*)?\n(?:\1[ \t]+" + SLEEPS + rb")+(?!\1[ \t]|[ \t]*[#\n]))",
    re.MULTILINE,
)
"""One that sleeps, and no more."""

WAIT = re.compile(rb"(?:\w+[ \t]*=[ \t]*)?[\w.]*[wW]ait_?[fF]or_?[sS]ervice\([^;]*\)")
IF_THERE = re.compile(rb"if[ \t]+(not[ \t]+)?[\w.]+\.wait_for_server\([^;]*\):")
POLLS = re.compile(rb"['\"](/[\w/]+)['\"]\s+not\s+in\s+[\w.]*get_service_list\(\)")
ASKS = re.compile(
    rb"True|1|not[ \t]+[\w.]+(?:\(\))?|[\w.]+[ \t]+(?:is|==)[ \t]+(?:None|False)"
    rb"|not[ \t]+[\w.]+\.wait_for_server\([^;]*\)|" + POLLS.pattern
)
"""A part of the condition of a loop that goes on until something is there."""
HARMLESS = re.compile(rb"(?:print|rospy\.log\w+|(?:[\w.]+\.)?sleep)\([^;]*\)|pass|continue")
ENDED = rb"(?:[\w.]+\.)?(?:ROSInterruptException|KeyboardInterrupt)"
INTERRUPTED = re.compile(
    rb"except[ \t(]+" + ENDED + rb"(?:[ \t]*,[ \t]*" + ENDED + rb")*[ \t]*\)?(?:[ \t]+as[ \t]+\w+)?[ \t]*:"
)
"""What only Ctrl-C raises: another error in the same brackets may be that the wait is over."""
COMMENT = re.compile(rb"(?:^|[ \t]+)#[^'\"]*$")
LINE_BYTES_MAX, LOOP_LINES_MAX = 200, 40


def gives_up(text: bytes) -> bool:
    """Return whether a source waits for a service, and goes on or ends if that does not come."""
    return GIVES_UP.search(_without_asking(text)) is not None


def naps(text: bytes) -> bool:
    """Return whether a source sleeps for a time of its own or has a timer: while it only asks, sleeping is no work."""
    return NAPS.search(_without_asking(text)) is not None


def _without_asking(text: bytes) -> bytes:
    """Return a source without its loops that ask for a service without end."""
    lines, skipped, kept = text.splitlines(), 0, list[bytes]()
    for number, line in enumerate(lines):
        if number >= skipped:
            skipped = number + _asks_without_end(lines[number : number + LOOP_LINES_MAX])
        if number >= skipped:
            kept.append(line)
    return b"\n".join(kept)


def polled(text: bytes) -> frozenset[str]:
    """Return the services for which a source looks again and again, without end, in the list of all that are there."""
    lines, found = text.splitlines(), set[str]()
    for number, line in enumerate(lines):
        if b"get_service_list" in line and _asks_without_end(lines[number : number + LOOP_LINES_MAX]):
            found.update(name.decode() for name in POLLS.findall(line))
    return frozenset(found)


def _asks_without_end(lines: Sequence[bytes]) -> int:
    """Return how many lines the loop has that begins here, if it asks for a service or an action's server again and
    again until that is there; else 0."""
    head = COMMENT.sub(b"", lines[0][:LINE_BYTES_MAX]).strip()
    if not re.match(rb"while\b.*:$", head):
        return 0
    asked = head[5:-1].strip()
    asked = asked[1:-1] if asked.startswith(b"(") and asked.endswith(b"))") else asked
    if not all(ASKS.fullmatch(part.strip()) for part in asked.split(b" and ")):
        return 0
    depth = _depth(lines[0])
    body = list(takewhile(lambda line: not line.strip() or _depth(line) > depth, islice(lines, 1, None)))
    # Another loop may wait for a flag that a callback sets, and then go on.
    asks = any(GIVES_UP.search(line) or POLLS.search(line) for line in (lines[0], *body))
    is_harmless = asks and len(body) < LOOP_LINES_MAX - 1 and all(_only_asks(body))
    return is_harmless * (1 + len(body))


def _only_asks(body: Sequence[bytes]) -> Iterator[bool]:
    """Yield of each line of a loop whether it does nothing as long as what is asked for is not there."""
    there = dict[int, bool]()
    """By their least depth, the blocks around a line, and whether they come only once it is there."""
    otherwise = dict[int, bool]()
    """The same of the `else` of each block."""
    for line in body:
        text, depth = COMMENT.sub(b"", line[:LINE_BYTES_MAX]).strip(), _depth(line)
        there = {least: one for least, one in there.items() if least <= depth or not text}
        if text == b"try:" or text.startswith(b"except"):
            there[depth + 1] = INTERRUPTED.match(text) is not None
        elif found := IF_THERE.fullmatch(text):
            there[depth + 1], otherwise[depth] = not found[1], bool(found[1])
        elif text == b"else:":
            there[depth + 1] = otherwise.get(depth, False)
        elif WAIT.fullmatch(text):
            there[depth] = True
        elif text:
            yield any(there.values()) or HARMLESS.fullmatch(text) is not None


def _depth(line: bytes) -> int:
    return len(line.expandtabs()) - len(line.expandtabs().lstrip())


def sleeps_elsewhere(text: bytes) -> bool:
    """Return whether a source sleeps or waits outside of such loops, too: then what calls it may go on after that."""
    return re.search(NAPS.pattern + rb"|[wW]ait_?[fF]or", SLEEPING.sub(b"", text)) is not None
