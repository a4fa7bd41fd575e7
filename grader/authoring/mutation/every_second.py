"""The lines by which a mutant does something in every second turn only."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from grader.authoring.mutation.python import Script
from grader.authoring.mutation.spans import Edit

PREAMBLE = ("import itertools", "every_second = itertools.cycle((True, False))")


def every_second_time(script: Script, statements: Sequence[ast.stmt]) -> list[Edit]:
    """Guards for statements of one block, all for the same turns; empty where they cannot be indented."""
    if not script.can_wrap(statements):
        return []
    edits = [script.preamble(*PREAMBLE), script.before(statements[0], "turn = next(every_second)")]
    return edits + [script.wrap([statement], "if turn:") for statement in statements]
