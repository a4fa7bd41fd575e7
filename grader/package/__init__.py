"""What the files of a package say, with file and line.

A `Submission` comes in, `PackageFacts` go out. Nothing of the student's is executed; whether the facts are right or
wrong is for `checks` to say.
"""

from grader.package.facts import python_paths, read_package, with_build_facts
from grader.package.python import SyntaxReport, check_syntax, read_syntax_report

__all__ = [
    "SyntaxReport",
    "check_syntax",
    "python_paths",
    "read_package",
    "read_syntax_report",
    "with_build_facts",
]
