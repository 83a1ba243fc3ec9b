"""The dashboard of the robot Maya on a ROS graph.

The parts without Qt and ROS: `words` (English and Spanish), `lengths`, `tasks`, `seen` (what is known of the robot),
`reasons` (why something cannot be done now), `teleop`. `robot` defines the interface of a robot; `ui_controller`
implements it over rospy. `dashboard` is the widget, `maya_ui_module` its rqt plugin, `start` its separate window.

Only rospy, Qt and Python 3.8 are needed, so that it runs wherever rqt does.
"""
