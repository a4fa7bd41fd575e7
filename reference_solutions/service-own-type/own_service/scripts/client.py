#!/usr/bin/env python3
"""Asks the server to keep a value between two bounds, and prints the answer."""

import sys

import rospy
from own_service.srv import Clamp

if __name__ == '__main__':
    rospy.init_node('clamp_client')
    value, low, high = map(float, rospy.myargv(sys.argv)[1:4])
    rospy.wait_for_service('/clamp')
    try:
        answer = rospy.ServiceProxy('/clamp', Clamp)(value, low, high)
        print('result: %.2f' % answer.result)
    except rospy.ServiceException as error:
        print('refused: %s' % error)
