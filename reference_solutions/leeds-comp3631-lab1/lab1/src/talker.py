#!/usr/bin/env python
"""Says hello on /chatter ten times a second."""

import rospy
from std_msgs.msg import String


def talk():
    text_pub = rospy.Publisher('chatter', String, queue_size=10)
    rospy.init_node('talker', anonymous=True)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        text = 'hello world %s' % rospy.get_time()
        rospy.loginfo(text)
        text_pub.publish(text)
        rate.sleep()


if __name__ == '__main__':
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
