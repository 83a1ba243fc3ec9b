"""Node joint_gui: chooses whose joints are drawn, those of the robot or of the sliders."""

from maya_ros.ros1.nodes.joint_gui import main

if __name__ == "__main__":
    raise SystemExit(main())
