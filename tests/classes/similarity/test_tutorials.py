"""Nobody is named for what everybody writes: the tutorial, the starter code, a lab of ten lines."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from grader.classes.similarity.sources import compare
from tests.classes.similarity.classes import class_of, renamed, solution

ROOT = Path(__file__).parent.parent.parent.parent
HANDOUT = ROOT / "reference_solutions" / "turtle-square"

TALKER = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String

def {talk}():
    {pub} = rospy.Publisher('chatter', String, queue_size=10)
    rospy.init_node('talker', anonymous=True)
    {rate} = rospy.Rate({hz})
    while not rospy.is_shutdown():
        {text} = "{words} %s" % rospy.get_time()
        rospy.loginfo({text})
        {pub}.publish({text})
        {rate}.sleep()

if __name__ == '__main__':
    try:
        {talk}()
    except rospy.ROSInterruptException:
        pass
"""
LISTENER = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String

def callback(data):
    rospy.loginfo(rospy.get_caller_id() + "I heard %s", data.data)

def listener():
    rospy.init_node('listener', anonymous=True)
    rospy.Subscriber("chatter", String, callback)
    # spin() simply keeps python from exiting until this node is stopped
    rospy.spin()

if __name__ == '__main__':
    listener()
"""
TALKER_CPP = """
#include "ros/ros.h"
#include "std_msgs/String.h"
#include <sstream>
int main(int argc, char **argv)
{
  ros::init(argc, argv, "talker");
  ros::NodeHandle n;
  ros::Publisher chatter_pub = n.advertise<std_msgs::String>("chatter", 1000);
  ros::Rate loop_rate(10);
  int count = 0;
  while (ros::ok())
  {
    std_msgs::String msg;
    std::stringstream ss;
    ss << "hello world " << count;
    msg.data = ss.str();
    ROS_INFO("%s", msg.data.c_str());
    chatter_pub.publish(msg);
    ros::spinOnce();
    loop_rate.sleep();
    ++count;
  }
  return 0;
}
"""


def compared(folders, **also):
    from grader.classes.similarity.comparison import compare_class  # noqa: PLC0415 - loads matplotlib

    return compare_class(
        **{"folders": folders, "starter": (), "groups": {}, "threshold": 0.5, "jobs": 2} | also
    )


def talker(number: int) -> bytes:
    names = {
        "talk": f"talk{number}",
        "pub": "pub",
        "rate": "rate",
        "hz": 10,
        "text": "hello_str",
        "words": "hello",
    }
    return TALKER.format(**names).encode()


@pytest.mark.full
@pytest.mark.parametrize("count", [2, 12])
def test_two_with_the_tutorial_are_not_named(tmp_path, count) -> None:
    """Nor are twelve: in a class of two nothing else takes it out."""
    files = [{"talker.py": talker(n), "listener.py": LISTENER.encode()} for n in range(count)]
    similarity = compared(class_of(tmp_path, {str(n): one for n, one in enumerate(files)}))
    assert similarity.pairs == ()
    assert len(similarity.too_little) == count


@pytest.mark.full
def test_two_with_the_tutorial_in_cpp_are_not_named(tmp_path) -> None:
    similarity = compared(class_of(tmp_path, {n: {"src/talker.cpp": TALKER_CPP.encode()} for n in "ab"}))
    assert similarity.pairs == ()
    assert similarity.too_little == ("a", "b")


@pytest.mark.full
def test_cpp_is_compared_where_it_is_more_than_the_tutorial(tmp_path) -> None:
    own = "".join(
        f"double part{n}(double x, int y) {{\n  double z = x * {n};\n  return z + y - {n * 7};\n}}\n"
        for n in range(5)
    )
    other = re.sub(r"\b[xyz]\b", lambda found: f"{found[0]}_value", own)
    files = {
        name: {"src/node.cpp": (text + TALKER_CPP).encode()} for name, text in (("a", own), ("b", other))
    }
    (pair,) = compared(class_of(tmp_path, files)).pairs
    assert pair.files[0].lines_a == ((1, 20),)


@pytest.mark.full
def test_labs_own_solutions_with_the_tutorials_shape_have_little_of_their_own(tmp_path) -> None:
    """The reference solutions of the labs that are a talker and a listener, each of them by itself."""
    labs = ("leeds-comp3631-lab1", "mcr2-basic-comms", "york-ele00118m-lab7", "sheffield-com2009-week1")
    submissions = {
        lab: {path.name: path.read_bytes() for path in (ROOT / "reference_solutions" / lab).rglob("*.py")}
        for lab in labs
    }
    assert all(submissions.values())
    assert compared(class_of(tmp_path, submissions)).pairs == ()


def both_with_the_handout(tmp_path: Path) -> dict[str, Path]:
    """Each has the handout's program, and one of their own."""
    given = (HANDOUT / "turtle_square" / "scripts" / "square.py").read_bytes()
    own = {name: solution(program).encode() for name, program in (("a", "laser"), ("b", "monitor"))}
    return class_of(tmp_path, {name: {"square.py": given, "own.py": code} for name, code in own.items()})


@pytest.mark.full
def test_without_the_starter_code_it_counts_as_their_own(tmp_path) -> None:
    similarity = compared(both_with_the_handout(tmp_path))
    assert len(similarity.pairs) == 1
    assert "no starter code" in similarity.notes[0]


@pytest.mark.full
@pytest.mark.parametrize("form", ["folder", "archive", "program"])
def test_the_starter_code_is_taken_out(tmp_path, form) -> None:
    folders = both_with_the_handout(tmp_path / "class")
    starter = {
        "folder": lambda: HANDOUT,
        "archive": lambda: Path(shutil.make_archive(str(tmp_path / "handout"), "zip", HANDOUT)),
        "program": lambda: HANDOUT / "turtle_square" / "scripts" / "square.py",
    }[form]()
    similarity = compare(folders, starter=[starter], threshold=0.3)
    assert similarity.pairs == ()
    assert [Path(path).name for path in similarity.taken_out.starter] == ["square.py"]
    assert similarity.notes == ()


@pytest.mark.full
def test_a_starter_with_other_names_is_the_starter(tmp_path) -> None:
    handout = tmp_path / "handout.py"
    handout.write_text(renamed(solution("timed")), encoding="utf-8")
    folders = class_of(tmp_path / "class", {n: {"n.py": solution("timed").encode()} for n in "ab"})
    assert compared(folders, starter=(handout,)).pairs == ()


@pytest.mark.full
def test_many_alike_are_said_to_have_a_common_source(tmp_path) -> None:
    same = {f"same{n}": {"n.py": solution("timed").encode()} for n in range(6)}
    others = {f"other{n}": {"n.py": solution(name).encode()} for n, name in enumerate(("laser", "table") * 4)}
    similarity = compared(class_of(tmp_path, same | others))
    assert len(similarity.clusters[0]) == 6
    assert any("may share a source" in note for note in similarity.notes)
