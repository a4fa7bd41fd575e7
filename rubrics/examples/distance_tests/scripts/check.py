#!/usr/bin/env python3
"""The instructor's tests: `check.py Average` of the C++ node, `check.py Alarm` of both nodes together."""

import sys
import time
import unittest

import rospy
import rostest
from std_msgs.msg import Bool, Float32

WAIT_S = 3


class Pair(unittest.TestCase):
    """Sends distances, and keeps what comes of them on one topic."""

    topic, type = "/mean", Float32
    silent = False  # what once did not come is not waited for again

    @classmethod
    def setUpClass(cls):
        cls.heard = []
        cls.answers = rospy.Subscriber(cls.topic, cls.type, lambda message: cls.heard.append(message.data))
        cls.distances = rospy.Publisher('/distance', Float32, queue_size=10, latch=True)  # a node that is late gets it too

    def setUp(self):
        self.assertTrue(self.waits(self.answers.get_num_connections), "no node publishes on " + self.topic)
        time.sleep(0.1)  # its publisher knows of this connection a moment later, and sends nothing before
        del self.heard[:]

    def waits(self, condition):
        until = time.time() + (0 if Pair.silent else WAIT_S)
        while not condition() and time.time() < until:
            time.sleep(0.02)
        Pair.silent = not condition()
        return not Pair.silent

    def send(self, *distances):
        """Send them one after the other, each after the answer to the one before."""
        for count, distance in enumerate(distances, 1):
            self.distances.publish(distance)
            came = self.waits(lambda: len(self.heard) >= count)
            self.assertTrue(came, "nothing comes on %s after the distance %g" % (self.topic, distance))


class Average(Pair):  # distances and means are not whole, so that a mean of integers shows
    def test_first_two(self):  # tests run in the order of their names, so nothing came before these
        self.send(4.5, 8)
        self.assertAlmostEqual(self.heard[0], 4.5, 3, "after the first distance, 4.5, the mean is %g" % self.heard[0])
        self.assertAlmostEqual(self.heard[1], 6.25, 3, "after the first two, 4.5 and 8, the mean is %g" % self.heard[1])

    def test_mean_of_three(self):
        self.send(1, 2.5, 7)
        self.assertAlmostEqual(
            self.heard[-1], 3.5, 3, "after 1, 2.5 and 7 the mean is %g, not 3.5" % self.heard[-1]
        )

    def test_only_the_last_three(self):
        self.send(50, 1, 2.5, 7)
        self.assertAlmostEqual(
            self.heard[-1], 3.5, 3, "after 50, 1, 2.5 and 7 the mean is %g, not 3.5" % self.heard[-1]
        )


class Alarm(Pair):
    topic, type = "/alarm", Bool

    def test_near(self):
        self.send(0.2, 0.3, 0.4)
        self.assertTrue(self.heard[-1], "no alarm where the mean is 0.3 m")

    def test_far(self):
        self.send(2, 2, 2)
        self.assertFalse(self.heard[-1], "an alarm where the mean is 2 m")

    def test_one_near(self):
        self.send(2, 2, 0.1)
        self.assertFalse(
            self.heard[-1], "an alarm where one distance of three is near, and the mean is 1.37 m"
        )


if __name__ == "__main__":
    rospy.init_node("check")
    rostest.rosrun("distance_tests", sys.argv[1].lower(), globals()[sys.argv[1]])
