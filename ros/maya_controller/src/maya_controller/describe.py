"""Prints the robot's description in the configuration that is in force: `describe.py MACROS`."""

import signal

for number in (signal.SIGINT, signal.SIGPIPE):  # of a launch that is given up nobody reads any more
    signal.signal(number, signal.SIG_DFL)

from maya_ros.ros1.description import main  # noqa: E402 - it takes a second to be read in

if __name__ == "__main__":
    raise SystemExit(main())
