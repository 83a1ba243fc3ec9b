"""`maya up` and `maya down`: start, serve and end the robot's service."""
