"""Node rosbridge: this graph for clients of the rosbridge protocol."""

from maya_ros.ros1.nodes.rosbridge import main

if __name__ == "__main__":
    raise SystemExit(main())
