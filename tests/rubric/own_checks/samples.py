"""A rubric with an instructor's own files beside it, and evidence to judge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from grader.evidence.run import Run
from grader.judging import judge
from grader.model.result import CriterionResult
from grader.rubric.load import LoadedRubric, load_rubric
from tests.support.timeline import build_runs

HEAD = """\
schema: grader.rubric/1
id: own
title: Own checks
version: "1"
package: lab1
"""
SCENARIOS = """\
scenarios:
  talker:
    title: The talker
    start: [{name: talker, script: src/talker.py}]
    until: {window_s: 5, topics: [/chatter]}
"""
OTHER = """\
  other:
    title: Not recorded
    start: [{name: talker, script: src/talker.py}]
    until: {window_s: 5, topics: [/chatter]}
"""
GREETING = '''\
from __future__ import annotations

from grader.checks import PackageFacts, Record, Run, Verdict, check, failed, passed, unjudged


class Greeting(Record):
    """`word` that every message begins with."""

    word: str
    times: int = 1


@check("greeting", params=Greeting)
def greeting(package: PackageFacts, run: Run, params: Greeting) -> Verdict:
    """Every message begins with a greeting.

    What it checks
        The first word.
    """
    texts = [text for channel in run.student_channels("/chatter") for text in channel.data]
    if not texts:
        return unjudged("nothing came")
    return passed("polite") if all(t.startswith(params.word) for t in texts) else failed("rude", hint="greet")
'''
OWN = "  - {id: own, title: o, points: 100, check: greeting, with: {word: hello}, scenario: talker}\n"
TESTS = "  - {id: own, title: o, points: 100, check: pytest, with: {file: test_lab.py}, scenario: talker}\n"
TIMELINE = {
    "runs": {
        "talker": {
            "topics": [{"topic": "/chatter", "count": 61, "values": {"text": "hello {i}"}}],
            "processes": [{"name": "talker", "stopped_by": "INT", "exit_code": 0}],
        }
    },
    "package": {"name": "lab1", "files": [{"path": "src/talker.py"}]},
}


def write_rubric(
    folder: Path, criteria: str, *, checks: str | None = None, tests: str | None = None, head: str = HEAD
) -> Path:
    """The rubric's file in a folder with those files."""
    folder.mkdir(parents=True, exist_ok=True)
    if checks is not None:
        (folder / "my_checks.py").write_text(checks, encoding="utf-8")
        head += "checks: my_checks.py\n"
    if tests is not None:
        (folder / "test_lab.py").write_text(tests, encoding="utf-8")
    path = folder / "lab.yaml"
    other = OTHER if tests is not None or "evidence" in (checks or "") else ""
    path.write_text(f"{head}{SCENARIOS}{other}criteria:\n{criteria}", encoding="utf-8")
    return path


def runs(**changes: Any) -> dict[str, Run]:
    """The recorded evidence; `changes` are to the run `talker`."""
    talker = {**TIMELINE["runs"]["talker"], **changes}
    return build_runs({**TIMELINE, "runs": {"talker": talker}})


def judged(path: Path, recorded: dict[str, Run] | None = None) -> dict[str, CriterionResult]:
    """The criteria by id."""
    loaded: LoadedRubric = load_rubric(str(path))
    return {c.id: c for c in judge(loaded.rubric, recorded or runs(), loaded.checks)}
