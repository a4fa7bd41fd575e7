#!/usr/bin/env python3
"""Publishes what the weather station measures, ten times a second."""

import math

import rospy
from weather_msgs.msg import Reading


if __name__ == '__main__':
    rospy.init_node('sensor')
    publisher = rospy.Publisher('/reading', Reading, queue_size=10)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        reading = Reading()
        reading.header.stamp = rospy.Time.now()
        reading.temperature = 20.0 + 5.0 * math.sin(rospy.get_time())
        reading.humidity = 60.0
        publisher.publish(reading)
        rate.sleep()
