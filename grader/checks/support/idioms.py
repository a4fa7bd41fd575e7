"""What hints say of ROS in code, in Python and in C++ at once; a verdict keeps what its node is written in."""

from __future__ import annotations

import json
import re
from typing import Literal

Language = Literal["python", "cpp"]

_PAIR = re.compile("\ue000([^\ue000-\ue002]*)\ue001([^\ue000-\ue002]*)\ue002")


def both(python: str, cpp: str) -> str:
    """Return a part of a hint that is said of a node in Python, or of one in C++."""
    return f"\ue000{python}\ue001{cpp}\ue002"


def in_language(hint: str, language: Language | None) -> str:
    """Return the hint for a node in this language. None, where it may be either, keeps both."""
    if language is None:
        python, cpp = (in_language(hint, one) for one in ("python", "cpp"))
        return python if python == cpp else f"{python} (in C++: {cpp})"
    return _PAIR.sub(r"\1" if language == "python" else r"\2", hint)


LOOP = both("while not rospy.is_shutdown():", "while (ros::ok())")
SPIN = both("rospy.spin()", "ros::spin()")
INIT = both("rospy.init_node(…)", "ros::init(argc, argv, …) and ros::NodeHandle")
RATE = both("rospy.Rate", "ros::Rate")
GET_TIME = both("rospy.get_time()", "ros::Time::now().toSec()")
NOW = both("rospy.Time.now()", "ros::Time::now()")
ANONYMOUS = both("anonymous=True", "ros::init_options::AnonymousName")
PUBLISHER = both("rospy.Publisher(…)", "nh.advertise<…>(…)")
SERVICE = both("rospy.Service(…)", "nh.advertiseService(…)")


def init(name: str, *, anonymous: bool = False) -> str:
    """Return the call that makes the program a node of this name."""
    flags = (", anonymous=True", ", ros::init_options::AnonymousName") if anonymous else ("", "")
    return both(f"rospy.init_node('{name}'{flags[0]})", f'ros::init(argc, argv, "{name}"{flags[1]})')


def loop_rate(hz: str) -> str:
    """Return what a loop sleeps with."""
    return both(f"rospy.Rate({hz})", f"ros::Rate rate({hz})")


def publisher(topic: str, python: str = "…", cpp: str = "10", *, type: str = "…") -> str:  # noqa: A002
    """Return the call that advertises the topic, with the other arguments of each language."""
    return both(f"rospy.Publisher('{topic}', {python})", f'nh.advertise<{type}>("{topic}", {cpp})')


def subscriber(topic: str, python: str = "…") -> str:
    """Return the call that subscribes to the topic."""
    return both(f"rospy.Subscriber('{topic}', {python})", f'nh.subscribe("{topic}", 10, callback)')


def service_call(name: str, python: str = "…") -> str:
    """Return the call that offers the service."""
    return both(f"rospy.Service('{name}', {python})", f'nh.advertiseService("{name}", callback)')


def service_client(name: str) -> str:
    """Return what calls the service."""
    return both(f"rospy.ServiceProxy('{name}', <Type>)(…)", f'nh.serviceClient<…>("{name}").call(…)')


def action_client(name: str) -> str:
    """Return what sends a goal to the action."""
    return both(
        f"actionlib.SimpleActionClient('{name}', <Type>).send_goal(…)",
        f'actionlib::SimpleActionClient<…>("{name}").sendGoal(…)',
    )


def imports(package: str, name: str, folder: str) -> str:
    """Return the line that makes a type known: `folder` is `msg` or `srv`."""
    return both(f"from {package}.{folder} import {name}", f'#include "{package}/{name}.h"')


def get_param(name: str) -> str:
    """Return the call that reads a parameter."""
    return both(f"rospy.get_param('{name}')", f'ros::param::get("{name}", value)')


def set_param(name: str, value: object = ...) -> str:
    """Return the call that sets a parameter, to a value if there is one."""
    python, cpp = ("…", "…") if value is ... else (repr(value), json.dumps(value, default=str))
    return both(f"rospy.set_param('{name}', {python})", f'ros::param::set("{name}", {cpp})')


def log(level: str, text: str) -> str:
    """Return the call that logs a text."""
    python = "err" if level == "error" else level
    return both(f'rospy.log{python}("{text}")', f'ROS_{level.upper()}("{text}")')


def log_param(name: str) -> str:
    """Return the calls that read a parameter and log its value."""
    cpp = f'ros::param::get("{name}", value), then ROS_INFO_STREAM(value)'
    return both(f"rospy.loginfo(rospy.get_param('{name}'))", cpp)
