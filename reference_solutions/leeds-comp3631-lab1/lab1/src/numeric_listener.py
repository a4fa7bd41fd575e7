#!/usr/bin/env python
"""Prints what it hears on /chatter and each number from /numeric_chatter."""

import rospy
from std_msgs.msg import Int8, String


def on_text(msg):
    rospy.loginfo('%s: I heard %s', rospy.get_caller_id(), msg.data)


def on_number(msg):
    rospy.loginfo('%s: I heard the number %d', rospy.get_caller_id(), msg.data)


def listen():
    rospy.init_node('numeric_listener', anonymous=True)
    rospy.Subscriber('chatter', String, on_text)
    rospy.Subscriber('numeric_chatter', Int8, on_number)
    rospy.spin()


if __name__ == '__main__':
    listen()
