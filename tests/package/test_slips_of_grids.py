"""Rows of grids: script_grids.py."""

from pathlib import Path

import pytest

from grader.package.python import check_syntax

pytestmark = pytest.mark.usefixtures("without_processes")


ROWS = {
    "rows = [[0] * width] * height": ("shared", "write `[[0] * width for _ in range(height)]`"),
    "rows = [[]] * 3": ("shared", "write `[[] for _ in range(3)]`"),
    "rows = [[0 for _ in range(height)] for _ in range(width)]": ("rows", "swap `height` and `width`: "),
    "rows = [[0] * self.height for _ in range(self.width)]": (
        "rows",
        "swap `self.height` and `self.width`: ",
    ),
    "rows = [[0] * width for _ in range(height)]": None,
    "rows = [0] * (width * height)": None,
    "rows = [[0 for _ in range(n)] for _ in range(width)]": None,
    "rows = ['a'] * 3": None,
}


@pytest.mark.parametrize("line", ROWS)
def test_rows_of_a_grid(line: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(f"{line}\n", encoding="utf-8")
    slips = [s for s in check_syntax(tmp_path, ["a.py"]).slips if s.kind == "wrong-value"]
    name, fix = ROWS[line] or ("", "")
    assert [(s.name, s.fix.partition(", ")[2].startswith(fix)) for s in slips] == (
        [(name, True)] if fix else []
    )
