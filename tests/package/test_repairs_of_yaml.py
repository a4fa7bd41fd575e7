"""Parameter files whose keys are in other levels than the lab asks for, or in lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.package.repairing import LEVELS, NESTED, Case, check

# fmt: off
CASES = {
    "keys-that-are-flat": Case(
        {"config/my.yaml": "# mine\nx: 1  # one\na_b_y: [2]\nz: 'three'\n"}, ["parameter-name"],
        "config/my.yaml: write the keys in levels,", NESTED,
        {"config/my.yaml": "# mine\na:\n  b:\n    x: 1  # one\n    y: [2]\n  c:\n    z: 'three'\n"},
    ),
    "keys-one-level-down": Case(
        {"config/my.yaml": "a:\n  x: 1\n  y: 2\n  z: 3\n"}, ["parameter-name"], "a/x should be a/b/x", NESTED,
        {"config/my.yaml": LEVELS.replace("\n  y", "\n    y")},
    ),
    "flat-keys-beside-others": Case({"config/my.yaml": "x: 1\ny: 2\nz: 3\nq: 4\n"}, [], wanted=NESTED),
    "one-flat-key-for-two-names": Case({"config/my.yaml": "x: 1\ny: 2\n"}, [], wanted=NESTED),
    "levels-of-lists": Case(
        {"config/my.yaml": "a:\n- b:\n  - x: 1\n  - y: 2\n- c:\n  - z: 3\n"}, ["parameter-name"],
        "config/my.yaml: start lines 2 to 6 with a space in place of the `-`", NESTED,
        {"config/my.yaml": "a:\n  b:\n    x: 1\n    y: 2\n  c:\n    z: 3\n"},
    ),
    "inner-lists-of-one-entry-each": Case(
        {"config/my.yaml": "a:\n  b:\n    - x: 1\n      y: 2\n  c:\n    - z: 3\n"}, ["parameter-name"],
        "line 3 of config/my.yaml: the `-` makes a list, in which there is no a/b/x", NESTED,
        {"config/my.yaml": "a:\n  b:\n      x: 1\n      y: 2\n  c:\n      z: 3\n"},
    ),
    "list-of-other-things": Case(
        {"config/my.yaml": "a:\n  b:\n    x: 1\n    y: 2\n  c:\n    z: 3\nq:\n  - w: 1\n  - w: 2\n"}, [], wanted=NESTED
    ),
}
# fmt: on


@pytest.mark.parametrize("name", CASES)
def test_keys_are_written_in_the_levels_of_the_lab(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)
