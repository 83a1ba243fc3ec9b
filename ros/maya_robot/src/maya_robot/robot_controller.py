"""Node robot_controller: the robot layer, /maya_command and /maya_move."""

from maya_ros.ros1.nodes.robot_controller import main

if __name__ == "__main__":
    raise SystemExit(main())
