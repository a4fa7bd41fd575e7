#!/usr/bin/env python3
"""Publishes how far the laser is from the place where the robot began."""

import math

import rospy
import tf2_ros
from std_msgs.msg import Float64

if __name__ == '__main__':
    rospy.init_node('distance')
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    publisher = rospy.Publisher('/distance', Float64, queue_size=10)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        try:
            found = buffer.lookup_transform('odom', 'laser', rospy.Time(0))
            at = found.transform.translation
            publisher.publish(math.sqrt(at.x ** 2 + at.y ** 2))
        except tf2_ros.TransformException as error:
            rospy.logwarn_throttle(1, 'not yet: %s' % error)
        rate.sleep()
