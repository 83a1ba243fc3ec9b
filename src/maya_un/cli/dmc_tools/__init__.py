"""`maya dmc`: the tools of `dmc`, and tools specific to the robot."""
