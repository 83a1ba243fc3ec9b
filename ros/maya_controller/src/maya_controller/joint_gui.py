"""Node joint_gui: chooses between the robot and the sliders, whose joints are drawn."""

from maya_un.ros.nodes.joint_gui import main

if __name__ == "__main__":
    raise SystemExit(main())
