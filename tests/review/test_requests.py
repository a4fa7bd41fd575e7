"""What students ask stands beside the criterion, and the answer in their report."""

from __future__ import annotations

import pytest

from grader.classes.review.requests import Request, read_requests
from tests.review.a_class import overrides_of, points_of, result_of
from tests.review.test_pages import rows

ASKED = """\
when,student,criterion,text,mail
2026-11-09,dana,counter-wrap,"Why 0?
It is <b>right</b>.",d@x
,ADA,style,Could I have more?,
,danna,style,x,
,dana,stile,x,
"""


@pytest.fixture
def asked(out):
    (out / "requests.csv").write_text(ASKED)


def test_rows_become_requests_and_faults_name_their_line(tmp_path) -> None:
    path = tmp_path / "requests.csv"
    path.write_text("\ufeff" + ASKED)
    found = read_requests(path, ["ada", "dana"], ["style", "counter-wrap"])
    assert found.found == {
        "dana": {"counter-wrap": (Request(text="Why 0?\nIt is <b>right</b>.", when="2026-11-09"),)},
        "ada": {"style": (Request(text="Could I have more?", when=""),)},
    }
    assert found.faults == (
        'requests.csv:5: there is no submission "danna" (did you mean "dana"?)',
        'requests.csv:6: there is no criterion "stile" (did you mean "style"?)',
    )


@pytest.mark.parametrize(("text", "column"), [("", "student"), ("student,text\n", "criterion")])
def test_a_file_without_a_column_says_so(tmp_path, text, column) -> None:
    (tmp_path / "requests.csv").write_text(text)
    found = read_requests(tmp_path / "requests.csv", ["ada"], ["style"])
    assert (found.found, found.faults) == ({}, (f"requests.csv:1: there is no column {column}",))


def test_no_file_is_no_request(tmp_path) -> None:
    found = read_requests(tmp_path / "requests.csv", ["ada"], ["style"])
    assert (found.found, found.faults) == ({}, ())


@pytest.mark.usefixtures("asked")
def test_they_are_listed_beside_the_criterion(page) -> None:
    assert rows(page.text("/?show=asked")) == ["ada", "dana"]
    assert rows(page.text("/?c=style&show=asked")) == ["ada"]
    text = page.text("/s/dana/?c=counter-wrap")
    assert "The student asks (2026-11-09):" in text
    assert "<b>right</b>" not in text
    assert "requests.csv:5: there is no submission" in text


@pytest.mark.usefixtures("asked")
def test_the_answer_is_kept_and_the_student_reads_it(page, out) -> None:
    before = points_of(out, "dana", "counter-wrap")
    page.save("dana", "counter-wrap", points=f"{before:g}", answer="It wraps at 127, see line 12.")
    assert overrides_of(out)["dana"]["counter-wrap"]["answer"] == "It wraps at 127, see line 12."
    assert points_of(out, "dana", "counter-wrap") == before
    (said,) = [c.message for c in result_of(out, "dana").criteria if c.id == "counter-wrap"]
    assert said.endswith("by A. Miller; to your request: It wraps at 127, see line 12.")
    assert "It wraps at 127, see line 12." in (out / "dana" / "report.html").read_text()
    assert rows(page.text("/?show=asked")) == ["ada"]


@pytest.mark.usefixtures("asked")
def test_a_decision_without_an_answer_leaves_it_open(page) -> None:
    page.save("ada", "style", points="9")
    assert rows(page.text("/?show=asked")) == ["ada", "dana"]
