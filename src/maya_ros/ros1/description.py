"""Prints the robot's description for launch files: `describe.py MACROS`, in the configuration that `maya` would read.

It needs no master. If xacro is not installed, it prints an error and fails, so that the launch fails too.
"""

from __future__ import annotations

import sys
from pathlib import Path

from dmc41x3.i18n import phrase
from maya_ros.graph.urdf import describe
from maya_un.config import load
from maya_un.errors import MayaError, RosMissing


def main() -> int:
    """Print the description from the file in the argument; return 1 after an error, 2 without an argument."""
    if len(sys.argv) != 2:
        print("usage: describe.py MACROS", file=sys.stderr)
        return 2
    try:
        print(_described(Path(sys.argv[1])))
    except MayaError as error:
        print(f"{error.code} {error}", file=sys.stderr)
        return 1
    return 0


def _described(macros: Path) -> str:
    try:
        return describe(load(), macros)
    except ModuleNotFoundError as missing:
        reason = phrase("{name} is not installed; it generates the robot's description", name=missing.name)
        raise RosMissing(reason=reason) from missing
