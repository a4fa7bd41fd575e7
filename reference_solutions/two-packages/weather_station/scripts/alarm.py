#!/usr/bin/env python3
"""Says for each reading whether it is too hot."""

import rospy
from std_msgs.msg import Bool
from weather_msgs.msg import Reading

LIMIT = 30.0  # degrees Celsius


def heard(reading):
    publisher.publish(Bool(reading.temperature > LIMIT))


if __name__ == '__main__':
    rospy.init_node('alarm')
    publisher = rospy.Publisher('/alarm', Bool, queue_size=10)
    rospy.Subscriber('/reading', Reading, heard)
    rospy.spin()
