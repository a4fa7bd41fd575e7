"""Topics that are missing, misnamed or of another type."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from grader.authoring.mutation.python_script import Function, Script, every_second_time
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.rospy_code import (
    Assignment,
    Endpoint,
    argument,
    calls,
    counted_names,
    last_name,
    literal,
    loops,
    publish_calls,
    publishers,
    rate_sleeps,
    sources,
    subscribers,
    targets,
)
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.text_edits import Edit, misspelt_name
from grader.model.record import Record


class OtherTypeParams(Record):
    """`to`: the name of the other type, of the same package; by default a near one."""

    to: str = ""


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


def _endpoints(solution: Solution) -> Iterator[tuple[Script, Endpoint]]:
    for script in solution.scripts:
        for endpoint in (*publishers(script), *subscribers(script)):
            yield script, endpoint


def _site(solution: Solution, script: Script, endpoint: Endpoint, edits: Sequence[Edit]) -> Site:
    at = {"script": script.path, "topic": endpoint.topic}
    return Site(at=at, tree=solution.edited(script.path, edits), line=endpoint.call.lineno)


@operator("topic-misspelt")
def topic_misspelt(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the topic.

    Fits every publisher and subscriber whose topic is written out.
    """
    for script, endpoint in _endpoints(solution):
        name = str(endpoint.name.value)
        yield _site(solution, script, endpoint, [script.replace(endpoint.name, repr(misspelt_name(name)))])


@operator("topic-capital")
def topic_capital(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Writes the topic with a capital letter.

    Fits every publisher and subscriber whose topic is written out.
    """
    for script, endpoint in _endpoints(solution):
        head, slash, tail = str(endpoint.name.value).rpartition("/")
        name = f"{head}{slash}{tail[:1].upper()}{tail[1:]}"
        yield _site(solution, script, endpoint, [script.replace(endpoint.name, repr(name))])


@operator("private-topic")
def private_topic(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Puts the topic into the node's private namespace.

    Fits every publisher and subscriber whose topic is written out.
    """
    for script, endpoint in _endpoints(solution):
        name = str(endpoint.name.value).lstrip("/~")
        edits = [script.replace(endpoint.name, repr(f"~{name}"))]
        yield _site(solution, script, endpoint, edits + _node_first(script, endpoint))


def _node_first(script: Script, endpoint: Endpoint) -> list[Edit]:
    """rospy knows private names only once the node has its own: init_node moves up where it comes later."""
    made = script.statement(endpoint.call)
    block = script.block(made)
    later = [s for call in calls(script, "init_node") if (s := script.statement(call)) in block]
    if not later or later[0].lineno < made.lineno or not script.has_lines(later[0]):
        return []
    return [script.before(made, script.source(later[0])), script.remove(later[0])]


@operator("publisher-dropped")
def publisher_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Removes a publisher that should stay.

    Fits every publisher that is kept in a variable.
    """
    for script in solution.scripts:
        for publisher in publishers(script):
            statements = [script.statement(call) for call in publish_calls(script, publisher)]
            if publisher.target and all(isinstance(s, ast.Expr) for s in statements):
                edits = [script.remove(script.statement(publisher.call))]
                edits += [script.replace(s, "pass") for s in statements]
                yield _site(solution, script, publisher, edits)


@operator("subscriber-dropped")
def subscriber_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Removes a subscriber that should stay.

    Fits every subscriber.
    """
    for script in solution.scripts:
        for subscriber in subscribers(script):
            yield _site(solution, script, subscriber, [script.remove(script.statement(subscriber.call))])


@operator("other-type", params=OtherTypeParams)
def other_type(solution: Solution, params: OtherTypeParams) -> Iterator[Site]:
    """Takes another message type.

    Fits every publisher and subscriber of a number or a text of std_msgs.
    """
    for script, endpoint in _endpoints(solution):
        to = params.to or OTHER_TYPES.get(endpoint.type_name, "")
        edits = _retyped(script, endpoint, to) if to else []
        if edits:
            yield _site(solution, script, endpoint, edits)


def _retyped(script: Script, endpoint: Endpoint, to: str) -> list[Edit]:
    if endpoint.type is None:
        return []
    publishes = last_name(endpoint.call.func) == "Publisher"
    uses: list[ast.expr] = [endpoint.type]
    edits: list[Edit] = []
    if publishes and endpoint.type_name == "String":
        edits += _numbers_for_texts(script, endpoint)
    elif publishes:
        uses += _made(script, endpoint)
    for use in uses:
        name = f"{script.source(use.value)}.{to}" if isinstance(use, ast.Attribute) else to
        edits.append(script.replace(use, name))
    imported = _import(script, endpoint.type, to)
    return [*edits, *imported] if imported is not None else []


def _made(script: Script, publisher: Endpoint) -> list[ast.expr]:
    """The type where the published messages are made: `Int8` of `Int8(5)`."""
    made = [n for value in sources(script, publisher) for n in ast.walk(value) if isinstance(n, ast.Call)]
    return [call.func for call in dict.fromkeys(made) if last_name(call.func) == publisher.type_name]


def _numbers_for_texts(script: Script, publisher: Endpoint) -> list[Edit]:
    """A text cannot be sent as a number: the time is sent in its place."""
    found = []
    for call in publish_calls(script, publisher):
        arguments = [*call.args, *(k.value for k in call.keywords)]
        if arguments:
            start = min(script.span(a)[0] for a in (*call.args, *call.keywords))
            end = max(script.span(a)[1] for a in (*call.args, *call.keywords))
            found.append(Edit(start, end, "rospy.get_time()"))
    return found


def _import(script: Script, kind: ast.expr, to: str) -> list[Edit] | None:
    """The import that the other type needs; None where it cannot be told how this one was imported."""
    if isinstance(kind, ast.Attribute):
        return []
    for statement in script.of(ast.ImportFrom):
        for alias in statement.names:
            if alias.name == "*" or to in {a.name for a in statement.names}:
                return []
            if alias.name == last_name(kind) and alias.asname is None:
                end = script.span(alias)[1]
                return [Edit(end, end, f", {to}")]
    return None


@operator("publish-half")
def publish_half(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Publishes this topic in every second turn only, its counter with it.

    Fits every publisher whose messages are sent by a statement of their own.
    """
    for script in solution.scripts:
        for publisher in publishers(script):
            statements = _sending(script, publisher)
            edits = every_second_time(script, statements) if statements else []
            if edits:
                yield _site(solution, script, publisher, edits)


def _sending(script: Script, publisher: Endpoint) -> list[ast.stmt]:
    """The statement that publishes, and those of the same block that count what is published."""
    sent = [script.statement(call) for call in publish_calls(script, publisher)]
    if len(sent) != 1 or not isinstance(sent[0], ast.Expr):
        return []
    counted = counted_names(script, publisher)
    return [s for s in script.block(sent[0]) if s is sent[0] or _assigns(s, counted)]


def _assigns(statement: ast.stmt, names: set[str]) -> bool:
    return any(isinstance(n, Assignment) and targets(n) & names for n in ast.walk(statement))


@operator("published-twice")
def published_twice(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Publishes each message twice.

    Fits every publisher whose messages are sent by a statement of their own.
    """
    for script in solution.scripts:
        for publisher in publishers(script):
            sent = [script.statement(call) for call in publish_calls(script, publisher)]
            if sent and isinstance(sent[0], ast.Expr) and script.has_lines(sent[0]):
                edits = [script.after(sent[0], script.source(sent[0]))]
                yield _site(solution, script, publisher, edits)


# [authoring.mutation.operators.timing] When messages come.


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
        """The number, as source, for `factor` times as often."""
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


def _site_timing(solution: Solution, script: Script, edits: Sequence[Edit], line: int) -> Site:
    return Site(at={"script": script.path}, tree=solution.edited(script.path, edits), line=line)


@operator("other-rate", params=RateParams)
def other_rate(solution: Solution, params: RateParams) -> Iterator[Site]:
    """Publishes at another rate.

    Fits every script with a rate, a timer, or a sleep in a loop.
    """
    for script in solution.scripts:
        for pace in paces(script):
            edit = script.replace(pace.node, pace.times(params.factor))
            yield _site_timing(solution, script, [edit], pace.node.lineno)


@operator("burst", params=BurstParams)
def burst(solution: Solution, params: BurstParams) -> Iterator[Site]:
    """Sends many messages at once and then none for long, with the right number in the mean.

    Fits every script with a rate, a timer, or a sleep in a loop that publishes.
    """
    for script in solution.scripts:
        for pace in paces(script)[:1]:
            for statements in _turns(script):
                slower = script.replace(pace.node, pace.times(1 / params.count))
                repeated = script.wrap(statements, f"for _ in range({params.count}):")
                yield _site_timing(solution, script, [slower, repeated], statements[0].lineno)


def _turns(script: Script) -> Iterator[list[ast.stmt]]:
    """What a loop or a timer's callback does in each turn, without the sleep."""
    names = {last_name(a) for call in calls(script, "Timer") if (a := argument(call, 1, "callback"))}
    bodies = [loop.body for loop in loops(script)]
    bodies += [f.body for f in script.of(ast.FunctionDef) if f.name in names]
    for body in bodies:
        kept = [s for s in body if not (_sleeps(s) or _declares(s))]
        together = body[body.index(kept[0]) : body.index(kept[-1]) + 1] == kept if kept else False
        publishes = any(last_name(c.func) == "publish" for c in _calls_in(script, kept))
        if together and publishes and script.can_wrap(kept):
            yield kept


def _declares(statement: ast.stmt) -> bool:
    """A docstring, or names of variables from outside."""
    text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return text or isinstance(statement, ast.Global | ast.Nonlocal)


def _sleeps(statement: ast.stmt) -> bool:
    return any(isinstance(n, ast.Call) and last_name(n.func) == "sleep" for n in ast.walk(statement))


def _calls_in(script: Script, statements: Sequence[ast.stmt]) -> Iterator[ast.Call]:
    """The calls in the statements, and in the script's own functions that they call."""
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


@operator("sleep-without-brackets")
def sleep_without_brackets(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Names rate.sleep but does not call it, so that the loop floods its topics.

    Fits every script with a statement rate.sleep().
    """
    for script in solution.scripts:
        for statement in rate_sleeps(script):
            if isinstance(statement.value, ast.Call):
                edit = script.replace(statement, script.source(statement.value.func))
                yield _site_timing(solution, script, [edit], statement.lineno)
