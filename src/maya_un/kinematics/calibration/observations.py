"""Measurements: raw counts, and the true position of the gripper point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.mechanism import Floats


@dataclass(frozen=True, slots=True)
class Observations:
    """Measured points.

    `counts` of a, b, c, shape (n, 3), as the controller counts them after a homing with the present configuration;
    `points` x, y, z [m], shape (n, 3); `sigma`, shape (n,), is the standard deviation of each coordinate of a row [m],
    None where it is not known; `rows` names each one to people (its line in a file), 1, 2, ... where nothing is said.
    Raises `ValueError` for other shapes, for numbers that are not finite and for a sigma that is not positive.
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
        """1 / sigma of each row [1/m], shape (n,); 1 where sigma is not known."""
        return np.ones(len(self.counts)) if self.sigma is None else 1.0 / self.sigma

    def chosen(self, rows: NDArray[np.bool_]) -> Observations:
        """Return the observations of some rows only, those where the mask of shape (n,) is True."""
        sigma = None if self.sigma is None else self.sigma[rows].copy()
        names = tuple(int(row) for row in np.array(self.rows)[rows])
        return Observations(self.counts[rows].copy(), self.points[rows].copy(), sigma, names)
