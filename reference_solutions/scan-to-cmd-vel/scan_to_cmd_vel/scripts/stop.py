#!/usr/bin/env python3
"""Drives forward, and stops where the laser sees something near."""

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

NEAR = 0.5  # m
SPEED = 0.2  # m/s


class Stop:
    def __init__(self):
        self.velocity = rospy.Publisher('/cmd_vel', Twist, queue_size=10)
        self.stopped = False
        rospy.Subscriber('/scan', LaserScan, self.scanned)

    def scanned(self, scan):
        distance = min(scan.ranges, default=float('inf'))
        near = distance < NEAR
        if near and not self.stopped:
            print('obstacle at %.2f m' % distance, flush=True)
        self.stopped = near
        command = Twist()
        command.linear.x = 0.0 if near else SPEED
        self.velocity.publish(command)


if __name__ == '__main__':
    rospy.init_node('stop')
    Stop()
    rospy.spin()
