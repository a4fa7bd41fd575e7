"""What the man page says beside what the parser knows."""

from __future__ import annotations

ABOUT = (
    (
        "grades the packages of an introductory ROS 1 lab: it builds a submission in a fresh catkin workspace, runs "
        "its nodes under a roscore of its own inside a sandbox, records every message, and judges the recording "
        "against a rubric. The same recording and rubric always give the same verdicts."
    ),
    "The files of a package are judged on any machine. To run nodes takes Linux with ROS 1: see grader doctor.",
)
"""Paragraphs; the first goes on after the program's name."""

ENVIRONMENT = {
    "GRADER_ROS_SETUP": "the setup.bash of the ROS 1 to use, or none, to do without. Without it the grader looks in "
    "/opt/ros, then for Debian's packages, then in the active conda environment.",
    "GITHUB_TOKEN, GITLAB_TOKEN": "credentials for submissions that are fetched from there. Stored nowhere.",
    "GRADER_GIT_HOST, GRADER_GIT_TOKEN, GRADER_GIT_USER": "the same for another host.",
    "XDG_CACHE_HOME": "where the folder grader of things kept for later lies, instead of ~/.cache.",
    "XDG_RUNTIME_DIR": "where gradings that run at the same time take turns.",
}

FILES = {
    "~/.cache/grader": "mirrors of fetched repositories, and what CMake learnt of this machine. May be deleted at any "
    "time.",
    "DIR/SUBMISSION/result.json": "the result, for programs; report.html beside it is for people, evidence/ holds the "
    "recordings.",
}

EXAMPLES = {
    "grader check": "Students, in the folder of their package, before they hand it in.",
    "grader grade submission.zip --rubric leeds-comp3631-lab1 --out results": "Grade one submission.",
    "grader batch roster.csv --rubric leeds-comp3631-lab1 --out results": "Grade a class; the same command goes on "
    "where it was stopped.",
    "grader judge results --rubric my-rubric.yaml": "Judge what was recorded by a changed rubric, without ROS.",
}

SEE_ALSO = ("bwrap(1)", "git(1)")
