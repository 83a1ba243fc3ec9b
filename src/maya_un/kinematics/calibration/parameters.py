"""The constants that a calibration fits, and the measurements to which it fits them.

The module has their names and their keys in the configuration.

With counts n read from the controller, scales k and zeros o (index a, b, c):

    α = n_a / k_a + o_a     b = n_b / (k (1 + e/2)) + o_b     c = n_c / (k (1 − e/2)) + o_c

A zero is the true joint value where the present configuration reads 0. Homing defines the counts at the short-end
switches, so a zero other than 0 means that a switch does not trip at `axes.*.minimum`.

Measurements: raw counts, and the true position of the gripper point.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import pi, radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmc41x3.i18n import phrase
from maya_un.axes import AXES
from maya_un.config import Config, Units
from maya_un.errors import UnknownName
from maya_un.kinematics.mechanism import Floats


class FittedConstants(NamedTuple):
    """The constants of one machine that a calibration considers.

    `height`, `length`, `delta`, `gripper_height` are H, D, Δ, Φ [m]; `pulses_per_metre` is the mean of lines b and c,
    `pulses_per_degree` belongs to axis a; the zeros are in rad, m, m. `line_difference` is e, the relative difference
    of the counts per metre of line b from line c. The configuration has one scale for both, so e is 0 in every fit and
    only estimated afterwards.
    """

    height: float
    length: float
    delta: float
    gripper_height: float
    pulses_per_metre: float
    pulses_per_degree: float
    zero_a: float = 0.0
    zero_b: float = 0.0
    zero_c: float = 0.0
    line_difference: float = 0.0

    @classmethod
    def of(cls, config: Config) -> FittedConstants:
        """Return the constants of a configuration; its zeros are 0."""
        geometry, scale = config.geometry, config.scale
        return cls(
            geometry.height,
            geometry.length,
            geometry.delta,
            geometry.gripper_height,
            scale.pulses_per_metre,
            scale.pulses_per_degree,
        )

    def keys(self, config: Config) -> dict[str, float]:
        """Return the keys of `config` that these constants change, with their new values.

        The ends of a stroke stay at the same counts, that is at the same places of the machine, and get new lengths
        (angles): an end at n counts is n / k + o. So the zeros take effect with the next homing, which defines the
        counts at `axes.*.minimum`. Lengths are rounded to nanometres.
        """
        new = {f"geometry.{name}": round(getattr(self, name), 9) for name in _LENGTHS}
        new |= {f"scale.{name}": round(getattr(self, name), 6) for name in _SCALES}
        before = Units.of(config).per_unit
        after = (self.pulses_per_degree * 180.0 / pi, self.pulses_per_metre, self.pulses_per_metre)
        for index, (name, zero) in enumerate(zip(AXES, (self.zero_a, self.zero_b, self.zero_c), strict=True)):
            for end in ("minimum", "maximum"):
                counts = getattr(config.axes[index], end) * before[index]
                new[f"axes.{name}.{end}"] = round(counts / after[index] + zero, 9)
        return {key: value for key, value in new.items() if _differs(value, value_of(config, key))}


_FINEST = 1e-7
"""A change of a key by less than 0.1 µm, or by this share, is ignored."""

_LENGTHS = ("height", "length", "delta", "gripper_height")
_SCALES = ("pulses_per_metre", "pulses_per_degree")

FITTED = FittedConstants._fields[:-1]
"""The constants that can be fitted, in the order of `FittedConstants`."""

TYPICAL = FittedConstants(0.01, 0.01, 0.01, 0.01, 1e4, 3.7106, radians(1.0), 0.01, 0.01, 0.01)
"""Plausible error of each constant in the configuration: 10 mm, 1 %, 1°. Scales every fit."""

WORDS = {
    "height": phrase("height (H)"),
    "length": phrase("length (D)"),
    "delta": phrase("delta (Δ)"),
    "gripper_height": phrase("gripper_height (Φ)"),
    "pulses_per_metre": phrase("counts per metre"),
    "pulses_per_degree": phrase("counts per degree"),
    "zero_a": phrase("zero of a"),
    "zero_b": phrase("zero of b"),
    "zero_c": phrase("zero of c"),
}
"""Names of the constants for display."""

_SHORT = {"h": "height", "d": "length", "phi": "gripper_height", "sigma": "gripper_height"}


def value_of(config: Config, key: str) -> float:
    """Return the value of a dotted key of the configuration."""
    found: object = config
    for part in key.split("."):
        found = getattr(found, part)
    assert isinstance(found, float)
    return found


def _differs(new: float, old: float) -> bool:
    return abs(new - old) > _FINEST * max(1.0, abs(old))


def named(text: str) -> str:
    """Return the constant named by `text`: its name, or H, D, Delta, Phi; raises `UnknownName`."""
    name = _SHORT.get(text.lower(), text.lower().replace("-", "_"))
    if name not in FITTED:
        raise UnknownName(name=text, known=", ".join(FITTED))
    return name


def listed(names: Iterable[str]) -> str:
    """Return constants in words, in their order: "length (D), zero of b and zero of c"."""
    words = [WORDS[name] for name in FITTED if name in set(names)]
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


@dataclass(frozen=True, slots=True)
class Observations:
    """Measured points.

    `counts` of a, b, c, shape (n, 3), are the controller's counts after a homing with the present configuration;
    `points` x, y, z [m], shape (n, 3); `sigma`, shape (n,), is the standard deviation of each coordinate of a row [m],
    None if unknown; `rows` names each row for display (its line in a file), by default 1, 2, ... Raises `ValueError`
    for other shapes, for numbers that are not finite and for a sigma that is not positive.
    """

    counts: Floats
    points: Floats
    sigma: Floats | None = None
    rows: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.counts)
        if self.counts.shape != (count, 3) or self.points.shape != (count, 3):
            raise ValueError("counts and points have the shape (n, 3)")
        if self.sigma is not None and (self.sigma.shape != (count,) or not bool(np.all(self.sigma > 0.0))):
            raise ValueError("sigma has the shape (n,) and is positive")
        if not all(bool(np.all(np.isfinite(part))) for part in (self.counts, self.points, self.weights)):
            raise ValueError("every number is finite")
        if not self.rows:
            object.__setattr__(self, "rows", tuple(range(1, count + 1)))
        if len(self.rows) != count:
            raise ValueError("every row has a name")
        for part in (self.counts, self.points, self.sigma):
            if part is not None:
                part.setflags(write=False)

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def weights(self) -> Floats:
        """1 / sigma of each row [1/m], shape (n,); 1 if sigma is unknown."""
        return np.ones(len(self.counts)) if self.sigma is None else 1.0 / self.sigma

    def chosen(self, rows: NDArray[np.bool_]) -> Observations:
        """Return the observations of the rows where the mask of shape (n,) is True."""
        sigma = None if self.sigma is None else self.sigma[rows].copy()
        names = tuple(int(row) for row in np.array(self.rows)[rows])
        return Observations(self.counts[rows].copy(), self.points[rows].copy(), sigma, names)
