"""What the files of a package say, with file and line.

A `Submission` comes in, `PackageFacts` go out. Nothing of the student's is executed; whether the facts are right or
wrong is for `checks` to say.

`repairs/` holds the kinds of repair, a file for each kind of file. The lines that they write are worked out here:
`line_slips`, `cmake_slips` and `xml_slips` for text, CMake and XML; for Python `source_repair`, which calls
`syntax_repair`, `name_repair`, `member_repair`, `call_repair` and `import_repair`.

Names are loaded when they are first asked for: the child that reads Python sources needs none of them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grader.package.facts import python_paths, read_package, read_packages, with_build_facts
    from grader.package.python import SyntaxReport, check_syntax, read_syntax_report

__all__ = [
    "SyntaxReport",
    "check_syntax",
    "python_paths",
    "read_package",
    "read_packages",
    "read_syntax_report",
    "with_build_facts",
]

_PLACES = {
    "facts": ("python_paths", "read_package", "read_packages", "with_build_facts"),
    "python": ("SyntaxReport", "check_syntax", "read_syntax_report"),
}
_MODULE_OF = {name: f"grader.package.{module}" for module, names in _PLACES.items() for name in names}


if not TYPE_CHECKING:  # to a type checker it would mean that there is every name

    def __getattr__(name: str) -> object:
        if name not in _MODULE_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_MODULE_OF[name]), name)
        return value
