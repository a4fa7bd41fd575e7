"""Real clusters that lose workers, the scheduler, or the client."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from grader.classes.cluster.executor import EXCHANGE, ClusterExecutor
from grader.errors import HostError
from tests.classes.cluster.clusters import ROOT, Cluster, kill
from tests.classes.cluster.jobs import ids, ignore, jobs_for, named_job, verdicts
from tests.support.processes import children_of, lives, until

pytestmark = pytest.mark.slow


@pytest.mark.full
def test_a_submission_that_ends_its_workers_is_given_up_and_the_others_are_graded(
    place: Cluster, tmp_path: Path
) -> None:
    for _ in range(2):
        place.worker(preload="poison", nanny=True)
    out = tmp_path / "out"
    jobs = [named_job(out, "poison"), *jobs_for(out, 4)]
    outcomes = {
        outcome.id: outcome
        for outcome in ClusterExecutor(place.address, out, insecure=True).run(jobs, begun=ignore)
    }
    poison = outcomes.pop("poison")
    assert (poison.status, poison.kind) == ("error", "worker-lost")
    assert "3 times" in poison.message
    assert poison.hint
    assert {outcome.status for outcome in outcomes.values()} == {"inconclusive"}
    assert sorted(verdicts(out)) == ["s000", "s001", "s002", "s003"]


@pytest.mark.full
def test_workers_that_come_later_take_over_from_those_that_are_gone(place: Cluster, tmp_path: Path) -> None:
    first = place.worker()
    out, outcomes = tmp_path / "out", []
    for outcome in ClusterExecutor(place.address, out, insecure=True).run(jobs_for(out, 8), begun=ignore):
        outcomes.append(outcome)
        if len(outcomes) == 2:
            kill(first.pid)
            first.wait()
            place.worker()
    assert ids(outcomes) == [f"s{number:03}" for number in range(8)]
    assert {outcome.status for outcome in outcomes} == {"inconclusive"}


@pytest.mark.full
def test_a_caller_that_stops_leaves_nothing_running(place: Cluster, tmp_path: Path) -> None:
    worker = place.worker(threads=2)
    out = tmp_path / "out"
    outcomes = ClusterExecutor(place.address, out, insecure=True).run(jobs_for(out, 50), begun=ignore)
    next(outcomes)
    assert children_of(worker.pid)
    outcomes.close()
    assert children_of(worker.pid) == []
    assert not (out / EXCHANGE).exists()
    assert worker.poll() is None


@pytest.mark.full
def test_a_killed_client_leaves_its_workers_free_and_the_next_one_goes_on(
    place: Cluster, tmp_path: Path
) -> None:
    worker = place.worker(threads=2, preload="hurried")
    out = tmp_path / "out"
    client = subprocess.Popen(
        [sys.executable, "-m", "tests.classes.cluster.client", place.address, str(out), "50"],
        cwd=ROOT,
        env=os.environ,
    )
    until(lambda: len(verdicts(out)) >= 2)
    busy = children_of(worker.pid)
    client.send_signal(signal.SIGKILL)
    client.wait()
    until(lambda: not any(lives(pid) for pid in busy))
    (out / EXCHANGE).mkdir(exist_ok=True)
    (out / EXCHANGE / "s000.0123456789abcdef.tar.gz").write_bytes(b"of the one that was killed")
    assert (
        len(ids(ClusterExecutor(place.address, out, insecure=True).run(jobs_for(out, 4), begun=ignore))) == 4
    )
    assert not (out / EXCHANGE).exists()


@pytest.mark.full
def test_without_its_scheduler_the_batch_ends_with_one_line(place: Cluster, tmp_path: Path) -> None:
    place.worker()
    out = tmp_path / "out"
    outcomes = ClusterExecutor(place.address, out, insecure=True).run(jobs_for(out, 50), begun=ignore)
    next(outcomes)
    kill(place.scheduler.pid)
    with pytest.raises(HostError, match=r"the connection to the scheduler at .* is lost") as caught:
        list(outcomes)
    assert "continues where it stopped" in caught.value.hint
    assert not (out / EXCHANGE).exists()


@pytest.mark.full
def test_a_cluster_of_this_machine_is_started_and_ended(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert len(ids(ClusterExecutor("local", out).run(jobs_for(out, 3), begun=ignore))) == 3
    assert len(verdicts(out)) == 3
    until(lambda: not any(_works_for_dask(pid) for pid in children_of(os.getpid())))


def _works_for_dask(pid: int) -> bool:
    """And not for Python's own bookkeeping, which ends with us."""
    return lives(pid) and b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
