"""The command `dmc`: a terminal, live values, recordings, programs, the wire itself, and a twin.

`maya dmc` offers the same tools. What depends on the robot stands behind `site.Site`.
"""
