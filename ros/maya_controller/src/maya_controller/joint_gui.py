"""Node joint_gui: chooses between the robot and the sliders, whose joints are drawn."""

from maya_ros.ros1.nodes.joint_gui import main

if __name__ == "__main__":
    raise SystemExit(main())
