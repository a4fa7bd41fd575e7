"""Late work, overrides and notes stand in every report that people read."""

from __future__ import annotations

import io
import json
from datetime import date, datetime, timedelta, timezone

import pytest
from lxml import etree

from grader.model.result import AppliedOverride, Automatic, ErrorInfo, GradingResult, HandedIn, Lateness, Note
from grader.model.verdict import FileCitation, Status
from grader.report.files import result_bytes
from grader.report.junit import render_junit
from grader.report.markdown import render_markdown
from grader.report.sentences import late_words
from grader.report.terminal import Terminal, open_console
from grader.report.view import file_places
from tests.report.hostile import result, rubric
from tests.support.a_class import criterion

DEADLINE = datetime(2026, 11, 20, 23, 59, tzinfo=timezone(timedelta(hours=1)))
DEADLINE_WORDS = "deadline 2026-11-20 23:59 UTC+01:00 with 1 day of extension"
LATE = Lateness(
    at=datetime(2026, 11, 22, 8, 0, 7, tzinfo=timezone.utc),
    by="commit",
    deadline=DEADLINE,
    extension_days=1,
    note="the last commit on main counts",
    late_s=118_807,
    points_before=87.5,
    points=70,
    text="2 days late (begun days count): 20 % of 87.5 points reached are lost",
)
FAILED = Automatic(status=Status.FAIL, points=0, message="5 Hz, not 10 Hz")
PASSED = Automatic(status=Status.PASS, points=10, message="10 Hz")
STYLE = AppliedOverride(
    criterion="style",
    points=7,
    comment="clear names",
    author="A. Miller",
    date=date(2026, 11, 2),
    automatic=Automatic(status=Status.MANUAL, points=0, message="a person awards these points"),
    was=Automatic(status=Status.MANUAL, points=0, message="a person awards these points"),
)
RATE = AppliedOverride(criterion="rate", points=8, automatic=PASSED, was=FAILED, changed=True)
CRITERIA = (
    criterion("style", Status.PARTIAL, 7, 10, message="7 of 10 points by A. Miller: clear names"),
    criterion(
        "rate", Status.PARTIAL, 8, 10, message="8 of 10 points, decided by a person", hint="sleep less"
    ),
    criterion("build", Status.PASS, 80, 80),
)
AGAIN = "the check now says 10/10 (passed), it said 0/10 (to fix) when this was decided: look again"


def settled(**changes: object) -> GradingResult:
    data = {"criteria": CRITERIA, "overrides": (STYLE, RATE), "late": LATE, "points": 70, "status": "graded"}
    return result(**{**data, **changes})


def terminal(shown: GradingResult) -> str:
    out = io.StringIO()
    Terminal(open_console(out)).report(shown, rubric())
    return out.getvalue()


def test_words_of_being_late():
    assert late_words(settled()) == (
        "87.5 of 100 points before, 70 after: 2 days late (begun days count): 20 % of 87.5 points reached are lost",
        f"Submitted 2026-11-22 09:00:07 UTC+01:00 (the commit's date), {DEADLINE_WORDS}",
        "The last commit on main counts",
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"late": None}, ()),
        ({"late": None, "handed_in": HandedIn(note="the folder as it is")}, ("The folder as it is",)),
        (
            {"late": None, "handed_in": HandedIn(at=DEADLINE, by="roster")},
            ("Submitted 2026-11-20 23:59 UTC+01:00 (as the roster says)",),
        ),
        (
            {"late": Lateness(deadline=DEADLINE, points_before=70, points=70, text="in time")},
            ("In time", "Deadline 2026-11-20 23:59 UTC+01:00"),
        ),
    ],
)
def test_words_where_nothing_was_lost(changes, words):
    assert late_words(settled(**changes)) == words


def test_markdown_says_it_below_the_points():
    text = render_markdown(settled(), rubric())
    assert text.startswith("# 70 of 100 points\n\n87.5 of 100 points before, 70 after: 2 days late")
    assert "\n\nThe last commit on main counts\n\n" in text
    section = text[text.index("## Decided by a person") : text.index("## To fix")]
    assert section == (
        "## Decided by a person\n\n"
        "- `style`: 7/10 by A. Miller, 2026-11-02: clear names\n"
        "- `rate`: 8/10 by a person\n"
        "  - The check says: 10/10 (passed): 10 Hz\n"
        f"  - **{AGAIN}**\n\n"
    )


def test_the_terminal_says_it_below_the_points():
    text = terminal(settled())
    assert text.startswith("ada\nhostile-lab: A lab | with *markup*\n87.5 of 100 points before, 70")
    assert "\n70 of 100 points, " in text
    section = text[text.index("Decided by a person") : text.index("\nTo fix\n")]
    assert "style  7/10\n  by A. Miller, 2026-11-02: clear names\n" in section
    assert AGAIN in " ".join(section.split())
    assert section.count("look again") == 1


def test_junit_has_it_as_properties_and_in_the_output():
    suite = etree.fromstring(render_junit(settled()))[0]
    values = {p.get("name"): p.get("value") for p in suite.iterfind("properties/property")}
    assert (values["points"], values["points_before"], values["late"]) == ("70", "87.5", LATE.text)
    style, rate, build = [
        dict(row.split(": ", 1) for row in case.findtext("system-out").splitlines())
        for case in suite.iterfind("testcase")
    ]
    assert style["decided_by_a_person"] == "by A. Miller, 2026-11-02: clear names"
    assert (rate["check"], rate["look_again"]) == ("10/10 (passed): 10 Hz", AGAIN)
    assert "look_again" not in style
    assert "check" not in build


def test_nothing_of_it_where_nobody_decided():
    for text in (render_markdown(result(), rubric()), terminal(result()), render_junit(result()).decode()):
        assert "ecided by" not in text
        assert "late" not in text


def test_a_long_comment_stays_whole_in_a_result_of_many_criteria():
    comment = "x\x1b" * 1000
    many = tuple(criterion(f"c{i}", Status.PASS, 1, 1, message=comment) for i in range(300))
    override = STYLE.model_copy(update={"criterion": "c0", "comment": comment})
    data = json.loads(result_bytes(settled(criteria=many, overrides=(override,))))
    assert data["overrides"][0]["comment"] == comment
    assert data["criteria"][0]["message"].endswith("more characters)")
    assert data["overrides"][0]["date"] == "2026-11-02"


def test_a_hint_is_no_advice_where_a_person_has_decided():
    right = CRITERIA[1].model_copy(update={"status": Status.PASS, "points": 10})
    assert "sleep less" not in render_markdown(settled(criteria=(CRITERIA[0], right, CRITERIA[2])), rubric())


def test_what_a_person_graded_in_the_graders_place_is_graded():
    error = ErrorInfo(kind="submission", message="no package in it", hint="hand in a package")
    text = render_markdown(settled(error=error), rubric())
    assert text.startswith("# 70 of 100 points\n")
    assert "It could not be graded automatically:\n\nno package in it\n\nhand in a package\n" in text
    assert "## To fix" in text
    assert render_markdown(settled(error=error, status="error"), rubric()).startswith("# Not graded\n")


def test_of_what_could_not_be_opened_there_is_no_digest() -> None:
    one = settled(
        error=ErrorInfo(kind="submission", message="the archive is damaged", hint=""), status="error"
    )
    assert "package digest" in render_markdown(one, rubric())
    gone = one.submission.model_copy(update={"digest": "", "package": ""})
    assert "recording digest" not in render_markdown(one.model_copy(update={"submission": gone}), rubric())


NOTES = (
    Note(scenario="real", actor="talker.py", kind="refused", text="asked the master to shut down"),
    Note(scenario="package", actor="", kind="limit", text="had more than 400 processes"),
)
COSTS_NOTHING = "None of this cost any points."


def test_result_json_names_them_last_and_only_where_there_are_any():
    data = json.loads(result_bytes(result(notes=NOTES)))
    assert list(data)[-2:] == ["timing", "notes"]
    assert data["notes"][0] == {
        "scenario": "real",
        "actor": "talker.py",
        "kind": "refused",
        "text": "asked the master to shut down",
    }
    assert "notes" not in json.loads(result_bytes(result()))


def test_markdown_has_a_section():
    text = render_markdown(result(notes=NOTES), rubric())
    assert (
        f"<summary>Noticed while it ran (2)</summary>\n\n{COSTS_NOTHING}\n\n- `real, talker.py`: asked the master"
        in text
    )
    assert "- `build`: had more than 400 processes (over the limit)" in text
    assert "Noticed" not in render_markdown(result(), rubric())


def test_the_terminal_has_a_section():
    out = io.StringIO()
    Terminal(open_console(out)).report(result(notes=NOTES), rubric())
    assert "\nNoticed while it ran\n" in out.getvalue()
    assert "  real, talker.py: asked the master to shut down (refused)\n" in out.getvalue()
    assert COSTS_NOTHING in out.getvalue()


def test_junit_has_it_as_output_of_the_suite():
    suite = etree.fromstring(render_junit(result(notes=NOTES)))[0]
    assert suite[-1].tag == "system-out"
    assert suite[-1].text.splitlines() == [
        f"Noticed while it ran. {COSTS_NOTHING}",
        "real, talker.py: asked the master to shut down (refused)",
        "build: had more than 400 processes (over the limit)",
    ]
    assert etree.fromstring(render_junit(result())).find("testsuite/system-out") is None


def test_a_file_is_named_with_its_lines_only_where_they_are_known():
    cited = (FileCitation(file="a.yaml"), FileCitation(file="b.py"), FileCitation(file="a.yaml", line=5))
    assert file_places(criterion("config", Status.FAIL, 0, 5, citations=cited)) == ["b.py", "a.yaml:5"]
