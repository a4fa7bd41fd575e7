"""Services that the grader offers: what a scenario may say of them, and every fault with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.rubric.load import load_rubric
from tests.rubric.samples import faults, spoiled

AT = "lab.yaml:11: scenarios.real.serves[0]"
OWN = "service: /add, type: lab1/Add"
TEXT = r'definition: "int64 a\n---\nint64 sum"'


def _serving(folder: Path, served: str) -> Path:
    return spoiled(folder, ("    until:", f"    serves: [{served}]\n    until:"))


@pytest.mark.parametrize(
    "served",
    [
        "{action: /count, type: lab1/Count, feedback: [{count: 1}], result: {total: 3}, ends: aborted, delay_s: 1}",
        f"{{{OWN}, answer: {{sum: 7}}}}",
        f"{{{OWN}, answers: [{{sum: 7}}, {{sum: 8}}], delay_s: 2, {TEXT}}}",
        f"{{{OWN}, fails: true}}",
        "{service: /reset, type: std_srvs/Empty, answer: {}}",
        r'{service: /lap, type: lab1/Lap, answer: {lap: {a: 1}}, definition: "---\nlab1/Time lap"}',
    ],
)
def test_sound_services(served: str, tmp_path: Path) -> None:
    assert load_rubric(str(_serving(tmp_path, served))).rubric.scenarios["real"].serves


@pytest.mark.parametrize(
    ("served", "fault"),
    [
        (f"{{{OWN}}}", ": give one of answer, answers and fails: none is there"),
        (
            f"{{{OWN}, answer: {{}}, fails: true}}",
            ": give one of answer, answers and fails: answer and fails are",
        ),
        ("{type: lab1/Add, fails: true}", ": give one of service and action, not neither"),
        ("{action: /a, type: a/B, fails: true}", ".fails: is not for an action"),
        (f"{{{OWN}, fails: true, result: {{}}}}", ".result: is not for a service"),
        (
            "{action: /a, type: actionlib/Test, result: {reslt: 1}}",
            ".result: actionlib/TestResult has no field reslt",
        ),
        ("{service: add, type: lab1/Add, fails: true}", '.service: a service begins with a slash: "/add"'),
        (
            f"{{{OWN}, answer: {{total: 7}}, {TEXT}}}",
            ".answer: lab1/AddResponse has no field total; its fields are",
        ),
        (f"{{{OWN}, answer: {{sum: 7.5}}, {TEXT}}}", ".answer: 7.5 is no int64"),
        (f"{{{OWN}, answers: [{{sum: 7}}, {{sum: x}}], {TEXT}}}", ".answers[1]: 'x' is no int64"),
        ("{service: /a, type: std_srvs/Trigger, answer: {succes: true}}", '(did you mean "success"?)'),
        ("{service: /a, type: std_srvs/Triger, fails: true}", '.type: std_srvs has no service type "Triger"'),
        (
            f'{{{OWN}, fails: true, definition: "int64 a"}}',
            ".definition: a service has a request and a response",
        ),
    ],
)
def test_faults(served: str, fault: str, tmp_path: Path) -> None:
    (found,) = faults(_serving(tmp_path, served))
    assert found.startswith(AT)
    assert fault in found


def test_a_service_is_offered_once(tmp_path: Path) -> None:
    served = f"{{{OWN}, fails: true}}"
    (found,) = faults(_serving(tmp_path, f"{served}, {served}"))
    assert found == "lab.yaml:11: scenarios.real.serves[1].service: /add is offered by serves[0] already"


def test_calls_are_judged_of_a_service_that_is_offered(tmp_path: Path) -> None:
    path = _serving(tmp_path, f"{{{OWN}, fails: true}}")
    text = path.read_text(encoding="utf-8")
    judged = "check: calls\n    with: {service: /ad, expect: {a: 3}}"
    path.write_text(text.replace("check: rate\n    with: {topic: /chatter, rate_hz: 10}", judged, 1))
    (found,) = faults(path)
    assert found == (
        'lab.yaml:18: criteria[0].with.service: the grader does not offer /ad in real (did you mean "/add"?): '
        "add it to serves"
    )
