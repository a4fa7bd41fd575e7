"""Names in a rubric that nothing else in it knows, or that are all but one that it has: topics, types, nodes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from grader.checks.registry import Check
from grader.checks.support.topics import READ_TOO, SYSTEM_TOPICS
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_map,
    as_maps,
    as_texts,
    set_in,
    starts_of,
)
from grader.wording import closest, join_words

LIKELY, SURE = 0.6, 0.85
"""How alike two names have to be: to be suggested, and to be taken for one with a slip."""
_DIGITS = re.compile(r"\d+")
_TOPIC = re.compile(r"(?:^|:=)(/[\w/]*\w)")


def unknown_names(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield a fault for each of them."""
    yield from _unknown_topics(rubric, checks)
    yield from _unknown_causes(rubric, checks)
    yield from _misspelt_nodes(rubric)
    yield from _own_types(rubric)
    yield from _misspelt_scripts(rubric)


def _unknown_topics(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield topics that a run waits for and that nothing else knows.

    Programs, launch files and checks of the instructor's own may know others: then only a near miss is a fault.
    """
    named = {topic for criterion in rubric.criteria for topic in topics_in(criterion.given)}
    named |= {topic for criterion in rubric.criteria for topic in READ_TOO.get(criterion.check, ())}
    found = [checks.get(criterion.check) for criterion in rubric.criteria]
    own = any(check is None or check.source or "evidence" in check.facts for check in found)
    for name, scenario in rubric.scenarios.items():
        until = as_map(scenario.get("until"))
        known = {*named, *SYSTEM_TOPICS}
        known |= {t for key, part in scenario.items() if key != "until" for t in topics_in(part)}
        open_ = own or any(start.get("script") is None for start in starts_of(scenario))
        for at, topic in _waited_for(until):
            near = _near(topic, named, cutoff=SURE if open_ else LIKELY)
            if topic.startswith("/") and topic not in known and (near or not open_):
                meant = f' (did you mean "{near}"?)' if near else ""
                yield ("scenarios", name, "until", *at), f"no criterion and no probe names {topic}{meant}"
        steps = [step for _, step in as_maps(scenario.get("steps")) if "wait" not in step]
        there = {*named, *topics_in(steps)}
        for at, topic in _waits_in_steps(scenario):
            near = "" if topic in there else _near(topic, named, cutoff=SURE)
            if near:
                yield ("scenarios", name, *at), f'no criterion names {topic} (did you mean "{near}"?)'


def _unknown_causes(rubric: WrittenRubric, checks: Mapping[str, Check]) -> Iterator[Fault]:
    """Yield causes on topics that nothing in the scenario sends on, and that no other criterion names."""
    for criterion, others in with_other_topics(rubric):
        check, name, scenario = checks.get(criterion.check), criterion.run, criterion.scenario
        sent = {*SYSTEM_TOPICS, *topics_in(scenario), *_of_actions(scenario)}
        open_ = any(start.get("script") is None for start in starts_of(scenario)) or "recording" in scenario
        for one in check.references(criterion.given) if check else ():
            at = one.path if isinstance(one.value, str) else (*one.path, "topic")
            topic = one.value if isinstance(one.value, str) else as_map(one.value).get("topic")
            if one.to not in {"cause", "heard"} or not isinstance(topic, str) or topic in sent | others:
                continue
            near = _near(topic, sent, cutoff=SURE if open_ else LIKELY)
            if near or not open_:
                meant = f' (did you mean "{near}"?)' if near else ""
                fault = f"nothing in {name} sends on {topic}, and no other criterion names it{meant}"
                yield (*criterion.at, *at), fault


def _of_actions(scenario: dict[str, Any]) -> Iterator[str]:
    """Yield the topics of the actions that the grader offers or asks: `/dock/goal`, `/dock/cancel`, …"""
    offered = [one.get("action") for _, one in as_maps(scenario.get("serves"))]
    asked = [as_map(step.get("action")).get("name") for _, step in as_maps(scenario.get("steps"))]
    for name in filter(None, (*offered, *asked)):
        yield from (f"{name}/{part}" for part in ("goal", "cancel", "status", "feedback", "result"))


def _own_types(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield types of the student's package that are all but one whose file a criterion asks for."""
    own, told = rubric.packages, {*re.findall(r"\w+", rubric.handout)}
    defined = {
        (str(c.data.get("package") or next(iter(own), "")), PurePosixPath(str(c.given.get("file"))).stem)
        for c in rubric.criteria
        if c.check == "definition"
    }
    names = {stem for _, stem in defined}
    typed = [(criterion.at, criterion.given) for criterion in rubric.criteria]
    typed += [((*at, key), as_map(step[key])) for at, step in rubric.steps() for key in step]
    for path, given in typed:
        kind = given.get("type")
        package, _, name = kind.partition("/") if isinstance(kind, str) else ("", "", "")
        near = closest(name, names, cutoff=SURE) if package in own and name not in names | told else ""
        places = {judged for judged, stem in defined if stem == name}
        if package in own and places and package not in places:
            fault = f"a criterion looks for {name} in {join_words(sorted(places))}, and this is {kind}"
            yield (*path, "type"), f"{fault}: give the criterion package: {package}"
        if near:
            fault = f'no criterion asks for {name} (did you mean "{package}/{near}"?)'
            yield (*path, "type"), f"{fault}: if it is right, say it in the handout too"


def _misspelt_scripts(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield scripts that nothing starts, and that are all but one that is started and that no criterion names."""
    paths = {c.at: c.given.get("path") for c in rubric.criteria if c.check == "executable"}
    named = {at: PurePosixPath(path).name for at, path in paths.items() if isinstance(path, str)}
    scripts = values_of([start for _, start in rubric.starts()], "script")
    started = {PurePosixPath(script).name for script in scripts}
    for at, name in named.items():
        near = "" if name in started else _near(name, started - {*named.values()}, cutoff=SURE)
        if near:
            yield (*at, "path"), f'no scenario starts {name} (did you mean "{near}"?)'


def _misspelt_nodes(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield private parameters of a node whose name is all but one that a criterion asks for."""
    asked: dict[str, set[str]] = {}
    for criterion in rubric.criteria:
        names = as_texts(criterion.given.get("names"))
        asked.setdefault(criterion.run, set()).update(n.strip("/") for _, n in names)
    for name, scenario in rubric.scenarios.items():
        programs = values_of(starts_of(scenario), "program")
        asked.setdefault(name, set()).update(program.rpartition("/")[2] for program in programs)
        for at, one in set_in(scenario):
            node, _, private = str(one.get("name", "")).strip("/").partition("/")
            nodes = asked.get(name, set())
            near = _near(node, nodes, cutoff=SURE) if private and node not in nodes else ""
            if near:
                fault = f'the node is called {near}, and not {node} (did you mean "/{near}/{private}"?)'
                yield ("scenarios", name, *at, "name"), fault


def _waits_in_steps(scenario: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    for index, step in as_maps(scenario.get("steps")):
        topic = as_map(step.get("wait")).get("topic")
        if isinstance(topic, str):
            yield ("steps", index, "wait", "topic"), topic


def _waited_for(until: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    for key in ("topics", "connected"):
        yield from (((key, index), topic) for index, topic in as_texts(until.get(key)))
    yield from ((("messages", topic), topic) for topic in as_map(until.get("messages")))


def with_other_topics(rubric: WrittenRubric) -> Iterator[tuple[WrittenCriterion, set[str]]]:
    """Yield each criterion, and the topics that the others name."""
    named = [set(topics_in(criterion.given)) for criterion in rubric.criteria]
    for place, criterion in enumerate(rubric.criteria):
        yield criterion, set().union(*named[:place], *named[place + 1 :])


def topics_in(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield from _TOPIC.findall(value)
    elif isinstance(value, Mapping):
        yield from (topic for key, item in value.items() for topic in (*topics_in(key), *topics_in(item)))
    elif isinstance(value, list | tuple):
        yield from (topic for item in value for topic in topics_in(item))


def _near(topic: str, named: Iterable[str], *, cutoff: float) -> str:
    """Return the topic most like it. `/turtle1/pose` and `/turtle2/pose` are two, and not one with a slip."""
    plain = _DIGITS.sub("", topic)
    return closest(topic, [name for name in named if _DIGITS.sub("", name) != plain], cutoff=cutoff)


def values_of(starts: list[dict[str, Any]], key: str) -> list[str]:
    return [start[key] for start in starts if isinstance(start.get(key), str)]
