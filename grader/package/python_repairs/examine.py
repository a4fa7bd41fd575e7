"""Finds mistakes in Python sources that do not run as meant, and repairs their text. The standard library only.

`examine` is the entry; it runs in a child process with limits (`limited_child.py`). Pairs of a file's name and its text
come in; for each, the steps go out (a mistake, and the text that has it repaired), and the names that the last text
uses. Nothing is executed. What does not parse is for `syntax.py`, calls are for `calls.py`;
`package/repairs/python.py` puts the answer in words.
"""

from __future__ import annotations

import ast
import builtins
import re
import sys
import warnings
from collections.abc import Iterator
from itertools import islice, pairwise
from pathlib import PurePosixPath
from typing import Any

from grader.package.lint.script_names import never_main
from grader.package.python_repairs.blocks import syntax_error
from grader.package.python_repairs.calls import (
    with_arguments,
    with_callbacks,
    with_calls,
    with_definitions_first,
    with_lines_turned,
    with_publish_uncommented,
    with_quoted_calls,
    with_values_called,
)
from grader.package.python_repairs.imports import (
    with_classes,
    with_imports,
    with_message_classes,
    without_suffixes,
)
from grader.package.python_repairs.lines_outside import LOOPED, with_lines_inside
from grader.package.python_repairs.lost_heads import lost_head, lost_method
from grader.package.python_repairs.members import Known, with_members
from grader.package.python_repairs.names import (
    ROSPY,
    bound_in,
    meant_by,
    old_methods,
    with_methods,
    with_names,
    with_parameters,
    with_self,
    with_targets,
)
from grader.package.python_repairs.python2 import as_python3
from grader.package.python_repairs.rospy_names import (
    runs_of,
    with_attributes,
    with_call_imported,
    with_init,
    with_logger,
    with_named_node,
    with_node_first,
    with_rospy,
    with_times,
)
from grader.package.python_repairs.shared_variables import with_globals
from grader.package.python_repairs.syntax import (
    Step,
    edited,
    last_name,
    make_readable,
    nodes_in,
    span_of,
    step_to,
    tree_of,
)
from grader.wording import is_one_edit

OLD_NAMES = {"raw_input": "input", "xrange": "range", "unicode": "str", "basestring": "str", "unichr": "chr"}
WAITING = frozenset({"Subscriber", "Service", "Timer", "SimpleActionServer"})
"""What a node that only waits is made of."""
HOLDING_NAMES = (
    "exec_ execute join main mainloop pause rosrun rostest run run_forever run_until_complete send_goal_and_wait "
    "serve_forever show unitrun wait wait_for_result Thread"
)
HOLDING = frozenset(HOLDING_NAMES.split())
"""What keeps a node alive: of threads, windows, asyncio, state machines, tests, and of a goal that is waited for."""
OF_TWO_FRAMES = {"lookup_transform", "can_transform", "lookupTransform", "canTransform", "waitForTransform"}
ROLES = {
    "Publisher": "publisher",
    "Subscriber": "subscriber",
    **dict.fromkeys(("Service", "SimpleActionServer", "ActionServer"), "server"),
    **dict.fromkeys(("ServiceProxy", "wait_for_service", "SimpleActionClient", "ActionClient"), "client"),
    "init_node": "node",
    **dict.fromkeys(("get_param", "has_param"), "param"),
    **dict.fromkeys(("set_param", "delete_param"), "set-param"),
}


def examine(
    files: list[list[str]], types: list[str], fields: dict[str, dict[str, list[str]]], site: str
) -> Iterator[dict[str, Any]]:
    """Yield for each pair of name and text its steps and its names. `types` are message types that the lab uses,
    `fields` are those of the submission's own messages, by package and class, `site` is the folder that has fissix."""
    warnings.simplefilter("ignore")
    sys.path.append(site)
    imports = {file: set(re.findall(r"\w+", " ".join(re.findall(IMPORTED, text)))) for file, text in files}
    imported = {part for parts in imports.values() for part in parts}
    own = {PurePosixPath(file).stem: text for file, text in files}
    makes_node = any("init_node" in text for name, text in own.items() if name in imported)
    for file, text in files:
        try:
            name = PurePosixPath(file).stem
            # a module of the package may make the node of a script that imports it
            node = "" if makes_node and imports[file] & own.keys() else name
            steps = list(_steps(text, types, Known(ROSPY, fields), node, is_run=name not in imported))
            names = _names(steps[-1]["text"] if steps else text)
        except (RecursionError, MemoryError):
            steps, names = [], []
        yield {"file": file, "steps": steps, "names": names}


IMPORTED = re.compile(r"^\s*(?:from|import)\s+([\w.]+(?:\s+import\s+\w+)?)", re.MULTILINE)


def _steps(text: str, types: list[str], known: Known, node: str, *, is_run: bool = True) -> Iterator[Step]:
    """Yield what is wrong in a script that `is_run`, or in a module that others import. `node` is a name for the node
    that the script does not make; "" where another file may make it."""
    for step in _readable(text):
        text = step["text"]
        yield step
    seen = {text}
    if syntax_error(text) is None:
        for repair in (
            _without_old_names,
            _without_old_print,
            with_rospy,
            lambda t: without_suffixes(t, types),
            lambda t: with_classes(t, types),
            lambda t: with_imports(t, types),
            with_self,
            lambda t: with_members(t, known),
            _with_quotes,
            with_names,
            with_targets,
            with_attributes,
            with_logger,
            with_methods,
            with_parameters,
            with_message_classes,
            with_values_called,
            with_times,
            with_calls,
            with_quoted_calls,
            with_publish_uncommented,
            with_callbacks,
            lambda t: with_arguments(t, types),
            lambda t: with_named_node(t, node),
            with_globals,
            with_lines_turned,
            with_definitions_first,
            with_lines_inside,
            _with_start,
            with_node_first,
            *((_with_main, lambda t: with_init(t, node), _with_server_started, _with_spin) if is_run else ()),
        ):
            for step in repair(text):
                if step["text"] in seen:  # two repairs that undo each other would do so for ever
                    break
                text = step["text"]
                seen.add(text)
                yield step


BLANKS = re.compile(r"^[ \t]+", re.MULTILINE)


def _readable(text: str) -> list[Step]:
    """Return the steps after which it parses. A text that begins its lines with tabs alone is read with four spaces in
    place of each, and gets its tabs back."""
    spaced = BLANKS.sub(lambda found: found[0].replace("\t", "    "), text)
    if spaced == text or _with_tabs(spaced) != text:
        return make_readable(text)
    return [{**step, "text": _with_tabs(step["text"])} for step in make_readable(spaced)]


def _with_tabs(text: str) -> str:
    return BLANKS.sub(lambda found: found[0].replace("    ", "\t"), text)


# ---- what parses, and is not meant


def _without_old_names(text: str) -> Iterator[Step]:
    tree, lines = tree_of(text), text.split("\n")
    bound = bound_in(tree)
    if any(map(_asks_for_version, nodes_in(tree))):
        return
    tried = {id(n) for one in nodes_in(tree) if isinstance(one, ast.Try) for n in _caught_in(one)}
    uses = [n for n in nodes_in(tree) if isinstance(n, ast.Name) and n.id in OLD_NAMES and n.id not in bound]
    uses = [n for n in uses if id(n) not in tried]
    found = [(n.id, span, OLD_NAMES[n.id]) for n in uses if (span := span_of(lines, n))]
    found += old_methods(tree, text)
    if found:
        names = ", ".join(sorted({name for name, _, _ in found}))
        after = edited(text, [(*span, new) for _, span, new in found])
        yield from step_to("old-name", min(span[0] for _, span, _ in found) + 1, text, after, names)


def _asks_for_version(node: ast.AST) -> bool:
    """Return whether a script may run under Python 2 as well, and use what that has only there."""
    if isinstance(node, ast.ExceptHandler):
        return node.type is not None and "NameError" in ast.unparse(node.type)
    return isinstance(node, ast.Attribute) and node.attr in OF_VERSION


OF_VERSION = ("version_info", "version", "hexversion", "PY2", "PY3", "python_version")


def _caught_in(node: ast.Try) -> Iterator[ast.AST]:
    """Yield the nodes of a `try:` whose `except` has an assignment's name missing (`input = raw_input`)."""
    plain = [one for one in node.body if isinstance(one, ast.Assign | ast.Import | ast.ImportFrom)]
    if any(one.type is None or "Exception" in ast.unparse(one.type) for one in node.handlers):
        yield from (n for one in plain for n in nodes_in(one))


def _without_old_print(text: str) -> Iterator[Step]:
    """`print >>file, x` parses, as a shift."""
    for node in nodes_in(tree_of(text)):
        value = node.value if isinstance(node, ast.Expr) else None
        first = value.elts[0] if isinstance(value, ast.Tuple) and value.elts else value
        shifts = isinstance(first, ast.BinOp) and isinstance(first.op, ast.RShift)
        if first is not None and shifts and last_name(getattr(first, "left", None)) == "print":
            for after in as_python3(text.split("\n"), first.lineno - 1):
                for step in step_to("old-name", first.lineno, text, after, "print >>"):
                    text = step["text"]
                    yield step


def _with_quotes(text: str) -> Iterator[Step]:
    """`Publisher(chatter, …)`, for `Publisher('chatter', …)`: a name without a value, where ROS is told one; and
    `details[name]`, where the name stands for a key of parameters."""
    tree, lines = tree_of(text), text.split("\n")
    known = bound_in(tree) | set(dir(builtins))
    if "*" in known:
        return
    stored: dict[str, list[int]] = {}
    for name in (n for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)):
        stored.setdefault(name.id, []).append(name.lineno)
    arguments = {n.arg for n in nodes_in(tree) if isinstance(n, ast.arg)}
    texts = [n for n in _texts_of_ros(tree) if isinstance(n, ast.Name)]
    missing = [n for n in texts if n.id not in known and not meant_by(n.id, set(stored))]
    missing = [n for n in missing if n.id != "topic" and not n.id.endswith("name")]  # a variable, by its name
    assigned = [n for n in nodes_in(tree) if isinstance(n, ast.Assign)]
    own = {id(inner): last_name(n.targets[0]) for n in assigned for inner in nodes_in(n.value)}
    keys = [n for n in _keys_of_parameters(tree) if n.id not in arguments]
    own_keys = {id(n) for n in keys if stored.get(n.id) == [n.lineno] and own.get(id(n)) == n.id}
    unknown = [*missing, *(n for n in keys if n.id not in known or id(n) in own_keys)]
    spans = [(span, n.id) for n in unknown if (span := span_of(lines, n))]
    if spans:
        after = edited(text, [(*span, f"'{name}'") for span, name in spans])
        words = ", ".join(dict.fromkeys(name for _, name in sorted(spans)))
        yield from step_to("quotes", min(spans)[0][0] + 1, text, after, words)


def _texts_of_ros(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield what stands where ROS is told the name of a node, a topic, a parameter or a frame."""
    yield from (node for _, node in _named_texts(tree))
    for node in nodes_in(tree):
        if isinstance(node, ast.Call) and last_name(node.func) in OF_TWO_FRAMES:
            yield from node.args[:2]
        elif isinstance(node, ast.Assign) and last_name(node.targets[0]) in ("frame_id", "child_frame_id"):
            yield node.value


def _keys_of_parameters(tree: ast.Module) -> Iterator[ast.Name]:
    """Yield the names in the brackets behind what `get_param(…)` gives."""
    given = [
        (n.targets[0], getattr(n.value, "func", None)) for n in nodes_in(tree) if isinstance(n, ast.Assign)
    ]
    read = {ast.unparse(target) for target, function in given if last_name(function) == "get_param"}
    for node in nodes_in(tree):
        root: ast.expr | None = node if isinstance(node, ast.Subscript) else None
        while isinstance(root, ast.Subscript):
            root = root.value
        of_call = isinstance(root, ast.Call) and last_name(root.func) == "get_param"
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Name) and root is not None:
            yield from [node.slice] if of_call or ast.unparse(root) in read else []


def _with_start(text: str) -> Iterator[Step]:
    """A function or class whose first line is a comment, and that the script uses; or one that goes on after two blank
    lines: the first line of the next one is missing; or, where it makes the node or calls a function there, the line
    that begins the script's own part."""
    tree, lines = tree_of(text), text.split("\n")
    used = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)} - bound_in(tree)
    methods = {n.name for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)}
    used |= {"__init__", *(n.attr for n in nodes_in(tree) if isinstance(n, ast.Attribute))} - methods
    for number, found in enumerate(map(COMMENTED_HEAD.match, lines)):
        changed = "\n".join(
            [*lines[:number], *([found[1] + found[2]] if found else []), *lines[number + 1 :]]
        )
        is_method = found and re.search(r"\(\s*self\b", found[2])
        if found and found[3] in used and bool(is_method) == bool(found[1]) and syntax_error(changed) is None:
            yield from step_to("commented", number + 1, text, changed, found[3])
            return
    yield from islice(_with_method(text, tree, lines), 1)
    functions = [n for n in tree.body if isinstance(n, ast.FunctionDef)]
    started = any(isinstance(n, ast.Call) for one in runs_of(tree) for n in nodes_in(one))
    for function in functions:
        for before, after in pairwise(function.body):
            between = lines[before.end_lineno or after.lineno : after.lineno - 1]
            if sum(not line.strip() for line in between) < BLANK_LINES:
                continue
            rest = function.body[function.body.index(after) :]
            nodes = (n for one in rest for n in ast.walk(one))
            calls = {last_name(n.func) for n in nodes if isinstance(n, ast.Call)}
            head = lost_head(text, tree, rest)
            begins = not started and calls & {"init_node", *(one.name for one in functions)}
            line = head or ("if __name__ == '__main__':" if begins else "")
            changed = "\n".join([*lines[: after.lineno - 1], line, *lines[after.lineno - 1 :]])
            if line and syntax_error(changed) is None:
                yield from step_to("start", after.lineno, text, changed, function.name)
                return


def _with_method(text: str, tree: ast.Module, lines: list[str]) -> Iterator[Step]:
    """A method without its first line, which the method above it goes on with, or a function below a class."""
    owners = [n for n in tree.body if isinstance(n, ast.ClassDef)]
    methods = [n for one in owners for n in one.body if isinstance(n, ast.FunctionDef)]
    blocks: list[ast.ClassDef | ast.FunctionDef] = [*owners, *methods]
    for block in blocks[:BLOCKS_MAX]:
        kept = {n.id for n in nodes_in(block) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        for before, after in pairwise(block.body[:BLOCKS_MAX]):
            first = after.lineno - 1
            apart = sum(not line.strip() for line in lines[before.end_lineno or 0 : first])
            body = "\n".join(lines[first : block.end_lineno])
            rest = block.body[block.body.index(after) :]
            head = ""
            if block in owners and apart >= BLANK_LINES:
                head = lost_head(text, tree, rest)
            elif block in methods and apart and DOES_WORK.search(body) and not SETS_UP.search(body):
                head = lost_method(text, tree, next(one for one in owners if block in one.body), rest)
                head = f"{lines[block.lineno - 1][: block.col_offset]}{head}" if head else ""
            changed = "\n".join([*lines[:first], head, *lines[first:]])
            if head and kept.isdisjoint(re.findall(r"\w+", head)) and syntax_error(changed) is None:
                yield from step_to("line", first + 1, text, changed, head.strip())


DOES_WORK = re.compile(r"\.data\b|\bpublish\(|\blog\w+\(|\bprint\(|\bspin\(|\bsleep\(|\breturn\b")
SETS_UP = re.compile(r"\b(?:Publisher|Subscriber|Timer|Rate|Service|ServiceProxy|init_node)\(")
COMMENTED_HEAD = re.compile(r"(\s*)#[#\s]*((?:def|class)\s+(\w+).*:)\s*$")


BLOCKS_MAX, BLANK_LINES = 40, 2
"""So many blocks are searched; so many blank lines stand between a function and what comes after it (PEP 8)."""


def _with_main(text: str) -> Iterator[Step]:
    """A script that calls nothing, or only where `__name__` has a value that it never has."""
    tree, lines = tree_of(text), text.split("\n")
    for node in nodes_in(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Compare):
            why, span = _never_main(node, tree), span_of(lines, node.test)
            if why and span:
                right = edited(text, [(*span, "__name__ == '__main__'")])
                yield from step_to("guard", node.lineno, text, right, why)
            if why or "__name__" in ast.unparse(node.test):
                return
    if any(isinstance(n, ast.Call) for one in runs_of(tree) for n in nodes_in(one)):
        return
    functions = [f for f in tree.body if isinstance(f, ast.FunctionDef)]
    functions = [f for f in functions if len(f.args.args) == len(f.args.defaults)]
    makers = [
        f for f in functions if any(last_name(getattr(n, "func", None)) == "init_node" for n in nodes_in(f))
    ]
    named = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)}
    if len(makers) == 1 and makers[0].name not in named:
        after = f"{text.rstrip()}\n\n\nif __name__ == '__main__':\n    {makers[0].name}()\n"
        yield from step_to("main", makers[0].lineno, text, after, makers[0].name)


def _never_main(guard: ast.If, tree: ast.Module) -> str:
    """Return why the comparison of an `if` for `__name__ == '__main__'` never holds; "" where it may hold, or where
    another word than that one may be meant."""
    odd, why = never_main(guard, tree)
    word = odd.strip("'\"")
    is_near = word.strip("_ ").lower() == "main" or is_one_edit(word, "__main__")
    return why if is_near or not why.startswith("`__name__` is never") else ""


def _with_server_started(text: str) -> Iterator[Step]:
    """An action server that waits for a `start()`, where nothing in the file calls or names one."""
    tree, lines = tree_of(text), text.split("\n")
    if any(isinstance(node, ast.Attribute) and node.attr == "start" for node in nodes_in(tree)):
        return
    for node in nodes_in(tree):
        made = node.value if isinstance(node, ast.Assign) else None
        if not isinstance(node, ast.Assign) or not isinstance(made, ast.Call):
            continue
        waits = [k for k in made.keywords if k.arg == "auto_start" and ast.unparse(k.value) == "False"]
        before = lines[node.lineno - 1][: node.col_offset]
        if last_name(made.func) == "SimpleActionServer" and waits and not before.strip():
            last, call = node.end_lineno or node.lineno, f"{ast.unparse(node.targets[0])}.start()"
            after = "\n".join([*lines[:last], f"{before}{call}", *lines[last:]])
            yield from step_to("server", last, text, after, call)
            return


def _with_spin(text: str) -> Iterator[Step]:
    """A node that only waits for messages, and ends at once."""
    tree = tree_of(text)
    calls = [n for n in nodes_in(tree) if isinstance(n, ast.Call)]
    waits = [c for c in calls if last_name(c.func) in WAITING]
    spin, text_now = with_call_imported(text, "spin")
    loops = any(isinstance(n, ast.While) for n in nodes_in(tree))
    makes_node = any(last_name(c.func) == "init_node" for c in calls)
    own = {n.name for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)}
    runs = any(isinstance(n, ast.Call) for one in runs_of(tree) for n in nodes_in(one))
    if not waits or loops or not spin or not makes_node or not runs:
        return
    if (LOOPED | (HOLDING - own)) & {last_name(c.func) for c in calls}:
        return
    if any(isinstance(f, ast.FunctionDef) and _is_own_callback(f, waits) for f in tree.body):
        return  # it would wait in its own callback
    lines = text_now.split("\n")
    block = _last_block(tree, waits)
    last = block[-1]
    before = isinstance(last, ast.Return) or (len(block) == 1 and isinstance(last, ast.Pass))
    first_line = lines[last.lineno - 1]
    indentation = first_line[: len(first_line) - len(first_line.lstrip())]
    at = last.lineno - 1 if before else last.end_lineno or last.lineno
    after = "\n".join([*lines[:at], f"{indentation}{spin}()", *lines[at:]])
    changed = (n for n, pair in enumerate(zip(text.split("\n"), lines, strict=True), 1) if len({*pair}) > 1)
    imported = f"`spin` behind what line {first} imports, and " if (first := next(changed, 0)) else ""
    yield from step_to("spin", at + 1, text, after, f"{imported}{spin}()")


def _is_own_callback(function: ast.FunctionDef, waits: list[ast.Call]) -> bool:
    """Return whether a function subscribes, and gives itself as the callback."""
    given = [c for c in waits if function.name in map(last_name, c.args)]
    return any(c in given for c in nodes_in(function))


def _last_block(tree: ast.Module, waits: list[ast.Call]) -> list[ast.stmt]:
    """The body in which the node would have to stay: of the function that subscribes, or else of the script."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and any(c in set(nodes_in(node)) for c in waits):
            return node.body
    block = tree.body
    while isinstance(block[-1], ast.If | ast.Try):
        block = block[-1].body
    return block


# ---- turns to the wrong side


def with_sign_turned(text: str, side: str) -> Iterator[Step]:
    """Yield the text with the other sign for the only turn that can be to the wrong `side`: a number of that sign, or
    else what is calculated, which alone counts where no side is known."""
    if syntax_error(text) is not None:
        return
    tree, lines = tree_of(text), text.split("\n")
    turns = _turns(tree)
    plain = [one for one in turns if side and (sign := _sign(one)) and (sign > 0) == (side == "left")]
    worked_out = [one for one in turns if _sign(one) is None]
    found = plain if not worked_out else worked_out if not plain else []
    span = span_of(lines, found[0]) if len(found) == 1 else None
    if span is not None:
        line, start, end = span
        after = edited(text, [(line, start, end, _other_sign(found[0], lines[line][start:end]))])
        yield from step_to("name", line + 1, text, after)


def _turns(tree: ast.Module) -> list[ast.expr]:
    """Return what `angular.z` is set to; where that is a variable, what it is set to; where only its bounds are kept,
    nothing."""
    asking = [n for n in nodes_in(tree) if isinstance(n, ast.If) and ".angular.z" in ast.unparse(n.test)]
    bounded = {id(inner) for n in asking for inner in nodes_in(n)}
    found: list[ast.expr] = []
    for node in nodes_in(tree):
        target = node.targets[0] if isinstance(node, ast.Assign) else None
        if isinstance(node, ast.Assign) and isinstance(target, ast.Attribute) and id(node) not in bounded:
            found += [node.value] if target.attr == "z" and last_name(target.value) == "angular" else []
        elif isinstance(node, ast.keyword) and node.arg == "angular" and isinstance(node.value, ast.Call):
            found += [*node.value.args[2:3], *(k.value for k in node.value.keywords if k.arg == "z")]
    given = {ast.unparse(one) for one in found if isinstance(one, ast.Name | ast.Attribute)}
    made = [n for n in nodes_in(tree) if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) in given]
    stored = {ast.unparse(n.targets[0]) for n in made}
    return [*(one for one in found if ast.unparse(one) not in stored), *(n.value for n in made)]


def _sign(value: ast.expr) -> float | None:
    """Return a number whose sign is that of the turn; None where it is worked out."""
    if isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.USub):
        sign = _sign(value.operand)
        return None if sign is None else -sign
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Mult | ast.Div):
        left, right = _sign(value.left), _sign(value.right)
        return None if left is None or right is None else left * right
    if last_name(value) == "pi":
        return 1.0
    number = value.value if isinstance(value, ast.Constant) else None
    return float(number) if isinstance(number, int | float) else None


def _other_sign(value: ast.expr, text: str) -> str:
    if isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.USub):
        return text[1:].lstrip()
    first = value.left if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Mult | ast.Div) else value
    if isinstance(first, ast.UnaryOp) and isinstance(first.op, ast.USub) and text.startswith("-"):
        return text[1:].lstrip()
    plain = isinstance(first, ast.Constant | ast.Name | ast.Attribute | ast.Call | ast.Subscript)
    return f"-{text}" if plain else f"-({text})"


# ---- names that ROS is told


def _names(text: str) -> list[dict[str, Any]]:
    """Return the texts that name a topic, a node or a parameter, each with its role, value and place."""
    if syntax_error(text) is not None:
        return []
    tree, lines = tree_of(text), text.split("\n")
    constants, keys = _constants(tree), _keys_read(tree)
    found = []
    for role, node in _named_texts(tree):
        given = constants.get(node.id) if isinstance(node, ast.Name) else node
        if not isinstance(given, ast.Constant) or not isinstance(given.value, str):
            continue
        span = span_of(lines, given)
        if span is not None and _is_literal(lines[span[0]][span[1] : span[2]], given.value):
            place = {"line": span[0] + 1, "start": span[1], "end": span[2]}
            found.append({"role": role, "value": given.value, **place, "keys": keys.get(id(node), [])})
    return found


def _keys_read(tree: ast.Module) -> dict[int, list[str]]:
    """Return for the first argument of a call, by its identity, the keys that are read of what the call gives:
    `first` of `get_param('name')['first']`, and of `name['first']` below `name = get_param('name')`."""
    calls = {ast.unparse(n.targets[0]): n.value for n in nodes_in(tree) if isinstance(n, ast.Assign)}
    found: dict[int, list[str]] = {}
    for node in nodes_in(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            of = node.value if isinstance(node.value, ast.Call) else calls.get(ast.unparse(node.value))
            if isinstance(of, ast.Call) and of.args and isinstance(node.slice.value, str):
                found.setdefault(id(of.args[0]), []).append(node.slice.value)
    return found


def _named_texts(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    for call in nodes_in(tree):
        if isinstance(call, ast.Subscript) and isinstance(call.slice, ast.Constant):
            yield "key", call.slice
        if not isinstance(call, ast.Call):
            continue
        role = ROLES.get(last_name(call.func), "")
        keyword = "param_name" if role.endswith("param") else "name"
        given = [*call.args[:1], *(k.value for k in call.keywords if k.arg == keyword)]
        if role and given:
            yield role, given[0]


def _constants(tree: ast.Module) -> dict[str, ast.expr]:
    """Names that are given one value, once, in the whole file."""
    found: dict[str, list[ast.expr]] = {}
    assigned = (n for n in nodes_in(tree) if isinstance(n, ast.Assign))
    for target, value in ((target, n.value) for n in assigned for target in n.targets):
        if isinstance(target, ast.Name):
            found.setdefault(target.id, []).append(value)
    return {name: values[0] for name, values in found.items() if len(values) == 1}


def _is_literal(source: str, value: str) -> bool:
    return len(source) < 300 and source.endswith((f"'{value}'", f'"{value}"')) and "\n" not in value
