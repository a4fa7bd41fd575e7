#!/usr/bin/env python
"""Prints what it hears on /chatter."""

import rospy
from std_msgs.msg import String


def on_text(msg):
    rospy.loginfo('%s: I heard %s', rospy.get_caller_id(), msg.data)


def listen():
    rospy.init_node('listener', anonymous=True)
    rospy.Subscriber('chatter', String, on_text)
    rospy.spin()


if __name__ == '__main__':
    listen()
