#!/usr/bin/env python3
"""Adds up the steps of a walk, forward or backward, and writes them into a table."""

import csv

import rospy
from std_msgs.msg import Float64


class Distance:
    def __init__(self, file):
        self.total = 0.0
        self.file = file
        self.table = csv.writer(file)
        self.table.writerow(['step', 'distance'])
        self.distance = rospy.Publisher('/distance', Float64, queue_size=10)
        rospy.Subscriber('/steps', Float64, self.stepped)

    def stepped(self, message):
        self.total += abs(message.data)
        self.table.writerow([message.data, self.total])
        self.file.flush()
        self.distance.publish(self.total)


if __name__ == '__main__':
    rospy.init_node('distance')
    with open('distance.csv', 'w') as file:
        Distance(file)
        rospy.spin()
