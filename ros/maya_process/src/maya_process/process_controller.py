"""Node process_controller: the process layer and its queue."""

from maya_ros.ros1.nodes.process_controller import main

if __name__ == "__main__":
    raise SystemExit(main())
