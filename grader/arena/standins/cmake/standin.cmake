# What find_package(catkin COMPONENTS <package>) needs of a package that has messages and Python programs only.
macro(standin_package name)
  if(NOT ${name}_CONFIG_INCLUDED)
    set(${name}_CONFIG_INCLUDED TRUE)
    set(${name}_FOUND_CATKIN_PROJECT TRUE)
    set(${name}_INCLUDE_DIRS "")
    set(${name}_LIBRARIES "")
    set(${name}_LIBRARY_DIRS "")
    set(${name}_EXPORTED_TARGETS ${name}_generate_messages_cpp ${name}_generate_messages_py)
    foreach(target ${${name}_EXPORTED_TARGETS} ${name}_gencpp ${name}_genpy)
      if(NOT TARGET ${target})
        add_custom_target(${target})
      endif()
    endforeach()
    # find_package(gencpp …) would bring add_message_files(…) along, which a package has to ask for itself
    set(standin_ros ${catkin_DIR}/../../..)
    if(EXISTS ${standin_ros}/lib/gencpp/gen_cpp.py)
      standin_headers(${name})
    endif()
  endif()
endmacro()

# C++ headers by ROS's own generator, where it is installed; what it cannot make, no program can include.
macro(standin_headers name)
  set(standin_include ${CMAKE_BINARY_DIR}/standins/include)
  file(MAKE_DIRECTORY ${standin_include}/${name})
  file(GLOB standin_definitions ${${name}_DIR}/../msg/*.msg ${${name}_DIR}/../srv/*.srv)
  foreach(definition ${standin_definitions})
    execute_process(
      COMMAND
        ${PYTHON_EXECUTABLE} ${standin_ros}/lib/gencpp/gen_cpp.py ${definition} -p ${name} -o ${standin_include}/${name}
        -I${name}:${${name}_DIR}/../msg -Istd_msgs:${standin_ros}/share/std_msgs/msg -e ${standin_ros}/share/gencpp
      OUTPUT_QUIET ERROR_QUIET)
  endforeach()
  set(${name}_INCLUDE_DIRS ${standin_include})
endmacro()
