"""What a node's source shows of the criteria that were not reached is named with the mistake that hides them."""

from __future__ import annotations

from typing import Any

import pytest

from grader.judging import judge
from grader.judging.cited_lines import cite_source
from grader.judging.facts import try_facts
from grader.judging.judge import Judgement, judge_all_runs
from grader.model.verdict import FileCitation, partial
from tests.support.rubrics import CHATTER, NODE, PACKAGE, RATE, SCENARIO, SCRIPT, rubric
from tests.support.timeline import build_runs

FILE = SCRIPT["path"]
DIES = {
    "processes": [{"name": "talker", "script": FILE, "exit_s": 0.5, "exit_code": 1}],
    "console": [{
        "process": "talker", "stream": "stderr", "at_s": 0.4, "every_s": 0.001,
        "lines": [
            "Traceback (most recent call last):", f'  File "/ws/src/lab1/{FILE}", line 3, in <module>',
            "NameError: name 'countmsg' is not defined",
        ],
    }],
    "outcome": "ended",
}  # fmt: skip
STARTED = {"name": "talker", "script": FILE, "nodes": ["/talker"], "stopped_by": "INT", "exit_s": 6.8}
ELSEWHERE = {"processes": [STARTED], "topics": [{"topic": "/hello", "count": 61}]}
DEAF = {"processes": [STARTED], "subscribers": {"/hello": ["/talker"]}}
MESSAGE = {
    "id": "message",
    "check": "message",
    "with": {"topic": "/chatter", "template": "hello world {seconds}"},
    "scenario": "talker",
    "requires": ["chatter", "node"],
}
HEARS = {
    "id": "hears",
    "check": "hears",
    "with": {"topic": "/chatter", "template": "I heard {value}"},
    "scenario": "talker",
}
LOGS = {
    "id": "logs",
    "check": "logs",
    "with": {"text": "Hello World!"},
    "scenario": "talker",
    "requires": ["node"],
}
UNDEFINED = {"name": "countmsg", "fix": "above line 3, create the message: `countmsg = Int32()`"}
NO_TYPE = {
    "name": "countmsg",
    "fix": "above line 3, define countmsg or import it (a message: `from <package>.msg import countmsg`)",
}
ROOT = {"requires": []}


def slip(kind: str, message: str, line: int = 5, **said: str) -> dict[str, Any]:
    return {"file": FILE, "line": line, "kind": kind, "message": message, **said}


def hint_of(
    name: str, run: dict[str, Any], criteria: list[dict[str, Any]], *slips: dict[str, Any], source: str = ""
) -> str:
    found = judgement_of(run, criteria, *slips, source=source).criteria
    return next(c.hint for c in found if c.id == name)


def judgement_of(
    run: dict[str, Any], criteria: list[dict[str, Any]], *slips: dict[str, Any], source: str = ""
) -> Judgement:
    package = {**PACKAGE, "slips": list(slips)}
    runs = {"talker": run, "package": {"attachments": {FILE: source}}}
    twice = any(criterion["check"] == "copies" for criterion in criteria)
    more = [{"name": "other", "script": FILE}, {"name": "ear", "script": "src/ear.py"}] if twice else []
    probes = [{"topic": "/chatter", "type": "std_msgs/String", "text": 2}]
    scenarios = {"talker": {**SCENARIO, "start": [*SCENARIO["start"], *more], "probes": probes}}
    recorded = build_runs({"runs": runs, "package": package})
    return judge_all_runs(rubric(*criteria, scenarios=scenarios), recorded)


TALKER = [NODE | ROOT, CHATTER, RATE, MESSAGE]
COPIES = {
    "id": "copies",
    "check": "copies",
    "with": {"first": "talker", "second": "other", "listener": "ear", "topic": "/chatter"},
    "scenario": "talker",
    "requires": ["node"],
}
CASES: dict[str, tuple[str, dict[str, Any], list[dict[str, Any]], list[dict[str, Any]], str]] = {
    "rate behind an undefined name": (
        "node", DIES, TALKER, [slip("undefined", "", 3, **UNDEFINED), slip("rate-number", "2", 4)],
        f"above line 3, create the message: `countmsg = Int32()`; then make it 10 Hz on line 4 of {FILE}"),
    "the same name several times in one function": (
        "node", DIES, TALKER,
        [slip("undefined", "", 3, **UNDEFINED), slip("undefined", "", 4, name="countmsg", fix="above line 4, …"),
         slip("rate-number", "2", 4), slip("rate-number", "2", 6)],
        f"create the message: `countmsg = Int32()`; then make it 10 Hz on lines 4 and 6 of {FILE}, which ask for 2 Hz"),
    "a module of Python 2 behind it": (
        "node", DIES, TALKER, [slip("lacking-import", "Tkinter")],
        f"; then write tkinter instead of Tkinter on line 5 of {FILE}"),
    "text behind an undefined name": (
        "node", DIES, TALKER, [slip("publishes", "my words {}")],
        f'; then publish `"hello world %s" % rospy.get_time()` on line 5 of {FILE}, not \'my words <value>\''),
    "the type of a topic whose name is in a variable": (
        "node", DIES, TALKER, [slip("publisher-type", "Num")],
        f"; then publish std_msgs/String on line 5 of {FILE}, not Num"),
    "the type that is subscribed to, and a field that the right one lacks": (
        "node", DIES, [NODE | ROOT, HEARS | {"requires": ["node"]}],
        [slip("subscriber", "vel"), slip("subscriber-type", "Twist"), slip("prints", "{}I heard {}", 7)],
        f"not Twist and print the `data` of the message on line 7 of {FILE}"),
    "a second undefined name": (
        "node", DIES, TALKER, [slip("undefined", "", name="math", fix="write `import math` at the top")],
        "; then write `import math` at the top"),
    "a name in Python 2 behind it": (
        "node", DIES, TALKER, [slip("undefined", "", name="null", fix="above line 5, …")],
        "; then on line 5, write `None` instead of `null`"),
    "a message type that is not imported": (
        "node", DIES, TALKER, [slip("undefined", "", name="Twist", fix="define <package>")],
        "; then write `from geometry_msgs.msg import Twist` at the top"),
    "a question behind it": (
        "node", DIES, TALKER, [slip("input", "`input()` waits", 6)],
        f"; then write a value in the code where line 6 of {FILE} asks for input"),
    "questions behind it": (
        "node", DIES, TALKER, [slip("input", "`input()` waits", 6), slip("input", "`input()` waits", 8)],
        f"; then write a value in the code where lines 6 and 8 of {FILE} ask for input"),
    "a type that nothing defines, where the lab has one": (
        "node", DIES, TALKER, [slip("undefined", "", 3, **NO_TYPE), slip("publisher-type", "countmsg", 3)],
        "on line 3, write String instead of countmsg, with `from std_msgs.msg import String` at the top"),
    "a function that nothing calls": (
        "node", DIES, TALKER, [slip("never-called", "nothing calls `talk()`", name="talk")],
        f"; then call `talk()`, which nothing in {FILE} calls"),
    "a callback that is handed to nobody": (
        "node", DIES, TALKER,
        [slip("never-called", "nothing calls `heard()`", name="heard", fix="pass it to what calls it: `…`")],
        "; then pass it to what calls it: `…`"),
    "a callback whose name is misspelt where it is handed over": (
        "node", DIES, TALKER,
        [slip("never-called", "nothing calls `herd()`", name="herd", fix="pass it to what calls it: `…`"),
         slip("misspelt", "did you mean herd?", 9, name="heard", fix="write herd instead of heard"),
         slip("rate-number", "2", 4)],
        "; then on line 9, write herd instead of heard and make it 10 Hz"),
    "a method that nothing calls because it is to be __init__": (
        "node", DIES, TALKER,
        [slip("never-called", "nothing calls `init()`", name="Node().init"),
         slip("object", "", name="__init__", fix="on line 5, write `__init__` instead of `init`")],
        "; then on line 5, write `__init__` instead of `init`"),
    "a loop that lacks its not": (
        "node", DIES, TALKER, [slip("never-begun", "", name="rospy.is_shutdown", fix="on line 5, write …")],
        f"; then on line 5, write … ({FILE})"),
    "a loop of so many turns": (
        "node", DIES, TALKER, [slip("loop-left", "it ends after a fixed number of rounds", fix="write `while …`")],
        "; then write `while …`, since it ends after a fixed number of rounds"),
    "a guard with another word": (
        "node", DIES, TALKER, [slip("main-guard", "")],
        f"; then write `if __name__ == '__main__':` on line 5 of {FILE}"),
    "rate.sleep without brackets behind it": (
        "node", DIES, TALKER, [slip("not-called", "", name="rate.sleep", fix="write `rate.sleep()`")],
        f"; then on line 5 of {FILE}, write `rate.sleep()`"),
    "a count where the time belongs": (
        "node", DIES, TALKER, [slip("publishes", "hello world {}"), slip("no-clock", "the script counts")],
        f'; then publish the time on line 5 of {FILE}, `"hello world %s" % rospy.get_time()`: the script only counts'),
    "text behind another topic": (
        "message", ELSEWHERE, TALKER, [],
        'publish "hello world %s" % rospy.get_time()'),
    "listener's topic, type and words behind an error": (
        "node", DIES, [NODE | ROOT, HEARS | {"requires": ["node"]}],
        [slip("subscriber", "hello"), slip("subscriber-type", "Int32"), slip("prints", "got {data}", 7)],
        (f"then subscribe to /chatter on line 5 of {FILE}, not to hello, subscribe with std_msgs/String on line 5 of "
         f"{FILE}, not Int32 and print 'I heard <message>' on line 7 of {FILE}, not 'got <message>'")),
    "two topics, and none is the right one": (
        "node", DIES, TALKER, [slip("publisher", "left"), slip("publisher", "right", 6)],
        f"publish std_msgs/String on /chatter: {FILE} publishes on left (line 5) and right (line 6)"),
    "words that are glued to others": (
        "node", DIES, [NODE | ROOT, HEARS | {"requires": ["node"]}], [slip("prints", "I heard: {data}", 7)],
        f"then print 'I heard <message>' on line 7 of {FILE}, not 'I heard: <message>'"),
    "listener's words behind another topic": (
        "hears", DEAF, [NODE | ROOT, HEARS], [slip("subscriber", "hello"), slip("prints", "{}got {data}", 7)],
        f"; then print 'I heard <message>' on line 7 of {FILE}, not '<value>got <message>'"),
    "what is not printed behind another topic": (
        "hears", DEAF, [NODE | ROOT, HEARS | {"with": {"topic": "/chatter"}}],
        [slip("subscriber", "hello"), slip("not-printed", "line 7 prints nothing", name="hello", fix="print it")],
        "; then print it: line 7 prints nothing"),
    "two copies of one name behind an error": (
        "node", DIES, [NODE | ROOT, COPIES], [slip("node-name", "talker", 11)],
        f"write anonymous=True on line 11 of {FILE}, since two of it run at once"),
    "other words that are logged, behind an error": (
        "node", DIES, [NODE | ROOT, LOGS], [slip("prints", "Hello ROS")],
        f"; then log 'Hello World!' on line 5 of {FILE}, not 'Hello ROS'"),
}  # fmt: skip
NOTHING: dict[str, tuple[str, dict[str, Any], list[dict[str, Any]], list[dict[str, Any]]]] = {
    "the right words": (
        "node", DIES, TALKER, [slip("publishes", "Hello  world {}"), slip("rate-number", "10")]),
    "words that only a run can tell": ("node", DIES, TALKER, [slip("publishes", "{}{}")]),
    "two texts": ("node", DIES, TALKER, [slip("publishes", "a"), slip("publishes", "b", 6)]),
    "a listener's right words": (
        "node", DIES, [NODE | ROOT, HEARS | {"requires": ["node"]}],
        [slip("subscriber", "/chatter"), slip("prints", "{}: i heard {data}", 7)]),
    "what was printed is no message": (
        "node", DIES, [NODE | ROOT, HEARS | {"requires": ["node"]}], [slip("prints", "listening")]),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_wrong_behind_a_mistake_is_named_with_it(case: str) -> None:
    name, run, criteria, slips, told = CASES[case]
    assert told in hint_of(name, run, criteria, *slips)


def test_a_type_that_the_lab_does_not_want_is_not_imported_first() -> None:
    lines = [f'  File "/ws/src/lab1/{FILE}", line 3, in <module>',
             "ImportError: cannot import name 'JointState' from 'std_msgs.msg' (/usr/lib/msg/__init__.py)"]  # fmt: skip
    console = [{**DIES["console"][0], "lines": ["Traceback (most recent call last):", *lines]}]
    run = {**DIES, "console": console}
    assert hint_of("node", run, TALKER).startswith("from sensor_msgs.msg import JointState")
    told = hint_of("node", run, TALKER, slip("publisher", "chatter"), slip("publisher-type", "JointState"))
    retyped = (
        f"from std_msgs.msg import String; then publish std_msgs/String on line 5 of {FILE}, not JointState"
    )
    assert told.startswith(retyped)
    source = "#!/usr/bin/env python3\nfrom std_msgs.msg import String\n\n\nrospy.Publisher('chatter', JointState)\n"
    source += "# JointState()\nm = JointState()\n"
    slips = slip("publisher", "chatter"), slip("publisher-type", "JointState")
    told = hint_of("node", run, TALKER, *slips, source=source)
    assert told.startswith(f"{retyped} (made on line 7)")
    told = hint_of("node", run, TALKER, *slips, source=f"{source}n = JointState()\n")
    assert told.startswith(f"{retyped} (made on lines 7 and 8)")


@pytest.mark.parametrize("case", NOTHING)
def test_nothing_is_named_behind_a_mistake_that_is_not_plainly_wrong(case: str) -> None:
    name, run, criteria, slips = NOTHING[case]
    hint = hint_of(name, run, criteria, *slips)
    assert hint != ""
    assert "then" not in hint


LACKS = "#!/usr/bin/env python3\n# I heard, hello world\nx = 1\n"


def test_words_that_stand_nowhere_in_the_source_are_named() -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    assert hint_of("node", DIES, heard, source=LACKS).endswith("; then print 'I heard <message>'")
    other = slip("publishes", "{}", 6)
    assert hint_of("node", DIES, TALKER, other, source=LACKS).endswith(
        f'; then publish `"hello world %s" % rospy.get_time()` on line 6 of {FILE}'
    )
    assert hint_of("node", DIES, TALKER, source=LACKS).endswith(
        '; then publish `"hello world %s" % rospy.get_time()`'
    )
    for criteria, words in ((heard, "I heard"), (TALKER, "Hello  World")):
        assert "then" not in hint_of("node", DIES, criteria, source=f"{LACKS}say('{words}')\n")


IMPORTED = " (with `from std_msgs.msg import String` at the top)"
ON_5 = f" on line 5 of {FILE}"
ONLY_DATA = " and put a text into `data`, the only field of String, in place of"


@pytest.mark.parametrize(
    ("kind", "line", "fields"),
    [
        ("Int8", "msg.data = 1", ""),
        ("Header", "msg.stamp = msg.frame_id", f"{ONLY_DATA} `stamp` and `frame_id` on line 5 of {FILE}"),
        ("Header", "msg.seq += 1", f"{ONLY_DATA} `seq`{ON_5}; leave out the calculation with it on line 5"),
        ("Header", "x = 'a' + msg.seq + 'b'", f"{ONLY_DATA} `seq`{ON_5}"),
        ("Header", "msg.serialize(f)", ""),
        ("Header", "p.publish(1, f(), 'a')", f" and publish one value on line 5 of {FILE}, as String has only `data`"),
        ("Header", "p.publish('a, %s' % (n, 1))", ""),
    ],
)  # fmt: skip
def test_other_lines_that_make_a_wrong_type_are_named(kind: str, line: str, fields: str) -> None:
    run = {"processes": [STARTED], "topics": [{"topic": "/chatter", "type": f"std_msgs/{kind}", "count": 61}]}
    source = (
        f"# {kind}()\nmsg = {kind}()\npub = Publisher('chatter', {kind})\npub.publish({kind}(1))\n{line}\n"
    )
    slips = [slip("publisher", "chatter", 3), slip("publisher-type", kind, 3)]
    hint = hint_of("chatter", run, [NODE | ROOT, CHATTER], *slips, source=source)
    told = f"then write String instead of {kind} on lines 2 and 4 of {FILE}{fields}"
    assert "rospy.Publisher('/chatter', String, queue_size=10)" in hint
    assert hint.endswith(f"; {told}")


def test_a_callback_that_takes_other_fields_is_told() -> None:
    source = (
        "def other(p):\n    p.y = 1\n\ndef heard(p):\n    print('%.2f' % p.x, p.data)\n\n    use(p.x)\np.z = 1\n"
        "rospy.Subscriber('chatter', Point, heard)\n"
    )
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    slips = [slip("subscriber", "chatter", 9), slip("subscriber-type", "Point", 9)]
    hint = hint_of("node", DIES, heard, *slips, source=source)
    assert (
        f"use `data`, the only field of String, in place of `x` on lines 5 and 7 of {FILE}, and %s in place of %.2f"
        in hint
    )


def test_what_a_callback_does_besides_comes_after_the_print() -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    slips = [slip("subscriber", "chatter"), slip("subscriber-type", "Int32")]
    hint = hint_of("node", DIES, heard, *slips, source=LACKS)
    assert hint.endswith(f"not Int32{IMPORTED} and print 'I heard <message>' first in the callback")


@pytest.mark.parametrize("given", [{"topic": "/chatter"}, HEARS["with"]])
def test_what_needs_a_number_gives_way_where_a_text_is_asked_for(given: dict[str, str]) -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"], "with": given}]
    loop = slip("takes-number", "line 7 needs a number", 6, fix="write `rospy.spin()` in place of the loop")
    own = [slip("subscriber", "chatter"), slip("prints", "I heard {data}", 2), loop]
    for kind, told in (("Int32", True), ("String", False)):
        hint = hint_of(
            "node", DIES, heard, *own, slip("subscriber-type", kind), source="#\nlog('%d', m.data)\n"
        )
        assert hint.endswith("needs a number") == told == (f"%s instead of %d on line 2 of {FILE}" in hint)


def test_a_text_that_another_function_prints_is_not_the_messages() -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    slips = [
        slip("subscriber", "colour"), slip("subscriber-type", "Colour"), slip("prints", "I send {data}", 9),
    ]  # fmt: skip
    hint = hint_of("node", DIES, heard, *slips, source=LACKS)
    assert hint.endswith(f"not Colour{IMPORTED} and print 'I heard <message>' first in the callback")


def test_a_field_that_is_told_with_its_line_is_not_told_as_the_messages_data_too() -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    slips = [
        slip("subscriber", "chatter", 3),
        slip("subscriber-type", "Twist", 3),
        slip("prints", "I heard {}", 2),
    ]
    source = "def show(msg):\n    print('I heard', msg.linear)\nrospy.Subscriber('chatter', Twist, show)\n"
    hint = hint_of("node", DIES, heard, *slips, source=source)
    assert f"in place of `linear` on line 2 of {FILE}" in hint
    assert "print the `data`" not in hint
    whole = source.replace("msg.linear", "msg")
    assert "print the `data` of the message on line 2" in hint_of("node", DIES, heard, *slips, source=whole)


@pytest.mark.parametrize(
    ("callback", "told"),
    [
        ("def callback(msg):\n    rospy.loginfo('I heard %s', msg)\n", True),
        ("def callback(msg):\n    rospy.loginfo('I heard %s',\n        msg.data)\n", False),
        ("def callback(msg):\n    said = msg\n    print('I heard', said.data)\n", False),
        ("def show(text):\n    print('I heard', text)\n", False),
        (f"def show(text):\n    print('I heard', text)\n# {20_000 * 'Subscriber('}\n", False),
    ],
    ids=["whole", "its data", "by another name", "another function", "a hostile line"],
)
def test_a_message_that_is_printed_whole_is_named_behind_another_mistake(callback: str, told: bool) -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    line = 3 if "said" in callback else 2
    slips = [slip("subscriber", "chatter"), slip("prints", "I heard {data}", line)]
    source = f"{callback}Subscriber('chatter', String, callback)\n"
    assert (
        "print the `data` of the message on line 2" in hint_of("node", DIES, heard, *slips, source=source)
    ) is told


@pytest.mark.parametrize(
    ("run", "given", "told"),
    [
        (DEAF, "on_text)", True),
        (DIES, "on_text)", True),
        (DEAF, "other)", False),
        (DEAF, "# on_text)", False),
    ],
    ids=["another topic", "a node that dies", "another callback", "a comment"],
)
def test_a_callback_that_ros_cannot_call_is_named_behind_another_mistake(
    run: dict[str, Any], given: str, told: bool
) -> None:
    criteria = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    fix = slip("callback-values", "", 1, fix="write `def on_text(msg):`", name="on_text")
    source = f"def on_text():\n    pass\nSubscriber('hello', String, {given}\n"
    own = slip("undefined", "", 2, name="msg", fix="above line 2, write `msg = …`")
    slips = (slip("subscriber", "hello"), own, fix)
    hint = hint_of("node" if run is DIES else "hears", run, criteria, *slips, source=source)
    assert (f"on line 1 of {FILE}, write `def on_text(msg):`" in hint) is told
    assert "msg = …" not in hint


@pytest.mark.parametrize(("place", "told"), [("%d", True), ("%.2f", True), ("%s", False)])
def test_a_text_is_not_printed_as_a_number(place: str, told: bool) -> None:
    heard = [NODE | ROOT, HEARS | {"requires": ["node"]}]
    slips = [
        slip("subscriber", "home"),
        slip("subscriber-type", "Int32"),
        slip("prints", "I heard {data}", 2),
    ]
    source = f"def callback(msg):\n    rospy.loginfo('I heard {place}', msg.data)\n"
    hint = hint_of("node", DIES, heard, *slips, source=source)
    assert (f"write %s instead of {place} on line 2" in hint) is told


@pytest.mark.parametrize("call", ["input()", "int(input(…))"])
def test_a_text_that_takes_the_place_of_input_is_told_once(call: str) -> None:
    asks = [f'  File "/ws/src/lab1/{FILE}", line 3, in <module>', f"    said = {call}"]
    lines = ["Traceback (most recent call last):", *asks, "EOFError: EOF when reading a line"]
    hint = hint_of(
        "node",
        {**DIES, "console": [{**DIES["console"][0], "lines": lines}]},
        TALKER,
        source=f"{LACKS}while True:\n",
    )
    assert hint.startswith(f'write `"hello world %s" % rospy.get_time()` in place of `{call}`')
    assert hint.count("hello world") == hint.count("`rate.sleep()`") == 1


@pytest.mark.parametrize("line", [4, 5])
def test_a_question_in_a_script_that_does_not_compile_is_named(line: int) -> None:
    fault = {"file": FILE, "line": line, "kind": "TabError", "message": "inconsistent use of tabs"}
    own = [{**one, "python_fault": fault} if one["path"] == FILE else one for one in PACKAGE["files"]]
    source = "# input()\n\nwhile True:\n    word = raw_input('?')\n\tprint(word)\n"
    lines = [f'  File "/ws/src/lab1/{FILE}", line {line}', "TabError: inconsistent use of tabs"]
    died = {**DIES, "console": [{**DIES["console"][0], "lines": lines}]}
    runs = {
        "runs": {"talker": died, "package": {"attachments": {FILE: source}}},
        "package": {**PACKAGE, "files": own},
    }
    found = {c.id: c.hint for c in judge(rubric(*TALKER), build_runs(runs))}
    told = f"then write a value in the code where line 4 of {FILE} asks for input"
    assert any(told in hint for hint in found.values())


def test_a_question_whose_answer_the_run_types_is_right() -> None:
    asks = slip("input", "input", 6, name="once")
    scenarios = {"talker": {**SCENARIO, "steps": [{"type": {"process": "talker", "line": "3"}}]}}
    recorded = build_runs({"runs": {"talker": DIES}, "package": {**PACKAGE, "slips": [asks]}})
    found = judge(rubric(*TALKER, scenarios=scenarios), recorded)
    assert all("for input" not in c.hint for c in found)
    assert "for input" in hint_of("node", DIES, TALKER, asks)


MADE = "    rate = rospy.Rate(10)\n"
LOOP = "    while not rospy.is_shutdown():\n        pub.publish(x)\n"
SLEEPS = "        rate.sleep()\n"


@pytest.mark.parametrize(
    ("source", "told"),
    [
        (MADE + LOOP, f"; then call `rate.sleep()` each time around the loop of {FILE}"),
        (LOOP, f"; then let the loop of {FILE} wait: `rate = rospy.Rate(10)` above it, `rate.sleep()` in it"),
        (f"    rate = 10  # Hz\n{LOOP}{SLEEPS}",
         f"; then write `rate = rospy.Rate(10)` on line 1 of {FILE}: only a Rate can sleep"),
        (f"{MADE}{LOOP}        rospy.spin()\n{SLEEPS}",
         f"; then delete `rospy.spin()` on line 4 of {FILE}, at which the loop stands still"),
        (f"{MADE}{LOOP}{SLEEPS}    rospy.spin()\n", ""),
        (f"    rospy.Timer(d, send)\n{LOOP}", ""),
        ("    pub.publish(x)\n", ""),
    ],
)  # fmt: skip
def test_what_keeps_a_loop_from_sleeping_is_named_before_it_runs(source: str, told: str) -> None:
    hint = hint_of("node", DIES, [NODE | ROOT, RATE | {"requires": ["node"]}], source=source)
    assert hint.endswith(told)
    assert ("then" in hint) == bool(told)


def test_a_callback_that_is_not_there_is_named_with_the_subscriber_that_has_it() -> None:
    deaf = {"processes": [STARTED], "subscribers": {"/left": ["/talker"], "/right": ["/talker"]}}
    slips = [slip("subscriber", "left", 6), slip("subscriber", "right", 7)]
    lab = [HEARS | {"requires": []}]
    hint = hint_of("hears", deaf, lab, *slips, source="def on_left(msg): pass\n")
    assert hint.endswith("; then write `def callback(msg):` above it, which prints 'I heard <message>'")
    assert "def callback" not in hint_of("hears", deaf, lab, *slips, source="def callback(msg): pass\n")


def test_a_question_that_is_not_there_in_python_3_is_told_once() -> None:
    asks = slip("undefined", "raw_input", 3, name="raw_input")
    hint = hint_of("node", DIES, TALKER, asks, slip("input", "raw_input", 3), source=LACKS)
    assert "on line 3, remove `raw_input(…)`" in hint
    assert "asks for input" not in hint


def test_the_wrong_one_of_two_rates_and_a_misspelt_sleep_are_told() -> None:
    rates, made = [slip("rate-number", "10", 1), slip("rate-number", "2", 2)], "%s = Rate(10)\n%s = Rate(2)\n"
    told = [hint_of("node", DIES, TALKER, *rates, source=made % two) for two in (("r", "r"), ("r", "s"))]
    assert f"; then make it 10 Hz on line 2 of {FILE}, which asks for 2 Hz" in told[0]
    assert "make it" not in told[1]
    hint = hint_of("node", DIES, TALKER, source="r = rospy.Rate(10)\nr.Sleep()\nr.remaining()\n")
    assert f"; then write `sleep` instead of `Sleep` on line 2 of {FILE} and " in hint
    slips = [slip("misspelt", "", name="rate", fix="write `self.rate` instead of rate")]
    slips.append(slip("not-called", "", name="rate.sleep", fix="write `rate.sleep()`"))
    assert "write `self.rate.sleep()`" in hint_of("node", DIES, TALKER, *slips)


def test_what_a_machine_lacks_does_not_hide_what_is_the_students() -> None:
    console = {
        **DIES["console"][0],
        "lines": [*DIES["console"][0]["lines"][:-1], "ModuleNotFoundError: No module named 'smoothly'"],
    }
    run = {**DIES, "console": [console]}
    hints = [
        hint_of("rate", run, TALKER, *found)
        for found in ([slip("rate-number", "2")], [slip("rate-number", "10")])
    ]
    assert hints[0].startswith(
        f"make it 10 Hz on line 5 of {FILE}, which asks for 2 Hz. For the rest, tell your instructor"
    )
    assert hints[1].startswith("nothing for you to do: tell your instructor")
    assert judgement_of(run, TALKER).undecided == frozenset()


def test_what_may_be_decided_by_grading_again_is_known() -> None:
    short = {"topics": [{"topic": "/chatter", "type": "std_msgs/String", "count": 3}]}
    assert judgement_of(short, TALKER).undecided == {"talker"}


def test_what_rests_on_what_the_machine_lacks_is_not_run_again() -> None:
    lines = [*DIES["console"][0]["lines"][:-1], "ModuleNotFoundError: No module named 'smoothly'"]
    lacking = {**DIES["console"][0], "lines": lines}
    silent = {"processes": [STARTED]}
    runs = {"talker": {**DIES, "console": [lacking]}, "silent": silent}
    criteria = (NODE | ROOT, RATE | {"scenario": "silent", "requires": ["node"]})
    lab = rubric(*criteria, scenarios={"talker": SCENARIO, "silent": SCENARIO})
    judgement = judge_all_runs(lab, build_runs({"runs": runs, "package": PACKAGE}))
    assert [(c.status.value, c.scenario) for c in judgement.criteria] == [
        ("inconclusive", "talker"),
        ("inconclusive", "silent"),
    ]
    assert judgement.undecided == frozenset()


def test_a_name_in_an_except_is_not_reached() -> None:
    wrong = slip("misspelt", "", 2, name="rospi", fix="write rospy instead of rospi")
    sources = {"except": "try:\nexcept rospi.ROSInterruptException:\n", "plain": "x = 1\nrospi.spin()\n"}
    hints = {name: hint_of("node", DIES, TALKER, wrong, source=text) for name, text in sources.items()}
    assert "rospi" not in hints["except"]
    assert "; then on line 2, write rospy instead of rospi" in hints["plain"]


CPP = """\
#include "ros/ros.h"
int main(int argc, char **argv) {
  ros::Publisher pub = nh.advertise<std_msgs::String>("hello", 10);  // not "chatter"
  ss << "my words " << count;
  ROS_INFO("got [%s]", msg->data.c_str());
}
"""


def cpp_runs(run: dict[str, Any], source: str = CPP) -> dict[str, Any]:
    package = {
        "files": [{"path": "src/talker.cpp"}],
        "cmake": {
            "calls": [["project", "lab1"], ["catkin_package"], ["add_executable", "talker", "src/talker.cpp"]]
        },
    }
    runs = {"talker": run, "package": {"attachments": {"src/talker.cpp": source}}}
    return build_runs({"runs": runs, "package": package})


def cpp_rubric(*criteria: dict[str, Any]) -> Any:
    probes = [{"topic": "/chatter", "type": "std_msgs/String", "text": 2}]
    start = [{"name": "talker", "script": "talker"}]
    return rubric(*criteria, scenarios={"talker": {**SCENARIO, "start": start, "probes": probes}})


def test_words_of_a_source_in_cpp_are_named_too() -> None:
    started = {**STARTED, "script": "talker"}
    told = {}
    for run in ({"processes": [started]}, {"processes": [started], "subscribers": {"/hello": ["/talker"]}}):
        found = judge(cpp_rubric(NODE | ROOT, CHATTER, MESSAGE, HEARS), cpp_runs(run))
        told |= {c.id: c.hint for c in found}
    assert told["chatter"].endswith(
        "; then publish `hello world <seconds>` on line 4 of src/talker.cpp, not 'my words <value>'"
    )
    assert told["hears"].endswith(
        "; then print 'I heard <message>' on line 5 of src/talker.cpp, not 'got [<message>]'"
    )


def test_a_source_in_cpp_without_the_words_is_not_told_pythons() -> None:
    runs = cpp_runs(
        {"processes": [{**STARTED, "script": "talker"}]}, "int main() {\n  pub.publish(msg);\n}\n"
    )
    told = {c.id: c.hint for c in judge(cpp_rubric(NODE | ROOT, CHATTER, MESSAGE), runs)}
    assert told["chatter"].endswith("; then publish `hello world <seconds>`")


def test_other_words_are_shown_where_the_program_in_cpp_makes_them() -> None:
    runs = cpp_runs({"processes": [STARTED]})
    lab = cpp_rubric(HEARS)
    said = partial(0.5, "each message is printed, but not as 'I heard <message>'").about(said="got [abc]")
    found = cite_source(said, lab.criteria[0], try_facts(lab, runs), runs["package"])
    assert found.citations == (FileCitation(file="src/talker.cpp", line=5),)


def test_a_text_that_no_line_has_is_named() -> None:
    told = hint_of("node", DIES, [NODE | ROOT, LOGS], source="rospy.loginfo('at %f', x)\n")
    assert told.endswith(f"; then log 'Hello World!', which no line of {FILE} does")
    short = {**LOGS, "with": {**LOGS["with"], "text": "OK"}}
    assert "log 'OK'" not in hint_of("node", DIES, [NODE | ROOT, short], source="rospy.loginfo('OK')\n")
