"""Judging: evidence and a rubric come in, criteria with their points go out.

It is pure and needs no ROS. What a single check says is the business of `checks`; how a result is shown, of `report`.
"""

from grader.judging.judge import judge
from grader.judging.summary import criteria_bytes, overall_status, reached_pass_mark, total_points

__all__ = ["criteria_bytes", "judge", "overall_status", "reached_pass_mark", "total_points"]
