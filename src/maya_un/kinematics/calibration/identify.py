"""Identifiability of the constants from points: the null directions of the weighted Jacobian.

The Jacobian is scaled so that a step of 1 in every constant is a plausible error of it (`parameters.TYPICAL`), and
weighted by the noise. A singular value s then means that the constants are known along its direction to 1/s plausible
errors. The points do not determine a direction that is known worse than `UNKNOWN`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

import numpy as np

from dmc41x3.i18n import phrase
from maya_un.errors import NotIdentifiable
from maya_un.kinematics.calibration.parameters import FITTED, TYPICAL, FittedConstants, Observations, listed
from maya_un.kinematics.mechanism import Floats

UNKNOWN = 10.0
"""A direction known no better than to this many plausible errors (100 mm, 10 %, 10°) counts as unknown."""

FAR = 0.03
"""Points that are farther off than this after a fit [m] are not explained by it."""

SUSPECTS = phrase(
    "check that the coordinates are in Maya's frame (z up, angle a clockwise from y to x) and that each "
    "row has the counts of its point"
)
"""The most likely error in points that no constants explain."""

_SINGULAR = 1e-9
"""Singular values below this share of the largest count as zero, because of rounding."""

_PART = 0.2
"""A constant belongs to a null direction from this share of its largest member on."""

LEAST_FREEDOM = 3
"""Number of coordinates needed beyond the number of constants, to estimate the noise."""


def typical(free: Sequence[str]) -> Floats:
    """Return the plausible errors of the constants `free`, shape (p,)."""
    return np.array([getattr(TYPICAL, name) for name in free])


def columns(free: Sequence[str]) -> list[int]:
    """Return the indices of the constants `free` among all."""
    return [FittedConstants._fields.index(name) for name in free]


def unknown(weighted: Floats, free: Sequence[str]) -> tuple[str, ...]:
    """Return the constants that a scaled and weighted Jacobian of shape (m, p) does not determine.

    They are those that belong to a null direction; empty if all are determined.
    """
    _, singular, directions = np.linalg.svd(weighted, full_matrices=True)
    known = np.zeros(len(free))
    known[: len(singular)] = singular
    null = directions[known < max(1.0 / UNKNOWN, _SINGULAR * float(known.max(initial=0.0)))]
    share = np.sqrt(np.sum(null * null, axis=0))
    return tuple(name for name, part in zip(free, share, strict=True) if part > _PART * float(share.max(initial=0.0)))


def require_enough(observations: Observations, free: Sequence[str]) -> None:
    """Raise `NotIdentifiable` if there are too few points for the `free` constants and the noise."""
    needed = -(-(len(free) + LEAST_FREEDOM) // 3)
    if len(observations) < needed:
        reason = phrase(
            "{points} points are too few for {constants} constants", points=len(observations), constants=len(free)
        )
        raise NotIdentifiable(
            what=listed(free), reason=reason, remedy=phrase("measure at least {needed}, better 20", needed=needed)
        )


def require_same_senses(now: FittedConstants, fitted: FittedConstants) -> None:
    """Raise `NotIdentifiable` if an axis of the fit counts in reverse: such a machine fits a mirrored frame."""
    turned = [
        name
        for name, before, after in zip(FITTED, now, fitted, strict=False)
        if name.startswith("pulses") and before * after <= 0.0
    ]
    if turned:
        reason = phrase("they fit only a machine whose axis counts in the opposite direction")
        raise NotIdentifiable(what=listed(turned), reason=reason, remedy=SUSPECTS)


def refusal(names: Sequence[str], joints: Floats, points: Floats, scatter: float) -> NotIdentifiable:
    """Return the error for points that do not determine `names`.

    `joints` (rad, m, m) and `points` [m], each of shape (n, 3), show what is missing; if the points lie farther than
    `FAR` from the fit, by `scatter` [m], that is the reason.
    """
    if scatter > FAR:
        reason = phrase("even with the best constants they are {distance:.0f} mm off", distance=scatter * 1000.0)
        return NotIdentifiable(what=listed(names), reason=reason, remedy=SUSPECTS)
    if len(names) == 1:
        reason = phrase("the points do not show it")
    else:
        reason = phrase("a common change of them does not move the gripper at any of these points")
    lacking = _lacking(joints, points)
    remedy = phrase(
        "measure at {lacking}, or hold what you know from another measurement (--hold {names})",
        lacking=lacking,
        names=_likeliest(names),
    )
    return NotIdentifiable(what=listed(names), reason=reason, remedy=remedy)


def _likeliest(names: Sequence[str]) -> str:
    """Return the constant to hold: a zero before a length, a length before a scale."""
    return max(names, key=lambda name: FITTED.index(name) if name.startswith("zero") else -FITTED.index(name))


def _lacking(joints: Floats, points: Floats) -> str:
    """Return in words which variety the points lack."""
    distance = np.hypot(points[:, 0], points[:, 1])
    lacks = [
        words
        for spread, least, words in (
            (degrees(float(np.ptp(joints[:, 0]))), 20.0, phrase("angles of the boom farther apart")),
            (float(np.ptp(distance)), 0.3, phrase("distances from the axis farther apart")),
            (float(np.ptp(points[:, 2])), 0.3, phrase("heights farther apart")),
        )
        if spread < least
    ]
    return " and ".join(lacks) or phrase("more places all over the workspace")
