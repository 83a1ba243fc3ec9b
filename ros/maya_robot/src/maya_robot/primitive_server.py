"""Node primitive_server: the action /task."""

from maya_ros.ros1.nodes.primitive_server import main

if __name__ == "__main__":
    raise SystemExit(main())
