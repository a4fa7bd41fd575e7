#!/usr/bin/env python3
"""Says hello on /chatter and counts on /count, ten times a second: a class that keeps its state."""

import rospy
from std_msgs.msg import Int8, String


class Pulse:
    def __init__(self):
        rospy.init_node("pulse", anonymous=True)
        self.text_pub = rospy.Publisher("/chatter", String, queue_size=1)
        self.count_pub = rospy.Publisher("/count", Int8, queue_size=1)
        self.count = Int8(data=0)
        self.rate = rospy.Rate(10)

    def publish(self):
        self.text_pub.publish(String(data="hello world %s" % rospy.get_time()))
        self.count_pub.publish(self.count)
        self.count.data = 0 if self.count.data >= 127 else self.count.data + 1

    def run(self):
        while not rospy.is_shutdown():
            self.publish()
            self.rate.sleep()


if __name__ == "__main__":
    try:
        Pulse().run()
    except rospy.ROSInterruptException:
        pass
