#!/usr/bin/env python
"""Logs what it hears on /data."""

import rospy
from std_msgs.msg import String


def on_data(data):
    rospy.loginfo('Received: ' + data.data)


def receiver():
    rospy.init_node('receiver')
    rospy.Subscriber('data', String, on_data)
    rospy.spin()


if __name__ == '__main__':
    receiver()
