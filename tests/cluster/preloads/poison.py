"""A worker that one submission ends."""

import os
import signal

from grader.classes.cluster import worker

_done = worker._done


def _ended(sent, folder, wanted):
    if sent.job.entry.id == "poison":
        os.kill(os.getpid(), signal.SIGKILL)
    return _done(sent, folder, wanted)


worker._done = _ended
