#include <deque>
#include <numeric>

#include <ros/ros.h>
#include <std_msgs/Float32.h>

const std::size_t COUNT = 3;

ros::Publisher mean;
std::deque<float> last;

void hear(const std_msgs::Float32::ConstPtr& distance)
{
  last.push_back(distance->data);
  if (last.size() > COUNT)
    last.pop_front();
  std_msgs::Float32 message;
  message.data = std::accumulate(last.begin(), last.end(), 0.0f) / last.size();
  mean.publish(message);
}

int main(int argc, char** argv)
{
  ros::init(argc, argv, "average");
  ros::NodeHandle node;
  mean = node.advertise<std_msgs::Float32>("/mean", 10);
  ros::Subscriber distances = node.subscribe("/distance", 10, hear);
  ros::spin();
  return 0;
}
