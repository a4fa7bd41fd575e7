"""Files that graders of every time wrote are read, and judged to the same verdicts."""

from __future__ import annotations

import json
import shutil
from functools import cache
from pathlib import Path

import pytest

from grader import judge, load_result, load_rubric
from grader.classes.batch.reports import write_one
from grader.evidence.reader import load_evidence, package_facts
from grader.report.result_json import result_text
from tests.formats.old import FOLDER, ROOT, Old, classes, submissions, times

ALL = submissions()
rubric_of = cache(load_rubric)
each = pytest.mark.parametrize("old", ALL, ids=[old.name for old in ALL])
each_judged = pytest.mark.parametrize(
    "old", [old for old in ALL if old.judged], ids=[old.name for old in ALL if old.judged]
)


@each
def test_its_result_is_read_whole(old: Old) -> None:
    written = json.loads((old.folder / "result.json").read_bytes())
    read = load_result(old.folder)
    assert json.loads(result_text(read)) == written
    assert [read.status, read.points] == old.said["result"]


@each_judged
def test_its_evidence_is_judged_alike_today(old: Old) -> None:
    found, then = judge(old.folder, rubric_of(old.rubric)), load_result(old.folder)
    checks = {o.criterion: (o.automatic.status.value, o.automatic.points) for o in then.overrides}
    assert {c.id: (c.status.value, c.points) for c in found.criteria} == old.criteria | checks
    assert (found.submission, found.notes) == (then.submission, then.notes)


@pytest.mark.parametrize("old", ALL[::3], ids=[old.name for old in ALL[::3]])
def test_its_reports_are_written_today(old: Old, tmp_path: Path) -> None:
    folder = tmp_path / old.folder.name
    shutil.copytree(old.folder, folder)
    before = (folder / "result.json").read_bytes()
    write_one(folder, rubric_of(old.rubric))
    assert (folder / "result.json").read_bytes() == before
    pages = [folder / name for name in ("report.html", "report.md", "junit.xml")]
    assert all(page.stat().st_size > 500 for page in pages)
    if any(run.channels for run in _runs(folder) if run.scenario != "package"):
        assert "<svg" in pages[0].read_text()


def _runs(folder: Path):
    return load_evidence([folder]).values() if (folder / "evidence").is_dir() else ()


@each_judged
def test_its_package_facts_are_read(old: Old) -> None:
    assert package_facts(load_evidence([old.folder])["package"]).files


@pytest.mark.parametrize("time", [time.name for time in times()])
def test_every_time_is_in_the_readme_and_every_folder_in_its_list(time: str) -> None:
    assert f"| `{time}` |" in (FOLDER / "README.md").read_text()
    written = {path.parent.relative_to(FOLDER).as_posix() for path in (FOLDER / time).rglob("result.json")}
    assert written == {old.name for old in ALL if old.name.startswith(time)}


def test_what_changed_says_why() -> None:
    for old in ALL:
        for name, one in old.said.get("changed", {}).items():
            assert name in old.said["criteria"], old.name
            assert len(one["why"]) > 20, old.name


def test_there_are_all_kinds() -> None:
    """Whoever takes files away sees here what they were for."""
    results = [load_result(old.folder) for old in ALL]
    assert {result.status for result in results} == {"graded", "inconclusive", "error"}
    assert {c.status.value for result in results for c in result.criteria} >= {
        "pass", "partial", "fail", "blocked", "inconclusive", "error"
    }  # fmt: skip
    assert any(result.notes for result in results)
    assert any(result.late and result.late.late_s > 0 for result in results)
    assert any(result.overrides for result in results)
    assert len({result.rubric.id for result in results}) >= 4


@pytest.mark.parametrize("folder", classes(), ids=[folder.parent.name for folder in classes()])
def test_a_class_has_its_rubric_beside_it(folder: Path) -> None:
    run = json.loads((folder / "run.json").read_text())
    assert load_rubric(folder.parent / "class.yaml").digest == run["rubric"]["digest"]
    assert not Path(run["rubric_source"]).is_relative_to(ROOT)
