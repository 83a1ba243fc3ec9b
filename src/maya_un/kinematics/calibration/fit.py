"""The fit of the constants to measured points, and its result: constants, their uncertainty, the residuals, and a text.

The fit is robust first, to find gross errors; then it is a least-squares fit of the remaining points.

The robust stage minimises Σ 2 (√(1 + r²) − 1) with r the residuals over their scale (the median of their sizes over
0.6745). A point farther than `GROSS` scales from the model is an outlier. The other rows are fitted by least squares;
the covariance is s² (JᵀJ)⁻¹, with s = 1 if each row has its sigma, else estimated with 3n − p degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue
from maya_un.kinematics.calibration import identify, model
from maya_un.kinematics.calibration.identify import FAR, SUSPECTS
from maya_un.kinematics.calibration.parameters import FITTED, FittedConstants, Observations, listed
from maya_un.kinematics.mechanism import Floats

_SURE = 4.0
"""A difference of this many standard errors is significant (by chance once in 16 000)."""

_POOR = 1.5
"""Residuals larger than sigma by this factor show that sigma, or the model, is wrong."""

_CLOSE = 0.98
"""Constants that correlate more than this are hardly known individually."""


class LineDifference(NamedTuple):
    """Relative difference of the counts per metre of line b from those of line c, and its standard error."""

    value: float
    error: float

    @property
    def is_significant(self) -> bool:
        """Return whether the difference is significant."""
        return abs(self.value) > _SURE * self.error


@dataclass(frozen=True, slots=True)
class Calibration:
    """The result of a fit.

    `now` and `fitted` are the constants before and after, `free` those that were fitted, `covariance` theirs in SI and
    counts, shape (p, p). `noise` is the standard deviation of a coordinate, from the residuals with `freedom` degrees
    of freedom: in m, or in sigmas if the rows have them. `residuals_before` and `residuals_after` are model less
    measured [m], shape (n, 3), outliers included; `inliers` marks the other rows, shape (n,).
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
        """The constants that were not fitted."""
        return tuple(name for name in FITTED if name not in self.free)

    @property
    def errors(self) -> dict[str, float]:
        """Standard error of each fitted constant, in the unit of the constant."""
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
        """Root mean square distance [m] between measured points and the model, before the fit; without outliers."""
        return _rms(self.residuals_before[self.inliers])

    @property
    def rms_after(self) -> float:
        """The same after the fit [m]."""
        return _rms(self.residuals_after[self.inliers])

    @property
    def words(self) -> tuple[str, ...]:
        """Notes that a user should read before using the result, a sentence each."""
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
            return phrase(
                "{held} is held and {other} fitted: gripper points show only their difference "
                "H − Φ, never each by itself; measure one with a ruler.",
                held=listed([held]),
                other=listed([other]),
            )
        return ""

    def _about_pairs(self) -> str:
        close = np.argwhere(np.triu(np.abs(self.correlations), 1) > _CLOSE)
        names = {self.free[index] for pair in close for index in pair}
        if not names:
            return ""
        return phrase(
            "{names} are known well only together: each may be off by more than the points are.", names=listed(names)
        )

    def _about_noise(self) -> str:
        if self.observations.sigma is None or self.noise <= _POOR:
            return ""
        return phrase(
            "The points deviate by {times:.1f} times their sigma. Either sigma is too small, or the machine "
            "bends in ways that these constants do not describe. In both cases the errors given here are too small.",
            times=self.noise,
        )

    def _about_outliers(self) -> str:
        if 5 * len(self.outliers) <= len(self.inliers):
            return ""
        return phrase(
            "{count} of {points} points are left out as outliers. Too many for chance: check how they were measured.",
            count=len(self.outliers),
            points=len(self.inliers),
        )

    def _about_rest(self) -> str:
        if self.rms_after < FAR:
            return ""
        return phrase(
            "After the fit the points are still off by {off:.0f} mm (rms): do not apply this, but {remedy}.",
            off=self.rms_after * 1e3,
            remedy=SUSPECTS,
        )

    def _about_lines(self) -> str:
        found = self.line_difference
        if found is None or not found.is_significant:
            return ""
        return phrase(
            "Lines b and c seem to differ in counts per metre by {difference:.3f} % (± {error:.3f} %); "
            "the configuration has one number for both, their mean.",
            difference=found.value * 100.0,
            error=found.error * 200.0,
        )


def _rms(residuals: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(residuals * residuals, axis=1))))


GROSS = 5.0
"""A point farther away than this many scales is an outlier; of good points, one in 65 000 is (χ², 3 degrees of
freedom).
"""

_FINEST = 1e-7
"""Least scale of residuals [m]: an encoder counts micrometres."""

_ROUNDS = 8
_EXACT, _ROUGH = 1e-12, 1e-6
_LEAST_NOISE = 1e-12
"""Smallest noise that is assumed [m]: points of one place may fit exactly."""

_MEDIAN = 0.6744897501960817
"""Median size of a normal deviate of standard deviation 1."""

_MEDIAN_NORM = 1.5381722544550522
"""Median length of a vector of three such deviates (χ, 3 degrees of freedom)."""


def calibrate(
    observations: Observations, now: FittedConstants, hold: Collection[str] = ("gripper_height",)
) -> Calibration:
    """Fit the constants to measured points, starting from `now`.

    `hold` names the constants that stay unchanged. Gripper points show only H − Φ: if neither is held, Φ is. Raises
    `NotIdentifiable` if the points do not determine the others, `InvalidValue` if all are held.
    """
    held = frozenset(hold) if {"height", "gripper_height"} & set(hold) else frozenset(hold) | {"gripper_height"}
    free = tuple(name for name in FITTED if name not in held)
    if not free:
        raise InvalidValue(key="hold", value=", ".join(FITTED), reason="nothing is left to fit")
    identify.require_enough(observations, free)
    problem = _Problem(observations, now, free)
    solution, inliers = problem.trimmed(problem.robust(problem.turned()))
    problem.require_told(solution, inliers)
    return problem.conclude(solution, inliers)


class _Problem:
    """One fit: steps from `now` in units of the plausible errors, residuals over sigma if it is known."""

    def __init__(self, observations: Observations, now: FittedConstants, free: Sequence[str]) -> None:
        self._seen = observations
        self._now = now
        self._free = tuple(free)
        self._columns = identify.columns(free)
        self._units = identify.typical(free)
        self._finest = _FINEST if observations.sigma is None else _FINEST * float(np.max(observations.weights))

    def turned(self) -> Floats:
        """Return the step that turns the machine towards the points, whose frame may have another zero direction."""
        step = np.zeros(len(self._free))
        if "zero_a" in self._free:
            bearing = np.arctan2(self._seen.points[:, 0], self._seen.points[:, 1])
            angle = model.joints(self._now, self._seen.counts)[:, 0]
            place = self._free.index("zero_a")
            step[place] = float(np.angle(np.sum(np.exp(1j * (bearing - angle))))) / self._units[place]
        return step

    def at(self, step: Floats) -> FittedConstants:
        """Return the constants after a step."""
        changed = np.array(self._now, dtype=float)
        changed[self._columns] += step * self._units
        return FittedConstants(*(float(value) for value in changed))

    def residuals(self, step: Floats) -> Floats:
        """Return weighted residuals, shape (n, 3)."""
        missed = model.points(self.at(step), self._seen.counts) - self._seen.points
        return missed * self._seen.weights[:, None]

    def jacobian(self, step: Floats) -> Floats:
        """Return their derivatives by the step, shape (n, 3, p)."""
        by_constants = model.jacobian(self.at(step), self._seen.counts)[:, :, self._columns]
        return by_constants * self._units * self._seen.weights[:, None, None]

    def scale(self, residuals: Floats) -> float:
        """Return the robust standard deviation of weighted residuals; at least 1 if sigma is known."""
        left = 1.0 - len(self._free) / residuals.size
        found = float(np.median(np.linalg.norm(residuals, axis=1))) / (_MEDIAN_NORM * np.sqrt(left))
        return max(found, self._finest if self._seen.sigma is None else 1.0)

    def robust(self, step: Floats) -> Floats:
        """Return the robust solution."""
        every = np.ones(len(self._seen), dtype=bool)
        scale = self.scale(self.residuals(step))
        for _ in range(_ROUNDS):
            step = self._solved(step, every, scale)
            before, scale = scale, self.scale(self.residuals(step))
            if abs(scale - before) <= 0.02 * before:
                break
        return step

    def trimmed(self, step: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the least-squares solution without outliers, and which rows are inliers."""
        inliers = self._inliers(step)
        for _ in range(_ROUNDS):
            step = self._solved(step, inliers, None)
            before, inliers = inliers, self._inliers(step)
            if np.array_equal(before, inliers):
                break
        return step, inliers

    def require_told(self, step: Floats, inliers: NDArray[np.bool_]) -> None:
        """Raise `NotIdentifiable` if the inliers leave a direction unknown, or mirror an axis."""
        identify.require_enough(self._seen.chosen(inliers), self._free)
        missed = self.residuals(step)[inliers]
        scale = self.scale(missed)
        weighted = self.jacobian(step)[inliers].reshape(-1, len(self._free)) / scale
        identify.require_same_senses(self._now, self.at(step))
        names = identify.unknown(weighted, self._free)
        if names:
            joints = model.joints(self.at(step), self._seen.counts[inliers])
            scatter = float(np.median(np.abs(missed / self._seen.weights[inliers, None]))) / _MEDIAN
            raise identify.refusal(names, joints, self._seen.points[inliers], scatter)

    def conclude(self, step: Floats, inliers: NDArray[np.bool_]) -> Calibration:
        """Return the result of a solution."""
        kept = self.residuals(step)[inliers]
        freedom = kept.size - len(self._free)
        noise = float(np.sqrt(np.sum(kept * kept) / freedom))
        spread = max(noise, _LEAST_NOISE) if self._seen.sigma is None else 1.0
        rows = self.jacobian(step)[inliers].reshape(-1, len(self._free))
        covariance = spread * spread * np.linalg.inv(rows.T @ rows) * np.outer(self._units, self._units)
        missed = self.residuals(np.zeros(len(self._free)))
        weights = self._seen.weights[:, None]
        return Calibration(
            now=self._now,
            fitted=self.at(step),
            free=self._free,
            covariance=covariance,
            noise=noise,
            freedom=freedom,
            observations=self._seen,
            residuals_before=missed / weights,
            residuals_after=self.residuals(step) / weights,
            inliers=inliers,
            line_difference=self._line_difference(step, inliers, spread),
        )

    def _inliers(self, step: Floats) -> NDArray[np.bool_]:
        residuals = self.residuals(step)
        if residuals.size < 2 * len(self._free):
            return np.ones(len(residuals), dtype=bool)  # so few points cannot show which is wrong
        within = GROSS * self.scale(residuals)
        return np.sum(residuals * residuals, axis=1) <= within * within

    def _solved(self, step: Floats, rows: NDArray[np.bool_], robust_scale: float | None) -> Floats:
        from scipy.optimize import least_squares  # noqa: PLC0415 - takes half a second, and only a fit needs it

        unit = 1.0 if robust_scale is None else robust_scale

        def missed(change: Floats) -> Floats:
            return self.residuals(step + change)[rows].ravel() / unit

        def slopes(change: Floats) -> Floats:
            return self.jacobian(step + change)[rows].reshape(-1, len(self._free)) / unit

        tolerance = _EXACT if robust_scale is None else _ROUGH
        found = least_squares(
            missed,
            np.zeros(len(step)),  # the first trust region is as large as the start, or 1 if that is zero
            jac=cast("Any", slopes),
            loss="linear" if robust_scale is None else "soft_l1",
            xtol=tolerance,
            ftol=tolerance,
            gtol=tolerance,
        )
        return step + np.asarray(found.x, dtype=np.float64)

    def _line_difference(self, step: Floats, inliers: NDArray[np.bool_], spread: float) -> LineDifference | None:
        """Return the estimate of a free e, by one Gauss-Newton step; None if the points do not determine it."""
        free = (*self._free, "line_difference")
        units = identify.typical(free)
        by_constants = model.jacobian(self.at(step), self._seen.counts)[:, :, identify.columns(free)]
        weighted = (by_constants * units * self._seen.weights[:, None, None])[inliers].reshape(-1, len(free))
        if identify.unknown(weighted / spread, free):
            return None
        normal = np.linalg.inv(weighted.T @ weighted)
        move = -normal @ weighted.T @ self.residuals(step)[inliers].ravel()
        error = spread * float(np.sqrt(normal[-1, -1]))
        return LineDifference(float(move[-1] * units[-1]), error * float(units[-1]))
