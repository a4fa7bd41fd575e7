"""Mistakes in scripts, in one table: what is changed in a correct package, what is found, what the script is then."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.package.repairing import (
    CMAKELISTS,
    LAUNCHED,
    MANIFEST,
    SCRIPT,
    SPINS,
    TALKER,
    XML,
    Case,
    asking,
    check,
    swapped,
)

pytestmark = pytest.mark.usefixtures("without_processes")

TWICE = "class A:\n    n = 1\n    def g(self, x): return x\n"
DEEPER = "        if late:\n            wait()\n"
OTHER = "rospy.Publisher('numeric_chatter2', Int8, queue_size=10)"
ECHO = (
    SPINS.replace("numeric_chatter", "numeric_chatter2").replace("'talker'", "'echo'") + "    rospy.spin()\n"
)
LAUNCH_THREE = "".join(
    [
        "<launch>",
        *(f'<node pkg="lab" type="{n}.py" name="{n}"/>' for n in ("talker", "relay", "echo")),
        "</launch>",
    ]
)
HEARD = "def heard(m):\n    x = m.data\n    y = -x\n    n += 1\n"
OWN_POINT = {"msg/Point.msg": "int8 X\n"}


def with_line(line: str) -> dict[str, str]:
    """Return the talker with this line above the one that makes its node."""
    return swapped(TALKER, ("    rospy.init", f"    d = {{'a': 1}}\n    {line}\n    rospy.init"))


CASES = {
    "crlf": Case({TALKER: SCRIPT.replace("\n", "\r\n")}, ["line-ends"], "has Windows line endings"),
    "bom": Case({TALKER: b"\xef\xbb\xbf" + SCRIPT.encode()}, ["byte-order-mark"], "byte order mark"),
    "utf-16": Case({TALKER: SCRIPT.encode("utf-16")}, ["encoding"], "saved as UTF-16"),
    "manifest-utf-16": Case({XML: MANIFEST.encode("utf-16")}, ["manifest-line"], "package.xml is saved as UTF-16",
        after={XML: MANIFEST}),
    "merge-markers": Case(
        swapped(TALKER, ("        publisher.pub", "<<<<<<< HEAD\n        publisher.pub"),
                ("        rate", "=======\n        publisher.publish(2)\n>>>>>>> 3f2a9c1 (second try)\n        rate")),
        ["python-syntax"], "git's merge markers",
    ),
    "merge-markers-with-the-base": Case(
        swapped(TALKER, ("        publisher.pub", "<<<<<<< HEAD\n        publisher.pub"),
                ("        rate", "||||||| 1d0c2fe\n        w()\n=======\n        go()\n>>>>>>> 3f2a9c1\n        rate")),
        ["python-syntax"], "for the first one, delete lines 10 and 12 to 16",
        after={TALKER: "is_shutdown():\n\n        publisher.publish(1)\n\n\n\n\n\n        rate"},
    ),
    "member-beside-an-empty-tuple": Case(
        swapped(TALKER, ("\ndef main", "NOTHING = ()\n\ndef main"), ("rate.sleep()", "rate.slep()")),
        ["missing-call"], "`slep` is called `sleep`",
    ),
    "field-of-an-own-message": Case(
        OWN_POINT | swapped(TALKER, ("\ndef main", "from lab.msg import Point\nPoint().x = 1\n\ndef main")),
        [*3 * ["build-line"], "missing-call"], "`x` is called `X`",
    ),
    "field-of-one-letter-that-may-be-any": Case(  # is it X, or another one?
        OWN_POINT | swapped(TALKER, ("\ndef main", "from lab.msg import Point\nPoint().a = 1\n\ndef main")),
        3 * ["build-line"],
    ),
    "field-with-other-capitals-beside-a-near-one": Case(
        {"msg/Point.msg": "int8 goals\nint8 Goal\n"}
        | swapped(TALKER, ("\ndef main", "from lab.msg import Point\nPoint().goal = 1\n\ndef main")),
        [*3 * ["build-line"], "missing-call"], "`goal` is called `Goal`",
    ),
    "topic-of-the-class": Case(
        swapped(TALKER, ("\ndef main", "class Names:\n    TOPIC = 'numeric_chatter'\n\ndef main"),
                ("'numeric_chatter', Int8", "Names.TOPIC, Int8")),
        [],
    ),
    "field-of-a-message-of-the-same-name": Case(
        OWN_POINT | swapped(TALKER, ("\ndef main", "from geometry_msgs.msg import Point\nPoint().x = 1\n\ndef main")),
        [],
    ),
    "field-of-a-message-by-its-module": Case(
        OWN_POINT | swapped(TALKER, ("\ndef main", "import nav_msgs.msg\nnav_msgs.msg.Point(x=1)\n\ndef main")),
        [],
    ),
    "module-for-a-type": Case(
        swapped(TALKER, ("from std_msgs.msg import Int8", "import std_msgs.msg"), ("Int8, ", "std_msgs.msg, ")),
        ["missing-call"], "`std_msgs.msg` is a module, and no type",
    ),
    "two-values-published": Case(
        swapped(TALKER, ("publisher.publish(", "publisher.publish('count', ")), ["missing-call"], "takes one value"),
    "a-per-cent-sign-beside-a-value": Case(
        swapped(TALKER, ("numeric_chatter', Int8", "numeric_chatter', String"), ("import Int8", "import String"),
                ("publisher.publish(", "publisher.publish('100%', ")), []),
    "latin-1": Case({TALKER: SCRIPT.replace("import rospy\n", "import rospy  # caf\u00e9\n").encode("latin-1")},
                ["encoding"], "not saved as UTF-8"),
    "two-accents-together": Case({TALKER: (SCRIPT + "# Gr\u00f6\u00dfe\n").encode("cp1252")}, ["encoding"],
                "not saved as UTF-8", after={TALKER: SCRIPT + "# Gr\u00f6\u00dfe\n"}),
    "gbk": Case({TALKER: (SCRIPT + "\u8ba1\u6570 = 0\n").encode("gbk")}, ["encoding"], "not saved as UTF-8",
                after={TALKER: SCRIPT + "\u8ba1\u6570 = 0\n"}),
    "no-shebang-and-a-slip": Case(
        swapped(TALKER, ("#!/usr/bin/env python3\n", ""), ("rospy.Publisher", "rospy.Publishr")),
        ["shebang", "missing-call"], "src/talker.py line 6: write `publisher = ", after={TALKER: SCRIPT},
    ),
    "markdown-above-the-shebang": Case({TALKER: "```python\n" + SCRIPT + "```\n"},
        ["shebang", "python-syntax", "python-syntax"],
        f"line {SCRIPT.count(chr(10)) + 2} of src/talker.py: this is Markdown"),
    "markdown": Case({TALKER: SCRIPT.replace("import rospy\n", "```\nimport rospy\n", 1) + "```\n"},
                     ["python-syntax"] * 2, f"line {SCRIPT.count(chr(10)) + 2} of src/talker.py: this is Markdown"),
    "no-shebang": Case(swapped(TALKER, ("#!/usr/bin/env python3\n", "")), ["shebang"], "cannot be started"),
    "shebang-blank": Case({TALKER: "\n" + SCRIPT}, ["shebang"], "`#!` comes on line 2"),
    "tabs-of-8": Case(swapped(TALKER, ("        publisher.pub", "\tpublisher.pub")), ["python-syntax"],
        "tabs and spaces"),
    "tabs-of-4-below-an-if": Case(
        {TALKER: SCRIPT + "def f(n):\n    if n:\n\t\tn = 0\n    return n\n"},
        ["python-syntax"],
        f"replace the tabs: start line {SCRIPT.count(chr(10)) + 3} with 8 spaces",
    ),
    "body-not-indented": Case(
        swapped(TALKER, ("\nmain()", "\nif __name__ == '__main__':\nmain()")),
        ["python-syntax"],
        "the line after a `:` must be indented",
    ),
    "no-body": Case(
        swapped(TALKER, ("        rate.sleep()\n", "        if 1:\n    rate.sleep()\n")),
        ["python-syntax"],
        "line 12 of src/talker.py: this block needs a line of its own",
    ),
    "pass-further-out": Case(
        swapped(TALKER, ("\nmain()", "\nif 1:\n    try:\n        main()\n    except Exception:\npass")),
        ["python-syntax"],
        "indent line 17 by 8 more spaces",
    ),
    "pass-at-no-level": Case(
        swapped(TALKER, ("\nmain()", "\nif 1:\n    try:\n        main()\n    except Exception:\n  pass  # no")),
        ["python-syntax"],
        "indent line 17 by 6 more spaces",
    ),
    "many-tabs": Case(
        swapped(TALKER, ("    rate = ", "".join(f"\ta{n} = {n}\n" for n in range(5)) + "    rate = ")),
        ["python-syntax"],
        "start lines 8 to 12 with 4 spaces",
    ),
    "further-in": Case(swapped(TALKER, ("    rate = ", "       rate = ")), ["python-syntax"],
        "line 8 of src/talker.py: t"),
    "all-further-in": Case(
        {TALKER: "#!/usr/bin/env python3\n" + "".join(f" {line}\n" for line in SCRIPT.split("\n")[1:-1] if line)},
        ["python-syntax"],
        "start lines 2 to 4 and 11 with no spaces, lines 5 to 8",
    ),
    "many-further-in": Case(
        {TALKER: f"{SCRIPT.split(chr(10))[0]}\n" + "".join(f" a{n} = {n}\n" for n in range(13))},
        ["python-syntax"],
        "change the indentation: start lines 2 to 14 with no spaces",
    ),
    "many-further-in-of-many-blocks": Case(
        {TALKER: f"{SCRIPT.split(chr(10))[0]}\n" + "".join(f" if a:\n  b{n} = {n}\n" for n in range(7))},
        ["python-syntax"],
        "start the lines of each block exactly below each other, from line 2 to 15",
    ),
    "between-two-of-one-level": Case(
        swapped(TALKER, ("    rate = rospy", "count = 0\n    rate = rospy")),
        ["python-syntax"],
        "line 8 of src/talker.py: this line is indented less than the lines around it",
        after={TALKER: "    count = 0\n    rate = rospy"},
    ),
    "between-two-of-one-level-with-a-tab-below": Case(
        swapped(
            TALKER, ("    rate = rospy", "count = 0\n    rate = rospy"), ("        rate.sleep()", "\trate.sleep()")
        ),
        ["python-syntax"] * 2,
        "line 8 of src/talker.py: this line is indented less than the lines around it",
        after={TALKER: "    count = 0\n    rate = rospy"},
    ),
    "further-out-after-a-deeper-block": Case(
        swapped(TALKER, ("        rate.sleep()", f"{DEEPER}    a = 1\n    b = 2\n        rate.sleep()")),
        ["python-syntax"],
        "change the indentation: start lines 13 and 14 with 8 spaces",
        after={TALKER: "        a = 1\n        b = 2\n        rate.sleep()"},
    ),
    "head-commented-out": Case(
        swapped(TALKER, ("    while not", "   ## while not")),
        ["python-syntax"],
        "line 9: write `while not rospy.is_shutdown():`, with 4 spaces before it",
        after={TALKER: "    while not rospy"},
    ),
    "bracket-not-opened": Case(
        swapped(TALKER, ("publish(1)", "publish)1)")),
        ["python-syntax"],
        "line 10 of src/talker.py: there is one `)` too many",
        after={TALKER: "publisher.publish(1)"},
    ),
    "further-out": Case(
        swapped(TALKER, ("        rate.sleep()", "       rate.sleep()")),
        ["python-syntax"],
        "line 11 of src/talker.py",
    ),
    "tabs-of-4": Case(swapped(TALKER, ("    rate = ", "\trate = ")), ["python-syntax"],
        "line 8 of src/talker.py: tabs"),
    "print": Case(swapped(TALKER, ("        rate.sleep()", "        print 'a', 1\n        rate.sleep()")),
              ["python-syntax"], "line 11 of src/talker.py: `print` has no brackets, as in Python 2"),
    "the-function-that-nothing-calls": Case(
        swapped(TALKER, ("\nmain()", "\nadd_two_ints_server()")), ["missing-call"],
        "add_two_ints_server is not defined", after={TALKER: "\nmain()\n"},
    ),
    "a-value-like-a-function": Case(
        swapped(TALKER, ("def main", "def turn_server(req):\n    return TurnResponse(turn_serve)\n\ndef main"),
                        ("import rospy", "import rospy\nfrom lab.srv import TurnResponse"),
                        ("    rate =", "    rospy.Service('t', Turn, turn_server)\n    rate =")), [],
    ),
    "no-such-future": Case(swapped(TALKER, ("import rospy", "from __future__ import print_functions\nimport rospy")),
        ["python-syntax"], "`__future__` has no `print_functions`, and Python 3 needs nothing from it"),
    "function-without-a-body-at-the-end": Case({TALKER: f"{SCRIPT}\n\ndef wall():\n"},
        ["python-syntax"], "write what it should do, or `pass` if nothing"),
    "function-without-a-body-above-another": Case(swapped(TALKER, ("def main():", "def wall():\n\n\ndef main():")),
        ["python-syntax"], "write what it should do, or `pass` if nothing"),
    "future-after-others": Case(
        swapped(TALKER, ("import rospy", "import rospy\nfrom __future__ import division, print_function  # 2")),
        ["python-syntax"], "may only be the first statement, and Python 3 needs nothing from it"),
    "colon": Case(swapped(TALKER, ("is_shutdown():", "is_shutdown()")), ["python-syntax"], "line 9"),
    "bracket": Case(swapped(TALKER, ("queue_size=10)", "queue_size=10")), ["python-syntax"], "never closed"),
    "quote": Case(swapped(TALKER, ("'talker')", "'talker)")), ["python-syntax"], "line 6 of src/talker.py: a quote"),
    "text-over-lines": Case(swapped(TALKER, ("'talker')", "'tal\n        ker')")), ["python-syntax"],
        "write `rospy.init_node('tal '`", after={TALKER: "    rospy.init_node('tal '\n        'ker')\n"}),
    "typographic": Case(swapped(TALKER, ("'talker'", "\u2018talker\u2019")), ["python-syntax"], "typographic quote"),
    "no-such-future-above-a-print-with-brackets": Case(
        swapped(TALKER, ("import rospy\n", "from __future__ import print_functions\nimport rospy\n"),
                ("    rospy.init", "    print('print it: %s' % 1)\n    rospy.init")),
        ["python-syntax"], "line 2 of src/talker.py: `__future__` has no `print_functions`",
    ),
    "future-behind-imports": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nfrom __future__ import print_function\n")),
        ["python-syntax"], "delete line 3",
    ),
    "future-behind-imports-and-python-2": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nfrom __future__ import division\n"),
                ("    rospy.init", "    print 'begins'\n    rospy.init")),
        ["python-syntax", "python-syntax"], "delete line 3",
    ),
    "future-at-the-top": Case(
        swapped(TALKER, ("import rospy\n", "from __future__ import print_function\nimport rospy\n")), [],
    ),
    "methods-of-python-2": Case(
        with_line("print(not d.has_key('a'), d.has_key('a') == 1, list(d.iteritems()))"), ["python-syntax"],
        "has_key, iteritems is Python 2",
        after=with_line("print(not 'a' in d, ('a' in d) == 1, list(d.items()))"),
    ),
    "methods-of-an-own-class": Case(
        with_line("class Keys:\n        def has_key(self, key):\n            return key\n    Keys().has_key(1)"), [],
    ),
    "raw-input": Case(swapped(TALKER, ("    rospy.init", "    raw_input()\n    rospy.init")), ["python-syntax"],
        "raw_"),
    **{
        f"argument-{name}": Case(swapped(TALKER, *swaps), ["missing-call"] * kinds, says, after={TALKER: after})
        for name, (swaps, kinds, says, after) in {
            "type-in-quotes": ([("Int8, q", "'Int8', q")], 1, "the type is given as a string", "Int8, q"),
            "message": ([("Int8, q", "Int8(), q")], 1, "`Int8()` is a message, not a type", "Int8, q"),
            "order": ([("'numeric_chatter', Int8", "Int8, 'numeric_chatter'")], 1, "the topic's name comes first",
                      "('numeric_chatter', Int8"),
            "number": ([("size=10", "size='10'"), ("rospy.get_param('~rate', 10)", "'10'")], 2, "number, not a string",
                       "Rate(10)"),
            "of-sleep": ([("rate.sleep()", "rate.sleep(1)")], 1, "a Rate already knows", "rate.sleep()"),
            "without-quotes": ([("'talker'", "main")], 1, "the name of the node has no quotes", "node('main'"),
            "timer": ([("        rate.s", "        rospy.Timer(1 / 10, tick)\n        rate.s")], 1, "takes a Duration",
                      "rospy.Timer(rospy.Duration(1 / 10), tick)"),
            "of-a-log": ([("        rate.s", "        rospy.loginfo('a:', 1)\n        rate.s")], 1, "fewer `%`",
                         "rospy.loginfo('a: %s', 1)"),
            "text-for-a-number": ([("publish(1)", "publish(str(1))")], 1, "makes a string of it", "publish(1)"),
            "character-for-a-number": ([("publish(1)", "publish(chr(1))")], 1, "`chr(…)` makes", "publish(1)"),
            "name-in-quotes": ([("publish(1)", "publish('rate')")], 1, "is a string, not the var", "publish(rate)"),
            "type-hidden": ([("publish(1)", "publish(Int8)"),
                             ("        publisher.", "        Int8 = 1\n        publisher.")], 1, "is a value and no",
                            "        msg = 1\n        publisher.publish(msg)\n"),
            "data-of-data": ([("\ndef main():", "\ndef f(m):\n    m = m.data\n    print(m.data)\ndef main():")], 1,
                             "it has no `.data`", "    print(m)\n"),
            "number-in-a-text": ([("publish(1)", "publish('%d' % 1)")], 1, "this is a string", "publish(1)"),
            "number-in-an-f-string": ([("publish(1)", "publish(f'{1}')")], 1, "this is a string", "publish(1)"),
            "number-formatted": ([("publish(1)", "publish(Int8('{}'.format(1)))")], 1, "this is a", "publish(Int8(1))"),
            "class": ([("\ndef main():", f"{TWICE}a = A\na.g(1)\ndef main():")], 1, "is the class itself", "a = A()"),
            "of-self": ([("\ndef main():", f"{TWICE}    def f(self): g(n)\ndef main():")], 1, "belongs to the class A",
                        "self.g(self.n)"),
            "without-a-value": ([("'talker')", "'talker', anonymous)")], 1, "is named here without its value",
                                "anonymous=True"),
            "queue-without-a-value": ([("queue_size=10", "queue_size")], 1, "is named here without", "queue_size=10"),
            "two-values": ([("publish(1)", "publish(rate, 2)")], 1, "takes one value", "publish(rate)"),
            "callback": ([("\nmain()", "\nrospy.on_shutdown('main')\nmain()")], 1, "'main' is a string",
                         "down(main)"),
        }.items()
    },
    "class-of-messages-of-another-function": Case(
        {TALKER: SCRIPT, "src/own.py": "from std_msgs.msg import Int8\ndef f():\n    m = Int8\n    print(m)\n"
         "def g():\n    m = Int8()\n    m.data = 1\n"}, [],
    ),
    "only-publish-in-a-comment": Case(
        swapped(TALKER, ("        publisher.publish(1)", "        # publisher.publish(1)")), ["missing-call"],
        "line 10 of src/talker.py: `publisher.publish(1)` is commented out",
    ),
    "publish-in-a-comment-beside-another": Case(
        swapped(TALKER, ("publisher.publish(1)", "# publisher.publish(1)\n        publisher.publish(2)")), [],
    ),
    "rate-before-the-node": Case(
        {TALKER: SCRIPT.replace("def main():\n", "def main():\n    early = rospy.Rate(5)\n    name = 'a'\n", 1)},
        ["missing-call"], "move `rospy.init_node(…)` from line 8 up, above line 6",
    ),
    "rate-that-the-node-needs-a-name-behind": Case(
        {TALKER: SCRIPT.replace("def main():\n", "def main():\n    early = rospy.Rate(5)\n    name = 'a'\n", 1)
         .replace("init_node(", "init_node(name + ")}, [],
    ),
    "variable-of-the-file": Case(
        swapped(
            TALKER,
            ("\ndef main():", "\nn = 0\n\ndef main():"),
            ("        rate.s", "        n += 1\n        rate.s"),
        ),
        ["missing-call"],
        "write `global n` as the first line of the function",
        after={TALKER: "def main():\n    global n\n"},
    ),
    "variable-of-a-callback": Case(
        swapped(TALKER, ("\ndef main():", "\nfront = None\n\ndef heard(msg):\n    front = msg.data\n\ndef main():"),
                        ("        rate.s", "        print(front)\n        rate.s")),
        ["missing-call"], "`heard(…)` gives a value to a variable front of its own",
        after={TALKER: "def heard(msg):\n    global front\n    front = msg.data\n"},
    ),
    "variable-that-a-callback-shows": Case(
        swapped(TALKER, ("\ndef main():", "\nup = 1\ndef heard(msg):\n    up = msg.data\n    print(up)\n\ndef main():"),
                        ("        rate.s", "        print(up)\n        rate.s")),
        ["missing-call"], "a value to a variable up of its own"),
    "variables-of-a-callback": Case(
        swapped(TALKER, ("\ndef main():", f"\ny = x = n = 0\n\n{HEARD}\ndef main():"),
                        ("        rate.s", "        print(x, y)\n        rate.s")),
        ["missing-call"], "`heard(…)` assigns to x, y and n: they are variables of its own",
        after={TALKER: "def heard(m):\n    global x, y, n\n    x = m.data\n"},
    ),
    "variables-of-their-own": Case(
        {TALKER: SCRIPT, "src/own.py": "n = 0\ndef f(n):\n    n += 1\ndef g():\n    global n\n    n += 1\n"
         "def h():\n    n = 1\n    n += 1\ndef i():\n    for n in (1,): print(n)\ndef j():\n"
         "    def f(): return n\n    n = 1\ndef k():\n    n = 1\n"},
        [],
    ),
    "sleep": Case(swapped(TALKER, ("rate.sleep()", "rate.sleep")), ["missing-call"],
        "rate.sleep is named but not called"),
    "main": Case(swapped(TALKER, ("\nmain()", "\nmain")), ["missing-call"], "line 13"),
    "guard": Case(swapped(TALKER, ("\nmain()", "\nif __name__ == '_main_':\n    main()")),
              ["missing-call"], "is never '_main_'"),
    "no-main": Case(swapped(TALKER, ("\nmain()", "")), ["missing-call"], "nothing calls main()"),
    "callback": Case(swapped(TALKER, ("    rate = ", "    rospy.Subscriber('a', Int8, on_a())\n    rate = "),
                         ("\nmain()", "\ndef on_a(msg):\n    pass\n\n\nmain()")),
                 ["missing-call"], "on_a() is called where the function itself is meant"),
    "shutdown": Case(swapped(TALKER, ("    rate = ", "    rospy.on_shutdown(stop())\n    rate = "),
                             ("\nmain()", "\ndef stop():\n    print('over')\n\n\nmain()")),
                     ["missing-call"], "stop() is called where the function itself is meant"),
    "shutdown-made": Case(swapped(TALKER, ("    rate = ", "    rospy.on_shutdown(stop())\n    rate = "),
                                  ("\nmain()", "\ndef stop():\n    return print\n\n\nmain()")), []),
    "true": Case(swapped(TALKER, ("'talker')", "'talker', anonymous=true)")), ["missing-call"], "true is not defined",
                 after={TALKER: "anonymous=True"}),
    "letter-of-an-import": Case(swapped(TALKER, ("import Int8", "import Int88")),
                                ["missing-call"], "Int88 is not defined",
                                after={TALKER: "from std_msgs.msg import Int8"}),
    "guard-twice": Case(swapped(TALKER, ("\nmain()", "\nif _name_ == '_main_':\n    main()")),
                        ["missing-call"], "_name_ is not defined",
                        after={TALKER: "if __name__ == '__main__':"}),
    "letter": Case(swapped(TALKER, ("rospy.Rate(", "rospu.Rate(")), ["missing-call"], "rospu is not defined",
                   after={TALKER: "rospy.Rate("}),
    "letter-of-a-class": Case(swapped(TALKER, ("numeric_chatter', Int8", "numeric_chatter', Int88")), ["missing-call"],
                              "Int88 is not defined"),
    "letter-of-a-local": Case(swapped(TALKER, ("publisher.publish", "publiser.publish")), ["missing-call"],
                              "publiser is not defined", after={TALKER: "publisher.publish(1)"}),
    "name-of-two": Case(swapped(TALKER, ("    rate = ", "    publishes = 1\n    rate = "),
                                ("publisher.publish", "publishe.publish")), []),
    "name-that-is-caught": Case(swapped(TALKER, ("\nmain()", "\ntry:\n    null\nexcept NameError:\n    main()")), []),
    "name-of-another-kind": Case(swapped(TALKER, ("publish(1)", "publish(speed)")), []),
    "module": Case(swapped(TALKER, ("from std_msgs.msg", "from std_msg.msg")), ["missing-import"],
               "not imported from std_msg"),
    "no-msg": Case(swapped(TALKER, ("from std_msgs.msg", "from std_msgs")), ["missing-import"],
               "not imported from std_msgs"),
    "module-beside-messages": Case(
        swapped(TALKER, ("from std_msgs.msg import Int8",
                         "from sensor_msgs import point_cloud2\nfrom std_msgs.msg import Int8")), [],
    ),
    "class-imported": Case(swapped(TALKER, ("from std_msgs.msg import Int8", "import std_msgs.msg.Int8")),
                       ["missing-import"], "not imported from std_msgs.msg.Int8"),
    "braces": Case(swapped(TALKER, ("def main():", "def main() {"), ("\nmain()", "}\n\nmain()")), ["python-syntax"],
               "line 5 of src/talker.py: Python has no `{` and `}`"),
    "not": Case(swapped(TALKER, ("not rospy", "!rospy")), ["python-syntax"], "`and`, `or` and `not`"),
    "plus-plus": Case(swapped(TALKER, ("        rate.sleep()", "        n++;\n        rate.sleep();")),
        ["python-syntax"],
                  "line 11 of src/talker.py: Python has no `++`"),
    "indented-more": Case(swapped(TALKER, ("        rate.sleep()", "          rate.sleep()")), ["python-syntax"],
                      "indented further than the one above"),
    "terminal": Case(swapped(TALKER, ("import rospy\n", "$ chmod +x talker.py\nimport rospy\n")), ["python-syntax"],
                 "a command for the terminal"),
    "import-of-header": Case(
        swapped(TALKER, ("publish(1)", "publish(Header())")), ["missing-import"], "talker.py uses Header",
    ),
    "import": Case(swapped(TALKER, ("import Int8", "import String")), ["missing-import"], "talker.py uses Int8"),
    "leading-slash": Case(
        swapped(TALKER, ("'numeric_chatter'", "'/numeric_chatter'")), ["topic-name"],
        "the topic /numeric_chatter should be numeric_chatter, without the slash",
        asking(remapped=("numeric_chatter",)),
    ),
    "private-parameter": Case(
        swapped(TALKER, ("    rate = ", "    rospy.get_param('colour', 'red')\n    rate = ")), ["parameter-name"],
        "the parameter colour should be ~colour", asking(private=("colour",)),
    ),
    "private-parameter-behind-the-nodes-name": Case(
        swapped(TALKER, ("    rate = ", "    rospy.get_param('/talker/colour', 'red')\n    rate = ")),
        ["parameter-name"], "the parameter /talker/colour should be ~colour", asking(private=("colour",)),
    ),
    "private-service": Case(
        swapped(TALKER, ("    rate = ", "    rospy.Service('~estimate', Trigger, answer)\n    rate = ")),
        ["service-name"], "the service ~estimate should be /estimate", asking(servers=("/estimate",)),
        {TALKER: "rospy.Service('estimate', Trigger, answer)"},
    ),
    "service-asked-for": Case(
        swapped(TALKER, ("\nmain()", "\nrospy.wait_for_service('/estimat')\nrospy.ServiceProxy('/estimat')\nmain()")),
        ["service-name"], "the service /estimat should be /estimate",
        asking(clients=("/estimate",)), {TALKER: "rospy.ServiceProxy('/estimate')"},
    ),
    "topic-in-another-namespace": Case(
        swapped(TALKER, ("'numeric_chatter'", "'/lab/numeric_chatter'")), ["topic-name"],
        "the topic /lab/numeric_chatter should be /numeric_chatter",
    ),
    "service-with-its-words-in-another-order": Case(
        swapped(TALKER, ("    rate = ", "    rospy.Service('/open_gate', Trigger, answer)\n    rate = ")),
        ["service-name"], "the service /open_gate should be /gate/open",
        asking(servers=("/gate/open", "/gate/close")),
    ),
    "import-capitals": Case(swapped(TALKER, ("import Int8", "import int8")), ["missing-call"], "int8"),
    "class-in-other-letters": Case(swapped(TALKER, ("Int8", "int8")), ["missing-call"], "int8"),
    "class-of-another-name": Case(
        swapped(TALKER, ("import Int8", "import Int8\nfrom turtlesim.msg import Int8Pose")), [],
    ),
    "class-misspelt-throughout": Case(swapped(TALKER, ("Int8", "Imt8")), ["missing-call"], "Imt8"),
    "import-ros": Case(swapped(TALKER, ("import rospy\n", "import ros\n")), ["missing-import"], "import rospy"),
    "module-of-messages": Case(swapped(TALKER, ("chatter', Int8", "chatter', geometry_msgs.msg.Twist")),
                               ["missing-import"], "uses geometry_msgs"),
    "no-rospy": Case(swapped(TALKER, ("import rospy\n", "")), ["missing-import"], "uses rospy"),
    "attribute": Case(swapped(TALKER, ("rospy.Publisher", "rospy.publisher")), ["missing-call"],
                  "there is no rospy.publisher"),
    "rospy-with-a-sign": Case(swapped(TALKER, ("rospy.init", "ros[y.init")), ["python-syntax"],
        "line 6 of src/talker.py"),
    "value-given": Case(swapped(TALKER, ("rospy.Rate(rospy.get_param('~rate', 10))", "rospy.rate=10")),
        ["missing-call"],
                    "rospy.Rate is given a value with `=`"),
    "global": Case(swapped(TALKER, ("        rate.sleep()", "        print(count)\n        global count"),
                       ("def main", "count = 0\ndef main")), ["python-syntax"], "`global count` comes after a line"),
    "global-outside": Case(swapped(TALKER, ("\nmain()", "\ncount = 0\nglobal count\nmain()")), ["python-syntax"],
                       "`global count` comes after a line that uses count"),
    "beside-a-global": Case(swapped(TALKER, ("def main():", "count = 0\ndef main():\n    global count"),
                                ("rate.sleep()", "rate.sleep")), ["missing-call"], "rate.sleep is named but not"),
    "name-of-a-series": Case(
        swapped(TALKER, ("    rate = ", f"    publisher2 = {OTHER}\n    rate = "),
                ("        rate.sleep", "        publisher3.publish(1)\n        rate.sleep")), [],
    ),
    "topic-between-two-other-scripts": Case(
        {"src/relay.py": SCRIPT.replace("'talker'", "'relay'").replace("numeric_chatter", "numeric_chatter2"),
         "src/echo.py": ECHO, LAUNCHED: LAUNCH_THREE}, [], wanted=asking(launch_files=("launch/lab.launch",)),
    ),
    "topic-of-another-script-alone": Case(
        {"src/echo.py": ECHO, LAUNCHED: LAUNCH_THREE}, ["topic-name"], "numeric_chatter2 should be /numeric_chatter",
        asking(launch_files=("launch/lab.launch",)),
    ),
    "topic-of-another-script-while-the-labs-is-not-there": Case(
        {"src/relay.py": SCRIPT.replace("'talker'", "'relay'").replace("numeric_chatter", "numeric_chatter2"),
         "src/echo.py": ECHO, LAUNCHED: LAUNCH_THREE}, ["topic-name"] * 2, "should be /numeric_chatter",
        asking(launch_files=("launch/lab.launch",), scripts=("src/talker.py", "src/counter.py")),
    ),
    "topic": Case(swapped(TALKER, ("numeric_chatter", "numeric_chater")), ["topic-name"], "should be /numeric_chatter"),
    "node": Case(swapped(TALKER, ("'talker'", "'Talker'")), ["node-name"], "the node Talker should be talker"),
    "node-of-another-script": Case(
        {"src/relay.py": SCRIPT.replace("'talker'", "'talker3'").replace("numeric_chatter", "totals").replace("~", "")},
        [], wanted=asking(scripts=("src/talker.py", "src/relay.py")),
    ),
    "slash": Case(swapped(TALKER, ("'talker'", "'/talker'")), ["node-name"], "the node /talker should be talker"),
    "param": Case(swapped(TALKER, ("'~rate'", "'~rat'")), ["parameter-name"],
        "the parameter ~rat should be ~rate"),
    "script-name": Case({TALKER: None, "src/talkr.py": SCRIPT}, ["file-name"], "should be called talker.py"),
    "no-suffix": Case({TALKER: None, "src/talker": SCRIPT}, ["file-name"], "should be called talker.py"),
    "dots-for-slashes": Case(
        swapped(TALKER, ("    rate = ", "    name = rospy.get_param('details.name')\n    rate = ")), ["parameter-name"],
        "the parameter details.name should be /details/name", after={TALKER: "get_param('details/name')"},
    ),
    "dots-where-the-next-line-reads-a-key": Case(
        swapped(TALKER, ("    rate = ", "    d = rospy.get_param('details.name')\n    print(d['name'])\n    rate = ")),
        ["parameter-name"], "the parameter details.name should be /details", after={TALKER: "get_param('details')"},
    ),
    "names-without-quotes": Case(
        swapped(TALKER, ("'numeric_chatter'", "numeric_chatter"), ("'talker'", "talker")), ["missing-call"],
        "quotes are missing around talker, numeric_chatter", after={TALKER: "Publisher('numeric_chatter', Int8"},
    ),
    "keys-without-quotes": Case(
        swapped(TALKER, ("    rate = ", "    all = rospy.get_param('details')\n    name = all[name]\n    rate = ")),
        ["missing-call"], "quotes are missing around name", after={TALKER: "name = all['name']"},
    ),
    "keys-that-are-variables": Case(
        swapped(TALKER, ("    rate =", "    d = rospy.get_param('details')\n    for k in d: print(d[k])\n    rate =")),
        [],
    ),
    "name-like-that-of-a-variable": Case(
        swapped(TALKER, ("'talker'", "noode"), ("def main():", "def main():\n    node = 'talker'")), ["missing-call"],
        after={TALKER: "init_node(node)"},
    ),
    "name-of-a-variable": Case(
        swapped(TALKER, ("'numeric_chatter', Int8", "topic, Int8"), ("main():", "main(topic='numeric_chatter'):")), [],
    ),
    "call-in-quotes": Case(swapped(TALKER, ("rate.sleep()", "'rate.sleep()'")), ["missing-call"],
                           "rate.sleep() is in quotes", after={TALKER: "        rate.sleep()"}),
    "type-that-is-imported": Case(swapped(TALKER, ("'numeric_chatter', Int8", "'numeric_chatter', Int16")),
                                  ["missing-call"], "Int16 is not defined", after={TALKER: "'numeric_chatter', Int8"}),
    "try-missing": Case(
        {TALKER: SCRIPT.replace("\nmain()", "\nif 1:\n        main()\n    except rospy.ROSException:\n        pass")},
        ["python-syntax"],
        "below line 13 add `try:`, with 4 spaces before it",
    ),
    "except-without-pass": Case(
        {TALKER: SCRIPT.replace("\nmain()", "\ntry:\n    main()\nexcept rospy.ROSException:")},
        ["python-syntax"],
        "add `pass`, with 4 spaces before it",
    ),
    "except-missing": Case(
        {TALKER: SCRIPT.replace("\nmain()", "\ntry:\n    main()\n    pass")},
        ["python-syntax"],
        "the line `except rospy.ROSInterruptException:` is missing",
    ),
    "function-without-first-line": Case(
        swapped(TALKER, ("def main():\n", "")), ["python-syntax"], "the line `def main():` is missing"
    ),
    "callback-without-first-line": Case(
        {TALKER: SPINS.replace("\ndef listen", "\n    print(m.data)\n\ndef listen").replace("print)", "heard)")},
        ["python-syntax", "missing-call"],
        "the line `def heard(m):` is missing",
    ),
    "second-function-without-first-line": Case(
        {TALKER: SPINS.replace("def listen():", "def heard(m):\n    print(m)\n\n").replace("print)", "heard)")},
        ["missing-call", "missing-call"],
        "add `def listen():`",
    ),
    "own-part-without-first-line": Case(
        {TALKER: SPINS.replace("\nif __name__ == '__main__':\n    listen()", "\n\n    listen()")},
        ["missing-call", "missing-call"],
        "add `if __name__ == '__main__':`",
    ),
    "call-without-first-line": Case(
        swapped(CMAKELISTS, ("find_package(catkin REQUIRED COMPONENTS rospy)", "  rospy\n)")),
        ["build-line"],
        "add `find_package(catkin REQUIRED COMPONENTS`",
    ),
    "spin": Case({TALKER: SPINS}, ["missing-call"], after={TALKER: "Int8, print)\n    rospy.spin()\n"}),
    "spin-of-a-function-that-is-its-own-callback": Case({TALKER: SPINS.replace("Int8, print)", "Int8, listen)")}, []),
    "another-topic": Case(swapped(TALKER, ("'numeric_chatter'", "'numbers'")), []),
    "another-node": Case(swapped(TALKER, ("'talker'", "'my_node'")), []),
    "import-of-everything": Case(swapped(TALKER, ("import Int8", "import *")), []),
    "sleep-with-an-argument": Case(
        swapped(TALKER, ("rate.sleep()", "rate.sleep(0.5")), ["python-syntax", "missing-call"],
        after={TALKER: "rate.sleep()"},
    ),
    "topics-that-are-all-near": Case(
        swapped(TALKER, ("    publisher = ", f"    {OTHER}\n    publisher = "),
                ("'numeric_chatter'", "'numeric_chatter1'")), []),
    "topic-of-another-role": Case(
        swapped(TALKER, ("    publisher = ", "    rospy.Subscriber('numeric_chater', Int8, print)\n    publisher = "),
                ("'numeric_chatter'", "'numeric_chattr'")), ["topic-name"], "numeric_chattr should be /numeric_chatter",
        wanted=asking(does=(("src/talker.py", "publisher", "/numeric_chatter"),))),
    "two-classes-of-an-import": Case(
        swapped(TALKER, ("import Int8\n", "import int8, string\n"), (", Int8, ", ", int8, "),
                ("rate =", "x = string\n    rate =")),
        ["missing-call"], "", after={TALKER: "from std_msgs.msg import Int8, String"},
    ),
    "two-on-one-line": Case(
        swapped(TALKER, ("std_msgs.msg import Int8", "std_msg.msg import int8")), ["missing-import", "missing-call"],
        "messages are not imported from std_msg.msg", after={TALKER: "from std_msgs.msg import Int8"},
    ),
    "underscores-lost": Case(
        swapped(TALKER, ("\nmain()", "\nif name == 'main':\n    main()")), ["missing-call"],
        "write `if __name__ == '__main__':`", after={TALKER: "\nif __name__ == '__main__':\n    main()"},
    ),
    "name-that-is-no-guard": Case(swapped(TALKER, ("\nmain()", "\nif name == 'talker':\n    main()")), []),
    "script-called-by-another-word": Case(
        {TALKER: None, "src/numeric_pub.py": SCRIPT.replace("'talker'", "'counter'")}, ["file-name"],
        "src/numeric_pub.py should be called talker.py",
        wanted=asking(does=((TALKER, "publisher", "/numeric_chatter"), (TALKER, "node-name", "talker"))),
    ),
    "encoding-of-no-name": Case(
        swapped(TALKER, ("import rospy\n", "# -*- coding: uft-8 -*-\nimport rospy\n")), ["python-syntax"],
        "line 2 of src/talker.py: Python knows no encoding uft-8", after={TALKER: "# -*- coding: utf-8 -*-\n"},
    ),
    "message-and-module-imported-at-once": Case(
        swapped(TALKER, ("import rospy\nfrom std_msgs.msg import Int8\n", "import rospy, std_msgs.msg.Int8\n")),
        ["missing-import"], "messages are not imported from std_msgs.msg.Int8", after={TALKER: SCRIPT},
    ),
    "file-imported-with-its-suffix": Case(
        swapped(TALKER, ("import rospy\n", "import rospy, half.py\n"), ("publish(1)", "publish(half.py.of(2))")),
        ["missing-import"], "the module of half.py is called half",
        after={TALKER: "publish(half.of(2))"},
    ),
    "name-imported-from-a-file-with-its-suffix": Case(
        swapped(TALKER, ("import rospy\n", "import rospy\nfrom half.py import of\nfrom std_msgs import Int8\n")),
        ["missing-import", "missing-import"], "the module of half.py is called half",
    ),
    "queue-size-without-its-name": Case(
        swapped(TALKER, ("Int8, queue_size=10", "Int8, 10")), ["missing-call"],
        "the third value of `Publisher(…)` is no queue size", after={TALKER: "Int8, queue_size=10)"},
    ),
    "listener-of-subscribers": Case(
        swapped(TALKER, ("Int8, queue_size=10", "Int8, Listener(), queue_size=10")), [],
    ),
    "method-of-the-class-itself": Case(
        swapped(TALKER, ("def main():", "class T:\n    def half():\n        return 5\n\ntool = T()\n\ndef main():"),
                ("publish(1)", "publish(T.half())")), [],
    ),
    "method-of-the-name-of-a-function-of-rospys": Case(
        swapped(TALKER, ("def main():", "class T:\n    def sleep():\n        return 5\n\ntool = T()\n\ndef main():"),
                ("publish(1)", "publish(T.sleep())")), [],
    ),
    "method-that-makes-a-number-of-an-object": Case(
        swapped(TALKER, ("def main():", "class T:\n    def __int__(self):\n        return 5\n\nt = T()\n\ndef main():"),
                ("publish(1)", "publish(int(t))")), [],
    ),
    "spin-outside-of-its-function": Case(
        {TALKER: "import rospy\nfrom std_msgs.msg import Int8\n\ndef main():\n    rospy.init_node('talker')\n"
                 "    rospy.Subscriber('numeric_chatter', Int8, print)\nrospy.spin()\n\nmain()\n"},
        ["shebang", "missing-call"], "start line 7 with 4 spaces", after={TALKER: "print)\n    rospy.spin()\n"},
    ),
    "loop-outside-of-its-function": Case(
        swapped(TALKER, ("    while", "while"), ("        pub", "    pub"), ("        rate", "    rate")),
        ["missing-call"], "start line 9 with 4 spaces and lines 10 and 11 with 8 spaces", after={TALKER: SCRIPT},
    ),
    "spin-at-the-end-of-a-script": Case(
        {TALKER: SCRIPT.replace("\nmain()\n", "\nrospy.init_node('a')\nrospy.spin()\n")}, [],
    ),
    "sleeps-by-the-class": Case(
        swapped(TALKER, ("        rate.sleep()", "        rospy.Rate.sleep(0.1)")), ["missing-call"],
        "needs a Rate that was made", after={TALKER: "rospy.sleep(0.1)"},
    ),
    "text-added-to-its-place": Case(
        swapped(TALKER, ("rate.sleep()", "rate.sleep()\n        rospy.loginfo('at %s' + rospy.get_name())")),
        ["missing-call"], "and not `+`", after={TALKER: "rospy.loginfo('at %s' % rospy.get_name())"},
    ),
    "text-added-to-a-text-with-a-place": Case(
        swapped(TALKER, ("rate.sleep()", "rate.sleep()\n        print('at ' + '%s' % rospy.get_name())")), [],
    ),
    "nothing": Case({}, []),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_in_a_script_is_found_and_repaired(name: str, tmp_path: Path) -> None:
    check(CASES[name], tmp_path)
