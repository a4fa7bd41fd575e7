#!/usr/bin/env python3
"""Drives forward, and turns away from whatever is in front of the robot."""

import math

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

NEAR = 0.5  # m
AHEAD = math.radians(45)  # to each side
SPEED = 0.2  # m/s
TURN = 1.0  # rad/s


class Avoid:
    def __init__(self):
        self.turning = 0.0
        self.velocity = rospy.Publisher('/cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('/scan', LaserScan, self.scanned)

    def scanned(self, scan):
        left, right = self.nearest(scan, 0, AHEAD), self.nearest(scan, -AHEAD, 0)
        command = Twist()
        if min(left, right) > NEAR:
            self.turning = 0.0
            command.linear.x = SPEED
        else:
            self.turning = self.turning or (TURN if left > right else -TURN)
            command.angular.z = self.turning
        self.velocity.publish(command)

    def nearest(self, scan, low, high):
        """The smallest range between two angles, 0 being ahead."""
        angles = (scan.angle_min + i * scan.angle_increment for i in range(len(scan.ranges)))
        ahead = (math.remainder(angle, 2 * math.pi) for angle in angles)
        return min((r for r, angle in zip(scan.ranges, ahead) if low <= angle <= high), default=math.inf)


if __name__ == '__main__':
    rospy.init_node('avoid')
    Avoid()
    rospy.spin()
