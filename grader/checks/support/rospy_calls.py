"""What is wrong with a call of rospy's, by what it raised and its line: a name, type or value in the wrong place."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import PurePosixPath

from grader.checks.support.console_output import Traceback
from grader.checks.support.text import shown
from grader.installable import noetic_messages
from grader.line_slips.python import parsed
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.wording import convert, join_words, on_lines

Meaning = tuple[str, str]
"""The cause, and what to do."""
_BAD_TOPIC = re.compile(
    r"^topic name is not a non-empty string|^(?:topic parameter 'data_class'|data_class \[)"
    r"|^(?:Publisher|Subscriber)\.__init__\(\) missing"
)
_VALUE_ALONE = re.compile(r"\s*(\w+)\((?:-?[\d.]+|'[^']*'|\"[^\"]*\")\)\s*(?:#.*)?$")

_OF_TWO = re.compile(r"between instances|unsupported operand")
_TEXT_AND_NUMBER = re.compile(
    r"'str' and '(?:int|float)'|'(?:int|float)' and 'str'|must be real number, not str"
)


def line_tree(source: str) -> ast.AST:
    """Return the syntax tree of a line that may begin a block; an empty one where Python cannot parse it."""
    with suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        return parsed(f"{source} pass" if source.rstrip().endswith(":") else source)
    return ast.Module(body=[], type_ignores=[])


def explain_ros_call(message: str, source: str) -> Meaning | None:
    """Of a call of rospy's: a topic's name, type or order, a rate, a pause, a class in place of a message."""
    if _BAD_TOPIC.match(message):
        return _topic(message, source)
    if re.search(r"between instances of 'Rate' and|^Rate\.sleep\(\) takes 1 positional", message):
        slept = next(iter(calls_in_line(source, "sleep")), None)
        rate = "rate"
        if slept is not None and "instances" in message and slept.args:
            rate = ast.unparse(slept.args[0])
        elif slept is not None and isinstance(slept.func, ast.Attribute):
            rate = ast.unparse(slept.func.value)
        return "a Rate already knows how long to sleep", f"write `{shown(rate)}.sleep()`"
    for explain in (_init_node, _parameter, _sent_class, _request_class, uncalled_proxy):
        if meaning := explain(message, source):
            return meaning
    if asks_for_rate := calls_in_line(source, "Rate"):
        return explain_rate(asks_for_rate[0])
    return None


def _sent_class(message: str, source: str) -> Meaning | None:
    """Of `publish(…)` with the class of the messages, or with a name that was given it."""
    if serialized := re.match(r"(\w+)\.serialize\(\) missing", message):
        name = serialized[1]
        sent = [ast.unparse(one) for call in calls_in_line(source, "publish") for one in call.args[:1]]
        if sent and re.fullmatch(r"\w+", sent[0]) and sent[0] != name:
            cause = f"`{shown(sent[0])}` is the type `{name}` itself, and not a message"
            return cause, f"write brackets where it is made: `{shown(sent[0])} = {name}()`"
        return (
            f"`{name}` is the type of the messages, not a message",
            f"publish a value: `{name}(…)`, or the value alone",
        )
    return None


SERVICES = ("Service", "ServiceProxy")
ACTIONS = ("SimpleActionServer", "SimpleActionClient", "ActionServer", "ActionClient")


def wrong_class(source: str) -> Meaning | None:
    """Return what is wrong with the type that a line gives a service or an action: a half of it, a value, a text."""
    call = next(iter(calls_in_line(source, *SERVICES, *ACTIONS)), None)
    if call is None or len(call.args) < 2:
        return None
    name, type_ = call.args[:2]
    if is_text(type_) and not is_text(name):
        return "the name comes first, then the type", rewritten(source, (name, type_), (type_, name))
    plain = type_.func if isinstance(type_, ast.Call) else type_
    written = str(plain.value) if isinstance(plain, ast.Constant) else ast.unparse(plain)
    of_action = getattr(call.func, "attr", getattr(call.func, "id", "")) in ACTIONS
    halves = r"(?:Action)?(?:Goal|Result|Feedback|Action)?$" if of_action else r"(?:Request|Response)$"
    right = re.sub(halves, "Action" if of_action else "", re.sub(r".*/", "", written), count=1)
    if ast.unparse(type_) == right:
        return None
    kind = "an action" if of_action else "a service"
    return f"the type of {kind} is the class `{shown(right)}`", rewritten(source, (type_, right))


ACTION_PARTS = {
    "send_goal": "Goal", "send_goal_and_wait": "Goal", "publish_feedback": "Feedback",
    "set_succeeded": "Result", "set_aborted": "Result", "set_preempted": "Result",
}  # fmt: skip
"""Methods of actionlib's servers and clients, and which part of the action each takes."""
_HAS_NOT = re.compile(r"'(?:(\w+?)(Action|Goal|Result|Feedback)|\w+)' object has no attribute '(\w+)'")


def part_of_action(found: Traceback) -> Meaning | None:
    """Of `publish_feedback(…)` and the like with another part of the action, with its class, or with a plain value."""
    source = found.innermost.source
    call = next(iter(calls_in_line(source, *ACTION_PARTS)), None)
    lacks = _HAS_NOT.search(found.message)
    if lacks is None or call is None or not call.args or not isinstance(call.func, ast.Attribute):
        return None
    given, part, kind = call.args[0], ACTION_PARTS[call.func.attr], lacks[0].split("'")[1]
    if lacks[2] == part or kind == "NoneType" or re.search(rf"\.{lacks[3]}\b", source):
        return None
    takes = f"`{call.func.attr}(…)` takes the action's {part.lower()}"
    if kind == "member_descriptor":
        name = shown(ast.unparse(given))
        return f"{takes}, and `{name}` is its type", f"write brackets with its fields: `{name}(…)`"
    cause = f"{takes}, and this is {'an' if kind[0] in 'aeiou' else 'a'} {kind}"
    if lacks[1] is None:
        inside = f"a field of the {part.lower()} is a time or a duration, and gets a number"
        around = "write `rospy.Duration(…)` around the number where the field gets it"
        is_time = lacks[3] in {"secs", "nsecs"}
        return (inside, around) if is_time else (cause, f"make a message of it: `…{part}(…)`")
    right = f"{lacks[1]}{part}"
    if isinstance(given, ast.Call) and ast.unparse(given.func).rpartition(".")[2] == kind:
        return cause, rewritten(source, (given.func, ast.unparse(given.func).replace(kind, right)))
    return cause, f"make it with `{right}(…)`"


def other_items(found: Traceback) -> Meaning | None:
    """Of a list of numbers in a message that has something else in it, such as lists."""
    listed = re.search(r"field (\w+)\[\] must be an? (?:unsigned )?integer type", found.message)
    if listed is None:
        return None
    why = f"`{listed[1]}` is one list of whole numbers, and something in it is no whole number"
    return (
        why,
        f"put whole numbers alone into `{listed[1]}`: no lists in it, and `int(…)` around any other number",
    )


def uncalled_proxy(message: str, source: str) -> Meaning | None:
    """Of a `ServiceProxy` in the place of what a call of it gives."""
    if not re.search(r"not '?ServiceProxy'?$|'ServiceProxy' object has no attribute", message):
        return None
    attribute = message.rpartition(" has no attribute ")[2].strip("'")
    read = (n for n in ast.walk(line_tree(source)) if isinstance(n, ast.Attribute) and n.attr == attribute)
    owner = next((shown(ast.unparse(n.value)) for n in read), "")
    where = f" where `{owner}` gets its value" if owner else ""
    hint = f"call the proxy{where}: brackets with the request's values behind its name, as in `ask(…)`"
    return f"{f'`{owner}`' if owner else 'this'} is the proxy itself, and not the answer of a call", hint


def _request_class(message: str, source: str) -> Meaning | None:
    """Of `add(AddRequest)`."""
    if message != "request object is not a valid request message instance":
        return None
    calls = (n for n in ast.walk(line_tree(source)) if isinstance(n, ast.Call))
    given = next((shown(ast.unparse(c.args[0])) for c in calls if len(c.args) == 1), "")
    if not re.fullmatch(r"[\w.]+Request", given):
        return None
    return (
        f"`{given}` is the type of the requests, not a request",
        f"write brackets with its fields: `{given}(…)`",
    )


def _init_node(message: str, source: str) -> Meaning | None:
    """Of `init_node(…)` without a name, or with one that is not text."""
    if re.search(r"\b(?:Rate\.)?__init__\(\) missing 1 required positional argument: 'hz'$", message):
        return (
            "`Rate(…)` is not told how often",
            "write how many times a second the loop has to run in its brackets",
        )
    if message == "init_node() missing 1 required positional argument: 'name'":
        return "a node needs a name", "write the node's name in the brackets, as a string"
    called = next(iter(calls_in_line(source, "init_node")), None)
    if called is not None and len(called.args) > 1 and message == "'bool' object is not iterable":
        flag = called.args[1]
        cause = "the second argument of `init_node(…)` is not `anonymous`, unless it says so"
        return cause, rewritten(source, (flag, f"anonymous={ast.unparse(flag)}"))
    if called is None or not called.args or not message.startswith("argument of type"):
        return None
    given = called.args[0]
    return "a node's name is a string", rewritten(source, (given, f"'{ast.unparse(given)}'"))


def _parameter(message: str, source: str) -> Meaning | None:
    """Of `set_param(…)` with the value before the name."""
    call = next(iter(calls_in_line(source, "set_param")), None)
    if call is None or len(call.args) != 2 or "expected string" not in message:
        return None
    value, name = call.args
    if isinstance(value, ast.Name) and not is_text(name):
        cause = f"the parameter's name comes first, in quotes, and `{shown(value.id)}` is no text"
        return cause, f"write the parameter's name, in quotes, in place of `{shown(value.id)}`"
    if is_text(name) and not is_text(value):
        return "the parameter's name comes first, then its value", rewritten(
            source, (value, name), (name, value)
        )
    return None


AROUND_THE_END = re.compile(r"([\w.]+)\[(-\d+):(\d+)\]")


def no_items(function: str, source: str) -> Meaning:
    """Of `min(scan.ranges[-45:45])`, or of another list without items."""
    if found := AROUND_THE_END.search(source):
        what, low, high = found.groups()
        why = f"`{found[0]}` is empty: a slice does not go on from the end of a list at its beginning"
        return why, f"write `{what}[{low}:] + {what}[:{high}]`"
    hint = f"check first that it is not empty, or say what the result is then: `{function}(…, default=…)`"
    return f"the list that is given to {function}() is empty", hint


def calls_in_line(source: str, *names: str) -> list[ast.Call]:
    """Return the calls in a line of source, of functions or methods with one of these names."""
    found = [n for n in ast.walk(line_tree(source)) if isinstance(n, ast.Call)]
    return [n for n in found if getattr(n.func, "attr", getattr(n.func, "id", "")) in names]


def _topic(message: str, source: str) -> Meaning:
    """Of `Publisher(…)` or `Subscriber(…)`: the topic's name is a text and comes first, its type is a class."""
    found = calls_in_line(source, "Publisher", "Subscriber")
    args = found[0].args if found else []
    if "<module " in message:
        module = shown(message.partition("<module '")[2].partition("'")[0])
        return (
            "the type's name refers to a whole module",
            f"import the type itself: `from {module} import …`",
        )
    if len(args) < 2:
        hint = "write the type of the messages after the topic's name, without quotes"
        return (
            "the type of the messages is missing" if found else "a topic's name comes first, then its type",
            hint,
        )
    topic, type_ = args[0], args[1]
    callback = next(iter(args[2:]), None)
    if is_text(type_) and not is_text(topic):
        return "the topic's name comes first, then its type", rewritten(
            source, (topic, type_), (type_, topic)
        )
    if callback is not None and re.search(r"<(?:function|bound method) ", message):
        return "the type comes before the callback", rewritten(source, (type_, callback), (callback, type_))
    return _no_type(message, source, topic, type_)


def is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _no_type(message: str, source: str, topic: ast.expr, type_: ast.expr) -> Meaning:
    """Of what stands in the place of the messages' type."""
    if isinstance(type_, ast.Constant) and is_text(type_):
        return "the type is given as a string", rewritten(
            source, (type_, re.sub(r".*[./]", "", str(type_.value)))
        )
    if isinstance(type_, ast.Call):
        return f"`{shown(ast.unparse(type_))}` is a message, not a type", rewritten(
            source, (type_, type_.func)
        )
    if "topic name" in message and isinstance(topic, ast.Name) and topic.id[:1].isupper():
        return "the topic's name is missing", f"write the topic's name, in quotes, before `{shown(topic.id)}`"
    if "topic name" in message and not is_text(topic):
        return "the topic's name is not text", "write the topic's name in quotes"
    hint = "import the type of the messages, as in `from std_msgs.msg import String`"
    return f"`{shown(ast.unparse(type_))}` is not a message type", hint


def rewritten(source: str, *changes: tuple[ast.expr, ast.expr | str], span_to: ast.expr | None = None) -> str:
    """Return the advice to write the line with other text in these places of it, the first one up to `span_to`."""
    # `col_offset` counts the bytes of UTF-8.
    line = source.encode()
    # From behind, so that the places of the others stay true.
    for old, new in sorted(changes, key=lambda change: change[0].col_offset, reverse=True):
        text = new if isinstance(new, str) else ast.get_source_segment(source, new) or ""
        line = line[: old.col_offset] + text.encode() + line[(span_to or old).end_col_offset :]
    return f"write `{shown(line.decode())}`"


def explain_rate(call: ast.Call) -> Meaning | None:
    """Of `rospy.Rate(…)` with a text, with 0, or with what `//` makes 0."""
    value = call.args[0].value if call.args and isinstance(call.args[0], ast.Constant) else None
    if call.args and isinstance(call.args[0], ast.BinOp) and isinstance(call.args[0].op, ast.FloorDiv):
        why = f"`{ast.unparse(call.args[0])}` is a whole number, 0, and 0 Hz is not a rate"
        return why, "write how many times a second the loop runs, as in `rospy.Rate(10)`"
    if isinstance(value, str):
        number = re.match(r"\s*(\d+(?:\.\d+)?)", value)
        hint = f"write `rospy.Rate({number[1]})`" if number else "write how many times a second the loop runs"
        return "a rate is a number, and this is text", hint
    if value == 0:
        return "0 Hz is not a rate", "write how many times a second the loop runs, as in `rospy.Rate(10)`"
    return None


def _decimal(value: ast.expr) -> Meaning | None:
    """Return why a calculation gives no whole number, and the one that does; None where it need not be so."""
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Div):
        whole = f"{ast.unparse(value.left)} // {ast.unparse(value.right)}"
        return "the message takes a whole number, and `/` makes one with a decimal point", whole
    parts = list(ast.walk(value))
    if isinstance(value, ast.Call) and getattr(value.func, "id", "") == "float" and len(value.args) == 1:
        return "the message takes a whole number, and `float(…)` makes one with a decimal point", ast.unparse(
            value.args[0]
        )
    decimal = any(isinstance(one, ast.Constant) and isinstance(one.value, float) for one in parts)
    clock = any(getattr(one, "attr", "") in {"get_time", "to_sec", "time"} for one in parts)
    if decimal or clock:
        return "the message takes a whole number, and this has a decimal point", f"int({ast.unparse(value)})"
    return None


NUMBER_TYPES = ("Int", "UInt", "Float", "Byte", "Char", "Bool")
"""How the types of std_msgs that hold a number begin."""


def _constants(package: PackageFacts) -> list[str]:
    """Return the constants of the package's own messages, as scripts write them: `Reading.OK`."""
    own = (one for each in (package, *package.also) for one in each.interfaces)
    return [
        f"{PurePosixPath(one.path).stem}.{f.name}" for one in own for f in one.fields if f.value is not None
    ]


def _swapped_values(found: Traceback, package: PackageFacts) -> Meaning | None:
    """Return the order of the fields, where `ClampResponse(changed, result)` is given one in the place of another."""
    if "required argument is not" not in found.message and "must be" not in found.message:
        return None
    for call in (n for n in ast.walk(line_tree(found.innermost.source)) if isinstance(n, ast.Call)):
        name = ast.unparse(call.func)
        fields = fields_of(package, name.rpartition(".")[2])
        given = {ast.unparse(one).rpartition(".")[2]: ast.unparse(one) for one in call.args}
        rest = [text for field, text in given.items() if field not in fields]
        if len(given) != len(fields) or call.keywords or len(rest) > 1 or len(rest) == len(given):
            continue
        right = [given[field] if field in given else rest[0] for field in fields]
        if right != [ast.unparse(one) for one in call.args]:
            fix = rewritten(found.innermost.source, (call, f"{name}({', '.join(right)})"))
            return f"`{name}` takes its values in the order {join_words(fields)}", fix
    return None


def _other_kind(found: Traceback) -> Meaning | None:
    """Return the field that gets no number, where none of the script's own lines is in the traceback."""
    field = re.search(r"field (\w+) must be (float|(?:an |unsigned )?integer) type", found.message)
    if field is None or found.innermost.source:
        return None
    kind, number = ("float", "number") if field[2] == "float" else ("int", "whole number")
    why = f"{field[1]} takes a {number}, and gets something else, such as a text"
    return why, f"give {field[1]} a {number}: `{kind}(…)`"


def _sender(source: str) -> tuple[ast.Call | None, str]:
    """Return the call on a line that publishes, and the name of its publisher."""
    sent = next(iter(calls_in_line(source, "publish")), None)
    return sent, ast.unparse(sent.func.value) if sent and isinstance(sent.func, ast.Attribute) else ""


def _replaced_publisher(found: Traceback, package: PackageFacts) -> Meaning | None:
    """Return that the publisher's variable was given another topic's before a message of the first one is sent."""
    _, owner = _sender(found.innermost.source)
    for slip in package.slips if "must be" in found.message else ():
        is_here = slip.kind == "never-published" and found.innermost.file.endswith(f"/{slip.file}")
        if is_here and owner and f"gives `{owner}` another" in slip.message:
            return slip.message.replace("this one", f"the one of line {slip.line}"), slip.fix
    return None


_WIDTH = re.compile(r"exceeds specified width \[(u?)int(\d+)\]|unsigned integer type (u)int(\d+)$")
_BOUNDS = re.compile(r"format requires (-?\d+) <= number <= (\d+)$")


def _out_of_range(message: str) -> Meaning | None:
    """Return which numbers a field takes, where one is too large or below 0; `message` may end with the type of an
    unsigned one."""
    width, told = _WIDTH.search(message), _BOUNDS.search(message)
    bounds = f"{told[1]} to {told[2]}" if told is not None else ""
    if width is not None:
        bits, is_unsigned = int(width[2] or width[4]), bool(width[1] or width[3])
        bounds = f"0 to {2**bits - 1}" if is_unsigned else f"{-(2 ** (bits - 1))} to {2 ** (bits - 1) - 1}"
    if not bounds:
        return None
    why = f"the message takes whole numbers from {bounds}, and this value is none"
    return why, f"publish only whole numbers from {bounds}: a counter has to start again in time"


def _no_whole_number(source: str, sent: ast.Call | None, slips: Sequence[PythonSlip]) -> Meaning | None:
    """Return why what a line publishes is no whole number, as far as the line and what is counted say so."""
    texts = [n for n in calls_in_line(source, "str") if len(n.args) == 1]
    if texts:
        why = "the message takes a whole number, and `str(…)` makes a string of it"
        return why, rewritten(source, (texts[0], texts[0].args[0]))
    if sent is None or not sent.args:
        return None
    if (point := _decimal(sent.args[0])) is not None:
        return point[0], rewritten(source, (sent.args[0], point[1]))
    name = ast.unparse(sent.args[0])
    if any((one.kind, one.name) == ("start-value", name) for one in slips):  # a counter is for its own topic
        why = f"the message takes a whole number, and `{name}`, which begins as one, no longer is"
        return why, convert("int", name)
    return None


def unfit_value(found: Traceback, package: PackageFacts) -> Meaning | None:
    """Return why a message does not take the value that is published: a text for a number, a number for a text, or the
    publisher of another topic."""
    made = re.match(r"(\w+)\(\) takes no arguments", found.message)
    if made and any(one.path.endswith(f"/{made[1]}.srv") for one in package.interfaces):
        fix = f"write `{made[1]}Response(…)`, and import it beside {made[1]}"
        return f"`{made[1]}` is the service's type, and its response has another type", fix
    frame = found.innermost
    wants_text = "must be of type bytes or an ascii string" in found.message
    swapped = _swapped_values(found, package) or _other_kind(found) or _replaced_publisher(found, package)
    if swapped or (not wants_text and "integer type" not in found.message):
        return swapped or _out_of_range(found.message)
    kind, other = ("string", "numbers") if wants_text else ("whole number", "strings")
    sent, owner = _sender(frame.source)
    slips = [s for s in package.slips if frame.file.endswith(f"/{s.file}")]
    types = {s.line: s.message for s in slips if s.kind == "publisher-type"}
    owners = {s.name: s for s in slips if s.kind == "publisher" and s.line in types}
    if not wants_text and (meant := _no_whole_number(frame.source, sent, slips)):
        return meant
    here = owners.get(owner)
    bounds = _out_of_range(f"{found.message} {types[here.line].lower()}") if here is not None else None
    others = [
        s for s in owners.values() if types[s.line].startswith(NUMBER_TYPES if wants_text else "String")
    ]
    # where no text is published at all, the other one does not get what belongs here
    is_swap = (not wants_text or any(s.kind == "publishes" for s in slips)) and bounds is None
    if here is not None and here not in others and len(others) == 1 and is_swap:
        why = f"`{owner}` publishes {types[here.line]} on {here.message} (line {here.line})"
        lines = sorted((here.line, others[0].line))
        fix = (
            f"swap `{owner}` and `{others[0].name}` on lines {lines[0]} and {lines[1]}, or where they publish"
        )
        return why, fix
    call = "str(…)" if wants_text else "int(…)"
    hint = f"publish a {kind} here, `{call}`; {other} go to the publisher of their own topic"
    if here is not None:  # only the handout says which of the two is wrong
        hint += f", or change {types[here.line]} on line {here.line} if /{here.message.lstrip('/')} has to carry them"
    field, constants = re.search(r"field (?:\w+\.)*(\w+) must", found.message), _constants(package)
    if field and constants and not wants_text:
        hint = f"give its field {field[1]} one of the type's constants: {join_words(constants, 'or')}"
    elif field and field[1] != "data":
        hint = f"give its field {field[1]} a {kind}, `{call}`, and each of its other fields a value of its type too"
    return bounds or (f"the message takes a {kind} but gets something else", hint)


def without_message(found: Traceback) -> tuple[str, str] | None:
    """Return the line that calls a function with a plain value where it wants a whole message."""
    if len(found.frames) < 2 or not found.message.endswith("has no attribute 'data'"):
        return None
    caller = found.frames[-2]
    call = None if caller.in_library else _VALUE_ALONE.match(caller.source)
    if call is None:
        return None
    said = shown(caller.source.partition("#")[0].strip())
    why = f"line {caller.line} calls it with a value in place of a message: `{said}`"
    return why, f"delete that call: ROS calls `{call[1]}` with each message"


def fields_of(package: PackageFacts, name: str) -> tuple[str, ...]:
    """Return the fields of a message type, of the student's own or of ROS's, by the name of its class."""
    for own in (package, *package.also):
        for one in own.interfaces:
            stem = one.path.rpartition("/")[2].partition(".")[0]
            part = name[len(stem) :].lower()
            fields = tuple(field.name for field in one.fields if field.part == part)
            if name.startswith(stem) and fields:
                return fields
    return next((fields for types in noetic_messages().values() if (fields := types.get(name, ()))), ())


def whole_message(found: Traceback, package: PackageFacts) -> Meaning | None:
    """Return which name stands for a whole message, goal or request of one field, where Python wants a value."""
    kinds = re.findall(r"'([A-Z]\w*)'", found.message) if found.kind == "TypeError" else []
    fields = [fields_of(package, kind) for kind in kinds]
    if len(kinds) != 1 or len(fields[0]) != 1 or (fields[0] == ("data",) and _OF_TWO.search(found.message)):
        return None
    frame = found.innermost
    name = only_value(frame.source[slice(*frame.marked)] if frame.marked else frame.source)
    hint = f"write `{name}.{fields[0][0]}` instead of `{name}`"
    return (f"`{name}` is the whole message ({kinds[0]})", hint) if name else None


def only_value(source: str) -> str:
    """Return the name that stands in a line for a value as a whole; "" where there is not one."""
    nodes = list(ast.walk(line_tree(source)))
    inner = [n.func for n in nodes if isinstance(n, ast.Call)]
    inner += [n.value for n in nodes if isinstance(n, ast.Attribute)]
    loaded = (n for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load))
    names = {n.id for n in loaded if n not in inner}
    return shown(names.pop()) if len(names) == 1 else ""


def of_typed_text(found: Traceback, file: str, package: PackageFacts) -> tuple[str, str] | None:
    """Return the lines that keep what is typed as a text, where a line computes with it, as Python 2 could."""
    if found.kind != "TypeError" or not _TEXT_AND_NUMBER.search(found.message):
        return None
    source = found.innermost.source
    typed = [s for s in package.slips if (s.kind, s.file) == ("typed-text", file)]
    bases = ((s.line, s.name if s.name.startswith("self.") else s.name.partition(".")[0]) for s in typed)
    read = [line for line, name in bases if re.search(rf"(?<![\w.]){re.escape(name)}\b", source)]
    if not read:
        return None
    hint = f"on {on_lines(read)}, write `float(input(…))` in place of `input(…)`"
    return "input() gives a text in Python 3", hint


def _time_and_number(time: ast.expr, source: str) -> tuple[str, str] | None:
    sums = [n for n in ast.walk(line_tree(source)) if isinstance(n, ast.BinOp)]
    compares = any(isinstance(n, ast.Compare) for n in ast.walk(line_tree(source)))
    if compares or len(sums) != 1 or not isinstance(sums[0].op, ast.Add | ast.Sub):
        return None
    other = sums[0].left if ast.dump(sums[0].right) == ast.dump(time) else sums[0].right
    seconds = f"rospy.Duration({ast.unparse(other)})"
    return "a Time and a number cannot be added", rewritten(source, (other, seconds))


def message_operand(message: str, left: str, source: str) -> tuple[str, str]:
    """Of a calculation with a whole message of this type, or a time."""
    sides = [
        n.left if message == left else n.right if isinstance(n, ast.BinOp) else n.comparators[-1]
        for n in ast.walk(line_tree(source))
        if isinstance(n, ast.BinOp | ast.Compare)
    ]
    name = ast.unparse(sides[0]) if len(sides) == 1 else ""
    fields = noetic_messages()["std_msgs"].get(message, ())
    is_time = message in {"Duration", "Time"}
    field = "to_sec()" if is_time else "data" if fields == ("data",) else ""
    what = "no number of seconds" if is_time else "the whole message"
    if message == "Time" and sides and (sum_ := _time_and_number(sides[0], source)):
        return sum_
    if name and field:
        return f"`{shown(name)}` is {what} ({message})", rewritten(source, (sides[0], f"{name}.{field}"))
    inner = f"`{shown(name)}.…`" if name else "`msg.…`"
    hint = "write `.to_sec()` behind that side" if is_time else f"take the field that you mean: {inner}"
    return f"one side is {what} ({message})", hint


def explain_formatting(message: str, source: str) -> tuple[str, str] | None:
    """Of a text with `%`: as many values as it has places, in brackets behind the `%`."""
    lacks = message == "not enough arguments for format string"
    if not lacks and message != "not all arguments converted during string formatting":
        return None
    there = "more" if lacks else "fewer"
    why = f"the string has {there} `%` than there are values after it"
    with suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        for node in ast.walk(parsed(source)):
            beside = node.args if isinstance(node, ast.Call) else getattr(node, "elts", [])
            if fix := _values_in_brackets(source, beside) if lacks else _places_added(source, beside):
                return why, fix
    fix = "give one value for each `%` in the string, or remove one"
    return why, fix if lacks else "put one `%s` for each value into the string"


def _places_in(node: ast.expr) -> int:
    """Return how many values a text takes behind its `%`; 0 of all else."""
    text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
    return len(re.findall(r"%[-+ #0-9.]*[a-zA-Z]", text.replace("%%", "")))


def _values_in_brackets(source: str, beside: Sequence[ast.expr]) -> str:
    """Return the line of `'%s %s' % a, b` with the values in brackets; "" for another line."""
    for at, one in enumerate(beside):
        if (
            isinstance(one, ast.BinOp)
            and isinstance(one.op, ast.Mod)
            and not isinstance(one.right, ast.Tuple)
        ):
            values = [one.right, *beside[at + 1 :]]
            if _places_in(one.left) == len(values) > 1:
                texts = [ast.get_source_segment(source, value) or "" for value in values]
                return rewritten(source, (values[0], f"({', '.join(texts)})"), span_to=values[-1])
    return ""


def _places_added(source: str, beside: Sequence[ast.expr]) -> str:
    """Return the line of `loginfo('a', b)` with a place for each value at the end of the text; "" for another line."""
    first = beside[0] if beside else None
    text = (ast.get_source_segment(source, first) or "") if first is not None else ""
    lacking = len(beside) - 1 - (_places_in(first) if first is not None else 0)
    if first is None or not is_text(first) or lacking < 1 or text[-3:] in ('"""', "'''"):
        return ""
    places = " ".join(["%s"] * lacking)
    return rewritten(source, (first, f"{text[:-1].rstrip()} {places}{text[-1]}"))
