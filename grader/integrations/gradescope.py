"""Gradescope: the export of an autograder, and the results of a grading."""

from __future__ import annotations

import json
from typing import Any

from grader.errors import GraderError
from grader.integrations.bundle import (
    SETTINGS_FILE,
    Bundle,
    Platform,
    Settings,
    add_lab,
    system_script,
    template,
    wheel,
)
from grader.model.result import GradingResult
from grader.report.gradescope import LIMIT, LOOK, render_gradescope
from grader.report.sentences import without_sandbox
from grader.report.text import line
from grader.rubric.load import LoadedRubric


def autograder(rubric: LoadedRubric, settings: Settings) -> bytes:
    """Return the zip to upload. Raises UsageError if the grader is not installed."""
    bundle = Bundle()
    name, data = wheel()
    bundle.add(name, data)
    bundle.add("system.sh", system_script(), executable=True)
    bundle.add("setup.sh", template("gradescope-setup.sh"), executable=True)
    run = template("run_autograder").replace(b"@SECONDS@", str(settings.grading_s).encode())
    bundle.add("run_autograder", run, executable=True)
    path = add_lab(bundle, rubric, "rubric")
    bundle.add(SETTINGS_FILE, settings.model_copy(update={"rubric": path}).to_json())
    return bundle.zipped()


def graded(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
    """Return the points and tests. Raises GraderError if nothing was graded because of the machine."""
    document: dict[str, Any] = json.loads(render_gradescope(result, rubric.rubric))
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
    """Return a document without a score: Gradescope then stores none, and the staff can run it again."""
    why = f"NOT GRADED, {LOOK}: {line(fault.message, LIMIT)}"
    test = {"name": "NOT GRADED", "status": "failed", "output": why, "visibility": "visible"}
    return {
        "output": f"{why}\n{line(fault.hint, LIMIT)}\nThis is no mark: nothing was counted against you.",
        "output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": [test],
    }


PLATFORM = Platform(lab="source", upload="submission", graded=graded, not_graded=not_graded)
"""Its folders lie below /autograder."""
