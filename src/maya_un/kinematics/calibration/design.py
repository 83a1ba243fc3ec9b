"""The poses at which to measure: those with the most information about the constants, in an order with short travel.

A point measured at a pose with Jacobian J adds JᵀJ to the information M about the constants (scaled as in `identify`).
D-optimal poses maximise det M, that is they minimise the volume of the remaining uncertainty. They are taken one after
the other from a grid, each the best in addition to those before, then exchanged while that helps (Fedorov). One more
pose gains det(I + J M⁻¹ Jᵀ), a determinant of 3 × 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np

from maya_un.config import Config, Units
from maya_un.kinematics.calibration import identify, model
from maya_un.kinematics.calibration.parameters import FittedConstants
from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints

BOOM_MARGIN = 0.03
"""Distance of poses from the ends of axis a [rad] ..."""

LINE_MARGIN = 0.02
"""... from the ends of the lines' strokes and from slack lines [m] ..."""

LOWEST = 0.25
"""... above this height [m], where only fixtures stand on the table ..."""

TENSION_SHARE = 0.7
"""... and below this share of the tension limit."""

NOISE = 1e-3
"""Assumed noise of a measured coordinate [m]; it only weighs points against plausible errors."""

SAME = 1e-3
"""Poses this near to each other in every joint are the same (rad, m)."""

_GRID = (9, 17, 15)
_ROUNDS = 10
_GAIN = 1e-6


def grid(config: Config) -> Floats:
    """Return the candidate poses, shape (n, 3) [rad, m, m]: distributed over the workspace, away from every limit.

    The result is empty if the margins leave no pose.
    """
    workspace = Workspace.of(config)
    mechanism = workspace.mechanism
    boom = np.linspace(workspace.boom[0] + BOOM_MARGIN, workspace.boom[1] - BOOM_MARGIN, _GRID[0])
    out = np.linspace(mechanism.delta + LINE_MARGIN, mechanism.length - LINE_MARGIN, _GRID[1])
    heights = np.linspace(LOWEST, mechanism.reach_down, _GRID[2], endpoint=False)
    places = np.array([(d * np.sin(a), d * np.cos(a), z) for a, d, z in product(boom, out, heights)])
    poses = mechanism.ik_many(places)
    return poses[[_is_safe(workspace, Joints(*map(float, pose))) for pose in poses]]


def apart(poses: Floats, others: Floats) -> Floats:
    """Return the poses, shape (n, 3), that are none of the `others`, shape (m, 3), apart from rounding to counts."""
    nearest = np.abs(poses[:, None, :] - others[None, :, :]).max(axis=2).min(axis=1, initial=np.inf)
    return poses[nearest > SAME]


def _is_safe(workspace: Workspace, pose: Joints) -> bool:
    if not workspace.contains(pose):
        return False
    margins = workspace.margins(pose)
    spare = (1.0 - TENSION_SHARE) * workspace.tension_limit
    return (
        min(margins.line_b, margins.line_c, margins.inner, margins.outer) >= LINE_MARGIN
        and margins.boom >= 0.5 * BOOM_MARGIN
        and min(margins.tension_b, margins.tension_c) >= spare
    )


def information(config: Config, poses: Floats, free: Sequence[str]) -> Floats:
    """Return the information of each pose of shape (n, 3) about the constants `free`: J, shape (n, 3, p).

    It is in plausible errors of the constants per standard deviation of a measured coordinate.
    """
    counts = poses * np.array(Units.of(config).per_unit)
    slopes = model.jacobian(FittedConstants.of(config), counts)[:, :, identify.columns(free)]
    return slopes * identify.typical(free) / NOISE


def log_determinant(rows: Floats) -> float:
    """Return log det Σ JᵀJ of poses, J of shape (n, 3, p); −inf if they leave a direction unknown."""
    flat = rows.reshape(-1, rows.shape[2])
    sign, value = np.linalg.slogdet(flat.T @ flat)
    return float(value) if sign > 0 else -np.inf


def chosen(rows: Floats, count: int, known: Floats) -> list[int]:
    """Return the indices of the `count` candidates with the most information in addition to the known points.

    `rows` holds J of the candidates, shape (n, 3, p), `known` that of points already measured, shape (m, 3, p). No
    candidate is taken twice, because a separate place also shows errors that no constant describes.
    """
    flat = known.reshape(-1, rows.shape[2])
    # A thousandth of the plausible errors' own information makes the first choice possible.
    matrix = flat.T @ flat + 1e-3 * np.eye(rows.shape[2])
    taken: list[int] = []
    for _ in range(min(count, len(rows))):
        best = int(np.argmax(_gains(rows, matrix, taken)))
        taken.append(best)
        matrix += rows[best].T @ rows[best]
    for _ in range(_ROUNDS):
        if not _exchange(rows, matrix, taken):
            break
    return taken


def _gains(rows: Floats, matrix: Floats, taken: Sequence[int]) -> Floats:
    """Return log det(I + J M⁻¹ Jᵀ) of each candidate, −inf for those taken."""
    cross = rows @ np.linalg.inv(matrix) @ np.swapaxes(rows, 1, 2)
    gains = np.linalg.slogdet(np.eye(3) + cross)[1]
    gains[list(taken)] = -np.inf
    return gains


def _exchange(rows: Floats, matrix: Floats, taken: list[int]) -> bool:
    """Replace each chosen candidate by a better one, if any; return whether one was replaced. Changes `matrix`."""
    changed = False
    for place, old in enumerate(taken):
        matrix -= rows[old].T @ rows[old]
        others = [*taken[:place], *taken[place + 1 :]]
        gains = _gains(rows, matrix, others)
        best = int(np.argmax(gains))
        if gains[best] <= gains[old] + _GAIN:
            best = old
        changed |= best != old
        taken[place] = best
        matrix += rows[best].T @ rows[best]
    return changed


def travel_time(config: Config, poses: Floats) -> Floats:
    """Return the time of the slowest axis between any two poses at its full speed [s], shape (n, n)."""
    speeds = [config.axes[axis].speed_counts / per for axis, per in enumerate(Units.of(config).per_unit)]
    return np.max(np.abs(poses[:, None, :] - poses[None, :, :]) / np.array(speeds), axis=2)


def ordered(config: Config, poses: Floats, start: Joints) -> list[int]:
    """Return an order of poses of shape (n, 3) with a short travel time from `start`.

    It takes the nearest pose next, then reverses pieces of the order while that makes it shorter (2-opt).
    """
    times = travel_time(config, np.vstack([np.array(start), poses]))
    way, left = [0], set(range(1, len(times)))
    while left:
        way.append(min(left, key=lambda pose: (float(times[way[-1], pose]), pose)))
        left.remove(way[-1])
    while (better := _turned(way, times)) is not None:
        way = better
    return [pose - 1 for pose in way[1:]]


def _turned(way: list[int], times: Floats) -> list[int] | None:
    """Return a shorter order with one piece reversed, None without one."""
    for first in range(1, len(way) - 1):
        for last in range(first + 1, len(way)):
            candidate = way[:first] + way[first : last + 1][::-1] + way[last + 1 :]
            if _length(candidate, times) < _length(way, times) - 1e-9:
                return candidate
    return None


def _length(way: Sequence[int], times: Floats) -> float:
    return float(sum(times[here, there] for here, there in pairwise(way)))
