include(${CMAKE_CURRENT_LIST_DIR}/../../../cmake/standin.cmake)
standin_package(robot_world)
