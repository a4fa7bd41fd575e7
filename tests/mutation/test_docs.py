from __future__ import annotations

from grader.mutation.docs import operators_page
from grader.mutation.operators import OPERATORS
from tests.mutation.samples import LABS, ROOT


def test_the_page_is_up_to_date():
    """`python -m grader.mutation.docs > docs/mutation-operators.md` brings it up to date."""
    assert (ROOT / "docs" / "mutation-operators.md").read_text(encoding="utf-8") == operators_page()


def test_the_page_has_every_operator_and_lab():
    page = operators_page()
    assert all(page.count(f"`{name}`") == 2 for name in OPERATORS)
    assert all(f" {lab.split('-')[0]} |" in page for lab in LABS)
