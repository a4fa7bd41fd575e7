"""Mechanical repairs: each kind by an example, the inverse of mutation operators, and hostile files."""

from __future__ import annotations

import ast
import os
import shutil
import stat
from pathlib import Path
from textwrap import dedent

import pytest

from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.package_tree import Tree, read_tree, write_tree
from grader.authoring.mutation.solution import Solution
from grader.model.repair import BY_HAND, DEFAULT_SHARES, KINDS, advice_of
from grader.model.submission import chmod_hint
from grader.package.repairs import NotRepairable, Repair, Wanted, apply_repair, find_repairs, wanted_of
from grader.package.repairs.names import is_near, is_one_edit
from grader.rubric.find import rubric_ids
from grader.rubric.load import load_rubric
from tests.package.trees import facts_of, plain

SOLUTIONS = Path(__file__).parents[2] / "reference_solutions"
TURTLE = str(Path(__file__).parents[2] / "rubrics" / "examples" / "turtle-square.yaml")
LABS = (*rubric_ids(), TURTLE)
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


def test_a_correct_package_needs_no_repair(tmp_path: Path) -> None:
    folder = package(tmp_path)
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


# What is changed in the correct package, the kinds of repair that are found, and a part of the first one's words.
TALKER, CMAKELISTS, XML, LAUNCHED = FILES
CASES = {
    "crlf": ({TALKER: SCRIPT.replace("\n", "\r\n")}, ["line-ends"], "end as on Windows"),
    "bom": ({TALKER: b"\xef\xbb\xbf" + SCRIPT.encode()}, ["byte-order-mark"], "byte order mark"),
    "utf-16": ({TALKER: SCRIPT.encode("utf-16")}, ["encoding"], "saved as UTF-16"),
    "latin-1": ({TALKER: SCRIPT.replace("import rospy\n", "import rospy  # caf\u00e9\n").encode("latin-1")},
                ["encoding"], "not saved as UTF-8"),
    "no-shebang": (swapped(TALKER, ("#!/usr/bin/env python3\n", "")), ["shebang"], "cannot be started"),
    "shebang-blank": ({TALKER: "\n" + SCRIPT}, ["shebang"], "`#!` comes in line 2"),
    "tabs-of-8": (swapped(TALKER, ("        publisher.pub", "\tpublisher.pub")), ["python-syntax"], "tabs and spaces"),
    "body-not-indented": (
        swapped(TALKER, ("\nmain()", "\nif __name__ == '__main__':\nmain()")),
        ["python-syntax"],
        "the line after a `:` must be indented",
    ),
    "further-in": (swapped(TALKER, ("    rate = ", "       rate = ")), ["python-syntax"], "line 8 of src/talker.py: t"),
    "all-further-in": (
        {TALKER: "#!/usr/bin/env python3\n" + "".join(f" {line}\n" for line in SCRIPT.split("\n")[1:-1] if line)},
        ["python-syntax"],
        "line 2 of src/talker.py: this line is indented further than the one above",
    ),
    "further-out": (
        swapped(TALKER, ("        rate.sleep()", "       rate.sleep()")),
        ["python-syntax"],
        "line 11 of src/talker.py",
    ),
    "tabs-of-4": (swapped(TALKER, ("    rate = ", "\trate = ")), ["python-syntax"], "line 8 of src/talker.py: tabs"),
    "print": (swapped(TALKER, ("        rate.sleep()", "        print 'a', 1\n        rate.sleep()")),
              ["python-syntax"], "line 11 of src/talker.py: this is Python 2: `print`"),
    "colon": (swapped(TALKER, ("is_shutdown():", "is_shutdown()")), ["python-syntax"], "line 9"),
    "bracket": (swapped(TALKER, ("queue_size=10)", "queue_size=10")), ["python-syntax"], "never closed"),
    "quote": (swapped(TALKER, ("'talker')", "'talker)")), ["python-syntax"], "line 6 of src/talker.py: a quote"),
    "typographic": (swapped(TALKER, ("'talker'", "\u2018talker\u2019")), ["python-syntax"], "typographic quote"),
    "raw-input": (swapped(TALKER, ("    rospy.init", "    raw_input()\n    rospy.init")), ["python-syntax"], "raw_"),
    "sleep": (swapped(TALKER, ("rate.sleep()", "rate.sleep")), ["missing-call"], "rate.sleep is named but not called"),
    "main": (swapped(TALKER, ("\nmain()", "\nmain")), ["missing-call"], "line 13"),
    "guard": (swapped(TALKER, ("\nmain()", "\nif __name__ == '_main_':\n    main()")),
              ["missing-call"], "is never '_main_'"),
    "no-main": (swapped(TALKER, ("\nmain()", "")), ["missing-call"], "nothing calls main()"),
    "callback": (swapped(TALKER, ("    rate = ", "    rospy.Subscriber('a', Int8, on_a())\n    rate = "),
                         ("\nmain()", "\ndef on_a(msg):\n    pass\n\n\nmain()")),
                 ["missing-call"], "on_a() is called where the function itself is meant"),
    "module": (swapped(TALKER, ("from std_msgs.msg", "from std_msg.msg")), ["missing-import"],
               "not imported from std_msg"),
    "no-msg": (swapped(TALKER, ("from std_msgs.msg", "from std_msgs")), ["missing-import"],
               "not imported from std_msgs"),
    "class-imported": (swapped(TALKER, ("from std_msgs.msg import Int8", "import std_msgs.msg.Int8")),
                       ["missing-import"], "not imported from std_msgs.msg.Int8"),
    "braces": (swapped(TALKER, ("def main():", "def main() {"), ("\nmain()", "}\n\nmain()")), ["python-syntax"],
               "line 5 of src/talker.py: Python has no `{` and `}`"),
    "not": (swapped(TALKER, ("not rospy", "!rospy")), ["python-syntax"], "`and`, `or` and `not`"),
    "plus-plus": (swapped(TALKER, ("        rate.sleep()", "        n++;\n        rate.sleep();")), ["python-syntax"],
                  "line 11 of src/talker.py: Python has no `++`"),
    "indented-more": (swapped(TALKER, ("        rate.sleep()", "          rate.sleep()")), ["python-syntax"],
                      "indented further than the one above"),
    "terminal": (swapped(TALKER, ("import rospy\n", "$ chmod +x talker.py\nimport rospy\n")), ["python-syntax"],
                 "a command for the terminal"),
    "import": (swapped(TALKER, ("import Int8", "import String")), ["missing-import"], "talker.py uses Int8"),
    "no-rospy": (swapped(TALKER, ("import rospy\n", "")), ["missing-import"], "uses rospy"),
    "attribute": (swapped(TALKER, ("rospy.Publisher", "rospy.publisher")), ["missing-call"],
                  "there is no rospy.publisher"),
    "rospy-with-a-sign": (swapped(TALKER, ("rospy.init", "ros[y.init")), ["python-syntax"], "line 6 of src/talker.py"),
    "value-given": (swapped(TALKER, ("rospy.Rate(rospy.get_param('~rate', 10))", "rospy.rate=10")), ["missing-call"],
                    "rospy.Rate is given a value with `=`"),
    "global": (swapped(TALKER, ("        rate.sleep()", "        print(count)\n        global count"),
                       ("def main", "count = 0\ndef main")), ["python-syntax"], "`global count` stands below a line"),
    "global-outside": (swapped(TALKER, ("\nmain()", "\ncount = 0\nglobal count\nmain()")), ["python-syntax"],
                       "`global count` stands below a line that uses count"),
    "beside-a-global": (swapped(TALKER, ("def main():", "count = 0\ndef main():\n    global count"),
                                ("rate.sleep()", "rate.sleep")), ["missing-call"], "rate.sleep is named but not"),
    "include": (swapped("CMakeLists.txt", ("catkin_package()", "catkin_package(\n  INCLUDE_DIRS include\n)")),
                ["build-line"], "line 4 of CMakeLists.txt: catkin_package(…) names the folder include/"),
    "topic": (swapped(TALKER, ("numeric_chatter", "numeric_chater")), ["topic-name"], "should be /numeric_chatter"),
    "node": (swapped(TALKER, ("'talker'", "'Talker'")), ["node-name"], "the node Talker should be talker"),
    "param": (swapped(TALKER, ("'~rate'", "'~rat'")), ["parameter-name"], "the parameter ~rat should be /talker/rate"),
    "type": (swapped("launch/lab.launch", ("talker.py", "talker")), ["launch-type"], 'type="talker" should be'),
    "pkg": (swapped("launch/lab.launch", ('pkg="lab"', 'pkg="laab"')), ["package-name"], 'pkg="laab" should be'),
    "manifest-name": (swapped("package.xml", (">lab<", ">lab_<")), ["package-name"], "the package is called lab_"),
    "own-name": ({"package.xml": MANIFEST.replace(">lab<", ">mine<"), "CMakeLists.txt": CMAKE.replace("lab", "mine")},
                 ["package-name"], "the package is called mine, not lab"),
    "folder-launched": ({"package.xml": MANIFEST.replace(">lab<", ">our_lab<"),
                         "CMakeLists.txt": CMAKE.replace("lab", "our_lab")},
                        ["package-name"], "the package is called our_lab, not lab"),
    "no-buildtool": (swapped("package.xml", ("  <buildtool_depend>catkin</buildtool_depend>\n", "")),
                     ["manifest-line"], "does not name catkin"),
    "no-depend": (swapped("package.xml", ("  <depend>rospy</depend>\n", "")), ["manifest-line"], "does not name rospy"),
    "open-tag": (swapped("package.xml", ("x</description>", "x")), ["manifest-line"], "<description> is never closed"),
    "no-find": (swapped("CMakeLists.txt", ("find_package", "# find_package")), ["build-line"], "not call find_package"),
    "no-catkin-package": (swapped("CMakeLists.txt", ("catkin_package()\n", "")), ["build-line"], "catkin_package()"),
    "command": (swapped("CMakeLists.txt", ("catkin_package", "catkin_pakage")), ["build-line"], "no command catkin_p"),
    "project": (swapped("CMakeLists.txt", ("project(lab)", "project(xyz)")), ["build-line"], "project(xyz)"),
    "open-bracket": (swapped("CMakeLists.txt", ("catkin_package()", "catkin_package(")), ["build-line"], "is never"),
    "cmake-name": ({"CMakeLists.txt": None, "CMakelists.txt": CMAKE}, ["file-name"], "should be called CMakeLists.txt"),
    "script-name": ({TALKER: None, "src/talkr.py": SCRIPT}, ["file-name"], "should be called talker.py"),
    "no-suffix": ({TALKER: None, "src/talker": SCRIPT}, ["file-name"], "should be called talker.py"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    changes, kinds, words = CASES[name]
    folder = package(tmp_path, changes)
    for script in (folder / "src").iterdir():
        script.chmod(0o755)
    found = repair_all(folder)
    assert [repair.kind for repair in found] == kinds
    assert words in (found[0].message if found else "")
    assert all(repair.fix and not repair.message.endswith(".") for repair in found)
    assert find_repairs(folder, facts_of(folder), WANTED) == ()
    assert all(ast.parse(path.read_bytes()) for path in folder.rglob("*.py"))
    assert (folder / "src" / "talker.py").stat().st_mode & 0o777 == 0o755


INSTALL = """
catkin_install_python(
  PROGRAMS
    scripts/other.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
"""
INSTALLS = Wanted(package="lab", installed=("src/talker.py", "src/listener.py"))
INSTALLED = {
    "below-programs": (INSTALL, "CMakeLists.txt line 7: write src/listener.py src/talker.py after PROGRAMS"),
    "another-place": (
        INSTALL.replace("_BIN_", "_SHARE_"),
        "write catkin_install_python(PROGRAMS src/listener.py src/talker.py DESTINATION ${CATKIN_PACKAGE_BIN_DEST",
    ),
    "no-dollar": (
        INSTALL.replace("$", "").replace("scripts/other.py", "src/talker.py src/listener.py"),
        "CMakeLists.txt line 9: write DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION}",
    ),
    "misspelt": (
        INSTALL.replace("scripts/other.py", "src/talker src/listener"),
        "write src/listener.py for src/listener; CMakeLists.txt line 8: write src/talker.py for src/talker",
    ),
}


@pytest.mark.parametrize("name", INSTALLED)
def test_scripts_go_into_the_call_that_installs_programs(name: str, tmp_path: Path) -> None:
    """However many lines the call has, what is to be written is said whole, and other calls stay as they are."""
    call, words = INSTALLED[name]
    folder = package(
        tmp_path, {"CMakeLists.txt": CMAKE + call, "src/listener.py": SCRIPT, "scripts/other.py": SCRIPT}
    )
    found = repair_all(folder, INSTALLS)
    assert words in "; ".join(advice_of(one) for one in found)
    assert find_repairs(folder, facts_of(folder), INSTALLS) == ()
    text = (folder / "CMakeLists.txt").read_text()
    assert ("scripts/other.py" in call) == ("scripts/other.py" in text)
    assert ("_SHARE_" in call) == ("_SHARE_" in text)


def test_an_executable_bit_is_set_for_those_who_may_read(tmp_path: Path) -> None:
    folder = package(tmp_path)
    (folder / "src" / "talker.py").chmod(0o640)
    (found,) = repair_all(folder)
    assert (found.kind, found.message) == ("executable-bit", "src/talker.py is not executable")
    assert found.fix == chmod_hint("disk", "src/talker.py")
    assert stat.S_IMODE((folder / "src" / "talker.py").stat().st_mode) == 0o750


def test_repairs_combine_in_the_order_in_which_a_student_meets_them(tmp_path: Path) -> None:
    script = SCRIPT.replace("    rate = ", "\trate = ").replace("rate.sleep()", "rate.sleep; print 'x'")
    script = script.replace("numeric_chatter", "numeric_chater").replace("import Int8", "import String")
    changes = {TALKER: script.replace("\n", "\r\n"), **swapped("CMakeLists.txt", ("catkin_package()\n", ""))}
    folder = package(tmp_path, {**changes, **swapped("launch/lab.launch", ("talker.py", "talker"))})
    (folder / "src" / "talker.py").chmod(0o644)
    found = [repair.kind for repair in repair_all(folder)]
    assert found == [
        *("executable-bit", "line-ends", "python-syntax", "python-syntax", "build-line", "launch-type"),
        *("missing-import", "missing-call", "topic-name"),
    ]
    assert found == sorted(found, key=KINDS.index)
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


def test_line_ends_stay_where_they_do_no_harm(tmp_path: Path) -> None:
    folder = package(tmp_path, {"CMakeLists.txt": CMAKE.replace("(lab)", "(xyz)").replace("\n", "\r\n")})
    repair_all(folder)
    assert (folder / "CMakeLists.txt").read_bytes() == CMAKE.replace("\n", "\r\n").encode()


def test_a_new_name_goes_where_the_old_one_was_written(tmp_path: Path) -> None:
    changes = swapped("launch/lab.launch", ("talker.py", "talkr.py"))
    install = (
        CMAKE + "catkin_install_python(PROGRAMS src/talkr.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
    )
    folder = package(tmp_path, {**changes, TALKER: None, "src/talkr.py": SCRIPT, "CMakeLists.txt": install})
    (found,) = repair_all(folder)
    assert found.fix == (
        "git mv src/talkr.py src/talker.py, and write talker.py in CMakeLists.txt and launch/lab.launch"
    )
    assert "src/talker.py" in (folder / "CMakeLists.txt").read_text()
    assert (folder / "launch" / "lab.launch").read_text() == LAUNCH


def test_a_misspelt_key_is_repaired_where_it_is_written_and_where_it_is_read(tmp_path: Path) -> None:
    yaml = 'details:\n  Name: "Ada"\n'
    script = SCRIPT.replace("    rate = ", "    name = rospy.get_param('details')['Name']\n    rate = ")
    folder = package(tmp_path, {"config/my.yaml": yaml, TALKER: script})
    found = repair_all(folder, WANTED.model_copy(update={"files": ("config/my.yaml",)}))
    assert [repair.file for repair in found] == ["config/my.yaml", "src/talker.py"]
    assert (folder / "config" / "my.yaml").read_text() == 'details:\n  name: "Ada"\n'
    assert "['name']" in (folder / "src" / "talker.py").read_text()


def test_a_subscriber_that_ends_at_once_spins(tmp_path: Path) -> None:
    script = dedent("""\
        #!/usr/bin/env python3
        import rospy
        from std_msgs.msg import Int8

        def listen():
            rospy.init_node('talker')
            rospy.Subscriber('numeric_chatter', Int8, print)

        if __name__ == '__main__':
            listen()
        """)
    folder = package(tmp_path, {TALKER: script})
    (found,) = repair_all(folder)
    assert found.kind == "missing-call"
    assert (
        "    rospy.Subscriber('numeric_chatter', Int8, print)\n    rospy.spin()\n"
        in (folder / "src" / "talker.py").read_text()
    )


@pytest.mark.parametrize(
    "change",
    [
        ("rate.sleep()", "rate.sleep(0.5"),  # an argument of another kind is no slip of the keyboard
        ("'numeric_chatter'", "'numbers'"),
        ("'talker'", "'my_node'"),
        ("        publisher.publish(1)", "    publisher.publish(1)\n     x = 1"),
        ("import Int8", "import *"),
    ],
)
def test_logic_and_other_names_are_left_alone(change: tuple[str, str], tmp_path: Path) -> None:
    folder = package(tmp_path, swapped(TALKER, change))
    kinds = {repair.kind for repair in find_repairs(folder, facts_of(folder), WANTED)}
    assert kinds <= {"python-syntax"}
    assert not kinds or "(" in change[1]


def test_a_repair_whose_lines_are_gone_is_refused(tmp_path: Path) -> None:
    folder = package(tmp_path, swapped(TALKER, ("numeric_chatter", "numeric_chater")))
    (found,) = find_repairs(folder, facts_of(folder), WANTED)
    (folder / "src" / "talker.py").write_text("import rospy\n")
    with pytest.raises(NotRepairable, match="is not as it was"):
        apply_repair(folder, found)
    assert (folder / "src" / "talker.py").read_text() == "import rospy\n"


def test_every_kind_has_a_share_and_words() -> None:
    assert set(DEFAULT_SHARES) == set(BY_HAND) == set(KINDS)
    assert {DEFAULT_SHARES[kind] for kind in KINDS} == {0.5, 1.0}
    assert DEFAULT_SHARES["topic-name"] == DEFAULT_SHARES["line-ends"] == 1.0
    assert DEFAULT_SHARES["python-syntax"] == DEFAULT_SHARES["missing-call"] == 0.5


@pytest.mark.parametrize(
    ("one", "other", "near"),
    [
        ("numeric_chater", "numeric_chatter", True),
        ("chattre", "chatter", True),
        ("Chatter", "chatter", True),
        ("chatters", "/chatter", True),
        ("chatter", "chatter", False),
        ("char", "chatter", False),
        ("x", "y", False),
        ("talker", "walker", True),
        ("listener", "talker", False),
    ],
)
def test_names_are_near_by_one_letter(one: str, other: str, near: bool) -> None:
    assert is_near(one, other) is near


def test_one_edit_counts_a_swap_and_not_two_letters() -> None:
    assert is_one_edit("abc", "acb")
    assert is_one_edit("abc", "abcd")
    assert is_one_edit("", "a")
    assert not is_one_edit("abc", "abc")
    assert not is_one_edit("abcd", "badc")


# ---- rubrics and their reference solutions


def solution_of(lab: str) -> tuple[Tree, Wanted, str]:
    rubric = load_rubric(lab).rubric
    folder = next((SOLUTIONS / rubric.id).iterdir())
    return read_tree(folder), wanted_of(rubric), rubric.package


@pytest.mark.parametrize("lab", LABS, ids=lambda lab: Path(lab).stem)
def test_a_reference_solution_needs_no_repair(lab: str, tmp_path: Path) -> None:
    tree, wanted, name = solution_of(lab)
    write_tree(tree, tmp_path / name)
    assert find_repairs(tmp_path / name, facts_of(tmp_path / name, name), wanted) == ()


def test_a_rubric_names_what_is_wanted() -> None:
    wanted = wanted_of(load_rubric("leeds-comp3631-lab1").rubric)
    assert wanted.package == "lab1"
    assert wanted.scripts == ("src/numeric_talker.py", "src/numeric_listener.py")
    assert wanted.topics == ("/chatter", "/numeric_chatter")
    assert wanted.nodes == ("numeric_talker", "talker")
    assert wanted.launch_files == ("lab1.launch",)
    assert wanted.types == ("std_msgs/String", "std_msgs/Int8")
    assert wanted_of(load_rubric("mcr2-basic-comms").rubric).installed == (
        "scripts/talker.py",
        "scripts/listener.py",
    )
    avoid = load_rubric(str(Path(TURTLE).with_name("avoid-obstacles.yaml"))).rubric
    assert {"/scan", "/cmd_vel"} <= set(wanted_of(avoid).topics), "what the robot's world has counts too"
    assert "/details/contact/phone" in wanted_of(load_rubric("eyantra-ros-basics").rubric).params


SAME = (
    *(
        "bit-removed",
        "crlf",
        "byte-order-mark",
        "no-shebang",
        "shebang-typo",
        "shebang-commented",
        "shebang-python2",
    ),
    *(
        "launch-type-without-py",
        "launch-pkg-misspelt",
        "project-renamed",
        "no-find-package",
        "cmake-malformed",
    ),
    *("install-commented", "install-elsewhere", "manifest-renamed", "manifest-malformed", "topic-misspelt"),
    *(
        "topic-capital",
        "tabs-and-spaces",
        "typographic-quote",
        "no-break-space",
        "syntax-error",
        "yaml-key-misspelt",
    ),
    *("sleep-without-brackets", "parameter-misspelt", "parameter-set-elsewhere"),
)
"""Operators whose mistake is undone: the files are those of the correct package, but for space, quotes and shebangs."""
SOUND = (
    *("no-catkin-package", "install-dropped", "dependency-dropped", "buildtool-dropped", "private-topic"),
    "python2-print",
)
"""Those whose mistake is repaired in other words."""
FOREIGN = ("launch-type-without-py", "launch-pkg-misspelt")
"""Operators that also change the node of another package, of which this package knows nothing."""


def assert_repaired(operator: str, lab: str, folder: Path) -> int:
    tree, wanted, name = solution_of(lab)
    solution = Solution(tree=tree, folder="", name=name)
    repaired = 0
    for site in OPERATORS[operator].sites(solution):
        write_tree(site.tree, folder / name)
        found = repair_all(folder / name, wanted, name)
        unasked = site.at.get("dependency", name) not in (name, *wanted.dependencies)
        if not found and (unasked or operator in FOREIGN):
            continue
        assert found, f"{operator} at {site.at} is not found"
        now = read_tree(folder / name)
        assert {path: entry.executable for path, entry in now.items()} == {
            p: e.executable for p, e in tree.items()
        }
        if operator in SAME:
            assert {p: plain(p, e.data) for p, e in now.items()} == {
                p: plain(p, e.data) for p, e in tree.items()
            }
        assert find_repairs(folder / name, facts_of(folder / name, name), wanted) == ()
        repaired += 1
        shutil.rmtree(folder / name)
    return repaired


@pytest.mark.slow
@pytest.mark.full
@pytest.mark.parametrize("lab", LABS, ids=lambda lab: Path(lab).stem)
@pytest.mark.parametrize("operator", [*SAME, *SOUND])
def test_a_repair_is_the_inverse_of_the_operator(operator: str, lab: str, tmp_path: Path) -> None:
    assert assert_repaired(operator, lab, tmp_path) >= 0


@pytest.mark.parametrize("operator", ["topic-misspelt", "python2-print", "install-dropped"])
def test_a_few_operators_are_undone(operator: str, tmp_path: Path) -> None:
    assert assert_repaired(operator, "mcr2-basic-comms", tmp_path) > 0


# ---- hostile files


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "secret.py").write_text(SCRIPT.replace("numeric_chatter", "numeric_chater"))
    (folder / "secret.py").chmod(0o644)
    return folder


def snapshot(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {p.name: (p.stat().st_mode, p.read_bytes()) for p in folder.rglob("*") if p.is_file()}


def misspelt(file: str = "src/talker.py") -> Repair:
    line = "    publisher = rospy.Publisher('numeric_chater', Int8, queue_size=10)"
    after = line.replace("chater", "chatter")
    return Repair(kind="topic-name", file=file, line=7, before=line, after=after, message="x", fix="x")


def test_a_link_in_place_of_the_script_is_not_followed(tmp_path: Path, outside: Path) -> None:
    before = snapshot(outside)
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").mkdir()
    (folder / "src" / "talker.py").symlink_to(outside / "secret.py")
    assert [r for r in find_repairs(folder, facts_of(folder), WANTED) if r.file == TALKER] == []
    bit = Repair(kind="executable-bit", file=TALKER, message="x", fix="x")
    for repair in (bit, misspelt()):
        with pytest.raises((OSError, NotRepairable)):
            apply_repair(folder, repair)
    assert snapshot(outside) == before
    assert (folder / "src" / "talker.py").is_symlink()


def test_a_linked_folder_is_not_entered(tmp_path: Path, outside: Path) -> None:
    before = snapshot(outside)
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").symlink_to(outside)
    for file in ("src/secret.py", "../outside/secret.py", str(outside / "secret.py")):
        with pytest.raises((OSError, NotRepairable)):
            apply_repair(folder, misspelt(file))
    assert snapshot(outside) == before


def test_windows_opens_nothing_relative_to_a_folder(tmp_path: Path, outside: Path, monkeypatch) -> None:
    monkeypatch.setattr("grader.package.repairs.editing.HAS_DIR_FD", False)
    before = snapshot(outside)
    changed = SCRIPT.replace("numeric_chatter", "numeric_chater")
    folder = package(tmp_path, {TALKER: None, "src/talkr.py": changed})
    assert [repair.kind for repair in repair_all(folder)] == ["file-name", "topic-name"]
    assert (folder / "src" / "talker.py").read_text() == SCRIPT
    (folder / "scripts").symlink_to(outside)
    with pytest.raises((OSError, NotRepairable)):
        apply_repair(folder, misspelt("scripts/secret.py"))
    assert snapshot(outside) == before


def test_a_script_with_a_name_elsewhere_changes_here_alone(tmp_path: Path, outside: Path) -> None:
    before = snapshot(outside)
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").mkdir()
    os.link(outside / "secret.py", folder / "src" / "talker.py")
    assert [repair.kind for repair in repair_all(folder)] == ["executable-bit", "topic-name"]
    assert snapshot(outside) == before
    assert (folder / "src" / "talker.py").read_text() == SCRIPT


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").mkdir()
    os.mkfifo(folder / "src" / "talker.py")
    assert [r for r in find_repairs(folder, facts_of(folder), WANTED) if r.file == TALKER] == []
    for repair in (misspelt(), Repair(kind="executable-bit", file=TALKER, message="x", fix="x")):
        with pytest.raises((OSError, NotRepairable)):
            apply_repair(folder, repair)


def test_a_huge_file_is_left_as_it_is_but_for_its_bit(tmp_path: Path) -> None:
    folder = package(tmp_path)
    script = folder / "src" / "talker.py"
    with script.open("r+b") as file:
        file.truncate(100_000_000)
    script.chmod(0o644)
    assert [repair.kind for repair in repair_all(folder)] == ["executable-bit"]
    assert script.stat().st_size == 100_000_000
    with pytest.raises(NotRepairable):
        apply_repair(folder, misspelt())


def test_a_name_with_a_newline_is_a_name(tmp_path: Path) -> None:
    file = "src/a\nb/talker.py"
    folder = package(tmp_path, {TALKER: None, file: SCRIPT.replace("numeric_chatter", "numeric_chater")})
    (found,) = repair_all(folder)
    assert found.file == file
    assert (folder / file).read_text() == SCRIPT


@pytest.mark.parametrize(
    "source",
    ["(" * 50_000, "x = " + "-" * 60_000 + "1", "def f():\n" + "".join(" " * i + "if 1:\n" for i in range(1, 200)),
     "print 'a'\n" * 3_000, "'" * 60_001, "\x0c\x0b\x1c x = 1\n", "x = '\\ud800'\nprint x\n", "\u2028print 'a'\n"],
    ids=["brackets", "signs", "indents", "prints", "quotes", "feeds", "surrogate", "separator"],
)  # fmt: skip
def test_a_hostile_source_costs_its_own_repairs(source: str, tmp_path: Path) -> None:
    launch = '<launch>\n  <node pkg="lab" type="evil.py" name="evil"/>\n</launch>\n'
    wrong = swapped(TALKER, ("numeric_chatter", "numeric_chater"))
    folder = package(
        tmp_path, {**wrong, "src/evil.py": f"#!/usr/bin/env python3\n{source}", "launch/e.launch": launch}
    )
    found = [repair for repair in repair_all(folder) if repair.file == TALKER]
    assert [repair.kind for repair in found] == ["topic-name"]
    assert (folder / "src" / "talker.py").read_text() == SCRIPT


@pytest.mark.parametrize(
    ("launch", "renamed"),
    [
        (LAUNCH, True),
        (LAUNCH.replace("talker.py", "talker"), True),
        (LAUNCH.replace("talker.py", "signals.py"), False),
    ],
)
def test_a_launch_file_under_another_name_is_meant_by_what_it_starts(
    tmp_path: Path, launch: str, renamed: bool
) -> None:
    folder = package(tmp_path, {"launch/lab.launch": None, "src/trial.launch": launch})
    asked = {"launch_files": ("activity1.launch",), "started": (("activity1.launch", "talker.py"),)}
    found = find_repairs(folder, facts_of(folder), WANTED.model_copy(update=asked))
    assert [one.after for one in found if one.kind == "file-name"] == ["src/activity1.launch"] * renamed


def test_which_of_two_launch_files_is_meant_is_not_known(tmp_path: Path) -> None:
    folder = package(tmp_path, {"launch/first.launch": LAUNCH})
    asked = {"launch_files": ("activity1.launch",), "started": (("activity1.launch", "talker.py"),)}
    assert find_repairs(folder, facts_of(folder), WANTED.model_copy(update=asked)) == ()


@pytest.mark.parametrize(
    ("yaml", "repaired"),
    [
        ("a:\n  b:\n    x: 1\n  y: 2\n  c:\n    z: 3\n", "a:\n  b:\n    x: 1\n    y: 2\n  c:\n    z: 3\n"),
        ("a:\n  b:\n    x: 1\n  c:\n    z: 3\n  y: 2\n", ""),
        ("a:\n  b:\n    x: 1\n    y: 2\n  c:\n    z: 3\n", ""),
    ],
)
def test_a_key_that_stands_one_level_too_far_left_is_moved(tmp_path: Path, yaml: str, repaired: str) -> None:
    folder = package(tmp_path, {"config/my.yaml": yaml})
    asked = {"files": ("config/my.yaml",), "params": ("/a/b/x", "/a/b/y", "/a/c/z")}
    found = repair_all(folder, WANTED.model_copy(update=asked))
    assert [one.kind for one in found] == ["parameter-name"] * bool(repaired)
    assert (folder / "config" / "my.yaml").read_text() == (repaired or yaml)


def test_a_renamed_launch_file_is_repaired_further(tmp_path: Path) -> None:
    """By its old path, and a package's wrong name is one repair however often it stands in the file."""
    nodes = LAUNCH.replace("</launch>", LAUNCH.splitlines()[1].replace("talker", "listener") + "\n</launch>")
    wrong: dict[str, str | bytes | None] = {
        "launch/lab.launch": None,
        "launch/la_b.launch": nodes.replace('pkg="lab"', 'pkg="laab"'),
    }
    folder = package(tmp_path, wrong)
    found = repair_all(folder, WANTED.model_copy(update={"launch_files": ("lab.launch",)}))
    assert [one.kind for one in found] == ["file-name", "package-name"]
    assert found[1].fix == 'write pkg="lab" for pkg="laab"'
    assert (folder / "launch" / "lab.launch").read_text() == nodes
