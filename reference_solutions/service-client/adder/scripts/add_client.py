#!/usr/bin/env python3
"""Asks the service /add for the sum of two numbers, and prints what comes back."""

import sys

import rospy
from adder.srv import Add

if __name__ == '__main__':
    rospy.init_node('add_client')
    a, b = map(int, rospy.myargv(sys.argv)[1:3])
    rospy.wait_for_service('/add')
    add = rospy.ServiceProxy('/add', Add)
    try:
        answer = add(a, b)
        print('sum: %d' % answer.sum)
    except rospy.ServiceException as error:
        print('failed: %s' % error)
