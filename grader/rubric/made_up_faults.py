"""Faults of the values that a rubric makes up, and of the places in which they stand."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from pydantic import ValidationError

from grader.rubric.made_up import (
    KEY,
    PLACES,
    MadeUp,
    Value,
    given_in,
    is_place,
    made_of,
    names_in,
    place_values,
    places,
)
from grader.rubric.source import Fault, KeyPath, as_map, as_maps, as_texts, dotted
from grader.wording import did_you_mean, join_words

KINDS = ("from", "one_of", "letters", "sum", "product")
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
    declared = _declared(data)
    longest = max((len(one.one_of) for one in declared.values()), default=0)
    samples = []
    for nth in (*range(max(longest, 1)), COUNT_MAX):
        values: dict[str, Value] = {}
        for name, one in declared.items():
            values[name] = one.value(values, lambda count, nth=nth: min(nth, count - 1))  # type: ignore[misc]
        samples.append(place_values(data, values, ("with",)))
    return samples


def of_sample(faults: list[Fault], written: Mapping[str, Any], sample: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield the faults of one sample, with the names of the values that make them. That there is no value is a fault of
    its own."""
    for path, message in faults:
        part = _at(written, path)
        names = join_words(sorted(names_in(part))) if is_place(part) or isinstance(part, str) else ""
        if not is_place(_at(sample, path)):
            yield path, f"{message} (made up: {names})" if names else message


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
        above = {other: made_up for other, made_up in _declared(data).items() if other in {*above, name}}
    used: set[str] = set()
    for path, name in places({key: part for key, part in data.items() if key != KEY}):
        used |= {name, *made_of(name, declared)}
        if name not in declared:
            yield path, f'made_up declares no value "{name}"{did_you_mean(name, declared)}'
        elif not _PLACE.match(dotted(path)):
            yield path, "made-up values stand in scenarios, and in with, hint and reproduce of criteria"
    yield from (
        ((KEY, name), "stands nowhere: remove it, or use it") for name in declared if name not in used
    )
    for index, criterion in as_maps(data.get("criteria")):
        scenario = as_map(as_map(data.get("scenarios")).get(str(criterion.get("scenario"))))
        for path, name in places(criterion.get("with"), ("criteria", index, "with")):
            if name in declared and not given_in(scenario, {name, *made_of(name, declared)}, {}):
                run = criterion.get("scenario") or "a criterion without a scenario"
                yield path, f'{run} gives programs no "{name}": they could not know it'


def _declared(data: Mapping[str, Any]) -> dict[str, MadeUp]:
    """Return what is declared without a fault."""
    found: dict[str, MadeUp] = {}
    for name, one in as_map(data.get(KEY)).items():
        try:
            made_up = MadeUp.model_validate_json(json.dumps(one), strict=True)
        except ValidationError:
            continue
        if not any(_faults_of(as_map(one), found)):
            found[name] = made_up
    return found


def _faults_of(one: dict[str, Any], above: Mapping[str, MadeUp]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the faults of one declaration, each with its key. `above` are the sound ones above it."""
    given = [key for key in KINDS if one.get(key) not in (None, [])]
    if len(given) != 1:
        found = f"{' and '.join(given)} are there" if given else "none is there"
        yield (), f"give one of {', '.join(KINDS[:-1])} and {KINDS[-1]}: {found}"
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
    for _, name in as_texts(one[kind]) if kind in {"sum", "product"} else ():
        if name not in above:
            yield (kind,), f'no value "{name}" is declared above it{did_you_mean(name, above)}'
        elif not above[name].is_number:
            yield (kind,), f'"{name}" is no number'


def _range_faults(one: dict[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
    try:
        made_up = MadeUp.model_validate_json(json.dumps(one), strict=True)
    except ValidationError:
        return  # which says what is wrong
    low, high, step = one["from"], one["to"], made_up.step
    if made_up.count < 2:
        yield ("to",), f"there are no two values from {low:g} to {high:g} in steps of {step:g}"
    elif made_up.count > COUNT_MAX:
        yield ("step",), f"makes {made_up.count} values, at most {COUNT_MAX}"
