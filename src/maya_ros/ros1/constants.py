"""The manual's constants of the machine, filled from the configuration, for ROS packages under any Python.

`python -m maya_ros.ros1.constants` prints them as JSON; that is how maya_controller.config.constants gets them.
"""

from __future__ import annotations

import json
import sys
from operator import attrgetter

from maya_un import config
from maya_un.config import Config
from maya_un.errors import MayaError

_BY_AXIS = {
    "ACCEL": "acceleration_counts",
    "DCEL": "deceleration_counts",
    "SP": "speed_counts",
}

KEYS = {
    "MAYA_ADDRESS": "controller.address",
    "COMS_SERVER_ADDRESS": "coms.server_address",
    "PULSES_PER_M": "scale.pulses_per_metre",
    "PULSES_PER_DEG": "scale.pulses_per_degree",
    "MAYA_HEIGHT": "geometry.height",
    "MAYA_LENGTH": "geometry.length",
    "DELTA": "geometry.delta",
    "SIGMA": "geometry.gripper_height",
    **{f"{letter}_0": f"axes.{letter.lower()}.minimum" for letter in "ABC"},
    **{f"{letter}_MAX": f"axes.{letter.lower()}.maximum" for letter in "ABC"},
    **{f"{name}_{letter}": f"axes.{letter.lower()}.{key}" for name, key in _BY_AXIS.items() for letter in "ABC"},
}
"""The key of the configuration for each name in the manual's module `constants`."""


def constants(machine: Config) -> dict[str, str | float]:
    """Return the values of the manual's module `constants` by its names, in its units: m, rad, counts."""
    return {name: attrgetter(key)(machine) for name, key in KEYS.items()}


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
