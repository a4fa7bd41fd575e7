"""Mistakes in the blocks of a script, in one table: their indentation, and lines that they cannot do without."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from grader.package.python_repairs.syntax import make_readable
from tests.package.repairing import SCRIPT, TALKER, Case, check, package, repair_all, swapped

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
TICKER = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8


class Ticker(object):
    \'\'\'Counts.\'\'\'

    def __init__(self, first):
        self.count = first
        self.pub = rospy.Publisher('numeric_chatter', Int8, queue_size=10)
        rospy.Timer(rospy.Duration(0.1), self.tick)

    def tick(self, event):
        self.pub.publish(self.count)
        self.count = (self.count + 1) % 128

    def run(self):
        rospy.spin()


def main():
    rospy.init_node('talker')
    Ticker(0)
    ticker = Ticker(0)
    ticker.run()


main()
"""
DOCSTRING = "    '''Counts.'''\n\n"
LOST = [line for line in TICKER.split("\n") if line.strip().startswith(("def", "class"))]
FORGOTTEN = TICKER.replace(
    "    def tick(self, event):\n", "    def run_on(self):\n        rate = rospy.Rate(10)\n\n"
)
OTHERS = "get_param, is_shutdown, Publisher, Rate"

LISTENER_CLASS = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8


class Echo:
    def __init__(self):
        self.last = 0
        rospy.Subscriber('numeric_chatter', Int8, self.heard)

    def heard(self, message):
        self.last = message.data
        rospy.loginfo(self.last)


if __name__ == '__main__':
    rospy.init_node('talker')
    Echo()
    rospy.spin()
"""

TWICE = ["python-syntax", "python-syntax"]

CASES = {
    "def-further-in-and-a-later-line": Case(
        {TALKER: LISTENER_CLASS.replace("    def __init__", "        def __init__").replace("    Echo", "      Echo")},
        ["python-syntax"], "line 7 of src/talker.py", after={TALKER: "\n    Echo()\n"}),
    "def-further-in-and-a-bracket": Case(
        {TALKER: LISTENER_CLASS.replace("    def heard", "       def heard").replace("spin()", "spin(")},
        TWICE, "line 11 of src/talker.py", after={TALKER: "\n    def heard(self, message):\n        self.last"}),
    "two-lines-of-a-block": Case(
        swapped(TALKER, ("    publisher = ", "  publisher = "), ("        rate.sleep", "      rate.sleep")),
        ["python-syntax"], "line 7 of src/talker.py", after={TALKER: "\n        rate.sleep()\n"}),
    "a-quote-below-a-line-further-out": Case(
        {TALKER: LISTENER_CLASS.replace("    self.last = m", "self.last = m").replace("== '", "== ")},
        TWICE, "line 12 of src/talker.py", after={TALKER: "if __name__ == '__main__':"}),
    "comment-sign-before-the-head-and-a-bracket": Case(
        swapped(TALKER, ("def main", "# def main"), ("size=10)", "size=10")), TWICE, "line 7 of src/talker.py",
        after={TALKER: "\ndef main():\n    rospy.init_node('talker')\n"}),
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
    "first-lines-behind-a-space": Case(
        swapped(TALKER, ("import rospy", " import rospy"), ("from", " from"), ("def main", " def main"),
                ("\nmain()", "\n main()")),
        ["python-syntax"], "with no spaces", after={TALKER: "\nimport rospy\nfrom std_msgs"}),
    "all-lines-behind-a-tab": Case(
        {TALKER: "#!/usr/bin/env python3\n" + "".join(f"\t{line}\n" for line in SCRIPT.split("\n")[1:-1])},
        ["python-syntax"], after={TALKER: "\nimport rospy\nfrom std_msgs.msg import Int8\n\ndef main():\n    rospy"}),
    "spaces-and-tabs-of-another-line": Case(
        swapped(TALKER, ("        publisher.", "    \tpublisher."), ("        rate.sleep()", "  \t\trate.sleep()")),
        ["python-syntax"], "start line 11 with the spaces and tabs of line 10", after={TALKER: "\n    \trate.sleep()"}),
    "texts-in-place-of-comments": Case(
        swapped(TALKER, ("import rospy", 'import rospy  """the library"""'), ("main():", 'main():  """the node"""')),
        TWICE, 'write `import rospy  # """the library"""`', after={TALKER: 'def main():  # """the node"""\n    rospy'}),
    "import-further-in": Case(
        {TALKER: FROM_ROSPY}, ["python-syntax"], "line 2 of src/talker.py: this line is indented further",
        after={TALKER: "\nfrom rospy import init_node, spin"}),
    "except-within-its-try-with-tabs": Case(
        {TALKER: SCRIPT.replace("    ", "\t").replace(
            "\nmain()\n", "\ntry:\n\tmain()\n\texcept rospy.ROSInterruptException:\n\t\tpass\n")},
        ["python-syntax"], after={TALKER: "\ntry:\n\tmain()\nexcept rospy.ROSInterruptException:\n\t\tpass\n"}),
    "what-an-if-does-is-missing": Case(
        swapped(TALKER, ("        rate.sleep()", "        if a:\n        rate.sleep()")), ["python-syntax"],
        "line 12 of src/talker.py: this block needs a line of its own",
        after={TALKER: "        if a:\n            pass\n        rate.sleep()"}),
    "import-of-rospys-names-that-is-missing": Case(
        {TALKER: FROM_ROSPY.replace("    from rospy import init_node, spin\n", "")}, ["missing-import"],
        "Publisher, Rate, get_param, init_node, is_shutdown and spin are not imported from rospy",
        after={TALKER: "\nfrom rospy import Publisher, Rate, get_param, init_node, is_shutdown, spin\n"}),
    "import-of-rospys-names-in-a-comment": Case(
        {TALKER: FROM_ROSPY.replace("    from rospy import", f"# from rospy import {OTHERS},")},
        ["missing-import"], "line 2 of src/talker.py: this line, which imports from rospy, is commented out",
        after={TALKER: "\nfrom rospy import get_param, is_shutdown, Publisher, Rate, init_node, spin\n"}),
    "statement-that-is-misspelt": Case(
        swapped(TALKER, ("        rate.sleep()", "        if a:\n            contniue\n        rate.sleep()")),
        ["missing-call"], "line 12 of src/talker.py: contniue is not defined", after={TALKER: " continue\n"}),
}  # fmt: skip


@pytest.mark.parametrize("head", LOST)
@pytest.mark.parametrize("docstring", [DOCSTRING, ""])
@pytest.mark.parametrize("blanks", ["    ", "\t"])
def test_the_first_line_of_a_class_or_function_that_is_lost(
    head: str, docstring: str, blanks: str, tmp_path: Path
) -> None:
    text = TICKER.replace(DOCSTRING, docstring).replace("    ", blanks)
    head = head.replace("    ", blanks)
    own = head.replace("(object)", "")
    missing = {TALKER: text.replace(f"{head}\n", "")}
    said = f"the line `{own.strip()}` is missing"
    check(
        Case(missing, ["python-syntax"], said, after={TALKER: text.replace(head, own)}), tmp_path / "missing"
    )
    indentation = head[: len(head) - len(head.lstrip())]
    commented = {TALKER: text.replace(head, f"{indentation}# {head.strip()}")}
    said = "this line begins the block below it, and is commented out"
    check(Case(commented, ["python-syntax"], said, after={TALKER: text}), tmp_path / "commented")


def test_a_method_that_is_not_there_has_no_lost_first_line(tmp_path: Path) -> None:
    folder = package(
        tmp_path, {TALKER: FORGOTTEN.replace("self.count = (", "rate.sleep()\n        self.count = (")}
    )
    assert repair_all(folder) == ()
    begins = "    def run(self):\n        self.rate = rospy.Rate(1)\n\n        self.n = 0\n        self.rate.sleep()\n"
    whole = (
        TICKER[: TICKER.index("    def __init__")].replace(DOCSTRING, "") + begins + "\n\nTicker().run()\n"
    )
    assert repair_all(package(tmp_path, {TALKER: whole})) == ()


@pytest.mark.parametrize(("given", "is_written"), [("0", True), ("", False), ("0, 1", False)])
def test_parameters_of_a_lost_first_line_are_as_many_as_are_given(
    given: str, is_written: bool, tmp_path: Path
) -> None:
    text = TICKER.replace("    def __init__(self, first):\n", "").replace("Ticker(0)", f"Ticker({given})")
    found = repair_all(package(tmp_path, {TALKER: text}))
    assert any("def __init__(self, first)" in one.after for one in found) == is_written


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_in_a_block_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)


@pytest.mark.parametrize("alone", ["break", "return 1", "raise a"])
def test_what_an_if_that_is_missing_asked_is_not_known(alone: str) -> None:
    wrong = SCRIPT.replace("        rate.sleep()", f"            {alone}\n        rate.sleep()")
    assert not list(make_readable(wrong))
    assert list(make_readable(wrong.replace(alone, "print(1)")))


NODE = """\
#!/usr/bin/env python3
import rospy
from std_msgs.msg import Int8, String


def heard(text):
    rospy.loginfo('I heard %s', text.data)


def on_number(number):
    if number.data > 0:
        rospy.loginfo('number %d', number.data)
    rospy.logdebug('heard')


def talk():
    pub = rospy.Publisher('chatter', String, queue_size=10)
    rospy.init_node('talker', anonymous=True)
    rospy.Subscriber('text', String, heard)
    rospy.Subscriber('number', Int8, on_number)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        now = rospy.get_time()
        pub.publish('hello %s' % now)
        rate.sleep()


if __name__ == '__main__':
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
"""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("def on_number(", "    def on_number("),
        ("def talk(", "    def talk("),
        ("def heard(", "    def heard("),
        ("    if number.data", "    # if number.data"),
        ("def heard(text):\n", ""),
        ("    while not rospy.is_shutdown():\n", ""),
        ("    rate = rospy.Rate(10)\n    while not rospy.is_shutdown():\n",
         "    while not rospy.is_shutdown():\n    rate = rospy.Rate(10)\n"),
        ("    pub = ", "        pub = "),
        ("        now = ", "            now = "),
        ("        talk()\n", ""),
        ("def talk():\n    pub", "    def talk():\n    pub"),
        ("import rospy\n", " rospy\n"),
        ("from std_msgs.msg import", " std_msgs.msg import"),
        ("def talk(", "de ftalk("),
        ("heard)", "hear)d"),
        ("String, heard", "Strin,g heard"),
        ("'chatter'", "c'hatter'"),
        ("__main__':", "__main__:'"),
        ("'talker', anon", "'talker, anon"),
        ("pub.publish('", "pub.publish'("),
        ("rospy.get_time()", "rospy.get_time))"),
        ("Rate(10)", "Rate10)"),
    ],
)  # fmt: skip
def test_one_slip_in_a_node_is_undone(right: str, wrong: str) -> None:
    """What comes out is the node as it was, and no other program that only parses."""
    steps = make_readable(NODE.replace(right, wrong, 1))
    assert ast.dump(ast.parse(steps[-1]["text"])) == ast.dump(ast.parse(NODE))


def test_a_function_without_a_body_is_left_without_one() -> None:
    """What belongs below `def` is not known, and nothing else of the script is moved there."""
    before = NODE.replace("    rospy.loginfo('I heard %s', text.data)\n", "")
    (step,) = make_readable(before)
    assert step["text"] == before.replace("def heard(text):\n", "def heard(text):\n    pass\n")
