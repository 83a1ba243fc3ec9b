#!/bin/sh
# Starts ros-coms, the link to the cloud, where there is one; roslaunch calls it unless skip_firebase is true.
echo "ros-coms is not part of this version: steps come from /step_command, and nothing goes to the cloud." \
    "skip_firebase:=true leaves this line out."
