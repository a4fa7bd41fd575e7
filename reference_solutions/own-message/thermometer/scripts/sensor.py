#!/usr/bin/env python3
"""Publishes what a thermometer measures, 20 times a second."""

import math

import rospy
from thermometer.msg import Reading

LIMIT = 80.0  # degrees Celsius


def measure(seconds):
    return 20.0 + 5.0 * math.sin(seconds)


if __name__ == '__main__':
    rospy.init_node('sensor')
    publisher = rospy.Publisher('/reading', Reading, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        reading = Reading()
        reading.temperature = measure(rospy.get_time())
        reading.state = Reading.TOO_HOT if reading.temperature > LIMIT else Reading.OK
        reading.header.frame_id = 'thermometer'
        reading.header.stamp = rospy.Time.now()
        publisher.publish(reading)
        rate.sleep()
