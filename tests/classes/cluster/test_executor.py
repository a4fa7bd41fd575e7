"""Results that come back take their place: the attempt that counts, and nothing else."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from grader.arena.limits import RunLimits
from grader.classes.batch.job import GradingJob, SubmissionOutcome
from grader.classes.cluster import executor
from grader.classes.cluster.executor import PackedFolderLost, store_results
from grader.classes.cluster.worker import Exchange, PackedFolder, Report, pack
from grader.errors import Busy
from grader.results import Results
from tests.classes.cluster.jobs import jobs_for


@pytest.fixture
def exchange(tmp_path: Path, monkeypatch) -> Exchange:
    monkeypatch.setattr(executor, "PAUSE_S", 0.0)
    made = Exchange(str(tmp_path / "exchange"))
    made.make()
    return made


@pytest.fixture
def job(tmp_path: Path) -> GradingJob:
    return next(jobs_for(tmp_path / "out", 1))


def _sent(
    exchange: Exchange, folder: Path, *, status: str = "graded", words: str = "", evidence: str = ""
) -> PackedFolder:
    (folder / "s000" / "evidence").mkdir(parents=True, exist_ok=True)
    (folder / "s000" / "result.json").write_text(json.dumps({"status": status, "words": words}))
    if evidence:
        (folder / "s000" / "evidence" / "package.mcap").write_text(evidence)
    packed = folder / "packed"
    packed.unlink(missing_ok=True)
    pack(folder / "s000", packed)
    return exchange.put(packed, "s000")


def _outcome(status: str = "graded", kind: str = "") -> SubmissionOutcome:
    return SubmissionOutcome.model_validate({"id": "s000", "status": status, "kind": kind})


def _words(job: GradingJob) -> str:
    return str(json.loads((job.out / "s000" / "result.json").read_text())["words"])


def test_of_two_attempts_the_one_that_was_reported_counts(
    exchange: Exchange, job: GradingJob, tmp_path: Path
) -> None:
    believed_lost = _sent(exchange, tmp_path, words="first", evidence="first")
    reported = _sent(exchange, tmp_path, words="second", evidence="second")
    assert store_results(job, Report(outcome=_outcome(), packed=reported), exchange).status == "graded"
    assert _words(job) == "second"
    assert (job.out / "s000" / "evidence" / "package.mcap").read_text() == "second"
    assert sorted(path.name for path in (job.out / "s000").iterdir()) == ["evidence", "result.json"]
    with pytest.raises(FileNotFoundError):
        exchange.open(reported)
    assert exchange.open(believed_lost).read()


@pytest.mark.parametrize(("kind", "stays"), [("host", True), ("killed", True), ("submission", False)])
def test_only_an_error_of_the_submission_takes_the_place_of_a_complete_result(
    kind: str, stays: bool, exchange: Exchange, job: GradingJob, tmp_path: Path
) -> None:
    earlier = _sent(exchange, tmp_path / "a", words="earlier", evidence="earlier")
    store_results(job, Report(outcome=_outcome(), packed=earlier), exchange)
    wrong = _sent(exchange, tmp_path / "b", status="error", words="wrong")
    outcome = store_results(job, Report(outcome=_outcome("error", kind), packed=wrong), exchange)
    assert outcome.status == "error"
    assert _words(job) == ("earlier" if stays else "wrong")
    assert (job.out / "s000" / "evidence").exists() is stays
    assert ("stays as it is" in outcome.hint) is stays
    assert list(Path(exchange.url).iterdir()) == []


def test_a_result_that_was_kept_needs_no_packed_folder(exchange: Exchange, job: GradingJob) -> None:
    kept = _outcome().model_copy(update={"kept": True})
    assert store_results(job, Report(outcome=kept), exchange) == kept
    assert not job.out.exists()


def test_a_packed_folder_that_is_not_there_or_not_whole_changes_nothing(
    exchange: Exchange, job: GradingJob, tmp_path: Path
) -> None:
    earlier = _sent(exchange, tmp_path, words="earlier", evidence="earlier")
    store_results(job, Report(outcome=_outcome(), packed=earlier), exchange)
    with pytest.raises(PackedFolderLost):
        store_results(job, Report(outcome=_outcome(), packed=earlier), exchange)
    broken = _sent(exchange, tmp_path, words="broken")
    whole = Path(exchange.url, broken.name).read_bytes()
    Path(exchange.url, broken.name).write_bytes(whole[:-9])
    with pytest.raises(PackedFolderLost):
        store_results(job, Report(outcome=_outcome(), packed=broken), exchange)
    assert _words(job) == "earlier"
    assert sorted(path.name for path in (job.out / "s000").iterdir()) == ["evidence", "result.json"]


def test_a_submission_that_another_grader_works_on_is_left_to_it(
    exchange: Exchange, job: GradingJob, tmp_path: Path
) -> None:
    packed = _sent(exchange, tmp_path)
    with Results(job.out / "s000"), pytest.raises(Busy):
        store_results(job, Report(outcome=_outcome(), packed=packed), exchange)


def test_the_page_on_clusters_has_the_limits_of_memory_as_they_are() -> None:
    """Half a gigabyte for each thread, in what it says and in both of its examples."""
    text = (Path(__file__).parents[3] / "docs" / "how-to" / "cluster.md").read_text(encoding="utf-8")
    assert f"at most {RunLimits().memory_bytes / 2**30:g} GB for each process tree" in text
    assert "0.5 GB of memory for each thread" in text
    threads = {int(count) for count in re.findall(r"(?:nthreads\"?,? \"?|cores=)(\d+)", text)}
    memory = {int(size) for size in re.findall(r"memory(?:=\"|: )(\d+)G", text)}
    assert (threads, memory) == ({16}, {8})
