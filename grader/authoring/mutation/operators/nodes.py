"""Names of nodes."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from typing import Literal

from pydantic import Field

from grader.authoring.mutation.python_script import Function, Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.rospy_code import LOGS, argument, calls, last_name, loops, speech, text_literal
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.text_edits import Edit, applied, misspelt_literal, texts_in
from grader.model.record import Record


def _site(solution: Solution, script: Script, call: ast.Call, edit: Edit) -> Site:
    return Site(at={"script": script.path}, tree=solution.edited(script.path, [edit]), line=call.lineno)


def _anonymous(call: ast.Call) -> ast.keyword | None:
    return next((k for k in call.keywords if k.arg == "anonymous"), None)


def _is_anonymous(call: ast.Call) -> bool:
    keyword = _anonymous(call)
    return keyword is not None and isinstance(keyword.value, ast.Constant) and bool(keyword.value.value)


@operator("name-changed")
def name_changed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Gives the node another name.

    Fits every script with a node whose name is written out.
    """
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            name = text_literal(script, argument(call, 0, "name"))
            if name is not None:
                yield _site(solution, script, call, script.replace(name, repr(f"my_{name.value!s}")))


@operator("not-anonymous")
def not_anonymous(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Leaves `anonymous=True` away.

    Fits every script with an anonymous node.
    """
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            keyword = _anonymous(call)
            if keyword is not None and _is_anonymous(call):
                yield _site(solution, script, call, script.replace(keyword.value, "False"))


@operator("made-anonymous")
def made_anonymous(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Makes the node anonymous where its plain name is asked for.

    Fits every script with a node that is not anonymous.
    """
    for script in solution.scripts:
        for call in calls(script, "init_node"):
            keyword = _anonymous(call)
            if _is_anonymous(call) or argument(call, 0, "name") is None:
                continue
            if keyword is not None:
                yield _site(solution, script, call, script.replace(keyword.value, "True"))
            else:
                last = script.span(max((*call.args, *call.keywords), key=lambda node: script.span(node)[1]))[
                    1
                ]
                yield _site(solution, script, call, Edit(last, last, ", anonymous=True"))


# [authoring.mutation.operators.life] Nodes that end when they should not, or do not end when they should.


class EndsParams(Record):
    """`turns`: how many rounds a loop makes before it ends."""

    turns: int = Field(default=30, ge=1)


def _spins(script: Script) -> list[ast.Expr]:
    return [s for call in calls(script, "spin") if isinstance(s := script.statement(call), ast.Expr)]


def _sites(solution: Solution, script: Script, edits: Sequence[Edit], line: int) -> Site:
    return Site(at={"script": script.path}, tree=solution.edited(script.path, edits), line=line)


@operator("node-ends-by-itself", params=EndsParams)
def node_ends_by_itself(solution: Solution, params: EndsParams) -> Iterator[Site]:
    """Lets the node come to its end: a loop that is counted, or no rospy.spin().

    Fits every script with a loop until shutdown or a spin.
    """
    for script in solution.scripts:
        spins = _spins(script)
        for loop in loops(script):
            start, _ = script.span(loop)
            edit = Edit(start, script.span(loop.test)[1], f"for _ in range({params.turns})")
            yield _sites(solution, script, [edit], loop.lineno)
        for spin in spins if not loops(script) else []:
            yield _sites(solution, script, [script.remove(spin)], spin.lineno)


@operator("ctrl-c-swallowed")
def ctrl_c_swallowed(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Catches every exception and goes on, so that Ctrl-C does not end the node.

    Fits every script with a loop until shutdown or a spin.
    """
    for script in solution.scripts:
        unit = script.unit
        except_pass = (f"{unit}except:", f"{unit * 2}pass")
        for loop in loops(script):
            if script.can_wrap(loop.body):
                edits = [
                    script.replace(loop.test, "True"),
                    script.wrap(loop.body, "try:", footer=("except:", f"{unit}pass")),
                ]
                yield _sites(solution, script, edits, loop.lineno)
        for spin in _spins(script) if not loops(script) else []:
            if script.has_lines(spin):
                sleep = f"{unit * 2}rospy.rostime.wallsleep(0.1)"
                edits = [
                    script.before(spin, "while True:", f"{unit}try:", sleep, *except_pass),
                    script.remove(spin) if len(script.block(spin)) > 1 else script.replace(spin, "pass"),
                ]
                yield _sites(solution, script, edits, spin.lineno)


@operator("traceback-on-exit")
def traceback_on_exit(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Uses a variable that is not there, once the node has been told to end.

    Fits every script with a loop until shutdown or a spin.
    """
    for script in solution.scripts:
        for node in loops(script) or _spins(script):
            if script.has_lines(node):
                edit = script.after(node, "print('stopped after', turns_so_far)")
                yield _sites(solution, script, [edit], node.lineno)


# [authoring.mutation.operators.logs] What a node logs, and how.

TEXT_LIMIT = 30
LEVELS = {"debug": "logdebug", "info": "loginfo", "warn": "logwarn", "error": "logerr", "fatal": "logfatal"}


class LevelParams(Record):
    """`level`: the level that is taken."""

    level: Literal["debug", "info", "warn", "error", "fatal"] = "warn"


def _spoken(solution: Solution) -> Iterator[tuple[Script, ast.Expr, ast.Call]]:
    for script in solution.scripts:
        for statement in speech(script):
            if isinstance(statement.value, ast.Call) and statement.value.args:
                yield script, statement, statement.value


def _site_logs(solution: Solution, script: Script, call: ast.Call, node: ast.AST, text: str) -> Site:
    at = {"script": script.path, "text": _said(script, call)}
    return Site(at=at, tree=solution.edited(script.path, [script.replace(node, text)]), line=call.lineno)


def _said(script: Script, call: ast.Call) -> str:
    """The first words of what is logged, as they stand in the source."""
    for text in (t for a in call.args for t in texts_in(a)):
        words = str(text.value) if isinstance(text, ast.Constant) else script.source(text)
        return " ".join(words.split())[:TEXT_LIMIT].rstrip()
    return script.source(call.args[0])[:TEXT_LIMIT]


@operator("log-level", params=LevelParams)
def log_level(solution: Solution, params: LevelParams) -> Iterator[Site]:
    """Logs at another level.

    Fits every call of rospy's logging.
    """
    for script, _, call in _spoken(solution):
        if last_name(call.func) in LOGS and isinstance(call.func, ast.Attribute):
            name = f"{script.source(call.func.value)}.{LEVELS[params.level]}"
            yield _site_logs(solution, script, call, call.func, name)


@operator("log-text")
def log_text(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells what it prints or logs.

    Fits every line that prints or logs a text.
    """
    for script, _, call in _spoken(solution):
        for text in [t for a in call.args for t in texts_in(a)][:1]:
            yield _site_logs(solution, script, call, text, misspelt_literal(script.source(text)))


@operator("print-instead-of-log")
def print_instead_of_log(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints where it should log.

    Fits every call of rospy's logging.
    """
    for script, _, call in _spoken(solution):
        if last_name(call.func) in LOGS and not call.keywords:
            words, *values = [script.source(a) for a in call.args]
            text = f"{words} % ({', '.join(values)},)" if values else words
            yield _site_logs(solution, script, call, call, f"print({text})")


@operator("log-dropped")
def log_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not print or log this.

    Fits every line that prints or logs.
    """
    for script, statement, call in _spoken(solution):
        yield _site_logs(solution, script, call, statement, "pass")


# [authoring.mutation.operators.syntax] Python files that Python 3 does not read, or that fail as soon as they run.

OPEN_QUOTE, CLOSE_QUOTE = "\u2018", "\u2019"


def _broken(solution: Solution, script: Script, edits: list[Edit], line: int) -> Iterator[Site]:
    """The site, if what comes out is really no Python 3."""
    try:
        compile(applied(script.text, edits), script.path, "exec", dont_inherit=True)
    except SyntaxError:
        yield Site(at={"script": script.path}, tree=solution.edited(script.path, edits), line=line)


@operator("python2-print")
def python2_print(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints as Python 2 does.

    Fits every Python script that prints or logs something.
    """
    for script in solution.scripts:
        for statement in speech(script)[:1]:
            call = statement.value
            words = script.source(call.args[0]) if isinstance(call, ast.Call) and call.args else "'here'"
            yield from _broken(
                solution, script, [script.replace(statement, f"print {words}")], statement.lineno
            )


@operator("tabs-and-spaces")
def tabs_and_spaces(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Mixes tabs and spaces.

    Fits every Python script with a block of two lines.
    """
    for script in solution.scripts:
        found = (site for s in script.of(ast.stmt) for site in _tabbed(solution, script, s))
        yield from [site for site, _ in zip(found, range(1), strict=False)]


def _tabbed(solution: Solution, script: Script, statement: ast.stmt) -> Iterator[Site]:
    indentation = script.indentation(statement)
    first = statement is script.block(statement)[0]
    if not indentation or first or not script.has_lines(statement):
        return
    start = script.starts[statement.lineno - 1]
    if "\t" in indentation:
        edit = Edit(start, start + len(indentation), indentation.expandtabs(8))
    else:
        edit = Edit(start, start + min(len(indentation), 8), "\t")
    yield from _broken(solution, script, [edit], statement.lineno)


@operator("typographic-quote")
def typographic_quote(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Copies a text with its quotes from a PDF.

    Fits every Python script with a text as an argument.
    """
    for script in solution.scripts:
        texts = [
            a
            for call in script.of(ast.Call)
            for a in call.args
            if isinstance(a, ast.Constant) and isinstance(a.value, str) and script.source(a)[0] in "'\""
        ]
        for text in texts[:1]:
            edit = script.replace(text, OPEN_QUOTE + str(text.value) + CLOSE_QUOTE)
            yield from _broken(solution, script, [edit], text.lineno)


@operator("no-break-space")
def no_break_space(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Copies a line from a PDF, with a space that is none for Python.

    Fits every Python script with an assignment that has spaces around its sign.
    """
    for script in solution.scripts:
        for statement in script.of(ast.Assign):
            _, end = script.span(statement.targets[-1])
            if script.text[end : end + 3] == " = ":
                yield from _broken(solution, script, [Edit(end + 2, end + 3, "\u00a0")], statement.lineno)
                break


@operator("syntax-error")
def syntax_error(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Forgets the colon after `def`, `class` or `while`.

    Fits every Python script that has one of them.
    """
    for script in solution.scripts:
        heads = [n for n in script.of(ast.stmt) if isinstance(n, Function | ast.ClassDef | ast.While)]
        for node in heads[:1]:
            start, _ = script.span(node)
            end, _ = script.span(node.body[0])
            colon = script.text.rfind(":", start, end)
            yield from _broken(solution, script, [Edit(colon, colon + 1, "")], node.lineno)


@operator("missing-module")
def missing_module(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Imports messages of a package that is not there.

    Fits every Python script that imports rospy.
    """
    for script in solution.scripts:
        imports = [n for n in script.of(ast.Import) if any(a.name == "rospy" for a in n.names)]
        for statement in imports[:1]:
            edit = script.after(statement, "from beginner_tutorials.msg import Num")
            yield Site(
                at={"script": script.path}, tree=solution.edited(script.path, [edit]), line=statement.lineno
            )


@operator("asks-for-input")
def asks_for_input(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Waits for somebody to press Enter before it makes its node.

    Fits every Python script that makes a node.
    """
    for script in solution.scripts:
        for call in list(calls(script, "init_node"))[:1]:
            statement = script.statement(call)
            if argument(call, 0, "name") is not None and script.has_lines(statement):
                edit = script.before(statement, "input('Press Enter to start')")
                yield Site(
                    at={"script": script.path},
                    tree=solution.edited(script.path, [edit]),
                    line=statement.lineno,
                )
