"""What a loss cites has its text: the line itself, and where Python's carets point in it."""

from __future__ import annotations

import pytest

from grader.judging.annotate import LINE_CHARS, show_lines
from grader.model.verdict import FileCitation, failed, passed
from tests.support.timeline import build_runs

TALKER = "#!/usr/bin/env python3\nimport rospy\n\n    print('I heard ' + 5)\n" + "x" * (LINE_CHARS + 1) + "\n"


def shown(kind=failed, **place) -> FileCitation:
    build = build_runs({"runs": {"package": {"attachments": {"talker.py": TALKER}}}})["package"]
    (citation,) = show_lines(
        kind("it died", citations=(FileCitation(file="talker.py", **place),)), build
    ).citations
    assert isinstance(citation, FileCitation)
    return citation


def test_a_line_has_its_text() -> None:
    assert shown(line=2).source == "import rospy"


def test_pythons_carets_are_moved_by_the_indentation() -> None:
    found = shown(line=4, column=7, end_column=21, source="print('I heard ' + 5)")
    assert (found.column, found.end_column) == (11, 25)
    assert found.source[found.column - 1 : found.end_column - 1] == "'I heard ' + 5"


@pytest.mark.parametrize("place", [{"line": 1}, {"line": 3}, {"line": 5}, {"line": 99}, {}])
def test_what_stands_for_the_file_or_is_empty_or_long_has_none(place: dict[str, int]) -> None:
    assert shown(**place).source == ""


def test_a_pass_stays_as_it_is() -> None:
    assert shown(passed, line=2).source == ""
