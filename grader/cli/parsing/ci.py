"""The command that CI systems run."""

from __future__ import annotations

from grader.cli.parsing.base import Adder

CI_VARIABLES = """variables, each of which may be missing:
  GRADER_LAB        a lab's id or a rubric's file (default: the lab for packages of that name)
  GRADER_PATH       the package's folder (default: .)
  GRADER_PASS_MARK  points, or a percentage of the visible points: 60% (default: the rubric's)
  GRADER_FAIL_ON    any of below-pass-mark, not-graded, inconclusive (default: all), or never
  GRADER_STATIC     true: look at the files only, run nothing
  GRADER_SANDBOX    auto (default), require or none
  GRADER_OUT        where the results go (default: grader-results)

"""


def add_ci(add: Adder) -> None:
    """Add `ci`."""
    command = add("ci", "check a package in a CI job, and tell the CI system")
    command.epilog = f"{CI_VARIABLES}{command.epilog}"
    command.add_argument("system", choices=("github", "gitlab"), help="whose runner this is")
