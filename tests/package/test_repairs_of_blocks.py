"""Mistakes in the blocks of a script, in one table: their indentation, and lines that they cannot do without."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.python_repairs.syntax import make_readable
from tests.package.repairing import SCRIPT, TALKER, Case, check, swapped

pytestmark = pytest.mark.usefixtures("without_processes")

USAGE = "    if not topic:\n        print('no topic')\n        exit(1)\n"
SERVED = """\
try:
    ask = rospy.ServiceProxy('/ask', Int8)
    answer = ask(1)
    print(answer)
except rospy.ServiceException as e:
    print(e)
"""
FROM_ROSPY = (
    SCRIPT.replace("rospy.", "").replace("import rospy\n", "    from rospy import init_node, spin\n")
    + "spin()\n"
)

CASES = {
    "further-in-than-what-nothing-reaches": Case(
        swapped(TALKER, ("    rate = rospy", f"{USAGE}    a = 1\n        rate = rospy")), ["python-syntax"],
        "line 12 of src/talker.py: this line is indented further than the one above for no reason",
        after={TALKER: "    a = 1\n    rate = rospy"}),
    "further-out-in-a-try": Case(
        {TALKER: SCRIPT + SERVED.replace("    answer", "answer")}, ["python-syntax"],
        "line 16 of src/talker.py: this line is indented less than the lines around it",
        after={TALKER: "\n    answer = "}),
    "except-further-in": Case(
        {TALKER: SCRIPT + SERVED.replace("except", "    except")}, ["python-syntax"],
        "line 18 of src/talker.py: this line is indented too far", after={TALKER: "\nexcept rospy"}),
    "except-that-is-missing": Case(
        {TALKER: SCRIPT + SERVED.replace("except rospy.ServiceException as e:\n", "")}, ["python-syntax"],
        "the line `except rospy.ServiceException as e:` is missing", after={TALKER: SERVED}),
    "import-further-in": Case(
        {TALKER: FROM_ROSPY}, ["python-syntax"], "line 2 of src/talker.py: this line is indented further",
        after={TALKER: "\nfrom rospy import init_node, spin"}),
    "what-an-if-does-is-missing": Case(
        swapped(TALKER, ("        rate.sleep()", "        if a:\n        rate.sleep()")), ["python-syntax"],
        "line 12 of src/talker.py: this block needs a line of its own",
        after={TALKER: "        if a:\n            pass\n        rate.sleep()"}),
    "statement-that-is-misspelt": Case(
        swapped(TALKER, ("        rate.sleep()", "        if a:\n            contniue\n        rate.sleep()")),
        ["missing-call"], "line 12 of src/talker.py: contniue is not defined", after={TALKER: " continue\n"}),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_in_a_block_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)


@pytest.mark.parametrize("alone", ["break", "return 1", "raise a"])
def test_what_an_if_that_is_missing_asked_is_not_known(alone: str) -> None:
    wrong = SCRIPT.replace("        rate.sleep()", f"            {alone}\n        rate.sleep()")
    assert not list(make_readable(wrong))
    assert list(make_readable(wrong.replace(alone, "print(1)")))
