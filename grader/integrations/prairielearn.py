"""PrairieLearn: a question with an external grader, the files of its image, and what it answers in the container."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from grader.errors import GraderError
from grader.integrations.autograde import Form, Place
from grader.integrations.bundle import add_lab
from grader.integrations.bundle import Parcel
from grader.integrations.bundle import FILE, Settings
from grader.integrations.bundle import system_script, wheel
from grader.model.result import CriterionResult, GradingResult
from grader.report.hidden import hidden_ids
from grader.report.settled import late_words
from grader.report.text import html, line, number, text_limit
from grader.report.view import OPEN
from grader.rubric.load import LoadedRubric

DEFAULT_MINUTES, MOST_MINUTES = 10, 10
"""PrairieLearn lets an external grader run for 600 seconds at most."""
ENTRYPOINT = "/usr/local/bin/grade-question"
IMAGE = "ros-lab-grader"
LIMIT = 1000
LOOK = "A PERSON MUST LOOK"


def question(rubric: LoadedRubric, settings: Settings, image: str) -> Parcel:
    """`question/` for a course, and `image/` to build the image from, which is the same for every lab."""
    parcel = Parcel()
    name, data = wheel()
    parcel.add(f"image/{name}", data)
    parcel.add("image/system.sh", system_script(), executable=True)
    parcel.add("image/grade-question", _file("grade-question"), executable=True)
    parcel.add("image/Dockerfile", _file("prairielearn.Dockerfile"))
    lab = add_lab(parcel, rubric, "question/tests/rubric").removeprefix("question/tests/")
    parcel.add(f"question/tests/{FILE}", settings.model_copy(update={"rubric": lab}).to_json())
    parcel.add("question/info.json", _info(rubric, settings, image))
    parcel.add("question/question.html", _page(rubric))
    return parcel


def _info(rubric: LoadedRubric, settings: Settings, image: str) -> bytes:
    """The uuid is made of the rubric's id: exported again, it is the same question."""
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


def _page(rubric: LoadedRubric) -> bytes:
    text = _file("question.html").decode()
    package = html(rubric.rubric.package)
    return text.replace("@TITLE@", html(rubric.rubric.title)).replace("@PACKAGE@", package).encode()


def place(root: Path) -> Place:
    """PrairieLearn's folders, below /grade."""
    return Place(lab=root / "tests", handed_in=root / "student", results=root / "results")


def graded(result: GradingResult, rubric: LoadedRubric) -> dict[str, Any]:
    """Points, or that what was handed in cannot be graded: then no attempt is used up."""
    if result.error is not None:
        return _invalid(result.error.message, result.error.hint)
    counting = [c for c in result.criteria if c.max_points > 0]
    if all(c.status in OPEN for c in counting):
        return _invalid("no criterion could be judged", "hand it in again")
    hidden = hidden_ids(rubric.rubric)
    shown = [c for c in result.criteria if c.id not in hidden]
    limit = text_limit(len(result.criteria), LIMIT)
    tests = [_test(c, limit) for c in shown]
    if unseen := [c for c in result.criteria if c.id in hidden]:
        tests.append(_unseen(unseen))
    return {
        "gradable": True,
        "score": round(min(1.0, max(0.0, result.points / (result.max_points or 1.0))), 6),
        "message": "\n".join(_message(result, shown)),
        "tests": tests,
    }


def not_graded(fault: GraderError) -> dict[str, Any]:
    """PrairieLearn takes no points and no attempt for it."""
    return _invalid(fault.message, fault.hint)


FORM = Form(graded=graded, not_graded=not_graded)


def _invalid(message: str, hint: str) -> dict[str, Any]:
    errors = [line(f"not graded: {message}", LIMIT), line(hint, LIMIT)]
    return {"gradable": False, "score": 0.0, "format_errors": [e for e in errors if e]}


def _message(result: GradingResult, shown: list[CriterionResult]) -> Iterator[str]:
    waiting = sum(c.max_points for c in shown if c.status in OPEN)
    if waiting:
        yield f"{LOOK}: {number(waiting)} points are not settled yet; no points are lost for good."
    yield f"{number(result.points)} of {number(result.max_points)} points"
    yield from (line(words, LIMIT) for words in late_words(result))


def _test(criterion: CriterionResult, limit: int) -> dict[str, Any]:
    name = f"{criterion.id}: {criterion.title}"
    rows = {
        "measured: ": criterion.measured,
        "expected: ": criterion.expected,
        "hint: ": criterion.hint,
        "see it yourself: ": criterion.reproduce,
    }
    return {
        "name": line(f"{LOOK}: {name}" if criterion.status in OPEN else name, limit),
        "points": criterion.points,
        "max_points": criterion.max_points,
        "message": line(f"{criterion.status.value}: {criterion.message}", limit),
        "output": "\n".join(f"{label}{line(text, limit)}" for label, text in rows.items() if text),
    }


def _unseen(criteria: list[CriterionResult]) -> dict[str, Any]:
    """PrairieLearn has no criteria that are seen later, and the score counts them all."""
    return {
        "name": f"{len(criteria)} criteria that are not shown",
        "points": round(sum(c.points for c in criteria), 6),
        "max_points": sum(c.max_points for c in criteria),
    }


def _file(name: str) -> bytes:
    return (resources.files("grader.integrations.deliver") / "files" / name).read_bytes()
