"""The tools of `maya dmc`: a terminal, live values, recordings, programs, and the wire itself.

All of them speak to a controller through the driver, so that they work on the twin and on a real one alike.
"""
