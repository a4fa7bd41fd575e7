#!/usr/bin/env python3
import rospy
from std_msgs.msg import Bool, Float32

LIMIT = 0.5


def hear(mean):
    alarm.publish(mean.data < LIMIT)


rospy.init_node('alarm')
alarm = rospy.Publisher('/alarm', Bool, queue_size=10)
rospy.Subscriber('/mean', Float32, hear)
rospy.spin()
