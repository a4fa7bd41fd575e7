#!/usr/bin/env python3

import rospy
from std_msgs.msg import String


def main():
    rospy.init_node('lamp')
    color = rospy.get_param('~color', 'white')
    state = rospy.Publisher('state', String, queue_size=1)
    rate = rospy.Rate(5)
    while not rospy.is_shutdown():
        state.publish(color)
        rate.sleep()


if __name__ == '__main__':
    try:
        main()
    except rospy.ROSInterruptException:
        pass
