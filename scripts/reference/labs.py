"""`labs.md`, made from the rubrics that come with the grader."""

from __future__ import annotations

from collections.abc import Iterator

from grader.rubric.load import all_rubrics
from grader.rubric.model import Criterion, Rubric
from grader.wording import number
from scripts.reference.table import MADE, code, table

INTRODUCTION = f"""# Labs

The rubrics that come with the grader, and what each criterion is worth. `grader rubric copy LAB` writes one of them,
to change it. {MADE}
"""


def labs_page() -> str:
    """Every lab as Markdown: its criteria, with their checks."""
    rubrics = [loaded.rubric for loaded in all_rubrics()]
    rows = [
        (
            f"[{code(rubric.id)}](#{rubric.id})",
            code(rubric.package),
            str(len(rubric.criteria)),
            rubric.handout,
        )
        for rubric in rubrics
    ]
    lines = [INTRODUCTION, *table(("lab", "package", "criteria", "handout"), rows)]
    for rubric in rubrics:
        lines += _lab(rubric)
    return "\n".join(lines).rstrip() + "\n"


def _lab(rubric: Rubric) -> Iterator[str]:
    yield from (f"## {rubric.id}", "", f"{rubric.title}. Version {rubric.version}.", "")
    yield from table(("points", "criterion", "asks for", "check"), map(_criterion, rubric.criteria))


def _criterion(criterion: Criterion) -> tuple[str, ...]:
    check = code(criterion.check)
    linked = check if criterion.check in {"manual", "pytest"} else f"[{check}](checks.md#{criterion.check})"
    hidden = ", hidden" if criterion.visibility == "hidden" else ""
    return number(criterion.points), code(criterion.id), criterion.title + hidden, linked
