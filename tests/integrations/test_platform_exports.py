"""`results.json` of both platforms, for results of every kind, and where there is no result at all."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from grader.errors import HostError
from grader.integrations.autograde import ID, PLATFORMS, REPORTS, grade_upload
from grader.integrations.platform_exports import (
    GRADESCOPE,
    PRAIRIELEARN,
    SETTINGS_FILE,
    BundleSettings,
    ContainerLayout,
)
from grader.model.result import ErrorInfo
from grader.model.verdict import Status
from grader.results import read_result
from grader.rubric.load import LoadedRubric
from tests.report.nasty import STEERING
from tests.report.worst import LONG, MERMAID, rubric, worst
from tests.support.a_class import criterion

REFERENCE = Path(__file__).parents[2] / "reference_solutions" / "leeds-comp3631-lab1" / "lab1"
RUBRIC = LoadedRubric.model_construct(rubric=rubric(), path=Path("lab.yaml"), digest="0" * 64)
SOUND = (
    criterion("good", Status.PASS, 6, 6),
    criterion("half", Status.PARTIAL, 1, 4, message="half of it"),
    criterion("secret", Status.FAIL, 0, 10, message="the secret was not found"),
)


def test_prairielearn_gives_a_share_and_a_test_for_each_criterion_but_the_hidden() -> None:
    result = worst(criteria=SOUND, points=7, max_points=20, late=None, overrides=(), status="graded")
    document = PRAIRIELEARN.graded(result, RUBRIC)
    assert (document["gradable"], document["score"]) == (True, 0.35)
    assert [(t["points"], t["max_points"]) for t in document["tests"]] == [(6, 6), (1, 4), (0, 10)]
    assert "secret" not in json.dumps(document)
    assert document["tests"][-1]["name"] == "1 criteria that are not shown"


def test_prairielearn_says_what_is_open() -> None:
    waiting = criterion("waiting", Status.INCONCLUSIVE, 0, 5)
    result = worst(criteria=(*SOUND, waiting), points=7, max_points=25, late=None, overrides=())
    document = PRAIRIELEARN.graded(result, RUBRIC)
    assert document["message"].startswith("A PERSON MUST LOOK: 5 points")
    assert document["tests"][2]["name"].startswith("A PERSON MUST LOOK")


def test_prairielearn_is_given_nothing_that_steers_and_less_than_it_takes() -> None:
    document = PRAIRIELEARN.graded(worst(error=None), RUBRIC)
    text = json.dumps(document, ensure_ascii=False)
    assert STEERING.search(text) is None
    assert len(text.encode()) < 1_000_000


@pytest.mark.parametrize("kind", ["host", "submission"])
def test_prairielearn_takes_no_attempt_for_what_was_not_graded(kind) -> None:
    error = ErrorInfo(kind=kind, message=LONG, hint=MERMAID)
    document = PRAIRIELEARN.graded(worst(error=error, status="error"), RUBRIC)
    assert document["gradable"] is False
    assert STEERING.search(json.dumps(document, ensure_ascii=False)) is None


def laid_out(root: Path, name: str, settings: str | None) -> ContainerLayout:
    platform = PLATFORMS[name]
    (root / platform.lab).mkdir()
    (root / platform.upload).mkdir()
    if settings is not None:
        (root / platform.lab / SETTINGS_FILE).write_text(settings)
    return platform


@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.parametrize(
    "settings", [None, "{", BundleSettings(rubric="rubric/none.yaml", minutes=10).to_json().decode()]
)
def test_a_grader_that_cannot_grade_says_so_and_gives_no_score(name, settings, tmp_path, capsys) -> None:
    platform = laid_out(tmp_path, name, settings)
    assert grade_upload(platform, tmp_path) is False
    document = json.loads((tmp_path / "results" / "results.json").read_bytes())
    assert not document.get("gradable", False)
    assert document.get("score", 0) == 0
    assert ("score" in document) == (name == "prairielearn")  # there, it says that nothing was gradable
    assert "NOT GRADED" in capsys.readouterr().out


@pytest.mark.parametrize("name", PLATFORMS)
def test_a_platform_can_read_what_it_is_told_and_the_reports_stay_closed(name, tmp_path) -> None:
    lab = Path(__file__).parents[2] / "benchmarks" / "data" / "static.yaml"
    platform = laid_out(tmp_path, name, BundleSettings(rubric=str(lab), minutes=10).to_json().decode())
    shutil.copytree(REFERENCE, tmp_path / platform.upload / "lab1")
    before = os.umask(0o022)
    try:
        assert grade_upload(platform, tmp_path)
    finally:
        os.umask(before)
    results = tmp_path / "results"
    places = (results, results / "results.json", results / REPORTS)
    assert [path.stat().st_mode & 0o777 for path in places] == [0o755, 0o644, 0o700]


@pytest.mark.parametrize("name", PLATFORMS)
def test_a_class_whose_packages_have_another_name_is_graded_under_that(name, tmp_path) -> None:
    lab = Path(__file__).parents[2] / "benchmarks" / "data" / "static.yaml"
    settings = BundleSettings(rubric=str(lab), minutes=10, package="week1")
    platform = laid_out(tmp_path, name, settings.to_json().decode())
    package = tmp_path / platform.upload / "week1"
    shutil.copytree(REFERENCE, package)
    manifest = package / "package.xml"
    manifest.write_text(manifest.read_text().replace("<name>lab1<", "<name>week1<"))
    assert grade_upload(platform, tmp_path)
    result = read_result(tmp_path / "results" / REPORTS / ID)
    assert result is not None
    assert (result.submission.package, result.error) == ("week1", None)


@pytest.mark.parametrize("name", PLATFORMS)
def test_an_interrupted_grading_says_that_it_took_too_long(name, tmp_path, monkeypatch) -> None:
    lab = Path(__file__).parents[2] / "rubrics" / "mcr2-basic-comms.yaml"
    platform = laid_out(tmp_path, name, BundleSettings(rubric=str(lab), minutes=10).to_json().decode())
    (tmp_path / platform.upload / "package.xml").touch()

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("grader.pipeline.grade", interrupted)
    assert grade_upload(platform, tmp_path) is False
    assert "took longer than the 10 minutes" in (tmp_path / "results" / "results.json").read_text()


def test_gradescope_hears_of_a_fault_in_plain_text_and_without_a_score() -> None:
    document = GRADESCOPE.not_graded(HostError(LONG, hint=MERMAID))
    text = json.dumps(document, ensure_ascii=False)
    assert "score" not in text
    assert document["output_format"] == "text"
    assert STEERING.search(text) is None
    assert len(text) < 10_000


def test_gradescope_is_told_by_what_it_was_graded() -> None:
    document = GRADESCOPE.graded(worst(error=None, status="graded"), RUBRIC)
    assert set(document["extra_data"]) == {"grader", "sandbox", "rubric", "submission"}
    assert "secret" not in json.dumps(document["extra_data"])
