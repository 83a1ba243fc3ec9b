"""Torque limits of the line motors: almost no torque at rest; in motion what the path needs, and a reserve.

A self-locking drum holds its load without its motor. So a line outside our motions gets too little torque to lift any
load: if another program begins a motion of it, the line stays. The bound is kept
by the controller (Galil DMC-41x3, command TL), so it holds also while this program is late or dead.

To shorten a line that carries T loads, a motor needs `homing.torque_per_load` times T, and friction.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import floor

import numpy as np

from maya_un.config import Config
from maya_un.kinematics.mechanism import Floats

HOLD = 0.25
"""Torque of a line at rest [loads]: it overcomes friction at most, and holds the motor against shaking."""

HOMING = 4.0
"""Torque of a line that homing moves [loads]: it needs 2.6 on the tightest ellipse, and friction up to half a load."""

SPARE, FRICTION = 1.25, 1.0
"""In motion, a line gets this multiple of the greatest tension of its path, and these loads for friction."""

_LINES = (1, 2)
_STEP = 20.0 / 65536.0
_MOST = 9.9982

Volts = Mapping[str, float]
"""Torque limits by the letters of the controller's axes [V]."""


class Torque:
    """Torque limits of the lines of one machine."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._letters = {axis: config.axes[axis].letter for axis in _LINES}
        self._width = config.geometry.width

    @property
    def most(self) -> Volts:
        """The limits for the greatest tension of any path."""
        return self._each(_LINES, self._needed(self._config.safety.tension_limit))

    @property
    def rest(self) -> Volts:
        """The limits at rest; a drum that is not self-locking needs its motor to hold the load."""
        return self._each(_LINES, HOLD) if self._config.safety.self_locking else self.most

    def homing(self, axes: Collection[int]) -> Volts:
        """Return the limits for a step of homing that moves `axes` (0 to 2)."""
        if not self._config.safety.self_locking:
            return self.most
        return {**self.rest, **self._each(axes, HOMING)}

    def travel(self, axes: Collection[int], knots: Floats) -> Volts:
        """Return the limits for a motion of `axes` (0 to 2) through `knots` (n, 3) [rad, m, m]."""
        if not self._config.safety.self_locking:
            return self.most
        return {**self.rest, **self._each(axes, self._needed(self.peak(knots)))}

    def peak(self, knots: Floats) -> float:
        """Return the greatest tension of a line at any of `knots` [multiples of the load].

        T_b = (W - u)/W · b/h and T_c = u/W · c/h, with u and h the place of the load from anchor b.
        """
        b, c, width = knots[:, 1], knots[:, 2], self._width
        u = np.clip((width * width + b * b - c * c) / (2.0 * width), 0.0, width)
        h = np.sqrt(np.maximum(b * b - u * u, 1e-9))
        return float((np.maximum((width - u) * b, u * c) / (width * h)).max(initial=0.0))

    @staticmethod
    def _needed(tension: float) -> float:
        return SPARE * tension + FRICTION

    def _each(self, axes: Collection[int], loads: float) -> dict[str, float]:
        volts = min(_MOST, loads * self._config.homing.torque_per_load)
        kept = floor(volts / _STEP) * _STEP
        return {self._letters[axis]: kept for axis in axes if axis in self._letters}


def commands(limits: Volts) -> list[str]:
    """Return the commands that set torque limits."""
    return [f"TL{letter}={volts + 1e-5:.5f}" for letter, volts in limits.items()]  # rounded up: the controller cuts
