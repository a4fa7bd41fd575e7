"""`docs/reference/checks.md`, made from the checks' own docstrings."""

from __future__ import annotations

from collections.abc import Iterator

from grader.checks import CHECKS, HEADINGS, Check
from grader.model.record import Record
from grader.rubric.schema import about, inner_records, parameters
from scripts.reference.table import table

INTRODUCTION = """# Checks

What each check of a rubric looks at, why, how it measures, and how to put right what it finds.
`grader explain NAME` shows the same. This page is made from the checks' docstrings
(`make reference`).
"""


def checks_page() -> str:
    """The whole page as Markdown, checks in the order of their names."""
    contents = "\n".join(f"- [`{c.name}`](#{c.name}): {c.title.rstrip('.')}" for c in _checks())
    return "\n".join([INTRODUCTION, contents, "", *(check_section(c) for c in _checks())]).rstrip() + "\n"


def check_section(check: Check) -> str:
    """One check as Markdown: title, the four headings, its parameters."""
    lines = [f"## {check.name}", "", check.title, ""]
    for heading in HEADINGS:
        lines += [f"**{heading}.** {check.sections.get(heading, '')}", ""]
    if check.params.model_fields:
        lines += [about(check.params), "", *_rows(check.params, "parameter")]
    for record, words in inner_records(check.params).items():
        lines += [f"**Keys of {words}.** {about(record)}", "", *_rows(record, "key")]
    return "\n".join(lines)


def _rows(record: type[Record], first: str) -> Iterator[str]:
    rows = [(f"`{one.name}`", *one[1:]) for one in parameters(record)]
    yield from table((first, "type", "default", "meaning"), rows)


def _checks() -> list[Check]:
    return [CHECKS[name] for name in sorted(CHECKS)]
