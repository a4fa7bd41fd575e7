from __future__ import annotations

from pathlib import Path

import pytest

from grader.authoring.mutation.load import load_mutants, parameters_of
from grader.authoring.mutation.operators import OPERATORS
from grader.errors import RubricError
from grader.rubric.load import load_rubric
from tests.mutation.samples import LABS, ROOT
from tests.rubric.samples import spoiled

SOUND = """\
schema: grader.mutants/1
rubric: sample
mutants:
  - operator: other-rate
    at: {script: src/talker.py}
    with: {factor: 2}
    costs: {chatter-rate: fail}
  - operator: bit-removed
    also:
      - operator: crlf
        at: {script: src/talker.py}
    costs: {talker-node: partial}
"""


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    text = SOUND
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "sample.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def faults(folder: Path, *changes: tuple[str, str]) -> list[str]:
    path = written(folder, *changes)
    with pytest.raises(RubricError) as caught:
        load_mutants(path, load_rubric(str(spoiled(folder))).rubric)
    return [fault.replace(f"{folder}/", "") for fault in caught.value.faults]


def test_a_sound_file_loads(tmp_path):
    rubric = load_rubric(str(spoiled(tmp_path))).rubric
    first, second = load_mutants(written(tmp_path), rubric).mutants
    assert first.costs == {"chatter-rate": "fail"}
    assert parameters_of(first.operator, first.parameters).model_dump() == {"factor": 2}
    assert [step.operator for step in second.also] == ["crlf"]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("other-rate", "other-rat", '4: mutants[0].operator: there is no operator "other-rat" (did you mean'),
        ("factor: 2", "factor: much", '6: mutants[0].with.factor: must be a number, not "much"'),
        ("factor: 2", "factor: 0", "6: mutants[0].with.factor: must be more than 0, not 0"),
        ("factor: 2", "factr: 2", '6: mutants[0].with.factr: is not known here (did you mean "factor"?)'),
        ("chatter-rate: fail", "chatter-rate: lost", '7: mutants[0].costs.chatter-rate: must be "fail", "partial"'),
        ("{chatter-rate: fail}", "{}", "7: mutants[0].costs: needs at least 1, has 0"),
        ("    costs: {chatter-rate: fail}\n", "", "4: mutants[0].costs: is missing"),
        ("costs: {chatter", "cost: {chatter", '7: mutants[0].cost: is not known here (did you mean "costs"?)'),
        ("rubric: sample", "rubric: other", "2: rubric: these mutants are for other, not for sample"),
        ("mutants/1", "mutants/2", "1: schema: written by a newer grader (grader.mutants/2); this one reads up to 1"),
        ("operator: crlf", "operator: clrf", '10: mutants[1].also[0].operator: there is no operator "clrf"'),
        ("src/talker.py}", "[a]}", "5: mutants[0].at.script"),
        ("operator: bit-removed", "operator: 1", "8: mutants[1].operator: must be text, not 1: put it in quotes"),
        ("    with: {factor", "    with: {}\n    with: {factor", "6: mutants[0].with: is given twice, again in line 7"),
    ],
)  # fmt: skip
def test_a_fault_is_named_with_its_line(old, new, fault, tmp_path):
    found = faults(tmp_path, (old, new))
    assert any(line.startswith(f"sample.yaml:{fault}") for line in found), found


def test_all_faults_are_named_at_once(tmp_path):
    found = faults(tmp_path, ("factor: 2", "factor: much"), ("crlf", "clrf"), ("rubric: sample", "rubric: s"))
    assert [line.split(":")[1] for line in found] == ["2", "6", "10"]


def test_the_same_mutant_twice(tmp_path):
    again = "  - operator: other-rate\n    at: {script: src/talker.py}\n    with: {factor: 2}\n    costs: {x: fail}\n"
    assert faults(tmp_path, ("mutants:\n", f"mutants:\n{again}")) == [
        "sample.yaml:8: mutants[1]: is the same mutant as mutants[0]"
    ]


@pytest.mark.parametrize("text", ["", "[]", "just text", "mutants: 3", "- \t", "\x00", "{a: &x [*x]}"])
def test_what_is_no_mutants_file(text, tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(text)
    with pytest.raises(RubricError) as caught:
        load_mutants(path, load_rubric(str(spoiled(tmp_path))).rubric)
    assert all(fault.startswith(str(path)) for fault in caught.value.faults)


def test_a_criterion_that_the_rubric_lacks_is_no_fault_of_the_file(tmp_path):
    rubric = load_rubric(str(spoiled(tmp_path))).rubric
    path = written(tmp_path, ("chatter-rate: fail", "no-such: fail"))
    assert load_mutants(path, rubric).mutants[0].costs == {"no-such": "fail"}


@pytest.mark.parametrize("lab", LABS)
def test_the_labs_have_enough_mutants_and_operators(lab):
    rubric = load_rubric(lab).rubric
    mutants = load_mutants(ROOT / "rubrics" / "mutants" / f"{lab}.yaml", rubric).mutants
    assert len(mutants) >= 20
    assert len({mutant.operator for mutant in mutants}) >= 15
    assert {name for mutant in mutants for name in mutant.costs} <= {c.id for c in rubric.criteria}


def test_every_lab_has_mutants():
    assert set(LABS) == {path.stem for path in (ROOT / "rubrics").glob("*.yaml")}


def failed(costs: dict[str, str]) -> set[str]:
    return {name for name, status in costs.items() if status != "blocked"}


@pytest.mark.parametrize("lab", LABS)
def test_every_criterion_worth_points_is_lost_by_a_mutant(lab):
    rubric = load_rubric(lab).rubric
    mutants = load_mutants(ROOT / "rubrics" / "mutants" / f"{lab}.yaml", rubric).mutants
    worth = {c.id for c in rubric.criteria if c.points > 0}
    assert worth <= {name for mutant in mutants for name in failed(mutant.costs)}


def test_every_criterion_of_the_first_lab_is_lost_alone():
    """Such a mutant would cost nothing, were the criterion taken out of the rubric."""
    rubric = load_rubric("leeds-comp3631-lab1").rubric
    mutants = load_mutants(ROOT / "rubrics" / "mutants" / f"{rubric.id}.yaml", rubric).mutants
    worth = {c.id for c in rubric.criteria if c.points > 0}
    assert worth <= {name for mutant in mutants if len(mutant.costs) == 1 for name in mutant.costs}


def test_every_operator_has_sound_defaults():
    assert all(operator.params() is not None for operator in OPERATORS.values())
