"""The pages of docs/reference/ that are made from the code: `make reference` writes them, a test compares them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from grader.evidence.writer import JSON_SCHEMAS, make_json_schemas
from scripts.reference.checks import checks_page
from scripts.reference.commands import commands_page, exit_codes_page
from scripts.reference.facts import facts_page
from scripts.reference.formats import format_pages
from scripts.reference.labs import labs_page
from scripts.reference.operators import operators_page
from scripts.reference.records import rubric_page

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "reference"
PAGES: dict[str, Callable[[], str]] = {
    "checks.md": checks_page,
    "commands.md": commands_page,
    "exit-codes.md": exit_codes_page,
    "facts.md": facts_page,
    "labs.md": labs_page,
    "mutation-operators.md": operators_page,
    "rubric.md": rubric_page,
}


def made() -> dict[str, str]:
    """Every file that is made, by its path below the folder of the reference."""
    schemas = {f"../../grader/evidence/{JSON_SCHEMAS}": make_json_schemas()}
    return {**{name: page() for name, page in PAGES.items()}, **format_pages(), **schemas}
