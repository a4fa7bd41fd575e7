"""`docs/reference/checks.md`, made from the checks' own docstrings."""

from __future__ import annotations

from grader.checks import CHECKS, HEADINGS, Check

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
        lines += ["| parameter | default |", "|---|---|", *_parameter_rows(check), ""]
    return "\n".join(lines)


def _parameter_rows(check: Check) -> list[str]:
    return [
        f"| `{name}` | {'required' if field.is_required() else f'`{field.default!r}`'} |"
        for name, field in check.params.model_fields.items()
    ]


def _checks() -> list[Check]:
    return [CHECKS[name] for name in sorted(CHECKS)]
