#!/bin/sh
# Starts ros-coms, the link to supervisors. It stays idle until POST http://localhost:3000/connect; MAYA_COMS_URL names
# the supervisors' server. roslaunch calls this unless skip_firebase is true.
exec rosrun maya_process ros_coms.py
