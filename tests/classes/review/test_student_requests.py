"""What students ask stands beside the criterion, and the answer in their report."""

from __future__ import annotations

import pytest

from grader.classes.review.student_requests import (
    RequestRow,
    StudentRequest,
    read_requests,
    request_files,
    rows_of,
    write_requests,
)
from grader.judging.settle import settle
from grader.model.batch import Entry
from grader.model.verdict import Status
from grader.rubric.load import load_rubric
from tests.classes.review.a_class import overrides_of, points_of, result_of
from tests.classes.review.running import rows

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
    found = read(tmp_path, "\ufeff" + ASKED)
    assert found.found == {
        "dana": {"counter-wrap": (StudentRequest(text="Why 0?\nIt is <b>right</b>.", when="2026-11-09"),)},
        "ada": {"style": (StudentRequest(text="Could I have more?", when=""),)},
    }
    assert found.faults == (
        'requests.csv:5: there is no submission "danna" (did you mean "dana"?)',
        'requests.csv:6: there is no criterion "stile" (did you mean "style"?)',
    )


@pytest.mark.parametrize(("text", "column"), [("", "student"), ("student,text\n", "criterion")])
def test_a_file_without_a_column_says_so(tmp_path, text, column) -> None:
    found = read(tmp_path, text)
    assert (found.found, found.faults) == ({}, (f"requests.csv:1: there is no column {column}",))


def test_no_file_is_no_request(tmp_path) -> None:
    found = read(tmp_path)
    assert (found.found, found.faults) == ({}, ())


def test_a_student_whose_id_could_be_a_formula_is_found_in_what_was_written(tmp_path) -> None:
    path, asked = tmp_path / "requests-github.csv", StudentRequest(text="=Why?", when="2026", source="x")
    row = RequestRow(student="-ada", criterion="style", request=asked)
    write_requests(path, [row])
    assert "'-ada" in path.read_text()
    assert rows_of(path, {"-ada"}) == [row]
    criteria = load_rubric("leeds-comp3631-lab1").rubric.criteria
    found = read_requests(
        [path], [Entry(id="-ada", source="")], [criteria[0].model_copy(update={"id": "style"})]
    )
    assert found.found == {"-ada": {"style": (asked,)}}


def test_the_export_of_a_form_is_read_as_it_is(tmp_path) -> None:
    found = read(
        tmp_path,
        """\
Timestamp,E-mail address,Your name,Which criterion is your question about?,What is your question?,Score
2026/11/20 10:00,dana@x.example,D.,The counter wraps,Why 0?,
2026/11/20 10:01,,Ada Lovelace,style (names),Please look again,
2026/11/20 10:02,,Someone,style,Why?,
2026/11/20 10:03,,Ada Lovelace,style and counter-wrap,Both?,
""",
        """\
ID;x,student,text,criterion
1,ada,Please look again,style
""",
    )
    first, second = (
        StudentRequest(text="Please look again", when="2026/11/20 10:01"),
        StudentRequest(text="Please look again"),
    )
    both = StudentRequest(text="Both?", when="2026/11/20 10:03")
    assert found.found == {
        "dana": {"counter-wrap": (StudentRequest(text="Why 0?", when="2026/11/20 10:00"),)},
        "ada": {"style": (first, both, second), "counter-wrap": (both,)},
    }
    assert found.faults == ('requests.csv:4: there is no submission "Someone"',)


def read(folder, *texts):
    for number, text in enumerate(texts):
        (folder / f"requests{number or ''}.csv").write_text(text)
    entries = [
        Entry(id="ada", source="/ada", name="Ada Lovelace"),
        Entry(id="dana", source="/dana", extra={"Email address": "Dana@x.example"}),
    ]
    criteria = [
        criterion.model_copy(update={"id": name, "title": title})
        for criterion, name, title in zip(
            load_rubric("leeds-comp3631-lab1").rubric.criteria,
            ("style", "counter-wrap"),
            ("Style", "The counter wraps"),
            strict=False,
        )
    ]
    return read_requests(request_files(folder), entries, criteria)


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
def test_an_answer_alone_leaves_the_points_to_the_check(page, out, review) -> None:
    page.save("dana", "counter-wrap", answer="See line 12.")
    written = overrides_of(out)["dana"]["counter-wrap"]
    assert (written["answer"], "points" in written) == ("See line 12.", False)
    assert review.background.wait(60)
    (applied,) = result_of(out, "dana").overrides
    assert (applied.points, applied.answer, points_of(out, "dana", "counter-wrap")) == (
        None,
        "See line 12.",
        0,
    )
    assert rows(page.text("/?show=asked")) == ["ada"]
    assert rows(page.text("/?c=counter-wrap&show=lost")) == ["dana"]
    assert rows(page.text("/?c=counter-wrap&show=decided")) == []
    report = (out / "dana" / "report.md").read_text()
    assert "## Notes by a person" in report
    assert "0/15 with a note by A. Miller" in report
    assert "to your request: See line 12." in report
    assert "counter-wrap: See line 12. (A. Miller)" in (out / "gradebook.csv").read_text()


@pytest.mark.usefixtures("asked")
def test_a_regrade_after_an_answer_alone_counts_as_the_check_says(page, out, review) -> None:
    page.save("dana", "counter-wrap", answer="It was our mistake: judged again.")
    assert review.background.wait(60)
    answered = result_of(out, "dana")
    better = [
        c.model_copy(update={"status": Status.PASS, "points": c.full}) if c.id == "counter-wrap" else c
        for c in answered.criteria
    ]
    judged = answered.model_copy(update={"criteria": tuple(better), "overrides": ()})
    again = settle(
        judged,
        review.rubric.rubric,
        overrides=review.overrides()["dana"],
        handed_in=None,
        before=answered.overrides,
    )
    (note,) = again.overrides
    assert (note.answer, note.changed) == ("It was our mistake: judged again.", False)
    assert next(c.points for c in again.criteria if c.id == "counter-wrap") == 15
    assert again.points == answered.points + 15


@pytest.mark.usefixtures("asked")
def test_an_answer_alone_leaves_what_is_open_open(page, out, review) -> None:
    page.save("ada", "style", answer="We shall look.")
    assert review.background.wait(60)
    assert "ada" in rows(page.text("/?c=style&show=open"))
    assert rows(page.text("/?show=asked")) == ["dana"]
    form = page.form("eve", "style")
    page.send("eve", "style", form, points="6", do="alike")
    assert overrides_of(out)["ada"]["style"].keys() == {"answer", "author", "date", "answered"}
    page.save("ada", "style", answer="We shall look.", points="9")
    assert "ada" in rows(page.text("/?c=style&show=decided"))


@pytest.mark.usefixtures("asked")
def test_a_decision_without_an_answer_leaves_it_open(page) -> None:
    page.save("ada", "style", points="9")
    assert rows(page.text("/?show=asked")) == ["ada", "dana"]


@pytest.mark.usefixtures("asked")
def test_who_asks_again_waits_again(page, out) -> None:
    page.save("ada", "style", points="9", answer="No.")
    assert rows(page.text("/?show=asked")) == ["dana"]
    with (out / "requests.csv").open("a") as file:
        file.write(",ada,style,But why?,\n")
    assert rows(page.text("/?show=asked")) == ["ada", "dana"]
    page.save("ada", "style", points="9", answer="No.")  # saved once more, for another reason
    assert rows(page.text("/?show=asked")) == ["ada", "dana"]
    page.save("ada", "style", points="9", answer="No: see the handout.")
    assert rows(page.text("/?show=asked")) == ["dana"]


@pytest.mark.usefixtures("asked")
def test_an_answer_written_by_hand_is_to_all_questions(page, out) -> None:
    (out / "overrides.yaml").write_text("ada: {style: {points: 9, answer: No.}}\n")
    assert rows(page.text("/?show=asked")) == ["dana"]
