"""`grader report`: reports of results that are there already, of one submission and of a class."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest
from lxml import etree

from grader.cli.main import run
from grader.cli.select_rubric import package_prefix
from grader.model.result import RubricInfo
from grader.model.verdict import FileCitation, Status
from grader.report.files import write_reports
from grader.report.forms import FORMS
from grader.results import READY
from tests.classes.batch.a_class import LAB, recorded
from tests.report.hostile import result
from tests.support.a_class import criterion

REPORTS = ("report.html", "report.md", "junit.xml")


@pytest.fixture(scope="module")
def graded(tmp_path_factory) -> Path:
    kinds = {"ada": "correct", "bob": "dies-at-128", "cy": "correct"}
    return recorded(tmp_path_factory.mktemp("class") / "out", kinds)


@pytest.fixture
def lab(graded, tmp_path) -> Path:
    """A class of three, without the reports that were written when it was graded."""
    out = shutil.copytree(graded, tmp_path / "out")
    for report in out.rglob("*.*"):
        if report.name in REPORTS:
            report.unlink()
    return out


def changed(folder: Path, **changes: object) -> None:
    path = folder / "result.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


@pytest.mark.full
def test_a_class_gets_every_report_and_its_page(lab, capsys):
    before = {path: path.read_bytes() for path in lab.rglob("result.json")}
    assert run(["report", str(lab)]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines() == [f"3 of 3 written: {lab}", str(lab / "index.html")]
    assert err == ""
    for name in ("ada", "bob", "cy"):
        assert {path.name for path in (lab / name).iterdir()} == {
            *REPORTS,
            "result.json",
            "console.log",
            "evidence",
        }
        assert "```mermaid" in (lab / name / "report.md").read_text()
        etree.parse(lab / name / "junit.xml")
    assert "<svg" in (lab / "bob" / "report.html").read_text()
    assert {path: path.read_bytes() for path in lab.rglob("result.json")} == before


@pytest.mark.full
def test_the_same_reports_come_again(lab):
    assert run(["report", str(lab / "bob")]) == 0
    first = {name: (lab / "bob" / name).read_bytes() for name in REPORTS}
    assert run(["report", str(lab)]) == 0
    assert {name: (lab / "bob" / name).read_bytes() for name in REPORTS} == first


@pytest.mark.full
def test_a_page_without_names_is_written_beside_the_other(lab, tmp_path, capsys):
    assert run(["report", str(lab), "--anonymous", str(tmp_path / "page.html")]) == 0
    assert str(tmp_path / "page.html") in capsys.readouterr().out
    page = (tmp_path / "page.html").read_text()
    assert "bob" not in page.lower()
    assert "bob" in (lab / "index.html").read_text().lower()


@pytest.mark.full
def test_what_cannot_be_read_costs_the_others_nothing(lab, capsys):
    (lab / "bob" / "result.json").write_text("{")
    shutil.rmtree(lab / "cy" / "evidence")
    assert run(["report", str(lab)]) == 3
    out, err = capsys.readouterr()
    assert "2 of 3 written" in out
    assert f"grader: error: {lab / 'bob' / 'result.json'}: not what a grader writes" in err
    assert not (lab / "bob" / "report.md").exists()
    assert (lab / "ada" / "report.md").exists()
    assert "mermaid" not in (lab / "cy" / "report.md").read_text()


@pytest.mark.full
def test_another_version_of_the_rubric_is_said(lab, capsys):
    changed(lab / "bob", rubric={"id": "leeds-comp3631-lab1", "version": "0", "digest": "f" * 64})
    assert run(["report", str(lab)]) == 0
    assert capsys.readouterr().err.startswith("grader: report: bob: judged by another version of ")


def test_the_rubric_is_the_batchs_or_the_one_of_that_id(lab, tmp_path, capsys):
    alone = shutil.copytree(lab / "bob", tmp_path / "alone" / "bob")
    assert run(["report", str(alone)]) == 0
    changed(alone, rubric={"id": "somebodys-own", "version": "0", "digest": "f" * 64})
    assert run(["report", str(alone)]) == 2
    assert 'its rubric "somebodys-own" is not one of the labs that are known here' in capsys.readouterr().err
    assert run(["report", str(alone), "--rubric", str(LAB)]) == 2
    assert "a result of somebodys-own, not of leeds-comp3631-lab1" in capsys.readouterr().err
    own = tmp_path / "own.yaml"
    own.write_text(LAB.read_text().replace("id: leeds-comp3631-lab1", "id: somebodys-own", 1))
    assert run(["report", str(alone), "--rubric", str(own)]) == 0
    own.write_text(f"{LAB.read_text()}# changed\n")
    run_json = json.loads((lab / "run.json").read_text()) | {"rubric_source": str(own)}
    (lab / "run.json").write_text(json.dumps(run_json))
    capsys.readouterr()
    assert run(["report", str(lab / "bob"), "--form", "markdown"]) == 0
    assert f"another version of {own}" in capsys.readouterr().err


@pytest.mark.full
def test_a_folder_of_results_without_a_batch_has_no_page(lab, tmp_path, capsys):
    (lab / "run.json").unlink()
    assert run(["report", str(lab)]) == 0
    assert (lab / "bob" / "report.html").exists()
    assert not (lab / "index.html").exists()
    assert run(["report", str(lab), "--anonymous", str(tmp_path / "page.html")]) == 2
    assert run(["report", str(tmp_path / "nowhere")]) == 2
    (tmp_path / "empty").mkdir()
    assert run(["report", str(tmp_path / "empty")]) == 2
    assert "contains no results" in capsys.readouterr().err


BEGINNINGS = {
    "html": "<!DOCTYPE html>",
    "markdown": "# ",
    "junit": "<?xml",
    "sarif": "{",
    "code-quality": "[",
    "annotations": "::error ",
    "gradescope": "{",
    "classroom": "eyJ2ZXJzaW9uIjogMSwg",
}


@pytest.mark.full
@pytest.mark.parametrize("form", FORMS)
def test_each_form_goes_to_stdout_and_to_a_file(lab, tmp_path, capsys, form):
    assert run(["report", str(lab / "bob"), "--form", form]) == 0
    out = capsys.readouterr().out
    assert run(["report", str(lab / "bob"), "--form", form, "--out", str(tmp_path / "new" / "file")]) == 0
    assert capsys.readouterr().out == ""
    assert (tmp_path / "new" / "file").read_text(encoding="utf-8") == out
    assert out.lower().startswith(BEGINNINGS.get(form, "").lower())
    assert "counter-wrap" in out or form in {"sarif", "code-quality", "classroom"}
    assert not (lab / "bob" / "report.md").exists()


@pytest.mark.parametrize(
    "options",
    [
        ["--form", "markdown"],
        ["--out", "x"],
        ["--prefix", "x"],
        ["--student"],
        ["--form", "word"],
    ],
)
def test_options_that_do_not_fit_a_class(lab, capsys, options):
    assert run(["report", str(lab), *options]) == 2
    assert not (lab / "index.html").exists()


def test_a_student_sees_how_many_more_there_are(lab, tmp_path, capsys):
    hiding = tmp_path / "hiding.yaml"
    text = LAB.read_text()
    begin = text.index("id: counter-wrap")
    marked = text[begin:].replace("points:", "visibility: hidden\n    points:", 1)
    hiding.write_text(text[:begin] + marked)
    options = ["report", str(lab / "bob"), "--rubric", str(hiding), "--form"]
    for form in ("markdown", "terminal", "html"):
        assert run([*options, form, "--student"]) == 0
        out = " ".join(capsys.readouterr().out.split())
        assert "visible checks passed; 1 more runs at grading." in out
        assert "counter-wrap" not in out
    assert run([*options, "gradescope"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [t["visibility"] for t in data["tests"]].count("after_published") == 1
    assert "1 more runs at grading." in data["output"]
    assert run([*options, "gradescope", "--student"]) == 2


def test_gradescope_gets_no_file_of_what_was_not_graded(lab, tmp_path, capsys):
    data = json.loads((lab / "bob" / "result.json").read_text())
    for one in data["criteria"]:
        one |= {"status": "inconclusive", "points": 0}
    changed(lab / "bob", criteria=data["criteria"], status="inconclusive", points=0)
    target = tmp_path / "results.json"
    assert run(["report", str(lab / "bob"), "--form", "gradescope", "--out", str(target)]) == 3
    assert not target.exists()
    assert "no results.json is written" in capsys.readouterr().err


def test_what_was_not_graded_is_never_said_to_have_points(lab, capsys):
    error = {"kind": "host", "message": "the disk is full", "hint": "make room"}
    changed(lab / "bob", criteria=[], status="error", points=0, error=error)
    for form in ("terminal", "markdown", "annotations"):
        assert run(["report", str(lab / "bob"), "--form", form]) == 0
        out, err = capsys.readouterr()
        assert "not graded" in out.lower()
        assert "the disk is full" in out
        assert "0 of 100" not in out
        assert err == ""


def test_a_folder_that_cannot_be_written_is_told(lab, capsys):
    (lab / "bob" / "report.md").mkdir()
    assert run(["report", str(lab / "bob")]) != 0
    assert "cannot write" in capsys.readouterr().err
    assert not (lab / "bob" / ".grader-new").exists()


def test_what_a_killed_grader_left_is_finished_first(lab):
    ready = lab / "bob" / READY
    ready.mkdir()
    (ready / "names.json").write_text(json.dumps(["evidence", "result.json"]))
    shutil.copy(lab / "ada" / "result.json", ready / "result.json")
    assert run(["report", str(lab / "bob")]) == 0
    assert (lab / "bob" / "result.json").read_bytes() == (lab / "ada" / "result.json").read_bytes()
    assert "# 100 of 100 points" in (lab / "bob" / "report.md").read_text()


def cited(*files: str):
    places = tuple(FileCitation(file=file, line=2) for file in files)
    of = RubricInfo(id="leeds-comp3631-lab1", version="1", digest="e" * 64)
    failed = criterion("a", Status.FAIL, 0, 5, message="wrong", citations=places)
    return result(criteria=(failed,), rubric=of)


def package(folder: Path, name: str = "lab1") -> Path:
    (folder / "src").mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (folder / "src" / "talker.py").write_text("x\ny\n")
    return folder


def test_the_package_is_found_in_its_repository(tmp_path):
    (tmp_path / ".git").mkdir()
    package(tmp_path / "other", "other")
    inside = package(tmp_path / "ws" / "src" / "lab1")
    shown = cited("src/talker.py", "package.xml")
    for here in (tmp_path, inside, inside / "src", tmp_path / "other"):
        assert package_prefix(shown, here) == "ws/src/lab1"
    assert package_prefix(cited("src/listener.py"), tmp_path) is None
    assert package_prefix(shown, tmp_path / "other" / "src") == "ws/src/lab1"


def test_a_package_that_is_the_repository_has_no_prefix(tmp_path):
    package(tmp_path)
    assert package_prefix(cited("src/talker.py"), tmp_path) == "."


def test_of_two_packages_of_that_name_the_one_with_the_files_is_meant(tmp_path):
    package(tmp_path / "a")
    (package(tmp_path / "b" / "c") / "src" / "listener.py").write_text("")
    assert package_prefix(cited("src/listener.py"), tmp_path) == "b/c"


def test_lines_of_files_begin_at_the_repositorys_root(tmp_path, capsys, monkeypatch):
    from grader.rubric.load import load_rubric  # noqa: PLC0415 - only here

    rubric = load_rubric(str(LAB))
    shown = cited("src/talker.py")
    write_reports(shown, tmp_path / "out" / "ada", console="", rubric=rubric.rubric)
    package(tmp_path / "repository" / "ws" / "lab1")
    monkeypatch.chdir(tmp_path / "repository")
    command = ["report", str(tmp_path / "out" / "ada"), "--rubric", str(LAB), "--form"]
    assert run([*command, "annotations"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("::error file=ws/lab1/src/talker.py,line=2,title=a%3A 0/5 points::wrong\n")
    assert "paths begin" not in err
    assert run([*command, "code-quality", "--prefix", "elsewhere/"]) == 0
    (issue,) = json.loads(capsys.readouterr().out)
    assert issue["location"] == {"path": "elsewhere/src/talker.py", "lines": {"begin": 2}}
    os.chdir(tmp_path / "out")
    assert run([*command, "sarif"]) == 0
    out, err = capsys.readouterr()
    assert '"uri": "src/talker.py"' in out
    assert "no package lab1 with these files is here, so paths begin in it" in err
