"""Gradescope: an autograder as a zip, and what it answers in Gradescope's container."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import Any

from grader.errors import GraderError
from grader.integrations.autograde import Form, Place
from grader.integrations.bundle import add_lab
from grader.integrations.bundle import Parcel
from grader.integrations.bundle import FILE, Settings
from grader.integrations.bundle import system_script, wheel
from grader.model.result import GradingResult
from grader.report.gradescope import LIMIT, LOOK, gradescope
from grader.report.text import line
from grader.report.unwalled import without_sandbox
from grader.rubric.load import LoadedRubric

DEFAULT_MINUTES, MOST_MINUTES = 10, 40
"""Gradescope's own limits of time."""


def autograder(rubric: LoadedRubric, settings: Settings) -> bytes:
    """The zip to upload. Raises UsageError where the grader is not installed."""
    parcel = Parcel()
    name, data = wheel()
    parcel.add(name, data)
    parcel.add("system.sh", system_script(), executable=True)
    parcel.add("setup.sh", _file("gradescope-setup.sh"), executable=True)
    run = _file("run_autograder").replace(b"@SECONDS@", str(settings.grading_s).encode())
    parcel.add("run_autograder", run, executable=True)
    path = add_lab(parcel, rubric, "rubric")
    parcel.add(FILE, settings.model_copy(update={"rubric": path}).to_json())
    return parcel.zipped()


def place(root: Path) -> Place:
    """Gradescope's folders, below /autograder."""
    return Place(lab=root / "source", handed_in=root / "submission", results=root / "results")


def graded(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
    """Raises GraderError where the machine kept everything from being graded."""
    document: dict[str, Any] = json.loads(gradescope(result, rubric.rubric))
    about = result.environment
    unwalled = line(without_sandbox(about.sandbox), LIMIT)
    document["extra_data"] = {
        "grader": about.grader,
        "sandbox": about.sandbox,
        **({"without_sandbox": unwalled} if unwalled else {}),
        "rubric": result.rubric.model_dump(),
        "submission": result.submission.digest,
    }
    return document


def not_graded(fault: GraderError) -> dict[str, Any]:
    """No score: Gradescope then keeps none, and the staff can run it again."""
    why = f"NOT GRADED, {LOOK}: {line(fault.message, LIMIT)}"
    test = {"name": "NOT GRADED", "status": "failed", "output": why, "visibility": "visible"}
    return {
        "output": f"{why}\n{line(fault.hint, LIMIT)}\nThis is no mark: nothing was counted against you.",
        "output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": [test],
    }


FORM = Form(graded=graded, not_graded=not_graded)


def _file(name: str) -> bytes:
    return (resources.files("grader.integrations.deliver") / "files" / name).read_bytes()
