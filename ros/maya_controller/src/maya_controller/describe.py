"""Prints the robot's description in the configuration that is in force: `describe.py MACROS`."""

from maya_un.ros.description import main

if __name__ == "__main__":
    raise SystemExit(main())
