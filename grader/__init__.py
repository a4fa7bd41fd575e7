"""An automated grader for introductory ROS 1 labs (rospy, catkin)."""

__version__ = "0.1.0"
