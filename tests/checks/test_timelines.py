"""Every timeline gets the verdict that it says, and every check has what it needs to be trusted."""

from __future__ import annotations

import ast
import inspect
import textwrap
from pathlib import Path

import pytest
import yaml

from grader.checks import CHECKS, HEADINGS, Check
from grader.checks.support.text import in_language
from grader.model.verdict import Status
from grader.rubric.schema import inner_records, parameters
from scripts.reference.checks import checks_page
from tests.checks.examples import LOADER, Example, differences, examples_of, exemplified

REPOSITORY = Path(__file__).parents[2]


@pytest.mark.parametrize("name", exemplified())
def test_verdicts(name: str) -> None:
    wrong = {e.id: faults_of(e) for e in examples_of(name)}
    assert {case: faults for case, faults in wrong.items() if faults} == {}


def faults_of(example: Example) -> list[str]:
    verdict = example.verdict()
    found = differences(verdict, example.expect)
    said = verdict.message + verdict.hint + verdict.measured
    for is_right, fault in (
        (bool(verdict.expected), "a verdict says what was expected"),
        (verdict.message == verdict.message.strip(), "there is space around the message"),
        ("\n" not in said, "what is said is one line"),
        (in_language(verdict.message, "cpp") == verdict.message, "only hints speak of code"),
        (verdict.status is Status.PASS or verdict.hint, "where points are lost, a hint says what to do"),
    ):
        if not is_right:
            found.append(f"{fault}: {verdict}")
    return found


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_check_is_documented(check: Check) -> None:
    assert check.title.endswith(".")
    assert list(check.sections) == list(HEADINGS)
    assert all(len(text) > 20 for text in check.sections.values())
    records = (check.params, *inner_records(check.params))
    rows = [row for record in records for row in parameters(record)]
    assert [row.name for row in rows if not row.meaning.endswith(".")] == [], (
        "a field's docstring says what it means"
    )
    assert [row.name for row in rows if "any value" in row.type and row.name not in {"value", "values"}] == []


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_check_is_short(check: Check) -> None:
    tree = ast.parse(textwrap.dedent(inspect.getsource(check.function)))
    function = tree.body[0]
    assert isinstance(function, ast.FunctionDef)
    first = function.body[1]  # behind the docstring
    assert (function.end_lineno or 0) - first.lineno < 40


@pytest.mark.parametrize("name", CHECKS)
def test_check_has_a_passing_and_a_failing_timeline(name: str) -> None:
    statuses = {e.expect["status"] for e in examples_of(name)}
    assert {"pass", "fail"} <= statuses


def test_every_check_has_a_place_in_a_rubric() -> None:
    folders = (REPOSITORY / "rubrics", REPOSITORY / "rubrics" / "examples")
    texts = [path.read_text(encoding="utf-8") for folder in folders for path in folder.glob("*.yaml")]
    rubrics = [yaml.load(text, Loader=LOADER) for text in texts]  # noqa: S506 - as safe as SafeLoader
    used = {criterion["check"] for rubric in rubrics for criterion in rubric["criteria"]}
    assert set(CHECKS) - used == set()


def test_timelines_are_for_checks() -> None:
    assert {*exemplified()} <= CHECKS.keys()


def test_docs_are_what_the_docstrings_say() -> None:
    page = (REPOSITORY / "docs" / "reference" / "checks.md").read_text(encoding="utf-8")
    assert page == checks_page(), "run: make reference"


def test_checks_touch_nothing_outside() -> None:
    """No file, clock, process, network or randomness in a check."""
    forbidden = {"os", "io", "time", "datetime", "random", "socket", "subprocess", "pathlib.Path", "logging"}
    for path in (REPOSITORY / "grader" / "checks").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or "", *(f"{node.module}.{a.name}" for a in node.names)]
            assert not forbidden & set(names), f"{path.name} imports {names}"
            assert not (isinstance(node, ast.Name) and node.id in {"open", "print"}), path.name
