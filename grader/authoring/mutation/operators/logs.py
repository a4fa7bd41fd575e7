"""What a node logs, and how."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Literal

from grader.authoring.mutation.python import Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import LOGS, last_name, speech
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.words import misspelt_literal, texts_in
from grader.model.record import Record

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


def _site(solution: Solution, script: Script, call: ast.Call, node: ast.AST, text: str) -> Site:
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
            yield _site(solution, script, call, call.func, name)


@operator("log-text")
def log_text(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells what it prints or logs.

    Fits every line that prints or logs a text.
    """
    for script, _, call in _spoken(solution):
        for text in [t for a in call.args for t in texts_in(a)][:1]:
            yield _site(solution, script, call, text, misspelt_literal(script.source(text)))


@operator("print-instead-of-log")
def print_instead_of_log(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Prints where it should log.

    Fits every call of rospy's logging.
    """
    for script, _, call in _spoken(solution):
        if last_name(call.func) in LOGS and not call.keywords:
            words, *values = [script.source(a) for a in call.args]
            text = f"{words} % ({', '.join(values)},)" if values else words
            yield _site(solution, script, call, call, f"print({text})")


@operator("log-dropped")
def log_dropped(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Does not print or log this.

    Fits every line that prints or logs.
    """
    for script, statement, call in _spoken(solution):
        yield _site(solution, script, call, statement, "pass")
