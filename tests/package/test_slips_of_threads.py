"""Threads, locks, tasks, generators and base classes that do not do what they are there for."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.package.facts import with_build_facts
from grader.package.own_modules import drop_slips_of_modules
from grader.package.python import check_syntax
from tests.package.trees import facts_of

pytestmark = pytest.mark.usefixtures("without_processes")

KINDS = {
    "stuck",
    "runs-out",
    "base-unmade",
    "callback-called",
    "never-begun",
    "loop-left",
    "ends-node",
    "not-printed",
    "printed-in-part",
}
KINDS |= {"publish-twice", "no-effect", "callback-missing"}
TALK = "def talk():\n    pub.publish(1)\n"
ENDLESS = "def talk():\n    while True:\n        pub.publish(1)\n"
GETS = "{}:\n    try:\n        pub.publish(q.get(timeout=1))\n    except queue.Empty:\n        break\n"
OUT = "def out():\n    while True:\n        m = yield\n        print(m)\no = out()\n"
TASK = "async def talk():\n    await x()\n"
HEARD = "rospy.Subscriber('t', String, heard)\n"
TICK = "def tick(e):\n    pub.publish(1)\n"
COUNT = "def count():\n    for n in range(9):\n        yield n\n"
BASE = "class Base:\n    def __init__(self):\n        self.pub = 1\n"
OWN = "class Own(Base):\n    def __init__(self):\n        self.n = 0\n"
SLIPS = {
    "thread": (TALK + "t = Thread(target=talk)\n", ["stuck:3:below line 3, write `t.start()`"]),
    "thread-kept": (TALK + "self.t = threading.Thread(target=talk)\nself.t.daemon = True\n",
                    ["stuck:3:below line 3, write `self.t.start()`"]),
    "thread-alone": (TALK + "Thread(target=talk)\n", ["stuck:3:on line 3, write `.start()` behind the last bracket"]),
    "thread-started": (TALK + "t = Thread(target=talk)\nt.daemon = True\nt.start()\n", []),
    "thread-listed": (TALK + "t = Thread(target=talk)\nfor one in [t]:\n    one.start()\n", []),
    "thread-handed": (TALK + "t = Thread(target=talk)\nbegin(t)\n", []),
    "thread-run": (ENDLESS + "t = Thread(target=talk)\nu = Thread(target=talk)\nt.run()\nu.run()\n",
                   ["stuck:6:on line 6, write `t.start()` in place of `t.run()`, and the same on line 7"]),
    "thread-run-once": (TALK + "t = Thread(target=talk)\nt.run()\n", []),
    "thread-called": (ENDLESS + "Thread(target=talk()).start()\nt = Thread(target=talk())\nt.start()\n",
                      ["stuck:4:on line 4, write `target=talk`, without the brackets, and the same on line 5"]),
    "thread-called-once": (TALK + "Thread(target=talk()).start()\n", []),
    "queue-left": (GETS.format("while not rospy.is_shutdown()"),
                   ["ends-node:5:on line 5, write `continue` in place of `break`"]),
    "queue-drained": (GETS.format("while True"), []),
    "process": (TALK + "pub = rospy.Publisher('a', Int8)\nProcess(target=talk).start()\n",
                ["stuck:4:on line 4, write `threading.Thread(…)` in place of `Process(…)`, and import threading"]),
    "process-own": (("def talk():\n    rospy.init_node('a')\n    pub = rospy.Publisher('a', Int8)\n    pub.publish(1)\n"
                    "Process(target=talk).start()\n"), []),
    "async": ("async def heard(msg):\n    print(msg)\n" + HEARD,
              ["callback-called:1:on line 1, write `def heard`, and no `await` below it"]),
    "yields": ("def heard(msg):\n    yield print(msg.data)\n" + HEARD,
               ["callback-called:1:write line 2 without `yield`"]),
    "send": (OUT + "rospy.Subscriber('t', String, o.send)\n",
             ["callback-called:5:below line 5, write `next(o)`: it runs to the first `yield`"]),
    "send-begun": (OUT + "next(o)\n"
                   "rospy.Subscriber('t', String, o.send)\n", []),
    "send-none": ("def out():\n    while True:\n        m = yield\no = out()\no.send(None)\no.send(1)\n", []),
    "task": (TASK + "async def main():\n    asyncio.create_task(talk())\nasyncio.run(main())\n",
             ["loop-left:4:on line 4, write `await` before `asyncio.create_task(…)`"]),
    "task-awaited": (TASK + "async def main():\n    t = asyncio.create_task(talk())\n"
                     "    await t\nasyncio.run(main())\n", []),
    "task-loop": (TASK + "async def main():\n    asyncio.create_task(talk())\n"
                  "    while not rospy.is_shutdown():\n        await y()\nasyncio.run(main())\n", []),
    "coroutine": (TASK + "talk()\n", ["stuck:3:on line 3, write `asyncio.run(talk())`"]),
    "coroutine-inside": ("async def talk(a):\n    await x()\nasync def main():\n    talk(1)\n    await y()\n",
                         ["stuck:4:on line 4, write `await talk(…)`"]),
    "leaves": ("def leaves(t):\n    for one in t:\n        if one:\n            leaves(one)\n        yield one\n",
               ["stuck:4:on line 4, write `yield from leaves(…)`"]),
    "leaves-all": (("def leaves(t):\n    for one in t:\n        if one:\n            yield from leaves(one)\n"
                   "        yield one\n"), []),
    "count": (COUNT + "c = count()\nprint(next(c))\n",
              ["runs-out:5:above line 2, write `while True:`, and begin lines 2 to 3 with four more spaces"]),
    "count-default": (COUNT + "c = count()\nprint(next(c, 0))\n", []),
    "count-endless": (("def count():\n    while True:\n        for n in range(9):\n            yield n\nc = count()\n"
                      "print(next(c))\n"), []),
    "count-in-turns": (COUNT + "c = itertools.cycle(count())\nprint(next(c))\n", []),
    "iterator": (("class Up:\n    def __next__(self):\n        if self.n > 9:\n            raise StopIteration\n"
                 "        return self.n\nsay = pub.publish\nfor n in Up():\n    say(n)\n    rate.sleep()\n"),
                 ["loop-left:7:put it inside a `while not rospy.is_shutdown():`"]),
    "queue": ("rospy.Subscriber('t', String, q.put)\nwhile not q.empty():\n    print(q.get())\nrospy.spin()\n",
              [("not-printed:2:on line 2, write `while not rospy.is_shutdown():`, and `q.get()` waits for each "
               "message")]),
    "queue-inside": (("rospy.Subscriber('t', String, q.put)\nwhile not rospy.is_shutdown():\n    while not q.empty():\n"
                      "        print(q.get())\n"), []),
    "queue-in-timer": (("rospy.Subscriber('t', String, q.put)\ndef show(e):\n    while not q.empty():\n"
                       "        print(q.get())\nrospy.Timer(d, show)\n"), []),
    "timers": (TICK + "rospy.Timer(d, tick)\nrospy.Timer(d, tick)\n", ["publish-twice:4:delete line 4"]),
    "timers-chosen": (TICK + "if fast:\n    rospy.Timer(d, tick)\nelse:\n    rospy.Timer(e, tick)\n", []),
    "timers-two": (TICK + "def tock(e):\n    pub.publish(2)\nrospy.Timer(d, tick)\nrospy.Timer(d, tock)\n", []),
    "submit": (TALK + "pool.submit(talk)\n",
               ["stuck:3:on line 3, write `.result()` behind the last bracket: it raises the error"]),
    "submit-uncalled": ("def talk():\n    pub.publish('%s' % rospy.get_time)\npool.submit(talk)\n",
                        ["stuck:2:on line 2, write `rospy.get_time()`"]),
    "submit-asked": (TALK + "f = pool.submit(talk)\nf.result()\n", []),
    "wait": (("while not rospy.is_shutdown():\n    try:\n        m = rospy.wait_for_message('t', String, timeout=1)\n"
             "    except rospy.ROSException:\n        break\n    print(m)\n"),
             ["ends-node:5:on line 5, write `continue` in place of `break`"]),
    "waits": (("while not rospy.is_shutdown():\n    try:\n        m = rospy.wait_for_message('t', String, timeout=1)\n"
                "    except rospy.ROSException:\n        continue\n    print(m)\n"), []),
    "logging": ("import logging\nlog = logging.getLogger(__name__)\ndef heard(msg):\n    log.warning('%s', msg.data)\n"
                + HEARD, ["not-printed:4:on line 4, write `rospy.logwarn`"]),
    "logging-itself": ("import logging\nlogging.basicConfig(level=logging.INFO)\ndef heard(msg):\n"
                       "    logging.info(msg.data)\n" + HEARD, ["not-printed:4:on line 4, write `rospy.loginfo`"]),
    "logging-of-ros": ("import logging\nlog = logging.getLogger('rosout.a')\ndef heard(msg):\n    log.info(msg.data)\n"
                       + HEARD, []),
    "logging-shown": ("import logging\nlog = logging.getLogger('a')\nlog.addHandler(h)\ndef heard(msg):\n"
                      "    log.info(msg.data)\n" + HEARD, []),
    "class-method": (("class A:\n    @classmethod\n    def heard(cls, msg):\n        cls.log.info(msg.data)\n"
                     "    def f(self):\n        rospy.Subscriber('t', String, self.heard)\n"), []),
    "letters": ("def heard(msg):\n    print('{}'.format(*msg.data))\n" + HEARD,
                ["printed-in-part:2:on line 2, write `msg.data` without the `*`"]),
    "starred": ("def heard(msg):\n    print(msg.data)\nfor a in b:\n    rospy.Subscriber(*a, heard)\n", []),
    "base": (BASE + OWN, ["base-unmade:5:below line 5, write `super().__init__()`"]),
    "base-made": (BASE + OWN + "        super().__init__()\n", []),
    "base-named": (BASE + OWN + "        Base.__init__(self)\n", []),
    "base-of-values": (BASE.replace("self)", "self, hz)") + OWN,
                       ["base-unmade:5:below line 5, write `super().__init__(…)`"]),
    "base-without": ("class Base:\n    pass\n" + OWN, []),
    "base-given": (BASE + OWN + "        self.pub = 2\n", []),
}  # fmt: skip


@pytest.mark.parametrize(("text", "said"), SLIPS.values(), ids=SLIPS)
def test_what_waits_or_comes_to_its_end(text: str, said: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    found = check_syntax(tmp_path, ["a.py"]).slips
    assert [f"{s.kind}:{s.line}:{s.fix}" for s in found if s.kind in KINDS] == said


@pytest.mark.parametrize(
    ("base", "said"),
    [
        (BASE, ("Own pub", "below line 3, write `super().__init__()`")),
        (BASE.replace("self)", "self, hz)"), ("Own pub", "below line 3, write `super().__init__(…)`")),
        (BASE.replace("self.pub = 1", "print(self.pub)"), None),
        (BASE.replace("pub", "n"), None),
        ("class Base:\n    pass\n\n\nclass Other:\n    def __init__(self):\n        self.pub = 1\n", None),
    ],
)
def test_a_base_class_of_another_file(base: str, said: tuple[str, str] | None, tmp_path: Path) -> None:
    texts = {"a.py": "from b import Base\n" + OWN, "b.py": base}
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    alone = check_syntax(tmp_path, ["a.py", "b.py"]).slips
    slips = drop_slips_of_modules(alone, texts)
    found = [(s.name, s.fix) for s in slips if s.kind == "base-unmade"]
    assert found == ([said] if said else [])
    # what ROS's own Python says of the files is seen together, too
    assert with_build_facts(facts_of(tmp_path), python_slips=alone, folder=tmp_path).slips == slips
