"""`python -m tests.classes.cluster.client ADDRESS OUT COUNT`: a batch in a process of its own, to be killed."""

from __future__ import annotations

import sys
from pathlib import Path

from grader.classes.cluster.executor import ClusterExecutor
from tests.classes.cluster.jobs import jobs_for


def main(address: str, out: Path, count: int) -> None:
    for outcome in ClusterExecutor(address, out, insecure=True).run(
        jobs_for(out, count), begun=lambda _: None
    ):
        print(outcome.id, flush=True)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
