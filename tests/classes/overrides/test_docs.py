"""The examples of docs/how-to/deadlines.md are what the grader reads."""

from __future__ import annotations

import re
from pathlib import Path

from grader.classes.overrides import FILE, read_overrides
from grader.rubric.load import load_rubric
from grader.rubric.model import Late
from tests.classes.overrides.samples import IDS, rubric
from tests.rubric.samples import spoiled

PAGE = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "deadlines.md"
DEADLINE, OVERRIDES = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_the_deadline_and_the_policy(tmp_path):
    found = load_rubric(str(spoiled(tmp_path, ("package: lab1\n", f"package: lab1\n{DEADLINE}")))).rubric
    assert found.late == Late(lost=10, grace_minutes=15, cap=50, cut_off_days=7)
    assert set(Late.model_fields) == {line.split(":")[0].strip() for line in DEADLINE.splitlines()[2:]}


def test_the_overrides(tmp_path):
    (tmp_path / FILE).write_text(OVERRIDES, encoding="utf-8")
    assert set(read_overrides(tmp_path / FILE, rubric(), IDS)["alice"]) == {"style", "chatter-rate"}
