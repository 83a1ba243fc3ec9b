# Sets MAYA_PYTHON to the Python that nodes run under: the one that is given (-DMAYA_PYTHON, or $MAYA_PYTHON), else
# .venv-ros in the checkout that this file, links followed, lies in.

get_filename_component(_checkout "${CMAKE_CURRENT_LIST_DIR}" REALPATH)
get_filename_component(_checkout "${_checkout}/../../.." ABSOLUTE)
if(NOT MAYA_PYTHON)
  #catkin_lint: ignore_once env_var
  set(MAYA_PYTHON "$ENV{MAYA_PYTHON}")
endif()
if(NOT MAYA_PYTHON)
  set(MAYA_PYTHON "${_checkout}/.venv-ros/bin/python")
endif()

execute_process(
  COMMAND "${MAYA_PYTHON}" -c "import maya_un, rospy"
  RESULT_VARIABLE _refused
  ERROR_VARIABLE _reason
)
if(_refused AND NOT MAYA_MESSAGES_ONLY)
  message(FATAL_ERROR
    "${MAYA_PYTHON} cannot run Maya's nodes: ${_refused} ${_reason}\n"
    "${_checkout}/scripts/ros makes a Python that can, in .venv-ros; or give your own, with maya-un and rospy in it, "
    "as -DMAYA_PYTHON=/path/to/python. -DMAYA_MESSAGES_ONLY=ON builds the messages alone, without nodes."
  )
endif()
