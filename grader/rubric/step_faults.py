"""Faults of a scenario's steps, and of what the grader serves in it, that their records' types cannot say.

What all belongs to a new kind of step is at the beginning of `scenario.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from grader.checks.support.fields import is_number
from grader.checks.support.processes import odd_name
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.errors import EvidenceError
from grader.evidence.message_values import FIRST, OTHER_TEXTS, MessageType, ServiceTypes, action_texts
from grader.installable import noetic_messages
from grader.model.message_definitions import NOT_FINITE
from grader.ros_env import ros_packages
from grader.rubric.definitions import each_in, sent_in_turn
from grader.rubric.durations import FASTEST_HZ, longest_s
from grader.rubric.fault_words import model_faults
from grader.rubric.scenario import STEP_S_MAX, Action, Play, Step, Transform
from grader.rubric.simulators import topics_of_programs
from grader.rubric.spelling import is_slip
from grader.rubric.yaml_lines import (
    Fault,
    KeyPath,
    WrittenRubric,
    as_map,
    as_maps,
    as_texts,
    give_one,
    given_steps,
    items_in,
    published_in,
    started_files,
    starts_of,
    texts_in,
)
from grader.wording import did_you_mean

KINDS = tuple(Step.model_fields)
RUN_S_MAX = 2 * STEP_S_MAX
PROCESS_STEPS = ("start", "stop", "kill", "restart")
FOR_NODES = ("publish", "call", "action", "transform", "play", "wait")
"""Steps in which a node takes part."""
NAMED = {
    "publish": ("topic", "a topic"),
    "call": ("service", "a service"),
    "action": ("name", "an action"),
    "set_param": ("name", "a parameter"),
}
"""The key of a step that is a name of ROS's."""
ROWS_PER_MESSAGE = 3
"""A node that writes more rows than this for each message, and `FASTEST_HZ` a second, is none of a lab's."""
WAITS = ("seconds", "topic", "node")
MOMENTS = 20
"""At so many messages of a row a value that changes is looked at, the first and the last among them."""


def played_bags(rubric: WrittenRubric) -> dict[KeyPath, dict[str, Any]]:
    """Return what steps play, by the place in the rubric where the recording is named."""
    return {(*at, "play", "bag"): as_map(step["play"]) for at, step in rubric.steps() if "play" in step}


def _topics_named(rubric: WrittenRubric, but: KeyPath) -> set[str]:
    """Return the names with a slash in a rubric, but for those in one of its parts."""
    texts = [text for path, text in rubric.texts if path[: len(but)] != but]
    return {name for text in texts for name in re.findall(r"(?<![\w.])/[A-Za-z][\w/]*\w", text)}


def bag_faults(path: KeyPath, file: Path, play: dict[str, Any], rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield what is wrong with a recording that a step plays. `path` is the place of its name."""
    from grader.evidence.reader import load_run  # noqa: PLC0415 - few rubrics play anything

    try:
        channels = load_run(file).channels
    except EvidenceError as error:
        yield path, f"cannot be played: {error.message}"
        return
    topics, named = {channel.topic for channel in channels}, _topics_named(rubric, path[:-1])
    yield from _rows_faults(path, file.name, [time for one in channels for time in one.times_ns], rubric)
    for number, topic in as_texts(play.get("topics")):
        if topic not in topics:
            yield (*path[:-1], "topics", number), f"{file.name} has no {topic}{did_you_mean(topic, topics)}"
    for topic in sorted(topics - named - SYSTEM_TOPICS):
        near = next((one for one in sorted(named - topics) if is_slip(topic, one)), "")
        if near:
            yield path, f"{file.name} has {topic}, and the rubric names {near}: give the recording that topic"


def _rows_faults(path: KeyPath, name: str, times_ns: list[int], rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield tables with more rows than can come of so many messages, or in that time."""
    lasts_s = (max(times_ns, default=0) - min(times_ns, default=0)) / 1e9
    for criterion in rubric.criteria:
        played, rows = given_steps(criterion.scenario, "play"), criterion.given.get("rows_at_least")
        speed = played[0].get("speed", Play.model_fields["speed"].default) if len(played) == 1 else None
        if criterion.run != path[1] or not is_number(rows) or not is_number(speed) or speed <= 0:
            continue
        most_s = longest_s(criterion.scenario, lasts_s / speed)
        if most_s is not None and rows > ROWS_PER_MESSAGE * len(times_ns) + FASTEST_HZ * most_s:
            fault = f"{name} has {len(times_ns)} messages in {lasts_s:.3g} s: so many rows never come"
            yield (*criterion.at, "rows_at_least"), fault


def step_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield the faults of one scenario's steps."""
    types: dict[str, str] = {}
    yield from _processes(path, scenario)
    for index, step in as_maps(scenario.get("steps")):
        at = (*path, "steps", index)
        given = [kind for kind in KINDS if step.get(kind) is not None]
        if len(given) != 1:
            yield at, give_one(KINDS, given)
        for kind in given:
            yield from _faults_of((*at, kind), kind, as_map(step[kind]), types)
    lasting_s = sum(_seconds(step) for _, step in as_maps(scenario.get("steps")))
    if lasting_s > RUN_S_MAX:
        yield (*path, "steps"), f"last {lasting_s:g} s in total, at most {RUN_S_MAX} s"


def _faults_of(at: KeyPath, kind: str, given: dict[str, Any], types: dict[str, str]) -> Iterator[Fault]:
    if kind in NAMED:
        key, what = NAMED[kind]
        is_private = kind == "set_param" and str(given.get(key)).startswith("~")
        found = private((*at, key), given.get(key)) if is_private else slash((*at, key), given.get(key), what)
        yield from found
    if kind == "publish":
        yield from _publish(at, given, types)
    elif kind == "call":
        yield from call_faults(at, given, types)
    elif kind == "action":
        yield from _action(at, given, types)
    elif kind == "wait":
        yield from _wait(at, given)
    elif kind == "set_param" and (given.get("value", "") is None or given.get("value") in tuple(NOT_FINITE)):
        yield (*at, "value"), "is not a value that the parameter server takes"
    elif kind == "transform":
        yield from _transform(at, given)
    elif kind == "play":
        for number, topic in as_texts(given.get("topics")):
            yield from slash((*at, "topics", number), topic, "a topic")


def call_faults(at: KeyPath, given: dict[str, Any], types: dict[str, str]) -> Iterator[Fault]:
    """Yield the faults of a call. `types` are those of the services that earlier ones call, and of topics."""
    name, asked = str(given.get("service")), given.get("type")
    known = asked and types.setdefault(f"service {name}", asked)  # a topic may have the same name
    if known != asked:
        yield (*at, "type"), f"an earlier call of {name} has {known}: a service has one type"
    yield from of_type(at, given)


def action_names(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield types of actions that are those of a message: `TimerAction` for what is in Timer.action."""
    said = " ".join(text for _, text in rubric.texts)
    for name, scenario in rubric.scenarios.items():
        steps = [
            (("steps", at, "action"), as_map(step.get("action")))
            for at, step in as_maps(scenario.get("steps"))
        ]
        served = [(("serves", at), one) for at, one in as_maps(scenario.get("serves")) if one.get("action")]
        for at, given in steps + served:
            kind = str(given.get("type"))
            short = kind.removesuffix("Action")
            # A file may end in Action, too: the rubric names it somewhere.
            if short != kind and not re.search(rf"\b{re.escape(kind.rpartition('/')[2])}\.action\b", said):
                fault = f"is named as its .action file, without Action: {short}"
                yield ("scenarios", name, *at, "type"), fault


def _action(at: KeyPath, given: dict[str, Any], types: dict[str, str]) -> Iterator[Fault]:
    """Yield the faults of a goal. `types` are those of what earlier steps publish on, and send goals to."""
    name, kind = str(given.get("name")), str(given.get("type"))
    types.setdefault(name, kind)
    for one, other in ((kind, types[name]), (types[name], kind)):
        if one != other and re.sub(r"(Action)?(Goal|Result|Feedback)$", "", one) == other:
            fault = f"has to be the same for all goals of {name}, that of the .action file: {other}"
            yield (*at, "type"), fault
    after_s = given.get("cancel_after_s")
    limit_s = given.get("limit_s", Action.model_fields["limit_s"].default)
    if isinstance(after_s, int | float) and isinstance(limit_s, int | float) and after_s >= limit_s:
        fault = f"{after_s:g} s is not before limit_s, {limit_s:g} s, after which the run goes on: nothing is cancelled"
        yield (*at, "cancel_after_s"), fault


def _seconds(step: dict[str, Any]) -> float:
    """Return how long a step lasts at least, where that is given."""
    publish, wait = as_map(step.get("publish") or step.get("transform")), as_map(step.get("wait"))
    lasting = publish.get("duration_s"), wait.get("seconds")
    return sum(s for s in lasting if isinstance(s, int | float))


def _publish(at: KeyPath, publish: dict[str, Any], types: dict[str, str]) -> Iterator[Fault]:
    """Yield the faults of messages to send. `types` are those of the topics that earlier steps publish on."""
    topic, kind = publish.get("topic"), publish.get("type")
    if ("value" in publish) == bool(publish.get("values")):
        yield at, "give one of value and values"
    listed, count = publish.get("values"), publish.get("count")
    if count is not None and publish.get("duration_s") is not None:
        yield at, "give count or duration_s, not both"
    if isinstance(listed, list) and isinstance(count, int) and 0 < count < len(listed):
        yield (*at, "count"), f"only {count} of the {len(listed)} values are sent"
    elif most := max((len(items) for _, items in each_in((), publish)), default=0):
        sent = len(sent_in_turn(publish))
        if sent < most:
            yield at, f"only {sent} of the {most} items of each are sent: write count: {most}"
    if not isinstance(topic, str) or not isinstance(kind, str) or "/" not in kind:
        return
    if types.setdefault(topic, kind) != kind:
        yield (*at, "type"), f"an earlier step publishes {types[topic]} on {topic}"
    values = enumerate(listed) if isinstance(listed, list) else ()
    places: list[tuple[KeyPath, Any]] = [((*at, "values", index), value) for index, value in values]
    places += [((*at, "value"), publish["value"])] if "value" in publish else []
    is_endless = publish.get("background") is True and count is None and publish.get("duration_s") is None
    yield from misfits((*at, "type"), kind, places, endless=is_endless)


def misfits(
    at: KeyPath, kind: str, values: list[tuple[KeyPath, Any]], *, endless: bool = False
) -> Iterator[Fault]:
    """Yield what does not fit the type, where it is one of ROS's own: no other is known before a run.

    `at` is the place of the type.
    """
    package, _, name = kind.partition("/")
    names = noetic_messages().get(package, ())
    if not names and kind not in OTHER_TEXTS:
        return
    if names and name not in names:
        near = did_you_mean(kind, [f"{package}/{one}" for one in names])
        yield at, f"ROS Noetic has no message type {kind}{near}"
        return
    message_type, first = MessageType(kind), FIRST._replace(total=None if endless else 1)
    for place, value in values:
        # A value that changes may fit at first and leave its type's range later.
        later = () if endless or not _changes(value) else range(MOMENTS)
        moments = [first, *(FIRST._replace(number=number, total=MOMENTS) for number in later)]
        if empty := empty_in(value):
            yield place, f"{empty} is empty: give it a value"
        elif wrong := next(filter(None, (message_type.misfit(value, moment) for moment in moments)), ""):
            yield place, wrong


def empty_in(value: object, done: str = "") -> str:
    """Return where a value has a key or an item without anything; "" if nowhere."""
    if value is None:
        return done
    named = ((f"[{key}]" if isinstance(key, int) else f".{key}", inner) for key, inner in items_in(value))
    return next(filter(None, (empty_in(inner, (done + key).lstrip(".")) for key, inner in named)), "")


def _changes(value: object) -> bool:
    """Return whether a value differs from message to message."""
    is_made = isinstance(value, dict) and not {"from", "each"}.isdisjoint(value)
    return is_made or any(_changes(inner) for _, inner in items_in(value))


def _transform(at: KeyPath, transform: dict[str, Any]) -> Iterator[Fault]:
    if transform.get("static") is True:
        for key in ("rate_hz", "count", "duration_s", "background"):
            if key in transform:
                yield (*at, key), "is not for a static transform: it is sent once, and stays"
    elif transform.get("count") is not None and transform.get("duration_s") is not None:
        yield at, "give count or duration_s, not both"
    if transform.get("parent") == transform.get("child"):
        yield (*at, "child"), "is the parent, too: a frame is placed in another one"
    if model_faults(Transform, transform):
        return  # said elsewhere
    sent = Transform.model_validate(transform).published
    yield from misfits(at, sent.type, [(at, sent.value)], endless=sent.total is None)


def _processes(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield the faults of steps that start, stop or type to a process."""
    starts = {str(start.get("name")): start for start in starts_of(scenario)}
    steps = as_maps(scenario.get("steps"))
    named = [
        (kind, step[kind]) for _, step in steps for kind in PROCESS_STEPS if isinstance(step.get(kind), str)
    ]
    # Reversed, so that the first step of each process stays.
    first = {name: kind for kind, name in reversed(named)}
    later = {name for name, kind in first.items() if kind == "start"}
    runs = dict.fromkeys(later, False)
    for index, step in steps:
        for kind in (*PROCESS_STEPS, "type"):
            key = (kind,) if kind in PROCESS_STEPS else (kind, "process")
            name = as_map(step.get(kind)).get("process") if kind == "type" else step.get(kind)
            if not isinstance(name, str):
                continue
            at = (*path, "steps", index, *key)
            if name not in starts:
                yield at, f'there is no start "{name}"{did_you_mean(name, starts)}'
            elif kind == "type" and not {"script", "program", "launch"} & starts[name].keys():
                yield at, f'"{name}" is not a script, program or launch file'
            elif kind == "start" and runs.get(name, False):
                yield at, f'"{name}" runs already: stop it before, or restart it'
            elif kind in {"stop", "kill", "type"} and not runs.get(name, True):
                why = "no earlier step has started it" if name in later else "an earlier step has stopped it"
                yield at, f'"{name}" does not run: {why}'
            if kind != "type":
                later.discard(name)
                runs[name] = kind in {"start", "restart"}
    yield from _after_the_last(path, steps, starts)


def _after_the_last(
    path: KeyPath, steps: list[tuple[int, dict[str, Any]]], starts: dict[str, dict[str, Any]]
) -> Iterator[Fault]:
    """Yield the first step that sends something, or waits for messages, once all processes have been stopped for
    good."""
    living = {name for name, start in starts.items() if start.get("load") is None}
    for place, (index, step) in enumerate(steps):
        ended = str(step.get("stop") or step.get("kill"))
        rest = steps[place + 1 :]
        # One that a later step may start again is not gone for good.
        living -= {ended} if not any({"start", "restart"} & one.keys() for _, one in rest) else set()
        kind = next((key for key in FOR_NODES if key in step), "")
        # A pause in seconds depends on no process.
        if not living and starts and kind and as_map(step.get("wait")).get("seconds") is None:
            fault = "nothing runs any more that could take part: it has been stopped"
            yield (*path, "steps", index, kind), fault
            return


def _wait(at: KeyPath, wait: dict[str, Any]) -> Iterator[Fault]:
    given = [key for key in WAITS if wait.get(key) is not None]
    if len(given) != 1:
        yield at, give_one(WAITS, given)
    for key in ("messages", "new"):
        if key in wait and "topic" not in given:
            yield (*at, key), "is for a topic"
    if wait.get("limit_s") is not None and "seconds" in given:
        yield (*at, "limit_s"), "is for a topic or a node"
    yield from slash((*at, "topic"), wait.get("topic"), "a topic")
    yield from slash((*at, "node"), wait.get("node"), "a node's name")


def wait_faults(rubric: WrittenRubric) -> Iterator[Fault]:
    """Yield waits for messages on a topic on which the grader alone sends, while no criterion judges any: the
    grader's own do not count."""
    for at, step in rubric.steps():
        topic, run = as_map(step.get("wait")).get("topic"), at[1]
        scenario = rubric.scenarios[str(run)]
        sent = [one for one in published_in(scenario) if one.get("topic") == topic]
        if not sent or not isinstance(topic, str):
            continue
        judged = [
            as_map(one.given.get(key))
            for one in rubric.criteria
            if one.run == run
            for key in ("effect", "topics")
        ]
        # What a program publishes in another run, it may publish here.
        own = started_files(scenario)
        alike = {run, *(name for name, one in rubric.scenarios.items() if own & started_files(one))}
        judged += [one.given for one in rubric.criteria if one.run in alike and one.check != "hears"]
        awaited = [text for _, text in texts_in((), scenario.get("until"))]
        named = any(one.get("topic") == topic or topic in one for one in judged) or topic in awaited
        if not named and topic not in topics_of_programs(scenario):
            told = f"the grader itself sends on {topic}, and its messages do not count"
            yield (*at, "wait", "topic"), f"{told}: name the one on which the node answers"


def slash(path: KeyPath, name: object, what: str) -> Iterator[Fault]:
    """Yield a fault for a name that does not begin with a slash, or that no one can have."""
    if isinstance(name, str) and not name.startswith("/"):
        package, _, kind = name.partition("/")
        swapped = f"is a type: are {path[-1]} and type swapped?"
        is_type = kind in noetic_messages().get(package, ())
        yield path, swapped if is_type else f'{what} begins with a slash: "/{name}"'
    elif isinstance(name, str) and (fault := odd_name(name)):
        yield path, fault


def private(path: KeyPath, name: object) -> Iterator[Fault]:
    """Yield a fault for a parameter's private name, which would be the grader's own."""
    if isinstance(name, str) and name.startswith("~"):
        yield path, f"{name} is private to the grader: write /, the node's name, and /{name.strip('~/')}"


ANSWERS = ("answer", "answers", "fails")
PARTS = ("Result", "Feedback")
OF_SERVICES, OF_ACTIONS = (*ANSWERS, "definition"), ("feedback", "result", "ends")


def served_faults(path: KeyPath, scenario: dict[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with one scenario's `serves`."""
    first: dict[str, int] = {}
    for index, served in as_maps(scenario.get("serves")):
        at, kinds = (*path, "serves", index), [key for key in ("service", "action") if served.get(key)]
        if len(kinds) != 1:
            yield at, f"give one of service and action, not {'both' if kinds else 'neither'}"
            continue
        (kind,) = kinds
        name = served[kind]
        yield from slash((*at, kind), name, "a service" if kind == "service" else "an action")
        if isinstance(name, str) and first.setdefault(name, index) != index:
            yield (*at, kind), f"{name} is offered by serves[{first[name]}] already"
        for key in OF_ACTIONS if kind == "service" else OF_SERVICES:
            if key in served:
                yield (*at, key), f"is not for {'a service' if kind == 'service' else 'an action'}"
        answers = [key for key in ANSWERS if served.get(key) or served.get(key) == {}]
        if kind == "service" and len(answers) != 1:
            yield at, give_one(ANSWERS, answers)
        yield from of_type(at, served)


def of_type(at: KeyPath, served: dict[str, Any]) -> Iterator[Fault]:
    """Yield what does not fit the type of a call, or of what is served, where its text is known before a run."""
    kind, text = served.get("type"), served.get("definition")
    if not isinstance(kind, str) or "/" not in kind:
        return
    if not isinstance(text, str):
        text = ros_packages().text(kind, "srv" if "service" in served else "action")
    if text is None:
        return
    values: list[tuple[MessageType, KeyPath, Any]] = []
    try:
        if "service" in served:
            types = ServiceTypes(kind, text)
            request, response = types.request, types.response
            values += [(request, (*at, "request"), as_map(served.get("request")))]
            values += [(response, (*at, "answer"), served["answer"])] if as_map(served.get("answer")) else []
            values += [(response, (*at, "answers", n), one) for n, one in as_maps(served.get("answers"))]
        else:
            result, feedback = (MessageType(f"{kind}{p}", action_texts(kind, text).get) for p in PARTS)
            values += [(result, (*at, "result"), as_map(served.get("result")))]
            values += [(feedback, (*at, "feedback", n), one) for n, one in as_maps(served.get("feedback"))]
    except ValueError:  # a type of the student's or the course's in it, known in a run
        return
    for type_, place, value in values:
        if wrong := type_.misfit(value):
            yield place, wrong


def count_causes(scenario: dict[str, Any]) -> int | None:
    """Return how often a run's steps do something to the only script that it starts; None where nobody can tell."""
    starts, steps = starts_of(scenario), [step for _, step in as_maps(scenario.get("steps"))]
    is_alone = len(starts) == 1 and "script" in starts[0] and not {"serves", "recording"} & scenario.keys()
    if not is_alone or not steps or any({"play", "action", "transform"} & step.keys() for step in steps):
        return None
    sent = given_steps(scenario, "publish")
    if "probes" in scenario or any("background" in one or "from" in str(one.get("value")) for one in sent):
        return None
    done = [step for step in steps if not {"wait", "publish"} & step.keys()]
    messages = sum(len(sent_in_turn(one)) for one in sent)
    return messages + len(done) + len(as_maps(scenario.get("calls")))
