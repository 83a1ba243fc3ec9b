"""Node firebase_bridge: steps of remote processes, and their results."""

from maya_ros.ros1.nodes.firebase_bridge import main

if __name__ == "__main__":
    raise SystemExit(main())
