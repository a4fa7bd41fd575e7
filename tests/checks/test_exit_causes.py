"""What is said of the exceptions that end a script, and that habits of other languages raise."""

from __future__ import annotations

import pytest

from grader.checks.support.console_output import tracebacks
from grader.checks.support.exit_causes import explain_traceback
from tests.checks.tracebacks import SCRIPT, explained, package_of, raised

pytestmark = pytest.mark.usefixtures("without_processes")


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
        (6, "r = rospy.Rate(1 // 10)", "ZeroDivisionError: float division by zero",
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
        (6, "rospy.loginfo('I send ' + text)", 'TypeError: can only concatenate str (not "tuple") to str',
         "where text gets its value, write `%` instead of the comma behind the text"),
        (6, "rospy.loginfo('I heard ' + msg)", 'TypeError: can only concatenate str (not "String") to str',
         "write `msg.data` instead of `msg`"),
        (6, "text = 'I heard ' + number", 'TypeError: can only concatenate str (not "Int8") to str',
         "write `str(number.data)` instead of `number`"),
        (6, "text = 'at ' + where", 'TypeError: can only concatenate str (not "Point") to str',
         "write `str(where.x)` instead of `where`"),
        (6, "n = int(msg)", "TypeError: int() argument must be a string, a bytes-like object or a number, not 'Int8'",
         "write `msg.data` instead of `msg`"),
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
        (6, "number_pub.publish(n)", "ROSSerializationException: field data exceeds specified width [int8]",
         "publish only whole numbers from -128 to 127: a counter has to start again in time"),
        (6, "number_pub.publish(n)", "struct.error: ubyte format requires 0 <= number <= 255",
         "publish only whole numbers from 0 to 255: a counter has to start again in time"),
        (6, "number_pub.publish(n)", "TypeError: field data must be of type bytes or an ascii string",
         "swap `number_pub` and `text_pub` on lines 13 and 14, or where they publish"),
        (6, "other_pub.publish(n)", "TypeError: field data must be of type bytes or an ascii string",
         "publish a string here, `str(…)`; numbers go to the publisher of their own topic"),
        (6, "server.publish_feedback(said)",
         "ROSSerializationException: field feedback.place must be an integer type",
         "give its field place a whole number, `int(…)`, and each of its other fields a value of its type too"),
        (6, "return TriggerResponse(True, said) + 'True'",
         "TypeError: unsupported operand type(s) for +: 'TriggerResponse' and 'str'",
         "leave out `'True'` and the `+`: `TriggerResponse(True, said)` alone is the answer"),
        (6, "return 'True' + srv.TurnResponse(n)", 'TypeError: can only concatenate str (not "TurnResponse") to str',
         "leave out `'True'` and the `+`: `srv.TurnResponse(n)` alone is the answer"),
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
         "write `float(reading.temperature)` instead of `reading.temperature`"),
        (6, "elif n >= LIMIT:", "TypeError: '>=' not supported between instances of 'int' and 'str'",
         "write `float(LIMIT)` instead of `LIMIT`"),
        (6, "if str(n) > 3:", "TypeError: '>' not supported between instances of 'str' and 'int'",
         "write `n` instead of `str(n)`"),
        (6, "hear()", "TypeError: hear() missing 1 required positional argument: 'msg'",
         "put 'msg' into its brackets, or remove the call: ROS calls a callback by itself"),
        (6, "pub.publish('heard {}').format(3)", "AttributeError: 'NoneType' object has no attribute 'format'",
         "write `.format(…)` behind the string, in the brackets of `publish(…)`"),
        (6, "print('heard %s') % 3", "TypeError: unsupported operand type(s) for %: 'NoneType' and 'int'",
         "write `%` behind the string, in the brackets of `print(…)`"),
        (6, "text = text + str(3)", "TypeError: 'str' object is not callable", "give the variable `str` another name"),
        (6, "text = 'The time is {:.1f}'.format(self.now)",
         "TypeError: unsupported format string passed to method.__format__", "write `self.now()`"),
        (6, "text = f'{rospy.get_time:.2f}'",
         "TypeError: unsupported format string passed to function.__format__", "write `rospy.get_time()`"),
        (6, "Robot().greet().stay()", "AttributeError: 'NoneType' object has no attribute 'stay'",
         "write `return self` at the end of `greet`"),
        (6, "now = event.current", "AttributeError: 'TimerEvent' object has no attribute 'current'",
         "write `.current_real`"),
        (6, "print(event.last_real.to_sec())", "AttributeError: 'NoneType' object has no attribute 'to_sec'",
         "write `event.current_real`"),
        (6, "dt = (event.current_real - event.last_real).to_sec()",
         "TypeError: unsupported operand type(s) for -: 'Time' and 'NoneType'",
         "above that line, write `if event.last_real is None:`, and `return` in it"),
        (6, "if event.last_duration > 0.1:", "TypeError: '>' not supported between instances of 'NoneType' and 'float'",
         "above that line, write `if event.last_duration is None:`, and `return` in it"),
        (6, "print('heard', msg.data())", "TypeError: 'str' object is not callable",
         "write `msg.data` without the brackets behind it"),
        (6, "self.count()", "TypeError: 'int' object is not callable",
         "give the variable and the function different names"),
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
         "write `self.grid.data[row * width + column]`, where `width` is how many are in a row"),
        (6, "if mean < LIMIT:", "TypeError: '<' not supported between instances of 'Float32' and 'float'",
         "write `if mean.data < LIMIT:`"),
        (6, "add(1, 2)", "TypeError: Invalid number of arguments, args should be ['a', 'b', 'c'] args are(1, 2)",
         "give each of them a value: `a=…, b=…, c=…`"),
        (6, "pub.publish(next(numbers))", "StopIteration",
         "let it begin again: `while True:` around the loop in it that has a `yield`, or `itertools.cycle(…)`"),
        (6, "out.send(msg)", "TypeError: can't send non-None value to a just-started generator",
         "call `next(…)` on it once, on the line below the one that makes it"),
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
        (6, "a = int(sys.argv[0])", "ValueError: invalid literal for int() with base 10: '/w/add.py'",
         "write `a = int(sys.argv[1])`, and read each argument behind it one place further on too"),
        (6, "a = int(args[0])", "ValueError: invalid literal for int() with base 10: 'talker.py'",
         "begin at `sys.argv[1]`"),
        (6, "self.publisher.publish(self.grid)",
         "rospy.exceptions.ROSSerializationException: field data[] must be an integer type",
         "put whole numbers alone into `data`: no lists in it, and `int(…)` around any other number"),
        (6, "grid.data[row * width + x] = 100", "TypeError: list indices must be integers or slices, not float",
         "write `grid.data[int(row * width + x)] = 100`"),
        (6, "v = rows[y / 2][x / 2]", "TypeError: list indices must be integers or slices, not float",
         "write `v = rows[int(y / 2)][int(x / 2)]`"),
        (6, "v = rows[y][cells[x / 2]]", "TypeError: list indices must be integers or slices, not float",
         "write `v = rows[y][cells[int(x / 2)]]`"),
        (6, "v = rows[y][x]", "TypeError: list indices must be integers or slices, not float",
         "make it one with `int(…)`"),
        (6, "at = found.translation", "AttributeError: 'TransformStamped' object has no attribute 'translation'",
         "write `at = found.transform.translation`"),
        (6, "b.sendTransform(t, r, now, 'a', 'b')",
         "TypeError: TransformBroadcaster.sendTransform() takes 2 positional arguments but 6 were given",
         "give it the TransformStamped alone, or make the broadcaster with `tf.TransformBroadcaster()`"),
        (6, "pub.publish(student)", "TypeError: expected [string] but got [lab/Student]",
         "name Student in `rospy.Publisher(…)`, and import it"),
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
    frame = ("src/talker.py", line + 1, source)  # below the first line that the arena writes
    assert explained(tmp_path, {"src/talker.py": SCRIPT}, frame, error=error).hint == hint


def test_a_second_node_of_a_script_is_not_told_to_come_first(tmp_path):
    text = "import rospy\ndef hear():\n    rospy.init_node('hear')\nrospy.init_node('talker')\nhear()\n"
    said = "rospy.init_node() has already been called with different arguments: ('talker', [])"
    frame, error = ("talker.py", 4, "rospy.init_node('hear')"), f"rospy.exceptions.ROSException: {said}"
    end = explained(tmp_path, {"talker.py": text}, frame, error=error)
    assert "is called a second time" in end.cause
    assert end.hint == "one script is one node: call `rospy.init_node(…)` once"


@pytest.mark.parametrize(("first", "line"), [("", 3), ("#!/usr/bin/env python3\n", 4)])
def test_a_line_is_counted_without_the_first_line_that_the_arena_writes(tmp_path, first, line):
    files = {"talker.py": f"{first}import rospy\nrospy.init_node('talker')\nrospu.spin()\n"}
    frame = ("talker.py", 4, "rospu.spin()")
    end = explained(tmp_path, files, frame, error="NameError: name 'rospu' is not defined")
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
        ("text = 'now ' - str(n)", "unsupported operand type(s) for -: 'str' and 'str'",
         "write `+`, or make numbers of both"),
        ("n = side - 1", "unsupported operand type(s) for -: 'str' and 'int'",
         "turn the text into a number first: `float(…)`"),
    ],
)  # fmt: skip
def test_a_text_that_was_typed_is_made_a_number_where_it_is_asked_for(tmp_path, source, error, hint):
    asked = (
        "goal.x = input('x')",
        "goal.y = input('y')",
        "side = float(input('side'))",
        "tolerance = input()",
        "names['a'] = input()",
        "self.name = input()",
    )
    files = {"go.py": "\n".join(("#!/usr/bin/env python3", *asked))}
    assert explained(tmp_path, files, ("go.py", 9, source), error=f"TypeError: {error}").hint == hint


@pytest.mark.parametrize(
    ("call", "hint"),
    [
        ("heard(1)", "delete that call: ROS calls `heard` with each message"),
        ("heard('a')  # try", "delete that call: ROS calls `heard` with each message"),
        ("heard(last)", "leave out `.data` here"),
    ],
)
def test_a_callback_that_the_script_calls_itself_gets_no_message(tmp_path, call, hint):
    frames = ("src/talker.py", 24, call), ("src/talker.py", 9, "print(msg.data)")
    error = "AttributeError: 'int' object has no attribute 'data'"
    assert explained(tmp_path, {"src/talker.py": SCRIPT}, *frames, error=error).hint == hint


@pytest.mark.parametrize(
    ("source", "error", "hint"),
    [
        ("return str(a)", "struct.error: required argument is not an integer", "give it an int: `int(…)` of a text"),
        ("return FitResponse(changed, result)", "struct.error: required argument is not an integer",
         "write `return FitResponse(result, changed)`"),
        ("return FitResponse(a != 3, self.result)", "struct.error: required argument is not an integer",
         "write `return FitResponse(self.result, a != 3)`"),
        ("return FitResponse(result, changed)", "struct.error: required argument is not an integer", "give it an int"),
        ("add('a')", "TypeError: Invalid number of arguments, args should be [] args are('a',)",
         "write the handout's fields into its .msg or .srv, and build again"),
        ("near = msg.ranges[360]", "IndexError: tuple index out of range", "choose a smaller index than 360"),
        ("sys.path.remove('/opt')", "ValueError: list.remove(x): x not in list", "or write `if … in …:`"),
        ("front = msg.ranges[0]", "IndexError: tuple index out of range", "check `len(msg.ranges) > 0` first"),
        ("print('{}'.format(msg.ranges[15]))", "IndexError: tuple index out of range", "a smaller index than 15"),
        ("near = min(msg.ranges[-45:45])", "ValueError: min() arg is an empty sequence",
         "write `msg.ranges[-45:] + msg.ranges[:45]`"),
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
         "write `reading.level` instead of `reading`"),
        ("abs(reading)", "TypeError: bad operand type for abs(): 'Reading'",
         "write `reading.level` instead of `reading`"),
        ("range(1, goal)", "TypeError: 'AddRequest' object cannot be interpreted as an integer",
         "write `goal.a` instead of `goal`"),
        ("add(1, 2)", "rospy.service.ServiceException: service [/add] responded with an error: b'not today'",
         "write `except rospy.ServiceException as error:`"),
        ("add(1, 2)", "rospy.service.ServiceException: service [/add] responded with an error: b'error processing it'",
         "look at that line"),
        ("range(first, goal)", "TypeError: 'AddRequest' object cannot be interpreted as an integer",
         "look at that line"),
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
        ("raise 'too far'", "TypeError: exceptions must derive from BaseException", "`raise ValueError(…)`"),
        ("pub.publish(str(a))", "rospy.exceptions.ROSSerializationException: field data is not a bool",
         "publish a bool, without `str(…)`"),
        ("self.res.count = self.count", "AttributeError: 'AddResponse' object has no attribute 'count'",
         "write `self.res.sum = self.count`"),
        ("self.res.a", "AttributeError: 'AddResponse' object has no attribute 'a'", "write `self.res.sum`"),
        ("publisher.publish(reading)",
         "rospy.exceptions.ROSSerializationException: field name is a non-ascii string",
         "compare the value of each of the message's other fields"),
        ("r ^ 2 - 1.0", "TypeError: unsupported operand type(s) for ^: 'float' and 'int'", "write `r ** 2 - 1.0`"),
        ("open('/home/anna/a.csv', 'w')", "FileNotFoundError: [Errno 2] No such file or directory: '/home/anna/a.csv'",
         "open `os.path.expanduser('~/a.csv')`, with `import os` at the top"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_messages_is_told_with_their_fields(tmp_path, source, error, hint):
    text = f"import sys\nimport rospy\n\na, b = sys.argv[1:3]\nx = {source}\n"
    files = {
        "msg/Reading.msg": "int32 level\n",
        "srv/Add.srv": "int64 a\n---\nint64 sum\n",
        "srv/Fit.srv": "float64 a\n---\nfloat64 result\nbool changed\n",
        "node.py": text.replace("x = return", "x =").replace("x = raise", "x ="),
    }
    assert hint in explained(tmp_path, files, ("node.py", 5, source), error=error).hint


def test_a_number_in_place_of_a_field_with_fields_is_told_with_its_name(tmp_path):
    package = package_of(tmp_path, {"node.py": SCRIPT})
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


@pytest.mark.parametrize("error", ["SyntaxError: invalid syntax", "NameError: name 'hello' is not defined"])
def test_a_message_that_is_run_as_code_is_told(tmp_path, error):
    source = "rospy.loginfo(eval(data.data))"
    files = {"listener.py": f"import rospy\ndef callback(data):\n    {source}\n"}
    end = explained(tmp_path, files, ("listener.py", 3, source), ("<string>", 1, ""), error=error)
    assert end.cause.endswith(
        "(listener.py, line 3): `eval(…)` takes the text that it is given for Python code"
    )
    assert end.hint == "leave `eval(…)` out, and use the text as it is"


def test_a_float_for_the_seconds_of_a_stamp_is_told_with_its_line(tmp_path):
    text = "msg.header.stamp.secs = rospy.get_time()\npub.publish(msg)\n"
    error = "rospy.exceptions.ROSSerializationException: <class 'struct.error'>: 'required argument is not an integer' "
    error += "when writing 'header:"
    found = explained(tmp_path, {"node.py": text}, ("node.py", 2, "pub.publish(msg)"), error=error)
    assert found.hint == "on line 1, write `msg.header.stamp = rospy.Time.now()`"


def test_arguments_that_are_texts_are_told_with_all_of_their_lines(tmp_path):
    """Python names the first field alone; an argument that the call does not get is none of them."""
    text = "x = sys.argv[1]\ny = sys.argv[2]\nname = sys.argv[3]\nadd(x, y)\n"
    error = "rospy.service.SerializationError: field a must be an integer type"
    found = explained(tmp_path, {"node.py": text}, ("node.py", 4, "add(x, y)"), error=error)
    assert found.hint == "on line 1, write `x = int(sys.argv[1])`; on line 2, write `y = int(sys.argv[2])`"


def test_what_a_script_raises_itself_is_no_riddle_of_pythons(tmp_path):
    found = explained(
        tmp_path,
        {"node.py": "raise Exception('far')\n"},
        ("node.py", 1, "raise Exception('far')"),
        error="Exception: far",
    )
    assert found.hint.startswith("the script raises this itself")


def test_a_message_of_the_other_package_is_told_with_its_import(tmp_path):
    source = "from lab.msg import Reading"
    package = package_of(tmp_path / "lab", {"node.py": source})
    also = package_of(tmp_path / "lab_msgs", {"msg/Reading.msg": "int32 level\n"}, "lab_msgs")
    both = package.model_copy(update={"also": (also,)})
    error = "ModuleNotFoundError: No module named 'lab'"
    found = explain_traceback(raised(both, ("node.py", 1, source), error=error), both)
    assert found.hint == "write `from lab_msgs.msg import Reading`"


@pytest.mark.parametrize("encoding", ["iso-8859-1", "utf-8"])
def test_a_script_in_an_old_encoding_is_not_read_by_what_the_build_makes_of_it(tmp_path, encoding) -> None:
    files = {"talker.py": f"# coding: {encoding}\n# é\n".encode(encoding)}
    error = (
        "UnicodeDecodeError: 'utf-8' codec can't decode byte 0xe9 in position 60: invalid continuation byte"
    )
    wrapper = "/home/student/catkin_ws/devel/lib/lab/talker.py"
    frame = (wrapper, 15, "exec(compile(fh.read(), python_script, 'exec'), context)")
    end = explained(tmp_path, files, frame, error=error)
    assert ("as UTF-8 in your editor" in end.hint) == (encoding != "utf-8")


DECORATED = "def once(f):\n    def inner():\n        f()\n@once\ndef report():\n    pass\nreport()\n"
PARTIAL = (
    "def step(publisher, size, event):\n    publisher.publish(size)\nt = Timer(1, partial(step, size, pub))\n"
)
CLOSED = "with open('a') as f:\n    n = Node(f)\nrospy.spin()\n"


@pytest.mark.parametrize(
    ("text", "line", "error", "hint"),
    [
        (DECORATED, 7, "TypeError: 'NoneType' object is not callable", "below line 3, write `return inner` at the end"),
        (PARTIAL, 2, "AttributeError: 'float' object has no attribute 'publish'", "on line 3, swap `size` and `pub`"),
        (CLOSED, 2, "ValueError: I/O operation on closed file", "indent line 3 like line 2"),
        ("def hear(msg):\n    file.write('a')\n", 2, "ValueError: I/O operation on closed file.",
         "close the file when the node ends"),
    ],
)  # fmt: skip
def test_an_error_that_another_line_brings_about_is_told_with_that_line(tmp_path, text, line, error, hint):
    frame = ("node.py", line, text.splitlines()[line - 1].strip())
    assert explained(tmp_path, {"node.py": text}, frame, error=error).hint.startswith(hint)


def test_a_parameter_that_is_read_where_it_is_not_set_is_told_with_its_condition(tmp_path):
    text = "import rospy\nif not rospy.has_param('~a'):\n    a = rospy.get_param('~a')\n"
    frame = ("node.py", 3, "a = rospy.get_param('~a')")
    found = explained(tmp_path, {"node.py": text}, frame, error="KeyError: '~a'")
    assert found.hint == "on line 2, write the condition without its `not`"


@pytest.mark.parametrize(
    ("caught", "error", "hint"),
    [
        ("rospy.ROSException as e", "rospy.service.ServiceException: service [/add] responded with an error: b'no'",
         "on line 4, write `except rospy.ServiceException as e:`"),
        ("rospy.ServiceException", "rospy.exceptions.ROSException: timeout exceeded while waiting for service /add",
         "on line 4, write `except rospy.ROSException:`"),
        ("tf2_ros.LookupException", "tf2_ros.ExtrapolationException: Lookup would require extrapolation",
         "on line 4, write `except tf2_ros.TransformException:`"),
        ("(tf.LookupException, tf.ConnectivityException)", "tf2_ros.ExtrapolationException: into the future",
         "on line 4, write `except tf.Exception:`"),
        ("rospy.ROSInterruptException", "rospy.service.ServiceException: service [/add] responded with an error: b'no'",
         "put the call below `try:`, and write `except rospy.ServiceException as error:` for it"),
        ("rospy.ServiceException", "rospy.service.ServiceException: service [/add] responded with an error: b'no'",
         "put the call below `try:`, and write `except rospy.ServiceException as error:` for it"),
    ],
)  # fmt: skip
def test_an_except_for_another_exception_is_told_with_its_line(tmp_path, caught, error, hint):
    files = {"node.py": f"import rospy\ntry:\n    ask()\nexcept {caught}:\n    pass\n"}
    assert explained(tmp_path, files, ("node.py", 3, "ask()"), error=error).hint == hint
