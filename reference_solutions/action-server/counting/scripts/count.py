#!/usr/bin/env python3
"""Counts up to a goal, ten times a second, and stops when it is told to."""

import actionlib
import rospy
from counting.msg import CountAction, CountFeedback, CountResult


class Count:
    def __init__(self):
        self.server = actionlib.SimpleActionServer('/count', CountAction, execute_cb=self.execute, auto_start=False)
        self.server.start()

    def execute(self, goal):
        total = 0
        if goal.target < 0:
            self.server.set_aborted(CountResult(total), 'there is nothing below 0')
            return
        rate = rospy.Rate(10)
        while total < goal.target:
            if self.server.is_preempt_requested():
                self.server.set_preempted(CountResult(total))
                return
            total += 1
            self.server.publish_feedback(CountFeedback(total))
            rate.sleep()
        self.server.set_succeeded(CountResult(total))


if __name__ == '__main__':
    rospy.init_node('count')
    count = Count()
    rospy.spin()
