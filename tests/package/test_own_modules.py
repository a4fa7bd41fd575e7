"""Nodes whose parts lie in several files of the package: what one file lacks, another one may do."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.repairs import find_repairs
from tests.package.repairing import SCRIPT, TALKER, WANTED, facts_of, package

pytestmark = pytest.mark.usefixtures("without_processes")

LOOP = "rate = rospy.Rate(10)\nwhile not rospy.is_shutdown():\n    {}\n    rate.sleep()\n"
MADE = "rospy.Publisher('numeric_chatter', Int8, queue_size=10)"
HEAD = "import rospy\nfrom std_msgs.msg import Int8\n"
START = "#!/usr/bin/env python3\nimport rospy\n"
INIT = "rospy.init_node('talker')\n"
BASE = f"{HEAD}\nclass Base:\n    def __init__(self):\n        {INIT}        self.pub = {MADE}\n"
PACKAGES = {
    "functions-of-a-module": {
        TALKER: f"{START}from lab.helper import make, run\n\n{INIT}run(make())\n",
        "src/lab/helper.py": f"{HEAD}\ndef make():\n    return {MADE}\n\n\ndef run(pub):\n"
        "    while not rospy.is_shutdown():\n        pub.publish(1)\n        rospy.sleep(1)\n",
    },
    "a-script-that-calls-main": {
        TALKER: "#!/usr/bin/env python3\nimport helper\nhelper.main()\n",
        "src/helper.py": SCRIPT.removesuffix("main()\n"),
    },
    "a-publisher-of-a-module": {
        TALKER: f"{START}from pubs import PUB\n\n{INIT}{LOOP.format('PUB.publish(1)')}",
        "src/pubs.py": f"{HEAD}\nPUB = {MADE}\n",
    },
    "a-class-of-a-module": {
        TALKER: "#!/usr/bin/env python3\nfrom node import Base\n\n\nclass Talker(Base):\n    def step(self):\n"
        "        self.pub.publish(1)\n\n\nTalker().run()\n",
        "src/node.py": f"{BASE}\n    def run(self):\n        while not rospy.is_shutdown():\n            self.step()\n"
        "            rospy.sleep(1)\n",
    },
    "a-module-that-fills-another": {
        TALKER: f"{START}import config\nimport setup\n\n{INIT}setup.make()\n{LOOP.format('config.pub.publish(1)')}",
        "src/config.py": "pub = None\n",
        "src/setup.py": f"{HEAD}import config\n\n\ndef make():\n    config.pub = {MADE}\n",
    },
}
ALONE = {"no-init", "never-called", "never-published", "object"}


@pytest.mark.parametrize("name", PACKAGES)
def test_what_another_file_does_is_no_slip(name: str, tmp_path: Path) -> None:
    folder = package(tmp_path, {"src/lab/__init__.py": "", **PACKAGES[name]})
    facts = facts_of(folder)
    assert [(one.kind, one.message) for one in facts.slips if one.kind in ALONE] == []
    assert find_repairs(folder, facts, WANTED) == ()


def test_what_no_file_does_is_one(tmp_path: Path) -> None:
    module = f"{HEAD}\nPUB = {MADE}\nOTHER = {MADE}\n\n\ndef run():\n    PUB.publish(1)\n"
    files = {TALKER: f"{START}import pubs\n\npubs.PUB.publish(1)\nrospy.spin()\n", "src/pubs.py": module}
    facts = facts_of(package(tmp_path, files))
    found = [(one.file, one.kind) for one in facts.slips if one.kind in ALONE]
    of_pubs = [("src/pubs.py", "never-published"), ("src/pubs.py", "never-called")]
    assert found == [*of_pubs, (TALKER, "no-init")]


def test_which_own_files_a_script_imports(tmp_path: Path) -> None:
    """A spare file beside them is not one."""
    files = {
        TALKER: f"{START}from lab.helper import make\n{INIT}",
        "src/lab/helper.py": "import numbers\nfrom .numbers import one\n",
        "src/lab/numbers.py": "one = 1\n",
        "src/old.py": "import rospy\n",
    }
    facts = facts_of(package(tmp_path, files))
    assert {one.path: one.imports for one in facts.files if one.imports} == {
        TALKER: ("src/lab/helper.py",),
        "src/lab/helper.py": ("src/lab/numbers.py",),
    }
