"""What is said of exceptions that habits of other languages raise."""

from __future__ import annotations

import pytest

from grader.checks.support.console_output import tracebacks
from grader.checks.support.exit_causes import explain_traceback
from tests.package.trees import facts_of

SCRIPT = """\
import rospy
class Talker:
    def __init__(self):
        self.pub = rospy.Publisher('chatter', String)
    def run():
        pub.publish('a')
    def stay(self):
        self.rate.sleep()
Talker.stay()
rospy.on_shutdown(leave())
def leave():
    print('over')
number_pub = rospy.Publisher('chatter', String)
text_pub = rospy.Publisher('numbers', Int8)
from std_msgs.msg import Int8
from geometry_msgs.msg import Twist
speed_pub = rospy.Publisher('cmd_vel', Twist)
"""


@pytest.mark.parametrize(
    ("line", "source", "error", "hint"),
    [
        (6, "add(1, 2)", "rospy.service.ServiceException: service [/add] unavailable",
         "wait for it before the call: `rospy.wait_for_service('/add')`"),
        (6, "add(1, 2)", "rospy.service.ServiceException: remote error reported: md5sums do not match: [1] vs. [2]",
         "give both the same .srv, with the names and types of the handout, and build again"),
        (6, "print('{} is {}'.format(x))", "IndexError: Replacement index 1 out of range for positional args tuple",
         "give `format(…)` as many values as the text has `{}` in it"),
        (6, "rate = rospy.Rate()", "TypeError: __init__() missing 1 required positional argument: 'hz'",
         "write how many times a second the loop has to run in its brackets"),
        (6, "while true:", "NameError: name 'true' is not defined. Did you mean: 'True'?",
         "write `True` instead of `true`"),
        (6, "last = null", "NameError: name 'null' is not defined", "write `None` instead of `null`"),
        (6, "n = 0 // start", "NameError: name 'start' is not defined", "write `n = 0 # start`"),
        (6, "pub.publish('a')", "NameError: name 'pub' is not defined",
         "on line 6, write self.pub instead of pub; write `from std_msgs.msg import String` at the top"),
        (6, "talker.run()", "TypeError: run() takes 0 positional arguments but 1 was given",
         "make it `def run(self):`"),
        (6, 'pub = rospy.Publisher(String, "chatter", queue_size=10)',
         "ValueError: topic name is not a non-empty string",
         'write `pub = rospy.Publisher("chatter", String, queue_size=10)`'),
        (6, 'rospy.Subscriber("chatter", "std_msgs/String", hear)',
         "ValueError: data_class [std_msgs/String] is not a class",
         'write `rospy.Subscriber("chatter", String, hear)`'),
        (6, "self.pub = rospy.Publisher('a', Int8(), queue_size=1)", "ValueError: data_class [data: 0] is not a class",
         "write `self.pub = rospy.Publisher('a', Int8, queue_size=1)`"),
        (6, "rospy.Subscriber('a', hear, Int8)", "ValueError: data_class [<function hear at 0x7f>] is not a class",
         "write `rospy.Subscriber('a', Int8, hear)`"),
        (6, "rospy.Subscriber('a', Int8, hear)",
         "ValueError: data_class [<module 'std_msgs.msg' from '/opt/ros'>] is not a class",
         "import the type itself: `from std_msgs.msg import …`"),
        (6, "rospy.Publisher('a', queue_size=1)",
         "TypeError: Publisher.__init__() missing 1 required positional argument: 'data_class'",
         "write the type of the messages after the topic's name, without quotes"),
        (6, "rospy.Publisher('a', str)", "ValueError: data_class [type] is not a message data class",
         "import the type of the messages, as in `from std_msgs.msg import String`"),
        (6, "rospy.sleep(r)", "TypeError: '<' not supported between instances of 'Rate' and 'int'",
         "write `r.sleep()`"),
        (6, "self.rate.sleep(10)", "TypeError: Rate.sleep() takes 1 positional argument but 2 were given",
         "write `self.rate.sleep()`"),
        (6, 'rate = rospy.Rate("10hz")', "TypeError: unsupported operand type(s) for /: 'float' and 'str'",
         "write `rospy.Rate(10)`"),
        (6, "r = rospy.Rate(0)", "ZeroDivisionError: float division by zero",
         "write how many times a second the loop runs, as in `rospy.Rate(10)`"),
        (6, "rospy.init_node()", "TypeError: init_node() missing 1 required positional argument: 'name'",
         "write the node's name in the brackets, as a string"),
        (6, "pub.publish(String)", "TypeError: String.serialize() missing 1 required positional argument: 'buff'",
         "publish a value: `String(…)`, or the value alone"),
        (6, "pub.publish(text)", "AttributeError: 'tuple' object has no attribute 'encode'",
         'put the values into the text with `%`: `"… %s" % value`, not after a comma'),
        (6, "pub.publish(dta=3)", "AttributeError: dta is not an attribute of Int8",
         "write `data=` instead of `dta=`"),
        (6, "rospy.publish(3)",
         "AttributeError: module 'rospy' has no attribute 'publish'. Did you mean: 'Publisher'?",
         "write that name in front of it: `pub.publish(…)`"),
        (6, "publish(3)", "NameError: name 'publish' is not defined",
         "write that name in front of it: `pub.publish(…)`"),
        (8, "self.rate.sleep()", "AttributeError: 'Talker' object has no attribute 'rate'",
         "in `__init__`, write `self.rate = …`, with the value that it should have"),
        (9, "Talker.stay()", "TypeError: Talker.stay() missing 1 required positional argument: 'self'",
         "on line 9, write `Talker().stay()`"),
        (10, "rospy.on_shutdown(leave())", "TypeError: shutdown hook [None] must be a function or callable object",
         "write `leave`, without brackets"),
        (6, "rospy.loginfo('%s heard: %s' % rospy.get_name(), msg.data)",
         "TypeError: not enough arguments for format string",
         "write `rospy.loginfo('%s heard: %s' % (rospy.get_name(), msg.data))`"),
        (6, "text = '%s: %d' % name, number", "TypeError: not enough arguments for format string",
         "write `text = '%s: %d' % (name, number)`"),
        (6, "text = '%s: %d' % name", "TypeError: not enough arguments for format string",
         "give one value for each `%` in the string, or remove one"),
        (6, "rospy.loginfo('Sending: ', text)", "TypeError: not all arguments converted during string formatting",
         "write `rospy.loginfo('Sending: %s', text)`"),
        (6, "rospy.loginfo('I heard ' + msg)", 'TypeError: can only concatenate str (not "String") to str',
         "write `msg.data` instead of `msg`"),
        (6, "text = 'I heard ' + number", 'TypeError: can only concatenate str (not "Int8") to str',
         "write `str(number.data)` instead of `number`"),
        (6, "text = 'at ' + where", 'TypeError: can only concatenate str (not "Point") to str',
         "write `str(where.x)` instead of `where`"),
        (6, "n = int(msg)", "TypeError: int() argument must be a string, a bytes-like object or a number, not 'Int8'",
         "take its field, as in `msg.data`"),
        (6, "scan.ranges[i] = 0.0", "TypeError: 'tuple' object does not support item assignment",
         "write `scan.ranges = list(scan.ranges)` first"),
        (6, "print(msg.data.x)", "AttributeError: 'Point' object has no attribute 'data'",
         "write `.x` instead of `.data.x`"),
        (6, "answer = ask(msg)", "TypeError: expected [float64] but got [std_msgs/Float64]",
         "take its field, as in `msg.data`"),
        (6, "words = msg.split()", "AttributeError: 'String' object has no attribute 'split'",
         "write `.data.split` instead of `.split`"),
        (6, "number_pub.publish(Int8(data=str(n)))",
         "ROSSerializationException: field data must be an integer type", "write `number_pub.publish(Int8(data=n))`"),
        (6, "number_pub.publish(n)", "TypeError: field data must be of type bytes or an ascii string",
         "swap `number_pub` and `text_pub` on lines 13 and 14, or where they publish"),
        (6, "other_pub.publish(n)", "TypeError: field data must be of type bytes or an ascii string",
         "publish a string here, `str(…)`; numbers go to the publisher of their own topic"),
        (6, "counter += 1", "TypeError: unsupported operand type(s) for +=: 'Int8' and 'int'",
         "write `counter.data` instead of `counter`"),
        (6, "rate.sleep()", "AttributeError: 'int' object has no attribute 'sleep'",
         "make it with `rospy.Rate(…)`, which takes how many times a second the loop runs"),
        (6, "rate.sleep()", "AttributeError: 'Duration' object has no attribute 'sleep'",
         "make it with `rospy.Rate(…)`, which takes how many times a second the loop runs"),
        (6, "now = time.time()", "AttributeError: 'builtin_function_or_method' object has no attribute 'time'",
         "write `time` instead of `time.time`"),
        (6, "now = datetime.datetime.now()",
         "AttributeError: type object 'datetime.datetime' has no attribute 'datetime'",
         "write `datetime` instead of `datetime.datetime`"),
        (6, "rospy.init_node(talker, anonymous=True)", "TypeError: argument of type 'function' is not iterable",
         "write `rospy.init_node('talker', anonymous=True)`"),
        (6, "print('sum: %d' % answer)", "TypeError: %d format: a real number is required, not AddResponse",
         "take one of its fields"),
        (6, "reading.header.frame_id = 'a'", "AttributeError: 'member_descriptor' object has no attribute 'frame_id'",
         "write brackets where it is made: `reading = …()`"),
        (6, "if reading.temperature > LIMIT:", "TypeError: '>' not supported between instances of 'str' and 'float'",
         "turn the text into a number first, or compare it with a text"),
        (6, "hear()", "TypeError: hear() missing 1 required positional argument: 'msg'",
         "put 'msg' into its brackets, or remove the call: ROS calls a callback by itself"),
        (6, "text = text + str(3)", "TypeError: 'str' object is not callable", "give the variable `str` another name"),
        (6, "add = rospy.ServiceProxy('/add', AddRequest)", "NameError: name 'AddRequest' is not defined",
         "write `add = rospy.ServiceProxy('/add', Add)`"),
        (6, "rospy.Service('/add', AddResponse, add)",
         "AttributeError: type object 'AddResponse' has no attribute '_request_class'",
         "write `rospy.Service('/add', Add, add)`"),
        (6, "rospy.ServiceProxy('/add', 'lab/Add')", "AttributeError: 'str' object has no attribute '_md5sum'",
         "write `rospy.ServiceProxy('/add', Add)`"),
        (6, "rospy.ServiceProxy(Add, '/add')", "AttributeError: type object 'Add' has no attribute 'startswith'",
         "write `rospy.ServiceProxy('/add', Add)`"),
        (6, "self.server = actionlib.SimpleActionServer('/count', Count, execute_cb=self.go)",
         "RecursionError: maximum recursion depth exceeded",
         "write `self.server = actionlib.SimpleActionServer('/count', CountAction, execute_cb=self.go)`"),
        (6, "actionlib.SimpleActionClient('/count', CountGoal)",
         "AttributeError: 'CountGoal' object has no attribute 'action_goal'",
         "write `actionlib.SimpleActionClient('/count', CountAction)`"),
        (6, "self.grid.data[row][column] = 100", "TypeError: 'int' object does not support item assignment",
         "write `self.grid.data[row * width + column]`, where `width` is how many there are in a row"),
        (6, "if mean < LIMIT:", "TypeError: '<' not supported between instances of 'Float32' and 'float'",
         "write `if mean.data < LIMIT:`"),
        (6, "add(1, 2)", "TypeError: Invalid number of arguments, args should be ['a', 'b', 'c'] args are(1, 2)",
         "give each of them a value: `a=…, b=…, c=…`"),
        (6, "add('1', 2)", "genpy.message.SerializationError: field a must be an integer type",
         "turn the value into one first: `int(…)`"),
        (6, "self.server.publish_feedback(CountResult(total))",
         "AttributeError: 'CountResult' object has no attribute 'count'",
         "write `self.server.publish_feedback(CountFeedback(total))`"),
        (6, "server.set_succeeded(feedback)", "AttributeError: 'CountFeedback' object has no attribute 'total'",
         "make it with `CountResult(…)`"),
        (6, "server.set_succeeded(total)", "AttributeError: 'int' object has no attribute 'total'",
         "make a message of it: `…Result(…)`"),
        (6, "client.send_goal(goal)", "AttributeError: 'float' object has no attribute 'secs'",
         "write `rospy.Duration(…)` around the number where the field gets it"),
        (6, "print(client.get_result().total)", "AttributeError: 'NoneType' object has no attribute 'total'",
         "above that line, write `client.wait_for_result()`"),
        (6, "server.set_succeeded(CountResult)", "AttributeError: 'member_descriptor' object has no attribute 'x'",
         "write brackets with its fields: `CountResult(…)`"),
        (6, "client.send_goal(goal)", "AttributeError: 'CountAction' object has no attribute 'target'",
         "make it with `CountGoal(…)`"),
        (6, "print('sum: %d' % answer.sum)", "AttributeError: 'ServiceProxy' object has no attribute 'sum'",
         ("call the proxy where `answer` gets its value: brackets with the request's values behind its name, "
          "as in `ask(…)`")),
        (6, "print('sum: %d' % answer)", "TypeError: %d format: a real number is required, not ServiceProxy",
         "call the proxy: brackets with the request's values behind its name, as in `ask(…)`"),
        (6, "answer = add(AddRequest)", "TypeError: request object is not a valid request message instance",
         "write brackets with its fields: `AddRequest(…)`"),
        (6, "a, b = map(float, sys.argv[0:2])", "ValueError: could not convert string to float: '/ws/lab/talker.py'",
         "write `a, b = map(float, sys.argv[1:3])`"),
        (6, "a = int(sys.argv[0]) + int(sys.argv[1])",
         "ValueError: invalid literal for int() with base 10: '/ws/lab/talker.py'",
         "write `a = int(sys.argv[1]) + int(sys.argv[2])`"),
        (6, "a = int(args[0])", "ValueError: invalid literal for int() with base 10: 'talker.py'",
         "begin at `sys.argv[1]`"),
        (6, "self.publisher.publish(self.grid)",
         "rospy.exceptions.ROSSerializationException: field data[] must be an integer type",
         "put whole numbers alone into `data`: no lists in it, and `int(…)` around any other number"),
        (6, "grid.data[row * width + x] = 100", "TypeError: list indices must be integers or slices, not float",
         "write `grid.data[int(row * width + x)] = 100`"),
        (6, "at = found.translation", "AttributeError: 'TransformStamped' object has no attribute 'translation'",
         "write `at = found.transform.translation`"),
        (6, "b.sendTransform(t, r, now, 'a', 'b')",
         "TypeError: TransformBroadcaster.sendTransform() takes 2 positional arguments but 6 were given",
         "give it the TransformStamped alone, or make the broadcaster with `tf.TransformBroadcaster()`"),
        (1, "import std_msgs.msg.String",
         "ModuleNotFoundError: No module named 'std_msgs.msg.String'; 'std_msgs.msg' is not a package",
         "write `from std_msgs.msg import String`"),
        (1, "import half.py", "ModuleNotFoundError: No module named 'half.py'; 'half' is not a package",
         "write half instead of half.py"),
        (1, "from std_msgs.mgs import String", "ModuleNotFoundError: No module named 'std_msgs.mgs'",
         "write std_msgs.msg instead of std_msgs.mgs"),
        (1, "from sensor_msgs.msgs import Imu", "ModuleNotFoundError: No module named 'sensor_msgs.msgs'",
         "write sensor_msgs.msg instead of sensor_msgs.msgs"),
    ],
)  # fmt: skip
def test_the_hint_is_the_line_as_it_should_be(tmp_path, line, source, error, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "talker.py").write_text(SCRIPT)
    package = facts_of(tmp_path)
    said = [
        "Traceback (most recent call last):",
        f'  File "/home/student/catkin_ws/src/{package.name}/src/talker.py", line {line}, in <module>',
        f"    {source}",
        error,
    ]
    (found,) = tracebacks(said)
    assert explain_traceback(found, package).hint == hint


@pytest.mark.parametrize(("first", "line"), [("", 3), ("#!/usr/bin/env python3\n", 4)])
def test_a_line_is_counted_without_the_first_line_that_the_arena_writes(tmp_path, first, line):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "talker.py").write_text(f"{first}import rospy\nrospy.init_node('talker')\nrospu.spin()\n")
    package = facts_of(tmp_path)
    end = explain_traceback(
        said(package, ("talker.py", 4, "rospu.spin()"), error="NameError: name 'rospu' is not defined"),
        package,
    )
    assert [place.line for place in end.citations] == [line]
    assert f"talker.py, line {line}" in end.cause
    assert end.hint == f"on line {line}, write rospy instead of rospu"


@pytest.mark.parametrize(
    ("source", "error", "hint"),
    [
        ("dx = goal.x - self.x", "unsupported operand type(s) for -: 'str' and 'float'",
         "on lines 2 and 3, write `float(input(…))` in place of `input(…)`"),
        ("while far > tolerance:", "'>' not supported between instances of 'float' and 'str'",
         "on line 5, write `float(input(…))` in place of `input(…)`"),
        ("total = self.n + self.text", "unsupported operand type(s) for +: 'int' and 'str'",
         "write `str(self.n)` instead of `self.n`"),
        ("n = side - 1", "unsupported operand type(s) for -: 'str' and 'int'",
         "turn the text into a number first: `float(…)`"),
    ],
)  # fmt: skip
def test_a_text_that_was_typed_is_made_a_number_where_it_is_asked_for(tmp_path, source, error, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    asked = (
        "goal.x = input('x')",
        "goal.y = input('y')",
        "side = float(input('side'))",
        "tolerance = input()",
        "names['a'] = input()",
        "self.name = input()",
    )
    (tmp_path / "go.py").write_text("\n".join(("#!/usr/bin/env python3", *asked)))
    package = facts_of(tmp_path)
    found = said(package, ("go.py", 9, source), error=f"TypeError: {error}")
    assert explain_traceback(found, package).hint == hint


def said(package, *frames, error):
    lines = ["Traceback (most recent call last):"]
    for file, line, source in frames:
        own = "/home/student/catkin_ws/src/" + package.name + "/"
        lines += [
            f'  File "{file if file.startswith("/") else own + file}", line {line}, in <module>',
            f"    {source}",
        ]
    return tracebacks([*lines, error])[0]


@pytest.mark.parametrize(
    ("call", "hint"),
    [
        ("heard(1)", "delete that call: ROS calls `heard` with each message"),
        ("heard('a')  # try", "delete that call: ROS calls `heard` with each message"),
        ("heard(last)", "leave out `.data` here"),
    ],
)
def test_a_callback_that_the_script_calls_itself_gets_no_message(tmp_path, call, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "talker.py").write_text(SCRIPT)
    frames = ("src/talker.py", 24, call), ("src/talker.py", 9, "print(msg.data)")
    package = facts_of(tmp_path)
    error = "AttributeError: 'int' object has no attribute 'data'"
    assert explain_traceback(said(package, *frames, error=error), package).hint == hint


LIBRARY = "/opt/ros/noetic/lib/python3/dist-packages/rospy/__init__.py"
IMPORTS = ("src/talker.py", 1, "import rospy")
INSIDE = (LIBRARY, 47, "from .client import spin")


@pytest.mark.parametrize(
    ("source", "error", "hint"),
    [
        ("from lab.action import CountAction, CountResult",
         "ModuleNotFoundError: No module named 'lab.action'",
         "write `from lab.msg import CountAction, CountResult`"),
        ("from lab.srv import Reading", "ImportError: cannot import name 'Reading' from 'lab.srv' (/d/__init__.py)",
         "write `from lab.msg import Reading`"),
        ("import lab.Reading", "ModuleNotFoundError: No module named 'lab.Reading'",
         "write `from lab.msg import Reading`"),
        ("from lab import Reading", "ImportError: cannot import name 'Reading' from 'lab' (/d/__init__.py)",
         "write `from lab.msg import Reading`"),
        ("from lab.msg import reading", "ImportError: cannot import name 'reading' from 'lab.msg' (/d/__init__.py)",
         "write `from lab.msg import Reading`"),
        ("from lab.msg import Count", "ImportError: cannot import name 'Count' from 'lab.msg' (/d/__init__.py)",
         "write `from lab.msg import CountAction`"),
        ("from std_msgs.msg import String, Reading",
         "ImportError: cannot import name 'Reading' from 'std_msgs.msg' (/d/__init__.py)",
         "write `from std_msgs.msg import String` and `from lab.msg import Reading`"),
        ("from beginner_tutorials.srv import Add, AddResponse",
         "ModuleNotFoundError: No module named 'beginner_tutorials'",
         "write `from lab.srv import Add, AddResponse`"),
        # the build has made some of them, and not these
        ("from lab.msg import Reading", "ImportError: cannot import name 'Reading' from 'lab.msg' (/d/__init__.py)",
         "list Reading.msg in add_message_files(…)"),
        ("from lab.srv import Sum", "ImportError: cannot import name 'Sum' from 'lab.srv' (/d/__init__.py)",
         "write the one that you mean instead of Sum"),
        # it has made none
        ("from lab.msg import Reading", "ModuleNotFoundError: No module named 'lab'",
         "first get the build to pass: catkin_make"),
    ],
)  # fmt: skip
def test_a_class_that_the_build_makes_is_imported_from_its_module(tmp_path, source, error, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "CMakeLists.txt").write_text("generate_messages()\n")
    for path, text in {
        "msg/Reading.msg": "",
        "srv/Add.srv": "---\n",
        "action/Count.action": "---\n---\n",
    }.items():
        (tmp_path / path).parent.mkdir()
        (tmp_path / path).write_text(text)
    (tmp_path / "node.py").write_text(SCRIPT)
    package = facts_of(tmp_path)
    end = explain_traceback(said(package, ("node.py", 1, source), error=error), package)
    assert end.hint == hint
    assert end.unbuilt == (not hint.startswith("write `from"))


@pytest.mark.parametrize(
    ("cmake", "error", "hint"),
    [
        ("add_service_files(FILES Sum.srv)", "NameError: name 'Add' is not defined. Did you mean: 'add'?",
         "list Add.srv in add_service_files(…)"),
        ("add_service_files(FILES Sum.srv)", "NameError: name 'AddResponse' is not defined",
         "list Add.srv in add_service_files(…)"),
        # the build makes it: the import is of another module, or comes later
        ("add_service_files(FILES Sum.srv Add.srv)", "NameError: name 'Add' is not defined", "check the spelling"),
        ("add_service_files(DIRECTORY srv)", "NameError: name 'Add' is not defined", "check the spelling"),
        ("add_service_files(FILES Sum.srv)", "NameError: name 'Sub' is not defined", "check the spelling"),
    ],
)  # fmt: skip
def test_a_name_that_a_star_does_not_bring_is_one_that_the_build_has_not_made(tmp_path, cmake, error, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "CMakeLists.txt").write_text(f"{cmake}\ngenerate_messages()\n")
    (tmp_path / "srv").mkdir()
    for name in ("Add", "Sum"):
        (tmp_path / "srv" / f"{name}.srv").write_text("---\n")
    source = "from lab.srv import *\nadd = rospy.ServiceProxy('add', Add)\n"
    (tmp_path / "node.py").write_text(source)
    package = facts_of(tmp_path)
    end = explain_traceback(said(package, ("node.py", 2, source.split("\n")[1]), error=error), package)
    assert end.hint.startswith(hint)
    assert (
        ("the build has not made it from srv/Add.srv" in end.cause) == end.unbuilt == hint.startswith("list")
    )
    assert "Did you mean" not in end.cause


def test_without_its_file_for_cmake_a_package_has_no_messages(tmp_path):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "srv").mkdir()
    (tmp_path / "srv" / "Add.srv").write_text("---\n")
    (tmp_path / "node.py").write_text("from lab.srv import Add\n")
    package = facts_of(tmp_path)
    raised = said(
        package, ("node.py", 1, "from lab.srv import Add"), error="ModuleNotFoundError: No module named 'lab'"
    )
    assert explain_traceback(raised, package).hint == (
        "first add the CMakeLists.txt that `catkin_create_pkg` writes. In it, list Add.srv in add_service_files(…), "
        "and call generate_messages(…)"
    )


@pytest.mark.parametrize(
    ("source", "hint"),
    [
        (
            "from lab.srv import Add, AddResponse",
            "write srv/Add.srv, list it in add_service_files(…), and call",
        ),
        ("from lab.srv import AddResponse", "write srv/Add.srv, list it in add_service_files(…), and call"),
        ("from lab.msg import *", "write the definition in msg/, list it in add_message_files(…), and call"),
        ("import lab", "delete line 1"),
    ],
)
def test_a_package_without_any_definition_is_told_what_to_write(tmp_path, source, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "CMakeLists.txt").write_text("catkin_package()\n")
    (tmp_path / "node.py").write_text(f"{source}\n")
    package = facts_of(tmp_path)
    raised = said(package, ("node.py", 1, source), error="ModuleNotFoundError: No module named 'lab'")
    assert explain_traceback(raised, package).hint.startswith(hint)


def test_the_message_is_that_of_the_package_that_is_named(tmp_path):
    made = "add_message_files(FILES Reading.msg)\ngenerate_messages()\n"
    for name, cmake in (("lab", ""), ("lab_msgs", made)):
        (tmp_path / name / "msg").mkdir(parents=True)
        (tmp_path / name / "msg" / "Reading.msg").write_text("int8 a\n")
        (tmp_path / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
        (tmp_path / name / "CMakeLists.txt").write_text(cmake)
    line = "from lab_msgs.msg import Reading"
    (tmp_path / "lab" / "node.py").write_text(f"{line}\n")
    package = facts_of(tmp_path / "lab").model_copy(
        update={"also": (facts_of(tmp_path / "lab_msgs", "lab_msgs"),)}
    )
    raised = said(package, ("node.py", 1, line), error="ModuleNotFoundError: No module named 'lab_msgs'")
    assert explain_traceback(raised, package).hint == "first get the build to pass: catkin_make"


@pytest.mark.parametrize(
    ("source", "error", "hint"),
    [
        ("return str(a)", "struct.error: required argument is not an integer", "give it an int: `int(…)` of a text"),
        ("s = rospy.Service('add', Add, add)", "rospy.service.ServiceException: service [/add] already registered",
         "make it once, above any loop"),
        ("return AddResponse(3)", "NameError: name 'AddResponse' is not defined",
         "write `from lab.srv import AddResponse` at the top"),
        ("x = Reading()", "NameError: name 'Reading' is not defined", "write `from lab.msg import Reading` at the top"),
        ("Reading(levl=1)", "AttributeError: levl is not an attribute of Reading", "write `level=` instead of `levl=`"),
        ("Reading(x=1)", "AttributeError: x is not an attribute of Reading", "write `level=` instead of `x=`"),
        ("found = buffer.lookup_transform('a', 'b', rospy.Time(0))",
         'tf2.LookupException: "a" passed to lookupTransform argument target_frame does not exist',
         "catch it, `try: … except tf2_ros.TransformException:`"),
        ("ask(a, b)", "genpy.message.SerializationError: field value must be float type",
         "on line 4, write `a, b = map(float, sys.argv[1:3])`"),
        ("ask(a, b)", "genpy.message.SerializationError: field value must be an integer type",
         "on line 4, write `a, b = map(int, sys.argv[1:3])`"),
        ("reading > 30", "TypeError: '>' not supported between instances of 'Reading' and 'int'",
         "take the field that you mean: `reading.…`"),
        ("abs(reading)", "TypeError: bad operand type for abs(): 'Reading'", "take one of its fields"),
        ("math.floor(point.x / 2)", "ValueError: cannot convert float NaN to integer",
         "go on to this line only if `math.isfinite(point.x)`"),
        ("int(point.y)", "OverflowError: cannot convert float infinity to integer",
         "go on to this line only if `math.isfinite(point.y)`"),
        ("time.time() - start < goal.wait", "TypeError: '<' not supported between instances of 'float' and 'Duration'",
         "write `.to_sec()` behind that side"),
        ("end = rospy.Time.now() + 3.0", "TypeError: unsupported operand type(s) for +: 'Time' and 'float'",
         "write `end = rospy.Time.now() + rospy.Duration(3.0)`"),
        ("msg.header.stamp = 3 + now", "TypeError: unsupported operand type(s) for +: 'int' and 'Time'",
         "write `msg.header.stamp = rospy.Duration(3) + now`"),
        ("start < goal.wait", "TypeError: '<' not supported between instances of 'float' and 'Duration'",
         "write `start < goal.wait.to_sec()`"),
        ("return AddResponse(1, 2)",
         "TypeError: Invalid number of arguments, args should be ['sum'] args are(1, 2)", "give it one value: `sum=…`"),
        ("answer.sum", "AttributeError: 'AddRequest' object has no attribute 'sum'",
         "make it as AddResponse(), not as AddRequest()"),
        ("publisher.publish(reading)",
         "rospy.exceptions.ROSSerializationException: field name is a non-ascii string",
         "compare the value of each of the message's other fields"),
        ("r ^ 2 - 1.0", "TypeError: unsupported operand type(s) for ^: 'float' and 'int'", "write `r ** 2 - 1.0`"),
        ("open('/home/anna/a.csv', 'w')", "FileNotFoundError: [Errno 2] No such file or directory: '/home/anna/a.csv'",
         "`import os`, and open `os.path.expanduser('~/a.csv')`"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_messages_is_told_with_their_fields(tmp_path, source, error, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    for path, text in {
        "msg/Reading.msg": "int32 level\n",
        "srv/Add.srv": "int64 a\n---\nint64 sum\n",
    }.items():
        (tmp_path / path).parent.mkdir()
        (tmp_path / path).write_text(text)
    (tmp_path / "node.py").write_text(
        f"import sys\nimport rospy\n\na, b = sys.argv[1:3]\nx = {source}\n".replace("x = return", "x =")
    )
    package = facts_of(tmp_path)
    assert hint in explain_traceback(said(package, ("node.py", 5, source), error=error), package).hint


def test_a_number_in_place_of_a_field_with_fields_is_told_with_its_name(tmp_path):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "node.py").write_text(SCRIPT)
    package = facts_of(tmp_path)
    own, twist = "/ws/src/lab/node.py", "/usr/lib/python3/dist-packages/geometry_msgs/msg/_Twist.py"
    lines = [
        "Traceback (most recent call last):",
        f'  File "{own}", line 4, in <module>', "    publisher.publish(command)",
        f'  File "{twist}", line 75, in serialize', "    buff.write(_get_struct_6d().pack(_x.linear.x, _x.angular.x))",
        "                                     ^^^^^^^^^^^",
        "AttributeError: 'float' object has no attribute 'x'",
    ]  # fmt: skip
    end = explain_traceback(tracebacks(lines)[0], package)
    assert end.hint == "write `.linear.x = …`, not `.linear = …`"


@pytest.mark.parametrize(
    ("files", "made", "cause", "hint"),
    [
        (["src/talker.py", "src/texts.py"], True, "does not look beside it",
         "write `import os, sys; sys.path.insert(0, os.path.dirname(__file__))` above the import"),
        (["src/talker.py", "scripts/texts.py"], False, "scripts/texts.py is in another folder",
         "os.path.join(os.path.dirname(__file__), '../scripts')"),
        (["src/talker.py", "src/texts.py"], False, "", "check the spelling of the import"),
        (["src/talker.py", "build/texts.py"], True, "", "a module of the student's own has to be pushed"),
    ],
)  # fmt: skip
def test_a_module_of_the_students_own_is_told_from_one_that_is_not_there(tmp_path, files, made, cause, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    for file in files:
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text(SCRIPT)
    package = facts_of(tmp_path)
    frames = [("/home/student/catkin_ws/devel/lib/lab/talker.py", 15, "exec(…)")] if made else []
    error = "ModuleNotFoundError: No module named 'texts'"
    end = explain_traceback(
        said(package, *frames, ("src/talker.py", 4, "import texts"), error=error), package
    )
    assert cause in end.cause
    assert hint in end.hint


@pytest.mark.parametrize(
    ("file", "line", "error", "cause"),
    [
        ("scripts/lab.py", "from lab.msg import Reading",
         "ModuleNotFoundError: No module named 'lab.msg'; 'lab' is not a package", "the package lab is meant"),
        ("scripts/std_msgs.py", "from std_msgs.msg import String",
         "ModuleNotFoundError: No module named 'std_msgs.msg'; 'std_msgs' is not a package",
         "the package std_msgs is meant"),
        ("scripts/turtle.py", "import turtle",
         "AttributeError: partially initialized module 'turtle' has no attribute 'Turtle' (most likely due to …)",
         "the module turtle is meant"),
    ],
)  # fmt: skip
def test_a_script_with_the_name_of_what_it_imports_is_told(tmp_path, file, line, error, cause):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/Reading.msg").write_text("int32 level\n")
    (tmp_path / "scripts").mkdir()
    (tmp_path / file).write_text(SCRIPT)
    package = facts_of(tmp_path)
    end = explain_traceback(said(package, (file, 1, line), error=error), package)
    assert f"Python finds {file} where {cause}" in end.cause
    assert end.hint == f"give {file} another name, everywhere it is named"
    assert not end.unbuilt


@pytest.mark.parametrize(
    ("setup", "calls", "hint"),
    [
        (False, "", "write setup.py as http"),
        (True, "", "call catkin_python_setup() above catkin_package(…)"),
        (True, "catkin_python_setup()\n", "check the spelling of the import"),
    ],
)
def test_a_python_package_that_the_build_does_not_make_known_is_told(tmp_path, setup, calls, hint):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "CMakeLists.txt").write_text(f"project(lab)\n{calls}catkin_package()\n")
    for file in ("src/lab/__init__.py", "scripts/talker.py", *(["setup.py"] if setup else [])):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(SCRIPT)
    package = facts_of(tmp_path)
    error = "ModuleNotFoundError: No module named 'lab'"
    line = ("scripts/talker.py", 4, "from lab.texts import hello")
    assert hint in explain_traceback(said(package, line, error=error), package).hint


@pytest.mark.parametrize(
    ("files", "frames", "error", "of_machine"),
    [
        ((), (IMPORTS, INSIDE), "ImportError: cannot import name 'spin' from 'rospy.client'", True),
        ((), (IMPORTS, INSIDE), "ModuleNotFoundError: No module named 'rosgraph_'", True),
        ((), (IMPORTS, (LIBRARY, 9, "x = (")), "SyntaxError: '(' was never closed", True),
        ((), (IMPORTS, INSIDE), "AttributeError: module 'yaml' has no attribute 'load'", True),
        ((), (INSIDE,), "ImportError: cannot import name 'spin' from 'rospy.client'", True),
        # the package's own yaml.py is what is imported
        (("src/yaml.py",), (IMPORTS, INSIDE), "AttributeError: module 'yaml' has no attribute 'load'", False),
        # a call, not an import
        ((), (("src/talker.py", 4, "rospy.spin()"), INSIDE), "TypeError: spin() takes no arguments", False),
        ((), (("src/talker.py", 1, "import rospi"),), "ModuleNotFoundError: No module named 'rospi'", False),
        ((), (INSIDE,), "ROSException: publish() to a closed topic", False),
    ],
)  # fmt: skip
def test_a_broken_module_of_the_machine_is_not_the_students(tmp_path, files, frames, error, of_machine):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "src").mkdir()
    for file in ("src/talker.py", *files):
        (tmp_path / file).write_text(SCRIPT)
    package = facts_of(tmp_path)
    end = explain_traceback(said(package, *frames, error=error), package)
    assert end.of_machine == of_machine
    assert (LIBRARY in end.cause) == of_machine


@pytest.mark.parametrize(
    ("file", "of_machine"), [("scripts/pygame", True), ("scripts/pygame.py", False), ("msg/Pygame.msg", True)]
)
def test_a_picture_with_a_modules_name_is_no_module(tmp_path, file, of_machine):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "a.py").write_text("import pygame\npygame.init()\n")
    (tmp_path / file).parent.mkdir()
    (tmp_path / file).write_text("%!PS-Adobe-3.0\n")
    package = facts_of(tmp_path)
    error = "ModuleNotFoundError: No module named 'pygame'"
    assert (
        explain_traceback(said(package, ("a.py", 1, "import pygame"), error=error), package).of_machine
        == of_machine
    )


def test_a_module_that_is_used_and_not_imported_is_meant_by_one_that_is_not_there(tmp_path):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "a.py").write_text("import ros\nrospy.init_node('a')\n")
    (tmp_path / "b.py").write_text("import ros\nros.start()\n")
    package = facts_of(tmp_path)
    error = "ModuleNotFoundError: No module named 'ros'"
    here = explain_traceback(said(package, ("a.py", 1, "import ros"), error=error), package)
    assert here.hint == "write rospy instead of ros"
    assert not here.of_machine
    assert explain_traceback(said(package, ("b.py", 1, "import ros"), error=error), package).of_machine


@pytest.mark.parametrize(
    ("source", "error"),
    [
        ("rospy.loginfo(eval(data.data))", "SyntaxError: invalid syntax"),
        ("rospy.loginfo(eval(data.data))", "NameError: name 'hello' is not defined"),
    ],
)
def test_a_message_that_is_run_as_code_is_told(tmp_path, source, error):
    (tmp_path / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / "listener.py").write_text(f"import rospy\ndef callback(data):\n    {source}\n")
    package = facts_of(tmp_path)
    end = explain_traceback(
        tracebacks(
            [
                "Traceback (most recent call last):",
                f'  File "/home/student/catkin_ws/src/{package.name}/listener.py", line 3, in callback',
                f"    {source}",
                '  File "<string>", line 1, in <module>',
                error,
            ]
        )[0],
        package,
    )
    assert end.cause.endswith(
        "(listener.py, line 3): `eval(…)` takes the text that it is given for Python code"
    )
    assert end.hint == "leave `eval(…)` out, and use the text as it is"
