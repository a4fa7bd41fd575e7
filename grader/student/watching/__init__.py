"""`grader check --watch`: a saved file has what it concerns run again, and everything judged again."""

from grader.student.watching.loop import Outcome, Watched, watch

__all__ = ["Outcome", "Watched", "watch"]
