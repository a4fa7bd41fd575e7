from __future__ import annotations

from grader.authoring.mutation.declared import load_mutants, mutants_text
from grader.authoring.mutation.plan import plan_all
from grader.model.mutants import LostCriterion, MutantResult
from grader.rubric.load import load_rubric
from tests.mutation.samples import other_solution
from tests.rubric.samples import spoiled


def lost(name: str, status: str) -> LostCriterion:
    return LostCriterion(id=name, status=status, message="")


def test_a_written_file_declares_what_was_lost(tmp_path):
    planned = plan_all(other_solution())
    results = [
        MutantResult(
            name=mutant.name,
            label=mutant.label,
            operator=mutant.mutant.operators[0],
            mistake="",
            state=("survived", "killed", "inconclusive")[index % 3],
            expected=None,
            lost=(lost("chatter-rate", "fail"), lost("talker-node", "blocked")) if index % 3 == 1 else (),
            diff="",
            wall_s=1,
        )
        for index, mutant in enumerate(planned)
    ]
    text = mutants_text("sample", {mutant.name: mutant.mutant for mutant in planned}, results)
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    loaded = load_mutants(path, load_rubric(str(spoiled(tmp_path))).rubric)
    assert len(loaded.mutants) == sum(result.state == "killed" for result in results)
    assert [m.edits for m in loaded.mutants.values()] == [
        p.mutant.edits for i, p in enumerate(planned) if i % 3 == 1
    ]
    assert all(
        m.expect == {"chatter-rate": "fail", "talker-node": "blocked"} for m in loaded.mutants.values()
    )
    assert text.count("# costs nothing: the rubric does not notice this mistake") == len(planned[::3])
