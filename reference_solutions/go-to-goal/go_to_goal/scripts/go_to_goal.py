#!/usr/bin/env python3
"""Drives the turtle to the goal that came last, and stops there."""

import math

import rospy
from geometry_msgs.msg import Pose2D, Twist
from turtlesim.msg import Pose

RATE_HZ = 20
NEAR = 0.1  # m
SPEED = 2.0  # m/s
TURN = 2.0  # rad/s
AHEAD = 0.4  # rad


class GoToGoal:
    def __init__(self):
        self.pose = None
        self.goal = None
        self.velocity = rospy.Publisher('/turtle1/cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('/turtle1/pose', Pose, self.moved)
        rospy.Subscriber('/goal', Pose2D, self.asked)

    def moved(self, pose):
        self.pose = pose

    def asked(self, goal):
        self.goal = goal

    def steer(self):
        command = Twist()
        dx, dy = self.goal.x - self.pose.x, self.goal.y - self.pose.y
        distance = math.hypot(dx, dy)
        if distance < NEAR:
            rospy.loginfo('goal reached: %.1f %.1f', self.goal.x, self.goal.y)
            self.goal = None
        else:
            error = math.remainder(math.atan2(dy, dx) - self.pose.theta, 2 * math.pi)
            command.angular.z = max(-TURN, min(TURN, 2 * error))
            if abs(error) < AHEAD:
                command.linear.x = min(SPEED, 1.5 * distance)
        self.velocity.publish(command)

    def run(self):
        rate = rospy.Rate(RATE_HZ)
        while not rospy.is_shutdown():
            if self.goal and self.pose:
                self.steer()
            rate.sleep()


if __name__ == '__main__':
    rospy.init_node('go_to_goal')
    try:
        GoToGoal().run()
    except rospy.ROSInterruptException:
        pass
