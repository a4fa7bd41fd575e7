#!/usr/bin/env python3
"""Says hello on /chatter ten times a second."""

import rospy
from std_msgs.msg import String


def talk():
    publisher = rospy.Publisher("chatter", String, queue_size=10)
    rospy.init_node("talker")
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        publisher.publish("hello world")
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
