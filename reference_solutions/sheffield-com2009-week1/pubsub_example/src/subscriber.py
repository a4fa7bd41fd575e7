#!/usr/bin/env python
"""Prints what it hears on /chatter."""

import rospy
from std_msgs.msg import String


class Subscriber():

    def __init__(self):
        rospy.init_node('subscriber_node', anonymous=True)
        self.sub = rospy.Subscriber('chatter', String, self.callback)
        rospy.loginfo('subscriber node is active...')

    def callback(self, message):
        print('%s heard: %s' % (rospy.get_name(), message.data))

    def main_loop(self):
        rospy.spin()


if __name__ == '__main__':
    Subscriber().main_loop()
