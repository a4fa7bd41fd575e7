"""Drafts of rubrics for `grader rubric new`: what is run to look at a correct package, and the YAML that comes of it.

A package's folder and facts come in, and `find_parts` gives what can be started. `first_look` and `second_look` give
rubrics that only run it and judge nothing. What was observed there (`observe`) becomes scenarios and criteria in
`propose.py`, and `rubric_text` gives the YAML that people go on to edit.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from math import isfinite
from pathlib import Path, PurePosixPath
from statistics import median
from typing import Any

import yaml

from grader.authoring.mutation.rospy_code import last_name
from grader.checks.support.console_output import printed_lines, probes_on
from grader.checks.support.processes import lives
from grader.checks.support.topics import SYSTEM_TOPICS
from grader.evidence.inspect import periodic_share, rate_stats
from grader.evidence.run import Channel, Run
from grader.model.message_definitions import integer_limits
from grader.model.package import Interface, PackageFacts
from grader.model.record import Record
from grader.rubric.load import LoadedRubric
from grader.untrusted_text import line, visible, without_ci_commands

SYSTEM_SERVICES = ("/get_loggers", "/set_logger_level", "/tf2_frames")
ANONYMOUS = re.compile(r"_\d+_\d{9,}$")
MESSAGES_MIN = 5
INFO = 2
PERIODIC_SHARE = 0.9
NICE_HZ = (
    0.1, 0.2, 0.25, 0.5, 1, 2, 2.5, 3, 4, 5, 8, 10, 12, 15, 16, 20, 24, 25, 30, 40, 50, 60, 75, 80, 100
)  # fmt: skip
NICE_WITHIN = 0.03
_NUMBER = re.compile(r"(?<![\w.])-?\d{1,12}(?:\.\d{1,12})?(?![\w.]*\d)")
_LEADING = re.compile(r"^\W+")
_TIME = re.compile(r"(?P<words>.*?)(?P<seconds>\d+(?:\.\d+)?)")


EARLY_NS = 20_000_000
"""So much earlier an answer may arrive than the arena has noted what it sent."""


class Topic(Record):
    """One published topic, `silent` where no message came on it. `rate_hz` is None where it is not periodic.

    `counts_from` is the first value of a counter, None where it does not count. `template` is the text of messages that
    tell the time, with `{seconds}`.
    """

    name: str
    type: str
    rate_hz: float | None = None
    latched: bool = False
    silent: bool = False
    counts_from: int | None = None
    template: str = ""


class Observed(Record):
    """One run. `nodes` are base names without slash, `anonymous` whether they carry rospy's numbers.

    `listens` maps topics to types, `services` names to types, `connected` are topics over which two of its nodes are
    connected, `logged` are the lines without numbers that it logs at INFO, `read` the names of the parameters whose
    made-up values it prints, `sought` the services that it looked for and that were not there. `ended` tells that the
    process ended by itself, `failed` why, where that was an error.
    """

    nodes: tuple[str, ...]
    anonymous: bool
    topics: tuple[Topic, ...]
    listens: dict[str, str]
    services: dict[str, str]
    connected: tuple[str, ...]
    ended: bool
    sought: tuple[str, ...] = ()
    failed: str = ""
    logged: tuple[str, ...] = ()
    read: tuple[str, ...] = ()


def observe(run: Run) -> Observed:
    """Return what the run shows of the student's nodes."""
    names = [n.lstrip("/") for n in run.student_nodes()]
    early = [one for one in lives(run) if one.ended_early]
    bad = next((one for one in early if one.end and one.end.exit_code != 0), None)
    return Observed(
        nodes=tuple(dict.fromkeys(ANONYMOUS.sub("", n) for n in names)),
        anonymous=bool(names) and all(ANONYMOUS.search(n) for n in names),
        topics=tuple(_topic(c) for c in run.student_channels() if c.topic not in SYSTEM_TOPICS),
        listens=_listens(run),
        services=_services(run),
        connected=_connected_topics(run),
        ended=bool(early),
        sought=tuple(e.topic for _, e in run.actors if e.action == "lookup" and e.detail and e.topic),
        failed=_last_words(run) if bad else "",
        logged=_logged_texts(run),
        read=_read(run),
    )


def wraps_of(run: Run, topic: str) -> tuple[int, int] | None:
    """Return the (last, first) values around a counter's wrap; None where it never did, or differently each time."""
    values = [v for c in run.student_channels(topic) for v in c.data if isinstance(v, int)]
    found = {(a, b) for a, b in pairwise(values) if b != a + 1}
    return next(iter(found)) if len(found) == 1 and next(iter(found))[1] < next(iter(found))[0] else None


def heard_template(run: Run, topic: str) -> str | None:
    """Return what the lines say around the messages (`I heard {value}`); None where they are not all printed."""
    lines = printed_lines(run)
    prefixes = set()
    for probe in probes_on(run, topic):
        found = [line.text for line in lines if line.at_ns >= probe.at_ns and str(probe.value) in line.text]
        if not found:
            return None
        prefixes.add(_LEADING.sub("", found[0].partition(str(probe.value))[0]).strip())
    words = prefixes.pop() if len(prefixes) == 1 else ""
    return f"{words} {{value}}".strip() if words and not re.search(r"\d", words) else "{value}"


def answers_to(run: Run, topic: str, within_s: float) -> tuple[str, ...]:
    """Return the topics on which a message of the student's follows each one that the grader sent on `topic`."""
    sent = [t - EARLY_NS for t, e in run.actors if e.action == "publish" and e.topic == topic]
    found = []
    for channel in run.student_channels():
        ends = [*sent[1:], sent[-1] + round(within_s * 1e9)] if sent else []
        answered = [
            any(begin <= t < end for t in channel.times_ns) for begin, end in zip(sent, ends, strict=True)
        ]
        if answered and all(answered) and channel.topic not in SYSTEM_TOPICS:
            found.append(channel.topic)
    return tuple(dict.fromkeys(found))


def plain_fields(value: object) -> RubricEntry:
    """Return the fields of a request or a response that are one number, text, true or false."""
    fields = value.items() if isinstance(value, dict) else ()
    return {k: v for k, v in fields if isinstance(v, str) or (isinstance(v, int | float) and isfinite(v))}


def printed_answer(run: Run, answer: Mapping[str, object]) -> RubricEntry:
    """Return the text and numbers of the first line that has a number of a service's answer; empty without one."""
    wanted = {float(v) for v in answer.values() if isinstance(v, int | float) and not isinstance(v, bool)}
    for printed in printed_lines(run):
        numbers = [float(number) for number in _NUMBER.findall(printed.text)]
        if wanted & {*numbers} and "{" not in printed.text:
            text = _NUMBER.sub("{number}", printed.text).strip()
            return {"text": text, "numbers": list(map(format_number, numbers)), "tolerance": 0.01}
    return {}


def _topic(channel: Channel) -> Topic:
    values, kind = channel.data, channel.type.replace("/msg/", "/")
    return Topic(
        name=channel.topic,
        type=kind,
        rate_hz=nice_rate(channel.times_ns),
        latched=channel.latching,
        silent=not channel.times_ns,
        counts_from=_counts_from(values) if integer_limits(kind) else None,
        template=_template(values, channel.times_ns),
    )


def nice_rate(times_ns: Sequence[int]) -> float | None:
    """Return the rate in Hz as an author would write it; None for what is not periodic."""
    stats = rate_stats(times_ns)
    if stats.mean_hz is None or stats.count < MESSAGES_MIN:
        return None
    gaps = [later - earlier for earlier, later in pairwise(sorted(times_ns))]
    if periodic_share(gaps, median(gaps) or 1) < PERIODIC_SHARE:
        return None
    nearest = min(NICE_HZ, key=lambda hz: abs(hz - stats.mean_hz) / hz)  # type: ignore[operator]
    return (
        float(nearest) if abs(nearest - stats.mean_hz) / nearest <= NICE_WITHIN else round(stats.mean_hz, 1)
    )


def _counts_from(values: Sequence[object]) -> int | None:
    numbers = [v for v in values if isinstance(v, int) and not isinstance(v, bool)]
    steps = [b - a for a, b in pairwise(numbers)]
    counting = len(numbers) >= MESSAGES_MIN and steps.count(1) >= 0.9 * len(steps)
    return numbers[0] if counting else None


def _template(values: Sequence[object], times_ns: Sequence[int]) -> str:
    """Return `hello world {seconds}` for texts that end in a time which grows as the clock does."""
    found = [_TIME.fullmatch(v) if isinstance(v, str) else None for v in values]
    matches = [m for m in found if m is not None]
    if len(matches) < MESSAGES_MIN or len(matches) < len(found) or len({m["words"] for m in matches}) > 1:
        return ""
    grown_s = float(matches[-1]["seconds"]) - float(matches[0]["seconds"])
    passed_s = (times_ns[-1] - times_ns[0]) / 1e9
    return matches[0]["words"] + "{seconds}" if abs(grown_s - passed_s) < 0.05 * passed_s + 1 else ""


def _listens(run: Run) -> dict[str, str]:
    found: dict[str, str] = {}
    for _, event in run.graph:
        for topic, nodes in event.subscribers.items():
            if topic not in SYSTEM_TOPICS and any(map(run.is_student_node, nodes)):
                found[topic] = event.topic_types.get(topic, "").replace("/msg/", "/")
    return found


def _services(run: Run) -> dict[str, str]:
    found: dict[str, str] = {}
    for _, event in run.graph:
        for name, nodes in event.services.items():
            if not name.endswith(SYSTEM_SERVICES) and any(map(run.is_student_node, nodes)):
                found[name] = event.service_types.get(name, found.get(name, ""))
    return found


def _connected_topics(run: Run) -> tuple[str, ...]:
    found = (
        c.topic
        for _, event in run.graph
        for c in event.connections
        if c.topic not in SYSTEM_TOPICS
        and run.is_student_node(c.publisher)
        and run.is_student_node(c.subscriber)
    )
    return tuple(dict.fromkeys(found))


def _logged_texts(run: Run) -> tuple[str, ...]:
    values = (v for c in run.student_channels("/rosout") for v in c.values if isinstance(v, dict))
    # A text with a made-up value is another one in the next run.
    made_up = {str(e.value) for _, e in run.actors if e.action == "param"}
    texts = [str(v.get("msg", "")).strip() for v in values if v.get("level") == INFO]
    plain = (t for t in texts if t and not re.search(r"\d", t) and not any(m in t for m in made_up))
    return tuple(dict.fromkeys(plain))


def _read(run: Run) -> tuple[str, ...]:
    text = "\n".join(line.text for line in printed_lines(run))
    set_ = [(str(e.topic), e.value) for _, e in run.actors if e.action == "param"]
    return tuple(name for name, value in set_ if not isinstance(value, bool | list) and str(value) in text)


def _last_words(run: Run) -> str:
    lines = [line.line for _, line in run.console if line.line.strip()]
    return lines[-1] if lines else "it ended with an error"


def format_number(number: float) -> float | int:
    return int(number) if number == int(number) else number


RubricEntry = dict[str, Any]


# ---- as YAML

NOTE_CHARS = 300
HEAD = """\
# Proposed by `grader rubric new` from a run of a correct package. Look through it: it asks for what this package does,
# and only you know what the handout asks for. `grader explain CHECK` tells more about each check, and
# `grader rubric test` whether the rubric notices what students do wrong.
"""


class _Dumper(yaml.SafeDumper):
    """Short lists and maps on one line, long ones not."""

    def ignore_aliases(self, _data: object) -> bool:
        # PyYAML writes `&id001` and `*id001` where two entries are the same object.
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: ARG002 - PyYAML's own
        """Indent the entries of lists."""
        super().increase_indent(flow, False)


def _quote_text(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    """Write text: what a CI's log could take for a command stands in double quotes, where `without_ci_commands` writes
    escapes; and so do lines, which are then on one."""
    style = '"' if "##" in text or "::" in text or "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _quote_text)


def title_of(package: str) -> str:
    """Return the title of a draft, with the package's name in words: `Lab: battery monitor`.

    No capitals are added: a name that differs in one letter is taken for a slip.
    """
    words = re.sub(r"[\W_]+", " ", package).strip()
    return f"Lab: {words or package}"


def rubric_text(
    package: str,
    rubric_id: str,
    scenarios: dict[str, Any],
    criteria: list[dict[str, Any]],
    notes: Iterable[str],
) -> str:
    """Return the text of the rubric's file."""
    about = {
        "schema": "grader.rubric/1",
        "id": rubric_id,
        "title": title_of(package),
        "version": "1",
        "package": package,
    }
    parts = [HEAD + "".join(f"# NOTE: {_one_line(note)}\n" for note in notes), _dump(about, flow=False)]
    runs = [_indent({name: scenario}) for name, scenario in scenarios.items()]
    parts.append("scenarios:\n" + "\n".join(runs) if runs else "scenarios: {}\n")
    parts.append("criteria:\n" + "\n".join(_indent([criterion]) for criterion in criteria))
    return "\n".join(parts)


def _indent(data: object) -> str:
    """Innermost lists and maps in flow style: `[rospy, std_msgs]`."""
    rows = _dump(data, flow=None).removesuffix("\n").split("\n")
    return "".join(f"  {row}\n" if row else "\n" for row in rows)


def _dump(data: object, *, flow: bool | None, width: int = 110) -> str:
    """Names of topics and texts come from a program: where one holds what cannot be seen, letters are escaped."""

    def dump(*, letters: bool) -> str:
        return yaml.dump(
            data, Dumper=_Dumper, sort_keys=False, allow_unicode=letters, width=width, default_flow_style=flow
        )

    text = without_ci_commands(dump(letters=True))
    return text if visible(text, lines=True) == text else without_ci_commands(dump(letters=False))


def dump_flow(data: object) -> str:
    """Return it as YAML on one line: `{topic: /in, count: 3}`."""
    return _dump(data, flow=True, width=10_000).strip()


def _one_line(text: str) -> str:
    return line(re.sub(r"\s+", " ", text), NOTE_CHARS)


SOURCE_BYTES_MAX = 1 << 20
WATCH_S = 6.0
QUIET_LAUNCH_S = 2.0
WARPED_MESSAGES = 300
TEXT_PROBES = 8
INTEGER_PROBES = 9
STRING = "std_msgs/String"
ANSWERS_S, MESSAGES = 0.5, 3
WAIT = {"wait": {"seconds": ANSWERS_S}}
ASKED, ANSWERED = ", with calls of the grader's", ", with a service of the grader's"
SERVICES: Mapping[str, list[tuple[str, str, str]]] = {
    "std_srvs/SetBool": [
        ("request", "bool", "data"),
        ("response", "bool", "success"),
        ("response", "string", "message"),
    ],
    "std_srvs/Trigger": [("response", "bool", "success"), ("response", "string", "message")],
}
MADE_UP, SENT = ", with messages made up for this run", ", with messages of the grader's"
SCAN: RubricEntry = {"header": {"stamp": "now", "frame_id": "laser"}, "range_max": 10.0}
SAMPLES: Mapping[str, tuple[object, ...]] = {
    "std_msgs/Float32": (1.5, -2.25, 3.0),
    "std_msgs/Float64": (1.5, -2.25, 3.0),
    "std_msgs/Bool": (True, False, True),
    "sensor_msgs/LaserScan": tuple(
        SCAN | {"ranges": {"repeat": far_m, "count": 360}} for far_m in (5.0, 0.3, 5.0)
    ),
    "sensor_msgs/BatteryState": ({"percentage": 0.9}, {"percentage": 0.1}, {"percentage": 0.9}),
}
"""What is sent to a node that does not print what it hears, and how soon it is to answer."""


class Parts(Record):
    """What can be run. `nodes` maps a start's name to its script or program, `launches` to its launch file; `configs`
    are the YAML files that may hold parameters."""

    nodes: dict[str, str]
    launches: dict[str, str]
    configs: tuple[str, ...] = ()


def find_parts(folder: Path, facts: PackageFacts) -> Parts:
    """Python files that call `init_node`, programs of `add_executable`, launch files that can be read."""
    scripts = [f.path for f in facts.files if f.python and not f.python_fault and _is_node(folder / f.path)]
    programs = [one.name for one in facts.cmake.executables] if facts.cmake else []
    launches = [f.path for f in facts.launch_files if f.fault is None and f.path.endswith(".launch")]
    taken: set[str] = set()
    nodes = {_name(path, taken): path for path in [*scripts, *programs]}
    configs = [
        f.path for f in facts.files if f.path.endswith((".yaml", ".yml")) and _holds_parameters(f.path)
    ]
    launch_names = {_name(path, taken): PurePosixPath(path).name for path in launches}
    return Parts(nodes=nodes, launches=launch_names, configs=tuple(configs))


def first_look(package: str, parts: Parts) -> LoadedRubric:
    """Return a rubric that runs each node alone, in real time, and each launch file."""
    until = {"alive_s": WATCH_S}
    scenarios = {name: start_alone(parts, name, " in real time", until=until) for name in parts.nodes}
    for name, launch in parts.launches.items():
        until = {"alive_s": QUIET_LAUNCH_S, "quiet_s": 0.0}
        scenarios[name] = {"title": launch, "start": [{"name": name, "launch": launch}], "until": until}
    return LoadedRubric.to_record(package, scenarios)


def second_look(
    package: str, parts: Parts, seen: Mapping[str, Observed], interfaces: Sequence[Interface] = ()
) -> LoadedRubric | None:
    """Messages for the nodes that listen, calls for those that offer a service and answers for those that look for one,
    and a fast clock for those that count; None where there is nothing to see."""
    scenarios: dict[str, RubricEntry] = {}
    for name in parts.nodes:
        alone, listens = partial(start_alone, parts, name), seen[name].listens.items()
        if calls := calls_of(seen[name], interfaces):
            scenarios[f"{name}-asked"] = alone(ASKED, calls=calls, until={"nodes": 1})
        if serves := serves_of(name, seen, interfaces):
            scenarios[f"{name}-served"] = alone(ANSWERED, serves=serves, until={"quiet_s": 2})
        if probes := [probe for topic, kind in listens if (probe := probe_for(topic, kind))]:
            scenarios[f"{name}-hears"] = alone(MADE_UP, probes=probes, until={"heard": True})
        if sent := [step_for(topic, kind) for topic, kind in listens if not probe_for(topic, kind)]:
            scenarios[f"{name}-answers"] = alone(SENT, steps=[*sent, WAIT])
        if counters := [topic.name for topic in seen[name].topics if topic.counts_from is not None]:
            until = {"messages": dict.fromkeys(counters, WARPED_MESSAGES)}
            scenarios[f"{name}-fast"] = alone(" with a fast clock", clock="warped", until=until)
    return LoadedRubric.to_record(package, scenarios) if scenarios else None


def calls_of(seen: Observed, interfaces: Sequence[Interface]) -> list[RubricEntry]:
    """Return calls of a node's services: two with values of their own where a request has fields that are known."""
    found = []
    for service, kind in seen.services.items():
        about, fields = _service(service, kind, interfaces)
        requests = [_filled(fields, "request", turn) for turn in range(2)]
        found += [{**about, "request": one} for one in (requests if requests[0] else [{}]) if kind]
    return found


def serves_of(name: str, seen: Mapping[str, Observed], interfaces: Sequence[Interface]) -> list[RubricEntry]:
    """Return the services that a node looks for and another one of the package offers, as the grader can offer them."""
    types = {service: kind for one in seen.values() for service, kind in one.services.items() if kind}
    found = [_service(s, types[s], interfaces) for s in dict.fromkeys(seen[name].sought) if s in types]
    return [{**about, "answer": _filled(fields, "response", 0)} for about, fields in found]


def _service(
    service: str, kind: str, interfaces: Sequence[Interface]
) -> tuple[RubricEntry, list[tuple[str, str, str]]]:
    """Return a service's name, type and own definition, and its fields: part, type and name."""
    path = f"srv/{kind.rpartition('/')[2]}.srv"
    own = next((one for one in interfaces if one.path == path and one.fault is None), None)
    if own is None or kind.startswith("std_srvs/"):
        return {"service": service, "type": kind}, SERVICES.get(kind, [])
    lines = {
        part: "".join(
            f"{f.type} {f.name}{'' if f.value is None else f'={f.value}'}\n"
            for f in own.fields
            if f.part == part
        )
        for part in ("request", "response")
    }
    text = f"{lines['request']}---\n{lines['response']}"
    fields = [(f.part, f.type, f.name) for f in own.fields if f.value is None]
    return {"service": service, "type": kind, "definition": text}, fields


def _filled(fields: Iterable[tuple[str, str, str]], part: str, turn: int) -> RubricEntry:
    """Return values for the plain fields of a request or a response, others on each `turn`."""
    found: RubricEntry = {}
    for place, (_, kind, name) in enumerate(field for field in fields if field[0] == part):
        if re.fullmatch(r"float(32|64)", kind):
            found[name] = 1.5 + 2 * place + 3 * turn
        elif re.fullmatch(r"u?int(8|16|32|64)", kind):
            found[name] = 3 + 2 * place + 4 * turn
        elif kind in {"string", "bool"}:
            found[name] = turn == 0 if kind == "bool" else ("first", "second")[turn]
    return found


def start_alone(parts: Parts, name: str, words: str, *, clock: str = "", **how: object) -> RubricEntry:
    """Return a scenario that starts one node, with the package's own parameters set before; `words` follow its
    file's name in the title."""
    script = parts.nodes[name]
    scenario: RubricEntry = {"title": f"{PurePosixPath(script).name}{words}"}
    scenario |= {"params": [{"file": path} for path in parts.configs]} if parts.configs else {}
    scenario |= {"clock": clock} if clock else {}
    return {**scenario, "start": [{"name": name, "script": script}], **how}


def probe_for(topic: str, kind: str) -> RubricEntry:
    """Return made-up messages of that type; nothing for a type of which none can be made up."""
    if kind == STRING:
        return {"topic": topic, "type": kind, "text": TEXT_PROBES}
    if integer_limits(kind):
        return {"topic": topic, "type": kind, "integers": INTEGER_PROBES, "among": [0]}
    return {}


def step_for(topic: str, kind: str) -> RubricEntry:
    """Return a step that sends some messages of that type: numbers, or zeros where it has other fields than `data`."""
    values = SAMPLES.get(kind)
    sent: RubricEntry = {"values": list(values)} if values else {"value": {}, "count": MESSAGES}
    return {"publish": {"topic": topic, "type": kind, **sent, "rate_hz": 1 / ANSWERS_S}}


def _is_node(path: Path) -> bool:
    """Return whether the file calls `init_node`; it is read, not run."""
    if path.stat().st_size > SOURCE_BYTES_MAX:
        return False
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError, RecursionError):
        return False
    calls = (node.func for node in ast.walk(tree) if isinstance(node, ast.Call))
    return "init_node" in {last_name(function) for function in calls}


def _holds_parameters(path: str) -> bool:
    """Return whether it does, by its folder: other YAML files are someone else's, a CI's for instance."""
    return {"config", "cfg", "param", "params", "yaml"} & set(PurePosixPath(path).parts[:-1]) != set()


def _name(path: str, taken: set[str]) -> str:
    """Return a start's name that no other has: `scripts/numeric_talker.py` becomes `numeric-talker`."""
    stem = re.sub(r"[^a-z0-9]+", "-", PurePosixPath(path).stem.lower()).strip("-")
    stem = stem if stem[:1].isalpha() else f"p-{stem}".rstrip("-")
    stem += "-launch" if path.endswith(".launch") else ""
    name = next(n for n in _numbered_names(stem) if n not in taken)
    taken.add(name)
    return name


def _numbered_names(stem: str) -> Iterable[str]:
    yield stem
    yield from (f"{stem}-{number}" for number in range(2, 1000))
