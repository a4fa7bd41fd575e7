"""What a message says."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.authoring.mutation.data import sources
from grader.authoring.mutation.python import Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import Endpoint, publishers
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit
from grader.authoring.mutation.words import misspelt_literal, texts_in

SECONDS = {"rospy.get_time()": "1700000000.0", "time.time()": "1700000000.0"}
TIMES = {"rospy.Time.now()": "rospy.Time(1700000000)", "rospy.get_rostime()": "rospy.Time(1700000000)"}
NANOSECONDS = "rospy.Time.now().to_nsec()"


def _fed(solution: Solution) -> Iterator[tuple[Script, Endpoint, list[ast.AST]]]:
    """Each publisher with everything that its messages are made of."""
    for script in solution.scripts:
        for publisher in publishers(script):
            nodes = {id(n): n for value in sources(script, publisher) for n in ast.walk(value)}
            yield script, publisher, list(nodes.values())


def _site(solution: Solution, script: Script, publisher: Endpoint, edits: list[Edit]) -> Iterator[Site]:
    if edits:
        at = {"script": script.path, "topic": publisher.topic}
        line = script.text.count("\n", 0, min(edits).start) + 1
        yield Site(at=at, tree=solution.edited(script.path, edits), line=line)


@operator("message-altered")
def message_altered(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Misspells the message.

    Fits every publisher whose messages are made from a text.
    """
    for script, publisher, _ in _fed(solution):
        for value in sources(script, publisher):
            texts = [t for t in texts_in(value) if misspelt_literal(script.source(t)) != script.source(t)]
            if texts:
                edit = script.replace(texts[0], misspelt_literal(script.source(texts[0])))
                yield from _site(solution, script, publisher, [edit])
                break


@operator("message-constant-time")
def message_constant_time(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sends the same time again and again.

    Fits every publisher whose messages carry the time.
    """
    constants = SECONDS | TIMES
    for script, publisher, nodes in _fed(solution):
        edits = [
            script.replace(n, constants[s]) for n in _calls(nodes) if (s := script.source(n)) in constants
        ]
        yield from _site(solution, script, publisher, edits)


@operator("message-nanoseconds")
def message_nanoseconds(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Sends the time in nanoseconds, not in seconds.

    Fits every publisher whose messages carry the time in seconds.
    """
    for script, publisher, nodes in _fed(solution):
        found = [n for n in _calls(nodes) if script.source(n) in SECONDS or _seconds_of_time(script, n)]
        yield from _site(solution, script, publisher, [script.replace(n, NANOSECONDS) for n in found])


def _calls(nodes: list[ast.AST]) -> list[ast.Call]:
    return [n for n in nodes if isinstance(n, ast.Call)]


def _seconds_of_time(script: Script, call: ast.Call) -> bool:
    """`rospy.Time.now().to_sec()`."""
    head, _, tail = script.source(call).rpartition(".")
    return head in TIMES and tail == "to_sec()"
