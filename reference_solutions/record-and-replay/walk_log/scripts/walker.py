#!/usr/bin/env python3
"""Walks: publishes the length of each step."""

import rospy
from std_msgs.msg import Float64

STEP = 0.5  # m

if __name__ == '__main__':
    rospy.init_node('walker')
    steps = rospy.Publisher('/steps', Float64, queue_size=10)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        steps.publish(STEP)
        rate.sleep()
