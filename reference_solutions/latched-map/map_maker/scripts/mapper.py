#!/usr/bin/env python3

import math

import rospy
from geometry_msgs.msg import Point
from nav_msgs.msg import OccupancyGrid

FREE = 0
OCCUPIED = 100


class Mapper:

    def __init__(self):
        self.grid = OccupancyGrid()
        self.grid.header.frame_id = 'map'
        self.grid.info.width = rospy.get_param('~width', 10)
        self.grid.info.height = rospy.get_param('~height', 10)
        self.grid.info.resolution = rospy.get_param('~resolution', 1.0)
        self.grid.data = [FREE] * (self.grid.info.width * self.grid.info.height)
        self.publisher = rospy.Publisher('/map', OccupancyGrid, latch=True, queue_size=1)
        self.publisher.publish(self.grid)
        rospy.Subscriber('/obstacle', Point, self.mark)

    def mark(self, point):
        if not (math.isfinite(point.x) and math.isfinite(point.y)):
            return
        column = math.floor(point.x / self.grid.info.resolution)
        row = math.floor(point.y / self.grid.info.resolution)
        if not (0 <= column < self.grid.info.width and 0 <= row < self.grid.info.height):
            return
        self.grid.data[row * self.grid.info.width + column] = OCCUPIED
        self.publisher.publish(self.grid)


if __name__ == '__main__':
    rospy.init_node('mapper')
    mapper = Mapper()
    rospy.spin()
