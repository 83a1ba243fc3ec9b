"""The manual's constants of the machine, filled from the configuration, for ROS packages under any Python.

`python -m maya_ros.ros1.constants` prints them as JSON; that is how maya_controller.config.constants gets them.
"""

from __future__ import annotations

import json
import sys

from maya_un import config
from maya_un.config import Config
from maya_un.errors import MayaError


def constants(machine: Config) -> dict[str, str | float]:
    """Return the values of the manual's module `constants` by its names, in its units: m, rad, counts."""
    geometry, axes = machine.geometry, machine.axes
    named = {"A": axes.a, "B": axes.b, "C": axes.c}
    return {
        "MAYA_ADDRESS": machine.controller.address,
        "COMS_SERVER_ADDRESS": machine.coms.server_address,
        "PULSES_PER_M": machine.scale.pulses_per_metre,
        "PULSES_PER_DEG": machine.scale.pulses_per_degree,
        "MAYA_HEIGHT": geometry.height,
        "MAYA_LENGTH": geometry.length,
        "DELTA": geometry.delta,
        "SIGMA": geometry.gripper_height,
        **{f"{letter}_0": axis.minimum for letter, axis in named.items()},
        **{f"{letter}_MAX": axis.maximum for letter, axis in named.items()},
        **{f"ACCEL_{letter}": axis.acceleration_counts for letter, axis in named.items()},
        **{f"DCEL_{letter}": axis.deceleration_counts for letter, axis in named.items()},
        **{f"SP_{letter}": axis.speed_counts for letter, axis in named.items()},
    }


def main() -> int:
    """Print the constants, or an error; return the exit code."""
    try:
        print(json.dumps(constants(config.load())))
    except MayaError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
