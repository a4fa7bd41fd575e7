"""What the sides of a sum or a comparison are that Python cannot add or compare."""

from __future__ import annotations

import ast
import re
from contextlib import suppress

from grader.checks.support.console_output import Frame, Traceback
from grader.checks.support.rospy_calls import fields_of, line_tree
from grader.checks.support.text import shown
from grader.line_slips.python import parsed
from grader.model.package import PackageFacts
from grader.wording import convert

_ADDED = re.compile(
    r"can only concatenate str \(not \"(\w+)\"\) to str|unsupported operand type\(s\) for \+=?: '(\w+)' and '(\w+)'"
)

_COMPARED = re.compile(
    r"not supported between instances of '(?:(str)' and '(?:int|float)|(?:int|float)' and 'str)'"
)
_BY_SIZE = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)


def explain_operand(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """A text or a message and something else are added, or text is compared with a number: which of both does not fit,
    where Python marks the place."""
    if compared := _compared_text(found) or _number_of_bytes(found):
        return compared
    if not (match := _ADDED.search(found.message)) or {"Time", "Duration"}.intersection(match.groups()):
        return None
    of_text = bool(match[1]) or "str" in match.groups()
    left = match[3] == "str" or (not of_text and bool(fields_of(package, match[2])))
    kind, is_right = (match[1], True) if match[1] else (match[2], False) if left else (match[3], True)
    other = _other_side(found.innermost, is_right=is_right)
    rest = _other_side(found.innermost, is_right=not is_right)
    if rest and kind.endswith("Response") and re.match(rf"(?:\w+\.)*{kind}\(", other):
        fix = f"leave out `{rest}` and the `+`: `{other}` alone is the answer"
        return f"nothing can be added to {other}, a whole answer", fix
    if fields := fields_of(package, kind):
        value = f"{other or 'msg'}.{fields[0]}"
        value = value if kind == "String" or not of_text else f"str({value})"
        whole = f"{other or 'one side'} is the whole message ({kind})"
        return whole, f"write `{value}` instead of `{other or 'msg'}`"
    return _beside_text(other, kind) if of_text else None


def _number_of_bytes(found: Traceback) -> tuple[str, str] | None:
    """`ord(…)` of what is a number already, as the items of bytes are under Python 3."""
    call = re.search(r"\bord\(\s*([\w.\[\]]+)\s*\)", found.innermost.source)
    if call is None or "ord() expected" not in found.message or "int found" not in found.message:
        return None
    return f"in Python 3, {call[1]} is a number already", f"write `{call[1]}` instead of `{call[0]}`"


def _compared_text(found: Traceback) -> tuple[str, str] | None:
    match, line = _COMPARED.search(found.message), re.sub(r"^\s*el(?=if\b)", "", found.innermost.source)
    sides = [
        n.left if match[1] else n.comparators[0]
        for n in (ast.walk(line_tree(line)) if match else ())
        if match and isinstance(n, ast.Compare) and len(n.ops) == 1 and isinstance(n.ops[0], _BY_SIZE)
    ]
    if len(sides) != 1:
        return None
    side, text = sides[0], shown(ast.unparse(sides[0]))
    made = isinstance(side, ast.Call) and getattr(side.func, "id", "") == "str" and len(side.args) == 1
    number = shown(ast.unparse(side.args[0])) if isinstance(side, ast.Call) and made else f"float({text})"
    return f"`{text}` is text, and is compared with a number", f"write `{number}` instead of `{text}`"


def _beside_text(other: str, kind: str) -> tuple[str, str]:
    """Return what stands beside a text in a sum, and is none."""
    if other and kind == "tuple":
        fix = f"where {other} gets its value, write `%` instead of the comma behind the text"
        return f"{other} is no text: a comma makes several values of it", fix
    if other:
        return f"{other} is not a string", convert("str", other)
    article = "an" if kind[0] in "aeiou" else "a"
    return f"{article} {kind} is not a string", "wrap it in `str(…)` before you add it to a string"


def _other_side(frame: Frame, *, is_right: bool) -> str:
    """Return the side of a sum that is not text: of the one that Python marks, or of the line's only one."""
    source = frame.source[slice(*frame.marked)] if frame.marked else frame.source
    with suppress(SyntaxError, ValueError, RecursionError):
        nodes = list(ast.walk(parsed(source)))
        sums = [n for n in nodes if isinstance(n, ast.BinOp) and isinstance(n.op, ast.Add)]
        if sums and (frame.marked or len(sums) == 1):
            return shown(ast.unparse(sums[0].right if is_right else sums[0].left))
        more = next((n for n in nodes if isinstance(n, ast.AugAssign)), None)
        if more is not None:
            return shown(ast.unparse(more.value if is_right else more.target))
    return ""


def _method_in_text(message: str, source: str) -> tuple[str, str] | None:
    """Of `'{:.1f}'.format(rospy.get_time)`: a function where its answer is meant."""
    if not re.match(
        r"unsupported format string passed to (?:builtin_function_or_)?(?:method|function)\.", message
    ):
        return None
    names: list[str] = []
    with suppress(SyntaxError, ValueError, RecursionError):
        nodes = list(ast.walk(parsed(source)))
        given = [n.value for n in nodes if isinstance(n, ast.FormattedValue)]
        calls = (n for n in nodes if isinstance(n, ast.Call) and getattr(n.func, "attr", "") == "format")
        given += [one for n in calls for one in (*n.args, *(keyword.value for keyword in n.keywords))]
        names = [shown(ast.unparse(n)) for n in given if isinstance(n, ast.Attribute | ast.Name)]
    if len(names) != 1:
        return (
            "a function is put into the text, and not what it returns",
            "write `()` behind the function's name",
        )
    return f"`{names[0]}` is a function, which is not called here", f"write `{names[0]}()`"


def _in_a_chain(message: str, source: str) -> tuple[str, str] | None:
    """Of `Robot().greet().stay()`, where `greet` has no `return`."""
    found = re.match(r"'NoneType' object has no attribute '(\w+)'", message)
    with suppress(SyntaxError, ValueError, RecursionError):
        for n in ast.walk(parsed(source)) if found else ():
            func = n.value.func if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Call) else None
            owner = func.value if isinstance(func, ast.Attribute) else None
            if found and func and isinstance(owner, ast.Call) and ast.unparse(n).endswith(f".{found[1]}"):
                name = shown(ast.unparse(func).rpartition(".")[2])
                return (
                    f"`{name}(…)` returns nothing to go on with",
                    f"write `return self` at the end of `{name}`",
                )
    return None


_EVENT_FIELDS = ("current_real", "current_expected", "last_real", "last_expected", "last_duration")


def _of_timer(message: str, source: str) -> tuple[str, str] | None:
    """Of a field that the event of a `rospy.Timer` has not, or has not in its first tick."""
    unset = list(dict.fromkeys(re.findall(r"\b(?:\w+\.)+last_(?:real|expected|duration)\b", source)))
    if "NoneType" in message and len(unset) == 1:
        called = re.match(r"'NoneType' object has no attribute '(\w+)'", message)
        hint = f"above that line, write `if {unset[0]} is None:`, and `return` in it"
        if called and f"{unset[0]}.{called[1]}" in source:
            hint = f"write `{unset[0].replace('.last_', '.current_')}`"
        return f"`{unset[0]}` is None in the timer's first call", hint
    found = re.match(r"'TimerEvent' object has no attribute '(\w+)'", message)
    if found is None:
        return None
    near = next((name for name in _EVENT_FIELDS if name.startswith(found[1])), "")
    hint = f"write `.{near}`" if near else "take one of these"
    return f"a timer's event has {', '.join(_EVENT_FIELDS)}", hint


def explain_by_definition(found: Traceback, package: PackageFacts) -> tuple[str, str] | None:
    """Return why a decorated function is None where it is called, or why a parameter has the value of another one."""
    source = found.own_frames[-1].source if found.own_frames else ""
    if (
        meaning := _method_in_text(found.message, source)
        or _of_timer(found.message, source)
        or _in_a_chain(found.message, source)
    ):
        return meaning
    if "on closed file" in found.message:
        closed = next((s for s in package.slips if (s.kind, s.name) == ("wrong-value", "closed")), None)
        hint = "close the file when the node ends: `rospy.spin()` stands within the `with` that opens it"
        return ("the file is closed already", hint) if closed is None else (closed.message, closed.fix)
    if found.kind == "AttributeError":
        swapped = (s for s in package.slips if (s.kind, s.name) == ("wrong-value", "swapped"))
        told = (s for s in swapped if "is given them the other way round" in s.message)
        owner = re.search(r"([A-Za-z_]\w*)\.\w+", source)
        return next(((s.message, s.fix) for s in told if owner and f"`{owner[1]}`" in s.message), None)
    if "'NoneType' object is not callable" not in found.message:
        return None
    slips = (s for s in package.slips if s.kind == "wrong-value" and s.name.startswith("decorator "))
    told = (s for s in slips if re.search(rf"\b{re.escape(s.name.split()[1])}\s*\(", source))
    return next(((one.message, one.fix) for one in told), None)
