"""What a script does with rospy: where it makes, feeds and reads topics, names its node, waits and speaks."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

from grader.authoring.mutation.solution import CodePlace, Solution
from grader.authoring.mutation.source_edits import Function, Script

LOGS = frozenset({"logdebug", "loginfo", "logwarn", "logerr", "logfatal"})
STREAMS = frozenset({"stdout", "stderr"})


@dataclass(frozen=True, kw_only=True)
class Endpoint:
    """A publisher or subscriber. `topic` begins with `/` or `~`; `name` is its literal in the source.

    `target` is what the object is assigned to, as source (`self.pub`), empty where it is not kept. `callback` is
    the function of a subscriber, where it is one of this script's.
    """

    call: ast.Call
    topic: str
    name: ast.Constant
    type: ast.expr | None
    target: str
    callback: Function | ast.Lambda | None = None

    @property
    def type_name(self) -> str:
        return last_name(self.type) if self.type is not None else ""


def last_name(node: ast.AST) -> str:
    """Return `Rate` of `rospy.Rate` and of `Rate`."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def calls(script: Script, *names: str) -> Iterator[ast.Call]:
    """Yield the calls of functions of these names, whatever they are attributes of."""
    return (call for call in script.of(ast.Call) if last_name(call.func) in names)


def argument(call: ast.Call, position: int, *keywords: str) -> ast.expr | None:
    """Return the argument at that place, or by one of these keywords."""
    if position < len(call.args):
        return call.args[position]
    return next((k.value for k in call.keywords if k.arg in keywords), None)


def literal(script: Script, node: ast.AST | None) -> ast.Constant | None:
    """Return the constant, or the one that the only assignment to this name gives it."""
    if isinstance(node, ast.Constant):
        return node
    if not isinstance(node, ast.Name | ast.Attribute):
        return None
    name = ast.unparse(node)
    values = [a.value for a in script.of(ast.Assign) for target in a.targets if ast.unparse(target) == name]
    value = values[0] if len(values) == 1 else None
    return value if isinstance(value, ast.Constant) else None


def text_literal(script: Script, node: ast.AST | None) -> ast.Constant | None:
    """Return the same for texts that stand on one line."""
    found = literal(script, node)
    whole = found is not None and isinstance(found.value, str) and found.lineno == found.end_lineno
    return found if whole else None


def endpoints(script: Script, *kinds: str) -> list[Endpoint]:
    """Return the script's endpoints of these kinds, `Publisher` and `Subscriber`, one kind after the other."""
    return [e for kind in kinds for call in calls(script, kind) if (e := _endpoint(script, call))]


def _endpoint(script: Script, call: ast.Call) -> Endpoint | None:
    name = text_literal(script, argument(call, 0, "name"))
    if name is None or not str(name.value).strip("/~"):
        return None
    statement = script.statement(call)
    target = ast.unparse(statement.targets[0]) if isinstance(statement, ast.Assign) else ""
    if isinstance(statement, ast.AnnAssign):
        target = ast.unparse(statement.target)
    subscribes = last_name(call.func) == "Subscriber"
    topic = str(name.value)
    return Endpoint(
        call=call,
        topic=topic if topic.startswith(("/", "~")) else f"/{topic}",
        name=name,
        type=argument(call, 1, "data_class"),
        target=target,
        callback=_function(script, argument(call, 2, "callback")) if subscribes else None,
    )


def _function(script: Script, node: ast.AST | None) -> Function | ast.Lambda | None:
    if isinstance(node, ast.Lambda) or node is None:
        return node
    return next((f for f in script.of(ast.FunctionDef) if f.name == last_name(node)), None)


def script_place(script: Script, node: ast.AST | None = None, **at: str) -> CodePlace:
    """Return a place in the script, in the line of `node`, or else of the first edit."""
    return CodePlace(path=script.path, at={"script": script.path, **at}, line=getattr(node, "lineno", None))


def each_script(solution: Solution) -> Iterator[tuple[CodePlace, Script]]:
    """Find the scripts."""
    return ((script_place(script), script) for script in solution.scripts)


def each_endpoint(
    solution: Solution, kinds: Sequence[str] = ("Publisher", "Subscriber")
) -> Iterator[tuple[CodePlace, Script, Endpoint]]:
    """Find the publishers and subscribers."""
    for script in solution.scripts:
        for endpoint in endpoints(script, *kinds):
            yield script_place(script, endpoint.call, topic=endpoint.topic), script, endpoint


each_publisher = partial(each_endpoint, kinds=["Publisher"])
each_subscriber = partial(each_endpoint, kinds=["Subscriber"])


def publish_calls(script: Script, publisher: Endpoint) -> list[ast.Call]:
    """Return `pub.publish(…)` by the publisher's own name; of an only publisher, by whatever name."""
    found = [c for c in calls(script, "publish") if isinstance(c.func, ast.Attribute)]
    own = [c for c in found if publisher.target and ast.unparse(c.func.value) == publisher.target]  # type: ignore[attr-defined]
    return own or (found if len(endpoints(script, "Publisher")) == 1 else [])


def message_name(callback: Function | ast.Lambda) -> str:
    """Return what the callback calls the message: its first argument after `self`."""
    names = [a.arg for a in callback.args.args if a.arg not in {"self", "cls"}]
    return names[0] if names else ""


def is_speech(node: ast.AST) -> bool:
    """Return whether it prints or logs: `rospy.loginfo(…)`, `print(…)`, `sys.stdout.write(…)`."""
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Attribute) and node.func.attr == "write":
        return last_name(node.func.value) in STREAMS
    return last_name(node.func) in LOGS | {"print"}


def speech(script: Script, inside: ast.AST | None = None) -> list[ast.Expr]:
    """Return the statements that print or log, of the whole script or of one function."""
    within = set(ast.walk(inside)) if inside is not None else None
    return [s for s in script.of(ast.Expr) if is_speech(s.value) and (within is None or s in within)]


def loops(script: Script) -> list[ast.While]:
    """Return the loops that run until ROS shuts down, or for ever."""
    return [
        loop
        for loop in script.of(ast.While)
        if "is_shutdown" in ast.unparse(loop.test)
        or (isinstance(loop.test, ast.Constant) and bool(loop.test.value))
    ]


def rate_sleeps(script: Script) -> list[ast.Expr]:
    """Return the statements `rate.sleep()`."""
    return [
        s
        for s in script.of(ast.Expr)
        if isinstance(s.value, ast.Call)
        and last_name(s.value.func) == "sleep"
        and isinstance(s.value.func, ast.Attribute)
        and not (s.value.args or s.value.keywords)
    ]


# ---- the values that a script publishes

Assignment = ast.Assign | ast.AugAssign | ast.AnnAssign


def assignments(script: Script, names: Iterable[str]) -> list[Assignment]:
    """Return those to one of the names or to a field of one (`msg.data` for `msg`)."""
    wanted = set(names)
    return [a for a in script.of(ast.stmt) if isinstance(a, Assignment) and targets(a) & wanted]


def targets(node: Assignment) -> set[str]:
    """Return what it assigns to, and the object of each field that it sets."""
    found = set()
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        found.add(ast.unparse(target))
        if isinstance(target, ast.Attribute):
            found.add(ast.unparse(target.value))
    return found - {"self"}


def names_in(node: ast.AST | None) -> set[str]:
    """Variables and attributes that an expression reads, as source. What is called is none."""
    if node is None:
        return set()
    called = {n.func for n in ast.walk(node) if isinstance(n, ast.Call)}
    found = {
        ast.unparse(n) for n in ast.walk(node) if isinstance(n, ast.Name | ast.Attribute) and n not in called
    }
    return found - {"self", "rospy", "time", "str", "int", "float"}


def sources(script: Script, publisher: Endpoint) -> list[ast.expr]:
    """Return the expressions that make up what is published: the arguments, and what is assigned to their names."""
    found: list[ast.expr] = []
    for call in publish_calls(script, publisher):
        found += [*call.args, *(keyword.value for keyword in call.keywords)]
    names: set[str] = set()
    while new := {name for value in found for name in names_in(value)} - names:
        names |= new
        found += [a.value for a in assignments(script, new) if a.value is not None and a.value not in found]
    return found


# ---- counters

INTEGER_TYPES = frozenset(f"{sign}{bits}" for sign in ("Int", "UInt") for bits in ("8", "16", "32", "64")) | {
    "Byte"
}
SMALLEST_LIMIT = 3


@dataclass(kw_only=True)
class Counter:
    """`limits` are the numbers that the counter is compared with or taken modulo; `resets` what it goes back to.

    `tests` are the `if` statements and conditional expressions that decide the reset.
    """

    starts: list[ast.Constant] = field(default_factory=list)
    steps: list[ast.Constant] = field(default_factory=list)
    limits: list[ast.Constant] = field(default_factory=list)
    resets: list[ast.Constant] = field(default_factory=list)
    tests: list[ast.If | ast.IfExp] = field(default_factory=list)
    modulos: list[ast.BinOp] = field(default_factory=list)


def find_counter(script: Script, publisher: Endpoint) -> Counter | None:
    """Return the counter that feeds an integer topic; None where nothing is counted in a way that can be read."""
    if publisher.type_name not in INTEGER_TYPES:
        return None
    names = counted_names(script, publisher)
    if not names:
        return None
    counter = Counter(steps=[step for name in sorted(names) for step in _steps(script, name)])
    for assignment in assignments(script, names):
        _take(script, counter, assignment, names)
    counter.limits += [c.right for c in counter.modulos if isinstance(c.right, ast.Constant)]
    return counter


def _steps(script: Script, name: str) -> list[ast.Constant]:
    """Return the numbers that are added to it."""
    found = []
    for assignment in assignments(script, [name]):
        if isinstance(assignment, ast.AugAssign) and isinstance(assignment.op, ast.Add):
            found.append(assignment.value)
        elif assignment.value is not None:
            sums = [n for n in ast.walk(assignment.value) if isinstance(n, ast.BinOp)]
            found += [n.right for n in sums if isinstance(n.op, ast.Add) and ast.unparse(n.left) == name]
    return _constants(found)


def _take(script: Script, counter: Counter, assignment: ast.AST, names: set[str]) -> None:
    value = assignment.value  # type: ignore[attr-defined]
    test = _test(script, assignment, names)
    choice = value if isinstance(value, ast.IfExp) and _compares(value.test, names) else None
    if isinstance(assignment, ast.Assign) and (number := _constants([value])):
        (counter.starts if test is None else counter.resets).extend(number)
    if choice is not None:
        counter.resets += [v for v in (choice.body, choice.orelse) if isinstance(v, ast.Constant)]
    for found in (test, choice):
        if found is not None and found not in counter.tests and _resets(found, names):
            counter.tests.append(found)
            counter.limits += _constants(ast.walk(found.test), SMALLEST_LIMIT)
    sums = [n for n in (ast.walk(value) if value is not None else ()) if isinstance(n, ast.BinOp)]
    counter.modulos += [
        n for n in sums if isinstance(n.op, ast.Mod) and _constants([n.right], SMALLEST_LIMIT)
    ]


def _test(script: Script, assignment: ast.AST, names: set[str]) -> ast.If | None:
    around = (n for n in script.above(assignment) if isinstance(n, ast.If))
    return next((n for n in around if _compares(n.test, names)), None)


def _compares(test: ast.expr, names: set[str]) -> bool:
    return any(isinstance(n, ast.Compare) for n in ast.walk(test)) and any(
        ast.unparse(n) in names for n in ast.walk(test) if isinstance(n, ast.Name | ast.Attribute)
    )


def _resets(test: ast.If | ast.IfExp, names: set[str]) -> bool:
    """Return whether one of its branches gives the counter a fixed number."""
    if isinstance(test, ast.IfExp):
        return any(isinstance(v, ast.Constant) for v in (test.body, test.orelse))
    inner = [n for s in (*test.body, *test.orelse) for n in ast.walk(s) if isinstance(n, ast.Assign)]
    return any(isinstance(a.value, ast.Constant) and ast.unparse(a.targets[0]) in names for a in inner)


def _constants(nodes: Iterable[ast.AST], least: float = -math.inf) -> list[ast.Constant]:
    """Return the whole numbers among the nodes that are not less than `least`."""
    found = [n for n in nodes if isinstance(n, ast.Constant) and type(n.value) is int]
    return [n for n in found if isinstance(n.value, int) and n.value >= least]


def counted_names(script: Script, publisher: Endpoint) -> set[str]:
    """Return the variables that are published and counted up."""
    read = {name for value in sources(script, publisher) for name in names_in(value)}
    return {name for name in read if _steps(script, name)}
