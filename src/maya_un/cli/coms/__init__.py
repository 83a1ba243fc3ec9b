"""`maya coms`: the link between the robot and its supervisors."""
