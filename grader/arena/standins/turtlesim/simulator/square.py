"""The node `draw_square`: drives the first turtle along a square of 2 m, again and again."""

from math import cos, hypot, pi, remainder, sin

import rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import Empty
from turtlesim.msg import Pose

SIDE_M = 2.0
SPEED = 1.0
TURN_SPEED = 0.4
NEAR_M, NEAR_RAD = 0.1, 0.01
STILL = 0.0001
PERIOD_S = 0.016


class Square:
    """Forward, stop, turn, stop. `next_command` gives linear and angular velocity for a pose."""

    def __init__(self):
        self._turning = False
        self._stopping = False
        self._goal = None

    def next_command(self, pose):
        if self._goal is None:
            self._aim(pose)
        if self._stopping:
            if pose.linear_velocity < STILL and pose.angular_velocity < STILL:
                rospy.loginfo("Reached goal")
                self._stopping, self._turning = False, not self._turning
                self._aim(pose)
            return 0.0, 0.0
        if self._reached(pose):
            self._stopping = True
            return 0.0, 0.0
        return (0.0, TURN_SPEED) if self._turning else (SPEED, 0.0)

    def _aim(self, pose):
        x, y, theta = pose.x, pose.y, pose.theta
        if self._turning:
            theta = remainder(theta + pi / 2, 2 * pi)
        else:
            x, y = x + SIDE_M * cos(theta), y + SIDE_M * sin(theta)
        self._goal = (x, y, theta)
        rospy.loginfo("New goal [%f %f, %f]", *self._goal)

    def _reached(self, pose):
        x, y, theta = self._goal
        if self._turning:
            return abs(remainder(pose.theta - theta, 2 * pi)) < NEAR_RAD
        return hypot(pose.x - x, pose.y - y) < NEAR_M


def main():
    rospy.init_node("draw_square")
    poses = []
    rospy.Subscriber("turtle1/pose", Pose, lambda pose: poses.__setitem__(slice(None), [pose]), queue_size=1)
    publisher = rospy.Publisher("turtle1/cmd_vel", Twist, queue_size=10)
    rospy.wait_for_service("reset")
    rospy.ServiceProxy("reset", Empty)()
    square = Square()

    def drive(_event):
        if poses:
            twist = Twist()
            twist.linear.x, twist.angular.z = square.next_command(poses[0])
            publisher.publish(twist)

    rospy.Timer(rospy.Duration(PERIOD_S), drive)
    rospy.spin()
