"""The nearest point of a path: against many of its points, and the first of several that are equally near."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.motion.polyline import Polyline

COORDINATES = st.tuples(*[st.integers(-50, 50).map(float)] * 3)


@given(st.lists(COORDINATES, min_size=2, max_size=6), COORDINATES)
def test_no_point_of_the_path_is_nearer(
    places: list[tuple[float, float, float]], place: tuple[float, float, float]
) -> None:
    path, here = np.array(places), np.array(place)
    found = Polyline(path).nearest(here)
    start, end = path[found.chord], path[found.chord + 1]
    assert found.away == pytest.approx(here - (start + found.share * (end - start)), abs=1e-9)
    shares = np.linspace(0.0, 1.0, 101)[:, None]
    samples = np.concatenate([one + shares * (two - one) for one, two in pairwise(path)])
    assert np.linalg.norm(found.away) <= np.linalg.norm(here - samples, axis=1).min() + 1e-9


def test_of_equally_near_chords_it_is_the_first() -> None:
    there_and_back = Polyline(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 0.5]]))
    here = np.array([4.0, 0.3])
    assert there_and_back.nearest(here).chord == 1
    assert there_and_back.nearest(here, same=1.0)[:2] == (0, 0.4)
    assert there_and_back.nearest(here, slice(1, 2), same=1.0).chord == 1


def test_chord_without_length_is_a_point() -> None:
    found = Polyline(np.array([[1.0, 1.0], [1.0, 1.0]])).nearest(np.array([1.0, 3.0]))
    assert (found.chord, found.share, found.away.tolist()) == (0, 0.0, [0.0, 2.0])
