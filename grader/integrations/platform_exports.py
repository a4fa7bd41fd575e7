"""Gradescope and PrairieLearn: what is exported for each, and how a result or a fault is written for it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from grader.errors import GraderError, UsageError
from grader.files import atomic_write
from grader.integrations.bundle import (
    SETTINGS_FILE,
    Bundle,
    BundleSettings,
    ContainerLayout,
    add_lab,
    needs_script,
    system_script,
    template,
    wheel,
)
from grader.model.result import CriterionResult, GradingResult
from grader.report.hidden_criteria import hidden_ids
from grader.report.platform_results import LIMIT, LOOK, detail_rows, render_gradescope
from grader.report.sentences import STATES, score_words, without_sandbox
from grader.report.text import html, line, text_limit
from grader.rubric.load import LoadedRubric
from grader.wording import number

ENTRYPOINT = "/usr/local/bin/grade-question"
NEEDS_LINES = (
    b"COPY needs.sh /tmp/needs.sh\nRUN bash /tmp/needs.sh && rm -rf /tmp/needs.sh /var/lib/apt/lists/*\n"
)


def gradescope_autograder(rubric: LoadedRubric, settings: BundleSettings) -> bytes:
    """Return the zip to upload. Raises UsageError if the grader is not installed."""
    bundle = Bundle()
    name, data = wheel()
    bundle.add(name, data)
    bundle.add("system.sh", system_script(), executable=True)
    bundle.add("setup.sh", template("gradescope-setup.sh"), executable=True)
    run = template("run_autograder").replace(b"@SECONDS@", str(settings.grading_s).encode())
    bundle.add("run_autograder", run, executable=True)
    if needs := needs_script(rubric.rubric.needs):
        bundle.add("needs.sh", needs, executable=True)
    path = add_lab(bundle, rubric, "rubric")
    bundle.add(SETTINGS_FILE, settings.model_copy(update={"rubric": path}).to_json())
    return bundle.zipped()


def _gradescope_results(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
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


def _gradescope_fault(fault: GraderError) -> dict[str, Any]:
    """Return a document without a score: Gradescope then stores none, and the staff can run it again."""
    why = f"NOT GRADED, {LOOK}: {line(fault.message, LIMIT)}"
    test = {"name": "NOT GRADED", "status": "failed", "output": why, "visibility": "visible"}
    return {
        "output": f"{why}\n{line(fault.hint, LIMIT)}\nThis is not a mark: nothing was counted against you.",
        "output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": [test],
    }


GRADESCOPE = ContainerLayout(
    lab="source", upload="submission", graded=_gradescope_results, not_graded=_gradescope_fault
)
"""Its folders lie below /autograder."""


def prairielearn_question(rubric: LoadedRubric, settings: BundleSettings, image: str) -> Bundle:
    """Return the folder `question/` for a course, and `image/`, the files of a Docker image: it suits every lab that
    needs nothing besides."""
    bundle = Bundle()
    name, data = wheel()
    bundle.add(f"image/{name}", data)
    bundle.add("image/system.sh", system_script(), executable=True)
    bundle.add("image/grade-question", template("grade-question"), executable=True)
    dockerfile = template("prairielearn.Dockerfile")
    if needs := needs_script(rubric.rubric.needs):
        bundle.add("image/needs.sh", needs, executable=True)
        dockerfile = dockerfile.replace(b"ENTRYPOINT", NEEDS_LINES + b"ENTRYPOINT")
    bundle.add("image/Dockerfile", dockerfile)
    lab = add_lab(bundle, rubric, "question/tests/rubric").removeprefix("question/tests/")
    bundle.add(f"question/tests/{SETTINGS_FILE}", settings.model_copy(update={"rubric": lab}).to_json())
    bundle.add("question/info.json", _info(rubric, settings, image))
    bundle.add("question/question.html", _page(rubric, settings))
    return bundle


def write_question(bundle: Bundle, target: Path) -> None:
    """Write a question to a folder, or to a zip if `target` ends in .zip.

    Raises UsageError if the folder contains anything but an earlier export.
    """
    if target.suffix.lower() == ".zip":
        atomic_write(target, bundle.zipped(), public=True)
        return
    if target.exists() and not target.is_dir():
        raise UsageError(f"{target} is not a folder", hint="give --out a folder, or a name that ends in .zip")
    exported = (target / "question" / "tests" / SETTINGS_FILE).is_file()
    if target.is_dir() and any(target.iterdir()) and not exported:
        raise UsageError(f"{target} contains other files", hint="choose a new folder with --out")
    bundle.write(target)


def _info(rubric: LoadedRubric, settings: BundleSettings, image: str) -> bytes:
    """Return info.json. Its uuid comes from the rubric's id, so that a second export is the same question."""
    lab = rubric.rubric
    info = {
        "uuid": str(uuid5(NAMESPACE_URL, f"ros-lab-grader:{lab.id}")),
        "title": lab.title,
        "topic": "ROS",
        "tags": ["code", "v3"],
        "type": "v3",
        "singleVariant": True,
        "gradingMethod": "External",
        "externalGradingOptions": {
            "enabled": True,
            "image": image,
            "entrypoint": ENTRYPOINT,
            "timeout": settings.minutes * 60,
        },
    }
    return f"{json.dumps(info, indent=4, ensure_ascii=False)}\n".encode()


def _page(rubric: LoadedRubric, settings: BundleSettings) -> bytes:
    text = template("question.html").decode()
    package = html(settings.package or rubric.rubric.package)
    return text.replace("@TITLE@", html(rubric.rubric.title)).replace("@PACKAGE@", package).encode()


def _prairielearn_results(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
    """Return the points, or that the submission cannot be graded: then no attempt is used up."""
    if result.error is not None:
        return _invalid(result.error.message, result.error.hint)
    # without any that counts, too: there is nothing to give points for
    counting = [c for c in result.criteria if c.counts]
    if all(c.status.is_open for c in counting):
        return _invalid("no criterion could be judged", "submit again")
    hidden = hidden_ids(rubric.rubric)
    shown = [c for c in result.criteria if c.id not in hidden]
    limit = text_limit(len(result.criteria), LIMIT)
    tests = [_test(c, limit) for c in shown]
    if unseen := [c for c in result.criteria if c.id in hidden]:
        tests.append(_unseen(unseen))
    return {
        "gradable": True,
        # a bonus gives no more than all, and penalties no less than none
        "score": round(min(1.0, max(0.0, result.points / (result.max_points or 1.0))), 6),
        "message": "\n".join(_message(result, shown)),
        "tests": tests,
    }


PRAIRIELEARN = ContainerLayout(
    lab="tests",
    upload="student",
    graded=_prairielearn_results,
    # costs neither points nor an attempt
    not_graded=lambda fault: _invalid(fault.message, fault.hint),
)
"""Its folders lie below /grade."""


def _invalid(message: str, hint: str) -> dict[str, Any]:
    errors = [line(f"not graded: {message}", LIMIT), line(hint, LIMIT)]
    return {"gradable": False, "score": 0.0, "format_errors": [e for e in errors if e]}


def _message(result: GradingResult, shown: list[CriterionResult]) -> Iterator[str]:
    waiting = sum(c.missing for c in shown if c.status.is_open)
    if waiting:
        yield f"{LOOK}: {number(waiting)} points are not decided yet; no points are lost for good."
    yield f"{number(result.points)} of {number(result.max_points)} points"
    yield from (line(words, LIMIT) for words in score_words(result))


def _test(criterion: CriterionResult, limit: int) -> dict[str, Any]:
    name = f"{criterion.id}: {criterion.title}"
    return {
        "name": line(f"{LOOK}: {name}" if criterion.status.is_open else name, limit),
        "points": criterion.points,
        "max_points": criterion.max_points,
        "message": line(f"{STATES[criterion.status]}: {criterion.message}", limit),
        "output": "\n".join(
            f"{label}{line(text, limit)}" for label, text in detail_rows(criterion).items() if text
        ),
    }


def _unseen(criteria: list[CriterionResult]) -> dict[str, Any]:
    """Return one row for all hidden criteria: PrairieLearn cannot reveal them later, and the score counts them."""
    return {
        "name": f"{len(criteria)} criteria that are not shown",
        "points": round(sum(c.points for c in criteria), 6),
        "max_points": sum(c.max_points for c in criteria),
    }
