"""Files that an earlier grader wrote are read, and judged to the same verdicts."""

from __future__ import annotations

import json
import shutil
from functools import cache
from pathlib import Path

import pytest

from grader import judge, load_result, load_rubric
from grader.classes.batch.renew_results import write_one
from grader.evidence.reader import load_evidence, package_facts
from grader.report.files import result_text
from tests.report.file_formats.kept import CLASS, FOLDER, ROOT, Kept, submissions

ALL = submissions()
rubric_of = cache(load_rubric)
each = pytest.mark.parametrize("kept", ALL, ids=[kept.name for kept in ALL])
each_judged = pytest.mark.parametrize(
    "kept", [kept for kept in ALL if kept.judged], ids=[kept.name for kept in ALL if kept.judged]
)


@each
def test_its_result_is_read_whole(kept: Kept) -> None:
    written = json.loads((kept.folder / "result.json").read_bytes())
    read = load_result(kept.folder)
    assert json.loads(result_text(read)) == written
    assert [read.status, read.points] == kept.said["result"]


@each_judged
def test_its_evidence_is_judged_alike_today(kept: Kept) -> None:
    found, then = judge(kept.folder, rubric_of(kept.rubric)), load_result(kept.folder)
    checks = {o.criterion: (o.automatic.status.value, o.automatic.points) for o in then.overrides}
    assert {c.id: (c.status.value, c.points) for c in found.criteria} == kept.criteria | checks
    assert (found.submission, found.notes) == (then.submission, then.notes)


@pytest.mark.parametrize("kept", ALL[::3], ids=[kept.name for kept in ALL[::3]])
def test_its_reports_are_written_today(kept: Kept, tmp_path: Path) -> None:
    folder = tmp_path / kept.folder.name
    shutil.copytree(kept.folder, folder)
    before = (folder / "result.json").read_bytes()
    write_one(folder, rubric_of(kept.rubric))
    assert (folder / "result.json").read_bytes() == before
    pages = [folder / name for name in ("report.html", "report.md", "junit.xml")]
    assert all(page.stat().st_size > 500 for page in pages)
    if any(run.channels for run in _runs(folder) if run.scenario != "package"):
        assert "<svg" in pages[0].read_text()


def _runs(folder: Path):
    return load_evidence([folder]).values() if (folder / "evidence").is_dir() else ()


@each_judged
def test_its_package_facts_are_read(kept: Kept) -> None:
    assert package_facts(load_evidence([kept.folder])["package"]).files


def test_every_folder_is_in_the_list() -> None:
    written = {path.parent.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("result.json")}
    assert written == {kept.name for kept in ALL}


def test_there_are_all_kinds() -> None:
    """What these files are kept for."""
    results = [load_result(kept.folder) for kept in ALL]
    assert {result.status for result in results} == {"graded", "inconclusive", "error"}
    assert {c.status.value for result in results for c in result.criteria} >= {
        "pass", "partial", "fail", "blocked", "inconclusive", "error"
    }  # fmt: skip
    assert any(result.notes for result in results)
    assert any(result.late and result.late.late_s > 0 for result in results)
    assert any(result.overrides for result in results)
    assert len({result.rubric.id for result in results}) == 3


def test_the_class_has_its_rubric_beside_it() -> None:
    run = json.loads((CLASS / "run.json").read_text())
    assert load_rubric(FOLDER / "class.yaml").digest == run["rubric"]["digest"]
    assert not Path(run["rubric_source"]).is_relative_to(ROOT)
