#!/usr/bin/env python3
"""Follows the wall on the robot's right, at half a metre."""

import math

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

DISTANCE = 0.5  # m
SPEED = 0.2  # m/s
TURN = 1.0  # rad/s
NEAR = 0.6  # m, ahead
GAIN = 2.0  # rad/s for each metre
LOOK = math.radians(50)


class Follow:
    def __init__(self):
        self.velocity = rospy.Publisher('/cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('/scan', LaserScan, self.scanned)

    def scanned(self, scan):
        command = Twist()
        right, before = self.at(scan, -math.pi / 2), self.at(scan, -math.pi / 2 + LOOK)
        if self.nearest(scan, math.radians(25)) < NEAR:
            command.angular.z = TURN
        elif math.isinf(right) and math.isinf(before):
            command.linear.x = SPEED
        else:
            command.linear.x = SPEED
            command.angular.z = max(-TURN, min(TURN, self.steer(right, before)))
        self.velocity.publish(command)

    def steer(self, right, before):
        """The turn (rad/s) that keeps the wall at its distance, by two ranges: beside, and a little before that."""
        if math.isinf(before) or before > 2 * DISTANCE / math.cos(LOOK):
            return -0.4  # a corner to go around: the circle's radius is half a metre
        if math.isinf(right):
            return 0.0
        angle = math.atan2(before * math.cos(LOOK) - right, before * math.sin(LOOK))
        distance = right * math.cos(angle)
        return GAIN * (DISTANCE - distance) - 1.5 * angle

    def at(self, scan, angle):
        return scan.ranges[self.index(scan, angle)]

    def index(self, scan, angle):
        return round((angle - scan.angle_min) % (2 * math.pi) / scan.angle_increment) % len(scan.ranges)

    def nearest(self, scan, half):
        count = int(half / scan.angle_increment)
        return min(self.at(scan, i * scan.angle_increment) for i in range(-count, count + 1))


if __name__ == '__main__':
    rospy.init_node('follow')
    Follow()
    rospy.spin()
