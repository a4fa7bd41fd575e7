"""The lines that a verdict cites, with those around them."""

from __future__ import annotations

import pytest

from grader.model.figure import CodeFigure
from grader.model.verdict import EvidenceCitation, FileCitation
from grader.report.figures.runs import FIGURES_MAX, LINES_MAX, code_figures
from tests.checks.examples import runs_of

TEXT = "".join(f"line {number}\n" for number in range(1, 201))


def code(text: str | bytes, *marks: int | None, file: str = "src/talker.py") -> list[CodeFigure]:
    runs = runs_of({})
    data = text if isinstance(text, bytes) else text.encode()
    build = runs["package"]
    object.__setattr__(build, "attachments", {"src/talker.py": data})
    return list(code_figures(build, [FileCitation(file=file, line=mark) for mark in marks]))


def test_three_lines_before_and_behind() -> None:
    (figure,) = code(TEXT, 100)
    assert figure.first_line == 97
    assert figure.lines == tuple(f"line {number}" for number in range(97, 104))
    assert figure.marked == (100,)


@pytest.mark.parametrize(("mark", "first", "count"), [(1, 1, 4), (2, 1, 5), (200, 197, 4)])
def test_at_the_ends_of_a_file(mark: int, first: int, count: int) -> None:
    (figure,) = code(TEXT, mark)
    assert (figure.first_line, len(figure.lines), figure.marked) == (first, count, (mark,))


def test_marks_near_each_other_are_one_figure() -> None:
    (figure,) = code(TEXT, 20, 12, 12, 10)
    assert figure.marked == (10, 12, 20)
    assert (figure.first_line, len(figure.lines)) == (7, 17)


def test_marks_far_apart_are_two() -> None:
    assert [f.marked for f in code(TEXT, 10, 150)] == [(10,), (150,)]


@pytest.mark.parametrize("mark", [None, 0, -3, 201])
def test_no_such_line(mark: int | None) -> None:
    assert code(TEXT, mark) == []


def test_files_that_were_not_kept_and_citations_of_messages() -> None:
    assert code(TEXT, 3, file="src/other.py") == []
    span = EvidenceCitation(evidence="talker.mcap", topic="/chatter")
    assert list(code_figures(runs_of({})["package"], [span])) == []


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_end_as_they_do_for_python(end: str) -> None:
    (figure,) = code(f"a{end}b\x0cb\u2028b{end}c{end}", 3)
    assert figure.lines == ("a", "b\x0cb\u2028b", "c")


@pytest.mark.parametrize(
    ("end", "shown"), [("\n", "#!/usr/bin/env python3"), ("\r\n", "#!/usr/bin/env python3\r")]
)
def test_a_shebang_has_its_carriage_return(end: str, shown: str) -> None:
    (figure,) = code(f"#!/usr/bin/env python3{end}import rospy{end}", 1)
    assert figure.lines == (shown, "import rospy")


def test_what_is_no_text_is_shown_all_the_same() -> None:
    (figure,) = code(b"\xef\xbb\xbf\xff\x00\nprint\n", 2)
    assert figure.lines == ("\ufffd\x00", "print")


def test_everything_is_bounded() -> None:
    figures = code(("x" * 10_000 + "\n") * 150, *range(1, 151))
    assert 1 < len(figures) <= FIGURES_MAX
    assert all(len(f.lines) <= LINES_MAX + 6 for f in figures)
    assert all(len(line) <= 300 for f in figures for line in f.lines)


def test_a_column_is_kept_where_its_line_is_shown() -> None:
    cited = [
        FileCitation(file="src/talker.py", line=2, column=3, source="line 2"),
        FileCitation(file="src/talker.py", line=3, column=10**6),
        FileCitation(file="src/talker.py", line=999, column=3),
    ]
    build = runs_of({})["package"]
    object.__setattr__(build, "attachments", {"src/talker.py": TEXT.encode()})
    (figure,) = code_figures(build, cited)
    assert figure.columns == {2: 3}
