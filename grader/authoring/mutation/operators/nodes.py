"""Names of nodes, how they live and end, what they log, and scripts that Python 3 does not run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from grader.authoring.mutation.registry import operator
from grader.authoring.mutation.rospy_code import (
    LOGS,
    argument,
    calls,
    each_script,
    last_name,
    loops,
    script_place,
    speech,
    text_literal,
)
from grader.authoring.mutation.solution import CodePlace, Solution
from grader.authoring.mutation.source_edits import (
    Function,
    Script,
    TextEdit,
    apply_edits,
    misspelt_literal,
    texts_in,
)
from grader.model.record import Record

# ---- names


def _init_nodes(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.Call]]:
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            yield script_place(script, call), script, call


def _anonymous(call: ast.Call) -> ast.keyword | None:
    return next((k for k in call.keywords if k.arg == "anonymous"), None)


def _is_anonymous(call: ast.Call) -> bool:
    keyword = _anonymous(call)
    return keyword is not None and isinstance(keyword.value, ast.Constant) and bool(keyword.value.value)


@operator(each=_init_nodes, fits="every script with a node whose name is written out")
def name_changed(script: Script, call: ast.Call) -> list[TextEdit]:
    """Gives the node another name."""
    name = text_literal(script, argument(call, 0, "name"))
    return [script.replace(name, repr(f"my_{name.value!s}"))] if name is not None else []


@operator(each=_init_nodes, fits="every script with an anonymous node")
def not_anonymous(script: Script, call: ast.Call) -> list[TextEdit]:
    """Leaves out `anonymous=True`."""
    keyword = _anonymous(call)
    return [script.replace(keyword.value, "False")] if keyword is not None and _is_anonymous(call) else []


@operator(each=_init_nodes, fits="every script with a node that is not anonymous")
def made_anonymous(script: Script, call: ast.Call) -> list[TextEdit]:
    """Makes the node anonymous where its plain name is asked for."""
    keyword = _anonymous(call)
    if _is_anonymous(call) or argument(call, 0, "name") is None:
        return []
    if keyword is not None:
        return [script.replace(keyword.value, "True")]
    end = max(script.span(node)[1] for node in (*call.args, *call.keywords))
    return [TextEdit(end, end, ", anonymous=True")]


# ---- how nodes live and end


class EndsParams(Record):
    """`turns`: how many rounds a loop makes before it ends."""

    turns: int = Field(default=30, ge=1)


def _lives(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.While | ast.Expr]]:
    """Find the loops that run until shutdown; in scripts without any, the calls of `spin`."""
    for script in solution.scripts:
        statements = (script.statement(call) for call in calls(script, "spin"))
        spins = [statement for statement in statements if isinstance(statement, ast.Expr)]
        for node in loops(script) or spins:
            yield script_place(script, node), script, node


@operator(each=_lives, params=EndsParams, fits="every script with a loop until shutdown or a spin")
def node_ends_by_itself(script: Script, life: ast.While | ast.Expr, params: EndsParams) -> list[TextEdit]:
    """Lets the node come to its end: a loop that is counted, or no rospy.spin()."""
    if isinstance(life, ast.Expr):
        return [script.remove(life)]
    return [TextEdit(script.span(life)[0], script.span(life.test)[1], f"for _ in range({params.turns})")]


@operator(each=_lives, fits="every script with a loop until shutdown or a spin")
def ctrl_c_swallowed(script: Script, life: ast.While | ast.Expr) -> list[TextEdit]:
    """Catches every exception and goes on, so that Ctrl-C does not end the node."""
    unit = script.unit
    if isinstance(life, ast.While):
        if not script.can_wrap(life.body):
            return []
        footer = ("except:", f"{unit}pass")
        return [script.replace(life.test, "True"), script.wrap(life.body, "try:", footer=footer)]
    if not script.has_lines(life):
        return []
    sleep = f"{unit * 2}rospy.rostime.wallsleep(0.1)"
    lines = ("while True:", f"{unit}try:", sleep, f"{unit}except:", f"{unit * 2}pass")
    return [script.before(life, *lines), script.remove(life)]


@operator(each=_lives, fits="every script with a loop until shutdown or a spin")
def traceback_on_exit(script: Script, life: ast.While | ast.Expr) -> list[TextEdit]:
    """Uses an undefined variable once the node has been told to end."""
    wrong = "print('stopped after', turns_so_far)"
    return [script.after(life, wrong)] if script.has_lines(life) else []


# ---- what nodes log

TEXT_LIMIT = 30
LEVELS = {"debug": "logdebug", "info": "loginfo", "warn": "logwarn", "error": "logerr", "fatal": "logfatal"}


class LevelParams(Record):
    """`level`: the level that is taken."""

    level: Literal["debug", "info", "warn", "error", "fatal"] = "warn"


def _logs(solution: Solution) -> Iterator[tuple[CodePlace, Script, ast.Expr, ast.Call]]:
    """Find what is printed or logged. A place has the first words, as they are in the source."""
    for script in solution.scripts:
        for statement in speech(script):
            call = statement.value
            if isinstance(call, ast.Call) and call.args:
                yield script_place(script, call, text=_first_words(script, call)), script, statement, call


def _first_words(script: Script, call: ast.Call) -> str:
    for text in (t for a in call.args for t in texts_in(a)):
        words = str(text.value) if isinstance(text, ast.Constant) else script.source(text)
        return " ".join(words.split())[:TEXT_LIMIT].rstrip()
    return script.source(call.args[0])[:TEXT_LIMIT]


@operator(each=_logs, params=LevelParams, fits="every call of rospy's logging")
def log_level(script: Script, _statement: ast.Expr, call: ast.Call, params: LevelParams) -> list[TextEdit]:
    """Logs at another level."""
    if last_name(call.func) not in LOGS or not isinstance(call.func, ast.Attribute):
        return []
    return [script.replace(call.func, f"{script.source(call.func.value)}.{LEVELS[params.level]}")]


@operator(each=_logs, fits="every line that prints or logs a text")
def log_text(script: Script, _statement: ast.Expr, call: ast.Call) -> list[TextEdit]:
    """Misspells what it prints or logs."""
    texts = [t for a in call.args for t in texts_in(a)]
    return [script.replace(text, misspelt_literal(script.source(text))) for text in texts[:1]]


@operator(each=_logs, fits="every call of rospy's logging")
def print_instead_of_log(script: Script, _statement: ast.Expr, call: ast.Call) -> list[TextEdit]:
    """Prints where it should log."""
    if last_name(call.func) not in LOGS or call.keywords:
        return []
    words, *values = [script.source(a) for a in call.args]
    return [script.replace(call, f"print({words} % ({', '.join(values)},))" if values else f"print({words})")]


@operator(each=_logs, fits="every line that prints or logs")
def log_dropped(script: Script, statement: ast.Expr, _call: ast.Call) -> list[TextEdit]:
    """Does not print or log this."""
    return [script.replace(statement, "pass")]


# ---- scripts that Python 3 does not read, or that fail as soon as they run

OPEN_QUOTE, CLOSE_QUOTE = "\u2018", "\u2019"


def _if_broken(script: Script, *edits: TextEdit) -> list[TextEdit]:
    """Return the edits if what comes out is really not Python 3."""
    try:
        compile(apply_edits(script.text, edits), script.path, "exec", dont_inherit=True)
    except SyntaxError:
        return list(edits)
    return []


@operator(each=each_script, fits="every Python script that prints or logs something")
def python2_print(script: Script) -> list[TextEdit]:
    """Prints as Python 2 does."""
    for statement in speech(script):
        call = statement.value
        words = script.source(call.args[0]) if isinstance(call, ast.Call) and call.args else "'here'"
        return _if_broken(script, script.replace(statement, f"print {words}"))
    return []


@operator(each=each_script, fits="every Python script with a block of two lines")
def tabs_and_spaces(script: Script) -> list[TextEdit]:
    """Mixes tabs and spaces."""
    return next((edits for s in script.of(ast.stmt) if (edits := _with_other_indentation(script, s))), [])


def _with_other_indentation(script: Script, statement: ast.stmt) -> list[TextEdit]:
    indentation = script.indentation(statement)
    first = statement is script.block(statement)[0]
    if not indentation or first or not script.has_lines(statement):
        return []
    start = script.starts[statement.lineno - 1]
    if "\t" in indentation:
        edit = TextEdit(start, start + len(indentation), indentation.expandtabs(8))
    else:
        edit = TextEdit(start, start + min(len(indentation), 8), "\t")
    return _if_broken(script, edit)


@operator(each=each_script, fits="every Python script with a text as an argument")
def typographic_quote(script: Script) -> list[TextEdit]:
    """Copies a text with its quotes from a PDF."""
    for text in (given for call in script.of(ast.Call) for given in call.args):
        if isinstance(text, ast.Constant) and isinstance(text.value, str) and script.source(text)[0] in "'\"":
            return _if_broken(script, script.replace(text, OPEN_QUOTE + str(text.value) + CLOSE_QUOTE))
    return []


@operator(each=each_script, fits="every Python script with an assignment that has spaces around its sign")
def no_break_space(script: Script) -> list[TextEdit]:
    """Copies a line from a PDF, with a space that Python does not accept."""
    for statement in script.of(ast.Assign):
        _, end = script.span(statement.targets[-1])
        if script.text[end : end + 3] == " = ":
            return _if_broken(script, TextEdit(end + 2, end + 3, "\u00a0"))
    return []


@operator(each=each_script, fits="every Python script that has one of them")
def syntax_error(script: Script) -> list[TextEdit]:
    """Forgets the colon after `def`, `class` or `while`."""
    for node in script.of(ast.stmt):
        if isinstance(node, Function | ast.ClassDef | ast.While):
            colon = script.text.rfind(":", script.span(node)[0], script.span(node.body[0])[0])
            return _if_broken(script, TextEdit(colon, colon + 1, ""))
    return []


@operator(each=each_script, fits="every Python script that imports rospy")
def missing_module(script: Script) -> list[TextEdit]:
    """Imports messages of a package that does not exist."""
    imports = [n for n in script.of(ast.Import) if any(a.name == "rospy" for a in n.names)]
    return [script.after(statement, "from beginner_tutorials.msg import Num") for statement in imports[:1]]


@operator(each=each_script, fits="every Python script that makes a node")
def asks_for_input(script: Script) -> list[TextEdit]:
    """Waits for someone to press Enter before it makes its node."""
    for call in calls(script, "init_node"):
        statement = script.statement(call)
        sound = argument(call, 0, "name") is not None and script.has_lines(statement)
        return [script.before(statement, "input('Press Enter to start')")] if sound else []
    return []
