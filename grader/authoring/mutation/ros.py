"""What a script does with rospy: where it makes, feeds and reads topics, names its node, waits and speaks."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

from grader.authoring.mutation.python import Function, Script

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
    """`Rate` of `rospy.Rate` and of `Rate`."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def calls(script: Script, *names: str) -> Iterator[ast.Call]:
    """The calls of functions of these names, whatever they are attributes of."""
    return (call for call in script.of(ast.Call) if last_name(call.func) in names)


def argument(call: ast.Call, position: int, *keywords: str) -> ast.expr | None:
    """The argument at that place, or by one of these keywords."""
    if position < len(call.args):
        return call.args[position]
    return next((k.value for k in call.keywords if k.arg in keywords), None)


def literal(script: Script, node: ast.AST | None) -> ast.Constant | None:
    """The constant, or the one that the only assignment to this name gives it."""
    if isinstance(node, ast.Constant):
        return node
    if not isinstance(node, ast.Name | ast.Attribute):
        return None
    name = ast.unparse(node)
    values = [a.value for a in script.of(ast.Assign) for target in a.targets if ast.unparse(target) == name]
    value = values[0] if len(values) == 1 else None
    return value if isinstance(value, ast.Constant) else None


def text_literal(script: Script, node: ast.AST | None) -> ast.Constant | None:
    """The same for texts that stand in one line."""
    found = literal(script, node)
    whole = found is not None and isinstance(found.value, str) and found.lineno == found.end_lineno
    return found if whole else None


def publishers(script: Script) -> list[Endpoint]:
    return [e for call in calls(script, "Publisher") if (e := _endpoint(script, call))]


def subscribers(script: Script) -> list[Endpoint]:
    return [e for call in calls(script, "Subscriber") if (e := _endpoint(script, call))]


def _endpoint(script: Script, call: ast.Call) -> Endpoint | None:
    name = text_literal(script, argument(call, 0, "name"))
    if name is None or not str(name.value).strip("/~"):
        return None
    statement = script.statement(call)
    target = ast.unparse(statement.targets[0]) if isinstance(statement, ast.Assign) else ""
    if isinstance(statement, ast.AnnAssign):
        target = ast.unparse(statement.target)
    subscribes = last_name(call.func) == "Subscriber"
    return Endpoint(
        call=call,
        topic=global_name(str(name.value)),
        name=name,
        type=argument(call, 1, "data_class"),
        target=target,
        callback=_function(script, argument(call, 2, "callback")) if subscribes else None,
    )


def global_name(name: str) -> str:
    return name if name.startswith(("/", "~")) else f"/{name}"


def _function(script: Script, node: ast.AST | None) -> Function | ast.Lambda | None:
    if isinstance(node, ast.Lambda) or node is None:
        return node
    return next((f for f in script.of(ast.FunctionDef) if f.name == last_name(node)), None)


def publish_calls(script: Script, publisher: Endpoint) -> list[ast.Call]:
    """`pub.publish(…)` by the publisher's own name; of an only publisher, by whatever name."""
    found = [c for c in calls(script, "publish") if isinstance(c.func, ast.Attribute)]
    own = [c for c in found if publisher.target and ast.unparse(c.func.value) == publisher.target]  # type: ignore[attr-defined]
    return own or (found if len(publishers(script)) == 1 else [])


def message_name(callback: Function | ast.Lambda) -> str:
    """What the callback calls the message: its first argument after `self`."""
    names = [a.arg for a in callback.args.args if a.arg not in {"self", "cls"}]
    return names[0] if names else ""


def is_speech(node: ast.AST) -> bool:
    """Whether it prints or logs: `rospy.loginfo(…)`, `print(…)`, `sys.stdout.write(…)`."""
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Attribute) and node.func.attr == "write":
        return last_name(node.func.value) in STREAMS
    return last_name(node.func) in LOGS | {"print"}


def speech(script: Script, inside: ast.AST | None = None) -> list[ast.Expr]:
    """The statements that print or log, of the whole script or of one function."""
    within = set(ast.walk(inside)) if inside is not None else None
    return [s for s in script.of(ast.Expr) if is_speech(s.value) and (within is None or s in within)]


def loops(script: Script) -> list[ast.While]:
    """The loops that run until ROS shuts down, or for ever."""
    return [
        loop
        for loop in script.of(ast.While)
        if "is_shutdown" in ast.unparse(loop.test)
        or (isinstance(loop.test, ast.Constant) and bool(loop.test.value))
    ]


def rate_sleeps(script: Script) -> list[ast.Expr]:
    """The statements `rate.sleep()`."""
    return [
        s
        for s in script.of(ast.Expr)
        if isinstance(s.value, ast.Call)
        and last_name(s.value.func) == "sleep"
        and isinstance(s.value.func, ast.Attribute)
        and not (s.value.args or s.value.keywords)
    ]
