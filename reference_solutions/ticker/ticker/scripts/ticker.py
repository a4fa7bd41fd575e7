#!/usr/bin/env python3
"""Counts from 1 to 10, again and again, five times a second."""

import rospy
from std_msgs.msg import UInt8


def main():
    rospy.init_node('ticker')
    pub = rospy.Publisher('ticks', UInt8, queue_size=10)
    rate = rospy.Rate(5)
    tick = 1
    while not rospy.is_shutdown():
        pub.publish(tick)
        tick = tick + 1 if tick < 10 else 1
        rate.sleep()


if __name__ == '__main__':
    try:
        main()
    except rospy.ROSInterruptException:
        pass
