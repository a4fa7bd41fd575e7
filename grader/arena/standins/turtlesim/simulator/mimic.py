"""The node `turtle_mimic`: what one turtle does, another one is told to do."""

import rospy
from geometry_msgs.msg import Twist
from turtlesim.msg import Pose


def main():
    rospy.init_node("turtle_mimic")
    given, wanted = rospy.resolve_name("input"), rospy.resolve_name("output")  # launch files remap these two
    publisher = rospy.Publisher(wanted + "/cmd_vel", Twist, queue_size=10)

    def follow(pose):
        twist = Twist()
        twist.linear.x, twist.angular.z = pose.linear_velocity, pose.angular_velocity
        publisher.publish(twist)

    rospy.Subscriber(given + "/pose", Pose, follow, queue_size=1)
    rospy.spin()
