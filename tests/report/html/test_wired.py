"""Pictures come from the evidence when a result is written and when it is written again, and never cost a result."""

from __future__ import annotations

import grader.report.figures
from grader import pipeline
from grader.classes.batch import renew_results
from grader.classes.batch.renew_results import rewrite
from grader.model.figure import Figures
from grader.report.files import write_reports
from grader.results import Results
from grader.rubric.load import load_rubric
from tests.report.hostile import result, rubric
from tests.report.html.made import console, figures


def broken(*_args, **_kwargs):
    raise ZeroDivisionError


def kept(folder) -> None:
    """A result as a grading leaves it."""
    with Results(folder) as results:
        write_reports(result(), results.new, console="printed", rubric=rubric())
        (results.evidence / "real.mcap").write_bytes(b"x")
        results.commit()


def test_a_failure_to_draw_is_no_failure_to_grade(monkeypatch):
    monkeypatch.setattr(grader.report.figures, "figures_of", broken)
    assert pipeline.draw_figures(load_rubric("leeds-comp3631-lab1"), {}, result()) is None


def test_a_result_is_drawn_from_the_runs_that_it_was_judged_from():
    assert pipeline.draw_figures(load_rubric("leeds-comp3631-lab1"), {}, result()) == Figures()


def test_a_result_that_is_written_again_is_drawn_again(tmp_path, monkeypatch):
    kept(tmp_path / "ada")
    loaded = []
    monkeypatch.setattr(renew_results, "load_evidence", lambda paths: loaded.append(paths) or {})
    drawn = figures().model_copy(update={"consoles": {"package": console("built again")}})
    monkeypatch.setattr(renew_results, "figures_of", lambda *_: drawn)
    rewrite(tmp_path / "ada", result(), rubric(), {"some-check": {"Why it matters on a robot": "It does."}})
    text = (tmp_path / "ada" / "report.html").read_text()
    assert loaded == [[tmp_path / "ada" / "evidence"]]
    assert "built again" in text
    assert "It does." in text
    assert (tmp_path / "ada" / "console.log").read_text() == "printed"


def test_evidence_that_cannot_be_read_leaves_a_report_without_pictures(tmp_path):
    kept(tmp_path / "ada")
    before = (tmp_path / "ada" / "report.html").read_text()
    rewrite(tmp_path / "ada", result(points=20), rubric(), {})
    after = (tmp_path / "ada" / "report.html").read_text()
    assert "<figure" not in after
    assert "20 of 100 points" in after
    assert "20 of 100 points" not in before
    assert (tmp_path / "ada" / "evidence" / "real.mcap").read_bytes() == b"x"


def test_docs_of_the_rubrics_checks_are_at_hand():
    docs = load_rubric("leeds-comp3631-lab1").docs
    assert docs["rate"]["Why it matters on a robot"].startswith("Controllers are tuned")
