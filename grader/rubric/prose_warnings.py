"""What a title, a hint or the handout says otherwise than the criterion beside it: warnings."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any

from grader.checks.support.fields import is_number
from grader.model.message_definitions import BUILT_IN
from grader.rubric.message_fields import said_types
from grader.rubric.simulators import topics_of_programs
from grader.rubric.spelling import is_slip
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_list,
    as_map,
    as_texts,
    numbers_in,
    published_in,
    starts_of,
    texts_in,
)
from grader.wording import join_words

WORDS = {
    "once": 1,
    "one": 1,
    "two": 2,
    "twice": 2,
    "three": 3,
    "four": 4,
    "five": 5,
    "ten": 10,
    "twenty": 20,
    "fifty": 50,
}
_NUMBER = rf"\d+(?:\.\d+)?|{'|'.join(WORDS)}"
# `10 Hz`, `twice a second`, `five messages per second`.
PER_SECOND = re.compile(rf"\b({_NUMBER})(?: ?Hz\b|(?: \w+)? (?:a|per) second)", re.IGNORECASE)
SHIFTS = (10, 100, 1000, 0.1, 0.01, 0.001, -1)
"""By so much a number is another where a digit is forgotten, the unit is a thousandth, or the sign is missing."""
DEFAULTS = {
    "counter-start": {"start": 0},
    "counter-step": {"maximum": 127},
    "counter-wrap": {"minimum": 0, "maximum": 127},
}
"""Numbers that a check has without being given them."""
EXPECTED = ("value", "values", "numbers", "rate_hz", "result", "expect", "goal", "start", "min", "max",
            "translation", "tolerance_m", "cause", "effect")  # fmt: skip
"""Keys of what a criterion asks for, as numbers."""
# Not the 1 of `turtle1` or `1.2.3`.
PLAIN_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w]|\.\d)")
# `uint8` of a definition, and `std_msgs/UInt8` of a topic.
PRIMITIVE = re.compile(r"(?:std_msgs/)?([Uu]?[Ii]nt|[Ff]loat)(8|16|32|64)")
# What ROS itself takes these two for (wiki.ros.org/msg).
OLD_NAMES = {"byte": "int8", "char": "uint8"}
TEXTS = {"prints": ("text", "template"), "logs": ("text", "template"), "definition": ("file",)}
"""By check, the parameters that the handout has as text."""
RANGE = re.compile(
    r"(-?\d+(?:\.\d+)?) (?:to|and|or above|or more than) (-?\d+(?:\.\d+)?)(?![\w.]\d)( ?(?:°|deg|%|percent|[cm]m\b))?"
)
NAME = re.compile(r"[~/\w.-]+")
SENTENCE_END = re.compile(r"(?<=[.;])\s+")
LEVEL = re.compile(
    r"\blog(info|warn|err|debug)|\blevel `?(info|warn|error|debug)|\bas an? (warning|error)\b|\b(warning|error) `…`",
    re.IGNORECASE,
)
"""Where a level is asked for: other sentences may have an error in them, or warn of something."""
VALUES = ("value", "values", "expect", "result")
"""Keys of texts that a node has to publish or to answer."""
FEW = 10
"""Of fewer values, each is drawn often."""
FIELD = re.compile(r"^\s*([a-z]+\d*)\s+(\w+)\s*(?:#.*)?$", re.MULTILINE)
"""A field of a primitive type in a definition."""


def prose_warnings(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield what may be a slip in one of the two."""
    handout = rubric.handout
    yield from _sent_otherwise(rubric)
    yield from _unsaid_topic(rubric)
    yield from _shifted_factors(as_map(rubric.data.get("made_up")), handout)
    yield from _said_values(as_map(rubric.data.get("made_up")), handout)
    for criterion in rubric.criteria:
        at, given, check = criterion.at, criterion.given, criterion.check
        yield from _shifted_numbers(criterion, rubric)
        yield from _numbers_of_title(criterion, rubric)
        yield from _other_range(criterion, handout)
        yield from _other_node(criterion, handout)
        yield from _other_types(at, given, handout)
        yield from _misspelt_keys(criterion, rubric)
        if check in {"node-lives", "node-name", "launch-runs"}:
            yield from _unsaid_node(at, given, rubric)
        yield from _other_text(criterion, rubric, TEXTS.get(check, VALUES))
        yield from _of_another_topic(criterion, rubric)
        yield from _value_of_another(criterion, rubric)
        yield from _sent_in_another_order(criterion)
        if check == "logs":
            yield from _other_level(criterion, handout)
        parent, child = (rf"`?{re.escape(str(given.get(key)))}`?(?!\w)" for key in ("parent", "child"))
        is_back = check == "transform" and re.search(rf"from {child}\s+to {parent}", handout)
        if is_back and not re.search(rf"from {parent}\s+to {child}", handout):
            yield (*at, "parent"), f"the handout has it from {given.get('child')} to {given.get('parent')}"


def _shifted_numbers(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield numbers that only this line has, and that the criterion's title or the handout has with another sign, or
    ten times as large or as small."""
    about = [str(criterion.data.get(key, "")) for key in ("title", "hint")]
    prose = " ".join([*about, rubric.handout])
    said = {float(number) for number in PLAIN_NUMBER.findall(prose)}
    said_hz = _rates(prose)
    there = [number for at, number in numbers_in((), rubric.data) if not _is_setting(at)]
    own = {number for _, number in numbers_in((), criterion.given)}
    arguments = [one for start in starts_of(criterion.scenario) for _, one in as_texts(start.get("args"))]
    for key in EXPECTED:
        asked = criterion.given.get(key)
        for at, number in numbers_in((key,), asked) if key != "goal" else ():  # which of the goals
            # A rate is compared with rates alone: the text has other numbers for other things.
            known = said_hz if key == "rate_hz" else said
            # Bounds are often each other's negative.
            shifts = SHIFTS[:-1] if at[-1] in {"min", "max"} else SHIFTS
            # Rounded, since a tenth of a float is mostly off by a hair.
            meant = next((number / by for by in shifts if round(number / by, 9) in known), None)
            # 0.1 or 100 is chosen by itself so often that a digit is no sign of a slip.
            is_round = key != "rate_hz" and re.fullmatch(r"0?\.?0*10*", f"{abs(number):.9g}") is not None
            # A list of values may have both signs on purpose.
            is_opposite = key == "values" and meant in own
            if number in said | known or meant is None or is_opposite or is_round or there.count(number) > 1:
                continue
            if f"{number:g}" in arguments:
                continue
            if at[-1] == "tolerance_m" and abs(number) < abs(meant):
                continue  # a tenth of the way is a usual one
            if at[-1] != "tolerance" and (known is said or len(known) == 1):
                fault = f"{number:g} is on no other line, and the rubric's text has {meant:g}"
                yield (*criterion.at, *at), fault


def _other_range(criterion: WrittenCriterion, handout: str) -> Iterator[Fault]:
    """Yield bounds of a field, neither of which is one of the range that the handout's sentence about it has."""
    given = criterion.given
    low, high, field = given.get("min"), given.get("max"), str(given.get("field")).rpartition(".")[2]
    if criterion.check != "field-bounds" or not is_number(low) or not is_number(high):
        return
    ranges = (set(map(float, said.groups()[:2])) for said in RANGE.finditer(handout))
    if {low, high} in ranges:
        return
    for sentence in SENTENCE_END.split(handout):
        said = RANGE.search(sentence)
        # what is in another unit than the field's has other numbers
        words = {field, str(given.get("topic")).rpartition("/")[2]} - {"data"}
        is_about = (
            said and not said[3] and any(re.search(rf"\b{re.escape(one)}s?\b", sentence) for one in words)
        )
        if said and is_about and not {low, high} & {*map(float, said.groups()[:2])}:
            yield (*criterion.at, "min"), f"to max is {low:g} to {high:g}, and the handout has {said[0]}"


def _said_values(made_up: dict[str, Any], handout: str) -> Iterator[Fault]:
    """Yield values that are made up of so few that one which the handout has, as a default, often comes."""
    # A factor of a formula is no default: `w * base / 2`.
    said = {
        float(number)
        for number in PLAIN_NUMBER.findall(re.sub(r"[*/]\s*[\d.]+\b|\b[\d.]+\s*\*", "", handout))
    }
    for name, one in made_up.items():
        low, high, step = (as_map(one).get(key, 1) for key in ("from", "to", "step"))
        if "from" not in as_map(one) or not all(map(is_number, (low, high, step))) or step <= 0:
            continue
        found = sorted(
            n for n in said if low <= n <= high and abs((n - low) / step - round((n - low) / step)) < 1e-6
        )
        if found and high - low < FEW * step:
            fault = f"may be {found[0]:g}, which the handout has: a node that always uses that passes then"
            yield ("made_up", name), fault


def _shifted_factors(made_up: dict[str, Any], handout: str) -> Iterator[Fault]:
    """Yield numbers by which a made-up value is computed, and that the handout has ten times as large or as small."""
    # A default is no factor.
    text = re.sub(r"\bdefaults?:?(?: to| is| of)? -?[\d.]+", "", handout)
    said = {float(number) for number in PLAIN_NUMBER.findall(text)}
    for name, key in ((name, key) for name in made_up for key in ("sum", "product", "quotient")):
        for at, number in numbers_in((key,), as_map(made_up[name]).get(key)):
            meant = next((number / by for by in SHIFTS[:-1] if round(number / by, 9) in said), None)
            is_round = re.fullmatch(r"0?\.?0*10*", f"{abs(number):.9g}") is not None
            if number not in said and meant is not None and not is_round:
                yield ("made_up", name, *at), f"{number:g} is not what the handout has: {meant:g}"


def _unsaid_topic(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield the first topic or service of a criterion that the handout does not name, where the handout has others in
    backticks that nothing else in the rubric names."""
    said = re.findall(r"(?<=`)\w+(?=`)|(?<=/)\w+", rubric.handout)
    named = {text for key, part in rubric.data.items() if key != "handout" for _, text in texts_in((), part)}
    used = {word for text in named for word in re.findall(r"(?<![\w.])/[\w/]*\w", text)}
    used |= {f"/{text}" for text in named}  # a node's
    # A simulator has topics that students use and no criterion reads, and others that only criteria read.
    used |= {topic for scenario in rubric.scenarios.values() for topic in topics_of_programs(scenario)}
    others = [
        name for name in dict.fromkeys(re.findall(r"`(/[\w/]*\w)`", rubric.handout)) if name not in used
    ]
    for criterion in rubric.criteria if others else ():
        for key in ("topic", "service"):
            name = criterion.given.get(key)
            if isinstance(name, str) and name.rpartition("/")[2] not in said:
                fault = (
                    f"the handout does not name {name}; it has {join_words(others)}, which nothing here does"
                )
                yield (*criterion.at, key), fault
                return


def _rates(text: str) -> set[float]:
    return {float(WORDS.get(number.lower(), number)) for number in PER_SECOND.findall(text)}


def _is_setting(path: KeyPath) -> bool:
    """Return whether a number is about the run or the marks, and not about what a node publishes or prints."""
    return bool(
        re.search(r"_s$|^(?:rate_hz|warp|points|bonus|penalty|at_most|digits|goal|number)$", str(path[-1]))
    )


def _other_node(criterion: WrittenCriterion, handout: str) -> Iterator[Fault]:
    """Yield the name of a process in place of its node's."""
    names = [name for _, name in as_texts(criterion.given.get("names"))]
    process, is_node = criterion.given.get("process"), criterion.check in {"node-lives", "node-name"}
    starts = [start for start in starts_of(criterion.scenario) if start.get("name") == process]
    if not is_node or len(names) != 1 or len(starts) != 1 or not handout:
        return
    script, name = PurePosixPath(str(starts[0].get("script"))).stem, names[0]
    quoted = re.findall(r"`[/~]?(\w+)`", handout)
    # Only where the handout has the script's name and not this one: both may be names of nodes.
    if name == process and script != name and script in quoted and not re.search(rf"\b{name}\b", handout):
        fault = f"{name} is what the rubric calls the process, and the handout has `{script}`: is that the node's name?"
        yield (*criterion.at, "names", 0), fault


def _unsaid_node(at: KeyPath, given: dict[str, Any], rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield names that the handout gives to the package or to a file alone, and not to a node as it does to others."""
    handout, starts = rubric.handout, [start for _, start in rubric.starts()]
    nodes = {
        name for said in re.findall(r"\bnodes? `[^.;:(]*", handout) for name in re.findall(r"`/?(\w+)`", said)
    }
    scripts = [str(start.get("script")) for start in starts]
    files = " ".join([*rubric.packages, *scripts, *re.findall(r"[\w/]+\.(?:py|cpp)\b", handout)])
    for number, name in as_texts(given.get("names")):
        if nodes and name.strip("/") not in nodes and re.search(rf"\b{re.escape(name.strip('/'))}\b", files):
            others = nodes - set(rubric.packages) | {*re.findall(r"\bnode `/?(\w+)`", handout)}
            fault = f"is no node of the handout, which has {join_words(sorted(others))}"
            yield (*at, "names", number), fault
    for name, package in as_map(given.get("nodes")).items():
        last = str(name).rpartition("/")[2]
        is_started = any(PurePosixPath(str(start.get("program"))).stem == last for start in starts)
        if package in rubric.packages and nodes and last not in nodes and not is_started:
            others = {*re.findall(r"\bnode `/?(\w+)`", handout)} or nodes
            yield (*at, "nodes", name), f"is no node of the handout, which has {join_words(sorted(others))}"


def _of_another_topic(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield a topic that the title does not name, where it names another one of the rubric."""
    own = criterion.topics
    named = {*re.findall(r"(?<![\w/])/[\w/]*\w", str(criterion.data.get("title")))}
    others = {topic for one in rubric.criteria for topic in one.topics}
    if isinstance(criterion.given.get("topic"), str) and named and named <= others and not named & own:
        yield (*criterion.at, "topic"), f"is not what the title has: {join_words(sorted(named))}"


def _value_of_another(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield a word to publish that the title has in another case, or that another criterion's title has alone."""
    value, title = criterion.given.get("value"), str(criterion.data.get("title"))
    words = set(re.findall(r"\w+", title))
    if criterion.check != "field-equals" or not isinstance(value, str) or value in words:
        return
    there = [one for one in rubric.criteria if one.check == "field-equals" and one is not criterion]
    told = [
        one.id for one in there if one.given.get("value") == value and value in str(one.data.get("title"))
    ]
    said = words & {*re.findall(r"\w+", rubric.handout)}
    # Of longer words, the spelling is looked at anyway
    same = next((one for one in sorted(said) if one.lower() == value.lower() and not is_slip(value, one)), "")
    if same:
        yield (*criterion.at, "value"), f"is {value}, and the title has {same}, as the handout"
    elif told:
        yield (
            (*criterion.at, "value"),
            f"{value} is in the title of {told[0]}, and not in this one's",
        )


def _sent_in_another_order(criterion: WrittenCriterion) -> Iterator[Fault]:
    """Yield a first or last value that is asked for, where the title has a number that the run sends, and not first or
    last."""
    when, numbers = criterion.given.get("when"), PLAIN_NUMBER.findall(str(criterion.data.get("title")))
    sent = [
        one for one in published_in(criterion.scenario) if one.get("topic") != criterion.given.get("topic")
    ]
    values = [
        value
        for one in sent
        for value in (*as_list(one.get("values")), one.get("value"))
        if value is not None
    ]
    inside = [{number for _, number in numbers_in((), value)} for value in values]
    if when not in {"first", "last"} or len(numbers) != 1 or len(inside) < 2:
        return
    number, end = float(numbers[0]), inside[0 if when == "first" else -1]
    if any(number in one for one in inside) and len(end) == 1 and number not in end:
        fault = (
            f"the {when} message that {criterion.run} sends has {end.pop():g}, not {number:g} as the title"
        )
        yield (*criterion.at, "when"), fault


def _other_level(criterion: WrittenCriterion, handout: str) -> Iterator[Fault]:
    """Yield the level of a log message for which the title, or the handout's sentence about its text, has another."""
    text, level = f"`{criterion.given.get('text')}`", criterion.given.get("level", "info")
    # The text itself is cut out: it may have a level's name in it, as in `error: no odometry`.
    about = [str(criterion.data.get("title")), *(one for one in SENTENCE_END.split(handout) if text in one)]
    found = {"".join(groups).lower() for one in about for groups in LEVEL.findall(one.replace(text, "`…`"))}
    said = {{"err": "error", "warning": "warn"}.get(one, one) for one in found}
    if len(said) == 1 and level not in said:
        yield (*criterion.at, "level"), f"is {level}, and the rubric's text has {said.pop()}"


def _sent_otherwise(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield types that the handout says otherwise of the topic on which the grader sends, and lines to type that it has
    in another case."""
    handout = rubric.handout
    quoted = sorted({*re.findall(r"`([^`]+)`", handout)})
    lines = {str(one.get("line")) for _, kind, one in rubric.parts() if kind == "type"}
    keys = {text for text in quoted if len(text) == 1}
    # Where keys are typed, a word in place of one of them is another line.
    untyped = keys - lines if len(keys & lines) > 1 else set()
    for path, kind, one in rubric.parts():
        line = str(one.get("line")) if kind == "type" else ""
        other = next(
            (text for text in quoted if text.lower() == line.lower() or line[:1] in untyped & {text}), ""
        )
        if other and line not in quoted:
            yield (*path, "line"), f"the handout has `{other}`"
        if kind in {"call", "serve", "publish"}:
            yield from _other_fields((*path, "definition"), one.get("definition"), handout)
        said = set(said_types(str(one.get("topic")), handout)) if kind == "publish" else set()
        if said and str(one.get("type")) not in said:
            fault = f"the handout says that {one['topic']} carries {join_words(sorted(said))}"
            yield (*path, "type"), fault
        for at, text in texts_in(path, [one.get("value"), one.get("values")]) if kind == "publish" else ():
            other = next((said for said in quoted if said.lower() == text.lower()), "")
            if other and text not in quoted and text != at[-1]:
                yield (*path, "value"), f"has {text}, and the handout `{other}`, in another case"
    services = [(path, one) for path, _, one in rubric.parts() if one.get("service") is not None]
    services += [(one.at, one.given) for one in rubric.criteria if one.check == "service"]
    for path, one in services:
        said = set(said_types(str(one["service"]), handout, of_service=True)) if "service" in one else set()
        if said and str(one.get("type")) not in said:
            yield (
                (*path, "type"),
                f"the handout says that {one['service']} is of type {join_words(sorted(said))}",
            )


def _other_types(at: KeyPath, given: dict[str, Any], handout: str) -> Iterator[Fault]:
    """Yield types of numbers that the handout does not have, where it has another of the same kind and size; and fields
    of a definition that it gives another type."""
    for key in ("text", "definition"):
        yield from _other_fields((*at, key), given.get(key), handout)
    said = {match[0] for match in PRIMITIVE.finditer(handout)}
    if not said:
        return
    asked: list[tuple[KeyPath, object]] = [((*at, "type"), given.get("type"))]
    asked += [((*at, "fields", key), kind) for key, kind in as_map(given.get("fields")).items()]
    asked += [
        ((*at, "topics", key, "type"), as_map(one).get("type"))
        for key, one in as_map(given.get("topics")).items()
    ]
    for path, written in asked:
        plain, bracket, _ = str(written).partition("[")
        kind = OLD_NAMES.get(plain, plain)
        # `float32` is in the handout, and `float32[]` nowhere.
        if bracket and plain in said and not re.search(rf"\b{plain}\b.?\[", handout):
            yield path, f"is a list, and the handout has {plain}"
        is_said = str(kind) in said or ("/" in str(kind) and _plain(kind) in map(_plain, said))
        if PRIMITIVE.fullmatch(str(kind)) and not is_said:
            near = [one for one in sorted(said) if ("/" in one) == ("/" in str(kind))]
            if near:
                yield path, f"the handout has {join_words(near)}, and not {written}"


def _other_fields(path: KeyPath, text: object, handout: str) -> Iterator[Fault]:
    """Yield fields of a definition to which the handout gives another type."""
    for kind, name in FIELD.findall(str(text or "")):
        there = BUILT_IN & {*re.findall(rf"\b(\w+)`? `?{name}\b", handout)}
        if there and kind not in there:
            yield path, f"has {kind} {name}, and the handout {join_words(sorted(there))} {name}"


def _plain(kind: object) -> str:
    return str(kind).rpartition("/")[2].lower()


def _misspelt_keys(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield constants and nodes of which a part is one letter off from a word of the handout or of the run, and that no
    other line has."""
    at, given, handout = criterion.at, criterion.given, rubric.handout
    words = set(re.findall(r"\w+", handout))
    of_run = {word for _, text in texts_in((), criterion.scenario) for word in re.findall(r"\w+", text)}
    texts = [text for _, text in rubric.texts]
    for name, value in as_map(given.get("constants")).items():
        said = re.search(rf"\b{re.escape(str(name))}\b[^\w,.-]{{0,5}}(-?\d+)\b", handout)
        if said and is_number(value) and float(said[1]) != value:
            yield (*at, "constants", name), f"is {value:g}, and the handout has {said[1]}"
    for key in ("constants", "nodes"):
        for name in as_map(given.get(key)):
            for part in filter(None, str(name).split("/")):
                known = (*sorted(words), *sorted(of_run))
                near = next((one for one in known if is_slip(part, one) or one.lower() == part.lower()), "")
                times = sum(len(re.findall(rf"\b{re.escape(part)}\b", text)) for text in texts)
                if part not in words and near and times == 1:
                    where = "the handout" if near in words else "its run"
                    fault = f'{part} is on no other line: did you mean "{near}", as in {where}?'
                    yield (*at, key, name), fault


def _numbers_of_title(criterion: WrittenCriterion, rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield numbers of a criterion's title that neither the criterion nor a run has, where they have others; and a rate
    that is not the title's, or where that has none, the handout's."""
    given, title = criterion.given, str(criterion.data.get("title"))
    # A title's own rate counts before all else, then the handout's sentences about the topic.
    rate_hz, rates = given.get("rate_hz"), _rates(title)
    of_topic = [one.given for one in rubric.criteria if one.given.get("topic") == given.get("topic")]
    known = {one.get("rate_hz") for one in of_topic}
    is_told = "cause" not in given and len(known) > 1  # said of the two criteria
    run = criterion.scenario
    is_told = is_told or rate_hz in _numbers_within([run.get("start"), run.get("params")])  # by a parameter
    sentences = SENTENCE_END.split(rubric.handout)
    about = [one for one in sentences if re.search(rf"{re.escape(str(given.get('topic')))}(?!\w)", one)]
    said_hz = _rates(" ".join(about))
    if not rates and not is_told and "made_up" not in rubric.data and is_number(rate_hz):
        rates = said_hz
    is_first = given is next((one for one in of_topic if "rate_hz" in one), None)
    if "made_up" not in rubric.data and is_first and rate_hz in rates and not said_hz & known:
        rates = said_hz or rates  # the title agrees
    if any(is_number(rate_hz) and round(rate_hz / by, 9) in rates for by in SHIFTS):
        return  # said elsewhere
    causes = [one for one in of_topic if "cause" in one and "rate_hz" in one]
    if 1 < len(causes) == len(said_hz) and known == {rate_hz} and given is causes[-1] and rate_hz in said_hz:
        others = join_words([f"{one:g}" for one in sorted(said_hz - known)])
        yield (*criterion.at, "rate_hz"), f"is {rate_hz:g} for each cause, and the handout has {others}, too"
    if rates and is_number(rate_hz) and rate_hz not in rates:
        said = join_words([f"{one:g}" for one in sorted(rates)])
        where = "title" if _rates(title) - {rate_hz} else "handout"
        yield (*criterion.at, "rate_hz"), f"{rate_hz:g} is not what the {where} has: {said}"
        return
    numbers = [float(one) for one in PLAIN_NUMBER.findall(title)]
    runs = list(rubric.scenarios.values())
    there = _numbers_within([DEFAULTS.get(criterion.check, {}) | given, runs])
    texts = " ".join(text for _, text in texts_in((), [given, runs]))
    is_open = "made_up" in texts or not any(key in given for key in EXPECTED) or "launch" in given
    own = {number for _, number in numbers_in((), given)}
    is_open = is_open or any(round(number * by, 9) in own for number in numbers for by in SHIFTS)
    if len(numbers) == 1 and not rates and not is_open and abs(numbers[0]) not in there:
        yield (*criterion.place, "title"), f"has {numbers[0]:g}, and neither the criterion nor a run has it"


def _numbers_within(value: object) -> set[float]:
    """Return all numbers of a part of the rubric, without their signs, also those within its texts."""
    texts = " ".join(text for _, text in texts_in((), value))
    inside = {float(one) for one in re.findall(r"\d+(?:\.\d+)?", texts)}
    return inside | {abs(number) for _, number in numbers_in((), value)}


def _other_text(criterion: WrittenCriterion, rubric: WrittenRubric, keys: tuple[str, ...]) -> Iterator[Fault]:
    """Yield a text to print or to send that the handout has with other blanks or signs, another case or word."""
    at, given = criterion.at, criterion.given
    said = re.sub(r"\s+", " ", rubric.handout)
    quoted = [one.strip() for one in re.findall(r"`([^`]+)`", said)]
    asked = [one for key in keys for one in texts_in((key,), given.get(key))]
    for key in ("cause", "effect"):
        asked += [one for one in texts_in((key,), given.get(key)) if one[0][-1] == "value"]
    for path, text in asked:
        if not _letters(text) or text == path[-1] or text in said or re.search(_as_pattern(text), said):
            continue
        alike = [one for one in quoted if _letters(one) == _letters(text) or _is_begun(one, text)]
        if len({re.sub(r"\d+", "#", one) for one in [*alike, text]}) == 1 < len(alike):
            continue  # `bowl-1`, `bowl-2` and so on
        alike += [one for one in quoted if sorted(one.lower().split()) == sorted(text.lower().split())]
        others = [one for other in rubric.criteria for _, one in texts_in((), other.given) if one != text]
        others = [one for one in others if not NAME.fullmatch(one)]
        words = [one for one in quoted if _differ_in_a_word(one, text) or _is_part(one, text)]
        words = [one for one in words if not any(re.search(_as_pattern(other), one) for other in others)]
        if alike or words:
            is_same = bool(alike) and alike[0].lower() == text.lower()
            is_order = bool(alike) and _letters(alike[0]) != _letters(text) and not _is_begun(alike[0], text)
            how = "in another order" if is_order else "with other blanks or signs"
            how = "in another case" if is_same else "with another word" if words else how
            yield (*at, *path), f"the handout has `{(words or alike)[0]}`, {how}"


def _as_pattern(text: str) -> str:
    # `{number}` in a template stands for any number that the handout may have as an example.
    return r"[-+]?\d+(?:\.\d+)?".join(map(re.escape, text.split("{number}")))


def _differ_in_a_word(said: str, text: str) -> bool:
    """Return whether two texts are the same but for one word; names alone, as all that is in backticks, are not."""
    one, other = (
        re.findall(r"#|[^\W\d_]+|[^\w\s]", re.sub(r"\{\w+\}|[-+]?\d+(?:\.\d+)?", "#", part))
        for part in (said.lower(), text.lower())
    )
    differing = [pair for pair in zip(one, other, strict=False) if pair[0] != pair[1]]
    is_text = len(one) == len(other) > 1 and len(differing) == 1 and not NAME.fullmatch(said)
    return is_text and all(word.isalpha() for word in differing[0])


def _is_part(said: str, text: str) -> bool:
    """Return whether one of two words is in the other: `bye` and `Goodbye`."""
    short, long = sorted((said.lower(), text.lower()), key=len)
    return len(short) >= PART_MIN and short in long and said.isalpha() and text.isalpha()


PART_MIN = 3


def _is_begun(said: str, text: str) -> bool:
    """Return whether a text begins with the words of one that the handout has, but not with its signs."""
    # A single word begins too many texts to say anything.
    is_longer = len(said.split()) > 1 and bool(_letters(said)) and _letters(text).startswith(_letters(said))
    return is_longer and not re.match(rf"{re.escape(said.strip().lower())}(?!\w)", text.lower())


def _letters(text: str) -> str:
    """Return the letters of a text alone, all small."""
    return "".join(re.findall(r"[^\W\d_]", text.replace("{number}", ""))).lower()
