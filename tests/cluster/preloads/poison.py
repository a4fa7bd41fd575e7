"""A worker that one submission ends."""

import os
import signal

from grader.classes.cluster import worker

_grade_in = worker._grade_in


def _ended(folder, errand, is_wanted):
    if errand.job.entry.id == "poison":
        os.kill(os.getpid(), signal.SIGKILL)
    return _grade_in(folder, errand, is_wanted)


worker._grade_in = _ended
