from __future__ import annotations

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from grader.checks.support.exit_causes import syntax_hint
from grader.line_slips.python import corrected, other_quotes, parsed
from grader.package.lint.script_blocks import first_version
from grader.package.python import check_syntax, read_syntax_report, reason_of

pytestmark = pytest.mark.usefixtures("without_processes")
"""What the child may take, and what ends it, is looked at in test_hostile.py."""

# Each text, the line of its fault, and words of its cause; all hold under Python 3.8 as under the newest.
CASES = {
    "print": ('print "x"\n', 1, "`print` has no brackets"),
    "print_name": ("x = 1\nprint x\n", 2, "`print` has no brackets"),
    "except": ("try:\n  pass\nexcept E, e:\n  pass\n", 3, "`except Error as name:`"),
    "raise": ('raise E, "x"\n', 1, "Python 2"),
    "exec": ('exec "x"\n', 1, "`exec` has no brackets, as in Python 2"),
    "backticks": ("x = `1`\n", 1, "backticks"),
    "markdown": ("```python\nx = 1\n```\n", 1, "this is Markdown"),
    "label": (
        "Toggle line numbers\n#!/usr/bin/env python\nx = 1\n",
        1,
        "this is text, from a page or a chat",
    ),
    "sentence": ("x = 1\nThis node publishes the numbers.\n", 2, "this is text, from a page or a chat"),
    "html": ("x = 1\nif x &lt; 2:\n    x = 2\n", 2, "as in the source of a web page"),
    "html_quotes": ("x = &quot;a&quot;\n", 1, "as in the source of a web page"),
    "markdown_end": ("x = 1\n```\n", 2, "this is Markdown"),
    "unequal": ("if 1 <> 2:\n  pass\n", 1, "`!=`"),
    "long": ("x = 10L\n", 1, "`L`"),
    "unit": ("rate = rospy.Rate(10Hz)\n", 1, "leave `Hz` out"),
    "unit-apart": ("wait(2 seconds)\n", 1, "leave `seconds` out"),
    "colon_if": ("if x\n  pass\n", 1, "a colon"),
    "colon_def": ("def f()  # why\n  pass\n", 1, "a colon"),
    "colon_main": ('if __name__ == "__main__"\n  pass\n', 1, "a colon"),
    "colon_and_more": ("while x < 3:-\n  pass\n", 1, "after the `:`"),
    "else_if": ("if x:\n  pass\nelse if y:\n  pass\n", 3, "`elif`"),
    "elif_alone": (
        "if x:\n  pass\ny = 1\nelif z:\n  pass\n",
        4,
        "there is no `if` that this `elif` belongs to",
    ),
    "else_deeper": ("if x:\n  y = 1\n  else:\n  y = 2\n", 3, "right behind that block"),
    "else_colon": ("if x:\n  pass\nelse\n  pass\n", 3, "a colon `:` is missing"),
    "elif_colon": ("if x:\n  pass\nelif z\n  pass\n", 3, "a colon `:` is missing"),
    "no_value_equal": ("if x ==:\n  pass\n", 1, "a value is missing behind `==`"),
    "except_alone": ("x = 1\nexcept E:\n  pass\n", 2, "there is no `try:` for this `except`"),
    "pair": ("def f(x, (a, b)):\n  pass\n", 1, "write one name in its place, `pair`, and `a, b = pair`"),
    "lambda_pair": ("f = lambda (a, b): a\n", 1, "what a `lambda` takes"),
    "lambda_colon": ("f = lambda m print(m)\n", 1, "a colon `:` is missing behind what the `lambda` takes"),
    "reserved": ("def f(self, class):\n  pass\n", 1, "`class` is a reserved word"),
    "module_dash": ("from my-pkg.msg import A\n", 1, "has no `-` in it"),
    "import_space": ("from a.srv import add two Ints, B\n", 1, "a name has no space in it"),
    "global_value": ("def f():\n  global x = 3\n", 2, "give it its value on the next line"),
    "no_value": ("x = 3 +\n", 1, "a value is missing behind `+`"),
    "no_value_inside": ("print('%d' % )\n", 1, "a value is missing behind `%`"),
    "default_first": ("def f(a=1, b):\n  pass\n", 1, "a parameter without a default"),
    "assign": ("if x = 1:\n  pass\n", 1, "write `==`"),
    "bracket": ("x = f(1\ny = 2\n", None, "never closed"),
    "bracket_end": ("x = f(1\n", 1, "never closed"),
    "bracket_many": ("x = 1)\n", 1, "too many"),
    "bracket_kind": ("x = (1]\n", 1, "the two match"),
    "text": ("x = 'a\n", 1, "a quote is opened"),
    "quote": ("x = \u2018a\u2019\n", 1, "typographic quote \u2018"),
    "double_quote": ("x = \u201ca b\u201d\n", 1, "typographic quote \u201c"),
    "dash": ("x = 1 \u2013 2\n", 1, "typographic dash"),
    "quote_at_the_end": ("x = 'a b\u2019\n", 1, "typographic quote \u2019"),
    "no_break": ("if 1:\n\u00a0\u00a0x = 1\n", 2, "no-break space (U+00A0)"),
    "zero_width": ("x = 1\u200b\n", 1, "invisible character (U+200B)"),
    "wide": ("if x\uff1a\n  pass\n", 1, "plain `:`"),
    "tabs": ("if 1:\n        x = 1\n\ty = 2\n", 3, "at a tab size of 8"),
    "tabs_of_4": ("def f():\n    x = 1\n\ty = 2\n", 3, "at a tab size of 4"),
    "tabs_behind_spaces": ("if 1:\n    \tx = 1\n        y = 2\n", 3, "at a tab size of 8"),
    "tabs_and_more": ("if 1:\n        x = 1\n\tprint 'a'\n", 3, "at a tab size of 8"),
    "tabs_unindent": ("if 1:\n\tif 2:\n\t\tx = 1\n  y = 2\n", 4, "tabs and spaces are mixed"),
    "spaces_on_one_line": (
        "if 1:\n\tif 2:\n\t\tx = 1\n  y = 2\n",
        4,
        "begin line 4 with tabs, as the other lines of the file",
    ),
    "tab_on_one_line": (
        "if 1:\n   if 2:\n      x = 1\n\ty = 2\n",
        4,
        "begin line 4 with spaces, as the other lines of the file",
    ),
    "tabs_on_two_lines": (
        "if 1:\n   if 2:\n      x = 1\n\ty = 2\n\tz = 2\n",
        4,
        "use four spaces everywhere",
    ),
    "indent_missing": ("if 1:\nx = 1\n", 2, "must be indented"),
    "comment_in_two_lines": (
        "# the topic to\nsend Twist messages\nx = 1\n",
        2,
        "goes on with the comment above it",
    ),
    "no_comment_in_two_lines": ("import rospy\n# starts\nrospy init node\n", 3, ""),
    "two_words_below_a_comment": ("# the\nsend it\n", 2, ""),
    "indent_first": (
        "#!/a\n x = 1\n\n  # a\n y = 2\nz = 3\n",
        2,
        "the space that each line from 2 to 5 begins with",
    ),
    "indent_first_only": ("\n    x = 1\n", 2, "delete the 4 spaces that this line begins with"),
    "indent_first_tab": ("\tx = 1\n\ty = 2\n", 1, "delete the tab that each line from 1 to 2 begins with"),
    "head_in_comment_first": ("# def f():\n    x = 1\n", 1, "commented out"),
    "indent_more": ("x = 1\n  y = 2\n", 2, "further than the one above"),
    "indent_less": ("if 1:\n    x = 1\n  y = 2\n", 3, "matches none of the lines above"),
    "cpp": (
        '\n#include "ros/ros.h"\n/* a node */\nint main(int argc, char **argv) {\n}\n',
        2,
        "the whole file is C++",
    ),
    "cpp_comment": ("# include the ros header\nx = 1 // two\ny = (\n", 3, "never closed"),
    "merge": ("def f():\n    x = 1\n<<<<<<< HEAD\n    y = 1\n", 3, "merge markers"),
    "return": ("return 1\n", 1, "outside every function"),
    "plus": ("x++\n", 1, "x += 1"),
    "async": ("x.async = 1\n", 1, "reserved word"),
    "shell": ("$ rosrun a b\n", 1, "command for the terminal"),
    "latin": (b"x = 1\ny = 2  # caf\xe9\n", 2, "not saved as UTF-8"),
    "latin_text": (b"y = '\xe9'\n", 1, "not saved as UTF-8"),
    "utf16": ("x = 1\n".encode("utf-16"), None, "UTF-16"),
    "page": ("\n<!DOCTYPE html>\n<html><title>talker.py</title></html>\n", None, "is a web page"),
    "xml": ('<?xml version="1.0"?>\n<robot name="arm"/>\n', None, "the whole file is XML"),
    "notebook": ('{"cells": [{"cell_type": "code"}], "nbformat": 4}\n', None, "is a Jupyter notebook"),
    "pointer": (
        "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 3\n",
        None,
        "a pointer of Git LFS",
    ),
    "document": ("{\\rtf1\\ansi import rospy}\n", None, "a document of a word processor"),
    "numbered": ("1 import rospy\n2\n3 x = 1\n4\n5 y = 2\n", None, "begins with its number"),
    "null": (b"x = 1\n\0\n", 2, "null bytes"),
    "coding": (b"# -*- coding: klingon -*-\n", 1, "does not know"),
    "deep": ("(" * 300 + ")" * 300, None, "nested too deep"),
}
GOOD = {
    "empty": b"",
    "crlf": b"x = 1\r\nif x:\r\n    y = 2\r\n",
    "bom": b"\xef\xbb\xbfx = 1\n",
    "declared": b"# -*- coding: latin-1 -*-\nx = '\xe9'\n",
    "missing_module": b"import no_such_module_at_all\n",
    "exits": b"raise SystemExit(7)\n",
    "warns": b"x = 1 is 1\ny = '\\d'\n",
}

SYNTAX = Path(__file__).resolve().parents[2] / "grader/package/lint/syntax.py"
PYTHONS = [p for p in (f"python3.{minor}" for minor in (8, 9, 10, 12, 13, 14)) if shutil.which(p)]


def write(folder, cases):
    for name, text in cases.items():
        (folder / f"{name}.py").write_bytes(text if isinstance(text, bytes) else text.encode())
    return [f"{name}.py" for name in cases]


def assert_cases(report):
    assert set(report.checked) == {f"{name}.py" for name in (*CASES, *GOOD)}
    assert set(report.faults) == {f"{name}.py" for name in CASES}
    for name, (_, line, cause) in CASES.items():
        fault = report.faults[f"{name}.py"]
        assert cause in fault.explanation, (name, fault)
        assert line in {None, fault.line}, (name, fault)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (
            "def f():\n    # to do\n\nif __name__ == '__main__':\n    f()\n",
            "in the block on line 1: below line 1, write",
        ),
        ("if 1:\n#    f()\n", "there are only comments in the block on line 1: below line 1, write"),
        ("if 1:\n# a word\nf()\n", "must be indented"),
        (
            "class A:\n    def f(self):\n    def g(self):\n        pass\n",
            "in the block on line 2: below line 2, write",
        ),
        (
            "def f(x):\n    for i in x:\n        if i:\n    return i\n",
            "nothing in the block on line 3: below",
        ),
        ("def f(x):\n    if x:\n    if x:\n        return 1\n", "repeats the one above: delete this line"),
        ("while f():\n    if x:\n    rate.sleep()\n", "nothing in the block on line 2: below line 2, write"),
        ("if x:\nrospy.spin()\n", "nothing in the block on line 1: below line 1, write"),
        ("try:\n    main()\nexcept A:  \n", "nothing in the block on line 3: below line 3, write"),
        (
            "def f():\n    try:\n        g()\n    except A:\npass\n",
            "after a `:` must be indented: start it four spaces further",
        ),
        (
            "try:\n    main()\nexcept A:\n    # to do\n",
            "only comments in the block on line 3: below line 3, write",
        ),
        ("try:\r\n    main()\r\nexcept A:\r\n", "nothing in the block on line 3: below line 3, write"),
        ("while f():\nrate.sleep()\n", "must be indented"),
        ("if x:\nx = 0\n", "must be indented"),
        ("class A:\ndef f(self):\n    pass\n", "must be indented"),
        ("def f():\nx = 1\n", "must be indented"),
        ("def f():\nif x:\nx = 1\nif y:\ny = 1\n", "no line of the file is indented"),
    ],
)
def test_a_block_without_a_line_is_told_from_one_that_is_not_indented(tmp_path, text, cause):
    (tmp_path / "x.py").write_bytes(text.encode())
    fault = check_syntax(tmp_path, ["x.py"]).faults["x.py"]
    assert cause in fault.explanation


@pytest.mark.parametrize(
    ("text", "is_lost"),
    [
        ("def f(x):\n    y = 1\n        return\n    print(y)\n", True),
        ("def f(x):\n    print(x)\n        print(1)\n        return\n\n    print(2)\n", True),
        ("while f():\n    n += 1\n        n = -128\n    rate.sleep()\n", True),
        ("def f(x):\n    y = 1\n        y = 2\n    else:\n        y = 3\n", True),
        ("def f(x):\n    y = 1\n        return y\n", False),
        ("def f(x):\n    y = 1\n        y = y + 2\n    print(y)\n", False),
        ("def f(x):\n    y = 1\n        print(y)\n    return y\n", False),
        ("def f(x):\n    y = 1\n     return\n    print(y)\n", False),
        ("def f(x):\n    return 1\n        return 2\n    print(y)\n", False),
        ("if a:\n    b()\nc()\n    return\nd()\n", False),
    ],
)
def test_a_block_without_its_first_line_is_told_where_that_is_sure(
    tmp_path: Path, text: str, is_lost: bool
) -> None:
    (tmp_path / "x.py").write_text(text)
    told = check_syntax(tmp_path, ["x.py"]).faults["x.py"].explanation
    assert ("the line that begins this block (`if …:`) is missing above this line" in told) is is_lost


def test_faults_have_line_and_plain_cause(tmp_path):
    paths = write(tmp_path, {name: text for name, (text, _, _) in CASES.items()}) + write(tmp_path, GOOD)
    report = check_syntax(tmp_path, paths)
    assert_cases(report)
    assert report.faults["tabs.py"].kind == "TabError"


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.skipif(sys.version_info >= (3, 12), reason="this Python allows it")
@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("print 1\nx = 2\nprint x\n", "line 1: write `print(1)`; line 3: write `print(x)`"),
        ("def f()\n  while x\n    print 1\n  else\n    pass\n",
         "line 1: write `def f():`; line 2: write `while x:`; line 3: write `print(1)`; line 4: write `else:`"),
        ("print 1\n" * 7, "; line 5: write `print(1)`; 2 more lines in the same way"),
        ("print 1, \\\n  2\nprint 3\n", "line 1: write `print(...)`"),
        ("print 1\n  x = 2\nprint 3\n", "line 1: write `print(1)`"),
        ("if x: print 1\nprint(2)\n", ""),
        ("if x:\n        a = 1\n\tb = 2\nprint a\nprint b\n", "; line 4: write `print(a)`; line 5: write `print(b)`"),
        ("x = \u2018a\u2019\nif x:\n    a = 1\n\tb = 2\n",
         "; line 4: tabs and spaces are mixed in the indentation: use four spaces everywhere"),
        ("a = 1\n" * 30_000 + "print 1\nprint 2\n", "line 30001: write `print(1)`"),
    ],
    ids=["print", "colon", "many", "statement of two lines", "another kind", "one line", "tabs first", "tabs later",
         "too long"],
)  # fmt: skip
def test_further_lines_of_one_kind_are_told_too(tmp_path, text, hint):
    (tmp_path / "a.py").write_text(text)
    fault = check_syntax(tmp_path, ["a.py"]).faults["a.py"]
    told = syntax_hint(fault)
    assert told.endswith(hint)
    assert hint.startswith(";") or "line 3" in hint or "line 3" not in told


def test_a_quote_inside_of_the_braces_ends_the_f_string(tmp_path):
    (tmp_path / "a.py").write_text("d = {}\nx = f'n: {d['a']}'\n")
    assert "the other kind of quotes" in check_syntax(tmp_path, ["a.py"]).faults["a.py"].explanation


@pytest.mark.parametrize("python", PYTHONS)
def test_other_pythons_lead_to_the_same_causes(tmp_path, python):
    paths = write(tmp_path, {name: text for name, (text, _, _) in CASES.items()}) + write(tmp_path, GOOD)
    done = subprocess.run([python, "-I", SYNTAX, tmp_path, *paths], capture_output=True, check=False)
    if done.returncode and not done.stdout:
        pytest.skip(f"{python} does not run here")
    assert_cases(read_syntax_report(done.stdout))


def test_nothing_is_executed(tmp_path):
    (tmp_path / "a.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    (tmp_path / "json.py").write_text("raise SystemExit\n")
    report = check_syntax(tmp_path, ["a.py", "json.py"])
    assert report.checked == ("a.py", "json.py")
    assert not (tmp_path / "ran").exists()


def test_names_of_any_bytes(tmp_path):
    name = os.fsdecode(b"caf\xe9.py")
    (tmp_path / name).write_text("x = \n")
    report = check_syntax(tmp_path, [name])
    assert report.faults["caf\\udce9.py"].line == 1
    assert report.model_dump_json()


def test_foreign_lines_are_passed_over():
    good = '{"file": "a.py", "faults": [], "slips": []}'
    bad = ["warning: x", "[]", '{"file": 1}', '{"file": "b", "faults": [1], "slips": []}', '{"fi']
    report = read_syntax_report("\n".join([*bad, good, *bad]))
    assert report.checked == ("a.py",)


@pytest.mark.parametrize(
    ("line", "fix"),
    [
        ("type Seconds = float", "Seconds = float"),
        ("except* ValueError as e:", ""),
        ("def first[T](values):", ""),
        ("    match f(x):", ""),
    ],
)
def test_what_only_newer_pythons_know_is_said_to_be_newer(line, fix):
    assert "newer Python" in reason_of("invalid syntax", line).why
    assert not fix or corrected(line, "invalid syntax") == fix
    assert "newer Python" not in reason_of("invalid syntax", "match (x) y:").why
    assert "newer Python" in reason_of("expected '('", "class Box[T]:").why


def test_a_message_that_says_enough_has_no_cause():
    assert reason_of("invalid syntax", "x = a ? b").text == ""
    assert reason_of("invalid syntax", "elif x 3:").text == ""
    assert reason_of("invalid syntax", "except E e:").text == ""
    assert "a comma" in reason_of("invalid syntax. Perhaps you forgot a comma?", "x = (a +").text


@pytest.mark.parametrize(
    ("source", "hint"),
    [
        ("x = \u2018numbers\u2019", "line 1: write `x = 'numbers'`"),
        ("x = \u2018it's\u2019", "line 1: type a plain '"),
        ("x =\u00a01", "line 1: write `x = 1`"),
        ("print x, y", "line 1: write `print(x, y)`"),
        ("print x  # twice", "line 1: write `print(x) # twice`"),
        ("while True", "line 1: write `while True:`"),
        ("while True:-\n    pass", "line 1: write `while True:`"),
        ("print 'a' +", "line 1: write `print(...)`"),
        ("if x = 1:\n    pass", "line 1: write `if x == 1:`"),
        ("try:\n    pass\nexcept IOError, e:\n    pass", "line 3: write `except IOError as e:`"),
        ("x = (1,\ny = 2\n", "line 1: write `)` at the end of what is opened there"),
        ("<<<<<<< HEAD", "line 1: keep one version"),
    ],
)
def test_the_hint_names_the_repair_where_the_cause_is_known(tmp_path, source, hint):
    (tmp_path / "a.py").write_text(source)
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == hint


# A line as C++, the shell or Python 2 has it, and the line that the hint names; "" where it only says what to do.
HABITS = {
    "while not rospy.is_shutdown();": "while not rospy.is_shutdown():",
    "pub.publish(text))": "pub.publish(text)",
    "pub.publish)text)": "pub.publish(text)",
    'rospy.loginfo"hi")': 'rospy.loginfo("hi")',
    "rospy.loginfo text)": "rospy.loginfo(text)",
    'rospy.logwinforospy.get_time() + "I heard %s", text)': 'rospy.loginfo(rospy.get_time() + "I heard %s", text)',
    "rate.sleep)": "rate.sleep()",
    "text = float(3))*2": "text = float(3)*2",
    "rospy.spin()chmod +x talker.py": "rospy.spin()",
    "rospy.spin() rosrun lab1 talker.py": "rospy.spin()",
    "print('x')catkin_make": "print('x')",
    "while !rospy.is_shutdown():": "while not rospy.is_shutdown():",
    "while (!done && n < 3):": "while (not done and n < 3):",
    "if a || b:": "if a or b:",
    "if n == 127 {": "if n == 127:",
    "def talker() {": "def talker():",
    "void talker():": "def talker():",
    "function talker():": "def talker():",
    "Def talker():": "def talker():",
    "While True:": "while True:",
    "whlie True:": "while True:",
    "Import rospy": "import rospy",
    "form std_msgs.msg import String": "from std_msgs.msg import String",
    "import String from std_msgs.msg": "from std_msgs.msg import String",
    "from std_msgs.msg import String Int8": "from std_msgs.msg import String, Int8",
    "from std_msgs.msg import String Int8 Bool": "from std_msgs.msg import String, Int8, Bool",
    "from std_msgs.msg import (String, Int8 Bool)": "from std_msgs.msg import (String, Int8, Bool)",
    "import rospy sys math": "import rospy, sys, math",
    "from std_msgs.msg import String and Int8": "",
    "n++;": "n += 1",
    "self.n--": "self.n -= 1",
    "int n = 0;": "n = 0",
    "String msg": "msg = String()",
    "std_msgs::String msg;": "msg = String()",
    "var n = 0": "n = 0",
    "my count = 0": "my_count = 0",
    "my-count = 0": "my_count = 0",
    "for (int i = 0; i < 128; i++) {": "for i in range(0, 128):",
    "if n === 127:": "if n == 127:",
    "if n =< 127:": "if n <= 127:",
    "if n > = 127:": "if n >= 127:",
    "while (n ! = 127):": "while (n != 127):",
    "ok = (a < = b) and b = = c": "ok = (a <= b) and b == c",
    "print('set [%f, %f]' 5 (a, b))": "print('set [%f, %f]' % (a, b))",
    "if n == 127 then:": "if n == 127:",
    "if __name__ = '__main__':": "if __name__ == '__main__':",
    "// counts": "# counts",
    "n = 0 // counts up": "n = 0 # counts up",
    "/* counts */": "# counts",
    "rate = new rospy.Rate(10)": "rate = rospy.Rate(10)",
    "pub->publish(n)": "pub.publish(n)",
    "rate = rospy::Rate(10)": "rate = rospy.Rate(10)",
    "rate.sleep();;": "rate.sleep()",
    "rate.sleep():": "rate.sleep()",
    ">>> n = 0": "n = 0",
    "rospy.loginfo(text": "rospy.loginfo(text)",
    "rospy.loginfo(text))": "rospy.loginfo(text)",
    "rospy.loginfo(text]": "rospy.loginfo(text)",
    "def talker(:": "def talker():",
    "pub = Publisher('chatter, String)": "pub = Publisher('chatter', String)",
    "pub = Publisher('chatter\", String)": "pub = Publisher('chatter', String)",
    "pub = Publisher(/chatter, String)": "pub = Publisher('/chatter', String)",
    "pub = Publisher('chatter' String)": "pub = Publisher('chatter', String)",
    "text = 'hello %s' get_time()": "text = 'hello %s' % get_time()",
    "text = f'hello {n'": "text = f'hello {n}'",
    "text = 'hello %s % get_time()": "text = 'hello %s' % get_time()",
    "text = 'a %s, b %d s % (a, b)": "text = 'a %s, b %d s' % (a, b)",
    "rospy.loginfo('heard %s, %d, a, b)": "rospy.loginfo('heard %s, %d', a, b)",
    "text = '100 % sure": "text = '100 % sure'",
    "text = 'a && b' + n++": "",
    "text = hello world %s": "",
    "x := 3": "x = 3",
    "class = 3": "",
    "$ chmod +x talker.py": "",
    "``` python": "",
    "using namespace std;": "",
    "x = f'{d['a']}'": "x = f'{d[\"a\"]}'",
    "x = f'at {'%.1f' % t}'": "x = f'at {\"%.1f\" % t}'",
}


@pytest.mark.parametrize(("line", "right"), HABITS.items())
def test_habits_of_other_languages_are_named_with_the_line_that_is_right(tmp_path, line, right):
    after = "\n    pass\n" if right.endswith(":") else "\n"
    (tmp_path / "a.py").write_text("x = 1\n" + line + after)
    fault = check_syntax(tmp_path, ["a.py"]).faults["a.py"]
    hint = syntax_hint(fault)
    assert fault.explanation
    assert fault.line == 2
    assert f"line 2: write `{right}`" in hint if right else "write `text" not in hint


def test_a_bracket_too_many_at_the_end_of_a_call_over_two_lines(tmp_path):
    (tmp_path / "a.py").write_text("print('a',\n      'b'))\n")
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == "line 2: write `'b')`"


@pytest.mark.parametrize(
    ("comment", "hint"),
    [
        ("    # while x < 3:", "line 3: write `while x < 3:`"),
        ("##if x:\n    # more", "line 3: write `if x:`, and begin it with 4 spaces"),
        ("\t#for i in (1, 2):", "line 3: write `for i in (1, 2):`, and begin it with 4 spaces"),
        ("    # try:", "line 3: write `try:`"),
        ("    # for example:", "line 4: start it exactly below that one"),
        ("    # else:", "line 4: start it exactly below that one"),
    ],
)
def test_the_first_line_of_a_block_that_is_commented_out(tmp_path, comment, hint):
    (tmp_path / "a.py").write_text(f"def f():\n    x = 1\n{comment}\n        x += 1\n")
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == hint


@pytest.mark.parametrize(
    ("lines", "hint"),
    [
        ("    a()\nb()\n    c()", "line 3: begin it with 4 spaces"),
        ("    try:\n        a()\n    b()\n    except E:\n        c()", "line 4: begin it with 8 spaces"),
        ("\tif x:\n\t\ta()\nb()\n# and\nc()\n\td()", "line 4: begin it with 1 tab"),
        ("    a()\nb()\nc()\nd()\ne()\n    f()", "line 7: start it exactly below that one"),
        ("    a()\nimport b\n    c()", "line 4: start it exactly below that one"),
        ("    a()\n        b()", "line 3: start it exactly below that one"),
        (
            "    a()\n\nimport b\n\n\n    c()\n    d()",
            "line 7: write it there, with the name that the script calls",
        ),
        ("    a()\n\nimport b\n\n    c()\n    d()", "line 6: start it exactly below that one"),
        ("    if a:\n        # b()\n    c()", "below line 2, write what it should do"),
    ],
)
def test_lines_further_out_than_their_block(tmp_path, lines, hint):
    (tmp_path / "a.py").write_text(f"def f():\n{lines}\n")
    assert syntax_hint(check_syntax(tmp_path, ["a.py"]).faults["a.py"]) == hint


def test_a_right_line_is_never_corrected():
    lines = (
        "x = a[1::2]",
        "print(1 // 2)",
        "d = {'a': 1}",
        "n = -1  # n++",
        "s = 'else if'",
        "if not (a or b): pass",
    )
    assert [corrected(line) for line in lines] == [""] * len(lines)


class _Busy:
    """Garbage whose collection takes as long as a thread may run before another's turn."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        assert sum(range(20_000))


def test_threads_that_parse_at_the_same_time() -> None:
    source = "if True:\n    x = [f(1), (2, 3), {'a': [4]}]\n" * 300

    def parse(_: int) -> int:
        found = 0
        for _ in range(15):
            _Busy()
            found += len(parsed(source).body)
        return found

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(parse, range(4))) == [15 * 300] * 4


@pytest.mark.parametrize(
    ("line", "right"),
    [
        ('print(f"{a["b"]} and {c["d"]}")', "print(f\"{a['b']} and {c['d']}\")"),
        ("print(f'{a['b']}', {'c': 1})", "print(f'{a[\"b\"]}', {'c': 1})"),
        ("print(f\"{a['b']}\")", ""),
        ('print(f"{x}", {"b": 1}, "c")', ""),
    ],
)
def test_quotes_in_the_braces_of_an_f_string_become_the_others(line, right):
    assert other_quotes(line) == right


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("a\n<<<<<<< HEAD\nb\n=======\nc\n>>>>>>> other\nd", "a\n\nb\n\n\n\nd"),
        ("<<<<<<< HEAD\nb\n||||||| base\na\n=======\nc\n>>>>>>> other", "\nb\n\n\n\n\n"),
        ("a heading\n=======\nb\n>>>>>>> c", "a heading\n=======\nb\n>>>>>>> c"),
        ("<<<<<<< HEAD\nb", "\nb"),
    ],
)
def test_the_first_version_of_a_merge_is_kept(text, kept):
    assert first_version(text) == kept
