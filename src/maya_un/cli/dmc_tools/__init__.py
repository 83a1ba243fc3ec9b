"""`maya dmc`: the tools of `dmc`, with those that know the robot."""
