"""Judging: evidence and a rubric in, criteria with their points out. Pure; needs no ROS."""

from grader.judging.judge import judge
from grader.judging.summary import criteria_bytes, overall_status, reached_pass_mark, total_points

__all__ = ["criteria_bytes", "judge", "overall_status", "reached_pass_mark", "total_points"]
