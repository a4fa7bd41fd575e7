"""The worked example of docs/how-to/own-checks.md, judged on recordings that are kept for ever."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml

from grader import checks
from grader.checks import CHECKS, registry
from grader.cli.main import run
from grader.evidence.reader import load_evidence
from grader.judging import judge
from grader.judging.summary import total_points
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.rubric.load import load_rubric
from tests.support.timeline import build_runs

ROOT = Path(__file__).parent.parent.parent.parent
EXAMPLE = ROOT / "rubrics" / "examples" / "own-checks"
PAGE = (ROOT / "docs" / "how-to" / "own-checks.md").read_text(encoding="utf-8")


def judged(recording: str) -> tuple[dict[str, CriterionResult], float]:
    loaded = load_rubric(str(EXAMPLE / "own-checks.yaml"))
    runs = load_evidence([ROOT / "tests" / "data" / "recordings" / recording])
    found = judge(loaded.rubric, runs, loaded.checks)
    return {c.id: c for c in found}, total_points(loaded.rubric, found)


@pytest.mark.parametrize("name", ["own-checks.yaml", "my_checks.py", "test_counting.py"])
def test_the_page_shows_the_files(name):
    assert f"\n{(EXAMPLE / name).read_text(encoding='utf-8')}```\n" in PAGE


@pytest.mark.full
def test_a_correct_package_gets_everything():
    found, points = judged("correct")
    assert {c.status for c in found.values()} == {Status.PASS}
    assert points == 100


@pytest.mark.full
def test_one_that_dies_at_128_loses_what_the_page_says():
    found, points = judged("dies-at-128")
    counting = found["counting"]
    assert (found["in-step"].status, points) == (Status.PASS, 80)
    shown = [
        f"counting: {counting.points:g}/{counting.max_points:g}, {counting.status.value}",
        counting.message,
        f"measured: {counting.measured}",
        f"hint: {counting.hint}",
    ]
    assert "```\n" + "\n".join(shown) + "\n```\n" in PAGE


RECIPES = dict(re.findall(r"```python\n(def (test_\w+).*?)```", PAGE.partition("## Recipes")[2], re.DOTALL))
assert len(RECIPES) == 5
RUN = """
topics:
  - {topic: /cmd_vel, type: geometry_msgs/Twist, values: [{linear: {x: 0.4}}]}
  - {topic: /status, times_s: [0.9, 1.8]}
console: [{process: talker, line: "ready to go"}]
processes: [{name: talker, script: src/talker.py, stopped_by: INT, exit_code: 0}]
actors: [{action: publish, topic: /command, values: [go, stop], every_s: 0.9, at_s: 0.6}]
"""


@pytest.mark.parametrize(("recipe", "name"), RECIPES.items(), ids=RECIPES.values())
def test_the_recipes_judge_a_recording(recipe, name):
    known: dict[str, object] = {}
    exec(recipe, known)  # noqa: S102 - the page's own code
    found = known[name]
    assert callable(found)
    found(build_runs(yaml.safe_load(RUN))["run"])
    with pytest.raises(AssertionError, match=r"\w+"):
        found(build_runs({"topics": [], "actors": []})["run"])


def test_explain_and_the_schema_say_what_a_parameter_means(capsys):
    rubric = str(EXAMPLE / "own-checks.yaml")
    assert run(["explain", "in-step", "--rubric", rubric]) == 0
    assert "within_s (number, seconds; default 0.05): How far apart the two may be" in capsys.readouterr().out
    assert run(["rubric", "schema", "--rubric", rubric]) == 0
    keys = json.loads(capsys.readouterr().out)["$defs"]["InStepParams"]["properties"]
    assert keys["within_s"]["description"] == "How far apart the two may be, one way or the other."


def test_the_page_names_the_facts_and_what_can_be_imported():
    assert all(f"| `{fact}` |" in PAGE for fact in registry.FACTS)
    names = set(checks.__all__) - {"CHECKS", "FAMILIES", "HEADINGS", "Check"}
    assert all(f"`{name}" in PAGE for name in names)
    assert "in-step" not in CHECKS
