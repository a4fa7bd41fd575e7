"""How numbers, counts, lists and "did you mean" are written in every text that the grader shows.

Pure functions that every room may use. Nothing is escaped here: `untrusted_text` does that.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Sequence
from itertools import chain

LISTED_MAX = 6
PART_CHARS_MIN = 3
AT_THE_END = " (rospy calls it when the node ends)"
"""How the message of a repair ends that only the end of a node shows."""
NOTHING_TO_DO = "nothing for you to do: "
ON_THE_MACHINE = f"{NOTHING_TO_DO}tell your instructor. On the grading machine: "
"""How every hint begins that only the instructor can follow: grading again changes nothing before."""


def number(value: float, digits: int = 3) -> str:
    """Return `10`, `87.5`: at most so many decimals, and no zeros at the end."""
    return f"{value:.{digits}f}".rstrip("0").rstrip(".") or "0"


def significant(value: float) -> str:
    """Return a measured number with four significant digits: `9.98`, `0.001234`; whole numbers as they are, -0 as 0."""
    return f"{value + 0:.10g}" if float(value).is_integer() else f"{value:.4g}"


def hertz(rate_hz: float) -> str:
    """Return `9.98 Hz`, `1200 Hz`."""
    return f"{rate_hz:.2f} Hz" if rate_hz < 1000 else f"{rate_hz:.0f} Hz"


def seconds(duration_ns: float) -> str:
    """Return nanoseconds as `2.5 s`."""
    return f"{duration_ns / 1e9:.1f} s"


def plural(count: float, noun: str, more: str = "") -> str:
    """Return `1 node`, `2.5 points`, `3 nodes`; `more` is a plural that is not the noun with an s."""
    return f"{number(count)} {noun if count == 1 else more or noun + 's'}"


def join_words(names: Iterable[str], last: str = "and", most: int = LISTED_MAX) -> str:
    """Return `a, b and c`, so many of them at most and how many more there are."""
    items = list(names)
    if len(items) > most:
        items = [*items[:most], f"{len(items) - most} more"]
    return " ".join([", ".join(items[:-1]), last, items[-1]]) if len(items) > 1 else "".join(items)


def there_is(names: Iterable[str]) -> str:
    """Return `there is a`, `there are a and b`."""
    items = list(names)
    return f"there {'is' if len(items) == 1 else 'are'} {join_words(items)}"


def name_package(name: str, places: Iterable[str] = ()) -> str:
    """Return what to write where a package has a slip of the name that it should have, which has to be the same
    everywhere: in these places, or in those that every package has."""
    usual = (
        f"<name>{name}</name> in package.xml",
        f"project({name}) in CMakeLists.txt",
        f'pkg="{name}" in each <node>',
    )
    return f"write {join_words(places) or join_words(usual)}"


def first_few(names: Sequence[str], most: int) -> str:
    """Return `a, b, c and 4 more`: the first `most` names, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def shorten(text: str, chars_max: int) -> str:
    """Return `text`, or its beginning with an ellipsis, at most so many characters."""
    return text if len(text) <= chars_max else text[: chars_max - 1] + "…"


ROLES = (
    (
        *("talker", "publisher", "pub", "pubs", "sender", "emitter", "speaker", "broadcaster"),
        *("publicador", "emisor"),
    ),
    (
        *("listener", "subscriber", "sub", "subs", "receiver", "hearer"),
        *("suscriptor", "subscriptor", "receptor", "oyente"),
    ),
    ("server", "service"),
)
"""Words for the same kind of node in the names of scripts."""
ROLE_CUTOFF = 0.85
"""How like one of these words a slip of it is: `suscriber`, `reciever`."""
PARTS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


def has_role_of(one: str, other: str) -> bool:
    """Return whether two scripts are called by different words for the same kind of node, "talker" and
    "publisher", or "suscriber". By the same word they are two that a lab asks for."""
    given, wanted = ({_role(part) for part in PARTS.findall(_stem(path))} for path in (one, other))
    return any(
        word in wanted and given & {*words} - {word} and word not in given
        for words in ROLES
        for word in words
    )


def is_of_other_role(one: str, other: str) -> bool:
    """Return whether two scripts are called by words for different kinds of node: "pub" and "sub"."""
    given, wanted = (
        {
            number
            for part in PARTS.findall(_stem(path))
            for number, words in enumerate(ROLES)
            if _role(part) in words
        }
        for path in (one, other)
    )
    return bool(given and wanted) and given.isdisjoint(wanted)


def is_role(stem: str) -> bool:
    """Return whether a script's name, without its suffix, is the word for a kind of node and nothing else."""
    return _role(stem) in chain(*ROLES)


def _role(part: str) -> str:
    """Return the word for a kind of node that this part of a name is, or nearly is; else the part itself."""
    return closest(part, chain(*ROLES), cutoff=ROLE_CUTOFF) or part.casefold()


def _stem(path: str) -> str:
    return path.rpartition("/")[2].partition(".")[0]


def closest(word: str, candidates: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return the candidate most like `word`, ignoring case, or "" if none reaches the `cutoff` (0 to 1)."""
    known = {candidate.lower(): candidate for candidate in candidates}
    near = difflib.get_close_matches(word.lower(), known, n=1, cutoff=cutoff)
    return known[near[0]] if near else ""


def did_you_mean(word: str, candidates: Iterable[str]) -> str:
    """Return ` (did you mean "rate"?)` for the end of a message, or "".

    A part of one name alone means that name (`leeds`); the dashes of options do not make them alike.
    """
    known = {candidate.lstrip("-"): candidate for candidate in candidates}
    plain = word.lstrip("-")
    inside = [name for name in known if len(plain) >= PART_CHARS_MIN and plain.lower() in name.lower()]
    near = inside[0] if len(inside) == 1 else closest(plain, known)
    return f' (did you mean "{known[near]}"?)' if near else ""


def is_one_edit(one: str, other: str) -> bool:
    """Return whether one letter added, left out, changed, or swapped with its neighbour makes one the other."""
    if abs(len(one) - len(other)) > 1:
        return False
    start = next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), None)
    # one is the beginning of the other: one letter at its end makes them equal, unless they are
    if start is None:
        return len(one) != len(other)
    one, other = one[start:], other[start:]
    swapped = one[:2] == other[1::-1] and one[2:] == other[2:]
    return swapped or one[1:] == other[1:] or one[1:] == other or one == other[1:]


def is_another_number(one: str, other: str) -> bool:
    """Return whether the two names differ in a number of as many digits alone, as `lab1` and `lab2` do."""
    numbers = [re.findall(r"\d+", name) for name in (one, other)]
    same_length = [len(number) for number in numbers[0]] == [len(number) for number in numbers[1]]
    return one != other and same_length and re.sub(r"\d", "0", one) == re.sub(r"\d", "0", other)


def is_word_of(given: str, name: str, names: Collection[str]) -> bool:
    """Return whether `given` is a word of `name`, all of whose words stand among `names` one by one (`std msgs`)."""
    words = name.split("_")
    return len(words) > 1 and given in words and set(words) <= set(names)


def numbers_text(numbers: Iterable[int]) -> str:
    """Return `3, 5 to 8 and 10`, of numbers in their order; two that follow each other are no range."""
    runs: list[list[int]] = []
    for each in numbers:
        if runs and each == runs[-1][-1] + 1:
            runs[-1].append(each)
        else:
            runs.append([each])
    texts = [[f"{run[0]} to {run[-1]}"] if len(run) > PAIR else map(str, run) for run in runs]
    return join_words((text for run in texts for text in run), most=PLACES_LISTED_MAX)


PAIR = 2
PLACES_LISTED_MAX = 16
"""Of the lines of a hint, which has to hold for each of them."""


def on_lines(numbers: Iterable[int]) -> str:
    """Return `line 3`, or `lines 3, 5 to 8 and 10`, of numbers in their order."""
    known = list(numbers)
    return f"line{'s' * (len(known) > 1)} {numbers_text(known)}"


def the_same_on(numbers: Sequence[int]) -> str:
    """Return `, and the same on line 3` behind what to do on another line; "" without further lines."""
    return f", and the same on {on_lines(numbers)}" if numbers else ""


def lines_text(first: int, last: int) -> str:
    """Return `line 3`, or `lines 3 to 5`, of lines from 0."""
    return f"line {first + 1}" if last == first else f"lines {first + 1} to {last + 1}"


TEXT_PLACE = "write %s for %d or %f"
"""The hint on a text that comes where a `%d` or `%f` is; `repaired_copy.py` finds it again."""
CONVERTED = re.compile(r"write `(str|int|float)\(([^`]+)\)` instead of `\2`")
"""The function and the value in a hint of `convert`."""


def convert(function: str, value: str) -> str:
    """Return the hint on a value of another type than is needed: ``write `str(n)` instead of `n` ``."""
    return f"write `{function}({value})` instead of `{value}`"


WRITE_HANDLER = re.compile(r"on line (\d+)(?: of [\w./-]+)?, write `(except rospy\.ROSInterruptException:)`")
"""The line and its code in the fix of an `except` that drops every error, which `package/lint` writes."""


IN_PLACE_OF_SPIN = re.compile(r"on line (\d+), write `([\w.]+\.sleep\([\d.]*\))` in place of spin\(\)")
"""The line and the call in the fix of a `spin()` in a loop, which `package/lint` writes."""


IN_PLACE_OF_INPUT = re.compile(r"on line (\d+), write `(rospy\.spin\(\))` in place of `input\(\)`")
"""The line and the call in the fix of an `input()` that keeps a node alive, which `package/lint` writes."""


HIDING = re.compile(r"give ([\w./-]+\.py) another name, everywhere it is named")
"""The file in a hint of `rename_hiding`."""


def rename_hiding(file: str) -> str:
    """Return the hint on a file that has the name of a module which its neighbours import."""
    return f"give {file} another name, everywhere it is named"


ASKED_RATE = re.compile(r"make it \S+ Hz in ([^:;]+\.py), line (\d+): use ([\w.]+\([\d.]+\))")
"""The file, the line and the call in a hint of `ask_rate`."""
ASKED_TYPE = re.compile(r"use (\w+)/(\w+), the type that the handout asks for")
"""The package and the name in a hint of `ask_type`."""


PUBLISHED_TYPE = re.compile(r"from (std_msgs)\.msg import (\w+), then rospy\.Publisher\('[^']+', \2,")
"""The package and the name in the hint on a publisher of another type."""


def ask_field(field: str, other: str, value: str = "") -> str:
    """Return the hint on a field that another one has the values of: `set linear.x to 0.2, not linear.y`."""
    return f"set {field} to {value}, not {other}" if value else f"set {field}, not {other}"


def suspect_field(field: str, other: str) -> str:
    """Return the same where it may be by chance: `is linear.y set in place of linear.x?`."""
    return f"is {other} set in place of {field}?"


def fields_told(hint: str) -> tuple[str, str] | None:
    """Return the field and the other one of a hint of these two; None in any other."""
    if (found := re.search(r"\bset ([\w.]+)(?: to [^\s,;]+)?, not ([\w.]*\w)", hint)) is not None:
        return found[1], found[2]
    found = re.search(r"\bis ([\w.]+) set in place of ([\w.]+)\?", hint)
    return (found[2], found[1]) if found is not None else None


def ask_item(field: str, topic: str, right: str, wrong: str) -> str:
    """Return the hint on a field that is made of another part of what comes: `for linear.x, use axes[1] of /joy, not
    axes[3]`."""
    return f"for {field}, use {right} of {topic}, not {wrong}"


ASKED_ITEM = re.compile(r"for [\w.]+, use (\S+) of /\S+, not ([^\s;]+)")
"""The part that is right, and the other one, in a hint of `ask_item`."""


SWAPPED = re.compile(r"on line (\d+), swap the two values in the brackets of `(\w+)`")
"""The line and the function in the fix of arguments in the wrong order, which `package/lint` writes."""


NO_SEMICOLON = re.compile(r"write a `;` at the end of (?:that line|the last line of code above line (\d+))")
"""The line below, if any, in a hint of `ask_semicolon`."""


def ask_semicolon(below: str = "") -> str:
    """Return the hint on a statement that has no end: on the line that is named, or above the line `below`."""
    where = f"the last line of code above line {below}" if below else "that line"
    return f"write a `;` at the end of {where}"


def ask_rate(hz: str, where: str, right: str) -> str:
    """Return the hint on a line that asks for another rate: `make it 10 Hz in a.py, line 3: use rospy.Rate(10)`."""
    return f"make it {hz} Hz in {where}: use {right}"


def ask_type(name: object) -> str:
    """Return the hint on a topic's type: `use std_msgs/String, the type that the handout asks for`."""
    wanted = f"{name}, the type" if isinstance(name, str) else "the type"
    return f"use {wanted} that the handout asks for"
