"""Values that are made up for each submission: declared once in a rubric, placed wherever it has `{made_up: NAME}`.

    rubric as written, values → plain rubric: what records and judges meets no value that is not there yet

A submission's values follow from its content, so that a program with these numbers in it is another submission, with
other values. The evidence has those that a run was recorded with.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from decimal import Decimal
from random import Random
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import Field, ValidationError

from grader.errors import EvidenceError
from grader.model.record import Record
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenRubric,
    as_map,
    as_maps,
    as_texts,
    dotted,
    give_one,
    items_in,
    starts_of,
)
from grader.wording import did_you_mean, join_words

if TYPE_CHECKING:
    from grader.evidence.run import Run
    from grader.rubric.model import Criterion, Rubric


Value: TypeAlias = bool | int | float | str
KEY = "made_up"
"""The key of a rubric, of a place in it, and of the evidence's metadata."""
PLACES = ("with", "hint", "reproduce")
"""The keys of a criterion in which made-up values may stand."""
# Without vowels no word comes about, and l looks like 1.
CONSONANTS = "bcdfghjkmnpqrstvwxz"
GIVEN = {
    "params": "the parameter {}",
    "set_param": "the parameter {}",
    "probes": "the messages on {}",
    "publish": "the messages on {}",
    "calls": "the request to {}",
    "call": "the request to {}",
    "serves": "the answer of {}",
    "action": "the goal of {}",
    "type": "the standard input of {}",
    "transform": "the transform of {}",
}
"""Parts of a scenario in which a program meets a value, and what a student reads of them."""
NAMED = ("name", "topic", "service", "action", "process", "child")
"""The keys of these parts that name them."""
_IN_TEXT = re.compile(r"\{made_up: ?([\w-]+)\}")
_NEARLY = re.compile(r"\{ ?made[ _-]?up\b", re.IGNORECASE)
_NEARLY_TOO = re.compile(r"\{\{ ?made_up\b|^made_up:? *[\w-]+$")


class MadeUp(Record):
    """A value that is made up for each submission. Give `from` and `to`, `one_of`, `letters`, `sum`, `product`,
    `quotient` or `mean`.

    It replaces `{made_up: NAME}` anywhere in a scenario, or in a criterion's `with`, `hint` or `reproduce`,
    also within a text: `args: ["_rate:={made_up: rate}"]`.
    """

    from_: Annotated[int | float | None, Field(alias="from")] = None
    """The least that it can be. It is a whole number if this and `step` are."""
    to: int | float | None = None
    """The most that it can be."""
    step: Annotated[int | float, Field(gt=0)] = 1
    """The distance between possible values, counted from `from`."""
    one_of: tuple[Value, ...] = ()
    """It is one of these."""
    letters: Annotated[int | None, Field(ge=3, le=40)] = None
    """It is a text of this many letters."""
    sum: tuple[str | int | float, ...] = ()
    """It is the sum of these, numbers and names of values above it: `[a, b]`."""
    product: tuple[str | int | float, ...] = ()
    """It is the product of these: `[rate, 2]`."""
    quotient: Annotated[tuple[str | int | float, ...], Field(max_length=2)] = ()
    """It is the first of these two divided by the second: `[1, rate]`."""
    mean: tuple[str | int | float, ...] = ()
    """It is the mean of these: `[a, b, c]`."""

    @property
    def is_number(self) -> bool:
        """Whether it can be counted with."""
        return self.letters is None and not any(isinstance(value, bool | str) for value in self.one_of)

    @property
    def may_be_zero(self) -> bool:
        """Whether it can be 0, as far as that is known: a range and a choice say it, what follows from others may."""
        if self.from_ is not None:
            # Decimals: 0.1 + 2 * 0.1 is 0.30000000000000004 as floats, and reports would show it so.
            low, step = Decimal(repr(self.from_)), Decimal(repr(self.step))
            return low <= 0 <= low + (self.count - 1) * step and low % step == 0
        return 0 in self.one_of if self.one_of else True

    @property
    def count(self) -> int:
        """How many values a range has."""
        low, high, step = (Decimal(repr(n or 0)) for n in (self.from_, self.to, self.step))
        return max(0, int((high - low) // step) + 1)

    def value(self, above: Mapping[str, Value], choose: Callable[[int], int]) -> Value:
        """Return a value; `choose` gives the place of one of so many, `above` has those that are declared above it."""
        if self.letters is not None:
            return "".join(CONSONANTS[choose(len(CONSONANTS))] for _ in range(self.letters))
        if self.one_of:
            return self.one_of[choose(len(self.one_of))]
        if self.from_ is not None:
            return _number(Decimal(repr(self.from_)) + choose(self.count) * Decimal(repr(self.step)))
        kind = next(kind for kind in COUNTED if getattr(self, kind))
        parts = [above[p] if isinstance(p, str) else p for p in getattr(self, kind)]
        return _number(COUNTED[kind]([Decimal(repr(part)) for part in parts]))


COUNTED: Mapping[str, Callable[[list[Decimal]], Decimal]] = {
    "sum": lambda parts: sum(parts, Decimal(0)),
    "product": lambda parts: math.prod(parts, start=Decimal(1)),
    "quotient": lambda parts: parts[0] / parts[1],
    "mean": lambda parts: sum(parts, Decimal(0)) / len(parts),
}
"""What follows from other values, and how."""


def _number(exact: Decimal) -> int | float:
    """Return a number as Python's own: a whole one only if it was made of whole numbers (`1.0` stays a decimal)."""
    exponent = exact.as_tuple().exponent
    return int(exact) if isinstance(exponent, int) and exponent >= 0 else float(exact)


# --- Values -----------------------------------------------------------------------------------------------------------


def draw_values(rubric: Rubric, digest: str) -> dict[str, Value]:
    """Return the values of the submission whose content has this digest; they stay when the rubric's words change."""
    values: dict[str, Value] = {}
    for name, one in rubric.made_up.items():
        # Seeded by name: a value that is added to the rubric leaves the others as they are.
        seeded = Random(f"{rubric.id} {name} {digest}")  # noqa: S311 - to be the same on every machine
        values[name] = one.value(values, seeded.randrange)
    return values


def with_values(rubric: Rubric, values: Mapping[str, Value]) -> Rubric:
    """Return the rubric with these values in their places. Raises ValidationError where one does not fit there."""
    if not rubric.made_up:
        return rubric
    placed = type(rubric).from_data(place_values(rubric.written, values))
    criteria = {c.id: c.model_dump(include={"parameters", "hint", "reproduce"}) for c in placed.criteria}
    update = {
        "scenarios": {name: placed.scenarios[name] for name in rubric.scenarios},
        "criteria": tuple(c.model_copy(update=criteria[c.id]) for c in rubric.criteria),
    }
    return rubric.model_copy(update=update).remember(rubric.written, values)


def with_recorded_values(rubric: Rubric, runs: Mapping[str, Run]) -> Rubric:
    """Return the rubric with the values that the runs were recorded with. Raises EvidenceError where they do not fit.

    A value that was declared since is drawn.
    """
    if not rubric.made_up:
        return rubric
    recorded = [run.metadata for run in runs.values()]
    digest = next((one["submission.digest"] for one in recorded if one.get("submission.digest")), "")
    values = draw_values(rubric, digest)
    try:
        for known in (json.loads(one[KEY]) for one in recorded if one.get(KEY)):
            # Values that the rubric no longer declares have no place in it.
            values |= {name: value for name, value in known.items() if name in values}
        return with_values(rubric, values)
    except (ValueError, AttributeError) as error:  # no JSON, no map, no value that fits
        message = "the values that were made up for this run do not fit the rubric"
        raise EvidenceError(message, hint="grade the submission again") from error


def values_of(rubric: Rubric, criterion: Criterion) -> dict[str, Value]:
    """Return the values that a criterion is judged by: its own, and those of its run."""
    if not rubric.values:
        return {}
    written, scenario = _written_criterion(rubric, criterion)
    names = names_in([scenario, *(written.get(key) for key in PLACES)])
    return {name: value for name, value in rubric.values.items() if name in names}


def tell_made_up(rubric: Rubric, criterion: Criterion, hint: str, seen: str) -> str:
    """Return a hint in which made-up values that the criterion asks for have their names, so that no one writes them
    into the code, with where the run gives them. What was `seen` the program has got, and needs no words."""
    if not rubric.values:
        return hint
    written, scenario = _written_criterion(rubric, criterion)
    told = []
    for name in sorted(names_in(written.get("with"))):
        value = _as_shown(rubric.values[name])
        written_as = "|".join(map(re.escape, (as_text(rubric.values[name]), value)))
        # As a whole number or word, and not where it is the number of a line.
        of_value = re.compile(rf"(?<![\w.:-])(?<!line )(?:{written_as})(?!\w|\.\d)")
        if of_value.search(seen):
            continue
        hint = of_value.sub(f"<{name}>", hint)
        parts = set(operands_of(name, as_map(rubric.written.get(KEY))))
        comes = "follows from" if parts else "comes with"
        found = join_words(inputs_with_values(scenario, {name, *parts}, rubric.values))
        told.append(f"<{name}> is made up for each submission, {value} here, and {comes} {found}")
    return "; ".join(filter(None, (hint, *told)))


def _written_criterion(rubric: Rubric, criterion: Criterion) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a criterion and its scenario as the rubric has them."""
    criteria = (one for _, one in as_maps(rubric.written.get("criteria")))
    own: dict[str, Any] = next((one for one in criteria if one.get("id") == criterion.id), {})
    return own, as_map(as_map(rubric.written.get("scenarios")).get(criterion.scenario or ""))


# --- Places -----------------------------------------------------------------------------------------------------------


def place_values(
    written: Mapping[str, Any], values: Mapping[str, Value], keys: Iterable[str] = PLACES
) -> dict[str, Any]:
    """Return a rubric's data with the values in its scenarios, and in these `keys` of its criteria."""
    placed = {key: place(part, values) if key == "scenarios" else part for key, part in written.items()}
    for index, criterion in as_maps(written.get("criteria")):
        own = {key: place(part, values) if key in keys else part for key, part in criterion.items()}
        placed["criteria"] = [*placed["criteria"][:index], own, *placed["criteria"][index + 1 :]]
    return placed


def place(part: Any, values: Mapping[str, Value]) -> Any:  # noqa: ANN401 - any part of a rubric
    """Return a part of a rubric's data with the values in their places; others stay as they are written."""
    if is_place(part):
        return values.get(part[KEY], part)
    if isinstance(part, dict):
        return {place(key, values): place(value, values) for key, value in part.items()}
    if isinstance(part, list):
        return [place(value, values) for value in part]
    if isinstance(part, str):
        return _IN_TEXT.sub(lambda found: as_text(values.get(found[1], found[0])), part)
    return part


def is_place(part: object) -> bool:
    """Return whether a made-up value stands there."""
    return isinstance(part, dict) and part.keys() == {KEY} and isinstance(part[KEY], str)


def _as_shown(value: Value) -> str:
    """Return a value as verdicts have it: seven digits of `2.3333333333333335`."""
    return f"{value:.7g}" if isinstance(value, float) else as_text(value)


def as_text(value: Value) -> str:
    """Return a value as it stands in a text: `14`, `0.5`, `true`."""
    return value if isinstance(value, str) else json.dumps(value)


def places(part: object, path: KeyPath = ()) -> Iterator[tuple[KeyPath, str]]:
    """Yield where made-up values stand in a part of a rubric's data, and their names."""
    if isinstance(part, dict) and is_place(part):
        yield path, part[KEY]
        return
    if isinstance(part, str):
        yield from ((path, name) for name in _IN_TEXT.findall(part))
    for key, value in items_in(part):
        yield from ((path, name) for name in _IN_TEXT.findall(str(key)))
        yield from places(value, (*path, key))


def names_in(part: object) -> set[str]:
    """Return the names of the values that stand in a part of a rubric's data."""
    return {name for _, name in places(part)}


def operands_of(name: str, declared: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of the values that a value follows from."""
    above: dict[str, Any] = {}
    for other, one in declared.items():
        if other == name:
            parts = [part for key in COUNTED for _, part in as_texts(as_map(one).get(key))]
            yield from (found for part in parts for found in (part, *operands_of(part, above)))
        above[other] = one


def inputs_with_values(
    scenario: Mapping[str, Any], names: set[str], values: Mapping[str, Value]
) -> list[str]:
    """Return where a scenario, as it is written, gives programs one of these values."""
    parts = [(key, part) for key in GIVEN for _, part in as_maps(scenario.get(key))]
    for _, step in as_maps(scenario.get("steps")):
        parts += [(kind, as_map(part)) for kind, part in step.items() if kind in GIVEN]
    found = [
        GIVEN[kind].format(place(next((part[key] for key in NAMED if key in part), ""), values))
        for kind, part in parts
        if names & names_in(part)
    ]
    for start in starts_of(scenario):
        args = [arg for _, arg in as_texts(start.get("args")) if names & names_in(arg)]
        found += [f"the argument {place(arg, values)}" for arg in args]
    return list(dict.fromkeys(found))


KINDS = ("from", "one_of", "letters", *COUNTED)
COUNT_MAX = 10**9
_PLACE = re.compile(
    r"scenarios\.[^.]*\.(?!title$|recording$|start\[\d+\]\.tests$|steps\[\d+\]\.play\.bag$)"
    rf"|criteria\[\d+\]\.(?:{'|'.join(PLACES)})\b"
)
"""Where they may stand: not in what people read of a lab, nor in names of files beside the rubric."""


def sample_data(data: Any) -> list[Any]:  # noqa: ANN401 - what a file holds
    """Return a rubric's data with the least and the most of each value, and all that one can be chosen from, in its
    places. The words of criteria stay as they are written, and so does what is declared with a fault."""
    if not isinstance(data, dict) or KEY not in data:
        return [data]
    declared = _declared_values(data)
    longest = max((len(one.one_of) for one in declared.values()), default=0)
    samples = []
    # The least of each, then each choice, then the most: `min` below keeps the number in range.
    for nth in (*range(max(longest, 1)), COUNT_MAX):
        values: dict[str, Value] = {}
        for name, one in declared.items():
            values[name] = one.value(values, lambda count, nth=nth: min(nth, count - 1))  # type: ignore[misc]
        samples.append(place_values(data, values, ("with",)))
    return samples


def faults_of_sample(
    faults: list[Fault], written: Mapping[str, Any], sample: Mapping[str, Any]
) -> Iterator[Fault]:
    """Yield the faults of one sample, with the names of the values that make them. That there is no value is a fault of
    its own."""
    for path, message in faults:
        part = _at(written, path)
        names = join_words(sorted(names_in(part))) if is_place(part) or isinstance(part, str) else ""
        placed = _at(sample, path)
        if not is_place(placed):
            yield path, f"{message} (made up: {names})" if names else message
        elif set(names_in(placed)) <= as_map(written.get(KEY)).keys():
            yield path, f'is text, which may have values in it: write "{{{KEY}: {names}}}" in quotes'


def _at(data: Any, path: KeyPath) -> Any:  # noqa: ANN401 - any part of a rubric
    with suppress(KeyError, IndexError, TypeError):
        for key in path:
            data = data[key]
        return data
    return None


def made_up_faults(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with the values that a rubric declares, and with their places."""
    declared = as_map(data.get(KEY))
    above: dict[str, MadeUp] = {}
    for name, one in declared.items():
        yield from (((KEY, name, *at), fault) for at, fault in _faults_of(as_map(one), above))
        above = {
            other: made_up for other, made_up in _declared_values(data).items() if other in {*above, name}
        }
    used: set[str] = set()
    others = {key: part for key, part in data.items() if key != KEY}
    criteria = {criterion.at: criterion for criterion in WrittenRubric(data).criteria}
    for path, name in places(others):
        names = {name, *operands_of(name, declared)}
        used |= names
        criterion = criteria.get(path[:3])
        if name not in declared:
            yield path, f'made_up declares no value "{name}"{did_you_mean(name, declared)}'
        elif not _PLACE.match(dotted(path)):
            yield path, "made-up values belong in scenarios, and in with, hint and reproduce of criteria"
        elif criterion and not inputs_with_values(criterion.scenario, names, {}):
            run = criterion.data.get("scenario") or "a criterion without a scenario"
            yield path, f'{run} gives programs no "{name}": they could not know it'
    yield from _no_names(others, ())
    for place, start in WrittenRubric(data).starts():
        for number, text in as_texts(start.get("args")):
            name, _, value = text.partition(":=")
            if value in declared and re.match(r"_[A-Za-z]", name):
                yield (
                    (*place, "args", number),
                    f'"{value}" is the name of a made-up value: write {name}:={{made_up: {value}}}',
                )
    yield from (
        ((KEY, name), "is used nowhere: remove it, or use it") for name in declared if name not in used
    )


def _no_names(part: object, path: KeyPath) -> Iterator[Fault]:
    """Yield places of made-up values that have no name."""
    if isinstance(part, dict) and part.keys() == {KEY} and not isinstance(part[KEY], str):
        yield (*path, KEY), "takes the name of one value: {made_up: rate}"
    elif isinstance(part, str) and (_NEARLY.search(_IN_TEXT.sub("", part)) or _NEARLY_TOO.search(part)):
        yield path, "a made-up value is written {made_up: rate}, with its own name"
    else:
        for key, inner in items_in(part):
            yield from _no_names(f"{{{key}" if inner is None else inner, (*path, key))


def _declared_values(data: Mapping[str, Any]) -> dict[str, MadeUp]:
    """Return what is declared without a fault."""
    found: dict[str, MadeUp] = {}
    for name, one in as_map(data.get(KEY)).items():
        try:
            made_up = MadeUp.from_data(one)
        except ValidationError:
            continue
        if not any(_faults_of(as_map(one), found)):
            found[name] = made_up
    return found


def _faults_of(one: dict[str, Any], above: Mapping[str, MadeUp]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the faults of one declaration, each with its key. `above` are the sound ones above it."""
    given = [key for key in KINDS if one.get(key) not in (None, [])]
    if len(given) != 1:
        yield (), give_one(KINDS, given)
        return
    (kind,) = given
    if kind != "from":
        yield from (((key,), "is for a range, which has from") for key in ("to", "step") if key in one)
    elif one.get("to") is None:
        yield ("to",), "is missing"
    else:
        yield from _range_faults(one)
    if kind == "one_of" and isinstance(one[kind], list) and len({json.dumps(v) for v in one[kind]}) < 2:
        yield (kind,), "needs two different values"
    parts = one[kind] if kind in COUNTED and isinstance(one[kind], list) else []
    for _, name in as_texts(parts):
        if name not in above:
            yield (kind,), f'no value "{name}" is declared above it{did_you_mean(name, above)}'
        elif not above[name].is_number:
            yield (kind,), f'"{name}" is not a number'
    if kind == "quotient":
        yield from (((kind,), fault) for fault in _division_faults(parts, above))


def _division_faults(parts: list[Any], above: Mapping[str, MadeUp]) -> Iterator[str]:
    if len(parts) != 2:
        yield f"needs two numbers, the one and what it is divided by: {len(parts)} are there"
    elif isinstance(parts[1], str):
        if parts[1] in above and above[parts[1]].may_be_zero:
            yield f'"{parts[1]}" may be 0: divide by a number, or a value with from or one_of that is never 0'
    elif parts[1] == 0:
        yield "divides by 0"


def _range_faults(one: dict[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
    try:
        made_up = MadeUp.from_data(one)
    except ValidationError:
        return  # which says what is wrong
    low, high, step = one["from"], one["to"], made_up.step
    if made_up.count < 2:
        yield ("to",), f"there are no two values from {low:g} to {high:g} in steps of {step:g}"
    elif made_up.count > COUNT_MAX:
        yield ("step",), f"makes {made_up.count} values, at most {COUNT_MAX}"
