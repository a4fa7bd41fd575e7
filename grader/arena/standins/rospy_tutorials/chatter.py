"""The two nodes of the first ROS tutorial: one says hello ten times a second, the other one logs what it hears."""

import rospy
from std_msgs.msg import String

RATE_HZ = 10
TOPIC = "chatter"


def talk():
    publisher = rospy.Publisher(TOPIC, String, queue_size=10)
    rospy.init_node("talker", anonymous=True)
    rate = rospy.Rate(RATE_HZ)
    try:
        while not rospy.is_shutdown():
            text = f"hello world {rospy.get_time()}"
            rospy.loginfo(text)
            publisher.publish(text)
            rate.sleep()
    except rospy.ROSInterruptException:
        rospy.logdebug("interrupted while it slept")


def listen():
    rospy.init_node("listener", anonymous=True)
    rospy.Subscriber(
        TOPIC, String, lambda message: rospy.loginfo("%sI heard %s", rospy.get_caller_id(), message.data)
    )
    rospy.spin()
