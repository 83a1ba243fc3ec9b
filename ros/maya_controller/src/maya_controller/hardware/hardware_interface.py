"""Node hardware_interface: the controller layer on the machine."""

from maya_ros.ros1.nodes.hardware_interface import main

if __name__ == "__main__":
    raise SystemExit(main())
