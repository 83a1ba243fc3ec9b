"""Node process_controller: the process floor and its queue."""

from maya_un.ros.nodes.process_controller import main

if __name__ == "__main__":
    raise SystemExit(main())
