"""Repairs of what belongs to an object: a dot that is missing or another sign, a misspelt member or argument.

The text of a script that parses comes in, and the steps go out that repair it, as in `calls.py`. It runs in a
child process as `examine.py` does: the standard library only, and nothing is executed.
"""

from __future__ import annotations

import ast
import builtins
import io
import math
import re
import time
import tokenize
from collections.abc import Collection, Iterator, Mapping
from difflib import get_close_matches
from itertools import chain
from typing import NamedTuple

from grader.package.lint.script_names import is_of_series
from grader.package.python_repairs.names import MEMBERS, bound_in, made_by, meant_by_use
from grader.package.python_repairs.syntax import Step, edited, last_name, nodes_in, span_of, step_to, tree_of
from grader.wording import is_one_edit

GIVES = {"Subscriber": "", "Service": "Request", "SimpleActionServer": "Goal"}
"""By what calls a callback: what the class of what it gets is called, behind the type's name."""
OF_TEXTS = tuple(name for name in dir(str) if not name.startswith("_"))
ALL_MEMBERS = frozenset(chain.from_iterable(MEMBERS.values()))
KEYWORDS = {
    "Publisher": ("queue_size", "latch", "data_class", "subscriber_listener", "tcp_nodelay", "name"),
    "Subscriber": ("queue_size", "callback", "callback_args", "data_class", "buff_size", "tcp_nodelay", "name"),
    "init_node": ("anonymous", "name", "argv", "log_level", "disable_signals"),
}  # fmt: skip
PLACE = re.compile(r"(?:(?<=\s)|^)[^\w\s%]?([sdf])$")
"""What is left of the `%s` at the end of a text."""

FIELD_NAMES = (
    "accel action_feedback action_goal action_result altitude angle_increment angle_max angle_min angular "
    "angular_velocity angular_velocity_covariance array axes binning_x binning_y buttons capacity cell_height "
    "cell_temperature cell_voltage cell_width cells channels charge child_frame_id count covariance current data "
    "data_offset datatype deserialize design_capacity distortion_model do_rectify echoes effort encoding feedback "
    "field_of_view fields fluid_pressure force format frame_id goal goal_id header height illuminance inertia "
    "info intensities intensity is_bigendian is_dense is_zero joint_names label latitude layout linear "
    "linear_acceleration linear_acceleration_covariance location longitude magnetic_field "
    "magnetic_field_covariance map_load_time max_range min_range name nsecs offset orientation "
    "orientation_covariance origin percentage point point_step points polygon pose poses position "
    "position_covariance position_covariance_type power_supply_health power_supply_status power_supply_technology "
    "present quaternion radiation_type range range_max range_min ranges relative_humidity resolution result "
    "rotation row_step scan_time secs serial_number serialize service size source stamp status step stride "
    "temperature theta time_increment time_ref to_nsec to_sec torque transform transforms translation twist type "
    "values variance vector velocity voltage width wrench x_offset y_offset "
)
OF_MESSAGES = tuple(FIELD_NAMES.split())
"""What belongs to messages of `OF_ROS`, without names of three letters and less, and to their times."""
OF_ROS = tuple(f"{one}_msgs.msg" for one in ("std", "geometry", "nav", "sensor"))

OF_SCANS = (
    *("header", "angle_min", "angle_max", "angle_increment", "time_increment", "scan_time"),
    *("range_min", "range_max", "ranges", "intensities"),
)
"""The fields of LaserScan, since another message has `range`."""

NUMBERS = [f"{kind}{bits}" for kind in ("Int", "UInt", "Float") for bits in (8, 16, 32, 64)]
OF_ONE_FIELD = frozenset(("Bool", "Byte", "Char", "String", *NUMBERS))
"""The messages of std_msgs that have `data` alone."""
DATA = frozenset({"data"})

Edit = tuple[tuple[int, int, int], str]
"""Line (from 0), start and end of what is replaced, and what is written for it."""


class Known(NamedTuple):
    """The names that rospy has, and the fields of the messages that packages of the submission define: by package, and
    in each by class."""

    of_rospy: Collection[str]
    defined: Mapping[str, Mapping[str, Collection[str]]]

    def fields(self, tree: ast.Module) -> dict[str, Collection[str]]:
        """Return the fields by class, without the classes of such a name that the script imports from elsewhere."""
        imports = (n for n in nodes_in(tree) if isinstance(n, ast.Import | ast.ImportFrom))
        names = [(getattr(n, "module", None) or a.name, a.asname or a.name) for n in imports for a in n.names]
        roots = {name.partition(".")[0] for of, name in names if of.partition(".")[0] not in self.defined}
        dotted = (ast.unparse(n) for n in nodes_in(tree) if isinstance(n, ast.Attribute))
        others = roots | {name.rpartition(".")[2] for name in dotted if name.partition(".")[0] in roots}
        every = (pair for classes in self.defined.values() for pair in classes.items())
        return {} if "*" in roots else {name: fields for name, fields in every if name not in others}


def with_members(text: str, known: Known) -> Iterator[Step]:
    """Yield the steps after which names of objects and of what belongs to them are as they are meant."""
    for find in (
        _dots,
        _misspelt_members,
        _misspelt_keywords,
        _lost_values,
        _lost_places,
        _whole_messages,
        _counted_messages,
        _values_behind,
        _lost_f,
    ):
        for edit, why in find(text, known):
            (line, _, _), _ = edit
            for step in step_to("argument", line + 1, text, edited(text, [(*edit[0], edit[1])]), why):
                yield step
                yield from with_members(step["text"], known)
                return


class _Names:
    """What the names of a script are: those that it gives a value, those of its objects alone, and what it reads of
    each by a dot."""

    def __init__(self, tree: ast.Module, of_rospy: Collection[str]) -> None:
        self.bound, self.own = bound_in(tree), _of_self(tree)
        self.known = self.bound | set(dir(builtins))
        self._members = {"rospy": set(of_rospy), "math": set(dir(math)), "time": set(dir(time))}
        for node in (n for n in nodes_in(tree) if isinstance(n, ast.Attribute)):
            if isinstance(node.value, ast.Name) and node.value.id != "rospy":
                self._members.setdefault(node.value.id, set(ALL_MEMBERS)).add(node.attr)
        calls = [n for n in nodes_in(tree) if isinstance(n, ast.Call) and last_name(n.func) in KEYWORDS]
        types = {ast.unparse(n) for one in calls for n in one.args if isinstance(n, ast.Attribute)}
        classes = [n for n in nodes_in(tree) if isinstance(n, ast.ClassDef)]
        self._types = types - {f"{one.name}.{name}" for one in classes for name in _members_of(one)}
        assigned = (n for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
        self._given = {n.id for n in assigned}

    def members_of(self, owner: str) -> Collection[str]:
        """Return what may stand behind a name and a dot."""
        return self.own if owner == "self" else self._members.get(owner, ALL_MEMBERS)

    def has_dot(self, first: tokenize.TokenInfo, sign: str, second: str) -> bool:
        """Return whether a dot is meant by the sign between two words."""
        if sign == "," and first.string == "self" and second in self.own:
            return not re.match(r"\s*def\b", first.line)
        if sign == "," and first.string in ("msg", "srv") and second[:1].isupper():
            return second not in self.known
        is_there = first.type == tokenize.NAME and first.string in self.bound | self.own
        is_member = second in self.members_of(first.string) and second not in self.known
        return is_there and is_member and sign in (",", ";", ":")

    def has_comma(self, first: tokenize.TokenInfo, second: tokenize.TokenInfo) -> bool:
        """Return whether a comma is meant by the dot between two words."""
        is_type = f"{first.string}.{second.string}" in self._types and first.string[:1].isupper()
        is_class = is_type and first.string in self.known - self._given
        is_named = second.type == tokenize.NAME and second.string in self.bound - self.own
        # a text has methods, whatever else in the script is called like one of them
        of_text = first.type == tokenize.STRING and not hasattr(str, second.string)
        return is_named and (of_text or is_class)


def _dots(text: str, known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `rospy,spin()` and `rospyspin()`, for `rospy.spin()`, and `"chatter". String`, for `"chatter", String`."""
    tree = tree_of(text)
    names = _Names(tree, known.of_rospy)
    if "*" in names.bound:
        return
    given = list(tokenize.generate_tokens(io.StringIO(text).readline))
    for first, sign, second in zip(given, given[1:], given[2:], strict=False):
        place = (sign.start[0] - 1, sign.start[1], sign.end[1])
        if names.has_dot(first, sign.string, second.string):
            yield (place, "."), f"a dot belongs between `{first.string}` and `{second.string}`"
        of_text = first.type == tokenize.STRING and "{" in first.string and second.string == "format"
        if of_text and sign.string == ",":
            yield (place, "."), "a dot belongs between the string and `format`"
        if sign.string == "." and names.has_comma(first, second):
            yield (place, ","), f"a comma belongs between `{first.string}` and `{second.string}`"
    # neither behind a dot nor as an argument's own name can two words be one
    alone = {(n.lineno, n.col_offset) for n in nodes_in(tree) if isinstance(n, ast.Name)}
    for name in (one for one in given if one.start in alone and one.string not in names.known):
        for owner in ("rospy", *sorted(names.bound - {"rospy"})):
            member = name.string.removeprefix(owner)
            if member != name.string and member in names.members_of(owner):
                span = (name.start[0] - 1, name.start[1], name.end[1])
                yield (span, f"{owner}.{member}"), f"the dot is missing in `{name.string}`"


def _of_self(tree: ast.Module) -> set[str]:
    """Return the attributes and methods that classes of the script have, and no plain name has."""
    nodes = list(nodes_in(tree))
    attributes = {n.attr for n in nodes if isinstance(n, ast.Attribute) and last_name(n.value) == "self"}
    classes = [n for n in nodes if isinstance(n, ast.ClassDef)]
    methods = {m.name for one in classes for m in one.body if isinstance(m, ast.FunctionDef)}
    tuples = (one.elts for one in nodes if isinstance(one, ast.Tuple))
    # `self, pub = …`, for `self.pub = …`
    beside = {
        id(n) for elements in tuples if last_name(next(iter(elements), None)) == "self" for n in elements
    }
    stored = (n for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
    plain = {n.arg for n in nodes if isinstance(n, ast.arg)} | {n.id for n in stored if id(n) not in beside}
    return (attributes | methods) - plain - {getattr(one, "name", "") for one in tree.body}


def _misspelt_members(text: str, known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `rate.slep()` and `msg.Data`."""
    tree, lines = tree_of(text), text.split("\n")
    kinds = {name: kind for name, kind in made_by(nodes_in(tree)).items() if kind}
    classes = [one for one in tree.body if isinstance(one, ast.ClassDef)]
    plain = {one.name: _members_of(one) for one in classes if {*map(ast.unparse, one.bases)} <= {"object"}}
    named = [(one, getattr(one, "name", "")) for one in tree.body]
    inside = {id(n): name for one, name in named if name in plain for n in nodes_in(one)}
    made = (n for n in nodes_in(tree) if isinstance(n, ast.Assign) and isinstance(n.value, ast.Call))
    of_rospy = {ast.unparse(t) for n in made for t in n.targets if re.match(r"rospy\.", ast.unparse(n.value))}
    stored = {n.attr for n in nodes_in(tree) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}
    fields_of, lacking = known.fields(tree), _Lacking(tree)
    of_ros, of_data = _inside_messages(tree, kinds), _instead_of_data(tree)
    messages = {**_messages_of_callbacks(tree, fields_of), **of_ros, **_heard_scans(tree)}
    for node in (n for n in nodes_in(tree) if isinstance(n, ast.Attribute)):
        members: Collection[str] = messages.get(id(node.value), ())
        of_text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        owner = ast.unparse(node.value)
        own = {} if owner in of_rospy else plain  # a class of the script may be called Publisher, too
        kind = inside.get(id(node), "") if owner == "self" else kinds.get(owner, owner.removesuffix("()"))
        fields = fields_of.get(kind, ()) if kind not in own else ()
        members = OF_TEXTS if of_text else own.get(kind) or MEMBERS.get(kind) or fields or members
        is_message = bool(fields) or id(node.value) in of_ros  # nothing else can be stored in one
        known_attr = node.attr in {*members, *(() if is_message else stored)}
        right = "" if known_attr else _near(node.attr, members)
        right = of_data.get(id(node), right)
        if not known_attr and not right and kind in ("Publisher", "Rate") and kind not in own:
            right = next(iter(get_close_matches(node.attr, members, 1, 0.85)), "")  # `pub.publisher(…)`
        elif not known_attr and not right and owner == "self" and kind in own:
            right = lacking.meant(node)
            local = None if right else lacking.local(node.attr)
            place = span_of(lines, local) if local is not None else None
            if place is not None:
                yield (
                    (place, f"self.{node.attr}"),
                    f"a value is given to `{node.attr}`, not to `self.{node.attr}`",
                )
        span = span_of(lines, node)
        if right and span is not None:
            line, _, end = span
            yield ((line, end - len(node.attr), end), right), f"`{node.attr}` is called `{right}`"


class _Lacking:
    """Finds which attribute of an object is meant by one that nothing in the script gives a value."""

    def __init__(self, tree: ast.Module) -> None:
        parts = [n for n in nodes_in(tree) if isinstance(n, ast.Attribute)]
        self._read = {n.attr for n in parts if isinstance(n.ctx, ast.Load)}
        self._member = {id(n.value): n.attr for n in parts}
        given = made_by(nodes_in(tree))
        self._given = {name[5:]: kind for name, kind in given.items() if re.fullmatch(r"self\.\w+", name)}
        names = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)} | {
            n.name for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)
        }
        self._is_made = bool(names & {"setattr", "hasattr", "getattr", "vars", "__getattr__"})
        """Whether attributes may come from elsewhere."""

        self._methods = [
            m
            for one in nodes_in(tree)
            if isinstance(one, ast.ClassDef)
            for m in one.body
            if isinstance(m, ast.FunctionDef) and [a.arg for a in m.args.args[:1]] == ["self"]
        ]

    def local(self, name: str) -> ast.Name | None:
        """Return where a method gives its own variable of that name a value, and does nothing with it; None where there
        is not one such place."""
        uses = [n for m in self._methods for n in nodes_in(m) if isinstance(n, ast.Name) and n.id == name]
        is_only = len(uses) == 1 and isinstance(uses[0].ctx, ast.Store) and not self._is_made
        return uses[0] if is_only else None

    def meant(self, node: ast.Attribute) -> str:
        if self._is_made or not isinstance(node.ctx, ast.Load):
            return ""
        return meant_by_use(node.attr, self._member.get(id(node), ""), self._given, self._read)


def _members_of(one: ast.ClassDef) -> tuple[str, ...]:
    """Return what the objects of a class have."""
    nodes, assigned = nodes_in(one), [s for s in one.body if isinstance(s, ast.Assign | ast.AnnAssign)]
    stored = [n.attr for n in nodes if isinstance(n, ast.Attribute) and not isinstance(n.ctx, ast.Load)]
    named = [n.id for s in assigned for n in nodes_in(s) if isinstance(n, ast.Name)]
    return (*(s.name for s in one.body if isinstance(s, ast.FunctionDef)), *stored, *named)


def _messages_of_callbacks(
    tree: ast.Module, fields: Mapping[str, Collection[str]]
) -> dict[int, Collection[str]]:
    """Return what belongs to the messages, requests and goals in callbacks, by the identity of each use: `data` where
    they are of std_msgs, else the fields that the package gives them."""
    imports = [n for n in nodes_in(tree) if isinstance(n, ast.ImportFrom) and n.module == "std_msgs.msg"]
    members = {**{a.asname or a.name: MEMBERS["message"] for n in imports for a in n.names}, **fields}
    named: dict[str, Collection[str]] = {}
    for call in (n for n in nodes_in(tree) if isinstance(n, ast.Call) and len(n.args) > 1):
        given = {str(k.arg): k.value for k in call.keywords}
        given |= dict(zip(("name", "type", "callback"), call.args, strict=False))
        kind, part = last_name(given["type"]), GIVES.get(last_name(call.func))
        callback = given.get("callback") or given.get("handler") or given.get("execute_cb")
        if part is not None and callback is not None:
            named[last_name(callback)] = members.get(f"{kind.removesuffix('Action')}{part}", ())
    return {
        id(use): named[function.name]
        for function in nodes_in(tree)
        if isinstance(function, ast.FunctionDef) and function.name in named and function.args.args
        for use in nodes_in(function)
        if isinstance(use, ast.Name) and use.id == function.args.args[-1].arg
    }


def _heard_scans(tree: ast.Module) -> dict[int, Collection[str]]:
    """Return the fields of a scan, by the identity of each parameter of a function that is asked for its `range`, in a
    script that imports LaserScan and not Range."""
    nodes = list(nodes_in(tree))
    classes = {
        a.name
        for n in nodes
        if isinstance(n, ast.ImportFrom) and n.module == "sensor_msgs.msg"
        for a in n.names
    }
    taken = {n.arg for n in nodes if isinstance(n, ast.arg)}
    parts = [
        n for n in nodes if isinstance(n, ast.Attribute) and n.attr == "range" and last_name(n.value) in taken
    ]
    is_plain = all(isinstance(n.value, ast.Name) and isinstance(n.ctx, ast.Load) for n in parts)
    is_scan = "LaserScan" in classes and classes.isdisjoint({"Range", "*"})
    return dict.fromkeys((id(n.value) for n in parts), OF_SCANS) if is_scan and is_plain else {}


def _inside_messages(tree: ast.Module, kinds: Mapping[str, str]) -> dict[int, Collection[str]]:
    """Return what may belong to what messages of ROS hold, by the identity of each use. `kinds` are the classes of
    names."""
    imports = [n for n in nodes_in(tree) if isinstance(n, ast.ImportFrom) and n.module in OF_ROS]
    classes = {a.asname or a.name for n in imports for a in n.names}
    made = {name for name, kind in kinds.items() if kind in classes}
    heard = _messages_of_callbacks(tree, dict.fromkeys(classes, OF_MESSAGES))
    found: dict[int, Collection[str]] = {}
    for node in (n for n in nodes_in(tree) if isinstance(n, ast.Attribute)):
        root = node.value
        while isinstance(root, ast.Attribute | ast.Subscript) and ast.unparse(root) not in made:
            root = root.value
        if len(node.attr) > 1 and (heard.get(id(root)) == OF_MESSAGES or ast.unparse(root) in made):
            found[id(node.value)] = OF_MESSAGES
    return found


def _instead_of_data(tree: ast.Module) -> dict[int, str]:
    """Return what is meant by the fields of messages that have `data` alone, by the identity of each use: `data` by
    `msg.counter` too, where nothing sets (or reads) that one as well."""
    nodes = nodes_in(tree)
    imports = [n for n in nodes if isinstance(n, ast.ImportFrom) and n.module == "std_msgs.msg"]
    classes = {a.asname or a.name for n in imports for a in n.names if a.name in OF_ONE_FIELD}
    given = [(n.value, ast.unparse(t)) for n in nodes if isinstance(n, ast.Assign) for t in n.targets]
    made, others = set[str](), set[str]()
    for value, target in given:
        is_made = isinstance(value, ast.Call) and last_name(value.func) in classes
        (made if is_made else others).add(target)
    heard = _messages_of_callbacks(tree, dict.fromkeys(classes, DATA))
    inner = {id(getattr(n, "func", getattr(n, "value", None))) for n in nodes if isinstance(n, WITH_INNER)}
    used: dict[tuple[str, bool], list[ast.Attribute]] = {}
    for node in (n for n in nodes if isinstance(n, ast.Attribute)):
        owner = ast.unparse(node.value)
        if id(node) not in inner and (owner in made - others or heard.get(id(node.value)) == DATA):
            used.setdefault((owner, isinstance(node.ctx, ast.Store)), []).append(node)
    found = {}
    for uses in used.values():
        is_alone = len({n.attr for n in uses}) == 1 and uses[0].attr[0] != "_"
        found.update({id(n): "data" if is_alone else _near(n.attr, DATA) for n in uses if n.attr != "data"})
    return found


WITH_INNER = (ast.Attribute, ast.Call, ast.Subscript)
"""What takes something of the value before it: a text's method, and no field."""


def _whole_messages(text: str, known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `'I heard ' + msg` in a callback, for `'I heard ' + str(msg.data)`; and `msg == 'stop'`, for `msg.data`."""
    tree, lines = tree_of(text), text.split("\n")
    messages = _messages_of_callbacks(tree, known.fields(tree))
    stored = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    for node in (n for n in nodes_in(tree) if isinstance(n, ast.BinOp) and isinstance(n.op, ast.Add)):
        parts: list[ast.expr] = [node.left, node.right]
        while isinstance(parts[0], ast.BinOp) and isinstance(parts[0].op, ast.Add):
            parts[:1] = [parts[0].left, parts[0].right]
        is_text = any(isinstance(p, ast.Constant) and isinstance(p.value, str) for p in parts)
        for one in parts if is_text else ():
            span = span_of(lines, one) if messages.get(id(one)) == MEMBERS["message"] else None
            if span is not None and isinstance(one, ast.Name) and one.id not in stored:
                why = f"`{one.id}` is the whole message, and no string can be added to it"
                yield (span, f"str({one.id}.data)"), why
    for one, name in _compared_names(tree):
        span = span_of(lines, one) if messages.get(id(one)) == MEMBERS["message"] else None
        if span is not None and one.id not in stored:
            yield (
                (span, f"{one.id}.data"),
                f"`{name}` is the whole message, and is compared with what is in it",
            )


def _compared_names(tree: ast.Module) -> Iterator[tuple[ast.Name, str]]:
    """Yield the names that are compared with a value, `msg == 'stop'`; or what such a name is given alone, in
    `command = msg`."""
    nodes = nodes_in(tree)
    tests = [[n.left, *n.comparators] for n in nodes if isinstance(n, ast.Compare)]
    plain = [t for t in tests if any(isinstance(p, ast.Constant) and p.value is not None for p in t)]
    names = [part for test in plain for part in test if isinstance(part, ast.Name)]
    yield from ((one, one.id) for one in names)
    compared = {one.id for one in names} - {
        ast.unparse(n.value) for n in nodes if isinstance(n, ast.Attribute)
    }
    for node in nodes:
        target = node.targets[0] if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
        given = getattr(node, "value", None)
        if isinstance(target, ast.Name) and target.id in compared and isinstance(given, ast.Name):
            yield given, target.id


def _counted_messages(text: str, _known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield the `count` of `count = count + 1`, `count > 127` and `count = 0`, for `count.data`, where it is made by
    `count = Int8()`."""
    tree, lines = tree_of(text), text.split("\n")
    given: dict[str, list[ast.Assign]] = {}
    for one in (n for n in nodes_in(tree) if isinstance(n, ast.Assign) and len(n.targets) == 1):
        given.setdefault(ast.unparse(one.targets[0]), []).append(one)
    for name, assigned in given.items():
        made = [n for n in assigned if last_name(getattr(n.value, "func", None)) in NUMBERS]
        counts = [n for n in assigned if _is_count(n.value, name)]
        operands = [n for n in _operands(tree) if ast.unparse(n).removesuffix(".data") == name]
        if not made or not operands or len(made) + len(counts) < len(assigned):
            continue
        whole = [n for n in (*operands, *(n.targets[0] for n in counts)) if ast.unparse(n) == name]
        for node in sorted(whole, key=lambda n: (n.lineno, n.col_offset)):
            if (span := span_of(lines, node)) is not None:
                kind = last_name(getattr(made[0].value, "func", None))
                yield (span, f"{name}.data"), f"`{name}` is the whole message ({kind}), and no number"


def _is_count(value: ast.expr, name: str) -> bool:
    """Return whether a value is a number, or what is calculated from the name or its `data`."""
    if isinstance(value, ast.BinOp):
        return ast.unparse(value.left).removesuffix(".data") == name
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float)


def _operands(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield what is added up or compared."""
    for node in nodes_in(tree):
        if isinstance(node, ast.BinOp):
            yield from (node.left, node.right)
        elif isinstance(node, ast.Compare):
            yield from (node.left, *node.comparators)
        elif isinstance(node, ast.AugAssign):
            yield node.target


def _misspelt_keywords(text: str, known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `Publisher(…, quue_size=10)`, and `queue_size10`."""
    tree, lines = tree_of(text), text.split("\n")
    taken = {**known.fields(tree), **KEYWORDS}
    for call in (n for n in nodes_in(tree) if isinstance(n, ast.Call)):
        keywords = tuple(taken.get(last_name(call.func), ()))
        for one in (k for k in call.keywords if keywords and k.arg and k.arg not in keywords):
            right, at = _near(str(one.arg), keywords), one.lineno - 1
            if right and at < len(lines) and (found := re.search(rf"\b{one.arg}(?=\s*=)", lines[at])):
                why = f"there is no argument `{one.arg}`: it is called `{right}`"
                yield ((at, *found.span()), right), why
        compared = [n for n in call.args if isinstance(n, ast.Compare) and isinstance(n.ops[0], ast.Eq)]
        for left in (n.left for n in compared if last_name(n.left) in keywords):
            span = span_of(lines, left)
            sign = lines[span[0]].find("==", span[2]) if span is not None else -1
            if span is not None and sign >= 0:
                yield ((span[0], sign, sign + 2), "="), "an argument of a call gets its value by `=`"
        for name in (n for n in call.args if isinstance(n, ast.Name)):
            glued = r"(queue_size|anonymous|latch)_?(\d+|True|False)"
            found = re.fullmatch(glued, name.id) if keywords else None
            span = span_of(lines, name) if found else None
            if found and span is not None:
                yield (span, f"{found[1]}={found[2]}"), f"`=` is missing between `{found[1]}` and its value"


def _lost_values(text: str, _known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `rate : rospy.Rate(10)` and `rate == rospy.Rate(10)`, which give a name no value."""
    tree, lines = tree_of(text), text.split("\n")
    stored = {ast.unparse(n) for n in nodes_in(tree) if isinstance(getattr(n, "ctx", None), ast.Store)}
    for one in (n.value for n in nodes_in(tree) if isinstance(n, ast.Expr)):
        left = one.left if isinstance(one, ast.Compare) and isinstance(one.ops[0], ast.Eq) else None
        span = span_of(lines, left) if left is not None and ast.unparse(left) not in stored else None
        sign = lines[span[0]].find("==", span[2]) if span is not None else -1
        if span is not None and sign >= 0:
            yield ((span[0], sign, sign + 2), "="), "a name gets its value by `=`, and not by `==`"
    for node in (n for n in nodes_in(tree) if isinstance(n, ast.AnnAssign) and n.value is None):
        span, kind = span_of(lines, node.target), node.annotation
        is_text = isinstance(kind, ast.Constant) and kind.value is not None
        is_text = is_text and not OF_TYPE.fullmatch(ast.unparse(kind))
        is_value = is_text or isinstance(kind, ast.Call | ast.BinOp)
        colon = lines[span[0]].find(":", span[2]) if span is not None else -1
        if is_value and span is not None and colon >= 0:
            yield ((span[0], colon, colon + 1), "="), "a name gets its value by `=`, and not by `:`"


OF_TYPE = re.compile(r"'([a-z]\w*\.)*[A-Z]\w*(\[.*\])?'")
"""A type whose name is written as a text: `'rospy.Publisher'`."""


def _lost_places(text: str, _known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `"hello world s" % x`, `"hello world %s" & x` and `"hello world %s" + x`."""
    tree, lines = tree_of(text), text.split("\n")
    calls = [n for n in nodes_in(tree) if isinstance(n, ast.Call) and len(n.args) > 1]
    sums = [n for n in nodes_in(tree) if isinstance(n, ast.BinOp)]
    with_values = {id(n) for one in calls for n in nodes_in(one.args[0])}
    with_values |= {id(n.left) for n in sums if isinstance(n.op, ast.Mod)}
    for node in sums:
        left, span = node.left, span_of(lines, node.left)
        if not isinstance(left, ast.Constant) or not isinstance(left.value, str) or span is None:
            continue
        line, start, end = span
        if isinstance(node.op, ast.BitAnd) and "%" in left.value and (at := lines[line].find("&", end)) >= 0:
            yield ((line, at, at + 1), "%"), "`%` belongs between a string and its values, and not `&`"
        plain = isinstance(node.right, ast.Name | ast.Attribute | ast.Call)
        added = isinstance(node.op, ast.Add) and plain and id(node) not in with_values
        alone = re.fullmatch(r"[^%]*%s\W*", left.value)
        if added and alone and (at := lines[line].find("+", end)) >= 0:
            yield ((line, at, at + 1), "%"), "`%` belongs between a string and its values, and not `+`"
        source = lines[line][start:end] if isinstance(node.op, ast.Mod) else ""
        if source and re.fullmatch(r"[^%]*%%[sdf][^%]*", left.value):
            yield (span, source.replace("%%", "%")), "`%%` is a plain `%`, and no place for a value"
        if source and "%" not in left.value and (right := with_place(source)):
            yield (span, right), "the string has no `%` in it"
        elif source and plain and "{}" in left.value and (end_of := span_of(lines, node)) is not None:
            right = f"{source}.format({ast.unparse(node.right)})"
            yield (
                (end_of, right),
                "the values of a string with `{}` are given by `.format(…)`, and not by `%`",
            )
        elif source and plain and "%" not in left.value and "{" not in left.value:
            yield (span, f"{source[:-1].rstrip()} %s{source[-1]}"), "the string has no `%` in it"


def _values_behind(text: str, _known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `rospy.loginfo("heard {}").format(x)`, and `pub.publish("heard %s") % x`."""
    tree, lines = tree_of(text), text.split("\n")
    for node in nodes_in(tree):
        called: ast.expr | None = None
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "format":
            called, sign = node.func.value, ".format(…)"
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod):
            called, sign = node.left, "%"
        if not isinstance(node, ast.expr) or not isinstance(called, ast.Call) or called.keywords:
            continue
        name, spans = last_name(called.func), [span_of(lines, n) for n in (node, called, *called.args)]
        places = [one for one in spans if one is not None]
        # `%` binds more closely than the `+` of a longer text
        is_text = len(called.args) == 1 and isinstance(called.args[0], ast.Constant | ast.JoinedStr)
        if not TAKES_TEXT.fullmatch(name) or not is_text or len(places) != len(spans):
            continue
        (line, start, end), (_, _, inner), (_, _, first) = places
        code = lines[line]
        right = f"{code[start:first]}{code[inner:end]}{code[first:inner]}"
        yield ((line, start, end), right), f"`{sign}` belongs to the string, in the brackets of `{name}(…)`"


TAKES_TEXT = re.compile(r"print|publish|log(debug|info|warn|err|fatal)")


def _lost_f(text: str, _known: Known) -> Iterator[tuple[Edit, str]]:
    """Yield `"heard {msg.data}"`, in whose brackets stand values that the script has."""
    tree, lines = tree_of(text), text.split("\n")
    nodes = nodes_in(tree)
    if any(last_name(n) in ("format", "format_map", "Template", "replace") for n in nodes):
        return
    known = bound_in(tree)
    inside = {
        id(part) for n in nodes if isinstance(n, ast.JoinedStr | ast.Expr) for part in ast.iter_child_nodes(n)
    }
    for node in (n for n in nodes if isinstance(n, ast.Constant)):
        span = span_of(lines, node) if id(node) not in inside else None
        places = re.findall(r"\{([^{}]*)\}", node.value) if isinstance(node.value, str) else []
        if (
            span is None
            or not places
            or not all(re.fullmatch(r"[A-Za-z_][\w.()\[\]]*", one) for one in places)
        ):
            continue
        line, start, end = span
        source = lines[line][start:end]
        is_plain = source[:1] in "'\"" and all(re.split(r"\W", one)[0] in known for one in places)
        if is_plain:
            yield (span, f"f{source}"), "the `f` in front of the string is missing"


def with_place(source: str) -> str:
    """Return the source of a text whose last word was `%s`, with its `%` again; "" of any other text."""
    quote, inner = source[-1:], source[:-1]
    changed = PLACE.sub(r"%\1", inner)
    return changed + quote if changed != inner and quote in "'\"" else ""


def _near(word: str, names: Collection[str]) -> str:
    """Return the name of which a word is a slip; "" where there is none, or a word of one letter may be any."""
    small = word.lower()
    same = [one for one in names if small == one.lower()]
    others = [one for one in names if len(word) > 1 and not is_of_series(small, one)]
    near = [one for one in others if is_one_edit(small, one)]
    return next(iter(same + near), "")
