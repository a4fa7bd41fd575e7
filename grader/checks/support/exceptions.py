"""What the exceptions of a first script mean."""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Callable, Iterable

from grader.checks.support.console_output import Traceback
from grader.checks.support.rospy_calls import (
    Meaning,
    calls_in_line,
    explain_rate,
    explain_ros_call,
    line_tree,
    message_operand,
    no_items,
    only_value,
    rewritten,
    uncalled_proxy,
)
from grader.checks.support.text import MAKE_RATE, as_number, shown
from grader.installable import noetic_messages
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip
from grader.model.verdict import FileCitation
from grader.wording import TEXT_PLACE, join_words, plural

HIDDEN = (
    "str", "int", "float", "list", "dict", "len", "max", "min", "sum", "range", "input", "print", "type", "round",
)  # fmt: skip
"""Functions of Python's whose names beginners give to variables."""
NUMBER_OF_PARTS = "not every message has so many parts"
_NO_FILE = re.compile(r"No such file or directory: '([^']+)'")
_NOT_WRITABLE = re.compile(r"(?:Permission denied|Read-only file system): '([^']+)'")
_UNPACKED = re.compile(r"(not enough|too many) values to unpack \(expected (\d+)(?:, got (\d+))?")
DECIMAL = re.compile(r"'-?\d*\.\d+(?:e-?\d+)?'")
_NO_ITEMS = re.compile(r"\b(min|max)\(\) (?:arg is an empty sequence|iterable argument is empty)")
_NO_NUMBER = re.compile(r"(?:invalid literal for int\(\) with base \d+|could not convert \w+ to float): (.+)")
_LOCAL = re.compile(r"local variable '(\w+)'")
_OPERANDS = re.compile(
    r"(?:unsupported operand type\(s\) for \S+|not supported between instances of) '(\w+)' and '(\w+)'"
)
_ONE_TOO_MANY = re.compile(r"(\w+)\(\) takes (\d+) positional arguments? but (\d+) (?:was|were) given")
_TOO_FEW = re.compile(r"^(?:\w+\.)*(\w+)\(\) missing \d+ required positional arguments?: (.+)$")
_COMMAND = re.compile(r"Command '(?:\[')?(.+?)(?:'\])?' returned non-zero exit status (\d+)")
_CALLED = re.compile(r"'(\w+)' object is not callable")
_WHOLE = re.compile(
    r"\bnot '?([A-Z]\w*)'?$|^object of type '([A-Z]\w*)'|^type ([A-Z]\w*) doesn't|^'([A-Z]\w*)' object is"
    r"|^bad operand type for \S+ '([A-Z]\w*)'$"
)
"""What Python says of a whole message where one of its values is meant."""
_WANTS_NUMBER = re.compile(r"(?:real number|a number) is required, not (\w+)|must be real number, not (\w+)")
_IN_ITSELF = re.compile(
    r"(?:'(?:builtin_function_or_method|function)' object|type object '[\w.]+') has no attribute '(\w+)'$"
)
# what rospy says of a slip that its exception's class does not tell of
SLIPS = {
    "name 'raw_input' is not defined": ("`raw_input` is Python 2, and a node gets no input",
     "remove `raw_input(…)`, and put its value in the code: a node cannot ask for input"),
    **{f"name '{old}' is not defined": (f"`{old}` is Python 2", f"write `{new}`, as in Python 3")
       for old, new in {"xrange": "range", "unicode": "str", "basestring": "str", "long": "int", "unichr": "chr",
                        "reduce": "functools.reduce", "reload": "importlib.reload", "file": "open"}.items()},
    **{f"'dict' object has no attribute '{old}'": (f"`{old}` is Python 2", f"write `{new}`, as in Python 3")
       for old, new in {"has_key": "key in d` for `d.has_key(key)", "iteritems": "items",
                        "itervalues": "values", "iterkeys": "keys"}.items()},
    **{f"name '{old}' is not defined": (f"Python has no `{old}`", f"write `{new}` instead of `{old}`")
       for old, new in {"true": "True", "false": "False", "TRUE": "True", "FALSE": "False", "null": "None",
                        "NULL": "None", "nullptr": "None", "nil": "None", "none": "None", "this": "self",
                        "printf": "print", "cout": "print(…)", "Pass": "pass", "Break": "break",
                        "Continue": "continue"}.items()},
    **{f"'{kind}' object has no attribute 'data'": (f"it is a plain {kind}, and no message", "leave out `.data` here")
       for kind in ("int", "float", "str", "bool")},
    **{f"{said} 'publish'{rest}": ("`publish` belongs to what `rospy.Publisher(…)` returns",
       "write that name in front of it: `pub.publish(…)`")
       for said, rest in (("name", " is not defined"), ("module 'rospy' has no attribute", ""))},
    "list.remove(x): x not in list": ("the list does not have that value",
     "delete that line, or write `if … in …:` above it, with the value and the list"),
    "required argument is not an integer": ("a field of whole numbers is given something else, such as a text or 2.0",
     "give it an int: `int(…)` of a text or a number; of a whole message or request, one of its fields"),
    "] already registered": ("the script offers that service already: each turn of a loop makes another one",
     "make it once, above any loop"),
    "is a non-ascii string": (
     "rospy names it by mistake, as a text may have such letters: another field has a value of the wrong type",
     "compare the value of each of the message's other fields with its type in the .msg file"),
    "can't send non-None value to a just-started generator": (
     "the generator has not come to its first `yield`, which takes what it is sent",
     "call `next(…)` on it once, on the line below the one that makes it"),
    "exceptions must derive from BaseException": ("only an exception can be raised, and this is none",
     "write the exception that is meant around it: `raise ValueError(…)`"),
    "sleep length must be non-negative": ("`time.sleep` is given less than 0 seconds", "give it 0 or more"),
    "is not a bool": ("the message takes True or False, and gets something else", "publish a bool, without `str(…)`"),
    "required argument is not a float": ("a field of numbers is given something else, such as a text",
     "give it a number: `float(…)`"),
    "namespaces are not allowed in node names": ("the name in `init_node(…)` has a slash", "write it without a slash"),
    "init_node() has already been called with different arguments": ("`rospy.init_node(…)` is called a second time",
     "one script is one node: call `rospy.init_node(…)` once"),
    "Inappropriate ioctl for device": ("it reads keys from its terminal, and a node that is started for you has none",
     "leave the keys out: publish in the loop by itself, or read keys in a node of their own"),
    "sendTransform() takes 2 positional arguments but 6": (
     "a broadcaster of tf2_ros takes one TransformStamped; these are the values for one of `tf`",
     "give it the TransformStamped alone, or make the broadcaster with `tf.TransformBroadcaster()`"),
    "sendTransform() missing 4 required": (
     "a broadcaster of `tf` takes translation, rotation, time, child and parent",
     "make it with `tf2_ros.TransformBroadcaster()`, which takes a TransformStamped"),
    "Invalid number of arguments, args should be": (
     "the message gets a different number of values than it has fields",
     'one value for each field; put a number into text with `%`: `publish("… %s" % value)`, not with a comma'),
}  # fmt: skip


OF_ROSCPP = {
    "You must call ros::init() before creating the first NodeHandle": (
     "a NodeHandle is made before `ros::init(…)` is called",
     "move `ros::init(…)` up, above the first `ros::NodeHandle`, one that is made outside of `main` too"),
    "Call to publish() on an invalid Publisher": (
     "`publish(…)` is called on a Publisher that nothing has advertised",
     "give that Publisher its value, `pub = nh.advertise<…>(…)`: a type in front of `pub` makes another variable"),
}  # fmt: skip
"""What roscpp says before it ends a program."""


def explain_exception(kind: str, message: str, source: str, marked: tuple[int, int] | None) -> Meaning | None:
    """Return the meaning of an exception that the line `source` raised; `marked` is what Python pointed at in it."""
    explain = _EXPLAINED.get(kind)
    return explain(message, source, marked) if explain else None


def explain_number_of_values(message: str, source: str) -> Meaning | None:
    """Return what is wrong with the number of values for a message of several fields, or for one of one field that is
    not published there; None of any other exception."""
    found = re.match(r"Invalid number of arguments, args should be \[([^\]]+)\]", message)
    if message.startswith("Invalid number of arguments, args should be [] "):
        return "it has no field", "write the handout's fields into its .msg or .srv, and build again"
    fields = re.findall(r"\w+", found[1]) if found else []
    if len(fields) == 1 and "publish" not in source:
        return f"there is one field: {fields[0]}", f"give it one value: `{fields[0]}=…`"
    if len(fields) < 2:
        return None
    named = ", ".join(f"{field}=…" for field in fields)
    return f"there are {len(fields)} fields: {join_words(fields)}", f"give each of them a value: `{named}`"


def _index(message: str, source: str, marked: tuple[int, int] | None) -> Meaning:
    if message.startswith("Replacement index") and re.search(r"\{\d*[^{}]*\}.*\.format\(", source):
        fix = "give `format(…)` as many values as the text has `{}` in it"
        return "the text has more `{}` in it than `format(…)` has values", fix
    found = _subscript(source, marked)
    if found is None:
        return "the index is beyond the end", f"check the length before you use it: {NUMBER_OF_PARTS}"
    name, index = (shown(ast.unparse(part)) for part in (found.value, found.slice))
    if "assignment" in message:  # to what the script makes itself, and not to what comes in a message
        fix = f"make `{name}` as long as it has to be where it gets its value: an assignment adds no element"
        return f"`{name}` has no element {index}", fix
    if index.isdecimal():
        parts = plural(int(index) + 1, "element")
        fewer, last = f"`{name}` has fewer than {parts}", f"the last one is `len({name}) - 1`"
        if name.endswith("ranges") and index != "0":  # of a laser, whose scans all have as many
            return fewer, f"choose a smaller index than {index}: they begin at 0, and {last}"
        return fewer, f"check `len({name}) > {index}` first: {NUMBER_OF_PARTS}"
    own = f"keep `{index}` below `len({name})`, or give `{name}` more elements"
    hint = f"check `len({name})` first: {NUMBER_OF_PARTS}" if index.startswith("-") else own
    return f"`{name}` has no element {index}", hint


def _subscript(source: str, marked: tuple[int, int] | None) -> ast.Subscript | None:
    """Return the only `x[i]` of the line, or the one that is marked."""
    every = [
        n for n in ast.walk(line_tree(re.sub(r"^el(?=if\b)", "", source))) if isinstance(n, ast.Subscript)
    ]
    found = [n for n in every if not isinstance(n.slice, ast.Slice)]
    pointed = [n for n in found if marked and (n.col_offset, n.end_col_offset) == marked]
    return (pointed or found)[0] if pointed or len(found) == 1 else None


def _key(message: str, source: str, _marked: tuple[int, int] | None) -> Meaning:
    if "get_param" in source:
        return f"the parameter {message} is not set", f"give it a default: `rospy.get_param({message}, …)`"
    if call := re.search(r"\.(substitute|format)\(", source):
        why = f"`{call[1]}(…)` gets no value for {message}, which the text has a place for"
        return why, f"write `{shown(message[1:-1])}=…` in its brackets"
    return (
        f"there is no key {message}",
        f"check which keys there are, or use `.get({message}, …)` with a default",
    )


def _value(message: str, source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    if meaning := explain_ros_call(message, source) or _not_finite(message, source):
        return meaning
    if found := _UNPACKED.search(message):
        came = f"; {found[3]} came" if found[3] else ""
        hint = f"check how many there are before you unpack them: {NUMBER_OF_PARTS}"
        return f"{plural(int(found[2]), 'value')} are expected on the right of `=`{came}", hint
    if found := _NO_ITEMS.search(message):
        return no_items(found[1], source)
    found = _NO_NUMBER.search(message)
    return _of_text(message, found[1], source) if found else None


def _of_text(message: str, text: str, source: str) -> Meaning | None:
    """Explain a text that `int(…)` or `float(…)` is given, in its quotes."""
    if text.endswith(".py'"):
        return _program(source)
    if ":=" in text:
        why = f"{shown(text)} is for ROS: roslaunch and rosrun add it to what they give a program"
        return why, "write `rospy.myargv()` in place of `sys.argv`: it has your own arguments only"
    if message.startswith("invalid literal for int") and DECIMAL.fullmatch(text):
        return f"{shown(text)} is no whole number", "write `float(…)` in place of `int(…)`"
    return f"{shown(text)} is text, not a number", "convert only what is a number, and print text as it is"


def _not_finite(message: str, source: str) -> Meaning | None:
    """Of `math.floor(point.x / width)`, or `int(…)`, where something in it is infinite or not a number."""
    if message not in ("cannot convert float NaN to integer", "cannot convert float infinity to integer"):
        return None
    whole = calls_in_line(source, "int", "round", "floor", "ceil")
    inner = whole[0].args[0] if len(whole) == 1 and whole[0].args else None
    value = inner.left if isinstance(inner, ast.BinOp) else inner
    checked = "…" if value is None else shown(ast.unparse(value))
    return (
        f"a value in this line is {'NaN' if 'NaN' in message else 'infinite'}, which cannot become a whole number",
        f"go on to this line only if `math.isfinite({checked})`: NaN is equal to nothing, so `==` never finds it",
    )


def _program(source: str) -> Meaning:
    """Of `float(sys.argv[0])`: the first argument is the program's own path."""
    cause = "the first of `sys.argv` is the path of the script itself, and its arguments begin at 1"
    every = (n for n in ast.walk(line_tree(source)) if isinstance(n, ast.Subscript))
    parts = [n for n in every if "argv" in ast.unparse(n)]
    places = [n.slice for n in parts if not isinstance(n.slice, ast.Slice)]
    slices = [n.slice for n in parts if isinstance(n.slice, ast.Slice)]
    places += [one for s in slices for one in (s.lower, s.upper) if one is not None]
    begins = [s for s in slices if s.lower is None]
    numbers = {p: p.value + 1 for p in places if isinstance(p, ast.Constant) and isinstance(p.value, int)}
    if not parts or begins or len(numbers) < len(places):
        return cause, "begin at `sys.argv[1]`"
    fix = rewritten(source, *((place, str(number)) for place, number in numbers.items()))
    behind = (
        "" if slices or len(numbers) > 1 else ", and read each argument behind it one place further on too"
    )
    return cause, f"{fix}{behind}"


def _place_in_list(message: str, source: str) -> Meaning | None:
    """Of `grid.data[row * width + x / resolution]`."""
    if not re.match(r"(?:list|tuple|string) indices must be integers(?: or slices)?, not float", message):
        return None
    found = _subscript(source, None)
    every = [n.slice for n in ast.walk(line_tree(source)) if isinstance(n, ast.Subscript)]
    divided = [p for p in every if "/" in (text := ast.unparse(p)) and not set(":[") & set(text)]
    cause = "a place in a list is a whole number, and `/`, or `//` with a decimal number, gives none"
    places = [found.slice] if found else divided
    if not places:
        return cause, "make it one with `int(…)`"
    return cause, rewritten(source, *((place, f"int({ast.unparse(place)})") for place in places))


def _type(message: str, source: str, marked: tuple[int, int] | None) -> Meaning | None:
    if (
        meaning := explain_ros_call(message, source)
        or _call(message, source, marked)
        or _nested_index(message, source)
        or _place_in_list(message, source)
    ):
        return meaning
    if "'NoneType' object" in message:
        return _none(source)
    if message == "'tuple' object does not support item assignment":
        return _tuple(source)
    if meaning := _no_number(message, source):
        return meaning
    if given := _OPERANDS.search(message):
        return _operands(given[1], given[2], source)
    return None


def _tuple(source: str) -> Meaning:
    """Of `scan.ranges[i] = 0`: what a message has as a list is a tuple once it is received, or was made one."""
    tree = line_tree(source)
    target = next(
        (n.value for n in ast.walk(tree) if isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store)),
        None,
    )
    name = shown(ast.unparse(target)) if target is not None else "values"
    return (
        "this is a tuple, as each list is in a message that was received, and cannot be changed",
        f"write `{name} = list({name})` first",
    )


def _nested_index(message: str, source: str) -> Meaning | None:
    """Of `grid.data[row][column]`: the fields of messages are lists of one level."""
    if not re.match(
        r"'(?:int|float)' object (?:is not subscriptable|does not support item assignment)", message
    ):
        return None
    parts = (n for n in ast.walk(line_tree(source)) if isinstance(n, ast.Subscript))
    nested = [n for n in parts if isinstance(n.value, ast.Subscript)]
    if len(nested) != 1 or not isinstance(inner := nested[0].value, ast.Subscript):
        return None
    flat, row, column = (ast.unparse(part) for part in (inner.value, inner.slice, nested[0].slice))
    fix = f"write `{shown(f'{flat}[{row} * width + {column}]')}`, where `width` is how many are in a row"
    return f"`{shown(flat)}` is one list of numbers, row after row", fix


def _no_number(message: str, source: str) -> Meaning | None:
    """Of a whole message, or a text, where a number is wanted."""
    if (whole := _WHOLE.search(message)) and (kind := whole[whole.lastindex or 0]) != "NoneType":
        name = only_value(source) if kind in noetic_messages()["std_msgs"] else None
        hint = "take one of its fields" if name is None else "take its field, as in `msg.data`"
        hint = f"write `{name}.data` instead of `{name}`" if name else hint
        return f"this is the whole message ({kind})", hint
    if re.match(
        r"expected \[\w+\] but got \[std_msgs/\w+\]", message
    ):  # rospy's own words, of a service's request
        return "this is the whole message", "take its field, as in `msg.data`"
    typed = re.match(r"expected \[\w+\] but got \[\w+/(\w+)\]", message)
    if typed and "publish" in source:
        fix = f"name {typed[1]} in `rospy.Publisher(…)`, and import it"
        return f"the Publisher is not for {typed[1]}", fix
    if re.search(r" of (?:'str' and '(?:int|float)|'(?:int|float)' and 'str)'", message):
        other = "leave out `str(…)`" if "str(" in source else "compare it with a text"
        return "text is compared with a number", f"turn the text into a number first, or {other}"
    if wanted := _WANTS_NUMBER.search(message):
        hint = TEXT_PLACE if "%" in source else "turn the text into a number: `float(…)`"
        return f"a number is needed here, but it is of the type {wanted[1] or wanted[2]}", hint
    return None


def _called_value(kind: str, source: str) -> Meaning:
    value = f"is a value ({kind}), and no function"
    if field := re.search(r"\b(?!self\.\w+\()[\w.]+\.(?:data|\w+(?=\(\)$))(?=\(\))", source):
        return f"`{field[0]}` {value}", f"write `{field[0]}` without the brackets behind it"
    if hidden := next((name for name in HIDDEN if calls_in_line(source, name)), ""):
        cause = f"`{hidden}` is a variable here, and hides Python's `{hidden}`"
        return cause, f"give the variable `{hidden}` another name"
    return f"what is called {value}", "give the variable and the function different names"


def _call(message: str, source: str, marked: tuple[int, int] | None) -> Meaning | None:
    """Of a call: a module, a value, or a method without `self`."""
    if message == "'module' object is not callable":
        return "a module is called", "call what is in it (`time.time()`), or import that: `from … import …`"
    if called := _CALLED.search(message):
        return _called_value(called[1], source[slice(*marked)] if marked else source)
    given = _ONE_TOO_MANY.search(message)
    if given and int(given[3]) == int(given[2]) + 1 and f".{given[1]}(" in source:
        method = given[1]
        if f"rospy.{method}(" in source:
            return f"`{method}` is given a value, and rospy's takes none", f"write `rospy.{method}()`"
        taken = "self, …" if int(given[2]) else "self"
        why = f"`{method}` is a method, so its first parameter has to be `self`"
        return why, f"make it `def {method}({taken}):`"
    if (lacks := _TOO_FEW.match(message)) and re.search(rf"\b{lacks[1]}\(", source):
        name, values = lacks.groups()
        hint = f"put {values} into its brackets"
        if "." not in source.partition(f"{name}(")[0].rpartition(" ")[2].removeprefix(
            "self."
        ):  # the student's own
            hint += ", or remove the call: ROS calls a callback by itself"
        return f"`{name}` is called without {values}", hint
    return None


def evaluated(found: Traceback) -> Meaning | None:
    """Return that a text is run as Python code, where what was raised comes from inside that text."""
    own = [frame for frame in found.own_frames if not frame.file.startswith("<")]
    call = _EVALUATES.search(own[-1].source) if own else None
    if call is None or found.frames[-1].file not in ("<string>", "<unknown>"):
        return None
    why = f"`{call[1]}(…)` takes the text that it is given for Python code"
    return why, f"leave `{call[1]}(…)` out, and use the text as it is"


_EVALUATES = re.compile(r"(?<![\w.])((?:ast\.literal_)?eval|exec)\(")


def _operands(left: str, right: str, source: str) -> Meaning | None:
    """Of a calculation: a whole message, or a text."""
    message = next((kind for kind in (left, right) if kind[:1].isupper() and kind != "NoneType"), "")
    if "NoneType" in (left, right):
        return _none(source)
    if message:
        return message_operand(message, left, source)
    if "^" in source and {left, right} <= {"int", "float"}:
        return "`^` is no power in Python", f"write `{shown(source.replace('^', '**'))}`"
    if left == right == "str":
        return "both sides are strings, which only `+` joins", "write `+`, or make numbers of both"
    if "str" in (left, right):
        return "one side is a string", "turn the text into a number first: `float(…)`"
    return None


def _none(source: str) -> Meaning:
    if found := re.search(r"([\w.]+)\.get_result\(\)", source):
        return "the action has no result yet", f"above that line, write `{found[1]}.wait_for_result()`"
    if found := re.search(r"\b(print|publish|log[a-z]+)\(.*\)\s*(\.format|%)", source):
        sign, where = found[2].replace("format", "format(…)"), f"the brackets of `{found[1]}(…)`"
        return f"`{sign}` belongs to the string, in {where}", f"write `{sign}` behind the string, in {where}"
    cause = "it is None here: nothing has given it a value yet, or a function without `return` did"
    return cause, "check `is not None` before that line"


def _local(message: str, _source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    if (name := _LOCAL.search(message)) is None:
        return None
    if hasattr(builtins, name[1]):
        cause = f"`{name[1]}` is a variable of this function, and hides Python's `{name[1]}`"
        return cause, f"give the variable `{name[1]}` another name"
    cause = f"the function itself assigns to {name[1]}, so it is a variable of its own and has no value yet"
    shared = f"write `global {name[1]}` as the first line of the function if the file has a {name[1]} outside of it"
    return cause, f"{shared}, else give {name[1]} a value in the function, above that line"


def _future(message: str, source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    """Of a frame that is looked up at a time of which tf has not heard yet."""
    if "into the future" not in message or ".now()" not in source:
        return None
    hint = "write `rospy.Time(0)` instead of `rospy.Time.now()`: it stands for the newest transform"
    return "it asks where the frame is now, and the newest transform is a little older", hint


def no_number(found: Traceback, place: FileCitation, package: PackageFacts) -> tuple[str, str] | None:
    """Return where a text comes from that a message takes for a number; None for what is published."""
    kind = "int" if "integer" in found.message else "float"
    texts = [s for s in package.slips if (s.file, s.kind) == (place.file, "argument-text")]
    said = " ".join(frame.source for frame in found.own_frames)
    # Python names the first of them alone
    if reads := [s for s in texts if re.search(rf"\b{re.escape(s.name)}\b", said)] or texts[:1]:
        fix = "; ".join(f"on line {s.line}, write `{s.fix}`" for s in reads)
        if kind == "float":
            fix = fix.replace("map(int, ", "map(float, ").replace("= int(", "= float(")
        return "a command-line argument is a string", fix
    if ".publish(" in found.innermost.source:
        return None
    fix = f"turn the value into one first: {as_number(kind, found.own_frames[-1].source)}"
    return "it takes a number but gets something else", fix


def without_base(message: str, slips: Iterable[PythonSlip]) -> Meaning | None:
    """Return that an attribute lacks its value because the base class, which gives it, is never set up."""
    for slip in (one for one in slips if one.kind == "base-unmade"):
        owner, *given = slip.name.split()
        if message.startswith(tuple(f"'{owner}' object has no attribute '{name}'" for name in given)):
            return slip.message, f"in {slip.file}, {slip.fix}"
    return None


def _attribute(message: str, source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    if meaning := uncalled_proxy(message, source):
        return meaning
    if found := re.match(r"'(Duration|int|float)' object has no attribute 'sleep'", message):
        what = "a Duration is a length of time" if found[1] == "Duration" else "this is a plain number"
        return f"{what}, and only a Rate sleeps", MAKE_RATE
    if (twice := _IN_ITSELF.search(message)) and re.search(rf"\b{twice[1]}\.{twice[1]}\b", source):
        name = twice[1]
        cause = f"`from {name} import {name}` makes `{name}` what is in the module, and not the module"
        return cause, f"write `{name}` instead of `{name}.{name}`"
    if found := re.match(r"'(tuple|list|dict)' object has no attribute 'encode'", message):
        hint = 'put the values into the text with `%`: `"… %s" % value`, not after a comma'
        return f"a string is published here, and this is a {found[1]}", hint
    if "'member_descriptor' object" in message:
        name = source.partition(".")[0].strip()
        return (
            f"`{name}` is the type of the messages, not a message",
            f"write brackets where it is made: `{name} = …()`",
        )
    return _none(source) if "'NoneType' object" in message else None


def _zero(_message: str, source: str, _marked: tuple[int, int] | None) -> Meaning:
    rate = next((meaning for call in calls_in_line(source, "Rate") if (meaning := explain_rate(call))), None)
    return rate or ("it divides by zero", "check that the divisor is not 0 before you divide")


def _file(message: str, source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    found = _NO_FILE.search(message)
    if found is None or found[1].startswith("/dev/"):
        return None
    path = found[1]
    here = f"os.path.join(os.path.dirname(os.path.abspath(__file__)), '{shown(path.rpartition('/')[2])}')"
    if path.startswith(("/", "~")):
        if any(_is_to_write(call) for call in calls_in_line(source, "open")):
            return "no other machine has this path", _below_home(path)
        return (
            "no other machine has this path",
            f"keep the file beside the script, and open `{here}`, with `import os` at the top",
        )
    return (
        "a path is looked for where the node is started, not beside the script",
        f"open `{here}` wherever it is opened, with `import os` at the top",
    )


def _unwritable(message: str, _source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    """Of a file where only the administrator may write."""
    found = _NOT_WRITABLE.search(message)
    if found is None or found[1].startswith("/dev/"):
        return None
    hint = f"delete the line that opens it if the lab asks for no file, or {_below_home(found[1])}"
    return "a node may not write to this place", hint


def _is_to_write(call: ast.Call) -> bool:
    mode = (
        call.args[1]
        if len(call.args) > 1
        else next((k.value for k in call.keywords if k.arg == "mode"), None)
    )
    return isinstance(mode, ast.Constant) and bool(re.search(r"[wax]", str(mode.value)))


def _below_home(path: str) -> str:
    """Return how a file is written that the node makes itself."""
    return f"open `os.path.expanduser('~/{shown(path.rpartition('/')[2])}')`, with `import os` at the top"


def _command(message: str, _source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    if not (found := _COMMAND.match(message)):
        return None
    hint = "leave it out, or catch the error: a graded node has neither your folder nor a network"
    return f"the command `{shown(found[1])}` fails (exit code {found[2]})", hint


def _service(message: str, _source: str, _marked: tuple[int, int] | None) -> Meaning | None:
    if absent := re.match(r"service \[(\S+)\] unavailable", message):
        hint = f"wait for it before the call: `rospy.wait_for_service('{shown(absent[1])}')`"
        return "no node offers the service yet, or only under another name", hint
    if "md5sum" in message:
        hint = "give both the same .srv, with the names and types of the handout, and build again"
        return "the service's type differs from the type that is called", hint
    if "responded with an error" in message and not re.search(r"error processing|handler returned", message):
        hint = "put the call below `try:`, and write `except rospy.ServiceException as error:` for it"
        return "the server refuses, and no `except` of the script is for that", hint
    return None


_TO_CATCH = {
    "ServiceException": "rospy.ServiceException",
    "ROSException": "rospy.ROSException",
    **dict.fromkeys(
        ("LookupException", "ExtrapolationException", "ConnectivityException"), "tf2_ros.TransformException"
    ),
}


def explain_narrow_handler(found: Traceback, place: FileCitation, package: PackageFacts) -> Meaning | None:
    """Return the `except` around a line that is for other exceptions, and what to write there."""
    wanted = _TO_CATCH.get(found.kind, "")
    # such a call only fails for a reason that has to be removed
    if not wanted or re.search(
        r"unavailable|md5sum|error processing|handler returned|init_node", found.message
    ):
        return None
    tries = [s for s in package.slips if (s.kind, s.file) == ("catches", place.file)]
    around = [s for s in tries if place.line and _spans(s.name, place.line)]
    slip = max(around, key=lambda s: int(s.name.partition("-")[0]), default=None)
    names = slip.message.split() if slip else []
    if slip is None or any(re.search(rf"Interrupt|SystemExit|{found.kind}$", name) for name in names):
        return None
    if all(name.startswith("tf.") for name in names):
        wanted = wanted.replace("tf2_ros.TransformException", "tf.Exception")
    caught = f"{wanted}{f' as {slip.fix}' if slip.fix else ''}"
    why = f"the `except` on line {slip.line} is for {join_words(names, 'or')}"
    return why, f"on line {slip.line}, write `except {shown(caught)}:`"


def _spans(lines: str, line: int) -> bool:
    first, _, last = lines.partition("-")
    return int(first) <= line <= int(last)


_EXPLAINED: dict[str, Callable[[str, str, tuple[int, int] | None], Meaning | None]] = {
    "IndexError": _index,
    "KeyError": _key,
    "ValueError": _value,
    "OverflowError": lambda message, source, _: _not_finite(message, source),
    "TypeError": _type,
    "UnboundLocalError": _local,
    "AttributeError": _attribute,
    "ExtrapolationException": _future,
    "FileNotFoundError": _file,
    **dict.fromkeys(("PermissionError", "OSError"), _unwritable),
    "CalledProcessError": _command,
    "ServiceException": _service,
    "ZeroDivisionError": _zero,
    "StopIteration": lambda *_: (
        "what `next(…)` goes through has no more values",
        "let it begin again: `while True:` around the loop in it that has a `yield`, or `itertools.cycle(…)`",
    ),
    "RecursionError": lambda *_: (
        "a function calls itself endlessly",
        "for its smallest values, return without that call, or loop",
    ),
}
