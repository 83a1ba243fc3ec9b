"""The pendant that `maya jog` opens on a terminal: keys move the robot by steps, and teach poses."""
