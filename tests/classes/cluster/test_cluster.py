"""Real clusters: workers in processes of their own, lost in the middle."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.classes.batch.job import LocalExecutor
from grader.classes.cluster.executor import EXCHANGE, ClusterExecutor
from grader.errors import HostError
from tests.classes.cluster.clusters import Cluster, cluster, kill
from tests.classes.cluster.jobs import ids, ignore, jobs_for, verdicts
from tests.classes.cluster.shelf import on_shelf, register

COUNT = 30
NAMES = [f"s{number:03}" for number in range(COUNT)]


@pytest.mark.full
@pytest.mark.slow
def test_a_worker_killed_in_the_middle_costs_nobody_a_result(place: Cluster, tmp_path: Path) -> None:
    workers = [place.worker() for _ in range(3)]
    out, begun, outcomes = tmp_path / "out", [], []
    for outcome in ClusterExecutor(place.address, out, insecure=True).run(
        jobs_for(out, COUNT), begun=begun.append
    ):
        outcomes.append(outcome)
        if len(outcomes) == 5:
            kill(workers[0].pid)
    assert ids(outcomes) == NAMES
    assert sorted(begun) == NAMES
    assert {o.status for o in outcomes} == {"inconclusive"}
    assert not (out / EXCHANGE).exists()

    alone = tmp_path / "alone"
    assert ids(LocalExecutor(2).run(jobs_for(alone, COUNT), begun=ignore)) == NAMES
    assert verdicts(out) == verdicts(alone)
    assert sorted(verdicts(out)) == NAMES


@pytest.mark.full
@pytest.mark.slow
def test_results_come_through_a_url_that_is_no_path(place: Cluster, tmp_path: Path, monkeypatch) -> None:
    shelf = tmp_path / "shelf"
    shelf.mkdir()
    monkeypatch.setenv("SHELF", str(shelf))
    register()
    place.worker(preload="shelf", threads=2)
    out = tmp_path / "out"
    executor = ClusterExecutor(place.address, out, "shelf://results", insecure=True)
    assert ids(executor.run(jobs_for(out, 4), begun=ignore)) == NAMES[:4]
    assert sorted(verdicts(out)) == NAMES[:4]
    assert on_shelf(shelf) == []


@pytest.mark.full
def test_a_cluster_with_certificates_needs_no_flag(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with cluster(tmp_path, tls=True) as made:
        made.worker()
        names = {"ca-file": "ca-file", "client.cert": "cert", "client.key": "key"}
        files = {f"distributed.comm.tls.{key}": str(made.certificates[name]) for key, name in names.items()}
        import dask.config  # noqa: PLC0415 - slow to load

        with dask.config.set(files):
            assert ids(ClusterExecutor(made.address, out).run(jobs_for(out, 2), begun=ignore)) == NAMES[:2]
    assert made.address.startswith("tls://")
    assert sorted(verdicts(out)) == NAMES[:2]


@pytest.mark.full
def test_workers_that_differ_are_named_and_left_out(place: Cluster, tmp_path: Path) -> None:
    place.worker(preload="older")
    place.worker(preload="without")
    out, said = tmp_path / "out", []
    executor = ClusterExecutor(place.address, out, insecure=True, say=said.append, patience_s=5.0)
    with pytest.raises(HostError, match="no worker that can grade") as caught:
        list(executor.run(jobs_for(out, 1), begun=ignore))
    assert f"dask worker {place.address}" in caught.value.hint
    assert any("it has grader 0.0.9, here it is" in line for line in said)
    assert any("no grader like this one is installed there" in line for line in said)


@pytest.mark.full
@pytest.mark.parametrize(
    ("preload", "why"), [("without", "has no grader like this one"), ("older", "has grader 0.0.9")]
)
def test_a_scheduler_that_differs_is_named(preload: str, why: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with cluster(tmp_path, preload=preload) as made, pytest.raises(HostError, match=why) as caught:
        list(ClusterExecutor(made.address, out, insecure=True).run(jobs_for(out, 1), begun=ignore))
    assert f"the scheduler at {made.address}" in caught.value.message
    assert caught.value.hint
    assert not out.exists()


@pytest.mark.full
@pytest.mark.ros
def test_real_gradings_get_the_same_verdicts_with_a_worker_killed(place: Cluster, tmp_path: Path) -> None:
    names, count = ("counter-resets-to-1", "listener-silent", "chatter-capital"), 6
    workers = [place.worker() for _ in range(3)]
    out, begun = tmp_path / "out", []

    def note(name: str) -> None:
        begun.append(name)
        if len(begun) == 3:
            kill(workers[0].pid)

    jobs = jobs_for(out, count, static_only=False, names=names)
    outcomes = list(ClusterExecutor(place.address, out, insecure=True).run(jobs, begun=note))
    assert ids(outcomes) == NAMES[:count]
    assert {outcome.status for outcome in outcomes} == {"graded"}

    alone = tmp_path / "alone"
    list(LocalExecutor(2).run(jobs_for(alone, 3, static_only=False, names=names), begun=ignore))
    once = verdicts(alone)
    assert verdicts(out) == {name: once[f"s{number % 3:03}"] for number, name in enumerate(NAMES[:count])}
