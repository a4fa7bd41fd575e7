"""Parameter files whose keys are in other levels than the lab asks for, or in lists, and into what they are loaded."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.package.repairing import LAUNCHED, LEVELS, NESTED, TALKER, Case, asking, check, swapped

pytestmark = pytest.mark.usefixtures("without_processes")

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


RIGHT = LEVELS.replace("\n  y", "\n    y")
OF_ARM = asking(files=("config/my.yaml",), params=("/arm/b/x", "/arm/b/y", "/arm/c/z"))
BELOW_A = "b:\n  x: 1\n  y: 2\nc:\n  z: 3\n"


def loaded(namespace: str, names: str, node: str = "") -> dict[str, str | bytes]:
    load = f'  <rosparam file="$(find lab)/config/my.yaml" {namespace}/>\n</launch>'
    changed = swapped(LAUNCHED, ("</launch>", load), ("<node ", f"<node {node}"))
    return {"config/my.yaml": names, **changed}


@pytest.mark.parametrize(
    "case",
    [
        Case(
            loaded('ns="/robot"', RIGHT),
            ["parameter-name"],
            'line 3: delete ns="/robot"',
            wanted=NESTED,
            after={LAUNCHED: '<rosparam file="$(find lab)/config/my.yaml"/>'},
        ),
        Case(
            loaded('ns="arms"', BELOW_A),
            ["parameter-name"],
            'ns="arms" should be ns="/arm"',
            wanted=OF_ARM,
            after={LAUNCHED: 'my.yaml" ns="/arm"/>'},
        ),
        Case(loaded('ns="a"', BELOW_A), [], wanted=NESTED),
        Case(
            {**loaded('ns="robot"', RIGHT), **swapped(TALKER, ("'~rate'", "'/robot/a/b/x'"))},
            [],
            wanted=NESTED,
        ),
        Case(loaded('ns="robot"', RIGHT, node='ns="robot" '), [], wanted=NESTED),
        Case(loaded('ns="robot"', "speed: 3\n"), [], wanted=NESTED),
        Case(loaded('ns="$(arg side)"', RIGHT), [], wanted=NESTED),
        Case(
            loaded('ns="/robot"', RIGHT), [], wanted=NESTED.model_copy(update={"nodes": ("/robot/talker",)})
        ),
    ],
    ids=[
        *("too-much", "misspelt", "right", "read-there", "of-the-node-too", "other-names", "of-an-argument"),
        "of-a-node-of-the-lab",
    ],
)
def test_a_namespace_of_loaded_parameters(case: Case, tmp_path: Path) -> None:
    check(case, tmp_path)
