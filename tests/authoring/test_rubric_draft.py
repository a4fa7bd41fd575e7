"""A rubric that is proposed from a run holds what the run's program wrote as data, and as nothing else."""

from __future__ import annotations

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.authoring.mutation.faulty_packages import mutants_text
from grader.authoring.rubric_draft import rubric_text
from grader.model.mutants import LostCriterion, Mutant, MutantResult
from tests.report.nasty import STEERING, TEXTS
from tests.report.test_text_visible import TO_A_CI

SOME = settings(max_examples=60)


@SOME
@given(TEXTS, TEXTS, st.lists(TEXTS, max_size=3))
def test_a_proposed_rubric_reads_back(name, text, notes):
    scenarios = {
        "node": {"title": text, "start": [{"name": "node", "script": name}], "until": {"messages": {text: 3}}}
    }
    criteria = [
        {
            "id": "a",
            "title": text,
            "points": 100,
            "check": "logs",
            "with": {"text": text, "names": [name, text]},
        }
    ]
    made = rubric_text(name, "sample", scenarios, criteria, notes)
    read = yaml.safe_load(made)
    assert read["package"] == name
    assert read["scenarios"] == scenarios
    assert read["criteria"] == criteria
    assert set(read) == {"schema", "id", "title", "version", "package", "scenarios", "criteria"}
    assert made.count("# NOTE:") >= len(notes)
    assert STEERING.search(made) is None
    assert TO_A_CI.search(made) is None


@SOME
@given(TEXTS, TEXTS)
def test_a_written_mutants_file_reads_back(place, value):
    edit = {"operator": "o", "at": {"script": place}, "with": {"to": value}}
    mutant = Mutant.model_validate({"edits": (edit,), "expect": {}})
    lost = (LostCriterion(id="rate", status="fail", message=""),)
    results = [
        MutantResult(
            name=state, label="", operator="o", mistake="", state=state, expected=None, diff="", wall_s=1,
            lost=lost if state == "killed" else (),
        )
        for state in ("killed", "survived")
    ]  # fmt: skip
    made = mutants_text("sample", {"killed": mutant, "survived": mutant}, results)
    assert yaml.safe_load(made)["mutants"] == {"killed": {"expect": {"rate": "fail"}, "edits": [edit]}}
    assert STEERING.search(made) is None
