"""The lengths and strokes of the manual's machine, and the place of the file that may change them.

It imports nothing heavy: without such a file, `maya fk` and `maya ik` need nothing more.
"""

from __future__ import annotations

import os
from math import pi
from pathlib import Path

from maya_un.namespace import own

HEIGHT = 2.35
"""H, height of the anchors above the table [m]."""

LENGTH = 2.30
"""D, distance of anchor c from axis a [m]."""

DELTA = 0.30
"""Distance of anchor b from axis a [m]."""

GRIPPER_HEIGHT = 0.20
"""Phi, from the meeting point of the lines to the gripper point [m]."""

STROKES = ((0.0, 2 * pi / 3), (0.575, 2.260), (0.565, 2.300))
"""Short and long end of axes a, b, c (rad, m, m)."""

TENSION_LIMIT = 5.0
"""Highest tension of a line, as a multiple of the load (errata 1)."""


def default_path() -> Path:
    """Return the place of the configuration: $MAYA_CONFIG, else maya/config.toml in the user's folder.

    In a ROS namespace it is the file of the Maya in that namespace, unless $MAYA_CONFIG names one.
    """
    named = os.environ.get("MAYA_CONFIG")
    if named:
        return Path(named)
    home = os.environ.get("XDG_CONFIG_HOME")
    return own((Path(home) if home else Path.home() / ".config") / "maya") / "config.toml"
