"""Parameters that the grader made up for a run, whether they are printed, and what broke the node that reads them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import Any, NamedTuple

from grader.checks.support.exit_cause import Ending, explain_end, explain_traceback, process_tracebacks
from grader.checks.support.param_tree import absolute, own, tree
from grader.checks.support.printed import Line
from grader.checks.support.process import early_end, lives
from grader.checks.support.text import near_names
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.wording import join_words

NOT_IN_FILE = "not in the file"


class Given(NamedTuple):
    """A parameter as the grader set it before the run."""

    name: str
    value: Any
    in_file: bool


def given(run: Run) -> dict[str, Given]:
    """What the grader set before anything started, by name."""
    events = [e for _, e in run.actors if e.action == "param"]
    names = (absolute(e.topic or "") for e in events)
    return {n: Given(n, e.value, NOT_IN_FILE not in e.detail) for n, e in zip(names, events, strict=True)}


def is_printed(value: object, lines: Sequence[Line]) -> bool:
    """In one line, a number as one of its own; of a list, each of its items."""
    if isinstance(value, list | tuple):
        return all(is_printed(item, lines) for item in value)
    text = str(value)
    edges = (r"(?<!\w)(?<!\d\.)", r"(?!\w|\.\d)") if text[-1:].isdigit() else ("", "")
    word = re.compile(re.escape(text).join(edges))
    return any(word.search(line.text) for line in lines)


def broken(package: PackageFacts, run: Run) -> Ending | None:
    """An error that ended the node, or its last traceback."""
    ended = early_end(run)
    if ended is not None and ended.end is not None and ended.end.exit_code != 0:
        end = explain_end(ended, run, package)
    else:
        found = [
            t for one in lives(run) for t in process_tracebacks(run, one.name, before_ns=one.interrupt_ns)
        ]
        if not found:
            return None
        end = explain_traceback(found[-1], package)
    key = re.match(r"KeyError: ['\"]?([^'\" (]+)", end.cause)
    if key is None:
        return end
    parts = {part for name in own(tree(run)) for part in name.split("/") if part}
    last = PurePosixPath(key[1]).name
    near = near_names(last, parts - {last})
    seen = f"; there is {join_words(near)}" if near else ""
    hint = "write the name as rosparam list shows it, one key for each level: get_param('details')['name']['first']"
    return end._replace(cause=f"{end.cause}: nothing is named {key[1]} there{seen}", hint=hint)
