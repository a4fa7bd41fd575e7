#!/usr/bin/env python
"""Publishes the time on /data, once a second."""

import rospy
import std_msgs.msg


def sender():
    pub = rospy.Publisher('data', std_msgs.msg.String, queue_size=10)
    # Anonymous, so that several senders can run at once
    rospy.init_node('sender', anonymous=True)
    rate = rospy.Rate(1)
    while not rospy.is_shutdown():
        message = 'The time is %s' % rospy.get_time()
        rospy.loginfo('Sending: ' + message)
        pub.publish(message)
        rate.sleep()


if __name__ == '__main__':
    try:
        sender()
    except rospy.ROSInterruptException:
        pass
