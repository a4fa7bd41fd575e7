#!/usr/bin/env python3
"""Says hello on /chatter and counts on /count, ten times a second or nearly so: a loop with time.sleep."""

import time

import rospy
from std_msgs.msg import Int8, String

rospy.init_node("pulse")
text_pub = rospy.Publisher("chatter", String, queue_size=10)
count_pub = rospy.Publisher("count", Int8, queue_size=10)
count = 0
while not rospy.is_shutdown():
    text_pub.publish("hello world %s" % rospy.get_time())
    count_pub.publish(count)
    count = (count + 1) % 128
    time.sleep(0.1)
