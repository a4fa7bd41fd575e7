"""Topics that are missing, misnamed or of another type, and when messages come."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from grader.authoring.mutation.registry import operator
from grader.authoring.mutation.rospy_code import (
    Assignment,
    Endpoint,
    argument,
    calls,
    counted_names,
    each_endpoint,
    each_publisher,
    each_subscriber,
    last_name,
    literal,
    loops,
    publish_calls,
    rate_sleeps,
    script_place,
    sources,
    targets,
)
from grader.authoring.mutation.solution import CodePlace, Solution
from grader.authoring.mutation.source_edits import (
    Function,
    Script,
    TextEdit,
    every_second_time,
    misspelt_name,
)
from grader.model.record import Record

OTHER_TYPES = {
    "Int8": "Int16",
    "UInt8": "Int16",
    "Int16": "Int32",
    "Int32": "Int64",
    "Int64": "Int32",
    "Float32": "Float64",
    "Float64": "Float32",
    "String": "Float64",
}


class OtherTypeParams(Record):
    """`to`: the name of the other type, of the same package; by default a near one."""

    to: str = ""


@operator(each=each_endpoint, fits="every publisher and subscriber whose topic is written out")
def topic_misspelt(script: Script, endpoint: Endpoint) -> list[TextEdit]:
    """Misspells the topic."""
    return [script.replace(endpoint.name, repr(misspelt_name(str(endpoint.name.value))))]


@operator(each=each_endpoint, fits="every publisher and subscriber whose topic is written out")
def topic_capital(script: Script, endpoint: Endpoint) -> list[TextEdit]:
    """Writes the topic with a capital letter."""
    head, slash, tail = str(endpoint.name.value).rpartition("/")
    return [script.replace(endpoint.name, repr(f"{head}{slash}{tail[:1].upper()}{tail[1:]}"))]


@operator(each=each_endpoint, fits="every publisher and subscriber whose topic is written out")
def private_topic(script: Script, endpoint: Endpoint) -> list[TextEdit]:
    """Puts the topic into the node's private namespace."""
    name = str(endpoint.name.value).lstrip("/~")
    return [script.replace(endpoint.name, repr(f"~{name}")), *_node_first(script, endpoint)]


def _node_first(script: Script, endpoint: Endpoint) -> list[TextEdit]:
    """rospy knows private names only once the node has its own: init_node moves up where it comes later."""
    made = script.statement(endpoint.call)
    block = script.block(made)
    later = [s for call in calls(script, "init_node") if (s := script.statement(call)) in block]
    if not later or later[0].lineno < made.lineno or not script.has_lines(later[0]):
        return []
    return [script.before(made, script.source(later[0])), script.remove(later[0])]


@operator(each=each_publisher, fits="every publisher that is kept in a variable")
def publisher_dropped(script: Script, publisher: Endpoint) -> list[TextEdit]:
    """Removes a publisher that should stay."""
    statements = [script.statement(call) for call in publish_calls(script, publisher)]
    if not publisher.target or not all(isinstance(s, ast.Expr) for s in statements):
        return []
    return [script.remove(script.statement(publisher.call)), *(script.replace(s, "pass") for s in statements)]


@operator(each=each_subscriber, fits="every subscriber")
def subscriber_dropped(script: Script, subscriber: Endpoint) -> list[TextEdit]:
    """Removes a subscriber that should stay."""
    return [script.remove(script.statement(subscriber.call))]


@operator(
    each=each_endpoint,
    params=OtherTypeParams,
    fits="every publisher and subscriber of a number or a text of std_msgs",
)
def other_type(script: Script, endpoint: Endpoint, params: OtherTypeParams) -> list[TextEdit]:
    """Takes another message type."""
    to = params.to or OTHER_TYPES.get(endpoint.type_name, "")
    if not to or endpoint.type is None:
        return []
    uses, edits = [endpoint.type], list[TextEdit]()
    if last_name(endpoint.call.func) == "Publisher":
        if endpoint.type_name == "String":
            edits = _send_time(script, endpoint)
        else:
            uses += _constructors(script, endpoint)
    for use in uses:
        name = f"{script.source(use.value)}.{to}" if isinstance(use, ast.Attribute) else to
        edits.append(script.replace(use, name))
    imported = _import(script, endpoint.type, to)
    return [*edits, *imported] if imported is not None else []


def _constructors(script: Script, publisher: Endpoint) -> list[ast.expr]:
    """Return the type where the published messages are made: `Int8` of `Int8(5)`."""
    made = [n for value in sources(script, publisher) for n in ast.walk(value) if isinstance(n, ast.Call)]
    return [call.func for call in dict.fromkeys(made) if last_name(call.func) == publisher.type_name]


def _send_time(script: Script, publisher: Endpoint) -> list[TextEdit]:
    """A text cannot be sent as a number: the time is sent in its place."""
    found = []
    for call in publish_calls(script, publisher):
        spans = [script.span(given) for given in (*call.args, *call.keywords)]
        if spans:
            found.append(TextEdit(min(spans)[0], max(end for _, end in spans), "rospy.get_time()"))
    return found


def _import(script: Script, kind: ast.expr, to: str) -> list[TextEdit] | None:
    """Return the import that the other type needs; None where it cannot be told how this one was imported."""
    if isinstance(kind, ast.Attribute):
        return []
    for statement in script.of(ast.ImportFrom):
        for alias in statement.names:
            if alias.name == "*" or to in {a.name for a in statement.names}:
                return []
            if alias.name == last_name(kind) and alias.asname is None:
                end = script.span(alias)[1]
                return [TextEdit(end, end, f", {to}")]
    return None


@operator(each=each_publisher, fits="every publisher whose messages are sent by a statement of their own")
def publish_half(script: Script, publisher: Endpoint) -> list[TextEdit]:
    """Publishes this topic in every second turn only, its counter with it."""
    sent = [script.statement(call) for call in publish_calls(script, publisher)]
    if len(sent) != 1 or not isinstance(sent[0], ast.Expr):
        return []
    counted = counted_names(script, publisher)
    block = [s for s in script.block(sent[0]) if s is sent[0] or _assigns(s, counted)]
    return every_second_time(script, block)


def _assigns(statement: ast.stmt, names: set[str]) -> bool:
    return any(isinstance(n, Assignment) and targets(n) & names for n in ast.walk(statement))


@operator(each=each_publisher, fits="every publisher whose messages are sent by a statement of their own")
def published_twice(script: Script, publisher: Endpoint) -> list[TextEdit]:
    """Publishes each message twice."""
    sent = [script.statement(call) for call in publish_calls(script, publisher)][:1]
    own = [s for s in sent if isinstance(s, ast.Expr) and script.has_lines(s)]
    return [script.after(statement, script.source(statement)) for statement in own]


# ---- when messages come


class RateParams(Record):
    """`factor`: how many times as fast as it should be."""

    factor: float = Field(default=0.5, gt=0)


class BurstParams(Record):
    """`count`: how many messages at once."""

    count: int = Field(default=10, ge=2)


@dataclass(frozen=True, kw_only=True)
class Pace:
    """A number that sets how often something happens: a rate in Hz, or a period in seconds."""

    node: ast.expr
    value: float
    unit: Literal["hz", "s"]

    def times(self, factor: float) -> str:
        """Return the number, as source, for `factor` times as often."""
        value = self.value * factor if self.unit == "hz" else self.value / factor
        return f"{value:.6g}"


def paces(script: Script) -> list[Pace]:
    """Rates, timers' periods, and sleeps in a loop."""
    found = [_pace(script, argument(call, 0, "hz"), "hz") for call in calls(script, "Rate")]
    for call in calls(script, "Timer"):
        period = argument(call, 0, "period")
        within = [c.args[0] for c in ast.walk(period or call) if isinstance(c, ast.Call) and _is_duration(c)]
        found += [_pace(script, node, "s") for node in within]
    for call in calls(script, "sleep"):
        if call.args and any(isinstance(n, ast.While | ast.For) for n in script.above(call)):
            found.append(_pace(script, call.args[0], "s"))
    return [pace for pace in found if pace is not None]


def _is_duration(call: ast.Call) -> bool:
    return last_name(call.func) in {"Duration", "from_sec"} and bool(call.args)


def _pace(script: Script, node: ast.expr | None, unit: Literal["hz", "s"]) -> Pace | None:
    """`node` may be a constant, the name of one, or a quotient such as `1.0 / 10`."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        above, below = _number(node.left), _number(node.right)
        return Pace(node=node, value=above / below, unit=unit) if above and below else None
    if isinstance(node, ast.Call) and _is_duration(node):
        return _pace(script, node.args[0], unit)
    constant = literal(script, node)
    value = _number(constant)
    return Pace(node=constant, value=value, unit=unit) if constant and value else None


def _number(node: ast.AST | None) -> float:
    value = node.value if isinstance(node, ast.Constant) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else 0.0


def _paces(solution: Solution) -> Iterator[tuple[CodePlace, Script, Pace]]:
    for script in solution.scripts:
        for pace in paces(script):
            yield script_place(script, pace.node), script, pace


def _turns(solution: Solution) -> Iterator[tuple[CodePlace, Script, Pace, list[ast.stmt]]]:
    """Find what a loop or a timer's callback does in each turn, without the sleep, and the script's first pace."""
    for script in solution.scripts:
        names = {last_name(a) for call in calls(script, "Timer") if (a := argument(call, 1, "callback"))}
        bodies = [loop.body for loop in loops(script)]
        bodies += [f.body for f in script.of(ast.FunctionDef) if f.name in names]
        first = paces(script)[:1]
        for pace, body in ((pace, body) for pace in first for body in bodies):
            kept = [s for s in body if not (_sleeps(s) or _declares(s))]
            together = body[body.index(kept[0]) : body.index(kept[-1]) + 1] == kept if kept else False
            publishes = any(last_name(c.func) == "publish" for c in _calls_in(script, kept))
            if together and publishes and script.can_wrap(kept):
                yield script_place(script, kept[0]), script, pace, kept


def _declares(statement: ast.stmt) -> bool:
    """Return whether it is a docstring, or names of variables from outside."""
    text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return text or isinstance(statement, ast.Global | ast.Nonlocal)


def _sleeps(statement: ast.stmt) -> bool:
    return any(isinstance(n, ast.Call) and last_name(n.func) == "sleep" for n in ast.walk(statement))


def _calls_in(script: Script, statements: Sequence[ast.stmt]) -> Iterator[ast.Call]:
    """Yield the calls in the statements, and in the script's own functions that they call."""
    own = {f.name: f for f in script.of(ast.FunctionDef)}
    waiting: list[ast.AST] = list(statements)
    seen: set[Function] = set()
    while waiting:
        for node in ast.walk(waiting.pop()):
            if isinstance(node, ast.Call):
                yield node
                called = own.get(last_name(node.func))
                if called is not None and called not in seen:
                    seen.add(called)
                    waiting.append(called)


@operator(each=_paces, params=RateParams, fits="every script with a rate, a timer, or a sleep in a loop")
def other_rate(script: Script, pace: Pace, params: RateParams) -> list[TextEdit]:
    """Publishes at another rate."""
    return [script.replace(pace.node, pace.times(params.factor))]


@operator(
    each=_turns,
    params=BurstParams,
    fits="every script with a rate, a timer, or a sleep in a loop that publishes",
)
def burst(script: Script, pace: Pace, turn: list[ast.stmt], params: BurstParams) -> list[TextEdit]:
    """Sends many messages at once and then none for long, with the right number in the mean."""
    slower = script.replace(pace.node, pace.times(1 / params.count))
    return [slower, script.wrap(turn, f"for _ in range({params.count}):")]


def _rate_sleeps(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.Expr]]:
    for script in solution.scripts:
        for statement in rate_sleeps(script):
            yield script_place(script, statement), script, statement


@operator(each=_rate_sleeps, fits="every script with a statement rate.sleep()")
def sleep_without_brackets(script: Script, statement: ast.Expr) -> list[TextEdit]:
    """Names rate.sleep but does not call it, so that the loop floods its topics."""
    call = statement.value
    return [script.replace(statement, script.source(call.func))] if isinstance(call, ast.Call) else []
