"""Prints the robot's description in the present configuration: `describe.py MACROS`."""

import signal

for number in (signal.SIGINT, signal.SIGPIPE):  # a cancelled launch reads no output
    signal.signal(number, signal.SIG_DFL)

from maya_ros.ros1.description import main  # noqa: E402 - loading it takes a second

if __name__ == "__main__":
    raise SystemExit(main())
