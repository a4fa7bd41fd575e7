"""One result full of text that nobody should obey, for the golden files."""

from __future__ import annotations

from grader.model.result import (
    EnvironmentInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
    TimingInfo,
)
from grader.model.verdict import EvidenceCitation, FileCitation, Status
from grader.rubric.model import Rubric
from tests.support.a_class import criterion

NS = 1_700_000_000_000_000_000
ESCAPES = "\x1b[31mred\x1b]0;title\x07 \u202egnp.exe \u200b \ufeff \x00 \x9b2J"
XML = "]]> <![CDATA[ </failure> & \ufffe \uffff \x0b"
MARKDOWN = (
    "| `code` ``x`` [a](http://evil.example) ![i](x.png) <img src=x onerror=alert(1)> @all #1 *b* _c_ $x$"
)
RICH = "[bold red]not bold[/] [link=http://evil.example]x[/link] :smile:"


def rubric(**changes: object) -> Rubric:
    """The rubric that `result` is of."""
    data: dict[str, object] = {
        "schema": "grader.rubric/1",
        "id": "hostile-lab",
        "title": "A lab | with *markup*",
        "version": "2026.1",
        "package": "lab1",
        "scenarios": {},
        "criteria": tuple(
            {
                "id": c.id,
                "title": c.title,
                "points": c.max_points,
                "check": c.check,
                "requires": REQUIRES.get(c.id, ()),
            }
            for c in result().criteria
        ),
    }
    return Rubric.model_validate({**data, **changes})


REQUIRES = {
    "counter-step": ("counter-start",),
    "counter-start": ("talker-node",),
    "counter-wrap": ("talker-node",),
}


def result(**changes: object) -> GradingResult:
    """Every status once, and hostile text in every field that a student can reach."""
    data = {
        "submission": SubmissionInfo(
            id="ada",
            source=f"/home/ada/{ESCAPES}",
            commit="0123456789abcdef" * 2,
            digest="d" * 64,
            package="lab1",
        ),
        "rubric": RubricInfo(id="hostile-lab", version="2026.1", digest="e" * 64),
        "status": "inconclusive",
        "points": 12.5,
        "max_points": 100,
        "criteria": CRITERIA,
        "environment": EnvironmentInfo(
            grader="0.1.0", ros="ros_comm 1.15.15", python="3.11.2", sandbox="bubblewrap"
        ),
        "timing": TimingInfo(wall_s=9.25, cpu_s=0.5, student_cpu_s=1.5),
    }
    return GradingResult.model_validate({**data, **changes})


CRITERIA = (
    criterion("manifest", Status.PASS, 5, 5, message="package.xml is sound", measured="lab1"),
    criterion(
        "chatter-rate",
        Status.FAIL,
        0,
        10,
        message="/chatter came at 5.02 Hz, not 10 Hz",
        expected="10 Hz ± 5 %",
        measured="5.02 Hz over 6.0 s (31 messages)",
        hint="Look at the number that rospy.Rate gets, and at whether rate.sleep() is called in the loop.",
        reproduce="rostopic hz /chatter",
        scenario="real",
        citations=(
            FileCitation(file="src/numeric_talker.py", line=17),
            EvidenceCitation(
                evidence="real.mcap",
                topic="/chatter",
                from_ns=NS,
                to_ns=NS + 6_000_000_000,
            ),
        ),
    ),
    criterion("talker-node", Status.FAIL, 0, 5, message=f"the node printed {ESCAPES}", measured=RICH),
    criterion("counter-start", Status.BLOCKED, 0, 5, message="not judged: talker-node failed"),
    criterion("counter-step", Status.BLOCKED, 0, 5, message="not judged: talker-node failed"),
    criterion("counter-wrap", Status.BLOCKED, 0, 15, message="not judged: talker-node failed"),
    criterion("listener-chatter", Status.PARTIAL, 7.5, 15, message=MARKDOWN, expected=XML, hint=MARKDOWN),
    criterion("build", Status.INCONCLUSIVE, 0, 20, message="no ROS 1 on this machine", measured=XML),
    criterion("launch", Status.ERROR, 0, 10, message=f"the check broke: {XML}"),
    criterion("style", Status.MANUAL, 0, 10, message="a person marks this"),
    criterion(
        "talker-name", Status.FAIL, 0, 0, message="the node is called /foo", hint="Call it numeric_talker."
    ),
)
