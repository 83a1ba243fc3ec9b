"""`maya record` and `maya replay`: recordings of the robot, listed, exported and replayed."""
