"""What the words of a source may come out as, in Python and in C++."""

from __future__ import annotations

import pytest

from grader.checks.support.scripts import SourceLine, lines_that_say
from grader.checks.support.text import could_say, texts_of_cpp


@pytest.mark.parametrize(
    ("line", "kind", "text"),
    [
        ('ss << "hello world " << count << std::endl;', "publishes", "hello world {}"),
        ('msg.data = "hi " + std::to_string(x);', "publishes", "hi {}"),
        ('msg.data = "fixed";', "publishes", "fixed"),
        ('ROS_INFO("I heard: [%s]\\n", msg->data.c_str());', "prints", "I heard: [{data}]"),
        ('ROS_INFO_STREAM("I got " << msg.data);', "prints", "I got {data}"),
        ('std::cout << "abc " << n << std::endl;', "prints", "abc {}"),
        ('// ROS_INFO("no")', "", ""),
        ('ros::init(argc, argv, "talker");', "", ""),
    ],
)
def test_a_line_of_cpp_says_a_text(line: str, kind: str, text: str) -> None:
    assert list(texts_of_cpp([f"  {line}"])) == ([(kind, 1, text)] if kind else [])


@pytest.mark.parametrize(
    ("said", "wanted", "can"),
    [
        ("hello world {}", "hello world 12.5", True),
        ("Hello  World {}", "hello world 12.5", True),
        ("{}{}", "hello world", True),
        ("hello {} {}", "hello world 12.5", True),
        ("hello {} world", "hello world 12.5", False),
        ("hello world", "hello world 12.5", False),
        ("{data} hello", "hello world", False),
        ("hello{}hello", "hello", False),
    ],
)
def test_whether_a_text_of_a_source_can_come_out_as_another(said: str, wanted: str, can: bool) -> None:
    assert could_say(said, wanted) is can


@pytest.mark.parametrize("said", ["hello world 7", "hello world7", "hello world"])
def test_a_count_right_behind_the_text_hides_no_line(said: str) -> None:
    line = SourceLine("src/talker.cpp", 3, 'ss << "hello world" << count;')
    assert lines_that_say([line, SourceLine("src/talker.cpp", 4, "pub.publish(msg);")], said) == [line]
