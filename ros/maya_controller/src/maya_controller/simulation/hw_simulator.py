"""Node hw_simulator: the controller layer on the virtual twin."""

from maya_ros.ros1.nodes.hw_simulator import main

if __name__ == "__main__":
    raise SystemExit(main())
