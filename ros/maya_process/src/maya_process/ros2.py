"""Node ros2: this graph for programs of ROS 2."""

from maya_ros.ros1.nodes.ros2 import main

if __name__ == "__main__":
    raise SystemExit(main())
