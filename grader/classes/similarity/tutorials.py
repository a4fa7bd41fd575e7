"""What everyone writes who has read ROS's first tutorial: a talker and a listener. It is no one's own.

Names and texts do not matter to the comparison, only the order of what is done.
"""

from __future__ import annotations

from grader.classes.similarity.sources import Source

_TALKER = """
import rospy
from std_msgs.msg import String

def say():
    words = rospy.Publisher('words', String, queue_size=10)
    rospy.init_node('speaker', anonymous=True)
    pace = rospy.Rate(10)
    while not rospy.is_shutdown():
        text = "it is %s" % rospy.get_time()
        rospy.loginfo(text)
        words.publish(text)
        pace.sleep()

if __name__ == '__main__':
    try:
        say()
    except rospy.ROSInterruptException:
        pass
"""

_LISTENER = """
import rospy
from std_msgs.msg import String

def heard(message):
    rospy.loginfo(rospy.get_caller_id() + "it said %s", message.data)

def listen():
    rospy.init_node('hearer', anonymous=True)
    rospy.Subscriber("words", String, heard)
    rospy.spin()

if __name__ == '__main__':
    listen()
"""

_TALKER_CPP = """
#include "ros/ros.h"
#include "std_msgs/String.h"
#include <sstream>

int main(int argc, char **argv)
{
  ros::init(argc, argv, "speaker");
  ros::NodeHandle node;
  ros::Publisher words = node.advertise<std_msgs::String>("words", 1000);
  ros::Rate pace(10);
  int number = 0;
  while (ros::ok())
  {
    std_msgs::String message;
    std::stringstream text;
    text << "it is " << number;
    message.data = text.str();
    ROS_INFO("%s", message.data.c_str());
    words.publish(message);
    ros::spinOnce();
    pace.sleep();
    ++number;
  }
  return 0;
}
"""

_LISTENER_CPP = """
#include "ros/ros.h"
#include "std_msgs/String.h"

void heard(const std_msgs::String::ConstPtr& message)
{
  ROS_INFO("it said [%s]", message->data.c_str());
}

int main(int argc, char **argv)
{
  ros::init(argc, argv, "hearer");
  ros::NodeHandle node;
  ros::Subscriber words = node.subscribe("words", 1000, heard);
  ros::spin();
  return 0;
}
"""

_QUIET_TALKER = _TALKER.replace(", anonymous=True", "").replace("        rospy.loginfo(text)\n", "")
_QUIET_LISTENER = _LISTENER.replace(", anonymous=True", "").replace('rospy.get_caller_id() + "it', '"it')
TUTORIALS = (
    Source(path="talker.py", code=_TALKER, language="python"),
    Source(path="talker.py without a log", code=_QUIET_TALKER, language="python"),
    Source(path="listener.py", code=_LISTENER, language="python"),
    Source(path="listener.py without its id", code=_QUIET_LISTENER, language="python"),
    Source(path="talker.cpp", code=_TALKER_CPP, language="cpp"),
    Source(path="listener.cpp", code=_LISTENER_CPP, language="cpp"),
)
