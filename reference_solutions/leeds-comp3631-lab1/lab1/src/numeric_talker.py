#!/usr/bin/env python
"""Says hello on /chatter and counts on /numeric_chatter, ten times a second."""

import rospy
from std_msgs.msg import Int8, String


def talk():
    text_pub = rospy.Publisher('chatter', String, queue_size=10)
    number_pub = rospy.Publisher('numeric_chatter', Int8, queue_size=10)
    rospy.init_node('numeric_talker', anonymous=True)
    rate = rospy.Rate(10)
    counter = 0
    while not rospy.is_shutdown():
        text = 'hello world %s' % rospy.get_time()
        rospy.loginfo(text)
        text_pub.publish(text)
        number_pub.publish(counter)
        counter += 1
        if counter > 127:
            counter = 0
        rate.sleep()


if __name__ == '__main__':
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
