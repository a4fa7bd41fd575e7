#!/usr/bin/env python3
"""Says hello on /chatter and counts on /count, ten times a second: a rospy.Timer."""

import itertools

import rospy
from std_msgs.msg import Int8, String

counter = itertools.cycle(range(128))


def tick(event):
    text_pub.publish("hello world %s" % rospy.get_time())
    count_pub.publish(next(counter))


rospy.init_node("pulse")
text_pub = rospy.Publisher("chatter", String, queue_size=10)
count_pub = rospy.Publisher("count", Int8, queue_size=10)
rospy.Timer(rospy.Duration(0.1), tick)
rospy.spin()
