"""Runs a program that opens windows, or prints one line why it cannot: `on_display.py PROGRAM [ARGUMENT ...]`."""

from maya_ros.ros1.display import main

if __name__ == "__main__":
    raise SystemExit(main())
