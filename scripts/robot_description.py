"""Writes the dimensions of the robot's description, which are those of the default configuration.

With --check it writes nothing and says whether they are current.
"""

from __future__ import annotations

import sys
from pathlib import Path

from maya_ros.graph.urdf import INCLUDE, MACROS, dimensions
from maya_un.config import Config

ROOT = Path(__file__).resolve().parent.parent
FILE = MACROS.parent / INCLUDE


def main(arguments: list[str]) -> int:
    """Write or check the file; return 1 where a check found that it is not current."""
    wanted = dimensions(Config())
    if FILE.exists() and FILE.read_text(encoding="utf-8") == wanted:
        return 0
    name = FILE.relative_to(ROOT)
    if "--check" in arguments:
        print(f"{name} is not current: run scripts/docs")
        return 1
    FILE.write_text(wanted, encoding="utf-8")
    print(name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
