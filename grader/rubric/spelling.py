"""Names in a rubric that one line alone has, and topics, types and nodes that nothing else in it knows: those that may
be a slip, and those that surely are one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

from grader.checks.registry import Check
from grader.checks.support.recorder_losses import READ_TOO
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.installable import noetic_messages
from grader.rubric.message_fields import type_judged, types_of
from grader.rubric.simulators import TRUE_POSE
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenCriterion,
    WrittenRubric,
    as_map,
    as_maps,
    as_texts,
    given_steps,
    set_in,
    starts_of,
    topics_in,
)
from grader.wording import closest, is_one_edit, join_words

ONE_NAME = re.compile(
    r"/[A-Za-z][\w/]*|[\w./-]*\.(?:py|cpp|launch|ya?ml|csv|txt|bag|pgm|urdf|srv|msg|action|xml)"
)
"""A topic, a service, a node or a parameter, and a file of the student's."""
PLAIN_NAMES = {
    "script", "parent", "child", "publisher", "subscriber", "frame_id", "child_frame_id", "names", "opened", "columns",
    "launch", "folders", "path",
}  # fmt: skip
"""Keys of names that have neither a slash nor a known ending: programs, nodes, frames, columns and folders; or of lists
of them."""
WORDS = {"text", "template", "value", "values"}
"""Keys of texts that students have to write as the handout has them; or of lists of them."""
FIELDS = {"result", "expect", "request", "goal", "answer", "feedback"}
"""Keys of maps from fields to values."""
USUAL_FRAMES = {"map", "odom", "base_link", "base_footprint", "base_scan", "laser", "world"}
"""Frames of REP 105, and those of TurtleBot3 and Stage: right on one line alone, unless the handout has others of
them."""
POSES = {"robot_world": TRUE_POSE, "turtlesim_node": "/turtle1/pose"}
"""By the program that publishes them."""
# Letters first, and two of them at least.
_WORD = r"[^\W\d]\w+"
CHARS_MIN = 3
"""Of names of so few letters, one that differs in a letter is another name."""
PROSE = {"title", "handout", "hint", "reproduce"}
FREE_TEXTS = {*FIELDS, "line", "definition", "answers"}
"""Keys of other texts in which a blank may be meant."""


def _blank_ends(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield names with a blank before or after them, which no name has and nobody sees."""
    free = {*PROSE, *WORDS, *FREE_TEXTS}
    for path, text in rubric.texts:
        is_free = not free.isdisjoint(path) or path[:1] == ("made_up",)
        if text != text.strip() and text.strip() and not is_free and "\n" not in text:
            yield path, f'has a blank before or after it: write "{text.strip()}"'


def names_seen_once(rubric: WrittenRubric, folder: Path) -> Iterator[Fault]:
    """Yield the names that one line alone has, and no file in the rubric's folder. Such a name may be right, or a slip
    that no other line shows."""
    for path, text, near in _named_once(rubric, folder):
        if not near:
            yield path, f"nothing else in the rubric names {text}: is it spelt as in the handout?"
    for path, text, said in _without_number(rubric):
        yield path, f"nothing else in the rubric names {text}: is it {said}, as in the handout?"
    for path, word, near in _misspelt_words(rubric, code=False):
        fault = f'nothing else in the rubric has the word {word}: did you mean "{near}", as in the handout?'
        yield path, fault
    for path, word, near in _misspelt_words(rubric, code=True, part="scenarios"):
        yield path, f"nothing else in the rubric has the word {word}: is `{near}` meant, as in the handout?"


def misspelt_names(rubric: WrittenRubric, folder: Path) -> Iterator[Fault]:
    """Yield those of them that are one letter off from a name that other lines have, and words of texts that are one
    letter off from one that the handout has in backticks; and names with a blank at an end."""
    yield from _blank_ends(rubric)
    for path, text, near in (
        *_named_once(rubric, folder),
        *_misspelt_words(rubric, code=True),
        *_package(rubric),
    ):
        if near:
            fault = f'nothing else in the rubric names {text} (did you mean "{near}"?): '
            yield path, fault + "if it is right, say it in the handout too"


def _without_number(rubric: WrittenRubric) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield each topic or service that one line alone has, and the handout with a number in it: `/turtle/cmd_vel`."""
    said = {one.lstrip("~/") for one in re.findall(r"[~/\w]*/[\w/]*\w", rubric.handout)}
    for path, text in rubric.texts:
        name = text.lstrip("/")
        if (
            text[:1] != "/"
            or "/" not in name
            or not PROSE.isdisjoint(path)
            or name in said
            or re.search(r"\d", name)
        ):
            continue
        numbered = [one for one in sorted(said) if one != name and re.sub(r"\d", "", one) == name]
        if len(numbered) == 1 and _count(text, text, rubric.texts) == 1:
            yield path, text, f"/{numbered[0]}"


def _package(rubric: WrittenRubric) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield the package's name where it is one letter off from the lab's id, or from a word of the handout or title."""
    package, prose = rubric.data.get("package"), f"{rubric.handout} {rubric.data.get('title')}"
    known = dict.fromkeys([str(rubric.data.get("id")).replace("-", "_"), *re.findall(r"\w+", prose)])
    typed = any(text.startswith(f"{package}/") for path, text in rubric.texts if path[-1] == "type")
    if isinstance(package, str) and not typed and not re.search(rf"\b{re.escape(package)}\b", prose):
        near = next((one for one in known if is_slip(package, one)), "")
        if near and package not in known:
            yield ("package",), package, near


def _misspelt_words(
    rubric: WrittenRubric, *, code: bool, part: str = "criteria"
) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield each word of a criterion's texts, or of those that a scenario sends, that no other line has, and the
    handout's word that is meant by it: one in backticks, or with `code=False` any other."""
    handout = rubric.handout
    quoted = set(re.findall(_WORD, " ".join(re.findall(r"`([^`]+)`", handout))))
    known = quoted if code else set(re.findall(_WORD, handout)) - quoted
    for path, text in rubric.texts:
        if path[0] != part or _key(path) not in WORDS or text == path[-1]:
            continue
        hint = rubric.data["criteria"][path[1]].get("hint") if part == "criteria" else ""
        hints = re.findall(r"\"([^\"]+)\"|`([^`]+)`", str(hint or ""))
        hinted = set(re.findall(_WORD, " ".join(map(" ".join, hints)))) if code else set[str]()
        # No placeholders of templates: `{number}`.
        for word in re.findall(rf"(?<![{{\w]){_WORD}(?![\w}}])", text):
            near_ones = [one for one in sorted(known | hinted) if is_slip(word, one)]
            near = next(iter(sorted(near_ones, key=lambda one: one.lower() != word.lower())), "")
            # A word that is there twice was meant.
            if near and _count(word, word, rubric.texts) == 1:
                yield path, word, near


def _named_once(rubric: WrittenRubric, folder: Path) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield each name that one line alone has, and the name that is meant by it, "" where none is known."""
    texts, handout = rubric.texts, rubric.handout
    programs = {text.rpartition("/")[2] for path, text in texts if path[-1] == "program"}
    plain = [one for one in texts if PROSE.isdisjoint(one[0])]
    names = [(path, text, last) for path, text in plain if (last := _last_word(path, text, rubric))]
    actions = {text for path, text in texts if path[-1] == "action"}
    frames = USUAL_FRAMES & {*re.findall(r"\w+", handout)} or USUAL_FRAMES
    poses = {POSES[program] for program in programs & POSES.keys()}
    known_ones = {*SYSTEM_TOPICS, *frames, *poses}
    words = {word for _, text in plain for word in re.findall(r"\w+", text)}
    topics = sorted(other for _, other, _ in names if other.startswith("/"))
    for path, text, last in names:
        if text.rpartition("/")[0] in actions:  # `/dock/cancel`
            continue
        # A file beside the rubric, or a known program's name, is no slip though nothing else names it.
        if text in known_ones or (folder / text).is_file() or not programs.isdisjoint(text.split("/")):
            continue
        if _count(last, text, texts) == 1:
            word, known = (text, topics) if text.startswith("/") else (last, sorted(words))
            alike = [one for one in known if is_slip(word, one) and _count(one, one, texts) > 1]
            alike += [one for one in re.findall(r"`[/~]?(\w+)`", handout) if is_slip(last, one)]
            if text.startswith("/"):
                alike += [one for one in re.findall(r"(?<![\w/])/[\w/]*\w", handout) if is_slip(text, one)]
            yield path, text, next(iter(alike), "")
        # The last word is there more than once, and the whole name is not: a folder or namespace may be the slip.
        elif re.search(r"[/.]", text) and _count(text, text, texts) == 1:
            whole = _in_namespace(path, text, names)
            if whole and not re.search(rf"(?<![\w~]){text}(?!\w)", handout):
                yield path, text, whole
                continue
            known = [other for _, other, _ in names if _is_slip_in_path(text, other, texts)]
            yield from ((path, text, one) for one in known[:1])


def _in_namespace(path: KeyPath, text: str, names: list[tuple[KeyPath, str, str]]) -> str:
    """Return the one name of the same scenario or of all criteria that has a namespace besides; "" for none."""
    if "/" in text[1:]:
        return ""
    found = {other for at, other, _ in names if at != path and other.startswith("/") and other.endswith(text)}
    return found.pop() if len(found) == 1 else ""


def _count(word: str, name: str, texts: list[tuple[KeyPath, str]]) -> int:
    """Return how often a word is there. `steps` is a word of prose too, `/steps` and `set_steps` are not."""
    end = rf"{re.escape(word)}(?!\w)"
    whole = re.compile(rf"(?<!\w){end}")
    # With its slash, or in backticks: the bare word in a sentence is no mention of the topic.
    is_plain = name.startswith("/") and not word.startswith("/") and word.isalpha()
    in_prose = re.compile(rf"[/~`_]{end}") if is_plain else whole
    there = ((whole if PROSE.isdisjoint(at) else in_prose, one) for at, one in texts if word in one)
    return sum(len(pattern.findall(one)) for pattern, one in there)


def is_slip(word: str, other: str) -> bool:
    """Return whether a word is one letter off from another: `talker2` is not, and words of two letters are none."""
    plain, other_plain = re.sub(r"\d", "", word), re.sub(r"\d", "", other)
    return (
        plain != other_plain
        and min(len(word), len(other)) >= CHARS_MIN
        and max(len(word), len(other)) > CHARS_MIN
        and is_one_edit(word, other)
    )


def _is_slip_in_path(name: str, other: str, texts: list[tuple[KeyPath, str]]) -> bool:
    """Return whether one part of a name with slashes is one letter off. The last part has to be the same, or the other
    name to be there more than once."""
    parts, others = re.split("[/.]", name), re.split("[/.]", other)
    differing = [pair for pair in zip(parts, others, strict=False) if pair[0] != pair[1]]
    if len(parts) != len(others) or len(differing) != 1 or not is_slip(*differing[0]):
        return False
    return name.rpartition("/")[2] == other.rpartition("/")[2] or _count(other, other, texts) > 1


def _last_word(path: KeyPath, text: str, rubric: WrittenRubric) -> str:
    """Return the part of a name by which others would know it; "" for a text that is not a name of the student's."""
    if ONE_NAME.fullmatch(text) or (_key(path) in PLAIN_NAMES and text != path[-1]):
        return PurePosixPath(text).stem
    is_value = len(path) == 4 and path[-2:] == ("with", "value")
    if is_value and str(_judged(path, rubric).get("field")).endswith("frame_id"):
        return text
    is_field = text == path[-1] and not FIELDS.isdisjoint(path[2:-1]) and not _is_known_field(path, rubric)
    is_own = text != path[-1] and _is_own_field(path, rubric)
    return text.rpartition(".")[2].partition("[")[0] if is_field or is_own else ""


def _key(path: KeyPath) -> object:
    """Return the key that a text is the value of, or one of the values."""
    return next((part for part in reversed(path) if not isinstance(part, int)), "")


def _is_known_field(path: KeyPath, rubric: WrittenRubric) -> bool:
    """Return whether a field is of a type that neither students nor the course write: that is looked up elsewhere."""
    about: Any = rubric.data
    kinds = list[str]()
    for key in path[:-1]:
        about = about[key]
        if isinstance(about, dict):
            kinds.append(
                type_judged(about, rubric) if path[0] == "criteria" else str(about.get("type") or "")
            )
    return any(kind and kind.partition("/")[0] not in rubric.own_packages for kind in kinds)


def _judged(path: KeyPath, rubric: WrittenRubric) -> dict[str, Any]:
    """Return what the criterion at a place asks for."""
    return next((one.given for one in rubric.criteria if one.place == path[:2]), {})


def _is_own_field(path: KeyPath, rubric: WrittenRubric) -> bool:
    """Return whether a field of a message type is meant that the student or the course defines, or one that no message
    of ROS's has, on a topic whose type is not said."""
    if len(path) != 4 or path[-2:] != ("with", "field"):
        return False
    given = _judged(path, rubric)
    kinds = [*types_of(str(given.get("topic")), rubric)]
    if not kinds:
        return not _fields_of_ros().issuperset(re.findall(r"[^\W\d]\w*", str(given.get("field"))))
    return any(str(kind).partition("/")[0] in rubric.own_packages for kind in kinds)


@cache
def _fields_of_ros() -> frozenset[str]:
    return frozenset(
        name for types in noetic_messages().values() for fields in types.values() for name in fields
    )


LIKELY, SURE = 0.6, 0.85
"""How alike two names have to be: to be suggested, and to be taken for one with a slip."""
_DIGITS = re.compile(r"\d+")


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
    named = {t for one in rubric.criteria for t in (*one.topics, *READ_TOO.get(one.check, ()))}
    found = [checks.get(criterion.check) for criterion in rubric.criteria]
    # Such a check may look at any topic in ways that the rubric does not show.
    own = any(check is None or check.source or "evidence" in check.facts for check in found)
    for name, scenario in rubric.scenarios.items():
        until = as_map(scenario.get("until"))
        known = {*named, *SYSTEM_TOPICS}
        known |= {t for key, part in scenario.items() if key != "until" for t in topics_in(part)}
        open_ = own or any(start.get("script") is None for start in starts_of(scenario))
        for at, topic in _waited_for(until):
            # Where something else may know the topic, only what is nearly surely a slip is a fault.
            near = _near(topic, named, cutoff=SURE if open_ else LIKELY)
            if topic.startswith("/") and topic not in known and (near or not open_):
                meant = f' (did you mean "{near}"?)' if near else ""
                yield ("scenarios", name, "until", *at), f"no criterion and no probe names {topic}{meant}"
        steps = [step for _, step in as_maps(scenario.get("steps")) if "wait" not in step]
        there = {*named, *topics_in(steps)}
        for index, step in as_maps(scenario.get("steps")):
            awaited = as_map(step.get("wait")).get("topic")
            if not isinstance(awaited, str) or awaited in there:
                continue
            if near := _near(awaited, named, cutoff=SURE):
                fault = f'no criterion names {awaited} (did you mean "{near}"?)'
                yield ("scenarios", name, "steps", index, "wait", "topic"), fault


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
    asked = [action.get("name") for action in given_steps(scenario, "action")]
    for name in filter(None, (*offered, *asked)):
        yield from (f"{name}/{part}" for part in ("goal", "cancel", "status", "feedback", "result"))


def _own_types(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield types of the student's package that are all but one whose file a criterion asks for."""
    own, told = rubric.packages, {*re.findall(r"\w+", rubric.handout)}
    defined = {
        (rubric.package_of(c.data), PurePosixPath(str(c.given.get("file"))).stem)
        for c in rubric.criteria
        if c.check == "definition"
    }
    names = {stem for _, stem in defined}
    typed = [(criterion.at, criterion.given) for criterion in rubric.criteria]
    typed += [(at, given) for at, _, given in rubric.parts()]
    for path, given in typed:
        kind = given.get("type")
        package, _, name = kind.partition("/") if isinstance(kind, str) else ("", "", "")
        # as a word of another case, the handout has it for the name that is meant
        is_told = name in told and name.lower() not in {one.lower() for one in names}
        near = "" if package not in own or name in names or is_told else closest(name, names, cutoff=SURE)
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


def _waited_for(until: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    for key in ("topics", "connected"):
        yield from (((key, index), topic) for index, topic in as_texts(until.get(key)))
    yield from ((("messages", topic), topic) for topic in as_map(until.get("messages")))


def with_other_topics(rubric: WrittenRubric) -> Iterator[tuple[WrittenCriterion, set[str]]]:
    """Yield each criterion, and the topics that the others name."""
    for criterion in rubric.criteria:
        yield criterion, set().union(*(one.topics for one in rubric.criteria if one is not criterion))


def _near(topic: str, named: Iterable[str], *, cutoff: float) -> str:
    """Return the topic most like it. `/turtle1/pose` and `/turtle2/pose` are two, and not one with a slip."""
    plain = _DIGITS.sub("", topic)
    return closest(topic, [name for name in named if _DIGITS.sub("", name) != plain], cutoff=cutoff)


def values_of(starts: list[dict[str, Any]], key: str) -> list[str]:
    return [start[key] for start in starts if isinstance(start.get(key), str)]
