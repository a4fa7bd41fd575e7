#!/usr/bin/env python
"""Tells the time on /chatter, ten times a second."""

import rospy
from std_msgs.msg import String


class Publisher():

    def __init__(self):
        self.pub = rospy.Publisher('chatter', String, queue_size=10)
        rospy.init_node('publisher_node', anonymous=True)
        self.rate = rospy.Rate(10)
        rospy.on_shutdown(self.stop)
        rospy.loginfo('publisher node is active...')

    def stop(self):
        print('stopping the publisher node at %s' % rospy.get_time())

    def main_loop(self):
        while not rospy.is_shutdown():
            self.pub.publish('the time is %s' % rospy.get_time())
            self.rate.sleep()


if __name__ == '__main__':
    publisher = Publisher()
    try:
        publisher.main_loop()
    except rospy.ROSInterruptException:
        pass
