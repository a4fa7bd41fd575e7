"""One result full of text that nobody should obey, for the golden files: `worst`, its rubric and its figures."""

from __future__ import annotations

from datetime import date, datetime, timezone

from grader.model.figure import Edge, Figures, GraphFigure
from grader.model.result import AppliedOverride, Automatic, GradingResult, Lateness, Note, SubmissionInfo
from grader.model.verdict import FileCitation, Status
from grader.rubric.model import Rubric
from tests.report import hostile
from tests.support.a_class import criterion

SCRIPT = "</script><script>alert(1)</script> <!-- --> </details></summary> <img src=x onerror=alert(1)>"
COMMANDS = "::error file=a,line=1::owned ##[error]x ##vso[task.complete] ##teamcity[y] %0A::stop-commands::t"
LINKS = (
    "[a](javascript:alert(1)) ![i](http://evil.example/x.png) www.evil.example @everyone #1 !2 GH-5 /close"
)
MERMAID = '"]-->x["y"] click n0 href "javascript:alert(1)" %%{init: {"securityLevel":"loose"}}%% ```'
FORMULA = "=cmd|' /C calc'!A0 +1 -2 @SUM(A1) \uff1d1"
WIDE = "学生の話し手 は 배터리 です 🤖🚀 " * 4
STACKED = "Z" + "\u0300" * 30
LONG = "x" * 5000 + "\x00\u202e" + "&<" * 2500
TEXTS = (SCRIPT, COMMANDS, LINKS, MERMAID, FORMULA, WIDE, STACKED, LONG)

NAMES = ("script", "commands", "links", "mermaid", "formula", "wide", "stacked", "long")
FILES = (
    "src/talker.py",
    "src/a,b:c%0A::error::.py",
    "../../etc/passwd",
    "javascript:alert(1)",
    "//evil.example/x.py",
    "src/学生 🤖.py",
    "src/\u202egnp.py",
    "launch/lab1.launch",
)
LONG_ID = "a-criterion-with-an-id-that-is-longer-than-any-column-of-a-terminal-would-like-it-to-be"

MORE = (
    *(
        criterion(
            f"text-{name}",
            Status.PARTIAL if i % 2 else Status.FAIL,
            i % 2,
            2,
            title=text,
            message=text,
            expected=text,
            measured=text,
            hint=text,
            reproduce=text,
            check=f"check-{name}",
            citations=(FileCitation(file=file, line=i + 1), FileCitation(file="src/other.py", line=7)),
        )
        for i, (name, text, file) in enumerate(zip(NAMES, TEXTS, FILES, strict=True))
    ),
    criterion(LONG_ID, Status.FAIL, 0, 4, message="its name is long", hint="nothing can be done about it"),
    criterion("no-line", Status.FAIL, 0, 0, message=LINKS, citations=(FileCitation(file="package.xml"),)),
    criterion("secret", Status.FAIL, 0, 6, message="the secret was not found", title="A secret"),
    criterion("given", Status.PARTIAL, 3, 5, message="3 of 5 points"),
)
GIVEN = AppliedOverride(
    criterion="given",
    points=3,
    comment=f"{LINKS} {COMMANDS}",
    author="A. Müller </script>",
    date=date(2026, 11, 2),
    automatic=Automatic(status=Status.FAIL, points=0, message=MERMAID),
    was=Automatic(status=Status.MANUAL, points=0, message="a person awards these points"),
    changed=True,
)
LATE = Lateness(
    at=datetime(2026, 11, 21, 8, 0, tzinfo=timezone.utc),
    by="commit",
    deadline=datetime(2026, 11, 20, 8, 0, tzinfo=timezone.utc),
    note=f"the last commit on {SCRIPT} counts",
    late_s=86_400,
    points_before=20,
    points=18,
    text="1 day late: 10 % of 20 points reached are lost",
)


def worst(**changes: object) -> GradingResult:
    """Every status, and such a text in every field that a student, a commit or a person can reach."""
    criteria = (*hostile.CRITERIA, *MORE)
    data: dict[str, object] = {
        "submission": SubmissionInfo(
            id="ada",
            source=f"/home/ada/{hostile.ESCAPES}",
            commit="01234567" * 5,
            digest="d" * 64,
            package="lab1",
        ),
        "criteria": criteria,
        "points": 18,
        "max_points": sum(c.max_points for c in criteria),
        "notes": (Note(scenario="real", actor=MERMAID, kind="refused", text=COMMANDS),),
        "overrides": (GIVEN,),
        "late": LATE,
    }
    return hostile.result(**{**data, **changes})


def rubric() -> Rubric:
    """Of `worst`: `secret` is hidden, and so are two that are not in the result at all."""
    plain = hostile.rubric()
    shown = [
        {
            "id": c.id,
            "title": c.title[:200],
            "points": c.max_points,
            "check": c.check,
            "requires": hostile.REQUIRES.get(c.id, ()),
            "visibility": "hidden" if c.id == "secret" else "visible",
        }
        for c in worst().criteria
    ]
    left = [
        {"id": name, "title": name, "points": 5, "check": "some-check", "visibility": "hidden"}
        for name in ("later-one", "later-two")
    ]
    return Rubric.model_validate({**plain.model_dump(by_alias=True), "criteria": (*shown, *left)})


def figures() -> Figures:
    """Two runs with the same graph, and one of whose names most want to be more than names."""
    plain = GraphFigure(
        scenario="real",
        nodes=("/numeric_talker", "/rosout"),
        topics=("/chatter",),
        edges=(Edge(node="/numeric_talker", topic="/chatter", publishes=True),),
    )
    bad = GraphFigure(
        scenario=MERMAID,
        nodes=(*TEXTS, "end", "`**x**`", "1. foo", ""),
        topics=("/chatter", '"]', "```"),
        edges=(Edge(node=SCRIPT, topic="```", publishes=True), Edge(node="end", topic='"]', publishes=False)),
        left_out=3,
    )
    return Figures(graphs={"real": plain, "again": plain, MERMAID: bad})


DOCS = {f"check-{name}": {"What it checks": "This.", "How to fix": "So: `rospy.Rate(10)`."} for name in NAMES}
