"""A sound rubric as text, and ways to spoil it."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.errors import RubricError
from grader.rubric.load import load_rubric

SOUND = """\
schema: grader.rubric/1
id: sample
title: A sample
version: "1"
package: lab1
scenarios:
  real:
    title: The talker in real time
    start:
      - {name: talker, script: src/talker.py}
    until: {window_s: 5, topics: [/chatter]}
criteria:
  - id: talker-node
    title: The talker runs
    points: 40
    check: rate
    with: {topic: /chatter, rate_hz: 10}
    scenario: real
  - id: chatter-rate
    title: 10 Hz
    points: 60
    check: rate
    with:
      topic: /chatter
      rate_hz: 10
    scenario: real
    requires: [talker-node]
"""


def spoiled(folder: Path, *changes: tuple[str, str]) -> Path:
    """The sound rubric as a file, each change made once."""
    text = SOUND
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "lab.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def faults(path: Path) -> list[str]:
    """The faults of a file, without the folder that it lies in."""
    with pytest.raises(RubricError) as caught:
        load_rubric(str(path))
    assert all("pydantic" not in fault and "\n" not in fault for fault in caught.value.faults)
    return [fault.replace(f"{path.parent}/", "") for fault in caught.value.faults]
