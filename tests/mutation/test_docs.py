from __future__ import annotations

from grader.authoring.mutation.declared import load_mutants
from grader.authoring.mutation.operators import OPERATORS
from grader.rubric.load import load_rubric
from scripts.reference.operators import EXAMPLE, operators_page
from tests.mutation.samples import LABS
from tests.rubric.samples import spoiled


def test_the_example_is_sound(tmp_path):
    rubric = load_rubric(str(spoiled(tmp_path, ("id: sample", "id: my-lab")))).rubric
    (tmp_path / "m.yaml").write_text(EXAMPLE, encoding="utf-8")
    assert len(load_mutants(tmp_path / "m.yaml", rubric).mutants) == 2


def test_the_page_has_every_operator_and_lab():
    page = operators_page()
    assert all(page.count(f"| `{name}` |") == page.count(f"- `{name}`: ") == 1 for name in OPERATORS)
    assert all(f" {lab.split('-')[0]} |" in page for lab in LABS)
