"""The command `dmc`: a terminal, live values, recordings, programs, wire captures, and a twin.

`maya dmc` offers the same tools. `console.Site` supplies the parts that depend on the robot.
"""
