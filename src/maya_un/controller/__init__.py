"""Floor 1: joint space. Home, move, follow, gripper, stop, state and events of the machine."""
