"""Feedback as files, what is kept of what was sent, and what a failure costs."""

from __future__ import annotations

import io
import json
import tarfile
import zipfile
from email import message_from_bytes
from email.message import EmailMessage
from email.policy import default
from pathlib import Path

import pytest

from grader.classes.feedback.files import FeedbackFolder
from grader.classes.feedback.forms import FORMS, Feedback
from grader.classes.feedback.publish import read_published
from grader.cli.main import run
from grader.model.batch import Publication
from tests.classes.feedback.a_class import award, feedback, publish, sent

pytestmark = pytest.mark.usefixtures("without_processes")


def report(out: Path, name: str, file: str = "report.html") -> bytes:
    published = read_published(out)
    return (published.folder(published.history[name][-1]) / file).read_bytes()


def test_a_folder_for_each_student(published: Path, capsys) -> None:
    assert feedback(published, "folder") == 0
    said = capsys.readouterr().out
    assert "4 sent by folder, 2 not published\n" in said
    assert {path.name for path in (published / "feedback").iterdir()} == {"ada", "bob", "cem", "fay"}
    for file in ("report.md", "report.html"):
        assert (published / "feedback" / "ada" / file).read_bytes() == report(published, "ada", file)
    assert [line[2] for line in sent(published)] == ["sent"] * 4


def test_nothing_is_sent_twice(published: Path, capsys) -> None:
    feedback(published, "folder", "--only", "ada")
    feedback(published, "folder")
    assert feedback(published, "folder") == 0
    assert "0 sent by folder, 4 sent before, 2 not published\n" in capsys.readouterr().out
    assert [line[0] for line in sent(published)] == ["ada", "bob", "cem", "fay"]
    feedback(published, "folder", "--again", "--only", "bob")
    assert len(sent(published)) == 5


def test_a_change_is_sent_as_a_change(published: Path) -> None:
    feedback(published, "folder")
    award(published, "ada", "style", 9, "clear names")
    publish(published)
    feedback(published, "folder", "--out", str(published / "more"))
    (more,) = (published / "more").iterdir()
    assert "85 → 89: override by ann, clear names (style)" in (more / "report.md").read_text()


def test_changed_since(published: Path, capsys) -> None:
    at = read_published(published).history["fay"][0].at
    assert feedback(published, "folder", "--changed-since", at.isoformat()) == 0
    assert "0 sent by folder, 4 published earlier than that" in capsys.readouterr().out
    assert feedback(published, "folder", "--changed-since", "2020-01-01") == 0
    assert feedback(published, "folder", "--changed-since", "soon") == 2


def test_a_dry_run_shows_one_and_sends_none(published: Path, capsys) -> None:
    before = {path: path.read_bytes() for path in published.rglob("*") if path.is_file()}
    for form in ("folder", "email"):
        feedback(published, form, "--dry-run")
        said = capsys.readouterr().out
        assert "85 of 100 points" in said
        assert said.count("ada → ") == 1
        assert "bob → " not in said
    assert {path: path.read_bytes() for path in published.rglob("*") if path.is_file()} == before


def test_nothing_is_sent_of_a_class_that_is_not_published(out: Path, capsys) -> None:
    assert feedback(out, "folder") == 2
    assert f"hint: grader publish {out}; or --drafts" in capsys.readouterr().err
    assert feedback(out, "folder", "--drafts", "--only", "ada", "eve") == 0
    assert {path.name for path in (out / "feedback").iterdir()} == {"ada", "eve"}
    assert not (out / "published.jsonl").exists()


def test_a_failure_costs_one_student(published: Path, capsys) -> None:
    for path in (published / ".published" / "bob").glob("*/report.md"):
        path.unlink()
    assert feedback(published, "folder") == 3
    said = capsys.readouterr()
    assert "3 sent by folder, 2 not published, 1 could not be sent\n" in said.out
    assert "grader: 1 student got nothing:\n" in said.err
    assert "bob: " in said.err
    assert ("bob", "folder", "failed") in sent(published)
    assert feedback(published, "folder") == 3
    assert [line[0] for line in sent(published)].count("ada") == 1


def test_what_is_interrupted_goes_on(published: Path, capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    send = FeedbackFolder.send

    def one_only(self: FeedbackFolder, feedback: Feedback, *, look: bool = False) -> str:
        if feedback.entry.id != "ada":
            raise KeyboardInterrupt
        return send(self, feedback, look=look)

    monkeypatch.setattr(FeedbackFolder, "send", one_only)
    assert feedback(published, "folder") == 130
    assert "grader: 1 of 4 sent; the same command continues\n" in capsys.readouterr().err
    monkeypatch.undo()
    assert feedback(published, "folder") == 0
    assert [line[0] for line in sent(published)] == ["ada", "bob", "cem", "fay"]


def test_a_torn_line_is_passed_over(published: Path) -> None:
    feedback(published, "folder", "--only", "ada")
    with (published / "sent.jsonl").open("a") as file:
        file.write('{"schema": "grader.sent/1", "id": "bo')
    assert feedback(published, "folder") == 0
    lines = (published / "sent.jsonl").read_text().splitlines()
    assert len(lines) == 5
    assert [json.loads(line)["id"] for line in lines if line.endswith("}")] == ["ada", "bob", "cem", "fay"]


def test_a_form_says_which_options_it_takes(published: Path, capsys) -> None:
    assert feedback(published, "git", "--smtp", "smtp://x") == 2
    assert "--form git does not take --smtp" in capsys.readouterr().err
    assert feedback(published, "folder", "--only", "nobody") == 2
    assert run(["feedback", str(published), "--form", "pigeon"]) == 2
    assert all(form.purpose for form in FORMS.values())


def test_moodles_zip(published: Path, capsys) -> None:
    assert feedback(published, "moodle") == 3
    assert "  bob, fay: Moodle's number for this submission is not known" in capsys.readouterr().err
    with zipfile.ZipFile(published / "feedback-moodle.zip") as made:
        assert made.namelist() == [
            "Ada Lovelace_101_assignsubmission_file_/report.html",
            "cem_103_assignsubmission_file_/report.html",
        ]
        assert made.read(made.namelist()[0]) == report(published, "ada")
        for name in made.namelist():
            assert _moodle_reads(name) in {("101", "report.html"), ("103", "report.html")}


def _moodle_reads(name: str) -> tuple[str, str]:
    """As mod/assign/feedback/file/importziplib.php takes a name apart: the participant's number, and the file."""
    parts = name.split("/")
    while parts:
        info = parts.pop(0).split("_", 4)
        if len(info) >= 4 and info[1].isdecimal() and info[2:4] == ["assignsubmission", "file"]:
            rest = [info[4] if len(info) > 4 else "", *parts]
            return info[1], "/".join(rest).lstrip("/")
    return "", ""


def test_a_zip_has_what_was_not_in_the_one_before(published: Path) -> None:
    feedback(published, "moodle")
    award(published, "cem", "style", 9)
    publish(published)
    feedback(published, "moodle")
    feedback(published, "moodle")
    with zipfile.ZipFile(published / "feedback-moodle-2.zip") as made:
        assert made.namelist() == ["cem_103_assignsubmission_file_/report.html"]
    assert not (published / "feedback-moodle-3.zip").exists()
    assert feedback(published, "moodle", "--again", "--out", str(published / "feedback-moodle.zip")) == 2


def test_the_names_of_canvas_stay_as_they_are(published: Path, capsys) -> None:
    assert feedback(published, "canvas", "--out", str(published / "up.zip")) == 3
    assert (
        "ada, fay: the name of the file that was submitted to Canvas is not known" in capsys.readouterr().err
    )
    with zipfile.ZipFile(published / "up.zip") as made:
        assert made.namelist() == ["bobby_LATE_12_345_lab1.zip", "cem_13_346_lab1.tar.gz"]
        bob, cem = (io.BytesIO(made.read(name)) for name in made.namelist())
    with zipfile.ZipFile(bob) as inner:
        assert inner.read("report.html") == report(published, "bob")
    with tarfile.open(fileobj=cem) as packed:
        assert packed.getnames() == ["report.html", "report.md"]
        page = packed.extractfile("report.html")
        assert page is not None
        assert page.read() == report(published, "cem")


def mails(folder: Path) -> dict[str, EmailMessage]:
    found = {path.stem: message_from_bytes(path.read_bytes(), policy=default) for path in folder.iterdir()}
    assert all(isinstance(mail, EmailMessage) for mail in found.values())
    return found  # type: ignore[return-value] - as asserted


def test_a_mail_for_each_student(published: Path, capsys) -> None:
    assert feedback(published, "email", "--from", "lab@x.example") == 3
    assert "fay: no mail address is known" in capsys.readouterr().err
    found = mails(published / "mails")
    assert set(found) == {"ada", "bob", "cem"}
    ada = found["ada"]
    assert (ada["From"], ada["To"]) == ("lab@x.example", "ada@x.example")
    assert found["cem"]["To"] == "c@x.example, d@x.example"
    assert ada["Subject"].endswith(": 85 of 100 points")
    text = ada.get_body(("plain",))
    assert text is not None
    assert text.get_content().startswith("85 of 100 points\r\n")
    assert "To fix" in text.get_content()
    assert "bob" not in text.get_content()
    assert "<details>" not in text.get_content()
    (page,) = ada.iter_attachments()
    assert page.get_filename() == "report.html"
    assert page.get_content().encode() == report(published, "ada")


@pytest.mark.parametrize(
    "said",
    [
        "nobody",
        "ada@x.example\nBcc: eve@x.example",
        "a@b@c",
        "Ada <ada@x.example>",
        "ada@x.example, none",
        "@x",
    ],
)
def test_what_is_no_address_gets_no_mail(published: Path, said: str) -> None:
    run_ = published / "run.json"
    data = json.loads(run_.read_text())
    data["entries"][0]["extra"]["Email"] = said
    run_.write_text(json.dumps(data))
    assert feedback(published, "email", "--only", "ada") == 3
    assert not (published / "mails").exists()


def test_a_title_becomes_one_harmless_line(tmp_path: Path) -> None:
    (tmp_path / "report.md").write_text("# 85 of 100 points\n")
    publication = Publication.model_construct(id="ada", digest="d")
    made = Feedback(
        entry=None,  # type: ignore[arg-type] - not looked at
        publication=publication,
        name="ada",
        title="Lab\r\nBcc: eve@x.example\x1b",
        folder=tmp_path,
    )
    assert made.subject == "Lab\\r\\nBcc: eve@x.example\\x1b: 85 of 100 points"
