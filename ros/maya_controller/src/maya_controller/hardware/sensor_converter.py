"""Node sensor_converter: what the machine's controller measures."""

from maya_ros.ros1.nodes.sensor_converter import main

if __name__ == "__main__":
    raise SystemExit(main())
