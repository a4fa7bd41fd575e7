"""Lines that stand in the wrong place: above what they need, or outside of the function that they belong to."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.package.repairing import WANTED, package, repair_all

pytestmark = pytest.mark.usefixtures("without_processes")

FILE = "src/talker.py"
HEAD = "#!/usr/bin/env python3\nimport rospy\nfrom std_msgs.msg import String\n"
NODE = "rospy.init_node('talker')\n"
SUBSCRIBED = "rospy.Subscriber('chatter', String, callback)\n"
CALLBACK = "def callback(msg):\n    print(msg.data)\n"
SPIN = "rospy.spin()\n"
GUARDED = f"if __name__ == '__main__':\n    {NODE}    {SUBSCRIBED}    {SPIN}"
MAIN = f"def main():\n    {NODE}    {SUBSCRIBED}    {SPIN}"
TALK = "def talk():\n    pub = rospy.Publisher('chatter', String, queue_size=1)\n"
LOOP = "rate = rospy.Rate(1)\nwhile not rospy.is_shutdown():\n    pub.publish('a')\n    rate.sleep()\n"


def repaired(code: str, tmp_path: Path) -> tuple[list[str], str]:
    """Return how a script is repaired, and what it is then."""
    folder = package(tmp_path, {FILE: HEAD + code})
    fixes = [one.fix for one in repair_all(folder, WANTED)]
    return fixes, (folder / FILE).read_text().removeprefix(HEAD)


@pytest.mark.parametrize(
    ("code", "fix", "after"),
    [
        (NODE + SUBSCRIBED + CALLBACK + SPIN, "move lines 6 to 7 above line 5", NODE + CALLBACK + SUBSCRIBED + SPIN),
        (GUARDED + CALLBACK, "move lines 4 to 7 below line 9", f"{CALLBACK}\n\n{GUARDED}"),
        (f"{MAIN}main()\n{CALLBACK}", "move line 8 below line 10", f"{MAIN}{CALLBACK}\n\nmain()\n"),
        (NODE + "a = [callback]\n" + CALLBACK + SPIN, "move lines 6 to 7 above line 5", None),
    ],
)  # fmt: skip
def test_what_is_defined_below_a_line_that_needs_it(
    code: str, fix: str, after: str | None, tmp_path: Path
) -> None:
    fixes, text = repaired(code, tmp_path)
    assert fixes == [fix]
    assert after is None or text == after


@pytest.mark.parametrize(
    "code",
    [
        f"{MAIN}{CALLBACK}main()\n",
        f"{NODE}rospy.on_shutdown(lambda: callback(1))\n{CALLBACK}{SUBSCRIBED}{SPIN}",
        f"callback = print\n{NODE}{SUBSCRIBED}{CALLBACK}{SPIN}",
    ],
)
def test_what_is_only_needed_later_stays_where_it_is(code: str, tmp_path: Path) -> None:
    assert repaired(code, tmp_path) == ([], code)


def test_a_loop_outside_of_its_function(tmp_path: Path) -> None:
    """With blank lines and others between, and `init_node` among these."""
    call = "if __name__ == '__main__':\n    talk()\n"
    fixes, text = repaired(f"{TALK}\n# the node\n{NODE}\n{LOOP}\n{call}", tmp_path)
    assert fixes == [
        "change the indentation: start lines 8 to 11 with 4 spaces and lines 12 and 13 with 8 spaces"
    ]
    inside = "".join(f"    {line}\n" for line in f"{NODE}\n{LOOP}".splitlines()).replace("    \n", "\n")
    assert text == f"{TALK}\n# the node\n{inside}\n{call}"


def test_a_loop_that_reads_what_a_callback_has_is_no_part_of_it(tmp_path: Path) -> None:
    code = f"def callback(msg):\n    pub = msg\n{NODE}{LOOP}"
    fixes, _ = repaired(code, tmp_path)
    assert not any("indentation" in one for one in fixes)
