"""The controller layer, in joint space: home, move, follow, gripper, stop, state and events of the machine."""
