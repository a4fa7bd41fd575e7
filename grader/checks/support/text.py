"""Text as a student reads it: names that nearly fit, numbers and lists, templates, and ROS in Python and in C++."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Literal

from pydantic import AfterValidator

from grader.model.python_slip import PythonSlip
from grader.untrusted_text import visible, without_colours
from grader.wording import is_one_edit, join_words, plural, shorten

SIMILARITY = 0.8
IN_PLACE_OF_ALL = "in place of all of it"
"""Of lines that are to be the whole file."""
IN_OWN_WORDS = "in the handout's own words"
OTHER_WORDS_SHARE = 0.5
"""Of the points, for what is said at the right place in other words than the handout's."""
SLIP_CHARS_MIN = 4
"""Of the last part of a name, so that one letter more, less or another is a slip."""
NAMES_MAX, NAME_CHARS_MAX = 1_000, 60
"""Of names that students may give by the thousand: so many are looked at, and so much of each."""
SHOWN_CHARS = 160
SHOWN_BEFORE_CHARS = 10_000
SECONDS, COUNT = "{seconds}", "{count}"
VALUE = "{value}"
PLACE = "{number}"
PLACES = frozenset({SECONDS, COUNT, VALUE, PLACE})
"""What stands for a time, a count, a message or a number in the texts that rubrics ask for."""
PLACED = re.compile(r"\{(seconds|count)\}")
GROWING = {SECONDS: "seconds that count up like the clock", COUNT: "a number that goes up by one each time"}
# `\d` would take the digits of other scripts, too.
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
    """Return those of `names` that look like a slip of `wanted`: case, namespace, separator, a typing error."""
    looked_at = islice(dict.fromkeys(names), NAMES_MAX)
    found = [n for n in looked_at if n != wanted and _is_near(wanted, n)]
    return tuple(sorted(found, key=lambda n: -_matcher(wanted, n).ratio()))


def _is_near(wanted: str, name: str) -> bool:
    last_wanted, last_name = (n.rstrip("/").rpartition("/")[2] for n in (wanted, name))
    # The same words in another order: `numeric_talker` and `talker_numeric`.
    same_words = sorted(_words(last_wanted)) == sorted(_words(last_name)) != []
    squeezed = _joined_words(last_wanted), _joined_words(last_name)
    same = same_words or squeezed[0] == squeezed[1]
    slip = min(map(len, squeezed)) >= SLIP_CHARS_MIN and is_one_edit(*squeezed)
    return same or slip or _is_similar(wanted, name)


def _is_similar(first: str, second: str) -> bool:
    """The quick ratios are never less than the ratio."""
    matcher = _matcher(first, second)
    # The quickest first: most names are told apart by it.
    return all(
        ratio() >= SIMILARITY for ratio in (matcher.real_quick_ratio, matcher.quick_ratio, matcher.ratio)
    )


def _matcher(first: str, second: str) -> difflib.SequenceMatcher[str]:
    one, other = (_joined_words(name)[:NAME_CHARS_MAX] for name in (first, second))
    return difflib.SequenceMatcher(None, one, other)


def _words(name: str) -> list[str]:
    return re.findall(r"[a-z0-9]+", name.casefold())


def _joined_words(name: str) -> str:
    return "".join(_words(name))


def shown(text: str, most_chars: int = SHOWN_CHARS) -> str:
    """One line of someone's output, without colours, what cannot be seen written out, cut to fit a report."""
    return in_one_line(without_colours(text[:SHOWN_BEFORE_CHARS]), most_chars)


def in_one_line(text: str, most_chars: int = SHOWN_CHARS) -> str:
    """Return the same of a message: its colours are part of it."""
    line = visible(" ".join(text[:SHOWN_BEFORE_CHARS].split()))
    return shorten(line, most_chars)


OTHER_PLACES = re.compile(r"%[-+ 0]*[\d.]*[dfs](?!\w)|\\[dwsS][+*]?|\.\*|\{:[^{}]*\}|\{\d\}")
"""What stands for a value in Python's texts and in regular expressions."""


def refuse_others(*places: str) -> AfterValidator:
    """Return what refuses a text with another word in braces that is meant to be one of `places`."""
    place = " or ".join(places)

    def checked(template: str) -> str:
        for word in re.findall(r"\{(?:[A-Za-z_]\w*)?\}", template):
            if word not in places and (
                not word.isupper() or word.lower() in PLACES
            ):  # `{INFO}` may be printed
                raise ValueError(f"{word} stands for nothing here: write {place}")
        if other := OTHER_PLACES.search(template):
            raise ValueError(f"{other[0]} stands for itself here, as the other letters do: write {place}")
        return template

    return AfterValidator(checked)


def words_pattern(words: str) -> str:
    """Return a regular expression for words without regard to case and to how many blanks stand between them."""
    parts = r"\s+".join(re.escape(part) for part in re.split(r"\s+", words))
    return f"(?i:{parts})" if words else ""


def message_pattern(template: str, value: str) -> re.Pattern[str]:
    """Return the whole text: the template's words, and `value` (a regular expression) where it says `{seconds}` or
    `{count}`, in groups of these names, which the first of each has."""
    first, *others = PLACED.split(template.strip())
    inner, named = "", set[str]()
    for name, words in zip(others[::2], others[1::2], strict=True):
        inner += f"({'' if name in named else f'?P<{name}>'}{value}){words_pattern(words)}"
        named.add(name)
    return re.compile(rf"\s*{words_pattern(first)}{inner}\s*", re.DOTALL)


def growing(template: str) -> str:
    """Return what grows from message to message, as the end of a sentence; "" for nothing."""
    found = [words for place, words in GROWING.items() if place in template]
    return f", with {' and '.join(found)}" if found else ""


def line_pattern(template: str, value: str, *, alone: bool = False) -> re.Pattern[str]:
    """Return the template's words around `value`, which has to stand there letter by letter, blanks squeezed; `alone`,
    if it must be no part of a longer word or number."""
    squeezed = re.escape(" ".join(value.split()))
    squeezed = rf"(?<![\w.-]){squeezed}(?!\w|\.\d)" if alone else squeezed
    return re.compile(squeezed.join(words_pattern(words) for words in template.strip().split(VALUE)))


def in_words(template: str) -> str:
    """Return the template as a student reads it: `hello world <seconds>`."""
    return PLACED.sub(r"<\1>", template).replace(VALUE, "<message>")


Language = Literal["python", "cpp"]

# Letters of Unicode's private use, which stand in no other text.
_PAIR = re.compile("\ue000([^\ue000-\ue002]*)\ue001([^\ue000-\ue002]*)\ue002")


RENAME_IF_MEANT = re.compile(r", or rename (?P<names>/[^;]*?) if that is meant to be it")


def rename_if_meant(names: Collection[str]) -> str:
    """Return what to put behind the hint that a topic or a service has to be added, where these may be meant to be it:
    `RENAME_IF_MEANT` finds it again."""
    return f", or rename {join_words(names, 'or')} if that is meant to be it" if names else ""


def python_or_cpp(python: str, cpp: str) -> str:
    """Return a part of a hint that is said of a node in Python, or of one in C++."""
    return f"\ue000{python}\ue001{cpp}\ue002"


_PLACES = re.compile(
    r"(?P<name>\{[A-Za-z_][\w.]*(?:\[[^][{}]*\]|\([^(){}]*\))*(?:![rsa])?(?::[^{}]*)?\})|\{\}|%[-+0-9.]*[dfs](?!\w)"
)


def unfilled(text: str) -> str:
    """Return what to write where a text came out with the places for its values; "" for any other text."""
    found = _PLACES.search(text)
    if found is None:
        return ""
    if found["name"]:
        return f"write an `f` before the quote of that text: without it, `{shown(found[0])}` is no value"
    if found[0] == "{}":
        return "write `.format(…)` behind that text, with a value for each `{}`"
    where = python_or_cpp("`% value` behind it", "the next argument")
    return f"give that text a value for its `{shown(found[0])}`: {where}"


VALUE_SLOT, RATE_SLOT, TYPE_SLOT = "\ue003", "\ue004", "\ue005"
"""Parts of a hint in whose place the judge writes what the lab asks for: a node's text, the rate of its loop, and the
type of what is sent to it."""


def in_language(hint: str, language: Language | None) -> str:
    """Return the hint for a node in this language. None, where it may be either, keeps both."""
    if language is None:
        python, cpp = (in_language(hint, one) for one in ("python", "cpp"))
        return python if python == cpp else f"{python} (in C++: {cpp})"
    return _PAIR.sub(r"\1" if language == "python" else r"\2", hint)


LOOP = python_or_cpp("while not rospy.is_shutdown():", "while (ros::ok())")
SPIN = python_or_cpp("rospy.spin()", "ros::spin()")
MAKE_RATE = "make it with `rospy.Rate(…)`, which takes how many times a second the loop runs"
STAY_ALIVE = f"a node has to stay alive: `{SPIN}`, or a loop `{LOOP}`"
INIT = python_or_cpp("rospy.init_node(…)", "ros::init(argc, argv, …) and ros::NodeHandle")
RATE = python_or_cpp("rospy.Rate", "ros::Rate")
GET_TIME = python_or_cpp("rospy.get_time()", "ros::Time::now().toSec()")
NOW = python_or_cpp("rospy.Time.now()", "ros::Time::now()")
ANONYMOUS = python_or_cpp("anonymous=True", "ros::init_options::AnonymousName")
PUBLISHER = python_or_cpp("rospy.Publisher(…)", "nh.advertise<…>(…)")
SERVICE = python_or_cpp("rospy.Service(…)", "nh.advertiseService(…)")


def init(name: str, *, anonymous: bool = False) -> str:
    """Return the call that makes the program a node of this name."""
    flags = (", anonymous=True", ", ros::init_options::AnonymousName") if anonymous else ("", "")
    return python_or_cpp(f"rospy.init_node('{name}'{flags[0]})", f'ros::init(argc, argv, "{name}"{flags[1]})')


def loop_rate(hz: str) -> str:
    """Return what a loop sleeps with."""
    return python_or_cpp(f"rospy.Rate({hz})", f"ros::Rate rate({hz})")


def rate_hint(ratio: float, nominal: str, *, even: bool) -> str:
    """Return what may be wrong where a loop comes round `ratio` times as often as it should."""
    if abs(ratio - 0.5) < 0.05:
        halved = "two of them halve the rate, and so does an `if` around publish(…)"
        return f"use {loop_rate(nominal)}, and call rate.sleep() once per loop: {halved}"
    if abs(ratio - 2) < 0.2 and not even:
        return f"twice the rate: does the loop, or a second publisher, publish twice? {loop_rate(nominal)}"
    if ratio < 1:
        return f"use {loop_rate(nominal)} and call rate.sleep() once per loop, with nothing slow beside it"
    return f"the number is in Hz, loops per second: {loop_rate(nominal)}"


def publisher(topic: str, python: str = "…", cpp: str = "10", *, type: str = "…") -> str:  # noqa: A002
    """Return the call that advertises the topic, with the other arguments of each language."""
    return python_or_cpp(f"rospy.Publisher('{topic}', {python})", f'nh.advertise<{type}>("{topic}", {cpp})')


def subscriber(topic: str, python: str = "…") -> str:
    """Return the call that subscribes to the topic."""
    return python_or_cpp(f"rospy.Subscriber('{topic}', {python})", f'nh.subscribe("{topic}", 10, callback)')


def service_call(name: str, python: str = "…") -> str:
    """Return the call that offers the service."""
    return python_or_cpp(f"rospy.Service('{name}', {python})", f'nh.advertiseService("{name}", callback)')


def service_client(name: str) -> str:
    """Return what calls the service."""
    return python_or_cpp(f"rospy.ServiceProxy('{name}', <Type>)(…)", f'nh.serviceClient<…>("{name}").call(…)')


def action_client(name: str) -> str:
    """Return what sends a goal to the action."""
    return python_or_cpp(
        f"actionlib.SimpleActionClient('{name}', <Type>).send_goal(…)",
        f'actionlib::SimpleActionClient<…>("{name}").sendGoal(…)',
    )


def imports(package: str, name: str, folder: str) -> str:
    """Return the line that makes a type known: `folder` is `msg` or `srv`."""
    return python_or_cpp(f"from {package}.{folder} import {name}", f'#include "{package}/{name}.h"')


def get_param(name: str) -> str:
    """Return the call that reads a parameter."""
    return python_or_cpp(f"rospy.get_param('{name}')", f'ros::param::get("{name}", value)')


def set_param(name: str, value: object = ...) -> str:
    """Return the call that sets a parameter, to a value if there is one."""
    python, cpp = ("…", "…") if value is ... else (repr(value), json.dumps(value, default=str))
    return python_or_cpp(f"rospy.set_param('{name}', {python})", f'ros::param::set("{name}", {cpp})')


def log(level: str, text: str) -> str:
    """Return the call that logs a text."""
    python = "err" if level == "error" else level
    return python_or_cpp(f'rospy.log{python}("{text}")', f'ROS_{level.upper()}("{text}")')


def log_param(name: str) -> str:
    """Return the calls that read a parameter and log its value."""
    cpp = f'ros::param::get("{name}", value), then ROS_INFO_STREAM(value)'
    return python_or_cpp(f"rospy.loginfo(rospy.get_param('{name}'))", cpp)


SAID_VALUE, SAID_DATA = "{}", "{data}"
"""In the text of a source, a value, and what is in a message."""
_GAP = re.compile(r"\{(?:data)?\}")
_STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')
_PLACED = re.compile(r"%[-+ #0-9.]*(?:l|ll|h)?[a-zA-Z]")
# `cout <<` prints, while any other `name <<` fills a text.
_CPP_PUBLISHES = re.compile(r"\s*(?!(?:std::)?c(?:out|err)\b)\w+\s*<<|.*\.data\s*=[^=]")
_CPP_PRINTS = re.compile(
    r"\s*(?:ROS_(?:INFO|WARN|ERROR|DEBUG)\w*\s*\(|printf\s*\(|(?:std::)?c(?:out|err)\s*<<)"
)


def could_say(said: str, wanted: str) -> bool:
    """Return whether the text of a source, its gaps filled, can be `wanted`, whatever its capitals and blanks."""
    text = " ".join(wanted.split()).casefold()
    first, *inner = [" ".join(part.split(" ")).casefold() for part in _GAP.split(" ".join(said.split()))]
    if not inner:
        return first == text
    *inner, last = inner
    if not text.startswith(first) or not text.endswith(last):
        return False
    # First and last part stand at the ends, so the others have to fit between them.
    at, end = len(first), len(text) - len(last)
    for part in inner:
        at = text.find(part, at, end)
        if at < 0:
            return False
        at += len(part)
    return at <= end


def says(said: str, template: str) -> bool:
    """Return whether the text of a source can have the template's words right before what is in a message, without
    regard to capitals and blanks."""
    words = " ".join(template.replace(VALUE, SAID_DATA).split()).casefold()
    text = " ".join(said.split()).casefold()
    before = _GAP.sub("", text[: text.find(SAID_DATA)])
    unknown = SAID_VALUE in text and not re.search(r"[^\W\d]", before)
    return words in text or unknown


def in_source(said: str) -> str:
    """Return the text of a source as a student reads it: `hello <value>`."""
    text = said.replace(SAID_DATA, "<message>").replace(SAID_VALUE, "<value>").replace("{node}", "<node>")
    return text.replace("\n", r"\n").replace("\t", r"\t")


def texts_of_cpp(lines: Iterable[str]) -> Iterator[tuple[Literal["publishes", "prints"], int, str]]:
    """Yield `publishes` or `prints`, the line and the text, of lines of C++ that build a text or print one."""
    for number, line in enumerate(lines, 1):
        code = line.partition("//")[0]
        prints, strings = _CPP_PRINTS.match(code) is not None, _STRING.findall(code)
        if not strings or not (prints or _CPP_PUBLISHES.match(code)):
            continue
        plain = _STRING.sub('"', code)
        value = SAID_DATA if re.search(r"(->|\.)data\b(?!\s*=[^=])", plain) else SAID_VALUE
        text = _PLACED.sub(value, strings[0])
        if text == strings[0]:
            streamed = "<<" in plain and '"' not in plain.partition("<<")[0]
            parts = plain.split("<<")[1:] if streamed else re.split(r"<<|\+", plain[plain.index('"') :])
            left = iter(strings)
            text = "".join(next(left, "") if '"' in part else value for part in parts if _is_said(part))
        yield "prints" if prints else "publishes", number, text.replace("\\n", "").replace('\\"', '"')


def _is_said(part: str) -> bool:
    return "endl" not in part and bool(part.strip(" ;)"))


ARGUMENT_HINT = (
    "put the value in the code, or use a default where `len(sys.argv)` is 1: nothing passes arguments"
)
PARSER_REFUSES = re.compile(r": error: (the following arguments|unrecognized arguments|argument )")
"""What Python's `argparse` prints last."""


def explain_arguments(last: str, given: Sequence[str]) -> tuple[str, str] | None:
    """Return what a program that ends for its arguments was given, and what to do; None where its last line names no
    such reason."""
    parser = PARSER_REFUSES.search(last)
    if parser is None and not re.search(r"\busage\b", last, re.IGNORECASE):
        return None
    listed = f"{plural(len(given), 'argument')} ({shown(' '.join(given))})" if given else "no arguments"
    return f"it was given {listed}", _parser_hint(last, given) if parser else _usage_hint(given)


def _usage_hint(given: Sequence[str]) -> str:
    if given:
        return f"compare argc, or len(sys.argv), with {len(given) + 1}: the program's name counts too"
    return ARGUMENT_HINT


def _parser_hint(last: str, given: Sequence[str]) -> str:
    # roslaunch and rosrun pass `__name:=…` and remappings behind a program's own arguments.
    if ":=" in last:
        return "write `parse_args(rospy.myargv()[1:])`: the last arguments are for ROS"
    if not given:
        return "write `default=…` in `add_argument(…)`, and no `required=True`: nothing passes arguments"
    if any(re.match("--?[A-Za-z]", one) for one in given):
        return "let `add_argument(…)` take each option by the name, and with the value, that it is given with"
    if ": error: argument " in last:
        return "let `type=…`, or `choices=…`, of that `add_argument(…)` take what it is given"
    option = re.search(r"required: (?:-\w/)?--([\w-]+)$", last)
    name = option[1].replace("-", "_") if option else "…"
    return f"write `add_argument('{name}', …)`, without dashes and without `required`: the arguments have no names"


def as_number(kind: str, source: str) -> str:
    """Return how to make a number of this kind of a value on a line of source."""
    divided = kind == "int" and not re.search("['\"]", source)
    return f"`{kind}(…)`" + (", or write `//` in place of a `/`, which makes a float" if divided else "")


REFUSED = re.compile(
    r"^\S+: error: (.*(?:unrecognized arguments|invalid \w+ value|arguments are required|expected).*)$"
)
"""How `argparse` ends a program that is given other options than it knows."""


def refused_options(lines: Iterable[str]) -> str:
    """Return what a program says of the options that it is given and does not know, behind a colon; "" of none."""
    said = next((found[1] for line in lines if (found := REFUSED.match(without_colours(line)))), "")
    return f": {shorten(said, 200)}" if said else ""


FILLED = {
    "seconds": ("rospy.get_time()", "ros::Time::now().toSec()"),
    "count": ("count", "count"),
}
"""What a template's places are filled in with, in Python and C++."""


def code_of(template: str) -> str:
    """Return the expression that makes such a text."""
    text, values = f'"{PLACED.sub("%s", template)}"', [FILLED[name] for name in PLACED.findall(template)]
    if not values:
        return text
    python, cpp = (", ".join(each) for each in zip(*values, strict=True))
    return text + python_or_cpp(f" % ({python})" if values[1:] else f" % {python}", f" with {cpp} for %s")


NO_INPUT = f"write {VALUE_SLOT} in place of `input()`"
OFFLINE = re.compile(
    r"name resolution|Name or service not known|No address associated with hostname|Network is unreachable"
    r"|(?i:could not|unable to) resolve host|No route to host"
)
"""What Python, curl, wget, ping and ssh say where there is no network."""
NEEDS_NETWORK = (
    "it needs the network, which a graded node does not have",
    "leave out what connects to other machines; if the lab asks for it, tell your instructor: a graded node is offline",
)
PAUSE = f"write `rate = {RATE_SLOT}` above it and `rate.sleep()` as its last line"
CAUSES = {
    "EOFError": ("it waits for input (`input()`), and a graded node gets no input",
     f"{NO_INPUT}, and pause in the loop: {PAUSE}"),
    "BdbQuit": ("the debugger (`set_trace()`, `breakpoint()`) waits for input, and a graded node gets no input",
     "remove `set_trace()` or `breakpoint()`, and its import"),
    "ROSInterruptException": ("ROS was told to shut down while the node slept, and nothing caught it",
     "call your main function in `try: … except rospy.ROSInterruptException: pass`"),
    "ROSInitException": ("it uses ROS before `rospy.init_node(…)`",
     "call `rospy.init_node(…)` before the first publish, Rate or sleep"),
    **dict.fromkeys(("LookupException", "ExtrapolationException", "ConnectivityException"), (
        "tf does not know the transform yet, as always at the start",
        "catch it, `try: … except tf2_ros.TransformException:`, or give `lookup_transform(…)` a time to wait")),
    "KeyboardInterrupt": ("Ctrl-C came at a point where nothing handles it",
     "loop with `while not rospy.is_shutdown():` and sleep with `rospy.Rate`"),
    "ModuleNotFoundError": ("",
     "check the spelling of the import (messages: `std_msgs.msg`), and push it if it is a file or package of your own"),
    "ImportError": ("", "check the spelling of the import: the message types are at http://wiki.ros.org/std_msgs"),
    "ResourceNotFound": ("there is no such ROS package", "remove `roslib.load_manifest(…)`: catkin needs no such line"),
    "NameError": ("", "check the spelling, and that it is imported or assigned before it is used"),
    "ROSSerializationException": ("", "publish a value that fits the message's type"),
    "SerializationError": ("", "publish a value that fits the message's type"),
    "ConnectionRefusedError": ("nothing answers at that address while a node is graded",
     "leave out what connects there, or catch the error, so that the node goes on without it"),
    "SyntaxError": ("", "compare that line and the end of the one above it with the handout, character by character"),
    "IndentationError": ("", "indent every block by four spaces, all of its lines alike"),
    "TabError": ("tabs and spaces are mixed in its indentation", "indent every line with four spaces"),
}  # fmt: skip
"""What an exception of this type means, and what to do, where nothing better is known."""


def fixes_of(slips: Sequence[PythonSlip]) -> str:
    """Return what to do about the first of them, and about two more of its kind and file at most."""
    same = [s for s in slips[1:] if (s.kind, s.file) == (slips[0].kind, slips[0].file)][:2]
    return "; ".join([slips[0].fix, *(f"on line {s.line}, {s.message}: {s.fix}" for s in same)])
