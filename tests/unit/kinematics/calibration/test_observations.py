from __future__ import annotations

import numpy as np
import pytest

from maya_un.kinematics import Floats
from maya_un.kinematics.calibration import Observations

COUNTS = np.arange(12.0).reshape(4, 3)
POINTS = COUNTS + 0.5
BAD = POINTS.copy()
BAD[1, 2] = np.nan


def test_rows_are_numbered_and_weigh_the_same_by_default() -> None:
    seen = Observations(COUNTS, POINTS)
    assert (len(seen), seen.rows) == (4, (1, 2, 3, 4))
    assert seen.weights.tolist() == [1.0] * 4


def test_sigma_weighs_rows() -> None:
    assert Observations(COUNTS, POINTS, np.array([1.0, 2.0, 4.0, 0.5])).weights.tolist() == [1.0, 0.5, 0.25, 2.0]


def test_some_rows_keep_their_names() -> None:
    seen = Observations(COUNTS, POINTS, np.array([1.0, 2.0, 3.0, 4.0]), (2, 3, 5, 8))
    some = seen.chosen(np.array([True, False, False, True]))
    assert (some.rows, some.points[1].tolist()) == ((2, 8), [9.5, 10.5, 11.5])
    assert some.sigma is not None
    assert some.sigma.tolist() == [1.0, 4.0]


def test_observations_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        Observations(COUNTS.copy(), POINTS.copy()).points[0, 0] = 1.0


@pytest.mark.parametrize(
    ("counts", "points", "sigma", "rows"),
    [
        (COUNTS[:3], POINTS, None, ()),
        (COUNTS[:, :2], POINTS, None, ()),
        (COUNTS, BAD, None, ()),
        (COUNTS, POINTS, np.ones(3), ()),
        (COUNTS, POINTS, np.array([1.0, 1.0, 0.0, 1.0]), ()),
        (COUNTS, POINTS, np.array([1.0, 1.0, np.nan, 1.0]), ()),
        (COUNTS, POINTS, None, (1, 2)),
    ],
    ids=["one count less", "two axes", "nan", "one sigma less", "sigma zero", "sigma nan", "names lack"],
)
def test_inconsistent_values_are_refused(
    counts: Floats, points: Floats, sigma: Floats | None, rows: tuple[int, ...]
) -> None:
    with pytest.raises(ValueError, match=r"shape|finite|positive|name"):
        Observations(counts.copy(), points.copy(), None if sigma is None else sigma.copy(), rows)
