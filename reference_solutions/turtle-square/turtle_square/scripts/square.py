#!/usr/bin/env python3
"""Drives the turtle in a square to the left, and once more for each call of ~restart."""

import math

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

SPEED = 2.0  # m/s
TURN = math.pi / 2  # rad/s, to the left
RATE_HZ = 20
CORNERS = 4


class Square:
    def __init__(self):
        self.side = rospy.get_param('~side', 2.0)
        rospy.set_param('~side', self.side)
        self.squares = 1
        self.velocity = rospy.Publisher('/turtle1/cmd_vel', Twist, queue_size=10)
        self.status = rospy.Publisher('~status', String, queue_size=1, latch=True)
        self.service = rospy.Service('~restart', Trigger, self.restart)

    def restart(self, request):
        self.squares += 1
        return TriggerResponse(success=True, message='on my way')

    def run(self):
        self.status.publish('waiting')
        rospy.sleep(1.0)  # until the turtle listens
        self.rate = rospy.Rate(RATE_HZ)
        while not rospy.is_shutdown():
            if self.squares > 0:
                self.squares -= 1
                self.drive()
            self.rate.sleep()

    def drive(self):
        self.status.publish('driving')
        for _ in range(CORNERS):
            self.move(self.side / SPEED, forward=SPEED)
            self.move(math.pi / 2 / TURN, turn=TURN)
        self.velocity.publish(Twist())
        self.status.publish('done')

    def move(self, duration, forward=0.0, turn=0.0):
        command = Twist()
        command.linear.x = forward
        command.angular.z = turn
        for _ in range(round(duration * RATE_HZ)):
            self.velocity.publish(command)
            self.rate.sleep()


if __name__ == '__main__':
    try:
        rospy.init_node('square')
        Square().run()
    except rospy.ROSInterruptException:
        pass
