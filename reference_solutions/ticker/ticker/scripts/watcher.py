#!/usr/bin/env python3
"""Logs every tick that it hears."""

import rospy
from std_msgs.msg import UInt8


def heard(tick):
    rospy.loginfo('tick %d', tick.data)


if __name__ == '__main__':
    rospy.init_node('watcher')
    rospy.Subscriber('ticks', UInt8, heard)
    rospy.spin()
