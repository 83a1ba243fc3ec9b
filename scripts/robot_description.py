"""Writes the dimensions of the robot's description, which are those of the default configuration.

With --check it writes nothing and says whether they are current.
"""

from __future__ import annotations

import sys

from generated_files import update

from maya_ros.graph.urdf import INCLUDE, MACROS, dimensions
from maya_un.config import Config


def main(arguments: list[str]) -> int:
    """Write or check the file; return 1 where a check found that it is not current."""
    return update({MACROS.parent / INCLUDE: dimensions(Config())}, arguments, "scripts/docs")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
