"""The commands for one submission."""

from __future__ import annotations

from grader.cli.parsing.base import Adder
from grader.cli.parsing.options import json_option, out_option, rubric_option, sandbox_option


def add_grading(add: Adder) -> None:
    """Add `grade` and `check`."""
    grade = add("grade", "grade one submission: a folder, a .zip or .tar.*, a git URL with @ref, a .bag")
    grade.add_argument("source", metavar="SOURCE")
    rubric_option(grade, required=True)
    out_option(grade, "results go to DIR/<submission id>/ (default: ./grader-results)")
    grade.add_argument("--id", metavar="NAME", dest="submission_id", help="the submission's id")
    sandbox_option(grade)
    json_option(grade)

    check = add("check", "check your own package before handing it in")
    check.add_argument("path", metavar="PATH", nargs="?", default=".", help="default: this folder")
    rubric_option(check, required=False)
    check.add_argument("--static", action="store_true", help="look at the files only, run nothing")
    check.add_argument(
        "--staged",
        action="store_true",
        help="with --static: look at what git has staged, for a pre-commit hook; only what fails fails it",
    )
    check.add_argument(
        "--watch", action="store_true", help="stay, and check again whenever a file is saved, until Ctrl-C"
    )
    out_option(check, "keep the results in DIR/<submission id>/ (default: they are only shown)")
    sandbox_option(check)
    json_option(check)
