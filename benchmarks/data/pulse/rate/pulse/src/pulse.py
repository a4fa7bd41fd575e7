#!/usr/bin/env python3
"""Says hello on /chatter and counts on /count, ten times a second: a loop with rospy.Rate."""

import rospy
from std_msgs.msg import Int8, String


def talk():
    text_pub = rospy.Publisher("chatter", String, queue_size=10)
    count_pub = rospy.Publisher("count", Int8, queue_size=10)
    rospy.init_node("pulse")
    rate = rospy.Rate(10)
    count = 0
    while not rospy.is_shutdown():
        text_pub.publish("hello world %s" % rospy.get_time())
        count_pub.publish(count)
        count = 0 if count == 127 else count + 1
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
