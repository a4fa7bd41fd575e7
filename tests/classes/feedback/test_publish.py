"""Results are drafts until they are published, and what is published stays as it was."""

from __future__ import annotations

import csv
import json
import os
import stat
from pathlib import Path

import pytest

from grader.classes.batch.folder import open_batch
from grader.classes.batch.run import hold_folder
from grader.classes.feedback.publish import changes_between, read_published
from grader.cli.main import run
from grader.model.result import AppliedOverride, Automatic, GradingResult, Lateness
from grader.model.verdict import Status
from tests.classes.feedback.a_class import award, publish, write_result
from tests.classes.review.a_class import result_of
from tests.support.a_class import criterion, made_result

pytestmark = pytest.mark.usefixtures("without_processes")

CRITERIA = (criterion("rate", Status.FAIL, 0, 10), criterion("style", Status.PASS, 10, 10))


def by(
    author: str, points: float, comment: str = "", name: str = "rate", answer: str = ""
) -> AppliedOverride:
    was = Automatic(status=Status.FAIL, points=0, message="")
    return AppliedOverride(
        criterion=name,
        points=points,
        comment=comment,
        author=author,
        automatic=was,
        was=was,
        answer=answer,
    )


def result(rate: float = 0, **fields: object) -> GradingResult:
    status = Status.PASS if rate == 10 else Status.PARTIAL if rate else Status.FAIL
    criteria = (criterion("rate", status, rate, 10, message="5 Hz"), CRITERIA[1])
    return made_result("ada", criteria, **fields)  # type: ignore[arg-type] - names as they are


LATE = Lateness(late_s=86400, points_before=10, points=5, text="1 day late: 5 taken")


@pytest.mark.parametrize(
    ("before", "after", "lines"),
    [
        (result(), result(), ()),
        (
            result(),
            result(10, overrides=(by("ann", 10, "clear"),)),
            ("10 → 20: override by ann, clear (rate)",),
        ),
        (result(10, overrides=(by("ann", 10),)), result(), ("20 → 10: an override was taken back (rate)",)),
        (result(), result(5), ("10 → 15: judged again (rate): 5 Hz",)),
        (
            result(5, overrides=(by("", 5, "a"),)),
            result(5, overrides=(by("", 5, "b"),)),
            ("override by a person, b (rate)",),
        ),
        (
            result(5, overrides=(by("ann", 5, "a"),)),
            result(5, overrides=(by("bob", 5, "a", answer="No."),)),
            ("request answered (rate)",),
        ),
        (result(), result(overrides=(by("ann", 0, answer="No."),)), ("request answered (rate)",)),
        (
            result(5, overrides=(by("ann", 5, "a"),)),
            result(10, overrides=(by("ann", 10, "a", answer="Yes."),)),
            ("15 → 20: override by ann, a (rate)",),
        ),
        (
            result(),
            result(5, late=LATE, points=5),
            ("10 → 5", "judged again (rate): 5 Hz", "1 day late: 5 taken"),
        ),
        (made_result("ada", error="no package"), result(10), ("not graded → 20",)),
        (result(10), made_result("ada", error="no package"), ("20 → not graded: no package",)),
    ],
)
def test_what_changed_in_words(before: GradingResult, after: GradingResult, lines: tuple[str, ...]) -> None:
    assert changes_between(before, after) == lines


def test_of_hidden_criteria_it_is_said_that_there_are_some() -> None:
    after = result(10, overrides=(by("ann", 10, "a secret"),))
    assert changes_between(result(), after, {"rate"}) == (
        "10 → 20: 1 criterion that your course does not show",
    )


def test_what_is_settled_is_published_and_the_rest_stays_a_draft(out: Path, capsys) -> None:
    assert publish(out) == 3  # of one there is no result
    said = capsys.readouterr().out
    assert "eve: stays a draft: not decided yet: style and answers\n" in said
    assert "gus: stays a draft: not graded yet\n" in said
    assert "4 published, 2 left as drafts\n" in said
    published = read_published(out)
    assert list(published.history) == ["ada", "bob", "cem", "fay"]
    (ada,) = published.history["ada"]
    assert (ada.by, ada.points, ada.status, ada.changes) == ("kim", 85, "graded", ())
    frozen = GradingResult.read_json((published.folder(ada) / "result.json").read_bytes())
    assert frozen == result_of(out, "ada")
    assert publish(out, "--only", "ada", "bob") == 0
    assert "2 published before and not changed\n" in capsys.readouterr().out
    assert len(read_published(out).history["ada"]) == 1


def test_a_draft_that_is_named_is_published_as_it_is(out: Path, capsys) -> None:
    assert publish(out, "--only", "eve") == 0
    assert read_published(out).history["eve"][0].status == "inconclusive"
    assert publish(out, "--only", "gus") == 3
    assert publish(out, "--only", "eva") == 2
    assert 'did you mean "eve"?' in capsys.readouterr().err


def test_a_later_change_is_a_draft_until_it_is_published_as_a_change(out: Path, capsys) -> None:
    publish(out)
    award(out, "ada", "style", 9, "clear names")
    award(out, "bob", "answers", 9, "the hidden answer was 42")
    capsys.readouterr()
    publish(out, "--dry-run")
    said = capsys.readouterr().out
    assert "ada: 85 → 89: override by ann, clear names (style)\n" in said
    assert "bob: 85 → 89: override by ann, the hidden answer was 42 (answers)\n" in said
    assert len(read_published(out).history["ada"]) == 1
    publish(out)
    published = read_published(out)
    ada, bob = (published.history[name][-1] for name in ("ada", "bob"))
    assert ada.changes == ("85 → 89: override by ann, clear names (style)",)
    assert bob.changes == ("85 → 89: 1 criterion that your course does not show",)
    text = (published.folder(ada) / "report.md").read_text()
    page = (published.folder(ada) / "report.html").read_text()
    assert f"- {ada.at:%Y-%m-%d}: 85 → 89: override by ann, clear names (style)\n" in text
    assert f"<li>{ada.at:%Y-%m-%d}: 85 → 89: override by ann, clear names (style)</li>" in page


@pytest.mark.parametrize("name", ["report.md", "report.html"])
def test_students_see_points_and_no_words_of_hidden_criteria(out: Path, name: str) -> None:
    publish(out)
    published = read_published(out)
    shown = (published.folder(published.history["ada"][0]) / name).read_text()
    assert "85" in shown
    assert "not-shown" in shown
    assert "answers" not in shown
    assert "questions of the sheet" not in shown
    publish(out, "--only", "eve", "--show-hidden")
    eve = read_published(out)
    assert "answers" in (eve.folder(eve.history["eve"][0]) / name).read_text()


def test_what_is_said_to_those_who_mark_is_not_said_to_students(out: Path) -> None:
    before = result_of(out, "ada")
    override = before.overrides[0].model_copy(update={"changed": True})
    write_result(out, "ada", before.model_copy(update={"overrides": (override,)}))
    publish(out)
    published = read_published(out)
    assert "look again" not in (published.folder(published.history["ada"][0]) / "report.md").read_text()


def grades(path: Path) -> dict[str, dict[str, str]]:
    return {row["id"]: row for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines())}


def test_gradebooks_have_drafts_until_something_is_published(out: Path, capsys) -> None:
    run(["gradebook", str(out), "--form", "csv"])
    said = capsys.readouterr()
    assert said.out == f"{out / 'gradebook.csv'}\n"
    assert f"these are drafts: nothing of this class is published yet (grader publish {out})" in said.err
    assert grades(out / "gradebook.csv")["ada"]["points"] == "85"


def test_gradebooks_have_what_is_published(out: Path, capsys) -> None:
    publish(out)
    award(out, "ada", "style", 9)
    capsys.readouterr()
    run(["gradebook", str(out), "--form", "csv"])
    said = capsys.readouterr()
    assert said.out == f"{out / 'gradebook-published.csv'}\n"
    assert f"left empty, because it is not published (grader publish {out}): eve and gus\n" in said.err
    assert "1 changed after they were published and stand here as published" in said.err
    found = grades(out / "gradebook-published.csv")
    assert (found["ada"]["points"], found["ada"]["style"]) == ("85", "5")
    assert (found["eve"]["points"], found["eve"]["error"]) == ("", "not published yet")
    run(["gradebook", str(out), "--form", "csv", "--drafts"])
    assert capsys.readouterr().err == ""
    assert grades(out / "gradebook.csv")["ada"]["points"] == "89"


def test_json_says_what_is_done(out: Path, capsys) -> None:
    publish(out, "--json")
    found = {one["id"]: one for one in json.loads(capsys.readouterr().out)}
    assert (found["ada"]["state"], found["ada"]["points"]) == ("new", 85)
    assert (found["eve"]["state"], found["eve"]["why"]) == ("draft", "not decided yet: style and answers")


def test_published_results_are_for_their_owner_alone(out: Path) -> None:
    before = os.umask(0)
    try:
        publish(out)
    finally:
        os.umask(before)
    made = [out / "published.jsonl", *(out / ".published").rglob("*")]
    assert {stat.S_IMODE(path.stat().st_mode) for path in made} == {0o600, 0o700}


def test_nothing_is_published_while_a_batch_works(out: Path, capsys) -> None:
    with hold_folder(out):
        assert publish(out) == 3
    assert "another batch works" in capsys.readouterr().err
    assert not (out / "published.jsonl").exists()


def test_a_changed_rubric_is_refused(out: Path, tmp_path: Path, capsys) -> None:
    rubric = tmp_path / "other.yaml"
    source = Path(open_batch(out).run.rubric_source)
    rubric.write_text(source.read_text() + "\n# changed\n")
    run_ = out / "run.json"
    run_.write_text(run_.read_text().replace(str(source), str(rubric)))
    assert publish(out) == 2
    assert "grader regrade" in capsys.readouterr().err


def test_a_file_of_a_newer_grader_is_refused(out: Path, capsys) -> None:
    publish(out)
    path = out / "published.jsonl"
    path.write_text(path.read_text().replace("grader.published/1", "grader.published/2"))
    capsys.readouterr()
    assert publish(out) == 2
    assert "written by a newer grader (grader.published/2); this one reads up to 1" in capsys.readouterr().err
    path.write_text("torn")
    assert publish(out) == 2


def test_rows_that_are_not_in_the_class_are_named(out: Path, capsys) -> None:
    run_ = out / "run.json"
    data = json.loads(run_.read_text())
    data["faults"] = [{"where": "roster.csv:9", "id": "hal", "text": "no source"}]
    run_.write_text(json.dumps(data))
    publish(out, "--dry-run")
    assert "hal: cannot be published: roster.csv:9: no source\n" in capsys.readouterr().out


def test_an_answer_alone_is_published(out: Path, capsys) -> None:
    publish(out)
    award(out, "ada", "style", 5, answer="It stays.")
    capsys.readouterr()
    publish(out)
    assert "ada: request answered (style)\n" in capsys.readouterr().out
    published = read_published(out)
    assert (
        "to your request: It stays."
        in (published.folder(published.history["ada"][-1]) / "report.md").read_text()
    )
