"""A worker that one submission ends."""

import os
import signal

from grader.classes.cluster import worker

_grade_in = worker._grade_in


def _ended(folder, request, is_wanted):
    if request.job.entry.id == "poison":
        os.kill(os.getpid(), signal.SIGKILL)
    return _grade_in(folder, request, is_wanted)


worker._grade_in = _ended
