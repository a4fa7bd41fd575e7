cmake_minimum_required(VERSION 3.0.2)
project(lab1)
find_package(catkin REQUIRED COMPONENTS rospy)
set(scripts src/a.py)
list(APPEND scripts src/b.py)
foreach(s IN LISTS scripts)
  if(EXISTS ${s})
    catkin_install_python(PROGRAMS ${s} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
endforeach()
#[[ a
comment ]]
message("a \"quote\" ${x}" [=[raw]=])
include(more.cmake)
add_subdirectory(sub)
%%% more.cmake
function(f a)
endfunction()
install(TARGETS x)
%%% sub/CMakeLists.txt
add_executable(x $<TARGET_OBJECTS:y> ../src/x.cpp)
