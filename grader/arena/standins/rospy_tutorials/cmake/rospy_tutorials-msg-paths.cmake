set(rospy_tutorials_MSG_INCLUDE_DIRS "${CMAKE_CURRENT_LIST_DIR}/../msg")
set(rospy_tutorials_MSG_DEPENDENCIES std_msgs)
