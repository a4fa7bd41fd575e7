"""A small correct package whose files a test replaces, and what a lab asks of it: for tests of repairs."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from pathlib import Path

from grader.model.repair import advice_on
from grader.package.repairs import Repair, Wanted, apply_repair, find_repairs
from tests.package.trees import facts_of

WANTED = Wanted(
    package="lab",
    scripts=("src/talker.py",),
    topics=("/numeric_chatter",),
    nodes=("talker",),
    params=("/details/name", "/talker/rate"),
    types=("std_msgs/Int8",),
    dependencies=("rospy",),
)
SCRIPT = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8

def main():
    rospy.init_node('talker')
    publisher = rospy.Publisher('numeric_chatter', Int8, queue_size=10)
    rate = rospy.Rate(rospy.get_param('~rate', 10))
    while not rospy.is_shutdown():
        publisher.publish(1)
        rate.sleep()

main()
"""
SPINS = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8

def listen():
    rospy.init_node('talker')
    rospy.Subscriber('numeric_chatter', Int8, print)

if __name__ == '__main__':
    listen()
"""
MANIFEST = """\
<package format="2">
  <name>lab</name>
  <version>0.0.0</version>
  <description>x</description>
  <maintainer email="a@b.org">a</maintainer>
  <license>MIT</license>
  <buildtool_depend>catkin</buildtool_depend>
  <depend>rospy</depend>
</package>
"""
CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project(lab)
find_package(catkin REQUIRED COMPONENTS rospy)
catkin_package()
"""
LAUNCH = '<launch>\n  <node pkg="lab" type="talker.py" name="talker"/>\n</launch>\n'
FILES = {
    "src/talker.py": SCRIPT,
    "package.xml": MANIFEST,
    "CMakeLists.txt": CMAKE,
    "launch/lab.launch": LAUNCH,
}
TALKER, XML, CMAKELISTS, LAUNCHED = FILES
OWN = {"msg/Level.msg": "float64 level\n", "src/level.py": "from lab.msg import Level\n"}
OWN_CMAKE = CMAKE.replace("rospy)\n", "message_generation rospy)\nadd_message_files(FILES Level.msg)\n")
RUN_OWN = {**OWN, TALKER: SCRIPT.replace("import Int8\n", "import Int8\nfrom lab.msg import Level\n")}


def package(folder: Path, changes: dict[str, str | bytes | None] | None = None) -> Path:
    """The correct package, with some files replaced or, for None, left out."""
    for name, content in {**FILES, **(changes or {})}.items():
        if content is not None:
            path = folder / "lab" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
            path.chmod(0o755 if name.endswith(".py") else 0o644)
    return folder / "lab"


def repair_all(folder: Path, wanted: Wanted = WANTED, name: str = "lab") -> tuple[Repair, ...]:
    found = find_repairs(folder, facts_of(folder, name), wanted)
    for repair in found:
        apply_repair(folder, repair)
    return found


def swapped(name: str, *pairs: tuple[str, str]) -> dict[str, str | bytes | None]:
    text = FILES[name]
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return {name: text}


def asking(**more: object) -> Wanted:
    """Return what is wanted of the correct package, and more."""
    return WANTED.model_copy(update=more)


LEVELS = "a:\n  b:\n    x: 1\n  y: 2\n  c:\n    z: 3\n"
NESTED = asking(files=("config/my.yaml",), params=("/a/b/x", "/a/b/y", "/a/c/z"))


@dataclass(frozen=True)
class Case:
    """`changes` to the correct package, the kinds of repair found, a part of their words, and of the repaired files."""

    changes: dict[str, str | bytes | None]
    kinds: list[str]
    says: str = ""
    wanted: Wanted = WANTED
    after: dict[str, str] = field(default_factory=dict)


def check(case: Case, tmp_path: Path) -> None:
    """The mistake is found, and what is repaired has none."""
    folder = package(tmp_path, case.changes)
    for script in (folder / "src").iterdir():
        script.chmod(0o755)
    found = repair_all(folder, case.wanted)
    assert [repair.kind for repair in found] == case.kinds
    said = [*(one.message for one in found), "; ".join(part for one in found for part in advice_on([one]))]
    assert case.says in "\n".join(said)
    assert all(repair.fix and not repair.message.endswith(".") for repair in found)
    assert find_repairs(folder, facts_of(folder), case.wanted) == ()
    assert all(ast.parse(path.read_bytes()) for path in folder.rglob("*.py"))
    assert (folder / TALKER).stat().st_mode & 0o777 == 0o755
    for path, part in case.after.items():
        assert part.encode() in (folder / path).read_bytes()
