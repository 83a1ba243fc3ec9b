"""`maya record` and `maya replay`: list, export and replay recordings of the robot."""
