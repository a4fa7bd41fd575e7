"""Slips of C++ sources: callbacks that wait, angles in degrees, and arguments that may not be there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.package.cpp import slips_of
from grader.package.repairs import find_repairs
from tests.package.repairing import WANTED, package
from tests.package.trees import facts_of

NODE = """\
#include <ros/ros.h>
// while (true) in a comment
void hear(const std_msgs::Float32::ConstPtr& distance)
{
  %s
}

int main(int argc, char** argv)
{
  ros::Subscriber distances = node.subscribe("/distance", 10, %s);
  while (ros::ok()) ros::Duration(5).sleep(), ros::spinOnce();
}
"""


ASKS = "write `while (ros::ok())`"


def _told(line: str, given: str = "hear") -> list[str]:
    found = [one for one in slips_of("src/node.cpp", NODE % (line, given)) if one.kind != "deaf"]
    return [f"{one.line}: {one.message}; {one.fix}" for one in found]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (
            "while (ros::ok()) { mean.publish(message); }",
            "the loop in the callback `hear`, line 5, never ends",
        ),
        ("for (;;) mean.publish(message);", "the loop in the callback `hear`, line 5, never ends"),
        ("ros::Duration(1.0).sleep();", "the callback `hear` sleeps on line 5"),
        ("usleep(500000);", "the callback `hear` sleeps on line 5"),
        ("rate.sleep();", "the callback `hear` sleeps on line 5"),
        ("ros::Duration d(1); d.sleep();", "the callback `hear` sleeps on line 5"),
        ("double wait = 2; ros::Duration(wait).sleep();", "the callback `hear` sleeps on line 5"),
        (
            "std::this_thread::sleep_for(std::chrono::milliseconds(300));",
            "the callback `hear` sleeps on line 5",
        ),
        ("ros::spin();", "the callback `hear` calls spin() on line 5"),
        (
            "while (ros::ok() && x < 3) { step(); rate.sleep(); ros::spinOnce(); }",
            "the loop in the callback `hear`, line 5, sleeps in each turn; keep in it only what came",
        ),
        (
            "for (int i = 0; i < 3; i++) { if (far) { ros::Duration(1).sleep(); } }",
            "the loop in the callback `hear`, line 5, sleeps in each turn",
        ),
        (
            "for (int i = 0; i < 3; i++) { add(i); } sleep(1);",
            "the callback `hear` sleeps on line 5; delete line 5",
        ),
    ],
)
@pytest.mark.parametrize(
    "given",
    [
        "hear",
        "&Node::hear, this",
        "boost::bind(&Node::hear, this, boost::placeholders::_1)",
        "boost::bind(&hear, _1, boost::ref(queue))",
        "std::bind(&Node::hear, this, std::placeholders::_1)",
        "hear, ros::TransportHints().tcpNoDelay()",
    ],
)
def test_a_callback_that_waits(line: str, told: str, given: str) -> None:
    (found,) = _told(line, given)
    assert re.match(rf"5: {re.escape(told)}(?:[;,]|$)", found)


LAMBDA = """\
  auto kept = [this](const std_msgs::Float32::ConstPtr& m) { ros::Duration(2).sleep(); };
  ros::Subscriber first = node.subscribe<std_msgs::Float32>("/first", 10, kept);
  ros::Subscriber second = node.subscribe<std_msgs::Float32>(
      "/second", 10, [&mean, this](const std_msgs::Float32::ConstPtr& m) -> void {
        hear(m, count);
        while (true) mean.publish(m);
      });
  ros::Subscriber third = node.subscribe<std_msgs::Float32>("/third", 10, [](auto m) { print(m, 5); });
  void print() { ros::spin(); }
"""


def test_a_lambda_that_waits() -> None:
    assert [f"{one.line}: {one.message}" for one in slips_of("src/node.cpp", LAMBDA)] == [
        "1: the callback `kept` sleeps on line 1",
        "6: the loop in the callback on line 4, line 6, never ends",
    ]


@pytest.mark.parametrize(
    "line",
    [
        "while (true) { if (done) break; }",
        "ros::Duration(0.01).sleep();",
        "usleep(1000);",
        'ROS_INFO("sleep(5) %d", distance->data);',
        "while (i < 3) i++;",
        "message.data = std::sin(angle * M_PI / 180);",
        "message.data = cos(yaw);",
        "double a = yaw * 180 / M_PI; x = cos(a * M_PI / 180) + cos(radians(a));",
        "message.data = sin(3.14159);",
        "ros::Duration d(0.01); d.sleep();",
        "ros::Duration d = ros::Duration(.05); d.sleep();",
        "const double DT = 0.01; ros::Duration(DT).sleep();",
    ],
)
def test_a_callback_that_is_right(line: str) -> None:
    assert _told(line) == []


@pytest.mark.parametrize(
    ("line", "fix"),
    [
        ("double a = tf::getYaw(q) * 180 / M_PI; x = cos(a);", "leave out `* 180 / M_PI`"),
        ("yaw = 2 * atan2(z, w) * 180 / M_PI; x = cos(yaw / 2);", "leave out `* 180 / M_PI`"),
        ("x = std::sin(yaw * 180.0 / M_PI);", "leave out `* 180 / M_PI`"),
        ("x = sin(90);", "write `sin(90 * M_PI / 180)`"),
        ("x = cos(angle_deg);", "write `cos(angle_deg * M_PI / 180)`"),
    ],
)
def test_a_sine_of_degrees(line: str, fix: str) -> None:
    (found,) = _told(line)
    assert f" takes radians, and gets degrees; {fix}" in found


@pytest.mark.parametrize(
    ("loop", "told"),
    [
        ("while (ros::ok()) rate.sleep();", ["2: the loop on line 2 never calls ros::spinOnce()"]),
        ("while (node.ok()) {\n  rate.sleep();\n}", ["2: the loop on line 2 never calls ros::spinOnce()"]),
        (
            "while (ros::ok()) { rate.sleep(); }\nros::spinOnce();",
            ["2: the loop on line 2 never calls ros::spinOnce()"],
        ),
        ("while (ros::ok()) { turn(); } }\nvoid turn() { ros::spinOnce();", []),
        ("while (ros::ok()) { ros::spinOnce(); }", []),
        ("while (ros::ok()) { ros::spinOnce; }", ["2: the loop on line 2 never calls ros::spinOnce()"]),
        ("ros::AsyncSpinner spinner(1); spinner.start(); while (ros::ok()) rate.sleep();", []),
        ("while (ros::ok()) queue.callAvailable(d);", []),
    ],
)
def test_a_loop_in_which_no_callback_is_called(loop: str, told: list[str]) -> None:
    code = f'auto sub = node.subscribe("/distance", 10, hear);\n{loop}\n'
    found = slips_of("src/node.cpp", f"int main() {{ {code}}}")
    assert [f"{one.line}: {one.message.partition(', so')[0]}" for one in found] == told
    assert list(slips_of("src/node.cpp", code)) == []  # what spins may be beside the main() of another file


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("bool add() {}\n/*\nint main(int argc, char **argv)\n{\n  ros::spin();\n}*/\n", [3]),
        ("// int main() { return 0; }\nint x;\n", [1]),
        ("// int main() { return 1; }\nint main() { return 0; }\n", []),
        ("// write int main() here\nbool add() {}\n", []),
    ],
)
def test_a_main_in_a_comment(text: str, lines: list[int]) -> None:
    found = [one for one in slips_of("src/node.cpp", text) if one.kind == "commented-out"]
    assert [one.line for one in found] == lines


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            'ros::init(argc, argv, "a");\nint hz = atoi(argv[1]);\n',
            ["1: it reads argv[1] on line 3 of src/node.cpp"],
        ),
        ("if (argc > 0) hz = std::stoi(argv[ 2 ]);\n", ["2: it reads argv[2] on line 2 of src/node.cpp"]),
        ("if (argc >= 1) name = argv[1];\n", ["1: it reads argv[1] on line 2 of src/node.cpp"]),
        ("if (argc > 1) hz = atoi(argv[1]);\n", []),
        ("if (argc != 3) return 1;\nhz = atoi(argv[1]);\n", []),
        ("if (2 > argc) return 1;\nhz = atoi(argv[1]);\n", []),
        ("for (int i = 1; i < argc; ++i) puts(argv[i]);\nputs(argv[1]);\n", []),
        ("switch (argc) { case 2: puts(argv[1]); }\n", []),
        ("puts(argv[0]);  // argv[1]\n", []),
    ],
)
def test_an_argument_that_may_not_be_there(text: str, told: list[str]) -> None:
    found = slips_of("src/node.cpp", f"int main(int argc, char **argv) {{\n{text}}}\n")
    assert [f"{one.name}: {one.message}" for one in found] == told


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("while (ros::ok) {\n  if (x) break;\n}\n",
         ["`ros::ok` has no brackets on line 2 of a.cpp; write `while (ros::ok())` on line 2"]),
        ("while (nh.ok) rate.sleep();\n",
         ["`nh.ok` has no brackets on line 2 of a.cpp; write `while (nh.ok())` on line 2"]),
        ("while(1) {\n  rate.sleep();\n}\n",
         [f"nothing in the loop on line 2 of a.cpp asks whether the node should end; {ASKS} on line 2"]),
        ("ros::Rate slow(0.1);\n", ["line 2 of a.cpp lets it sleep for 10 s at a time; "]),
        ("ros::Duration(4.0).sleep();\nsleep(3);\n",
         ["line 2 of a.cpp lets it sleep for 4 s at a time; ", "line 3 of a.cpp lets it sleep for 3 s at a time; "]),
        ("while (1) {\n  switch (x) { case 1: { break; } }\n}\n",
         [f"nothing in the loop on line 2 of a.cpp asks whether the node should end; {ASKS} on line 2"]),
        ("while (1) {\n  switch (x) { case 1: return 0; }\n}\n", []),
        ("while (1) {\n  switch (x) { case 1: break; }\n  if (x) break;\n}\n", []),
        ("while (true) { if (!ros::ok()) break; }\n", []),
        ("for (;;) { if (done) return 0; }\n", []),
        ("while (ros::ok()) { rate.sleep(); }\nros::Rate rate(0.5);\nsleep(1);\nros::Duration(0.1).sleep();\n", []),
        ("ros::Rate rate(0.0);\n", []),
    ],
)  # fmt: skip
def test_what_goes_on_after_ctrl_c(text: str, told: list[str]) -> None:
    found = slips_of("a.cpp", f"int main() {{\n{text}}}\n")
    assert [f"{one.message}; {one.fix}" for one in found if one.kind == "deaf"] == told
    assert all(one.kind != "deaf" for one in slips_of("a.cpp", text)), "of a class, without main()"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("std::string s;\nstd::cin >> s;\n", 4),
        ("while (kbhit()) {\n  c = getch();\n}\n", 3),
        ("std::getline(std::cin, s);\n", 3),
        ("read(STDIN_FILENO, &c, 1);\n", 3),
        ("read(fd, &c, 1);\nports.getchars();\n// cin >> x\n", 0),
    ],
)
def test_what_reads_the_keyboard(text: str, line: int) -> None:
    found = slips_of("a.cpp", f"int kbhit(void);\nint main() {{\n{text}}}\n")
    assert [one.line for one in found if one.kind == "input"] == [line] * bool(line)


MAKES = 'ros::Publisher p = n.advertise<std_msgs::Int8>("/a", 1);'
HEARS = 'auto s = n.subscribe("/b", 1, hear);'


@pytest.mark.parametrize(
    ("callback", "loop", "told"),
    [
        (MAKES, "ros::spin();", "1: the callback `hear` makes another publisher each time (line 1)"),
        (MAKES.replace("ros::Publisher p =", "static auto p ="), "ros::spin();", ""),
        ("if (!p) p = n.advertise<std_msgs::Int8>(t, 1);", "ros::spin();", ""),
        ("if (!p) {\n p = n.advertise<std_msgs::Int8>(t, 1);\n}", "ros::spin();", ""),
        (
            "",
            "while (ros::ok()) {\n" + HEARS + "\nros::spinOnce();\n}",
            "3: the loop on line 2 subscribes again",
        ),
        (
            "",
            "while (ros::ok())\n{\n" + MAKES + " ros::spinOnce();\n}",
            "4: the loop on line 2 makes another publisher",
        ),
        ("", "while (ros::ok()) { if (late) {" + MAKES + "} ros::spinOnce(); }", ""),
        ("", MAKES + " while (ros::ok()) { ros::spinOnce(); }", ""),
    ],
)
def test_what_is_made_again_and_again(callback: str, loop: str, told: str) -> None:
    code = f"void hear(M m) {{ {callback} }}\nint main() {{ {HEARS} {loop} }}"
    found = [f"{one.line}: {one.message}" for one in slips_of("src/node.cpp", code)]
    assert [told in one for one in found] == [True] * bool(told)


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("int sum = 0; sum += v; m.data = sum / 3;", "write `double sum` on line 3"),
        ("int sum = 0; sum = sum + v; m.data = (1 + sum / 3);", "write `double sum` on line 3"),
        ("m.data = accumulate(a.begin(), a.end(), 0) / 3;", "write `0.0` in place of the `0` on line 3"),
        ("m.data = accumulate(a.begin(), a.end(), 0.0) / 3;", ""),
        ("int n = 0; n += 1; m.data = sum / n;", ""),
        ("int n = 0; n++; m.data = n / 2;", ""),
        ("int ticks = 0; ticks += 4; m.data = ticks / 360.0;", ""),
        ("double sum = 0; sum += v; m.data = sum / 3;", ""),
        ("std_msgs::Int8 other; int sum = 0; sum += v; m.data = sum / 3;", ""),
    ],
)
def test_a_sum_of_floats_in_a_whole_number(body: str, told: str) -> None:
    code = f"std_msgs::Float32 m;\nint main() {{\n{body}\n}}"
    found = [one.fix for one in slips_of("src/node.cpp", code)]
    assert [told in one for one in found] == [True] * bool(told)


RIGHT_NODES = {
    "a handle goes first": (
        "  message_filters::Subscriber<Int8> of_a;\n  of_a.subscribe(nh, topic, 10);\n  ros::spin();\n"
    ),
    "of images": '  image_transport::ImageTransport it(nh);\n  it.subscribe("a", 1, see);\n  ros::spin();\n',
    "tests": '  auto sub = nh.subscribe("a", 1, hear);\n  return RUN_ALL_TESTS();\n',
    "kept while it waits": (
        '  ros::spin();\n}\nvoid other() {\n  ros::Subscriber sub = nh.subscribe("a", 1, hear);\n  waitForMessage();\n'
    ),
    "kept by a test": (
        '  ros::spin();\n}\nTEST(A, b) {\n  ros::Subscriber sub = nh.subscribe("a", 1, hear);\n  EXPECT_EQ(1, n);\n'
    ),
}


@pytest.mark.parametrize("name", RIGHT_NODES)
def test_a_right_node_of_cpp_is_left_alone(name: str, tmp_path: Path) -> None:
    begin = 'int main(int argc, char** argv) {\n  ros::init(argc, argv, "a");\n  ros::NodeHandle nh;\n'
    folder = package(tmp_path, {"src/a.cpp": f"{begin}{RIGHT_NODES[name]}}}\n"})
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


def test_a_subscription_by_a_variable_is_kept(tmp_path: Path) -> None:
    node = "int main() {\n  ros::NodeHandle nh;\n  nh.subscribe(topic, 1, hear);\n  ros::spin();\n}\n"
    folder = package(tmp_path, {"src/a.cpp": node})
    assert [one.line for one in find_repairs(folder, facts_of(folder), WANTED)] == [3]


CHANGED = "which is made of the message's value, and not the value itself"


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("auto s = msg->data; std::sort(s.begin(), s.end()); cout << s << std::endl;", f"`s`, {CHANGED}"),
        ('int x = msg->data * 2; ROS_INFO("%d", x);', f"`x`, {CHANGED}"),
        ("int x(msg->data); x += 2; ROS_INFO_STREAM(x);", f"`x`, {CHANGED}"),
        ('ROS_INFO("I heard %d", count);', "`count`, and not the message's value"),
        ('ROS_INFO("I heard it");', "nothing of the message"),
        ('auto s = msg->data; ROS_INFO("%s", s.c_str());', ""),
        ("std::string s(msg->data.c_str()); std::cout << s << std::endl;", ""),
        ("std::stringstream ss; ss << msg->data; std::cout << ss.str();", ""),
        ('sprintf(b, "%s", msg->data.c_str()); puts(b);', ""),
        ("total += msg->data; std::cout << total;", ""),
        ("show(msg); std::cout << count;", ""),
        ('ROS_INFO("I heard"); ROS_INFO("%s", msg->data.c_str());', ""),
    ],
)
def test_what_a_callback_prints_in_place_of_its_message(body: str, told: str) -> None:
    code = f"void hear(const std_msgs::String::ConstPtr& msg)\n{{\n{body}\n}}\nint main() {{ {HEARS} ros::spin(); }}"
    found = [(one.message, one.fix) for one in slips_of("src/node.cpp", code) if one.kind == "not-printed"]
    assert found == [(f"line 3 prints {told}", "on line 3, print `msg->data` itself")] * bool(told)


BOUND = """\
#include <ros/ros.h>
void mean(const std_msgs::Float32::ConstPtr& in, %s, ros::Publisher* out)
{
  %s
}

int main(int argc, char** argv)
{
  ros::NodeHandle n;
  ros::Subscriber in = n.subscribe<std_msgs::Float32>("/in", 5, boost::bind(mean, _1, %s, &out));
  %s
}
"""
SPIN = "ros::spin();"


@pytest.mark.parametrize(
    ("parameter", "line", "given", "end", "fix"),
    [
        (
            "Buffer buffer",
            "buffer.push_back(in->data);",
            "buffer",
            SPIN,
            "on line 2, write `Buffer& buffer`, and on line 10, `boost::ref(buffer)` in place of `buffer`",
        ),
        (
            "std::vector<float> last",
            "last.clear();",
            "last",
            SPIN,
            "on line 2, write `std::vector<float>& last`, and on line 10, `boost::ref(last)` in place of `last`",
        ),
        ("int count", "count++;", "n_seen", SPIN, "on line 2, write `int& count`, and on line 10"),
        ("Buffer& buffer", "buffer.push_back(in->data);", "boost::ref(buffer)", SPIN, ""),
        ("Buffer* buffer", "buffer->push_back(in->data);", "&buffer", SPIN, ""),
        ("double limit", "if (in->data == limit) out->publish(in);", "0.5", SPIN, ""),
        ("const Buffer buffer", "out->publish(buffer.size());", "buffer", SPIN, ""),
        (
            "Buffer& buffer",
            "buffer.clear();",
            "boost::ref(buffer)",
            "ros::AsyncSpinner spinner(1);\n  ros::waitForShutdown();",
            "below line 11, write `spinner.start();`",
        ),
        (
            "Buffer& buffer",
            "buffer.clear();",
            "boost::ref(buffer)",
            "ros::AsyncSpinner s(1);\n  s.start();\n  ros::waitForShutdown();",
            "",
        ),
        (
            "Buffer& buffer",
            "buffer.clear();",
            "boost::ref(buffer)",
            "ros::AsyncSpinner s(1);\n  ros::spin();",
            "",
        ),
        (
            "Buffer& buffer",
            "while (!buffer.full()) ros::spinOnce();",
            "boost::ref(buffer)",
            SPIN,
            "take the loop of line 4 out of it, and keep in variables what has to last",
        ),
        (
            "Buffer& buffer",
            "while (!buffer.full())\n  {\n    ros::spinOnce();\n  }",
            "boost::ref(buffer)",
            SPIN,
            "take the loop of line 4 out of it, and keep in variables what has to last",
        ),
        ("Buffer& buffer", "ros::spinOnce();", "boost::ref(buffer)", SPIN, "delete line 4"),
    ],
)
def test_what_a_bound_callback_is_given(parameter: str, line: str, given: str, end: str, fix: str) -> None:
    found = [*slips_of("src/node.cpp", BOUND % (parameter, line, given, end))]
    assert [one.fix.startswith(fix) for one in found] == ([True] if fix else [])


HANDLES = """\
#include <ros/ros.h>
Node::Node(%s)
{
  pub_ = %s.advertise<std_msgs::Float32>("mean", 10); // pnh.advertise<X>("other", 1)
  sub_ = %s.subscribe("%s", 10, &Node::hear, this);
}
"""


@pytest.mark.parametrize(
    ("taken", "handle", "topic", "fix"),
    [
        (
            "ros::NodeHandle& nh, ros::NodeHandle& pnh",
            "pnh",
            "in",
            "on lines 4 and 5, write `nh` in place of `pnh`",
        ),
        (
            "ros::NodeHandle private_nh",
            "private_nh",
            "in",
            'on lines 4 and 5, write `"/mean"`, with the slash',
        ),
        (
            "ros::NodeHandle& nh, ros::NodeHandle& pnh",
            "pnh",
            "/in",
            "on line 4, write `nh` in place of `pnh`",
        ),
        ("ros::NodeHandle& nh, ros::NodeHandle& pnh", "nh", "in", ""),
        ("ros::NodeHandle n", "n", "in", ""),
    ],
)
def test_topics_of_a_private_handle(taken: str, handle: str, topic: str, fix: str) -> None:
    found = [*slips_of("src/node.cpp", HANDLES % (taken, handle, handle, topic))]
    assert [one.fix for one in found if one.name.startswith("private ")] == ([fix] if fix else [])


def test_topics_of_a_handle_that_is_made_private() -> None:
    text = HANDLES % ("", "handle", "handle", "/in") + '\nros::NodeHandle handle("~");\n'
    assert [one.name for one in slips_of("src/node.cpp", text)] == ["private mean"]


def test_headers_are_those_that_a_source_includes_by_itself_or_by_its_own(tmp_path: Path) -> None:
    files = {
        "src/a.cpp": '#include <lab/Num.h>\n// #include <lab/Other.h>\n  # include "part.h"\n',
        "include/lab/part.h": '#include "deep.hpp"\n#if 0\n#include <lab/Unused.h>\n#endif\n#include <lab/Srv.h>\n',
        "include/lab/deep.hpp": '#include <lab/part.h>\n#include "std_msgs/String.h"\n#include <vector>\n',
        "src/b.cpp": "int main() {}\n",
    }
    facts = facts_of(package(tmp_path, files))
    found = {file.path: file.headers for file in facts.files if file.headers}
    assert found == {"src/a.cpp": ("lab/Num.h", "lab/Srv.h", "std_msgs/String.h")}
