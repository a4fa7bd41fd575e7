set(turtlesim_MSG_INCLUDE_DIRS "${CMAKE_CURRENT_LIST_DIR}/../msg")
set(turtlesim_MSG_DEPENDENCIES geometry_msgs std_msgs std_srvs)
