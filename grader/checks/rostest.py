"""Tests of an instructor's own, for rostest, that ran beside the student's nodes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, ValidationError

from grader.checks.registry import Refers, check
from grader.checks.support.clocks import Lateness, excused, why_late
from grader.checks.support.exit_causes import Ending, explain_end, explain_error
from grader.checks.support.processes import TYPES_HINT, Life, disputed_types, lives, not_started
from grader.checks.support.topics import cite, nodes_on, published_topics
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import (
    Status,
    Verdict,
    failed_or_blocked,
    inconclusive,
    partial,
    passed,
)
from grader.wording import plural, shorten, significant

SHOWN, LINE_CHARS = 4, 200
LATE_MS, OFTEN_LATE_MS = 500.0, 50.0
Outcome = Literal["passed", "failed", "error", "skipped"]


class RostestParams(Record):
    """Whose results are judged."""

    process: Annotated[str, Field(min_length=1), Refers("rostest")]
    """The scenario's name for the start of the `.test` file."""
    test: str = ""
    """Only the `<test>` with this `test-name`; empty: all of the file."""


class Case(Record):
    """What the process of the tests printed of one testcase (`arena/ros/rostests.py`)."""

    test: str
    case: str
    outcome: Outcome
    message: str = ""
    file: str = ""
    line: int = 0

    @property
    def shown(self) -> str:
        """`test_sum: 3 is not 4 (check_sum.py:12)`."""
        place = f" ({self.file}:{self.line})" if self.line else ""
        said = f": {self.message}" if self.message else ""
        return shorten(f"{self.case}{said}{place}", LINE_CHARS)


class Course(Record):
    """How it went with a `<test>`: it has begun, it is over, it took too long, or it could not be run."""

    test: str
    end: Literal["begun", "over", "late", "broken"]
    limit_s: float = 0.0
    message: str = ""


class Results(NamedTuple):
    """What the process said: the tests by name, each with how it went last, their cases, and why nothing was run."""

    ends: dict[str, Course | None]
    cases: list[Case]
    fault: str


@check("rostest", params=RostestParams)
def rostest(package: PackageFacts, run: Run, params: RostestParams) -> Verdict:
    """The instructor's tests for rostest pass.

    What it checks
        What the tests of a `.test` file check while your nodes run, each testcase for its share of the points.

    Why it matters on a robot
        A robot's software is tested as a whole: each node alone may be right, but what they send each other
        wrong.

    How it is measured
        Each `<test>` of the file is a program that runs beside your nodes, subscribes to their topics and
        calls their services. A testcase fails if an assertion does, and all of a `<test>` fails if it takes
        longer than its time limit. Skipped testcases do not count. Faults in the tests themselves cost no
        marks.

    How to fix
        Read what each testcase that failed says, and look at the same topic or service with `rostopic echo` or
        `rosservice call` while your nodes run.
    """
    started = [t for t, e in run.processes if e.event == "start" and e.name == params.process]
    if not started or not lives(run):
        return not_started("your package's program").about(expected="the tests pass")
    found = _results(run, params)
    verdict = _faulty(found, run, params) or _judge_results(found, run, package, started[0])
    counts = (
        f"{sum(c.outcome == 'passed' for c in found.cases)} of {plural(len(found.cases), 'testcase')} passed"
    )
    expected = f"the tests of {params.test or params.process} pass"
    cited = (cite(run, "/grader/console", started[0], run.end_ns),)
    return verdict.about(expected=expected, measured=verdict.measured or counts, citations=cited)


def _results(run: Run, params: RostestParams) -> Results:
    found = Results({}, [], "")
    for fields in _lines(run, params.process):
        if "fault" in fields:
            return found._replace(fault=str(fields["fault"]))
        try:
            if isinstance(names := fields.get("tests"), list):
                found.ends.update(dict.fromkeys(n for n in names if params.test in {"", n}))
            elif fields.get("test") not in found.ends:
                continue
            elif "case" in fields:
                found.cases.append(Case.model_validate(fields))
            else:
                found.ends[str(fields["test"])] = Course.model_validate(fields)
        except ValidationError:
            return found._replace(fault="what it printed is not a result")
    return found


def _lines(run: Run, process: str) -> Iterator[dict[str, object]]:
    for _, line in run.lines(process):
        if line.stream != "stdout":
            continue
        try:
            fields = json.loads(line.line)
        # A test may print anything, also brackets that are nested without end.
        except (ValueError, RecursionError):
            continue
        if isinstance(fields, dict):
            yield fields


def _faulty(found: Results, run: Run, params: RostestParams) -> Verdict | None:
    """Return the verdict where the tests themselves are at fault, which costs no mark."""
    errors = [case for case in found.cases if case.outcome == "error"]
    broken = [one for one in found.ends.values() if one is not None and one.end == "broken"]
    unfinished = [name for name, one in found.ends.items() if one is None or one.end == "begun"]
    alone = all(one.ended_early for one in lives(run))
    if found.fault:
        why = found.fault
    elif name := _taken_name(run, params.process):
        why = f"a <test> takes the name of the student's node {name}: give it another name (name=)"
    elif not found.ends:
        why = f"no <test> is named {params.test}" if params.test else _last_line(run, params.process)
    elif broken:
        why = f"{broken[0].test}: {broken[0].message}; {_last_line(run, params.process)}"
    elif errors:
        why = f"{errors[0].shown}; only an assertion is held against a student, so catch it and use self.fail"
    elif unfinished and not alone:
        why = f"{unfinished[0]} was not over when the run ended: raise limit_s of the scenario's until"
    else:
        return None
    message = "the instructor's tests could not be run; this costs no marks"
    return Verdict(status=Status.ERROR, score=0.0, message=message, hint=f"for the instructor: {why}")


def _taken_name(run: Run, tests: str) -> str:
    """Return the name of a student's node that a node of the tests took: rosmaster ends the older one. A `<test>`
    without a `name` has its test-name."""
    students = {one.name for one in lives(run)}
    owned = {(node, process) for _, event in run.graph for node, process in event.processes.items()}
    return next((n for n, p in sorted(owned) if p == tests and any((n, s) in owned for s in students)), "")


def _last_line(run: Run, process: str) -> str:
    lines = [
        line.line.strip() for _, line in run.lines(process) if line.stream == "stderr" and line.line.strip()
    ]
    errors = [line for line in lines if "rror" in line]
    return f"it printed last: {shorten((errors or lines)[-1], LINE_CHARS)}" if lines else "it printed nothing"


def _judge_results(found: Results, run: Run, package: PackageFacts, start_ns: int) -> Verdict:
    late = [
        f"{name} was not over after {significant(one.limit_s)} s"
        if one is not None and one.end == "late"
        else f"{name} was not over when the last of your processes had ended"
        for name, one in found.ends.items()
        if one is None or one.end != "over"
    ]
    right = sum(case.outcome == "passed" for case in found.cases)
    said = [*(case.shown for case in found.cases if case.outcome == "failed"), *late]
    total = right + len(said)
    if not total:
        hint = "for the instructor: no testcase was run"
        return inconclusive("every testcase was skipped", hint=hint).based_on(unjudged=True)
    if not said:
        return passed(f"all {total} testcases pass" if total > 1 else "its testcase passes")
    more = f" and {len(said) - 1} more" if len(said) > 1 else ""
    message = f"{right} of {plural(total, 'testcase')} pass; {said[0]}{more}" if total > 1 else said[0]
    hint = "; ".join(said[:SHOWN])
    verdict = partial(right / total, message, hint=hint) if right else failed_or_blocked(message, hint=hint)
    dead = next((one for one in lives(run) if one.ended_early and one.end and one.end.exit_code != 0), None)
    if dead is not None:
        verdict = _with_cause(verdict, dead, run, package)
    elif error := _error_behind(verdict, package, run):
        of_types = error.hint == TYPES_HINT
        message = f"{verdict.message}; {'' if of_types else 'a callback fails: '}{error.cause}"
        # what no node hears is no fault of what it would do with it
        unjudged = of_types and verdict.basis.unjudged
        about = {"message": message, "hint": error.hint, "citations": error.citations}
        verdict = verdict.model_copy(update=about).based_on(unjudged=unjudged)
    return excused(verdict.if_repeated(), run, start_ns, run.end_ns, _why_late)


def _error_behind(verdict: Verdict, package: PackageFacts, run: Run) -> Ending | None:
    """Return the types of a topic that do not fit, or the error in a callback of a node that publishes on a topic which
    the testcase that failed first names."""
    if disputed := disputed_types(run):
        return Ending(disputed, TYPES_HINT)
    topics = [topic for topic in published_topics(run) if re.search(rf"{topic}(?![\w/])", verdict.message)]
    nodes = {node for topic in topics for node in nodes_on(run, topic, "publishers")}
    processes = {event.processes.get(node, "") for _, event in run.graph for node in nodes} - {""}
    return explain_error(package, run, only=processes) if processes else None


def _with_cause(verdict: Verdict, dead: Life, run: Run, package: PackageFacts) -> Verdict:
    """Return the same with what ended the student's process, on whose messages the tests may have waited."""
    end = explain_end(dead, run, package)
    message = f"{verdict.message}; {dead.name} ended by itself after {dead.lasted}: {end.cause}"
    return end.explain(verdict, message)


def _why_late(late: Lateness) -> str:
    """Return what the machine was where even a test that waits for seconds, or measures a mean, could fail by it."""
    return why_late(late) if late.max_ms >= LATE_MS or late.p95_ms >= OFTEN_LATE_MS else ""
