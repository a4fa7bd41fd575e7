#!/usr/bin/env python3
"""Tells tf where the robot is, and where the laser is on it."""

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry


class Frames:
    def __init__(self):
        self.moving = tf2_ros.TransformBroadcaster()
        self.fixed = tf2_ros.StaticTransformBroadcaster()
        self.send_laser()
        rospy.Subscriber('/odom', Odometry, self.moved)

    def send_laser(self):
        laser = TransformStamped()
        laser.header.stamp = rospy.Time.now()
        laser.header.frame_id = 'base_link'
        laser.child_frame_id = 'laser'
        laser.transform.translation.x = 0.2
        laser.transform.translation.z = 0.1
        laser.transform.rotation.w = 1.0
        self.fixed.sendTransform(laser)

    def moved(self, odometry):
        base = TransformStamped()
        base.header.stamp = rospy.Time.now()
        base.header.frame_id = 'odom'
        base.child_frame_id = 'base_link'
        position = odometry.pose.pose.position
        base.transform.translation.x = position.x
        base.transform.translation.y = position.y
        base.transform.translation.z = position.z
        base.transform.rotation = odometry.pose.pose.orientation
        self.moving.sendTransform(base)


if __name__ == '__main__':
    rospy.init_node('frames')
    frames = Frames()
    rospy.spin()
