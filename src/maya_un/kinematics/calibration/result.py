"""The result of a calibration: constants, their uncertainty, the residuals, and a text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.calibration.identify import FAR, SUSPECTS
from maya_un.kinematics.calibration.observations import Observations
from maya_un.kinematics.calibration.parameters import FITTED, FittedConstants, listed
from maya_un.kinematics.mechanism import Floats

_SURE = 4.0
"""A difference of so many standard errors is none by chance (once in 16 000)."""

_POOR = 1.5
"""Residuals larger than sigma by this factor say that sigma, or the model, is wrong."""

_CLOSE = 0.98
"""Constants that correlate more than this are hardly known one by one."""


class LineDifference(NamedTuple):
    """By which share line b would have more counts per metre than line c, and the standard error of that."""

    value: float
    error: float

    @property
    def is_significant(self) -> bool:
        """Whether chance is no explanation."""
        return abs(self.value) > _SURE * self.error


@dataclass(frozen=True, slots=True)
class Calibration:
    """The result of a fit.

    `now` and `fitted` are the constants before and after, `free` those that were fitted, `covariance` theirs in SI
    and counts, shape (p, p). `noise` is the standard deviation of a coordinate, from the residuals with `freedom`
    degrees of freedom: in m, or in sigmas where the rows have them. `residuals_before` and `residuals_after` are
    model less measured [m], shape (n, 3), outliers included; `inliers` says which rows are none, shape (n,).
    """

    now: FittedConstants
    fitted: FittedConstants
    free: tuple[str, ...]
    covariance: Floats
    noise: float
    freedom: int
    observations: Observations
    residuals_before: Floats
    residuals_after: Floats
    inliers: NDArray[np.bool_]
    line_difference: LineDifference | None

    @property
    def held(self) -> tuple[str, ...]:
        """The constants that stayed as they were."""
        return tuple(name for name in FITTED if name not in self.free)

    @property
    def errors(self) -> dict[str, float]:
        """Standard error of each fitted constant, in its own unit."""
        return dict(zip(self.free, (float(error) for error in np.sqrt(np.diag(self.covariance))), strict=True))

    @property
    def correlations(self) -> Floats:
        """Correlations of the fitted constants, shape (p, p)."""
        errors = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(errors, errors)

    @property
    def outliers(self) -> tuple[int, ...]:
        """Names of the rows with gross errors."""
        named = zip(self.observations.rows, self.inliers, strict=True)
        return tuple(row for row, inlier in named if not inlier)

    @property
    def rms_before(self) -> float:
        """Root mean square distance [m] between measured points and the model, before; outliers left out."""
        return _rms(self.residuals_before[self.inliers])

    @property
    def rms_after(self) -> float:
        """The same after the fit [m]."""
        return _rms(self.residuals_after[self.inliers])

    @property
    def words(self) -> tuple[str, ...]:
        """Notes that a person should read before using the result, a sentence each."""
        every = (
            self._about_height(),
            self._about_pairs(),
            self._about_noise(),
            self._about_outliers(),
            self._about_rest(),
            self._about_lines(),
        )
        return tuple(sentence for sentence in every if sentence)

    def _about_height(self) -> str:
        if "gripper_height" in self.free or "height" in self.free:
            held, other = ("height", "gripper_height") if "height" in self.held else ("gripper_height", "height")
            return (
                f"{listed([held])} is held and {listed([other])} fitted: gripper points show only their difference "
                "H − Φ, never each by itself; measure one with a ruler."
            )
        return ""

    def _about_pairs(self) -> str:
        close = np.argwhere(np.triu(np.abs(self.correlations), 1) > _CLOSE)
        names = {self.free[index] for pair in close for index in pair}
        if not names:
            return ""
        return f"{listed(names)} are known well only together: each may be off by more than the points are."

    def _about_noise(self) -> str:
        if self.observations.sigma is None or self.noise <= _POOR:
            return ""
        return (
            f"The points are {self.noise:.1f} times as far off as their sigma says: either it is too small, or the "
            "machine bends in ways that these constants do not describe. The errors named here are too small then."
        )

    def _about_outliers(self) -> str:
        if 5 * len(self.outliers) <= len(self.inliers):
            return ""
        return (
            f"{len(self.outliers)} of {len(self.inliers)} points are left out as outliers. So many are no accident: "
            "look at how they were measured."
        )

    def _about_rest(self) -> str:
        if self.rms_after < FAR:
            return ""
        return (
            f"After the fit the points are still off by {self.rms_after * 1e3:.0f} mm (rms): do not apply this, but "
            f"{SUSPECTS}."
        )

    def _about_lines(self) -> str:
        found = self.line_difference
        if found is None or not found.is_significant:
            return ""
        return (
            f"Lines b and c seem to differ in counts per metre by {found.value * 100.0:.3f} % "
            f"(± {found.error * 200.0:.3f} %); the configuration has one number for both, their mean."
        )


def _rms(residuals: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(residuals * residuals, axis=1))))
