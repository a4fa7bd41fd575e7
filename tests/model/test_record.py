"""Records are changed by copies, and only in fields that they have."""

from __future__ import annotations

import pytest

from grader.model.verdict import FileCitation


def test_a_copy_has_the_changed_field() -> None:
    cited = FileCitation(file="src/talker.py", line=3)
    assert cited.model_copy(update={"line": 4}) == FileCitation(file="src/talker.py", line=4)


def test_a_misspelt_field_of_a_copy_is_refused() -> None:
    cited = FileCitation(file="src/talker.py", line=3)
    with pytest.raises(TypeError, match="FileCitation has no field lines, path"):
        cited.model_copy(update={"lines": 4, "path": "src/listener.py"})
