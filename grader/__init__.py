"""An automated grader for introductory ROS 1 labs (rospy, catkin).

`from grader import grade, judge, load_rubric` gives the Python API (docs/how-to/python-api.md). It is loaded when it is
first asked for, so that `import grader` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grader.api import grade, judge, load_rubric
    from grader.errors import EvidenceError, GraderError, HostError, RubricError, SubmissionError, UsageError
    from grader.model.result import CriterionResult, GradingResult
    from grader.model.verdict import EvidenceCitation, FileCitation, Status
    from grader.results import load_result
    from grader.rubric.load import LoadedRubric
    from grader.rubric.model import Criterion, Rubric
    from grader.rubric.scenario import Scenario

__version__ = "0.1.0"

__all__ = [
    "Criterion",
    "CriterionResult",
    "EvidenceCitation",
    "EvidenceError",
    "FileCitation",
    "GraderError",
    "GradingResult",
    "HostError",
    "LoadedRubric",
    "Rubric",
    "RubricError",
    "Scenario",
    "Status",
    "SubmissionError",
    "UsageError",
    "__version__",
    "grade",
    "judge",
    "load_result",
    "load_rubric",
]

_PLACES = {
    "grader.api": ("grade", "judge", "load_rubric"),
    "grader.errors": (
        "EvidenceError",
        "GraderError",
        "HostError",
        "RubricError",
        "SubmissionError",
        "UsageError",
    ),
    "grader.model.result": ("CriterionResult", "GradingResult"),
    "grader.model.verdict": ("EvidenceCitation", "FileCitation", "Status"),
    "grader.results": ("load_result",),
    "grader.rubric.load": ("LoadedRubric",),
    "grader.rubric.model": ("Criterion", "Rubric", "Scenario"),
}
# turned round, since PEP 562's `__getattr__` below is asked by the name
_MODULE_OF = {name: module for module, names in _PLACES.items() for name in names}


if not TYPE_CHECKING:  # to a type checker it would mean that there is every name

    def __getattr__(name: str) -> object:
        if name not in _MODULE_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_MODULE_OF[name]), name)
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
