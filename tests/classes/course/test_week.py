"""A course week, from the roster to the feedback in each student's hands, played with the commands that people use."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from grader.classes.roster.entries import read_table
from grader.cli.main import run
from tests.classes.batch.a_class import CORRECT, RUBRIC, WRONG_NAME, lines_of
from tests.classes.course.samples import write_roster
from tests.classes.review.running import Server, Tab

STUDENTS = [f"s{number:02}" for number in range(60)]
LATE = {"s07": "2026-10-31T11:00:00Z", "s21": "2026-10-31T11:00:00Z"}
WRONG = {"s03", "s33"}
ASKED = {"s00": "Why not all?", "s10": "The names are the handout's.", "s20": "I had tests, too."}
BANK = {f"c{number}": {"text": f"Remark {number}", "points": number} for number in range(1, 11)}
COURSE = """title: Robotics 1
late: {lost: 10}
late_days: {budget: 2}
feedback: email
labs:
  lab1: {rubric: rubric.yaml, roster: roster.csv, deadline: 2026-10-30T12:00:00Z}
"""
STYLE = """
  - id: style
    title: The code reads well
    points: 10
    check: manual
"""
OUT = Path("results", "lab1")

pytestmark = pytest.mark.full


@pytest.fixture
def course(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GRADER_SMTP_FROM", "lab@course.example")
    shutil.copytree(CORRECT, "right")
    shutil.copytree(WRONG_NAME, "wrong")
    Path("rubric.yaml").write_text(RUBRIC.read_text().replace("points: 40", "points: 30") + STYLE)
    Path("course.yaml").write_text(COURSE)
    rows = [
        f"{one},{'wrong' if one in WRONG else 'right'},{LATE.get(one, '2026-10-30T11:00:00Z')},{one}@x.example"
        for one in STUDENTS
    ]
    write_roster(Path("roster.csv"), *rows, columns="id,source,submitted_at,Email")
    return tmp_path


def mark(*more: str) -> int:
    """One marker goes through all that wait for a decision on the style, with a comment of the bank each."""
    server = Server(OUT, *more)
    decided = 0
    try:
        tab = Tab(server)
        _, text = tab.ask("GET", "/criteria")
        found = re.search(r'class="row" href="(/s/[^"]*c=style[^"]*)"', text)
        assert found
        path = found[1].replace("&amp;", "&")
        while path.startswith("/s/"):
            key = path.split("/")[2]
            _, page = tab.ask("GET", path)
            form = dict(re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', own_form(page, key)))
            shown = page.replace(form["csrf"], "")  # random letters, which a student's id may be among
            assert not any(one in shown for one in STUDENTS), "blind"
            comment = f"c{decided % len(BANK) + 1}"
            fields = {**form, "bank": comment, "points": "", "comment": "", "do": "next"}
            answer, _ = tab.ask("POST", f"/s/{key}/c/style", fields)
            assert answer.status == 303
            decided += 1
            path = str(answer.getheader("Location"))
    finally:
        code, _, errors = server.end()
    assert code == 0, errors
    return decided


def own_form(page: str, key: str) -> str:
    found = re.search(rf'<form[^>]*action="/s/{key}/c/style".*?</form>', page, re.DOTALL)
    assert found
    return found.group()


def test_a_week(course: Path, capsys) -> None:
    run(["course", "grade", "course.yaml", "lab1", "--sandbox", "none"])
    (OUT / "comments.yaml").write_text(json.dumps({"style": BANK}))
    assert (
        mark("--marker", "ann", "--of", "2", "--blind") + mark("--marker", "bob", "--of", "2", "--blind")
        == 60
    )
    assert run(["course", "publish", "course.yaml", "lab1"]) == 0
    first = marks()
    assert {one["late"]["late_days_used"] for name, one in first.items() if name in LATE} == {1}
    assert all(one["points"] == (60 if name in WRONG else 90) + style(one) for name, one in first.items())
    assert mails_of() == dict.fromkeys(STUDENTS, 1)

    rows = "".join(f'{name},style,"{text}"\n' for name, text in ASKED.items())
    (OUT / "requests.csv").write_text(f"student,criterion,text\n{rows}")
    answer_all()
    with (course / "rubric.yaml").open("a") as file:
        file.write("# The same, in other words.\n")
    run(["regrade", str(OUT)])
    assert run(["course", "publish", "course.yaml", "lab1"]) == 0
    assert mails_of() == {name: 2 if name in ASKED else 1 for name in STUDENTS}
    for name in ASKED:
        newest = max((OUT / ".published" / name).iterdir(), key=lambda path: path.stat().st_mtime_ns)
        assert "You are right" in (newest / "report.md").read_text()
    agree()


def style(result: dict) -> float:
    (points,) = (c["points"] for c in result["criteria"] if c["id"] == "style")
    return points


def marks() -> dict[str, dict]:
    return {line["submission"]["id"]: line for line in lines_of(OUT)}


def mails_of() -> dict[str, int]:
    """How often each student was sent feedback."""
    lines = [json.loads(line) for line in (OUT / "sent.jsonl").read_text().splitlines()]
    sent = [line["id"] for line in lines if line["state"] == "sent"]
    return {name: sent.count(name) for name in STUDENTS}


def answer_all() -> None:
    server = Server(OUT)
    try:
        tab = Tab(server)
        for name in ASKED:
            form = tab.form(name, "style")
            assert tab.send(name, "style", form, points="10", comment="", answer="You are right.") == 303
    finally:
        assert server.end()[0] == 0


def agree() -> None:
    """The gradebooks of three platforms have the same marks: those that are published."""
    now = {name: one["points"] for name, one in marks().items()}
    for form in ("canvas", "moodle", "blackboard"):
        target = Path(f"{form}.csv")
        assert run(["gradebook", str(OUT), "--form", form, "--out", str(target)]) == 0
        cells = [list(row.fields.values()) for row in read_table(target).rows]
        found = {cell.partition("@")[0]: row for row in cells for cell in row if cell[:3] in STUDENTS}
        assert set(found) == set(STUDENTS), form
        assert all(f"{now[name]:g}" in row for name, row in found.items()), form
