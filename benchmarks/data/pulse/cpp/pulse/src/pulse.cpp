// Says hello on /chatter and counts on /count, ten times a second: roscpp.
#include <sstream>

#include <ros/ros.h>
#include <std_msgs/Int8.h>
#include <std_msgs/String.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "pulse");
  ros::NodeHandle node;
  ros::Publisher text_pub = node.advertise<std_msgs::String>("chatter", 10);
  ros::Publisher count_pub = node.advertise<std_msgs::Int8>("count", 10);
  ros::Rate rate(10);
  int count = 0;
  while (ros::ok()) {
    std_msgs::String text;
    std::stringstream words;
    words << "hello world " << ros::Time::now().toSec();
    text.data = words.str();
    text_pub.publish(text);
    std_msgs::Int8 number;
    number.data = count;
    count_pub.publish(number);
    count = count == 127 ? 0 : count + 1;
    ros::spinOnce();
    rate.sleep();
  }
  return 0;
}
